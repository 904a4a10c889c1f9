//! The connected parts of a map: boxes that can be reached from each other in 4-connected steps.

use super::{Cell, GridMap, UnknownPolicy};

/// The 4-connected components of a map's free boxes.
///
/// Components are numbered from 0 in the order of their first box, row by row from the bottom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    width: u32,
    /// Component of each box, row by row from the bottom, or `BLOCKED`.
    label: Vec<u32>,
    /// Number of boxes of each component.
    sizes: Vec<usize>,
}

/// Label of a box that is not free.
const BLOCKED: u32 = u32::MAX;
/// Label of a free box that is in no component yet.
const UNLABELED: u32 = u32::MAX - 1;

impl Components {
    /// Returns the component of a box, or `None` where it is not free.
    pub fn label_at(&self, col: u32, row: u32) -> Option<u32> {
        let label = self.label[row as usize * self.width as usize + col as usize];
        (label != BLOCKED).then_some(label)
    }

    /// Returns the number of boxes of each component; its index is the component's number.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Returns the component with the most boxes, of several the first; `None` without a free box.
    pub fn largest(&self) -> Option<u32> {
        let largest = self.sizes.iter().max()?;
        self.sizes.iter().position(|size| size == largest).and_then(|i| u32::try_from(i).ok())
    }

    /// Returns the number of boxes of the largest component; 0 without a free box.
    pub fn largest_size(&self) -> usize {
        self.sizes.iter().copied().max().unwrap_or(0)
    }

    /// Labels all boxes that are connected to the box at `seed` as a new component.
    fn flood_fill(&mut self, seed: usize) {
        let component = self.sizes.len() as u32;
        let mut pending = vec![seed];
        let mut size = 0;
        self.label[seed] = component;
        while let Some(index) = pending.pop() {
            size += 1;
            let neighbors = neighbors(index, self.width as usize, self.label.len());
            for neighbor in neighbors.into_iter().flatten() {
                if self.label[neighbor] == UNLABELED {
                    self.label[neighbor] = component;
                    pending.push(neighbor);
                }
            }
        }
        self.sizes.push(size);
    }
}

/// Returns the boxes east, north, west and south of the box at `index`, where the map has them.
fn neighbors(index: usize, width: usize, boxes: usize) -> [Option<usize>; 4] {
    let col = index % width;
    [
        (col + 1 < width).then(|| index + 1),
        (index + width < boxes).then(|| index + width),
        (col > 0).then(|| index - 1),
        index.checked_sub(width),
    ]
}

impl GridMap {
    /// Returns the 4-connected components of the free boxes; `unknown` decides on unknown boxes
    /// (with [`UnknownPolicy::Keep`] they are not free).
    pub fn components(&self, unknown: UnknownPolicy) -> Components {
        let label = self
            .cells()
            .iter()
            .map(|&cell| match unknown.apply(cell) {
                Cell::Free => UNLABELED,
                Cell::Wall | Cell::Unknown => BLOCKED,
            })
            .collect();
        let mut components = Components { width: self.width(), label, sizes: Vec::new() };
        for seed in 0..components.label.len() {
            if components.label[seed] == UNLABELED {
                components.flood_fill(seed);
            }
        }
        components
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Cell::{Free, Unknown, Wall};

    #[test]
    fn boxes_that_touch_at_a_corner_only_are_apart() {
        let map = GridMap::new(2, 2, 1.0, vec![Free, Wall, Wall, Free]);
        let components = map.components(UnknownPolicy::Wall);
        assert_eq!(components.sizes(), [1, 1]);
        assert_eq!(components.label_at(0, 0), Some(0));
        assert_eq!(components.label_at(1, 1), Some(1));
        assert_eq!(components.label_at(1, 0), None);
    }

    #[test]
    fn unknown_boxes_join_only_where_they_are_free() {
        let map = GridMap::new(3, 1, 1.0, vec![Free, Unknown, Free]);
        assert_eq!(map.components(UnknownPolicy::Wall).sizes(), [1, 1]);
        assert_eq!(map.components(UnknownPolicy::Keep).sizes(), [1, 1]);
        assert_eq!(map.components(UnknownPolicy::Free).sizes(), [3]);
    }

    #[test]
    fn the_east_edge_does_not_touch_the_west_edge_of_the_next_row() {
        let map = GridMap::new(2, 2, 1.0, vec![Wall, Free, Free, Wall]);
        assert_eq!(map.components(UnknownPolicy::Wall).sizes(), [1, 1]);
    }

    #[test]
    fn the_largest_of_equals_is_the_first_and_none_without_free_boxes() {
        let map = GridMap::new(5, 1, 1.0, vec![Free, Wall, Free, Wall, Free]);
        assert_eq!(map.components(UnknownPolicy::Wall).largest(), Some(0));
        let walls = GridMap::new(1, 1, 1.0, vec![Wall]).components(UnknownPolicy::Wall);
        assert_eq!((walls.largest(), walls.largest_size()), (None, 0));
    }
}
