//! `calibench noise PHOTOS...|CSV`: how much do the marks of a still board scatter from frame to frame, and
//! was it still?

use super::calibrate::{Views, parse_size, refuse_views_outside, views_of};
use super::diff::parse_rate;
use super::format::Format;
use super::report::table;
use super::said::{Said, number_that, say, written_by};
use super::{Exit, warn};
use crate::board::board_or_file;
use calibench::board::View;
use calibench::evaluate::Interval;
use calibench::io::memory::{DEFAULT_MEMORY, parse_bytes};
use calibench::io::significant;
use calibench::noise::{
    Correlation, Deviation, ExtractionNoise, Scatter, Test, extraction_noise, frames_for,
};
use calibench::photos::BoardSpec;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

/// What the exit codes mean here.
const EXIT_CODES: &str = "\
Exit codes:
  0  measured, and nothing but noise changed
  1  measured, but more than noise changed: motion, drift, or marks that follow the light
  2  wrong usage or input
  3  incomplete";

#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub(super) struct Arguments {
    /// Photographs of a board that nobody touched, in the order in which they were taken, with --board; or a
    /// corner file (view,point,X,Y,u,v), a view a frame
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The board in the photographs, as for `calibench calibrate`
    #[arg(long, value_name = "BOARD", value_parser = board_or_file)]
    board: Option<BoardSpec>,
    /// Says how many frames it takes to know a standard deviation to this many per cent
    #[arg(long, value_name = "PERCENT", value_parser = parse_percent, default_value_t = 5.0)]
    want: f64,
    /// Rate of false alarms of each test
    #[arg(long, value_name = "RATE", value_parser = parse_rate, default_value_t = 0.01)]
    rate: f64,
    /// Size that the photographs must have [default: that of most]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    image_size: Option<(usize, usize)>,
    /// Memory that photographs may take together [default: 2GiB]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes, default_value_t = DEFAULT_MEMORY, hide_default_value = true)]
    memory: u64,
    /// Folder for noise.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// Precisions that frames can reach.
fn parse_percent(text: &str) -> Result<f64, String> {
    number_that(text, |x| (0.1..=50.0).contains(&x), "a number of per cent from 0.1 to 50")
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let found = found(arguments);
    let holds = found.as_ref().is_ok_and(|found| found.noise.still.holds());
    let said = found.map(|found| Said { text: found.text(arguments), json: found.json(arguments) });
    match say(said, arguments.out.as_deref(), "noise.json", arguments.format) {
        Exit::Held if !holds => Exit::Deviates,
        exit => exit,
    }
}

struct Found {
    views: Views,
    /// Each frame's light over the mean of all.
    light: Option<Vec<f64>>,
    noise: ExtractionNoise,
}

fn found(arguments: &Arguments) -> Result<Found, String> {
    let views = views_of(&arguments.files, arguments.board.as_ref(), arguments.image_size, arguments.memory)?;
    let pixels = views.views.iter().map(View::pixels);
    refuse_views_outside(&views.source, arguments.image_size, views.names.iter().zip(pixels))?;
    let mean = views.light.iter().sum::<f64>() / views.light.len() as f64;
    let light = (mean > 0.0).then(|| views.light.iter().map(|level| level / mean).collect::<Vec<f64>>());
    let noise = extraction_noise(&views.views, light.as_deref(), arguments.rate)
        .map_err(|error| format!("{}: {error}", views.source))?;
    if noise.marks_left_out > 0 {
        warn(&format!("warning: {} marks are missing in some frame and are left out", noise.marks_left_out));
    }
    Ok(Found { views, light, noise })
}

fn from_to(interval: Interval, digits: usize) -> String {
    format!("{} to {}", significant(interval.low, digits), significant(interval.high, digits))
}

fn deviation_cell(deviation: &Deviation) -> String {
    format!("{} ({})", significant(deviation.value_px, 4), from_to(deviation.interval_px, 4))
}

fn correlation_cell(correlation: Option<Correlation>) -> String {
    let Some(Correlation { value, interval: Interval { low, high }, .. }) =
        correlation.filter(|c| c.value.is_finite())
    else {
        return "-".into();
    };
    format!("{value:+.3} ({low:+.3} to {high:+.3})")
}

