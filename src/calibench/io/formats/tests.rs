//! Do the readers see the camera that other programs wrote, and does it survive every way between two
//! formats?

use super::*;
use crate::camera::{BrownConrady, Camera, Lens, Parameter};
use crate::geometry::{Pose, Vec2, Vec3, rotation};

/// The camera of the samples.
const CAMERA: Camera = Camera {
    fx: 812.3456789012345,
    fy: 808.7654321098765,
    cx: 331.4142135623731,
    cy: 236.7320508075689,
    skew: 0.0,
    distortion: BrownConrady {
        k1: -0.223606797749979,
        k2: 0.0648074069840786,
        p1: 0.0013038404810405,
        p2: -0.0009486832980505,
        k3: -0.0173205080756888,
    },
};
const SIZE: (usize, usize) = (640, 480);

fn without_k3() -> Camera {
    CAMERA.with_distortion(BrownConrady { k3: 0.0, ..CAMERA.distortion })
}

/// The camera of the samples with the lens of each model.
fn with_lens(model: Model) -> Camera<Lens> {
    let opencv = [
        -0.223606797749979,
        0.0648074069840786,
        0.0013038404810405,
        -0.0009486832980505,
        -0.0173205080756888,
        0.01,
        0.002,
        0.003,
        1e-3,
        -2e-4,
        -1e-3,
        3e-4,
        0.01,
        -0.02,
    ];
    let coefficients: &[f64] = match model {
        Model::KannalaBrandt => &[0.01, 0.02, 0.003, 0.004],
        Model::Division => &[-0.18],
        Model::DoubleSphere => &[-0.2, 0.55],
        Model::HalconPolynomial => &[0.22, 0.03, 0.0013, -0.00095, 0.01],
        model => &opencv[..model.coefficients().len()],
    };
    let Camera { fx, fy, cx, cy, .. } = CAMERA;
    Camera::with_lens(fx, fy, cx, cy, Lens::new(model, coefficients).unwrap())
}

fn whole(camera: impl Into<Camera<Lens>>) -> CameraFile {
    CameraFile { image_size: Some(SIZE), ..CameraFile::of(camera) }
}

/// Largest difference of two cameras' pixels over the frame, px.
fn largest_px(a: impl Into<Camera<Lens>>, b: &Camera<Lens>) -> f64 {
    let a = a.into();
    let rays = fitted::frame(SIZE).map(|pixel| a.ray(&pixel).unwrap());
    rays.map(|ray| (a.pixel(&ray).unwrap() - b.pixel(&ray).unwrap()).norm()).fold(0.0, f64::max)
}

fn read(file: &str, text: &str, camera: Option<&str>, wishes: &Wishes) -> Result<CameraFile, FormatError> {
    read_camera_file(detect(file, text)?, file, text, camera, wishes)
}

macro_rules! sample {
    ($name:literal) => {
        ($name, include_str!(concat!("samples/", $name)))
    };
}

#[test]
fn what_other_programs_wrote_projects_as_the_camera_it_was_written_from() {
    // Numbers with 17 digits; the pixels are some hundreds.
    const ROUNDING_PX: f64 = 1e-11;
    let cases = [
        (sample!("opencv.yaml"), "opencv-yaml", None, CAMERA, ROUNDING_PX),
        (sample!("opencv.xml"), "opencv-xml", None, CAMERA, ROUNDING_PX),
        (sample!("opencv.json"), "opencv-json", None, CAMERA, ROUNDING_PX),
        (sample!("ros.yaml"), "ros", None, CAMERA, ROUNDING_PX),
        (sample!("colmap.txt"), "colmap", Some("1"), CAMERA, ROUNDING_PX),
        (sample!("colmap.txt"), "colmap", Some("2"), without_k3(), ROUNDING_PX),
        (sample!("kalibr.yaml"), "kalibr", Some("cam0"), without_k3(), ROUNDING_PX),
        (sample!("matlab.json"), "matlab", None, CAMERA, ROUNDING_PX),
        (sample!("matlab-transposed.json"), "matlab", None, CAMERA, ROUNDING_PX),
        // Ten digits: half a unit of the last in fx, cx and k1 is 5e-8 px each.
        (sample!("mrcal.cameramodel"), "mrcal", None, CAMERA, 2e-7),
        (sample!("mrcal-opencv4.cameramodel"), "mrcal", None, without_k3(), 2e-7),
    ];
    for ((file, text), format, name, expected, tolerance_px) in cases {
        assert_eq!(detect(file, text).unwrap().name, format);
        let found = read(file, text, name, &Wishes::default()).unwrap();
        let error = largest_px(expected, &found.camera);
        assert!(error <= tolerance_px, "{file}: {error:.1e} px");
        assert_eq!(found.image_size, Some(SIZE), "{file}");
    }
    let (file, text) = sample!("halcon.dat");
    let ideal = CAMERA.with_distortion(BrownConrady::default());
    assert!(largest_px(ideal, &read(file, text, None, &Wishes::default()).unwrap().camera) < ROUNDING_PX);
    let radial = read("c.txt", sample!("colmap.txt").1, Some("3"), &Wishes::default()).unwrap().camera;
    assert_eq!(
        (radial.fx, radial.fy, radial.distortion),
        (CAMERA.fx, CAMERA.fx, BrownConrady::radial(CAMERA.distortion.k1, CAMERA.distortion.k2).into())
    );
}

