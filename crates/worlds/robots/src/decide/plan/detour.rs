//! The cheapest path through the places around a robot, to where the path of the static map goes on.

use super::local_box_set::LocalBoxSet;
use super::local_grid::{EXIT_LEVELS, Exits, LocalGrid, PRICES};
use super::local_view::LocalView;
use super::step_costs::StepCosts;
use crate::effector::HEADINGS;

/// Number of costs that a search looks ahead, more than that of any step; a power of two.
const PENDING_LEVELS: usize = 64;

/// Returns the direction of the first step; none where walls leave no way out.
///
/// Dijkstra's search backward from the exits, over places and headings. All places of one cost and heading are one word,
/// so that a step of all of them is a shift.
pub(super) fn first_step(view: &LocalView<'_>, prices: StepCosts) -> Option<u8> {
    let mut exits = [LocalBoxSet::default(); EXIT_LEVELS];
    let grid = LocalGrid::new(view, prices, &mut exits)?;
    let mut steps: [StepsByCost; 4] = Default::default();
    for (heading, steps) in (0..).zip(&mut steps) {
        steps.fill(&grid, prices.off_lane, heading);
    }
    let mut search = Search {
        grid: &grid,
        exits: &exits,
        steps: &steps,
        pending: [[LocalBoxSet::default(); 4]; PENDING_LEVELS],
        settled: [LocalBoxSet::default(); 4],
        last_level: 0,
    };
    let mut best: Option<(usize, u8)> = None;
    let mut level = 0;
    while level <= search.last_level || level < EXIT_LEVELS {
        let settled = search.settle(level);
        for turn in TURNS {
            let direction = (view.heading + turn) % 4;
            let (east, north) = HEADINGS[usize::from(direction)];
            if !settled[usize::from(direction)].contains(east, north) {
                continue;
            }
            let cost = level + first_cost(view, &grid, prices, direction);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, direction));
            }
        }
        // What is settled later costs at least a step from a cost above this one.
        if best.is_some_and(|(least, _)| least <= level + 2) {
            break;
        }
        level += 1;
    }
    best.map(|(_, direction)| direction)
}

/// The first step ahead, then to the right: of equal ones the first is kept, and robots that meet head on both keep to the
/// right.
const TURNS: [u8; 4] = [0, 3, 1, 2];

/// Returns the cost of the first step, with the turns before it.
fn first_cost(view: &LocalView<'_>, grid: &LocalGrid, prices: StepCosts, direction: u8) -> usize {
    let (east, north) = HEADINGS[usize::from(direction)];
    let turn = (4 + direction - view.heading) % 4;
    let turns = u16::from(turn.min(4 - turn));
    let is_away = view.rise(direction).is_some_and(|rise| rise >= 0);
    let change = prices.change_of_course(direction, is_away);
    let off_lane = grid.off_lane[usize::from(direction)].contains(east, north);
    let lane = prices.off_lane * u16::from(off_lane);
    usize::from(turns + 1 + change + lane + grid.price((east, north)))
}

struct Search<'a> {
    grid: &'a LocalGrid,
    exits: &'a Exits,
    /// The steps of each heading.
    steps: &'a [StepsByCost; 4],
    /// Places and headings that are reached at a cost, by the cost modulo the number of levels.
    pending: [[LocalBoxSet; 4]; PENDING_LEVELS],
    /// Those that have been reached at any cost before, by heading.
    settled: [LocalBoxSet; 4],
    /// Highest cost at which something is pending.
    last_level: usize,
}

/// The steps with one heading, by what they cost.
#[derive(Default)]
struct StepsByCost {
    /// The places from which a step costs that much, and the cost; places at each price on lane, and off it.
    costs: [(LocalBoxSet, usize); 2 * PRICES],
    /// The number of costs that some step has.
    len: usize,
}

impl StepsByCost {
    /// Adds all steps with a heading.
    fn fill(&mut self, grid: &LocalGrid, off_lane_price: u16, heading: u8) {
        let off_lane = grid.off_lane[usize::from(heading)];
        for &(places, price) in &grid.prices {
            self.push(places.without(off_lane), heading, price);
            self.push(places.intersection(off_lane), heading, price + off_lane_price);
        }
    }

    /// Adds the steps into places of a price.
    fn push(&mut self, into: LocalBoxSet, heading: u8, price: u16) {
        if !into.is_empty() {
            self.costs[self.len] = (into.shift(heading + 2), 1 + usize::from(price));
            self.len += 1;
        }
    }
}

