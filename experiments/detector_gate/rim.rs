//! Which discs are far off: those beside the end of the sheet, or all of them?

use super::SEED;
use calibench::geometry::Vec2;
use calibench::io::Grey;
use calibench_detector_gate::protocol::Kind;
use calibench_detector_gate::{Cell, Photo, Scene, scenes, variance_px2};
use rayon::prelude::*;

/// Scenes in which it is asked: those where discs are far from the bound.
pub const SCENES: [&str; 5] = ["steep", "blurred", "moved", "very-blurred", "uneven-light"];
/// The first photographs of each.
pub const PHOTOS: u64 = 12;

/// Errors of some discs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Errors {
    squares_px2: f64,
    /// What the squares are at the bound.
    bound_px2: f64,
    discs: usize,
}

impl Errors {
    /// Root mean squared error over that of the bound.
    pub fn over_bound(&self) -> f64 {
        (self.squares_px2 / self.bound_px2).sqrt()
    }

    /// Root mean squared error of a coordinate, px.
    pub fn rms_px(&self) -> f64 {
        (self.squares_px2 / (2 * self.discs) as f64).sqrt()
    }

    fn add(&mut self, other: &Errors) {
        self.squares_px2 += other.squares_px2;
        self.bound_px2 += other.bound_px2;
        self.discs += other.discs;
    }
}

/// This library's errors in the discs of the first photographs of a scene: of those that have others all
/// around them, and of the outermost.
pub fn inner_and_outer(id: &str) -> Option<[Errors; 2]> {
    let scene = scenes().into_iter().find(|scene| scene.kind == Kind::Circles && scene.id == id)?;
    let of_photo = |trial| {
        let photo = scene.look.photo(&scene.board(), SEED, &scene.name(), trial)?;
        in_photo(&scene, trial, &photo)
    };
    let each: Vec<[Errors; 2]> = (0..PHOTOS).into_par_iter().filter_map(of_photo).collect();
    let mut both = [Errors::default(); 2];
    for [inner, outer] in &each {
        both[0].add(inner);
        both[1].add(outer);
    }
    Some(both)
}

fn in_photo(scene: &Scene, trial: u64, photo: &Photo) -> Option<[Errors; 2]> {
    let seen = scene.wanted(trial).spec().see(&Grey::U8(photo.image.clone())).ok()?;
    let (board, places) = (scene.board(), &photo.places_px);
    let (columns, rows) = (board.board().columns(), board.board().rows());
    let mut both = [Errors::default(); 2];
    for found in seen.places_px().iter().flatten() {
        // Whatever the order: a disc is nearest to its own place.
        let distance = |place: &Vec2| (place - found).norm();
        let nearest = places.iter().enumerate().map(|(i, place)| (i, distance(place)));
        let (i, error_px) = nearest.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let (column, row) = (i % columns, i / columns);
        let cell = Cell::of(&board, places, i);
        let variance = variance_px2(&photo.clean, &places[i], &cell, scene.look.noise)?;
        let is_outer = column == 0 || column + 1 == columns || row == 0 || row + 1 == rows;
        both[usize::from(is_outer)].add(&Errors {
            squares_px2: error_px * error_px,
            bound_px2: 2.0 * variance,
            discs: 1,
        });
    }
    Some(both)
}
