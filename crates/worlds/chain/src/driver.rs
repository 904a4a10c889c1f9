//! Tasks of a chain's initiator, carried out one after the other: its source of motion, and its
//! destination (slides R4, R9).

pub(crate) mod external;
pub(crate) mod own_driver;
pub(crate) mod step_motion;

use super::events::EventKind;
use super::motion::recovery::RecoveryMemory;
use super::navigate::Navigator;
use super::script::{Script, ScriptMotion, Turtle};
use super::swarm::leader::LeaderState;
use own_driver::OwnDriver;
use serde::{Deserialize, Serialize};
use sidestep_arms::plan::JointGoal;
use sidestep_kernel::distr::normal;
use sidestep_kernel::stream::Draws;
use sidestep_kernel::{Cycle, InputError, math};
use sidestep_rods::geometry::{Aabb, Point, convert_dimensions, normalized};
use sidestep_rods::{RequestSource, VetoReason};
use std::sync::Arc;

/// Largest number of motions in a script: a mistaken repetition must not fill the memory.
pub(crate) const MAX_MOTIONS: usize = 1_000_000;

/// A task as a scenario gives it; what has come of it so far is in [`TaskProgress`].
#[derive(Debug, Clone)]
pub(crate) struct Task<const D: usize> {
    /// The connector that moves.
    pub(crate) agent: usize,
    /// Highest speed of that connector, m/s.
    pub(crate) speed_m_s: f64,
    pub(crate) driver: TaskKind<D>,
    /// Longest duration of the task, s; infinite if it may take as long as it needs.
    pub(crate) lasts_s: f64,
    /// The time for which a vetoed motion is retried before the task is given up, s.
    pub(crate) patience_s: f64,
    /// The time for which its local rules may come no nearer to a target before a path is planned, s; none if
    /// nothing is ever planned.
    pub(crate) plans_after_s: Option<f64>,
}

/// Kinds of goals for an initiator.
#[derive(Debug, Clone)]
pub(crate) enum TaskKind<const D: usize> {
    /// Nothing: it moves only to get out of the way.
    Rest,
    /// Go anywhere, autonomously.
    Wander(Wander<D>),
    /// Move as a script says, as an operator would.
    Script(Arc<Script>),
    /// Move to targets one after the other, as a planner would, but around obstacles.
    Targets(Targets<D>),
    /// Navigate on wheels, with a laser; in the plane.
    Navigate(Arc<Navigator>),
    /// Move as an external caller orders, cycle by cycle.
    External,
    /// Move as a driver of the program's own proposes, cycle by cycle.
    Own(OwnDriver),
}

impl<const D: usize> TaskKind<D> {
    /// Returns the name of its kind in files.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Rest => "rest",
            Self::Wander(_) => "wander",
            Self::Script(_) => "script",
            Self::Targets(_) => "targets",
            Self::Navigate(_) => "navigate",
            Self::External => "external",
            Self::Own(own) => &own.name,
        }
    }
}

/// Wandering: ahead, with small random turns to either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wander<const D: usize> {
    /// Standard deviation of the turn per square root of a meter of travel.
    pub(crate) turn_rad: f64,
    /// Region to stay in, if any: outside it the initiator turns back.
    pub(crate) within: Option<Aabb<D>>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Targets<const D: usize> {
    /// Where to go, in this order.
    pub(crate) places: Vec<Point<D>>,
    /// Distance at which a place counts as reached, meters.
    pub(crate) tolerance_m: f64,
    /// What is asked of an arm's joints at each of the places; none where these are all.
    pub(crate) goals: Vec<JointGoal>,
    /// The way from one to the next.
    pub(crate) path: TargetPath,
    /// Distance within which the tool of an arm passes those before the last without coming to rest, meters; none
    /// where it has to be as near as at the last.
    pub(crate) blend_m: Option<f64>,
}

impl<const D: usize> Targets<D> {
    /// Returns the distance at which a target that is not the last one counts as passed, meters.
    pub(crate) fn passing_distance_m(&self) -> f64 {
        self.blend_m.map_or(self.tolerance_m, |blend_m| blend_m.max(self.tolerance_m))
    }
}

/// The way from one target to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TargetPath {
    /// Any: by local rules and plans.
    Any,
    /// A straight line of an arm's tool.
    Line,
}

impl<const D: usize> Task<D> {
    pub(crate) fn request_source(&self) -> RequestSource {
        // A script is obeyed to the letter; all others may find another way after a veto.
        match self.driver {
            TaskKind::Script(_) => RequestSource::Operator,
            _ => RequestSource::Autonomous,
        }
    }
}

/// Progress of an initiator through its tasks: a part of the state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskProgress {
    /// Number of the present task, from 0; that of tasks in all once every one has ended.
    pub task: u32,
    /// Cycles since the task started.
    pub cycles: Cycle,
    /// The most recent cycles, of these, without progress.
    pub idle: u32,
    /// Cycles since it last came nearer to its present target than ever before.
    pub late: u32,
    /// Motions of the script, or targets, that are finished.
    pub next: u32,
    /// Cycles that it has rested because the script says so, or because a robot lags.
    pub rested: u32,
    /// Place and heading at the start of the task.
    pub start: Turtle,
    /// The direction ahead, a unit vector.
    pub ahead: [f64; 3],
    /// Smallest distance to its present target so far, meters.
    pub nearest_m: f64,
    /// Kind of the last event since a motion succeeded at the first try; not reported again until then.
    pub last_event: Option<EventKind>,
    /// The last objection in this part of the task.
    pub objection: Option<VetoRecord>,
    /// Its rung on the ladder after vetoes.
    pub ladder: RecoveryMemory,
    /// Memory of a navigator on wheels.
    pub leader: Option<LeaderState>,
    /// Distances in this task, meters.
    pub way_m: TravelStats,
}