impl Search<'_> {
    /// Settles the places of a cost, and returns those of each heading.
    fn settle(&mut self, level: usize) -> [LocalBoxSet; 4] {
        let mut reached = std::mem::take(&mut self.pending[level % PENDING_LEVELS]);
        let exits = self.exits.get(level).copied().unwrap_or_default();
        for (heading, places) in reached.iter_mut().enumerate() {
            *places = places.union(exits).without(self.settled[heading]);
            self.settled[heading] = self.settled[heading].union(*places);
        }
        for (heading, &places) in (0..).zip(&reached) {
            if !places.is_empty() {
                self.reach_from(level, heading, places);
            }
        }
        reached
    }

    /// Adds what leads to these places: a turn on the spot, and a step from the place behind.
    fn reach_from(&mut self, level: usize, heading: u8, places: LocalBoxSet) {
        self.add(level + 1, heading + 1, places);
        self.add(level + 1, heading + 3, places);
        let behind = places.shift(heading + 2).intersection(self.grid.open);
        for number in 0..self.steps[usize::from(heading)].len {
            let (from, cost) = self.steps[usize::from(heading)].costs[number];
            self.add(level + cost, heading, behind.intersection(from));
        }
    }

    fn add(&mut self, level: usize, heading: u8, places: LocalBoxSet) {
        let heading = usize::from(heading % 4);
        let fresh = places.without(self.settled[heading]);
        if !fresh.is_empty() {
            let pending = &mut self.pending[level % PENDING_LEVELS][heading];
            *pending = pending.union(fresh);
            self.last_level = self.last_level.max(level);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_map::planning::{FlowField, FreeSpace, Lanes};
    use std::sync::Arc;

    const SIDE: u32 = 14;

    /// Returns the least cost over all first steps in a direction, by going over places and headings until no cost
    /// falls any more.
    fn least_cost(
        view: &LocalView<'_>,
        (grid, exits): (&LocalGrid, &Exits),
        prices: StepCosts,
        first: u8,
    ) -> usize {
        let mut costs = [[usize::MAX; 4]; 81];
        let number = |(col, row): (i32, i32)| ((row + 4) * 9 + col + 4) as usize;
        for (level, places) in exits.iter().enumerate() {
            places.places().for_each(|at| costs[number(at)] = [level; 4]);
        }
        let price = |at: (i32, i32), heading: u8| {
            let is_off = grid.off_lane[usize::from(heading)].contains(at.0, at.1);
            1 + usize::from(grid.price(at)) + usize::from(prices.off_lane) * usize::from(is_off)
        };
        let mut is_falling = true;
        while is_falling {
            is_falling = false;
            for at in LocalBoxSet::ALL.places() {
                for heading in 0..4u8 {
                    let here = usize::from(heading);
                    let (east, north) = HEADINGS[here];
                    let next = (at.0 + east, at.1 + north);
                    let mut cost = costs[number(at)][here];
                    for turned in [(heading + 1) % 4, (heading + 3) % 4] {
                        cost = cost.min(costs[number(at)][usize::from(turned)].saturating_add(1));
                    }
                    if grid.open.contains(at.0, at.1) && LocalBoxSet::ALL.contains(next.0, next.1) {
                        let there = costs[number(next)][here];
                        cost = cost.min(there.saturating_add(price(next, heading)));
                    }
                    is_falling |= cost < costs[number(at)][here];
                    costs[number(at)][here] = cost;
                }
            }
        }
        let (east, north) = HEADINGS[usize::from(first)];
        let there = costs[number((east, north))][usize::from(first)];
        there.saturating_add(first_cost(view, grid, prices, first))
    }

    proptest! {
        #[test]
        fn the_first_step_begins_a_path_of_the_least_cost(
            walls in any::<[u128; 3]>(), goal in (0..SIDE, 0..SIDE), at in (0..SIDE, 0..SIDE), heading in 0u8..4,
            blocked in any::<[u128; 3]>(), vague in any::<[u128; 2]>(), moved in 0u8..5, is_sidestep: bool,
        ) {
            let is_wall = |col, row| walls.iter().all(|w| w.rotate_right(row * 15 + col) & 1 == 1);
            let free = FreeSpace::new(SIDE, SIDE, |col, row| !is_wall(col, row));
            let lanes = Arc::new(Lanes::new(&free, 1));
            let field = FlowField::along_lanes(&free, 1, &[goal], &lanes);
            let sets = [blocked[0] & blocked[1] & blocked[2], vague[0] & vague[1]];
            let [blocked, vague] = sets.map(|bits| LocalBoxSet::from_rows(|row| (bits >> (9 * row)) as u32));
            let moved = moved.checked_sub(1);
            let prices = StepCosts { blocked: 31, beside: 6, vague: 5, off_lane: 8, is_on_detour: false, moved, is_sidestep };
            let view = LocalView {
                field: &field, at, heading, blocked, vague,
                may_err: true, is_agile: false, is_done: false, is_alone: false,
            };
            let step = first_step(&view, prices);
            let mut exits = [LocalBoxSet::default(); EXIT_LEVELS];
            let Some(grid) = LocalGrid::new(&view, prices, &mut exits) else {
                prop_assert_eq!(step, None);
                return Ok(());
            };
            let costs = [0, 1, 2, 3].map(|direction| least_cost(&view, (&grid, &exits), prices, direction));
            let least = costs.into_iter().min().filter(|&cost| cost < usize::MAX);
            prop_assert_eq!(step.map(|direction| costs[usize::from(direction)]), least, "{:?}", costs);
        }
    }

    #[test]
    fn head_on_a_robot_keeps_to_the_right() {
        let free = FreeSpace::new(40, 20, |_, _| true);
        let field = FlowField::to_nearest(&free, 1, &[(39, 10)]);
        let mut blocked = LocalBoxSet::default();
        blocked.insert(1, 0);
        let vague = LocalBoxSet::default();
        let view = LocalView {
            field: &field,
            at: (10, 10),
            heading: 0,
            blocked,
            vague,
            may_err: false,
            is_agile: true,
            is_done: false,
            is_alone: false,
        };
        let prices = StepCosts {
            blocked: 20,
            beside: 1,
            vague: 1,
            off_lane: 8,
            is_on_detour: false,
            moved: None,
            is_sidestep: false,
        };
        assert_eq!(first_step(&view, prices), Some(3));
    }
}
