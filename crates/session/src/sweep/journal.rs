//! Lines of a journal: the outcome of a run, and its time of arrival.

use serde::{Deserialize, Serialize};
use sidestep_experiment::sweep::Outcome;
use std::time::{SystemTime, UNIX_EPOCH};

/// An outcome with the time at which it was stored. Readers of outcomes alone see no difference: no result depends on
/// a clock.
#[derive(Debug, Serialize)]
pub(super) struct TimestampedOutcome<'a> {
    #[serde(flatten)]
    outcome: &'a Outcome,
    ended_unix_s: f64,
}

/// The same, as read back.
#[derive(Debug, Deserialize)]
pub(super) struct StoredOutcome {
    #[serde(flatten)]
    pub(super) outcome: Outcome,
    /// Seconds since the beginning of 1970; early journals do not have it.
    pub(super) ended_unix_s: Option<f64>,
}

impl<'a> TimestampedOutcome<'a> {
    pub(super) fn now(outcome: &'a Outcome) -> Self {
        Self { outcome, ended_unix_s: now_unix_s() }
    }
}

/// Returns the seconds since the beginning of 1970.
pub(super) fn now_unix_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}
