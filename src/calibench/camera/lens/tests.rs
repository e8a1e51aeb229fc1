//! One test for all models: derivatives, homogeneity, inverse, monotone angle.

use super::*;
use crate::camera::{Camera, Lens, Model};
use crate::geometry::lanes::{Arithmetic, LANES, Lanes, run_portable};
use crate::geometry::lanes::{Kernel, dispatch};
use proptest::prelude::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number with one derivative (Clifford 1873): `f(a + b e) = f(a) + f'(a) b e`.
#[derive(Clone, Copy, Debug)]
struct Dual(f64, f64);

impl Add for Dual {
    type Output = Dual;
    fn add(self, o: Dual) -> Dual {
        Dual(self.0 + o.0, self.1 + o.1)
    }
}
impl Sub for Dual {
    type Output = Dual;
    fn sub(self, o: Dual) -> Dual {
        Dual(self.0 - o.0, self.1 - o.1)
    }
}
impl Mul for Dual {
    type Output = Dual;
    fn mul(self, o: Dual) -> Dual {
        Dual(self.0 * o.0, self.0 * o.1 + self.1 * o.0)
    }
}
impl Div for Dual {
    type Output = Dual;
    fn div(self, o: Dual) -> Dual {
        Dual(self.0 / o.0, (self.1 * o.0 - self.0 * o.1) / (o.0 * o.0))
    }
}
impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        Dual(-self.0, -self.1)
    }
}
impl Arithmetic for Dual {
    fn splat(value: f64) -> Dual {
        Dual(value, 0.0)
    }
}
impl Real for Dual {
    fn sqrt(self) -> Dual {
        Dual(self.0.sqrt(), self.1 / (2.0 * self.0.sqrt()))
    }
    fn sin(self) -> Dual {
        Dual(libm::sin(self.0), self.1 * libm::cos(self.0))
    }
    fn cos(self) -> Dual {
        Dual(libm::cos(self.0), -self.1 * libm::sin(self.0))
    }
    fn atan2(self, x: Dual) -> Dual {
        Dual(libm::atan2(self.0, x.0), (self.1 * x.0 - self.0 * x.1) / (self.0 * self.0 + x.0 * x.0))
    }
    fn min(self, o: Dual) -> Dual {
        if self.0 < o.0 { self } else { o }
    }
}

/// Coefficients of ordinary size from numbers between -1 and 1.
fn coefficients(model: Model, random: &[f64; 14]) -> Vec<f64> {
    model
        .coefficients()
        .iter()
        .zip(random)
        .map(|(parameter, x)| {
            use Parameter::*;
            match parameter {
                // A barrel, as most lenses are.
                K1 if model == Model::HalconPolynomial => 0.1 + 0.1 * x,
                K1 => -0.1 + 0.1 * x,
                K2 | K3 | K4 => 0.02 * x,
                K5 | K6 => 0.01 * x,
                P1 | P2 | S1 | S2 | S3 | S4 => 0.003 * x,
                TauX | TauY => 0.05 * x,
                Xi => 0.3 * x,
                Alpha => 0.55 + 0.1 * x,
                _ => unreachable!("linear"),
            }
        })
        .collect()
}

/// Values and derivatives in the direction of coefficient or coordinate `unknown`, from dual numbers and from
/// the model's own formulas.
struct Derivative {
    point: [f64; 3],
    unknown: usize,
}

impl LensVisitor for Derivative {
    type Output = ([Dual; 2], [f64; 2]);

    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Self::Output {
        let Derivative { point, unknown } = self;
        let carrying = |i: usize, value: f64| Dual(value, f64::from(u8::from(i == unknown)));
        let lens: [Dual; P] = std::array::from_fn(|i| carrying(i, coefficients[i]));
        let dual = M::project(&M::constants(lens), std::array::from_fn(|i| carrying(P + i, point[i])));
        let plain = M::project(&M::constants(coefficients), point);
        assert_eq!(dual.at.map(|d| d.0), plain.at);
        let own =
            if unknown < P { plain.by_lens[unknown] } else { plain.by_point.map(|row| row[unknown - P]) };
        (dual.at, own)
    }
}

fn ray_at(angle: f64, around: f64) -> Vec3 {
    Vec3::new(libm::sin(angle) * libm::cos(around), libm::sin(angle) * libm::sin(around), libm::cos(angle))
}

