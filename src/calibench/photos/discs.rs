//! Where are a board's discs in a photograph, be they dark on bright ground or bright on dark?

use super::DetectError;
use crate::detect::{
    Blob, BlobOptions, GridError, Polarity, SeenBoard, blobs, refuse_larger, searched_blobs,
};
use crate::geometry::Vec2;
use crate::io::Grey;
use crate::raster::{Level, Raster};

/// A board that was not found, and what might have been its marks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct NotFound {
    /// Why.
    pub reason: DetectError,
    /// Centres of the discs that were seen but do not make the board, px; none for a chessboard.
    pub candidates_px: Vec<Vec2>,
}

/// The discs of a photograph in the order that `order` gives them. Dark ones are tried first, then bright
/// ones; where neither makes the board, both are searched for once more, harder ([`searched_blobs`]), unless
/// another complete board of as many discs was seen: a harder look that then finds the board has lost a row
/// of the other.
///
/// # Errors
/// Neither makes the board: the reason of whichever kind has more discs.
pub fn ordered_discs<Ordered>(
    photo: &Grey,
    order: impl Fn(&[Blob]) -> Result<Ordered, GridError>,
) -> Result<Ordered, NotFound> {
    match photo {
        Grey::U8(image) => of_either_polarity(image, order),
        Grey::U16(image) => of_either_polarity(image, order),
        Grey::F32(image) => of_either_polarity(image, order),
    }
}

/// A board that was found, unless more of it stands beyond a side ([`refuse_larger`]); `period` is 1 or,
/// where rows are staggered, 2.
///
/// # Errors
/// It goes on.
pub(super) fn alone(photo: &Grey, board: SeenBoard, period: usize) -> Result<SeenBoard, NotFound> {
    let candidates_px = board.seen().map(|(_, place)| place).collect();
    let alone = match photo {
        Grey::U8(image) => refuse_larger(image, board, period),
        Grey::U16(image) => refuse_larger(image, board, period),
        Grey::F32(image) => refuse_larger(image, board, period),
    };
    alone.map_err(|reason| NotFound { reason: reason.into(), candidates_px })
}

fn of_either_polarity<T: Level, Ordered>(
    image: &Raster<T>,
    order: impl Fn(&[Blob]) -> Result<Ordered, GridError>,
) -> Result<Ordered, NotFound> {
    let of = |find: fn(&Raster<T>, &BlobOptions) -> Vec<Blob>, polarity| {
        let discs = find(image, &BlobOptions { polarity, ..BlobOptions::default() });
        order(&discs).map_err(|reason| NotFound {
            reason: reason.into(),
            candidates_px: discs.iter().map(|disc| disc.centre_px).collect(),
        })
    };
    let of_either = |find| {
        of(find, Polarity::Dark).or_else(|dark| {
            of(find, Polarity::Bright).map_err(|bright| {
                if bright.candidates_px.len() > dark.candidates_px.len() { bright } else { dark }
            })
        })
    };
    of_either(blobs).or_else(|first| match &first.reason {
        DetectError::Grid(reason) if reason.is_other_board() => Err(first),
        _ => of_either(searched_blobs).map_err(|_| first),
    })
}
