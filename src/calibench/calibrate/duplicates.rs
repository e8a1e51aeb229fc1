//! Which views and marks were given more than once? A copy says nothing new, and counted again it would
//! shrink every standard deviation.

use crate::board::View;
use crate::geometry::Vec2;
use std::collections::HashMap;

/// Two photographs differ by their noise, some 0.01 px at the least; pixels that all agree to this many px
/// are one measurement, written twice: to two decimals perhaps.
const SAME_PX: f64 = 6e-3;
/// Coordinates of a target that agree to this part of its size are those of one mark.
const SAME_PART: f64 = 1e-9;

/// What is left of the views when copies are taken away, and where each given one went.
pub(super) struct Distinct {
    /// The given views that were kept, in order.
    pub kept: Vec<usize>,
    /// For each given view its place among those kept.
    pub place: Vec<usize>,
    /// For each given view the kept view's mark that each of its marks is: `None` where they are the same, in
    /// the same order.
    marks: Vec<Option<Vec<usize>>>,
    /// The kept views whose marks were not all different, without the copies.
    thinned: Vec<(usize, View)>,
    /// Marks that were given more than once in their view: how many, and the first, as view and number.
    pub repeated: Option<(usize, usize, usize)>,
}

impl Distinct {
    /// `None` where nothing was given twice.
    pub fn of(views: &[View]) -> Option<Distinct> {
        let first = first_of_each(views);
        let thin: Vec<Option<Thinned>> = views.iter().map(Thinned::of).collect();
        if thin.iter().all(Option::is_none) && first.iter().enumerate().all(|(i, &first)| i == first) {
            return None;
        }
        let kept: Vec<usize> = (0..views.len()).filter(|&view| first[view] == view).collect();
        let place = first.iter().map(|view| kept.partition_point(|kept| kept < view)).collect();
        let marks = (0..views.len()).map(|view| marks_in(views, &thin, view, first[view])).collect();
        let repeats = || thin.iter().enumerate().filter_map(|(view, thin)| Some((view, thin.as_ref()?)));
        let count = repeats().map(|(view, thin)| views[view].len() - thin.view.len()).sum();
        let repeated = repeats().next().map(|(view, thin)| (count, view, thin.first));
        let thinned =
            kept.iter().filter_map(|&view| Some((view, thin[view].as_ref()?.view.clone()))).collect();
        Some(Distinct { kept, place, marks, thinned, repeated })
    }

    /// The views to calibrate from.
    pub fn views(&self, given: &[View]) -> Vec<View> {
        let thinned = |view: usize| {
            let at = self.thinned.binary_search_by_key(&view, |(index, _)| *index).ok()?;
            Some(&self.thinned[at].1)
        };
        self.kept.iter().map(|&view| thinned(view).unwrap_or(&given[view]).clone()).collect()
    }

    /// What was found for the marks of the kept views, for the marks of a given one.
    pub fn spread<T: Clone>(&self, view: usize, found: &[Vec<T>]) -> Vec<T> {
        let found = &found[self.place[view]];
        match &self.marks[view] {
            Some(marks) => marks.iter().map(|&mark| found[mark].clone()).collect(),
            None => found.clone(),
        }
    }

    /// The first given mark that is a mark of a kept view.
    pub fn given_mark(&self, kept: usize, mark: usize) -> (usize, usize) {
        let view = self.kept[kept];
        let given = self.marks[view].as_ref().and_then(|marks| marks.iter().position(|&m| m == mark));
        (view, given.unwrap_or(mark))
    }
}

/// A view without its marks' copies.
struct Thinned {
    view: View,
    /// For each given mark its number in `view`.
    marks: Vec<usize>,
    /// The first mark that is a copy.
    first: usize,
}

impl Thinned {
    /// `None` where all marks are different.
    fn of(view: &View) -> Option<Thinned> {
        if are_different(view) {
            return None;
        }
        let (mut points, mut pixels, mut marks): (Vec<Vec2>, Vec<Vec2>, Vec<usize>) = Default::default();
        let mut first = None;
        let mut known = HashMap::new();
        for (index, (point, pixel)) in view.pairs().enumerate() {
            // Zeros of either sign are one number.
            let numbers = [point.x, point.y, pixel.x, pixel.y].map(|x| (x + 0.0).to_bits());
            let next = points.len();
            let number = *known.entry(numbers).or_insert(next);
            if number == next {
                points.push(*point);
                pixels.push(*pixel);
            } else {
                first = first.or(Some(index));
            }
            marks.push(number);
        }
        let view = View::new(points, pixels).expect("a part of a view is one");
        first.map(|first| Thinned { view, marks, first })
    }
}

