//! Which of two runs is closer to the truth? Trials that met the same noise are compared one by one.

use super::engine::Engine;
use super::folder_error::FolderError;
use super::moments::Estimated;
use super::quantity::Quantity;
use super::reading::Reading;
use super::run_error::RunError;
use super::trial::Trial;
use calibench::evaluate::distribution::normal_two_sided;
use calibench::evaluate::interval::each_of;
use calibench::io::ShownPath;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Runs that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A run that cannot be read.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The trials do not meet the same noise.
    #[error("{what}: {a} and {b}; trials are paired by seed, cell and index, so both runs need the same")]
    NotPaired {
        /// What differs.
        what: &'static str,
        /// In the first run.
        a: String,
        /// In the second.
        b: String,
    },
    /// One run under both names.
    #[error("{path} is named twice: a run is no different from itself", path = .0.shown())]
    Same(PathBuf),
    /// Cells that draw numbers of their own.
    #[error("the cells of {path} draw noise of their own (common_random_numbers = false): their trials are no pairs", path = path.shown())]
    NotCommon {
        /// The run.
        path: PathBuf,
    },
    /// No such factor.
    #[error("`{factor}` is no factor of {path}; there are: {known}", path = path.shown())]
    Factor {
        /// The run.
        path: PathBuf,
        /// As asked.
        factor: String,
        /// Those that are.
        known: String,
    },
}

impl From<FolderError> for CompareError {
    fn from(error: FolderError) -> CompareError {
        RunError::from(error).into()
    }
}

/// What can be said of a pair of runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The second run's errors are smaller.
    SecondBetter,
    /// The first run's errors are smaller.
    FirstBetter,
    /// The whole interval lies within a thousandth of "no difference": what two programs that stop at other
    /// roundings leave.
    Alike,
    /// The interval holds "no difference".
    NotTold,
}

/// A ratio that differs from 1 by less than this is no difference that matters, however certain.
const RELEVANT: f64 = 1e-3;

/// One cell and quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Cell, as either run names it.
    pub cell: String,
    /// Of what.
    pub quantity: Quantity,
    /// Trials in which both converged.
    pub pairs: u64,
    /// Root mean square error of both runs over those.
    pub rms: [f64; 2],
    /// The second over the first, with its interval.
    pub ratio: Estimated,
    /// What follows.
    pub verdict: Verdict,
}

/// A comparison of two runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// One a cell and error that both runs measure.
    pub effects: Vec<Effect>,
    /// Trials of each cell that converged in the first run only, and in the second only.
    pub only: Vec<(String, u64, u64)>,
    /// False-alarm rate of each interval; that of all together is the runs' own.
    pub each: f64,
}

/// Sums over the pairs of one cell and quantity: `a^2`, `b^2` and their products.
#[derive(Debug, Clone, Copy, Default)]
struct Pairs {
    count: u64,
    a: f64,
    b: f64,
    aa: f64,
    bb: f64,
    ab: f64,
}

impl Pairs {
    fn add(&mut self, a: f64, b: f64) {
        let (a, b) = (a * a, b * b);
        self.count += 1;
        for (sum, term) in [&mut self.a, &mut self.b, &mut self.aa, &mut self.bb, &mut self.ab]
            .into_iter()
            .zip([a, b, a * a, b * b, a * b])
        {
            *sum += term;
        }
    }

    /// `rms_b / rms_a`: its logarithm is nearly normal with variance `var(b^2 / mean b^2 - a^2 / mean a^2) /
    /// (4 n)`, pair by pair.
    fn ratio(&self, false_alarm: f64) -> Option<Estimated> {
        let n = self.count as f64;
        let (a, b) = (self.a / n, self.b / n);
        if self.count < 4 || a <= 0.0 || b <= 0.0 {
            return None;
        }
        let variance = (self.aa / (a * a) + self.bb / (b * b) - 2.0 * self.ab / (a * b)) / n;
        let half = 0.5 * normal_two_sided(false_alarm) * (variance.max(0.0) / n).sqrt();
        let value = (b / a).sqrt();
        let factor = libm::exp(half);
        Some(Estimated { value, low: value / factor, high: value * factor })
    }
}

