//! Errors over the bound with the boards found, scene by scene; and what the scenes look like.

use super::judged::{Judged, Measured};
use super::tables::heading;
use super::{DRAWN, PHOTOS, SEED, Seen, shows_board};
use calibench::raster::Raster;
use calibench_detector_gate::protocol::Kind;
use calibench_detector_gate::{Scene, scenes};
use calibench_harness::{Align, Dash, Drawing, ExperimentError, Figure, Look, stats};
use rayon::prelude::*;

/// Widths of the scenes' names, of a panel's axis and of a column of counts, and the gap between the panels,
/// px.
const NAMES: f64 = 112.0;
const AXIS: f64 = 236.0;
const COUNT: f64 = 42.0;
const GAP: f64 = 26.0;
/// Height of a scene's row, and where the first begins.
const ROW: f64 = 27.0;
const TOP: f64 = 88.0;
/// Ticks of the axis.
const TICKS: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// Half of a panel: one kind of board.
struct Panel<'a> {
    kind: Kind,
    heading: &'static str,
    left: f64,
    /// Programs with their place in the legend.
    seen: Vec<(usize, &'a Seen)>,
    /// Ends of the axis.
    range: (f64, f64),
}

impl Panel<'_> {
    fn x(&self, over: f64) -> f64 {
        let (low, high) = self.range;
        self.left + AXIS * libm::log(over / low) / libm::log(high / low)
    }

    fn count_at(&self, column: usize) -> f64 {
        self.left + AXIS + COUNT * (column as f64 + 0.6)
    }

    fn right(&self) -> f64 {
        self.left + AXIS + COUNT * self.seen.len() as f64 + 8.0
    }

    fn judged(&self, column: usize, id: &str) -> Option<Judged<'_>> {
        let is_it = |scene: &Scene| scene.kind == self.kind && scene.id == id;
        let scene = scenes().into_iter().find(is_it)?;
        Some(self.seen[column].1.in_scene(scene))
    }
}

fn look(program: usize) -> Look {
    Look::series(program).dash(Dash::Solid).size(4.4)
}

/// Names of the scenes that show a board.
fn rows() -> Vec<&'static str> {
    let of_one = |scene: &Scene| scene.kind == Kind::Chessboard && shows_board(scene);
    scenes().iter().filter(|scene| of_one(scene)).map(|scene| scene.id).collect()
}

/// Errors over the bound, and boards found, of every scene and program: two kinds of boards a figure.
pub fn errors(seen: &[Seen]) -> Vec<Figure> {
    let ours = |kind: Kind, id: &str| {
        let judged = seen[0].with_board().into_iter().find(|j| j.scene.kind == kind && j.scene.id == id);
        judged.and_then(|j| j.over_bound(DRAWN)).map_or(f64::NAN, |over| over.value)
    };
    let of_blur = |kind: Kind| {
        let [blurred, very, moved] = ["blurred", "very-blurred", "moved"].map(|id| ours(kind, id));
        format!(
            "{blurred:.1} times in blurred photographs, {very:.1} in very blurred ones and {moved:.1} in moved ones"
        )
    };
    let [discs, asymmetric, hexagonal] = [Kind::Circles, Kind::Asymmetric, Kind::Hexagonal].map(of_blur);
    let [sharp, tags] = [Kind::Charuco, Kind::AprilGrid].map(|kind| ours(kind, "clean"));
    vec![
        of_kinds(
            "errors",
            [Kind::Chessboard, Kind::Circles],
            seen,
            &format!(
                "how far discs are from it where blur is wider than their edge: {discs}, for this library's"
            ),
        ),
        of_kinds(
            "errors-of-staggered-discs",
            [Kind::Asymmetric, Kind::Hexagonal],
            seen,
            &format!(
                "the same where blur is wide: {asymmetric} on asymmetric grids, {hexagonal} on hexagonal ones, for this library's"
            ),
        ),
        of_kinds(
            "errors-of-coded-boards",
            [Kind::Charuco, Kind::AprilGrid],
            seen,
            &format!("clean photographs: {sharp:.2} and {tags:.2} times the bound, for this library's"),
        ),
    ]
}

