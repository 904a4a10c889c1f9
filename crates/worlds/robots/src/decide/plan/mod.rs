//! Going somewhere among others: around the things that are sensed, and out of each other's way.
//!
//! Every robot decides alone, from its percept, its memory, the static map and the way to its goal:
//!
//! 1. *Sight*: readings that the static map does not explain block places around the robot; so does
//!    the last contact, for a few decisions.
//! 2. *Detour*: the cheapest way through the places around it. A blocked place costs some actions
//!    that grow while the robot waits, because the obstacle may go away.
//! 3. *Requests*: a robot that waits before something asks it to make room ([`super::set_request`]). A robot
//!    obeys a rank above its own: it takes a free place that it was not asked for, or passes the
//!    request on with the same rank (priority inheritance, as in PIBT: Okumura et al., "Priority
//!    inheritance with backtracking for iterative multi-agent path finding", 2022). Ranks are drawn;
//!    a robot that stands at its last goal has none and obeys every other, then returns.
//! 4. *Deadlock*: after many actions without progress a robot draws a new rank and strays for some
//!    actions. Without this, two robots in a dead end could wait for each other forever.

mod detour;
mod local_costmap;
mod memory;
#[cfg(test)]
mod tests;

use super::pass_request::PassRequest;
use super::{Memory, Percept};
use crate::effector::{ActionId, FORWARD, HEADINGS, LEFT, RIGHT, STAY};
use crate::sensor::WALL;
use crate::world::RobotBody;
use detour::StepCosts;
use local_costmap::{BeamModel, LocalBoxSet, LocalCostmap};
use memory::PlannerMemory;
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::{FlowField, FreeSpace};
use std::sync::Arc;

/// Actions without progress after which a robot strays, at least; its rank adds up to 31, so that
/// not all stray at once.
const MIN_STRAY_ACTIONS: u8 = 64;
/// Decisions for which a robot believes that the thing it has touched is still there.
const BUMP_DECISIONS: u8 = 2;
/// Decisions for which a robot keeps out of a place that it was asked to leave.
const KEEP_AWAY_DECISIONS: u8 = 1;

/// Decisions to wait before something after which a robot with sensors that err tries to go on.
const WAIT_TIMEOUT_DECISIONS: u8 = 5;
/// Highest rank of a robot that has been at its last goal and was asked to leave it. Its rank grows
/// with the time that it is away.
const MAX_DONE_RANK: u8 = 63;

/// Plans the steps of robots of one type.
#[derive(Debug)]
pub struct Planner {
    beam_model: BeamModel,
    /// Whether sensors or wheels err, so that robots had better keep their distance.
    is_careful: bool,
}

/// The present goal of a robot.
#[derive(Debug, Clone, Copy)]
pub(super) struct CurrentGoal<'a> {
    /// Ways to it.
    pub(super) field: &'a FlowField,
    /// Whether it is the last one and was reached before.
    pub(super) is_done: bool,
}

/// Everything that a robot knows of the places around it.
struct LocalView<'a> {
    field: &'a FlowField,
    at: (u32, u32),
    heading: u8,
    blocked: LocalBoxSet,
    vague: LocalBoxSet,
    /// See [`Planner::is_careful`].
    is_careful: bool,
    /// Whether no other body is noticed.
    is_alone: bool,
}

