//! `calibench study plan`: what must be photographed for a wanted accuracy?

use super::{Failure, read};
use crate::{Exit, print};
use calibench::io::ShownPath;
use calibench::io::significant;
use calibench_harness::ProgressDisplay;
use calibench_study::plan::{Design, Goal, PlanError, Search, choose, confirm, search};
use calibench_study::{Length, Spec};
use comfy_table::{Table, presets};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// A study whose camera, target, noise and estimator are planned for
    spec: PathBuf,
    /// What is wanted: a quantity and its largest standard deviation, such as fx=0.5 (px) or length=0.01 (mm)
    #[arg(long, value_name = "QUANTITY=SD", value_parser = parse_goal)]
    want: Goal,
    /// For `length`: place of its middle in the camera's frame, mm
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_negative_numbers = true)]
    at: Option<Vec<f64>>,
    /// For `length`: the length, mm
    #[arg(long, value_name = "MM", requires = "at")]
    length: Option<f64>,
    /// Tilts to try, degrees
    #[arg(long, value_delimiter = ',', default_values_t = [10.0, 20.0, 30.0, 40.0])]
    tilt: Vec<f64>,
    /// Coverages to try, 0 to 1
    #[arg(long, value_delimiter = ',', default_values_t = [0.0, 0.5, 1.0])]
    coverage: Vec<f64>,
    /// Depth of the target, mm
    #[arg(long, default_value_t = 160.0)]
    distance: f64,
    /// Most views
    #[arg(long, default_value_t = 200)]
    most_views: usize,
    /// Trials that confirm the plan
    #[arg(long, default_value_t = 500)]
    confirm: u64,
}

fn parse_goal(text: &str) -> Result<Goal, String> {
    let parts = text.split_once('=').and_then(|(quantity, sd)| Some((quantity, sd.parse().ok()?)));
    let (quantity, sd) = parts.ok_or("write QUANTITY=SD, such as fx=0.5")?;
    Ok(Goal { quantity: quantity.to_string(), sd })
}

impl From<PlanError> for Failure {
    fn from(error: PlanError) -> Failure {
        Failure::usage(error.to_string())
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let mut spec = Spec::parse(&read(&arguments.spec)?)
        .map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.shown())))?;
    if let Some(length) = length(arguments)? {
        spec.scene.length = Some(length);
    }
    if arguments.confirm < 4 || arguments.most_views == 0 {
        return Err(Failure::usage("--confirm needs at least 4 trials, --most-views at least 1 view"));
    }
    let range = Search {
        tilts_deg: arguments.tilt.clone(),
        coverages: arguments.coverage.clone(),
        most_views: arguments.most_views,
        distance_mm: arguments.distance,
    };
    let designs = search(&spec, &arguments.want, &range)?;
    print(&designs_text(&designs, arguments));
    let Some(chosen) = choose(&designs) else {
        print("No design suffices: allow more views or tilt, reduce the noise, or hold parameters.\n");
        return Ok(Exit::Deviates);
    };
    judge(&spec, chosen, arguments)
}

fn length(arguments: &Arguments) -> Result<Option<Length>, Failure> {
    match (&arguments.at, arguments.length) {
        (None, _) => Ok(None),
        (Some(at), Some(length_mm)) => {
            let centre_mm =
                at.as_slice().try_into().map_err(|_| Failure::usage("--at needs three numbers: X,Y,Z"))?;
            Ok(Some(Length { centre_mm, length_mm, direction_deg: 0.0 }))
        }
        (Some(_), None) => Err(Failure::usage("--at needs --length MM too")),
    }
}

fn designs_text(designs: &[Design], arguments: &Arguments) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["tilt (deg)", "coverage", "views", "predicted sd"]);
    for d in designs {
        let (views, sd) = match (&d.enough, &d.best) {
            (Some((views, sd)), _) => (views.to_string(), significant(*sd, 4)),
            (None, Ok(Some(sd))) => (format!("> {}", arguments.most_views), significant(*sd, 4)),
            (None, Ok(None)) => ("none".to_string(), "not determined".to_string()),
            (None, Err(why)) => ("none".to_string(), why.clone()),
        };
        table.add_row([d.tilt_deg.to_string(), d.coverage.to_string(), views, sd]);
    }
    format!("Fewest views for sd({}) <= {}:\n{table}\n", arguments.want.quantity, arguments.want.sd)
}

fn judge(spec: &Spec, chosen: &Design, arguments: &Arguments) -> Result<Exit, Failure> {
    let progress = ProgressDisplay::stderr().start("confirming", arguments.confirm as usize);
    let mut shown = 0;
    let confirmed = confirm(spec, &arguments.want, chosen, arguments.distance, arguments.confirm, |pace| {
        progress.advance((pace.trials - shown) as usize);
        shown = pace.trials;
    })?;
    drop(progress);
    let views = chosen.enough.map_or(0, |e| e.0);
    let Some(c) = confirmed else {
        print(
            "Too few trials converged to confirm anything: the bound promises what no calibration of these views keeps.\n",
        );
        return Ok(Exit::Deviates);
    };
    // The plan fails where the measured interval lies above what is wanted.
    let met = c.sd.low <= arguments.want.sd;
    print(&format!(
        "Chosen: {views} views, tilt {} deg, coverage {}. {} trials, {:.1} % converged: sd({}) = {} [{}, {}], {} [{}, {}] of the \
         prediction: {}.\n",
        chosen.tilt_deg,
        chosen.coverage,
        c.trials,
        100.0 * c.converged,
        arguments.want.quantity,
        significant(c.sd.value, 4),
        significant(c.sd.low, 4),
        significant(c.sd.high, 4),
        significant(c.ratio.value, 4),
        significant(c.ratio.low, 4),
        significant(c.ratio.high, 4),
        if met { "confirmed" } else { "NOT confirmed, plan with more views" },
    ));
    Ok(if met { Exit::Held } else { Exit::Deviates })
}
