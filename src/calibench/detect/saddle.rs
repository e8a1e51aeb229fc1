//! Which crossing of two edges explains the pixels around a chessboard corner best?
//!
//! Model: `I(p) = m + g . (p - q) + a f1(d1) f2(d2)`, with `d = n . (p - q) - k (t . (p - q))^2 / 2` the
//! distance from an edge of direction `t`, normal `n` and curvature `k`, and `f = 1 - 2 S` running from -1 to
//! 1 across it, `S` the edge as a square pixel sees it ([`Edge`]). Gauss-Newton on the corner `q`, the two
//! directions and widths, `m`, `a` and the slope `g` of uneven light. Both widths are free, for a moving
//! camera blurs one edge more than the other. The curvatures are given: the neighbouring corners show them
//! far better than a window's pixels. A pixel on neither edge adds nothing to `q`, so pixels farther away are
//! left out, and unlike gradients between pixels the model has no error of its own that depends on where the
//! corner lies on the pixel grid.
//!
//! Blur of any symmetric shape leaves the image of two crossing lines symmetric under half a turn about `q`,
//! and so is the model: a wrong shape of the edge costs precision, but does not move the corner.

use super::edge::{Edge, LaneEdge, SHARPEST_EDGE_PX};
use crate::geometry::Vec2;
use crate::geometry::lanes::{Arithmetic, Kernel, LANES, Lanes, Portable, dispatch};
use crate::raster::{Level, Raster};
use nalgebra::{Matrix2, SMatrix, SVector};

/// Corner (2), directions (2), edge widths (2), mean, amplitude, slope (2).
const PARAMETERS: usize = 10;

/// Gauss-Newton steps; from half a pixel away five suffice.
const MAX_STEPS: usize = 16;

/// Steps in which the edges' widths are estimated too. Then they are held: sharp and soft edges have
/// different models, and an edge between the two would swing from one to the other for ever.
const WIDTH_STEPS: usize = 5;

/// Steps below this are at rest: a tenth of the accuracy of a good image, and the next would be ten times
/// smaller.
const REST_PX: f64 = 5e-4;

/// Largest last step where the corner never rests: an edge along a row of a sharp image steps to and fro
/// between models, by as much as this is no harm.
const LAST_PX: f64 = 0.01;

/// Pixels on either side of an edge's reach that show the level of the squares.
const PLATEAU_PX: f64 = 1.5;

/// How much wider than at the start an edge may prove without more pixels being taken.
const WIDER: f64 = 1.5;

/// How often the edges may prove wider still: by a factor of 1.5 to 32 each time.
const MAX_BANDS: usize = 4;

/// Two crossing edges and the levels of their squares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    pub corner: Vec2,
    /// Directions of the edges; of a positive amplitude it is dark from the first to the second, turning as
    /// from u to v.
    pub angles_rad: [f64; 2],
    /// Half-widths of the edges, px ([`Edge::new`]).
    pub edges_px: [f64; 2],
    pub mean: f64,
    pub amplitude: f64,
    pub slope: Vec2,
}

/// The pixels that a crossing is fitted to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Window {
    /// A disc of this radius, px.
    Disc(usize),
    /// A parallelogram about squares.
    Along {
        /// Half its sides, along the first edge and along the second, px.
        sides: [Vec2; 2],
        /// How far from the second edge and from the first the squares are plain, in sides; `None`: all over.
        plain: Option<[f64; 2]>,
    },
}

/// What is left of a plain strip for the fit, however far the blur of what follows reaches into it.
const LEAST_OF_PLAIN: f64 = 0.5;

impl Window {
    /// Whether a pixel shows nothing but the crossing: what lies in the squares' middle, and its blur, is
    /// left out in all four alike, so that the window stays symmetric under half a turn.
    fn is_plain(&self, offset: &Vec2, edges_px: [f64; 2]) -> bool {
        let Window::Along { sides: [first, second], plain: Some(plain) } = self else { return true };
        let area = first.perp(second);
        let reach_px = Edge::new(edges_px[0].max(edges_px[1])).reach_px();
        let along = [offset.perp(second) / area, first.perp(offset) / area];
        // How many pixels from edge to edge a side is high.
        let height_px = [area.abs() / second.norm(), area.abs() / first.norm()];
        (0..2).any(|i| along[i].abs() < (plain[i] - reach_px / height_px[i]).max(LEAST_OF_PLAIN * plain[i]))
    }
}

