//! `calibench study plan`: what must be photographed for a wanted accuracy? Designs by the bound, then trials
//! of the smallest one that suffices, with more views until they confirm it.

use super::finished::estimated_json;
use super::{Failure, read_study};
use crate::format::Format;
use crate::said::{print_as, written_by};
use crate::{Exit, print, warn};
use calibench::io::ShownPath;
use calibench::io::significant;
use calibench_harness::ProgressDisplay;
use calibench_study::plan::{
    Attempt, Design, Finding, Goal, Outcome, PlanError, Search, attempt, next_views, ranked, search,
};
use calibench_study::{Estimated, Length, Spec};
use comfy_table::{Table, presets};
use serde_json::{Value, json};
use std::path::PathBuf;

/// What the exit codes mean here.
const EXIT_CODES: &str = "\
Exit codes:
  0  confirmed: the whole interval of every wanted standard deviation lies at or below the wish
  1  no design reaches what is wanted, or trials with the most views refute it
  2  wrong usage or input
  3  undecided: with the most views the interval still holds the wish; it is said how many trials would decide";

#[derive(Debug, clap::Args)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Arguments {
    /// A study whose camera, target, noise and estimator are planned for
    spec: PathBuf,
    /// What is wanted: a quantity and its largest standard deviation, such as fx=0.5 (px) or length=0.01
    /// (mm); may be repeated, and then all must hold
    #[arg(long, value_name = "QUANTITY=SD", value_parser = parse_goal, required = true)]
    want: Vec<Goal>,
    /// For `length`: place of its middle in the camera's frame, mm
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',')]
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
    /// Most views, also of those tried after a number that trials did not confirm
    #[arg(long, default_value_t = 200, value_parser = crate::said::whole::<usize>)]
    most_views: usize,
    /// Trials of each number of views that is tried
    #[arg(long, default_value_t = 500, value_parser = crate::said::whole::<u64>)]
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
    let (text, inputs) = read_study(&arguments.spec)?;
    let mut spec = Spec::parse_with(&text, &inputs)
        .map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.shown())))?;
    if let Some(length) = length(arguments)? {
        spec.scene.length = Some(length);
    }
    warn_of_factors(&spec);
    if arguments.confirm < 4 || arguments.most_views == 0 {
        return Err(Failure::usage("--confirm needs at least 4 trials, --most-views at least 1 view"));
    }
    // A study's numbers are those of TOML, which end at 2^63; its own limits are far below.
    if u32::try_from(arguments.most_views).is_err() {
        return Err(Failure::usage(format!("--most-views {}: no trial shows so many", arguments.most_views)));
    }
    let range = Search {
        tilts_deg: arguments.tilt.clone(),
        coverages: arguments.coverage.clone(),
        most_views: arguments.most_views,
        distance_mm: arguments.distance,
    };
    let designs = search(&spec, &arguments.want, &range)?;
    // People see the designs before the trials, which take a while.
    say(arguments, || designs_text(&designs, arguments));
    let tried = attempts(&spec, ranked(&designs, &arguments.want), &range, arguments)?;
    let (chosen, attempts) = tried.into_iter().unzip::<_, _, Vec<_>, Vec<_>>();
    let reached = Reached { designs: &designs, chosen: chosen.last().copied(), attempts: &attempts };
    print_as(arguments.format, || reached.text(arguments), || reached.json(arguments));
    Ok(reached.exit())
}

/// To people only.
fn say(arguments: &Arguments, text: impl FnOnce() -> String) {
    if arguments.format == Format::Text {
        print(&text());
    }
}

/// A plan is for one scene: that of `[scene]`.
fn warn_of_factors(spec: &Spec) {
    let names: Vec<String> = spec.factor.iter().map(|factor| factor.name.clone()).collect();
    if !names.is_empty() {
        warn(&format!(
            "warning: the study's factors are left out of the plan, which is for [scene] alone: {}",
            names.join(", ")
        ));
    }
}

/// Trials of the designs that suffice by the bound, fewest views first, each with more views until they
/// confirm it or there may be no more. A design with which too few trials converge waits, with twice its
/// views, until none has fewer; one that answers is the last.
fn attempts<'a>(
    spec: &Spec,
    mut open: Vec<(usize, &'a Design)>,
    range: &Search,
    arguments: &Arguments,
) -> Result<Vec<(&'a Design, Attempt)>, Failure> {
    let mut made = Vec::new();
    while !open.is_empty() {
        let (views, design) = open.remove(0);
        let tried = shown_attempt(spec, (views, design), arguments)?;
        if !tried.findings.is_empty() {
            open.clear();
        }
        let next = match tried.outcome() {
            Outcome::Confirmed => None,
            Outcome::Refuted | Outcome::Undecided => {
                next_views(spec, &arguments.want, (&tried, design), range)?
            }
        };
        if let Some(next) = next {
            open.insert(open.partition_point(|(views, _)| *views <= next), (next, design));
        }
        made.push((design, tried));
    }
    Ok(made)
}

