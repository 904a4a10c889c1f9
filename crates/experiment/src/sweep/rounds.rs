//! The next trials to run, if a requested precision decides when a variant has had enough runs.

use super::file::Precision;
use super::groups::{Equality, equality};
use super::plan::{Plan, Trial};
use super::table::RunTable;
use super::trial::Outcome;
use serde::Serialize;
use sidestep_statistics::{StopDecision, StopReason, StoppingRule};
use std::collections::{BTreeMap, BTreeSet};

/// Number of runs of each variant before the first check: with fewer, a standard deviation that is small by chance would
/// end the runs.
const MIN_RUNS: usize = 10;

/// The metrics of the variants so far: the decision depends on nothing else.
///
/// They are a function of the outcomes alone, in any order, so the number of workers does not
/// matter, nor whether the sweep was killed in between.
#[derive(Debug)]
pub struct Rounds<'a> {
    plan: &'a Plan,
    until: &'a Precision,
    /// Values by replicate of each variant, by metric: of all metrics, because those that decide may be equal where
    /// others show that seeds change something.
    values: Vec<BTreeMap<String, Values>>,
    /// Replicates of each variant that have an outcome.
    done: Vec<BTreeSet<u32>>,
}

/// The reason why a variant is no longer run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct VariantStop {
    /// Index of the variant in [`Plan::variants`].
    pub variant: u32,
    /// Number of its runs when they were enough.
    pub runs: usize,
    /// The reason why they are enough.
    pub reason: StopReason,
}

/// Returns the reasons why the variants of a plan stopped, if a precision ended them.
pub fn variant_stops(plan: &Plan, runs: &RunTable) -> Vec<VariantStop> {
    let Some(until) = &plan.until else { return Vec::new() };
    let mut rounds = Rounds::new(plan, until);
    runs.for_each_outcome(|outcome| rounds.add(&outcome));
    rounds.variant_stops()
}

impl<'a> Rounds<'a> {
    /// Returns the rounds before any run.
    pub fn new(plan: &'a Plan, until: &'a Precision) -> Self {
        let n = plan.variants.len();
        Self { plan, until, values: vec![BTreeMap::new(); n], done: vec![BTreeSet::new(); n] }
    }

    /// Adds an outcome; one of a trial that is not in the plan is left out.
    pub fn add(&mut self, outcome: &Outcome) {
        let Some(trial) = self.plan.trial_of(outcome.trial) else { return };
        let variant = trial.variant as usize;
        self.done[variant].insert(trial.replicate);
        for (name, value) in &outcome.metrics {
            let number = value.as_f64().or_else(|| value.as_bool().map(f64::from));
            let of_metric = self.values[variant].entry(name.clone()).or_default();
            of_metric.insert(trial.replicate, number);
        }
    }

    /// Returns the trials of the next round that have no outcome yet; empty if all variants are
    /// done.
    pub fn next_trials(&self) -> Vec<Trial> {
        let mut trials = Vec::new();
        for variant in 0..self.plan.variants.len() as u32 {
            if let StopDecision::Run(total) = self.decide(variant) {
                let done = &self.done[variant as usize];
                let open = (0..total as u32).filter(|replicate| !done.contains(replicate));
                trials.extend(open.map(|replicate| self.plan.trial(variant, replicate)));
            }
        }
        // As all sweeps are run: the first results are a small complete experiment.
        trials.sort_by_key(|trial| (trial.replicate, trial.variant));
        trials
    }

    /// Returns the reasons why variants are done.
    pub fn variant_stops(&self) -> Vec<VariantStop> {
        let mut stops = Vec::new();
        for variant in 0..self.plan.variants.len() as u32 {
            if let StopDecision::Enough(runs, reason) = self.decide(variant) {
                stops.push(VariantStop { variant, runs, reason });
            }
        }
        stops
    }

