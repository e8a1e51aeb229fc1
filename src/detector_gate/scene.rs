//! Under which conditions is a detector tried? Every scene is a condition of photographs, for a kind of
//! board.

use super::look::Look;
use super::protocol::{Kind, Markers, Wanted};
use calibench::photos::BoardSpec;

/// What is asked of the answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demand {
    /// Every board is found, and its marks are where they are.
    Found,
    /// How many are found is told; what is found is right.
    Right,
    /// The board that is asked for is not in the photograph.
    Nothing,
}

/// A condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    /// Its name.
    pub id: &'static str,
    /// What it is, for people.
    pub about: &'static str,
    /// The board.
    pub kind: Kind,
    /// What is asked.
    pub demand: Demand,
    /// How photographs arise.
    pub look: Look,
}

/// Spacing of the marks, and side of a tag; the unit does not matter.
const SPACING: f64 = 10.0;
/// Boards of other sizes that are asked for: marks in a row, and rows, more or less than there are.
const OTHERS: [(isize, isize); 4] = [(-1, 0), (0, -1), (1, 0), (1, 1)];
/// The same of boards with markers. They may be seen in part: with rows added at the end they have the
/// markers that are seen.
const OTHER_WIDTHS: [isize; 4] = [-1, 1, -2, 2];
/// Markers of a ChArUco board, and those of another.
const MARKERS: &str = "DICT_4X4_50";
const OTHER_MARKERS: &str = "DICT_5X5_50";

/// All scenes, of every kind of board.
pub fn scenes() -> Vec<Scene> {
    let good = Look { noise: 0.005, ..Look::default() };
    let looks = [
        ("clean", "640 x 480, blur 0.6 px, noise 0.5 %, tilted by up to 40 degrees", Demand::Found, good),
        (
            "facing",
            "facing, rows along the image's: what depends on the place within a pixel shows",
            Demand::Found,
            Look { tilt: (0.0, 2.0), roll: 1.0, blur_px: 0.4, ..good },
        ),
        ("noisy", "noise of 2 %", Demand::Found, Look { noise: 0.02, ..good }),
        ("blurred", "blur of 2 px", Demand::Found, Look { blur_px: 2.0, ..good }),
        ("tilted", "tilted by 45 to 60 degrees", Demand::Found, Look { tilt: (45.0, 60.0), ..good }),
        (
            "uneven-light",
            "the light changes by 60 % from the centre to the edges",
            Demand::Found,
            Look { light: 0.6, ..good },
        ),
        (
            "dark-surround",
            "on a background as dark as the marks",
            Demand::Found,
            Look { levels: [0.1, 0.85, 0.1], ..good },
        ),
        (
            "wide-lens",
            "half the focal length, barrel distortion",
            Demand::Found,
            Look { lens: [-0.3, 0.1], focal: 0.5, ..good },
        ),
        ("codec", "JPEG of quality 50", Demand::Found, Look { jpeg: Some(50), ..good }),
        ("poor-codec", "JPEG of quality 10", Demand::Right, Look { jpeg: Some(10), ..good }),
        ("far", "up to three times as far as fills the image", Demand::Right, Look { far: 3.0, ..good }),
        ("strong-noise", "noise of 12 %", Demand::Right, Look { noise: 0.12, ..good }),
        ("very-blurred", "blur of 3 px", Demand::Right, Look { blur_px: 3.0, ..good }),
        ("steep", "tilted by 60 to 70 degrees", Demand::Right, Look { tilt: (60.0, 70.0), ..good }),
        ("moved", "moved by 8 px while the shutter was open", Demand::Right, Look { motion_px: 8.0, ..good }),
        (
            "faint",
            "contrast of 6 % beside something bright",
            Demand::Right,
            Look { levels: [0.24, 0.30, 0.97], noise: 0.003, ..good },
        ),
        ("another-size", "a board of another size is asked for", Demand::Nothing, good),
        (
            "another-kind",
            "a board of another kind, or with other markers, is asked for",
            Demand::Nothing,
            good,
        ),
        (
            "noise-only",
            "no board: levels drawn at random",
            Demand::Nothing,
            Look { levels: [0.5; 3], noise: 0.2, ..good },
        ),
    ];
    Kind::ALL
        .into_iter()
        .flat_map(|kind| looks.map(|(id, about, demand, look)| Scene { id, about, kind, demand, look }))
        .collect()
}

impl Scene {
    /// The board that is photographed.
    pub fn board(&self) -> BoardSpec {
        let diameter = match self.kind {
            Kind::Circles | Kind::Hexagonal => Some(5.0),
            // The nearest neighbours are sqrt(2) spacings away.
            Kind::Asymmetric => Some(7.0),
            Kind::Chessboard | Kind::Charuco | Kind::AprilGrid => None,
        };
        wanted_of(self.kind).board(SPACING, diameter)
    }

    /// What is asked for in a trial.
    pub fn wanted(&self, trial: u64) -> Wanted {
        match self.id {
            "another-size" => of_another_size(self.kind, trial),
            "another-kind" => of_another_kind(self.kind),
            _ => wanted_of(self.kind),
        }
    }

    /// Its name with that of the board.
    pub fn name(&self) -> String {
        format!("{} {}", self.kind.name(), self.id)
    }
}

/// The board of a kind that is photographed.
fn wanted_of(kind: Kind) -> Wanted {
    let (columns, rows) = match kind {
        Kind::Chessboard => (9, 6),
        Kind::Circles => (9, 7),
        Kind::Asymmetric => (4, 11),
        Kind::Hexagonal => (8, 7),
        Kind::Charuco => (7, 5),
        // 6 x 4 tags.
        Kind::AprilGrid => (12, 8),
    };
    let markers = match kind {
        Kind::Charuco => Some(Markers { dictionary: MARKERS, marker: Some(0.72), gap: None }),
        Kind::AprilGrid => Some(Markers { dictionary: "DICT_APRILTAG_36h11", marker: None, gap: Some(0.3) }),
        _ => None,
    };
    Wanted { kind, columns, rows, markers }
}

fn of_another_size(kind: Kind, trial: u64) -> Wanted {
    let wanted = wanted_of(kind);
    let of_four = trial as usize % OTHERS.len();
    let (columns, rows) = match kind {
        Kind::Charuco => (OTHER_WIDTHS[of_four], 0),
        Kind::AprilGrid => (2 * OTHER_WIDTHS[of_four], 0),
        _ => OTHERS[of_four],
    };
    let changed = |marks: usize, by: isize| marks.saturating_add_signed(by);
    Wanted { columns: changed(wanted.columns, columns), rows: changed(wanted.rows, rows), ..wanted }
}

fn of_another_kind(kind: Kind) -> Wanted {
    match kind {
        Kind::Chessboard => wanted_of(Kind::Circles),
        Kind::Circles => wanted_of(Kind::Chessboard),
        Kind::Asymmetric | Kind::Hexagonal => wanted_of(Kind::Circles),
        Kind::AprilGrid => wanted_of(Kind::Charuco),
        Kind::Charuco => {
            let wanted = wanted_of(kind);
            let markers = wanted.markers.map(|markers| Markers { dictionary: OTHER_MARKERS, ..markers });
            Wanted { markers, ..wanted }
        }
    }
}