/// Trials of a design, with their progress and what came of them.
fn shown_attempt(
    spec: &Spec,
    (views, design): (usize, &Design),
    arguments: &Arguments,
) -> Result<Attempt, Failure> {
    let what = format!("trying {views} views, tilt {} deg, coverage {}", design.tilt_deg, design.coverage);
    let progress = ProgressDisplay::stderr().start(&what, arguments.confirm as usize);
    let mut shown = 0;
    let (goals, distance_mm) = (&arguments.want, arguments.distance);
    let tried = attempt(spec, goals, (views, design), distance_mm, arguments.confirm, |pace| {
        progress.advance((pace.trials - shown) as usize);
        shown = pace.trials;
    })?;
    drop(progress);
    say(arguments, || attempt_text(&tried));
    Ok(tried)
}

/// All that was found.
struct Reached<'a> {
    designs: &'a [Design],
    chosen: Option<&'a Design>,
    attempts: &'a [Attempt],
}

impl Reached<'_> {
    /// What the last attempt says; `None` where no design suffices.
    fn outcome(&self) -> Option<Outcome> {
        self.attempts.last().map(Attempt::outcome)
    }

    fn exit(&self) -> Exit {
        match self.outcome() {
            Some(Outcome::Confirmed) => Exit::Held,
            Some(Outcome::Undecided) => Exit::Incomplete,
            Some(Outcome::Refuted) | None => Exit::Deviates,
        }
    }

    fn text(&self, arguments: &Arguments) -> String {
        let (Some(chosen), Some(last)) = (self.chosen, self.attempts.last()) else {
            return "NOT REACHED by any design: allow more views or tilt, reduce the noise, or hold parameters.\n".into();
        };
        let most = arguments.most_views;
        match last.outcome() {
            Outcome::Confirmed => format!(
                "CONFIRMED: {} views, tilt {} deg, coverage {}.\n",
                last.views, chosen.tilt_deg, chosen.coverage
            ),
            Outcome::Refuted if last.findings.is_empty() => format!(
                "REFUTED: too few trials converged with any of these designs, with up to {most} views: the bound promises what no \
                 calibration of these views keeps.\n"
            ),
            Outcome::Refuted if last.is_off() => format!(
                "REFUTED with {most} views, the most: the mean error is larger than what is wanted. Camera, board or noise are not what the \
                 estimator takes them for.\n"
            ),
            Outcome::Refuted => format!(
                "REFUTED with {most} views, the most: the estimator does not keep the bound here. Allow more views (--most-views), or \
                 reduce the noise.\n"
            ),
            Outcome::Undecided => format!(
                "UNDECIDED with {most} views, the most: the interval holds what is wanted. {}, or allow more views (--most-views).\n",
                match last.deciding_trials() {
                    Some(trials) => format!("About {trials} trials would decide it (--confirm {trials})"),
                    None => "No number of trials of use would decide it".into(),
                }
            ),
        }
    }

    fn json(&self, arguments: &Arguments) -> Value {
        let wanted = |goal: &Goal| json!({ "quantity": goal.quantity, "sd": goal.sd });
        let last = self.attempts.last();
        json!({
            "written_by": written_by(),
            "want": arguments.want.iter().map(wanted).collect::<Vec<_>>(),
            "most_views": arguments.most_views,
            "distance_mm": arguments.distance,
            "designs": self.designs.iter().map(|design| design_json(design, arguments)).collect::<Vec<_>>(),
            "chosen": self.chosen.map(|design| design_json(design, arguments)),
            "attempts": self.attempts.iter().map(attempt_json).collect::<Vec<_>>(),
            "outcome": self.outcome().map_or("not-reached", Outcome::name),
            "confirmed_views": last.filter(|last| last.outcome() == Outcome::Confirmed).map(|last| last.views),
            "deciding_trials": last.and_then(Attempt::deciding_trials),
        })
    }
}

fn length(arguments: &Arguments) -> Result<Option<Length>, Failure> {
    let is_wanted = arguments.want.iter().any(|goal| goal.quantity == "length");
    match (&arguments.at, arguments.length) {
        (None, _) => Ok(None),
        (Some(_), _) if !is_wanted => Err(Failure::usage("--at and --length are for --want length=SD")),
        (Some(at), Some(length_mm)) => {
            let centre_mm =
                at.as_slice().try_into().map_err(|_| Failure::usage("--at needs three numbers: X,Y,Z"))?;
            Ok(Some(Length { centre_mm, length_mm, direction_deg: 0.0 }))
        }
        (Some(_), None) => Err(Failure::usage("--at needs --length MM too")),
    }
}

