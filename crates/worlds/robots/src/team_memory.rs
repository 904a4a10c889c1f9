//! What the planner of a team remembers from cycle to cycle.

use crate::reports::Belief;
use sidestep_planners::{GridPose, TeamPlannerState};

/// All that the planner of a team remembers.
#[derive(Debug, Clone)]
pub(crate) struct TeamMemory {
    pub(crate) planner: TeamPlannerState,
    /// The pose that each robot has after its planned action; none before the first.
    pub(crate) planned: Vec<Option<GridPose>>,
    /// Times that each robot was elsewhere than planned.
    pub(crate) off_plan: Vec<u32>,
    /// What is believed of each robot; empty for a planner that knows all that is true.
    pub(crate) beliefs: Vec<Belief>,
    /// Whether each robot has reported in the present cycle; no state, because it is set anew in each one.
    pub(crate) has_reported: Vec<bool>,
}

impl TeamMemory {
    /// Counts the robots that are elsewhere than planned.
    pub(crate) fn compare(&mut self, poses: &[GridPose]) {
        for (robot, &pose) in poses.iter().enumerate() {
            let is_off = self.planned[robot].is_some_and(|planned| planned != pose);
            self.off_plan[robot] += u32::from(is_off);
        }
    }
}
