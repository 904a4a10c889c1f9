//! Every pose that a robot can reach, with the outcomes of each action there.

use crate::obstacle::{ActionOutcome, GridPose, outcome_distribution};
use crate::robot::SingleRobot;
use crate::sparse::SparseMatrix;
use sidestep_error_models::effector::{ActionId, Side, Transition};
use sidestep_kernel::InputError;
use std::collections::BTreeMap;

/// Largest number of poses of a model, four headings on 50,000 boxes: with the bound of outcomes it bounds the memory.
pub const MAX_STATES: usize = 200_000;
/// Largest number of outcomes over all poses and actions; they take about 320 MB.
const MAX_OUTCOMES: usize = 20_000_000;

/// Every pose that a robot can reach from its start, with the outcomes of each action there.
#[derive(Debug, Clone)]
pub struct MarkovModel {
    pub(crate) robot: SingleRobot,
    /// Transitions of each action in free space, in the robot's regime.
    transitions: Vec<Vec<Transition>>,
    /// Poses in the order in which the search finds them; the first is the start.
    pub(crate) poses: Vec<GridPose>,
    /// Outcomes, in row `pose * actions + action`.
    pub(crate) outcomes: SparseMatrix<ModelTransition>,
}

/// One outcome of an action at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ModelTransition {
    /// Index of the pose reached.
    pub(crate) to: u32,
    pub(crate) contact: Option<(u8, Side)>,
    pub(crate) p: f64,
}

impl MarkovModel {
    /// Computes the model of a robot.
    ///
    /// # Errors
    /// When an action's transitions are not a distribution, the robot has no size or never acts, or it reaches more
    /// than [`MAX_STATES`] poses.
    pub fn new(robot: SingleRobot) -> Result<Self, InputError> {
        robot.check()?;
        let mut model = Self {
            transitions: robot.transitions(),
            poses: vec![robot.start],
            robot,
            outcomes: SparseMatrix::default(),
        };
        model.explore()?;
        Ok(model)
    }

    /// Follows every action from every pose found, until there is no new pose: a breadth-first search in which `poses`
    /// is the queue as well.
    fn explore(&mut self) -> Result<(), InputError> {
        let mut index_of = BTreeMap::from([(self.robot.start, 0)]);
        let mut next = 0;
        while let Some(&pose) = self.poses.get(next) {
            next += 1;
            for action in 0..self.actions().len() {
                let mut row = Vec::new();
                for (outcome, p) in self.outcome_distribution(pose, action as ActionId) {
                    let ActionOutcome { pose, contact } = outcome;
                    let to = *index_of.entry(pose).or_insert_with(|| {
                        self.poses.push(pose);
                        self.poses.len() as u32 - 1
                    });
                    row.push(ModelTransition { to, contact, p });
                }
                self.outcomes.push(row);
            }
            // Checked at each pose, because a robot on a large map could fill the memory before the search ends.
            self.check_size()?;
        }
        Ok(())
    }

    fn check_size(&self) -> Result<(), InputError> {
        if self.poses.len() <= MAX_STATES && self.outcomes.len() <= MAX_OUTCOMES {
            return Ok(());
        }
        let cause = format!(
            "the robot reaches more than {MAX_STATES} poses, or its actions have more than {MAX_OUTCOMES} outcomes there"
        );
        let remedy = "use larger boxes (map.box_size_m), a smaller map, or fewer transitions";
        Err(InputError::new(&self.robot.place, cause, remedy))
    }

    /// Returns the distribution of outcomes of an action at a pose, merged; it sums to 1.
    ///
    /// # Panics
    /// When the robot has no such action.
    pub fn outcome_distribution(
        &self,
        pose: GridPose,
        action: ActionId,
    ) -> Vec<(ActionOutcome, f64)> {
        let robot = &self.robot;
        let transitions = &self.transitions[usize::from(action)];
        outcome_distribution(transitions, robot.size, pose, robot.obstacle_rule, |col, row| {
            robot.kind_at(col, row)
        })
    }

    /// Returns every pose that can be reached; the first is the start.
    pub fn poses(&self) -> &[GridPose] {
        &self.poses
    }

    /// Returns the names of the actions, by id.
    pub fn actions(&self) -> &[String] {
        &self.robot.effector.actions
    }

    /// Returns the number of outcomes over all poses and actions.
    pub fn outcomes(&self) -> usize {
        self.outcomes.len()
    }

    /// Returns how often the robot acts in the first `cycles` cycles.
    pub fn actions_in(&self, cycles: u64) -> u64 {
        let period = u64::from(self.robot.period);
        let phase = u64::from(self.robot.phase);
        (cycles + phase).div_ceil(period) - phase.div_ceil(period)
    }

    /// Returns the outcomes of an action at the pose with this index.
    pub(crate) fn model_transitions(&self, pose: usize, action: usize) -> &[ModelTransition] {
        self.outcomes.row(pose * self.actions().len() + action)
    }
}
