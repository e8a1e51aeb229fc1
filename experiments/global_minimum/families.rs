//! Which scenes do people have? The distributions of the random scenes, as data with a sentence each.
//!
//! A family is a list of cameras, layouts, and models; scene `i` takes the camera `i mod cameras`, then the
//! layout, then the model, so that any run of neighbouring indices is balanced. Everything else is drawn.

use calibench::camera::{FreeParameters, Parameter::*};

/// How a number is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Draw {
    /// Not at all.
    Is(f64),
    /// Evenly between two bounds.
    Uniform(f64, f64),
    /// Evenly in the logarithm: as much between 1 and 2 as between 2 and 4.
    LogUniform(f64, f64),
}
use Draw::{Is, LogUniform, Uniform};

/// A kind of scene.
#[derive(Debug, Clone, Copy)]
pub struct Family {
    /// Name in kebab-case; keys the random streams.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Scenes in the whole measurement.
    pub scenes: u64,
    /// Cameras taken in turn.
    pub cameras: &'static [Lens],
    /// The target.
    pub target: Target,
    /// Layouts taken in turn.
    pub layouts: &'static [Layout],
    /// Sets of free parameters taken in turn.
    pub models: &'static [Model],
    /// Noise of a pixel coordinate, px.
    pub noise_px: Draw,
    /// Whether the solver is told the image size: probability.
    pub size_given: f64,
}

/// A camera's distribution.
#[derive(Debug, Clone, Copy)]
pub struct Lens {
    /// fx, px.
    pub focal_px: Draw,
    /// fy / fx.
    pub focal_ratio: Draw,
    /// Image width, px.
    pub width_px: Draw,
    /// Width / height, one of these.
    pub aspects: &'static [f64],
    /// Distance of the principal point from the image's centre, parts of width and height: one of these.
    pub centres: &'static [Centre],
    /// k1.
    pub k1: Draw,
    /// k2.
    pub k2: Second,
    /// p1 and p2 where the lens has them, px-free.
    pub tangential: Draw,
    /// Share of lenses with tangential terms among those whose model does not estimate them.
    pub tangential_share: f64,
    /// Whether the lens must be one-to-one out to the farthest corner of the image, and that corner within
    /// [`WIDEST`].
    pub whole_field: bool,
}

/// Largest undistorted radius of an image corner: half a field of 120 degrees. Beyond, nobody uses this lens
/// model.
pub const WIDEST: f64 = 1.75;

/// Where a principal point lies.
#[derive(Debug, Clone, Copy)]
pub enum Centre {
    /// Within this part of width and height of the image's centre.
    Within(f64),
    /// Exactly there.
    At(f64, f64),
}

/// How k2 follows.
#[derive(Debug, Clone, Copy)]
pub enum Second {
    /// By itself.
    Alone(Draw),
    /// So many times k1 squared, as in lenses whose distortion levels off.
    OfSquare(Draw),
    /// One or the other, by a coin.
    Either(Draw, Draw),
}

/// A target's distribution.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Marks in a row.
    pub columns: Draw,
    /// Rows.
    pub rows: Draw,
    /// Distance of neighbouring marks, in the target's unit.
    pub spacing: Draw,
    /// Distance of the origin from the middle of the marks, in widths of the target, along X and Y.
    pub origin: Draw,
}

/// How a target is held.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Name.
    pub name: &'static str,
    /// Number of views.
    pub views: Draw,
    /// Largest tilt against the image plane, degrees.
    pub tilt_deg: Draw,
    /// How the tilts are spread.
    pub tilts: Tilts,
    /// Width of the target over width of the image.
    pub coverage: Draw,
    /// Each view's distance over that of the coverage.
    pub distance: Draw,
    /// Turn about the optical axis, degrees.
    pub roll_deg: Draw,
    /// Where in the image.
    pub places: Places,
}

/// Tilts of the views.
#[derive(Debug, Clone, Copy)]
pub enum Tilts {
    /// From facing to the largest, about random axes.
    UpTo,
    /// Each at the largest, about random axes.
    All,
    /// Between minus and plus the largest, about one axis.
    OneAxis,
    /// Every second view faces the camera, the others have the largest tilt about random axes.
    Mixed,
    /// Every second view faces the camera, the others have the largest tilt about one axis.
    MixedOneAxis,
    /// These rotations `Rz Ry Rx` (degrees) on the axis at these distances; nothing of the layout is drawn.
    Listed(&'static [([f64; 3], f64)]),
}

/// Places of the target in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Places {
    /// Anywhere the whole target fits.
    Anywhere,
    /// In the middle.
    Middle,
    /// Somewhere, the same for every view.
    One,
    /// As near to a corner, the same for every view, as it fits.
    Corner,
}

