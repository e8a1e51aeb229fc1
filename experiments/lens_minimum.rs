//! Does the solver find the right minimum with every lens model, whatever people photograph?
//!
//! Expected: wherever the marks determine the camera (Cramer-Rao bound of sd(fx) below 2 % of fx) the solver
//! ends at the cost that a search from the truth reaches, or says that it does not know. Nothing certifies a
//! minimum of these models: a number of starts is refined, and this measures how often that suffices.
//!
//! What it cannot show: marks that break the model. Noise is Gaussian, the lens is of the model that is
//! fitted, the board is flat and has six marks or more in every view. The reference itself is a local
//! minimum: where it is not the lowest one, a solver that ends lower counts as right. Where numerator and
//! denominator of a lens nearly cancel, it may have gone along a valley without end.
//!
//! The run judges the first scenes of every model; all of them take minutes, stand in golden/lens-minimum/,
//! and are read here. They are refused as stale when a line of the solver, of the scenes or of the reference
//! has changed, unless the changed code has made an eighth of them again, bit for bit.

use crate::global_minimum::{ENDINGS, judged::Class, more_than};
use calibench::camera::Model;
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record, Table};
use rayon::prelude::*;

pub mod campaign;
pub mod families;
pub mod judged;
pub mod reference;
pub mod scenes;

use families::{FAMILIES, Family, SCENES};
use judged::{DETERMINED, HEADER, Line};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "lens-minimum",
    title: "The right minimum with every lens model",
    question: "Random scenes of seven lens models: fields of 30 to 200 degrees, 640 to 4000 px wide, pixels up to twice as high as wide, 3 x 4 to \
               9 x 12 marks of which a part is seen, 4 to 20 views, tilts of up to 15 to 60 degrees, noise of 0.01 to 1 px. How often does \
               the solver accept a minimum of higher cost than the one next to the truth, not converge, or refuse? Expected: never where \
               the marks determine the camera.",
    seed: SEED,
    takes_image: false,
    run,
};

/// Seed of every scene; not chosen for its result.
const SEED: u64 = 21;
/// Scenes of each model that every run judges.
const SHARE: u64 = 4;
/// The command that judges all scenes and writes golden/lens-minimum/.
const COMMAND: &str = "cargo run --release --bin lens-minimum-scenes";

/// What was committed of each model.
const COMMITTED: [&str; FAMILIES.len()] = [
    include_str!("../golden/lens-minimum/rational.csv"),
    include_str!("../golden/lens-minimum/thin-prism.csv"),
    include_str!("../golden/lens-minimum/tilted.csv"),
    include_str!("../golden/lens-minimum/kannala-brandt.csv"),
    include_str!("../golden/lens-minimum/division.csv"),
    include_str!("../golden/lens-minimum/double-sphere.csv"),
    include_str!("../golden/lens-minimum/halcon-polynomial.csv"),
];

/// A model with what was committed of it.
struct Measured {
    family: &'static Family,
    text: &'static str,
    lines: Vec<Line>,
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let measured = read()?;
    for m in &measured {
        record.input(format!("golden/lens-minimum/{}.csv", m.family.name()), m.text.as_bytes());
    }
    claim_current(&mut record, &measured);
    claim_share(&mut record, &measured, context);
    report_counts(&mut record, &measured);
    claim_minima(&mut record, &measured);
    claim_deviations(&mut record, &measured);
    record.table(families_table());
    record.table(models_table(&measured));
    record.table(wrong_table(&measured));
    Ok(record)
}

fn read() -> Result<Vec<Measured>, ExperimentError> {
    let one = |(family, text): (&'static Family, &'static str)| {
        let mut rows = text.lines().skip(1);
        let lines =
            (rows.next() == Some(HEADER)).then(|| rows.map(Line::read).collect::<Option<Vec<_>>>()).flatten();
        let broken = || format!("golden/lens-minimum/{}.csv is broken: run {COMMAND}", family.name());
        lines.map(|lines| Measured { family, text, lines }).ok_or_else(|| ExperimentError::Input(broken()))
    };
    FAMILIES.iter().zip(COMMITTED).map(one).collect()
}

