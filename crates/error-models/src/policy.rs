//! Random actions: the baseline of comparisons, and the policy of the exact chains.

use crate::effector::{ActionId, FORWARD, LEFT, RIGHT, STANDARD_ACTIONS};
use sidestep_kernel::distr::{Categorical, DistributionError};

/// Draws each action from fixed probabilities: one row while nothing blocks, another after a
/// contact. It has no memory and asks for nothing else that a robot perceives, so a robot alone in a
/// building is a Markov chain over its poses.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomPolicy {
    usual: ActionDistribution,
    after_contact: ActionDistribution,
}

#[derive(Debug, Clone, PartialEq)]
struct ActionDistribution {
    probabilities: Vec<f64>,
    distribution: Categorical,
}

impl RandomPolicy {
    /// Returns the policy that draws from `usual`, and after a contact from `after_contact`; both
    /// hold one probability per action, by action id. Actions at the end may be left out.
    ///
    /// # Errors
    /// When a row is not a distribution.
    pub fn new(usual: Vec<f64>, after_contact: Vec<f64>) -> Result<Self, DistributionError> {
        Ok(Self {
            usual: ActionDistribution::new(usual)?,
            after_contact: ActionDistribution::new(after_contact)?,
        })
    }

    /// Returns the policy that draws each standard action with equal probability.
    pub fn uniform() -> Self {
        let row = ActionDistribution::uniform_over(&[0, 1, 2, 3]);
        Self { usual: row.clone(), after_contact: row }
    }

    /// Returns the policy that always chooses the same action.
    pub fn always(action: ActionId) -> Self {
        let row = ActionDistribution::uniform_over(&[action]);
        Self { usual: row.clone(), after_contact: row }
    }

    /// Returns the policy that goes ahead, and after a contact makes a quarter turn to either side.
    pub fn bounce() -> Self {
        Self {
            usual: ActionDistribution::uniform_over(&[FORWARD]),
            after_contact: ActionDistribution::uniform_over(&[LEFT, RIGHT]),
        }
    }

    /// Returns the probability of each action, by action id, after a contact or without.
    pub fn probabilities(&self, after_contact: bool) -> &[f64] {
        &self.row(after_contact).probabilities
    }

    /// Returns whether a contact changes the probabilities.
    pub fn depends_on_contact(&self) -> bool {
        self.usual.probabilities != self.after_contact.probabilities
    }

    /// Returns the action for the uniform word `u`, after a contact or without.
    #[inline]
    pub fn sample(&self, after_contact: bool, u: u32) -> ActionId {
        self.row(after_contact).distribution.sample(u) as ActionId
    }

    #[inline]
    fn row(&self, after_contact: bool) -> &ActionDistribution {
        if after_contact { &self.after_contact } else { &self.usual }
    }
}

impl ActionDistribution {
    fn new(probabilities: Vec<f64>) -> Result<Self, DistributionError> {
        let distribution = Categorical::new(&probabilities)?;
        Ok(Self { probabilities, distribution })
    }

    /// Returns equal shares for `actions`.
    fn uniform_over(actions: &[ActionId]) -> Self {
        let last = actions.iter().max().map_or(0, |&action| usize::from(action) + 1);
        let mut row = vec![0.0; last.max(STANDARD_ACTIONS.len())];
        for &action in actions {
            row[usize::from(action)] = 1.0 / actions.len() as f64;
        }
        Self::new(row).expect("equal shares of 1 are a distribution")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effector::STAY;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};

    fn counts(policy: &RandomPolicy, after_contact: bool) -> [u32; 4] {
        let streams = Streams::new(Seed(5));
        let mut counts = [0; 4];
        for now in 0..4000 {
            let word = streams.draws(0, now, Purpose(3)).next_u32();
            counts[usize::from(policy.sample(after_contact, word))] += 1;
        }
        counts
    }

    #[test]
    fn actions_are_drawn_as_often_as_they_weigh() {
        let counts = counts(&RandomPolicy::uniform(), false);
        // Five standard deviations of a count, fixed seed.
        assert!(counts.iter().all(|&n| n.abs_diff(1000) < 137), "{counts:?}");
        assert_eq!(RandomPolicy::always(STAY).probabilities(false), [0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_bouncing_robot_turns_after_contacts_only() {
        let bounce = RandomPolicy::bounce();
        let [forward, left, right, stay] = counts(&bounce, true);
        assert_eq!((forward, stay), (0, 0));
        assert!(left.abs_diff(right) < 320, "{left} {right}");
        assert_eq!(counts(&bounce, false), [4000, 0, 0, 0]);
        assert!(bounce.depends_on_contact() && !RandomPolicy::uniform().depends_on_contact());
    }

    #[test]
    fn weights_that_are_no_distribution_are_refused() {
        assert!(RandomPolicy::new(vec![0.5, 0.4], vec![1.0]).is_err());
        assert!(RandomPolicy::new(vec![1.0], vec![]).is_err());
    }
}
