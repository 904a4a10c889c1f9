//! What the planner of a team remembers from cycle to cycle.

use crate::belief::{Beliefs, Knowledge};
use sidestep_planners::{GridPose, TeamPlannerState};

/// All that the planner of a team remembers.
#[derive(Debug, Clone)]
pub(crate) struct TeamMemory {
    pub(crate) planner: TeamPlannerState,
    /// The pose that each robot has after its planned action; none before the first.
    pub(crate) planned: Vec<Option<GridPose>>,
    /// Times that each robot was elsewhere than planned.
    pub(crate) off_plan: Vec<u32>,
    /// What is believed of the robots.
    pub(crate) beliefs: Beliefs,
}

impl TeamMemory {
    /// Returns what the planner believed at its last turn.
    pub(crate) fn knowledge(&mut self) -> Knowledge<'_> {
        let step = self.planner.pibt.step;
        Knowledge { beliefs: &mut self.beliefs, planned: &self.planned, step }
    }

    /// Counts the robots that are elsewhere than planned.
    pub(crate) fn compare(&mut self, poses: &[GridPose]) {
        for (robot, &pose) in poses.iter().enumerate() {
            let is_off = self.planned[robot].is_some_and(|planned| planned != pose);
            self.off_plan[robot] += u32::from(is_off);
        }
    }
}
