//! Random actions: the baseline of comparisons, and the policy of the exact chains.

use super::{Behaviour, Decision, Memory, Percept};
use crate::effector::{ActionId, FORWARD, LEFT, RIGHT, STANDARD_ACTIONS};
use sidestep_kernel::distr::{Categorical, RowError};
use sidestep_kernel::stream::Draws;

/// Draws each action from fixed probabilities: one row while the way is free, another after a
/// contact. It has no memory and uses no other part of its percept, so a robot alone in a building
/// is a Markov chain over its poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Random {
    usual: ActionDistribution,
    after_contact: ActionDistribution,
}

#[derive(Debug, Clone, PartialEq)]
struct ActionDistribution {
    probabilities: Vec<f64>,
    distribution: Categorical,
}

impl Random {
    /// Returns the behavior that draws from `usual`, and after a contact from `after_contact`; both
    /// hold one probability per action, by action id. Actions at the end may be left out.
    ///
    /// # Errors
    /// When a row is not a distribution.
    pub fn new(usual: Vec<f64>, after_contact: Vec<f64>) -> Result<Self, RowError> {
        Ok(Self {
            usual: ActionDistribution::new(usual)?,
            after_contact: ActionDistribution::new(after_contact)?,
        })
    }

    /// Returns the behavior that draws each standard action with equal probability.
    pub fn uniform() -> Self {
        let row = ActionDistribution::uniform_over(&[0, 1, 2, 3]);
        Self { usual: row.clone(), after_contact: row }
    }

    /// Returns the behavior that always chooses the same action.
    pub fn always(action: ActionId) -> Self {
        let row = ActionDistribution::uniform_over(&[action]);
        Self { usual: row.clone(), after_contact: row }
    }

    /// Returns the behavior that goes ahead, and after a contact makes a quarter turn to either
    /// side, as [`Wander`](super::Wander) does without sensors and without voluntary turns.
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

    fn row(&self, after_contact: bool) -> &ActionDistribution {
        if after_contact { &self.after_contact } else { &self.usual }
    }
}

impl ActionDistribution {
    fn new(probabilities: Vec<f64>) -> Result<Self, RowError> {
        let distribution = Categorical::new(&probabilities)?;
        Ok(Self { probabilities, distribution })
    }

    /// Returns equal shares for `actions`.
    fn uniform_over(actions: &[ActionId]) -> Self {
        let longest = actions.iter().max().map_or(0, |&a| usize::from(a) + 1);
        let mut row = vec![0.0; longest.max(STANDARD_ACTIONS.len())];
        actions.iter().for_each(|&a| row[usize::from(a)] = 1.0 / actions.len() as f64);
        Self::new(row).expect("equal shares of 1 are a distribution")
    }
}

impl Behaviour for Random {
    #[inline]
    fn decide(&self, percept: &Percept<'_>, _: &mut Memory, draws: &mut Draws) -> Decision {
        let row = self.row(percept.contact.is_some());
        (row.distribution.sample(draws.next_u32()) as ActionId).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::{Contact, UNSEEN};
    use crate::effector::{STAY, Side};
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};

    fn counts(policy: &Random, contact: Option<Contact>) -> [u32; 4] {
        let (streams, mut counts) = (Streams::new(Seed(5)), [0; 4]);
        for now in 0..4000 {
            let (at, heading) = ((0, 0), 0);
            let percept = Percept {
                now,
                id: 0,
                readings: &[],
                sectors: &[],
                nearest_in: [UNSEEN; 4],
                contact,
                at,
                heading,
                heard: &[],
            };
            let mut draws = streams.draws(0, now, Purpose(3));
            let decision = policy.decide(&percept, &mut Memory::default(), &mut draws);
            counts[usize::from(decision.action)] += 1;
        }
        counts
    }

    #[test]
    fn actions_are_drawn_as_often_as_they_weigh() {
        let counts = counts(&Random::uniform(), None);
        // Five standard deviations of a count, fixed seed.
        assert!(counts.iter().all(|&n| n.abs_diff(1000) < 137), "{counts:?}");
        assert_eq!(Random::always(STAY).probabilities(false), [0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_bouncing_robot_turns_after_contacts_only() {
        let contact = Some(Contact { kind: 1, side: Side::Front });
        let [forward, left, right, stay] = counts(&Random::bounce(), contact);
        assert_eq!((forward, stay), (0, 0));
        assert!(left.abs_diff(right) < 320, "{left} {right}");
        assert_eq!(counts(&Random::bounce(), None), [4000, 0, 0, 0]);
        assert!(Random::bounce().depends_on_contact() && !Random::uniform().depends_on_contact());
    }

    #[test]
    fn weights_that_are_no_distribution_are_refused() {
        assert!(Random::new(vec![0.5, 0.4], vec![1.0]).is_err());
        assert!(Random::new(vec![1.0], vec![]).is_err());
    }
}
