//! Which freedoms that nobody decided on do the marks ask for? Groups of parameters and the board's shape, by
//! what the cost would fall by with them; with any lens.
//!
//! Rao's score test (1948) needs no further fit: with the normal equations `H` and the gradient `g` of a
//! problem in which `k` numbers more are free, at the minimum without them, the cost falls by `g^T H^-1 g`,
//! to second order. If they are 0 in truth, that over `k` variances of a coordinate follows Fisher's F of `k`
//! and the residuals' degrees of freedom. One shortcoming of a model looks like many: of what is asked for,
//! the least likely is named first, and the others only for what they explain beside it.

use super::any_lens::Falls;
use super::chance::fisher_tail;
use super::prior::is_held;
use super::{Board, LensCalibration, Loss, Prior, Role, Settings, Warning};
use crate::board::View;
use crate::camera::{FreeParameters, Parameter};

/// What may be free besides: parameters, and the board's two bows and twist.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Freedoms {
    pub parameters: FreeParameters,
    pub shape: bool,
}

impl Freedoms {
    /// Nothing besides.
    pub const NONE: Freedoms = Freedoms { parameters: FreeParameters::NONE, shape: false };
}

/// What the cost of a minimum would fall by with more freedoms.
pub(crate) trait CostFalls {
    /// With some of them; `None` where the marks do not determine them.
    fn fall(&self, more: Freedoms) -> Option<f64>;

    /// Two bows and a twist with which it would be least, with these parameters more; `None` of marks that
    /// are not a board's.
    fn shape(&self, parameters: FreeParameters) -> Option<[f64; DEFORMATIONS]>;
}

/// Numbers that come together.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Group {
    /// What most lenses have, or the standard choice leaves out; or what is held at values that are not 0, or
    /// known too well for the marks to have a say: that they contradict it is told as of one that is known
    /// beforehand.
    Parameters(FreeParameters),
    /// So many of two bows and a twist.
    Shape {
        /// The others are estimated already.
        more: usize,
    },
}

impl Group {
    fn of(parameters: &[Parameter]) -> Group {
        Group::Parameters(FreeParameters::of(parameters))
    }

    /// What of it others do not have; `None` where that is nothing.
    fn beyond(self, others: Freedoms) -> Option<Group> {
        match self {
            Group::Parameters(all) => {
                let new = others.parameters.iter().fold(all, FreeParameters::without);
                (!new.is_empty()).then_some(Group::Parameters(new))
            }
            Group::Shape { .. } => Some(self),
        }
    }

    fn len(self) -> usize {
        match self {
            Group::Parameters(set) => set.len(),
            Group::Shape { more } => more,
        }
    }

    /// Other freedoms and this one.
    fn besides(self, others: Freedoms) -> Freedoms {
        match self {
            Group::Parameters(set) => {
                Freedoms { parameters: set.iter().fold(others.parameters, FreeParameters::with), ..others }
            }
            Group::Shape { .. } => Freedoms { shape: true, ..others },
        }
    }
}

/// Of a board that is not flat.
pub(crate) const DEFORMATIONS: usize = 3;

/// Parameters that are looked for, each group by itself.
const ASKED: [&[Parameter]; 4] =
    [&[Parameter::P1, Parameter::P2], &[Parameter::K3], &[Parameter::Cx, Parameter::Cy], &[Parameter::Skew]];
/// A set that needs none of them is told that it does with this probability, for each.
const CHANCE: f64 = 1e-5;

