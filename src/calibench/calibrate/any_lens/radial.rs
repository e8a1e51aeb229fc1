//! Which coefficients bend angles from the axis to given radii? A start for one model from another's picture.

use crate::camera::{FreeParameters, Lens, Model, Parameter};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector};

/// A pinhole has no image of what lies beyond this angle, rad.
const BESIDE: f64 = 1.55;
/// Combinations of coefficients that are known worse than the best by this factor are left alone.
const UNTOLD: f64 = 1e-6;
/// Steps of each coefficient of the double sphere.
const STEPS: usize = 12;

/// The lens with those coefficients that are free fitted to pairs of angle (rad) and distorted radius; the
/// others stay as they are. With it the factor of the focal length: the radii are those of a lens that leaves
/// the axis with slope 1, and a double sphere does so with `1 / (1 + xi)`. Of these there are two, as a rule
/// each a minimum of its own: one with a negative and one with a positive `xi`. None where a pinhole would
/// have to see beside itself.
pub(super) fn fitted(lens: Lens, free: FreeParameters, radii: &[[f64; 2]]) -> Vec<(Lens, f64)> {
    use Parameter::{K4, K5, K6};
    if !lens.model().sees_behind() && radii.iter().any(|[angle, _]| *angle > BESIDE) {
        return Vec::new();
    }
    match lens.model() {
        Model::DoubleSphere if free.contains(Parameter::Xi) => [[-0.6, -0.05], [0.0, 0.9]]
            .into_iter()
            .filter_map(|[from, to]| best_sphere(lens, free, &steps(from, to), radii))
            .collect(),
        Model::DoubleSphere => {
            let xi = lens.get(Parameter::Xi).unwrap_or(0.0);
            best_sphere(lens, free, &[xi], radii).into_iter().collect()
        }
        // A fraction follows the radii in many ways: with all its terms, and with none below the line.
        _ => [free, free.without(K4).without(K5).without(K6)]
            .into_iter()
            .take(if lens.get(K6).is_some() && [K4, K5, K6].iter().any(|&p| free.contains(p)) {
                2
            } else {
                1
            })
            .filter_map(|free| Some((least_squares(lens, free, radii)?, 1.0)))
            .collect(),
    }
}

/// Other lenses of the same model with nearly the same radii: a fraction follows a curve in many ways, with
/// some of its terms left out, each perhaps beside a minimum of its own. None where the model is no fraction.
pub(super) fn alternatives(lens: Lens, free: FreeParameters, radii: &[[f64; 2]]) -> Vec<Lens> {
    use Parameter::{K1, K2, K3, K4, K5, K6};
    if lens.get(K6).is_none() {
        return Vec::new();
    }
    let without = |left_out: &&[Parameter]| {
        let left_out = left_out.iter().copied().filter(|&p| free.contains(p));
        let (lens, free) = left_out
            .fold((lens, free), |(lens, free), p| (lens.with(p, 0.0).unwrap_or(lens), free.without(p)));
        least_squares(lens, free, radii)
    };
    let subsets: [&[Parameter]; 4] = [&[K6], &[K3], &[K4, K5, K6], &[K1, K2, K3]];
    subsets.iter().filter_map(without).collect()
}

/// Ranges of xi in which a double sphere may have a minimum of its own.
const XI_RANGES: [[f64; 2]; 4] = [[-0.6, -0.2], [-0.2, 0.1], [0.1, 0.5], [0.5, 1.1]];

/// Double spheres with nearly the same radii, one in each range of `xi` but for the range of `lens` itself,
/// with the factor of the focal length: spheres that are farther apart behind a longer lens make nearly the
/// same picture. None where xi is not free or the model another.
pub(super) fn other_spheres(lens: Lens, free: FreeParameters, radii: &[[f64; 2]]) -> Vec<(Lens, f64)> {
    let Some(own) = lens.get(Parameter::Xi).filter(|_| free.contains(Parameter::Xi)) else {
        return Vec::new();
    };
    let sloped: Vec<[f64; 2]> = radii.iter().map(|[angle, radius]| [*angle, (1.0 + own) * radius]).collect();
    XI_RANGES
        .into_iter()
        .filter(|[from, to]| !(*from..*to).contains(&own))
        .filter_map(|[from, to]| best_sphere(lens, free, &steps(from, to), &sloped))
        .map(|(lens, factor)| (lens, factor / (1.0 + own)))
        .collect()
}

