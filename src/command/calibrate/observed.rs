//! What was seen, and where does it come from?

use calibench::board::{Board, View};
use calibench::detect::Orientation;
use calibench::io::LeftOut;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Views and where they come from.
#[derive(Debug, Default)]
pub(super) struct Observed {
    /// What errors call the input.
    pub(super) source: String,
    /// What the page calls it.
    pub(super) title: String,
    /// Unit of lengths on the board.
    pub(super) unit: String,
    /// Names of all that was given, the views and what was left out.
    pub(super) given: Vec<String>,
    /// The photographs, if those were given.
    pub(super) photos: Vec<PathBuf>,
    /// One name a view.
    pub(super) names: Vec<String>,
    /// The place of each view in what was given.
    pub(super) places: Vec<usize>,
    pub(super) views: Vec<View>,
    pub(super) image_size: Option<(usize, usize)>,
    /// How far photographs tell which mark is the board's first.
    pub(super) orientation: Option<Orientation>,
    /// Mean level of each photograph over the board.
    pub(super) light: Vec<f64>,
    /// The board whose discs' bias is to be corrected.
    pub(super) discs: Option<Board>,
    /// Input that gave no view.
    pub(super) left_out: Vec<LeftOut>,
    /// Its places in what was given.
    pub(super) left_out_places: Vec<usize>,
    /// Pictures by their photographs' places: paths relative to the output folder.
    pub(super) overlays: BTreeMap<usize, String>,
    /// Why one of these could not be written, the first of them.
    pub(super) unwritten: Option<String>,
    /// What a reader must know about the input.
    pub(super) notes: Vec<String>,
}