/// Whether the image folds between the axis and that angle, as tangential terms and prisms make it before the
/// radius does: a pixel then is the image of a ray nearer to the axis too.
fn is_folded(lens: &Lens, angle: f64, around: f64) -> bool {
    let at = |angle: f64, around: f64| lens.project(&ray_at(angle, around)).unwrap();
    (1..=100).map(|k| angle * f64::from(k) / 100.0).any(|angle| {
        let step = 1e-6;
        let outwards = at(angle + step, around) - at(angle - step, around);
        let along = at(angle, around + step) - at(angle, around - step);
        outwards.perp(&along) <= 0.0
    })
}

proptest! {
    #[test]
    fn derivatives_are_those_of_dual_numbers(
        random in prop::array::uniform14(-1.0f64..1.0), x in -0.9f64..0.9, y in -0.9f64..0.9, z in 0.8f64..3.0,
    ) {
        for model in Model::ALL {
            let coefficients = coefficients(model, &random);
            let lens = Lens::new(model, &coefficients).unwrap();
            for unknown in 0..coefficients.len() + 3 {
                let (dual, own) = visit(&lens, Derivative { point: [x, y, z], unknown });
                for i in 0..2 {
                    prop_assert!(
                        (dual[i].1 - own[i]).abs() <= 1e-11 * (1.0 + own[i].abs()),
                        "{} {}: {} {}", model, unknown, dual[i].1, own[i]
                    );
                }
            }
        }
    }

    #[test]
    fn only_the_direction_of_a_point_counts(
        random in prop::array::uniform14(-1.0f64..1.0), x in -0.9f64..0.9, y in -0.9f64..0.9, far in 0.01f64..1e4,
    ) {
        for model in Model::ALL {
            let lens = Lens::new(model, &coefficients(model, &random)).unwrap();
            let near = lens.project(&Vec3::new(x, y, 1.0)).unwrap();
            let away = lens.project(&(far * Vec3::new(x, y, 1.0))).unwrap();
            prop_assert!((near - away).norm() <= 1e-14 * (1.0 + near.norm()), "{model}");
        }
    }

    #[test]
    fn the_inverse_is_exact_inside_the_domain(
        random in prop::array::uniform14(-1.0f64..1.0), part in 0.0f64..0.97, around in 0.0f64..6.3,
    ) {
        for model in Model::ALL {
            let lens = Lens::new(model, &coefficients(model, &random)).unwrap();
            // Pinholes are tried up to 80 degrees and the division model, whose radius grows without bound
            // too, up to 120, where a pixel is far outside of every image.
            let most = match model {
                Model::KannalaBrandt | Model::DoubleSphere => lens.monotone_angle(),
                Model::Division => lens.monotone_angle().min(2.1),
                _ => lens.monotone_angle().min(1.4),
            };
            let angle = part * most;
            let ray = ray_at(angle, around);
            let at = lens.project(&ray).unwrap();
            // Next to the rim tangential terms may carry a point over it: that may be refused, not answered
            // wrongly.
            match lens.ray(&at) {
                Ok(found) => {
                    let back = lens.project(&found).unwrap();
                    prop_assert!((back - at).norm() <= 1e-14 * (1.0 + at.norm()), "{model} {angle} {at}");
                    let is_the_one = (found - ray).norm() < 1e-7 || is_folded(&lens, angle, around);
                    prop_assert!(is_the_one, "{model} {angle} {found} {ray}");
                }
                Err(error) => prop_assert!(part > 0.85, "{model} {angle}: {error}"),
            }
        }
    }

    #[test]
    fn the_radius_grows_up_to_the_monotone_angle_and_not_beyond(random in prop::array::uniform14(-1.0f64..1.0)) {
        for model in Model::ALL {
            let mut strong = coefficients(model, &random);
            // Strong enough to fold, and without what is not radial.
            for (value, parameter) in strong.iter_mut().zip(model.coefficients()) {
                use Parameter::*;
                match parameter {
                    K1 | K2 | K3 | K4 => *value *= 4.0,
                    P1 | P2 | S1 | S2 | S3 | S4 | TauX | TauY => *value = 0.0,
                    _ => {}
                }
            }
            let lens = Lens::new(model, &strong).unwrap();
            let limit = lens.monotone_angle();
            let radius = |angle: f64| lens.project(&Vec3::new(libm::sin(angle), 0.0, libm::cos(angle))).map(|p| p.x);
            let (mut last, mut missed) = (0.0, 0);
            for k in 1..2000 {
                let Some(now) = radius(limit * 0.9999 * f64::from(k) / 2000.0) else {
                    missed += 1;
                    continue;
                };
                prop_assert!(now > last, "{model} {strong:?} {k}");
                last = now;
            }
            // A polynomial that is solved for the seen point may end short where it hardly grows.
            let may_miss = if model == Model::HalconPolynomial { 400 } else { 0 };
            prop_assert!(missed <= may_miss, "{model} {strong:?}: {missed}");
            let (rim, beyond) = (radius(limit * 0.99999), radius(limit * 1.001));
            let ends = limit * 1.001 >= if model.sees_behind() { std::f64::consts::PI } else { 1.57 };
            let folds = match (rim, beyond) {
                (Some(rim), Some(beyond)) => beyond < rim * (1.0 + 1e-5),
                _ => true,
            };
            prop_assert!(ends || folds, "{model} {strong:?} {limit} {rim:?} {beyond:?}");
        }
    }
}

