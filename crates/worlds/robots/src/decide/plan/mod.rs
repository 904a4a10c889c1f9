//! Going somewhere among others: around the things that are sensed, and out of each other's way.
//!
//! Every robot decides alone, from its percept, its memory, the static map and the flow field of its goal:
//!
//! 1. *Lanes*: the flow field leads along the right half of passages in which two bodies fit side by side
//!    ([`Lanes`](sidestep_map::planning::Lanes)). Where the next step is clear the robot takes it.
//! 2. *Local costmap*: readings that the static map does not explain block places around the robot; so does
//!    the last contact, for a few decisions.
//! 3. *Detour*: the cheapest path through the places around it. On lanes a blocked place costs few actions while the robot
//!    is patient, because the obstacle may go away, and many when it is not; a place off lane costs more while it is
//!    patient, and little when it goes around something that stays. A robot of one box where nothing errs is *agile*: it
//!    goes around sooner, and waits the less the longer it has made no progress. Without lanes, a blocked place costs more with each
//!    decision in vain.
//! 4. *Requests*: a robot that waits before something asks it to make room ([`PassRequest`]). A robot
//!    obeys a rank above its own: it takes a free place that it was not asked for, or passes the
//!    request on with the same rank (priority inheritance, as in PIBT: Okumura et al., "Priority
//!    inheritance with backtracking for iterative multi-agent path finding", 2022). Ranks are drawn;
//!    a robot that stands at its last goal has none and obeys every other, then returns.
//! 5. *Deadlock*: after many actions without progress a robot draws a new rank and strays for some
//!    actions. Without this, two robots in a dead end could wait for each other forever.

mod detour;
mod local_box_set;
mod local_costmap;
mod local_grid;
mod local_view;
mod memory;
mod step_costs;
#[cfg(test)]
mod tests;

use super::pass_request::PassRequest;
use super::{Memory, Percept};
use crate::effector::{ActionId, FORWARD, HEADINGS, LEFT, RIGHT, STAY};
use crate::sensor::WALL;
use crate::world::RobotBody;
use local_costmap::{BeamModel, LocalCostmap};
use local_view::{LocalView, goal_direction, next_direction};
use memory::{MAX_WAITED, PlannerMemory};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::{FlowField, FreeSpace};
use std::sync::Arc;
use step_costs::StepCosts;

