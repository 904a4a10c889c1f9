//! Studies, shared by all papers: a sweep file and its scenario -> the table of its runs.
//!
//! The sweep files and scenarios are those of `scenarios/papers/`, which `sidestep sweep` and
//! `sidestep run` accept unchanged. A plan keeps only some of a sweep's variants, or runs it
//! longer.

use crate::trial_file::TrialFile;
use serde_json::{Map, Value};
use sidestep::experiment::sweep::scheduler::run_trials;
use sidestep::experiment::sweep::{
    BaseScenario, Outcome, Plan, RunTable, RunTableBuilder, Setting, Shard, Sweep, Trial, Variant,
    start_trial,
};
use sidestep::kernel::{Cycle, InputError, Simulation};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use std::any::Any;

/// A callback for progress: the current activity, and the share done, from 0 to 1.
pub type Progress<'a> = dyn FnMut(&str, f64) + 'a;

/// Returns the progress of a part of the whole that goes from share `from` to share `to`.
pub(crate) fn sub_progress(
    progress: &mut Progress<'_>,
    from: f64,
    to: f64,
) -> impl FnMut(&str, f64) {
    move |what, share| progress(what, from + (to - from) * share)
}

/// Number of runs between two reports of progress, per worker: fewer would let workers wait for the slowest run too often.
const BATCH_RUNS: usize = 8;

