//! Which dark (or bright) pixels hang together? Connected components of runs, with their moments, in one
//! pass.
//!
//! Each row is cut into runs of marked pixels; runs that touch a run of the row above (sharing a column) join
//! its component through a union-find forest. Only runs are touched after the tiles of one side are skipped,
//! so the time grows with the outline, not with the area. (Run-based labelling: He, Chao & Suzuki 2008.)

use super::threshold::{Side, TILE_PX, Thresholds};
use crate::raster::{Level, Raster};

/// Which side of the threshold is the mark?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Polarity {
    /// Dark marks on bright ground.
    #[default]
    Dark,
    /// Bright marks on dark ground.
    Bright,
}

/// Moments and extent of a connected set of pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Number of pixels.
    pub area_px: f64,
    /// Sums of x and y.
    pub first: [f64; 2],
    /// Sums of x^2, x y and y^2.
    pub second: [f64; 3],
    /// Least x and y.
    pub low: [u32; 2],
    /// Greatest x and y.
    pub high: [u32; 2],
}

/// A run of marked pixels `start..end` of a row.
#[derive(Debug, Clone, Copy)]
struct Run {
    start: u32,
    end: u32,
    component: u32,
}

impl Component {
    fn of_run(start: u32, end: u32, y: u32) -> Component {
        let (a, b, v) = (f64::from(start), f64::from(end) - 1.0, f64::from(y));
        let n = b - a + 1.0;
        let sum = 0.5 * n * (a + b);
        // Sum of squares of consecutive integers about their mean: n (n^2 - 1) / 12.
        let squares = sum * sum / n + n * (n * n - 1.0) / 12.0;
        Component {
            area_px: n,
            first: [sum, n * v],
            second: [squares, sum * v, n * v * v],
            low: [start, y],
            high: [end - 1, y],
        }
    }

    fn join(&mut self, other: &Component) {
        self.area_px += other.area_px;
        self.first = [self.first[0] + other.first[0], self.first[1] + other.first[1]];
        for (sum, more) in self.second.iter_mut().zip(other.second) {
            *sum += more;
        }
        for axis in 0..2 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
    }
}

/// The components of an image, in the order of their topmost, leftmost run.
pub fn components<T: Level>(
    image: &Raster<T>,
    thresholds: &Thresholds<T>,
    polarity: Polarity,
) -> Vec<Component> {
    let mut forest = Forest::default();
    let (mut above, mut runs): (Vec<Run>, Vec<Run>) = (Vec::new(), Vec::new());
    let mut stretches = Vec::new();
    for y in 0..image.height() {
        if y % TILE_PX == 0 {
            stretches.clear();
            find_stretches(thresholds.row(y / TILE_PX), image.width(), polarity, &mut stretches);
        }
        std::mem::swap(&mut above, &mut runs);
        runs.clear();
        find_runs(image.row(y), &stretches, polarity, &mut runs);
        forest.attach(&above, &mut runs, y as u32);
    }
    forest.roots()
}

/// Neighbouring columns in a row of tiles that may be marked.
struct Stretch<T> {
    start: usize,
    end: usize,
    /// The threshold that decides, unless all are marked.
    level: Option<T>,
}

/// The stretches of a row of tiles, left to right: one for every mixed tile, one for neighbouring tiles of
/// the mark's side.
fn find_stretches<T: Level>(
    tiles: impl Iterator<Item = (T, Side)>,
    width: usize,
    polarity: Polarity,
    stretches: &mut Vec<Stretch<T>>,
) {
    let mark_side = if polarity == Polarity::Dark { Side::Dark } else { Side::Bright };
    for (tile, (level, side)) in tiles.enumerate() {
        let (start, end) = (tile * TILE_PX, width.min((tile + 1) * TILE_PX));
        if side == Side::Mixed {
            stretches.push(Stretch { start, end, level: Some(level) });
        } else if side == mark_side {
            match stretches.last_mut() {
                Some(last) if last.end == start && last.level.is_none() => last.end = end,
                _ => stretches.push(Stretch { start, end, level: None }),
            }
        }
    }
}