/// What is estimated, and which lens is photographed.
#[derive(Debug, Clone, Copy)]
pub struct Model {
    /// Name.
    pub name: &'static str,
    /// The free parameters; all others are held at the truth.
    pub free: FreeParameters,
    /// Whether the true lens is ideal.
    pub ideal: bool,
}

const fn model(name: &'static str, free: FreeParameters) -> Model {
    Model { name, free, ideal: false }
}

const CHAPTER: Model = model("k1-k2", FreeParameters::STANDARD);
const LINEAR: Model = model("lens-held", FreeParameters::of(&[Fx, Fy, Cx, Cy]));

/// Half of all users fit two radial terms; the others everything else that is common.
const MODELS: &[Model] = &[
    CHAPTER,
    model("k1-k2-p1-p2", FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2, P1, P2])),
    CHAPTER,
    model("k1", FreeParameters::of(&[Fx, Fy, Cx, Cy, K1])),
    CHAPTER,
    Model { name: "pinhole", free: FreeParameters::of(&[Fx, Fy, Cx, Cy]), ideal: true },
    CHAPTER,
    model("k1-k2-k3", FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2, K3])),
    CHAPTER,
    model("centre-held", FreeParameters::of(&[Fx, Fy, K1, K2])),
    CHAPTER,
    model("k1-k2-p1-p2-k3", FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2, P1, P2, K3])),
    CHAPTER,
    LINEAR,
    CHAPTER,
    model("skew-k1-k2", FreeParameters::of(&[Fx, Fy, Cx, Cy, Skew, K1, K2])),
];

/// Cameras from a wide web camera to a telephoto of many pixels; most principal points near the middle, some
/// far off.
const ANY_CAMERA: Lens = Lens {
    focal_px: LogUniform(250.0, 5000.0),
    focal_ratio: Uniform(0.97, 1.03),
    width_px: LogUniform(640.0, 4000.0),
    aspects: &[4.0 / 3.0, 16.0 / 9.0, 3.0 / 2.0, 5.0 / 4.0, 1.0, 3.0 / 4.0],
    centres: &[
        Centre::Within(0.03),
        Centre::Within(0.03),
        Centre::Within(0.03),
        Centre::Within(0.1),
        Centre::Within(0.2),
    ],
    k1: Uniform(-0.35, 0.2),
    k2: Second::Either(Uniform(-0.1, 0.2), Uniform(0.2, 1.5)),
    tangential: Uniform(-2e-3, 2e-3),
    tangential_share: 0.25,
    whole_field: true,
};

const ANY_TARGET: Target = Target {
    columns: LogUniform(3.0, 20.0),
    rows: LogUniform(3.0, 20.0),
    spacing: LogUniform(0.01, 100.0),
    origin: Uniform(-1.0, 1.0),
};

/// One way to hold a target: anywhere in the image, at distances that vary by a third.
const fn held(name: &'static str, tilts: Tilts, roll: f64) -> Layout {
    Layout {
        name,
        views: LogUniform(2.0, 50.0),
        tilt_deg: LogUniform(2.0, 60.0),
        tilts,
        coverage: Uniform(0.2, 1.0),
        distance: Uniform(0.8, 1.4),
        roll_deg: Uniform(-roll, roll),
        places: Places::Anywhere,
    }
}

/// At one distance within two per cent.
const fn one_distance(layout: Layout) -> Layout {
    Layout { distance: Uniform(0.99, 1.01), ..layout }
}

const ANY_LAYOUT: &[Layout] = &[
    held("up-to", Tilts::UpTo, 180.0),
    held("all", Tilts::All, 20.0),
    one_distance(held("up-to-one-distance", Tilts::UpTo, 20.0)),
    held("mixed", Tilts::Mixed, 20.0),
    held("up-to", Tilts::UpTo, 20.0),
    held("one-axis", Tilts::OneAxis, 20.0),
    one_distance(held("all-one-distance", Tilts::All, 180.0)),
    held("mixed-one-axis", Tilts::MixedOneAxis, 10.0),
    Layout { places: Places::Middle, ..held("up-to-middle", Tilts::UpTo, 180.0) },
];