#[test]
fn pixels_are_those_of_opencv() {
    let (_, text) = sample!("projections.csv");
    for line in text.lines().skip(1) {
        let n: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let pixel = CAMERA.project(&Vec3::new(n[0], n[1], n[2])).unwrap();
        assert!((pixel - Vec2::new(n[3], n[4])).norm() < 1e-9, "{line}");
    }
}

#[test]
fn what_other_programs_wrote_of_other_lenses_projects_as_the_camera_it_was_written_from() {
    const ROUNDING_PX: f64 = 1e-11;
    let cases = [
        (sample!("opencv-rational.yaml"), None, Model::Rational, ROUNDING_PX),
        (sample!("opencv-thin-prism.json"), None, Model::ThinPrism, ROUNDING_PX),
        (sample!("opencv-tilted.xml"), None, Model::Tilted, ROUNDING_PX),
        (sample!("opencv-fisheye.yaml"), None, Model::KannalaBrandt, ROUNDING_PX),
        (sample!("colmap-lenses.txt"), Some("1"), Model::Rational, ROUNDING_PX),
        (sample!("colmap-lenses.txt"), Some("2"), Model::KannalaBrandt, ROUNDING_PX),
        (sample!("colmap-lenses.txt"), Some("8"), Model::Division, ROUNDING_PX),
        (sample!("kalibr.yaml"), Some("cam1"), Model::KannalaBrandt, ROUNDING_PX),
        // Ten digits.
        (sample!("mrcal-opencv8.cameramodel"), None, Model::Rational, 2e-7),
        (sample!("mrcal-opencv12.cameramodel"), None, Model::ThinPrism, 2e-7),
        // Its metres are multiplied by themselves and by a focal length of millimetres.
        (sample!("halcon-division.dat"), None, Model::Division, ROUNDING_PX),
        (sample!("halcon-polynomial.dat"), None, Model::HalconPolynomial, ROUNDING_PX),
    ];
    for ((file, text), name, model, tolerance_px) in cases {
        let found = read(file, text, name, &Wishes::default()).unwrap();
        assert_eq!(found.camera.distortion.model(), model, "{file}");
        assert!(found.image_size.is_none_or(|size| size == SIZE), "{file}");
        // The script that wrote the division for HALCON took another coefficient than COLMAP's.
        let expected = match (file, model) {
            ("halcon-division.dat", _) => {
                Camera { distortion: lens::division(HALCONS_DIVISION), ..with_lens(model) }
            }
            _ => with_lens(model),
        };
        let error = largest_px(expected, &found.camera);
        assert!(error <= tolerance_px, "{file}: {error:.1e} px");
    }
    let found = |name| read("c.txt", sample!("colmap-lenses.txt").1, Some(name), &Wishes::default()).unwrap();
    for (name, coefficients) in [
        ("3", vec![0.01, 0.0, 0.0, 0.0]),
        ("4", vec![0.01, 0.02, 0.0, 0.0]),
        ("6", vec![0.0; 4]),
        ("7", vec![-0.18]),
    ] {
        assert_eq!(found(name).camera.distortion.coefficients(), coefficients, "camera {name}");
    }
    assert_eq!((found("7").camera.fy, found("6").camera.fy), (CAMERA.fx, CAMERA.fy));
}

