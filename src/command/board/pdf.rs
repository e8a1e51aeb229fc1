//! A page as PDF (ISO 32000-1): one page of filled paths and words in a font that every reader has. Five
//! objects, whose places the table at the end lists.

use super::sheet::{Ink, Sheet};
use super::svg::mm;
use calibench::geometry::Vec2;
use std::f64::consts::PI;
use std::fmt::Write;

/// Points a millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// Arcs of a circle. A cubic curve leaves an eighth of a circle by 4e-6 of its radius at most (a quarter by
/// 2.7e-4).
const ARCS: usize = 8;

/// The file. It asks to be printed without scaling.
pub(super) fn pdf(sheet: &Sheet) -> Vec<u8> {
    let content = content(sheet);
    let (width, height) = (POINTS * sheet.size.x, POINTS * sheet.size.y);
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_string(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_string(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.4} {height:.4}] /Contents 4 0 R /Resources << /Font << /F 5 0 R >> >> >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>".to_string(),
    ];
    let mut file = String::from("%PDF-1.6\n");
    let mut places = Vec::new();
    for (i, object) in objects.iter().enumerate() {
        places.push(file.len());
        // Writing to a string cannot fail, here and below.
        let _ = write!(file, "{} 0 obj\n{object}\nendobj\n", i + 1);
    }
    let table = file.len();
    let count = places.len() + 1;
    // Every line of the table has twenty bytes.
    let _ = write!(file, "xref\n0 {count}\n0000000000 65535 f \n");
    for place in places {
        let _ = writeln!(file, "{place:010} 00000 n ");
    }
    let _ = write!(file, "trailer\n<< /Size {count} /Root 1 0 R >>\nstartxref\n{table}\n%%EOF\n");
    file.into_bytes()
}

/// The drawing, in millimetres from the top left corner: the first line turns points into them.
fn content(sheet: &Sheet) -> String {
    let mut text = format!("{POINTS:.9} 0 0 -{POINTS:.9} 0 {:.9} cm\n", POINTS * sheet.size.y);
    for ink in &sheet.ink {
        let _ = match ink {
            Ink::Disc { centre, diameter } => writeln!(text, "{} f", circle(*centre, 0.5 * diameter)),
            Ink::Rectangle { corner, size } => {
                writeln!(text, "{} {} {} {} re f", mm(corner.x), mm(corner.y), mm(size.x), mm(size.y))
            }
            Ink::Cells(cells) => {
                for [low, high] in cells {
                    let size = high - low;
                    let _ = writeln!(text, "{} {} {} {} re", mm(low.x), mm(low.y), mm(size.x), mm(size.y));
                }
                writeln!(text, "f")
            }
            // The matrix turns the letters upright again.
            Ink::Words { at, height, text: words } => {
                writeln!(
                    text,
                    "BT /F {height} Tf 1 0 0 -1 {} {} Tm ({}) Tj ET",
                    mm(at.x),
                    mm(at.y),
                    escaped(words)
                )
            }
        };
    }
    text
}

/// A circle as arcs: the handles are `4/3 tan(angle / 4)` radii long.
fn circle(centre: Vec2, radius: f64) -> String {
    let angle = 2.0 * PI / ARCS as f64;
    let handle = 4.0 / 3.0 * libm::tan(0.25 * angle);
    let on = |i: usize| {
        let at = angle * i as f64;
        Vec2::new(libm::cos(at), libm::sin(at))
    };
    let place = |p: Vec2| {
        let p = centre + radius * p;
        format!("{} {}", mm(p.x), mm(p.y))
    };
    let ahead = |p: Vec2| Vec2::new(-p.y, p.x);
    let mut path = format!("{} m", place(on(0)));
    for i in 0..ARCS {
        let (from, to) = (on(i), on(i + 1));
        let _ = write!(
            path,
            " {} {} {} c",
            place(from + handle * ahead(from)),
            place(to - handle * ahead(to)),
            place(to)
        );
    }
    path
}

/// A text in brackets: what ends it gets a backslash.
fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('(', "\\(").replace(')', "\\)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_keep_to_the_circle() {
        let path = circle(Vec2::zeros(), 1000.0);
        let numbers: Vec<f64> = path.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let points: Vec<Vec2> = numbers.chunks(2).map(|p| Vec2::new(p[0], p[1])).collect();
        for curve in points[..points.len() - 1].chunks(3).zip(points[3..].iter().step_by(3)) {
            let ([a, b, c], d) = (<[Vec2; 3]>::try_from(curve.0).unwrap(), *curve.1);
            for k in 0..=20 {
                let t = f64::from(k) / 20.0;
                let s = 1.0 - t;
                let p = s * s * s * a + 3.0 * s * s * t * b + 3.0 * s * t * t * c + t * t * t * d;
                assert!((p.norm() - 1000.0).abs() < 5e-3, "{p}");
            }
        }
    }

    #[test]
    fn the_table_says_where_the_objects_are() {
        let sheet = Sheet::of(&"chess:9x6:25mm".parse().unwrap(), &"A4".parse().unwrap()).unwrap();
        let file = String::from_utf8(pdf(&sheet)).unwrap();
        let (_, start) = file.rsplit_once("startxref\n").unwrap();
        let table = &file[start.lines().next().unwrap().parse().unwrap()..];
        assert!(table.starts_with("xref\n0 6\n"));
        let entries: Vec<&str> = table.lines().skip(3).take(5).collect();
        for (i, entry) in entries.iter().enumerate() {
            let place: usize = entry[..10].parse().unwrap();
            assert!(file[place..].starts_with(&format!("{} 0 obj\n", i + 1)), "{entry}");
        }
        let (_, stream) = file.split_once("stream\n").unwrap();
        let (stream, _) = stream.split_once("endstream").unwrap();
        assert!(file.contains(&format!("/Length {} ", stream.len())));
    }

    #[test]
    fn brackets_in_words_do_not_end_them() {
        assert_eq!(escaped(r"a (b\c)"), r"a \(b\\c\)");
    }
}
