//! Which lens model do the marks ask for? Models compared by Schwarz's criterion, and by what they predict of
//! views that they have not seen.
//!
//! The residuals of the fit always fall with more coefficients. Two measures do not: Schwarz's criterion
//! (1978), which charges every unknown `ln n`, and the error on views that were left out:
//!
//! ```text
//! BIC = n ln(sum |r|^2 / n) + p ln n,   n = 2 N coordinates, p unknowns
//! hold-out = sqrt(sum |r|^2 / sum (2 N - 6)) over views that the camera was not fitted to
//! ```
//!
//! Under a robust loss the squares are those of the marks that count ([`Counted`]), and `N` is their number.
//!
//! The criterion looks at all views at once; a fifth of few views is little to predict, and from four fifths
//! of them a rich model is known poorly. So the criterion decides, and predictions only where it says
//! nothing.

use super::any_lens::located;
use super::chance::fisher_tail;
use super::counted::{Counted, weighted_residuals};
use super::domain::spans_a_plane;
use super::structure::neighbours;
use super::{Board, CalibrationError, LensCalibration, Role, Settings, Warning, calibrate_lens};
use crate::board::View;
use crate::camera::{FreeParameters, Model, Parameter};

/// A lens model with the coefficients that are estimated, and what is taken of the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The model.
    pub model: Model,
    /// Its coefficients that are free; the others are 0, or held as the settings say. Of fx, fy, cx, cy and
    /// skew those that are free besides what the settings say.
    pub coefficients: FreeParameters,
    /// The board.
    pub board: Board,
}

impl Candidate {
    /// The models worth comparing where nothing is known of the lens: Brown-Conrady's from two coefficients
    /// to five, the rational model, two fisheyes and the division model, with a flat board.
    pub fn usual() -> Vec<Candidate> {
        use Parameter::{K1, K2, K3, P1, P2};
        let plain: [&[Parameter]; 4] = [&[K1, K2], &[K1, K2, K3], &[K1, K2, P1, P2], &[K1, K2, P1, P2, K3]];
        let brown = plain.map(|list| (Model::BrownConrady, FreeParameters::of(list)));
        let others = [Model::Rational, Model::KannalaBrandt, Model::DoubleSphere, Model::Division]
            .map(|model| (model, FreeParameters::of(model.coefficients())));
        let flat = |(model, coefficients)| Candidate { model, coefficients, board: Board::Flat };
        brown.into_iter().chain(others).map(flat).collect()
    }

    /// The settings with this model: what they say of fx, fy, cx, cy and skew stays, but for those that are
    /// free here.
    pub fn settings(&self, settings: &Settings) -> Settings {
        let mut own = settings.clone().with_model(self.model).with_board(self.board);
        for parameter in Parameter::OF_ALL_MODELS.into_iter().filter(|p| !Parameter::LINEAR.contains(p)) {
            let role = match (self.coefficients.contains(parameter), settings.role(parameter)) {
                (true, known @ Role::Known { .. }) => known,
                (true, _) => Role::Free,
                (false, held @ Role::Held(_)) if self.model == settings.model() => held,
                (false, _) => Role::Default,
            };
            own = own.with_role(parameter, role);
        }
        // What is known of one of them beforehand stays known.
        let is_new = |p: &Parameter| self.coefficients.contains(*p) && !settings.free().contains(*p);
        Parameter::LINEAR.into_iter().filter(is_new).fold(own, Settings::estimate)
    }
}

/// How a candidate does.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Compared {
    /// Which.
    pub candidate: Candidate,
    /// The fit to all views.
    pub calibration: LensCalibration,
    /// Schwarz's criterion: the least is best, 10 more is very strong evidence against (Kass & Raftery 1995).
    pub bic: f64,
    /// Error of a coordinate on views that were left out, px; `None` where the lens cannot be calibrated
    /// without a part of the views, or does not reach a mark of that part.
    pub hold_out_px: Option<f64>,
    /// Squared error of each fold, for the comparison of two candidates.
    folds: Vec<f64>,
    /// Sum of the squares of what counts of the residuals, px^2.
    square: f64,
    /// Whether it comes behind all of which this is false: a coefficient lies where the model is not defined,
    /// or there are as many unknowns as measurements, so that it fits whatever was measured.
    pub is_behind: bool,
    /// Correlation of a mark's residual with the next one's: 0 for noise.
    pub correlation: f64,
}

