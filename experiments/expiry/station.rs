//! How does the station err? Its camera, its surroundings, and what it measures with the calibration of day
//! one.

use calibench::camera::Camera;
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::synth::{Stream, StreamKey};

/// Three shifts a day.
pub(crate) const SHIFTS_A_DAY: usize = 3;
/// Temperature of the three shifts against the day's mean, K.
const SHIFT_KELVIN: [f64; SHIFTS_A_DAY] = [-2.0, 0.0, 2.0];
/// Temperature that no season explains, K.
const JITTER_KELVIN: f64 = 0.5;
/// Days of a year.
const YEAR_DAYS: f64 = 365.25;

/// A station that measures a length on a plane, and what makes it drift.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    /// The camera of day one; its lens is corrected perfectly, so it is a pinhole.
    pub camera: Camera,
    /// Distance of the plane, mm.
    pub distance_mm: f64,
    /// The reference: from the optical axis to this place on the plane, mm. That is its length.
    pub reference_mm: f64,
    /// Noise of a pixel coordinate, px, and frames that one check averages.
    pub sigma_px: f64,
    pub frames: usize,
    /// Relative change of the focal length, 1/K.
    pub focal_per_kelvin: f64,
    /// Warming from the day of calibration (spring) to a quarter later, K.
    pub season_kelvin: f64,
    /// Turn of the bracket about the image's vertical axis in one shift: mean and standard deviation, rad.
    pub creep_rad: f64,
    pub creep_sd_rad: f64,
}

impl Station {
    /// The chapter's camera at the chapter's distance, with causes in round numbers: an aluminium mount (30
    /// ppm/K), a summer 8 K warmer than the spring, and 5 urad of creep a shift. The bracket turns away from
    /// the reference's far end, the worse case: its share then adds to that of the warmth.
    pub(crate) fn case_study() -> Station {
        Station {
            camera: Camera::pinhole(600.0, 600.0, 326.0, 243.0),
            distance_mm: 120.0,
            reference_mm: 40.0,
            sigma_px: 0.1,
            frames: 25,
            focal_per_kelvin: 30e-6,
            season_kelvin: 8.0,
            creep_rad: 5e-6,
            creep_sd_rad: 20e-6,
        }
    }

    /// The same station with other causes.
    pub(crate) fn scaled(&self, season: f64, creep: f64) -> Station {
        Station { season_kelvin: season * self.season_kelvin, creep_rad: creep * self.creep_rad, ..*self }
    }

    /// Standard deviation of one check: two ends, each the mean of some frames, mm.
    pub(crate) fn check_sd_mm(&self) -> f64 {
        self.distance_mm / self.camera.fx * self.sigma_px * (2.0 / self.frames as f64).sqrt()
    }

    /// Systematic error of the reference's length when the camera is `kelvin` warmer and turned by
    /// `turn_rad`: the camera as it is takes the picture, the calibration of day one turns it into
    /// millimetres.
    pub(crate) fn error_mm(&self, kelvin: f64, turn_rad: f64) -> f64 {
        let stretch = 1.0 + self.focal_per_kelvin * kelvin;
        let now = Camera { fx: self.camera.fx * stretch, fy: self.camera.fy * stretch, ..self.camera };
        // The camera turns away from the reference's far end, which then lies farther out in its eyes.
        let turn =
            Pose { rotation: rotation::exp(&Vec3::new(0.0, turn_rad, 0.0)), translation: Vec3::zeros() };
        let see = |x_mm: f64| {
            let point = turn.apply(&Vec3::new(x_mm, 0.0, self.distance_mm));
            now.project(&point).expect("a plane 120 mm ahead stays ahead under turns of milliradians")
        };
        let millimetres = |pixel: Vec2| (pixel.x - self.camera.cx) / self.camera.fx * self.distance_mm;
        millimetres(see(self.reference_mm)) - millimetres(see(0.0)) - self.reference_mm
    }

    /// The same to first order, and a bound of what is left out.
    ///
    /// With `t = reference / distance`, warming stretches by `a` and a turn `w` takes `tan` of one end to
    /// `(t - w') / (1 + t w')`, `w' = tan w`: the error is `Z [(1 + a) ((t - w') / (1 + t w') + w') - t]`,
    /// that is `Z (a t - t^2 w)` and terms of second order. Expanding, those are
    /// `Z (t (1 + t^2) w^2 + |a| t^2 |w|)`; twice that covers the higher orders while `w < 0.01`.
    pub(crate) fn first_order_mm(&self, kelvin: f64, turn_rad: f64) -> (f64, f64) {
        let (z, t) = (self.distance_mm, self.reference_mm / self.distance_mm);
        let a = self.focal_per_kelvin * kelvin;
        // The far end moves outwards: the plane turns by minus w.
        let w = -turn_rad;
        let bound = 2.0 * z * (t * (1.0 + t * t) * w * w + (a * w).abs() * t * t);
        (z * (a * t - t * t * w), bound)
    }
}

/// What happens to a station, shift by shift.
pub(crate) struct History {
    pub kelvin: Vec<f64>,
    pub turn_rad: Vec<f64>,
    pub error_mm: Vec<f64>,
}

impl History {
    /// Draws the history of a trial.
    pub(crate) fn of(station: &Station, seed: u64, scenario: &str, trial: u64, shifts: usize) -> History {
        let stream = |purpose| Stream::open(StreamKey { seed, scenario, trial, purpose });
        let (mut weather, mut vibration) = (stream("temperature"), stream("vibration"));
        let kelvin: Vec<f64> = (0..shifts)
            .map(|shift| {
                let day = (shift / SHIFTS_A_DAY) as f64;
                let season = station.season_kelvin * libm::sin(std::f64::consts::TAU * day / YEAR_DAYS);
                season + SHIFT_KELVIN[shift % SHIFTS_A_DAY] + JITTER_KELVIN * weather.normal()
            })
            .collect();
        let mut turn = 0.0;
        let turn_rad: Vec<f64> = (0..shifts)
            .map(|_| {
                turn += station.creep_rad + station.creep_sd_rad * vibration.normal();
                turn
            })
            .collect();
        let error_mm = kelvin.iter().zip(&turn_rad).map(|(&k, &w)| station.error_mm(k, w)).collect();
        History { kelvin, turn_rad, error_mm }
    }

    /// The checks: error and noise, in standard deviations of one check.
    pub(crate) fn checks(&self, station: &Station, seed: u64, scenario: &str, trial: u64) -> Vec<f64> {
        let mut noise = Stream::open(StreamKey { seed, scenario, trial, purpose: "check" });
        let sd = station.check_sd_mm();
        self.error_mm.iter().map(|error| error / sd + noise.normal()).collect()
    }
}