#[test]
fn outside_the_domain_there_is_no_ray() {
    let folding = [
        Lens::new(Model::BrownConrady, &[-0.3, 0.0, 0.0, 0.0, 0.0]),
        Lens::new(Model::Rational, &[-0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        Lens::new(Model::KannalaBrandt, &[-0.1, 0.0, 0.0, 0.0]),
        Lens::new(Model::Division, &[1.0]),
        Lens::new(Model::DoubleSphere, &[0.2, 0.7]),
        Lens::new(Model::HalconPolynomial, &[-0.3, 0.0, 0.0, 0.0, 0.0]),
    ];
    for lens in folding.map(Result::unwrap) {
        let refused = lens.ray(&Vec2::new(3.0, 2.0));
        assert!(matches!(refused, Err(UndistortError::OutsideMonotoneRadius { .. })), "{lens:?} {refused:?}");
        assert!(matches!(lens.ray(&Vec2::new(f64::NAN, 0.0)), Err(UndistortError::NotFinite { .. })));
    }
    assert!(Lens::new(Model::Division, &[1.0, 2.0]).is_err());
}

#[test]
fn a_point_on_the_axis_is_seen_at_the_principal_point() {
    for model in Model::ALL {
        let camera = Camera::with_lens(600.0, 590.0, 320.0, 240.0, Lens::ideal(model));
        let pixel = camera.pixel(&Vec3::new(0.0, 0.0, 2.0)).unwrap();
        assert!((pixel - Vec2::new(320.0, 240.0)).norm() < 1e-12, "{model}");
        assert!((camera.ray(&pixel).unwrap() - Vec3::z()).norm() < 1e-12, "{model}");
    }
}

/// Everything that a model gives for four points.
struct Lanewise([[f64; LANES]; 3]);

struct LanewiseWith<M, const P: usize>([[f64; LANES]; 3], [f64; P], std::marker::PhantomData<M>);

impl<M: LensModel<P>, const P: usize> Kernel for LanewiseWith<M, P> {
    type Output = Vec<[f64; LANES]>;

    fn run<L: Lanes>(self) -> Vec<[f64; LANES]> {
        let p = M::project(&M::constants(self.1.map(L::splat)), self.0.map(|v| L::load(&v)));
        let all =
            p.at.into_iter().chain(p.by_point.into_iter().flatten()).chain(p.by_lens.into_iter().flatten());
        all.map(Lanes::store).collect()
    }
}

impl LensVisitor for Lanewise {
    type Output = ();

    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) {
        let kernel = || LanewiseWith::<M, P>(self.0, coefficients, std::marker::PhantomData);
        let (wide, plain) = (dispatch(kernel()), run_portable(kernel()));
        assert_eq!(wide, plain);
        for lane in 0..LANES {
            let point = self.0.map(|v| v[lane]);
            let one = M::project(&M::constants(coefficients), point);
            let all = one
                .at
                .into_iter()
                .chain(one.by_point.into_iter().flatten())
                .chain(one.by_lens.into_iter().flatten());
            for (single, four) in all.zip(&wide) {
                assert_eq!(single.to_bits(), four[lane].to_bits());
            }
        }
    }
}

#[test]
fn four_points_at_once_have_the_bits_of_one() {
    let random = std::array::from_fn(|i| libm::sin(3.0 * i as f64 + 1.0));
    for model in Model::ALL {
        let lens = Lens::new(model, &coefficients(model, &random)).unwrap();
        visit(&lens, Lanewise([[0.1, -0.4, 0.0, 0.7], [0.3, 0.2, 0.0, -0.5], [1.0, 0.9, 1.2, 0.8]]));
    }
}
