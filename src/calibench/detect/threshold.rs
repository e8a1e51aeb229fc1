//! Which level separates marks from their ground here? A threshold for every tile, half-way between the
//! extremes around it.
//!
//! Tiles whose neighbourhood shows no contrast (inside a large mark, on empty paper) inherit the threshold of
//! the nearest tiles that have one, through a pyramid of averages. So the threshold follows uneven light, and
//! marks may be larger than tiles. One pass over the pixels (extremes), the rest over tiles. (Local extremes
//! on tiles as in AprilTag 2, Wang & Olson 2016; the inheritance is ours.)

use crate::raster::{Level, Raster};

/// Side of a tile, px. A neighbourhood of 3 x 3 tiles, 48 px, sees mark and ground of every mark up to about
/// that size at its edge; larger tiles follow shading less well, smaller ones see more noise and less
/// contrast.
pub const TILE_PX: usize = 16;

/// Least contrast of a neighbourhood, as a fraction of the range of the whole image, that can be a mark's
/// edge. Noise of 2 % of the range spans 14 % in a neighbourhood of 2304 samples.
const LEAST_CONTRAST: f64 = 0.15;

/// How thresholds are chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Where a threshold lies between the extremes around it: 0 at the darkest.
    pub part: f64,
    /// Least contrast of a neighbourhood that can be a mark's edge, in levels.
    pub least_contrast: f64,
    /// The same as a fraction of the range of the whole image; the greater of the two counts.
    pub least_share: f64,
    /// Levels beyond these count as these: what is far brighter or darker than marks and ground.
    pub within: (f64, f64),
}

/// The first look: half-way.
const FIRST: Search = Search { part: 0.5, least_contrast: 0.0, least_share: LEAST_CONTRAST, within: ALL };

/// Every level.
pub const ALL: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// What a tile shows against its threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Every sample is below it.
    Dark,
    /// No sample is.
    Bright,
    /// Both occur.
    Mixed,
}

/// The thresholds of an image's tiles.
#[derive(Debug, Clone, PartialEq)]
pub struct Thresholds<T> {
    columns: usize,
    levels: Vec<T>,
    sides: Vec<Side>,
}

impl<T: Level> Thresholds<T> {
    /// The thresholds of an image; `None` where the image is empty or has a single level.
    pub fn of(image: &Raster<T>) -> Option<Thresholds<T>> {
        Thresholds::by(image, &FIRST)
    }

    /// The same, chosen otherwise.
    pub fn by(image: &Raster<T>, search: &Search) -> Option<Thresholds<T>> {
        let tiles = Extremes::of(image)?;
        let (low, high) = tiles.range();
        if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
            return None;
        }
        let (darkest, brightest) = search.within;
        let range = high.to_f64().min(brightest) - low.to_f64().max(darkest);
        let least_contrast = search.least_contrast.max(search.least_share * range);
        let seen = tiles.neighbourhood_levels(search.part, least_contrast, search.within);
        let levels: Vec<T> =
            inherited(seen, tiles.columns, tiles.rows).into_iter().map(T::at_least).collect();
        let sides = levels
            .iter()
            .zip(tiles.low.iter().zip(&tiles.high))
            .map(|(level, (low, high))| match (low < level, high < level) {
                (true, true) => Side::Dark,
                (true, false) => Side::Mixed,
                _ => Side::Bright,
            })
            .collect();
        Some(Thresholds { columns: tiles.columns, levels, sides })
    }

    /// Threshold and side of the tiles of a row of tiles: samples below the threshold are dark.
    pub fn row(&self, tile_row: usize) -> impl Iterator<Item = (T, Side)> {
        let range = tile_row * self.columns..(tile_row + 1) * self.columns;
        self.levels[range.clone()].iter().copied().zip(self.sides[range].iter().copied())
    }
}

/// Least and greatest sample of every tile.
struct Extremes<T> {
    columns: usize,
    rows: usize,
    low: Vec<T>,
    high: Vec<T>,
}

impl<T: Level> Extremes<T> {
    fn of(image: &Raster<T>) -> Option<Extremes<T>> {
        let columns = image.width().div_ceil(TILE_PX);
        let rows = image.height().div_ceil(TILE_PX);
        if columns == 0 || rows == 0 {
            return None;
        }
        let (mut low, mut high) = (Vec::with_capacity(columns * rows), Vec::with_capacity(columns * rows));
        let (mut lows, mut highs) = (Vec::new(), Vec::new());
        for tiles in image.samples().chunks(TILE_PX * image.width()) {
            let mut rows = tiles.chunks_exact(image.width());
            let top = rows.next().unwrap_or_default();
            lows.clear();
            lows.extend_from_slice(top);
            highs.clear();
            highs.extend_from_slice(top);
            // Column by column first: this loop runs over whole rows and vectorises.
            for row in rows {
                for ((low, high), &sample) in lows.iter_mut().zip(&mut highs).zip(row) {
                    *low = lesser(sample, *low);
                    *high = greater(sample, *high);
                }
            }
            low.extend(lows.chunks(TILE_PX).map(|tile| pick_one(tile, lesser)));
            high.extend(highs.chunks(TILE_PX).map(|tile| pick_one(tile, greater)));
        }
        Some(Extremes { columns, rows, low, high })
    }

