//! The places around a robot, with what a search reads of each of them many times.

use super::LocalView;
use super::local_costmap::{PLAN_RADIUS_BOXES, PLAN_SIDE_BOXES};
use super::step_costs::StepCosts;
use crate::effector::HEADINGS;
use sidestep_map::planning::FlowWindow;

const PLAN_SIDE: usize = PLAN_SIDE_BOXES as usize;
/// The planned square and a ring around it, so that each of its places has four neighbors.
const SIDE: usize = PLAN_SIDE + 2;
pub(super) const GRID_BOXES: usize = SIDE * SIDE;
/// The place of the robot itself.
pub(super) const CENTER: usize = GRID_BOXES / 2;

/// The places of the planned square, row by row from the southwest of the ring around it.
#[derive(Debug)]
pub(super) struct LocalGrid {
    /// How much farther from the goal the next place is in each direction; none where a wall is, and at the edge.
    pub(super) rises: [[Option<i8>; 4]; GRID_BOXES],
    /// Directions, a bit each, in which a robot comes into the left lane of a passage: there is a wall to the left, and
    /// room to the right. One that comes the other way then finds its own right lane taken.
    pub(super) left_lanes: [u8; GRID_BOXES],
    /// Prices of standing in each place, beside the step.
    pub(super) costs: [u16; GRID_BOXES],
    /// Places from which the path of the static map may be followed, a bit each.
    pub(super) exits: u128,
}

impl LocalGrid {
    pub(super) fn new(view: &LocalView<'_>, prices: StepCosts) -> Self {
        let reach = PLAN_RADIUS_BOXES + 1;
        // Places on a grid of less than 2^31 boxes a side; some lie outside of it.
        let west = view.at.0 as i32 - reach;
        let south = view.at.1 as i32 - reach;
        let flow = view.field.window::<SIDE>(west, south);
        let mut grid = Self {
            rises: [[None; 4]; GRID_BOXES],
            left_lanes: [0; GRID_BOXES],
            costs: [0; GRID_BOXES],
            exits: 0,
        };
        let beside = view.blocked.neighbors();
        for row in 1..=PLAN_SIDE {
            for col in 1..=PLAN_SIDE {
                let n = row * SIDE + col;
                let rises = flow.rises(col, row);
                grid.left_lanes[n] = left_lanes(rises);
                grid.rises[n] = within_square(rises, col, row);
                let offset = box_offset(col, row);
                grid.costs[n] = if view.blocked.contains(offset.0, offset.1) {
                    prices.blocked
                } else {
                    prices.beside * u16::from(beside.contains(offset.0, offset.1))
                        + prices.vague * u16::from(view.vague.contains(offset.0, offset.1))
                };
                grid.exits |= u128::from(is_exit(&flow, col, row)) << n;
            }
        }
        grid
    }
}

/// Returns the neighbor of a place of the planned square.
pub(super) fn neighbor(n: usize, direction: u8) -> usize {
    match direction {
        0 => n + 1,
        1 => n + SIDE,
        2 => n - 1,
        _ => n - SIDE,
    }
}

/// Returns the directions in which a place is in the left lane, a bit each.
fn left_lanes(rises: [Option<i8>; 4]) -> u8 {
    let mut walls = 0;
    for (direction, rise) in rises.iter().enumerate() {
        walls |= u8::from(rise.is_none()) << direction;
    }
    // Twice the four bits, so that a turn is a shift.
    let walls = walls | walls << 4;
    let is_wall_left = walls >> 1;
    let is_wall_right = walls >> 3;
    is_wall_left & !is_wall_right & 0b1111
}

/// Returns the rises of a place without those of steps out of the planned square.
fn within_square(mut rises: [Option<i8>; 4], col: usize, row: usize) -> [Option<i8>; 4] {
    let is_at_edge = [col == PLAN_SIDE, row == PLAN_SIDE, col == 1, row == 1];
    for (rise, is_at_edge) in rises.iter_mut().zip(is_at_edge) {
        if is_at_edge {
            *rise = None;
        }
    }
    rises
}

/// Returns whether the static map's path may be followed from a place on: at a goal, and where it
/// leads out of the planned square, or along its edge. Where it leads back in, it may lead to the
/// same obstacle again.
fn is_exit(flow: &FlowWindow<SIDE>, col: usize, row: usize) -> bool {
    if flow.is_goal(col, row) {
        return true;
    }
    let offset = box_offset(col, row);
    if ring(offset) != PLAN_RADIUS_BOXES {
        return false;
    }
    let Some(direction) = flow.direction(col, row) else { return false };
    let (east, north) = HEADINGS[usize::from(direction)];
    ring((offset.0 + east, offset.1 + north)) >= PLAN_RADIUS_BOXES
}

