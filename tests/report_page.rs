//! Does a reader of `report.html` find every view by one name, the pictures, the poses and what is known of
//! each point?

use crate::program::{calibench, folder, text};
use calibench::board::View;
use calibench::camera::{Camera, Lens, Model};
use calibench::geometry::Vec2;
use calibench::io::formats::corner_text;
use calibench::io::{CornerFile, read_image, write_png};
use calibench::raster::Raster;
use calibench::synth::render::{Imaging, nine_dot_stand_in, photograph};
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Writes the views of the example scene with noise, under these names.
fn corner_file(file: &Path, names: &[&str]) {
    let key = StreamKey { seed: 1, scenario: "report-page", trial: 0, purpose: "noise" };
    let views: Vec<View> = Scene::example().observe(0.1, &mut Stream::open(key));
    assert_eq!(views.len(), names.len());
    let view_names = names.iter().map(|name| name.to_string()).collect();
    fs::write(file, corner_text(&CornerFile { view_names, views })).expect("written");
}

/// Calibrates; the page and the result.
fn report(folder: &Path, arguments: &[&str]) -> (String, Value) {
    let run = calibench(folder, &[&["calibrate"], arguments, &["--out", "out"]].concat());
    assert_eq!(run.status.code(), Some(0), "{arguments:?}: {}", text(&run.stderr));
    let read = |name: &str| fs::read_to_string(folder.join("out").join(name)).expect("it is written");
    (read("report.html"), serde_json::from_str(&read("result.json")).expect("JSON"))
}

/// What stands between two headings, or after the last.
fn section<'a>(page: &'a str, heading: &str) -> &'a str {
    let (_, after) =
        page.split_once(&format!("<h2>{heading}</h2>")).unwrap_or_else(|| panic!("no {heading}"));
    after.split("<h2>").next().unwrap_or(after)
}

/// The cells of a table's rows.
fn rows(section: &str) -> Vec<Vec<String>> {
    let cells = |row: &str| {
        row.split("<td>")
            .skip(1)
            .filter_map(|cell| cell.split_once("</td>"))
            .map(|c| c.0.to_string())
            .collect()
    };
    section.split("<tr>").map(cells).filter(|row: &Vec<String>| !row.is_empty()).collect()
}

