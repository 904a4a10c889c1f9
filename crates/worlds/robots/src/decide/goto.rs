//! Going somewhere: along shortest paths on the static map, and past obstacles.

use super::plan::{CurrentGoal, Planner};
use super::sidestep::{SensorTrust, sidestep};
use super::touch::follow;
use super::{Behaviour, Decision, Memory, Percept, TripEvent};
use crate::effector::{ActionId, STAY};
use sidestep_kernel::column::AtomicCell;
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
    /// Does what the planner of its team wrote into its memory before the cycle. Holds, for each goal, the boxes where
    /// the body fits.
    Team(Vec<Vec<(u32, u32)>>),
}

/// Word 1 of a robot that a planner leads: the action plus 1, or 0 for none.
const ORDER_WORD: usize = 1;

/// Returns the action that a planner wrote into a memory, and removes it.
pub(super) fn take_order(memory: &mut Memory) -> ActionId {
    match std::mem::take(&mut memory.words[ORDER_WORD]) {
        0 => STAY,
        order => (order - 1) as ActionId,
    }
}

/// Writes the next action of a robot that a planner leads into the words of its memory.
pub(crate) fn order_action(words: &mut [u32; 4], action: ActionId) {
    words[ORDER_WORD] = u32::from(action) + 1;
}

impl Avoidance {
    /// Writes the next action of a robot that a planner leads into its memory. It stands until the robot's next turn.
    pub(crate) fn order(memory: &[AtomicCell<u32>; 4], action: ActionId) {
        memory[ORDER_WORD].set(u32::from(action) + 1);
    }

    /// Returns the action that [`Self::order`] wrote; it stays written.
    pub(crate) fn ordered(memory: &[AtomicCell<u32>; 4]) -> ActionId {
        memory[ORDER_WORD].get().checked_sub(1).map_or(STAY, |order| order as ActionId)
    }

    /// Returns the boxes of a goal, where a planner chooses among them.
    fn anchors(&self, goal: usize) -> &[(u32, u32)] {
        match self {
            Self::Team(anchors) => anchors.get(goal).map_or(&[], Vec::as_slice),
            _ => &[],
        }
    }

    fn step(
        &self,
        goal: CurrentGoal<'_>,
        percept: &Percept<'_>,
        memory: &mut Memory,
        draws: &mut Draws,
    ) -> ActionId {
        match self {
            Self::Plan(planner) => planner.step(goal, percept, memory, draws),
            Self::Team(_) => take_order(memory),
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
        at: (u32, u32),
        memory: &mut Memory,
    ) -> (Option<CurrentGoal<'_>>, Option<TripEvent>) {
        let mut trip = None;
        loop {
            let reached = memory.words[GOALS_REACHED_WORD] as usize;
            let Some(field) = self.goals.get(reached) else {
                let last = self.goals.last();
                return (last.map(|field| CurrentGoal { field, is_done: true }), trip);
            };
            if !field.is_goal(at.0, at.1) {
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

impl Shuttle {
    /// Counts the end that is reached here, and returns the next one.
    fn next_end(&self, at: (u32, u32), memory: &mut Memory) -> (usize, Option<TripEvent>) {
        let target = (memory.words[GOALS_REACHED_WORD] % 2) as usize;
        if !self.ends[target].is_goal(at.0, at.1) {
            return (target, None);
        }
        memory.words[GOALS_REACHED_WORD] = memory.words[GOALS_REACHED_WORD].wrapping_add(1);
        // The first arrival at end 0 only starts the first trip, because a robot may start anywhere.
        let is_first = memory.words[GOALS_REACHED_WORD] <= 1;
        let event = if is_first { TripEvent::Started } else { TripEvent::Completed };
        (1 - target, (target == 0).then_some(event))
    }
}

impl Behaviour for Goto {
    fn goal(&self, memory: &Memory) -> Option<usize> {
        Some(memory.words[GOALS_REACHED_WORD] as usize)
            .filter(|&reached| reached < self.goals.len())
    }

    fn is_on_trip(&self, memory: &Memory) -> bool {
        (memory.words[GOALS_REACHED_WORD] as usize) < self.goals.len()
    }

    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let (goal, trip) = self.next_goal(percept.at, memory);
        let action = goal.map_or(STAY, |goal| self.avoidance.step(goal, percept, memory, draws));
        Decision { trip, ..action.into() }
    }

    fn has_requests(&self) -> bool {
        self.avoidance.has_requests()
    }

    fn flow_fields(&self) -> &[Arc<FlowField>] {
        &self.goals
    }

    fn planned_goals(&self, at: (u32, u32), memory: &Memory) -> &[(u32, u32)] {
        // A copy, because the robot itself counts its goals when it decides.
        let mut memory = *memory;
        self.next_goal(at, &mut memory);
        let reached = memory.words[GOALS_REACHED_WORD] as usize;
        self.avoidance.anchors(reached.min(self.goals.len().saturating_sub(1)))
    }
}

impl Behaviour for Shuttle {
    fn goal(&self, memory: &Memory) -> Option<usize> {
        Some((memory.words[GOALS_REACHED_WORD] % 2) as usize)
    }

    fn is_on_trip(&self, memory: &Memory) -> bool {
        // The first trip starts at end 0.
        memory.words[GOALS_REACHED_WORD] > 0
    }

    fn flow_fields(&self) -> &[Arc<FlowField>] {
        &self.ends
    }

    fn planned_goals(&self, at: (u32, u32), memory: &Memory) -> &[(u32, u32)] {
        // A copy, because the robot itself counts its trips when it decides.
        let mut memory = *memory;
        self.avoidance.anchors(self.next_end(at, &mut memory).0)
    }

    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let (target, trip) = self.next_end(percept.at, memory);
        let goal = CurrentGoal { field: &self.ends[target], is_done: false };
        let action = self.avoidance.step(goal, percept, memory, draws);
        Decision { trip, ..action.into() }
    }

    fn has_requests(&self) -> bool {
        self.avoidance.has_requests()
    }
}
