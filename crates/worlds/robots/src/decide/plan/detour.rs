//! The cheapest path through the places around a robot, to where the path of the static map goes on.

use super::LocalView;
use super::local_costmap::{LocalBoxSet, PLAN_RADIUS_BOXES, PLAN_SIDE_BOXES};
use crate::effector::HEADINGS;

const LOCAL_BOXES: usize = (PLAN_SIDE_BOXES * PLAN_SIDE_BOXES) as usize;
/// Price of a first step away from the goal that goes straight back, or gives up a sidestep. It is
/// there because a robot sees little of a wide obstacle, and would otherwise go to and fro before it.
const CHANGE_COST: u16 = 4;
const INFINITE_COST: u16 = u16::MAX;
/// Stands for the direction of the first step at the start, where none has been made.
const NO_DIRECTION: u8 = 4;

/// Prices of a search, in actions.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepCosts {
    /// Price of a place that is blocked now; the obstacle may go away.
    pub(super) blocked: u16,
    /// Extra price of a place beside a blocked one, where a slip ends in a contact.
    pub(super) beside: u16,
    /// Extra price of a place where something may be.
    pub(super) vague: u16,
    /// Direction of the last step; none before the first.
    pub(super) moved: Option<u8>,
    /// Whether that step did not lead nearer to the goal, so that it belongs to a detour.
    pub(super) is_sidestep: bool,
}

/// The cheapest path found so far to a place.
#[derive(Debug, Clone, Copy)]
struct Label {
    cost: u16,
    /// Distance to the goal on the static map, less that of the robot's own place.
    rise: i16,
    /// Direction of the first step.
    first: u8,
    /// Direction of the last one.
    last: u8,
}

/// Returns the direction of the first step; none where walls leave no way out.
pub(super) fn first_step(view: &LocalView<'_>, prices: StepCosts) -> Option<u8> {
    let start = Label { cost: 0, rise: 0, first: NO_DIRECTION, last: view.heading };
    let mut labels = [Label { cost: INFINITE_COST, ..start }; LOCAL_BOXES];
    let center = LocalBoxSet::index(0, 0)?;
    labels[center] = start;
    // Label correcting in rounds, because the set of all 81 places fits into one word.
    let mut waiting = 1u128 << center;
    let mut next = 0u128;
    while waiting != 0 {
        let n = waiting.trailing_zeros() as usize;
        waiting &= waiting - 1;
        next |= relax_neighbors(view, prices, &mut labels, n);
        if waiting == 0 {
            waiting = std::mem::take(&mut next);
        }
    }
    let exits = (0..LOCAL_BOXES).filter(|&n| n != center && is_exit(view, n));
    let reached = exits.map(|n| labels[n]).filter(|label| label.cost != INFINITE_COST);
    // The rest of the path, beyond the exit, costs one action a box: the rise is how much longer it is
    // than from here. Of equal exits one straight ahead saves a turn.
    let best = reached.min_by_key(|label| {
        let whole_cost = i32::from(label.cost) + i32::from(label.rise);
        (whole_cost, label.first != view.heading)
    });
    best.map(|label| label.first)
}

/// Spreads a label to the neighbors of its place, and returns those that have changed.
fn relax_neighbors(
    view: &LocalView<'_>,
    prices: StepCosts,
    labels: &mut [Label; LOCAL_BOXES],
    n: usize,
) -> u128 {
    let from = labels[n];
    let (col, row) = box_offset(n);
    let at = view.offset(col, row);
    let is_first = from.first == NO_DIRECTION;
    let mut changed = 0;
    // First ahead, then to the right: of equal paths the first is kept, and robots that meet head on
    // both keep to the right.
    for turn in [0, 3, 1, 2] {
        let direction = (from.last + turn) % 4;
        let (east, north) = HEADINGS[usize::from(direction)];
        let Some(next) = LocalBoxSet::index(col + east, row + north) else { continue };
        let Some(rise) = view.field.rise(at.0, at.1, direction) else { continue };
        let is_change = is_first && rise >= 0 && prices.is_change_of_course(direction);
        let change = if is_change { CHANGE_COST } else { 0 };
        let lane = u16::from(is_left_lane(view, box_offset(next), direction));
        let cost = from.cost
            + 1
            + quarter_turns(turn)
            + change
            + lane
            + box_cost(view, prices, box_offset(next));
        if cost < labels[next].cost {
            let first = if is_first { direction } else { from.first };
            labels[next] =
                Label { cost, rise: from.rise + i16::from(rise), first, last: direction };
            changed |= 1 << next;
        }
    }
    changed
}

impl StepCosts {
    /// Returns whether a step in a direction goes back, or gives up the last step if that was a sidestep.
    fn is_change_of_course(self, direction: u8) -> bool {
        let Some(moved) = self.moved else { return false };
        match (4 + direction - moved) % 4 {
            0 => false,
            2 => true,
            _ => self.is_sidestep,
        }
    }
}

/// Returns the price of standing in a place, beside the step.
fn box_cost(view: &LocalView<'_>, prices: StepCosts, (col, row): (i32, i32)) -> u16 {
    if view.blocked.contains(col, row) {
        return prices.blocked;
    }
    let beside =
        HEADINGS.iter().any(|(east, north)| view.blocked.contains(col + east, row + north));
    prices.beside * u16::from(beside) + prices.vague * u16::from(view.vague.contains(col, row))
}

/// Returns whether a place is in the left lane of a passage: there is a wall to the left, and room
/// to the right. A robot that comes the other way then finds its own right lane taken.
fn is_left_lane(view: &LocalView<'_>, (col, row): (i32, i32), direction: u8) -> bool {
    let at = view.offset(col, row);
    let is_wall_left = view.field.rise(at.0, at.1, (direction + 1) % 4).is_none();
    is_wall_left && view.field.rise(at.0, at.1, (direction + 3) % 4).is_some()
}

fn quarter_turns(turn: u8) -> u16 {
    u16::from(turn.min(4 - turn))
}

/// Returns whether the static map's path may be followed from a place on: at a goal, and where it
/// leads out of the planned square, or along its edge. Where it leads back in, it may lead to the
/// same obstacle again.
fn is_exit(view: &LocalView<'_>, n: usize) -> bool {
    let (col, row) = box_offset(n);
    let at = view.offset(col, row);
    if view.field.is_goal(at.0, at.1) {
        return true;
    }
    let Some(direction) = view.field.direction(at.0, at.1) else { return false };
    let (east, north) = HEADINGS[usize::from(direction)];
    let is_at_edge = ring(col, row) == PLAN_RADIUS_BOXES;
    is_at_edge && ring(col + east, row + north) >= PLAN_RADIUS_BOXES
}

/// Returns the number of the square ring around the robot in which a place lies.
fn ring(col: i32, row: i32) -> i32 {
    col.abs().max(row.abs())
}

/// Returns column and row of a place from the robot.
fn box_offset(n: usize) -> (i32, i32) {
    (n as i32 % PLAN_SIDE_BOXES - PLAN_RADIUS_BOXES, n as i32 / PLAN_SIDE_BOXES - PLAN_RADIUS_BOXES)
}
