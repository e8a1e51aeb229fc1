//! How well do this library's detectors, and OpenCV's, find the marks of a board in hidden photographs?
//!
//! Expected: what is sharp and evenly lit is found, never a board that is not there, and no mark errs less
//! than the noise of the pixels makes it err (Cramer & Rao). Blur wider than a mark's edge, motion and strong
//! tilt cost more than their bound says; by how much is told, not judged.
//!
//! What it cannot show: photographs of a real camera. The scenes were written beside this library's
//! detectors, and these were mended where a scene showed a fault; OpenCV's finders are asked as its tutorial
//! does.
//!
//! The photographs take minutes: the command `detector-gate-trials` showed them and wrote
//! golden/detector-gate/, which is read. It is refused as stale when a line of what draws or judges the
//! photographs, of an adapter or, for this library's own, of its detectors has changed since.

use calibench::evaluate::interval::each_of;
use calibench_detector_gate::protocol::Kind;
use calibench_detector_gate::{Builtin, Demand, Scene, scenes};
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{Context, Experiment, ExperimentError, Record, stats};

pub mod campaign;
mod figures;
mod judged;
pub mod programs;
mod rim;
pub mod row;
mod tables;
mod wrong;

use judged::{Judged, clopper_pearson};
use programs::{PROGRAMS, Program};
use row::{HEADER, Row};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "detector-gate",
    title: "Who finds the marks, and how well",
    question: "Chessboards, boards of discs and boards with markers are photographed by the virtual camera: sharp, noisy, blurred, tilted, unevenly lit, \
               faint, moved, packed as JPEG, or not at all. This library's detectors and OpenCV's look for them. How many boards are \
               found, how many that are not there, and how far are marks from their places, in px and in units of the bound that the \
               pixels' noise implies? Expected: sharp boards are found, none is invented, no error is below the bound.",
    seed: SEED,
    takes_image: false,
    run,
};

/// Seed of every photograph; not chosen for its result.
pub const SEED: u64 = 1;
/// Photographs of a scene.
pub const PHOTOS: u64 = 24;
/// Photographs of a scene that every run shows this library's detectors again.
const REPEATED: u64 = 1;
/// Chance that a correct program fails one of the statistical claims.
const FALSE_ALARM: f64 = 1e-4;
/// Coverage of the intervals that are drawn and tabulated.
const DRAWN: f64 = 0.05;
/// Noise of a coordinate that the studies of the book assume, px.
const ASSUMED_PX: f64 = 0.1;
/// Scenes with nothing between the board and its photograph but the pixels.
const PLAIN: [&str; 2] = ["clean", "facing"];
/// Scenes that are sharp, evenly lit, tilted by 40 degrees at most and not packed: noise is what is left.
const SHARP: [&str; 8] =
    ["clean", "facing", "noisy", "dark-surround", "wide-lens", "far", "strong-noise", "faint"];
/// Scenes in which the discs that are far off are the outermost alone.
const INNER_NEAR: [&str; 3] = ["steep", "blurred", "moved"];
/// Twice the bound: four photographs do what one could.
const NEAR: f64 = 2.0;

/// What was committed of each program.
const COMMITTED: [&str; PROGRAMS.len()] = [
    include_str!("../golden/detector-gate/calibench.csv"),
    include_str!("../golden/detector-gate/opencv.csv"),
    include_str!("../golden/detector-gate/opencv-sb.csv"),
];

/// A program with its photographs.
struct Seen {
    program: &'static Program,
    committed: &'static str,
    rows: Vec<Row>,
}

impl Seen {
    /// Every scene that the program was shown.
    fn scenes(&self) -> Vec<Judged<'_>> {
        campaign::scenes_of(self.program).into_iter().map(|scene| Judged::new(scene, &self.rows)).collect()
    }

    /// Those that show the board that is asked for.
    fn with_board(&self) -> Vec<Judged<'_>> {
        self.scenes().into_iter().filter(|judged| shows_board(&judged.scene)).collect()
    }

    /// The others.
    fn without_board(&self) -> Vec<Judged<'_>> {
        self.scenes().into_iter().filter(|judged| !shows_board(&judged.scene)).collect()
    }

    fn in_scene(&self, scene: Scene) -> Judged<'_> {
        Judged::new(scene, &self.rows)
    }
}

