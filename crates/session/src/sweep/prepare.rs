//! Every variant of a sweep, compiled once, so that errors in any of them are reported before any
//! runs.

use crate::scenario::{read_scenario, read_source};
use crate::watcher::{Progress, ProgressGuard};
use crate::{Error, Watcher};
use sidestep_experiment::sweep::scheduler::run_trials;
use sidestep_experiment::sweep::trial::metric_names;
use sidestep_experiment::sweep::{BaseScenario, Plan, Setting, Sweep, Variant};
use sidestep_kernel::InputError;
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
    let fixed: Vec<String> = sweep.fixed.iter().map(Setting::to_override).collect();
    let base = base_source(worlds, sweep, &fixed)?;
    let mut variants = sweep.design.variants(&sweep.place)?;
    Plan::check_size(variants.len(), sweep.replicates, &sweep.place)?;
    let checked = |wanted: &Variant| {
        compile_variant(worlds, &base, wanted).map_err(|e| {
            let plain = match sweep.given {
                Some(_) => worlds.compile(&base).err(),
                None => read_scenario(worlds, &sweep.scenario, &fixed).err(),
            };
            variant_error(wanted, &base, plain, e)
        })
    };
    let (source, first) = checked(&variants[0])?;
    check_metrics(sweep, &source, first.as_ref())?;
    let one = |k: u32, wanted: &Variant| -> Result<CompiledVariant<T>, Error> {
        let (source, compiled) = checked(wanted)?;
        let (seeds, agents) = (compiled.seed_effect(), compiled.body_count() as u64);
        Ok(CompiledVariant { seeds, agents, made: make(k, &source, compiled.as_ref())? })
    };
    let all = for_each_variant(&variants, workers, watcher, &one)?;
    let agents = all.iter().map(|one| one.agents).max().unwrap_or(0);
    let mut made = Vec::with_capacity(all.len());
    for (variant, one) in variants.iter_mut().zip(all) {
        variant.seeds = one.seeds;
        made.push(one.made);
    }
    let plain = first.plan();
    let base = BaseScenario { world: first.world(), seed: plain.seed, source: &base };
    let plan = Plan::new(sweep, variants, base)?;
    // A sweep without a name of its own has that of its scenario.
    let name = if plan.name.is_empty() { plain.name } else { plan.name };
    Ok((Plan { agents, name, ..plan }, made))
}

/// The findings of compiling a variant, and the thing made of it.
struct CompiledVariant<T> {
    seeds: SeedEffect,
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
    let run = |(k, variant): &(u32, &Variant)| {
        let is_wanted = watcher.should_continue() && *k < wrong_at.load(Ordering::Relaxed);
        is_wanted.then(|| {
            let result = work(*k, variant);
            if result.is_err() {
                wrong_at.fetch_min(*k, Ordering::Relaxed);
            }
            Ok::<_, Error>((*k, result))
        })
    };
    let watched = ProgressGuard(watcher);
    let mut results: Vec<(u32, Result<T, Error>)> = Vec::with_capacity(variants.len());
    run_trials(&numbered, workers, run, &mut |result| {
        results.push(result);
        let share = results.len() as f64 / variants.len() as f64;
        watched.report(Progress::Stage { what: "checking variants", share });
        Ok(())
    })?;
    results.sort_by_key(|(k, _)| *k);
    let found: Vec<T> = results.into_iter().map(|(_, result)| result).collect::<Result<_, _>>()?;
    if found.len() < variants.len() { Err(Error::Interrupted) } else { Ok(found) }
}

/// Returns the scenario with the settings that all variants share.
fn base_source(worlds: &Worlds, sweep: &Sweep, fixed: &[String]) -> Result<Source, InputError> {
    match &sweep.given {
        Some(source) => source.clone().with_overrides(fixed),
        None => read_source(worlds, &sweep.scenario, fixed),
    }
}

/// Checks that the requested metrics exist: it is better to know before all runs than after them.
fn check_metrics(
    sweep: &Sweep,
    source: &Source,
    compiled: &dyn CompiledScenario,
) -> Result<(), InputError> {
    let of_until = sweep.until.iter().flat_map(|until| &until.metrics);
    let mut wanted = sweep.metrics.iter().chain(of_until).peekable();
    if wanted.peek().is_none() {
        return Ok(());
    }
    let mut simulation = compiled.start(source, 1);
    // Some metrics appear only after something has happened.
    simulation.advance(1);
    let known = metric_names(simulation.as_ref());
    let Some(unknown) = wanted.find(|name| !known.contains(name)) else { return Ok(()) };
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    let cause = format!("`{unknown}` is no metric of the world `{}`", compiled.world());
    Err(InputError::new(&sweep.place, cause, suggestion(unknown, &known)))
}

/// Returns a variant's scenario.
fn compile_variant(
    worlds: &Worlds,
    base: &Source,
    wanted: &Variant,
) -> Result<(Source, Box<dyn CompiledScenario>), InputError> {
    let overrides: Vec<String> = wanted.settings.iter().map(Setting::to_override).collect();
    let source = base.clone().with_overrides(&overrides)?;
    let compiled = worlds.compile(&source)?;
    Ok((source, compiled))
}

/// Returns the error of a variant, which names the variant unless all have it: users do not see the
/// lines of the text that its settings have edited.
fn variant_error(
    wanted: &Variant,
    base: &Source,
    plain: Option<InputError>,
    e: InputError,
) -> InputError {
    match plain.filter(|plain| plain.cause() == e.cause()) {
        Some(plain) => plain,
        None if !e.place().starts_with(base.file_place()) => e,
        None => {
            let place = format!("{}, where {wanted}", base.file_place());
            InputError::new(place, e.cause(), e.remedy())
        }
    }
}
