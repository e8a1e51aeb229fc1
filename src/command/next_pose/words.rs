//! What does a photographer do? The best pose in words and numbers, what it brings, and those that come next.

use super::{Arguments, Plan};
use crate::report::table;
use crate::said::written_by;
use calibench::geometry::{Vec2, Vec3, rotation};
use calibench::io::significant;
use calibench::planning::{Candidate, Gain, Ranked, Wish};
use serde_json::{Value, json};
use std::fmt::Write;

/// A view that leaves more than this part of every standard deviation is not worth its photograph.
const HARDLY_LESS: f64 = 0.99;

impl Plan {
    pub(super) fn text(&self) -> String {
        let best = &self.found.ranked[0];
        let names: Vec<&str> = self.wishes.iter().map(|wish| wish.wanted.name()).collect();
        let mut text = format!(
            "The best of {} poses that show every mark, of {} tried, for {}:\n\n",
            self.found.reachable,
            self.found.tried,
            names.join(" and ")
        );
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}\n", self.instruction(&best.candidate));
        let _ = writeln!(text, "{}\n", self.gain_table(best).trim_fmt());
        text.push_str(&self.at_an_end(&best.candidate));
        if best.gains.iter().all(|gain| gain.ratio() > HARDLY_LESS) {
            text.push_str("No photograph of this board from there tells much more of it: other distances, more tilt, or many photographs would.\n\n");
        }
        if self.found.ranked.len() > 1 {
            let _ = writeln!(
                text,
                "Next to it, each another way of holding the board:\n\n{}",
                self.others_table().trim_fmt()
            );
        }
        text
    }

    /// Says where the best pose lies at an end of what was allowed, beyond which there may be a better one.
    fn at_an_end(&self, c: &Candidate) -> String {
        let reach = &self.reach;
        let is_last = |x: f64, all: &[f64]| all.len() > 1 && all.last() == Some(&x);
        let ends = [
            (is_last(c.tilt_rad, &reach.tilts_rad), "the largest tilt allowed (--most-tilt)"),
            (
                reach.distances.len() > 1 && reach.distances.first() == Some(&c.distance),
                "the nearest distance (--distance)",
            ),
            (is_last(c.distance, &reach.distances), "the farthest distance (--distance)"),
        ];
        let named: Vec<&str> = ends.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
        match named.is_empty() {
            true => String::new(),
            false => format!(
                "This is {}: beyond there may be better poses, where the marks are still found as well.\n\n",
                named.join(" and ")
            ),
        }
    }

    /// A length of the target.
    fn length(&self, value: f64) -> String {
        let shown = significant(value, 3);
        if self.unit.is_empty() {
            format!("{shown} (in the target's unit)")
        } else {
            format!("{shown} {}", self.unit)
        }
    }

    fn instruction(&self, c: &Candidate) -> String {
        let turn = match rounded_deg(c.turn_rad) {
            0 => String::new(),
            degrees => format!(" Turn it {degrees} degrees clockwise in its plane."),
        };
        let tilt = match rounded_deg(c.tilt_rad) {
            0 => "Do not tilt it".to_string(),
            degrees => {
                format!(
                    "Tilt it {degrees} degrees, its {} (as the camera sees it) away from the camera",
                    side(c.away_rad)
                )
            }
        };
        let corners: Vec<String> =
            self.corners(c).iter().map(|p| format!("({:.0}, {:.0})", p.x, p.y)).collect();
        format!(
            "Hold the board with its middle {} from the camera, at pixel ({:.0}, {:.0}), {}.\n\
             Let it face the camera there, upright.{turn} {tilt}.\n\
             The marks at its corners are then at {}.",
            self.length(c.distance),
            c.middle_px.x,
            c.middle_px.y,
            part_of(&c.middle_px, self.image_size),
            corners.join(" ")
        )
    }

    /// Pixels of the marks nearest to the corners of the rectangle that holds all, in order around it.
    fn corners(&self, c: &Candidate) -> Vec<Vec2> {
        let low = self.points.iter().fold(Vec2::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = self.points.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
        [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)]
            .iter()
            .filter_map(|corner| {
                let apart = |p: &&Vec2| (*p - corner).norm();
                let mark = self.points.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
                self.known.camera.pixel(&c.cam_from_target.apply(&Vec3::new(mark.x, mark.y, 0.0)))
            })
            .collect()
    }

    fn gain_table(&self, best: &Ranked) -> comfy_table::Table {
        let mut rows =
            table(&["standard deviation of", "so far", "with this view", "", "best view taken, again", ""]);
        for (i, (wish, gain)) in self.wishes.iter().zip(&best.gains).enumerate() {
            let again = self.repeated.as_ref().map(|(view, gains)| (&self.known.views[*view], &gains[i]));
            let (after, change) = again.map_or((String::new(), String::new()), |(view, gain)| {
                (format!("{} ({view})", self.sd(wish, gain.after)), percent(gain))
            });
            rows.add_row([
                wish.wanted.name().to_string(),
                self.sd(wish, gain.before),
                self.sd(wish, gain.after),
                percent(gain),
                after,
                change,
            ]);
        }
        rows
    }

    fn sd(&self, wish: &Wish, value: f64) -> String {
        let unit = match wish.wanted.name() {
            "length" => &self.unit,
            _ => wish.wanted.unit(),
        };
        format!("{} {unit}", significant(value, 4)).trim_end().to_string()
    }

    fn others_table(&self) -> comfy_table::Table {
        let mut header: Vec<&str> = vec!["distance", "middle (px)", "turn", "tilt", "away"];
        header.extend(self.wishes.iter().map(|wish| wish.wanted.name()));
        let mut rows = table(&header);
        for ranked in &self.found.ranked[1..] {
            let c = &ranked.candidate;
            let mut row = vec![
                significant(c.distance, 3),
                format!("({:.0}, {:.0})", c.middle_px.x, c.middle_px.y),
                rounded_deg(c.turn_rad).to_string(),
                rounded_deg(c.tilt_rad).to_string(),
                if c.tilt_rad == 0.0 { String::new() } else { side(c.away_rad).to_string() },
            ];
            row.extend(
                self.wishes
                    .iter()
                    .zip(&ranked.gains)
                    .map(|(wish, gain)| format!("{}, {}", self.sd(wish, gain.after), percent(gain))),
            );
            rows.add_row(row);
        }
        rows
    }

    pub(super) fn json(&self, arguments: &Arguments) -> Value {
        json!({
            "written_by": written_by(),
            "result": arguments.result.display().to_string(),
            "image_size": [self.image_size.0, self.image_size.1],
            "doubts": self.known.doubts,
            "mark_sd_px": self.sigma_px,
            "unit": self.unit,
            "marks": self.points.len(),
            "tried": self.found.tried,
            "reachable": self.found.reachable,
            "poses": self.found.ranked.iter().map(|ranked| self.ranked_json(ranked)).collect::<Vec<_>>(),
            "best_view_again": self.repeated.as_ref().map(|(view, gains)| json!({
                "view": self.known.views[*view],
                "gains": self.gains_json(gains),
            })),
        })
    }

    fn ranked_json(&self, ranked: &Ranked) -> Value {
        let c = &ranked.candidate;
        let pose = &c.cam_from_target;
        json!({
            "words": self.instruction(c),
            "distance": c.distance,
            "middle_px": [c.middle_px.x, c.middle_px.y],
            "turn_deg": c.turn_rad.to_degrees(),
            "tilt_deg": c.tilt_rad.to_degrees(),
            "away_deg": (c.tilt_rad != 0.0).then(|| c.away_rad.to_degrees()),
            "rotation_vector_rad": <[f64; 3]>::from(rotation::log(&pose.rotation)),
            "translation": <[f64; 3]>::from(pose.translation),
            "corners_px": self.corners(c).iter().map(|p| [p.x, p.y]).collect::<Vec<_>>(),
            "gains": self.gains_json(&ranked.gains),
        })
    }

    fn gains_json(&self, gains: &[Gain]) -> Vec<Value> {
        let gain = |(wish, gain): (&Wish, &Gain)| {
            json!({
                "quantity": wish.wanted.name(),
                "sd_before": gain.before,
                "sd_after": gain.after,
                "ratio": gain.ratio(),
            })
        };
        self.wishes.iter().zip(gains).map(gain).collect()
    }
}