/// Compares the runs in two folders. The intervals are widened so that all together raise a false alarm as
/// rarely as one of the first run's own intervals (Bonferroni).
pub fn compare(first: &Path, second: &Path) -> Result<Comparison, CompareError> {
    // Each is locked while it is read: the second would seem to be in use by another run.
    if let (Ok(a), Ok(b)) = (first.canonicalize(), second.canonicalize())
        && a == b
    {
        return Err(CompareError::Same(first.to_path_buf()));
    }
    let (mut a, mut b) = (Reading::open(first)?, Reading::open(second)?);
    check_pairing(&a.engine, &b.engine)?;
    let shared: Vec<(Quantity, usize, usize)> = a
        .engine
        .quantities
        .iter()
        .enumerate()
        .filter(|(_, q)| q.is_error())
        .filter_map(|(i, q)| Some((*q, i, b.engine.quantities.iter().position(|r| r == q)?)))
        .collect();
    let cells = a.engine.cells.len();
    let mut pairs = vec![Pairs::default(); cells * shared.len()];
    let mut only = vec![(0, 0); cells];
    let (mut left, mut right) = (a.next()?, b.next()?);
    while let (Some(((cell, batch), ours)), Some(((other, its_batch), theirs))) = (&left, &right) {
        let order = (batch, cell).cmp(&(its_batch, other));
        if order.is_eq() {
            let sums = &mut pairs[cell * shared.len()..][..shared.len()];
            ours.iter().zip(theirs).for_each(|(x, y)| add(x, y, &shared, sums, &mut only[*cell]));
        }
        // A cell that ended early in one run has batches without partner in the other.
        match order {
            std::cmp::Ordering::Less => left = a.next()?,
            std::cmp::Ordering::Greater => right = b.next()?,
            std::cmp::Ordering::Equal => (left, right) = (a.next()?, b.next()?),
        }
    }
    let name = |cell: usize| match (&a.engine.cells[cell].name, &b.engine.cells[cell].name) {
        (x, y) if x == y => x.clone(),
        (x, y) => format!("{x} | {y}"),
    };
    let names: Vec<String> = (0..cells).map(name).collect();
    Ok(conclude(&names, &shared, &pairs, &only, 1.0 - a.engine.spec.confidence))
}

/// Compares the levels of a factor within the run in a folder: each cell with that of the factor's first
/// level and the same levels of the others, trial by trial. The first of a pair is the cell of the first
/// level.
pub fn compare_levels(path: &Path, factor: &str) -> Result<Comparison, CompareError> {
    let mut run = Reading::open(path)?;
    let spec = &run.engine.spec;
    if !spec.common_random_numbers {
        return Err(CompareError::NotCommon { path: path.to_path_buf() });
    }
    let at = spec.factor.iter().position(|f| f.name == factor).ok_or_else(|| CompareError::Factor {
        path: path.to_path_buf(),
        factor: factor.to_string(),
        known: spec.factor.iter().map(|f| f.name.as_str()).collect::<Vec<_>>().join(", "),
    })?;
    let after: usize = spec.factor[at + 1..].iter().map(|f| f.count()).product();
    // Cells are numbered in mixed radix, so the first level's comes first in every round.
    let levels: Vec<usize> = run.engine.cells.iter().map(|cell| cell.levels[at]).collect();
    let errors = run.engine.quantities.iter().enumerate().filter(|(_, q)| q.is_error());
    let shared: Vec<(Quantity, usize, usize)> = errors.map(|(i, q)| (*q, i, i)).collect();
    let names: Vec<String> = run.engine.cells.iter().map(|cell| cell.name.clone()).collect();
    let false_alarm = 1.0 - spec.confidence;
    let mut pairs = vec![Pairs::default(); names.len() * shared.len()];
    let mut only = vec![(0, 0); names.len()];
    let (mut round, mut firsts) = (0, BTreeMap::new());
    while let Some(((cell, batch), trials)) = run.next()? {
        if batch != round {
            (round, firsts) = (batch, BTreeMap::new());
        }
        if levels[cell] == 0 {
            firsts.insert(cell, trials);
        } else if let Some(first) = firsts.get(&(cell - levels[cell] * after)) {
            let sums = &mut pairs[cell * shared.len()..][..shared.len()];
            first.iter().zip(&trials).for_each(|(x, y)| add(x, y, &shared, sums, &mut only[cell]));
        }
    }
    Ok(conclude(&names, &shared, &pairs, &only, false_alarm))
}

