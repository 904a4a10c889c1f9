//! The progress of a sweep that other processes run, read from its folder without changing it.

use super::folder::{Folder, check_variants, to_run_table, to_share};
use super::journal::{StoredOutcome, now_unix_s};
use serde::Serialize;
use serde_json::Value;
use sidestep_experiment::sweep::{Outcome, Plan, Shard};
use sidestep_kernel::InputError;
use sidestep_record::sweep::Share;
use std::collections::BTreeSet;

/// The span in seconds before the last run from which runs give the rate: a sweep that was stopped overnight and
/// resumed has the rate of this morning.
const RATE_WINDOW_S: f64 = 600.0;
// Where journals are locked, only the estimate of the time left depends on these two.
/// The idle time, in usual times between two runs, after which a sweep counts as abandoned, ...
const IDLE_TIMEOUT_RUNS: f64 = 10.0;
/// ... but not before this many seconds.
const MIN_IDLE_TIMEOUT_S: f64 = 60.0;
/// Largest number of failed runs that are listed one by one.
const MAX_LISTED_FAILURES: usize = 100;

/// The state of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepStatus {
    /// Whether the table of all runs exists.
    pub is_complete: bool,
    /// Number of finished runs, those that failed among them.
    pub runs: u64,
    /// Number of planned runs; an upper bound if a precision ends the sweep.
    pub total: u64,
    /// Whether a precision ends the sweep: then its total is a bound, and there is no estimate of the time left.
    pub until_precise: bool,
    /// Number of runs that failed.
    pub failed: usize,
    /// The first of them.
    pub failures: Vec<FailedRun>,
    /// Whether a process is running it, by the locks of its journals; where there are no locks, by the time since the
    /// last finished run.
    pub is_active: bool,
    /// The shares that have been started, in order.
    pub shares: Vec<ShareStatus>,
    /// Recent rate of finished runs per second; none before the second run, and none once the sweep is complete.
    pub runs_per_s: Option<f64>,
    /// Seconds since the last run finished.
    pub idle_s: Option<f64>,
    /// Estimated seconds left at the recent rate; none if no process seems to be running, or if a precision ends it.
    pub eta_s: Option<f64>,
}

impl SweepStatus {
    /// Returns the status as JSON, with the names of fields that version 0.1 used as well.
    pub fn to_json(&self) -> Value {
        let mut json = serde_json::to_value(self).unwrap_or_default();
        if let Value::Object(fields) = &mut json {
            fields.insert("of".into(), self.total.into());
            fields.insert("is_worked_on".into(), self.is_active.into());
            fields.insert("left_s".into(), self.eta_s.into());
        }
        json
    }
}

/// A run that failed, with everything needed to repeat it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FailedRun {
    /// Number of its trial; `--json` calls it `cell`.
    #[serde(rename = "cell")]
    pub trial: u64,
    /// Name of its variant, as tables show it.
    pub variant: String,
    /// The seed of the run, which repeats the failure with the variant's scenario.
    pub seed: u64,
    /// The reason.
    pub why: String,
}

/// The state of a share.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShareStatus {
    /// Its name, as `--shard` takes it.
    pub share: String,
    /// Number of finished runs that it has.
    pub runs: u64,
    /// Number of its planned runs; an upper bound if a precision ends the sweep.
    pub of: u64,
    /// Whether all of its runs are finished and stored as a part.
    pub is_done: bool,
    /// Seconds since its last run finished; none if it is done.
    pub idle_s: Option<f64>,
}

/// The runs of all parts and journals, each counted once even if two shares have it.
#[derive(Default)]
struct FolderScan {
    trials: BTreeSet<u64>,
    failed: Vec<(u64, String)>,
    /// The times at which runs of shares in progress finished.
    stamps: Vec<f64>,
}

impl FolderScan {
    fn add(&mut self, outcome: Outcome) {
        let is_new = self.trials.insert(outcome.trial);
        if let Some(why) = outcome.failure.filter(|_| is_new) {
            self.failed.push((outcome.trial, why));
        }
    }
}

/// Returns the state of the sweep in a folder.
///
/// # Errors
/// When something in it cannot be read.
pub fn read_status(folder: &Folder) -> Result<SweepStatus, InputError> {
    let plan = folder.plan();
    let now_s = now_unix_s();
    let mut found = FolderScan::default();
    let mut shares = Vec::new();
    check_variants(folder)?;
    let is_complete = folder.is_complete();
    if is_complete {
        to_run_table(folder.results()?).for_each_outcome(|outcome| found.add(outcome));
    } else {
        folder.parts(|part| to_run_table(part).for_each_outcome(|outcome| found.add(outcome)))?;
        for (share, is_done) in folder.shares()? {
            shares.push(share_status(folder, share, is_done, &mut found, now_s)?);
        }
    }
    let runs = found.trials.len() as u64;
    let until_precise = plan.until.is_some();
    let total = if is_complete { runs } else { plan.runs() };
    let newest_s = found.stamps.iter().copied().reduce(f64::max);
    let idle_s = newest_s.map(|newest_s| (now_s - newest_s).max(0.0));
    let runs_per_s = newest_s.and_then(|newest_s| rate(&found.stamps, newest_s));
    let eta_s = eta_s(total.saturating_sub(runs), runs_per_s, idle_s).filter(|_| !until_precise);
    let is_active = is_active(folder, &shares, runs_per_s);
    let failures = failures(plan, &mut found.failed);
    let failed = found.failed.len();
    Ok(SweepStatus {
        is_complete,
        runs,
        total,
        until_precise,
        failed,
        failures,
        is_active,
        shares,
        runs_per_s,
        idle_s,
        eta_s,
    })
}

