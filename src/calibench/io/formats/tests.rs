//! Do the readers see the camera that other programs wrote, and does it survive every way between two
//! formats?

use super::*;
use crate::camera::BrownConrady;
use crate::geometry::{Pose, Vec3, rotation};

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

fn whole(camera: Camera) -> CameraFile {
    CameraFile { image_size: Some(SIZE), ..CameraFile::of(camera) }
}

/// Largest difference of two cameras' pixels over the frame, px.
fn largest_px(a: &Camera, b: &Camera) -> f64 {
    let pixel = |camera: &Camera, ray: &Vec2| camera.pixel_from_normalised(&camera.distortion.distort(ray));
    let rays = fitted::frame(SIZE).map(|pixel| a.normalised_ray(&pixel).unwrap());
    rays.map(|ray| (pixel(a, &ray) - pixel(b, &ray)).norm()).fold(0.0, f64::max)
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
        let error = largest_px(&expected, &found.camera);
        assert!(error <= tolerance_px, "{file}: {error:.1e} px");
        assert_eq!(found.image_size, Some(SIZE), "{file}");
    }
    let (file, text) = sample!("halcon.dat");
    let ideal = CAMERA.with_distortion(BrownConrady::default());
    assert!(largest_px(&ideal, &read(file, text, None, &Wishes::default()).unwrap().camera) < ROUNDING_PX);
    let radial = read("c.txt", sample!("colmap.txt").1, Some("3"), &Wishes::default()).unwrap().camera;
    assert_eq!(
        (radial.fx, radial.fy, radial.distortion),
        (CAMERA.fx, CAMERA.fx, BrownConrady::radial(CAMERA.distortion.k1, CAMERA.distortion.k2))
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
fn a_camera_survives_the_way_through_every_two_formats() {
    for first in &FORMATS {
        for second in &FORMATS {
            let has = |name: &str| [first.name, second.name].contains(&name);
            let camera = match (has("halcon"), has("kalibr")) {
                (true, _) => CAMERA.with_distortion(BrownConrady::default()),
                (_, true) => without_k3(),
                _ => CAMERA,
            };
            let wishes = Wishes::default();
            let once = write_camera_file(first, &whole(camera), &wishes).unwrap();
            let between = read("file", &once.text, None, &wishes).unwrap();
            let twice = write_camera_file(second, &between, &wishes).unwrap();
            assert_eq!(detect("file", &twice.text).unwrap().name, second.name);
            let back = read("file", &twice.text, None, &wishes).unwrap();
            let error = largest_px(&camera, &back.camera);
            assert!(error < 1e-9, "{} to {}: {error:.1e} px", first.name, second.name);
            assert_eq!(back.image_size, Some(SIZE));
            assert!(read_back_px(second, &twice, &between).unwrap().unwrap() < 1e-9);
        }
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
    let fisheye = "%YAML:1.0\n---\nfisheye_model: 1\ncamera_matrix: [1., 0., 0., 0., 1., 0., 0., 0., 1.]\n";
    let ros = "image_width: 6\nimage_height: 4\ncamera_matrix:\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\ndistortion_model: equidistant\n\
               distortion_coefficients:\n  data: [1, 2, 3, 4]\n";
    let telecentric = "ParGroup: Camera: Parameter;\nMagnification:mag: 0.2;\n";
    let cases = [
        (sample!("opencv-rational.yaml"), None, "a lens with k4 k5 k6"),
        (sample!("mrcal-cahvor.cameramodel"), None, "LENSMODEL_CAHVOR"),
        (sample!("colmap.txt"), Some("4"), "the model OPENCV_FISHEYE"),
        (sample!("kalibr.yaml"), Some("cam1"), "the distortion model equidistant of cam1"),
        (sample!("halcon-division.dat"), None, "HALCON's division lens"),
        (sample!("halcon-polynomial.dat"), None, "HALCON's polynomial lens"),
        (("s.cameramodel", splined), None, "LENSMODEL_SPLINED_STEREOGRAPHIC"),
        (("f.yml", fisheye), None, "OpenCV's fisheye model"),
        (("r.yaml", ros), None, "the distortion model equidistant"),
        (("t.dat", telecentric), None, "a telecentric lens"),
    ];
    for ((file, text), name, model) in cases {
        let error = read(file, text, name, &Wishes::default()).unwrap_err();
        assert!(matches!(error, FormatError::Lens { .. }), "{file}: {error}");
        assert!(error.to_string().contains(model) && error.to_string().starts_with(file), "{error}");
    }
}

#[test]
fn halcons_lenses_are_fitted_with_the_error_that_is_said() {
    let wishes = Wishes { fit: true, ..Wishes::default() };
    // The largest errors of NumPy's least squares on the same nodes.
    let cases = [(sample!("halcon-division.dat"), 1.368e-3), (sample!("halcon-polynomial.dat"), 7.462e-2)];
    for ((file, text), expected_px) in cases {
        let read = read(file, text, None, &wishes).unwrap();
        let said = read
            .notes
            .iter()
            .find_map(|note| note.split_once("the largest error is "))
            .expect("it is said")
            .1;
        let said: f64 = said.trim_end_matches(" px").parse().unwrap();
        assert!((said / expected_px - 1.0).abs() < 0.01, "{file}: {said} px, expected {expected_px} px");
        // Barrel: what is seen far out comes from farther out.
        assert!(read.camera.distortion.k1 < -0.1, "{:?}", read.camera);
        // And back: HALCON's polynomial is near to what was fitted to it.
        let written = write_camera_file(&halcon::FORMAT, &read, &wishes).unwrap();
        assert!(read_back_px(&halcon::FORMAT, &written, &read).unwrap().unwrap() < 0.1);
    }
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
        ("%YAML:1.0\n---\ncamera_matrix: [1., 2., 0., 0., 1., 0., 0., 0., 1.]\n", "skew 2"),
        ("{\"RadialDistortion\": [0, 0], \"FocalLength\": [1, 1]}", "f:1: PrincipalPoint is missing"),
        (
            "{'lensmodel': 'LENSMODEL_OPENCV4', 'intrinsics': [1, 2, 3], 'imagersize': [6, 4]}",
            "LENSMODEL_OPENCV4 has 8 numbers, got 3",
        ),
        ("1 OPENCV 640 480 1 2 3\n", "f:1:1: OPENCV: 3 numbers are not what this model has"),
        ("1 PINHOLE 640 480.5 1 1 0 0\n", "f:1:1"),
        ("1 PINHOLE 640 480 1 1 nan 0\n", "f:1:23: PARAMS: `nan` is not a finite number"),
        ("1 PINHOLE 640 480 -1 1 0 0\n", "fx and fy must be positive"),
    ];
    for (text, expected) in cases {
        let format = detect("f", text).unwrap_or(format_of_name("colmap").unwrap());
        let error = read_camera_file(format, "f", text, None, &Wishes::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\nexpected {expected}");
    }
}
