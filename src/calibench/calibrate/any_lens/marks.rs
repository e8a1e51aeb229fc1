//! What does one view give the kernel? Marks in blocks of four: place on the board, pixel, weight.

use super::super::target_frame::{TargetFrame, TargetFrames};
use super::shape;
use crate::board::View;
use crate::geometry::lanes::LANES;
use crate::geometry::{Vec2, Vec3};

/// Four marks, coordinate by coordinate, in the frame in which targets are refined.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub x: [f64; LANES],
    pub y: [f64; LANES],
    /// Height per unit of each of the board's three deformations.
    pub height: [[f64; LANES]; 3],
    pub u: [f64; LANES],
    pub v: [f64; LANES],
    /// 0 in the lanes after the last mark, which repeat it.
    pub weight: [f64; LANES],
}

const EMPTY: Block = Block {
    x: [0.0; LANES],
    y: [0.0; LANES],
    height: [[0.0; LANES]; 3],
    u: [0.0; LANES],
    v: [0.0; LANES],
    weight: [0.0; LANES],
};

/// One mark.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark {
    /// Place on the plane.
    pub point: Vec2,
    /// Height per unit of each deformation.
    pub height: [f64; 3],
    pub pixel: Vec2,
    pub weight: f64,
}

impl Mark {
    /// Where it is on a board of this shape.
    pub fn on_board(&self, shape: &[f64; 3]) -> Vec3 {
        let height: f64 = self.height.iter().zip(shape).map(|(h, s)| h * s).sum();
        Vec3::new(self.point.x, self.point.y, height)
    }
}

/// The marks of a view.
#[derive(Debug, Clone)]
pub(super) struct Marks {
    pub list: Vec<Mark>,
    pub blocks: Vec<Block>,
}

impl Marks {
    /// Those of a view; `region` is the box around all marks of the board, in its own unit.
    pub fn of(view: &View, frame: &TargetFrame, region: &[Vec2; 2]) -> Marks {
        let weight = |i: usize| view.weights().map_or(1.0, |weights| weights[i]);
        let list: Vec<Mark> = view
            .pairs()
            .enumerate()
            .map(|(i, (point, pixel))| Mark {
                point: frame.of_point(point),
                height: shape::basis(region, point).map(|h| h / frame.scale()),
                pixel: *pixel,
                weight: weight(i),
            })
            .collect();
        Marks::of_list(list)
    }

    /// Marks in blocks.
    pub fn of_list(list: Vec<Mark>) -> Marks {
        let blocks = list.chunks(LANES).map(block).collect();
        Marks { list, blocks }
    }

    pub fn len(&self) -> usize {
        self.list.len()
    }
}

/// The marks of all views.
pub(super) fn of_views(views: &[View], frames: &TargetFrames, region: &[Vec2; 2]) -> Vec<Marks> {
    let of_view = |(index, view)| Marks::of(view, frames.at(index), region);
    views.iter().enumerate().map(of_view).collect()
}

fn block(marks: &[Mark]) -> Block {
    let mut block = EMPTY;
    for lane in 0..LANES {
        let mark = marks[lane.min(marks.len() - 1)];
        (block.x[lane], block.y[lane]) = (mark.point.x, mark.point.y);
        (block.u[lane], block.v[lane]) = (mark.pixel.x, mark.pixel.y);
        for (row, height) in block.height.iter_mut().zip(mark.height) {
            row[lane] = height;
        }
        block.weight[lane] = if lane < marks.len() { mark.weight } else { 0.0 };
    }
    block
}
