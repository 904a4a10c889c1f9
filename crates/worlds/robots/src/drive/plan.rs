//! Where an action is meant to end: boxes ahead or back, then quarter turns, as a robot with two wheels can drive it.

use super::grid::BodyGrid;
use crate::decide::{ActionId, Contact};
use crate::effector::{HEADINGS, ObstacleRule, Side, Transition};
use crate::sensor::WALL;
use crate::world::RobotsWorld;
use sidestep_kernel::EntityId;
use sidestep_planners::GridPose;

/// The intended outcome of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct IntendedMotion {
    /// Boxes ahead, below 0 for back.
    ahead: i32,
    /// Quarter turns to the left after that, 0 to 3.
    quarter_turns: u8,
}

/// The motion of one action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionPlan {
    /// Where it starts.
    pub start: GridPose,
    /// Where it is meant to end.
    pub target: GridPose,
    /// The wall of the map that cuts it short: then the target is before that wall.
    pub contact: Option<Contact>,
}

impl MotionPlan {
    /// Returns whether nothing moves.
    pub fn is_rest(&self) -> bool {
        self.start == self.target
    }

    /// Returns whether the body goes to other boxes.
    pub fn has_path(&self) -> bool {
        (self.start.col, self.start.row) != (self.target.col, self.target.row)
    }
}

/// Plans the actions of a robot.
#[derive(Debug, Clone)]
pub struct ActionPlanner {
    grid: BodyGrid,
    motions: Vec<IntendedMotion>,
    rule: ObstacleRule,
}

impl ActionPlanner {
    /// Returns the planner of a robot.
    ///
    /// # Errors
    /// With the cause, when there is no such robot, or one of its actions goes sideways.
    pub fn new(world: &RobotsWorld, id: EntityId) -> Result<Self, String> {
        let grid = BodyGrid::new(world, id).ok_or("there is no such robot")?;
        let model = world.robot_model(id).ok_or("there is no such robot")?;
        let effector = &model.body.effector;
        let mut motions = Vec::new();
        for (name, transitions) in effector.actions.iter().zip(&effector.transitions) {
            let motion = transitions.first().and_then(intended_motion);
            motions.push(motion.ok_or_else(|| {
                format!(
                    "the action `{name}` of effector `{}` goes sideways, or ahead and back",
                    effector.name
                )
            })?);
        }
        Ok(Self { grid, motions, rule: world.obstacle_rule })
    }

    /// Returns the motion of an action from a place. Walls of the map are known, and not run into.
    pub fn plan(&self, action: ActionId, start: GridPose) -> MotionPlan {
        let Some(motion) = self.motions.get(usize::from(action)) else {
            return MotionPlan { start, target: start, contact: None };
        };
        let side = if motion.ahead < 0 { Side::Back } else { Side::Front };
        let reached = self.reached(*motion, start);
        if reached.is_blocked {
            let contact = Some(Contact { kind: WALL, side });
            let is_cut = self.rule == ObstacleRule::Cut;
            let target = if is_cut { reached.pose } else { start };
            return MotionPlan { start, target, contact };
        }
        let heading = (start.heading + motion.quarter_turns) % 4;
        MotionPlan { start, target: GridPose { heading, ..reached.pose }, contact: None }
    }

    /// Goes box by box until a wall.
    fn reached(&self, motion: IntendedMotion, start: GridPose) -> ReachedPose {
        let heading = HEADINGS[usize::from(start.heading % 4)];
        let direction = i64::from(motion.ahead.signum());
        let mut pose = start;
        for _ in 0..motion.ahead.abs() {
            let col = i64::from(pose.col) + direction * i64::from(heading.0);
            let row = i64::from(pose.row) + direction * i64::from(heading.1);
            if !self.grid.fits(col, row) {
                return ReachedPose { pose, is_blocked: true };
            }
            // A place where the body fits has no number below 0.
            pose = GridPose { col: col as u32, row: row as u32, ..pose };
        }
        ReachedPose { pose, is_blocked: false }
    }
}

struct ReachedPose {
    pose: GridPose,
    is_blocked: bool,
}

/// Returns the motion of a transition; none where it has steps to a side, or to both of front and back.
fn intended_motion(transition: &Transition) -> Option<IntendedMotion> {
    let first = transition.path.first().copied().unwrap_or(Side::Front);
    let is_along = matches!(first, Side::Front | Side::Back);
    let is_straight = transition.path.iter().all(|side| *side == first);
    let boxes = i32::try_from(transition.path.len()).ok()?;
    (is_along && is_straight).then(|| IntendedMotion {
        ahead: if first == Side::Back { -boxes } else { boxes },
        quarter_turns: transition.turn % 4,
    })
}

/// The displacement of an action in boxes and quarter turns, in the frame of the heading before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridMotion {
    /// Boxes ahead.
    pub ahead: i64,
    /// Boxes to the left.
    pub left: i64,
    /// The turn in degrees, from -90 to 180.
    pub turn_deg: i32,
}

impl GridMotion {
    /// Returns the displacement from one place to another.
    pub fn between(start: GridPose, end: GridPose) -> Self {
        let dx = i64::from(end.col) - i64::from(start.col);
        let dy = i64::from(end.row) - i64::from(start.row);
        let heading = HEADINGS[usize::from(start.heading % 4)];
        let ux = i64::from(heading.0);
        let uy = i64::from(heading.1);
        let quarters = (4 + i32::from(end.heading) - i32::from(start.heading)) % 4;
        Self {
            ahead: dx * ux + dy * uy,
            left: dy * ux - dx * uy,
            turn_deg: 90 * if quarters == 3 { -1 } else { quarters },
        }
    }
}
