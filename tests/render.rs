//! The virtual camera's images against independent integration of the same scene.

use calibench::board::Board;
use calibench::camera::{BrownConrady, Camera, Lens, Model};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::synth::render::{
    Appearance, Imaging, RenderError, SensorNoise, Shading, Surround, nine_dot_stand_in, photograph,
};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Stream, StreamKey, Truth};

/// The board point that a pixel sees: the camera model inverted, then the ray met with the plane Z = 0.
fn board_point(camera: &Camera<Lens>, cam_from_target: &Pose, pixel: &Vec2) -> Vec2 {
    let ray = camera.ray(pixel).unwrap();
    let target_from_cam = cam_from_target.inverse();
    let direction = target_from_cam.rotation * ray;
    let origin = target_from_cam.translation;
    (origin - direction * (origin.z / direction.z)).xy()
}

/// Mean of the board's level over the square of a pixel from `n x n` point samples.
fn supersampled(level: &dyn Fn(&Vec2) -> f64, pixel: (usize, usize), n: usize) -> f64 {
    let offset = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
    let sum: f64 = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .map(|(i, j)| level(&Vec2::new(pixel.0 as f64 + offset(i), pixel.1 as f64 + offset(j))))
        .sum();
    sum / (n * n) as f64
}

/// Largest difference between a rendered image and supersampling, over a scatter of pixels with partial
/// coverage.
fn largest_difference(board: &Board, ink: &dyn Fn(&Vec2) -> bool) -> (f64, usize) {
    let camera = Truth::example_camera().with_distortion(BrownConrady {
        k1: -0.18,
        k2: 0.05,
        p1: 2e-3,
        p2: -1e-3,
        k3: 0.01,
    });
    largest_difference_of(&camera.into(), &looking_at_centre([-25.0, 30.0, 10.0], 150.0), board, ink)
}

fn largest_difference_of(
    camera: &Camera<Lens>,
    pose: &Pose,
    board: &Board,
    ink: &dyn Fn(&Vec2) -> bool,
) -> (f64, usize) {
    let photo = photograph(camera, (640, 480), board, pose, &Imaging::default()).unwrap();
    let level = |pixel: &Vec2| if ink(&board_point(camera, pose, pixel)) { 0.1 } else { 0.85 };
    let (mut largest, mut tested) = (0.0f64, 0);
    for y in 0..480 {
        for x in 0..640 {
            let seen = f64::from(photo.image.get(x, y));
            if (0.11..0.84).contains(&seen) && (7 * x + 13 * y) % 29 == 0 {
                largest = largest.max((seen - supersampled(&level, (x, y), 48)).abs());
                tested += 1;
            }
        }
    }
    (largest, tested)
}

// An edge pixel of n x n samples is wrong by about sqrt(n) / n^2 samples (3e-3 at n = 48), five times that in
// the worst of hundreds, times the contrast 0.75.
const SUPERSAMPLING_PX: f64 = 5.0 * 3e-3 * 0.75;

#[test]
fn discs_cover_what_supersampling_finds() {
    let board = Truth::example_board();
    let centres = board.points();
    let ink = |p: &Vec2| centres.iter().any(|c| (p - c).norm() < 1.5);
    let (largest, tested) = largest_difference(&board, &ink);
    assert!(tested > 50 && largest < SUPERSAMPLING_PX, "{largest} over {tested}");
}

/// Whether a point of a chessboard of 9 x 7 corners, 10 apart, is dark.
fn is_dark(p: &Vec2) -> bool {
    let (i, j) = ((p.x + 50.0) / 10.0, (p.y + 40.0) / 10.0);
    (0.0..10.0).contains(&i) && (0.0..8.0).contains(&j) && (i.floor() + j.floor()) as i64 % 2 == 0
}

#[test]
fn squares_cover_what_supersampling_finds() {
    let board = Board::chessboard(9, 7, 10.0).unwrap();
    let (largest, tested) = largest_difference(&board, &is_dark);
    assert!(tested > 200 && largest < SUPERSAMPLING_PX, "{largest} over {tested}");
}

