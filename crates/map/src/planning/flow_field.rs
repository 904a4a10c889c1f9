//! The direction to the nearest goal from every box, in half a byte per box.

use super::{Distances, FreeSpace, STEPS};

/// The first step of a shortest 4-connected path to the nearest goal, and the difference in distance
/// to each neighbor, for every box of a grid.
///
/// Neighbors differ by at most one step, so the distance modulo 3 shows which of them is
/// nearer to the goal, and a box takes four bits.
///
/// Of several shortest paths it follows the one with the lowest direction of its step (0 east, 1
/// north, 2 west, 3 south), so it depends neither on the order of the goals nor on that of the
/// search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FlowField {
    width: u32,
    height: u32,
    /// One code per box, row by row from the bottom; even boxes in the low half of a byte.
    codes: Vec<u8>,
}

/// Code of a goal; the codes below are `direction + 4 * (distance % 3)`.
const GOAL: u8 = 12;
/// Code of a box without a path to a goal.
const UNREACHABLE: u8 = 13;

impl FlowField {
    /// Computes the field for a body of `size` x `size` boxes that has to fit into `free` along its
    /// path to the nearest of `goals` (column, row); boxes and goals mean its lower-left box. Goals
    /// where the body does not fit do not count.
    ///
    /// # Panics
    /// When `size` is 0.
    pub fn to_nearest(free: &FreeSpace, size: u32, goals: &[(u32, u32)]) -> Self {
        Self::from_distances(&Distances::to_nearest(free, size, goals))
    }

    /// Computes the field that descends along `distances`.
    pub fn from_distances(distances: &Distances) -> Self {
        let width = distances.width();
        let height = distances.height();
        let boxes = distances.as_slice().len();
        let mut field = Self { width, height, codes: vec![0; boxes.div_ceil(2)] };
        for row in 0..height {
            for col in 0..width {
                field.set(col, row, code(distances, col, row));
            }
        }
        field
    }

    /// Returns the direction of the next step: 0 east, 1 north, 2 west, 3 south. `None` at a goal,
    /// where no path leads to one, and outside the grid.
    pub fn direction(&self, col: u32, row: u32) -> Option<u8> {
        self.code(col, row).filter(|&code| code < GOAL).map(|code| code % 4)
    }

    /// Returns how many steps farther from the nearest goal the neighbor in a direction is: -1, 0
    /// or 1. `None` where no path leads from one of the two boxes to a goal.
    pub fn rise(&self, col: u32, row: u32, direction: u8) -> Option<i8> {
        let (east, north) = STEPS[usize::from(direction % 4)];
        let here = self.code(col, row)?;
        let there = self.code(col.wrapping_add_signed(east), row.wrapping_add_signed(north))?;
        RISES[distance_mod_3(here)][distance_mod_3(there)]
    }

    /// Returns whether the box is one of the goals.
    pub fn is_goal(&self, col: u32, row: u32) -> bool {
        self.code(col, row) == Some(GOAL)
    }

    /// Returns whether a path leads from the box to a goal; a goal reaches itself.
    pub fn reaches_goal(&self, col: u32, row: u32) -> bool {
        self.code(col, row).is_some_and(|code| code != UNREACHABLE)
    }

    /// Number of columns of the grid.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of rows of the grid.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the part of `SIDE` x `SIDE` boxes whose lower-left one is in this column and row. It may reach beyond the
    /// grid: from there no path leads to a goal.
    pub fn window<const SIDE: usize>(&self, west: i32, south: i32) -> FlowWindow<SIDE> {
        let mut codes = [[UNREACHABLE; SIDE]; SIDE];
        for (codes_of_row, row) in codes.iter_mut().zip(south..) {
            for (code, col) in codes_of_row.iter_mut().zip(west..) {
                // A number below zero becomes one beyond every grid.
                *code = self.code(col as u32, row as u32).unwrap_or(UNREACHABLE);
            }
        }
        FlowWindow { codes }
    }

    fn code(&self, col: u32, row: u32) -> Option<u8> {
        if col >= self.width || row >= self.height {
            return None;
        }
        let index = self.index(col, row);
        Some(self.codes[index / 2] >> (index % 2 * 4) & 0xf)
    }

    /// Writes the code of a box that still has code 0.
    fn set(&mut self, col: u32, row: u32, code: u8) {
        let index = self.index(col, row);
        self.codes[index / 2] |= code << (index % 2 * 4);
    }

    fn index(&self, col: u32, row: u32) -> usize {
        row as usize * self.width as usize + col as usize
    }
}

/// A square part of a [`FlowField`], for a search that reads each of its boxes many times. Columns and rows are counted
/// from its lower-left box.
#[derive(Debug, Clone)]
pub struct FlowWindow<const SIDE: usize> {
    codes: [[u8; SIDE]; SIDE],
}

impl<const SIDE: usize> FlowWindow<SIDE> {
    /// Returns what [`FlowField::direction`] does.
    ///
    /// # Panics
    /// Outside of the window.
    #[inline]
    pub fn direction(&self, col: usize, row: usize) -> Option<u8> {
        Some(self.codes[row][col]).filter(|&code| code < GOAL).map(|code| code % 4)
    }

    /// Returns what [`FlowField::rise`] does in each direction.
    ///
    /// # Panics
    /// At the edge of the window, and outside of it.
    #[inline]
    pub fn rises(&self, col: usize, row: usize) -> [Option<i8>; 4] {
        let distance = |col: usize, row: usize| distance_mod_3(self.codes[row][col]);
        let rises = &RISES[distance(col, row)];
        [
            rises[distance(col + 1, row)],
            rises[distance(col, row + 1)],
            rises[distance(col - 1, row)],
            rises[distance(col, row - 1)],
        ]
    }

