//! What do the trials of a program say, cell by cell, in units of the bound?

use super::grid::GRIDS;
use super::row::{Answer, Ending, Row};
use super::trials::JUDGED;
use calibench_study::{Estimated, Moments, SpecError};

/// Bound of sd(fx)/fx below which data determine the camera, as in the experiment global-minimum.
pub const DETERMINED: f64 = 0.02;

/// A cell of the studies, and what theory expects there.
pub struct Place {
    /// Its number, through all studies.
    pub index: usize,
    /// Study and levels.
    pub name: String,
    /// The Cramer-Rao bound of fx, px, and of k2.
    pub bounds: [f64; 2],
    /// The bound of fx over fx.
    pub relative: f64,
    /// Measurements less unknowns.
    pub freedom: f64,
}

/// All cells, in order.
///
/// # Errors
/// A study that cannot be run as written.
pub fn places() -> Result<Vec<Place>, SpecError> {
    let mut places = Vec::new();
    for grid in &GRIDS {
        let spec = grid.spec(1)?;
        let cells = spec.cells(grid.text())?;
        let quantities = spec.quantities(&cells);
        for cell in &cells {
            let bounds = JUDGED
                .map(|p| cell.predicted(&quantities, p.name()).map_or(f64::INFINITY, |expected| expected.sd));
            let (views, marks) = cell.size();
            let unknowns = cell.free().len() + 6 * views;
            places.push(Place {
                index: places.len(),
                name: format!("{}: {}", grid.study, cell.name),
                bounds,
                relative: bounds[0] / spec.scene.camera.0.fx,
                freedom: (2 * views * marks - unknowns) as f64,
            });
        }
    }
    Ok(places)
}

impl Place {
    /// Whether its data determine the camera.
    pub fn is_determined(&self) -> bool {
        self.relative < DETERMINED
    }
}

/// The trials of a program in a cell.
pub struct Judged<'a> {
    /// The cell.
    pub place: &'a Place,
    rows: Vec<&'a Row>,
}

impl<'a> Judged<'a> {
    /// Of all trials those in this cell.
    pub fn new(place: &'a Place, rows: &'a [Row]) -> Judged<'a> {
        Judged { place, rows: rows.iter().filter(|row| row.cell == place.index).collect() }
    }

    /// How many there are.
    pub fn trials(&self) -> usize {
        self.rows.len()
    }

    fn answers(&self) -> impl Iterator<Item = &'a Answer> {
        self.rows.iter().filter_map(|row| row.answer.as_ref())
    }

    /// How many gave a camera.
    pub fn answered(&self) -> usize {
        self.answers().count()
    }

    /// How many ended so.
    pub fn ended(&self, ending: Ending) -> usize {
        self.rows.iter().filter(|row| row.ending == ending).count()
    }

    /// How many of the cameras came with a warning.
    pub fn warned(&self) -> usize {
        self.rows.iter().filter(|row| row.answer.is_some() && row.warned).count()
    }

    /// Cameras without a warning whose fx is off by more than `limit` of the stated standard deviations.
    /// `None` where none are stated.
    pub fn misleading(&self, limit: f64) -> Option<usize> {
        let mut count = 0;
        for row in &self.rows {
            let Some(answer) = &row.answer else { continue };
            let z = answer.errors[0] / answer.stated?[0];
            count += usize::from(!row.warned && z.abs() > limit);
        }
        Some(count)
    }

    /// Errors of the cameras over the bound.
    pub fn errors(&self, quantity: usize) -> Moments {
        let mut moments = Moments::default();
        self.answers().for_each(|answer| moments.add(answer.errors[quantity] / self.place.bounds[quantity]));
        moments
    }

    /// Their standard deviation, with its interval.
    pub fn spread(&self, quantity: usize, false_alarm: f64) -> Option<Estimated> {
        self.errors(quantity).sd_interval(false_alarm)
    }

    /// Squares of the errors over the stated standard deviations; `None` where none are stated.
    pub fn squares_stated(&self, quantity: usize) -> Option<Vec<f64>> {
        let square = |answer: &Answer| {
            let z = answer.errors[quantity] / answer.stated?[quantity];
            Some(z * z)
        };
        self.answers().map(square).collect()
    }

    /// Their mean; `None` without answers too.
    pub fn mean_square_stated(&self, quantity: usize) -> Option<f64> {
        mean(self.squares_stated(quantity)?)
    }

    /// Mean of the squared error under the stated covariance; `None` where none is stated.
    pub fn mean_nees(&self) -> Option<f64> {
        mean(self.answers().map(|answer| answer.nees).collect::<Option<Vec<f64>>>()?)
    }

    /// Trials in which both gave a camera.
    fn pairs(&self, other: &Judged<'a>) -> Vec<(&'a Answer, &'a Answer)> {
        let partner = |row: &&Row| other.rows.iter().find(|theirs| theirs.trial == row.trial);
        let both = |row: &&'a Row| Some((row.answer.as_ref()?, partner(row)?.answer.as_ref()?));
        self.rows.iter().filter_map(both).collect()
    }

    /// Difference of the estimates from those of another program on the same noise, over the bound.
    pub fn differences(&self, other: &Judged<'a>, quantity: usize) -> Vec<f64> {
        let difference = |(a, b): (&Answer, &Answer)| a.errors[quantity] - b.errors[quantity];
        let pairs = self.pairs(other).into_iter();
        pairs.map(|pair| difference(pair) / self.place.bounds[quantity]).collect()
    }

    /// Cost above that of another program on the same noise, in variances of the noise.
    pub fn excesses(&self, other: &Judged<'a>) -> Vec<f64> {
        self.pairs(other).into_iter().filter_map(|(a, b)| Some(a.cost? - b.cost?)).collect()
    }
}

