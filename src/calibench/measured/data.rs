//! Which marks were seen where, and which of their coordinates are unknown? Names resolved into numbers.

use super::shape::Shape;
use super::{MeasuredError, MeasuredTarget, MeasuredView};
use crate::geometry::{Vec2, Vec3};

/// A mark in a view.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Number among the marks that were seen.
    pub mark: usize,
    pub pixel: Vec2,
    pub weight: f64,
}

/// Target and views. Marks that no view shows are left out.
#[derive(Debug, Clone)]
pub(super) struct Data {
    /// Place of each mark in the target's list.
    pub in_target: Vec<usize>,
    /// Measured positions from `centre`: rotations then move no far origin.
    pub positions: Vec<Vec3>,
    pub deviations: Vec<Vec3>,
    /// Number of each coordinate among the unknown ones; `None` for one that is exact.
    pub unknown: Vec<[Option<usize>; 3]>,
    /// Standard deviations of the unknown coordinates, in their order.
    pub unknown_deviations: Vec<f64>,
    pub views: Vec<Vec<Seen>>,
    /// In the target's coordinates.
    pub centre: Vec3,
}

/// Two pixels closer than this are one: noise puts a mark of another photograph farther away.
const SAME_PX: f64 = 1e-6;

impl Data {
    pub fn of(target: &MeasuredTarget, views: &[MeasuredView]) -> Result<Data, MeasuredError> {
        let mut is_seen = vec![false; target.marks().len()];
        let mut places: Vec<Vec<usize>> = Vec::with_capacity(views.len());
        for (view, seen) in views.iter().enumerate() {
            let place = |id: &String| {
                let unknown = || MeasuredError::UnknownMark { view, mark: id.clone() };
                target.position(id).ok_or_else(unknown)
            };
            let of_view: Vec<usize> = seen.marks().iter().map(|m| place(&m.id)).collect::<Result<_, _>>()?;
            of_view.iter().for_each(|&place| is_seen[place] = true);
            places.push(of_view);
        }
        let in_target: Vec<usize> = (0..is_seen.len()).filter(|&place| is_seen[place]).collect();
        let number = |place: &usize| in_target.binary_search(place).unwrap_or(0);
        let of_view = |(places, view): (&Vec<usize>, &MeasuredView)| {
            let seen = |(place, m): (&usize, &super::SeenMark)| Seen {
                mark: number(place),
                pixel: m.pixel,
                weight: m.weight,
            };
            let mut list: Vec<Seen> = places.iter().zip(view.marks()).map(seen).collect();
            list.sort_by_key(|seen| seen.mark);
            list
        };
        let views: Vec<Vec<Seen>> = places.iter().zip(views).map(of_view).collect();
        let marks = || in_target.iter().map(|&place| &target.marks()[place]);
        let raw: Vec<Vec3> = marks().map(|m| m.position).collect();
        let centre = Shape::of(&raw).centre;
        let deviations: Vec<Vec3> = marks().map(|m| m.standard_deviation).collect();
        let mut unknown_deviations = Vec::new();
        let unknown = deviations.iter().map(|sd| {
            [0, 1, 2].map(|axis| {
                (sd[axis] > 0.0).then(|| {
                    unknown_deviations.push(sd[axis]);
                    unknown_deviations.len() - 1
                })
            })
        });
        let unknown = unknown.collect();
        let positions = raw.iter().map(|p| p - centre).collect();
        Ok(Data { in_target, positions, deviations, unknown, unknown_deviations, views, centre })
    }

    /// Marks over all views.
    pub fn observations(&self) -> usize {
        self.views.iter().map(Vec::len).sum()
    }

    /// Marks with a coordinate that is not exact.
    pub fn uncertain_marks(&self) -> usize {
        self.unknown.iter().filter(|axes| axes.iter().any(Option::is_some)).count()
    }

    /// How the marks of a view lie.
    pub fn shape(&self, view: usize) -> Shape {
        Shape::of(&self.views[view].iter().map(|seen| self.positions[seen.mark]).collect::<Vec<_>>())
    }

    /// Some of the views.
    pub fn with_views(&self, chosen: &[usize]) -> Data {
        Data { views: chosen.iter().map(|&view| self.views[view].clone()).collect(), ..self.clone() }
    }

    /// Refuses a view that is given again.
    pub fn refuse_copies(&self) -> Result<(), MeasuredError> {
        let is_same = |a: &Seen, b: &Seen| a.mark == b.mark && (a.pixel - b.pixel).norm() < SAME_PX;
        for (view, list) in self.views.iter().enumerate() {
            let copies = |other: &Vec<Seen>| {
                other.len() == list.len() && other.iter().zip(list).all(|(a, b)| is_same(a, b))
            };
            if let Some(copy_of) = self.views[..view].iter().position(copies) {
                return Err(MeasuredError::RepeatedView { view, copy_of });
            }
        }
        Ok(())
    }
}