/// A model's equation multiplied out, linear in its radial coefficients: their factors and the right-hand
/// side.
fn equation(model: Model, &[angle, radius]: &[f64; 2]) -> (Vec<(Parameter, f64)>, f64) {
    use Parameter::{K1, K2, K3, K4, K5, K6};
    let r = libm::tan(angle);
    let (s, g) = (r * r, radius / r);
    match model {
        Model::KannalaBrandt => {
            let t = angle * angle;
            (vec![(K1, t), (K2, t * t), (K3, t * t * t), (K4, t * t * t * t)], radius / angle - 1.0)
        }
        Model::Division => (vec![(K1, radius * radius)], g - 1.0),
        Model::HalconPolynomial => {
            let t = radius * radius;
            (vec![(K1, t), (K2, t * t), (K3, t * t * t)], r / radius - 1.0)
        }
        _ => {
            let above = [(K1, s), (K2, s * s), (K3, s * s * s)];
            let below = [(K4, -g * s), (K5, -g * s * s), (K6, -g * s * s * s)];
            (above.into_iter().chain(below).collect(), g - 1.0)
        }
    }
}

fn least_squares(lens: Lens, free: FreeParameters, radii: &[[f64; 2]]) -> Option<Lens> {
    let rows: Vec<_> = radii
        .iter()
        .filter(|[angle, radius]| *angle > 1e-3 && *radius > 0.0)
        .map(|sample| equation(lens.model(), sample))
        .collect();
    let Some((first, _)) = rows.first() else { return Some(lens) };
    let is_unknown = |p: &Parameter| free.contains(*p) && lens.get(*p).is_some();
    let unknown: Vec<Parameter> = first.iter().map(|(p, _)| *p).filter(is_unknown).collect();
    if unknown.is_empty() {
        return Some(lens);
    }
    let mut a = DMatrix::zeros(rows.len(), unknown.len());
    let mut b = DVector::zeros(rows.len());
    for (i, (terms, wanted)) in rows.iter().enumerate() {
        b[i] = *wanted;
        for &(parameter, factor) in terms {
            match unknown.iter().position(|&p| p == parameter) {
                Some(column) => a[(i, column)] = factor,
                None => b[i] -= factor * lens.get(parameter).unwrap_or(0.0),
            }
        }
    }
    // The triangle of A = Q R has A's singular values, and few rows.
    let triangle = if a.nrows() > a.ncols() {
        let factors = a.qr();
        factors.q_tr_mul(&mut b);
        b = b.rows(0, unknown.len()).into_owned();
        factors.r()
    } else {
        a
    };
    let decomposed = triangle.svd(true, true);
    let solved = decomposed.solve(&b, UNTOLD * decomposed.singular_values.max()).ok()?;
    unknown.iter().zip(solved.iter()).try_fold(lens, |lens, (&p, &value)| lens.with(p, value))
}

/// Numbers evenly between two.
fn steps(from: f64, to: f64) -> Vec<f64> {
    (0..=STEPS).map(|k| from + (to - from) * k as f64 / STEPS as f64).collect()
}

