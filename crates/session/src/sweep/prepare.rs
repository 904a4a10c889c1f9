//! Every variant of a sweep, compiled once, so that errors in any of them are reported before any
//! runs.

use crate::scenario::{read_scenario, read_source};
use crate::watcher::{Progress, ProgressGuard};
use crate::{Error, NoWatcher, Watcher};
use sidestep_experiment::sweep::scheduler::run_trials;
use sidestep_experiment::sweep::trial::metric_names;
use sidestep_experiment::sweep::{BaseScenario, Plan, Setting, Sweep, Variant};
use sidestep_kernel::series::SeriesInterval;
use sidestep_kernel::{InputError, Simulation};
use sidestep_scenario::{CompiledScenario, SeedEffect, Source, Worlds, suggestion};
use std::sync::atomic::{AtomicU32, Ordering};

/// A plan, and the thing made of each variant, by its number.
pub(super) type PreparedPlan<T> = (Plan, Vec<T>);

/// A function that makes a thing of a variant: of its number, its scenario, and the compiled scenario.
pub(super) type VariantFn<'a, T> =
    &'a (dyn Fn(u32, &Source, &dyn CompiledScenario) -> Result<T, Error> + Sync);

/// Compiles every variant on a number of workers, calls `make` for each, and returns the results with the plan. With
/// any number of workers, the error is that of the first variant that has one.
///
/// # Errors
/// When the design or a variant is wrong, `make` fails, or the watcher asks to stop.
pub(super) fn prepare<T: Send>(
    worlds: &Worlds,
    sweep: &Sweep,
    workers: usize,
    watcher: &dyn Watcher,
    make: VariantFn<'_, T>,
) -> Result<PreparedPlan<T>, Error> {
    let base = BaseSource::read(worlds, sweep)?;
    let mut variants = sweep.design.variants(&sweep.place)?;
    // Before anything is compiled: a design may ask for millions of variants.
    Plan::check_size(variants.len(), sweep.replicates, &sweep.place)?;
    let (source, first) = base.compile(&variants[0])?;
    check_metrics(sweep, &source, first.as_ref())?;
    let all = for_each_variant(&variants, workers, watcher, &|k, variant| {
        let (source, compiled) = base.compile(variant)?;
        Ok(CompiledVariant {
            seeds: compiled.seed_effect(),
            privilege: compiled.privilege(),
            agents: compiled.body_count() as u64,
            made: make(k, &source, compiled.as_ref())?,
        })
    })?;
    let agents = all.iter().map(|one| one.agents).max().unwrap_or(0);
    let mut made = Vec::with_capacity(all.len());
    for (variant, one) in variants.iter_mut().zip(all) {
        variant.seeds = one.seeds;
        variant.privilege = one.privilege.map(String::from);
        made.push(one.made);
    }
    let config = first.plan();
    let base = BaseScenario { world: first.world(), seed: config.seed, source: &base.source };
    let plan = Plan::new(sweep, variants, base)?;
    // A sweep without a name of its own has that of its scenario.
    let name = if plan.name.is_empty() { config.name } else { plan.name };
    Ok((Plan { agents, name, ..plan }, made))
}

/// Compiles every variant of a sweep.
///
/// # Errors
/// Those of [`prepare`].
pub(crate) fn check_variants(worlds: &Worlds, sweep: &Sweep) -> Result<(), Error> {
    prepare(worlds, sweep, 1, &NoWatcher, &|_, _, _| Ok(())).map(|_| ())
}

/// The scenario of a sweep, with the settings that all variants share.
struct BaseSource<'a> {
    worlds: &'a Worlds,
    sweep: &'a Sweep,
    /// The shared settings.
    fixed: Vec<String>,
    source: Source,
}

impl<'a> BaseSource<'a> {
    fn read(worlds: &'a Worlds, sweep: &'a Sweep) -> Result<Self, InputError> {
        let fixed: Vec<String> = sweep.fixed.iter().map(Setting::to_override).collect();
        let source = match &sweep.given {
            Some(source) => source.clone().with_overrides(&fixed)?,
            None => read_source(worlds, &sweep.scenario, &fixed)?,
        };
        Ok(Self { worlds, sweep, fixed, source })
    }

    /// Returns a variant's scenario.
    fn compile(
        &self,
        variant: &Variant,
    ) -> Result<(Source, Box<dyn CompiledScenario>), InputError> {
        let overrides: Vec<String> = variant.settings.iter().map(Setting::to_override).collect();
        let source = self.source.clone().with_overrides(&overrides).map_err(|error| {
            // Nobody has typed the option that a setting of a file stands for.
            let setting = error.place().trim_start_matches("--set ");
            let place = format!("{}, where {variant}", self.source.file_place());
            InputError::new(place, format!("{setting}: {}", error.cause()), error.remedy())
        })?;
        match self.worlds.compile(&source) {
            Ok(compiled) => Ok((source, compiled)),
            Err(error) => Err(self.variant_error(variant, error)),
        }
    }

