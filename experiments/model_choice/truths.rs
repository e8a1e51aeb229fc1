//! Which lenses are the truth? One of each kind that people have, and which of the candidates could be it.

use calibench::calibrate::Candidate;
use calibench::camera::{Camera, Lens, Model, Parameter};

/// A true camera.
#[derive(Debug)]
pub struct Truth {
    /// Name in files and streams.
    pub name: &'static str,
    /// What it is, for a table.
    pub about: &'static str,
    /// Width and height of its image, px.
    pub size: (usize, usize),
    /// fx, fy, cx, cy, px.
    linear: [f64; 4],
    model: Model,
    coefficients: &'static [f64],
    /// Whether candidates that cannot follow it search long: it gets fewer trials.
    pub is_slow: bool,
}

/// All truths.
pub const TRUTHS: [Truth; 10] = [
    Truth {
        name: "two-radial",
        about: "Brown-Conrady with k1 and k2 alone",
        size: (1280, 960),
        linear: [1000.0, 1002.0, 645.0, 474.0],
        model: Model::BrownConrady,
        coefficients: &[-0.18, 0.05, 0.0, 0.0, 0.0],
        is_slow: false,
    },
    Truth {
        name: "tangential",
        about: "that lens with p1 and p2 besides",
        size: (1280, 960),
        linear: [1000.0, 1002.0, 645.0, 474.0],
        model: Model::BrownConrady,
        coefficients: &[-0.18, 0.05, 1e-3, -8e-4, 0.0],
        is_slow: false,
    },
    Truth {
        name: "three-radial",
        about: "Brown-Conrady with k1, k2 and a strong k3",
        size: (1280, 960),
        linear: [800.0, 801.0, 637.0, 485.0],
        model: Model::BrownConrady,
        coefficients: &[-0.30, 0.14, 0.0, 0.0, -0.03],
        is_slow: false,
    },
    // The depth camera of an Azure Kinect, as its maker calibrated one (issue 1488 of the
    // Azure-Kinect-Sensor-SDK), rounded.
    Truth {
        name: "rational",
        about: "rational: a wide depth camera as its maker calibrated it",
        size: (1024, 1024),
        linear: [503.8, 503.7, 513.5, 509.0],
        model: Model::Rational,
        coefficients: &[4.725, 3.209, 5.9e-6, 1.238e-4, 0.1706, 5.056, 4.776, 0.8865],
        is_slow: true,
    },
    // As calibrations of Intel's T265 print it.
    Truth {
        name: "kannala-brandt",
        about: "Kannala-Brandt: the fisheye of a tracking camera",
        size: (848, 800),
        linear: [286.0, 286.1, 416.0, 403.0],
        model: Model::KannalaBrandt,
        coefficients: &[-0.0059, 0.0408, -0.0386, 0.0071],
        is_slow: true,
    },
    // Close to the lens of Usenko, Demmel & Cremers (2018), table 2.
    Truth {
        name: "double-sphere",
        about: "double sphere: a fisheye",
        size: (1024, 1024),
        linear: [313.0, 313.2, 514.0, 507.0],
        model: Model::DoubleSphere,
        coefficients: &[-0.18, 0.59],
        is_slow: true,
    },
    Truth {
        name: "division",
        about: "division",
        size: (1280, 960),
        linear: [800.0, 801.0, 645.0, 474.0],
        model: Model::Division,
        coefficients: &[-0.2],
        is_slow: false,
    },
    Truth {
        name: "tilted-sensor",
        about: "the first lens before a sensor tilted by 3 and 2 degrees: no candidate has it",
        size: (1280, 960),
        linear: [1000.0, 1002.0, 645.0, 474.0],
        model: Model::Tilted,
        coefficients: &[-0.18, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0524, 0.0349],
        is_slow: true,
    },
    Truth {
        name: "thin-prism",
        about: "the first lens with s1 to s4: no candidate has them",
        size: (1280, 960),
        linear: [1000.0, 1002.0, 645.0, 474.0],
        model: Model::ThinPrism,
        coefficients: &[-0.18, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.004, -0.002, -0.003, 0.001],
        is_slow: false,
    },
    // A barrel like the second lens, as HALCON would describe it.
    Truth {
        name: "halcon-polynomial",
        about: "HALCON's polynomial with k1, k2, p1 and p2: no candidate has it",
        size: (1280, 960),
        linear: [1000.0, 1002.0, 645.0, 474.0],
        model: Model::HalconPolynomial,
        coefficients: &[0.2, 0.03, 8e-4, -6e-4, 0.0],
        is_slow: false,
    },
];