/// Kappa of the sample, -25688.96721004612 / m^2, times its focal length squared, by hand.
const HALCONS_DIVISION: f64 = -25688.96721004612 * 0.002790240740779074 * 0.002790240740779074;

#[test]
fn pixels_of_other_lenses_are_those_of_opencv_colmap_and_halcons_equations() {
    let (_, text) = sample!("lens-projections.csv");
    let (file, polynomial) = sample!("halcon-polynomial.dat");
    let polynomial = read(file, polynomial, None, &Wishes::default()).unwrap().camera;
    for line in text.lines().skip(1) {
        let (model, numbers) = line.split_once(',').unwrap();
        let n: Vec<f64> = numbers.split(',').map(|word| word.parse().unwrap()).collect();
        let camera = match model.parse().unwrap() {
            // What was solved in metres is to come out of the file, whose coefficients are in metres too.
            Model::HalconPolynomial => polynomial,
            model => with_lens(model),
        };
        let pixel = camera.pixel(&Vec3::new(n[0], n[1], n[2])).unwrap();
        assert!((pixel - Vec2::new(n[3], n[4])).norm() < 1e-9, "{line}: {pixel}");
    }
}

/// The camera of a lens that two formats hold alike: without what Kalibr has no place for, or HALCON without
/// a fit.
fn held_by(formats: [&Format; 2], model: Model) -> Option<Camera<Lens>> {
    let has = |name: &str| formats.iter().any(|format| format.name == name);
    if !formats.iter().all(|format| format.room.lenses.contains(&model)) {
        return None;
    }
    match model {
        Model::Division | Model::HalconPolynomial => Some(with_lens(model)),
        Model::BrownConrady if has("halcon") => {
            Some(lens::camera([800.0, 790.0, 320.0, 240.0], lens::ideal()))
        }
        _ if has("halcon") => None,
        Model::BrownConrady if has("kalibr") => Some(without_k3().into()),
        _ => Some(with_lens(model)),
    }
}

#[test]
fn a_camera_of_every_lens_survives_the_way_through_every_two_formats() {
    let mut ways = 0;
    for model in Model::ALL {
        for first in &FORMATS {
            for second in &FORMATS {
                let Some(camera) = held_by([first, second], model) else { continue };
                let wishes = Wishes::default();
                let once = write_camera_file(first, &whole(camera), &wishes).unwrap();
                let between = read("file", &once.text, None, &wishes).unwrap();
                let twice = write_camera_file(second, &between, &wishes).unwrap();
                assert_eq!(detect("file", &twice.text).unwrap().name, second.name);
                let back = read("file", &twice.text, None, &wishes).unwrap();
                let error = largest_px(camera, &back.camera);
                assert!(error < 1e-9, "{model}: {} to {}: {error:.1e} px", first.name, second.name);
                assert_eq!((back.camera.distortion.model(), back.image_size), (model, Some(SIZE)));
                assert!(read_back_px(second, &twice, &between).unwrap().unwrap() < 1e-9);
                ways += 1;
            }
        }
    }
    // Brown-Conrady's in 10 formats; rational in 7, thin prism in 5, tilted in 4, Kannala-Brandt in 7,
    // division in 3, double sphere in 2, HALCON's polynomial in 2.
    assert_eq!(ways, 100 + 49 + 25 + 16 + 49 + 9 + 4 + 4);
}

#[test]
fn a_lens_that_a_format_has_no_place_for_is_refused_with_those_it_has() {
    for format in &FORMATS {
        for model in Model::ALL.into_iter().filter(|model| !format.room.lenses.contains(model)) {
            let error = write_camera_file(format, &whole(with_lens(model)), &Wishes::default())
                .unwrap_err()
                .to_string();
            assert!(error.contains(&format!("cannot hold a {model} lens")), "{error}");
            assert!(error.ends_with(format.room.lenses[format.room.lenses.len() - 1].name()), "{error}");
        }
    }
    // A longer model whose further coefficients are 0 is the shorter one.
    let tilted = Lens::new(Model::Tilted, &lens::padded(&CAMERA.distortion.into(), 14)).unwrap();
    let camera = whole(Camera { distortion: tilted, ..with_lens(Model::Tilted) });
    let text = write_camera_file(&mrcal::FORMAT, &camera, &Wishes::default()).unwrap().text;
    assert!(text.contains("LENSMODEL_OPENCV5"), "{text}");
}

