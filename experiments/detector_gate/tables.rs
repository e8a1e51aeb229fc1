//! What was found, as tables.

use super::judged::{Judged, Measured, clopper_pearson};
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
    let named = |what: &'static str| {
        seen.iter().map(move |one| format!("{what}_{}", one.program.name.replace('-', "_")))
    };
    let caption = format!(
        "{}: boards found of {PHOTOS}, root mean squared error of a coordinate, the same over that of the bound, and the largest distance of a mark from \
         its place, of boards whose marks are at their places",
        heading(kind)
    );
    let rows = of_kind(kind).into_iter().map(|scene| {
        let judged: Vec<Judged<'_>> = seen.iter().map(|one| one.in_scene(scene)).collect();
        (scene.id, judged)
    });
    let each = |judged: &[Judged<'_>], cell: &dyn Fn(&Judged<'_>) -> Cell| {
        judged.iter().map(cell).collect::<Vec<_>>()
    };
    Table::of(name, caption, rows)
        .column("scene", "", |(scene, _)| *scene)
        .columns(named("found"), "", |(_, judged)| each(judged, &|j| j.boards().into()))
        .columns(named("rms"), "px", |(_, judged)| {
            each(judged, &|j| told(j.rms_px(DRAWN).map(|rms| rms.value)))
        })
        .columns(named("over_bound"), "", |(_, judged)| {
            each(judged, &|j| told(j.over_bound(DRAWN).map(|over| over.value)))
        })
        .columns(named("worst"), "px", |(_, judged)| each(judged, &|j| told(j.worst_px())))
        .into()
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
    let caption = "Photographs without the board that is asked for: boards found nevertheless, and the most that their share can be (95 %, \
                   Clopper and Pearson)";
    let rows = seen.iter().flat_map(|one| one.without_board().into_iter().map(move |judged| (one, judged)));
    Table::of("invented", caption, rows)
        .column("program", "", |(one, _)| one.program.name)
        .column("board", "", |(_, judged)| judged.scene.kind.name())
        .column("scene", "", |(_, judged)| judged.scene.id)
        .column("photographs", "", |(_, judged)| judged.photos())
        .column("found", "", |(_, judged)| judged.boards())
        .column("at_most", "%", |(_, judged)| {
            100.0 * clopper_pearson(judged.boards(), judged.photos(), DRAWN).high
        })
        .into()
}

/// Everything, a program and scene a row.
pub fn scenes(seen: &[Seen]) -> Table {
    let caption = "Every program and scene that shows the board: boards found with the interval of their share (95 %, Clopper and Pearson), boards with a \
                   mark at another's place, boards numbered as in a mirror, marks not seen, broken answers; of the other boards the root mean squared \
                   error of a coordinate, the same over that of the bound (95 %, independent photographs), the median of a photograph's, and the \
                   largest distance of a mark from its place";
    let rows = seen.iter().flat_map(|one| one.with_board().into_iter().map(move |judged| (one, judged)));
    let with_interval = |measured: Option<Measured>| match measured {
        Some(m) => [m.value, m.interval.low, m.interval.high].map(Cell::from),
        None => ["-", "-", "-"].map(Cell::from),
    };
    Table::of("scenes", caption, rows)
        .column("program", "", |(one, _)| one.program.name)
        .column("board", "", |(_, judged)| judged.scene.kind.name())
        .column("scene", "", |(_, judged)| judged.scene.id)
        .column("what", "", |(_, judged)| judged.scene.about)
        .column("photographs", "", |(_, judged)| judged.photos())
        .column("found", "", |(_, judged)| judged.boards())
        .column("share_low", "%", |(_, judged)| 100.0 * judged.share(DRAWN).interval.low)
        .column("share_high", "%", |(_, judged)| 100.0 * judged.share(DRAWN).interval.high)
        .column("wrong", "", |(_, judged)| judged.wrong())
        .column("mirrored", "", |(_, judged)| judged.mirrored())
        .column("marks_missing", "", |(_, judged)| judged.missing())
        .column("broken", "", |(_, judged)| judged.broken())
        .columns(["rms", "rms_low", "rms_high"], "px", |(_, judged)| with_interval(judged.rms_px(DRAWN)))
        .columns(["over_bound", "over_low", "over_high"], "", |(_, judged)| {
            with_interval(judged.over_bound(DRAWN))
        })
        .column("over_median", "", |(_, judged)| told(judged.over_bound_median()))
        .column("worst", "px", |(_, judged)| told(judged.worst_px()))
        .into()
}

/// How each was asked.
pub fn fairness(seen: &[Seen]) -> Table {
    let versions = |one: &Seen| {
        let head = one.committed.lines().next().unwrap_or_default();
        head.split("; ").find_map(|part| part.strip_prefix("versions ")).unwrap_or("-").to_string()
    };
    let rows = seen.iter().flat_map(|one| {
        let finders = Kind::ALL.into_iter().zip(one.program.finders);
        finders.filter_map(move |(kind, finder)| Some((one, kind, finder?)))
    });
    let caption = "What was asked for which boards, and what is fair to say of each program";
    Table::of("fairness", caption, rows)
        .column("program", "", |(one, ..)| one.program.name)
        .column("versions", "", |(one, ..)| versions(one))
        .column("boards", "", |(_, kind, _)| heading(*kind))
        .column("finder", "", |(.., finder)| *finder)
        .column("fairness", "", |(one, ..)| one.program.note)
        .into()
}
