//! `calibench study plan`: what must be photographed for a wanted accuracy?

use super::finished::estimated_json;
use super::{Failure, read};
use crate::calibrate::Format;
use crate::said::{print_as, written_by};
use crate::{Exit, print};
use calibench::io::ShownPath;
use calibench::io::significant;
use calibench_harness::ProgressDisplay;
use calibench_study::plan::{Confirmation, Design, Goal, PlanError, Search, choose, confirm, search};
use calibench_study::{Length, Spec};
use comfy_table::{Table, presets};
use serde_json::{Value, json};
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
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
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
    // People see the designs before the trials, which take a while.
    if arguments.format == Format::Text {
        print(&designs_text(&designs, arguments));
    }
    let chosen = choose(&designs);
    let confirmed = chosen.map(|chosen| confirmation(&spec, chosen, arguments)).transpose()?.flatten();
    print_as(
        arguments.format,
        || outcome_text(chosen, confirmed.as_ref(), arguments),
        || plan_json(&designs, chosen, confirmed.as_ref(), arguments),
    );
    let is_met = confirmed.is_some_and(|confirmed| is_met(&confirmed, &arguments.want));
    Ok(if is_met { Exit::Held } else { Exit::Deviates })
}

/// The plan fails where the measured interval lies above what is wanted.
fn is_met(confirmed: &Confirmation, want: &Goal) -> bool {
    confirmed.sd.low <= want.sd
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

/// What trials say of the chosen design; `None` where too few converge.
fn confirmation(
    spec: &Spec,
    chosen: &Design,
    arguments: &Arguments,
) -> Result<Option<Confirmation>, Failure> {
    let progress = ProgressDisplay::stderr().start("confirming", arguments.confirm as usize);
    let mut shown = 0;
    Ok(confirm(spec, &arguments.want, chosen, arguments.distance, arguments.confirm, |pace| {
        progress.advance((pace.trials - shown) as usize);
        shown = pace.trials;
    })?)
}

fn outcome_text(chosen: Option<&Design>, confirmed: Option<&Confirmation>, arguments: &Arguments) -> String {
    let Some(chosen) = chosen else {
        return "No design suffices: allow more views or tilt, reduce the noise, or hold parameters.\n"
            .into();
    };
    let Some(c) = confirmed else {
        return "Too few trials converged to confirm anything: the bound promises what no calibration of these views keeps.\n".into();
    };
    format!(
        "Chosen: {} views, tilt {} deg, coverage {}. {} trials, {:.1} % converged: sd({}) = {} [{}, {}], {} [{}, {}] of the \
         prediction: {}.\n",
        chosen.enough.map_or(0, |e| e.0),
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
        if is_met(c, &arguments.want) { "confirmed" } else { "NOT confirmed, plan with more views" },
    )
}

fn plan_json(
    designs: &[Design],
    chosen: Option<&Design>,
    confirmed: Option<&Confirmation>,
    arguments: &Arguments,
) -> Value {
    json!({
        "written_by": written_by(),
        "want": { "quantity": arguments.want.quantity, "sd": arguments.want.sd },
        "most_views": arguments.most_views,
        "distance_mm": arguments.distance,
        "designs": designs.iter().map(design_json).collect::<Vec<_>>(),
        "chosen": chosen.map(design_json),
        "confirmed": confirmed.map(|c| json!({
            "trials": c.trials,
            "converged": c.converged,
            "sd": estimated_json(&c.sd),
            "ratio": estimated_json(&c.ratio),
            "met": is_met(c, &arguments.want),
        })),
    })
}

/// `views` is `null` where no number of them suffices; `predicted_sd` is then that of the most views, if there is one.
fn design_json(design: &Design) -> Value {
    let best = design.best.as_ref();
    json!({
        "tilt_deg": design.tilt_deg,
        "coverage": design.coverage,
        "views": design.enough.map(|(views, _)| views),
        "predicted_sd": design.enough.map(|(_, sd)| sd).or(best.ok().copied().flatten()),
        "refused": best.err(),
    })
}
