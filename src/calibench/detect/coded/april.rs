//! placeholder
use super::CodedError;
use super::layout::AprilGrid;
use crate::detect::SeenBoard;
use crate::raster::{Level, Raster};
/// todo
pub fn seen_april_grid<T: Level>(_image: &Raster<T>, _board: &AprilGrid) -> Result<SeenBoard, CodedError> {
    Err(CodedError::NoCorners { seen: 0 })
}