/// Actions without progress after which a robot strays, at least; its rank adds up to 31, so that
/// not all stray at once. A queue before a narrow passage makes no progress for long either, and must
/// not be taken for a deadlock.
const MIN_STRAY_ACTIONS: u8 = 64;
/// Decisions for which a robot believes that the thing it has touched is still there: one in which it
/// turns to a detour, and one in which it takes the first step of that.
const BUMP_DECISIONS: u8 = 2;
/// Decisions for which a robot keeps out of a place that it was asked to leave; within one the robot
/// that asked can step into it.
const KEEP_AWAY_DECISIONS: u8 = 1;
// The memory has one bit for them, and tells a detour from a wait by the largest number that it can count to.
const _: () = assert!(KEEP_AWAY_DECISIONS <= 1 && PATIENT_DECISIONS < MAX_WAITED);
/// Decisions since the last move after which a robot no longer yields to others that might step into
/// the same place, because in a crowd there is always one.
const MAX_YIELD_DECISIONS: u8 = 4;
/// Blocked places up to which a robot has time to be polite and cautious. Among more others it would wait in vain too often.
/// A thing blocks more places for a larger body, which has the less room beside it: so it is soon among too many.
const MAX_SPARSE_BLOCKED: usize = 6;
/// Decisions for which a robot waits before something in the hope that it goes on; then it goes around. Who leaves a queue
/// meets those that come: with less patience crowded corridors turn into knots. An agile robot begins with as many.
const PATIENT_DECISIONS: u8 = 20;
/// Points of being stuck that cost an agile robot one of these decisions. One that waits gains a point an action, and loses some by
/// what it gains on its goal: so a slow queue costs patience, too, but a knot costs all of it.
const STUCK_POINTS_PER_DECISION: u8 = 4;
/// Decisions for which an agile robot waits at least; that often the thing before it was about to go on.
const MIN_PATIENT_DECISIONS: u8 = 2;
/// Price of a blocked place for a robot that is patient: a step aside and back costs more, a free lane beside less.
const PATIENT_BLOCKED_COST: u16 = 4;
/// The same for an agile robot: it loses little by a step aside and back. Larger bodies turn queues into knots by them, and
/// slips and wrong readings make them longer.
const AGILE_PATIENT_BLOCKED_COST: u16 = 6;
/// The same for a robot that has no patience left: above that of a long detour.
const IMPATIENT_BLOCKED_COST: u16 = 31;
/// Price of a place beside a blocked one.
const BESIDE_COST: u16 = 1;
/// The same where sensors or wheels err and few others are near: a slip or a thing at the far end of its class soon ends in
/// a contact.
const CAREFUL_BESIDE_COST: u16 = 6;
/// Blocked places up to which few others are near. In a crowd most places are beside others, and who keeps a
/// distance there stands still.
const MAX_FEW_BLOCKED: usize = 2;
/// Price of a place where something may be.
const VAGUE_COST: u16 = 2;
/// Extra price of a place that is off lane for a robot that is patient, because who overtakes a queue meets those that come.
const OFF_LANE_COST: u16 = 6;
/// Decisions for which a robot that has waited long enough goes around what it has waited for, at most.
const DETOUR_DECISIONS: u8 = 15;
/// Highest rank of a robot that has been at its last goal and was asked to leave it. Its rank grows
/// with the time that it is away, but stays below the ranks of robots that still have a goal.
const MAX_DONE_RANK: u8 = 63;
/// Rank of a robot that stands at its last goal: the lowest one that a request can have.
const AT_LAST_GOAL_RANK: u8 = 1;

/// Plans the steps of robots of one type.
#[derive(Debug)]
pub struct Planner {
    beam_model: BeamModel,
    /// Whether sensors or wheels err, so that what a robot waits for may not be there.
    may_err: bool,
    /// Whether robots have one box and nothing errs, so that they leave a queue and find back into it with ease.
    is_agile: bool,
}

/// The present goal of a robot.
#[derive(Debug, Clone, Copy)]
pub(super) struct CurrentGoal<'a> {
    /// Shortest paths to it.
    pub(super) field: &'a FlowField,
    /// Whether it is the last one and was reached before.
    pub(super) is_done: bool,
}

impl CurrentGoal<'_> {
    /// Returns whether a robot with this lower-left box stands at its last goal.
    fn is_final_place(&self, at: (u32, u32)) -> bool {
        self.is_done && self.field.is_goal(at.0, at.1)
    }
}

impl Planner {
    /// Returns a planner for robots with this body; `walls` are the free boxes of the static map.
    pub(crate) fn new(
        walls: Arc<FreeSpace>,
        size: u32,
        body: &RobotBody,
        box_size_m: f64,
        wheels_err: bool,
    ) -> Self {
        let beam_model = BeamModel::new(walls, size, body, box_size_m);
        let may_err = wheels_err || !beam_model.are_reliable;
        Self { beam_model, may_err, is_agile: size == 1 && !may_err }
    }