/// Seven cameras that people own.
const ORDINARY_CAMERAS: &[Lens] = &[
    camera(250.0, 640.0, -0.3, 0.1),
    camera(600.0, 640.0, -0.18, 0.05),
    camera(550.0, 1280.0, -0.25, 0.06),
    camera(1000.0, 1280.0, -0.1, 0.02),
    camera(1600.0, 1920.0, 0.1, -0.05),
    camera(3000.0, 4000.0, 0.02, 0.0),
    camera(5000.0, 1280.0, 0.0, 0.0),
];

const fn camera(focal: f64, width: f64, k1: f64, k2: f64) -> Lens {
    Lens {
        focal_px: Is(focal),
        focal_ratio: Is(1.0),
        width_px: Is(width),
        aspects: &[4.0 / 3.0],
        centres: &[Centre::At(0.0, 0.0)],
        k1: Is(k1),
        k2: Second::Alone(Is(k2)),
        tangential: Is(0.0),
        tangential_share: 0.0,
        whole_field: false,
    }
}

/// A set of views: number, largest tilt, coverage; tilted up to that about random axes.
const fn set(name: &'static str, views: f64, tilt: f64, coverage: f64) -> Layout {
    Layout {
        name,
        views: Is(views),
        tilt_deg: Is(tilt),
        tilts: Tilts::UpTo,
        coverage: Is(coverage),
        distance: Uniform(0.9, 1.2),
        roll_deg: Uniform(-10.0, 10.0),
        places: Places::Anywhere,
    }
}

const ORDINARY_LAYOUTS: &[Layout] = &[
    set("3 views 30 deg", 3.0, 30.0, 0.5),
    set("4 views 20 deg", 4.0, 20.0, 0.5),
    set("5 views 45 deg", 5.0, 45.0, 0.4),
    set("6 views 15 deg", 6.0, 15.0, 0.6),
    set("8 views 30 deg", 8.0, 30.0, 0.3),
    set("10 views 10 deg", 10.0, 10.0, 0.6),
    set("10 views 45 deg", 10.0, 45.0, 0.5),
    set("15 views 20 deg", 15.0, 20.0, 0.4),
    set("20 views 30 deg", 20.0, 30.0, 0.7),
    set("30 views 45 deg", 30.0, 45.0, 0.3),
    set("50 views 20 deg", 50.0, 20.0, 0.5),
];

const fn grid(columns: f64, rows: f64) -> Target {
    Target { columns: Is(columns), rows: Is(rows), spacing: Is(10.0), origin: Is(0.0) }
}

const fn row(name: &'static str, about: &'static str, scenes: u64) -> Family {
    Family {
        name,
        about,
        scenes,
        cameras: &[],
        target: grid(9.0, 6.0),
        layouts: &[],
        models: &[CHAPTER],
        noise_px: Is(0.1),
        size_given: 1.0,
    }
}

const CHAPTER_CAMERA: Lens =
    Lens { centres: &[Centre::At(6.5 / 640.0, 3.5 / 480.0)], ..camera(600.0, 640.0, -0.18, 0.05) };

const fn listed(name: &'static str, poses: &'static [([f64; 3], f64)]) -> Layout {
    Layout { tilts: Tilts::Listed(poses), views: Is(poses.len() as f64), ..set(name, 0.0, 25.0, 0.5) }
}

const THREE_AND_ONE: Layout = listed(
    "3 facing, 1 tilted",
    &[([0.0; 3], 120.0), ([0.0; 3], 140.0), ([0.0; 3], 160.0), ([25.0, 0.0, 0.0], 140.0)],
);

const THREE_AND_THREE: Layout = listed(
    "3 facing, 3 tilted",
    &[
        ([0.0; 3], 120.0),
        ([0.0; 3], 140.0),
        ([0.0; 3], 160.0),
        ([25.0, 0.0, 0.0], 120.0),
        ([25.0, 0.0, 0.0], 140.0),
        ([25.0, 0.0, 0.0], 160.0),
    ],
);