    /// Returns the error of a variant, which names the variant unless all have it: users do not see the
    /// lines of the text that its settings have edited.
    fn variant_error(&self, variant: &Variant, error: InputError) -> InputError {
        let base_error = match self.sweep.given {
            Some(_) => self.worlds.compile(&self.source).err(),
            None => read_scenario(self.worlds, &self.sweep.scenario, &self.fixed).err(),
        };
        if let Some(base_error) = base_error
            && base_error.cause() == error.cause()
        {
            return base_error;
        }
        // An error in another file, e.g. in a profile, has its own place.
        if !error.place().starts_with(self.source.file_place()) {
            return error;
        }
        let place = format!("{}, where {variant}", self.source.file_place());
        InputError::new(place, error.cause(), error.remedy())
    }
}

/// The findings of compiling a variant, and the thing made of it.
struct CompiledVariant<T> {
    seeds: SeedEffect,
    privilege: Option<&'static str>,
    agents: u64,
    made: T,
}

/// Does the work for each variant, on a number of workers, and returns the results in the order of the variants.
///
/// # Errors
/// That of the first variant that has one, or when the watcher asks to stop.
fn for_each_variant<T: Send>(
    variants: &[Variant],
    workers: usize,
    watcher: &dyn Watcher,
    work: &(dyn Fn(u32, &Variant) -> Result<T, Error> + Sync),
) -> Result<Vec<T>, Error> {
    let numbered: Vec<(u32, &Variant)> = (0..).zip(variants).collect();
    // Variants before a wrong one are completed, because one of them may be wrong, too.
    let wrong_at = AtomicU32::new(u32::MAX);
    let run_one = |(k, variant): &(u32, &Variant)| {
        if !watcher.should_continue() || *k >= wrong_at.load(Ordering::Relaxed) {
            return None;
        }
        let result = work(*k, variant);
        if result.is_err() {
            wrong_at.fetch_min(*k, Ordering::Relaxed);
        }
        Some(Ok::<_, Error>((*k, result)))
    };
    let watched = ProgressGuard(watcher);
    let mut results: Vec<(u32, Result<T, Error>)> = Vec::with_capacity(variants.len());
    run_trials(&numbered, workers, run_one, &mut |result| {
        results.push(result);
        let share = results.len() as f64 / variants.len() as f64;
        watched.report(Progress::Stage { what: "checking variants", share });
        Ok(())
    })?;
    results.sort_by_key(|(k, _)| *k);
    let found: Vec<T> = results.into_iter().map(|(_, result)| result).collect::<Result<_, _>>()?;
    if found.len() < variants.len() { Err(Error::Interrupted) } else { Ok(found) }
}

/// Checks that the requested metrics exist: it is better to know before all runs than after them.
fn check_metrics(
    sweep: &Sweep,
    source: &Source,
    compiled: &dyn CompiledScenario,
) -> Result<(), InputError> {
    let of_until = sweep.until.iter().flat_map(|until| &until.metrics);
    let aims = sweep.better.iter().map(|aim| &aim.metric);
    let mut wanted = sweep.metrics.iter().chain(of_until).chain(aims).peekable();
    let series = sweep.series.as_deref().unwrap_or_default();
    if wanted.peek().is_none() && series.is_empty() {
        return Ok(());
    }
    let mut simulation = compiled.start(source, 1);
    check_series(series, simulation.as_mut(), &sweep.place)?;
    // Some metrics appear only after the first cycle.
    simulation.advance(1);
    let known = metric_names(simulation.as_ref());
    let Some(unknown) = wanted.find(|name| !known.contains(name)) else { return Ok(()) };
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    let cause = format!("`{unknown}` is no metric of the world `{}`", compiled.world());
    Err(InputError::new(&sweep.place, cause, suggestion(unknown, &known)))
}

/// Checks that the metrics exist that are to be kept over time.
fn check_series(
    wanted: &[String],
    simulation: &mut dyn Simulation,
    place: &str,
) -> Result<(), InputError> {
    simulation.start_series(SeriesInterval::with_rows(1, 1));
    let columns = simulation.series_columns();
    let known: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    let unknown = wanted.iter().find(|name| !known.contains(&name.as_str()));
    let Some(unknown) = unknown else { return Ok(()) };
    let world = simulation.world_name();
    let cause = format!("`{unknown}` is no metric that runs of the world `{world}` keep over time");
    Err(InputError::new(place, cause, suggestion(unknown, &known)))
}