    fn decide(&self, variant: u32) -> StopDecision {
        if self.plan.runs_of(variant) == 1 && !self.done[variant as usize].is_empty() {
            return StopDecision::Enough(1, StopReason::Seedless);
        }
        let rule = StoppingRule {
            half_width: self.until.half_width,
            relative: self.until.is_relative,
            min_runs: MIN_RUNS,
            max_runs: self.plan.runs_of(variant) as usize,
        };
        let done = &self.done[variant as usize];
        // Only runs without a gap count: an interrupted round is completed first.
        let complete = (0u32..).zip(done).take_while(|(k, replicate)| k == *replicate).count();
        let mut columns: Vec<Vec<Option<f64>>> = Vec::new();
        for values in self.deciding_metrics(variant) {
            columns.push((0..complete as u32).map(|k| values.get(&k).copied().flatten()).collect());
        }
        if columns.is_empty() {
            let first = MIN_RUNS.min(rule.max_runs);
            if complete >= first {
                return StopDecision::Enough(first, StopReason::NoValues);
            }
            return StopDecision::Run(first);
        }
        let first = MIN_RUNS.min(rule.max_runs);
        if complete >= first && self.is_unseen(variant) {
            return StopDecision::Enough(first, StopReason::Unseen);
        }
        let columns: Vec<&[Option<f64>]> = columns.iter().map(Vec::as_slice).collect();
        rule.decide_columns(&columns)
    }

    /// Returns the values of the metrics that decide for a variant: those requested; without any, those that vary.
    /// Which these are is seen in the first round and stays, so that no later run changes what an earlier one decided.
    fn deciding_metrics(&self, variant: u32) -> Vec<&Values> {
        let of_variant = &self.values[variant as usize];
        if !self.until.metrics.is_empty() {
            let requested = of_variant.iter().filter(|(name, _)| self.until.metrics.contains(name));
            return requested.map(|(_, values)| values).collect();
        }
        let mut present = Vec::new();
        let mut varying = Vec::new();
        for (name, values) in of_variant {
            if first_round(values).any(Option::is_some) {
                present.push(values);
                if self.varies(name) {
                    varying.push(values);
                }
            }
        }
        // If nothing varies, it takes as many runs to believe that as for a single metric.
        if varying.is_empty() { present } else { varying }
    }

    /// Returns whether all metrics of a variant's first round are equal but for rounding, one of them a measure: no
    /// number of runs would give an interval. The first round decides, so that later runs do not change that.
    fn is_unseen(&self, variant: u32) -> bool {
        let mut whole = Equality::Counts;
        for values in self.values[variant as usize].values() {
            let round: Vec<Option<f64>> = first_round(values).copied().collect();
            match equality(&round) {
                Some(of_metric) => whole = whole.max(of_metric),
                None => return false,
            }
        }
        whole == Equality::Measures
    }

    /// Returns whether a metric differs between two runs of a variant's first round, for any variant: a
    /// rare event is then looked for also in variants that have not had it.
    fn varies(&self, name: &str) -> bool {
        let mut of_variants = self.values.iter().filter_map(|of_variant| of_variant.get(name));
        of_variants.any(|values| {
            let mut all = first_round(values);
            let first = all.next();
            all.any(|value| Some(value) != first)
        })
    }
}

/// Values of a metric, by replicate.
type Values = BTreeMap<u32, Option<f64>>;