    /// Returns whether a box is one of the goals.
    ///
    /// # Panics
    /// Outside of the window.
    #[inline]
    pub fn is_goal(&self, col: usize, row: usize) -> bool {
        self.codes[row][col] == GOAL
    }
}

/// See [`distance_mod_3`].
const DISTANCE_MOD_3: [u8; 16] = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 0, 3, 3, 3];

/// The rise by the distances here and there modulo 3, which differ by at most one; 3 is no path.
const RISES: [[Option<i8>; 4]; 4] = [
    [Some(0), Some(1), Some(-1), None],
    [Some(-1), Some(0), Some(1), None],
    [Some(1), Some(-1), Some(0), None],
    [None; 4],
];

/// Returns the distance to the goal modulo 3 by the code of a box; 3 without a path.
#[inline]
fn distance_mod_3(code: u8) -> usize {
    usize::from(DISTANCE_MOD_3[usize::from(code)])
}

fn code(distances: &Distances, col: u32, row: u32) -> u8 {
    match distances.steps(col, row) {
        None => UNREACHABLE,
        Some(0) => GOAL,
        Some(steps) => downhill(distances, (col, row), steps - 1) + 4 * (steps % 3) as u8,
    }
}

/// Returns the lowest direction to a neighbor that is `steps` away from the goal.
fn downhill(distances: &Distances, (col, row): (u32, u32), steps: u32) -> u8 {
    let direction = STEPS.iter().position(|&(east, north)| {
        let neighbor =
            distances.steps(col.wrapping_add_signed(east), row.wrapping_add_signed(north));
        neighbor == Some(steps)
    });
    direction.expect("a box that is n > 0 steps away has a neighbor that is n - 1 away") as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn open(width: u32, height: u32) -> FreeSpace {
        FreeSpace::new(width, height, |_, _| true)
    }

    #[test]
    fn of_equal_ways_the_lowest_direction_is_taken() {
        let field = FlowField::to_nearest(&open(3, 3), 1, &[(1, 1)]);
        let row = |row| [0, 1, 2].map(|col| field.direction(col, row));
        assert_eq!(row(0), [Some(0), Some(1), Some(1)]);
        assert_eq!(row(1), [Some(0), None, Some(2)]);
        assert_eq!(row(2), [Some(0), Some(3), Some(2)]);
    }

    #[test]
    fn goals_unreachable_boxes_and_the_outside_have_no_direction() {
        let free = FreeSpace::new(4, 1, |col, _| col != 2);
        let field = FlowField::to_nearest(&free, 1, &[(1, 0), (2, 0)]);
        assert!(field.is_goal(1, 0) && field.reaches_goal(1, 0) && field.reaches_goal(0, 0));
        assert!(!field.is_goal(2, 0) && !field.reaches_goal(2, 0) && !field.reaches_goal(3, 0));
        let directions = [0, 1, 2, 3, 4].map(|col| field.direction(col, 0));
        assert_eq!(directions, [Some(0), None, None, None, None]);
        assert_eq!(field.direction(0, 1), None);
    }

    proptest! {
        #[test]
        fn following_the_field_reaches_a_goal_in_as_many_steps_as_the_distance_says(
            width in 1u32..15, height in 1u32..15, size in 1u32..3, walls in any::<[u128; 2]>(),
            goals in proptest::collection::vec((0u32..15, 0u32..15), 0..4),
        ) {
            let is_wall = |col, row| walls.iter().all(|w| w.rotate_right(row * 15 + col) & 1 == 1);
            let free = FreeSpace::new(width, height, |col, row| !is_wall(col, row));
            let distances = Distances::to_nearest(&free, size, &goals);
            let field = FlowField::to_nearest(&free, size, &goals);
            let anchors = free.anchors(size);
            for (col, row) in (0..width).flat_map(|col| (0..height).map(move |row| (col, row))) {
                let (mut at, mut steps) = ((col, row), 0);
                while let Some(direction) = field.direction(at.0, at.1) {
                    let (east, north) = STEPS[direction as usize];
                    at = (at.0.wrapping_add_signed(east), at.1.wrapping_add_signed(north));
                    steps += 1;
                    prop_assert!(anchors.is_free(at.0, at.1));
                }
                prop_assert_eq!(field.is_goal(at.0, at.1), goals.contains(&at) && anchors.is_free(at.0, at.1));
                for (direction, (east, north)) in (0..).zip(STEPS) {
                    let there = distances.steps(col.wrapping_add_signed(east), row.wrapping_add_signed(north));
                    let rise = distances.steps(col, row).zip(there).map(|(a, b)| (i64::from(b) - i64::from(a)) as i8);
                    prop_assert_eq!(field.rise(col, row, direction), rise);
                }
                let window = field.window::<3>(col as i32 - 1, row as i32 - 1);
                prop_assert_eq!(window.direction(1, 1), field.direction(col, row));
                prop_assert_eq!(window.is_goal(1, 1), field.is_goal(col, row));
                let rises = [0, 1, 2, 3].map(|direction| field.rise(col, row, direction));
                prop_assert_eq!(window.rises(1, 1), rises);
                let expected = distances.steps(col, row);
                prop_assert_eq!(field.reaches_goal(col, row).then_some(steps), expected);
            }
        }
    }
}