impl Compared {
    /// In how many of the folds this one predicts the views that were left out better than the other, of how
    /// many.
    pub fn wins_against(&self, other: &Compared) -> (usize, usize) {
        let better = self.folds.iter().zip(&other.folds).filter(|(own, others)| own < others).count();
        (better, self.folds.len().min(other.folds.len()))
    }

    /// How likely would the sum of squares be so much below that of `other`, which has more degrees of
    /// freedom, if `other` were right and this model held it? The tail of Fisher's F, of what the unknowns
    /// more take away over what is left; `None` where this model has not more unknowns, or no degree of
    /// freedom.
    pub fn chance_against(&self, other: &Compared) -> Option<f64> {
        let own = self.calibration.degrees_of_freedom;
        let more = other.calibration.degrees_of_freedom.checked_sub(own).filter(|&more| more > 0)?;
        let each = |square: f64, freedom: usize| square / freedom as f64;
        (own > 0)
            .then(|| fisher_tail(each(other.square - self.square, more) / each(self.square, own), more, own))
    }

    /// The error on views that were left out; infinite where there is none.
    fn predicted(&self) -> f64 {
        self.hold_out_px.unwrap_or(f64::INFINITY)
    }
}

/// Parts into which the views are divided; each is left out once.
const FOLDS: usize = 5;

/// A difference of the criterion below this one is "not worth more than a bare mention" (Kass & Raftery
/// 1995): odds of less than e to one.
const NO_EVIDENCE: f64 = 2.0;

/// Fits every candidate. The first of the result is the choice: of those whose criterion of Schwarz lies
/// within 2 of the least, the one that best predicts views that were left out (in five parts of the views in
/// turn). The others follow by their criterion; behind them those whose coefficients lie where their model is
/// not defined, or that have as many unknowns as there are measurements. Candidates that the views do not
/// determine come with their reason. Views whose marks do not span a plane tell nothing and take no part, as
/// long as half of the views do.
///
/// ```
/// use calibench::calibrate::{Candidate, Settings, compare_models};
/// use calibench::camera::Model;
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "choice", trial: 0, purpose: "noise" });
/// let views = Scene::example().observe(0.1, &mut stream);
/// // Brown-Conrady's lens with two coefficients, the true one, and with more; the others take longer.
/// let candidates: Vec<Candidate> =
///     Candidate::usual().into_iter().filter(|candidate| candidate.model == Model::BrownConrady).collect();
/// let (compared, refused) = compare_models(&views, &Settings::standard(), &candidates);
/// assert!(refused.is_empty());
/// assert_eq!(compared[0].candidate.coefficients.to_string(), "k1,k2");
/// ```
pub fn compare_models(
    views: &[View],
    settings: &Settings,
    candidates: &[Candidate],
) -> (Vec<Compared>, Vec<(Candidate, CalibrationError)>) {
    let views = &telling(views);
    let (mut fitted, mut refused) = (Vec::new(), Vec::new());
    for &candidate in candidates {
        match calibrate_lens(views, &candidate.settings(settings)) {
            Ok(calibration) => fitted.push((candidate, calibration)),
            Err(error) => refused.push((candidate, error)),
        }
    }
    let counted = Counted::of(views, fitted.iter().map(|(_, fit)| fit), settings.loss);
    let judge = |(candidate, fit)| judged(views, settings, &counted, candidate, fit);
    let mut compared: Vec<Compared> = fitted.into_iter().map(judge).collect();
    compared.sort_by(|a, b| (a.is_behind.cmp(&b.is_behind)).then(a.bic.total_cmp(&b.bic)));
    let worst = compared.first().is_some_and(|first| first.is_behind);
    let eligible = compared.iter().take_while(|c| c.is_behind == worst);
    let measures: Vec<(f64, f64)> = eligible.map(|c| (c.bic, c.predicted())).collect();
    if let Some(place) = chosen(&measures) {
        compared[..=place].rotate_right(1);
    }
    (compared, refused)
}