/// An objection to a motion that an initiator wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct VetoRecord {
    /// The connector that objected.
    pub by: u32,
    /// The constraint that it would have broken.
    pub reason: VetoReason,
}

/// The distances that an initiator wanted to move and has moved.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct TravelStats {
    /// Distance that it wanted to move, meters.
    pub wanted: f64,
    /// Distance that it has moved, meters.
    pub gone: f64,
}

impl TaskProgress {
    /// Returns the state at the start of the first task.
    pub fn new<const D: usize>(agent: usize, points: &[Point<D>]) -> Self {
        let mut driving = Self {
            task: 0,
            cycles: 0,
            idle: 0,
            late: 0,
            next: 0,
            rested: 0,
            start: Turtle { position_m: [0.0; 3], ahead: [0.0; 3], left: [0.0; 3] },
            ahead: [0.0; 3],
            nearest_m: f64::INFINITY,
            last_event: None,
            objection: None,
            ladder: RecoveryMemory::default(),
            leader: None,
            way_m: TravelStats::default(),
        };
        driving.start_task(agent, points);
        driving
    }

    /// Starts a task at the place of its initiator.
    fn start_task<const D: usize>(&mut self, agent: usize, points: &[Point<D>]) {
        self.start = initial_turtle(agent, points);
        self.ahead = self.start.ahead;
        self.cycles = 0;
        self.idle = 0;
        self.next = 0;
        self.rested = 0;
        self.nearest_m = f64::INFINITY;
        self.late = 0;
        self.leader = None;
        self.last_event = None;
        self.objection = None;
        self.ladder = RecoveryMemory::default();
        self.way_m = TravelStats::default();
    }

    /// Goes on to the next motion or target.
    pub fn start_next_subtask(&mut self) {
        self.next += 1;
        self.rested = 0;
        self.idle = 0;
        self.last_event = None;
        self.objection = None;
        self.nearest_m = f64::INFINITY;
        self.late = 0;
    }

    /// Goes on to the next task, which `agent` carries out.
    pub fn start_next_task<const D: usize>(&mut self, agent: usize, points: &[Point<D>]) {
        self.task += 1;
        self.start_task(agent, points);
    }

    /// Returns all motions of a script started here.
    ///
    /// # Errors
    /// When the script contains an entry that is no motion, or too many motions.
    pub fn script_motions(&self, script: &Script) -> Result<Vec<ScriptMotion>, InputError> {
        let motions = script.motions(self.start);
        let motions: Vec<ScriptMotion> = motions.take(MAX_MOTIONS + 1).collect::<Result<_, _>>()?;
        if motions.len() > MAX_MOTIONS {
            let cause = format!("makes more than {MAX_MOTIONS} motions");
            return Err(InputError::new("script", cause, "repeat less often"));
        }
        Ok(motions)
    }
}

/// Returns a turtle at a connector, facing away from the chain.
fn initial_turtle<const D: usize>(agent: usize, points: &[Point<D>]) -> Turtle {
    let at = points[agent];
    let behind = if agent == 0 { points.get(1) } else { points.get(agent - 1) };
    let ahead = behind.and_then(|b| normalized(std::array::from_fn::<f64, D, _>(|i| at[i] - b[i])));
    let ahead = ahead.map_or([1.0, 0.0, 0.0], convert_dimensions);
    // Left is level: across the upward axis, or along y if the turtle faces straight up or down.
    let across = math::hypot(ahead[0], ahead[1]);
    let left =
        if across > 1e-9 { [-ahead[1] / across, ahead[0] / across, 0.0] } else { [0.0, 1.0, 0.0] };
    Turtle { position_m: convert_dimensions(at), ahead, left }
}

/// Returns the direction of a wandering initiator's next step.
pub(crate) fn wander_direction<const D: usize>(
    rule: &Wander<D>,
    at: Point<D>,
    ahead: Point<D>,
    step_m: f64,
    draws: &mut Draws,
) -> Point<D> {
    let by_m = rule.turn_rad * step_m.sqrt();
    let turned =
        std::array::from_fn(|i| ahead[i] + by_m * normal(draws) + rule.home_direction(at)[i]);
    normalized(turned).unwrap_or(ahead)
}

impl<const D: usize> Wander<D> {
    /// Returns the direction toward the inside, if `at` is outside.
    fn home_direction(&self, at: Point<D>) -> Point<D> {
        let Some(within) = &self.within else { return [0.0; D] };
        let inside: Point<D> = std::array::from_fn(|i| at[i].clamp(within.lo[i], within.hi[i]));
        let back = normalized(std::array::from_fn::<f64, D, _>(|i| inside[i] - at[i]));
        back.map_or([0.0; D], |u| u.map(|x| HOMING_TURN * x))
    }
}

/// The turn back of a wandering initiator that is outside, per step: within some ten steps it outweighs the heading.
const HOMING_TURN: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turtle_looks_away_from_the_chain() {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        assert_eq!(initial_turtle(2, &points).ahead, [0.0, 1.0, 0.0]);
        assert_eq!(initial_turtle(0, &points).ahead, [-1.0, 0.0, 0.0]);
        assert_eq!(initial_turtle(0, &points[..1]).ahead, [1.0, 0.0, 0.0]);
        let upward = initial_turtle(1, &[[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]);
        assert_eq!((upward.ahead, upward.left), ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]));
    }
}