/// What nobody has decided on, and the values that are held or tied. Without these a coefficient that nobody
/// asked for would make up for a wrong one.
fn undecided(settings: &Settings) -> Vec<Group> {
    let model = settings.model();
    let is_left_out = |&p: &Parameter| match settings.role(p) {
        Role::Default => model.parameters().any(|own| own == p),
        Role::Held(_) => Parameter::LINEAR.contains(&p),
        _ => false,
    };
    let asked: Vec<&[Parameter]> = ASKED.into_iter().filter(|list| list.iter().all(is_left_out)).collect();
    let is_tied = |p: &Parameter| *p == Parameter::Fy && settings.fy_per_fx().is_some();
    let is_value =
        |p: &Parameter| is_tied(p) || matches!(settings.role(*p), Role::Held(value) if value != 0.0);
    let is_alone = |p: &Parameter| !asked.iter().any(|list| list.contains(p));
    let values: Vec<Parameter> = model.parameters().filter(is_value).filter(is_alone).collect();
    let more = DEFORMATIONS - settings.board.bend().map_or(0, |bend| bend.deformations);
    let shape = (more > 0).then_some(Group::Shape { more });
    asked.into_iter().map(Group::of).chain(of_values(&values)).chain(shape).collect()
}

/// Values that are held: each, both focal lengths, which distances make up for where they are wrong by one
/// factor, and all together.
fn of_values(values: &[Parameter]) -> Vec<Group> {
    let mut groups: Vec<Group> = values.iter().map(|&value| Group::of(&[value])).collect();
    let focal = [Parameter::Fx, Parameter::Fy];
    let together = [&focal[..], values].map(Group::of);
    let is_held = [focal.iter().all(|p| values.contains(p)), values.len() > 1];
    for (group, is_held) in together.into_iter().zip(is_held) {
        if is_held && !groups.contains(&group) {
            groups.push(group);
        }
    }
    groups
}

/// A warning for each group that the marks of a calibration ask for.
pub(super) fn asked_for(views: &[View], settings: &Settings, found: &LensCalibration) -> Vec<Warning> {
    asked(settings, found, true, |settings, found, more| Falls::of(views, settings, found, more))
}

/// The same of any marks, a board's or others: `falls` gives what the cost of a result would fall by, with
/// what is as good as held no longer among its free parameters and priors.
pub(crate) fn asked<F: CostFalls>(
    settings: &Settings,
    found: &LensCalibration,
    are_of_board: bool,
    falls: impl FnOnce(&Settings, &LensCalibration, Freedoms) -> Option<F>,
) -> Vec<Warning> {
    if settings.loss != Loss::Squares || !found.termination.is_minimum() {
        return Vec::new();
    }
    match held_by_priors(settings, found) {
        Some((settings, found)) => asked_of_held(&settings, &found, are_of_board, falls),
        None => asked_of_held(settings, found, are_of_board, falls),
    }
}

/// The same where what is known so well that the marks have no say is held; `None` where nothing is. A prior
/// of this kind can be contradicted no other way: by how far the estimate lies from it is lost in rounding.
fn held_by_priors(settings: &Settings, found: &LensCalibration) -> Option<(Settings, LensCalibration)> {
    let is_tight = |prior: &&Prior| {
        let posterior = found.covariance.standard_deviation(prior.parameter);
        posterior.is_some_and(|posterior| is_held(prior.standard_deviation, posterior))
    };
    let tight: Vec<Prior> = found.priors.iter().filter(is_tight).copied().collect();
    let is_flat = settings.board.bend().zip(found.board.as_ref()).is_some_and(|(bend, shape)| {
        let mut known = shape.standard_deviations.iter().take(bend.deformations);
        known.all(|&posterior| is_held(bend.standard_deviation, posterior))
    });
    if tight.is_empty() && !is_flat {
        return None;
    }
    let (mut settings, mut found) = (settings.clone(), found.clone());
    if is_flat {
        settings = settings.with_board(Board::Flat);
    }
    for Prior { parameter, .. } in tight {
        // Where it is, which is hardly ever 0: a value that is known to be 0 is asked too.
        settings = settings.hold(parameter, found.camera.value(parameter)?);
        found.free = found.free.without(parameter);
        found.priors.retain(|prior| prior.parameter != parameter);
    }
    Some((settings, found))
}

