//! What a team looks like to its planner.

use sidestep_planners::{BusyAgent, Courier, GridPose};
use std::collections::BTreeSet;

/// What a team looks like at the start of a cycle, as it is or as its planner believes.
#[derive(Debug, Default)]
pub(crate) struct TeamSituation {
    pub(crate) poses: Vec<GridPose>,
    pub(crate) goals: Vec<Option<(u32, u32)>>,
    pub(crate) others: Vec<(u32, u32)>,
    pub(crate) busy: Vec<BusyAgent>,
    /// Whether each pose is known to be true.
    pub(crate) is_known: Vec<bool>,
    /// Actions left of the plan of each robot of a team whose plans a caller orders.
    pub(crate) actions_left: Vec<usize>,
    /// The places where robots are believed to stand, and those that they leave, where actions take several cycles.
    pub(crate) held: BTreeSet<(u32, u32)>,
}

impl TeamSituation {
    /// Returns why a robot cannot act; none for one that can.
    pub(crate) fn busy_agent(&self, robot: usize) -> Option<&BusyAgent> {
        let place = self.busy.binary_search_by_key(&(robot as u32), |busy| busy.agent).ok()?;
        Some(&self.busy[place])
    }

    /// Returns the robots as those who carry tasks out. Whether one has come to a place is known by its reports only.
    pub(crate) fn couriers(&self) -> Vec<Courier> {
        let robots = self.poses.iter().zip(&self.is_known);
        let mut couriers: Vec<Courier> =
            robots.map(|(&pose, is_known)| Courier { pose, is_in_action: !is_known }).collect();
        for busy in self.busy.iter().filter(|busy| busy.steps_left > 0) {
            couriers[busy.agent as usize].is_in_action = true;
        }
        couriers
    }
}