impl LocalView<'_> {
    fn offset(&self, col: i32, row: i32) -> (u32, u32) {
        (self.at.0.wrapping_add_signed(col), self.at.1.wrapping_add_signed(row))
    }

    fn rise(&self, direction: u8) -> Option<i8> {
        self.field.rise(self.at.0, self.at.1, direction)
    }

    fn is_blocked(&self, direction: u8) -> bool {
        let (east, north) = HEADINGS[usize::from(direction)];
        self.blocked.contains(east, north)
    }

    /// Returns the direction of a shortest way on the static map; ahead where there is one.
    fn goal_direction(&self) -> Option<u8> {
        if self.rise(self.heading) == Some(-1) {
            return Some(self.heading);
        }
        self.field.direction(self.at.0, self.at.1)
    }

    /// Returns the direction in which the way goes on behind the next place.
    fn next_direction(&self, direction: u8) -> Option<u8> {
        let (east, north) = HEADINGS[usize::from(direction)];
        let (col, row) = self.offset(east, north);
        self.field.direction(col, row)
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
        let eyes = BeamModel::new(walls, size, body, box_size_m);
        Self { is_careful: wheels_err || !eyes.are_reliable, beam_model: eyes }
    }

    /// Returns the next action of a robot.
    pub(super) fn step(
        &self,
        way: CurrentGoal<'_>,
        percept: &Percept<'_>,
        memory: &mut Memory,
        draws: &mut Draws,
    ) -> ActionId {
        let heard = PassRequest::take_heard(memory);
        let mut mood = PlannerMemory::from_memory(memory);
        update_memory(&mut mood, way, percept, draws);
        let seen = self.beam_model.local_costmap(percept);
        let is_alone = seen.is_none() && mood.bump_left == 0 && heard.is_none();
        let LocalCostmap { mut blocked, vague } = seen.unwrap_or_default();
        if mood.bump_left > 0 {
            let (east, north) = HEADINGS[usize::from(mood.bump)];
            blocked.insert(east, north);
        }
        let (at, heading) = (percept.at, percept.heading);
        let is_careful = self.is_careful;
        let view =
            LocalView { field: way.field, at, heading, blocked, vague, is_alone, is_careful };
        // An obstacle ahead is believed to be there once more, because a sensor may miss it.
        if !self.beam_model.are_reliable && view.is_blocked(heading) && mood.bump_left == 0 {
            mood.bump = heading;
            mood.bump_left = BUMP_DECISIONS;
        }
        obey_request(&mut mood, heard, &view, draws);
        let stands = way.is_done && way.field.is_goal(at.0, at.1);
        let action = if mood.yield_left > 0 {
            make_room(&mut mood, &view)
        } else if mood.stray_left > 0 {
            stray(&mut mood, &view, draws)
        } else if stands {
            STAY
        } else {
            travel(&mut mood, &view, draws)
        };
        mood.store(memory);
        action
    }
}

/// Brings a robot's memory up to date: its last move, its progress, its last contact.
fn update_memory(
    mood: &mut PlannerMemory,
    way: CurrentGoal<'_>,
    percept: &Percept<'_>,
    draws: &mut Draws,
) {
    let place = ((percept.at.0 & 15) << 4 | percept.at.1 & 15) as u8;
    mood.request = 0;
    mood.bump_left = mood.bump_left.saturating_sub(1);
    if mood.rank == 0 {
        mood.rank = draw_rank(draws);
        mood.place = place;
    }
    if way.is_done {
        mood.rank = match way.field.is_goal(percept.at.0, percept.at.1) {
            true => 1,
            false => (mood.rank + u8::from(percept.now.is_multiple_of(4))).clamp(2, MAX_DONE_RANK),
        };
    }
    let moved = direction_between(mood.place, place);
    mood.place = place;
    if let Some(direction) = moved {
        mood.moved = direction + 1;
        mood.waited = 0;
        mood.bump_left = 0;
        mood.yield_pending = false;
    }
    mood.stuck = stuck_count(mood.stuck, way, percept.at, moved);
    if mood.stuck >= MIN_STRAY_ACTIONS + mood.rank / 8 {
        mood.stuck = 0;
        if !way.is_done {
            mood.rank = draw_rank(draws);
        }
        mood.stray_left = 4 + draws.uniform_below(12) as u8;
        mood.yield_left = 0;
    }
    if let Some(contact) = percept.contact.filter(|contact| contact.kind != WALL) {
        mood.bump = (percept.heading + contact.side as u8) % 4;
        mood.bump_left = BUMP_DECISIONS;
    }
}

/// Returns how stuck a robot is after a move in this direction: less, the nearer the goal it came.
fn stuck_count(stuck: u8, way: CurrentGoal<'_>, (col, row): (u32, u32), moved: Option<u8>) -> u8 {
    let rise_back = moved.and_then(|d| way.field.rise(col, row, (d + 2) % 4));
    match rise_back {
        _ if way.is_done && way.field.is_goal(col, row) => stuck.saturating_sub(1),
        Some(1) => stuck.saturating_sub(2),
        Some(-1) => stuck.saturating_add(3),
        _ => stuck.saturating_add(1),
    }
}

fn draw_rank(draws: &mut Draws) -> u8 {
    MAX_DONE_RANK + 1 + draws.uniform_below(255 - u32::from(MAX_DONE_RANK)) as u8
}

/// Returns the direction from one place to another, both modulo 16; none where they are the same.
fn direction_between(from: u8, to: u8) -> Option<u8> {
    let part = |shift: u8| {
        let step = (to >> shift & 15).wrapping_sub(from >> shift & 15) & 15;
        if step < 8 { i32::from(step) } else { i32::from(step) - 16 }
    };
    let (east, north) = (part(4), part(0));
    match (east, north) {
        (0, 0) => None,
        _ if east.abs() >= north.abs() => Some(if east > 0 { 0 } else { 2 }),
        _ => Some(if north > 0 { 1 } else { 3 }),
    }
}