fn asked_of_held<F: CostFalls>(
    settings: &Settings,
    found: &LensCalibration,
    are_of_board: bool,
    falls: impl FnOnce(&Settings, &LensCalibration, Freedoms) -> Option<F>,
) -> Vec<Warning> {
    let mut undecided = undecided(settings);
    undecided.retain(|group| are_of_board || !matches!(group, Group::Shape { .. }));
    let all = undecided.iter().fold(Freedoms::NONE, |all, group| group.besides(all));
    let variance = found.sigma_px * found.sigma_px;
    match falls(settings, found, all) {
        Some(falls) => named(&falls, undecided, variance, found.degrees_of_freedom),
        None => Vec::new(),
    }
}

/// A group with what the cost would fall by for it, in variances, and how likely chance makes so much.
#[derive(Clone, Copy)]
struct Told {
    group: Group,
    fall: f64,
    probability: f64,
}

fn named(falls: &impl CostFalls, mut undecided: Vec<Group>, variance: f64, freedom: usize) -> Vec<Warning> {
    let (mut with, mut before) = (Freedoms::NONE, 0.0);
    let mut told = Vec::new();
    loop {
        let asked = |group: &Group| {
            let group = group.beyond(with)?;
            let fall = (falls.fall(group.besides(with))? - before) / variance;
            let below = freedom.checked_sub(group.len()).filter(|&below| below > 0)?;
            let probability = fisher_tail(fall / group.len() as f64, group.len(), below);
            (probability < CHANCE).then_some(Told { group, fall, probability })
        };
        let less_likely = |a: &Told, b: &Told| {
            let each = |told: &Told| told.fall / told.group.len() as f64;
            a.probability.total_cmp(&b.probability).then(each(b).total_cmp(&each(a)))
        };
        let Some(next) = undecided.iter().filter_map(asked).min_by(less_likely) else { break };
        (with, before) = (next.group.besides(with), before + next.fall * variance);
        undecided.retain(|group| group.beyond(with).is_some() && *group != next.group);
        told.push(next);
    }
    let shape = falls.shape(with.parameters).unwrap_or_default();
    told.into_iter().map(|told| warning(told, shape)).collect()
}

