//! What would change a result without a word, were it not read, read in part or lost? It is refused or told.
#![cfg(target_os = "linux")]

use crate::hostile::{CALIBENCH, corner_file, limited, refused};
use crate::program::{folder, text};
use std::fs;
use std::process::{Child, Command, Stdio};

#[test]
fn a_column_that_looks_like_one_that_is_read_is_refused() {
    let folder = folder("misspelt");
    let with = |column: &str| {
        let lines = corner_file();
        let (header, rows) = lines.split_once('\n').expect("a header");
        let rows: String = rows.lines().map(|row| format!("{row},1\n")).collect();
        fs::write(folder.join("c.csv"), format!("{header},{column}\n{rows}")).expect("written");
    };
    for (column, meant) in [("wieght", "weight"), ("Weight", "weight"), ("sigma_pix", "sigma_px")] {
        with(column);
        refused(
            &folder,
            &["calibrate", "c.csv"],
            &["c.csv:1", &format!("'{column}' is read"), &format!("looks like '{meant}'")],
        );
    }
    with("comment");
    assert_eq!(limited(&folder, &["calibrate", "c.csv"]).status.code(), Some(0));
    fs::write(folder.join("a.csv"), "point,X,Y,sdd\na,0,0,1\nb,9,0,1\nc,0,9,1\n").expect("written");
    refused(&folder, &["register", "a.csv", "a.csv"], &["'sdd' is read", "looks like 'sd'"]);
    fs::write(folder.join("a.csv"), "point,X,Y,sd,sd_X,sd_Y\na,0,0,1,1,1\nb,9,0,1,1,1\n").expect("written");
    refused(&folder, &["register", "a.csv", "a.csv"], &["say the same twice"]);
}

#[test]
fn weights_that_a_format_has_no_place_for_are_told() {
    let folder = folder("weights-lost");
    let weighted: String = (0..4)
        .map(|i| {
            format!(
                "0,{i},{},{},{},{},0.5\n",
                10 * (i % 2),
                10 * (i / 2),
                100 + 90 * (i % 2),
                80 + 90 * (i / 2)
            )
        })
        .collect();
    fs::write(folder.join("c.csv"), format!("view,point,X,Y,u,v,weight\n{weighted}")).expect("written");
    let told = limited(&folder, &["convert", "c.csv", "c.vnl", "--board", "chess:2x2:10mm"]);
    let said = text(&told.stdout) + &text(&told.stderr);
    assert!(told.status.code() == Some(0) && said.contains("how well each mark was seen"), "{said}");
}