    /// Returns the next action of a robot.
    pub(super) fn step(
        &self,
        goal: CurrentGoal<'_>,
        percept: &Percept<'_>,
        words: &mut Memory,
        draws: &mut Draws,
    ) -> ActionId {
        let heard = PassRequest::take_heard(words);
        let mut memory = PlannerMemory::from_memory(words);
        update_memory(&mut memory, goal, percept, draws);
        let is_free = heard.is_none() && !memory.is_occupied();
        if let Some(direction) = is_free.then(|| self.clear_direction(goal, percept)).flatten() {
            let then = next_direction(goal.field, percept.at, direction);
            memory.set_request(memory.rank, direction, then);
            memory.store(words);
            return turn_to(percept.heading, direction).unwrap_or(FORWARD);
        }
        let view = self.view(goal, percept, &memory, heard.is_some());
        // An obstacle ahead is believed to be there once more, because a sensor may miss it.
        let may_miss = !self.beam_model.are_reliable && view.blocked.len() <= MAX_SPARSE_BLOCKED;
        if may_miss && view.is_blocked(view.heading) && memory.bump_left == 0 {
            memory.bump = view.heading;
            memory.bump_left = BUMP_DECISIONS;
        }
        let mut rank = memory.rank;
        if let Some(request) = heard {
            if view.goes_that_way(request) {
                // It is in the way as little as it can: what stands before it hears of the higher rank.
                rank = rank.max(request.rank);
            } else {
                obey_request(&mut memory, request, &view, draws);
            }
        }
        // Making room comes first, because a robot of a higher rank waits for it.
        let action = if memory.yield_left > 0 {
            make_room(&mut memory, &view)
        } else if memory.stray_left > 0 && !memory.is_on_detour() {
            stray(&mut memory, &view, draws)
        } else if goal.is_final_place(percept.at) {
            STAY
        } else {
            travel(&mut memory, &view, rank, draws)
        };
        memory.store(words);
        action
    }

    /// Returns the direction of a shortest path on the static map, if nothing is noticed in its next step; none there, and
    /// at a goal.
    fn clear_direction(&self, goal: CurrentGoal<'_>, percept: &Percept<'_>) -> Option<u8> {
        let direction = goal_direction(goal.field, percept.at, percept.heading)?;
        self.beam_model.is_clear(percept, direction).then_some(direction)
    }

    /// Returns the places around a robot as it knows them: by the static map, its readings, and its
    /// last contact.
    fn view<'a>(
        &self,
        goal: CurrentGoal<'a>,
        percept: &Percept<'_>,
        memory: &PlannerMemory,
        is_asked: bool,
    ) -> LocalView<'a> {
        let costmap = self.beam_model.local_costmap(percept);
        let is_alone = costmap.is_none() && memory.bump_left == 0 && !is_asked;
        let LocalCostmap { mut blocked, vague } = costmap.unwrap_or_default();
        if memory.bump_left > 0 {
            let (east, north) = HEADINGS[usize::from(memory.bump)];
            blocked.insert(east, north);
        }
        LocalView {
            field: goal.field,
            at: percept.at,
            heading: percept.heading,
            blocked,
            vague,
            may_err: self.may_err,
            is_agile: self.is_agile,
            is_done: goal.is_done,
            is_alone,
        }
    }
}

/// Brings a robot's memory up to date: its last move, its progress, its last contact.
fn update_memory(
    memory: &mut PlannerMemory,
    goal: CurrentGoal<'_>,
    percept: &Percept<'_>,
    draws: &mut Draws,
) {
    let place = ((percept.at.0 & 15) << 4 | percept.at.1 & 15) as u8;
    memory.request = 0;
    memory.bump_left = memory.bump_left.saturating_sub(1);
    if memory.rank == 0 {
        memory.rank = draw_rank(draws);
        memory.place = place;
    }
    if goal.is_final_place(percept.at) {
        memory.rank = AT_LAST_GOAL_RANK;
    } else if goal.is_done {
        // One rank in four cycles: the ranks up to the highest one last for about 240 cycles.
        let growth = u8::from(percept.now.is_multiple_of(4));
        memory.rank = (memory.rank + growth).clamp(AT_LAST_GOAL_RANK + 1, MAX_DONE_RANK);
    }
    let moved = direction_between(memory.place, place);
    memory.place = place;
    if let Some(direction) = moved {
        memory.moved = direction + 1;
        if memory.is_on_detour() {
            end_detour(memory, goal, percept.at, direction);
        } else {
            memory.waited = 0;
        }
        memory.bump_left = 0;
        memory.yield_pending = false;
    }
    if memory.is_on_detour() {
        count_detour_decision(memory, goal, percept.at, moved);
    }
    memory.stuck = stuck_count(memory.stuck, goal, percept.at, moved);
    if memory.stuck >= MIN_STRAY_ACTIONS + memory.rank / 8 {
        start_straying(memory, goal, draws);
    }
    // Walls are on the static map, and need not be remembered.
    if let Some(contact) = percept.contact.filter(|contact| contact.kind != WALL) {
        memory.bump = (percept.heading + contact.side as u8) % 4;
        memory.bump_left = BUMP_DECISIONS;
    }
}

