//! Where in the photograph was a whole row of the output seen? Four pixels at a time, with the bits of one at
//! a time.

use super::fraction::COARSE;
use super::points::source_within;
use crate::camera::Camera;
use crate::geometry::Vec2;
use crate::geometry::lanes::{Kernel, LANES, Lanes, dispatch};

/// Pixels of a row that are worked on while they are near.
pub const PIECE: usize = 256;

/// Sources of pixels of a row, in coarse fractions of a pixel (a power of two, so no bit is lost); NaN
/// without data.
#[derive(Debug, Clone, PartialEq)]
pub struct Sources {
    pub u: [f64; PIECE],
    pub v: [f64; PIECE],
}

impl Sources {
    /// No sources yet.
    pub const fn new() -> Sources {
        Sources { u: [f64::NAN; PIECE], v: [f64::NAN; PIECE] }
    }

    /// The source of a pixel of the piece, px.
    pub fn get(&self, place: usize) -> Vec2 {
        Vec2::new(self.u[place], self.v[place]) / f64::from(COARSE)
    }

    /// Changes the source of a pixel of the piece, px.
    pub fn set(&mut self, place: usize, source: Option<Vec2>) {
        let source = source.unwrap_or(Vec2::new(f64::NAN, f64::NAN)) * f64::from(COARSE);
        (self.u[place], self.v[place]) = (source.x, source.y);
    }
}

/// The sources of an output camera's rows.
pub struct SourceRows<'a> {
    camera: &'a Camera,
    output: &'a Camera,
    radius: f64,
    /// Normalised `x` of every column, and of a few more that fill the last block, in the row of `x_row`.
    x: Vec<f64>,
    x_row: Option<usize>,
}

impl<'a> SourceRows<'a> {
    /// Of an output that is `width` pixels wide.
    pub fn new(camera: &'a Camera, output: &'a Camera, width: usize) -> SourceRows<'a> {
        let x = vec![0.0; width.next_multiple_of(LANES)];
        SourceRows { camera, output, radius: camera.distortion.monotone_radius(), x, x_row: None }
    }

    /// The sources of `count` pixels, at most [`PIECE`], from `first` on, a multiple of [`LANES`], in row
    /// `y`. The rest of the piece is left as it is.
    pub fn fill(&mut self, y: usize, first: usize, count: usize, sources: &mut Sources) {
        if !self.output.distortion.is_ideal() {
            for place in 0..count {
                sources.set(place, self.source(first + place, y));
            }
            return;
        }
        // The same for every row, unless the axes are skew.
        if self.x_row.is_none() || (self.output.skew != 0.0 && self.x_row != Some(y)) {
            for (column, x) in self.x.iter_mut().enumerate() {
                *x = self.output.normalised_from_pixel(&Vec2::new(column as f64, y as f64)).x;
            }
            self.x_row = Some(y);
        }
        dispatch(Distort { rows: self, y, first, count, sources });
    }

    fn source(&self, x: usize, y: usize) -> Option<Vec2> {
        source_within(self.camera, self.output, self.radius, &Vec2::new(x as f64, y as f64))
    }
}

struct Distort<'a, 'b> {
    rows: &'a SourceRows<'b>,
    y: usize,
    first: usize,
    count: usize,
    sources: &'a mut Sources,
}

impl Kernel for Distort<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        if self.is_plain() { self.distort::<L, true>() } else { self.distort::<L, false>() }
    }
}

impl Distort<'_, '_> {
    /// Whether the lens has but k1 and k2, the axes are not skew, and the whole piece lies within the
    /// monotone radius.
    fn is_plain(&self) -> bool {
        let camera = self.rows.camera;
        let lens = &camera.distortion;
        // Farthest from the middle is an end: columns are in order, and so are the roundings of their
        // squares.
        let last = (self.first + self.count).next_multiple_of(LANES) - 1;
        let farthest = self.rows.x[self.first].abs().max(self.rows.x[last].abs());
        let y = self.rows.output.normalised_from_pixel(&Vec2::new(0.0, self.y as f64)).y;
        let is_unfolded = farthest * farthest + y * y < self.rows.radius * self.rows.radius;
        is_unfolded && [lens.p1, lens.p2, lens.k3, camera.skew].iter().all(|&x| x == 0.0)
    }

