//! A model under a fixed policy: a Markov chain with its distributions over time and in the long
//! run.

use crate::model::MarkovModel;
use crate::obstacle::GridPose;
use crate::sparse::SparseMatrix;
use serde::Serialize;
use sidestep_error_models::RandomPolicy;
use sidestep_kernel::InputError;
use std::collections::BTreeMap;

/// A state of a chain: the pose, and the contact as far as the policy depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChainState {
    /// The pose in which the robot chooses its next action.
    pub pose: GridPose,
    /// Whether the last action met an obstacle; always false when the policy ignores contacts.
    pub after_contact: bool,
}

/// A Markov chain over the states that the policy reaches; the first state is the start.
#[derive(Debug, Clone)]
pub struct MarkovChain {
    states: Vec<ChainState>,
    rows: SparseMatrix<(u32, f64)>,
}

/// The distribution of a chain in the long run.
#[derive(Debug, Clone, PartialEq)]
pub struct StationaryDistribution {
    /// Probability of each of [`MarkovChain::states`].
    pub distribution: Vec<f64>,
    /// Total variation between the distribution and itself one action later; 0 if it were exact.
    pub residual: f64,
    /// Number of iterations until it converged, or the limit.
    pub iterations: u32,
}

/// The description of a chain's long run in a report.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Convergence {
    pub(super) residual: f64,
    pub(super) iterations: u32,
}

impl From<&StationaryDistribution> for Convergence {
    fn from(s: &StationaryDistribution) -> Self {
        Self { residual: s.residual, iterations: s.iterations }
    }
}

/// Iterations stop when one changes the distribution by less than this (total variation), about what rounding adds.
const CONVERGENCE_TOLERANCE: f64 = 1e-13;
/// Number of multiplications after which iterating stops without having converged: some seconds.
const MAX_MULTIPLICATIONS: usize = 5_000_000_000;

impl MarkovModel {
    /// Returns the Markov chain of the robot under a policy.
    ///
    /// # Errors
    /// When the policy chooses an action that the robot does not have.
    pub fn chain(&self, policy: &RandomPolicy) -> Result<MarkovChain, InputError> {
        MarkovChain::new(self, policy)
    }
}

impl MarkovChain {
    fn new(model: &MarkovModel, policy: &RandomPolicy) -> Result<Self, InputError> {
        check_actions(model, policy)?;
        let mut index_of = BTreeMap::from([((0, false), 0)]);
        let mut found = vec![(0, false)];
        let mut rows = SparseMatrix::default();
        let mut next = 0;
        while let Some(&(pose, after_contact)) = found.get(next) {
            next += 1;
            let mut row = BTreeMap::new();
            for (key, p) in successors(model, policy, pose, after_contact) {
                let to = *index_of.entry(key).or_insert_with(|| {
                    found.push(key);
                    found.len() as u32 - 1
                });
                *row.entry(to).or_insert(0.0) += p;
            }
            rows.push(row);
        }
        let mut states = Vec::with_capacity(found.len());
        for (pose, after_contact) in found {
            states.push(ChainState { pose: model.poses[pose as usize], after_contact });
        }
        Ok(Self { states, rows })
    }

    /// Returns the states; the first is the start.
    pub fn states(&self) -> &[ChainState] {
        &self.states
    }

    /// Returns the successors of a state by index, with their probabilities.
    pub fn row(&self, state: usize) -> &[(u32, f64)] {
        self.rows.row(state)
    }

    /// Returns the distribution one action later. Shape: that of [`MarkovChain::states`], as the
    /// argument.
    pub fn step(&self, distribution: &[f64]) -> Vec<f64> {
        let mut next = vec![0.0; self.states.len()];
        for (&mass, row) in distribution.iter().zip(self.rows.rows()) {
            if mass > 0.0 {
                row.iter().for_each(|&(to, p)| next[to as usize] += mass * p);
            }
        }
        next
    }

    /// Returns the distribution over [`MarkovChain::states`] after this number of actions from the start.
    pub fn distribution_after(&self, actions: u64) -> Vec<f64> {
        let mut distribution = self.start_distribution();
        for _ in 0..actions {
            let next = self.step(&distribution);
            // A fixed point stays the same, however many actions are left.
            if next == distribution {
                break;
            }
            distribution = next;
        }
        distribution
    }