#[test]
fn of_photographs_every_view_has_one_number_a_short_name_and_a_picture() {
    let folder = folder("report-photos");
    for (i, pose) in Truth::example_poses().iter().enumerate() {
        let imaging = Imaging { blur_px: 0.5, ..Imaging::default() };
        let photo = photograph(
            &Truth::example_camera(),
            Truth::EXAMPLE_IMAGE,
            &Truth::example_board(),
            pose,
            &imaging,
        );
        let photo = photo.expect("it is seen").image.to_u8();
        // Two photographs of one name in two folders, and a name that is no HTML.
        let file = ["a/same.png", "b/same.png", "a/R&D <2>.png", "a/fourth.png"][i];
        fs::create_dir_all(folder.join(file).parent().expect("a folder")).expect("made");
        write_png(&folder.join(file), &photo).expect("written");
    }
    write_png(&folder.join("a/blank.png"), &Raster::filled(640, 480, 200u8)).expect("written");
    let photos = ["a/same.png", "a/blank.png", "b/same.png", "a/R&D <2>.png", "a/fourth.png"];
    let (page, result) = report(&folder, &[&["--board", "circles:9x7:10mm:3mm"], &photos[..]].concat());
    assert!(page.contains("<p>4 of 5 photographs were used; 1 was left out, see below.</p>"), "{page}");
    assert!(page.contains("<h1>Calibration from photographs of a"), "{page}");
    // Number and name of the table, as they stand in the list given.
    let views = rows(section(&page, "Views"));
    let places: Vec<&str> = views.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(places, ["1", "3", "4", "5"]);
    let names: Vec<&str> = views.iter().map(|row| row[1].as_str()).collect();
    let link = |file: &str, name: &str| format!("<a href=\"overlay/{file}.png\">{name}</a>");
    assert_eq!(
        names,
        [
            link("001-same", "a/same.png"),
            link("003-same", "b/same.png"),
            link("004-R_D__2_", "R&amp;D &lt;2&gt;.png"),
            link("005-fourth", "fourth.png"),
        ]
    );
    assert!(
        section(&page, "Left out").contains("<li>2 \u{b7} <a href=\"overlay/002-blank.png\">blank.png</a>: ")
    );
    // The plot of the views has the same numbers; that of the poses has them too.
    assert!(page.contains("number of the view") && page.contains("undistorted radius (px)"));
    // JSON keeps the whole names.
    assert_eq!(result["views"][1]["name"], "b/same.png");
    // Ten marks, each linked to its picture.
    let worst = rows(section(&page, "The 10 marks that fit worst"));
    assert_eq!(worst.len(), 10);
    assert!(worst.iter().all(|row| row[1].starts_with("<a href=\"overlay/00")), "{worst:?}");
    let lengths: Vec<f64> = worst.iter().map(|row| row[9].parse().expect("a number")).collect();
    assert!(lengths.is_sorted_by(|a, b| a >= b), "{lengths:?}");
    // Every picture that is shown lies beside the page, and is asked for when it comes into view.
    let shown: Vec<&str> =
        page.split("<img src=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(shown.len(), photos.len() + 2, "{shown:?}");
    assert_eq!(page.matches("loading=\"lazy\"").count(), shown.len());
    for file in shown {
        assert!(read_image(&folder.join("out").join(file)).is_ok(), "{file}");
    }
    let size = |name: &str| read_image(&folder.join("out/undistorted").join(name)).expect("read").size();
    assert_eq!((size("before.png"), size("after.png")), ((640, 480), (640, 480)));
    let before = fs::read(folder.join("out/undistorted/before.png")).expect("read");
    assert_ne!(before, fs::read(folder.join("out/undistorted/after.png")).expect("read"));
    assert!(!page.contains("<td></td>"));
}

#[test]
fn of_a_corner_file_the_page_needs_nothing_else_and_keeps_the_numbers_of_the_file() {
    let folder = folder("report-corners");
    corner_file(&folder.join("numbers.csv"), &["0", "1", "2", "3"]);
    let (page, _) = report(&folder, &["numbers.csv", "--image-size", "640x480"]);
    assert!(page.contains("<h1>Calibration from numbers.csv</h1>"));
    assert!(page.contains("<p>All 4 views were used.</p>"));
    let views = rows(section(&page, "Views"));
    let names: Vec<&str> = views.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(names, ["0", "1", "2", "3"]);
    for absent in ["src=", "<img", "<h2>Photographs", "<h2>Before", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(absent), "{absent}");
    }
    // Residuals, views, lens, scatter, histogram, poses in space, from above and from the side, coverage,
    // deviation.
    assert_eq!(page.matches("<svg").count(), 10);
    // Names that are no numbers get them, from 1.
    corner_file(&folder.join("paths.csv"), &["/d/a.png", "/d/b.png", "/e/a.png", "/e/c.png"]);
    let (page, result) = report(&folder, &["paths.csv"]);
    let views = rows(section(&page, "Views"));
    let names: Vec<[&str; 2]> = views.iter().map(|row| [row[0].as_str(), row[1].as_str()]).collect();
    assert_eq!(names, [["1", "d/a.png"], ["2", "b.png"], ["3", "e/a.png"], ["4", "c.png"]]);
    assert!(!page.contains("<td></td>"));
    // Without the image's size there is no field of view, and the page says what it needs.
    assert!(result["field_of_view_deg"].is_null() && page.contains("give --image-size"));
    assert!(section(&page, "Parameters").contains("A dash as unit: a pure number."));
}