fn warning(Told { group, fall, probability }: Told, [bow_x, bow_y, twist]: [f64; DEFORMATIONS]) -> Warning {
    match group {
        Group::Parameters(set) => Warning::LeftOut { parameters: set.iter().collect(), fall, probability },
        Group::Shape { .. } => Warning::NotFlat { bow_x, bow_y, twist, fall, probability },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::calibrate_lens;
    use crate::calibrate::tests::four_views;
    use crate::camera::Model;

    #[test]
    fn what_is_decided_on_is_not_asked() {
        use Parameter::{Cx, Cy, K3, P1, P2, Skew};
        let [tangential, radial, centre, skew] = ASKED.map(Group::of);
        let shape = Group::Shape { more: 3 };
        let standard = Settings::standard();
        assert_eq!(undecided(&standard), [tangential, radial, skew, shape]);
        assert_eq!(undecided(&standard.clone().hold(K3, 0.0)), [tangential, skew, shape]);
        assert_eq!(undecided(&standard.clone().estimate(P2).estimate(Skew)), [radial, shape]);
        let standard_deviation = f64::INFINITY;
        let decided = standard.clone().estimate(P1).estimate(K3).estimate(Skew);
        let bowed = decided.clone().with_board(Board::Bowed { standard_deviation });
        assert_eq!(undecided(&bowed), [Group::Shape { more: 1 }]);
        assert!(undecided(&decided.with_board(Board::Bent { standard_deviation })).is_empty());
        // A value that is held is one that somebody believes in.
        let k2 = standard.clone().hold(Parameter::K2, 0.07);
        let [fx, fy, k2_alone] = [Parameter::Fx, Parameter::Fy, Parameter::K2].map(|p| Group::of(&[p]));
        assert_eq!(undecided(&k2), [tangential, radial, skew, k2_alone, shape]);
        // Distances make up for focal lengths that are both wrong.
        let focal = k2.hold(Parameter::Fx, 600.0).hold(Parameter::Fy, 600.0);
        let both = Group::of(&[Parameter::Fx, Parameter::Fy]);
        let all = Group::of(&[Parameter::Fx, Parameter::Fy, Parameter::K2]);
        assert_eq!(undecided(&focal), [tangential, radial, skew, fx, fy, k2_alone, both, all, shape]);
        let tied = standard.clone().hold(Parameter::Fx, 600.0).tie_focal_lengths(1.0);
        assert_eq!(undecided(&tied), [tangential, radial, skew, fx, fy, both, shape]);
        // A lens is asked for nothing that it does not have.
        assert_eq!(undecided(&Settings::of_model(Model::KannalaBrandt)), [skew, shape]);
        // What a wrong value of the principal point does is not to be put down to p1 and p2.
        let off = standard.hold(Cx, 320.0).hold(Cy, 240.0);
        assert_eq!(undecided(&off), [tangential, radial, centre, skew, shape]);
    }

    /// What the cost falls by for each set of parameters.
    struct Table(Vec<(FreeParameters, f64)>);

    impl CostFalls for Table {
        fn fall(&self, more: Freedoms) -> Option<f64> {
            self.0.iter().find(|(parameters, _)| *parameters == more.parameters).map(|(_, fall)| *fall)
        }

        fn shape(&self, _: FreeParameters) -> Option<[f64; DEFORMATIONS]> {
            None
        }
    }

    /// Parameters, fall and probability of what is told of p1 with p2 and of k3, by what the cost falls by
    /// with the first, the second and both.
    fn told(falls: [f64; 3], variance: f64, freedom: usize) -> Vec<(Vec<Parameter>, f64, f64)> {
        let [tangential, radial, ..] = ASKED;
        let sets = [tangential.to_vec(), radial.to_vec(), [tangential, radial].concat()];
        let table = Table(sets.iter().map(|set| FreeParameters::of(set)).zip(falls).collect());
        let warnings = named(&table, vec![Group::of(tangential), Group::of(radial)], variance, freedom);
        let told = warnings.into_iter().map(|warning| match warning {
            Warning::LeftOut { parameters, fall, probability } => (parameters, fall, probability),
            other => panic!("{other}"),
        });
        told.collect()
    }

    #[test]
    fn the_second_is_told_with_what_it_explains_beside_the_first() {
        use Parameter::{K3, P1, P2};
        // Variances of 0.5 px^2: alone 100 and 60 of them, together 140.
        let found = told([50.0, 30.0, 70.0], 0.5, 200);
        let [(first, a, probability), (second, b, _)] = &found[..] else { panic!("{found:?}") };
        assert_eq!((&first[..], *a, &second[..], *b), (&[P1, P2][..], 100.0, &[K3][..], 40.0));
        // Of two and d degrees of freedom F is exceeded with probability (1 + 2 F / d)^(-d / 2): F = 50, d =
        // 198.
        let expected = libm::pow(1.0 + 100.0 / 198.0, -99.0);
        assert!((probability / expected - 1.0).abs() < 1e-6, "{probability}");
        // What is explained already is not told.
        assert_eq!(told([50.0, 30.0, 51.0], 0.5, 200).len(), 1);
    }

    #[test]
    fn where_no_chance_is_left_the_first_is_what_explains_most_with_each_parameter() {
        let found = told([1e6, 8e5, 2e6], 1.0, 1000);
        assert_eq!((found[0].2, found[1].2), (0.0, 0.0));
        assert_eq!(found[0].0, [Parameter::K3]);
    }

    #[test]
    fn a_wrong_value_that_is_held_is_told() {
        let settings = Settings::standard().hold(Parameter::K1, -0.15);
        let views = four_views(0.1);
        let found = calibrate_lens(&views, &settings).unwrap();
        let is_k1 = |w: &Warning| matches!(w, Warning::LeftOut { parameters, .. } if parameters[..] == [Parameter::K1]);
        assert!(asked_for(&views, &settings, &found).iter().any(is_k1));
    }
}