#[test]
fn what_lies_beside_and_behind_the_camera_is_named_where_a_program_does_not_see_it() {
    let wide = |model: Model, coefficients: &[f64]| {
        whole(Camera::with_lens(180.0, 180.0, 320.0, 240.0, Lens::new(model, coefficients).unwrap()))
    };
    let fisheye = wide(Model::KannalaBrandt, &[0.0; 4]);
    let double_sphere = wide(Model::DoubleSphere, &[-0.2, 0.55]);
    for (camera, name, lost) in [
        (&fisheye, "opencv-yaml", true),
        (&fisheye, "kalibr", true),
        (&fisheye, "calibench", false),
        (&double_sphere, "kalibr", false),
        (&whole(with_lens(Model::KannalaBrandt)), "ros", false),
    ] {
        let written = write_camera_file(format_of_name(name).unwrap(), camera, &Wishes::default()).unwrap();
        let named = written.lost.iter().any(|line| line.contains("90 degrees from the axis and beyond"));
        assert_eq!(named, lost, "{name}: {:?}", written.lost);
    }
}

#[test]
fn the_first_pixel_is_where_each_format_says() {
    for (name, centre) in [("opencv-yaml", 0.0), ("colmap", 0.5), ("matlab", 1.0)] {
        let text = write_camera_file(format_of_name(name).unwrap(), &whole(CAMERA), &Wishes::default())
            .unwrap()
            .text;
        assert!(text.contains(&decimal::decimal(CAMERA.cx + centre)), "{name}: {text}");
        // A file whose writer took the image's corner for the origin, whatever its format says.
        let wishes = Wishes { first_pixel: Some(0.5), ..Wishes::default() };
        let shifted = read("f.yaml", &text, None, &wishes).unwrap().camera;
        assert!((shifted.cx - (CAMERA.cx + centre - 0.5)).abs() < 1e-12);
    }
}

#[test]
fn a_lens_of_another_kind_is_refused_by_its_name() {
    let splined = "{'lensmodel': 'LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=11_fov_x_deg=120', 'intrinsics': [1,2,3,4], 'imagersize': [1,1]}";
    let kalibr = |camera: &str, distortion: &str| {
        format!(
            "cam0:\n  camera_model: {camera}\n  intrinsics: [1, 1, 1, 1]\n  distortion_model: {distortion}\n  resolution: [6, 4]\n"
        )
    };
    let (omni, fov) = (kalibr("omni", "none"), kalibr("pinhole", "fov"));
    let scaramuzza = "{\"MappingCoefficients\": [350, -1e-3, 0, 0], \"ImageSize\": [4, 6]}";
    let ros = "image_width: 6\nimage_height: 4\ncamera_matrix:\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\ndistortion_model: fov\n\
               distortion_coefficients:\n  data: [1, 2, 3, 4]\n";
    let telecentric = "ParGroup: Camera: Parameter;\nMagnification:mag: 0.2;\n";
    let cases = [
        (sample!("mrcal-cahvor.cameramodel"), None, "LENSMODEL_CAHVOR"),
        (sample!("colmap-lenses.txt"), Some("9"), "the model EUCM"),
        (sample!("colmap-lenses.txt"), Some("10"), "the model THIN_PRISM_FISHEYE"),
        (sample!("colmap-lenses.txt"), Some("11"), "the model FOV"),
        (("s.cameramodel", splined), None, "LENSMODEL_SPLINED_STEREOGRAPHIC"),
        (("m.json", scaramuzza), None, "MATLAB's fisheye lens"),
        (("k.yaml", omni.as_str()), None, "the camera model omni of cam0"),
        (("k.yaml", fov.as_str()), None, "the distortion model fov of cam0"),
        (("r.yaml", ros), None, "the distortion model fov"),
        (("t.dat", telecentric), None, "a telecentric lens"),
    ];
    for ((file, text), name, model) in cases {
        let error = read(file, text, name, &Wishes::default()).unwrap_err();
        assert!(matches!(error, FormatError::Lens { .. }), "{file}: {error}");
        assert!(error.to_string().contains(model) && error.to_string().starts_with(file), "{error}");
    }
}

