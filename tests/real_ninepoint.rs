//! Does the plane calibration reproduce what others published for a real nine-point set?

use calibench::geometry::Handedness;
use calibench::io::read_point_pairs;
use calibench::planar::{PlaneModel, calibrate_plane};

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn the_published_affine_map_is_reproduced() {
    let folder = crate::data::folder();
    let pairs = read_point_pairs(&folder.join("ninepoint/pairs.csv")).unwrap();
    let published = std::fs::read_to_string(folder.join("published.toml")).unwrap();
    let published: toml::Table = published.parse().unwrap();
    let entry = |key: &str| published["ninepoint"][key].clone();

    let fit = calibrate_plane(PlaneModel::Affine, &pairs.pixels, &pairs.world).unwrap();
    for (row, values) in entry("affine").as_array().unwrap().iter().enumerate() {
        for (column, value) in values.as_array().unwrap().iter().enumerate() {
            let value = value.as_float().unwrap();
            let ours = fit.map.matrix()[(row, column)];
            // Published to 13 digits and more.
            assert!((ours - value).abs() <= 1e-12 * value.abs(), "({row}, {column}): {ours} for {value}");
        }
    }
    // Printed to 11 decimals.
    assert!((fit.rms_point - entry("rms_point").as_float().unwrap()).abs() <= 0.5e-11, "{}", fit.rms_point);
    assert!((fit.max_point - entry("max_point").as_float().unwrap()).abs() <= 0.5e-11, "{}", fit.max_point);
    assert_eq!(fit.degrees_of_freedom, 12);
    assert_eq!(fit.handedness, Handedness::Proper);
}