    fn range(&self) -> (T, T) {
        let of =
            |values: &[T], pick: fn(T, T) -> T| values[1..].iter().fold(values[0], |best, &x| pick(x, best));
        (of(&self.low, lesser), of(&self.high, greater))
    }

    /// A part of the way between the extremes of the 3 x 3 tiles around each tile, where they differ enough.
    fn neighbourhood_levels(
        &self,
        part: f64,
        least_contrast: f64,
        (darkest, brightest): (f64, f64),
    ) -> Vec<Option<f64>> {
        let low = over_neighbours(&self.low, self.columns, lesser);
        let high = over_neighbours(&self.high, self.columns, greater);
        let level = |(low, high): (&T, &T)| {
            let (low, high) = (low.to_f64().max(darkest), high.to_f64().min(brightest));
            (high - low >= least_contrast).then_some((1.0 - part) * low + part * high)
        };
        low.iter().zip(&high).map(level).collect()
    }
}

/// The one of a tile's samples that wins against all others, in halves: each is one operation on short
/// vectors.
fn pick_one<T: Level>(tile: &[T], pick: impl Fn(T, T) -> T) -> T {
    let Some(samples) = tile.first_chunk::<TILE_PX>() else {
        return tile[1..].iter().fold(tile[0], |best, &x| pick(x, best));
    };
    let eight: [T; 8] = std::array::from_fn(|i| pick(samples[i], samples[i + 8]));
    let four: [T; 4] = std::array::from_fn(|i| pick(eight[i], eight[i + 4]));
    pick(pick(four[0], four[2]), pick(four[1], four[3]))
}

/// Every value combined with its eight neighbours, those there are: first along columns, then along rows.
fn over_neighbours<T: Level>(values: &[T], columns: usize, pick: impl Fn(T, T) -> T) -> Vec<T> {
    let mut upright = values.to_vec();
    for (row, &value) in upright[columns..].iter_mut().zip(values) {
        *row = pick(value, *row);
    }
    for (row, &value) in upright.iter_mut().zip(&values[columns..]) {
        *row = pick(value, *row);
    }
    let mut all = upright.clone();
    for (row, upright) in all.chunks_exact_mut(columns).zip(upright.chunks_exact(columns)) {
        for (place, &value) in row[1..].iter_mut().zip(upright) {
            *place = pick(value, *place);
        }
        for (place, &value) in row.iter_mut().zip(&upright[1..]) {
            *place = pick(value, *place);
        }
    }
    all
}

/// The first if it is less, else the second.
fn lesser<T: Level>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The first if it is greater, else the second.
fn greater<T: Level>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// Every tile's level, missing ones taken from the coarsest-necessary average of their surroundings.
fn inherited(levels: Vec<Option<f64>>, columns: usize, rows: usize) -> Vec<f64> {
    if levels.iter().all(Option::is_some) || columns * rows == 1 {
        return levels.into_iter().map(|level| level.unwrap_or(0.0)).collect();
    }
    let (coarse_columns, coarse_rows) = (columns.div_ceil(2), rows.div_ceil(2));
    let mut sums = vec![(0.0, 0.0); coarse_columns * coarse_rows];
    for (place, level) in levels.iter().enumerate() {
        if let Some(level) = level {
            let sum = &mut sums[place / columns / 2 * coarse_columns + place % columns / 2];
            *sum = (sum.0 + level, sum.1 + 1.0);
        }
    }
    let means = sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect();
    let coarse = inherited(means, coarse_columns, coarse_rows);
    let parent = |place: usize| coarse[place / columns / 2 * coarse_columns + place % columns / 2];
    levels.into_iter().enumerate().map(|(place, level)| level.unwrap_or_else(|| parent(place))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_follows_the_light() {
        // Stripes of 20 % and 80 % reflectance, 8 px wide, under light that falls to a fifth across the
        // image.
        let light = |x: usize| 1.0 - 0.8 * x as f32 / 639.0;
        let image = Raster::from_fn(640, 64, |x, _| light(x) * if x / 8 % 2 == 0 { 0.2 } else { 0.8 });
        let thresholds = Thresholds::of(&image).unwrap();
        for (column, (level, side)) in thresholds.row(1).enumerate().skip(1).take(37) {
            let light = light(column * TILE_PX + 8);
            assert!(0.2 * light < level && level < 0.8 * light, "column {column}");
            assert_eq!(side, Side::Mixed);
        }
    }

    #[test]
    fn the_inside_of_a_large_mark_inherits_its_edges_threshold() {
        let image = Raster::from_fn(400, 400, |x, y| {
            let (dx, dy) = (x as i64 - 200, y as i64 - 200);
            if dx * dx + dy * dy < 120 * 120 { 30u8 } else { 200 }
        });
        let thresholds = Thresholds::of(&image).unwrap();
        let (level, side) = thresholds.row(12).nth(12).unwrap();
        assert_eq!((level, side), (115, Side::Dark));
        assert_eq!(thresholds.row(0).next().unwrap().1, Side::Bright);
    }

    #[test]
    fn an_image_of_one_level_has_no_threshold() {
        assert_eq!(Thresholds::of(&Raster::filled(100, 100, 7u8)), None);
        assert_eq!(Thresholds::of(&Raster::filled(0, 0, 7u8)), None);
        assert_eq!(Thresholds::of(&Raster::filled(64, 64, f32::NAN)), None);
    }
}