/// Returns the number of the square ring around the robot in which a place lies.
fn ring((col, row): (i32, i32)) -> i32 {
    col.abs().max(row.abs())
}

/// Returns column and row of a place from the robot.
fn box_offset(col: usize, row: usize) -> (i32, i32) {
    let center = PLAN_RADIUS_BOXES + 1;
    (col as i32 - center, row as i32 - center)
}

#[cfg(test)]
mod tests {
    use super::super::local_costmap::LocalBoxSet;
    use super::*;
    use proptest::prelude::*;
    use sidestep_map::planning::{FlowField, FreeSpace};

    const PRICES: StepCosts =
        StepCosts { blocked: 7, beside: 2, vague: 3, moved: None, is_sidestep: false };

    /// Returns a view from a place, with some places blocked and vague.
    fn view(field: &FlowField, at: (u32, u32), blocked: u128, vague: u128) -> LocalView<'_> {
        let [blocked, vague] = [blocked, vague].map(|bits| {
            let mut places = LocalBoxSet::default();
            let square = PLAN_SIDE_BOXES * PLAN_SIDE_BOXES;
            for n in (0..square).filter(|n| bits >> n & 1 == 1) {
                let row = n / PLAN_SIDE_BOXES;
                let col = n % PLAN_SIDE_BOXES;
                places.insert(col - PLAN_RADIUS_BOXES, row - PLAN_RADIUS_BOXES);
            }
            places
        });
        LocalView { field, at, heading: 0, blocked, vague, is_careful: false, is_alone: false }
    }

    /// Returns the price of a place, looked up for it alone.
    fn cost(view: &LocalView<'_>, (col, row): (i32, i32)) -> u16 {
        if view.blocked.contains(col, row) {
            return PRICES.blocked;
        }
        let is_beside =
            HEADINGS.iter().any(|(east, north)| view.blocked.contains(col + east, row + north));
        PRICES.beside * u16::from(is_beside)
            + PRICES.vague * u16::from(view.vague.contains(col, row))
    }

    /// Returns whether a place is an exit, looked up for it alone.
    fn leads_out(view: &LocalView<'_>, offset: (i32, i32)) -> bool {
        let at = view.offset(offset.0, offset.1);
        let Some(direction) = view.field.direction(at.0, at.1) else {
            return view.field.is_goal(at.0, at.1);
        };
        let (east, north) = HEADINGS[usize::from(direction)];
        let next = (offset.0 + east, offset.1 + north);
        ring(offset) == PLAN_RADIUS_BOXES && ring(next) >= PLAN_RADIUS_BOXES
    }

    proptest! {
        #[test]
        fn a_grid_has_what_field_and_sets_say_of_each_place(
            walls in any::<[u128; 3]>(), goal in (0u32..14, 0u32..14), at in (0u32..14, 0u32..14),
            blocked in any::<[u128; 2]>(), vague in any::<u128>(),
        ) {
            let is_wall = |col, row| walls.iter().all(|w| w.rotate_right(row * 15 + col) & 1 == 1);
            let free = FreeSpace::new(14, 14, |col, row| !is_wall(col, row));
            let field = FlowField::to_nearest(&free, 1, &[goal]);
            let view = view(&field, at, blocked[0] & blocked[1], vague);
            let grid = LocalGrid::new(&view, PRICES);
            for row in 1..=PLAN_SIDE {
                for col in 1..=PLAN_SIDE {
                    let n = row * SIDE + col;
                    let offset = box_offset(col, row);
                    let place = view.offset(offset.0, offset.1);
                    prop_assert_eq!(grid.costs[n], cost(&view, offset));
                    prop_assert_eq!(grid.exits >> n & 1 == 1, leads_out(&view, offset));
                    for direction in 0..4 {
                        let rise = |side| field.rise(place.0, place.1, (direction + side) % 4);
                        let (east, north) = HEADINGS[usize::from(direction)];
                        let is_inside = ring((offset.0 + east, offset.1 + north)) <= PLAN_RADIUS_BOXES;
                        let expected = rise(0).filter(|_| is_inside);
                        prop_assert_eq!(grid.rises[n][usize::from(direction)], expected);
                        let is_lane = rise(1).is_none() && rise(3).is_some();
                        prop_assert_eq!(grid.left_lanes[n] >> direction & 1 == 1, is_lane);
                        let (next_col, next_row) = (neighbor(n, direction) % SIDE, neighbor(n, direction) / SIDE);
                        prop_assert_eq!(box_offset(next_col, next_row), (offset.0 + east, offset.1 + north));
                    }
                }
            }
            prop_assert_eq!(box_offset(CENTER % SIDE, CENTER / SIDE), (0, 0));
        }
    }
}