/// Names of [`Candidate::usual`], in its order.
pub const CANDIDATES: [&str; 8] = [
    "k1-k2",
    "k1-k2-k3",
    "k1-k2-p1-p2",
    "k1-k2-p1-p2-k3",
    "rational",
    "kannala-brandt",
    "double-sphere",
    "division",
];

impl Truth {
    /// The camera.
    pub fn camera(&self) -> Camera<Lens> {
        let [fx, fy, cx, cy] = self.linear;
        let lens = Lens::new(self.model, self.coefficients).expect("a truth has its model's coefficients");
        Camera::with_lens(fx, fy, cx, cy, lens)
    }

    /// Whether a candidate, with coefficients of its own, can be this lens exactly: of the same model, or
    /// rational where the lens is Brown-Conrady's, with all that is not zero here among its coefficients.
    pub fn is_within(&self, candidate: &Candidate) -> bool {
        let lens = self.camera().distortion;
        let same_family = candidate.model == self.model
            || (candidate.model, self.model) == (Model::Rational, Model::BrownConrady);
        let used = |p: &&Parameter| lens.get(**p).is_some_and(|value| value != 0.0);
        same_family
            && self.model.coefficients().iter().filter(used).all(|&p| candidate.coefficients.contains(p))
    }

    /// The candidate that can be this lens with the fewest coefficients; `None` where none can.
    pub fn right(&self) -> Option<usize> {
        let all = Candidate::usual();
        let within = (0..all.len()).filter(|&i| self.is_within(&all[i]));
        within.min_by_key(|&i| all[i].coefficients.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::evaluate::difference::frame_nodes;

    #[test]
    fn every_truth_has_its_right_candidate_and_those_that_contain_it() {
        let all = Candidate::usual();
        let right: Vec<Option<&str>> = TRUTHS.iter().map(|t| t.right().map(|i| CANDIDATES[i])).collect();
        let expected = [
            Some("k1-k2"),
            Some("k1-k2-p1-p2"),
            Some("k1-k2-k3"),
            Some("rational"),
            Some("kannala-brandt"),
            Some("double-sphere"),
            Some("division"),
            None,
            None,
            None,
        ];
        assert_eq!(right, expected);
        let contain = |truth: &Truth| all.iter().filter(|c| truth.is_within(c)).count();
        assert_eq!(TRUTHS.each_ref().map(contain), [5, 3, 3, 1, 1, 1, 1, 0, 0, 0]);
    }

    #[test]
    fn the_names_are_those_of_the_candidates() {
        for (candidate, name) in Candidate::usual().iter().zip(CANDIDATES) {
            let coefficients: Vec<&str> = candidate.coefficients.iter().map(|p| p.name()).collect();
            let of_brown = candidate.model == Model::BrownConrady;
            let expected = if of_brown { coefficients.join("-") } else { candidate.model.name().to_string() };
            assert_eq!(name, expected);
        }
    }

    #[test]
    fn every_truth_shows_its_frame() {
        for truth in &TRUTHS {
            let nodes = frame_nodes(truth.size).0;
            let seen = nodes.iter().filter(|node| truth.camera().ray(node).is_ok()).count();
            assert!(seen == nodes.len(), "{}: {seen} of {}", truth.name, nodes.len());
        }
    }
}
