//! A small study for the tests of this crate.

/// Two cells of three trials each, in batches of two.
pub(super) const STUDY: &str = r#"
name = "two-cells"
question = "Are foreign trials refused?"
seed = 1

[scene]
image = [640, 480]
camera = { fx = 600.0, fy = 600.0, cx = 320.0, cy = 240.0 }
target = { columns = 3, rows = 3, spacing_mm = 10.0 }
poses = { kind = "spread", views = 3, tilt_deg = 30.0, distance_mm = 150.0 }
noise_px = 0.1

[trials]
per_cell = 3
batch = 2

[[factor]]
name = "noise"
set = ["scene.noise_px"]
levels = [0.1, 0.3]
"#;