/// The committed scenes are those of this code.
fn claim_current(record: &mut Record, measured: &[Measured]) {
    let present = Fingerprint::of_lens_minimum();
    let case = |m: &Measured| {
        let (what, held) = present.case(&format!("{}.csv", m.family.name()), m.text, COMMAND);
        (what, held && m.lines.len() as u64 == SCENES)
    };
    record
        .claim_that(
            "scenes-are-current",
            "every committed scene was drawn and judged by the present code, or by code of which the present has made an eighth again, bit for bit",
        )
        .every("tables", measured.iter().map(case))
        .because("SHA-256 of the code lines of solver, scenes and reference, and the versions of the numeric crates");
}

/// The first scenes of every model are judged again in every run.
fn claim_share(record: &mut Record, measured: &[Measured], context: &Context) {
    if context.seed != SEED {
        record.note("Another seed draws other scenes than the committed ones: the share is not compared.");
        return;
    }
    let jobs: Vec<(&Measured, u64)> =
        measured.iter().flat_map(|m| (0..SHARE).map(move |index| (m, index))).collect();
    let progress = context.progress("scenes", jobs.len());
    let case = |(m, index): &(&Measured, u64)| {
        let now = judged::judged(m.family, SEED, *index).map(|line| line.text());
        progress.step();
        let then = m.text.lines().nth(2 + *index as usize);
        (format!("{} {index}: run {COMMAND}", m.family.name()), now.is_some() && now.as_deref() == then)
    };
    let cases: Vec<(String, bool)> = jobs.par_iter().map(case).collect();
    record.exact("").count("scenes-judged", cases.len(), "scenes judged in every run");
    record
        .claim_that(
            "share-has-the-same-bits",
            "the scenes judged in this run give the committed estimates, costs and references, bit for bit",
        )
        .every("scenes", cases)
        .because("the streams are keyed by seed, model and index, and every sum has its order");
}

/// Claims that something never happens: the false-alarm rate is that of a solver to which it happens once in
/// a million scenes.
const NEVER: f64 = 1e-6;
/// How far a mean squared error over the stated variance may be off.
const MEAN_OFF: f64 = 0.05;
/// And chance besides, in standard deviations of such a mean; a normal number lies farther out with the
/// probability below.
const MEAN_DEVIATIONS: f64 = 3.3;
const MEAN_CHANCE: f64 = 9.7e-4;
/// Fewest results that such a mean is taken of.
const FEWEST: usize = 100;

impl Measured {
    fn count(&self, of: impl Fn(&Line) -> bool) -> usize {
        self.lines.iter().filter(|line| of(line)).count()
    }

    /// Accepted at a higher cost than the reference's, where the marks determine the camera.
    fn wrong_where_determined(&self) -> usize {
        self.count(|line| line.class == Class::Wrong && line.is_determined())
    }

    /// And by more than a noise variance: chance alone moves a minimum so far.
    fn far_where_determined(&self) -> usize {
        self.count(|line| line.class == Class::Wrong && line.is_determined() && line.excess > 1.0)
    }

    /// Results that are right, determined and that no warning questions.
    fn unquestioned(&self) -> impl Iterator<Item = &Line> {
        self.right_and_determined().filter(|line| !line.is_questioned)
    }

    /// And those that a warning questions.
    fn questioned(&self) -> impl Iterator<Item = &Line> {
        self.right_and_determined().filter(|line| line.is_questioned)
    }

    fn right_and_determined(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(|line| line.class == Class::Right && line.is_determined())
    }
}