/// Runs every item on one of up to `workers` workers; results in the order of the items.
///
/// # Errors
/// The first error that `run` returns.
pub(crate) fn run_all<C: Sync, T: Send, E: Send>(
    items: &[C],
    workers: usize,
    mut report: impl FnMut(f64),
    run: impl Fn(&C) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let numbers: Vec<usize> = (0..items.len()).collect();
    let mut results: Vec<(usize, T)> = Vec::with_capacity(items.len());
    for batch in numbers.chunks(workers.max(1) * BATCH_RUNS) {
        run_trials(
            batch,
            workers,
            |k| Some(run(&items[*k]).map(|result| (*k, result))),
            &mut |result| {
                results.push(result);
                Ok(())
            },
        )?;
        report(results.len() as f64 / items.len() as f64);
    }
    // Results come in the order in which runs end, which differs from call to call.
    results.sort_by_key(|(k, _)| *k);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

pub(crate) fn setting(key: &str, value: impl Into<toml::Value>) -> Setting {
    Setting { key: key.into(), value: value.into() }
}

/// Returns the scenario of this text, with some settings.
///
/// # Errors
/// When a setting does not fit.
pub(crate) fn source(text: &str, settings: &[Setting]) -> Result<Source, InputError> {
    let overrides: Vec<String> = settings.iter().map(Setting::to_override).collect();
    Source::new("a scenario of this experiment", text, "").with_overrides(&overrides)
}

/// Variants, the number of runs of each, and their scenario.
#[derive(Debug)]
pub(crate) struct Study {
    scenario: &'static str,
    sweep: Sweep,
    variants: Vec<Variant>,
}

impl Study {
    /// Reads a sweep file, for the scenario that it names.
    ///
    /// # Errors
    /// When the file is wrong.
    pub(crate) fn from_file(file: &str, scenario: &'static str) -> Result<Self, InputError> {
        let sweep = Sweep::parse(&Source::new("a sweep of this experiment", file, ""))?;
        let variants = sweep.design.variants(&sweep.place)?;
        Ok(Self { scenario, sweep, variants })
    }

    /// Returns variants that no sweep file can describe, because they set no keys of a scenario.
    pub(crate) fn from_variants(scenario: &'static str, variants: Vec<Vec<Setting>>) -> Self {
        let sweep = Sweep::from_scenario("a case of this experiment");
        let variants = variants.into_iter().map(Variant::from).collect();
        Self { scenario, sweep, variants }
    }

    /// Sets the runs of each variant, and the cycles of each run.
    pub(crate) fn with_size(mut self, seeds: usize, cycles: Option<Cycle>) -> Self {
        self.sweep.replicates = seeds as u32;
        self.sweep.first_seed = Some(1);
        // A variant that sets its own number of cycles keeps it.
        let is_open = self.variants.iter().all(|variant| variant.value("cycles").is_none());
        if let (Some(cycles), true) = (cycles, is_open) {
            self.sweep.fixed.push(setting("cycles", cycles as i64));
        }
        self
    }

    /// The variants that are kept stay in their order.
    pub(crate) fn filtered(mut self, holds: impl Fn(&Variant) -> bool) -> Self {
        self.variants.retain(holds);
        self
    }

    /// Keeps the variants that set `key` to one of these numbers.
    pub(crate) fn filtered_by_number(self, key: &str, among: &[f64]) -> Self {
        self.filtered(|v| among.contains(&setting_number(v, key)))
    }

    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.variants.len()
    }

    /// Runs every variant to its end, except for trials that are kept; the metrics are those of its world.
    ///
    /// # Errors
    /// When a scenario is wrong.
    pub(crate) fn run(
        &self,
        workers: usize,
        what: &str,
        kept: &TrialFile,
        progress: &mut Progress<'_>,
    ) -> Result<StudyResults, InputError> {
        let mut results = self.run_by(workers, what, progress, |scenario, _, trial| {
            kept.result(&format!("{what}, trial {}", trial.id), || {
                let run = start_trial(&WORLDS, *trial, &scenario()?, 1)?;
                Ok(run.run(&|| true).expect("nobody stops it"))
            })
        })?;
        for variant in &mut results.variants {
            let compiled = WORLDS.compile(&self.scenario_with(&variant.settings)?)?;
            variant.privilege = compiled.privilege().map(String::from);
        }
        Ok(results)
    }

    /// Returns the scenario with settings that a case and its seed give, in place of those of its variant.
    ///
    /// # Errors
    /// When a setting does not fit.
    pub(crate) fn scenario_with(&self, settings: &[Setting]) -> Result<Source, InputError> {
        source(self.scenario, &[&self.sweep.fixed[..], settings].concat())
    }

    /// Runs every variant by `run`, seed by seed, so that other load on the machine affects all
    /// variants alike. `run` receives a function that makes the variant's scenario.
    ///
    /// # Errors
    /// The first error that `run` returns.
    pub(crate) fn run_by(
        &self,
        workers: usize,
        what: &str,
        progress: &mut Progress<'_>,
        run: impl Fn(&ScenarioFn<'_>, &Variant, &Trial) -> Result<Outcome, InputError> + Sync,
    ) -> Result<StudyResults, InputError> {
        let base = source(self.scenario, &self.sweep.fixed)?;
        let own = BaseScenario { world: "", seed: 1, source: &base };
        let plan = Plan::new(&self.sweep, self.variants.clone(), own)?;
        let trials: Vec<Trial> = plan.shard_trials(Shard::ALL).collect();
        let outcomes = run_all(
            &trials,
            workers,
            |share| progress(what, share),
            |trial| {
                let variant = &plan.variants[trial.variant as usize];
                // Made on demand, because an experiment without a world has no scenario that its settings would fit.
                run(&|| scenario_of(&base, variant, trial.seed), variant, trial)
            },
        )?;
        let mut rows = RunTableBuilder::default();
        for outcome in &outcomes {
            rows.push(outcome);
        }
        let table = rows.build(&plan)?;
        Ok(StudyResults { table, variants: plan.variants })
    }
}

fn scenario_of(base: &Source, variant: &Variant, seed: u64) -> Result<Source, InputError> {
    let overrides: Vec<String> = variant.settings.iter().map(Setting::to_override).collect();
    base.clone().with_overrides(&overrides)?.with_overrides(&[format!("seed={seed}")])
}

/// Makes the scenario of a trial.
pub(crate) type ScenarioFn<'a> = dyn Fn() -> Result<Source, InputError> + 'a;

/// Returns the outcome of an experiment that is no run of a scenario: its values by name.
pub(crate) fn outcome_from_values(trial: &Trial, values: Value) -> Outcome {
    let metrics = match values {
        Value::Object(metrics) => metrics,
        _ => Map::new(),
    };
    Outcome {
        trial: trial.id,
        cycles: 0,
        digest: String::new(),
        failure: None,
        metrics,
        costs: Map::new(),
        series: Map::new(),
    }
}

/// Runs a simulation to its end, and calls `on_cycle` after every cycle.
pub(crate) fn run_to_end(run: &mut dyn Simulation, mut on_cycle: impl FnMut(&dyn Simulation)) {
    let until = run.config().cycles;
    while run.cycle() < until && !run.is_over() {
        run.advance(1);
        on_cycle(run);
    }
}

/// Downcasts a run to that of a known world, for facts that only the state of that world has.
///
/// # Panics
/// When it is a run of another world.
pub(crate) fn downcast<R: Simulation>(run: &dyn Simulation) -> &R {
    let run: &dyn Any = run;
    run.downcast_ref().expect("a run of the world that the scenario names")
}

/// The table of runs, and the variants that its rows belong to.
#[derive(Debug)]
pub(crate) struct StudyResults {
    pub(crate) table: RunTable,
    pub(crate) variants: Vec<Variant>,
}

/// Returns the value that a variant sets a key to, as a number; for a list its first; NaN if it is
/// none.
pub(crate) fn setting_number(variant: &Variant, key: &str) -> f64 {
    variant.value(key).and_then(first_number).unwrap_or(f64::NAN)
}

fn first_number(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Float(x) => Some(*x),
        toml::Value::Integer(n) => Some(*n as f64),
        toml::Value::Array(all) => first_number(all.first()?),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn results_come_back_in_the_order_of_the_items_for_any_number_of_workers() {
        for workers in [0, 1, 2, 5] {
            let items: Vec<usize> = (0..100).collect();
            let mut shares = vec![0.0];
            let square = |i: &usize| Ok::<_, ()>(i * i);
            let results = run_all(&items, workers, |share| shares.push(share), square);
            assert_eq!(results, Ok(items.iter().map(|i| i * i).collect()));
            assert!(shares.is_sorted() && shares.last() == Some(&1.0));
        }
    }

    #[test]
    fn rows_are_by_variant_and_seed() {
        let variants = vec![vec![setting("n", 1)], vec![setting("n", 2)], vec![setting("n", 3)]];
        let study = Study::from_variants("", variants)
            .with_size(2, None)
            .filtered(|v| setting_number(v, "n") > 1.0);
        let run = |_: &ScenarioFn<'_>, v: &Variant, trial: &Trial| {
            Ok(outcome_from_values(
                trial,
                json!({ "x": 10.0 * setting_number(v, "n") + trial.seed as f64 }),
            ))
        };
        let results = study.run_by(2, "", &mut |_, _| (), run).expect("valid");
        let x = results.table.column("x").expect("there");
        let values: Vec<_> = (0..4).filter_map(|row| x.values.number(row)).collect();
        assert_eq!(values, [21.0, 22.0, 31.0, 32.0]);
    }
}
