//! `calibench calibrate`: a camera from a corner file or from photographs, or a plane map from a file of
//! point pairs.

use super::source::{last_part, unended};
use super::{Exit, warn};
use calibench::board::View;
use calibench::io::ShownPath;
use calibench::io::read_named_table;
use calibench::io::table::columns;
use calibench::io::{misplaced_marks, parse_corners};
use calibench::photos::BoardSpec;
use contradictions::Input;
use observed::Observed;
use std::path::{Path, PathBuf};

mod advice;
mod before_after;
mod camera;
mod contradictions;
mod finished;
mod gallery;
mod html;
mod maps;
mod measured;
mod measured_page;
mod measured_report;
mod models;
mod observed;
mod optics;
mod options;
mod page;
mod photographs;
mod plane;
mod plane_page;
mod plots;
mod poses;
mod scatter;
mod view_names;
mod worst;

pub(crate) use camera::refuse_views_outside;

pub(super) use options::{Arguments, Mode, parse_size};
pub(super) use plane::plane_text;
pub(super) use plane_page::PlaneReport;
pub(super) use plots::round_down;

pub(super) fn run(arguments: &Arguments) -> Exit {
    let outcome = match (&arguments.board, &arguments.files[..]) {
        (Some(board), photos) => contradictions::refuse(arguments, Input::Photographs)
            .and_then(|()| photographs::run(arguments, board, photos)),
        (None, [file]) => from_table(arguments, file),
        (None, files) => Err(format!(
            "{} files but no --board: give one CSV file, or the board that the photographs show",
            files.len()
        )),
    };
    outcome.unwrap_or_else(|message| {
        warn(&message);
        Exit::Usage
    })
}

/// Corners or point pairs, told apart by the names of their columns.
fn from_table(arguments: &Arguments, file: &Path) -> Result<Exit, String> {
    if let Some(target) = &arguments.target {
        contradictions::refuse(arguments, Input::Measured)?;
        return measured::run(arguments, file, target);
    }
    let bytes = read_named_table(file).map_err(|error| error.to_string())?;
    let name = if file.as_os_str() == "-" { "standard input".into() } else { file.shown() };
    let columns = columns(&bytes);
    let has = |names: &[&str]| names.iter().all(|name| columns.iter().any(|column| column == name));
    if has(&["px"]) && !has(&["view", "u", "v"]) {
        contradictions::refuse(arguments, Input::PointPairs)?;
        unended(&name, &bytes).iter().for_each(|said| warn(&format!("warning: {said}")));
        return plane::run(arguments, &name, &bytes);
    }
    contradictions::refuse(arguments, Input::Corners)?;
    let corners = parse_corners(&name, bytes.as_slice()).map_err(|error| error.to_string())?;
    let flat = has(&["Z"]).then(|| {
        format!("{name}: its column Z is not read, and every mark taken for one of a plane: --target takes marks in space, `calibench tsai` one view of them")
    });
    let misplaced = misplaced_marks(&name, &bytes).map_err(|error| error.to_string())?;
    let notes = unended(&name, &bytes).into_iter().chain(flat).chain(misplaced).collect();
    let observed = Observed {
        title: if file.as_os_str() == "-" { name.clone() } else { last_part(file) },
        unit: "target units".to_string(),
        source: name,
        given: corners.view_names.clone(),
        places: (0..corners.views.len()).collect(),
        names: corners.view_names,
        views: corners.views,
        image_size: arguments.image_size,
        notes,
        ..Observed::default()
    };
    camera::run(arguments, observed)
}

/// Views of a board, for verbs that judge a camera: from a corner file, or with a board from photographs.
#[derive(Debug)]
pub(super) struct Views {
    pub(super) source: String,
    pub(super) names: Vec<String>,
    pub(super) views: Vec<View>,
    /// The board whose discs' bias is to be corrected.
    pub(super) discs: Option<calibench::board::Board>,
    /// Mean level of each photograph over the board; none of a corner file.
    pub(super) light: Vec<f64>,
}

/// Reads them.
pub(super) fn views_of(
    files: &[PathBuf],
    board: Option<&BoardSpec>,
    image_size: Option<(usize, usize)>,
    memory: u64,
) -> Result<Views, String> {
    if let Some(board) = board {
        let reading = photographs::Reading { image_size, memory, overlays: None };
        let Observed { source, names, views, discs, notes, light, .. } = reading.observe(board, files)?;
        notes.iter().for_each(|note| warn(&format!("warning: {note}")));
        return Ok(Views { source, names, views, discs, light });
    }
    let [file] = files else {
        return Err(format!(
            "{} files but no --board: give one CSV file, or the board that the photographs show",
            files.len()
        ));
    };
    let bytes = read_named_table(file).map_err(|error| error.to_string())?;
    let source = file.shown();
    unended(&source, &bytes).iter().for_each(|said| warn(&format!("warning: {said}")));
    let corners = parse_corners(&source, bytes.as_slice()).map_err(|error| error.to_string())?;
    let misplaced = misplaced_marks(&source, &bytes).map_err(|error| error.to_string())?;
    misplaced.iter().for_each(|said| warn(&format!("warning: {said}")));
    Ok(Views { source, names: corners.view_names, views: corners.views, discs: None, light: Vec::new() })
}
