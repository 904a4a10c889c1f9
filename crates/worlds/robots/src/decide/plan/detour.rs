//! The cheapest path through the places around a robot, to where the path of the static map goes on.

use super::LocalView;
use super::local_grid::{CENTER, GRID_BOXES, LocalGrid, neighbor};
use super::step_costs::StepCosts;

/// Price of a first step away from the goal that goes straight back, or gives up a sidestep. It is
/// there because a robot sees little of a wide obstacle, and would otherwise go to and fro before it.
const CHANGE_COST: u16 = 4;
const INFINITE_COST: u16 = u16::MAX;
/// Stands for the direction of the first step at the start, where none has been made.
const NO_DIRECTION: u8 = 4;

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
    let grid = LocalGrid::new(view, prices);
    let start = Label { cost: 0, rise: 0, first: NO_DIRECTION, last: view.heading };
    let mut labels = [Label { cost: INFINITE_COST, ..start }; GRID_BOXES];
    labels[CENTER] = start;
    // Label correcting in rounds, because the set of all places fits into one word.
    let mut waiting = 1u128 << CENTER;
    let mut next = 0u128;
    while waiting != 0 {
        let n = waiting.trailing_zeros() as usize;
        waiting &= waiting - 1;
        next |= relax_neighbors(&grid, prices, &mut labels, n);
        if waiting == 0 {
            waiting = std::mem::take(&mut next);
        }
    }
    best_exit(&grid, &labels, view.heading)
}

/// Returns the direction of the first step to the best place at which the path of the static map goes on.
fn best_exit(grid: &LocalGrid, labels: &[Label; GRID_BOXES], heading: u8) -> Option<u8> {
    let mut best: Option<((i32, bool), u8)> = None;
    let mut exits = grid.exits & !(1 << CENTER);
    while exits != 0 {
        let label = labels[exits.trailing_zeros() as usize];
        exits &= exits - 1;
        if label.cost == INFINITE_COST {
            continue;
        }
        // The rest of the path, beyond the exit, costs one action a box: the rise is how much longer it is
        // than from here. Of equal exits one straight ahead saves a turn.
        let whole_cost = i32::from(label.cost) + i32::from(label.rise);
        let key = (whole_cost, label.first != heading);
        if best.is_none_or(|(least, _)| key < least) {
            best = Some((key, label.first));
        }
    }
    best.map(|(_, first)| first)
}

/// Spreads a label to the neighbors of its place, and returns those that have changed.
fn relax_neighbors(
    grid: &LocalGrid,
    prices: StepCosts,
    labels: &mut [Label; GRID_BOXES],
    n: usize,
) -> u128 {
    let from = labels[n];
    let is_first = from.first == NO_DIRECTION;
    let mut changed = 0;
    // First ahead, then to the right: of equal paths the first is kept, and robots that meet head on
    // both keep to the right.
    for turn in [0, 3, 1, 2] {
        let direction = (from.last + turn) % 4;
        let Some(rise) = grid.rises[n][usize::from(direction)] else { continue };
        let next = neighbor(n, direction);
        let is_change = is_first && rise >= 0 && prices.is_change_of_course(direction);
        let change = if is_change { CHANGE_COST } else { 0 };
        let lane = u16::from(grid.left_lanes[next] >> direction & 1);
        let cost = from.cost + 1 + quarter_turns(turn) + change + lane + grid.costs[next];
        if cost < labels[next].cost {
            let first = if is_first { direction } else { from.first };
            labels[next] =
                Label { cost, rise: from.rise + i16::from(rise), first, last: direction };
            changed |= 1 << next;
        }
    }
    changed
}

fn quarter_turns(turn: u8) -> u16 {
    u16::from(turn.min(4 - turn))
}
