//! How often is a board wrong? Ten thousand photographs, of the gate's scenes and of what else may stand
//! before a camera: other boards beside it, its own end outside of the image, a tiled floor, a keyboard.
//! Counted by scene, as it is committed in golden/detector-gate/.

use super::DRAWN;
use super::campaign::FOLDER;
use super::judged::clopper_pearson;
use calibench_detector_gate::{Builtin, Sight, Tally, sights, tally};
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{ProgressDisplay, Record, Table, campaign};
use rayon::prelude::*;
use std::path::Path;

/// Photographs of a scene: of 163 scenes ten thousand in all.
pub const PHOTOS: u64 = 62;
/// The command that writes what is committed.
const COMMAND: &str = "cargo run --release --bin detector-gate-trials -- calibench --wrong";
/// Name of the file, without its ending, and of the table.
const NAME: &str = "wrong-boards";
/// The columns of a line; `trials` are those of wrong boards, with spaces between.
const HEADER: &str = "board,scene,photographs,found,refused,wrong,broken,trials";

/// What is committed.
const COMMITTED: &str = include_str!("../../golden/detector-gate/wrong-boards.csv");

/// Shows this library's detectors the photographs, and writes what became of them.
pub fn write(seed: u64, photos: u64, out: Option<&Path>) -> Result<(), String> {
    let sights = sights();
    let progress = ProgressDisplay::stderr().start("wrong boards", sights.len());
    let counted = |sight: &Sight| {
        let counts = tally(sight, &mut Builtin, seed, photos).map_err(|error| error.to_string())?;
        progress.step();
        Ok(line(&counts.ok_or("this library does not know a board of its gate")?))
    };
    let lines = sights.par_iter().map(counted).collect::<Result<Vec<String>, String>>()?;
    let head = Fingerprint::of_wrong_boards().head(&format!("detector-gate-trials --wrong; seed {seed}"));
    campaign::write(out, FOLDER, NAME, &format!("{head}\n{}", campaign::table(HEADER, lines)))
}

fn line(counts: &Tally) -> String {
    let trials: Vec<String> = counts.wrong.iter().map(u64::to_string).collect();
    let Tally { scene, found, refused, broken, wrong } = counts;
    let (kind, id, photos) = (scene.kind.name(), scene.id, counts.photographs());
    format!("{kind},{id},{photos},{found},{refused},{},{broken},{}", wrong.len(), trials.join(" "))
}

/// A line of the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    board: String,
    scene: String,
    photographs: usize,
    found: usize,
    refused: usize,
    wrong: usize,
    broken: usize,
    trials: String,
}

impl Row {
    fn read(text: &str) -> Option<Row> {
        let cells: Vec<&str> = text.split(',').collect();
        let [board, scene, photographs, found, refused, wrong, broken, trials] = cells[..] else {
            return None;
        };
        let count = |cell: &str| cell.parse::<usize>().ok();
        Some(Row {
            board: board.to_string(),
            scene: scene.to_string(),
            photographs: count(photographs)?,
            found: count(found)?,
            refused: count(refused)?,
            wrong: count(wrong)?,
            broken: count(broken)?,
            trials: trials.to_string(),
        })
    }
}

/// The committed lines; what to do where they cannot be read.
pub fn read() -> Result<Vec<Row>, String> {
    let mut lines = COMMITTED.lines().skip(1);
    let rows = (lines.next() == Some(HEADER)).then(|| lines.map(Row::read).collect::<Option<Vec<Row>>>());
    rows.flatten().ok_or_else(|| format!("{FOLDER}/{NAME}.csv is broken: run {COMMAND}"))
}

impl Row {
    fn told(&self) -> String {
        format!("{} {}: {} wrong of {}", self.board, self.scene, self.wrong, self.photographs)
    }
}

/// What was counted, and that it is of this code.
pub fn report(record: &mut Record, rows: &[Row]) {
    record.input(format!("{FOLDER}/{NAME}.csv"), COMMITTED.as_bytes());
    let sum = |of: fn(&Row) -> usize| rows.iter().map(of).sum::<usize>();
    let (photos, wrong) = (sum(|row| row.photographs), sum(|row| row.wrong));
    record
        .exact("")
        .suffix("-of-campaign", ", in the search for wrong boards")
        .count("scenes", rows.len(), "scenes")
        .count("photographs", photos, "photographs")
        .count("found", sum(|row| row.found), "boards found with every mark within 2 px of its place")
        .count("refused", sum(|row| row.refused), "photographs in which no board was found")
        .count("wrong", wrong, "wrong boards")
        .count("broken", sum(|row| row.broken), "answers that break the protocol")
        .number(
            "wrong-most",
            clopper_pearson(wrong, photos, DRAWN).high,
            "most that the share of wrong boards can be, 95 %",
        );
    record
        .claim_that("wrong-boards-are-current", "every photograph in which wrong boards were looked for was drawn, judged and answered by the present code")
        .every("files", [Fingerprint::of_wrong_boards().case(&format!("{NAME}.csv"), COMMITTED, COMMAND)])
        .because("SHA-256 of the code lines that draw and judge and of this library's detectors, and the versions of the numeric crates and of the codec");
    record
        .claim_that("no-wrong-board-in-the-search", "in none of the photographs in which wrong boards were looked for was a wrong one answered")
        .every("scenes", rows.iter().map(|row| (row.told(), row.wrong == 0)))
        .because("a mark farther than 2 px from its place, a mirror's order, or a board that is not there is a wrong board");
    record.table(table(rows));
}

/// The scenes with a wrong board; the committed file has all.
fn table(rows: &[Row]) -> Table {
    let wrong = rows.iter().filter(|row| row.wrong > 0);
    Table::of(
        NAME,
        "The search for wrong boards: the scenes in which there are any, and the trials that show them",
        wrong,
    )
    .column("board", "", |row| row.board.clone())
    .column("scene", "", |row| row.scene.clone())
    .column("photographs", "", |row| row.photographs)
    .column("found", "", |row| row.found)
    .column("refused", "", |row| row.refused)
    .column("wrong", "", |row| row.wrong)
    .column("trials", "", |row| row.trials.clone())
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written() {
        let scene = *sights()[0].scene();
        let counts = Tally { scene, found: 5, refused: 2, wrong: vec![3, 17], broken: 1 };
        let row = Row::read(&line(&counts)).unwrap();
        assert_eq!((row.photographs, row.found, row.refused, row.wrong, row.broken), (10, 5, 2, 2, 1));
        assert_eq!(
            (row.board.as_str(), row.scene.as_str(), row.trials.as_str()),
            ("chessboard", "clean", "3 17")
        );
        assert_eq!(Row::read("chessboard,clean,10"), None);
    }

    #[test]
    fn a_scene_is_counted_once() {
        let names: std::collections::BTreeSet<String> =
            sights().iter().map(|sight| sight.scene().name()).collect();
        assert_eq!(names.len(), sights().len());
        assert!(sights().len() as u64 * PHOTOS >= 10_000);
    }
}
