//! Samples that were left out of the tables, and whether the reason is one that says nothing about the errors.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::EstimateOptions;
use sidestep_kernel::InputError;

/// Causes that have nothing to do with the result of a sample, so that the others are still a fair draw. Any other
/// cause is unexplained: a reading that is no number may be just the one that missed.
const EXPLAINED_CAUSES: [&str; 9] = [
    "contact",
    "gap",
    "nearer_than_measured",
    "no_ground_truth",
    "no_true_pose",
    "observer_without_ground_truth",
    "own_action",
    "turn",
    "unmapped",
];
/// Like the others, for the subject of a sighting.
const SUBJECT_LOST: &str = "subject_without_ground_truth";

/// The number of samples of a log, and of those among them that were left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct LeftOut {
    /// Number of samples in the log.
    pub samples: u64,
    /// Number of samples that are in no table.
    pub left_out: u64,
    /// Number of those left out for a reason that nothing explains, such as a damaged row or a range that is no number.
    pub unexplained: u64,
}

impl LeftOut {
    /// Counts samples of which `used` are in the tables, and the others are left out by these causes.
    pub(crate) fn new(used: u64, by_cause: &BTreeMap<String, u64>) -> Self {
        let left_out = by_cause.values().sum();
        let unexplained = by_cause.iter().filter(|(cause, _)| !is_explained(cause));
        Self {
            samples: used + left_out,
            left_out,
            unexplained: unexplained.map(|(_, count)| count).sum(),
        }
    }

    /// Returns the share of samples that are in no table, from 0 to 1.
    pub fn share(&self) -> f64 {
        self.left_out as f64 / self.samples.max(1) as f64
    }

    /// Returns the share of samples left out for a reason that nothing explains, from 0 to 1.
    pub fn unexplained_share(&self) -> f64 {
        self.unexplained as f64 / self.samples.max(1) as f64
    }

    /// Returns the warning where the share that nothing explains is too large for intervals.
    pub(crate) fn warning(&self, options: &EstimateOptions) -> Option<String> {
        let share = self.unexplained_share();
        (share > options.max_unexplained).then(|| {
            format!(
                "no intervals: {} of {} samples ({:.1} %) were left out for a reason that nothing explains, and what \
                 they would have shown may be just the errors; repair the log, or accept that share with \
                 --max-unexplained {}",
                self.unexplained,
                self.samples,
                100.0 * share,
                rounded_up(share)
            )
        })
    }
}

/// Returns the number of `misfits`, rows with another number of fields, that may be among those chosen of `all` other
/// rows: nothing tells of which robot, effector or sensor they are, so these have their share of them, rounded up.
pub(crate) fn misfits_among(all: usize, misfits: usize, chosen: usize) -> u64 {
    if all == 0 {
        return misfits as u64;
    }
    (misfits as u64 * chosen as u64).div_ceil(all as u64)
}

/// Returns the warning on damaged rows of a table, with the error of the first of them.
pub(crate) fn damage_warning(count: u64, first: &InputError) -> String {
    // Its remedy is for a file of one's own, and the rest of its text for a terminal.
    let text = first.to_string();
    let cause = text.lines().next().unwrap_or_default();
    format!("{count} damaged rows were left out, the first: {cause}")
}

fn is_explained(cause: &str) -> bool {
    cause == SUBJECT_LOST || EXPLAINED_CAUSES.contains(&cause)
}

/// Returns the next hundredth from a share on, which accepts it.
fn rounded_up(share: f64) -> f64 {
    ((share * 100.0).floor() + 1.0).min(100.0) / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left_out(causes: &[(&str, u64)]) -> LeftOut {
        LeftOut::new(900, &causes.iter().map(|(cause, n)| (cause.to_string(), *n)).collect())
    }

    #[test]
    fn only_what_nothing_explains_takes_the_intervals() {
        let options = EstimateOptions::default();
        let explained = left_out(&[("no_true_pose", 5000), ("no_number", 40)]);
        assert_eq!((explained.samples, explained.unexplained), (5940, 40));
        assert_eq!(explained.warning(&options), None);
        let damaged = left_out(&[("no_number", 100)]);
        assert!(damaged.warning(&options).unwrap().contains("--max-unexplained 0.11"));
        let accepted = EstimateOptions { max_unexplained: 0.11, ..options };
        assert_eq!(damaged.warning(&accepted), None);
        assert_eq!(left_out(&[]).share(), 0.0);
    }
}
