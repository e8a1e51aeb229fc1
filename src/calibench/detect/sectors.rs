//! Where around a disc is its ground? A ring of sectors, of which those that something else lies in are left
//! out.
//!
//! A sheet that ends near a disc lies in a part of the directions only; at its corner, in more than half of
//! them. What neighbouring sectors show that are most alike is taken for the ground, and every sector that
//! agrees with it is added, as a region is grown from a seed.

use super::levels::{Plane, PlaneFit};
use super::mean::Mean;
use crate::geometry::Vec2;

/// Sectors of the ring: of fifteen degrees.
pub const SECTORS: usize = 24;

/// A mean belongs to the ground if it is within so many standard deviations of its noise and the plane's. Of
/// the two means of 24 sectors of a hundred discs one in three boards exceeds it, and costs a fiftieth of a
/// ring.
const NOISE_SDS: f64 = 4.0;

/// And a part of the contrast that does no harm: one sector that is so much off moves a disc with a sharp
/// edge by less than 0.001 px.
const HARMLESS: f64 = 0.003;

/// Rounds in which sectors are added; two or three add some.
const ROUNDS: usize = 8;

/// Fewest sectors that must agree: a third of the directions shows the ground's slope.
const FEWEST: usize = SECTORS / 3;

/// A pixel of the ring.
#[derive(Debug, Clone, Copy)]
pub struct RingPixel {
    /// Offset from the disc's centre.
    pub place: Vec2,
    /// Its level.
    pub level: f64,
    /// The direction that it lies in.
    pub sector: usize,
    /// Whether it is next to the disc's edge.
    pub is_near: bool,
}

/// The ground around a disc.
#[derive(Debug, Clone, Copy)]
pub struct Ground {
    /// What its pixels add up to.
    pub sums: PlaneFit,
    /// Whether the ground fills a sector.
    pub fills: [bool; SECTORS],
    /// Whether it fills what is next to the disc's edge.
    pub is_near: [bool; SECTORS],
}

/// The sector of an offset from the centre. What lies between two belongs to the same one of them however the
/// image is turned.
pub fn sector_of(offset: &Vec2) -> usize {
    let turn = libm::atan2(offset.y, offset.x) / std::f64::consts::TAU + 0.5;
    (turn * SECTORS as f64) as usize % SECTORS
}

/// The means of a sector, next to the disc's edge and farther out.
type Means = [Mean; 2];

/// The ground around a disc of this contrast; `None` where too few sectors agree on one.
pub fn ground(pixels: &[RingPixel], contrast: f64) -> Option<Ground> {
    let mut means = [Means::default(); SECTORS];
    for pixel in pixels {
        means[pixel.sector][usize::from(!pixel.is_near)].add_pixel(&pixel.place, pixel.level);
    }
    let agreed = Agreed::grown(&means, pixels, contrast)?;
    let fills = means.map(|means| agreed.with_all(&means));
    let is_beside = |s: usize| fills[(s + 1) % SECTORS] || fills[(s + SECTORS - 1) % SECTORS];
    let is_near: [bool; SECTORS] =
        std::array::from_fn(|s| fills[s] || (is_beside(s) && agreed.with(&means[s][0])));
    if is_near.iter().filter(|near| **near).count() < FEWEST {
        return None;
    }
    let mut sums = PlaneFit::default();
    for pixel in pixels.iter().filter(|p| fills[p.sector] || (p.is_near && is_near[p.sector])) {
        sums.add_pixel(&pixel.place, pixel.level);
    }
    Some(Ground { sums, fills, is_near })
}

/// What some sectors agree on.
struct Agreed {
    sums: PlaneFit,
    plane: Plane,
    /// Standard deviation of a pixel about the plane.
    noise: f64,
    /// Difference that does no harm.
    harmless: f64,
}

impl Agreed {
    /// Of the neighbouring sectors that are most alike, and of every sector that agrees with them, until none
    /// is added.
    fn grown(means: &[Means; SECTORS], pixels: &[RingPixel], contrast: f64) -> Option<Agreed> {
        let of = |chosen: &[bool; SECTORS]| Agreed::of(means, pixels, chosen, contrast);
        let window = |first: usize| -> [bool; SECTORS] {
            std::array::from_fn(|sector| (sector + SECTORS - first) % SECTORS < FEWEST)
        };
        let is_there = |sector: usize| means[sector].iter().any(|mean| mean.count > 0.0);
        let is_whole = |chosen: &[bool; SECTORS]| (0..SECTORS).all(|s| !chosen[s] || is_there(s));
        let windows = (0..SECTORS).map(window).filter(is_whole);
        let mut chosen = windows.min_by(|a, b| roughness(means, a).total_cmp(&roughness(means, b)))?;
        let mut agreed = of(&chosen)?;
        for _ in 0..ROUNDS {
            let now = means.map(|means| agreed.with_all(&means));
            if now == chosen || now.iter().filter(|chosen| **chosen).count() < FEWEST {
                break;
            }
            chosen = now;
            agreed = of(&chosen)?;
        }
        Some(agreed)
    }

    /// Of some sectors. The noise is that of the pixels, or what the means show if that is more: what is the
    /// same for pixels beside each other, as the codec of a file makes it, is in these.
    fn of(
        means: &[Means; SECTORS],
        pixels: &[RingPixel],
        chosen: &[bool; SECTORS],
        contrast: f64,
    ) -> Option<Agreed> {
        let sums = sums_of(means, chosen);
        let plane = sums.solve()?;
        let among = || pixels.iter().filter(|pixel| chosen[pixel.sector]);
        let square: f64 = among().map(|p| p.level - plane.at(&p.place)).map(|e| e * e).sum();
        let of_pixels = square / (among().count() as f64 - 3.0);
        let noise = of_pixels.max(roughness(means, chosen)).sqrt();
        Some(Agreed { sums, plane, noise, harmless: HARMLESS * contrast })
    }

