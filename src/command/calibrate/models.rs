//! Which lens model is to be taken, and which freedom explains what a fit leaves over?

use super::super::report::table;
use super::observed::Observed;
use calibench::calibrate::{
    Board, Candidate, Compared, Freedom, LensCalibration, Loss, Settings, Warning, calibrate_lens,
    compare_models, explaining_freedoms,
};
use calibench::camera::{Model, Parameter};
use calibench::io::result::ModelFields;
use calibench::io::{message, significant};
use calibench::photos::Fit;

/// Lens models that were compared.
pub(super) struct Comparison {
    compared: Vec<Compared>,
    /// Those that the views do not determine, and why.
    refused: Vec<String>,
}

/// Compares the usual models before the board that is asked for, and gives the settings the chosen one.
pub(super) fn compare(observed: &Observed, settings: &mut Settings) -> Result<Comparison, String> {
    let candidates = usual(settings);
    let (compared, refused) = compare_models(&observed.views, settings, &candidates);
    let Some(chosen) = compared.first() else {
        let reason = refused.first().map(|(_, error)| message(error)).unwrap_or_default();
        return Err(format!("{}: no lens model can be calibrated: {reason}", observed.source));
    };
    *settings = chosen.candidate.settings(settings);
    let refused = refused.iter().map(|(c, error)| format!("{}: {}", name(c), message(error))).collect();
    Ok(Comparison { compared, refused })
}

fn usual(settings: &Settings) -> Vec<Candidate> {
    Candidate::usual().into_iter().map(|usual| Candidate { board: settings.board, ..usual }).collect()
}

fn name(candidate: &Candidate) -> String {
    format!("{} ({})", candidate.model, candidate.coefficients)
}

impl Comparison {
    /// For programs.
    pub(super) fn fields(&self) -> Vec<ModelFields> {
        self.compared.iter().map(ModelFields::of).collect()
    }

    /// A table, the chosen model first, and how sure the choice is.
    pub(super) fn text(&self) -> String {
        let columns = [
            "lens model",
            "RMSE (px a point)",
            "views left out (px a coordinate)",
            "BIC over the least",
            "neighbours",
        ];
        let mut rows = table(&columns);
        let least = self.compared.iter().map(|c| c.bic).fold(f64::INFINITY, f64::min);
        for compared in &self.compared {
            rows.add_row([
                format!("{}{}", name(&compared.candidate), if compared.is_behind { ", behind" } else { "" }),
                significant(compared.calibration.rmse_px, 4),
                compared.hold_out_px.map_or("none".to_string(), |px| significant(px, 4)),
                format!("{:.1}", compared.bic - least),
                format!("{:+.2}", compared.correlation),
            ]);
        }
        let refused: String =
            self.refused.iter().map(|reason| format!("not determined: {reason}\n")).collect();
        let behind = if self.compared.iter().any(|compared| compared.is_behind) { BEHIND } else { "" };
        let none =
            if self.compared.iter().any(|compared| compared.hold_out_px.is_none()) { NONE } else { "" };
        format!("{}\n\n{none}{behind}{refused}{}\n\n", rows.trim_fmt(), self.verdict())
    }

    fn verdict(&self) -> String {
        let chosen = &self.compared[0];
        let Some(next) = self.compared.get(1) else {
            return format!("chosen: {}, the only one that the views determine", name(&chosen.candidate));
        };
        if next.is_behind && !chosen.is_behind {
            return format!(
                "chosen: {}; of the others each has as many unknowns as there are measurements, or coefficients where its model is not \
                 defined",
                name(&chosen.candidate)
            );
        }
        let unpredicted: Vec<String> = [chosen, next]
            .into_iter()
            .filter(|compared| compared.hold_out_px.is_none())
            .map(|compared| name(&compared.candidate))
            .collect();
        let predicts = if unpredicted.is_empty() {
            let (wins, folds) = chosen.wins_against(next);
            format!(
                "it predicts views that were left out better than {} in {wins} of {folds} parts of the views",
                name(&next.candidate)
            )
        } else {
            format!("how {} predicts views that were left out is not known", unpredicted.join(" or "))
        };
        format!(
            "chosen: {}; {predicts}, and its BIC is {} by {:.1}{}",
            name(&chosen.candidate),
            if chosen.bic < next.bic { "lower" } else { "higher" },
            (chosen.bic - next.bic).abs(),
            self.doubt(chosen),
        )
    }

    /// That another lens may be right. One with fewer unknowns: the one for which chance makes the fall of
    /// the squares likeliest, as the criterion takes the noise for well known, which few degrees of freedom
    /// do not tell. And those that the criterion does not tell from the chosen one.
    fn doubt(&self, chosen: &Compared) -> String {
        let others = || self.compared[1..].iter().filter(|other| !other.is_behind);
        let likely =
            |other| Some((chosen.chance_against(other)?, other)).filter(|(chance, _)| *chance > DOUBTFUL);
        let likeliest = others().filter_map(likely).max_by(|(a, _), (b, _)| a.total_cmp(b));
        let simpler = likeliest.map_or_else(String::new, |(chance, other)| {
            format!(
                "; but with {} degree(s) of freedom, chance makes a fit as much better than that of {} with probability {} where the \
                 latter is right",
                chosen.calibration.degrees_of_freedom,
                name(&other.candidate),
                significant(chance, 2)
            )
        });
        let is_alike = |other: &&Compared| (chosen.bic - other.bic).abs() < NO_EVIDENCE;
        let alike: Vec<String> = others().filter(is_alike).map(|other| name(&other.candidate)).collect();
        if alike.is_empty() {
            return simpler;
        }
        format!(
            "{simpler}; a difference of BIC below {NO_EVIDENCE} is no evidence: {} may be right as well",
            alike.join(" or ")
        )
    }
}