/// Bits of the table in which marks are looked up: few enough to clear for every view, and so many that of 63
/// different marks two share one in a view of four.
const TABLE_BITS: u32 = 13;

/// Whether no mark is a copy of another: by a table of their keys' bits, and by sorted keys where two share a
/// bit.
fn are_different(view: &View) -> bool {
    let mut table = [0_u64; 1 << (TABLE_BITS - 6)];
    let is_new = |pair| {
        let at = key(pair).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - TABLE_BITS);
        let (word, bit) = (&mut table[(at >> 6) as usize], 1 << (at & 63));
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    };
    if view.pairs().all(is_new) {
        return true;
    }
    let mut keys: Vec<u64> = view.pairs().map(key).collect();
    keys.sort_unstable();
    keys.windows(2).all(|pair| pair[0] != pair[1])
}

/// Equal for equal pairs, and hardly ever for others.
fn key((point, pixel): (&Vec2, &Vec2)) -> u64 {
    let turned = |x: f64, by: u32| x.to_bits().rotate_left(by);
    turned(point.x, 0) ^ turned(point.y, 17) ^ turned(pixel.x, 31) ^ turned(pixel.y, 47)
}

/// For each mark of `view` its number in the kept view `first`, thinned; `None` where nothing changes.
fn marks_in(views: &[View], thin: &[Option<Thinned>], view: usize, first: usize) -> Option<Vec<usize>> {
    let in_first = |mark: usize| thin[first].as_ref().map_or(mark, |thin| thin.marks[mark]);
    if view == first {
        return thin[first].as_ref().map(|thin| thin.marks.clone());
    }
    let (own, other) = (in_order(&views[view]), in_order(&views[first]));
    let mut marks = vec![0; own.len()];
    for (mine, theirs) in own.into_iter().zip(other) {
        marks[mine] = in_first(theirs);
    }
    Some(marks)
}

/// For each view the first that is the same but for rounding and the order of its marks: itself unless it is
/// a copy.
fn first_of_each(views: &[View]) -> Vec<usize> {
    let mut first: Vec<usize> = (0..views.len()).collect();
    // Only views whose outermost pixels agree are compared whole: time grows as that of sorting.
    let mut order: Vec<(Extremes, usize)> =
        views.iter().enumerate().map(|(index, view)| (extremes(view), index)).collect();
    order.sort_unstable_by(|a, b| a.0[0].total_cmp(&b.0[0]).then(a.1.cmp(&b.1)));
    for (i, &(outermost, a)) in order.iter().enumerate() {
        if first[a] != a {
            continue;
        }
        let near = order[i + 1..].iter().take_while(|(other, _)| other[0] - outermost[0] <= SAME_PX);
        for &(other, b) in near {
            let may_be = other.iter().zip(&outermost).all(|(x, y)| (x - y).abs() <= SAME_PX);
            if may_be && first[b] == b && is_copy(&views[a], &views[b]) {
                first[a.max(b)] = a.min(b);
            }
        }
    }
    // Copies of copies point to the first of all.
    for view in 0..first.len() {
        first[view] = first[first[view]];
    }
    first
}

/// The least and the largest u and v of a view's pixels.
type Extremes = [f64; 4];

fn extremes(view: &View) -> Extremes {
    let mut found = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
    for pixel in view.pixels() {
        found = [found[0].min(pixel.x), found[1].max(pixel.x), found[2].min(pixel.y), found[3].max(pixel.y)];
    }
    found
}

fn is_copy(a: &View, b: &View) -> bool {
    if a.len() != b.len() {
        return false;
    }
    let size = extent(a);
    let same = |i: usize, j: usize| {
        (a.points()[i] - b.points()[j]).abs().max() <= SAME_PART * size
            && (a.pixels()[i] - b.pixels()[j]).abs().max() <= SAME_PX
    };
    (0..a.len()).all(|i| same(i, i)) || in_order(a).into_iter().zip(in_order(b)).all(|(i, j)| same(i, j))
}

/// The largest coordinate of the target.
fn extent(view: &View) -> f64 {
    view.points().iter().map(|p| p.abs().max()).fold(0.0, f64::max)
}

