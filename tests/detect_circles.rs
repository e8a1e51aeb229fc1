//! Circle grids and sparse dots on rendered images: order, refusals, and the accuracy of centres against
//! theory.

use calibench::board::Board;
use calibench::camera::{BrownConrady, Camera};
use calibench::detect::{
    BlobOptions, DotGrid, GridError, Polarity, blobs, circle_grid, circle_grid_of, disc_biases, sparse_dots,
};
use calibench::geometry::{Pose, Vec2};
use calibench::raster::Raster;
use calibench::synth::render::{
    Appearance, Imaging, Photograph, SensorNoise, Shading, nine_dot_stand_in, photograph,
};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Stream, StreamKey, Truth};

fn chapter_photo(pose: &Pose, imaging: &Imaging) -> Photograph {
    photograph(&Truth::example_camera(), (640, 480), &Truth::example_board(), pose, imaging).unwrap()
}

/// RMS distance of detected centres, corrected for the bias of their discs, to the true ones.
fn corrected_rms_px(grid: &DotGrid, photo: &Photograph, biases: &[Vec2]) -> f64 {
    let pairs = grid.centres_px().into_iter().zip(&photo.centres_true).zip(biases);
    let square: f64 = pairs.map(|((seen, truth), bias)| (seen - bias - truth).norm_squared()).sum();
    (square / biases.len() as f64).sqrt()
}

#[test]
fn corrected_centres_are_within_a_hundredth_of_a_pixel() {
    for tilt in [
        [0.0; 3],
        [20.0, 0.0, 0.0],
        [0.0, -20.0, 0.0],
        [-15.0, 15.0, 10.0],
        [40.0, 0.0, 0.0],
        [0.0, 40.0, 0.0],
    ] {
        let pose = looking_at_centre(tilt, 120.0);
        let biases = disc_biases(&Truth::example_camera(), &pose, &Truth::example_board()).unwrap();
        for blur_px in [0.0, 0.5, 1.0] {
            let photo = chapter_photo(&pose, &Imaging { blur_px, ..Imaging::default() });
            // The target of the project. Measured: 0.0005 to 0.0014 px.
            let rms = corrected_rms_px(&circle_grid(&photo.image, 9, 7).unwrap(), &photo, &biases);
            assert!(rms < 0.01, "tilt {tilt:?}, blur {blur_px}: {rms}");
            let quantised = circle_grid(&photo.image.to_u8(), 9, 7).unwrap();
            let rms = corrected_rms_px(&quantised, &photo, &biases);
            assert!(rms < 0.01, "8 bit, tilt {tilt:?}, blur {blur_px}: {rms}");
        }
    }
}

#[test]
fn without_correction_the_bias_of_tilted_discs_remains() {
    let pose = looking_at_centre([40.0, 0.0, 0.0], 120.0);
    let photo = chapter_photo(&pose, &Imaging::default());
    let grid = circle_grid(&photo.image, 9, 7).unwrap();
    let none = vec![Vec2::zeros(); 63];
    let biases = disc_biases(&Truth::example_camera(), &pose, &Truth::example_board()).unwrap();
    let predicted = (biases.iter().map(Vec2::norm_squared).sum::<f64>() / 63.0).sqrt();
    let seen = corrected_rms_px(&grid, &photo, &none);
    assert!(predicted > 0.04 && (seen - predicted).abs() < 0.003, "{seen} {predicted}");
}