#[test]
fn every_lens_shows_what_its_rays_meet() {
    let board = Board::chessboard(9, 7, 10.0).unwrap();
    let pose = looking_at_centre([-25.0, 30.0, 10.0], 150.0);
    let coefficients: [(Model, &[f64]); 7] = [
        (Model::Rational, &[-0.2, 0.05, 0.001, -0.001, 0.01, 0.02, 0.01, 0.003]),
        (
            Model::ThinPrism,
            &[-0.2, 0.05, 0.001, -0.001, 0.01, 0.02, 0.01, 0.003, 0.002, -0.001, 0.001, 0.002],
        ),
        (
            Model::Tilted,
            &[-0.2, 0.05, 0.001, -0.001, 0.01, 0.02, 0.01, 0.003, 0.002, -0.001, 0.001, 0.002, 0.03, -0.02],
        ),
        (Model::KannalaBrandt, &[-0.03, 0.004, 0.001, -0.0005]),
        (Model::Division, &[-0.2]),
        (Model::DoubleSphere, &[-0.1, 0.55]),
        (Model::HalconPolynomial, &[0.2, 0.03, 0.001, -0.001, 0.01]),
    ];
    for (model, coefficients) in coefficients {
        let lens = Lens::new(model, coefficients).unwrap();
        let camera = Camera::with_lens(500.0, 505.0, 326.0, 243.0, lens);
        let (largest, tested) = largest_difference_of(&camera, &pose, &board, &is_dark);
        assert!(tested > 150 && largest < SUPERSAMPLING_PX, "{model}: {largest} over {tested}");
    }
}