fn shows_board(scene: &Scene) -> bool {
    scene.demand != Demand::Nothing
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let seen = read()?;
    for one in &seen {
        record.input(format!("golden/detector-gate/{}.csv", one.program.name), one.committed.as_bytes());
    }
    claim_current(&mut record, &seen);
    claim_repeated(&mut record, context, &seen[0])?;
    report(&mut record, &seen);
    claim_boards(&mut record, &seen[0]);
    claim_errors(&mut record, &seen);
    claim_rim(&mut record)?;
    wrong::report(&mut record, &wrong::read().map_err(ExperimentError::Input)?);
    for table in tables::each_kind(&seen) {
        record.table(table);
    }
    record.table(tables::invented(&seen));
    record.table(tables::scenes(&seen));
    record.table(tables::fairness(&seen));
    for figure in figures::errors(&seen) {
        record.figure(figure);
    }
    record.figure(figures::photographs()?);
    Ok(record)
}

fn read() -> Result<Vec<Seen>, ExperimentError> {
    let one = |(program, committed): (&'static Program, &'static str)| {
        let mut lines = committed.lines().skip(1);
        let rows = (lines.next() == Some(HEADER))
            .then(|| lines.map(Row::read).collect::<Option<Vec<_>>>())
            .flatten();
        let broken =
            || format!("golden/detector-gate/{}.csv is broken: run {}", program.name, program.command());
        Ok(Seen { program, committed, rows: rows.ok_or_else(|| ExperimentError::Input(broken()))? })
    };
    PROGRAMS.iter().zip(COMMITTED).map(one).collect()
}

/// The committed photographs are those of this code, and of this adapter.
fn claim_current(record: &mut Record, seen: &[Seen]) {
    let case = |one: &Seen| {
        let (name, command) = (one.program.name, one.program.command());
        let present = match one.program.method {
            None => Fingerprint::of_detector_gate(),
            Some(_) => Fingerprint::of_detector_gate_scenes(),
        };
        let (what, held) = present.case(&format!("{name}.csv"), one.committed, &command);
        let adapter = format!("; adapter {}", one.program.adapter_hash());
        let is_adapters = one.committed.lines().next().is_some_and(|head| head.contains(&adapter));
        let is_whole = one.scenes().iter().all(|judged| judged.photos() as u64 == PHOTOS);
        let what = match (held, is_adapters && is_whole) {
            (true, false) => format!("{name}.csv is of another adapter or other photographs: run {command}"),
            _ => what,
        };
        (what, held && is_adapters && is_whole)
    };
    record
        .claim_that(
            "photographs-are-current",
            "every committed photograph was drawn and judged by the present code and shown by the present adapter",
        )
        .every("programs", seen.iter().map(case))
        .because(
            "SHA-256 of the code lines that draw and judge, of the adapter and, for this library, of its \
             detectors, and the versions of the numeric crates and of the codec",
        );
}

/// The first photograph of every scene, shown to this library's detectors in every run.
fn claim_repeated(record: &mut Record, context: &Context, ours: &Seen) -> Result<(), ExperimentError> {
    if context.seed != SEED {
        record.note("Another seed draws other photographs than the committed ones: none is compared.");
        return Ok(());
    }
    let scenes = scenes();
    let progress = context.progress("scenes", scenes.len());
    let mut cases = Vec::new();
    for scene in &scenes {
        let rows = campaign::rows_of(scene, &mut Builtin, 0..REPEATED);
        for row in rows.map_err(ExperimentError::at("the repeated photographs"))? {
            let what = format!("{}, photograph {}: run {}", scene.name(), row.trial, ours.program.command());
            cases.push((what, ours.committed.lines().any(|line| line == row.text())));
        }
        progress.step();
    }
    record.exact("").count(
        "photographs-repeated",
        cases.len(),
        "photographs that every run shows this library's detectors again",
    );
    record
        .claim_that(
            "share-is-repeated",
            "the photographs repeated in this run give the committed errors and bounds, bit for bit",
        )
        .every("photographs", cases)
        .because("streams are keyed by seed, scene and photograph, and every sum has its order");
    Ok(())
}

