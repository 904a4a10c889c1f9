//! Samples of all metrics of a run, for charts over time.

use crate::protocol::{MetricName, ReplyBody};
use serde_json::Value;
use sidestep_kernel::Cycle;
use sidestep_scenario::{MetricInfo, MetricLabel, metric_label};
use std::time::Duration;

/// Maximum number of samples; beyond it every second one is dropped. A chart is at most about 2000 pixels wide.
const MAX_SAMPLES: usize = 2048;
/// Maximum number of metrics; further ones are left out, so that memory has a limit for worlds with a metric per
/// agent.
const MAX_METRICS: usize = 400;
/// Minimum time between two samples, before any thinning: charts that change faster cannot be read.
const MIN_SPACING: Duration = Duration::from_millis(100);
/// Minimum ratio of total time to the time spent on sampling: it slows a run down by 1 % at most.
const MIN_COST_RATIO: u32 = 100;

/// The samples of one run.
pub(crate) struct MetricSamples {
    infos: &'static [MetricInfo],
    names: Vec<MetricName>,
    cycles: Vec<Cycle>,
    /// Values in each sample, metric by metric.
    values: Vec<Vec<Option<f64>>>,
    /// Number of times that every second sample was dropped.
    thinned: u32,
    spacing: Duration,
    /// The time that it took to take the last sample, which decides how soon the next one may come.
    last_cost: Duration,
}

impl MetricSamples {
    /// Returns an empty store for the metrics of a world.
    pub(crate) fn new(infos: &'static [MetricInfo]) -> Self {
        Self {
            infos,
            names: Vec::new(),
            cycles: Vec::new(),
            values: Vec::new(),
            thinned: 0,
            spacing: MIN_SPACING,
            last_cost: Duration::ZERO,
        }
    }

    /// Returns whether a sample of a cycle is due, some time after the last one.
    pub(crate) fn is_due(&self, cycle: Cycle, since: Duration) -> bool {
        let Some(&last) = self.cycles.last() else { return true };
        cycle > last && since >= self.spacing.max(self.last_cost.saturating_mul(MIN_COST_RATIO))
    }

    pub(crate) fn is_new_cycle(&self, cycle: Cycle) -> bool {
        self.cycles.last().is_none_or(|&last| cycle > last)
    }

    /// Keeps the metrics of a cycle; `cost` is the time that it took to compute them.
    pub(crate) fn push(&mut self, cycle: Cycle, metrics: &Value, cost: Duration) {
        self.last_cost = cost;
        let mut found = Vec::new();
        flatten_numbers(metrics, "", &mut found);
        let row = self.cycles.len();
        self.cycles.push(cycle);
        self.values.iter_mut().for_each(|column| column.push(None));
        for (key, value) in found {
            if let Some(metric) = self.find_or_add_column(key) {
                self.values[metric][row] = Some(value);
            }
        }
        if self.cycles.len() > MAX_SAMPLES {
            self.drop_every_second();
        }
    }

    /// Returns the column of a metric, a new one for a new metric.
    fn find_or_add_column(&mut self, key: String) -> Option<usize> {
        let known = self.names.iter().position(|name| name.key == key);
        if known.is_some() || self.names.len() == MAX_METRICS {
            return known;
        }
        let MetricLabel { words, unit, .. } = metric_label(self.infos, &key);
        self.names.push(MetricName { key, label: words, unit: unit.unwrap_or_default().into() });
        self.values.push(vec![None; self.cycles.len()]);
        Some(self.names.len() - 1)
    }

    /// Drops every second sample, but never the first.
    fn drop_every_second(&mut self) {
        fn keep_every_second<T: Copy>(all: &mut Vec<T>) {
            *all = all.iter().copied().step_by(2).collect();
        }
        keep_every_second(&mut self.cycles);
        self.values.iter_mut().for_each(keep_every_second);
        self.thinned += 1;
        self.spacing = self.spacing.saturating_mul(2);
    }

