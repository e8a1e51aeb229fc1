//! Does rectification make straight what is straight, with the true lens and with a calibrated one?

use calibench::calibrate::single_plane::{SinglePlaneOptions, calibrate_single_plane};
use calibench::camera::{BrownConrady, Camera};
use calibench::geometry::Vec2;
use calibench::raster::Raster;
use calibench::rectify::{OutputView, RectifyMap, output_camera, rectify_points};
use calibench::synth::{Scene, Truth};

const SIZE: (usize, usize) = Truth::EXAMPLE_IMAGE;

/// A photograph of a grey edge that is straight for an ideal lens: intensity rises by 1/8 a pixel across the
/// line `v = 60 + 0.05 u`, from black to white.
fn photograph_of_an_edge(camera: &Camera) -> Raster<f32> {
    let across = |ideal: Vec2| (ideal.y - 60.0 - 0.05 * ideal.x) / 1.0025f64.sqrt();
    Raster::from_fn(SIZE.0, SIZE.1, |x, y| {
        let ideal = camera.correct_pixel(&Vec2::new(x as f64, y as f64)).unwrap();
        (0.5 + across(ideal) / 8.0).clamp(0.0, 1.0) as f32
    })
}

/// Where each column passes the middle grey, by linear interpolation; columns that have data about it.
fn edge_of(image: &Raster<f32>, mask: &Raster<bool>) -> Vec<Vec2> {
    let crossing = |x: usize| {
        (1..image.height()).find_map(|y| {
            let (above, below) = (f64::from(image.get(x, y - 1)), f64::from(image.get(x, y)));
            let seen = mask.get(x, y - 1) && mask.get(x, y);
            (seen && above < 0.5 && below >= 0.5)
                .then(|| Vec2::new(x as f64, (y - 1) as f64 + (0.5 - above) / (below - above)))
        })
    };
    (0..image.width()).filter_map(crossing).collect()
}

#[test]
fn a_bent_edge_is_straight_in_the_rectified_image() {
    let camera = Truth::example_camera();
    let output = output_camera(&camera, SIZE, OutputView::SameK).unwrap();
    let map = RectifyMap::between(&camera, SIZE, &output, SIZE).unwrap();
    let photograph = photograph_of_an_edge(&camera);
    let off = |edge: &[Vec2]| edge.iter().map(|p| (p.y - 60.0 - 0.05 * p.x).abs()).fold(0.0, f64::max);

    let everywhere = Raster::filled(SIZE.0, SIZE.1, true);
    let bent = edge_of(&photograph, &everywhere);
    assert!(bent.len() > 500 && off(&bent) > 3.0, "the photograph's edge must be bent: {}", off(&bent));

    let straight = edge_of(&map.apply(&photograph, 0.0).unwrap(), &map.mask());
    assert!(straight.len() > 600, "{}", straight.len());
    // Bilinear sampling of a ramp whose level lines have the curvature k errs by k / 8 px in either
    // direction, twice (photograph and crossing); the lens bends this line by at most 12 px over 640, k = 8 *
    // 12 / 640^2 = 2.3e-4 a px. f32 adds 1e-6.
    assert!(off(&straight) < 2.0 * 2.0 * 2.3e-4 / 8.0, "{:e}", off(&straight));
}

#[test]
fn the_chapters_line_is_recovered_exactly() {
    let camera = Truth::example_camera();
    let output = camera.with_distortion(BrownConrady::default());
    let ideal: Vec<Vec2> = (0..61).map(|i| Vec2::new(20.0 + 10.0 * f64::from(i), 60.0)).collect();
    let seen: Vec<Vec2> = ideal.iter().map(|p| camera.distort_pixel(p)).collect();
    for (point, shown) in ideal.iter().zip(rectify_points(&camera, &output, &seen)) {
        // Two maps of pixels near 640 at a few ulp each: 640 eps is 1.4e-13.
        assert!((shown.unwrap() - point).norm() < 1e-12);
    }
}

#[test]
fn a_lens_calibrated_from_one_exact_view_rectifies_as_the_true_one() {
    let chapter = Truth::example();
    let scene = Scene::new(Truth { cam_from_target: vec![chapter.cam_from_target[0]], ..chapter }).unwrap();
    let truth = scene.truth.camera;
    let options =
        SinglePlaneOptions { focal_px: 600.0, centre_px: Vec2::new(320.0, 240.0), centre_free: true };
    let fit = calibrate_single_plane(&scene.exact()[0], &options).unwrap();

    let ideal = |camera: &Camera| camera.with_distortion(BrownConrady::default());
    let by_truth = RectifyMap::between(&truth, SIZE, &ideal(&truth), SIZE).unwrap();
    let lens = fit.lens_camera();
    // The same output camera for both, and the calibrated lens given as a plain function.
    let by_fit = RectifyMap::new(SIZE, SIZE, |pixel| Some(lens.distort_pixel(pixel))).unwrap();
    let differing =
        by_truth.mask().samples().iter().zip(by_fit.mask().samples()).filter(|(a, b)| a != b).count();
    assert_eq!(differing, 0);
    let photograph = photograph_of_an_edge(&truth).to_u16();
    let (a, b) = (by_truth.apply(&photograph, 0).unwrap(), by_fit.apply(&photograph, 0).unwrap());
    // The lenses agree to 1e-8 px, f32 weights to 6e-8: far below a level of 65536 over an edge of 8 px, but
    // for a rounding.
    assert!(a.samples().iter().zip(b.samples()).all(|(a, b)| a.abs_diff(*b) <= 1));
}
