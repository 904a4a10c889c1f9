//! Going somewhere: along shortest ways on the static map, and past obstacles.

use super::plan::{CurrentGoal, Planner};
use super::sidestep::{SensorTrust, sidestep};
use super::touch::follow;
use super::{Behaviour, Decision, Memory, Percept, TripEvent};
use crate::effector::{ActionId, STAY};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;
use std::sync::Arc;

/// The way in which a robot that goes somewhere deals with obstacles.
#[derive(Debug, Clone)]
pub enum Avoidance {
    /// Plans around the things that it senses, and makes room for others.
    Plan(Arc<Planner>),
    /// Steps aside from near things that its sensors report.
    Sidestep(SensorTrust),
    /// Keeps to its way until it touches something, then waits or steps aside at random.
    Touch,
}

impl Avoidance {
    fn step(
        &self,
        way: CurrentGoal<'_>,
        percept: &Percept<'_>,
        memory: &mut Memory,
        draws: &mut Draws,
    ) -> ActionId {
        match self {
            Self::Plan(planner) => planner.step(way, percept, memory, draws),
            // Only planners know others, and leave a goal for them.
            _ if way.is_done => STAY,
            Self::Sidestep(trust) => sidestep(*trust, way.field, percept, memory, draws),
            Self::Touch => follow(way.field, percept, memory, draws),
        }
    }

    fn has_requests(&self) -> bool {
        matches!(self, Self::Plan(_))
    }
}

/// Visits goals in order; each robot starts with the goals of its own list.
#[derive(Debug, Clone)]
pub struct Goto {
    /// Shortest ways to the goals, in order.
    pub goals: Vec<Arc<FlowField>>,
    /// Whether it starts again after the last goal, rather than staying there.
    pub repeat: bool,
    /// Its way past obstacles.
    pub avoidance: Avoidance,
}

/// Goes back and forth between two regions; a trip is there and back again.
#[derive(Debug, Clone)]
pub struct Shuttle {
    /// Shortest ways to the two regions.
    pub ends: [Arc<FlowField>; 2],
    /// Its way past obstacles.
    pub avoidance: Avoidance,
}

/// Word 0: number of goals reached (wraps at the length for a repeated list). The other words belong
/// to the avoidance.
const GOALS_REACHED_WORD: usize = 0;

impl Goto {
    /// Counts the goals that are reached here, and returns the way to the next one; none where all
    /// goals of a repeated list are here.
    fn next_goal(
        &self,
        percept: &Percept<'_>,
        memory: &mut Memory,
    ) -> (Option<CurrentGoal<'_>>, Option<TripEvent>) {
        let (mut trip, n) = (None, self.goals.len());
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
            if self.repeat && reached + 1 == n {
                memory.words[GOALS_REACHED_WORD] = 0;
                // Stop here, because a list with all of its goals here would loop forever.
                return (None, trip);
            }
        }
    }
}

impl Behaviour for Goto {
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let (way, trip) = self.next_goal(percept, memory);
        let action = way.map_or(STAY, |way| self.avoidance.step(way, percept, memory, draws));
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
    fn flow_fields(&self) -> &[Arc<FlowField>] {
        &self.ends
    }

    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let mut trip = None;
        let mut target = (memory.words[GOALS_REACHED_WORD] % 2) as usize;
        if self.ends[target].is_goal(percept.at.0, percept.at.1) {
            memory.words[GOALS_REACHED_WORD] = memory.words[GOALS_REACHED_WORD].wrapping_add(1);
            if target == 0 {
                // The first arrival at end 0 only starts the first trip.
                trip = Some(if memory.words[GOALS_REACHED_WORD] > 1 {
                    TripEvent::Completed
                } else {
                    TripEvent::Started
                });
            }
            target = 1 - target;
        }
        let way = CurrentGoal { field: &self.ends[target], is_done: false };
        let action = self.avoidance.step(way, percept, memory, draws);
        Decision { trip, ..action.into() }
    }

    fn has_requests(&self) -> bool {
        self.avoidance.has_requests()
    }
}
