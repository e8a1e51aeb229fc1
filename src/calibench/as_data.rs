//! Boards, views, lenses and intervals as data of serde. What cannot be, such as a view with more points than
//! pixels, is refused when it is read.
//!
//! Other types derive it where they are defined. The files of these are ones of which a changed line makes
//! committed measurements stale.

use crate::board::{Arrangement, Board, Pattern, View};
use crate::camera::{Lens, Model, Parameter};
use crate::evaluate::difference::PixelDifference;
use crate::evaluate::{FrameDifference, Interval};
use crate::geometry::{Pose, Vec2};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;

/// A type goes as another one, which is made of a reference to it and from which it is made again or refused.
macro_rules! as_data {
    ($of:ty, $data:ty) => {
        impl Serialize for $of {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                <$data>::from(self).serialize(to)
            }
        }

        impl<'a> Deserialize<'a> for $of {
            fn deserialize<D: Deserializer<'a>>(from: D) -> Result<$of, D::Error> {
                <$data>::deserialize(from)?.try_into().map_err(D::Error::custom)
            }
        }
    };
}

#[derive(Serialize, Deserialize)]
#[serde(rename = "View")]
struct ViewData {
    points: Vec<Vec2>,
    pixels: Vec<Vec2>,
    weights: Option<Vec<f64>>,
}

as_data!(View, ViewData);

impl From<&View> for ViewData {
    fn from(view: &View) -> ViewData {
        let (points, pixels) = (view.points().to_vec(), view.pixels().to_vec());
        ViewData { points, pixels, weights: view.weights().map(<[f64]>::to_vec) }
    }
}

impl TryFrom<ViewData> for View {
    type Error = crate::board::ViewError;

    fn try_from(data: ViewData) -> Result<View, Self::Error> {
        let view = View::new(data.points, data.pixels)?;
        match data.weights {
            Some(weights) => view.with_weights(weights),
            None => Ok(view),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(rename = "Board")]
struct BoardData {
    columns: usize,
    rows: usize,
    spacing: f64,
    pattern: Pattern,
    arrangement: Arrangement,
}

as_data!(Board, BoardData);

impl From<&Board> for BoardData {
    fn from(board: &Board) -> BoardData {
        BoardData {
            columns: board.columns(),
            rows: board.rows(),
            spacing: board.spacing(),
            pattern: board.pattern(),
            arrangement: board.arrangement(),
        }
    }
}

impl TryFrom<BoardData> for Board {
    type Error = crate::board::BoardError;

    fn try_from(data: BoardData) -> Result<Board, Self::Error> {
        Board::arranged(data.columns, data.rows, data.spacing, data.pattern, data.arrangement)
    }
}

/// A lens by its model's name and its coefficients' names.
#[derive(Serialize, Deserialize)]
#[serde(rename = "Lens")]
struct LensData {
    model: Model,
    coefficients: BTreeMap<Parameter, f64>,
}

as_data!(Lens, LensData);

impl From<&Lens> for LensData {
    fn from(lens: &Lens) -> LensData {
        let names = lens.model().coefficients().iter().copied();
        LensData {
            model: lens.model(),
            coefficients: names.zip(lens.coefficients().iter().copied()).collect(),
        }
    }
}

impl TryFrom<LensData> for Lens {
    type Error = String;

    /// What is not named has the value of a lens without distortion.
    fn try_from(LensData { model, coefficients }: LensData) -> Result<Lens, String> {
        coefficients.into_iter().try_fold(Lens::ideal(model), |lens, (parameter, value)| {
            lens.with(parameter, value).ok_or_else(|| format!("the {model} model has no {parameter}"))
        })
    }
}

/// A type goes by what is told of its fields or variants here, which are all there is to it.
macro_rules! as_told {
    ($($of:ty: $told:ty),*) => {
        $(
            impl Serialize for $of {
                fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                    <$told>::serialize(self, to)
                }
            }

            impl<'a> Deserialize<'a> for $of {
                fn deserialize<D: Deserializer<'a>>(from: D) -> Result<$of, D::Error> {
                    <$told>::deserialize(from)
                }
            }
        )*
    };
}

as_told!(
    Pattern: PatternTold,
    Arrangement: ArrangementTold,
    Interval: IntervalTold,
    PixelDifference: PixelDifferenceTold,
    FrameDifference: FrameDifferenceTold
);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Pattern", rename_all = "kebab-case")]
enum PatternTold {
    Circles { diameter: f64 },
    Chessboard,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Arrangement", rename_all = "kebab-case")]
enum ArrangementTold {
    Square,
    Asymmetric,
    Hexagonal,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Interval")]
struct IntervalTold {
    low: f64,
    high: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "PixelDifference")]
struct PixelDifferenceTold {
    pixel: Vec2,
    difference: Vec2,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "FrameDifference")]
struct FrameDifferenceTold {
    nodes: Vec<PixelDifference>,
    b_from_a: Pose,
    rms_px: f64,
}

#[cfg(all(test, feature = "io"))]
mod tests;
