//! The places around a robot as sets, a bit for each place, for a search that handles all of them at once.

use super::local_box_set::{LOCAL_BOXES, LocalBoxSet, PLAN_RADIUS_BOXES, PLAN_SIDE_BOXES};
use super::local_view::LocalView;
use super::step_costs::StepCosts;
use crate::effector::HEADINGS;
use sidestep_map::planning::FlowWindow;

const SIDE: usize = PLAN_SIDE_BOXES as usize;
/// Column and row of the robot itself.
const CENTER: (usize, usize) = (PLAN_RADIUS_BOXES as usize, PLAN_RADIUS_BOXES as usize);
/// Number of prices that a place can have.
pub(super) const PRICES: usize = 5;
/// Number of exit costs that are told apart. Of two exits that differ by more the farther one is never worth it.
pub(super) const EXIT_LEVELS: usize = 64;

/// The planned square around a robot.
#[derive(Debug)]
pub(super) struct LocalGrid {
    /// Places from which a path leads to the goal.
    pub(super) open: LocalBoxSet,
    /// By direction: the places that are off lane for a robot that goes so.
    pub(super) off_lane: [LocalBoxSet; 4],
    /// The places by the price of standing there, beside the step.
    pub(super) prices: [(LocalBoxSet, u16); PRICES],
}

/// Places from which the path of the static map may be followed, by how much that costs from there on, less that of the
/// cheapest one.
pub(super) type Exits = [LocalBoxSet; EXIT_LEVELS];

impl LocalGrid {
    /// Returns the grid around a robot, and adds its exits to `into_exits`, since they are too large to be returned; none
    /// where no path leads out of it.
    pub(super) fn new(
        view: &LocalView<'_>,
        prices: StepCosts,
        into_exits: &mut Exits,
    ) -> Option<Self> {
        // Places on a grid of less than 2^31 boxes a side; some lie outside of it.
        let west = view.at.0 as i32 - PLAN_RADIUS_BOXES;
        let south = view.at.1 as i32 - PLAN_RADIUS_BOXES;
        let flow = view.field.window::<SIDE>(west, south);
        let off_lane = [0, 1, 2, 3].map(|direction| match view.field.lanes() {
            None => LocalBoxSet::default(),
            Some(lanes) => {
                let window = lanes.off_lane(direction).window::<SIDE>(west, south);
                LocalBoxSet::from_rows(|row| window.row(row))
            }
        });
        let open = LocalBoxSet::from_rows(|row| flow.reaching_goal(row));
        let has_exit = write_exits(view, &flow, open, into_exits);
        has_exit.then(|| Self { open, off_lane, prices: place_prices(view, prices) })
    }

    /// Returns the price of standing in a place of the square, beside the step.
    pub(super) fn price(&self, offset: (i32, i32)) -> u16 {
        let of_place = self.prices.iter().find(|(places, _)| places.contains(offset.0, offset.1));
        of_place.map_or(0, |&(_, price)| price)
    }
}

/// Returns the places of each price.
fn place_prices(view: &LocalView<'_>, prices: StepCosts) -> [(LocalBoxSet, u16); PRICES] {
    let blocked = view.blocked;
    let beside = blocked.neighbors().without(blocked);
    let vague = view.vague.without(blocked);
    let plain = LocalBoxSet::ALL.without(blocked).without(beside).without(vague);
    [
        (plain, 0),
        (beside.without(vague), prices.beside),
        (vague.without(beside), prices.vague),
        (beside.intersection(vague), prices.beside + prices.vague),
        (blocked, prices.blocked),
    ]
}

/// Adds the places from which the static map's path may be followed: goals, and those where it leads out of the
/// planned square, or along its edge. Where it leads back in, it may lead to the same obstacle again. Returns whether there
/// are any.
fn write_exits(
    view: &LocalView<'_>,
    flow: &FlowWindow<SIDE>,
    open: LocalBoxSet,
    exits: &mut Exits,
) -> bool {
    let mut found = LocalBoxSet::from_rows(|row| flow.goals(row));
    let on_edge = LocalBoxSet::EDGE.intersection(open).without(found);
    for (number, (col, row)) in on_edge.numbered_places() {
        if leads_out(view, (col, row)) {
            found.insert_number(number);
        }
    }
    // A robot that stands at one of several goals plans only where it has to leave it.
    let found = found.without(LocalBoxSet::CENTER);
    let mut rises = [0; LOCAL_BOXES];
    let mut least = i32::MAX;
    for number in found.numbers() {
        let rise = i32::from(flow.rise(CENTER, (number % SIDE, number / SIDE)));
        rises[number] = rise;
        least = least.min(rise);
    }
    for number in found.numbers() {
        let level = (rises[number] - least) as usize;
        exits[level.min(EXIT_LEVELS - 1)].insert_number(number);
    }
    !found.is_empty()
}

/// Returns whether the static map's path leads from a place at the edge out of the square, or along its edge.
fn leads_out(view: &LocalView<'_>, (col, row): (i32, i32)) -> bool {
    let at = view.offset(col, row);
    let Some(direction) = view.field.direction(at.0, at.1) else { return false };
    let (east, north) = HEADINGS[usize::from(direction)];
    (col + east).abs().max((row + north).abs()) >= PLAN_RADIUS_BOXES
}
