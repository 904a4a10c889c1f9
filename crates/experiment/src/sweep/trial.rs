//! One trial -> one row.

use super::plan::Trial;
use super::series::TrialSeries;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use sidestep_kernel::series::is_clock_metric;
use sidestep_kernel::{Cycle, InputError, Interrupt, Simulation};
use sidestep_scenario::{Source, Worlds};

/// Cycles between two checks whether to continue: few, so that a run stops soon, and enough for
/// checks to cost nothing.
const INTERRUPT_CHECK_CYCLES: Cycle = 256;

/// The outcome of a trial, which becomes one row of the table of runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Number of the trial; files call it `cell`.
    #[serde(rename = "cell")]
    pub trial: u64,
    /// Cycles that were run; 0 if the run failed.
    pub cycles: Cycle,
    /// Digest of the last state, in hexadecimal; empty if the run failed.
    pub digest: String,
    /// The reason why the run failed: a bug, because wrong scenarios are found earlier.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// The metrics, by dotted name: numbers, truth values and text.
    pub metrics: Map<String, Value>,
    /// The times that it took, by dotted name, in seconds; they differ when it is run again.
    pub costs: Map<String, Value>,
    /// Metrics over time, and the cycles at which they were kept, as [`series`](super::series) writes them.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    pub series: Map<String, Value>,
}

/// The simulation of a trial, at its start.
pub struct TrialRun {
    trial: Trial,
    simulation: Box<dyn Simulation>,
    until: Cycle,
    /// The metrics that are kept over time.
    series: Vec<String>,
}

/// Returns the simulation of a trial of the variant `source`, of one of `worlds`, at its start.
///
/// # Errors
/// When the scenario is wrong with this seed.
pub fn start_trial(
    worlds: &Worlds,
    trial: Trial,
    source: &Source,
    workers: usize,
) -> Result<TrialRun, InputError> {
    let source = source.clone().with_overrides(&[format!("seed={}", trial.seed)])?;
    let compiled = worlds.compile(&source)?;
    let until = compiled.plan().cycles;
    let simulation = compiled.start(&source, workers);
    let series = series_metrics(worlds, compiled.world(), None);
    Ok(TrialRun { trial, simulation, until, series })
}

/// Returns the metrics that a trial keeps over time: the requested ones, or those that its world is about.
pub fn series_metrics(worlds: &Worlds, world: &str, requested: Option<&[String]>) -> Vec<String> {
    if let Some(requested) = requested {
        return requested.to_vec();
    }
    let of_world = worlds.find(world).map_or(&[][..], |world_type| world_type.chart_metrics());
    of_world.iter().map(ToString::to_string).collect()
}

/// Returns the names of the metrics that runs of a scenario have, in order.
pub fn metric_names(simulation: &dyn Simulation) -> Vec<String> {
    let names = flattened(&simulation.metrics()).into_iter().map(|(name, _)| name);
    let names = names.filter(|name| !is_clock_metric(name));
    std::iter::once("cycles_run".to_string()).chain(names).collect()
}

impl TrialRun {
    /// Returns the same simulation, which unwinds within a cycle when `interrupt` is raised.
    #[must_use]
    pub fn with_interrupt(mut self, interrupt: Interrupt) -> Self {
        self.simulation.set_interrupt(interrupt);
        self
    }

    /// Returns the same simulation, of which these metrics are kept over time.
    #[must_use]
    pub fn with_series(self, series: Vec<String>) -> Self {
        Self { series, ..self }
    }

    /// Runs to the end; returns `None` as soon as `should_continue` returns false.
    pub fn run(mut self, should_continue: &dyn Fn() -> bool) -> Option<Outcome> {
        let simulation = self.simulation.as_mut();
        let series = TrialSeries::start(simulation, self.until, self.series);
        while simulation.cycle() < self.until && !simulation.is_over() {
            if !should_continue() {
                return None;
            }
            simulation.advance(INTERRUPT_CHECK_CYCLES.min(self.until - simulation.cycle()));
        }
        let series = series.take(simulation);
        Some(Outcome { series, ..Outcome::from_simulation(self.trial, simulation) })
    }
}

