//! Looks at robots with goals between cycles, every [`CHECK_CYCLES`](super::progress::CHECK_CYCLES) cycles.
//!
//! ```text
//! mod.rs        for each robot, the least cost of its path since it has its goal, and who was in its way since then
//! circles.rs    robots that wait for each other in a circle
//! ```

mod circles;

use super::perceive::memory_of;
use super::plan::place_in_team;
use super::progress::{Approach, Gridlock, GridlockEvent, Obstruction, Progress};
use super::state::{BodyState, RobotsState};
use super::team::Errand;
use super::world::{RobotsWorld, Role};
use sidestep_kernel::{Cycle, EntityId};
use sidestep_map::planning::FlowField;

/// Boxes that a robot with tasks has to get away from a place to be stalled there no more: more than robots stray that push
/// each other to and fro.
const FAR_BOXES: u32 = 8;

/// Cycles without coming nearer to its goal after which a robot may be in a gridlock: planning robots draw new ranks
/// and stray after 64 to 95 actions in vain, and most jams come loose then, or the next time.
const STALL_CYCLES: Cycle = 200;

impl RobotsWorld {
    /// Returns the progress of robots that begin to be looked at.
    pub(super) fn start_progress(&self, state: &RobotsState, now: Cycle) -> Progress {
        let approaches = self.watched_robots.iter().map(|&id| {
            let mut approach = Approach::default();
            self.update_approach(&mut approach, state, id, now);
            approach
        });
        Progress { approaches: approaches.collect(), checked: now, ..Progress::default() }
    }

    /// Looks at all robots with goals after `now` cycles; returns the gridlocks that have begun or come loose.
    pub(super) fn check_progress(
        &self,
        progress: &mut Progress,
        state: &RobotsState,
        now: Cycle,
    ) -> Vec<GridlockEvent> {
        progress.checked = now;
        let mut stalled = Vec::new();
        for (approach, &id) in progress.approaches.iter_mut().zip(&self.watched_robots) {
            self.update_approach(approach, state, id, now);
            if approach.goal.is_none() || approach.nearer_at == now {
                continue;
            }
            let window = self.stall_cycles(id);
            approach.obstructions.retain(|obstruction| now - obstruction.at < window);
            if self.has_errands(id) {
                // The paths to an errand are searched for only where it is likely that the robot is stalled.
                if now - approach.nearer_at < window / 2 {
                    continue;
                }
                self.compare_errand_cost(approach, state, id, now);
                if approach.nearer_at == now {
                    continue;
                }
            }
            let steps = self.steps_in_way(state, id);
            approach.obstructions.extend(steps.map(|steps| Obstruction { at: now, steps }));
            if now - approach.nearer_at >= window {
                stalled.push(id);
            }
        }
        let mut events = end_gridlocks(progress, &stalled);
        // One robot alone waits for nobody that waits for it.
        if stalled.len() > 1 {
            for robots in circles::find_circles(self.waiting_robots(progress, &stalled)) {
                events.extend(self.begin_gridlock(progress, robots));
            }
        }
        events
    }

    /// Returns the number of cycles after which a robot may be in a gridlock. One that acts seldom, or slowly, has as many
    /// actions as others to come nearer.
    fn stall_cycles(&self, id: EntityId) -> Cycle {
        let body = &self.bodies[id as usize];
        STALL_CYCLES * u64::from(body.period) * u64::from(body.action_cycles)
    }