    /// The operations of `BrownConrady::distort`, `BrownConrady::jacobian` and
    /// `Camera::pixel_from_normalised`, in their order. Products with zero are left out if `PLAIN`: they add
    /// nothing.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "three slices of one length")]
    fn distort<L: Lanes, const PLAIN: bool>(self) {
        let Distort { rows, y: row, first, count, sources } = self;
        let lens = &rows.camera.distortion;
        let [k1, k2, k3, p1, p2] = [lens.k1, lens.k2, lens.k3, lens.p1, lens.p2].map(L::splat);
        let c = rows.camera;
        let [fx, fy, cx, cy, skew] =
            [c.fx, c.fy, c.cx, c.cy, c.skew].map(|x| L::splat(x * f64::from(COARSE)));
        let [one, two, three, six] = [1.0, 2.0, 3.0, 6.0].map(L::splat);
        let is_tangential = lens.p1 != 0.0 || lens.p2 != 0.0;
        let radius_sq = L::splat(rows.radius * rows.radius);
        let y = L::splat(rows.output.normalised_from_pixel(&Vec2::new(0.0, row as f64)).y);
        let yy = y * y;
        let blocks = count.div_ceil(LANES);
        let xs = &rows.x[first..].as_chunks::<LANES>().0[..blocks];
        let us = &mut sources.u.as_chunks_mut::<LANES>().0[..blocks];
        let vs = &mut sources.v.as_chunks_mut::<LANES>().0[..blocks];
        for block in 0..blocks {
            let x = L::load(&xs[block]);
            let s = x * x + yy;
            if PLAIN {
                let g = one + s * (k1 + s * k2);
                us[block] = (fx * (x * g) + cx).store();
                vs[block] = (fy * (y * g) + cy).store();
                continue;
            }
            let g = one + s * (k1 + s * (k2 + s * k3));
            let (mut x_d, mut y_d) = (x * g, y * g);
            let mut unfolded = (radius_sq - s).all_positive();
            if is_tangential {
                let twice_xy = two * x * y;
                x_d = x_d + p1 * twice_xy + p2 * (s + two * x * x);
                y_d = y_d + p1 * (s + two * y * y) + p2 * twice_xy;
                let twice_slope = two * (k1 + s * (two * k2 + s * three * k3));
                let off_diagonal = twice_slope * x * y + two * (p1 * x + p2 * y);
                let xx = g + twice_slope * x * x + two * p1 * y + six * p2 * x;
                let yy = g + twice_slope * y * y + six * p1 * y + two * p2 * x;
                unfolded = unfolded && (xx * yy - off_diagonal * off_diagonal).all_positive();
            }
            // Without tangential part the determinant is positive within the monotone radius.
            us[block] = (fx * x_d + skew * y_d + cx).store();
            vs[block] = (fy * y_d + cy).store();
            if !unfolded {
                for lane in 0..LANES {
                    let source = rows.source(first + block * LANES + lane, row);
                    let source = source.unwrap_or(Vec2::new(f64::NAN, f64::NAN)) * f64::from(COARSE);
                    (us[block][lane], vs[block][lane]) = (source.x, source.y);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;
    use crate::geometry::lanes::run_portable;

    fn bits(sources: &Sources, count: usize) -> Vec<[Option<u64>; 2]> {
        let number = |x: f64| (!x.is_nan()).then_some(x.to_bits());
        (0..count).map(|i| [number(sources.u[i]), number(sources.v[i])]).collect()
    }

    #[test]
    fn a_row_has_the_bits_of_its_pixels_on_any_registers() {
        let lenses = [
            BrownConrady::default(),
            BrownConrady::radial(-0.18, 0.05),
            // Folds inside the image, without and with a tangential part.
            BrownConrady::radial(-0.3, 0.0),
            BrownConrady { k1: -0.3, k2: 0.01, p1: 1e-3, p2: -2e-3, k3: 0.02 },
        ];
        let mut folded = 0;
        for lens in lenses {
            for skew in [0.0, 0.7] {
                let camera =
                    Camera { skew, ..Camera::pinhole(110.0, 108.0, 150.3, 60.7) }.with_distortion(lens);
                let output = Camera { skew: 0.5 * skew, ..Camera::pinhole(100.0, 101.0, 149.5, 61.0) };
                for output in [output, output.with_distortion(BrownConrady::radial(0.02, 0.0))] {
                    let width = 301;
                    let mut rows = SourceRows::new(&camera, &output, width);
                    for y in [0, 61, 119] {
                        for (first, count) in [(0, PIECE), (PIECE, width - PIECE)] {
                            let mut sources = Sources::new();
                            rows.fill(y, first, count, &mut sources);
                            let mut one_by_one = Sources::new();
                            for place in 0..count {
                                one_by_one.set(place, rows.source(first + place, y));
                            }
                            assert_eq!(bits(&sources, count), bits(&one_by_one, count), "{lens:?} {y}");
                            folded += (0..count).filter(|&i| sources.u[i].is_nan()).count();
                            if output.distortion.is_ideal() {
                                let mut portable = Sources::new();
                                run_portable(Distort {
                                    rows: &rows,
                                    y,
                                    first,
                                    count,
                                    sources: &mut portable,
                                });
                                assert_eq!(bits(&portable, count), bits(&sources, count));
                            }
                        }
                    }
                }
            }
        }
        assert!(folded > 1000, "{folded}");
    }
}
