//! The command's report of a model.

use crate::compare::Comparison;
use crate::markov_chain::{Convergence, MarkovChain, StationaryDistribution};
use crate::model::MarkovModel;
use crate::pomdp::PomdpSize;
use serde::Serialize;
use sidestep_error_models::RandomPolicy;
use sidestep_kernel::InputError;
use std::collections::BTreeMap;

/// A model under a policy in figures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Poses that the robot can reach.
    pub poses: usize,
    /// Names of its actions.
    pub actions: Vec<String>,
    /// Number of outcomes over all poses and actions.
    pub outcomes: usize,
    /// The policy, as the caller names it.
    pub policy: String,
    /// Number of states of the chain under the policy.
    pub chain_states: usize,
    /// The accuracy of the long run.
    stationary: Convergence,
    /// The boxes that hold the robot's lower-left box most often in the long run.
    pub most_visited: Vec<VisitedBox>,
    /// Size of the exported POMDP, where one was made.
    pub pomdp: Option<PomdpSize>,
    /// The comparison of the simulator with the chain, where it was made.
    pub comparison: Option<Comparison>,
}

/// A box, and the share of time that the robot is there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct VisitedBox {
    /// Column, from the west.
    pub col: i32,
    /// Row, from the south.
    pub row: i32,
    /// Share of the actions that start there.
    pub share: f64,
}

impl MarkovModel {
    /// Summarizes the model under `policy`, named `name`, with the `top` most visited boxes.
    ///
    /// # Errors
    /// When the policy does not fit the robot.
    pub fn summary(
        &self,
        name: &str,
        policy: &RandomPolicy,
        top: usize,
    ) -> Result<Summary, InputError> {
        let chain = self.chain(policy)?;
        let stationary = chain.stationary();
        Ok(Summary {
            poses: self.poses().len(),
            actions: self.actions().to_vec(),
            outcomes: self.outcomes(),
            policy: name.into(),
            chain_states: chain.states().len(),
            stationary: Convergence::from(&stationary),
            most_visited: most_visited(&chain, &stationary, top),
            pomdp: None,
            comparison: None,
        })
    }
}

/// Returns the boxes by falling share; equal ones by row and column.
fn most_visited(
    chain: &MarkovChain,
    stationary: &StationaryDistribution,
    top: usize,
) -> Vec<VisitedBox> {
    let mut shares = BTreeMap::new();
    for (pose, p) in chain.pose_distribution(&stationary.distribution) {
        *shares.entry((pose.row, pose.col)).or_insert(0.0) += p;
    }
    let visited = shares.into_iter().map(|((row, col), share)| VisitedBox { col, row, share });
    let mut boxes: Vec<VisitedBox> = visited.collect();
    boxes.sort_by(|a, b| b.share.total_cmp(&a.share));
    boxes.truncate(top);
    boxes
}