#[test]
fn a_lens_that_halcon_has_not_is_fitted_with_the_error_that_is_said() {
    let wishes = Wishes { fit: true, ..Wishes::default() };
    // Of least squares on the same nodes with 40 digits.
    let expected_px = 0.138488;
    let written = write_camera_file(&halcon::FORMAT, &whole(CAMERA), &wishes).unwrap();
    let said = written.converted.iter().find_map(|line| line.split_once("the largest error is "));
    let said: f64 = said.expect("it is said").1.trim_end_matches(" px").parse().unwrap();
    assert!((said / expected_px - 1.0).abs() < 0.01, "{said} px, expected {expected_px} px");
    let apart = read_back_px(&halcon::FORMAT, &written, &whole(CAMERA)).unwrap().unwrap();
    assert!((apart / expected_px - 1.0).abs() < 0.05, "{apart} px, expected {expected_px} px");
    let back = read("f.dat", &written.text, None, &Wishes::default()).unwrap().camera;
    assert_eq!(back.distortion.model(), Model::HalconPolynomial);
    // A barrel: what is seen far out comes from farther out.
    assert!(back.value(Parameter::K1).unwrap() > 0.1, "{back:?}");
}

#[test]
fn halcons_polynomial_is_fitted_for_other_programs_if_asked_for() {
    let camera = whole(with_lens(Model::HalconPolynomial));
    let (plain, fit) = (Wishes::default(), Wishes { fit: true, ..Wishes::default() });
    for format in FORMATS.iter().filter(|format| !format.room.lenses.contains(&Model::HalconPolynomial)) {
        let refused = write_camera_file(format, &camera, &plain).unwrap_err().to_string();
        assert!(refused.contains("--fit"), "{}: {refused}", format.name);
        let written = match write_camera_file(format, &camera, &fit) {
            // The nearest lens has a k3.
            Err(error) => {
                assert!(
                    format.name == "kalibr" && error.to_string().contains("k3"),
                    "{}: {error}",
                    format.name
                );
                continue;
            }
            Ok(written) => written,
        };
        let said = written.converted.iter().find_map(|line| line.split_once("the largest error is "));
        let said: f64 = said.expect("it is said").1.trim_end_matches(" px").parse().unwrap();
        let apart = read_back_px(format, &written, &camera).unwrap().unwrap();
        assert!(
            0.01 < said && said < 1.0 && (apart / said - 1.0).abs() < 0.01,
            "{}: {said} {apart}",
            format.name
        );
        // Asked for and not possible, the reason is told.
        let unsized_camera = CameraFile { image_size: None, ..camera.clone() };
        let refused = write_camera_file(format, &unsized_camera, &fit).unwrap_err().to_string();
        assert!(refused.contains("--image-size"), "{}: {refused}", format.name);
        // What the format holds already is not fitted.
        let plain_lens = whole(CAMERA);
        let exact = write_camera_file(format, &plain_lens, &fit).unwrap();
        assert!(read_back_px(format, &exact, &plain_lens).unwrap().unwrap() < 1e-6, "{}", format.name);
    }
}

#[test]
fn halcons_polynomial_without_a_coefficient_is_an_ideal_lens() {
    let (file, text) = sample!("halcon-polynomial.dat");
    let is_coefficient = |line: &str| line.starts_with("Poly");
    let zero = |line: &str| line.rsplit_once(": ").map_or(String::new(), |(name, _)| format!("{name}: 0.0;"));
    let lines: Vec<String> =
        text.lines().map(|line| if is_coefficient(line) { zero(line) } else { line.into() }).collect();
    let camera = read(file, &lines.join("\n"), None, &Wishes::default()).unwrap().camera;
    assert_eq!(camera.distortion, lens::ideal());
    // Every format holds it.
    let ideal = Lens::ideal(Model::HalconPolynomial);
    for format in &FORMATS {
        let camera = whole(Camera { distortion: ideal, ..with_lens(Model::HalconPolynomial) });
        assert!(write_camera_file(format, &camera, &Wishes::default()).is_ok(), "{}", format.name);
    }
    // One that is missing is no 0.
    let without = text.replace("Poly3:", "Poly6:");
    let error = read(file, &without, None, &Wishes::default()).unwrap_err().to_string();
    assert!(error.contains("Poly3 is missing"), "{error}");
}

