//! Which markers are there? OpenCV's predefined dictionaries, by OpenCV's names (Garrido-Jurado et al. 2014,
//! 2016), among them the AprilTag families (Olson 2011, Wang & Olson 2016).
//!
//! The tables hold a marker a line, its inner cells as a hexadecimal number; `tables/write.py` says how they
//! were written. OpenCV's smaller dictionaries are the first markers of those with 1000.

use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;

/// Cells of a marker, row by row from the top left, the first the highest of the binary digits; white 1.
pub type Cells = u64;

/// The markers of a family.
struct Table {
    /// Cells along a side, without the border.
    side: usize,
    text: &'static str,
    cells: OnceLock<Vec<Cells>>,
}

macro_rules! table {
    ($name:ident, $side:literal, $file:literal) => {
        static $name: Table = Table {
            side: $side,
            text: include_str!(concat!("tables/", $file, ".txt")),
            cells: OnceLock::new(),
        };
    };
}

table!(FOUR, 4, "4x4_1000");
table!(FIVE, 5, "5x5_1000");
table!(SIX, 6, "6x6_1000");
table!(SEVEN, 7, "7x7_1000");
table!(ORIGINAL, 5, "aruco_original");
table!(MIP, 6, "aruco_mip_36h12");
table!(TAG_16, 4, "apriltag_16h5");
table!(TAG_25, 5, "apriltag_25h9");
table!(TAG_36_10, 6, "apriltag_36h10");
table!(TAG_36_11, 6, "apriltag_36h11");

/// OpenCV's name without `DICT_`, the markers, their number, and how many wrong cells the code corrects.
type Entry = (&'static str, &'static Table, usize, u32);

/// The smaller of a family first. Wrong cells as OpenCV has them (`maxCorrectionBits`): half of what the
/// least Hamming distance of two markers leaves.
static ENTRIES: [Entry; 22] = [
    ("4X4_50", &FOUR, 50, 1),
    ("4X4_100", &FOUR, 100, 1),
    ("4X4_250", &FOUR, 250, 1),
    ("4X4_1000", &FOUR, 1000, 0),
    ("5X5_50", &FIVE, 50, 3),
    ("5X5_100", &FIVE, 100, 3),
    ("5X5_250", &FIVE, 250, 2),
    ("5X5_1000", &FIVE, 1000, 2),
    ("6X6_50", &SIX, 50, 6),
    ("6X6_100", &SIX, 100, 5),
    ("6X6_250", &SIX, 250, 5),
    ("6X6_1000", &SIX, 1000, 4),
    ("7X7_50", &SEVEN, 50, 9),
    ("7X7_100", &SEVEN, 100, 8),
    ("7X7_250", &SEVEN, 250, 8),
    ("7X7_1000", &SEVEN, 1000, 6),
    ("ARUCO_ORIGINAL", &ORIGINAL, 1024, 1),
    ("ARUCO_MIP_36h12", &MIP, 250, 5),
    ("APRILTAG_16h5", &TAG_16, 30, 2),
    ("APRILTAG_25h9", &TAG_25, 35, 4),
    ("APRILTAG_36h10", &TAG_36_10, 2320, 4),
    ("APRILTAG_36h11", &TAG_36_11, 587, 5),
];

/// A set of markers with a name of OpenCV's, such as `DICT_4X4_50`.
///
/// ```
/// use calibench::detect::Dictionary;
///
/// let dictionary: Dictionary = "DICT_6X6_250".parse()?;
/// assert_eq!((dictionary.len(), dictionary.side()), (250, 6));
/// assert!("DICT_8X8_50".parse::<Dictionary>().is_err());
/// # Ok::<(), calibench::detect::UnknownDictionary>(())
/// ```
#[derive(Clone, Copy)]
pub struct Dictionary(&'static Entry);

/// A name that no dictionary has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "no dictionary is called `{0}`: DICT_4X4_50, DICT_4X4_100, DICT_4X4_250, DICT_4X4_1000, the same of 5X5, 6X6 and 7X7, \
     DICT_ARUCO_ORIGINAL, DICT_ARUCO_MIP_36h12, DICT_APRILTAG_16h5, _25h9, _36h10 and _36h11 are known"
)]
pub struct UnknownDictionary(pub String);