    /// Whether a mean agrees, within its noise and that of the plane there.
    fn with(&self, mean: &Mean) -> bool {
        if mean.count == 0.0 {
            return false;
        }
        let variance = self.sums.variance_at(&mean.place()).unwrap_or(0.0);
        let sd = self.noise * (variance + 1.0 / mean.count).sqrt();
        mean.beside(&self.plane).abs() <= (NOISE_SDS * sd).max(self.harmless)
    }

    /// Whether all of a sector agrees.
    fn with_all(&self, means: &Means) -> bool {
        let there = || means.iter().filter(|mean| mean.count > 0.0);
        there().count() > 0 && there().all(|mean| self.with(mean))
    }
}

/// The means of some sectors that have pixels.
fn some<'a>(means: &'a [Means; SECTORS], chosen: &'a [bool; SECTORS]) -> impl Iterator<Item = &'a Mean> {
    let of = means.iter().zip(chosen).filter(|(_, chosen)| **chosen).flat_map(|(means, _)| means);
    of.filter(|mean| mean.count > 0.0)
}

fn sums_of(means: &[Means; SECTORS], chosen: &[bool; SECTORS]) -> PlaneFit {
    let mut sums = PlaneFit::default();
    some(means, chosen).for_each(|mean| sums.add_weighted(&mean.place(), mean.level(), mean.count));
    sums
}

/// Variance of a pixel that the means of some sectors show about a plane of their own.
fn roughness(means: &[Means; SECTORS], chosen: &[bool; SECTORS]) -> f64 {
    let Some(plane) = sums_of(means, chosen).solve() else { return f64::INFINITY };
    let square = |mean: &Mean| mean.count * mean.beside(&plane) * mean.beside(&plane);
    let freedom = some(means, chosen).count() as f64 - 3.0;
    some(means, chosen).map(square).sum::<f64>() / freedom
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring about (0, 0) from 12 to 18 px whose level at a place is given.
    fn ring(level: impl Fn(&Vec2) -> f64) -> Vec<RingPixel> {
        let places = (-18..=18).flat_map(|y| (-18..=18).map(move |x| Vec2::new(f64::from(x), f64::from(y))));
        places
            .filter(|p| (12.0..18.0).contains(&p.norm()))
            .map(|place| RingPixel {
                place,
                level: level(&place),
                sector: sector_of(&place),
                is_near: place.norm() < 13.5,
            })
            .collect()
    }

    /// Light that falls off, with a pattern that stands for noise.
    fn lit(p: &Vec2) -> f64 {
        0.8 + 0.004 * p.x - 0.002 * p.y + 0.002 * libm::sin(37.0 * p.x + 91.0 * p.y)
    }

    fn deviation(ground: &Ground) -> f64 {
        let plane = ground.sums.solve().unwrap();
        let at = [Vec2::new(10.0, 0.0), Vec2::new(-10.0, 0.0), Vec2::new(0.0, 10.0), Vec2::new(0.0, -10.0)];
        at.iter().map(|p| (plane.at(p) - (0.8 + 0.004 * p.x - 0.002 * p.y)).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn uneven_light_is_ground_all_around() {
        let ground = ground(&ring(lit), 0.7).unwrap();
        assert_eq!(ground.fills, [true; SECTORS]);
        assert!(deviation(&ground) < 5e-4);
    }

    #[test]
    fn a_sheet_that_ends_on_one_side_or_two_leaves_its_ground() {
        for level in [0.5, 0.1, 1.0] {
            let side = ring(|p| if p.x > 14.0 { level } else { lit(p) });
            let corner = ring(|p| if p.x > 14.0 || p.y > 13.0 { level } else { lit(p) });
            for (pixels, least) in [(side, 14), (corner, 8)] {
                let ground = ground(&pixels, 0.7).unwrap();
                let count = ground.fills.iter().filter(|fills| **fills).count();
                assert!((least..SECTORS).contains(&count), "{level}: {count}");
                assert!(!ground.fills[sector_of(&Vec2::new(16.0, 1.0))]);
                // The slope is known by half of the ring only.
                assert!(deviation(&ground) < 3e-3, "{level}: {}", deviation(&ground));
            }
        }
    }

    #[test]
    fn sectors_turn_with_the_image() {
        for (x, y) in [(3.0, 0.0), (3.0, 3.0), (0.0, 3.0), (5.0, 2.0), (-4.0, 0.0), (-2.0, -2.0), (-1.5, 7.0)]
        {
            let sector = sector_of(&Vec2::new(x, y));
            assert_eq!(sector_of(&Vec2::new(-x, -y)), (sector + SECTORS / 2) % SECTORS, "{x}, {y}");
            assert_eq!(sector_of(&Vec2::new(-y, x)), (sector + SECTORS / 4) % SECTORS, "{x}, {y}");
        }
    }

    #[test]
    fn no_pixels_are_no_ground() {
        assert!(ground(&[], 0.6).is_none());
    }

    #[test]
    fn stripes_are_noise_and_their_mean_is_the_ground() {
        let striped = ring(|p| if ((p.x + 40.0) as usize / 4).is_multiple_of(2) { 0.2 } else { 0.8 });
        let ground = ground(&striped, 0.6).unwrap();
        assert_eq!(ground.fills, [true; SECTORS]);
    }
}