/// The Cramer-Rao bound of a disc's centre, levels and shape known: `sigma^2 (sum g g^T)^-1` over the pixels
/// around it, with `g` the image's derivative by a shift, from renders shifted by `+-h`. RMS over the discs
/// of the distance, px.
fn bound_px(pose: &Pose, imaging: &Imaging, sigma: f64) -> f64 {
    let h = 0.02;
    let board = Truth::example_board();
    let shifted = |du: f64, dv: f64| -> Photograph {
        let camera = Truth::example_camera();
        let moved = Camera { cx: camera.cx + du, cy: camera.cy + dv, ..camera };
        photograph(&moved, (640, 480), &board, pose, imaging).unwrap()
    };
    let (right, left, down, up) = (shifted(h, 0.0), shifted(-h, 0.0), shifted(0.0, h), shifted(0.0, -h));
    let slope = |ahead: &Photograph, behind: &Photograph, x: usize, y: usize| {
        (f64::from(ahead.image.get(x, y)) - f64::from(behind.image.get(x, y))) / (2.0 * h)
    };
    let centres = shifted(0.0, 0.0).centres_true;
    let variance: f64 = centres
        .iter()
        .map(|centre| {
            let mut information = nalgebra::Matrix2::zeros();
            for y in (centre.y as usize - 16)..(centre.y as usize + 17) {
                for x in (centre.x as usize - 16)..(centre.x as usize + 17) {
                    let g = Vec2::new(slope(&right, &left, x, y), slope(&down, &up, x, y));
                    information += g * g.transpose();
                }
            }
            sigma * sigma * information.try_inverse().unwrap().trace()
        })
        .sum();
    (variance / centres.len() as f64).sqrt()
}

#[test]
fn noise_moves_centres_hardly_more_than_the_bound() {
    let sigma = 0.01;
    let trials = 20;
    for (tilt, blur_px) in [(0.0, 0.0), (20.0, 0.5), (40.0, 1.0)] {
        let pose = looking_at_centre([tilt, 0.0, 0.0], 120.0);
        let imaging = Imaging { blur_px, ..Imaging::default() };
        let photo = chapter_photo(&pose, &imaging);
        let biases = disc_biases(&Truth::example_camera(), &pose, &Truth::example_board()).unwrap();
        let square: f64 = (0..trials)
            .map(|trial| {
                let key = StreamKey { seed: 1, scenario: "centres", trial, purpose: "noise" };
                let noisy = photo.clone().with_noise(&SensorNoise::constant(sigma), &mut Stream::open(key));
                let rms = corrected_rms_px(&circle_grid(&noisy.image, 9, 7).unwrap(), &photo, &biases);
                rms * rms
            })
            .sum();
        let ratio = (square / trials as f64).sqrt() / bound_px(&pose, &imaging, sigma);
        // 20 x 63 centres, two coordinates each: the ratio's own standard error is 1/sqrt(4 x 1260) = 0.014,
        // so an efficient estimator lies above 0.93 with a chance of 1 - 3e-7. What the estimator may lose is
        // a claim: a quarter. The bound knows levels, shading and shape, the estimator does not: measured
        // 1.04 to 1.11.
        eprintln!("tilt {tilt}, blur {blur_px}: {ratio:.3} of the bound");
        assert!((0.93..1.25).contains(&ratio), "tilt {tilt}, blur {blur_px}: {ratio}");
    }
}

#[test]
fn light_that_falls_off_moves_centres_little() {
    let pose = looking_at_centre([20.0, 0.0, 0.0], 120.0);
    let shading = Shading { slope_x: 0.4, slope_y: -0.2, falloff: -0.3 };
    let photo = chapter_photo(&pose, &Imaging { shading, ..Imaging::default() });
    let biases = disc_biases(&Truth::example_camera(), &pose, &Truth::example_board()).unwrap();
    let rms = corrected_rms_px(&circle_grid(&photo.image, 9, 7).unwrap(), &photo, &biases);
    assert!(rms < 0.01, "{rms}");
}

/// Whether a grid holds the true centres in the true order or, by the documented convention, in the reverse
/// one.
fn assert_ordered(grid: &DotGrid, centres_true: &[Vec2], what: &str) {
    let seen = grid.centres_px();
    let last = seen.len() - 1;
    let reversed = centres_true[last].sum() < centres_true[0].sum();
    let truth = |i: usize| if reversed { centres_true[last - i] } else { centres_true[i] };
    for (i, centre) in seen.iter().enumerate() {
        assert!((centre - truth(i)).norm() < 1.0, "{what}: mark {i} at {centre}, expected {}", truth(i));
    }
}