impl Found {
    fn text(&self, arguments: &Arguments) -> String {
        let mut text = format!("{}\n\n{}\n\n", self.marks_text(), self.scatter_text());
        text += &self.tests_text();
        let light = self.light.iter().flatten().copied();
        let (low, high) = light.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        // Writing to a string cannot fail, here and below.
        if high > 0.0 {
            let _ = writeln!(
                text,
                "light on the board: from {} to {} of its mean",
                significant(low, 5),
                significant(high, 5)
            );
        }
        let sigma = &self.noise.within.sigma_px;
        let _ = writeln!(
            text,
            "noise of a coordinate within the frames: {} px, 95 % from {} on {} degrees of freedom",
            significant(sigma.value_px, 4),
            from_to(sigma.interval_px, 4),
            significant(sigma.degrees_of_freedom, 4)
        );
        text += &self.frames_text(arguments.want);
        let verdict = match self.noise.still.holds() {
            true => "nothing but noise changed from frame to frame",
            false => "more than noise changed from frame to frame",
        };
        let _ = writeln!(text, "{verdict} (false alarms of each test at {})", arguments.rate);
        text
    }

    fn frames_text(&self, percent: f64) -> String {
        let [together, alone] = self.frames_wanted(percent);
        format!(
            "to {percent} %: {together} frames like these for all marks together, {alone} for a coordinate of one mark\n"
        )
    }

    /// Frames that a precision takes, for all marks together and for a coordinate of one.
    fn frames_wanted(&self, percent: f64) -> [usize; 2] {
        [self.noise.within.independent_coordinates, 1.0].map(|m| frames_for(0.01 * percent, m))
    }

    fn marks_text(&self) -> String {
        let mut rows =
            table(&["mark", "u (px)", "v (px)", "sigma u", "sigma v", "correlation", "noisier by chance"]);
        for mark in &self.noise.marks {
            rows.add_row([
                format!("{}, {}", significant(mark.point.x, 6), significant(mark.point.y, 6)),
                significant(mark.mean_px.x, 7),
                significant(mark.mean_px.y, 7),
                significant(mark.sigma_px.x, 3),
                significant(mark.sigma_px.y, 3),
                // Where a coordinate does not scatter there is none.
                if mark.correlation_uv.is_finite() {
                    format!("{:+.2}", mark.correlation_uv)
                } else {
                    "-".into()
                },
                significant(mark.p_value, 2),
            ]);
        }
        let (low, high) = self.noise.factors_of_a_mark();
        format!(
            "{}\n\na mark's sigma within the frames is known to a factor of {low:.2} to {high:.2} (95 %)",
            rows.trim_fmt()
        )
    }

    fn scatter_text(&self) -> String {
        let (seen, within) = (&self.noise.as_seen, &self.noise.within);
        let mut rows =
            table(&["95 % intervals", "as seen", "within the frames, motion as a whole taken off"]);
        let mut row = |name: &str, cell: &dyn Fn(&Scatter) -> String| {
            rows.add_row([name.to_string(), cell(seen), cell(within)]);
        };
        row("sigma of u (px)", &|s| deviation_cell(&s.sigma_u_px));
        row("sigma of v (px)", &|s| deviation_cell(&s.sigma_v_px));
        row("correlation of u and v", &|s| correlation_cell(s.correlation_uv));
        row("of neighbouring marks", &|s| correlation_cell(s.correlation_neighbours));
        row("with the next frame", &|s| correlation_cell(s.correlation_next_frame));
        row("independent coordinates", &|s| significant(s.independent_coordinates, 3));
        rows.trim_fmt()
    }