fn of_kinds(name: &'static str, kinds: [Kind; 2], seen: &[Seen], notice: &str) -> Figure {
    let rows = rows();
    let bounds: Vec<Measured> = seen
        .iter()
        .flat_map(Seen::with_board)
        .filter(|judged| kinds.contains(&judged.scene.kind))
        .filter_map(|judged| judged.over_bound(DRAWN))
        .collect();
    let least = stats::smallest(bounds.iter().map(|over| over.interval.low));
    let most = stats::largest(bounds.iter().map(|over| over.interval.high));
    let range = (0.9 * least.min(1.0), 1.1 * most.max(2.0));
    let known = |kind: Kind| seen.iter().enumerate().filter(|(_, one)| one.program.knows(kind)).collect();
    let panel =
        |kind: Kind, left: f64| Panel { kind, heading: heading(kind), left, seen: known(kind), range };
    let first = panel(kinds[0], NAMES);
    let second = panel(kinds[1], first.right() + GAP);
    let bottom = TOP + ROW * rows.len() as f64;
    let mut sheet = Drawing::new(second.right() + 6.0, bottom + 48.0);
    for k in (0..rows.len()).step_by(2) {
        let (upper, lower) = (TOP + ROW * k as f64, TOP + ROW * (k + 1) as f64);
        let corners = [(4.0, upper), (second.right(), upper), (second.right(), lower), (4.0, lower)];
        sheet = sheet.area(corners, Look::ink(), 0.05);
    }
    for (k, name) in rows.iter().enumerate() {
        sheet = sheet.words(*name, (NAMES - 12.0, TOP + ROW * (k as f64 + 0.5)), Align::End);
    }
    sheet = legend(sheet, [&first, &second], seen);
    for panel in [&first, &second] {
        sheet = axis(sheet, panel, bottom);
        for (k, name) in rows.iter().enumerate() {
            sheet = scene(sheet, panel, name, TOP + ROW * (k as f64 + 0.5));
        }
    }
    let caption = format!(
        "Root mean squared error of the marks over that of the Cramer-Rao bound, scene by scene: a point a program, with its interval (95 %, independent \
         photographs); beside it the boards found of {PHOTOS}, seed {SEED}. Where a codec stands between there is no bound. Notice {notice}."
    );
    Figure::drawing(name, &sheet, caption)
}