    /// Returns the share of actions spent in each state in the long run from the start.
    ///
    /// Uses power iteration on the chain that stays in place half of the time, because that chain
    /// has the same long run and converges even where the chain itself is periodic. Where it does
    /// not converge within the work allowed, [`StationaryDistribution::residual`] says how close it is.
    pub fn stationary(&self) -> StationaryDistribution {
        let mut distribution = self.start_distribution();
        // At least 100 iterations, so that a chain of any size comes near; at most a million, so that a tiny one ends.
        let limit = (MAX_MULTIPLICATIONS / self.rows.len().max(1)).clamp(100, 1_000_000) as u32;
        for iteration in 1..=limit {
            let next = self.step(&distribution);
            let residual = total_variation(&distribution, &next);
            if residual < CONVERGENCE_TOLERANCE {
                return StationaryDistribution { distribution, residual, iterations: iteration };
            }
            distribution.iter_mut().zip(&next).for_each(|(p, q)| *p = 0.5 * (*p + q));
        }
        let residual = total_variation(&distribution, &self.step(&distribution));
        StationaryDistribution { distribution, residual, iterations: limit }
    }

    /// Returns a distribution over states as one over poses.
    pub fn pose_distribution(&self, distribution: &[f64]) -> BTreeMap<GridPose, f64> {
        let mut poses = BTreeMap::new();
        for (state, p) in self.states.iter().zip(distribution) {
            *poses.entry(state.pose).or_insert(0.0) += p;
        }
        poses
    }

    fn start_distribution(&self) -> Vec<f64> {
        let mut distribution = vec![0.0; self.states.len()];
        distribution[0] = 1.0;
        distribution
    }
}

/// Returns the total variation, half the sum of absolute differences: the largest difference in the
/// probability of any event.
///
/// # Panics
/// When the distributions are over different numbers of states.
pub fn total_variation(p: &[f64], q: &[f64]) -> f64 {
    assert_eq!(p.len(), q.len(), "distributions over the same states");
    0.5 * p.iter().zip(q).map(|(a, b)| (a - b).abs()).sum::<f64>()
}

fn check_actions(model: &MarkovModel, policy: &RandomPolicy) -> Result<(), InputError> {
    let known = model.actions().len();
    let mut rows = [policy.probabilities(false), policy.probabilities(true)].into_iter();
    if rows.all(|row| row.iter().skip(known).all(|&p| p <= 0.0)) {
        return Ok(());
    }
    let cause = format!("the policy chooses an action beyond the robot's {known}");
    Err(InputError::new(&model.robot.place, cause, "give weights to the robot's own actions only"))
}

/// Returns the states after one action chosen by the policy, unmerged.
fn successors<'a>(
    model: &'a MarkovModel,
    policy: &'a RandomPolicy,
    pose: u32,
    after_contact: bool,
) -> impl Iterator<Item = ((u32, bool), f64)> + 'a {
    // States that differ only in a contact which the policy ignores would follow the same law, so they are one.
    let depends_on_contact = policy.depends_on_contact();
    let chosen = policy.probabilities(after_contact).iter().enumerate().filter(|c| *c.1 > 0.0);
    chosen.flat_map(move |(action, &chance)| {
        let arrivals = model.model_transitions(pose as usize, action).iter();
        arrivals.map(move |arrival| {
            let is_after_contact = depends_on_contact && arrival.contact.is_some();
            ((arrival.to, is_after_contact), chance * arrival.p)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two states that change places with certainty: periodic.
    fn flip() -> MarkovChain {
        let state =
            |col| ChainState { pose: GridPose { col, row: 0, heading: 0 }, after_contact: false };
        let mut rows = SparseMatrix::default();
        rows.push([(1, 1.0)]);
        rows.push([(0, 1.0)]);
        MarkovChain { states: vec![state(0), state(1)], rows }
    }

    #[test]
    fn a_periodic_chain_has_a_long_run_all_the_same() {
        let stationary = flip().stationary();
        assert_eq!(stationary.distribution, [0.5, 0.5]);
        assert!(stationary.residual < CONVERGENCE_TOLERANCE);
        assert_eq!(flip().distribution_after(7), [0.0, 1.0]);
    }

    #[test]
    fn total_variation_is_the_largest_difference_of_any_event() {
        assert_eq!(total_variation(&[0.5, 0.5, 0.0], &[0.25, 0.25, 0.5]), 0.5);
        assert_eq!(total_variation(&[1.0, 0.0], &[1.0, 0.0]), 0.0);
    }
}