fn rounded_deg(rad: f64) -> i32 {
    libm::round(rad.to_degrees()) as i32
}

/// By how much a standard deviation is lower.
fn percent(gain: &Gain) -> String {
    format!("-{:.1} %", 100.0 * (1.0 - gain.ratio()))
}

/// The side of the board, in the image, that lies in a direction: rad from right to down.
fn side(direction_rad: f64) -> &'static str {
    const SIDES: [&str; 8] = [
        "right side",
        "lower right corner",
        "lower side",
        "lower left corner",
        "left side",
        "upper left corner",
        "upper side",
        "upper right corner",
    ];
    let eighth = libm::round(direction_rad.to_degrees() / 45.0) as usize;
    SIDES[eighth % SIDES.len()]
}

/// In which part of the image a pixel lies: one of nine.
fn part_of(pixel: &Vec2, (width, height): (usize, usize)) -> &'static str {
    const PARTS: [[&str; 3]; 3] = [
        ["in the upper left of the image", "at the top of the image", "in the upper right of the image"],
        ["at the left of the image", "in the middle of the image", "at the right of the image"],
        ["in the lower left of the image", "at the bottom of the image", "in the lower right of the image"],
    ];
    let third = |x: f64, side: usize| ((3.0 * (x + 0.5) / side as f64) as usize).min(2);
    PARTS[third(pixel.y, height)][third(pixel.x, width)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_and_parts_are_those_of_the_image_as_it_is_seen() {
        let named = [0.0, 90.0, 180.0, 270.0, 315.0].map(|degrees: f64| side(degrees.to_radians()));
        assert_eq!(named, ["right side", "lower side", "left side", "upper side", "upper right corner"]);
        let part = |u: f64, v: f64| part_of(&Vec2::new(u, v), (640, 480));
        assert_eq!(part(320.0, 240.0), "in the middle of the image");
        assert_eq!(part(10.0, 470.0), "in the lower left of the image");
        assert_eq!(part(639.0, 0.0), "in the upper right of the image");
    }

    #[test]
    fn a_part_that_remains_is_told_as_what_is_saved() {
        assert_eq!(percent(&Gain { before: 0.8, after: 0.6 }), "-25.0 %");
    }
}
