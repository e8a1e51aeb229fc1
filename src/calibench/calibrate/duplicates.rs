//! Which views were given more than once? A copy says nothing new, and counted again it would shrink every standard deviation.

use crate::board::View;

/// For each view the first that is the same to the last bit: itself unless it is a copy.
pub(super) fn first_of_each(views: &[View]) -> Vec<usize> {
    let mut first: Vec<usize> = (0..views.len()).collect();
    let key = |view: &View| {
        let pixel = view.pixels().first().map_or((0, 0), |p| (p.x.to_bits(), p.y.to_bits()));
        (pixel, view.len())
    };
    // Only views whose first pixels agree are compared whole: time grows as that of sorting.
    let mut order: Vec<((u64, u64), usize, usize)> =
        views.iter().enumerate().map(|(index, view)| (key(view).0, key(view).1, index)).collect();
    order.sort_unstable();
    for group in order.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        mark_copies(views, group.iter().map(|entry| entry.2).collect(), &mut first);
    }
    first
}

/// Among views alike at first sight, in order.
fn mark_copies(views: &[View], mut left: Vec<usize>, first: &mut [usize]) {
    while left.len() > 1 {
        let original = left.remove(0);
        left.retain(|&view| {
            let is_copy = views[view] == views[original];
            if is_copy {
                first[view] = original;
            }
            !is_copy
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;

    #[test]
    fn copies_point_to_the_first_of_them() {
        let view = |seed: f64| {
            let points: Vec<Vec2> = (0..6).map(|i| Vec2::new(f64::from(i % 3), f64::from(i / 3))).collect();
            let mut pixels: Vec<Vec2> = points.iter().map(|p| p * 10.0).collect();
            pixels[5].x += seed;
            View::new(points, pixels).unwrap()
        };
        let views = [view(0.0), view(1.0), view(0.0), view(1.0), view(2.0), view(0.0)];
        assert_eq!(first_of_each(&views), [0, 1, 0, 1, 4, 0]);
    }
}