fn report(record: &mut Record, seen: &[Seen]) {
    record.exact("").count("scenes", scenes().len(), "scenes, of all kinds of boards").count(
        "photographs",
        PHOTOS as usize,
        "photographs of a scene",
    );
    for one in seen {
        report_boards(record, one);
        one.with_board().iter().for_each(|judged| report_scene(record, one.program, judged));
    }
}

fn report_boards(record: &mut Record, one: &Seen) {
    let (with, without) = (one.with_board(), one.without_board());
    let sum = |judged: &[Judged<'_>], of: fn(&Judged<'_>) -> usize| judged.iter().map(of).sum::<usize>();
    let name = one.program.name;
    let asked = sum(&without, |judged| judged.photos());
    let invented = sum(&without, |judged| judged.boards());
    record
        .exact("")
        .suffix(format!("-{name}"), format!(", {name}"))
        .count("asked-in-vain", asked, "photographs without the board that was asked for")
        .count("invented", invented, "boards found in them")
        .number(
            "invented-most",
            clopper_pearson(invented, asked, DRAWN).high,
            "most that their share can be, 95 %",
        )
        .count("boards", sum(&with, |judged| judged.boards()), "boards found where there is one")
        .count("wrong", sum(&with, |judged| judged.wrong()), "of them with a mark at another's place")
        .count("mirrored", sum(&with, |judged| judged.mirrored()), "of them numbered as in a mirror")
        .count("missing", sum(&with, |judged| judged.missing()), "marks of the others that were not seen")
        .count("broken", sum(&one.scenes(), |judged| judged.broken()), "answers that break the protocol");
}

fn report_scene(record: &mut Record, program: &Program, judged: &Judged<'_>) {
    let (kind, scene, name) = (judged.scene.kind.name(), judged.scene.id, program.name);
    let mut numbers = record.exact("");
    numbers.suffix(format!("-{kind}-{scene}-{name}"), format!(", {kind}, {scene}, {name}")).number(
        "found",
        judged.share(DRAWN).value,
        "share of boards found",
    );
    if let Some(over) = judged.over_bound(DRAWN) {
        numbers.number("over", over.value, "root mean squared error over that of the bound");
    }
    if let (Some(rms), Some(worst)) = (judged.rms_px(DRAWN), judged.worst_px()) {
        numbers.unit("px").number("rms", rms.value, "root mean squared error of a coordinate").number(
            "worst",
            worst,
            "largest distance of a mark from its place",
        );
    }
}

/// What this library's detectors say of boards.
fn claim_boards(record: &mut Record, ours: &Seen) {
    let without = ours.without_board();
    let invented = |judged: &Judged<'_>| {
        let (boards, photos) = (judged.boards(), judged.photos());
        (format!("{}: {boards} of {photos}", judged.scene.name()), boards == 0)
    };
    record
        .claim_that(
            "nothing-is-invented",
            "this library's detectors find no board of another size or kind, and none in noise",
        )
        .every("scenes", without.iter().map(invented))
        .because("a grid with a row too many or too few is refused, and noise has no grid");
    let right = |judged: &Judged<'_>| {
        let (wrong, mirrored) = (judged.wrong(), judged.mirrored());
        let what =
            format!("{}: {wrong} with a mark at another's place, {mirrored} mirrored", judged.scene.name());
        (what, wrong + mirrored == 0)
    };
    record
        .claim_that(
            "marks-are-numbered",
            "of the boards that they find no mark is at another's place, and none is numbered as in a mirror",
        )
        .every("scenes", ours.with_board().iter().map(right))
        .because("a board seen from behind faces the other way, and no camera sees it so");
    let with = ours.with_board();
    let plain = with.iter().filter(|judged| PLAIN.contains(&judged.scene.id));
    let found = |judged: &Judged<'_>| {
        let (boards, photos) = (judged.boards(), judged.photos());
        (format!("{}: {boards} of {photos}", judged.scene.name()), boards == photos)
    };
    record
        .claim_that("plain-boards-are-found", "in clean photographs, tilted or facing, they find every board")
        .every("scenes", plain.map(found))
        .because("every mark is sharp, wholly in the image, and far brighter or darker than its ground");
}

