//! Which cells are all solvers asked? Those of three studies of `studies/`, of two of them not every level: a
//! trial is that of the whole study all the same, since its noise does not depend on the cell.

use calibench_study::{Spec, SpecError};

/// A study, with the levels that are asked of each of its factors.
pub struct Grid {
    /// Its name, and that of its file.
    pub study: &'static str,
    text: &'static str,
    levels: &'static [&'static [f64]],
}

/// The studies, in the order of the trials.
pub const GRIDS: [Grid; 3] = [
    Grid {
        study: "pose-count",
        text: include_str!("../../studies/pose-count.toml"),
        levels: &[&[3.0, 4.0, 6.0, 8.0, 16.0]],
    },
    Grid {
        study: "coverage-tilt",
        text: include_str!("../../studies/coverage-tilt.toml"),
        levels: &[&[0.0, 0.5, 1.0], &[5.0, 10.0, 40.0]],
    },
    Grid {
        study: "few-flat-views",
        text: include_str!("../../studies/few-flat-views.toml"),
        levels: &[&[2.0, 3.0, 4.0], &[1.0, 2.0, 5.0]],
    },
];

impl Grid {
    /// The file of the study.
    pub fn text(&self) -> &'static str {
        self.text
    }

    /// The study with these levels alone and the first `trials` trials of a cell, a batch each.
    ///
    /// # Errors
    /// A file that is no study.
    pub fn spec(&self, trials: u64) -> Result<Spec, SpecError> {
        let mut spec = Spec::parse(self.text)?;
        for (factor, asked) in spec.factor.iter_mut().zip(self.levels) {
            let numbers: Vec<Option<f64>> = (0..factor.count()).map(|level| factor.number(level)).collect();
            let mut is_asked = numbers.iter().map(|number| number.is_some_and(|n| asked.contains(&n)));
            factor.levels.get_mut().retain(|_| is_asked.next().unwrap_or(false));
        }
        (spec.trials.per_cell, spec.trials.batch) = (trials, trials);
        Ok(spec)
    }
}