fn designs_text(designs: &[Design], arguments: &Arguments) -> String {
    let wanted: Vec<String> =
        arguments.want.iter().map(|goal| format!("sd({}) <= {}", goal.quantity, goal.sd)).collect();
    let predicted = arguments.want.iter().map(|goal| format!("predicted sd({})", goal.quantity));
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["tilt (deg)", "coverage", "views"].map(String::from).into_iter().chain(predicted));
    for d in designs {
        let numbers = |sds: &[f64]| sds.iter().map(|sd| significant(*sd, 4)).collect::<Vec<_>>();
        let (views, sds) = match (&d.enough, &d.best) {
            (Some((views, sds)), _) => (views.to_string(), numbers(sds)),
            (None, Ok(Some(sds))) => (format!("> {}", arguments.most_views), numbers(sds)),
            (None, Ok(None)) => ("none".to_string(), vec!["not determined".to_string()]),
            (None, Err(why)) => ("none".to_string(), vec![why.clone()]),
        };
        table.add_row([d.tilt_deg.to_string(), d.coverage.to_string(), views].into_iter().chain(sds));
    }
    format!("Fewest views for {}:\n{table}\n", wanted.join(" and "))
}

fn attempt_text(tried: &Attempt) -> String {
    let head = format!(
        "{} view{}, tilt {} deg, coverage {}: {} trials, {:.1} % converged",
        tried.views,
        if tried.views == 1 { "" } else { "s" },
        tried.tilt_deg,
        tried.coverage,
        tried.trials,
        100.0 * tried.converged
    );
    if tried.findings.is_empty() {
        return format!("{head}: too few, 95 % are wanted.\n");
    }
    let findings: Vec<String> = tried.findings.iter().map(finding_text).collect();
    format!("{head}: {}.\n", findings.join("; "))
}

fn finding_text(f: &Finding) -> String {
    let interval = |e: &Estimated| {
        format!("{} [{}, {}]", significant(e.value, 4), significant(e.low, 4), significant(e.high, 4))
    };
    let outcome = match (f.outcome, f.deciding_trials) {
        (Outcome::Confirmed, _) => "confirmed".into(),
        (Outcome::Refuted, _) => "REFUTED".into(),
        (Outcome::Undecided, Some(trials)) => format!("undecided, about {trials} trials would decide"),
        (Outcome::Undecided, None) => "undecided".into(),
    };
    let mean = match f.mean.low > 0.0 || f.mean.high < 0.0 {
        true => format!(", mean error {}", interval(&f.mean)),
        false => String::new(),
    };
    format!(
        "sd({}) = {}, {} of the prediction{mean}: {outcome}",
        f.goal.quantity,
        interval(&f.sd),
        interval(&f.ratio)
    )
}

fn attempt_json(tried: &Attempt) -> Value {
    let finding = |f: &Finding| {
        json!({
            "quantity": f.goal.quantity,
            "wanted_sd": f.goal.sd,
            "predicted_sd": f.predicted_sd,
            "sd": estimated_json(&f.sd),
            "ratio": estimated_json(&f.ratio),
            "mean_error": estimated_json(&f.mean),
            "outcome": f.outcome.name(),
            "deciding_trials": f.deciding_trials,
        })
    };
    json!({
        "tilt_deg": tried.tilt_deg,
        "coverage": tried.coverage,
        "views": tried.views,
        "trials": tried.trials,
        "converged": tried.converged,
        "quantities": tried.findings.iter().map(finding).collect::<Vec<_>>(),
        "outcome": tried.outcome().name(),
    })
}

/// `views` is `null` where no number of them suffices; `predicted_sd` is then that of the most views, if
/// there is one.
fn design_json(design: &Design, arguments: &Arguments) -> Value {
    let best = design.best.as_ref();
    let sds = design.enough.as_ref().map(|(_, sds)| sds).or(best.ok().and_then(Option::as_ref));
    let named = |sds: &Vec<f64>| -> serde_json::Map<String, Value> {
        arguments.want.iter().zip(sds).map(|(goal, sd)| (goal.quantity.clone(), json!(sd))).collect()
    };
    json!({
        "tilt_deg": design.tilt_deg,
        "coverage": design.coverage,
        "views": design.enough.as_ref().map(|(views, _)| views),
        "predicted_sd": sds.map(named),
        "refused": best.err(),
    })
}