fn report_counts(record: &mut Record, measured: &[Measured]) {
    let reason = "counts over committed scenes: a changed solver moves them, the claims judge them";
    record.exact("").count(
        "scenes",
        measured.iter().map(|m| m.lines.len()).sum(),
        "random scenes of all models",
    );
    for m in measured {
        let name = m.family.name();
        let mut number = |id: &str, value: usize, what: &str| {
            record.group("", Band::absolute(m.lines.len() as f64, reason)).number(
                format!("{id}-{name}"),
                value as f64,
                format!("{name}: {what}"),
            );
        };
        number("determined", m.count(Line::is_determined), "scenes with a bound of sd(fx)/fx below 2 %");
        number(
            "right",
            m.count(|l| l.class == Class::Right),
            "scenes accepted at the reference's cost or below",
        );
        number("wrong", m.count(|l| l.class == Class::Wrong), "scenes accepted at a higher cost");
        number("wrong-of-determined", m.wrong_where_determined(), "of these, determined");
        number("far-of-determined", m.far_where_determined(), "and higher by more than a noise variance");
        number("refused", m.count(|l| l.class == Class::Refused), "scenes refused");
        number(
            "refused-of-determined",
            m.count(|l| l.class == Class::Refused && l.is_determined()),
            "of these, determined",
        );
        number("open", m.count(|l| l.class == Class::NotConverged), "scenes that did not converge");
    }
}

fn claim_minima(record: &mut Record, measured: &[Measured]) {
    let determined: usize = measured.iter().map(|m| m.count(Line::is_determined)).sum();
    let reason = "sums of squares against a search from the truth; the false-alarm rate is that of a solver wrong once in a million scenes";
    let silent = |m: &Measured| m.count(|l| l.class == Class::Wrong && l.is_determined() && !l.is_questioned);
    record
        .claim_that(
            "none-silently-wrong-where-determined",
            "where the marks determine the camera, no minimum is accepted at a higher cost than that next to the truth without a warning that questions it",
        )
        .every("models", measured.iter().map(|m| (format!("{}: {}", m.family.name(), silent(m)), silent(m) == 0)))
        .at_rate(more_than(0, determined, NEVER))
        .because(reason);
    // Fractions and prisms have valleys with two minima that differ by less than noise.
    let few = [Model::KannalaBrandt, Model::Division, Model::DoubleSphere];
    let of_few = || measured.iter().filter(|m| few.contains(&m.family.model));
    record
        .claim_that(
            "fisheyes-are-right-where-determined",
            "where the marks determine the camera, no minimum of the fisheyes' and the division model is accepted at a higher cost, warned of or not",
        )
        .every(
            "models",
            of_few().map(|m| {
                (format!("{}: {}", m.family.name(), m.wrong_where_determined()), m.wrong_where_determined() == 0)
            }),
        )
        .at_rate(more_than(0, of_few().map(|m| m.count(Line::is_determined)).sum(), NEVER))
        .because(reason);
}

/// Errors of the whole camera under the stated covariance: their mean is the number of parameters.
fn claim_deviations(record: &mut Record, measured: &[Measured]) {
    let caption = "error of fx over its stated deviation, and squared error of all parameters over their number, under the stated covariance: \
                   right results of determined scenes without a warning that questions them, and the first of these for those with one";
    let stated: Vec<Stated> = measured.iter().map(Stated::of).collect();
    record.table(
        Table::of("errors", caption, &stated)
            .column("model", "", |s| s.model)
            .column("results", "", |s| s.errors.len())
            .column("mean_z_squared", "", |s| mean_square_of_fx(&s.errors))
            .column("mean_square", "", |s| s.mean_square())
            .column("largest_square", "", |s| s.squares().fold(0.0, f64::max))
            .column("questioned", "", |s| s.questioned.len())
            .column("their_mean_z_squared", "", |s| mean_square_of_fx(&s.questioned)),
    );
    let enough = stated.iter().filter(|s| s.errors.len() >= FEWEST);
    let cases: Vec<(String, bool)> = enough.map(Stated::case).collect();
    let rate = cases.len() as f64 * MEAN_CHANCE;
    record
        .claim_that(
            "covariances-are-true",
            "without a warning that questions it, the mean squared error of all parameters under the stated covariance is their number within five per cent, model by model",
        )
        .every("models", cases)
        .at_rate(rate)
        .because("a mean of n chi-squared numbers of k degrees of freedom has a relative standard deviation of sqrt(2 / (n k)), and 3.3 of them are allowed besides");
}

