//! Which lens model is to be taken, and which freedom explains what a fit leaves over?

use super::Failure;
use super::camera::Observed;
use super::table;
use calibench::calibrate::{
    Board, Candidate, Compared, Freedom, Settings, Warning, compare_models, explaining_freedoms,
};
use calibench::io::result::ModelFields;
use calibench::io::{message, significant};
use calibench::photos::Fit;

/// Lens models that were compared.
pub(super) struct Comparison {
    compared: Vec<Compared>,
    /// Those that the views do not determine, and why.
    refused: Vec<String>,
}

/// Compares the usual models, and gives the settings the chosen one.
pub(super) fn compare(observed: &Observed, settings: &mut Settings) -> Result<Comparison, Failure> {
    let (compared, refused) = compare_models(&observed.views, settings, &Candidate::usual());
    let Some(chosen) = compared.first() else {
        let reason = refused.first().map(|(_, error)| message(error)).unwrap_or_default();
        return Err(Failure::from(format!("{}: no lens model can be calibrated: {reason}", observed.source)));
    };
    *settings = chosen.candidate.settings(settings);
    let refused = refused.iter().map(|(c, error)| format!("{}: {}", name(c), message(error))).collect();
    Ok(Comparison { compared, refused })
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
                name(&compared.candidate),
                significant(compared.calibration.rmse_px, 4),
                compared.hold_out_px.map_or("none".to_string(), |px| significant(px, 4)),
                format!("{:.1}", compared.bic - least),
                format!("{:+.2}", compared.correlation),
            ]);
        }
        let refused: String =
            self.refused.iter().map(|reason| format!("not determined: {reason}\n")).collect();
        format!("{}\n\n{refused}{}\n\n", rows.trim_fmt(), self.verdict())
    }

    fn verdict(&self) -> String {
        let chosen = &self.compared[0];
        let Some(next) = self.compared.get(1) else {
            return format!("chosen: {}, the only one that the views determine", name(&chosen.candidate));
        };
        let predicts = match chosen.wins_against(next) {
            (_, 0) => "no part of the views can be left out".to_string(),
            (wins, folds) => format!(
                "it predicts views that were left out better than {} in {wins} of {folds} parts of the views",
                name(&next.candidate)
            ),
        };
        format!(
            "chosen: {}; {predicts}, and its BIC is {} by {:.1}",
            name(&chosen.candidate),
            if chosen.bic < next.bic { "lower" } else { "higher" },
            (chosen.bic - next.bic).abs(),
        )
    }
}

/// Where residuals of neighbours agree: what would explain them.
pub(super) fn freedoms(fit: &Fit, settings: &Settings) -> Vec<String> {
    let is_structured = |w: &Warning| matches!(w, Warning::Structured { .. } | Warning::AboveFloor { .. });
    if !fit.calibration.warnings.iter().any(is_structured) {
        return Vec::new();
    }
    let before = fit.calibration.rmse_px;
    let found = explaining_freedoms(&fit.views, settings, &fit.calibration);
    if found.is_empty() {
        return vec![
            "none of the lens models and shapes of the board that were tried explains these residuals: they may come from the marks themselves"
                .to_string(),
        ];
    }
    found.iter().map(|freedom| in_words(freedom, settings, before)).collect()
}

fn in_words(freedom: &Freedom, settings: &Settings, before: f64) -> String {
    let Freedom { candidate, rmse_px, correlation, .. } = freedom;
    let what = if candidate.board != settings.board {
        match candidate.board {
            Board::Bent { .. } => "a bowed and twisted board (--board-shape bent:free)".to_string(),
            _ => "a bowed board (--board-shape bow:free)".to_string(),
        }
    } else if candidate.model == settings.model() {
        format!("coefficients {} free (--free)", candidate.coefficients)
    } else {
        format!("a {} lens (--model {})", candidate.model, candidate.model)
    };
    format!(
        "{what} lowers the RMSE from {} to {} px and leaves neighbours a correlation of {correlation:+.2}",
        significant(before, 3),
        significant(*rmse_px, 3),
    )
}