#[test]
fn parts_of_a_camera_that_are_not_read_or_are_lost_are_refused() {
    let folder = folder("camera-parts");
    let camera = r#"{"fx": 600, "fy": 600, "cx": 320, "cy": 240}"#;
    for (beside, word) in [
        (r#""model": "kannala-brandt""#, "model stands beside `camera`"),
        (r#""distortion": [-0.2, 0.05]"#, "distortion stands beside `camera`"),
        (r#""free": ["fx", "k1"]"#, "k1 was estimated"),
    ] {
        fs::write(folder.join("r.json"), format!("{{{beside}, \"camera\": {camera}}}")).expect("written");
        refused(&folder, &["diff", "r.json", "r.json"], &["r.json", word]);
    }
}

#[test]
fn a_result_is_not_written_where_a_file_stands_in_the_place_of_its_folder() {
    let folder = folder("file-for-folder");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    fs::write(folder.join("out"), "kept").expect("written");
    let output = limited(&folder, &["calibrate", "c.csv", "--out", "out"]);
    let said = text(&output.stderr);
    assert!(output.status.code() != Some(0) && said.contains("out is a file, name a folder"), "{said}");
    assert_eq!(fs::read(folder.join("out")).expect("there"), b"kept");
}

#[test]
fn marks_in_other_units_that_tell_no_angle_are_told() {
    let folder = folder("other-units");
    let marks = |scale: f64| {
        let place = |name: &str, x: f64, y: f64| format!("{name},{},{}\n", scale * x, scale * y);
        "point,X,Y\n".to_string()
            + &place("a", 0.0, 0.0)
            + &place("b", 100.0, 0.0)
            + &place("c", 100.0, 60.0)
            + &place("d", 0.0, 60.0)
    };
    fs::write(folder.join("mm.csv"), marks(1.0)).expect("written");
    fs::write(folder.join("um.csv"), marks(1000.0)).expect("written");
    let said = |found: &str| text(&limited(&folder, &["register", "mm.csv", found]).stderr);
    assert!(said("um.csv").contains("the marks do not tell the angle"), "{}", said("um.csv"));
    assert_eq!(said("mm.csv"), "");
}

#[test]
fn checks_that_are_added_at_once_are_all_kept_and_a_link_is_followed() {
    let folder = folder("checks-at-once");
    let add = |history: &str, when: usize| -> Child {
        let arguments = ["check-reference", history, "--reference", "25", "--sd", "0.01", "--add", "25"];
        Command::new(CALIBENCH)
            .args(arguments)
            .args(["--when", &format!("w{when}")])
            .current_dir(&folder)
            .stdout(Stdio::null())
            .spawn()
            .expect("it starts")
    };
    let all: Vec<Child> = (0..8).map(|when| add("h.csv", when)).collect();
    for mut one in all {
        assert_eq!(one.wait().expect("it ends").code(), Some(0));
    }
    let kept = fs::read_to_string(folder.join("h.csv")).expect("a history");
    assert_eq!(kept.lines().count(), 9, "{kept}");
    std::os::unix::fs::symlink("h.csv", folder.join("link.csv")).expect("a link");
    assert_eq!(add("link.csv", 8).wait().expect("it ends").code(), Some(0));
    assert!(folder.join("link.csv").is_symlink());
    assert_eq!(fs::read_to_string(folder.join("h.csv")).expect("a history").lines().count(), 10);
}

/// A PGM of one grey.
fn photograph() -> Vec<u8> {
    [b"P5 16 12 255\n".as_slice(), &[128; 16 * 12]].concat()
}

#[test]
fn photographs_that_are_not_corrected_beside_others_make_the_work_incomplete() {
    let folder = folder("incomplete");
    fs::write(folder.join("camera.json"), r#"{"camera": {"fx": 20, "fy": 20, "cx": 8, "cy": 6}}"#)
        .expect("written");
    fs::write(folder.join("a.pgm"), photograph()).expect("written");
    fs::write(folder.join("b.pgm"), "").expect("written");
    let ends = |photos: &[&str]| {
        let arguments = [&["undistort", "--camera", "camera.json", "--out", "o"], photos].concat();
        limited(&folder, &arguments).status.code()
    };
    assert_eq!((ends(&["b.pgm"]), ends(&["a.pgm", "b.pgm"]), ends(&["a.pgm"])), (Some(2), Some(3), Some(0)));
}

#[test]
fn levels_beyond_white_and_none_are_refused() {
    let folder = folder("levels");
    fs::write(folder.join("camera.json"), r#"{"camera": {"fx": 20, "fy": 20, "cx": 8, "cy": 6}}"#)
        .expect("written");
    let undistort = ["undistort", "--camera", "camera.json", "--out", "o", "f.tif"];
    for (level, is_refused) in [(0.5, false), (1.0, false), (255.0, true), (-0.1, true), (f32::NAN, true)] {
        let grey = image::ImageBuffer::from_pixel(16, 12, image::Rgb([level; 3]));
        image::DynamicImage::ImageRgb32F(grey).save(folder.join("f.tif")).expect("written");
        if is_refused {
            refused(&folder, &undistort, &["576 of 576 floating-point levels", "scale them first"]);
        } else {
            assert_eq!(limited(&folder, &undistort).status.code(), Some(0), "{level}");
        }
    }
}

#[test]
fn an_output_of_undistort_that_shows_little_is_told() {
    let folder = folder("little");
    fs::write(folder.join("a.pgm"), photograph()).expect("written");
    for (k1, is_told) in [("1e6", true), ("-0.1", false)] {
        let camera = format!(r#"{{"camera": {{"fx": 20, "fy": 20, "cx": 8, "cy": 6, "k1": {k1}}}}}"#);
        fs::write(folder.join("camera.json"), camera).expect("written");
        let output = limited(&folder, &["undistort", "--camera", "camera.json", "--out", "o", "a.pgm"]);
        let said = text(&output.stderr);
        assert_eq!(said.contains("output shows the photograph"), is_told, "{k1}: {said}");
    }
}

#[test]
fn a_photograph_that_is_to_be_turned_or_one_of_several_in_its_file_is_told() {
    let folder = folder("turned");
    let camera = r#"{"camera": {"fx": 20, "fy": 20, "cx": 8, "cy": 6}}"#;
    fs::write(folder.join("camera.json"), camera).expect("written");
    let grey = image::ImageBuffer::from_pixel(16, 12, image::Luma([90_u8]));
    for name in ["plain.jpg", "plain.tif"] {
        grey.save(folder.join(name)).expect("written");
    }
    let told = |name: &str, bytes: &[u8]| {
        fs::write(folder.join(name), bytes).expect("written");
        let output = limited(&folder, &["undistort", "--camera", "camera.json", "--out", "o", name]);
        assert_eq!(output.status.code(), Some(0), "{name}");
        text(&output.stderr).lines().filter(|line| line.contains(name)).map(String::from).collect::<Vec<_>>()
    };
    let jpeg = fs::read(folder.join("plain.jpg")).expect("read");
    assert_eq!(told("a.jpg", &jpeg), Vec::<String>::new());
    // Exif data with an orientation of 6: to be turned by a quarter.
    let exif = b"\xff\xe1\0\x22Exif\0\0II\x2a\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0";
    let turned = told("b.jpg", &[&jpeg[..2], exif, &jpeg[2..]].concat());
    assert!(turned.len() == 1 && turned[0].contains("asks to be shown turned or mirrored"), "{turned:?}");
    let mut tiff = fs::read(folder.join("plain.tif")).expect("read");
    assert_eq!(told("a.tif", &tiff), Vec::<String>::new());
    let directory = u32::from_le_bytes(tiff[4..8].try_into().expect("four bytes")) as usize;
    let entries = usize::from(u16::from_le_bytes([tiff[directory], tiff[directory + 1]]));
    tiff[directory + 2 + 12 * entries] = 8;
    let pgm = [b"P5 16 12 255\n".as_slice(), &[90; 16 * 12]].concat();
    assert_eq!(told("a.pgm", &pgm), Vec::<String>::new());
    for several in [told("b.tif", &tiff), told("b.pgm", &pgm.repeat(2))] {
        assert!(several.len() == 1 && several[0].contains("holds more than one image"), "{several:?}");
    }
}