/// Cuts a row into runs of marked pixels.
fn find_runs<T: Level>(row: &[T], stretches: &[Stretch<T>], polarity: Polarity, runs: &mut Vec<Run>) {
    let mut close = |start: Option<usize>, end: usize| {
        if let Some(start) = start {
            runs.push(Run { start: start as u32, end: end as u32, component: 0 });
        }
    };
    let (mut start, mut seen) = (None, 0);
    for stretch in stretches {
        if stretch.start > seen {
            close(start.take(), seen);
        }
        seen = stretch.end;
        let Some(level) = stretch.level else {
            start.get_or_insert(stretch.start);
            continue;
        };
        // One bit a pixel, set where the row passes from unmarked to marked or back.
        let samples = &row[stretch.start..stretch.end];
        let marked = marks(samples, level, polarity);
        let mut passes = (marked ^ (marked << 1 | u32::from(start.is_some()))) & ((1 << samples.len()) - 1);
        while passes != 0 {
            let at = stretch.start + passes.trailing_zeros() as usize;
            match start.take() {
                None => start = Some(at),
                open => close(open, at),
            }
            passes &= passes - 1;
        }
    }
    close(start, seen);
}

/// Which of a tile's samples are marked: bit `i` for sample `i`.
fn marks<T: Level>(samples: &[T], level: T, polarity: Polarity) -> u32 {
    let dark = samples.iter().rev().fold(0, |bits, &sample| bits << 1 | u32::from(sample < level));
    if polarity == Polarity::Dark { dark } else { !dark }
}

/// A union-find forest of components; the root of a tree is its oldest member.
#[derive(Default)]
struct Forest {
    parent: Vec<u32>,
    members: Vec<Component>,
}

impl Forest {
    fn root(&mut self, mut node: u32) -> u32 {
        while self.parent[node as usize] != node {
            let above = self.parent[self.parent[node as usize] as usize];
            self.parent[node as usize] = above;
            node = above;
        }
        node
    }

    /// Gives every run of a row its component: that of the runs above it, joined, or a new one.
    fn attach(&mut self, above: &[Run], runs: &mut [Run], y: u32) {
        let mut first = 0;
        for run in runs {
            while first < above.len() && above[first].end <= run.start {
                first += 1;
            }
            let mut root = None;
            for touching in above[first..].iter().take_while(|other| other.start < run.end) {
                let other = self.root(touching.component);
                root = Some(root.map_or(other, |root| self.unite(root, other)));
            }
            let own = Component::of_run(run.start, run.end, y);
            run.component = match root {
                Some(root) => {
                    self.members[root as usize].join(&own);
                    root
                }
                None => {
                    self.parent.push(self.members.len() as u32);
                    self.members.push(own);
                    self.members.len() as u32 - 1
                }
            };
        }
    }

    fn unite(&mut self, a: u32, b: u32) -> u32 {
        let (old, young) = (a.min(b), a.max(b));
        if old != young {
            self.parent[young as usize] = old;
            let joined = self.members[young as usize];
            self.members[old as usize].join(&joined);
        }
        old
    }

    fn roots(self) -> Vec<Component> {
        let is_root = |(node, parent): (usize, &u32)| node == *parent as usize;
        let roots = self.parent.iter().enumerate().map(is_root);
        self.members.iter().zip(roots).filter(|(_, root)| *root).map(|(member, _)| *member).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_text(rows: &[&str]) -> Vec<Component> {
        let image =
            Raster::from_fn(
                rows[0].len(),
                rows.len(),
                |x, y| {
                    if rows[y].as_bytes()[x] == b'#' { 0u8 } else { 255 }
                },
            );
        components(&image, &Thresholds::of(&image).unwrap(), Polarity::Dark)
    }

    #[test]
    fn arms_that_meet_further_down_are_one_component() {
        let found = of_text(&["#...#..#", "#.#.#..#", "#####...", "......##", "......##"]);
        assert_eq!(found.len(), 3);
        assert_eq!(found[0].area_px, 10.0);
        assert_eq!((found[0].low, found[0].high), ([0, 0], [4, 2]));
        // Touching at a corner only is not touching.
        assert_eq!((found[1].area_px, found[2].area_px), (2.0, 4.0));
        assert_eq!(found[2].first, [26.0, 14.0]);
        assert_eq!(found[2].second, [2.0 * 36.0 + 2.0 * 49.0, 26.0 * 3.5, 2.0 * 9.0 + 2.0 * 16.0]);
    }

    #[test]
    fn every_marked_pixel_belongs_to_exactly_one_component() {
        let image = Raster::from_fn(150, 90, |x, y| ((x * x * 7 + y * y * 13 + x * y * 5) % 251) as u8);
        let thresholds = Thresholds::of(&image).unwrap();
        let count = |polarity| -> f64 {
            components(&image, &thresholds, polarity).iter().map(|component| component.area_px).sum()
        };
        assert_eq!(count(Polarity::Dark) + count(Polarity::Bright), 150.0 * 90.0);
    }
}