/// Ends a detour after a move along the path of the static map that is on lane: the robot is past what it has waited for.
fn end_detour(memory: &mut PlannerMemory, goal: CurrentGoal<'_>, at: (u32, u32), moved: u8) {
    let goes_along = goal.field.direction(at.0, at.1).is_none_or(|direction| direction == moved);
    let lanes = goal.field.lanes();
    let is_off_lane = lanes.is_some_and(|lanes| lanes.is_off_lane(at.0, at.1, moved));
    if goes_along && !is_off_lane {
        memory.waited = 0;
        memory.stray_left = 0;
    }
}

/// Counts a decision on a detour. Steps aside do not count, because the obstacle may be wide.
fn count_detour_decision(
    memory: &mut PlannerMemory,
    goal: CurrentGoal<'_>,
    at: (u32, u32),
    moved: Option<u8>,
) {
    let rise_back = moved.and_then(|moved| goal.field.rise(at.0, at.1, (moved + 2) % 4));
    let is_aside = rise_back.is_some_and(|rise| rise < 0);
    if is_aside {
        return;
    }
    memory.stray_left -= 1;
    if memory.stray_left == 0 {
        memory.waited = 0;
    }
}

/// Lets a robot leave a deadlock: with a new rank, because the old ones have led into it.
fn start_straying(memory: &mut PlannerMemory, goal: CurrentGoal<'_>, draws: &mut Draws) {
    memory.stuck = 0;
    memory.waited = 0;
    if !goal.is_done {
        memory.rank = draw_rank(draws);
    }
    // Drawn, so that two robots do not come back at once; at most 15, which four bits hold.
    memory.stray_left = 4 + draws.uniform_below(12) as u8;
    memory.yield_left = 0;
}

/// Returns how stuck a robot is after a move in this direction: less, the nearer the goal it came.
fn stuck_count(stuck: u8, goal: CurrentGoal<'_>, at: (u32, u32), moved: Option<u8>) -> u8 {
    if goal.is_final_place(at) {
        return stuck.saturating_sub(1);
    }
    let rise_back = moved.and_then(|direction| goal.field.rise(at.0, at.1, (direction + 2) % 4));
    match rise_back {
        Some(rise) if rise > 0 => stuck.saturating_sub(2),
        // More than a step forward takes off, so that going to and fro counts as being stuck.
        Some(rise) if rise < 0 => stuck.saturating_add(3),
        _ => stuck.saturating_add(1),
    }
}

/// Returns a rank of a robot that still has a goal, above all that have none.
fn draw_rank(draws: &mut Draws) -> u8 {
    MAX_DONE_RANK + 1 + draws.uniform_below(255 - u32::from(MAX_DONE_RANK)) as u8
}

/// Returns the direction from one place to another, both modulo 16; none where they are the same.
fn direction_between(from: u8, to: u8) -> Option<u8> {
    let east = signed_difference(from >> 4, to >> 4);
    let north = signed_difference(from, to);
    match (east, north) {
        (0, 0) => None,
        _ if east.abs() >= north.abs() => Some(if east > 0 { 0 } else { 2 }),
        _ => Some(if north > 0 { 1 } else { 3 }),
    }
}

/// Returns the difference of two numbers that are known modulo 16, as -8 to 7.
fn signed_difference(from: u8, to: u8) -> i32 {
    let step = (to & 15).wrapping_sub(from & 15) & 15;
    if step < 8 { i32::from(step) } else { i32::from(step) - 16 }
}

