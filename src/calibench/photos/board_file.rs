//! How large is a board that was printed? The file that goes with a page: the board as it was drawn, and how
//! long the page's two rulers came out.

use super::board::{BoardSpec, BoardSpecError};
use serde::Deserialize;

/// Largest accepted difference of the page's two scales, as a fraction. A ruler of 150 mm is read to half a
/// millimetre, which is a third of a per cent, and two readings differ by half of one at most; a printer that
/// stretches more than that makes another board.
const MOST_STRETCH: f64 = 0.005;

/// Scales of a page that can be meant. Whoever writes centimetres, or inches, is beyond.
const SCALES: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Why a file describes no board.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoardFileError {
    /// It is not the TOML that `calibench board` writes.
    #[error("{file}:{line}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// The board in it does not exist.
    #[error("{file}: {reason}")]
    Board {
        /// The file.
        file: String,
        /// Why.
        reason: BoardSpecError,
    },
    /// A length of a ruler that cannot be.
    #[error(
        "{file}: a ruler of {drawn} mm that measures {measured}: give its length on the page in millimetres"
    )]
    Length {
        /// The file.
        file: String,
        /// As drawn, mm.
        drawn: f64,
        /// As measured, mm.
        measured: f64,
    },
    /// The page is stretched in one direction.
    #[error(
        "{file}: the page came out at {across:.4} of its width and {down:.4} of its height: squares are no squares on it. Measure \
         again, or print it again at 100 %"
    )]
    Stretched {
        /// The file.
        file: String,
        /// Scale along the lower ruler.
        across: f64,
        /// Scale along the left ruler.
        down: f64,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    board: String,
    drawn_mm: [f64; 2],
    measured_mm: [f64; 2],
}

/// The board of a file as it came out of the printer: the drawn one, scaled by the mean of what both rulers
/// tell.
///
/// # Errors
/// See [`BoardFileError`].
///
/// ```
/// use calibench::photos::parse_board_file;
///
/// // As `calibench board` leaves it, with the lengths of the printed rulers: the page came out 3 % smaller.
/// let text = r#"
/// board = "circles:9x7:20mm:8mm"
/// drawn_mm = [160.0, 120.0]
/// measured_mm = [155.2, 116.4]
/// "#;
/// let board = parse_board_file("board.toml", text)?;
/// assert!((board.board().spacing() - 19.4).abs() < 1e-9);
/// # Ok::<(), calibench::photos::BoardFileError>(())
/// ```
pub fn parse_board_file(name: &str, text: &str) -> Result<BoardSpec, BoardFileError> {
    let file = || name.to_string();
    let read: File = toml::from_str(text).map_err(|error| {
        let before = error.span().map_or("", |span| &text[..span.start]);
        let line = before.matches('\n').count() + 1;
        BoardFileError::Syntax { file: file(), line, message: error.message().trim().to_string() }
    })?;
    let drawn: BoardSpec =
        read.board.parse().map_err(|reason| BoardFileError::Board { file: file(), reason })?;
    let scale = |i: usize| {
        let (drawn, measured) = (read.drawn_mm[i], read.measured_mm[i]);
        let scale = measured / drawn;
        let meant = drawn > 0.0 && SCALES.contains(&scale);
        if meant { Ok(scale) } else { Err(BoardFileError::Length { file: file(), drawn, measured }) }
    };
    let (across, down) = (scale(0)?, scale(1)?);
    if (across - down).abs() > MOST_STRETCH {
        return Err(BoardFileError::Stretched { file: file(), across, down });
    }
    drawn.scaled(0.5 * (across + down)).map_err(|reason| BoardFileError::Board { file: file(), reason })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;

    fn file(measured: &str) -> Result<BoardSpec, BoardFileError> {
        let text = format!(
            "# words\nboard = \"circles:9x7:10mm:3mm\"\ndrawn_mm = [200, 100]\nmeasured_mm = {measured}\n"
        );
        parse_board_file("board.toml", &text)
    }

    #[test]
    fn the_board_has_the_size_that_the_rulers_tell() {
        assert_eq!(*file("[200, 100]").unwrap().board(), Board::circles(9, 7, 10.0, 3.0).unwrap());
        let printed = file("[194.0, 97.0]").unwrap();
        assert_eq!(*printed.board(), Board::circles(9, 7, 9.7, 0.97 * 3.0).unwrap());
        assert_eq!(printed.unit, "mm");
        // Half a millimetre of the longer ruler moves the mean by an eighth of a per cent.
        assert!((file("[200.5, 100]").unwrap().board().spacing() - 10.0125).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_printed_board_is_refused() {
        assert!(matches!(file("[20.0, 10.0]"), Err(BoardFileError::Length { .. })));
        assert!(matches!(file("[nan, 100]"), Err(BoardFileError::Length { .. })));
        assert!(matches!(file("[0, 0]"), Err(BoardFileError::Length { .. })));
        assert!(matches!(file("[202.0, 99.5]"), Err(BoardFileError::Stretched { .. })));
        assert!(matches!(file("[200]"), Err(BoardFileError::Syntax { .. })));
        let no_board = parse_board_file("b", "board = \"x\"\ndrawn_mm = [1, 1]\nmeasured_mm = [1, 1]\n");
        assert!(matches!(no_board, Err(BoardFileError::Board { .. })));
        let drawn_of_no_length =
            parse_board_file("b", "board = \"chess:9x6:25mm\"\ndrawn_mm = [0, 0]\nmeasured_mm = [0, 0]\n");
        assert!(matches!(drawn_of_no_length, Err(BoardFileError::Length { .. })));
    }
}