fn share_status(
    folder: &Folder,
    share: Share,
    is_done: bool,
    found: &mut FolderScan,
    now_s: f64,
) -> Result<ShareStatus, InputError> {
    let shard = Shard { index: share.index, count: share.count };
    let of = folder.plan().shard_trials(shard).count() as u64;
    let share_name = shard.to_string();
    if is_done {
        return Ok(ShareStatus { share: share_name, runs: of, of, is_done, idle_s: None });
    }
    let mut runs = 0;
    let mut newest_s: Option<f64> = None;
    let read = folder.journal_of(share, |StoredOutcome { outcome, ended_unix_s }| {
        runs += 1;
        found.add(outcome);
        if let Some(ended_s) = ended_unix_s {
            found.stamps.push(ended_s);
            newest_s = Some(newest_s.map_or(ended_s, |newest_s| newest_s.max(ended_s)));
        }
    });
    if let Err(error) = read {
        // A share that has ended meanwhile no longer has a journal.
        let is_done = folder.shares()?.contains(&(share, true));
        if !is_done {
            return Err(error);
        }
        return Ok(ShareStatus { share: share_name, runs: of, of, is_done, idle_s: None });
    }
    // Clocks of other machines may be ahead.
    let idle_s = newest_s.map(|newest_s| (now_s - newest_s).max(0.0));
    Ok(ShareStatus { share: share_name, runs, of, is_done, idle_s })
}

/// Returns the recent rate of runs per second.
fn rate(stamps: &[f64], newest_s: f64) -> Option<f64> {
    let recent: Vec<f64> =
        stamps.iter().copied().filter(|s| newest_s - s <= RATE_WINDOW_S).collect();
    let oldest_s = recent.iter().copied().fold(newest_s, f64::min);
    // N runs have N - 1 intervals between them.
    let intervals = recent.len() - 1;
    let span_s = newest_s - oldest_s;
    (intervals > 0 && span_s > 0.0).then(|| intervals as f64 / span_s)
}

/// Returns the estimated seconds left; none without a rate, and if no process seems to be running.
fn eta_s(remaining: u64, runs_per_s: Option<f64>, idle_s: Option<f64>) -> Option<f64> {
    let runs_per_s = runs_per_s?;
    if is_stalled(idle_s?, Some(runs_per_s)) {
        return None;
    }
    Some(remaining as f64 / runs_per_s)
}

/// Returns whether no run has finished for longer than a sweep in progress would take; without a rate a minute
/// decides.
fn is_stalled(idle_s: f64, runs_per_s: Option<f64>) -> bool {
    let usual_s = runs_per_s.map_or(0.0, |runs_per_s| IDLE_TIMEOUT_RUNS / runs_per_s);
    idle_s > MIN_IDLE_TIMEOUT_S.max(usual_s)
}

/// Returns whether a process is running one of the shares that are started and not done.
fn is_active(folder: &Folder, shares: &[ShareStatus], runs_per_s: Option<f64>) -> bool {
    shares.iter().filter(|share| !share.is_done).any(|share| {
        let shard: Option<Shard> = share.share.parse().ok();
        if let Some(is_locked) = shard.and_then(|shard| folder.is_locked(to_share(shard))) {
            return is_locked;
        }
        // Without locks, as on some network file systems, the time since the last run decides. A share without a
        // finished run may take any time for its first one.
        share.idle_s.is_none_or(|idle_s| !is_stalled(idle_s, runs_per_s))
    })
}

/// Returns the first runs that failed, in order.
fn failures(plan: &Plan, failed: &mut [(u64, String)]) -> Vec<FailedRun> {
    failed.sort();
    let names = plan.names();
    let mut failures = Vec::new();
    for (id, why) in failed.iter().take(MAX_LISTED_FAILURES) {
        let Some(trial) = plan.trial_of(*id) else { continue };
        failures.push(FailedRun {
            trial: *id,
            variant: names[trial.variant as usize].clone(),
            seed: trial.seed,
            why: why.clone(),
        });
    }
    failures
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_that_of_the_last_minutes_and_what_is_left_is_told_while_somebody_works() {
        assert_eq!(rate(&[100.0], 100.0), None);
        assert_eq!(rate(&[100.0, 102.0, 104.0], 104.0), Some(0.5));
        assert_eq!(
            rate(&[1.0, 5000.0, 5004.0], 5004.0),
            Some(0.25),
            "the night between is none of it"
        );
        assert_eq!(eta_s(10, Some(0.5), Some(30.0)), Some(20.0));
        assert_eq!(eta_s(10, Some(0.5), Some(61.0)), None);
        assert_eq!(eta_s(10, Some(0.01), Some(900.0)), Some(1000.0), "long runs come in seldom");
        assert_eq!(eta_s(10, None, Some(1.0)), None);
    }
}
