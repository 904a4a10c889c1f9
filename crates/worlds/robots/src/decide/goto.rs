//! Going somewhere: along shortest paths on the static map, and past obstacles.

use super::plan::{CurrentGoal, Planner};
use super::sidestep::{SensorTrust, sidestep};
use super::touch::follow;
use super::{Behaviour, Decision, Memory, Percept, TripEvent};
use crate::effector::{ActionId, STAY};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;
use std::sync::Arc;

/// The rule by which a robot that goes somewhere deals with obstacles.
#[derive(Debug, Clone)]
pub enum Avoidance {
    /// Plans around the things that it senses, and makes room for others.
    Plan(Arc<Planner>),
    /// Steps aside from near things that its sensors report.
    Sidestep(SensorTrust),
    /// Keeps to its path until it touches something, then waits or steps aside at random.
    Touch,
}

impl Avoidance {
    fn step(
        &self,
        goal: CurrentGoal<'_>,
        percept: &Percept<'_>,
        memory: &mut Memory,
        draws: &mut Draws,
    ) -> ActionId {
        match self {
            Self::Plan(planner) => planner.step(goal, percept, memory, draws),
            // Only planners hear requests, and leave a goal for others.
            _ if goal.is_done => STAY,
            Self::Sidestep(trust) => sidestep(*trust, goal.field, percept, memory, draws),
            Self::Touch => follow(goal.field, percept, memory, draws),
        }
    }

    fn has_requests(&self) -> bool {
        matches!(self, Self::Plan(_))
    }
}

/// Visits goals in order; each robot starts with the goals of its own list.
#[derive(Debug, Clone)]
pub struct Goto {
    /// Shortest paths to the goals, in order.
    pub goals: Vec<Arc<FlowField>>,
    /// Whether it starts again after the last goal, rather than staying there.
    pub repeat: bool,
    /// Its rule for obstacles.
    pub avoidance: Avoidance,
}

/// Goes back and forth between two regions; a trip is there and back again.
#[derive(Debug, Clone)]
pub struct Shuttle {
    /// Shortest paths to the two regions.
    pub ends: [Arc<FlowField>; 2],
    /// Its rule for obstacles.
    pub avoidance: Avoidance,
}

/// Word 0: number of goals reached (wraps at the length for a repeated list). The other words belong
/// to the avoidance.
const GOALS_REACHED_WORD: usize = 0;

impl Goto {
    /// Counts the goals that are reached here, and returns the next one; none where all goals of a
    /// repeated list are here.
    fn next_goal(
        &self,
        percept: &Percept<'_>,
        memory: &mut Memory,
    ) -> (Option<CurrentGoal<'_>>, Option<TripEvent>) {
        let mut trip = None;
        loop {
            let reached = memory.words[GOALS_REACHED_WORD] as usize;
            let Some(field) = self.goals.get(reached) else {
                let last = self.goals.last();
                return (last.map(|field| CurrentGoal { field, is_done: true }), trip);
            };
            if !field.is_goal(percept.at.0, percept.at.1) {
                return (Some(CurrentGoal { field, is_done: false }), trip);
            }
            trip = Some(TripEvent::Completed);
            memory.words[GOALS_REACHED_WORD] += 1;
            if self.repeat && reached + 1 == self.goals.len() {
                memory.words[GOALS_REACHED_WORD] = 0;
                // Stop here, because a list with all of its goals here would loop forever.
                return (None, trip);
            }
        }
    }
}

impl Behaviour for Goto {
    fn is_on_trip(&self, memory: &Memory) -> bool {
        (memory.words[GOALS_REACHED_WORD] as usize) < self.goals.len()
    }

    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let (goal, trip) = self.next_goal(percept, memory);
        let action = goal.map_or(STAY, |goal| self.avoidance.step(goal, percept, memory, draws));
        Decision { trip, ..action.into() }
    }

    fn has_requests(&self) -> bool {
        self.avoidance.has_requests()
    }

    fn flow_fields(&self) -> &[Arc<FlowField>] {
        &self.goals
    }
}

impl Behaviour for Shuttle {
    fn is_on_trip(&self, memory: &Memory) -> bool {
        // The first trip starts at end 0.
        memory.words[GOALS_REACHED_WORD] > 0
    }

    fn flow_fields(&self) -> &[Arc<FlowField>] {
        &self.ends
    }

    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let mut trip = None;
        let mut target = (memory.words[GOALS_REACHED_WORD] % 2) as usize;
        if self.ends[target].is_goal(percept.at.0, percept.at.1) {
            memory.words[GOALS_REACHED_WORD] = memory.words[GOALS_REACHED_WORD].wrapping_add(1);
            if target == 0 {
                // The first arrival at end 0 only starts the first trip, because a robot may start anywhere.
                let is_first = memory.words[GOALS_REACHED_WORD] <= 1;
                let event = if is_first { TripEvent::Started } else { TripEvent::Completed };
                trip = Some(event);
            }
            target = 1 - target;
        }
        let goal = CurrentGoal { field: &self.ends[target], is_done: false };
        let action = self.avoidance.step(goal, percept, memory, draws);
        Decision { trip, ..action.into() }
    }

    fn has_requests(&self) -> bool {
        self.avoidance.has_requests()
    }
}