fn claim_errors(record: &mut Record, seen: &[Seen]) {
    let ours = seen[0].with_board();
    let below = |judged: &Judged<'_>| {
        let name = judged.scene.name();
        judged.rms_px(DRAWN).map_or((format!("{name}: no board was found"), false), |rms| {
            (format!("{name}: {:.4} px at most", rms.interval.high), rms.interval.high <= ASSUMED_PX)
        })
    };
    record
        .claim_that(
            "below-the-noise-of-the-studies",
            "in every scene, but of grids of tags, the error of a coordinate of this library's marks is below the 0.1 px that the \
             book's studies assume",
        )
        .every("scenes", ours.iter().filter(|judged| judged.scene.kind != Kind::AprilGrid).map(below))
        .because("upper end of the 95 % interval of independent photographs, in each scene");
    let all: Vec<(&Program, Judged<'_>)> = seen
        .iter()
        .flat_map(|one| one.with_board().into_iter().map(move |judged| (one.program, judged)))
        .collect();
    let each = each_of(all.len(), FALSE_ALARM);
    let at_bound = all.iter().filter_map(|(program, judged)| {
        let high = judged.over_bound(each)?.interval.high;
        Some((format!("{}, {}: at most {high:.3}", program.name, judged.scene.name()), high >= 1.0))
    });
    record
        .claim_that("none-below-the-bound", "no program errs less in a scene than the pixels' noise makes it err")
        .every("scenes", at_bound)
        .at_rate(FALSE_ALARM)
        .because(
            "the Cramer-Rao bound of a mark by itself, which rounding and clipping of levels can only raise; upper \
             end of the interval of independent photographs, Bonferroni over programs and scenes",
        );
    let sharp: Vec<(&str, f64)> = ours
        .iter()
        .filter(|judged| judged.scene.kind == Kind::Circles && SHARP.contains(&judged.scene.id))
        .filter_map(|judged| Some((judged.scene.id, judged.over_bound(DRAWN)?.value)))
        .collect();
    record.exact("").number(
        "over-sharp-discs-most",
        stats::largest(sharp.iter().map(|(_, over)| *over)),
        "error of this library's discs over the bound in the sharp, evenly lit scene where it is largest",
    );
    record
        .claim_that(
            "sharp-discs-are-near-the-bound",
            "in sharp, evenly lit photographs this library's discs err at most twice as much as the bound",
        )
        .every("scenes", sharp.iter().map(|(scene, over)| (format!("{scene}: {over:.3}"), *over <= NEAR)))
        .because("an edge model with the image's own blur uses nearly all that the edge tells");
}

/// Where blur is wide, light uneven or the board steep: which discs are far off?
fn claim_rim(record: &mut Record) -> Result<(), ExperimentError> {
    let mut cases = Vec::new();
    for id in rim::SCENES {
        let found = rim::inner_and_outer(id).ok_or("no such scene");
        let [inner, outer] = found.map_err(ExperimentError::at("the outermost discs"))?;
        let mut numbers = record.exact("");
        numbers
            .suffix(format!("-{id}"), format!(", {id}, the first photographs"))
            .number("over-inner", inner.over_bound(), "error over the bound of discs with others all around")
            .number("over-outer", outer.over_bound(), "error over the bound of the outermost discs")
            .unit("px")
            .number("rms-inner", inner.rms_px(), "error of a coordinate of discs with others all around")
            .number("rms-outer", outer.rms_px(), "error of a coordinate of the outermost discs");
        if INNER_NEAR.contains(&id) {
            cases.push((format!("{id}: {:.3}", inner.over_bound()), inner.over_bound() <= NEAR));
        }
    }
    record.exact("").count(
        "photographs-of-rims",
        rim::PHOTOS as usize,
        "photographs of a scene behind these",
    );
    record
        .claim_that(
            "inner-discs-are-near-the-bound",
            "in steep, blurred and moved photographs discs with others all around err at most twice as much as the bound",
        )
        .every("scenes", cases)
        .because("what is far off there are discs whose ground ends beside them");
    Ok(())
}