/// A pixel: its offset from the window's centre, and its level.
type Pixel = (Vec2, f64);

/// Refines a corner within a disc of radius `half_px`; `None` where no crossing fits or it leaves the start
/// by a pixel.
pub(super) fn refine<T: Level>(image: &Raster<T>, start: Vec2, half_px: usize) -> Option<Vec2> {
    let pixels = pixels_in(image, start, &Window::Disc(half_px))?;
    let crossing = initial(&pixels, start)?;
    Some(fit(&pixels, crossing, [0.0; 2], half_px as f64, 1.0)?.corner)
}

/// Fits a crossing to the pixels of a window near its edges, which bend by the curvatures; `None` where none
/// fits or it leaves the start by more than `most_px`. Where the edges prove wider than was thought, more
/// pixels are taken.
pub(super) fn fit_near_edges<T: Level>(
    image: &Raster<T>,
    start: &Crossing,
    window: &Window,
    curvatures: [f64; 2],
    most_px: f64,
) -> Option<Crossing> {
    let all = pixels_in(image, start.corner, window)?;
    let normals = directions(start).map(|along| Vec2::new(-along.y, along.x));
    let widest_px = match window {
        Window::Disc(half_px) => *half_px as f64,
        Window::Along { sides, .. } => sides[0].norm().max(sides[1].norm()),
    };
    let mut begin = *start;
    for _ in 0..MAX_BANDS {
        let thought_px = begin.edges_px.map(|edge_px| WIDER * edge_px);
        let bands = thought_px.map(|edge_px| Edge::new(edge_px).reach_px() + PLATEAU_PX);
        let near = |(offset, _): &&Pixel| {
            (0..2).any(|i| normals[i].dot(offset).abs() < bands[i]) && window.is_plain(offset, thought_px)
        };
        let pixels: Vec<Pixel> = all.iter().filter(near).copied().collect();
        let found = fit(&pixels, begin, curvatures, widest_px, most_px)?;
        if pixels.len() == all.len() || (0..2).all(|i| found.edges_px[i] <= thought_px[i]) {
            return Some(found);
        }
        begin.edges_px = [0, 1].map(|i| found.edges_px[i].max(begin.edges_px[i]));
    }
    None
}

/// Root mean square of what a crossing leaves of the levels in a window about its corner, as part of its
/// amplitude.
pub(super) fn misfit<T: Level>(
    image: &Raster<T>,
    crossing: &Crossing,
    window: &Window,
    curvatures: [f64; 2],
) -> Option<f64> {
    let mut pixels = pixels_in(image, crossing.corner, window)?;
    pixels.retain(|(offset, _)| window.is_plain(offset, crossing.edges_px));
    let left = Left { blocks: &blocks(&pixels), sides: sides(crossing, curvatures), crossing };
    let mean = dispatch(left) / pixels.len() as f64;
    Some(mean.sqrt() / crossing.amplitude.abs())
}

fn fit(
    pixels: &[Pixel],
    start: Crossing,
    curvatures: [f64; 2],
    widest_px: f64,
    most_px: f64,
) -> Option<Crossing> {
    if pixels.len() < 2 * PARAMETERS {
        return None;
    }
    let blocks = blocks(pixels);
    let mut crossing = start;
    for i in 0..MAX_STEPS {
        let edges_px = crossing.edges_px;
        let moved_px = step(&blocks, &mut crossing, &start.corner, curvatures, widest_px)?;
        if i >= WIDTH_STEPS {
            crossing.edges_px = edges_px;
        }
        let away_px = (crossing.corner - start.corner).norm();
        if away_px.is_nan() || away_px > most_px {
            return None;
        }
        let width_moved = (0..2).map(|i| (crossing.edges_px[i] - edges_px[i]).abs()).fold(0.0, f64::max);
        if moved_px < REST_PX && (i >= WIDTH_STEPS || width_moved < 0.05) {
            break;
        }
        if i + 1 == MAX_STEPS && moved_px > LAST_PX {
            return None;
        }
    }
    (crossing.amplitude * start.amplitude > 0.0).then_some(crossing)
}

