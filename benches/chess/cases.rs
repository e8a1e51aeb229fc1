//! Under which conditions are boards looked for? One row a case; all else is a sharp, well lit photograph.

/// A condition.
pub struct Case {
    pub name: &'static str,
    /// Width and height, px.
    pub size: (usize, usize),
    /// Least and largest tilt, degrees.
    pub tilt: (f64, f64),
    /// Standard deviation of a sample's noise, as part of the range.
    pub noise: f64,
    /// Standard deviation of the lens's blur, px.
    pub blur_px: f64,
    /// Length of the motion during the exposure, px.
    pub motion_px: f64,
    /// Levels of dark squares, bright squares and of what surrounds the board.
    pub levels: [f64; 3],
    /// Radial distortion k1, k2.
    pub lens: [f64; 2],
    /// Focal length as part of the image's width.
    pub focal: f64,
    /// Largest distance of the board, where 1 fills the image.
    pub far: f64,
    /// Change of the light from the centre to the edges.
    pub light: f64,
}

const VGA: (usize, usize) = (640, 480);
const TWO: (usize, usize) = (2000, 1500);
const LARGE: (usize, usize) = (4000, 3000);

const CLEAN: Case = Case {
    name: "clean",
    size: VGA,
    tilt: (0.0, 40.0),
    noise: 0.0,
    blur_px: 0.6,
    motion_px: 0.0,
    levels: [0.1, 0.85, 0.5],
    lens: [-0.18, 0.05],
    focal: 0.9375,
    far: 1.6,
    light: 0.0,
};

/// The conditions.
pub const CASES: &[Case] = &[
    CLEAN,
    Case { name: "no blur", blur_px: 0.0, ..CLEAN },
    Case { name: "far", far: 3.0, ..CLEAN },
    Case { name: "noise 1 %", noise: 0.01, ..CLEAN },
    Case { name: "noise 2 %", noise: 0.02, ..CLEAN },
    Case { name: "noise 4 %", noise: 0.04, ..CLEAN },
    Case { name: "noise 12 %", noise: 0.12, ..CLEAN },
    Case { name: "blur 1 px", blur_px: 1.0, noise: 0.005, ..CLEAN },
    Case { name: "blur 2 px", blur_px: 2.0, noise: 0.005, ..CLEAN },
    Case { name: "blur 3 px", blur_px: 3.0, noise: 0.005, ..CLEAN },
    Case { name: "tilt 45-60", tilt: (45.0, 60.0), noise: 0.005, ..CLEAN },
    Case { name: "tilt 60-65", tilt: (60.0, 65.0), noise: 0.005, ..CLEAN },
    Case { name: "tilt 65-70", tilt: (65.0, 70.0), noise: 0.005, ..CLEAN },
    Case { name: "tilt 65-70, 1280 x 960", size: (1280, 960), tilt: (65.0, 70.0), noise: 0.005, ..CLEAN },
    Case { name: "motion 8 px", motion_px: 8.0, noise: 0.005, ..CLEAN },
    Case { name: "motion 12 px", motion_px: 12.0, noise: 0.005, ..CLEAN },
    Case { name: "contrast .06 beside bright", levels: [0.24, 0.30, 0.97], noise: 0.003, ..CLEAN },
    Case { name: "contrast .06, noise 1 %", levels: [0.24, 0.30, 0.97], noise: 0.01, ..CLEAN },
    Case { name: "dark surround", levels: [0.1, 0.85, 0.1], noise: 0.005, ..CLEAN },
    Case { name: "uneven light", light: 0.6, noise: 0.005, ..CLEAN },
    Case { name: "wide lens", lens: [-0.3, 0.1], focal: 0.5, noise: 0.005, ..CLEAN },
    Case { name: "2000 x 1500, noise 4 %", size: TWO, noise: 0.04, blur_px: 1.0, ..CLEAN },
    Case { name: "4000 x 3000, clean", size: LARGE, blur_px: 1.0, ..CLEAN },
    Case { name: "4000 x 3000, noise 2 %", size: LARGE, noise: 0.02, blur_px: 1.0, ..CLEAN },
    Case { name: "4000 x 3000, noise 4 %, blur 3 px", size: LARGE, noise: 0.04, blur_px: 3.0, ..CLEAN },
    Case { name: "4000 x 3000, far", size: LARGE, noise: 0.01, blur_px: 1.0, far: 8.0, ..CLEAN },
];