/// What the table means by these words.
const NONE: &str = "none: without a part of the views the lens is not determined, or does not reach a mark that was left out\n";
const BEHIND: &str = "behind: a coefficient lies where the model is not defined, or there are as many unknowns as measurements\n";
/// A difference of the criterion that is not worth more than a bare mention (Kass & Raftery 1995).
const NO_EVIDENCE: f64 = 2.0;
/// A choice that chance makes with more than this probability is in doubt.
const DOUBTFUL: f64 = 0.01;

/// Where residuals of neighbours agree: what would explain them.
pub(super) fn freedoms(fit: &Fit, settings: &Settings) -> Vec<String> {
    let is_structured = |w: &Warning| matches!(w, Warning::Structured { .. } | Warning::AboveFloor { .. });
    if !fit.calibration.warnings.iter().any(is_structured) {
        return better_model(fit, settings).into_iter().collect();
    }
    let found = explaining_freedoms(&fit.views, settings, &fit.calibration);
    if found.is_empty() {
        let narrow = match settings.loss {
            Loss::Squares => "",
            _ => ", or the loss be too narrow for a lens that would (ask again with a wider one)",
        };
        return vec![format!(
            "none of the lens models and shapes of the board that were tried explains these residuals: they may come from the marks \
             themselves{narrow}"
        )];
    }
    found.iter().map(|freedom| in_words(freedom, settings)).collect()
}

/// With fewer marks a view than this, poses take up what residuals of neighbours would share.
const FEW_MARKS: usize = 20;
/// What the criterion below must fall by: 10 is very strong evidence (Kass & Raftery 1995), and of eight
/// models one falls by as much by chance now and then.
const STRONG: f64 = 20.0;

/// A lens model that explains few marks a view far better than the one that was asked for: their residuals do
/// not tell that it is wrong, and other models are fitted in no time. Brown-Conrady's lens has its
/// certificate. Under a robust loss strays, which are in the RMSE, would decide.
fn better_model(fit: &Fit, settings: &Settings) -> Option<String> {
    let marks = fit.calibration.points();
    let is_told = settings.model() == Model::BrownConrady || settings.loss != Loss::Squares;
    if is_told || marks >= FEW_MARKS * fit.views.len() {
        return None;
    }
    let own = criterion(&fit.calibration);
    let fitted = usual(settings).into_iter().filter_map(|candidate| {
        let other = calibrate_lens(&fit.views, &candidate.settings(settings)).ok()?;
        let gain = own - criterion(&other);
        // As many unknowns as measurements explain whatever was measured.
        let is_better = other.degrees_of_freedom > 0 && other.rmse_px < fit.calibration.rmse_px;
        (gain > STRONG && is_better).then_some((gain, candidate, other))
    });
    let (gain, candidate, other) = fitted.max_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
    let coefficients: Vec<&str> = candidate.coefficients.iter().map(|parameter| parameter.name()).collect();
    Some(format!(
        "a {} lens with {} explains the marks better than this model: the noise of a coordinate is {} px with it in place of {} px \
         (Schwarz's criterion falls by {gain:.0}, where 10 is very strong evidence); views of so few marks do not show a wrong model \
         otherwise: compare models (--model auto)",
        candidate.model,
        coefficients.join(", "),
        significant(other.sigma_px, 3),
        significant(fit.calibration.sigma_px, 3),
    ))
}

/// Schwarz's criterion (1978), up to what all models share: `f ln(sum |r|^2) + p ln f`, for the `f` degrees
/// of freedom that the poses leave and `p` parameters of the camera. With few marks a view half of the
/// coordinates tell of the poses alone, and would count twice.
fn criterion(calibration: &LensCalibration) -> f64 {
    let coordinates = 2.0 * calibration.points() as f64;
    let freedom = (coordinates - 6.0 * calibration.cam_from_target.len() as f64).max(1.0);
    let square = calibration.rmse_px * calibration.rmse_px;
    freedom * libm::log(square) + calibration.free.len() as f64 * libm::log(freedom)
}

fn in_words(freedom: &Freedom, settings: &Settings) -> String {
    let Freedom { candidate, rmse_px, rmse_without_px, correlation, .. } = freedom;
    let what = if candidate.board != settings.board {
        match candidate.board {
            Board::Bent { .. } => "a bowed and twisted board (--board-shape bent:free)".to_string(),
            _ => "a bowed board (--board-shape bow:free)".to_string(),
        }
    } else {
        changed_camera(candidate, settings)
    };
    format!(
        "{what} lowers the RMSE from {} to {} px and leaves neighbours a correlation of {correlation:+.2}",
        significant(*rmse_without_px, 3),
        significant(*rmse_px, 3),
    )
}

/// Another lens, or more of this one, with the options that ask for it.
fn changed_camera(candidate: &Candidate, settings: &Settings) -> String {
    let (before, after) = (settings.free(), candidate.settings(settings));
    let unties =
        if settings.fy_per_fx().is_some() && after.fy_per_fx().is_none() { ", no --tie" } else { "" };
    let list = format!("--free {}{unties}", after.free());
    if candidate.model == settings.model() {
        let is_new = |p: &Parameter| !before.contains(*p);
        let names: Vec<&str> = candidate.coefficients.iter().filter(is_new).map(Parameter::name).collect();
        return format!("{} estimated too ({list})", names.join(", "));
    }
    let model = candidate.model;
    let is_standard = before == settings.model().standard_free() && after.free() == model.standard_free();
    let list = if is_standard { String::new() } else { format!(" {list}") };
    format!("a {model} lens (--model {model}{list})")
}