fn pixels_in<T: Level>(image: &Raster<T>, centre: Vec2, window: &Window) -> Option<Vec<Pixel>> {
    let (reach, inverse) = match window {
        Window::Disc(half_px) => (Vec2::repeat(*half_px as f64), None),
        Window::Along { sides: [first, second], .. } => {
            let sides = Matrix2::from_columns(&[*first, *second]);
            let inverse = sides.try_inverse()?;
            ((first.abs() + second.abs()).map(libm::ceil), Some(inverse))
        }
    };
    let (x, y) = (libm::round(centre.x), libm::round(centre.y));
    let fits = |at: f64, reach: f64, size: usize| at >= reach && at + reach < size as f64;
    if !(fits(x, reach.x, image.width()) && fits(y, reach.y, image.height())) {
        return None;
    }
    let (left, right) = (x as usize - reach.x as usize, x as usize + reach.x as usize);
    let (top, bottom) = (y as usize - reach.y as usize, y as usize + reach.y as usize);
    let mut pixels = Vec::with_capacity((right - left + 1) * (bottom - top + 1));
    for y in top..=bottom {
        let down = y as f64 - centre.y;
        let all = (left..=right).zip(&image.row(y)[left..=right]);
        let offsets = all.map(|(x, sample)| (Vec2::new(x as f64 - centre.x, down), sample.to_f64()));
        match inverse {
            Some(inverse) => {
                let of_row = inverse.column(1) * down;
                let part = |i: usize, along: f64| inverse[(i, 0)] * along + of_row[i];
                let is_inside = |along: f64| part(0, along).abs() <= 1.0 && part(1, along).abs() <= 1.0;
                pixels.extend(offsets.filter(|(offset, _)| is_inside(offset.x)));
            }
            None => pixels.extend(offsets.filter(|(offset, _)| offset.norm() <= reach.x + 0.5)),
        }
    }
    Some(pixels)
}

/// Directions from the quadric that fits the pixels: along an edge through a saddle it does not curve.
fn initial(pixels: &[Pixel], corner: Vec2) -> Option<Crossing> {
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    let mut right = SVector::<f64, 6>::zeros();
    for (d, level) in pixels {
        let row = SVector::from([1.0, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y]);
        normal += row * row.transpose();
        right += row * *level;
    }
    let fit = normal.cholesky()?.solve(&right);
    let hessian = Matrix2::new(2.0 * fit[3], fit[4], fit[4], 2.0 * fit[5]);
    let eigen = hessian.symmetric_eigen();
    let (low, high) = if eigen.eigenvalues[0] < eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
    let (least, greatest) = (eigen.eigenvalues[low], eigen.eigenvalues[high]);
    if !(least < 0.0 && greatest > 0.0) {
        return None;
    }
    // d = u cos t + v sin t with greatest cos^2 t + least sin^2 t = 0.
    let axis = eigen.eigenvectors.column(high);
    let axis_rad = libm::atan2(axis[1], axis[0]);
    let half_opening_rad = libm::atan((-greatest / least).sqrt());
    let angles_rad = [axis_rad - half_opening_rad, axis_rad + half_opening_rad];
    let levels = || pixels.iter().map(|(_, level)| *level);
    let (low, high) = (levels().fold(f64::INFINITY, f64::min), levels().fold(f64::NEG_INFINITY, f64::max));
    // Along the axis of greatest curvature the image is bright: there the two normals point to different
    // sides.
    Some(Crossing {
        corner,
        angles_rad,
        edges_px: [1.5 * SHARPEST_EDGE_PX; 2],
        mean: 0.5 * (low + high),
        amplitude: -0.5 * (high - low),
        slope: Vec2::zeros(),
    })
}

fn directions(crossing: &Crossing) -> [Vec2; 2] {
    crossing.angles_rad.map(|angle| {
        let (sine, cosine) = libm::sincos(angle);
        Vec2::new(cosine, sine)
    })
}

/// Four pixels; fewer are filled up with pixels of weight 0.
struct Block {
    x: [f64; LANES],
    y: [f64; LANES],
    level: [f64; LANES],
    weight: [f64; LANES],
}