#[test]
fn any_rotation_tilt_and_lens_gives_the_order_of_the_convention() {
    let lenses =
        [BrownConrady::radial(-0.25, 0.07), BrownConrady::default(), BrownConrady::radial(0.25, 0.0)];
    let board = Truth::example_board();
    for (lens, distortion) in lenses.into_iter().enumerate() {
        let camera = Truth::example_camera().with_distortion(distortion);
        for turn in (0..360).step_by(15) {
            for tilt in [[0.0, 0.0], [45.0, 0.0], [-45.0, 0.0], [0.0, 45.0], [-30.0, 32.0]] {
                let pose = looking_at_centre([tilt[0], tilt[1], f64::from(turn)], 190.0);
                let photo = photograph(&camera, (640, 480), &board, &pose, &Imaging::default()).unwrap();
                let what = format!("lens {lens}, turn {turn}, tilt {tilt:?}");
                let grid = circle_grid(&photo.image.to_u8(), 9, 7).unwrap_or_else(|e| panic!("{what}: {e}"));
                assert_ordered(&grid, &photo.centres_true, &what);
            }
        }
    }
}

#[test]
fn a_square_grid_starts_at_the_corner_nearest_to_the_top_left() {
    let board = Board::circles(6, 6, 10.0, 4.0).unwrap();
    for turn in (0..360).step_by(20) {
        let pose = looking_at_centre([20.0, 10.0, f64::from(turn)], 150.0);
        let photo =
            photograph(&Truth::example_camera(), (640, 480), &board, &pose, &Imaging::default()).unwrap();
        let centres = circle_grid(&photo.image, 6, 6).unwrap().centres_px();
        let corners = [centres[0], centres[5], centres[30], centres[35]];
        assert!(corners.iter().all(|corner| corner.sum() >= centres[0].sum()));
        assert!((centres[5] - centres[0]).perp(&(centres[30] - centres[0])) > 0.0, "seen from its front");
    }
}

/// Paints over a place with the level of the paper.
fn erase(image: &mut Raster<f32>, at: Vec2, radius_px: f64) {
    for y in 0..image.height() {
        for x in 0..image.width() {
            if (Vec2::new(x as f64, y as f64) - at).norm() < radius_px {
                image.set(x, y, 0.85);
            }
        }
    }
}

#[test]
fn a_grid_with_missing_marks_is_refused_with_their_number() {
    let pose = looking_at_centre([10.0, -20.0, 30.0], 150.0);
    let photo = chapter_photo(&pose, &Imaging::default());
    // A corner, an edge and an inner mark: none may be taken for a smaller or a shifted grid.
    for lost in [0, 4, 31, 62] {
        let mut image = photo.image.clone();
        erase(&mut image, photo.centres_true[lost], 9.0);
        assert_eq!(
            circle_grid(&image, 9, 7),
            Err(GridError::Partial { columns: 9, rows: 7, found: 62, expected: 63, seen: 62 })
        );
    }
    let mut image = photo.image.clone();
    (0..7).for_each(|row| erase(&mut image, photo.centres_true[9 * row + 8], 9.0));
    // Without a column it is a complete grid of another size, and it cannot be told which of both it is.
    let named = GridError::WrongSize { columns: 9, rows: 7, found_columns: 8, found_rows: 7 };
    assert_eq!(circle_grid(&image, 9, 7), Err(named));
    // A board that reaches beyond the image.
    let aside = Pose {
        translation: calibench::geometry::Vec3::new(30.0, 0.0, 120.0),
        ..looking_at_centre([0.0; 3], 120.0)
    };
    assert!(matches!(
        circle_grid(&chapter_photo(&aside, &Imaging::default()).image, 9, 7),
        Err(GridError::Partial { .. } | GridError::WrongSize { .. })
    ));
}

#[test]
fn a_grid_of_another_size_is_refused() {
    let photo = chapter_photo(&looking_at_centre([0.0; 3], 120.0), &Imaging::default());
    for (columns, rows) in [(8, 7), (9, 6), (8, 6), (7, 8), (9, 8), (10, 8), (10, 10)] {
        let expected = GridError::WrongSize { columns, rows, found_columns: 9, found_rows: 7 };
        assert_eq!(circle_grid(&photo.image, columns, rows), Err(expected));
    }
    // Asked the other way round it is the same board, its rows and columns exchanged.
    assert_eq!(circle_grid(&photo.image, 7, 9).unwrap().columns(), 7);
}

