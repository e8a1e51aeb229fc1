//! Who is shown the photographs, and what is fair to say of each?

use calibench::io::sha256_hex;
use calibench_detector_gate::protocol::Kind;

/// A program.
pub struct Program {
    /// Its name, and that of its file in golden/detector-gate/.
    pub name: &'static str,
    /// What finds each kind of board, in the order of [`Kind::ALL`]; `None` where it is not asked for them.
    pub finders: [Option<&'static str>; Kind::ALL.len()],
    /// The argument of the adapter; none for this library's detectors.
    pub method: Option<&'static str>,
    /// What is fair to say of it.
    pub note: &'static str,
}

/// What answers for OpenCV.
const ADAPTER: &str = include_str!("../../adapters/detector_opencv.py");

/// This library first.
pub const PROGRAMS: [Program; 3] = [
    Program {
        name: "calibench",
        finders: [
            Some("saddles and an edge model"),
            Some("edges of discs"),
            Some("edges of discs"),
            Some("edges of discs"),
            Some("markers, and the edge model"),
            Some("markers, and the edge model"),
        ],
        method: None,
        note: "whose scenes these are: they were written beside its detectors, which were mended where a scene showed a fault",
    },
    Program {
        name: "opencv",
        finders: [
            Some("findChessboardCorners, cornerSubPix"),
            Some("findCirclesGrid"),
            Some("findCirclesGrid"),
            None,
            Some("CharucoDetector"),
            Some("ArucoDetector, cornerSubPix"),
        ],
        method: Some("classic"),
        note: "as in its tutorial: a window of 11 x 11 px for cornerSubPix, the usual blob detector for discs; other windows and thresholds may suit a scene better; its detector of tags knows no board, and its marks are \
               taken by their numbers",
    },
    Program {
        name: "opencv-sb",
        finders: [Some("findChessboardCornersSB"), None, None, None, None, None],
        method: Some("sb"),
        note: "no flags; it knows chessboards alone, and refines by itself",
    },
];

/// Digits of the adapter's hash that are kept.
const DIGITS: usize = 16;

impl Program {
    /// Whether it is shown such boards.
    pub fn knows(&self, kind: Kind) -> bool {
        self.finders[kind as usize].is_some()
    }

    /// The command that writes what is committed.
    pub fn command(&self) -> String {
        format!("cargo run --release --bin detector-gate-trials -- {}", self.name)
    }

    /// SHA-256 of the adapter, shortened; `none` for this library's detectors.
    pub fn adapter_hash(&self) -> String {
        self.method.map_or("none".to_string(), |_| sha256_hex(ADAPTER.as_bytes())[..DIGITS].to_string())
    }
}
