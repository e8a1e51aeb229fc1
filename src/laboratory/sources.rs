//! Which sources make the answers of the laboratory? The build script and the test that looks whether the
//! committed WebAssembly is stale read the same list.

/// Folders and files whose lines change an answer, below the root of the project.
pub const SOURCES: &[&str] = &[
    "src/calibench/board",
    "src/calibench/calibrate",
    "src/calibench/camera",
    "src/calibench/distribution.rs",
    "src/calibench/evaluate",
    "src/calibench/geometry",
    "src/calibench/planar",
    "src/calibench/raster",
    "src/calibench/rectify",
    "src/calibench/synth/scene.rs",
    "src/calibench/synth/stream.rs",
    "src/laboratory",
];
