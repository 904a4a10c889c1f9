//! Delays from a log: the pauses between the command of an action and its motion.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use sidestep_error_models::delay::{DelayDuration, DelayEvent, DelayModel};

use crate::CountTable;
use crate::counts::rounded;

/// The steps without motion before an action, 0 for one that began at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pause {
    /// Number of the robot; 0 where the table names none.
    pub(super) robot: u32,
    pub(super) cycles: u32,
}

/// The delays of a log in numbers; `delays` and `delay_cycles` among the probabilities have the counts of durations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DelayReport {
    /// Number of actions whose pause the log gives.
    pub actions: u64,
    /// Number of those that were delayed.
    pub delays: u64,
    /// Sum of all pauses in cycles.
    pub cycles: u64,
    /// Number of pairs of consecutive actions of a robot.
    pub pairs: u64,
    /// Correlation of the pauses of such pairs; `None` where all pauses are alike.
    pub autocorrelation: Option<f64>,
}

/// Beyond so many standard errors of independent pauses their correlation is told.
const MAX_STANDARD_ERRORS: f64 = 3.0;

impl DelayReport {
    pub(super) fn new(pauses: &[Pause]) -> Self {
        let series = series_by_robot(pauses);
        Self {
            actions: pauses.len() as u64,
            delays: pauses.iter().filter(|pause| pause.cycles > 0).count() as u64,
            cycles: pauses.iter().map(|pause| u64::from(pause.cycles)).sum(),
            pairs: series.iter().map(|one| one.len() as u64 - 1).sum(),
            autocorrelation: autocorrelation(&series),
        }
    }

    /// Returns the warning on pauses that are not independent, as a simulation draws them.
    pub(super) fn warning(&self) -> Option<String> {
        let correlation = self.autocorrelation?;
        let limit = MAX_STANDARD_ERRORS / (self.pairs as f64).sqrt();
        (correlation.abs() > limit).then(|| {
            format!(
                "the pauses of consecutive actions correlate (r = {correlation:.3}, {limit:.3} is within chance), and a \
                 simulation draws them independently: long standstills will be too rare"
            )
        })
    }
}

/// Returns the pauses of each robot in the order of time.
fn series_by_robot(pauses: &[Pause]) -> Vec<Vec<u32>> {
    let mut series: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for pause in pauses {
        series.entry(pause.robot).or_default().push(pause.cycles);
    }
    series.into_values().collect()
}

/// Returns the correlation of consecutive pauses, by the mean and variance of all.
fn autocorrelation(series: &[Vec<u32>]) -> Option<f64> {
    let all = || series.iter().flatten().map(|cycles| f64::from(*cycles));
    let n: usize = series.iter().map(Vec::len).sum();
    let mean = all().sum::<f64>() / n as f64;
    let variance = all().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n as f64;
    let off = |cycles: u32| f64::from(cycles) - mean;
    let pairs = series.iter().flat_map(|one| one.windows(2));
    let pair_count = n - series.len();
    (variance > 0.0 && pair_count > 0).then(|| {
        let products = pairs.map(|pair| off(pair[0]) * off(pair[1]));
        products.sum::<f64>() / (pair_count as f64 * variance)
    })
}

/// Returns how many actions were delayed, and for how long those were.
pub(super) fn count_tables(pauses: &[Pause]) -> Vec<CountTable> {
    let columns = ["delayed", "prompt"].map(String::from);
    let mut starts = CountTable::new("delays", &["action".to_string()], &columns);
    for pause in pauses {
        starts.add(0, usize::from(pause.cycles == 0), 1.0);
    }
    let lengths = lengths(pauses);
    if lengths.is_empty() {
        return vec![starts];
    }
    let columns: Vec<String> = lengths.iter().map(u32::to_string).collect();
    let mut cycles = CountTable::new("delay_cycles", &["delayed".to_string()], &columns);
    for pause in pauses.iter().filter(|pause| pause.cycles > 0) {
        cycles.add(0, lengths.binary_search(&pause.cycles).expect("a length of all pauses"), 1.0);
    }
    vec![starts, cycles]
}

/// Returns the lengths of all delays, each once, rising.
fn lengths(pauses: &[Pause]) -> Vec<u32> {
    let lengths = pauses.iter().map(|pause| pause.cycles).filter(|&cycles| cycles > 0);
    lengths.collect::<BTreeSet<_>>().into_iter().collect()
}

/// Returns the delays as shares of the counts; `None` where no action was delayed. They are not smoothed, because a
/// duration that was never seen has no place in the table.
pub(super) fn model(pauses: &[Pause]) -> Option<DelayModel> {
    let tables = count_tables(pauses);
    let [starts, cycles] = &tables[..] else { return None };
    let share = |table: &CountTable| table.smoothed(0, 0.0).map(|row| rounded(&row));
    let durations = lengths(pauses).into_iter().zip(share(cycles)?);
    Some(DelayModel {
        p: share(starts)?[0],
        per: DelayEvent::Action,
        durations: durations.map(|(cycles, p)| DelayDuration { cycles, p }).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pauses(cycles: &[u32]) -> Vec<Pause> {
        cycles.iter().map(|&cycles| Pause { robot: 0, cycles }).collect()
    }

    #[test]
    fn delays_are_shares_of_actions_and_durations_of_delays() {
        let model = model(&pauses(&[0, 2, 0, 0, 5, 2, 0, 2])).expect("delays");
        assert_eq!(model.p, 0.5);
        let durations: Vec<_> = model.durations.iter().map(|d| (d.cycles, d.p)).collect();
        assert_eq!(durations, [(2, 0.75), (5, 0.25)]);
    }

    #[test]
    fn a_log_without_a_pause_has_no_delays() {
        assert_eq!(model(&pauses(&[0, 0, 0])), None);
        let report = DelayReport::new(&pauses(&[0, 0, 0]));
        assert_eq!((report.actions, report.delays, report.autocorrelation), (3, 0, None));
    }

    #[test]
    fn pauses_that_come_in_a_row_are_told() {
        let in_a_row: Vec<u32> = (0..400).map(|k| u32::from(k / 20 % 2 == 0)).collect();
        let report = DelayReport::new(&pauses(&in_a_row));
        assert!(report.autocorrelation.expect("pauses differ") > 0.8, "{report:?}");
        assert!(report.warning().expect("a warning").contains("correlate"));
        // Each is followed by both alike: the pairs 00, 01, 11, 10 take turns.
        let mixed: Vec<u32> = (0..400).map(|k| u32::from(k / 2 % 2 == 0)).collect();
        assert_eq!(DelayReport::new(&pauses(&mixed)).warning(), None);
    }

    #[test]
    fn pairs_do_not_reach_from_robot_to_robot() {
        let of = |robot, cycles| Pause { robot, cycles };
        let report = DelayReport::new(&[of(0, 1), of(1, 0), of(0, 1), of(1, 0)]);
        assert_eq!((report.pairs, report.autocorrelation), (2, Some(1.0)));
    }
}