    /// Returns some robots, with those that were in their way lately.
    fn waiting_robots<'a>(
        &self,
        progress: &'a Progress,
        stalled: &[EntityId],
    ) -> Vec<circles::WaitingRobot<'a>> {
        let robots = self.watched_robots.iter().zip(&progress.approaches);
        let waiting = robots.filter(|(id, _)| stalled.binary_search(id).is_ok());
        waiting
            .map(|(&id, approach)| circles::WaitingRobot {
                id,
                obstructions: &approach.obstructions,
            })
            .collect()
    }

    /// Adds a circle that was found: one that stands already only grows.
    fn begin_gridlock(
        &self,
        progress: &mut Progress,
        robots: Vec<EntityId>,
    ) -> Option<GridlockEvent> {
        let known = progress.gridlocks.iter().position(|known| known.shares_robot(&robots));
        if let Some(known) = known {
            let is_new =
                |id: &EntityId| !progress.gridlocks.iter().any(|one| one.robots.contains(id));
            let new: Vec<EntityId> = robots.into_iter().filter(is_new).collect();
            progress.gridlocks[known].robots.extend(new);
            progress.gridlocks[known].robots.sort_unstable();
            return None;
        }
        let since = self.last_nearer(progress, &robots);
        let gridlock = Gridlock { since, robots };
        progress.gridlocks_begun += 1;
        progress.first_found.get_or_insert_with(|| (progress.checked, gridlock.clone()));
        progress.gridlocks.push(gridlock.clone());
        Some(GridlockEvent { cycle: progress.checked - 1, has_begun: true, gridlock })
    }

    /// Returns the last look at which one of some robots had come nearer to its goal.
    fn last_nearer(&self, progress: &Progress, robots: &[EntityId]) -> Cycle {
        let places = robots.iter().filter_map(|id| self.watched_robots.binary_search(id).ok());
        places.map(|place| progress.approaches[place].nearer_at).max().unwrap_or(0)
    }

    /// Brings an approach up to date with a robot's present place and goal.
    fn update_approach(
        &self,
        approach: &mut Approach,
        state: &RobotsState,
        id: EntityId,
        now: Cycle,
    ) {
        let body = state.body(id);
        if self.has_errands(id) {
            return self.update_errand_approach(approach, state, body, now);
        }
        let place = self.map_position(body.position());
        let goal = self.goal_of(body);
        let number = goal.map(|(number, _)| number);
        let is_same_goal = number.is_some() && number == approach.goal;
        let cost = match goal {
            Some((_, field)) if is_same_goal => cost_after(field, approach, body, place),
            Some((_, field)) => field.cost(place.0, place.1),
            None => None,
        };
        // Without a path to it, a goal is none.
        approach.goal = number.filter(|_| cost.is_some());
        approach.cost = cost.unwrap_or(0);
        approach.place = place;
        approach.moves = body.moves.get();
        if !is_same_goal || approach.cost < approach.least_cost {
            approach.least_cost = approach.cost;
            approach.nearer_at = now;
            approach.obstructions.clear();
        }
    }

    /// Brings the approach of a robot with tasks up to date. It counts as coming nearer when it has done an errand, or gets
    /// far from where it was: to know what its path costs, paths from everywhere to its errand would have to be searched
    /// for at each errand.
    fn update_errand_approach(
        &self,
        approach: &mut Approach,
        state: &RobotsState,
        body: &BodyState,
        now: Cycle,
    ) {
        let place = self.map_position(body.position());
        let errand = place_in_team(self, body.id)
            .and_then(|(team, robot)| state.planner_teams[team].errand(robot));
        let number = errand.map(|errand| errand.number);
        let errands_done = errands_done(body, errand);
        let boxes = approach.place.0.abs_diff(place.0).max(approach.place.1.abs_diff(place.1));
        // A task that nobody has begun may be given to another robot at any time: that is no progress of either.
        let has_done_one = errands_done != approach.errands_done;
        if number.is_none() || approach.goal.is_none() || has_done_one || boxes >= FAR_BOXES {
            approach.place = place;
            approach.nearer_at = now;
            approach.obstructions.clear();
        }
        if number != approach.goal {
            approach.least_cost = u32::MAX;
        }
        approach.goal = number;
        approach.errands_done = errands_done;
        approach.moves = body.moves.get();
    }

    /// Notes whether a robot with tasks that may be stalled is nearer to its errand than at any look before at which it may
    /// have been.
    fn compare_errand_cost(
        &self,
        approach: &mut Approach,
        state: &RobotsState,
        id: EntityId,
        now: Cycle,
    ) {
        let Some((team, robot)) = place_in_team(self, id) else { return };
        let Some(field) = state.planner_teams[team].errand_field(robot) else { return };
        let (col, row) = self.map_position(state.body(id).position());
        let Some(cost) = field.cost(col, row) else { return };
        if approach.least_cost != u32::MAX && cost < approach.least_cost {
            approach.nearer_at = now;
            approach.obstructions.clear();
        }
        approach.least_cost = approach.least_cost.min(cost);
    }

    /// Returns whether a robot is one of a team with tasks.
    fn has_errands(&self, id: EntityId) -> bool {
        let team = place_in_team(self, id).map(|(team, _)| &self.planner_teams[team]);
        team.is_some_and(|team| team.tasks.is_some())
    }

    /// Returns the bodies in the way of a robot by the first steps of its paths, see [`circles::bodies_in_way`].
    fn steps_in_way(&self, state: &RobotsState, id: EntityId) -> Option<Vec<Vec<EntityId>>> {
        let body = state.body(id);
        if let Some((_, field)) = self.goal_of(body) {
            return circles::bodies_in_way(self, state, body, field);
        }
        let (team, robot) = place_in_team(self, id)?;
        let field = state.planner_teams[team].errand_field(robot)?;
        circles::bodies_in_way(self, state, body, &field)
    }

    /// Returns the bodies, by rising id, that stand on all paths to a robot's goal, within the boxes that it looks ahead;
    /// none where it can go on by one of them.
    pub(super) fn bodies_in_way(&self, state: &RobotsState, id: EntityId) -> Vec<EntityId> {
        let steps = self.steps_in_way(state, id);
        let mut bodies: Vec<EntityId> = steps.into_iter().flatten().flatten().collect();
        bodies.sort_unstable();
        bodies.dedup();
        bodies
    }

    /// Returns the number of entries of [`RobotsState::waits`].
    pub(super) fn waits_len(&self) -> usize {
        if self.goal_robots.is_empty() { 0 } else { self.bodies.len() }
    }

    /// Returns whether a body is a robot that goes somewhere.
    pub(super) fn has_goal(&self, body: &BodyState) -> bool {
        self.goal_of(body).is_some()
    }

    /// Returns the present goal of a robot: its number among those of its behavior, and the paths to it.
    pub(super) fn goal_of(&self, body: &BodyState) -> Option<(u32, &FlowField)> {
        let Role::Robot(model) = &self.type_of(body.id).role else { return None };
        let number = model.behaviour.goal(&memory_of(body))?;
        let field = model.behaviour.flow_fields().get(number)?;
        Some((number as u32, field))
    }
}