    /// Returns the samples from a number on; none if there are not so many, as after a thinning.
    pub(crate) fn samples_reply(&self, from: u32) -> ReplyBody {
        let first = (from as usize).min(self.cycles.len());
        ReplyBody::Metrics {
            names: self.names.clone(),
            first: first as u32,
            thinned: self.thinned,
            cycles: self.cycles[first..].iter().map(|&cycle| cycle as f64).collect(),
            values: self.values.iter().map(|column| column[first..].to_vec()).collect(),
        }
    }
}

/// Collects the numbers of a tree by their paths; lists are no metrics.
fn flatten_numbers(tree: &Value, path: &str, found: &mut Vec<(String, f64)>) {
    match tree {
        Value::Number(number) => {
            found.extend(number.as_f64().map(|number| (path.to_string(), number)));
        }
        Value::Object(members) => members.iter().for_each(|(key, value)| match path {
            "" => flatten_numbers(value, key, found),
            _ => flatten_numbers(value, &format!("{path}.{key}"), found),
        }),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The names of all metrics, and the samples from a number on.
    struct Sampled {
        keys: Vec<String>,
        first: u32,
        cycles: Vec<f64>,
        values: Vec<Vec<Option<f64>>>,
    }

    fn sampled(samples: &MetricSamples, from: u32) -> Sampled {
        let ReplyBody::Metrics { names, first, cycles, values, .. } = samples.samples_reply(from)
        else {
            panic!("no metrics");
        };
        Sampled { keys: names.into_iter().map(|name| name.key).collect(), first, cycles, values }
    }

    #[test]
    fn numbers_are_named_by_their_path_and_new_ones_have_no_past() {
        let mut samples = MetricSamples::new(&[]);
        samples.push(
            0,
            &json!({ "a": 1, "list": [1], "of": { "b": 2.5, "word": "x" } }),
            MIN_SPACING,
        );
        samples.push(5, &json!({ "a": 2, "of": { "c": 3 } }), MIN_SPACING);
        let all = sampled(&samples, 0);
        assert_eq!((all.first, all.keys), (0, ["a", "of.b", "of.c"].map(String::from).into()));
        assert_eq!(all.cycles, [0.0, 5.0]);
        assert_eq!(all.values, [[Some(1.0), Some(2.0)], [Some(2.5), None], [None, Some(3.0)]]);
        let last = sampled(&samples, 1);
        assert_eq!((last.first, last.cycles), (1, vec![5.0]));
        assert_eq!(last.values[0], [Some(2.0)]);
        assert_eq!(sampled(&samples, 9).first, 2);
    }

    #[test]
    fn samples_stay_within_their_bound_and_keep_the_first() {
        let mut samples = MetricSamples::new(&[]);
        (0..5000).for_each(|cycle| samples.push(cycle, &json!({ "n": cycle }), Duration::ZERO));
        let Sampled { cycles, values, .. } = sampled(&samples, 0);
        assert!(cycles.len() <= MAX_SAMPLES && cycles.len() > MAX_SAMPLES / 4);
        assert_eq!(cycles[0], 0.0);
        let same = |(cycle, value): (&f64, &Option<f64>)| Some(*cycle) == *value;
        assert!(cycles.iter().zip(&values[0]).all(same));
        assert!(samples.thinned > 0 && samples.spacing > MIN_SPACING);
    }

    #[test]
    fn a_sample_is_wanted_of_later_cycles_alone() {
        let mut samples = MetricSamples::new(&[]);
        assert!(samples.is_due(0, Duration::ZERO));
        samples.push(7, &json!({}), Duration::from_millis(5));
        assert!(!samples.is_due(7, MIN_SPACING * 100) && !samples.is_new_cycle(7));
        assert!(
            samples.is_due(8, MIN_SPACING * 5) && !samples.is_due(8, MIN_SPACING),
            "one in a hundred"
        );
    }
}
