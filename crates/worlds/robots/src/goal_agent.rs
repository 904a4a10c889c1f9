//! A robot that a caller sends to places: one whose behavior is `external` finds its way there as one whose behavior is `goto`
//! does.
//!
//! What it decides is an action, which the caller orders. So a run holds only orders, and replays without the goals.

use super::agents::{RobotAgent, RobotControl, RobotPercept};
use super::decide::pass_request::HEARD_REQUEST_WORD;
use super::decide::{Avoidance, Goto, TripEvent};
use super::drive::grid::{BodyGrid, Pose2};
use super::effector::{ActionId, LEFT, RIGHT, STAY};
use super::routes::RoutePlanner;
use super::world::RobotsWorld;
use sidestep_kernel::EntityId;
use sidestep_map::planning::FlowField;
use sidestep_planners::GridPose;
use std::fmt;
use std::sync::Arc;

#[cfg(test)]
mod tests;

/// The reason why a robot does not go to a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GoalRefusal {
    /// The place is not on the map.
    OffMap,
    /// A wall is in the way of its body there.
    NoRoom(GridPose),
    /// No path on the map leads there from where it stands.
    NoWay {
        /// Where it stands.
        from: GridPose,
        /// Where it should go.
        to: GridPose,
    },
}

impl fmt::Display for GoalRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OffMap => write!(f, "it is not on the map"),
            Self::NoRoom(at) => {
                write!(f, "the robot does not fit at column {}, row {}", at.col, at.row)
            }
            Self::NoWay { from, to } => write!(
                f,
                "no way leads from column {}, row {} to column {}, row {}",
                from.col, from.row, to.col, to.row
            ),
        }
    }
}

/// A place, and the way there.
#[derive(Debug)]
struct Goal {
    place: GridPose,
    field: Arc<FlowField>,
    way: Goto,
    /// Whether no decision was made for it yet.
    is_new: bool,
}

/// The program of a robot that a caller sends to places. It has at most one goal, the last one.
#[derive(Debug)]
pub struct GoalAgent {
    agent: RobotAgent,
    grid: BodyGrid,
    routes: RoutePlanner,
    avoidance: Avoidance,
    goal: Option<Goal>,
    /// The words of its memory: those of the run hold the orders.
    memory: [u32; 4],
}

impl GoalAgent {
    /// Returns the program of a robot without a goal; none for a body whose behavior is not `external`.
    pub fn new(world: Arc<RobotsWorld>, id: EntityId) -> Option<Self> {
        let agent = RobotAgent::under_orders(world.clone(), id)?;
        let grid = BodyGrid::new(&world, id)?;
        let body = &world.robot_model(id)?.body;
        // As in a scenario: who sees nobody that comes keeps to no lane.
        let routes = RoutePlanner::new(&world.map, grid.side_boxes(), !body.sensors.is_empty());
        let planner = routes.planner(body, grid.box_m(), world.regime);
        let avoidance = Avoidance::Plan(Arc::new(planner));
        Some(Self { agent, grid, routes, avoidance, goal: None, memory: [0; 4] })
    }

    /// Returns the place to which it goes.
    pub fn goal(&self) -> Option<GridPose> {
        self.goal.as_ref().map(|goal| goal.place)
    }

    /// Takes the boxes and the heading nearest to a pose in the frame of the map as its goal, in place of the one before. The
    /// robot stands at `from` now. Returns what it has taken.
    ///
    /// # Errors
    /// When it cannot get there; the goal before stays then.
    pub fn set_goal(&mut self, from: GridPose, pose: &Pose2) -> Result<GridPose, GoalRefusal> {
        let place = self.grid.nearest(pose).ok_or(GoalRefusal::OffMap)?;
        let field = Arc::new(self.routes.to_nearest(&[(place.col, place.row)]));
        if !field.is_goal(place.col, place.row) {
            return Err(GoalRefusal::NoRoom(place));
        }
        if !field.reaches_goal(from.col, from.row) {
            return Err(GoalRefusal::NoWay { from, to: place });
        }
        let avoidance = self.avoidance.clone();
        let way = Goto { goals: vec![field.clone()], repeat: false, avoidance };
        self.goal = Some(Goal { place, field, way, is_new: true });
        self.memory = [0; 4];
        Ok(place)
    }

    /// Forgets its goal.
    pub fn clear_goal(&mut self) {
        self.goal = None;
    }

    /// Takes the request of another robot to make room, as a word of its memory; 0 for none.
    pub(crate) fn hear_request(&mut self, word: u32) {
        self.memory[HEARD_REQUEST_WORD] = word;
    }

    /// Decides by a percept, of which the memory does not count. Without a goal it stays. A trip begins with the first
    /// decision for a goal, and is complete where the robot stands there with the heading of the goal.
    ///
    /// # Errors
    /// When the percept cannot be one of this robot, with the reason.
    pub fn decide(&mut self, percept: &RobotPercept) -> Result<RobotControl, String> {
        let Some(goal) = &mut self.goal else { return Ok(control(percept, STAY, None)) };
        let started = std::mem::take(&mut goal.is_new).then_some(TripEvent::Started);
        if !goal.field.is_goal(percept.at.0, percept.at.1) {
            let own = RobotPercept { memory: self.memory, ..percept.clone() };
            let decided = self.agent.decide_by(&goal.way, &own)?;
            self.memory = decided.memory;
            return Ok(RobotControl { trip: started, broadcast: None, ..decided });
        }
        let turn = turn_toward(percept.heading, goal.place.heading);
        // A goal that is reached already is a trip, too, which has to begin before it is complete.
        if turn == STAY && started.is_none() {
            self.goal = None;
            return Ok(control(percept, STAY, Some(TripEvent::Completed)));
        }
        Ok(control(percept, turn, started))
    }
}

fn control(percept: &RobotPercept, action: ActionId, trip: Option<TripEvent>) -> RobotControl {
    let RobotPercept { id, cycle, memory, .. } = *percept;
    RobotControl { id, cycle, action, trip, broadcast: None, memory }
}

/// Returns the quarter turn from one heading toward another.
fn turn_toward(heading: u8, wanted: u8) -> ActionId {
    match (4 + wanted - heading % 4) % 4 {
        0 => STAY,
        3 => RIGHT,
        // To go back, two turns to the left do it.
        _ => LEFT,
    }
}