/// Which of some candidates is taken, by their criteria, in ascending order, and their errors on views left
/// out.
fn chosen(measures: &[(f64, f64)]) -> Option<usize> {
    let (least, _) = *measures.first()?;
    let no_worse = measures.iter().take_while(|(bic, _)| bic - least <= NO_EVIDENCE);
    no_worse.enumerate().min_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b)).map(|(place, _)| place)
}

/// The views whose marks span a plane; all of them where they are less than half.
fn telling(views: &[View]) -> Vec<View> {
    let telling: Vec<View> = views.iter().filter(|view| spans_a_plane(view).is_ok()).cloned().collect();
    if 2 * telling.len() >= views.len() { telling } else { views.to_vec() }
}

fn judged(
    views: &[View],
    settings: &Settings,
    counted: &Counted,
    candidate: Candidate,
    calibration: LensCalibration,
) -> Compared {
    let folds = hold_out(views, &candidate.settings(settings), counted);
    let error = |folds: &[(f64, f64)]| {
        let (square, freedom) =
            folds.iter().fold((0.0, 0.0), |(s, f), (square, freedom)| (s + square, f + freedom));
        (square / freedom).sqrt()
    };
    let of_fit = counted.in_fit(views, &calibration);
    Compared {
        candidate,
        bic: criterion(of_fit, unknowns(&calibration)),
        hold_out_px: folds.as_deref().map(error),
        folds: folds.unwrap_or_default().into_iter().map(|(square, _)| square).collect(),
        square: of_fit.0,
        is_behind: Warning::is_outside_range(&calibration.camera) || calibration.degrees_of_freedom == 0,
        correlation: neighbours(&weighted_residuals(views, &calibration), settings.loss).correlation,
        calibration,
    }
}

/// Schwarz's criterion of a sum of squares over so many marks.
fn criterion((square, marks): (f64, usize), unknowns: f64) -> f64 {
    let coordinates = 2.0 * marks as f64;
    coordinates * libm::log(square / coordinates) + unknowns * libm::log(coordinates)
}

fn unknowns(fit: &LensCalibration) -> f64 {
    (2.0 * fit.points() as f64 - fit.degrees_of_freedom as f64).max(0.0)
}

/// Of each fold the squared, weighted error on its views and its degrees of freedom; `None` where a fold
/// cannot be calibrated without.
fn hold_out(views: &[View], settings: &Settings, counted: &Counted) -> Option<Vec<(f64, f64)>> {
    let folds = FOLDS.min(views.len());
    (0..folds)
        .map(|fold| {
            let (out, kept): (Vec<_>, Vec<_>) =
                views.iter().enumerate().partition(|(view, _)| view % folds == fold);
            let kept: Vec<View> = kept.into_iter().map(|(_, view)| view.clone()).collect();
            let fit = calibrate_lens(&kept, settings).ok()?;
            let of_view = |(place, view): (usize, &View)| {
                let residuals = located(&fit.camera, fit.board.as_ref(), view, settings.loss)?.residuals;
                let (square, marks) = counted.in_view(place, view, &residuals);
                Some((square, (2.0 * marks as f64 - 6.0).max(0.0)))
            };
            out.into_iter().try_fold((0.0, 0.0), |(square, freedom), left_out| {
                of_view(left_out).map(|(s, f)| (square + s, freedom + f))
            })
        })
        .collect()
}

/// A freedom that explains what a fit leaves over.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Freedom {
    /// The model with it.
    pub candidate: Candidate,
    /// RMSE with it, px; under a robust loss of the marks that are strays to none of the models that were
    /// tried.
    pub rmse_px: f64,
    /// RMSE without it, of the same marks, px.
    pub rmse_without_px: f64,
    /// Correlation of neighbours' residuals with it.
    pub correlation: f64,
}

/// A freedom that takes away less than this part of the RMSE explains little.
const WORTH: f64 = 0.05;
/// A criterion of Schwarz's that falls by so much is very strong evidence (Kass & Raftery 1995).
const STRONG_EVIDENCE: f64 = 10.0;

/// What of fx, fy, cx, cy and skew is held or tied: the focal lengths, the principal point and skew each by
/// itself.
fn held_basics(settings: &Settings) -> Vec<&'static [Parameter]> {
    const BASICS: [&[Parameter]; 4] =
        [&[Parameter::Fx], &[Parameter::Fy], &[Parameter::Cx, Parameter::Cy], &[Parameter::Skew]];
    let free = settings.free();
    BASICS.into_iter().filter(|list| list.iter().any(|&p| !free.contains(p))).collect()
}

