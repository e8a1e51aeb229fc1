//! Where are the marks of a board whose markers tell them apart? ChArUco boards and grids of AprilTags.
//!
//! The corners are those of the chessboard's own detector, found and fitted alike; the markers only tell
//! which they are.

mod april;
mod cells;
mod charuco;
mod dictionary;
mod filled;
mod layout;
mod neighbourhood;
mod placement;
mod quads;
mod tag;
mod together;

pub use april::seen_april_grid;
pub use charuco::seen_charuco;
pub use dictionary::{Dictionary, UnknownDictionary};
pub use layout::{AprilGrid, Charuco, LayoutError};

/// Why a board with markers is not found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CodedError {
    /// No lattice of corners.
    #[error(
        "no squares of a board are seen ({seen} places in the image look like corners): too small, too blurred, or outside"
    )]
    NoCorners {
        /// Places that look like corners.
        seen: usize,
    },
    /// Corners, but no marker of any dictionary.
    #[error(
        "{corners} corners are seen, but no marker of {dictionary}: is the marker's size right? In squares of few pixels markers \
         cannot be read"
    )]
    NoMarker {
        /// Corners of the largest lattice.
        corners: usize,
        /// The asked dictionary.
        dictionary: Dictionary,
    },
    /// Markers of another dictionary.
    #[error("the markers are of {seen} ({count} of them fit it), not of {asked}")]
    OtherDictionary {
        /// The asked dictionary.
        asked: Dictionary,
        /// The smallest that has the markers.
        seen: Dictionary,
        /// Markers that were read in it.
        count: usize,
    },
    /// A photograph that was mirrored.
    #[error(
        "{count} markers are seen as in a mirror: the photograph is mirrored, which a camera's software may do to show people \
         themselves; turn that off, for no pose of the board explains it"
    )]
    Mirrored {
        /// Markers of the asked dictionary that are seen so.
        count: usize,
    },
    /// One marker alone may be read wrongly.
    #[error(
        "only one marker can be read (number {id}): two that agree are needed to be certain where on the board they are"
    )]
    OneMarker {
        /// Its number.
        id: usize,
    },
    /// Tags of one row, which grids of any width have.
    #[error(
        "{tags} tags agree, but all are of one row, which looks alike on grids of any width: show tags of two rows at least"
    )]
    OneRow {
        /// Tags that agree.
        tags: usize,
    },
    /// Few markers, which stand to each other as on boards of another width too, beside others that
    /// contradict the board.
    #[error(
        "{markers} markers agree on where the board is, but stand alike on a board {other} wide, and others in the image do not stand as on \
         one {columns} wide: show more rows of it, and no other board of its markers"
    )]
    AnyWidth {
        /// Markers that agree.
        markers: usize,
        /// Asked squares along a row.
        columns: usize,
        /// Squares along a row of another board on which they stand alike.
        other: usize,
    },
    /// The markers do not stand as on the board.
    #[error(
        "{agree} of {read} markers agree on where the board is, and the others do not: is it {columns} wide and {rows} high?{}",
        other_hint(*.other, *.columns)
    )]
    Disagree {
        /// Markers that agree.
        agree: usize,
        /// Markers that were read.
        read: usize,
        /// Asked squares or tags along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Width on which most markers agree, and whether such a board begins with a white square.
        other: Option<(usize, bool)>,
    },
    /// Marks beyond the board's edge.
    #[error(
        "the board goes on beyond the {columns} x {rows} that were asked: give the size of the whole board"
    )]
    GoesOn {
        /// Asked squares or tags along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
    },
    /// Tags stand farther from each other, or nearer, than was said.
    #[error(
        "the tags stand {}.{:03} of their side apart, and not {}.{:03}: give the spacing of the printed board, measured",
        .seen / 1000, .seen % 1000, .asked / 1000, .asked % 1000
    )]
    Spacing {
        /// Asked distance of two tags, in thousandths of a tag's side.
        asked: usize,
        /// What it is in the photograph.
        seen: usize,
    },
    /// Too few corners have a place better than a pixel: fewer than four, or of tags fewer than a third.
    #[error(
        "{found} of the board's marks have edges clear enough for exact places, too few: hold the board still, or use more light"
    )]
    Unclear {
        /// Marks with exact places.
        found: usize,
    },
}

impl CodedError {
    /// Whether markers contradict that this is the board, more than chance explains.
    fn is_grave(&self) -> bool {
        match self {
            CodedError::Disagree { read, .. } => *read > BY_CHANCE,
            CodedError::GoesOn { .. } | CodedError::Spacing { .. } => true,
            _ => false,
        }
    }

    /// The same, of a lattice of so many corners.
    fn of_corners(self, corners: usize) -> CodedError {
        match self {
            CodedError::NoMarker { dictionary, .. } => CodedError::NoMarker { corners, dictionary },
            other => other,
        }
    }

    /// How many markers of the asked dictionary were read, where that may be chance: cells of others look
    /// like some.
    fn by_chance(&self) -> Option<usize> {
        match self {
            CodedError::NoMarker { .. } => Some(0),
            CodedError::OneMarker { .. } => Some(1),
            CodedError::Disagree { read, other: None, .. } => Some(*read),
            _ => None,
        }
    }
}

/// Fewest markers that tell of another dictionary, or of a mirror.
const FEWEST_OF_ANOTHER: usize = 3;

/// Markers that a piece of something else may seem to have.
const BY_CHANCE: usize = 2;

fn other_hint(other: Option<(usize, bool)>, columns: usize) -> String {
    match other {
        None => String::new(),
        Some((width, white)) if width == columns => {
            let which = if white {
                "the legacy pattern: write :legacy behind it"
            } else {
                "the present pattern: leave :legacy out"
            };
            format!(" They would agree on OpenCV's other pattern, {which}")
        }
        Some((width, _)) => format!(" They would agree on one {width} wide"),
    }
}
