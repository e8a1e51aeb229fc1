//! Who is asked, how often, and what is fair to say of each?

use calibench::io::sha256_hex;

/// A program and what was committed of its trials.
pub struct Program {
    /// Its name, and that of its file in golden/other-solvers/.
    pub name: &'static str,
    /// The first trials of each cell that it is asked: the slower the fewer.
    pub trials: u64,
    /// Adapter, and the files that it is made of; none for this library's solver.
    pub adapter: Option<(&'static str, &'static [&'static str])>,
    /// Modules of Python whose versions are told.
    pub modules: &'static [&'static str],
    /// Whether pixels are read in single precision.
    pub is_single_precision: bool,
    /// What was committed.
    pub committed: &'static str,
    /// What is fair to say of it.
    pub note: &'static str,
}

const MINIMAL: &str = include_str!("../../adapters/minimal_solver.py");

/// This library first.
pub const PROGRAMS: [Program; 5] = [
    Program {
        name: "calibench",
        trials: 200,
        adapter: None,
        modules: &[],
        is_single_precision: false,
        committed: include_str!("../../golden/other-solvers/calibench.csv"),
        note: "whose study this is; states a covariance, and warns or refuses where data tell little",
    },
    Program {
        name: "opencv",
        trials: 200,
        adapter: Some(("opencv_solver.py", &[include_str!("../../adapters/opencv_solver.py")])),
        modules: &["cv2", "numpy"],
        is_single_precision: true,
        committed: include_str!("../../golden/other-solvers/opencv.csv"),
        note: "200 iterations to machine precision, its own start; its binding takes points in single precision; states standard deviations, no covariance",
    },
    Program {
        name: "colmap",
        trials: 200,
        adapter: Some(("colmap_solver.py", &[include_str!("../../adapters/colmap_solver.py"), MINIMAL])),
        modules: &["pycolmap", "numpy"],
        is_single_precision: false,
        committed: include_str!("../../golden/other-solvers/colmap.csv"),
        note: "its bundle adjustment, made for scenes, 200 iterations to machine precision; start and what is held are the adapter's",
    },
    Program {
        name: "scipy",
        trials: 16,
        adapter: Some(("scipy_solver.py", &[include_str!("../../adapters/scipy_solver.py"), MINIMAL])),
        modules: &["scipy", "numpy"],
        is_single_precision: false,
        committed: include_str!("../../golden/other-solvers/scipy.csv"),
        note: "a general solver: camera, start and covariance are the adapter's, search and finite differences SciPy's",
    },
    Program {
        name: "minimal",
        trials: 100,
        adapter: Some(("minimal_solver.py", &[MINIMAL])),
        modules: &["numpy"],
        is_single_precision: false,
        committed: include_str!("../../golden/other-solvers/minimal.csv"),
        note: "200 lines of NumPy, a model for adapters; refuses where its normal equations are nearly singular",
    },
];

/// Digits of an adapter's hash that are kept.
const DIGITS: usize = 16;

impl Program {
    /// The command that writes what is committed.
    pub fn command(&self) -> String {
        format!("cargo run --release --bin other-solvers-trials -- {}", self.name)
    }

    /// SHA-256 of the adapter, shortened; `none` for this library's solver.
    pub fn adapter_hash(&self) -> String {
        self.adapter.map_or("none".to_string(), |(_, files)| {
            sha256_hex(files.concat().as_bytes())[..DIGITS].to_string()
        })
    }

    /// The words of the first line that follow `key`.
    pub fn told(&self, key: &str) -> Option<&'static str> {
        let head = self.committed.lines().next()?.trim_start_matches("# ");
        head.split("; ").find_map(|part| part.strip_prefix(key)?.strip_prefix(' '))
    }
}