#[test]
fn a_stray_disc_beside_the_grid_does_no_harm_but_a_row_of_them_does() {
    let big = Board::circles(10, 7, 10.0, 3.0).unwrap();
    let pose = looking_at_centre([10.0, 0.0, 0.0], 150.0);
    let photo = photograph(&Truth::example_camera(), (640, 480), &big, &pose, &Imaging::default()).unwrap();
    let mut image = photo.image.clone();
    for row in 0..7 {
        if row != 3 {
            erase(&mut image, photo.centres_true[10 * row + 9], 9.0);
        }
    }
    let centres = circle_grid(&image, 9, 7).unwrap().centres_px();
    assert!(
        (centres[0] - photo.centres_true[0]).norm() < 0.1
            && (centres[62] - photo.centres_true[68]).norm() < 0.1
    );
    let mut image = photo.image;
    erase(&mut image, photo.centres_true[9], 9.0);
    assert!(matches!(circle_grid(&image, 9, 7), Err(GridError::NotRectangular { found: 69, .. })));
}

#[test]
fn nine_dots_are_too_few_for_a_dense_grid_and_enough_for_sparse_dots() {
    let photo = nine_dot_stand_in();
    let image = photo.image.to_u8();
    let refused = circle_grid(&image, 3, 3).unwrap_err();
    assert_eq!(refused, GridError::TooFewForGrid { columns: 3, rows: 3, found: 9, need: 4 });
    // Of a board that is large enough they are a part.
    assert!(matches!(circle_grid(&image, 9, 7), Err(GridError::Partial { found: 9, seen: 9, .. })));
    let blank = Raster::from_fn(64, 48, |_, _| 200u8);
    assert!(matches!(circle_grid(&blank, 9, 7), Err(GridError::Partial { found: 0, seen: 0, .. })));
    let grid = sparse_dots(&image, 3, 3).unwrap();
    for (seen, truth) in grid.centres_px().iter().zip(&photo.centres_true) {
        assert!((seen - truth).norm() < 0.01, "{seen} {truth}");
    }
}

#[test]
fn what_holds_no_discs_gives_none() {
    assert!(blobs(&Raster::filled(640, 480, 128u8), &BlobOptions::default()).is_empty());
    assert!(blobs(&Raster::<u8>::filled(0, 0, 0), &BlobOptions::default()).is_empty());
    assert!(blobs(&Raster::filled(3, 2000, f32::NAN), &BlobOptions::default()).is_empty());
    let key = StreamKey { seed: 2, scenario: "noise only", trial: 0, purpose: "noise" };
    let mut noise = Raster::filled(640, 480, 0.5f32);
    SensorNoise::constant(0.1).add_to(&mut noise, &mut Stream::open(key));
    assert!(circle_grid(&noise, 9, 7).is_err());
    // The squares of a chessboard are not discs.
    let board = Board::chessboard(9, 6, 10.0).unwrap();
    let pose = looking_at_centre([20.0, 0.0, 10.0], 150.0);
    let photo = photograph(&Truth::example_camera(), (640, 480), &board, &pose, &Imaging::default()).unwrap();
    assert!(circle_grid_of(&blobs(&photo.image, &BlobOptions::default()), 5, 4).is_err());
    assert!(blobs(&photo.image, &BlobOptions::default()).is_empty());
}

#[test]
fn bright_discs_on_dark_ground_are_found_when_asked_for() {
    let appearance = Appearance { paper: 0.1, ink: 0.8, surround: None };
    let pose = looking_at_centre([20.0, 0.0, 0.0], 120.0);
    let photo = chapter_photo(&pose, &Imaging { appearance, ..Imaging::default() });
    let bright = BlobOptions { polarity: Polarity::Bright, ..BlobOptions::default() };
    let grid = circle_grid_of(&blobs(&photo.image, &bright), 9, 7).unwrap();
    let biases = disc_biases(&Truth::example_camera(), &pose, &Truth::example_board()).unwrap();
    assert!(corrected_rms_px(&grid, &photo, &biases) < 0.01);
    assert!(circle_grid(&photo.image, 9, 7).is_err());
}