    fn tests_text(&self) -> String {
        let mut text = String::new();
        for (name, test, found) in self.tests() {
            let Some(test) = test else { continue };
            let said = if self.noise.still.passes(&test) { "no" } else { found };
            let _ = writeln!(
                text,
                "{name}: {said} (F {} on {} and {}, by chance with probability {})",
                significant(test.ratio, 4),
                test.degrees_of_freedom[0],
                test.degrees_of_freedom[1],
                significant(test.p_value, 2)
            );
        }
        let largest = self.noise.frames.iter().zip(&self.views.names);
        let largest = largest.max_by(|a, b| a.0.rms_px.total_cmp(&b.0.rms_px));
        if let Some((frame, name)) = largest {
            let drift = self.noise.still.drift_px;
            let _ = writeln!(
                text,
                "largest motion as a whole: {} px RMS in {name}; over all frames a drift of ({}, {}) px",
                significant(frame.rms_px, 3),
                significant(drift.x, 3),
                significant(drift.y, 3)
            );
        }
        text
    }

    /// The tests, with what each asks and what it says where it finds something.
    fn tests(&self) -> [(&'static str, Option<Test>, &'static str); 4] {
        let still = &self.noise.still;
        [
            (
                "the marks move together",
                Some(still.motion),
                "YES, board or camera shook, or their noise is common to neighbours",
            ),
            ("they drift together", still.drift, "YES, board or camera was moving"),
            (
                "they drift against each other",
                still.bending,
                "YES, the board bends, the lens warms up, or a shadow moves",
            ),
            ("they follow the light", still.light, "YES, the light flickers, and marks with it"),
        ]
    }

    fn json(&self, arguments: &Arguments) -> Value {
        let still = &self.noise.still;
        let [together, alone] = self.frames_wanted(arguments.want);
        let light = self.light.as_deref();
        let frames = self.noise.frames.iter().zip(&self.views.names).enumerate();
        json!({
            "written_by": written_by(),
            "source": self.views.source,
            "rate": arguments.rate,
            "still": still.holds(),
            "as_seen": scatter_json(&self.noise.as_seen),
            "within": scatter_json(&self.noise.within),
            "tests": {
                "motion": test_json(still.motion),
                "drift": still.drift.map(test_json),
                "bending": still.bending.map(test_json),
                "light": still.light.map(test_json),
            },
            "drift_px": [still.drift_px.x, still.drift_px.y],
            "frames_wanted": { "percent": arguments.want, "together": together, "one_coordinate": alone },
            "marks_left_out": self.noise.marks_left_out,
            "marks": self.noise.marks.iter().map(|mark| json!({
                "point": [mark.point.x, mark.point.y],
                "mean_px": [mark.mean_px.x, mark.mean_px.y],
                "sigma_px": [mark.sigma_px.x, mark.sigma_px.y],
                "correlation_uv": mark.correlation_uv,
                "p_value": mark.p_value,
            })).collect::<Vec<_>>(),
            "frames": frames.map(|(i, (frame, name))| json!({
                "name": name,
                "shift_px": [frame.shift_px.x, frame.shift_px.y],
                "rms_px": frame.rms_px,
                "light": light.map(|light| light[i]),
            })).collect::<Vec<_>>(),
        })
    }
}

fn interval_json(interval: Interval) -> Value {
    json!([interval.low, interval.high])
}

fn scatter_json(scatter: &Scatter) -> Value {
    let deviation = |d: &Deviation| {
        json!({
            "value_px": d.value_px,
            "interval_px": interval_json(d.interval_px),
            "degrees_of_freedom": d.degrees_of_freedom,
        })
    };
    let correlation = |c: &Correlation| json!({ "value": c.value, "interval": interval_json(c.interval) });
    json!({
        "sigma": deviation(&scatter.sigma_px),
        "sigma_u": deviation(&scatter.sigma_u_px),
        "sigma_v": deviation(&scatter.sigma_v_px),
        "independent_coordinates": scatter.independent_coordinates,
        "correlation_uv": scatter.correlation_uv.as_ref().map(correlation),
        "correlation_neighbours": scatter.correlation_neighbours.as_ref().map(correlation),
        "correlation_next_frame": scatter.correlation_next_frame.as_ref().map(correlation),
    })
}

fn test_json(test: Test) -> Value {
    json!({ "ratio": test.ratio, "degrees_of_freedom": test.degrees_of_freedom, "p_value": test.p_value })
}