/// Errors of the right results of a model whose scenes are determined, in units of what is stated of them: of
/// fx, and the square of all parameters under their covariance.
struct Stated {
    model: &'static str,
    parameters: f64,
    /// Without a warning that questions them.
    errors: Vec<[f64; 2]>,
    /// With one.
    questioned: Vec<[f64; 2]>,
}

impl Stated {
    fn of(m: &Measured) -> Stated {
        Stated {
            model: m.family.name(),
            parameters: m.family.free().len() as f64,
            errors: m.unquestioned().filter_map(|line| line.errors).collect(),
            questioned: m.questioned().filter_map(|line| line.errors).collect(),
        }
    }

    /// Over the number of parameters: 1 is expected.
    fn squares(&self) -> impl Iterator<Item = f64> {
        self.errors.iter().map(|[_, square]| square / self.parameters)
    }

    fn mean_square(&self) -> f64 {
        self.squares().sum::<f64>() / self.errors.len() as f64
    }

    /// Whether the mean is 1 within what is allowed.
    fn case(&self) -> (String, bool) {
        let (count, square) = (self.errors.len() as f64, self.mean_square());
        let chance = MEAN_DEVIATIONS * (2.0 / (count * self.parameters)).sqrt();
        (format!("{}: {square:.3} of {count}", self.model), (square - 1.0).abs() <= MEAN_OFF + chance)
    }
}

/// Mean squared error of fx over its stated variance.
fn mean_square_of_fx(errors: &[[f64; 2]]) -> f64 {
    errors.iter().map(|[z, _]| z * z).sum::<f64>() / errors.len() as f64
}

fn families_table() -> Table {
    Table::of("families", "the lenses that are drawn, and how many parameters are estimated", &FAMILIES)
        .column("model", "", |family| family.name())
        .column("what", "", |family| family.about)
        .column("half_field_from", "deg", |family| family.half_field_deg.0)
        .column("half_field_to", "deg", |family| family.half_field_deg.1)
        .column("unknowns", "", |family| family.free().len())
        .into()
}

fn models_table(measured: &[Measured]) -> Table {
    let caption = format!(
        "how the scenes of every model ended; determined: bound of sd(fx)/fx below {DETERMINED}; by_a_variance: of these, at a cost higher by more than a noise variance; lower: accepted at a cost lower than the \
         reference's by a thousandth of a variance"
    );
    Table::of("models", caption, measured)
        .column("model", "", |m| m.family.name())
        .column("scenes", "", |m| m.lines.len())
        .columns(ENDINGS, "", |m| Class::ALL.map(|class| m.count(|line| line.class == class)))
        .column("determined", "", |m| m.count(Line::is_determined))
        .column("wrong_determined", "", |m| m.wrong_where_determined())
        .column("by_a_variance", "", |m| m.far_where_determined())
        .column("refused_determined", "", |m| m.count(|l| l.class == Class::Refused && l.is_determined()))
        .column("lower", "", |m| m.count(|line| line.class == Class::Right && line.excess < -1e-3))
        .into()
}

/// Every scene that was accepted at a higher cost.
fn wrong_table(measured: &[Measured]) -> Table {
    let caption =
        "scenes accepted at a higher cost than the reference's, which exceeds it by so many noise variances";
    let wrong = measured.iter().flat_map(|m| {
        m.lines.iter().filter(|line| line.class == Class::Wrong).map(move |line| (m.family.name(), line))
    });
    Table::of("wrong", caption, wrong)
        .column("model", "", |(model, _)| *model)
        .column("index", "", |(_, line)| line.index as usize)
        .column("views", "", |(_, line)| line.views)
        .column("marks", "", |(_, line)| line.marks)
        .column("half_field", "deg", |(_, line)| line.field_deg)
        .column("bound", "", |(_, line)| line.bound)
        .column("excess", "", |(_, line)| line.excess)
        .column("warned", "", |(_, line)| if line.is_questioned { "yes" } else { "no" })
        .column("what", "", |(_, line)| line.note.clone())
        .into()
}