/// Fewer than [`MIN_RUNS`] while the round is in progress.
fn first_round(values: &Values) -> impl Iterator<Item = &Option<f64>> {
    (0..MIN_RUNS as u32).filter_map(|k| values.get(&k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{BaseScenario, Factor, Sweep};
    use serde_json::json;
    use sidestep_scenario::Source;

    fn plan(max_runs: u32) -> Plan {
        let mut sweep = Sweep::from_scenario("s.toml");
        sweep.design.factors = vec![Factor::parse("n=1,2").expect("valid")];
        sweep.replicates = max_runs;
        let variants = sweep.design.variants("test").expect("valid");
        let source = Source::new("s.toml", "", "");
        let base = BaseScenario { world: "robots", seed: 1, source: &source };
        Plan::new(&sweep, variants, base).expect("valid")
    }

    /// Variant 0 is sure at once, variant 1 varies a lot.
    fn outcome(trial: Trial) -> Outcome {
        let wave = f64::from(trial.replicate * 7 % 10) - 4.5;
        let value = 100.0 + if trial.variant == 0 { 0.1 } else { 10.0 } * wave;
        let mut outcome = Outcome::from_failure(trial, "");
        outcome.metrics.insert("m".into(), json!(value));
        outcome.metrics.insert("constant".into(), json!(3));
        outcome
    }

    fn until(metrics: &[&str]) -> Precision {
        let metrics = metrics.iter().map(ToString::to_string).collect();
        Precision { metrics, ..("ci=0.05".parse().expect("valid")) }
    }

    /// Runs rounds until none is left; how many runs each variant had.
    fn all(plan: &Plan, until: &Precision, order: impl Fn(&mut Vec<Trial>)) -> [usize; 2] {
        let mut rounds = Rounds::new(plan, until);
        loop {
            let mut trials = rounds.next_trials();
            if trials.is_empty() {
                let stopped = rounds.variant_stops();
                assert_eq!(stopped.len(), 2);
                return [stopped[0].runs, stopped[1].runs];
            }
            order(&mut trials);
            trials.iter().for_each(|trial| rounds.add(&outcome(*trial)));
        }
    }

    #[test]
    fn runs_whose_metrics_are_equal_but_for_rounding_stop_and_are_not_called_precise() {
        for metrics in [vec![], vec!["losses".to_string()]] {
            let mut plan = plan(100);
            plan.until = Some(Precision { half_width: 0.05, is_relative: true, metrics });
            let mut rounds = Rounds::new(&plan, plan.until.as_ref().expect("given"));
            for trial in plan.shard_trials(crate::sweep::Shard::ALL) {
                if trial.replicate < MIN_RUNS as u32 {
                    let mut outcome = Outcome::from_failure(trial, "");
                    let rounding = f64::from(trial.replicate) * 1e-9;
                    outcome.metrics.insert("losses".into(), json!(28));
                    outcome.metrics.insert("lost_s".into(), json!(14.285714 + rounding));
                    rounds.add(&outcome);
                }
            }
            let stops = rounds.variant_stops();
            assert_eq!(stops.len(), 2);
            assert!(
                stops.iter().all(|stop| stop.reason == StopReason::Unseen && stop.runs == MIN_RUNS)
            );
            assert!(rounds.next_trials().is_empty());
        }
    }

    #[test]
    fn a_variant_that_varies_more_is_run_more_often() {
        let plan = plan(1000);
        let runs = all(&plan, &until(&[]), |_| ());
        assert!(runs[0] == MIN_RUNS && (60..400).contains(&runs[1]), "{runs:?}");
        assert_eq!(runs, all(&plan, &until(&["m"]), |_| ()), "what is constant asks for nothing");
    }

    #[test]
    fn what_one_variant_has_seen_is_looked_for_in_the_others_too() {
        let plan = plan(1000);
        let until = Precision { half_width: 0.3, ..until(&[]) };
        let mut rounds = Rounds::new(&plan, &until);
        while let trials = rounds.next_trials()
            && !trials.is_empty()
        {
            for trial in trials {
                let rare = u32::from(trial.variant == 1 && trial.replicate % 2 == 0);
                let mut outcome = Outcome::from_failure(trial, "");
                outcome.metrics.insert("rare".into(), json!(rare));
                rounds.add(&outcome);
            }
        }
        let told = rounds.variant_stops();
        assert_eq!((told[0].runs, told[0].reason), (60, StopReason::Constant), "0 of 10 is not 0");
        assert_eq!(told[1].reason, StopReason::Reached);
    }

    #[test]
    fn runs_that_come_to_nothing_are_not_made_for_ever() {
        let plan = plan(1000);
        let until = until(&[]);
        let mut rounds = Rounds::new(&plan, &until);
        while let trials = rounds.next_trials()
            && !trials.is_empty()
        {
            trials.iter().for_each(|trial| rounds.add(&Outcome::from_failure(*trial, "no start")));
        }
        let told = rounds.variant_stops();
        assert_eq!((told[0].runs, told[0].reason), (MIN_RUNS, StopReason::NoValues));
    }

    #[test]
    fn order_and_interruptions_change_no_decision() {
        let plan = plan(1000);
        let straight = all(&plan, &until(&[]), |_| ());
        assert_eq!(straight, all(&plan, &until(&[]), |trials| trials.reverse()));
        // Killed in the middle of every round: only some trials of it are done.
        let some = |trials: &mut Vec<Trial>| {
            let n = trials.len().div_ceil(2);
            trials.reverse();
            trials.truncate(n);
        };
        assert_eq!(straight, all(&plan, &until(&[]), some));
    }

    #[test]
    fn the_limit_ends_what_is_never_precise_and_says_so() {
        let plan = plan(20);
        let until = until(&["m"]);
        let mut rounds = Rounds::new(&plan, &until);
        while let trials = rounds.next_trials()
            && !trials.is_empty()
        {
            trials.iter().for_each(|trial| rounds.add(&outcome(*trial)));
        }
        let told = rounds.variant_stops();
        assert_eq!((told[1].runs, told[1].reason), (20, StopReason::Maximum));
    }
}
