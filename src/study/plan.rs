//! How many views, how far tilted, how widely placed, for a wanted accuracy? Predicted from the bound,
//! confirmed by trials.

use super::engine::{Pace, in_memory};
use super::moments::Estimated;
use super::poses::{Poses, PosesError};
use super::spec::{Spec, Trials};
use super::spec_error::SpecError;
use super::summary::summarise;

/// What is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// `fx`, ..., `depth`, `length`.
    pub quantity: String,
    /// Largest standard deviation, in the quantity's unit.
    pub sd: f64,
}

/// Where to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// Tilts of all views.
    pub tilts_deg: Vec<f64>,
    /// Shares of the way to the image's border.
    pub coverages: Vec<f64>,
    /// Most views.
    pub most_views: usize,
    /// Depth of the target.
    pub distance_mm: f64,
}

/// The fewest views of one tilt and coverage.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// Tilt of every view.
    pub tilt_deg: f64,
    /// See [`Poses::Spread`].
    pub coverage: f64,
    /// Fewest views that suffice, and the predicted standard deviation with them.
    pub enough: Option<(usize, f64)>,
    /// Where no number suffices: the predicted standard deviation with the most views, if there is one, or
    /// why there is none.
    pub best: Result<Option<f64>, String>,
}

/// What trials say of the chosen design.
#[derive(Debug, Clone, PartialEq)]
pub struct Confirmation {
    /// Trials.
    pub trials: u64,
    /// Share that converged.
    pub converged: f64,
    /// Measured standard deviation.
    pub sd: Estimated,
    /// Measured over predicted.
    pub ratio: Estimated,
}

/// A plan that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The scene.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// Nothing to plan for.
    #[error("`{quantity}` is not measured in this study; there are: {known}")]
    Quantity {
        /// As asked.
        quantity: String,
        /// Those that are.
        known: String,
    },
    /// A wanted value that is none.
    #[error("a standard deviation of {0} cannot be wanted: give a positive number")]
    Wanted(f64),
}

/// For every tilt and coverage the fewest views whose Cramer-Rao bound meets the goal.
///
/// The views of a longer series contain those of a shorter one, so the bound falls with every view and
/// halving finds the fewest.
pub fn search(spec: &Spec, goal: &Goal, search: &Search) -> Result<Vec<Design>, PlanError> {
    if !(goal.sd > 0.0 && goal.sd.is_finite()) {
        return Err(PlanError::Wanted(goal.sd));
    }
    let mut designs = Vec::new();
    for &tilt_deg in &search.tilts_deg {
        for &coverage in &search.coverages {
            let at =
                |views: usize| sd_at(&with_poses(spec, views, tilt_deg, coverage, search.distance_mm), goal);
            designs.push(match at(search.most_views) {
                // Another tilt or coverage may fit.
                Err(PlanError::Spec(
                    error @ SpecError::Poses { cause: PosesError::OutsideImage { .. }, .. },
                )) => Design { tilt_deg, coverage, enough: None, best: Err(error.to_string()) },
                Err(error) => return Err(error),
                Ok(best) => {
                    Design { tilt_deg, coverage, enough: fewest(best, &at, goal, search)?, best: Ok(best) }
                }
            });
        }
    }
    Ok(designs)
}

fn fewest(
    best: Option<f64>,
    at: &impl Fn(usize) -> Result<Option<f64>, PlanError>,
    goal: &Goal,
    search: &Search,
) -> Result<Option<(usize, f64)>, PlanError> {
    let Some(mut sd) = best.filter(|sd| *sd <= goal.sd) else { return Ok(None) };
    let (mut short, mut enough) = (0, search.most_views);
    while enough - short > 1 {
        let middle = short + (enough - short) / 2;
        match at(middle)? {
            Some(found) if found <= goal.sd => (enough, sd) = (middle, found),
            _ => short = middle,
        }
    }
    Ok(Some((enough, sd)))
}

/// The study's scene with other poses, without factors.
fn with_poses(spec: &Spec, views: usize, tilt_deg: f64, coverage: f64, distance_mm: f64) -> Spec {
    let mut spec = spec.clone();
    spec.factor.clear();
    spec.trials.precision = None;
    spec.scene.poses = Poses::Spread { views, tilt_deg, coverage, distance_mm };
    spec
}

/// The predicted standard deviation; `None` where the scene determines no camera.
fn sd_at(spec: &Spec, goal: &Goal) -> Result<Option<f64>, PlanError> {
    let cells = spec.cells("")?;
    let quantities = spec.quantities(&cells);
    let at = quantities.iter().position(|q| q.is_error() && q.name() == goal.quantity);
    let at = at.ok_or_else(|| PlanError::Quantity {
        quantity: goal.quantity.clone(),
        known: quantities.iter().filter(|q| q.is_error()).map(|q| q.name()).collect::<Vec<_>>().join(", "),
    })?;
    Ok(cells[0].prediction.0[at].map(|p| p.sd))
}

/// Fewest views first; among equals the smaller standard deviation.
pub fn choose(designs: &[Design]) -> Option<&Design> {
    let known = designs.iter().filter_map(|d| Some((d.enough?, d)));
    known.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(_, design)| design)
}

/// A short Monte Carlo run of a design. `None` if too few trials converged to say anything.
pub fn confirm(
    spec: &Spec,
    goal: &Goal,
    design: &Design,
    distance_mm: f64,
    trials: u64,
    report: impl FnMut(&Pace),
) -> Result<Option<Confirmation>, PlanError> {
    let Some((views, _)) = design.enough else { return Ok(None) };
    let mut spec = with_poses(spec, views, design.tilt_deg, design.coverage, distance_mm);
    spec.trials = Trials { per_cell: trials, ..spec.trials };
    let engine = in_memory(spec, "", report)?;
    let summary = summarise(&engine);
    let cell = &summary.cells[0];
    let statistic = cell.of(&goal.quantity);
    Ok(statistic.and_then(|s| {
        Some(Confirmation {
            trials: cell.trials,
            converged: cell.converged()?.value,
            sd: s.sd?,
            ratio: s.ratio?,
        })
    }))
}
