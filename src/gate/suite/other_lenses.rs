//! Which scenes have another lens than Brown-Conrady's? One a model, and a fisheye that sees behind itself.
//!
//! Where the data would not tell all coefficients of a model apart, some are held at the truth.

use super::{Draft, example_draft, ring};
use calibench::camera::{Camera, FreeParameters, Lens, Model, Parameter};

/// k1, k2, p1, p2, k3, k4, k5, k6: a lens that sees to 74 degrees from its axis, whose denominator is no part
/// of its numerator.
const RATIONAL: [f64; 8] = [0.2, 0.3, 0.0006, -0.0009, 0.02, 0.5, 0.4, 0.1];
/// A polynomial of the same kind whose denominator is 1 and held.
const POLYNOMIAL: [f64; 8] = [-0.2, 0.05, 0.0006, -0.0009, -0.004, 0.0, 0.0, 0.0];
/// k1, k2, p1, p2, k3 of HALCON's polynomial: a barrel.
const HALCON_POLYNOMIAL: [f64; 5] = [0.2, 0.03, 0.0006, -0.0009, 0.004];
/// s1, s2, s3, s4.
const PRISMS: [f64; 4] = [0.001, -0.0004, -0.0012, 0.0003];
/// tau_x, tau_y, rad.
const TILT: [f64; 2] = [0.03, -0.02];

/// The scenes, in the order of [`Model::ALL`].
pub(super) fn drafts() -> Vec<Draft> {
    use Parameter::{Cx, Cy, Fx, Fy, K1, K2, K3, P1, P2, S1, S2, S3, S4, TauX, TauY};
    let prisms = [&POLYNOMIAL[..], &PRISMS].concat();
    let tilted = [&[-0.2, 0.05, 0.0, 0.0, -0.004, 0.0, 0.0, 0.0], &[0.0; 4][..], &TILT].concat();
    vec![
        Draft {
            poses: ring(8, 30.0, 12.0, 42.0),
            ..draft("rational", "a wide lens with a denominator", 250.0, Model::Rational, &RATIONAL)
        },
        Draft {
            poses: ring(8, 30.0, 12.0, 95.0),
            free: FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2, P1, P2, K3, S1, S2, S3, S4]),
            ..draft("thin-prism", "thin prisms before a lens", 450.0, Model::ThinPrism, &prisms)
        },
        Draft {
            poses: ring(8, 30.0, 12.0, 95.0),
            free: FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2, K3, TauX, TauY]),
            ..draft("tilted", "a sensor tilted by two degrees", 450.0, Model::Tilted, &tilted)
        },
        Draft {
            poses: ring(8, 35.0, 20.0, 45.0),
            ..draft(
                "fisheye",
                "a fisheye that sees to 75 degrees from its axis",
                230.0,
                Model::KannalaBrandt,
                &[0.02, -0.01, 0.004, -0.0015],
            )
        },
        Draft {
            poses: round_about(),
            ..draft(
                "behind-itself",
                "a fisheye with points up to 105 degrees from its axis",
                140.0,
                Model::KannalaBrandt,
                &[0.01, -0.006, 0.002, -0.0003],
            )
        },
        Draft {
            poses: ring(8, 30.0, 12.0, 62.0),
            ..draft("division", "a lens with one coefficient", 290.0, Model::Division, &[-0.25])
        },
        Draft {
            poses: ring(8, 35.0, 20.0, 45.0),
            ..draft("double-sphere", "a fisheye of two spheres", 150.0, Model::DoubleSphere, &[-0.2, 0.55])
        },
        Draft {
            poses: ring(8, 30.0, 12.0, 95.0),
            ..draft(
                "halcon-polynomial",
                "a lens by HALCON's polynomial",
                450.0,
                Model::HalconPolynomial,
                &HALCON_POLYNOMIAL,
            )
        },
    ]
}

fn draft(id: &'static str, about: &'static str, focal: f64, model: Model, coefficients: &[f64]) -> Draft {
    let lens = Lens::new(model, coefficients).expect("as many coefficients as the model has");
    Draft {
        camera: Camera::with_lens(focal, 1.002 * focal, 326.0, 243.0, lens),
        free: model.standard_free(),
        ..example_draft(id, about)
    }
}

/// Targets all round the camera and six ahead: the outer ones reach behind its plane.
fn round_about() -> Vec<[f64; 6]> {
    let aside = |sign: f64| [0.0, 70.0 * sign, 8.0 * sign, 62.0 * sign, 4.0, 24.0];
    let above = |sign: f64| [-70.0 * sign, 0.0, -6.0 * sign, 5.0, 60.0 * sign, 24.0];
    let mut poses = ring(6, 35.0, 25.0, 40.0);
    poses.extend([aside(1.0), aside(-1.0), above(1.0), above(-1.0)]);
    poses
}

#[cfg(test)]
mod tests {
    use calibench::geometry::Vec3;

    #[test]
    fn a_fisheye_that_sees_behind_itself_has_targets_on_all_sides_and_six_ahead() {
        let suite = crate::suite::suite().unwrap();
        let scene = &suite.iter().find(|scene| scene.id == "behind-itself").unwrap().setup.scene;
        let (ahead, around) = scene.truth.cam_from_target.split_at(6);
        let seen_from = |pose: &calibench::geometry::Pose| -> Vec<f64> {
            let point = |p: &calibench::geometry::Vec2| pose.apply(&Vec3::new(p.x, p.y, 0.0));
            let angle = |p: Vec3| libm::atan2(libm::hypot(p.x, p.y), p.z).to_degrees();
            scene.truth.points.iter().map(|p| angle(point(p))).collect()
        };
        assert!(ahead.iter().flat_map(seen_from).all(|degrees| degrees < 90.0));
        assert!(around.iter().all(|pose| seen_from(pose).iter().any(|degrees| *degrees > 90.0)));
        // On the right, on the left, below, above: each to its side first of all.
        let sides = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
        for (pose, (axis, sign)) in around.iter().zip(sides) {
            let [along, across] = [axis, 1 - axis].map(|axis| pose.translation[axis]);
            assert!(sign * along > 2.0 * across.abs(), "{:?}", pose.translation);
        }
    }
}