/// Chooses where to make room, if a request has a rank above those that bind the robot.
fn obey_request(
    memory: &mut PlannerMemory,
    request: PassRequest,
    view: &LocalView<'_>,
    draws: &mut Draws,
) {
    let own = memory.rank;
    let inherited = if memory.yield_left > 0 { memory.yield_rank * 8 } else { 0 };
    if request.rank <= own.max(inherited) {
        return;
    }
    let place_to_leave_to = cheapest_exit(request, view, draws);
    // A robot at its goal that is asked again and again stands in a jam: a few requests let it stray.
    if own == AT_LAST_GOAL_RANK && memory.yield_left == 0 {
        memory.stuck = memory.stuck.saturating_add(10);
    }
    if let Some(direction) = place_to_leave_to {
        memory.yield_to = direction;
        memory.yield_pending = true;
        memory.yield_left = KEEP_AWAY_DECISIONS;
        memory.yield_rank = request.rank / 8;
    }
}

/// Returns the direction in which a robot best makes room; none where walls leave it only the one
/// that the request comes from.
fn cheapest_exit(request: PassRequest, view: &LocalView<'_>, draws: &mut Draws) -> Option<u8> {
    let asked_from = (request.toward + 2) % 4;
    let mut best: Option<(u32, u8)> = None;
    for direction in (0..4).filter(|&direction| direction != asked_from) {
        let Some(rise) = view.rise(direction) else { continue };
        let turn = (4 + direction - view.heading) % 4;
        // All else together is below the 32 of a blocked place, so a free one is always taken. The place
        // into which the asking robot goes next would have to be left again. The draw decides between
        // equal places, so that two robots that make room do not go on choosing alike.
        let price = 32 * u32::from(view.is_blocked(direction))
            + 12 * u32::from(request.then == Some(direction))
            + 4 * (rise.signum() + 1) as u32
            + 2 * u32::from(turn.min(4 - turn))
            + draws.uniform_below(2);
        if best.is_none_or(|(least, _)| price < least) {
            best = Some((price, direction));
        }
    }
    best.map(|(_, direction)| direction)
}

/// Leaves its place as it was asked to, then keeps away from it for some decisions.
fn make_room(memory: &mut PlannerMemory, view: &LocalView<'_>) -> ActionId {
    memory.yield_left -= 1;
    if !memory.yield_pending {
        return STAY;
    }
    let direction = memory.yield_to;
    if view.is_blocked(direction) {
        // The rank is kept in steps of 8, and the highest one of the step is passed on: the next robot
        // must obey wherever this one did.
        let inherited_rank = memory.yield_rank.saturating_mul(8).saturating_add(7);
        memory.set_request(inherited_rank, direction, None);
    } else {
        // Only the decisions after the move count.
        memory.yield_left = KEEP_AWAY_DECISIONS;
    }
    match turn_to(view.heading, direction) {
        Some(turn) => turn,
        None if view.is_blocked(direction) => STAY,
        None => FORWARD,
    }
}

/// Goes somewhere at random, to get out of a deadlock; mostly ahead, because a turn gains no distance.
fn stray(memory: &mut PlannerMemory, view: &LocalView<'_>, draws: &mut Draws) -> ActionId {
    memory.stray_left -= 1;
    if view.is_open(view.heading) && draws.uniform_below(4) > 0 {
        memory.set_request(memory.rank, view.heading, None);
        return FORWARD;
    }
    if draws.uniform_below(2) == 0 { LEFT } else { RIGHT }
}

/// Takes the next step toward the goal, or waits before an obstacle, and asks for room with a rank.
fn travel(
    memory: &mut PlannerMemory,
    view: &LocalView<'_>,
    rank: u8,
    draws: &mut Draws,
) -> ActionId {
    let direction = if view.is_alone {
        view.goal_direction()
    } else {
        detour::first_step(view, step_costs(memory, view))
    };
    let Some(direction) = direction else { return STAY };
    if !memory.is_on_detour()
        && view.field.lanes().is_some()
        && memory.waited >= patient_decisions(memory, view.is_agile)
        && !view.descends(direction)
    {
        memory.waited = MAX_WAITED;
        memory.stray_left = DETOUR_DECISIONS;
    }
    memory.set_request(rank, direction, view.next_direction(direction));
    if let Some(turn) = turn_to(view.heading, direction) {
        return turn;
    }
    if view.is_blocked(direction) {
        memory.waited += 1;
        // Sensors that err may see something in a narrow gap forever. When its patience is over, one decision in four tries
        // to go on, so that of two robots that wait for each other mostly one moves. Where nothing errs it is there.
        let has_waited = view.may_err && memory.waited > PATIENT_DECISIONS;
        let tries = has_waited && draws.uniform_below(4) == 0;
        return if tries { FORWARD } else { STAY };
    }
    let may_yield = memory.waited < MAX_YIELD_DECISIONS && view.blocked.len() <= MAX_SPARSE_BLOCKED;
    if may_yield && should_yield(view, direction, draws) {
        memory.waited += 1;
        return STAY;
    }
    FORWARD
}