/// The programs of either panel, and what finds the marks for each.
fn legend(sheet: Drawing, panels: [&Panel<'_>; 2], seen: &[Seen]) -> Drawing {
    let mut at = NAMES;
    let is_shown = |k: &usize| panels.iter().any(|panel| panel.seen.iter().any(|(other, _)| other == k));
    (0..seen.len()).filter(is_shown).fold(sheet, |sheet, k| {
        let program = seen[k].program;
        let mut finders: Vec<&str> =
            panels.iter().filter_map(|panel| program.finders[panel.kind as usize]).collect();
        finders.dedup();
        let text = match program.method {
            None => program.name.to_string(),
            Some(_) => finders.join("; "),
        };
        let place = (at, 16.0);
        at += 34.0 + 6.6 * text.len() as f64;
        sheet.mark(place, look(k)).words(text, (place.0 + 10.0, place.1), Align::Start)
    })
}

fn axis(sheet: Drawing, panel: &Panel<'_>, bottom: f64) -> Drawing {
    let middle = panel.left + 0.5 * AXIS;
    let mut sheet = sheet
        .heading(panel.heading, (middle, 42.0), Align::Middle)
        .words("found", (panel.count_at(0) - 0.4 * COUNT, 54.0), Align::Start)
        .words("error / bound", (middle, bottom + 34.0), Align::Middle);
    let (low, high) = panel.range;
    for tick in TICKS.into_iter().filter(|tick| (low..=high).contains(tick)) {
        let line = match tick {
            1.0 => Look::ink(),
            _ => Look::ink().width(0.5).dash(Dash::Dotted),
        };
        sheet = sheet.line([(panel.x(tick), TOP), (panel.x(tick), bottom)], line).words(
            format!("{tick}"),
            (panel.x(tick), bottom + 14.0),
            Align::Middle,
        );
    }
    for (column, (k, _)) in panel.seen.iter().enumerate() {
        sheet = sheet.mark((panel.count_at(column), TOP - 14.0), look(*k));
    }
    sheet
}

/// A scene in a panel: errors of every program below each other, and the boards that it found.
fn scene(sheet: Drawing, panel: &Panel<'_>, id: &str, middle: f64) -> Drawing {
    let programs = panel.seen.len();
    let mut sheet = sheet;
    let mut is_bounded = false;
    for (column, (k, _)) in panel.seen.iter().enumerate() {
        let Some(judged) = panel.judged(column, id) else { continue };
        let count = judged.boards().to_string();
        sheet = sheet.words(count, (panel.count_at(column), middle), Align::Middle);
        let Some(over) = judged.over_bound(DRAWN) else { continue };
        is_bounded = true;
        let y = middle + 7.5 * (column as f64 - 0.5 * (programs as f64 - 1.0));
        let end = |value: f64| (panel.x(value.max(panel.range.0)), y);
        sheet = sheet
            .line([end(over.interval.low), end(over.interval.high)], look(*k))
            .mark((panel.x(over.value), y), look(*k));
    }
    if is_bounded { sheet } else { sheet.words("no bound", (panel.left + 0.5 * AXIS, middle), Align::Middle) }
}

/// Part of a photograph that is shown, and its size when it is: half as many pixels each way.
const PART: (usize, usize) = (400, 300);
const TILE: (usize, usize) = (PART.0 / 2, PART.1 / 2);
const COLUMNS: usize = 4;
const BETWEEN: usize = 4;

/// The middle of a photograph of every scene.
pub fn photographs() -> Result<Figure, ExperimentError> {
    let ids = rows();
    let kind = |k: usize| Kind::ALL[k % Kind::ALL.len()];
    let tile = |(k, &id): (usize, &&str)| {
        let scene = scenes().into_iter().find(|scene| scene.kind == kind(k) && scene.id == id)?;
        Some(scene.look.photo(&scene.board(), SEED, &scene.name(), 0)?.image)
    };
    let tiles: Option<Vec<Raster<u8>>> = ids.par_iter().enumerate().map(tile).collect();
    let tiles = tiles.ok_or("no pose fits").map_err(ExperimentError::at("the figure of scenes"))?;
    let lines = ids.len().div_ceil(COLUMNS);
    let (width, height) = (COLUMNS * (TILE.0 + BETWEEN) - BETWEEN, lines * (TILE.1 + BETWEEN) - BETWEEN);
    let sheet = Raster::from_fn(width, height, |x, y| {
        let (column, line) = (x / (TILE.0 + BETWEEN), y / (TILE.1 + BETWEEN));
        let (u, v) = (x % (TILE.0 + BETWEEN), y % (TILE.1 + BETWEEN));
        match tiles.get(line * COLUMNS + column) {
            Some(photo) if u < TILE.0 && v < TILE.1 => mean_of_four(photo, u, v),
            _ => u8::MAX,
        }
    });
    let names: Vec<String> = ids.chunks(COLUMNS).map(|names| names.join(", ")).collect();
    let caption = format!(
        "The middle of the first photograph of every scene, at half its size, the kinds of boards in turn. Row by row: {}. Seed {SEED}. Notice \
         those of little contrast.",
        names.join("; ")
    );
    Ok(Figure::photo("photographs", &sheet, caption))
}

/// A pixel of the part that is shown.
fn mean_of_four(photo: &Raster<u8>, u: usize, v: usize) -> u8 {
    let (left, top) = ((photo.width() - PART.0) / 2 + 2 * u, (photo.height() - PART.1) / 2 + 2 * v);
    let level = |dx: usize, dy: usize| u16::from(photo.get(left + dx, top + dy));
    ((level(0, 0) + level(1, 0) + level(0, 1) + level(1, 1) + 2) / 4) as u8
}
