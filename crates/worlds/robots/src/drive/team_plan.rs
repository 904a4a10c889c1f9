//! The plan of all robots of a scenario. Each driver computes it by itself: it depends on the scenario alone.

use crate::scenario::Compiled;
use crate::world::RobotsWorld;
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::{Digest, EntityId, InputError};
use sidestep_planners::{Action, DependencyGraph, GridPose};
use sidestep_scenario::Source;

/// The plan of all robots, and the order of its actions.
#[derive(Debug)]
pub struct TeamPlan {
    starts: Vec<GridPose>,
    graph: DependencyGraph,
}

impl TeamPlan {
    /// Computes the plan of a scenario.
    ///
    /// # Errors
    /// Where planners do not lead all bodies, the regime has errors, or robots move in a ring: no message makes them start in
    /// the same instant.
    pub fn new(compiled: &Compiled, source: &Source) -> Result<Self, InputError> {
        let found = compiled.run_plan(source)?;
        let starts = (0..found.plan.agents()).map(|robot| found.plan.pose(robot, 0)).collect();
        let graph = DependencyGraph::new(&found.instance, &found.plan).map_err(|error| {
            InputError::new(
                &source.place,
                error.to_string(),
                "report this: plans of runs are right",
            )
        })?;
        if let Some(ring) = graph.circles().first() {
            let cause = format!(
                "robots {ring:?} of its plan move in a ring, each into the boxes that another one leaves at the same instant"
            );
            let remedy =
                "give another conflict_policy than \"simultaneous\": then planners make no rings";
            return Err(InputError::new(&source.place, cause, remedy));
        }
        Ok(Self { starts, graph })
    }

    /// Returns the number of robots, whose ids are those below.
    pub fn robots(&self) -> usize {
        self.starts.len()
    }

    /// Returns the order of its actions, where agents are robots by id.
    pub fn graph(&self) -> &DependencyGraph {
        &self.graph
    }

    /// Returns the number of actions of a robot.
    pub fn actions(&self, robot: usize) -> u32 {
        self.graph.actions(robot) as u32
    }

    /// Returns where a robot is after so many of its actions; none after more than it has.
    pub fn pose_after(&self, robot: usize, done: u32) -> Option<GridPose> {
        match done.checked_sub(1) {
            None => Some(self.starts[robot]),
            Some(last) => self.graph.action(robot, last as usize).map(|action| action.1),
        }
    }

    /// Returns the next action of a robot after so many.
    pub fn action_after(&self, robot: usize, done: u32) -> Option<Action> {
        self.graph.action(robot, done as usize).map(|action| action.0)
    }

    /// Returns how many actions of others have to be done before a robot's actions up to some number can have been.
    pub(super) fn needed_by(&self, robot: usize, done: u32) -> impl Iterator<Item = (usize, u32)> {
        let all = (0..done as usize).flat_map(move |index| self.graph.dependencies(robot, index));
        all.map(|dependency| (dependency.0, dependency.1 as u32 + 1))
    }

    fn write_to(&self, hasher: &mut Hasher) {
        for robot in 0..self.robots() {
            let actions = self.actions(robot);
            hasher.write_u32(actions);
            for done in 0..=actions {
                let Some(pose) = self.pose_after(robot, done) else { continue };
                hasher.write_u32(pose.col);
                hasher.write_u32(pose.row);
                hasher.write_u8(pose.heading);
            }
        }
    }
}

impl RobotsWorld {
    /// Returns a digest of what robots must have in common to understand each other's beacons: the map, the sides of all
    /// robots, the range of the radio, and the plan, if there is one.
    pub fn common_digest(&self, plan: Option<&TeamPlan>) -> Digest {
        let mut hasher = Hasher::default();
        hasher.write_u32(self.map.width());
        hasher.write_u32(self.map.height());
        hasher.write_f64(self.map.box_size_m);
        for row in 0..self.map.height() {
            for col in 0..self.map.width() {
                hasher.write_u8(u8::from(self.map.cell(col, row) == sidestep_map::Cell::Free));
            }
        }
        for robot in 0..self.robot_count() {
            hasher.write_u32(self.type_of(robot as EntityId).size.0);
        }
        hasher.write_u64(self.radio.map_or(0, |radio| radio.reach2_half_boxes));
        if let Some(plan) = plan {
            plan.write_to(&mut hasher);
        }
        hasher.finish()
    }
}