impl FromStr for Dictionary {
    type Err = UnknownDictionary;

    /// OpenCV's name, in any case, with or without `DICT_`.
    fn from_str(text: &str) -> Result<Dictionary, UnknownDictionary> {
        let upper = text.to_ascii_uppercase();
        let name = upper.strip_prefix("DICT_").unwrap_or(&upper);
        let found = ENTRIES.iter().find(|entry| entry.0.eq_ignore_ascii_case(name));
        found.map(Dictionary).ok_or_else(|| UnknownDictionary(text.to_string()))
    }
}

impl fmt::Display for Dictionary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "DICT_{}", self.0.0)
    }
}

impl fmt::Debug for Dictionary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Dictionary({self})")
    }
}

impl PartialEq for Dictionary {
    fn eq(&self, other: &Dictionary) -> bool {
        self.0.0 == other.0.0
    }
}

impl Eq for Dictionary {}

/// A marker that was recognised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Recognised {
    /// Its number.
    pub id: usize,
    /// Quarter turns: the cell seen at `p` from the middle is the marker's at `turned(p, turns)`.
    pub turns: u8,
    /// Cells that differ.
    pub wrong: u32,
}

impl Dictionary {
    /// AprilTag's family 36h11, which Kalibr's grids have.
    pub(super) fn april_36h11() -> Dictionary {
        Dictionary(&ENTRIES[21])
    }

    /// All of them, the smaller ones of a family first.
    pub(super) fn all() -> impl Iterator<Item = Dictionary> {
        ENTRIES.iter().map(Dictionary)
    }

    /// Number of markers.
    #[expect(clippy::len_without_is_empty, reason = "no dictionary is empty")]
    pub fn len(&self) -> usize {
        self.0.2
    }

    /// Cells along a side of a marker, without its border.
    pub fn side(&self) -> usize {
        self.0.1.side
    }

    /// Whether a cell of a marker is white, by its row and column; `None` for a marker or a cell that does
    /// not exist.
    pub fn is_white(&self, marker: usize, row: usize, column: usize) -> Option<bool> {
        let side = self.side();
        let cells = self.cells().get(marker).filter(|_| row < side && column < side)?;
        Some(cells >> (side * side - 1 - row * side - column) & 1 == 1)
    }

    /// All markers.
    pub(super) fn cells(&self) -> &'static [Cells] {
        let table = self.0.1;
        let digits = |line: &str| Cells::from_str_radix(line, 16).unwrap_or(0);
        let all = table.cells.get_or_init(|| table.text.lines().map(digits).collect());
        &all[..self.len().min(all.len())]
    }

    /// How many cells differ from a marker's, if what was seen is turned by so many quarters.
    pub(super) fn wrong(&self, seen: Cells, marker: usize, turns: u8) -> Option<u32> {
        let cells = self.cells().get(marker)?;
        Some((turned_back(seen, self.side(), turns % 4) ^ cells).count_ones())
    }

    /// The marker among the first `count` that is nearest to what was seen, if so near that no other can be
    /// meant.
    pub(super) fn recognise(&self, seen: Cells, count: usize) -> Option<Recognised> {
        let turned: Vec<Cells> = (0..4).map(|turns| turned_back(seen, self.side(), turns)).collect();
        let markers = self.cells().iter().take(count).enumerate();
        let all = markers.flat_map(|(id, cells)| {
            turned.iter().zip(0..).map(move |(turned, turns)| Recognised {
                id,
                turns,
                wrong: (turned ^ cells).count_ones(),
            })
        });
        let mut best: Option<Recognised> = None;
        let mut alone = true;
        for marker in all {
            let least = best.map_or(u32::MAX, |best| best.wrong);
            if marker.wrong < least {
                (best, alone) = (Some(marker), true);
            } else if marker.wrong == least {
                alone = false;
            }
        }
        best.filter(|best| alone && best.wrong <= self.0.3)
    }
}

