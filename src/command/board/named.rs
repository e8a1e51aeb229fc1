//! A board as it is named on the command line: by words, or by the file that lies beside a printed page.

use calibench::io::input::{MOST_TABLE_BYTES, read_regular};
use calibench::io::shown::on_one_line;
use calibench::photos::{BoardSpec, BoardSpecError, parse_board_file};
use std::path::Path;

/// What a file of a printed board is called by its ending.
const ENDING: &str = ".toml";

/// `circles:9x7:10mm:3mm`, or a file such as `board.toml`.
pub(in super::super) fn board_or_file(text: &str) -> Result<BoardSpec, String> {
    if !text.ends_with(ENDING) {
        return text.parse().map_err(|error: BoardSpecError| match error {
            BoardSpecError::Form(_) => {
                format!("{error}; or the board.toml beside a page that `calibench board` drew")
            }
            error => error.to_string(),
        });
    }
    let bytes = read_regular(Path::new(text), MOST_TABLE_BYTES).map_err(|error| error.to_string())?;
    // What stands in the file begins no line of the parser's message.
    parse_board_file(text, &String::from_utf8_lossy(&bytes))
        .map_err(|error| on_one_line(&error.to_string()).into_owned())
}

/// The file of a page: what was drawn, and what its owner will measure.
pub(super) fn file_text(board: &BoardSpec, rulers_mm: [f64; 2]) -> String {
    let [lower, left] = rulers_mm;
    format!(
        "# A printed board, for `calibench calibrate --board board.toml PHOTOS...`.\n\
         # Printers scale. Measure both rulers on the page, from the middle of the first tick to the middle of the last,\n\
         # and write their lengths behind measured_mm: the lower ruler first, then the one on the left.\n\
         board = \"{}\"\n\
         drawn_mm = [{lower}, {left}]\n\
         measured_mm = [{lower}, {left}]\n",
        board.words()
    )
}

/// Whether the owner of a page has written into its file what the rulers measure: it cannot be drawn anew.
pub(super) fn is_measured(text: &str) -> bool {
    let lengths = |name: &str| {
        let stated =
            text.lines().find_map(|line| line.trim().strip_prefix(name)?.trim_start().strip_prefix('='));
        stated.map(str::trim)
    };
    lengths("measured_mm") != lengths("drawn_mm")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_measured_once_its_lengths_are_others() {
        let drawn = file_text(&"circles:9x7:10mm:3mm".parse().unwrap(), [270.0, 180.0]);
        assert!(!is_measured(&drawn));
        assert!(is_measured(&drawn.replace("measured_mm = [270, 180]", "measured_mm = [261.9, 174.6]")));
        assert!(is_measured(&drawn.replace("measured_mm = [270, 180]\n", "")));
    }
}