fn check_pairing(a: &Engine, b: &Engine) -> Result<(), CompareError> {
    let differ = |what, a: String, b: String| {
        if a == b { Ok(()) } else { Err(CompareError::NotPaired { what, a, b }) }
    };
    differ("seed", a.spec.seed.to_string(), b.spec.seed.to_string())?;
    differ("number of cells", a.cells.len().to_string(), b.cells.len().to_string())?;
    differ("trials.batch", a.spec.trials.batch.to_string(), b.spec.trials.batch.to_string())?;
    let common = |engine: &Engine| engine.spec.common_random_numbers;
    differ("common_random_numbers", common(a).to_string(), common(b).to_string())?;
    // A cell that draws noise of its own draws it by its name.
    let mut cells = a.cells.iter().zip(&b.cells).filter(|_| !common(a));
    cells.try_for_each(|(a, b)| differ("name of a cell", a.name.clone(), b.name.clone()))
}

fn add(a: &Trial, b: &Trial, shared: &[(Quantity, usize, usize)], sums: &mut [Pairs], only: &mut (u64, u64)) {
    match (a.converged(), b.converged()) {
        (true, false) => only.0 += 1,
        (false, true) => only.1 += 1,
        (true, true) => {
            for ((_, i, j), sum) in shared.iter().zip(sums) {
                if let (Some(x), Some(y)) = (a.values[*i], b.values[*j]) {
                    sum.add(x, y);
                }
            }
        }
        (false, false) => {}
    }
}