impl RobotsState {
    /// Counts a turn in which a body neither moved nor turned, if it is a robot with a goal.
    pub(super) fn count_wait(&self, world: &RobotsWorld, body: &BodyState) {
        if world.has_goal(body) {
            self.waits.add(body.id as usize, 1);
        }
    }

    /// Returns the turns in which a body waited.
    pub(super) fn waits_of(&self, id: EntityId) -> u64 {
        if self.waits.is_empty() { 0 } else { u64::from(self.waits.get(id as usize)) }
    }
}

/// Returns a number that changes whenever a robot with tasks has done an errand.
fn errands_done(body: &BodyState, errand: Option<Errand>) -> u32 {
    let visited = errand.map_or(0, |errand| errand.visited);
    // Eight bits for the errands of a task: of two that would be mixed up, the robot has done one long before the other.
    body.trips.get() << 8 | visited & 0xff
}

/// Returns what the path of a robot costs that still goes to the goal of the last look. Few steps change it by an
/// amount that the field knows, and only after many the robot's path has to be gone along.
fn cost_after(
    field: &FlowField,
    last: &Approach,
    body: &BodyState,
    place: (u32, u32),
) -> Option<u32> {
    if body.moves.get() - last.moves > FlowField::MAX_COMPARABLE_STEPS {
        return field.cost(place.0, place.1);
    }
    last.cost.checked_add_signed(field.cost_difference(last.place, place)?)
}

/// Takes out the gridlocks of which more than half of the robots have come nearer to their goals: in a jam in which
/// robots stray, one of them now and then comes a step nearer than ever before.
fn end_gridlocks(progress: &mut Progress, stalled: &[EntityId]) -> Vec<GridlockEvent> {
    let cycle = progress.checked - 1;
    let has_ended = |gridlock: &mut Gridlock| {
        let still = gridlock.robots.iter().filter(|&id| stalled.binary_search(id).is_ok());
        2 * still.count() < gridlock.robots.len()
    };
    let ended = progress.gridlocks.extract_if(.., has_ended);
    ended.map(|gridlock| GridlockEvent { cycle, has_begun: false, gridlock }).collect()
}

#[cfg(test)]
mod tests;