#[test]
fn what_a_format_cannot_hold_is_refused_or_named() {
    let write = |name: &str, camera: &CameraFile| {
        write_camera_file(format_of_name(name).unwrap(), camera, &Wishes::default())
    };
    let skewed = whole(Camera { skew: 0.5, ..CAMERA });
    for format in &FORMATS {
        let held = ["calibench", "matlab"].contains(&format.name);
        assert_eq!(
            write_camera_file(format, &skewed, &Wishes { fit: true, ..Wishes::default() }).is_ok(),
            held
        );
    }
    assert!(write("kalibr", &whole(CAMERA)).unwrap_err().to_string().contains("k3 = -0.017"));
    assert!(write("halcon", &whole(CAMERA)).unwrap_err().to_string().contains("--fit"));
    assert!(write("ros", &CameraFile::of(CAMERA)).unwrap_err().to_string().contains("--image-size"));
    let pose =
        Pose { rotation: rotation::exp(&Vec3::new(0.1, 0.0, 0.0)), translation: Vec3::new(1.0, 2.0, 3.0) };
    let placed = CameraFile { cam_from_reference: Some(pose), ..whole(CAMERA) };
    assert_eq!(write("opencv-xml", &placed).unwrap().lost, ["the camera's pose: OpenCV has no place for it"]);
    let kept = write("mrcal", &placed).unwrap();
    let back =
        read("m.cameramodel", &kept.text, None, &Wishes::default()).unwrap().cam_from_reference.unwrap();
    assert!(kept.lost.is_empty() && (back.rotation - pose.rotation).norm() < 1e-15);
}

#[test]
fn several_cameras_need_a_name_and_an_ending_that_fits_several_formats_is_none() {
    let (file, text) = sample!("colmap.txt");
    let error = read(file, text, None, &Wishes::default()).unwrap_err().to_string();
    assert_eq!(error, "colmap.txt: 4 cameras: name one of 1, 2, 3, 4 with --camera");
    assert!(
        read(file, text, Some("9"), &Wishes::default()).unwrap_err().to_string().contains("no camera `9`")
    );
    assert_eq!(format_to_write("a.cameramodel").unwrap().name, "mrcal");
    assert_eq!(format_to_write("a.JSON").unwrap().name, "calibench");
    assert!(
        format_to_write("a.yaml").unwrap_err().to_string().contains("--to, one of ros, kalibr, opencv-yaml")
    );
    assert!(detect("a.bin", "?").unwrap_err().to_string().contains("--from"));
}

#[test]
fn complaints_name_file_line_and_value() {
    let cases = [
        (
            "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   data: [ 1., x ]\n",
            "f:5:16: camera_matrix.data: `x` is not a number",
        ),
        ("%YAML:1.0\n---\nimage_width: 640\nK: 3\n", "f:4:4: K: 9 numbers are expected, got 1"),
        (
            "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 4\n   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]\n",
            "3 rows of 4 are said, and 9 numbers are there",
        ),
        ("%YAML:1.0\n---\ncamera_matrix: [1., 2., 0., 0., 1., 0., 0., 0., 1.]\n", "skew 2"),
        ("{\"RadialDistortion\": [0, 0], \"FocalLength\": [1, 1]}", "f:1: PrincipalPoint is missing"),
        (
            "{'lensmodel': 'LENSMODEL_OPENCV4', 'intrinsics': [1, 2, 3], 'imagersize': [6, 4]}",
            "LENSMODEL_OPENCV4 has 8 numbers, got 3",
        ),
        (
            "%YAML:1.0\n---\nfisheye_model: 1\ncamera_matrix: [1., 0., 0., 0., 1., 0., 0., 0., 1.]\nD: [1., 2., 3.]\n",
            "a fisheye has 4 coefficients, k1 k2 k3 k4, got 3",
        ),
        ("1 OPENCV 640 480 1 2 3\n", "f:1:1: OPENCV: 3 numbers are not what this model has"),
        ("1 PINHOLE 640 480.5 1 1 0 0\n", "f:1:1"),
        ("1 PINHOLE 640 480 1 1 nan 0\n", "f:1:23: PARAMS: `nan` is not a finite number"),
        ("1 PINHOLE 640 480 -1 1 0 0\n", "fx = -1e0 px, and focal lengths are from 1e-6 to 1e9 px"),
    ];
    for (text, expected) in cases {
        let format = detect("f", text).unwrap_or(format_of_name("colmap").unwrap());
        let error = read_camera_file(format, "f", text, None, &Wishes::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\nexpected {expected}");
    }
}
