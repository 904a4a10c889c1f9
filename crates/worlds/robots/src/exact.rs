//! The exact Markov chain of one robot in a building, computed without random draws.
//!
//! A robot that is alone, with walls and closed doors around it, is a Markov chain over its poses.
//! This module computes the chain from the same tables that the simulator draws from, but by other
//! code, so that each can be checked against the other; and it writes the model as a POMDP for
//! planners.
//!
//! ```text
//! Compiled -> Model   outcomes of every action at every pose      obstacle.rs building.rs
//!               |---> Chain under a policy: distributions         chain.rs
//!               |        `---> Comparison with the simulator      compare.rs
//!               `---> Pomdp: observations as well, as text        observe.rs pomdp.rs names.rs
//! ```

mod compare;
mod markov_chain;
mod names;
mod observe;
mod obstacle;
mod pomdp;
mod sparse;
mod static_map;
mod summary;

pub use compare::{Comparison, SIGNIFICANCE, compare, sampling_limit};
pub use markov_chain::{ChainState, MarkovChain, StationaryDistribution, total_variation};
pub use observe::Beam;
pub use obstacle::{ActionOutcome, GridPose, outcome_distribution};
pub use pomdp::{MAX_BEAMS, Pomdp, PomdpOptions, PomdpSize};
pub use summary::{Summary, VisitedBox};

use super::decide::RandomPolicy;
use super::effector::{ActionId, FORWARD, ObstacleRule, Side};
use super::scenario::Compiled;
use sidestep_kernel::InputError;
use sparse::SparseMatrix;
use static_map::{Robot, StaticMap};
use std::collections::BTreeMap;

/// Largest number of poses of a model.
pub const MAX_STATES: usize = 200_000;
/// Largest number of outcomes over all poses and actions.
const MAX_OUTCOMES: usize = 20_000_000;

/// The names of the policies that have one.
pub const POLICIES: [&str; 3] = ["uniform", "forward", "bounce"];

/// Returns the policy of a name: `uniform` (each standard action alike), `forward` (always ahead),
/// or `bounce` (ahead, and a turn to either side after a contact).
///
/// # Errors
/// When there is no such policy.
pub fn policy(name: &str) -> Result<RandomPolicy, InputError> {
    match name {
        "uniform" => Ok(RandomPolicy::uniform()),
        "forward" => Ok(RandomPolicy::always(FORWARD)),
        "bounce" => Ok(RandomPolicy::bounce()),
        _ => {
            let remedy = sidestep_scenario::suggestion(name, &POLICIES);
            Err(InputError::new("--policy", format!("unknown policy `{name}`"), remedy))
        }
    }
}

/// Every pose that a robot can reach from its start, with the outcomes of each action there.
#[derive(Debug, Clone)]
pub struct MarkovModel {
    place: String,
    building: StaticMap,
    robot: Robot,
    rule: ObstacleRule,
    kinds: Vec<String>,
    /// Poses in the order in which the search finds them; the first is the start.
    poses: Vec<GridPose>,
    /// Outcomes, in row `pose * actions + action`.
    outcomes: SparseMatrix<ModelTransition>,
}

/// One outcome of an action at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ModelTransition {
    /// Index of the pose reached.
    to: u32,
    contact: Option<(u8, Side)>,
    p: f64,
}

impl MarkovModel {
    /// Computes the model of a scenario with one robot and nothing else that moves; doors
    /// that never open are walls of their kind.
    ///
    /// # Errors
    /// When there are more robots or other moving bodies, or more than [`MAX_STATES`] poses.
    pub fn new(compiled: &Compiled) -> Result<Self, InputError> {
        let (building, robot) = static_map::single_robot(compiled)?;
        let mut model = Self {
            place: static_map::source_name(compiled),
            building,
            poses: vec![robot.start],
            robot,
            rule: compiled.world.obstacle_rule,
            kinds: compiled.world.kinds.clone(),
            outcomes: SparseMatrix::default(),
        };
        model.explore()?;
        Ok(model)
    }

    /// Follows every action from every pose found, until there is no new pose.
    fn explore(&mut self) -> Result<(), InputError> {
        let mut index_of = BTreeMap::from([(self.robot.start, 0)]);
        let mut next = 0;
        while let Some(&pose) = self.poses.get(next) {
            next += 1;
            for action in 0..self.actions().len() {
                let outcomes = self.outcome_distribution(pose, action as ActionId);
                let poses = &mut self.poses;
                let arrivals = outcomes.into_iter().map(|(ActionOutcome { pose, contact }, p)| {
                    let to = *index_of.entry(pose).or_insert_with(|| {
                        poses.push(pose);
                        poses.len() as u32 - 1
                    });
                    ModelTransition { to, contact, p }
                });
                self.outcomes.push(arrivals);
            }
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
        Err(InputError::new(&self.place, cause, remedy))
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
        let transitions = &self.robot.actions[usize::from(action)];
        let kind_at = |col, row| self.building.kind_at(col, row);
        outcome_distribution(transitions, self.robot.size, pose, self.rule, kind_at)
    }

    /// Returns every pose that can be reached; the first is the start.
    pub fn poses(&self) -> &[GridPose] {
        &self.poses
    }

    /// Returns the names of the actions, by id.
    pub fn actions(&self) -> &[String] {
        &self.robot.body.effector.actions
    }

    /// Returns the number of outcomes over all poses and actions.
    pub fn outcomes(&self) -> usize {
        self.outcomes.len()
    }

    /// Returns how often the robot acts in the first `cycles` cycles.
    pub fn actions_in(&self, cycles: u64) -> u64 {
        let (period, phase) = (u64::from(self.robot.timing.period), self.robot.timing.phase);
        (cycles + u64::from(phase)).div_ceil(period) - u64::from(phase).div_ceil(period)
    }

    /// Returns the Markov chain of the robot under a policy.
    ///
    /// # Errors
    /// When the policy chooses an action that the robot does not have.
    pub fn chain(&self, policy: &RandomPolicy) -> Result<MarkovChain, InputError> {
        MarkovChain::new(self, policy)
    }

    /// Returns the model with its observations, in the form that planners read.
    ///
    /// # Errors
    /// When `options` do not fit the scenario, or ask for too much.
    pub fn pomdp(&self, options: &PomdpOptions) -> Result<Pomdp, InputError> {
        Pomdp::new(self, options)
    }

    /// Returns the outcomes of an action at the pose with this index.
    fn model_transitions(&self, pose: usize, action: usize) -> &[ModelTransition] {
        self.outcomes.row(pose * self.actions().len() + action)
    }
}
