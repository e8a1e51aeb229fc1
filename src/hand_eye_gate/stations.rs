//! Where is the robot? Stations drawn with a stated spread of axes and angles.

use calibench::downstream::SetUp;
use calibench::geometry::{Pose, Vec3, rotation};
use calibench::synth::Stream;
use std::f64::consts::PI;

/// How the camera is turned at the stations, against facing the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turns {
    /// About axes drawn evenly within a cone about the x axis, by angles drawn evenly up to the largest, both
    /// ways.
    Drawn {
        /// Half the opening of the cone, degrees; 90 is any axis.
        cone_deg: f64,
        /// Largest angle, degrees.
        largest_deg: f64,
    },
    /// About axes drawn evenly in space, by the largest angle.
    Largest {
        /// The angle, degrees.
        largest_deg: f64,
    },
    /// By the largest angle both ways about x, y and z in turn.
    ThreeAxes {
        /// The angle, degrees.
        largest_deg: f64,
    },
    /// By the largest angle about axes spread evenly in the plane of the target: tilts, and no turn about the
    /// view.
    Tilts {
        /// The angle, degrees.
        largest_deg: f64,
    },
}

impl Turns {
    /// Rotation vectors of the stations, rad.
    pub fn draw(self, stations: usize, stream: &mut Stream) -> Vec<Vec3> {
        (0..stations).map(|i| self.one(i, stations, stream)).collect()
    }

    fn one(self, i: usize, stations: usize, stream: &mut Stream) -> Vec3 {
        let sign = |is_negative: bool| if is_negative { -1.0 } else { 1.0 };
        match self {
            Turns::Drawn { cone_deg, largest_deg } => {
                let axis = axis_in_cone(cone_deg.to_radians(), stream);
                axis * stream.uniform_in(-largest_deg, largest_deg).to_radians()
            }
            Turns::Largest { largest_deg } => {
                let angle = sign(stream.uniform() < 0.5) * largest_deg.to_radians();
                axis_in_cone(0.5 * PI, stream) * angle
            }
            Turns::ThreeAxes { largest_deg } => {
                let mut axis = Vec3::zeros();
                axis[i / 2 % 3] = sign(i % 2 == 1) * largest_deg.to_radians();
                axis
            }
            Turns::Tilts { largest_deg } => {
                let (sin, cos) = libm::sincos(2.0 * PI * i as f64 / stations as f64);
                Vec3::new(cos, sin, 0.0) * largest_deg.to_radians()
            }
        }
    }
}

/// A direction drawn evenly on the part of the sphere within `half_angle` of x.
fn axis_in_cone(half_angle: f64, stream: &mut Stream) -> Vec3 {
    let x = 1.0 - stream.uniform() * (1.0 - libm::cos(half_angle));
    let (sin, cos) = libm::sincos(2.0 * PI * stream.uniform());
    let across = (1.0 - x * x).max(0.0).sqrt();
    Vec3::new(x, across * cos, across * sin)
}

/// Distance of the target, mm: a target of 80 by 60 mm is seen whole by a camera of 640 by 480 px and a focal
/// length of 600 px, however it is turned.
pub const DISTANCE_MM: (f64, f64) = (210.0, 250.0);
/// How far the target's middle lies off the optical axis, mm.
const ASIDE_MM: f64 = 8.0;

/// cam_from_target of a station: the target turned about its middle, somewhere before the camera.
pub fn seen(turn: &Vec3, stream: &mut Stream) -> Pose {
    let mut aside = || stream.uniform_in(-ASIDE_MM, ASIDE_MM);
    let (x, y) = (aside(), aside());
    let z = stream.uniform_in(DISTANCE_MM.0, DISTANCE_MM.1);
    Pose { rotation: rotation::exp(turn), translation: Vec3::new(x, y, z) }
}

/// base_from_gripper where the camera sees the target so, from `G X C = Y`.
pub fn robot_at(set_up: SetUp, x: &Pose, y: &Pose, cam_from_target: &Pose) -> Pose {
    let g = y.compose(&cam_from_target.inverse()).compose(&x.inverse());
    match set_up {
        SetUp::EyeInHand => g,
        SetUp::EyeToHand => g.inverse(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::synth::StreamKey;

    fn stream() -> Stream {
        Stream::open(StreamKey { seed: 3, scenario: "stations", trial: 0, purpose: "test" })
    }

    #[test]
    fn axes_stay_within_their_cone_and_angles_below_the_largest() {
        let turns = Turns::Drawn { cone_deg: 15.0, largest_deg: 20.0 }.draw(500, &mut stream());
        let of_axis = |w: &Vec3| libm::acos((w.x / w.norm()).abs()).to_degrees();
        let widest = turns.iter().map(of_axis).fold(0.0, f64::max);
        let largest = turns.iter().map(|w| w.norm().to_degrees()).fold(0.0, f64::max);
        // 500 draws come within a hundredth of both ends.
        assert!((14.5..15.0).contains(&widest), "{widest}");
        assert!((19.8..20.0).contains(&largest), "{largest}");
    }

    #[test]
    fn the_robot_stands_where_the_loop_closes() {
        let mut stream = stream();
        let mut pose = || seen(&Vec3::new(stream.normal(), stream.normal(), stream.normal()), &mut stream);
        let (x, y, c) = (pose(), pose(), pose());
        for set_up in [SetUp::EyeInHand, SetUp::EyeToHand] {
            let robot = robot_at(set_up, &x, &y, &c);
            let g = if set_up == SetUp::EyeInHand { robot } else { robot.inverse() };
            assert!(g.compose(&x).compose(&c).step_to(&y).norm() < 1e-12);
        }
    }
}
