//! The direction to the nearest goal from every box, and how much farther each neighbor is.

use super::lanes::{Lanes, OFF_LANE_COST};
use super::{Distances, FreeSpace, STEPS};
use std::sync::Arc;

/// The first step of a cheapest 4-connected path to the nearest goal, and the difference in cost to each neighbor, for
/// every box of a grid.
///
/// A step costs 1, and [`OFF_LANE_COST`] more where it leads off lane and not to a goal, if the field knows lanes. A box takes ten bits: its
/// cost modulo 254, of which neighbors have little more or less, and its direction.
///
/// Of several cheapest paths it follows the one with the lowest direction of its step (0 east, 1
/// north, 2 west, 3 south), so it depends neither on the order of the goals nor on that of the
/// search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FlowField {
    width: u32,
    height: u32,
    /// One cost per box, row by row from the bottom.
    costs: Vec<u8>,
    /// One direction per box, the lowest bits of a byte first.
    directions: Vec<u8>,
    lanes: Option<Arc<Lanes>>,
}

/// Costs are known modulo this number.
const MODULUS: u8 = 254;
/// Stands for the cost of a goal, which is 0.
const GOAL: u8 = 254;
/// Stands for the cost of a box without a path to a goal.
const UNREACHABLE: u8 = 255;

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

    /// Computes the field of paths that keep to the lanes, where that is not too far around.
    ///
    /// # Panics
    /// When `size` is 0, or where the lanes are those of another grid.
    pub fn along_lanes(
        free: &FreeSpace,
        size: u32,
        goals: &[(u32, u32)],
        lanes: &Arc<Lanes>,
    ) -> Self {
        let distances = Distances::along_lanes(free, size, goals, lanes);
        Self::new(&distances, Some(Arc::clone(lanes)))
    }

    /// Computes the field that descends along `distances`.
    pub fn from_distances(distances: &Distances) -> Self {
        Self::new(distances, None)
    }

    fn new(distances: &Distances, lanes: Option<Arc<Lanes>>) -> Self {
        let width = distances.width();
        let height = distances.height();
        let boxes = distances.as_slice().len();
        let costs = distances.as_slice().iter().map(|&steps| cost_code(steps)).collect();
        let mut field =
            Self { width, height, costs, directions: vec![0; boxes.div_ceil(4)], lanes };
        for row in 0..height {
            for col in 0..width {
                if let Some(direction) = field.lowest_descent(distances, col, row) {
                    let index = field.index(col, row);
                    field.directions[index / 4] |= direction << (index % 4 * 2);
                }
            }
        }
        field
    }

    /// Returns the direction of the next step: 0 east, 1 north, 2 west, 3 south. `None` at a goal,
    /// where no path leads to one, and outside the grid.
    pub fn direction(&self, col: u32, row: u32) -> Option<u8> {
        self.code(col, row).filter(|&code| code < MODULUS)?;
        let index = self.index(col, row);
        Some(self.directions[index / 4] >> (index % 4 * 2) & 3)
    }

    /// Returns by how much the neighbor in a direction is farther from the nearest goal, in steps; less than 0 where
    /// it is nearer. `None` where no path leads from one of the two boxes to a goal.
    pub fn rise(&self, col: u32, row: u32, direction: u8) -> Option<i8> {
        let here = self.code(col, row).filter(|&code| code != UNREACHABLE)?;
        let (col, row) = neighbor(col, row, direction);
        let there = self.code(col, row).filter(|&code| code != UNREACHABLE)?;
        Some(difference(here, there))
    }

    /// Returns what a cheapest path to the nearest goal costs, by going along it; 0 at a goal. `None` where no path
    /// leads to one, and outside the grid.
    pub fn cost(&self, col: u32, row: u32) -> Option<u32> {
        let mut at = (col, row);
        let mut sum = 0;
        while let Some(direction) = self.direction(at.0, at.1) {
            sum += u32::from(self.step_cost(at.0, at.1, direction));
            at = neighbor(at.0, at.1, direction);
        }
        self.is_goal(at.0, at.1).then_some(sum)
    }

    /// Returns by how much one box costs more than another one. Both must reach a goal. The value is right for two
    /// boxes with at most [`FlowField::MAX_COMPARABLE_STEPS`] steps between them.
    pub fn cost_difference(&self, from: (u32, u32), to: (u32, u32)) -> Option<i32> {
        let from = self.code(from.0, from.1).filter(|&code| code != UNREACHABLE)?;
        let to = self.code(to.0, to.1).filter(|&code| code != UNREACHABLE)?;
        Some(i32::from(difference(from, to)))
    }

    /// Steps over which the difference of costs is less than half of the number modulo which costs are known.
    pub const MAX_COMPARABLE_STEPS: u32 = (MODULUS as u32 / 2 - 1) / (1 + OFF_LANE_COST as u32);

    /// Returns whether a cheapest path begins with a step in this direction.
    pub fn descends(&self, col: u32, row: u32, direction: u8) -> bool {
        let is_goal = self.is_goal(col, row);
        let rise = self.rise(col, row, direction);
        !is_goal && rise == Some(-(self.step_cost(col, row, direction) as i8))
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

    /// Returns the lanes that its paths keep to, if it knows some.
    pub fn lanes(&self) -> Option<&Lanes> {
        self.lanes.as_deref()
    }

    /// Returns the part of `SIDE` x `SIDE` boxes whose lower-left one is in this column and row. It may reach beyond the
    /// grid: from there no path leads to a goal.
    pub fn window<const SIDE: usize>(&self, west: i32, south: i32) -> FlowWindow<SIDE> {
        let mut codes = [[UNREACHABLE; SIDE]; SIDE];
        let is_within = west >= 0 && west + SIDE as i32 <= self.width as i32;
        for (codes_of_row, row) in codes.iter_mut().zip(south..) {
            // A number below zero becomes one beyond every grid.
            if row as u32 >= self.height {
                continue;
            }
            if is_within {
                let first = self.index(west as u32, row as u32);
                codes_of_row.copy_from_slice(&self.costs[first..first + SIDE]);
                continue;
            }
            for (code, col) in codes_of_row.iter_mut().zip(west..) {
                *code = self.code(col as u32, row as u32).unwrap_or(UNREACHABLE);
            }
        }
        FlowWindow { codes }
    }

    /// Returns the price of a step: 1, and [`OFF_LANE_COST`] more where it leads off lane and not to a goal.
    pub fn step_cost(&self, col: u32, row: u32, direction: u8) -> u8 {
        let (col, row) = neighbor(col, row, direction);
        let lanes = self.lanes.as_ref();
        let is_off_lane = lanes.is_some_and(|lanes| lanes.is_off_lane(col, row, direction))
            && !self.is_goal(col, row);
        1 + OFF_LANE_COST * u8::from(is_off_lane)
    }

    fn lowest_descent(&self, distances: &Distances, col: u32, row: u32) -> Option<u8> {
        let here = distances.steps(col, row).filter(|&steps| steps > 0)?;
        (0..4).find(|&direction| {
            let (next_col, next_row) = neighbor(col, row, direction);
            let there = distances.steps(next_col, next_row);
            let step = u32::from(self.step_cost(col, row, direction));
            there.is_some_and(|there| there + step == here)
        })
    }

    fn code(&self, col: u32, row: u32) -> Option<u8> {
        if col >= self.width || row >= self.height {
            return None;
        }
        Some(self.costs[self.index(col, row)])
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
    /// Returns whether a path leads from each box of a row to a goal, a bit each from the west.
    ///
    /// # Panics
    /// Outside of the window.
    #[inline]
    pub fn reaching_goal(&self, row: usize) -> u32 {
        let mut bits = 0;
        for (col, &code) in self.codes[row].iter().enumerate() {
            bits |= u32::from(code != UNREACHABLE) << col;
        }
        bits
    }

    /// Returns which boxes of a row are goals, a bit each from the west.
    ///
    /// # Panics
    /// Outside of the window.
    #[inline]
    pub fn goals(&self, row: usize) -> u32 {
        let mut bits = 0;
        for (col, &code) in self.codes[row].iter().enumerate() {
            bits |= u32::from(code == GOAL) << col;
        }
        bits
    }

    /// Returns by how many steps a box is farther from the nearest goal than another one. Both must reach a goal. The
    /// value is right for two boxes that differ by at most 126.
    ///
    /// # Panics
    /// Outside of the window.
    #[inline]
    pub fn rise(&self, from: (usize, usize), to: (usize, usize)) -> i8 {
        difference(self.codes[from.1][from.0], self.codes[to.1][to.0])
    }
}

/// Returns the box beside another one; off the west or south edge it has a large number, which is off the grid, too.
fn neighbor(col: u32, row: u32, direction: u8) -> (u32, u32) {
    let (east, north) = STEPS[usize::from(direction % 4)];
    (col.wrapping_add_signed(east), row.wrapping_add_signed(north))
}

fn cost_code(steps: u32) -> u8 {
    match steps {
        Distances::UNREACHABLE => UNREACHABLE,
        0 => GOAL,
        steps => (steps % u32::from(MODULUS)) as u8,
    }
}

/// Returns how much greater the second cost is than the first one.
#[inline]
fn difference(from: u8, to: u8) -> i8 {
    // 254, the code of a goal, is 0 modulo 254 as well.
    let difference = i16::from(to) - i16::from(from);
    let half = i16::from(MODULUS / 2);
    let modulus = i16::from(MODULUS);
    let wrapped = if difference >= half {
        difference - modulus
    } else if difference < -half {
        difference + modulus
    } else {
        difference
    };
    wrapped as i8
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

    /// Returns what a cheapest path from a box costs, by going over all boxes until no cost falls any more.
    fn costs(free: &FreeSpace, goals: &[(u32, u32)], lanes: &Lanes) -> Vec<u32> {
        let width = free.width();
        let boxes: Vec<_> =
            (0..free.height()).flat_map(|row| (0..width).map(move |col| (col, row))).collect();
        let mut costs = vec![u32::MAX; boxes.len()];
        for _ in 0..boxes.len() {
            for (n, &at) in boxes.iter().enumerate().filter(|(_, at)| free.is_free(at.0, at.1)) {
                for direction in 0..4 {
                    let next = neighbor(at.0, at.1, direction);
                    if free.is_free(next.0, next.1) {
                        let there = costs[(next.1 * width + next.0) as usize];
                        let is_off =
                            lanes.is_off_lane(next.0, next.1, direction) && !goals.contains(&next);
                        let step = 1 + 2 * u32::from(is_off);
                        costs[n] = costs[n].min(there.saturating_add(step));
                    }
                }
                if goals.contains(&at) {
                    costs[n] = 0;
                }
            }
        }
        costs
    }

    #[test]
    fn a_path_along_a_corridor_changes_to_the_right_hand_lane_at_once_and_stays_there() {
        let free = open(30, 2);
        let lanes = Arc::new(Lanes::new(&free, 1));
        let field = FlowField::along_lanes(&free, 1, &[(29, 0), (29, 1)], &lanes);
        let direction = |col, row| field.direction(col, row);
        assert_eq!(
            [direction(0, 1), direction(0, 0), direction(20, 1)],
            [Some(3), Some(0), Some(3)]
        );
        assert_eq!(direction(28, 1), Some(0), "a step from its goal it does not change any more");
        assert_eq!(field.rise(5, 1, 0), Some(-1), "a step nearer, and off lane");
        assert!(!field.descends(5, 1, 0) && field.descends(5, 1, 3) && field.descends(5, 0, 0));
    }

    proptest! {
        #[test]
        fn along_lanes_every_step_pays_off_lane_places_and_the_whole_path_costs_least(
            width in 1u32..12, height in 1u32..12, walls in any::<[u128; 3]>(), goal in (0u32..12, 0u32..12),
        ) {
            let is_wall = |col, row| walls.iter().all(|w| w.rotate_right(row * 12 + col) & 1 == 1);
            let free = FreeSpace::new(width, height, |col, row| !is_wall(col, row));
            let lanes = Arc::new(Lanes::new(&free, 1));
            let field = FlowField::along_lanes(&free, 1, &[goal], &lanes);
            let costs = costs(&free, &[goal], &lanes);
            for (col, row) in (0..width).flat_map(|col| (0..height).map(move |row| (col, row))) {
                let cost = costs[(row * width + col) as usize];
                prop_assert_eq!(field.reaches_goal(col, row), cost != u32::MAX);
                let (mut at, mut paid) = ((col, row), 0);
                while let Some(direction) = field.direction(at.0, at.1) {
                    prop_assert!(field.descends(at.0, at.1, direction));
                    paid += u32::from(field.step_cost(at.0, at.1, direction));
                    at = neighbor(at.0, at.1, direction);
                }
                prop_assert_eq!(paid, if cost == u32::MAX { 0 } else { cost });
                prop_assert_eq!(field.cost(col, row), (cost != u32::MAX).then_some(cost));
                for direction in (0..4).filter(|_| cost != u32::MAX) {
                    let there = neighbor(col, row, direction);
                    let is_inside = there.0 < width && there.1 < height;
                    let there = if is_inside { costs[(there.1 * width + there.0) as usize] } else { u32::MAX };
                    let rise = (there != u32::MAX).then(|| there as i32 - cost as i32);
                    prop_assert_eq!(field.rise(col, row, direction).map(i32::from), rise);
                    prop_assert_eq!(field.cost_difference((col, row), neighbor(col, row, direction)), rise);
                }
            }
        }

        #[test]
        fn a_window_has_what_the_field_has_there(
            west in -4i32..18, south in -4i32..18, walls in any::<[u128; 3]>(), goal in (0u32..15, 0u32..15),
        ) {
            let is_wall = |col, row| walls.iter().all(|w| w.rotate_right(row * 15 + col) & 1 == 1);
            let free = FreeSpace::new(15, 15, |col, row| !is_wall(col, row));
            let field = FlowField::to_nearest(&free, 1, &[goal]);
            let window = field.window::<9>(west, south);
            let costs = Distances::to_nearest(&free, 1, &[goal]);
            let center = ((west + 4) as u32, (south + 4) as u32);
            for (row, at_row) in (south..).take(9).enumerate() {
                for (col, at_col) in (west..).take(9).enumerate() {
                    let at = (at_col as u32, at_row as u32);
                    prop_assert_eq!(window.reaching_goal(row) >> col & 1 == 1, field.reaches_goal(at.0, at.1));
                    prop_assert_eq!(window.goals(row) >> col & 1 == 1, field.is_goal(at.0, at.1));
                    if let Some((here, there)) = costs.steps(center.0, center.1).zip(costs.steps(at.0, at.1)) {
                        prop_assert_eq!(i64::from(window.rise((4, 4), (col, row))), i64::from(there) - i64::from(here));
                    }
                }
            }
        }

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
                    prop_assert_eq!(field.descends(col, row, direction), rise == Some(-1));
                }
                let expected = distances.steps(col, row);
                prop_assert_eq!(field.reaches_goal(col, row).then_some(steps), expected);
            }
        }
    }
}
