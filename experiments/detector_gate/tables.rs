//! What was found, as tables.

use super::judged::{Judged, clopper_pearson};
use super::{DRAWN, PHOTOS, Seen, shows_board};
use calibench_detector_gate::protocol::Kind;
use calibench_detector_gate::{Scene, scenes as all_scenes};
use calibench_harness::{Cell, Table};

fn of_kind(kind: Kind) -> Vec<Scene> {
    all_scenes().into_iter().filter(|scene| scene.kind == kind && shows_board(scene)).collect()
}

fn told(value: Option<f64>) -> Cell {
    value.map_or(Cell::from("-"), Cell::from)
}

/// A scene a row, found, error over the bound and worst mark of each program in its columns.
fn beside(name: &str, kind: Kind, seen: &[&Seen]) -> Table {
    let label = |one: &Seen| one.program.name.replace('-', "_");
    let of = |what: &str| seen.iter().map(|one| format!("{what}_{}", label(one))).collect::<Vec<_>>();
    let columns: Vec<(String, &str)> = [("scene".to_string(), "")]
        .into_iter()
        .chain(of("found").into_iter().map(|name| (name, "")))
        .chain(of("rms").into_iter().map(|name| (name, "px")))
        .chain(of("over_bound").into_iter().map(|name| (name, "")))
        .chain(of("worst").into_iter().map(|name| (name, "px")))
        .collect();
    let columns: Vec<(&str, &str)> = columns.iter().map(|(name, unit)| (name.as_str(), *unit)).collect();
    let caption = format!(
        "{}: boards found of {PHOTOS}, root mean squared error of a coordinate, the same over that of the bound, and the largest distance of a mark from \
         its place, of boards whose marks are at their places",
        heading(kind)
    );
    let mut table = Table::new(name, caption, &columns);
    for scene in of_kind(kind) {
        let judged: Vec<Judged<'_>> = seen.iter().map(|one| one.in_scene(scene)).collect();
        let mut row: Vec<Cell> = vec![scene.id.into()];
        row.extend(judged.iter().map(|j| Cell::from(j.boards())));
        row.extend(judged.iter().map(|j| told(j.rms_px(DRAWN).map(|rms| rms.value))));
        row.extend(judged.iter().map(|j| told(j.over_bound(DRAWN).map(|over| over.value))));
        row.extend(judged.iter().map(|j| told(j.worst_px())));
        table.push(row);
    }
    table
}

/// Each kind of board, of the programs that know it.
pub fn each_kind(seen: &[Seen]) -> Vec<Table> {
    let of = |kind: Kind| {
        let known: Vec<&Seen> = seen.iter().filter(|one| one.program.knows(kind)).collect();
        beside(table_name(kind), kind, &known)
    };
    Kind::ALL.map(of).into()
}

fn table_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Chessboard => "chessboards",
        Kind::Circles => "discs",
        Kind::Asymmetric => "asymmetric-grids",
        Kind::Hexagonal => "hexagonal-grids",
        Kind::Charuco => "charuco-boards",
        Kind::AprilGrid => "april-grids",
    }
}

/// A kind of board, for readers.
pub fn heading(kind: Kind) -> &'static str {
    match kind {
        Kind::Chessboard => "Chessboards",
        Kind::Circles => "Discs in rows and columns",
        Kind::Asymmetric => "Discs in staggered rows (asymmetric)",
        Kind::Hexagonal => "Discs in staggered rows (hexagonal)",
        Kind::Charuco => "ChArUco boards",
        Kind::AprilGrid => "Grids of AprilTags",
    }
}

/// Boards that are not there, a program and scene a row.
pub fn invented(seen: &[Seen]) -> Table {
    let columns =
        [("program", ""), ("board", ""), ("scene", ""), ("photographs", ""), ("found", ""), ("at_most", "%")];
    let caption = "Photographs without the board that is asked for: boards found nevertheless, and the most that their share can be (95 %, \
                   Clopper and Pearson)";
    let mut table = Table::new("invented", caption, &columns);
    for one in seen {
        for judged in one.without_board() {
            let most = clopper_pearson(judged.boards(), judged.photos(), DRAWN).high;
            table.push::<Cell>([
                one.program.name.into(),
                judged.scene.kind.name().into(),
                judged.scene.id.into(),
                judged.photos().into(),
                judged.boards().into(),
                (100.0 * most).into(),
            ]);
        }
    }
    table
}

/// Everything, a program and scene a row.
pub fn scenes(seen: &[Seen]) -> Table {
    let columns = [
        ("program", ""),
        ("board", ""),
        ("scene", ""),
        ("what", ""),
        ("photographs", ""),
        ("found", ""),
        ("share_low", "%"),
        ("share_high", "%"),
        ("wrong", ""),
        ("mirrored", ""),
        ("marks_missing", ""),
        ("broken", ""),
        ("rms", "px"),
        ("rms_low", "px"),
        ("rms_high", "px"),
        ("over_bound", ""),
        ("over_low", ""),
        ("over_high", ""),
        ("over_median", ""),
        ("worst", "px"),
    ];
    let caption = "Every program and scene that shows the board: boards found with the interval of their share (95 %, Clopper and Pearson), boards with a \
                   mark at another's place, boards numbered as in a mirror, marks not seen, broken answers; of the other boards the root mean squared \
                   error of a coordinate, the same over that of the bound (95 %, independent photographs), the median of a photograph's, and the \
                   largest distance of a mark from its place";
    let mut table = Table::new("scenes", caption, &columns);
    for one in seen {
        for judged in one.with_board() {
            let share = judged.share(DRAWN).interval;
            let (rms, over) = (judged.rms_px(DRAWN), judged.over_bound(DRAWN));
            table.push::<Cell>([
                one.program.name.into(),
                judged.scene.kind.name().into(),
                judged.scene.id.into(),
                judged.scene.about.into(),
                judged.photos().into(),
                judged.boards().into(),
                (100.0 * share.low).into(),
                (100.0 * share.high).into(),
                judged.wrong().into(),
                judged.mirrored().into(),
                judged.missing().into(),
                judged.broken().into(),
                told(rms.map(|rms| rms.value)),
                told(rms.map(|rms| rms.interval.low)),
                told(rms.map(|rms| rms.interval.high)),
                told(over.map(|over| over.value)),
                told(over.map(|over| over.interval.low)),
                told(over.map(|over| over.interval.high)),
                told(judged.over_bound_median()),
                told(judged.worst_px()),
            ]);
        }
    }
    table
}

/// How each was asked.
pub fn fairness(seen: &[Seen]) -> Table {
    let versions = |one: &Seen| {
        let head = one.committed.lines().next().unwrap_or_default();
        head.split("; ").find_map(|part| part.strip_prefix("versions ")).unwrap_or("-").to_string()
    };
    let mut rows: Vec<[String; 5]> = Vec::new();
    for one in seen {
        for (kind, finder) in Kind::ALL.into_iter().zip(one.program.finders) {
            let Some(finder) = finder else { continue };
            let (name, note) = (one.program.name.to_string(), one.program.note.to_string());
            rows.push([name, versions(one), heading(kind).to_string(), finder.to_string(), note]);
        }
    }
    Table::of_arrays(
        "fairness",
        "What was asked for which boards, and what is fair to say of each program",
        [("program", ""), ("versions", ""), ("boards", ""), ("finder", ""), ("fairness", "")],
        &rows,
    )
}