fn blocks(pixels: &[Pixel]) -> Vec<Block> {
    let block = |part: &[Pixel]| {
        let of = |value: fn(&Pixel) -> f64| std::array::from_fn(|i| part.get(i).map_or(0.0, value));
        Block { x: of(|p| p.0.x), y: of(|p| p.0.y), level: of(|p| p.1), weight: of(|_| 1.0) }
    };
    pixels.chunks(LANES).map(block).collect()
}

/// An edge of a crossing, with all that a pixel needs of it.
struct Side {
    along: Vec2,
    normal: Vec2,
    curvature: f64,
    edge: LaneEdge,
    edge_px: f64,
    /// Distance beyond which an edge's coverage changes no more, px.
    far_px: f64,
    /// `f` and its slope there: on the side of negative distances, and of positive ones.
    far: [(f64, f64); 2],
}

/// Beyond the reach by so much, rounding does not bring a distance back within it.
const BEYOND: f64 = 1.000_001;

/// What a side adds to four pixels: `f`, its slope `df/dd`, the distance `d`, and `t . (p - q)`.
struct Seen<L> {
    f: L,
    slope: L,
    d: L,
    along: L,
}

/// `f` and its slope at a distance from an edge.
#[inline(always)]
fn across<L: Lanes>(edge: &LaneEdge, d: L) -> (L, L) {
    let (coverage, slope) = edge.coverage(d);
    (L::splat(1.0) - L::splat(2.0) * coverage, L::splat(2.0) * slope)
}

impl Side {
    #[inline(always)]
    fn at<L: Lanes>(&self, x: L, y: L) -> Seen<L> {
        let along = L::splat(self.along.x) * x + L::splat(self.along.y) * y;
        let straight = L::splat(self.normal.x) * x + L::splat(self.normal.y) * y;
        let d = straight - L::splat(0.5 * self.curvature) * along * along;
        // Most pixels lie far from one edge or the other, and what is known of these need not be computed
        // again.
        let (f, slope) = if (d.max(-d) - L::splat(self.far_px)).all_positive() {
            let far = d.store().map(|d| self.far[usize::from(d > 0.0)]);
            (L::load(&far.map(|(f, _)| f)), L::load(&far.map(|(_, slope)| slope)))
        } else {
            across(&self.edge, d)
        };
        Seen { f, slope, d, along }
    }
}

/// Elements of a symmetric matrix and of a vector: row by row up to the diagonal, then the vector.
const SUMS: usize = PARAMETERS * (PARAMETERS + 1) / 2 + PARAMETERS;

/// The normal equations of a step.
struct Normal<'a> {
    blocks: &'a [Block],
    sides: [Side; 2],
    crossing: &'a Crossing,
    /// The corner, seen from the window's centre.
    corner: Vec2,
}

impl Kernel for Normal<'_> {
    type Output = [f64; SUMS];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f64; SUMS] {
        let mut sums = [L::zero(); SUMS + 3];
        let Crossing { mean, amplitude, slope, .. } = self.crossing;
        for block in self.blocks {
            let (x, y) =
                (L::load(&block.x) - L::splat(self.corner.x), L::load(&block.y) - L::splat(self.corner.y));
            let weight = L::load(&block.weight);
            let [first, second] = [self.sides[0].at(x, y), self.sides[1].at(x, y)];
            let product = first.f * second.f;
            let by_distance = [
                L::splat(*amplitude) * first.slope * second.f * weight,
                L::splat(*amplitude) * second.slope * first.f * weight,
            ];
            let by_corner = |normals: [f64; 2]| {
                -(L::splat(normals[0]) * by_distance[0] + L::splat(normals[1]) * by_distance[1])
            };
            let predicted = L::splat(*mean)
                + (L::splat(slope.x) * x + L::splat(slope.y) * y)
                + L::splat(*amplitude) * product;
            let row = [
                by_corner(self.sides.each_ref().map(|side| side.normal.x)),
                by_corner(self.sides.each_ref().map(|side| side.normal.y)),
                // d(n . offset) / d(angle) = -(t . offset); a wider edge looks like one nearer to its middle.
                -(first.along * by_distance[0]),
                -(second.along * by_distance[1]),
                -(by_distance[0] * first.d * L::splat(1.0 / self.sides[0].edge_px)),
                -(by_distance[1] * second.d * L::splat(1.0 / self.sides[1].edge_px)),
                weight,
                product * weight,
                x * weight,
                y * weight,
            ];
            let residual = L::load(&block.level) - predicted;
            let mut at = 0;
            for i in 0..PARAMETERS {
                for j in 0..=i {
                    sums[at + j] = sums[at + j] + row[i] * row[j];
                }
                at += i + 1;
                sums[SUMS - PARAMETERS + i] = sums[SUMS - PARAMETERS + i] + row[i] * residual;
            }
        }
        let mut totals = [0.0; SUMS];
        for (four, totals) in sums.chunks_exact(4).zip(totals.chunks_mut(4)) {
            let of_four = L::sums([four[0], four[1], four[2], four[3]]);
            totals.copy_from_slice(&of_four[..totals.len()]);
        }
        totals
    }
}