/// The double sphere, of a grid, whose radii are closest.
fn best_sphere(lens: Lens, free: FreeParameters, xis: &[f64], radii: &[[f64; 2]]) -> Option<(Lens, f64)> {
    let held = || vec![lens.get(Parameter::Alpha).unwrap_or(0.5)];
    let alphas = if free.contains(Parameter::Alpha) { steps(0.1, 0.9) } else { held() };
    let squared_error = |lens: &Lens, xi: f64, [angle, radius]: &[f64; 2]| {
        let at = lens.project(&Vec3::new(libm::sin(*angle), 0.0, libm::cos(*angle)))?;
        let off = (1.0 + xi) * at.x - radius;
        Some(off * off)
    };
    let mut best: Option<(f64, Lens, f64)> = None;
    for &xi in xis {
        for &alpha in &alphas {
            let candidate = lens.with(Parameter::Xi, xi)?.with(Parameter::Alpha, alpha)?;
            let error: Option<f64> = radii.iter().map(|sample| squared_error(&candidate, xi, sample)).sum();
            if let Some(error) = error
                && best.is_none_or(|(least, ..)| error < least)
            {
                best = Some((error, candidate, 1.0 + xi));
            }
        }
    }
    best.map(|(_, lens, factor)| (lens, factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Angles and radii of a lens, as if it left the axis with slope 1.
    fn radii(lens: &Lens, slope: f64) -> Vec<[f64; 2]> {
        let radius =
            |angle: f64| lens.project(&Vec3::new(libm::sin(angle), 0.0, libm::cos(angle))).unwrap().x;
        (1..=20).map(|k| 0.06 * f64::from(k)).map(|angle| [angle, radius(angle) / slope]).collect()
    }

    #[test]
    fn a_polynomial_is_found_from_its_radii_with_some_of_its_terms_held() {
        use Parameter::{K1, K2, K3, K4};
        let truth = Lens::new(Model::KannalaBrandt, &[0.02, -0.01, 0.004, -0.0015]).unwrap();
        for free in [vec![K1, K2, K3, K4], vec![K1, K3], vec![K2], vec![]] {
            let start = free.iter().fold(truth, |lens, &p| lens.with(p, 0.0).unwrap());
            let found = fitted(start, FreeParameters::of(&free), &radii(&truth, 1.0));
            let [(lens, factor)] = found[..] else { panic!("{found:?}") };
            assert_eq!(factor, 1.0);
            for p in [K1, K2, K3, K4] {
                let [is, should] = [lens, truth].map(|lens| lens.get(p).unwrap());
                // The eighth power of these angles is told a thousandth as well as the square.
                assert!((is - should).abs() < 1e-9, "{free:?} {p:?}: {is} {should}");
            }
        }
    }

    #[test]
    fn a_double_sphere_whose_xi_is_held_keeps_it_and_takes_the_closest_alpha() {
        use Parameter::{Alpha, Xi};
        // On the grid of alpha, and off the grid of xi.
        let truth = Lens::new(Model::DoubleSphere, &[0.23, 0.6]).unwrap();
        let start = truth.with(Alpha, 0.4).unwrap();
        let radii = radii(&truth, 1.0 / 1.23);
        let found = fitted(start, FreeParameters::of(&[Alpha]), &radii);
        let [(lens, factor)] = found[..] else { panic!("{found:?}") };
        assert_eq!((lens.get(Xi), factor), (Some(0.23), 1.23));
        assert!((lens.get(Alpha).unwrap() - 0.6).abs() < 0.04, "{lens:?}");
    }

    #[test]
    fn the_equation_of_a_model_holds_of_its_lenses() {
        use Parameter::{K1, K2, K3, K4, K5, K6};
        for (model, coefficients) in [
            (Model::KannalaBrandt, vec![(K1, 0.02), (K2, -0.01), (K3, 0.004), (K4, -0.0015)]),
            (Model::Division, vec![(K1, -0.2)]),
            (Model::HalconPolynomial, vec![(K1, 0.2), (K2, 0.05), (K3, 0.01)]),
            (Model::Rational, vec![(K1, 0.3), (K2, 0.2), (K3, 0.1), (K4, 0.4), (K5, 0.25), (K6, 0.05)]),
        ] {
            let lens = coefficients
                .iter()
                .fold(Lens::ideal(model), |lens, &(p, value)| lens.with(p, value).unwrap());
            for sample in radii(&lens, 1.0) {
                let (factors, right) = equation(model, &sample);
                let left: f64 = factors.iter().map(|(p, factor)| factor * lens.get(*p).unwrap()).sum();
                assert!(
                    (left - right).abs() < 1e-9 * (1.0 + right.abs()),
                    "{model:?} {sample:?}: {left} {right}"
                );
            }
        }
    }

    #[test]
    fn other_spheres_make_nearly_the_same_picture_with_another_focal_length() {
        use Parameter::{Alpha, Xi};
        let own = Lens::new(Model::DoubleSphere, &[0.2, 0.55]).unwrap();
        let own_radii = radii(&own, 1.0);
        let others = other_spheres(own, FreeParameters::of(&[Xi, Alpha]), &own_radii);
        assert!(others.len() >= 2, "{others:?}");
        for (other, factor) in others {
            assert!((other.get(Xi).unwrap() - 0.2).abs() > 0.05);
            for ([_, here], [_, there]) in own_radii.iter().zip(radii(&other, 1.0)) {
                assert!((factor * there / here - 1.0).abs() < 0.05, "{other:?} {factor}: {there} {here}");
            }
        }
        // Where xi is held there are none.
        assert!(other_spheres(own, FreeParameters::of(&[Alpha]), &own_radii).is_empty());
    }
}