#[test]
fn every_lens_model_has_its_page() {
    let folder = folder("report-models");
    corner_file(&folder.join("c.csv"), &["0", "1", "2", "3"]);
    let models = [
        "brown-conrady",
        "thin-prism",
        "tilted",
        "kannala-brandt",
        "division",
        "double-sphere",
        "halcon-polynomial",
    ];
    for model in models {
        let arguments = ["calibrate", "c.csv", "--image-size", "640x480", "--model", model, "--out", model];
        let run = calibench(&folder, &arguments);
        // A lens that these few views do not determine well ends with 3, and has its page too.
        assert!(matches!(run.status.code(), Some(0 | 3)), "{model}: {}", text(&run.stderr));
        let page = fs::read_to_string(folder.join(model).join("report.html")).expect("it is written");
        assert_eq!(page.matches("<svg").count(), 10, "{model}");
        assert!(!page.contains("NaN") && !page.contains("<td></td>"), "{model}");
        let optics = rows(section(&page, "Field of view and focal length"));
        // The example's camera: 2 atan(320 / 600) and what little its lens adds.
        let horizontal: f64 = optics[0][1].parse().expect("an angle");
        assert!((54.0..64.0).contains(&horizontal), "{model}: {horizontal}");
    }
}

#[test]
fn field_of_view_and_focal_length_follow_from_the_camera() {
    let folder = folder("report-optics");
    corner_file(&folder.join("c.csv"), &["0", "1", "2", "3"]);
    let (page, result) = report(&folder, &["c.csv", "--image-size", "640x480", "--pixel-pitch", "5.5"]);
    let number = |value: &Value| value.as_f64().expect("a number");
    let (fx, fy) = (number(&result["camera"]["fx"]), number(&result["camera"]["fy"]));
    let focal = &result["focal_length_mm"];
    assert!((number(&focal["x"]) / (fx * 5.5e-3) - 1.0).abs() < 1e-12);
    assert!((number(&focal["y"]) / (fy * 5.5e-3) - 1.0).abs() < 1e-12);
    let sd = number(&result["standard_deviations"]["fx"]);
    assert!((number(&focal["standard_deviations"][0]) / (sd * 5.5e-3) - 1.0).abs() < 1e-12);
    // The rays at the edges, by the true camera: the estimate differs by some pixels of 600, or a degree.
    let truth: Camera<Lens> = Truth::example_camera().into();
    assert_eq!(truth.distortion.model(), Model::BrownConrady);
    let angle = |u: f64| {
        let ray = truth.ray(&Vec2::new(u, truth.cy)).expect("it is seen");
        libm::atan2(ray.x, ray.z).to_degrees()
    };
    let horizontal = number(&result["field_of_view_deg"]["horizontal"]);
    assert!((horizontal - (angle(639.5) - angle(-0.5))).abs() < 1.0, "{horizontal}");
    let diagonal = number(&result["field_of_view_deg"]["diagonal"]);
    assert!(diagonal > horizontal && horizontal > number(&result["field_of_view_deg"]["vertical"]));
    assert!(section(&page, "Field of view and focal length").contains("focal length along u"));
    let wrong = calibench(&folder, &["calibrate", "c.csv", "--pixel-pitch", "0"]);
    assert_eq!(wrong.status.code(), Some(2), "{}", text(&wrong.stdout));
}