/// Returns the prices of a detour, which depend on how long the robot has waited, on whether it has to allow for errors, and
/// on whether it is in a crowd.
fn step_costs(memory: &PlannerMemory, view: &LocalView<'_>) -> StepCosts {
    let moved = memory.moved.checked_sub(1);
    let is_patient = memory.waited < patient_decisions(memory, view.is_agile);
    let off_lane = if is_patient { OFF_LANE_COST } else { 1 };
    let blocked = if view.field.lanes().is_none() {
        // At first cheaper than most detours, because the obstacle may go away; each decision in vain
        // makes a longer detour worth it.
        (3 + 4 * u16::from(memory.waited)).min(IMPATIENT_BLOCKED_COST)
    } else if !is_patient {
        IMPATIENT_BLOCKED_COST
    } else if view.is_agile {
        AGILE_PATIENT_BLOCKED_COST
    } else {
        PATIENT_BLOCKED_COST
    };
    let is_in_crowd = view.blocked.len() > MAX_FEW_BLOCKED;
    let beside = if view.may_err && !is_in_crowd { CAREFUL_BESIDE_COST } else { BESIDE_COST };
    let has_gained =
        moved.is_some_and(|moved| view.rise((moved + 2) % 4).is_some_and(|rise| rise > 0));
    // Where nothing errs robots see enough to keep to every change of course.
    let is_sidestep = !view.may_err || moved.is_some() && !has_gained;
    StepCosts {
        blocked,
        off_lane,
        is_on_detour: memory.is_on_detour(),
        beside,
        vague: VAGUE_COST,
        moved,
        is_sidestep,
    }
}

/// Returns the decisions for which a robot waits before something on its lane.
fn patient_decisions(memory: &PlannerMemory, is_agile: bool) -> u8 {
    if !is_agile {
        return PATIENT_DECISIONS;
    }
    let lost = memory.stuck / STUCK_POINTS_PER_DECISION;
    PATIENT_DECISIONS.saturating_sub(lost).max(MIN_PATIENT_DECISIONS)
}

/// Returns whether to let another robot pass that may step into the same place: one from the
/// right goes first, and of two head on one by a fair draw. It is a draw in both cases, because the thing
/// on the right may also be a parked body, which never goes first.
fn should_yield(view: &LocalView<'_>, direction: u8, draws: &mut Draws) -> bool {
    let is_on_right = view.is_blocked_beyond(direction, direction + 3);
    let comes = is_on_right || view.is_blocked_beyond(direction, direction);
    comes && draws.uniform_below(2) == 0
}

fn turn_to(heading: u8, direction: u8) -> Option<ActionId> {
    match (4 + direction - heading) % 4 {
        0 => None,
        3 => Some(RIGHT),
        // To go back, two turns to the left do it.
        _ => Some(LEFT),
    }
}

#[cfg(test)]
mod patience_tests {
    use super::*;

    #[test]
    fn who_makes_no_progress_for_long_has_less_patience_but_some() {
        let patience = |stuck: u8, is_agile: bool| {
            patient_decisions(&PlannerMemory { stuck, ..PlannerMemory::default() }, is_agile)
        };
        assert_eq!(
            [0, 3, 4, 40, 72, 255].map(|stuck| patience(stuck, true)),
            [20, 20, 19, 10, 2, 2]
        );
        assert_eq!([0, 40, 255].map(|stuck| patience(stuck, false)), [20; 3]);
    }
}