fn mean(values: Vec<f64>) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> Place {
        Place { index: 0, name: "cell".into(), bounds: [2.0, 0.5], relative: 0.003, freedom: 354.0 }
    }

    fn row(trial: u64, fx: f64, warned: bool) -> Row {
        let answer = Answer { errors: [fx, 0.0], stated: Some([1.0, 1.0]), nees: None, cost: Some(fx) };
        Row { cell: 0, trial, ending: Ending::Answered, warned, answer: Some(answer) }
    }

    #[test]
    fn trials_are_paired_by_their_number_and_differ_in_units_of_the_bound() {
        let refused = Row { cell: 0, trial: 1, ending: Ending::Refused, warned: false, answer: None };
        let (ours, theirs) = (
            [row(0, 1.0, false), refused, row(2, 4.0, false)],
            [row(2, 5.0, false), row(1, 7.0, false), row(0, 0.5, false)],
        );
        let place = place();
        let (ours, theirs) = (Judged::new(&place, &ours), Judged::new(&place, &theirs));
        assert_eq!(theirs.differences(&ours, 0), [0.5, -0.25]);
        assert_eq!(theirs.excesses(&ours), [1.0, -0.5]);
        assert_eq!((ours.trials(), ours.answered(), ours.ended(Ending::Refused)), (3, 2, 1));
    }

    #[test]
    fn an_answer_misleads_that_is_far_off_and_does_not_say_so() {
        let rows = [row(0, 7.0, false), row(1, 7.0, true), row(2, -5.0, false)];
        let place = place();
        let judged = Judged::new(&place, &rows);
        assert_eq!((judged.misleading(6.0), judged.misleading(4.0), judged.warned()), (Some(1), Some(2), 1));
        assert_eq!(judged.mean_square_stated(0), Some((49.0 + 49.0 + 25.0) / 3.0));
        assert_eq!(judged.mean_nees(), None);
    }

    #[test]
    fn the_cells_are_those_of_the_studies_and_most_determine_the_camera() {
        let places = places().unwrap();
        assert_eq!(places.len(), 5 + 9 + 9);
        assert_eq!(places[0].name, "pose-count: views = 3");
        assert_eq!(places[0].freedom, (2 * 3 * 63 - 24) as f64);
        assert!(places.iter().all(|place| place.bounds.iter().all(|bound| *bound > 0.0)));
        assert!(places[..14].iter().all(Place::is_determined) && !places[14].is_determined());
    }
}