#[test]
fn a_plane_has_a_page_with_residual_and_standard_deviation_of_every_point() {
    let folder = folder("report-plane");
    let mut pairs = "point,px,py,X,Y\n".to_string();
    for (k, name) in ["a", "b", "<c>", "d", "e"].iter().enumerate() {
        let (u, v) = [(100.0, 100.0), (500.0, 110.0), (510.0, 400.0), (90.0, 390.0), (300.0, 250.0)][k];
        // A hundredth of a unit off, in turns.
        let off = if k % 2 == 0 { 0.01 } else { -0.01 };
        pairs += &format!("{name},{u},{v},{},{}\n", 0.1 * u + off, 50.0 - 0.1 * v - off);
    }
    fs::write(folder.join("pairs.csv"), &pairs).expect("written");
    let (page, result) = report(&folder, &["pairs.csv"]);
    assert!(page.contains("<h1>Map of a plane from pairs.csv</h1>"));
    let points = rows(section(&page, "Points"));
    let names: Vec<[&str; 2]> = points.iter().map(|row| [row[0].as_str(), row[1].as_str()]).collect();
    assert_eq!(names, [["1", "a"], ["2", "b"], ["3", "&lt;c&gt;"], ["4", "d"], ["5", "e"]]);
    for (k, row) in points.iter().enumerate() {
        let cell = |column: usize| row[column].replace('\u{2212}', "-").parse::<f64>().expect("a number");
        let [dx, dy] = [0, 1].map(|axis| result["residuals"][k][axis].as_f64().expect("a number"));
        // Three digits are shown.
        assert!(
            (cell(6) - dx).abs() <= 0.006 * dx.abs() && (cell(7) - dy).abs() <= 0.006 * dy.abs(),
            "{row:?}"
        );
        assert!(cell(10) > 0.0 && cell(11) > 0.0, "{row:?}");
    }
    assert_eq!(page.matches("<svg").count(), 2);
    // Four pairs leave a tilted plane nothing to state, and the page says so in place of empty cells.
    let four: Vec<&str> = pairs.lines().take(5).collect();
    fs::write(folder.join("four.csv"), four.join("\n") + "\n").expect("written");
    let (page, _) = report(&folder, &["four.csv", "--mode", "tilted"]);
    assert!(page.contains("the map goes through every point") && !page.contains("<td></td>"));
    assert!(rows(section(&page, "Points")).iter().all(|row| row[10] == "\u{2013}"), "{page}");
    // The dots of a photograph have the same page, with their picture.
    write_png(&folder.join("dots.png"), &nine_dot_stand_in().image.to_u8()).expect("written");
    let run = calibench(&folder, &["ninepoint", "dots.png", "--out", "nine"]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    let page = fs::read_to_string(folder.join("nine/report.html")).expect("it is written");
    assert!(
        page.contains("<h1>Map of a plane from the dots of dots.png</h1>")
            && page.contains("src=\"overlay.png\"")
    );
    assert_eq!(rows(section(&page, "Points")).len(), 9);
}

#[test]
fn a_stray_mark_is_told_by_where_it_is() {
    let folder = folder("report-stray");
    corner_file(&folder.join("c.csv"), &["a", "b", "c", "d"]);
    let right = fs::read_to_string(folder.join("c.csv")).expect("read");
    let mut moved = None;
    // The file numbers its points backwards, and the tenth mark of the third view is off by 20 px.
    let line = |(k, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
        if k > 0 {
            cells[1] = (1000 - k).to_string();
        }
        if cells[0] == "c" && moved.is_none() && k % 63 == 10 {
            cells[4] = (cells[4].parse::<f64>().expect("a number") + 20.0).to_string();
            moved = Some((cells[2].clone(), cells[3].clone()));
        }
        cells.join(",") + "\n"
    };
    let wrong: String = right.lines().enumerate().map(line).collect();
    let (x, y) = moved.expect("it is moved");
    fs::write(folder.join("wrong.csv"), wrong).expect("written");
    let run = calibench(&folder, &["calibrate", "wrong.csv", "--format", "json"]);
    let result: Value = serde_json::from_str(&text(&run.stdout)).expect("JSON");
    let warnings = result["warnings"].to_string();
    assert!(
        warnings.contains(&format!("that mark is the one at X {x}, Y {y} in view c, seen at u ")),
        "{warnings}"
    );
}

#[test]
fn heights_that_are_not_read_are_told() {
    let folder = folder("report-heights");
    corner_file(&folder.join("c.csv"), &["0", "1", "2", "3"]);
    let flat = fs::read_to_string(folder.join("c.csv")).expect("read");
    let line = |(k, line): (usize, &str)| format!("{line},{}\n", if k == 0 { "Z" } else { "5" });
    fs::write(folder.join("z.csv"), flat.lines().enumerate().map(line).collect::<String>()).expect("written");
    let run = calibench(&folder, &["calibrate", "z.csv"]);
    let printed = text(&run.stdout);
    assert!(printed.contains("warning: z.csv: its column Z is not read"), "{printed}");
}