impl Outcome {
    /// Returns the outcome of a simulation that has ended: its present metrics and digest.
    pub fn from_simulation(trial: Trial, simulation: &dyn Simulation) -> Self {
        let (costs, metrics) = flattened(&simulation.metrics())
            .into_iter()
            .partition(|(name, _)| is_clock_metric(name));
        Self {
            trial: trial.id,
            cycles: simulation.cycle(),
            digest: simulation.digest().to_string(),
            failure: None,
            metrics,
            costs,
            series: Map::new(),
        }
    }

    /// Returns the outcome of a trial in which the simulation broke one of its own rules.
    pub fn from_failure(trial: Trial, why: impl Into<String>) -> Self {
        Self {
            trial: trial.id,
            cycles: 0,
            digest: String::new(),
            failure: Some(why.into()),
            metrics: Map::new(),
            costs: Map::new(),
            series: Map::new(),
        }
    }
}

/// Returns nested tables as dotted names. Lists of tables become their number (`NAME_count`); lists
/// of numbers (histograms) are left out, because they are not a single value.
fn flattened(value: &Value) -> Map<String, Value> {
    let mut found = Map::new();
    add_flattened(&mut found, "", value);
    found
}

fn add_flattened(found: &mut Map<String, Value>, name: &str, value: &Value) {
    match value {
        Value::Object(table) => {
            for (key, value) in table {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                add_flattened(found, &name, value);
            }
        }
        Value::Array(items) if items.iter().any(Value::is_number) => {}
        Value::Array(items) => {
            found.insert(format!("{name}_count"), items.len().into());
        }
        value => {
            found.insert(name.into(), value.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::worlds;
    use serde_json::json;

    const ROBOTS: &str = "format = 1\nworld = \"robots\"\ncycles = 300\n[map]\n\
                          office = { corridors = 1, rooms_per_side = 2 }\n[robots]\ncount = 3\n\
                          effector = \"nomad\"\nbehaviour = { kind = \"wander\" }\n";
    const AIRSPACE: &str = "format = 1\nworld = \"airspace\"\n[airspace.generator]\n\
                            kind = \"superconflict\"\nn = 3\n";

    fn trial(seed: u64) -> Trial {
        Trial { id: 5, variant: 0, replicate: 0, seed }
    }

    fn outcome(text: &str, seed: u64, workers: usize) -> Outcome {
        let source = Source::new("s.toml", text, "");
        let started = start_trial(&worlds(), trial(seed), &source, workers).expect("valid");
        started.run(&|| true).expect("not stopped")
    }

    #[test]
    fn a_row_is_a_function_of_its_trial_alone() {
        for text in [ROBOTS, AIRSPACE] {
            let one = outcome(text, 3, 1);
            let again = outcome(text, 3, 2);
            assert_eq!((&one.digest, &one.metrics), (&again.digest, &again.metrics));
            assert_ne!(one.digest, outcome(text, 4, 1).digest);
        }
    }

    #[test]
    fn what_a_clock_measured_stands_apart() {
        let outcome = outcome(AIRSPACE, 1, 1);
        assert!(outcome.costs.contains_key("optimize_cpu_s"));
        assert!(!outcome.metrics.keys().any(|name| name.ends_with("cpu_s")));
        assert_eq!(outcome.metrics["arrived"], json!(3));
    }

    #[test]
    fn a_run_that_is_to_stop_is_no_row() {
        let source = Source::new("s.toml", ROBOTS, "");
        assert_eq!(
            start_trial(&worlds(), trial(1), &source, 1).expect("valid").run(&|| false),
            None
        );
    }

    #[test]
    fn nested_metrics_have_dotted_names_and_lists_are_counted() {
        let value = json!({ "a": { "b": 1, "c": null }, "d": [1, 2], "e": [{ "f": 1 }], "g": [] });
        let names: Vec<(String, Value)> = flattened(&value).into_iter().collect();
        let expected =
            [("a.b", json!(1)), ("a.c", json!(null)), ("e_count", json!(1)), ("g_count", json!(0))];
        assert_eq!(names, expected.map(|(name, value)| (name.to_string(), value)));
    }
}