fn conclude(
    names: &[String],
    shared: &[(Quantity, usize, usize)],
    pairs: &[Pairs],
    only: &[(u64, u64)],
    false_alarm: f64,
) -> Comparison {
    let judged = pairs.iter().filter(|p| p.count >= 4).count();
    let each = each_of(judged, false_alarm);
    let mut effects = Vec::new();
    for (cell, sums) in pairs.chunks(shared.len().max(1)).enumerate() {
        for ((quantity, _, _), sum) in shared.iter().zip(sums) {
            let Some(ratio) = sum.ratio(each) else { continue };
            let verdict = match ratio {
                r if r.low > 1.0 - RELEVANT && r.high < 1.0 + RELEVANT => Verdict::Alike,
                r if r.high < 1.0 => Verdict::SecondBetter,
                r if r.low > 1.0 => Verdict::FirstBetter,
                _ => Verdict::NotTold,
            };
            let rms = [sum.a, sum.b].map(|s| (s / sum.count as f64).sqrt());
            effects.push(Effect {
                cell: names[cell].clone(),
                quantity: *quantity,
                pairs: sum.count,
                rms,
                ratio,
                verdict,
            });
        }
    }
    let only = only.iter().zip(names).map(|(o, name)| (name.clone(), o.0, o.1)).collect();
    Comparison { effects, only, each }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_errors_have_ratio_one_without_doubt() {
        let mut pairs = Pairs::default();
        [0.3, -1.2, 0.8, 2.0, -0.1].iter().for_each(|x| pairs.add(*x, -x));
        let ratio = pairs.ratio(0.05).unwrap();
        assert!((ratio.value - 1.0).abs() < 1e-15 && ratio.high - ratio.low < 1e-7);
    }

    #[test]
    fn the_interval_of_a_ratio_is_that_of_its_logarithm() {
        // a^2 = 1 and b^2 = 0.5, 1.5, ...: the pairs' differences have variance 0.25, the logarithm 0.25 / (4
        // n).
        let mut pairs = Pairs::default();
        (0..100).for_each(|i| pairs.add(1.0, [0.5f64, 1.5][i % 2].sqrt()));
        let ratio = pairs.ratio(0.05).unwrap();
        let factor = libm::exp(1.959_964 * 0.025);
        assert!((ratio.value - 1.0).abs() < 1e-12);
        assert!((ratio.high - factor).abs() < 1e-7 && (ratio.low * factor - 1.0).abs() < 1e-7, "{ratio:?}");
    }

    #[test]
    fn a_common_factor_is_found_exactly() {
        let mut pairs = Pairs::default();
        [0.3, -1.2, 0.8, 2.0, -0.1].iter().for_each(|x| pairs.add(*x, 3.0 * x));
        let ratio = pairs.ratio(0.05).unwrap();
        // The variance of the paired difference is rounding; its root, 1e-8, is what is left.
        assert!((ratio.value - 3.0).abs() < 1e-14 && ratio.low > 2.999_999 && ratio.high < 3.000_001);
    }

    #[test]
    fn a_verdict_needs_an_interval_that_leaves_out_no_difference() {
        let one = |list: &[(f64, f64)]| {
            let mut pairs = Pairs::default();
            (0..25).flat_map(|_| list).for_each(|(x, y)| pairs.add(*x, *y));
            let shared = [(Quantity::Depth, 0, 0)];
            conclude(&["cell".into()], &shared, &[pairs], &[(0, 0)], 0.05).effects[0].verdict
        };
        assert_eq!(one(&[(1.0, 1.0), (2.0, 2.0)]), Verdict::Alike);
        assert_eq!(one(&[(1.0, 1.5), (2.0, 2.4)]), Verdict::FirstBetter);
        assert_eq!(one(&[(1.5, 1.0), (2.4, 2.0)]), Verdict::SecondBetter);
        assert_eq!(one(&[(1.0, 2.0), (2.0, 1.0)]), Verdict::NotTold);
    }

    #[test]
    fn runs_are_paired_only_where_their_trials_meet_the_same_noise() {
        let level = crate::example::STUDY;
        let other = level.replace("name = \"noise\"", "name = \"noise of a pixel\"");
        assert_ne!(level, other);
        let own = |text: &str| format!("common_random_numbers = false\n{text}");
        let paired = |a: &str, b: &str| {
            let [a, b] = [a, b].map(|text| Engine::new(text, crate::Shard::WHOLE).unwrap());
            check_pairing(&a, &b).map_err(|error| error.to_string())
        };
        assert_eq!(paired(level, &other), Ok(()));
        assert_eq!(paired(&own(level), &own(level)), Ok(()));
        assert!(paired(level, &own(level)).unwrap_err().starts_with("common_random_numbers: true and false"));
        assert!(paired(&own(level), &own(&other)).unwrap_err().starts_with("name of a cell: noise = "));
    }

    /// A complete run of this study in a folder of its own.
    fn ran(name: &str, text: &str) -> PathBuf {
        let at = std::env::temp_dir().join(format!("calibench-compare-{}-{name}", std::process::id()));
        let spec = crate::Spec::parse(text).unwrap();
        let manifest = crate::Manifest::new(&spec, crate::Shard::WHOLE, &calibench_harness::Build::default());
        let folder = crate::Folder::create(&at, text, &manifest).unwrap();
        let mut engine = folder.engine(crate::Shard::WHOLE).unwrap();
        folder.run(&mut engine, &Default::default(), |_| ()).unwrap();
        crate::finish(&folder, &engine).unwrap();
        at
    }

    #[test]
    fn levels_are_compared_with_the_first_at_the_same_levels_of_the_other_factors() {
        let other = "\n[[factor]]\nname = \"distance\"\nset = [\"scene.poses.distance_mm\"]\nlevels = [150.0, 160.0]\n";
        let text =
            crate::example::STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 6\nbatch = 4") + other;
        let at = ran("levels", &text);
        let found = compare_levels(&at, "noise").unwrap();
        std::fs::remove_dir_all(&at).unwrap();
        let engine = Engine::new(&text, crate::Shard::WHOLE).unwrap();
        let fx = engine.quantities.iter().position(|q| q.name() == "fx").unwrap();
        // Cells 0 and 1 have the first level of the noise, and the two distances.
        for (first, second) in [(0, 2), (1, 3)] {
            let square = |cell: usize| -> f64 {
                let of_trial = |trial| crate::run_trial(&engine.cells[cell], &engine.quantities, trial);
                (0..6).map(|trial| of_trial(trial).values[fx].unwrap()).map(|x| x * x).sum()
            };
            let is_it = |e: &&Effect| e.cell == engine.cells[second].name && e.quantity.name() == "fx";
            let effect = found.effects.iter().find(is_it).unwrap();
            assert_eq!(effect.pairs, 6);
            assert!((effect.ratio.value / (square(second) / square(first)).sqrt() - 1.0).abs() < 1e-12);
            assert!((effect.rms[0] / (square(first) / 6.0).sqrt() - 1.0).abs() < 1e-12);
        }
        assert!(found.effects.iter().all(|e| e.cell.starts_with("noise = 0.3")));
    }

    #[test]
    fn a_run_is_compared_with_another_and_not_with_itself() {
        let text = crate::example::STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 6\nbatch = 4");
        let text = text.replace("views = 3", "views = 8").replace("[0.1, 0.3]", "[0.001, 0.002]");
        let louder = text.replace("[0.001, 0.002]", "[0.001, 0.004]");
        let (first, second) = (ran("first", &text), ran("second", &louder));
        let found = compare(&first, &second).unwrap();
        let itself = compare(&first, &first);
        [first, second].iter().for_each(|at| std::fs::remove_dir_all(at).unwrap());
        assert!(matches!(itself, Err(CompareError::Same(_))));
        let of = |cell: &str| found.effects.iter().filter(|e| e.cell == cell).collect::<Vec<_>>();
        let (same, other) = (of("noise = 0.001"), of("noise = 0.002 | noise = 0.004"));
        assert!(same.len() == other.len() && same.len() + other.len() == found.effects.len());
        assert!(same.iter().all(|e| e.verdict == Verdict::Alike && e.ratio.value == 1.0 && e.pairs == 6));
        for effect in other {
            // Of so little noise errors are a linear function.
            assert!((effect.ratio.value / 2.0 - 1.0).abs() < 0.05, "{effect:?}");
            assert_eq!(effect.verdict, Verdict::FirstBetter, "{effect:?}");
        }
    }

    #[test]
    fn trials_that_converge_in_one_run_only_are_counted_and_not_compared() {
        let trial = |outcome: &str, x: f64| Trial {
            cell: 0,
            trial: 0,
            outcome: outcome.into(),
            iterations: 1,
            values: vec![Some(x)],
        };
        let (mut sums, mut only) = ([Pairs::default()], (0, 0));
        for (a, b) in [
            ("converged", "stalled"),
            ("converged", "stalled"),
            ("stalled", "converged"),
            ("converged", "converged"),
            ("stalled", "stalled"),
        ] {
            add(&trial(a, 2.0), &trial(b, 3.0), &[(Quantity::Depth, 0, 0)], &mut sums, &mut only);
        }
        assert_eq!((only, sums[0].count, sums[0].a, sums[0].b), ((2, 1), 1, 4.0, 9.0));
    }

    #[test]
    fn three_pairs_tell_no_ratio_and_four_do() {
        let of = |count: usize| {
            let mut pairs = Pairs::default();
            (0..count).for_each(|i| pairs.add(1.0 + i as f64, 2.0));
            pairs.ratio(0.05)
        };
        assert!(of(3).is_none() && of(4).is_some());
        let mut exact = Pairs::default();
        (0..4).for_each(|_| exact.add(0.0, 1.0));
        assert_eq!(exact.ratio(0.05), None, "nothing is so many times zero");
    }

    #[test]
    fn a_difference_of_less_than_a_thousandth_does_not_matter_however_certain_it_is() {
        let verdict = |ratio: f64| {
            let mut pairs = Pairs::default();
            (0..25).for_each(|_| pairs.add(1.0, ratio));
            conclude(&["cell".into()], &[(Quantity::Depth, 0, 0)], &[pairs], &[(0, 0)], 0.05).effects[0]
                .verdict
        };
        assert_eq!([0.9991, 1.0009].map(verdict), [Verdict::Alike; 2]);
        assert_eq!([0.9989, 1.0011].map(verdict), [Verdict::SecondBetter, Verdict::FirstBetter]);
    }
}