/// A board that stands beside the camera, from before it to behind it.
#[test]
fn a_fisheye_sees_a_board_beside_and_behind_it() {
    let board = Board::chessboard(9, 7, 10.0).unwrap();
    let lens = Lens::new(Model::KannalaBrandt, &[0.0; 4]).unwrap();
    let camera = Camera::with_lens(130.0, 130.0, 320.0, 240.0, lens);
    // Its normal points along X; its rows lie along the optical axis.
    let rotation = rotation::exp(&Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    let pose = Pose { rotation, translation: Vec3::new(60.0, 0.0, 10.0) };
    let photo = photograph(&camera, (640, 480), &board, &pose, &Imaging::default()).unwrap();
    let depths = board.points().iter().map(|p| pose.apply(&Vec3::new(p.x, p.y, 0.0)).z).collect::<Vec<_>>();
    assert!(depths.iter().any(|&z| z < -25.0) && depths.iter().any(|&z| z > 45.0), "{depths:?}");
    for (point, centre) in board.points().iter().zip(&photo.centres_true) {
        let seen = pose.apply(&Vec3::new(point.x, point.y, 0.0));
        let angle = libm::atan2(seen.xy().norm(), seen.z);
        let expected = Vec2::new(320.0, 240.0) + seen.xy().normalize() * (130.0 * angle);
        assert!((centre - expected).norm() < 1e-9, "{point}");
    }
    let (largest, tested) = largest_difference_of(&camera, &pose, &board, &is_dark);
    assert!(tested > 100 && largest < SUPERSAMPLING_PX, "{largest} over {tested}");
    // A camera that sees what is before it does not see this.
    let refused = photograph(
        &Camera::with_lens(500.0, 500.0, 320.0, 240.0, Lens::ideal(Model::Rational)),
        (640, 480),
        &board,
        &pose,
        &Imaging::default(),
    );
    assert!(matches!(refused, Err(RenderError::BeyondMonotoneAngle { .. })), "{:?}", refused.err());
}

#[test]
fn a_board_seen_from_behind_keeps_its_levels() {
    let pose = looking_at_centre([180.0, 0.0, 0.0], 120.0);
    let photo =
        photograph(&Truth::example_camera(), (640, 480), &Truth::example_board(), &pose, &Imaging::default());
    let image = photo.unwrap().image;
    let darkest = image.samples().iter().copied().fold(1.0, f32::min);
    let brightest = image.samples().iter().copied().fold(0.0, f32::max);
    assert!((darkest - 0.1).abs() < 1e-6 && (brightest - 0.85).abs() < 1e-6);
}

#[test]
fn blur_moves_light_but_makes_none() {
    let total = |blur_px: f64| -> f64 {
        let imaging = Imaging { blur_px, ..Imaging::default() };
        let board = Truth::example_board();
        let pose = Truth::example_poses()[3];
        let photo = photograph(&Truth::example_camera(), (640, 480), &board, &pose, &imaging).unwrap();
        photo.image.samples().iter().map(|&x| 0.85 - f64::from(x)).sum()
    };
    // 307 200 samples rounded to f32 near 0.85: each 3e-8 at most, the same for all paper pixels.
    let sharp = total(0.0);
    assert!((total(0.8) / sharp - 1.0).abs() < 1e-5);
    assert!((total(3.0) / sharp - 1.0).abs() < 1e-5);
}

#[test]
fn the_surround_shading_and_noise_enter_where_they_should() {
    let appearance =
        Appearance { surround: Some(Surround { level: 0.3, margin: 8.0 }), ..Appearance::default() };
    let shading = Shading { slope_x: 0.2, ..Shading::default() };
    let imaging = Imaging { appearance, shading, ..Imaging::default() };
    let pose = looking_at_centre([0.0; 3], 150.0);
    let photo =
        photograph(&Truth::example_camera(), (640, 480), &Truth::example_board(), &pose, &imaging).unwrap();
    let left = f64::from(photo.image.get(0, 240));
    assert!((left / 0.3 - 0.8).abs() < 1e-3, "{left}");
    let key = StreamKey { seed: 3, scenario: "render", trial: 0, purpose: "noise" };
    let noise = SensorNoise::constant(0.01);
    let noisy = photo.clone().with_noise(&noise, &mut Stream::open(key));
    let again = photo.clone().with_noise(&noise, &mut Stream::open(key));
    assert_eq!(noisy, again);
    assert_ne!(noisy.image, photo.image);
    assert_eq!(noisy.centres_true, photo.centres_true);
}

#[test]
fn the_nine_dot_stand_in_has_the_published_geometry() {
    let photo = nine_dot_stand_in();
    assert_eq!((photo.image.width(), photo.image.height()), (1571, 1053));
    let c = &photo.centres_true;
    assert!((c[4] - Vec2::new(714.708, 565.993)).norm() < 1e-12);
    assert!((c[5].x - c[4].x - 236.23).abs() < 1e-12 && (c[7].y - c[4].y - 236.19).abs() < 1e-12);
    assert!(photo.image.get(715, 566) < 0.11 && photo.image.get(600, 450) > 0.84);
}

#[test]
fn what_cannot_be_seen_is_refused_with_its_place() {
    let see = |camera: &Camera, pose: &Pose, imaging: &Imaging| {
        photograph(camera, (640, 480), &Truth::example_board(), pose, imaging).unwrap_err()
    };
    let camera = Truth::example_camera();
    let close = looking_at_centre([80.0, 0.0, 0.0], 20.0);
    assert!(matches!(see(&camera, &close, &Imaging::default()), RenderError::BehindCamera { .. }));
    let folding = camera.with_distortion(BrownConrady::radial(-2.0, 0.0));
    let front = looking_at_centre([0.0; 3], 120.0);
    assert!(matches!(see(&folding, &front, &Imaging::default()), RenderError::BeyondMonotoneRadius { .. }));
    for blur_px in [-1.0, f64::NAN, 1e9] {
        let imaging = Imaging { blur_px, ..Imaging::default() };
        assert!(matches!(see(&camera, &front, &imaging), RenderError::Setting { name: "blur_px", .. }));
    }
}