/// A place turned by quarter turns, from the first axis to the second.
pub(super) fn turned((x, y): (i32, i32), turns: u8) -> (i32, i32) {
    match turns % 4 {
        0 => (x, y),
        1 => (-y, x),
        2 => (-x, -y),
        _ => (y, -x),
    }
}

/// What was seen, as a mirror shows it: every row from its other end.
pub(super) fn mirrored(seen: Cells, side: usize) -> Cells {
    let row = |row: usize| seen >> (side * row) & ((1 << side) - 1);
    let reversed = |cells: Cells| cells.reverse_bits() >> (Cells::BITS as usize - side);
    (0..side).fold(0, |all, k| all | reversed(row(k)) << (side * k))
}

/// What was seen, as it would be upright: the cell at `turned(p)` is the seen one at `p`.
fn turned_back(seen: Cells, side: usize, turns: u8) -> Cells {
    let last = side as i32 - 1;
    let mut upright = 0;
    for row in 0..side {
        for column in 0..side {
            if seen >> (side * side - 1 - row * side - column) & 1 == 1 {
                // Twice the place from the middle, so that it is whole.
                let (x, y) = turned((2 * column as i32 - last, 2 * row as i32 - last), turns);
                let (column, row) = ((x + last) / 2, (y + last) / 2);
                upright |= 1 << (side * side - 1 - row as usize * side - column as usize);
            }
        }
    }
    upright
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_have_as_many_markers_as_their_dictionaries_say_and_all_differ() {
        for dictionary in Dictionary::all() {
            let cells = dictionary.cells();
            assert_eq!(cells.len(), dictionary.len(), "{dictionary}");
            let bits = dictionary.side() * dictionary.side();
            assert!(cells.iter().all(|cells| cells >> bits == 0));
            let sorted: std::collections::BTreeSet<_> = cells.iter().collect();
            assert_eq!(sorted.len(), cells.len(), "{dictionary}");
        }
        assert_eq!(ORIGINAL.text.lines().count(), 1024);
        assert_eq!(Dictionary::april_36h11().to_string(), "DICT_APRILTAG_36h11");
    }

    #[test]
    fn every_marker_is_recognised_in_every_turn_with_as_many_wrong_cells_as_the_code_corrects() {
        for dictionary in Dictionary::all().filter(|dictionary| dictionary.len() <= 100) {
            for (id, &cells) in dictionary.cells().iter().enumerate() {
                for turns in 0..4 {
                    // Turned back so often, it is seen turned by the rest.
                    let seen = turned_back(cells, dictionary.side(), 4 - turns);
                    let wrong = (0..dictionary.0.3).fold(seen, |seen, cell| seen ^ (1 << (3 * cell % 16)));
                    let found = dictionary.recognise(wrong, dictionary.len());
                    let expected = Recognised { id, turns: turns % 4, wrong: dictionary.0.3 };
                    assert_eq!(found, Some(expected), "{dictionary} {id}");
                }
            }
        }
    }

    #[test]
    fn names_are_opencvs_in_any_case() {
        for name in ["DICT_APRILTAG_36h11", "dict_apriltag_36H11", "APRILTAG_36h11"] {
            assert_eq!(name.parse::<Dictionary>().unwrap(), Dictionary::april_36h11());
        }
        assert_eq!("6X6_250".parse::<Dictionary>().unwrap().to_string(), "DICT_6X6_250");
        assert!("DICT_6X6".parse::<Dictionary>().unwrap_err().to_string().contains("DICT_4X4_50"));
    }
}
