//! Which photographs of a scene are shown, and what is true of them?

use super::bound::variance_px2;
use super::look::Photo;
use super::observed::Truth;
use super::scene::Scene;
use rayon::prelude::*;

/// The photographs of these trials, without those in which no pose fits.
pub(super) fn photographs(scene: &Scene, seed: u64, trials: &[u64]) -> Vec<(u64, Photo)> {
    let (board, name) = (scene.board(), scene.name());
    let photo = |&trial: &u64| Some((trial, scene.look.photo(&board, seed, &name, trial)?));
    trials.par_iter().filter_map(photo).collect()
}

/// What is true of them.
pub(super) fn truths(scene: &Scene, drawn: &[(u64, Photo)]) -> Vec<Truth> {
    let board = scene.board();
    let truth = |(_, photo): &(u64, Photo)| {
        Truth::of(photo, &board, |place, cell| match scene.look.jpeg {
            // What a codec adds is no noise of the pixels.
            Some(_) => None,
            None => variance_px2(&photo.clean, place, cell, scene.look.noise),
        })
    };
    drawn.par_iter().map(truth).collect()
}
