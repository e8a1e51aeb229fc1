//! Which mark stands at this place of a growing lattice? A table of places, for a lattice is asked many times
//! a mark.

use crate::detect::lattice::{Lattice, Place};

/// Places along each side of the table; the first mark stands in its middle.
const SIDE: i32 = 128;

/// No mark.
const EMPTY: u32 = u32::MAX;

/// Marks by place.
pub struct Places {
    cells: Vec<u32>,
    filled: Vec<Place>,
}

fn cell((i, j): Place) -> Option<usize> {
    let (x, y) = (i + SIDE / 2, j + SIDE / 2);
    let inside = (0..SIDE).contains(&x) && (0..SIDE).contains(&y);
    inside.then_some((y * SIDE + x) as usize)
}

impl Places {
    pub fn new() -> Places {
        Places { cells: vec![EMPTY; (SIDE * SIDE) as usize], filled: Vec::new() }
    }

    /// Number of marks.
    pub fn len(&self) -> usize {
        self.filled.len()
    }

    pub fn get(&self, place: Place) -> Option<usize> {
        let mark = self.cells[cell(place)?];
        (mark != EMPTY).then_some(mark as usize)
    }

    /// Sets a mark at an empty place; `false` where the place is outside the table.
    pub fn insert(&mut self, place: Place, mark: usize) -> bool {
        let Some(cell) = cell(place) else { return false };
        self.cells[cell] = mark as u32;
        self.filled.push(place);
        true
    }

    /// Places with marks, in the order in which they came.
    pub fn filled(&self) -> &[Place] {
        &self.filled
    }

    /// Empties the table.
    pub fn take(&mut self) -> Lattice {
        let lattice = self.filled.iter().filter_map(|&place| Some((place, self.get(place)?))).collect();
        for place in self.filled.drain(..) {
            if let Some(cell) = cell(place) {
                self.cells[cell] = EMPTY;
            }
        }
        lattice
    }
}