/// The sum of the squares of what a crossing leaves of the levels about its corner.
struct Left<'a> {
    blocks: &'a [Block],
    sides: [Side; 2],
    crossing: &'a Crossing,
}

impl Kernel for Left<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Crossing { mean, amplitude, slope, .. } = self.crossing;
        let mut sum = L::zero();
        for block in self.blocks {
            let (x, y) = (L::load(&block.x), L::load(&block.y));
            let [first, second] = [self.sides[0].at(x, y), self.sides[1].at(x, y)];
            let ground = L::splat(*mean) + (L::splat(slope.x) * x + L::splat(slope.y) * y);
            let predicted = ground + L::splat(*amplitude) * (first.f * second.f);
            let left = (L::load(&block.level) - predicted) * L::load(&block.weight);
            sum = sum + left * left;
        }
        L::sums([sum, L::zero(), L::zero(), L::zero()])[0]
    }
}

/// The edges of a crossing.
fn sides(crossing: &Crossing, curvatures: [f64; 2]) -> [Side; 2] {
    let along = directions(crossing);
    [0, 1].map(|i| {
        let normal = Vec2::new(-along[i].y, along[i].x);
        let edge_px = crossing.edges_px[i];
        let model = Edge::new(edge_px);
        let edge = LaneEdge::new(&model, &normal);
        let far_px = BEYOND * model.reach_px();
        let far = [-far_px, far_px].map(|d| {
            let (f, slope) = across(&edge, Portable::splat(d));
            (f.store()[0], slope.store()[0])
        });
        Side { along: along[i], normal, curvature: curvatures[i], edge, edge_px, far_px, far }
    })
}

/// One Gauss-Newton step; returns how far the corner moved.
fn step(
    blocks: &[Block],
    crossing: &mut Crossing,
    centre: &Vec2,
    curvatures: [f64; 2],
    widest_px: f64,
) -> Option<f64> {
    let sides = sides(crossing, curvatures);
    let sums = dispatch(Normal { blocks, sides, crossing, corner: crossing.corner - centre });
    let mut normal = SMatrix::<f64, PARAMETERS, PARAMETERS>::from_fn(|i, j| {
        let (i, j) = (i.max(j), i.min(j));
        sums[i * (i + 1) / 2 + j]
    });
    let gradient = SVector::<f64, PARAMETERS>::from_fn(|i, _| sums[SUMS - PARAMETERS + i]);
    // A perfectly sharp image leaves the widths undetermined below the pixel's own: hold them lightly where
    // they are.
    let hold = 1e-6 * crossing.amplitude * crossing.amplitude * (LANES * blocks.len()) as f64;
    normal[(4, 4)] += hold;
    normal[(5, 5)] += hold;
    let change = normal.cholesky()?.solve(&gradient);
    let moved = Vec2::new(change[0], change[1]);
    crossing.corner += moved;
    crossing.angles_rad = [crossing.angles_rad[0] + change[2], crossing.angles_rad[1] + change[3]];
    crossing.edges_px = [0, 1].map(|i| {
        let edge_px = crossing.edges_px[i];
        (edge_px + change[4 + i])
            .clamp(0.5 * edge_px, 2.0 * edge_px)
            .clamp(SHARPEST_EDGE_PX, widest_px.max(SHARPEST_EDGE_PX))
    });
    crossing.mean += change[6];
    crossing.amplitude += change[7];
    crossing.slope += Vec2::new(change[8], change[9]);
    Some(moved.norm())
}