/// Chooses where to make room, where a request is to be obeyed.
fn obey_request(
    mood: &mut PlannerMemory,
    heard: Option<PassRequest>,
    view: &LocalView<'_>,
    draws: &mut Draws,
) {
    let Some(ask) = heard else { return };
    let own = mood.rank;
    let bound = if mood.yield_left > 0 { own.max(mood.yield_rank * 8) } else { own };
    if ask.rank <= bound {
        return;
    }
    let from = (ask.toward + 2) % 4;
    let mut best: Option<(u32, u8)> = None;
    for direction in (0..4).filter(|&d| d != from) {
        let Some(rise) = view.rise(direction) else { continue };
        let turn = (4 + direction - view.heading) % 4;
        let price = 32 * u32::from(view.is_blocked(direction))
            + 12 * u32::from(ask.then == Some(direction))
            + 4 * (rise + 1) as u32
            + 2 * u32::from(turn.min(4 - turn))
            + draws.uniform_below(2);
        if best.is_none_or(|(least, _)| price < least) {
            best = Some((price, direction));
        }
    }
    if own == 1 && mood.yield_left == 0 {
        mood.stuck = mood.stuck.saturating_add(10);
    }
    if let Some((_, direction)) = best {
        mood.yield_to = direction;
        mood.yield_pending = true;
        mood.yield_left = KEEP_AWAY_DECISIONS;
        mood.yield_rank = ask.rank / 8;
    }
}

/// Leaves its place as it was asked to, then keeps away from it for a while.
fn make_room(mood: &mut PlannerMemory, view: &LocalView<'_>) -> ActionId {
    mood.yield_left -= 1;
    if !mood.yield_pending {
        return STAY;
    }
    let direction = mood.yield_to;
    if view.is_blocked(direction) {
        mood.set_request(mood.yield_rank.saturating_mul(8).saturating_add(7), direction, None);
    } else {
        // It counts only the decisions after the move.
        mood.yield_left = KEEP_AWAY_DECISIONS;
    }
    match turn_to(view.heading, direction) {
        Some(turn) => turn,
        None if view.is_blocked(direction) => STAY,
        None => FORWARD,
    }
}

/// Goes somewhere, to get out of a deadlock.
fn stray(mood: &mut PlannerMemory, view: &LocalView<'_>, draws: &mut Draws) -> ActionId {
    mood.stray_left -= 1;
    let is_open = |d: u8| view.rise(d).is_some() && !view.is_blocked(d);
    if is_open(view.heading) && draws.uniform_below(4) > 0 {
        mood.set_request(mood.rank, view.heading, None);
        return FORWARD;
    }
    if draws.uniform_below(2) == 0 { LEFT } else { RIGHT }
}

/// Takes the next step toward the goal, or waits before an obstacle.
fn travel(mood: &mut PlannerMemory, view: &LocalView<'_>, draws: &mut Draws) -> ActionId {
    let direction = if view.is_alone {
        view.goal_direction()
    } else {
        let blocked = 3 + 4 * u16::from(mood.waited);
        let moved = mood.moved.checked_sub(1);
        let (beside, vague) = if view.is_careful { (6, 5) } else { (1, 1) };
        // Where nothing errs robots see enough to keep to every change of course.
        let gained = |moved: u8| view.rise((moved + 2) % 4) == Some(1);
        let is_sidestep = !view.is_careful || moved.is_some_and(|moved| !gained(moved));
        detour::first_step(view, StepCosts { blocked, beside, vague, moved, is_sidestep })
    };
    let Some(direction) = direction else { return STAY };
    mood.set_request(mood.rank, direction, view.next_direction(direction));
    if let Some(turn) = turn_to(view.heading, direction) {
        return turn;
    }
    if view.is_blocked(direction) {
        mood.waited += 1;
        // Sensors that err may see something in a narrow gap forever.
        let tries =
            view.is_careful && mood.waited > WAIT_TIMEOUT_DECISIONS && draws.uniform_below(4) == 0;
        return if tries { FORWARD } else { STAY };
    }
    if mood.waited < 4 && should_yield(view, direction, draws) {
        mood.waited += 1;
        return STAY;
    }
    FORWARD
}

/// Returns whether to let another robot pass that may step into the same place: one from the
/// right goes first, and of two head on one by a fair draw.
fn should_yield(view: &LocalView<'_>, direction: u8, draws: &mut Draws) -> bool {
    let (east, north) = HEADINGS[usize::from(direction)];
    let beside = |d: u8| {
        let (e, n) = HEADINGS[usize::from(d % 4)];
        view.blocked.contains(east + e, north + n)
    };
    let comes = beside(direction + 3) || beside(direction);
    comes && draws.uniform_below(2) == 0
}

fn turn_to(heading: u8, direction: u8) -> Option<ActionId> {
    match (4 + direction - heading) % 4 {
        0 => None,
        3 => Some(RIGHT),
        _ => Some(LEFT),
    }
}
