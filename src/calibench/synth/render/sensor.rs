//! How does light become numbers? Uneven illumination, and the noise of photons and of reading out.

use crate::raster::Raster;
use crate::synth::Stream;

/// A smooth gain over the image: `1 + slope_x x + slope_y y + falloff (x^2 + y^2)`, with `x, y` running from
/// -1 to 1 over the longer side of the image and 0 at its centre.
///
/// The gain is a property of the pixel, taken at its centre: over one pixel it changes by about `2 slope /
/// width`, which an illumination across the board would do too.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shading {
    /// Change of the gain from the centre to the right edge.
    pub slope_x: f64,
    /// Change of the gain towards the bottom edge, per half width.
    pub slope_y: f64,
    /// Vignetting: negative darkens the corners.
    pub falloff: f64,
}

impl Shading {
    /// The gain of a pixel.
    pub fn gain(&self, column: usize, row: usize, (width, height): (usize, usize)) -> f64 {
        let half = 0.5 * width.max(height) as f64;
        let x = (column as f64 - 0.5 * (width as f64 - 1.0)) / half;
        let y = (row as f64 - 0.5 * (height as f64 - 1.0)) / half;
        1.0 + self.slope_x * x + self.slope_y * y + self.falloff * (x * x + y * y)
    }

    /// A coefficient that is not a finite number.
    pub(super) fn first_bad(&self) -> Option<f64> {
        [self.slope_x, self.slope_y, self.falloff].into_iter().find(|c| !c.is_finite())
    }
}

/// The linear sensor model of EMVA 1288: a sample of intensity `L` has variance `L / full_well + (read /
/// full_well)^2`.
///
/// Photon noise is drawn from the normal distribution of equal variance; at 100 electrons its skewness is
/// 0.1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorNoise {
    /// Electrons at intensity 1; infinite for no photon noise. Positive.
    pub full_well_e: f64,
    /// Standard deviation of the read-out, as intensity. Not negative.
    pub read_sigma: f64,
}

impl SensorNoise {
    /// The same standard deviation at every pixel, as intensity.
    pub fn constant(sigma: f64) -> SensorNoise {
        SensorNoise { full_well_e: f64::INFINITY, read_sigma: sigma }
    }

    /// Standard deviation of a sample of the given intensity.
    pub fn sigma(&self, intensity: f64) -> f64 {
        (intensity.max(0.0) / self.full_well_e + self.read_sigma * self.read_sigma).sqrt()
    }

    /// Adds the noise, one normal draw a pixel, row by row.
    pub fn add_to(&self, image: &mut Raster<f32>, stream: &mut Stream) {
        for y in 0..image.height() {
            for sample in image.row_mut(y) {
                let intensity = f64::from(*sample);
                *sample = (intensity + self.sigma(intensity) * stream.normal()) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::StreamKey;

    #[test]
    fn noise_has_the_variance_of_the_sensor_model() {
        let noise = SensorNoise { full_well_e: 10_000.0, read_sigma: 0.002 };
        let mut image = Raster::filled(1000, 1000, 0.5f32);
        let key = StreamKey { seed: 1, scenario: "sensor", trial: 0, purpose: "noise" };
        noise.add_to(&mut image, &mut Stream::open(key));
        let n = 1e6;
        let mean = image.samples().iter().map(|&x| f64::from(x)).sum::<f64>() / n;
        let variance =
            image.samples().iter().map(|&x| (f64::from(x) - mean) * (f64::from(x) - mean)).sum::<f64>() / n;
        let expected = 0.5 / 10_000.0 + 0.002 * 0.002;
        // Five standard errors of mean and variance: a right model misses one of them with probability 1e-6.
        assert!((mean - 0.5).abs() < 5.0 * (expected / n).sqrt());
        assert!((variance / expected - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
    }

    #[test]
    fn shading_is_one_at_the_centre_and_falls_to_the_corners() {
        let shading = Shading { slope_x: 0.2, slope_y: 0.0, falloff: -0.3 };
        assert_eq!(shading.gain(320, 240, (641, 481)), 1.0);
        assert!(shading.gain(0, 0, (641, 481)) < 0.6);
        assert_eq!(Shading::default().gain(3, 4, (641, 481)), 1.0);
    }
}
