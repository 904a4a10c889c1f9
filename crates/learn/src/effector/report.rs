//! The report on a learned effector, for people and for programs.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::delays::DelayReport;
use super::grid_displacement::FORWARD_CLASSES;
use crate::display::{self, TableHeading};
use crate::holdout::HoldoutTest;
use crate::{Estimate, EstimateOptions, LeftOut, LowCountRow};
use sidestep_statistics::Moments;

/// The report on a learned effector. Displayed as readable tables, serialized for programs.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct EffectorReport {
    /// The folder or file from which it was learned.
    pub source: String,
    /// Side of a box in meters; `None` where displacements are in units of the commanded move.
    pub box_m: Option<f64>,
    /// Name of the effector, where the table names it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effector: Option<String>,
    /// Number of moves of one box ahead.
    pub events: u64,
    /// Number of samples, and of those that are in no table; `rejected` has them by cause.
    pub left_out: LeftOut,
    /// Number of windows that were not used, by cause.
    pub rejected: BTreeMap<String, u64>,
    /// The results of a move ahead, phase-averaged; `None` without such moves.
    pub transitions: Option<ForwardShares>,
    /// The same with displacements rounded to whole boxes.
    pub transitions_rounded: Option<ForwardShares>,
    /// Phase-averaged probability of each box, `"ahead,left"`.
    pub outcomes: BTreeMap<String, f64>,
    /// Number of moves by the box to which they round, `"ahead,left"`.
    pub rounded_counts: BTreeMap<String, u64>,
    /// Displacements: `ahead_boxes`, `left_boxes`, `dtheta_minus_cmd_rad`, `duration_s` and
    /// all other quantities that the source gives, by name with unit.
    pub moments: BTreeMap<String, Moments>,
    /// `None` where the log has no commanded turn.
    pub turns: Option<TurnReport>,
    /// Counts of every action's outcomes, phase-averaged, where the source names actions.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub actions: BTreeMap<String, BTreeMap<String, f64>>,
    /// The pauses before actions; `None` where the source does not give them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delays: Option<DelayReport>,
    /// Lateral slip of odometry per step as a share of its length: standard deviation.
    pub lateral_slip_sd: Option<f64>,
    /// The same as a robust spread, to which poses that jump add nothing: 1.4826 times the median
    /// absolute deviation, of the steps that odometry can make.
    pub lateral_slip_robust_sd: Option<f64>,
    /// The slip of all steps in full.
    pub lateral_slip: Option<Moments>,
    /// Every estimated probability with its count and interval.
    pub probabilities: Vec<Estimate>,
    /// Rows with fewer counts than [`EstimateOptions::thin_below`].
    pub thin: Vec<LowCountRow>,
    /// Tests of how well a part of the events predicts the rest.
    pub hold_out: Vec<HoldoutTest>,
    /// The rule by which counts become probabilities.
    pub estimate: EstimateOptions,
    /// Warnings that the reader should see before trusting the numbers.
    pub warnings: Vec<String>,
}

/// The results of one box ahead, as shares of all events.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ForwardShares {
    /// Share that stayed in the same box.
    pub stay: f64,
    /// Share that went one box ahead.
    pub ahead: f64,
    /// Share that went two boxes ahead.
    pub ahead2: f64,
    /// To the box diagonally ahead on the left.
    pub ahead_left: f64,
    /// To the box diagonally ahead on the right.
    pub ahead_right: f64,
    /// Share that went anywhere else.
    pub other: f64,
}

impl ForwardShares {
    /// Returns shares from counts in the order of [`FORWARD_CLASSES`]; `None` without counts.
    pub(super) fn from_counts(counts: &[f64]) -> Option<Self> {
        let total: f64 = counts.iter().sum();
        let [stay, ahead, ahead2, ahead_left, ahead_right, other] =
            std::array::from_fn(|class: usize| counts[class] / total);
        debug_assert_eq!(counts.len(), FORWARD_CLASSES.len());
        (total > 0.0).then_some(Self { stay, ahead, ahead2, ahead_left, ahead_right, other })
    }
}

/// The results of commanded turns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TurnReport {
    /// Number of commanded turns, to either side.
    pub n: usize,
    /// Those commanded to the left.
    pub n_left: usize,
    /// Those commanded to the right.
    pub n_right: usize,
    /// True over commanded turn: below 1 where the robot turns too little.
    pub true_over_commanded: Option<Moments>,
    /// True turn minus commanded turn in degrees, + = too far.
    pub error_deg_along_turn: Option<Moments>,
    /// Duration in seconds, where known.
    pub duration_s: Option<Moments>,
    /// Number of true turns by degrees along the command, rounded to 15 degrees.
    pub hist_15deg: BTreeMap<i32, u64>,
    /// Number of errors by degrees too far, rounded to 5 degrees.
    pub error_hist_5deg: BTreeMap<i32, u64>,
}

impl fmt::Display for EffectorReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.effector {
            Some(name) => writeln!(f, "Effector `{name}` learned from {}", self.source)?,
            None => writeln!(f, "Effector learned from {}", self.source)?,
        }
        let unit = self.box_m.map_or("one commanded move".to_string(), |m| format!("{m} m"));
        writeln!(f, "{} moves of one box ({unit}) ahead", self.events)?;
        for (cause, count) in &self.rejected {
            writeln!(f, "  rejected {count}: {}", cause.replace('_', " "))?;
        }
        display::write_warnings(f, &self.warnings)?;
        display::write_moments(f, &self.named_moments())?;
        if let (Some(robust), Some(plain)) = (self.lateral_slip_robust_sd, self.lateral_slip_sd) {
            let [robust, plain] = [100.0 * robust, 100.0 * plain];
            writeln!(f, "lateral slip: {robust:.2} % robust, {plain:.2} % with all that jump")?;
        }
        if let Some(delays) = &self.delays {
            write_delays(f, delays)?;
        }
        let heading = TableHeading { row: "action", column: "outcome" };
        display::write_estimates(f, &self.probabilities, &heading)?;
        display::write_low_count_rows(f, &self.thin, self.estimate.thin_below)?;
        display::write_holdout_tests(f, &self.hold_out)
    }
}

fn write_delays(f: &mut fmt::Formatter<'_>, delays: &DelayReport) -> fmt::Result {
    let DelayReport { actions, delays, cycles, pairs, autocorrelation } = delays;
    write!(f, "{delays} of {actions} actions were delayed, {cycles} cycles in all")?;
    match autocorrelation {
        Some(r) => writeln!(f, "; autocorrelation of pauses {r:.3} ({pairs} pairs of actions)"),
        None => writeln!(f),
    }
}

impl EffectorReport {
    /// Counts the samples that were left out beside those `used`, and takes the intervals back where there are too many.
    pub(super) fn judge_left_out(&mut self, used: u64) {
        self.left_out = LeftOut::new(used, &self.rejected);
        let Some(warning) = self.left_out.warning(&self.estimate) else { return };
        self.warnings.insert(0, warning);
        self.probabilities.iter_mut().for_each(|estimate| estimate.interval = None);
    }

    fn named_moments(&self) -> Vec<(String, Option<Moments>)> {
        let mut named: Vec<(String, Option<Moments>)> =
            self.moments.iter().map(|(name, moments)| (name.clone(), Some(*moments))).collect();
        named.push(("lateral_slip_ratio".to_string(), self.lateral_slip));
        if let Some(turns) = &self.turns {
            named.push(("turn true/commanded".to_string(), turns.true_over_commanded));
            named.push(("turn error [deg]".to_string(), turns.error_deg_along_turn));
        }
        named
    }
}