/// All families. The first is the experiment's; the others repeat sets that were seen to fail.
pub const FAMILIES: &[Family] = &[
    Family {
        name: "any",
        about: "anything: 250 to 5000 px at 640 to 4000 px wide, 3 x 3 to 20 x 20 marks, 2 to 50 views, tilts of 2 to 60 degrees",
        scenes: 20_000,
        cameras: &[ANY_CAMERA],
        target: ANY_TARGET,
        layouts: ANY_LAYOUT,
        models: MODELS,
        noise_px: LogUniform(0.01, 2.0),
        size_given: 0.5,
    },
    Family {
        cameras: ORDINARY_CAMERAS,
        layouts: ORDINARY_LAYOUTS,
        ..row("ordinary", "seven cameras, eleven sets of views, 9 x 6 marks, centred principal point", 3080)
    },
    Family {
        cameras: &[camera(550.0, 1280.0, -0.25, 0.06)],
        target: grid(11.0, 8.0),
        layouts: &[set("50 views 20 deg", 50.0, 20.0, 0.3)],
        noise_px: Is(0.5),
        ..row(
            "wide-many",
            "fx 550, 1280 x 960, k1 -0.25, 11 x 8, 50 views, tilts 0 to 20 degrees, 0.5 px",
            54,
        )
    },
    Family {
        cameras: &[Lens { centres: &[Centre::At(-0.19, 0.18)], ..camera(550.0, 1280.0, -0.25, 0.06) }],
        target: grid(11.0, 8.0),
        layouts: &[set("50 views 20 deg", 50.0, 20.0, 0.3)],
        noise_px: Is(0.5),
        ..row(
            "wide-many-off-centre",
            "the same, principal point (-0.19, 0.18) of the image off its centre",
            54,
        )
    },
    Family {
        cameras: &[camera(250.0, 640.0, -0.3, 0.1)],
        layouts: &[set("8 views 10 deg", 8.0, 10.0, 0.5)],
        ..row("wide-few", "fx 250, 640 x 480, k1 -0.3, k2 0.1, 9 x 6, 8 views, 10 degrees, 0.1 px", 53)
    },
    Family {
        cameras: &[camera(250.0, 640.0, -0.3, 0.1)],
        target: grid(7.0, 5.0),
        layouts: &[set("12 views 5 deg", 12.0, 5.0, 0.5)],
        ..row("wide-flat", "the same lens, 7 x 5, 12 views, 5 degrees", 53)
    },
    Family {
        cameras: &[camera(5000.0, 1280.0, 0.0, 0.0)],
        layouts: &[set("10 views 50 deg", 10.0, 50.0, 0.2)],
        noise_px: Is(0.5),
        ..row("tele", "fx 5000, 1280 x 960, 9 x 6, 10 views, 50 degrees, coverage 0.2, 0.5 px", 40)
    },
    Family {
        cameras: &[CHAPTER_CAMERA],
        target: grid(9.0, 7.0),
        layouts: &[THREE_AND_ONE],
        models: &[LINEAR],
        ..row(
            "three-and-one",
            "three facing views at 120, 140, 160 mm and one tilted 25 degrees about X, lens held",
            200,
        )
    },
    Family {
        cameras: &[CHAPTER_CAMERA],
        target: grid(9.0, 7.0),
        layouts: &[THREE_AND_THREE],
        models: &[LINEAR],
        ..row("three-and-three", "three facing and three tilted 25 degrees about X, fx fy cx cy free", 200)
    },
    Family {
        cameras: &[camera(4000.0, 4000.0, 0.0, 0.0)],
        layouts: &[Layout { places: Places::Corner, ..set("8 views 40 deg", 8.0, 40.0, 0.04) }],
        models: &[LINEAR],
        noise_px: Is(0.01),
        size_given: 0.0,
        ..row("corner", "4000 x 3000, f 4000, target 160 px wide in a corner, no image size, 0.01 px", 50)
    },
    Family {
        cameras: &[camera(1000.0, 1280.0, 0.0, 0.0)],
        layouts: &[Layout {
            tilts: Tilts::All,
            places: Places::One,
            ..set("4 views 30 deg", 4.0, 30.0, 0.2)
        }],
        models: &[LINEAR],
        noise_px: Is(0.01),
        size_given: 0.0,
        ..row(
            "one-place",
            "pinhole, four tilts of 30 degrees at one place off the axis, no image size, 0.01 px",
            50,
        )
    },
];