/// Where residuals of neighbouring marks agree: which one freedom more, of the lens or of the board, lowers
/// the RMSE of `fit` by a twentieth or more; where none does, those for which the criterion of Schwarz is
/// very strong evidence. The first has the strongest: a dozen coefficients come behind the two that do as
/// well.
pub fn explaining_freedoms(views: &[View], settings: &Settings, fit: &LensCalibration) -> Vec<Freedom> {
    use Parameter::{K1, K2, K3, P1, P2, S1, S2, S3, S4, TauX, TauY};
    let model = settings.model();
    let is_coefficient = |p: &Parameter| !Parameter::LINEAR.contains(p);
    let own = fit.free.iter().filter(is_coefficient).fold(FreeParameters::NONE, FreeParameters::with);
    let with = |more: &[Parameter]| more.iter().fold(own, |set, &p| set.with(p));
    let basics = held_basics(settings);
    let richer = [with(&[K3]), with(&[P1, P2]), with(&[K1, K2, K3, P1, P2])]
        .into_iter()
        .filter(|_| model == Model::BrownConrady)
        .chain(basics.into_iter().map(with))
        .map(|set| (model, set));
    let others = [
        (Model::Rational, Model::Rational.coefficients()),
        (Model::KannalaBrandt, Model::KannalaBrandt.coefficients()),
        (Model::DoubleSphere, Model::DoubleSphere.coefficients()),
        (Model::Division, Model::Division.coefficients()),
        (Model::ThinPrism, &[K1, K2, K3, P1, P2, S1, S2, S3, S4]),
        (Model::Tilted, &[K1, K2, K3, P1, P2, TauX, TauY]),
    ]
    .into_iter()
    .filter(|(other, _)| *other != model)
    .map(|(other, coefficients)| (other, FreeParameters::of(coefficients)));
    let standard_deviation = f64::INFINITY;
    let boards = [Board::Bowed { standard_deviation }, Board::Bent { standard_deviation }];
    let is_richer = |board: &Board| match (settings.board, board) {
        (Board::Bent { .. }, Board::Bowed { .. }) => false,
        (own, board) => own != *board,
    };
    let candidates = richer
        .chain(others)
        .map(|(model, coefficients)| Candidate { model, coefficients, board: settings.board })
        .filter(|candidate| candidate.coefficients != own)
        .chain(boards.into_iter().filter(is_richer).map(|board| Candidate {
            model,
            coefficients: own,
            board,
        }));
    // A coefficient that is held, and that richer sets have, makes some of these the same.
    let distinct = candidates.fold(Vec::new(), |mut distinct: Vec<Candidate>, candidate| {
        if !distinct.contains(&candidate) {
            distinct.push(candidate);
        }
        distinct
    });
    let fitted: Vec<(Candidate, LensCalibration)> = distinct
        .into_iter()
        .filter_map(|candidate| Some((candidate, calibrate_lens(views, &candidate.settings(settings)).ok()?)))
        .filter(|(_, fit)| fit.termination.is_minimum() && fit.degrees_of_freedom > 0)
        .collect();
    let fits = fitted.iter().map(|(_, calibration)| calibration);
    let counted = Counted::of(views, fits.chain([fit]), settings.loss);
    let rmse_without_px = counted.rmse_px(views, fit);
    let of_fit = |fit: &LensCalibration| criterion(counted.in_fit(views, fit), unknowns(fit));
    let without = of_fit(fit);
    let freedom = |(candidate, calibration): (Candidate, LensCalibration)| {
        let gain = without - of_fit(&calibration);
        let rmse_px = counted.rmse_px(views, &calibration);
        let correlation = neighbours(&weighted_residuals(views, &calibration), settings.loss).correlation;
        (gain, Freedom { candidate, rmse_px, rmse_without_px, correlation })
    };
    let mut tried: Vec<(f64, Freedom)> = fitted.into_iter().map(freedom).collect();
    let is_much = |freedom: &Freedom| freedom.rmse_px < (1.0 - WORTH) * rmse_without_px;
    let one_is_much = tried.iter().any(|(_, freedom)| is_much(freedom));
    tried.retain(|(gain, freedom)| if one_is_much { is_much(freedom) } else { *gain > STRONG_EVIDENCE });
    tried.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let mut found: Vec<Freedom> = tried.into_iter().map(|(_, freedom)| freedom).collect();
    // A twist besides two bows explains something only where bows alone do not explain it.
    let is_bowed = |f: &&Freedom| matches!(f.candidate.board, Board::Bowed { .. });
    let bowed_px = found.iter().find(is_bowed).map_or(f64::INFINITY, |bowed| bowed.rmse_px);
    let is_idle = |f: &Freedom| {
        matches!(f.candidate.board, Board::Bent { .. }) && f.rmse_px >= (1.0 - WORTH) * bowed_px
    };
    found.retain(|freedom| !is_idle(freedom));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::four_views;
    use crate::geometry::Vec2;

    #[test]
    fn the_criterion_decides_and_predictions_where_it_says_nothing() {
        let none = f64::INFINITY;
        assert_eq!(chosen(&[]), None);
        // A prediction that is far better by chance does not shut out the candidate with evidence for it.
        assert_eq!(chosen(&[(-350.0, 0.13), (-347.9, 0.11)]), Some(0));
        assert_eq!(chosen(&[(-350.0, 0.13), (-348.1, 0.12), (-349.0 + 5.0, 0.11)]), Some(1));
        // Where no part of the views can be left out the criterion is alone.
        assert_eq!(chosen(&[(-350.0, none), (-349.0, none)]), Some(0));
        assert_eq!(chosen(&[(-350.0, none), (-349.0, 0.2)]), Some(1));
    }

    #[test]
    fn what_is_held_or_known_stays_so_while_others_are_freed() {
        use Parameter::{Cx, Cy, K1, K2};
        let known = Role::Known { mean: 320.0, standard_deviation: 1.0 };
        let settings = Settings::standard().with_role(Cx, known).hold(Cy, 240.0).hold(K2, 0.05);
        let coefficients = FreeParameters::of(&[K1, Cx, Cy]);
        let candidate = Candidate { model: Model::BrownConrady, coefficients, board: Board::Flat };
        let own = candidate.settings(&settings);
        let roles = [Cx, Cy, K1, K2].map(|p| own.role(p));
        assert_eq!(roles, [known, Role::Free, Role::Free, Role::Held(0.05)]);
        // Another lens has its own coefficients.
        let other = Candidate { model: Model::Rational, ..candidate };
        assert_eq!(other.settings(&settings).role(K2), Role::Default);
    }

    #[test]
    fn the_true_model_predicts_views_left_out_as_well_as_noise_allows() {
        let views = four_views(0.1);
        let (compared, _) = compare_models(&views, &Settings::standard(), &Candidate::usual()[..1]);
        // Of 480 degrees of freedom the noise is known to 3 %; the camera of three views adds a little.
        let hold_out_px = compared[0].hold_out_px.unwrap();
        assert!((0.09..0.12).contains(&hold_out_px), "{hold_out_px}");
    }

    /// A candidate with so many degrees of freedom, sum of squares, and errors of folds.
    fn compared(freedom: usize, square: f64, folds: &[f64]) -> Compared {
        let candidate = Candidate::usual()[0];
        let mut calibration =
            calibrate_lens(&four_views(0.1), &candidate.settings(&Settings::standard())).unwrap();
        calibration.degrees_of_freedom = freedom;
        Compared {
            candidate,
            calibration,
            bic: 0.0,
            hold_out_px: None,
            folds: folds.to_vec(),
            square,
            is_behind: false,
            correlation: 0.0,
        }
    }

    #[test]
    fn chance_takes_so_much_away_with_the_tail_of_fishers_distribution() {
        // Of 2 and d degrees of freedom F is exceeded with probability (1 + 2 F / d)^(-d / 2), which is the
        // ratio of the squares to the power of d / 2.
        let (rich, plain) = (compared(100, 1.0, &[]), compared(102, 1.2, &[]));
        let chance = rich.chance_against(&plain).unwrap();
        assert!((chance / libm::pow(1.2, -50.0) - 1.0).abs() < 1e-6, "{chance}");
        assert_eq!((plain.chance_against(&rich), plain.chance_against(&plain)), (None, None));
        assert_eq!(compared(0, 1.0, &[]).chance_against(&plain), None);
    }

    #[test]
    fn a_fold_is_won_by_the_smaller_error() {
        let (a, b) = (compared(9, 1.0, &[1.0, 2.0, 3.0, 4.0]), compared(9, 1.0, &[1.0, 3.0, 4.0]));
        assert_eq!((a.wins_against(&b), b.wins_against(&a)), ((2, 3), (0, 3)));
        // Nothing is predicted where nothing could be left out.
        assert_eq!(a.predicted(), f64::INFINITY);
        assert_eq!(Compared { hold_out_px: Some(0.2), ..a }.predicted(), 0.2);
    }

    #[test]
    fn the_criterion_is_schwarzs() {
        // Twenty coordinates of mean square e^2: 20 ln e^2 + 3 ln 20.
        let own = criterion((20.0 * libm::exp(2.0), 10), 3.0);
        assert!((own - (40.0 + 3.0 * libm::log(20.0))).abs() < 1e-12, "{own}");
        assert_eq!(unknowns(&compared(474, 1.0, &[]).calibration), 30.0);
    }

    #[test]
    fn views_that_span_no_plane_take_no_part_where_half_of_all_do() {
        let plane = four_views(0.1)[0].clone();
        let row = View::new(plane.points()[..9].to_vec(), plane.pixels()[..9].to_vec()).unwrap();
        let of = |planes: usize, rows: usize| {
            telling(&[vec![plane.clone(); planes], vec![row.clone(); rows]].concat()).len()
        };
        assert_eq!((of(2, 2), of(3, 1), of(1, 2), of(2, 3)), (2, 3, 3, 5));
    }

    #[test]
    fn a_view_left_out_has_its_coordinates_but_for_those_of_its_pose() {
        let views = four_views(0.1);
        let settings = Settings::standard();
        let fit = calibrate_lens(&views, &settings).unwrap();
        let counted = Counted::of(&views, [&fit].into_iter(), settings.loss);
        let folds = hold_out(&views, &settings, &counted).unwrap();
        assert_eq!(folds.iter().map(|(_, freedom)| *freedom).collect::<Vec<_>>(), [120.0; 4]);
    }

    #[test]
    fn a_fit_with_degrees_of_freedom_and_coefficients_in_range_is_not_behind() {
        let (compared, _) = compare_models(&four_views(0.1), &Settings::standard(), &Candidate::usual()[..2]);
        assert!(compared.iter().all(|c| !c.is_behind));
    }

    #[test]
    fn a_lens_that_is_not_centred_asks_for_tangential_terms() {
        use Parameter::{K1, K2, P1, P2};
        // A shift by the tangential terms of p1 = 0.01 about (326, 243), to first order.
        let tangential = |view: &View| {
            let shifted = |pixel: &Vec2| {
                let at = (pixel - Vec2::new(326.0, 243.0)) / 600.0;
                let shift = 0.01 * Vec2::new(2.0 * at.x * at.y, at.norm_squared() + 2.0 * at.y * at.y);
                pixel + 600.0 * shift
            };
            View::new(view.points().to_vec(), view.pixels().iter().map(shifted).collect()).unwrap()
        };
        let views: Vec<View> = four_views(0.02).iter().map(tangential).collect();
        let settings = Settings::standard().hold(Parameter::P1, 0.0).hold(Parameter::P2, 0.0);
        let fit = calibrate_lens(&views, &settings).unwrap();
        let found = explaining_freedoms(&views, &settings, &fit);
        let crooked = FreeParameters::of(&[K1, K2, P1, P2]);
        let own = found.iter().find(|freedom| freedom.candidate.coefficients == crooked).unwrap();
        assert!(own.rmse_px < 0.032 && own.rmse_without_px > 0.05, "{own:?}");
        // Richer models that have these terms do as well; what explains nothing is not named.
        assert!(found.iter().any(|freedom| freedom.candidate.model == Model::ThinPrism));
        assert!(found.iter().all(|freedom| freedom.rmse_px < 0.95 * freedom.rmse_without_px), "{found:?}");
    }
}