/// The numbers of the marks in an order that depends on where they are only.
fn in_order(view: &View) -> Vec<usize> {
    let step = (2.0 * SAME_PART * extent(view)).max(f64::MIN_POSITIVE);
    let cell = |i: usize| {
        let (p, q) = (view.points()[i], view.pixels()[i]);
        [p.x / step, p.y / step, q.x / SAME_PX, q.y / SAME_PX].map(libm::round)
    };
    let mut order: Vec<usize> = (0..view.len()).collect();
    order.sort_by(|&i, &j| {
        let pairs = cell(i).into_iter().zip(cell(j));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(i.cmp(&j))
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(seed: f64) -> View {
        let points: Vec<Vec2> = (0..6).map(|i| Vec2::new(f64::from(i % 3), f64::from(i / 3))).collect();
        let mut pixels: Vec<Vec2> = points.iter().map(|p| p * 10.0).collect();
        pixels[5].x += seed;
        View::new(points, pixels).unwrap()
    }

    fn reordered(view: &View, order: &[usize], shift: f64) -> View {
        let points = order.iter().map(|&i| view.points()[i]).collect();
        View::new(points, order.iter().map(|&i| view.pixels()[i] + Vec2::repeat(shift)).collect()).unwrap()
    }

    #[test]
    fn copies_point_to_the_first_of_them() {
        let views = [view(0.0), view(1.0), view(0.0), view(1.0), view(2.0), view(0.0)];
        assert_eq!(first_of_each(&views), [0, 1, 0, 1, 4, 0]);
        assert!(Distinct::of(&[view(0.0), view(1.0), view(2.0)]).is_none());
    }

    #[test]
    fn neither_rounding_nor_another_order_hides_a_copy_and_noise_is_none() {
        let order = [3, 1, 5, 0, 2, 4];
        let views = [view(0.0), reordered(&view(0.0), &order, 4e-3), reordered(&view(0.0), &order, 2e-2)];
        let distinct = Distinct::of(&views).unwrap();
        assert_eq!((distinct.kept.as_slice(), distinct.place.as_slice()), (&[0, 2][..], &[0, 0, 1][..]));
        let found: Vec<Vec<usize>> = vec![(0..6).collect(), (10..16).collect()];
        assert_eq!(distinct.spread(1, &found), order);
        assert_eq!(distinct.spread(2, &found), (10..16).collect::<Vec<_>>());
    }

    #[test]
    fn a_mark_given_twice_counts_once() {
        let twice = reordered(&view(0.0), &[0, 1, 2, 2, 3, 4, 0, 5], 0.0);
        let distinct = Distinct::of(&[view(1.0), twice.clone()]).unwrap();
        assert_eq!(distinct.repeated, Some((2, 1, 3)));
        assert_eq!(distinct.views(&[view(1.0), twice])[1], view(0.0));
        let found = vec![vec![0; 6], (0..6).collect::<Vec<_>>()];
        assert_eq!(distinct.spread(1, &found), [0, 1, 2, 2, 3, 4, 0, 5]);
        assert_eq!(distinct.given_mark(1, 3), (1, 4));
    }

    /// The same, its pixels moved by 100 px.
    fn moved(view: &View) -> View {
        View::new(view.points().to_vec(), view.pixels().iter().map(|p| p + Vec2::repeat(100.0)).collect())
            .unwrap()
    }

    #[test]
    fn copies_are_found_wherever_in_the_image() {
        let views = [moved(&view(1.0)), moved(&view(0.0)), moved(&view(1.0))];
        assert_eq!(first_of_each(&views), [0, 1, 0]);
    }

    #[test]
    fn coordinates_of_a_target_are_the_same_to_a_part_of_its_size() {
        let of = |off: f64| {
            let mut points: Vec<Vec2> = view(0.0).points().iter().map(|p| 500.0 * p).collect();
            points[2].x += off;
            View::new(points, view(0.0).pixels().to_vec()).unwrap()
        };
        // Of 1000 mm a part in 1e9 is 1e-6 mm.
        for (off, is_same) in [(9e-7, true), (1.1e-6, false)] {
            assert_eq!(is_copy(&of(0.0), &of(off)), is_same, "{off}");
        }
    }

    #[test]
    fn pixels_that_differ_by_rounding_do_not_order_the_marks() {
        let (own, order) = (view(0.0), [3, 1, 5, 0, 2, 4]);
        let other = reordered(&own, &order, 0.0);
        // Up in one row of the target and down in the other: marks of a column change places by their pixels.
        let rounded = |(point, pixel): (&Vec2, &Vec2)| pixel + Vec2::new(2e-3 - 4e-3 * point.y, 0.0);
        let pixels = other.pairs().map(rounded).collect();
        assert!(is_copy(&own, &View::new(other.points().to_vec(), pixels).unwrap()));
    }
}
