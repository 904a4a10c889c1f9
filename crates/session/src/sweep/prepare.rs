//! Every variant of a sweep, compiled once, so that errors in any of them are reported before any
//! runs.

use crate::scenario::{read, source_of};
use crate::watcher::{Progress, Watched};
use crate::{Error, Watcher};
use sidestep::experiment::sweep::cell::metric_names;
use sidestep::experiment::sweep::{Base, Plan, Setting, Sweep, Variant};
use sidestep::kernel::InputError;
use sidestep::scenario::{Compiled, Source, Worlds, nearest};

/// Compiles every variant, passes it to `each` with its number, and makes the plan.
///
/// # Errors
/// When the design or a variant is wrong, `each` fails, or the watcher asks to stop.
pub(super) fn prepare(
    worlds: Worlds,
    sweep: &Sweep,
    watcher: &dyn Watcher,
    mut each: impl FnMut(u32, &Source, &dyn Compiled) -> Result<(), Error>,
) -> Result<Plan, Error> {
    let fixed: Vec<String> = sweep.fixed.iter().map(Setting::to_override).collect();
    let base = base(worlds, sweep, &fixed)?;
    let mut variants = sweep.design.variants(&sweep.place)?;
    Plan::check_size(variants.len(), sweep.replicates, &sweep.place)?;
    let (mut agents, mut first) = (0, None);
    let (count, watched) = (variants.len(), Watched(watcher));
    for (k, wanted) in (0u32..).zip(&mut variants) {
        if !watcher.go_on() {
            return Err(Error::Interrupted);
        }
        let share = f64::from(k) / count as f64;
        watched.at(Progress::Stage { what: "checking variants", share });
        let (source, compiled) = variant(worlds, &base, wanted).map_err(|e| {
            let plain = match sweep.given {
                Some(_) => worlds.compile(&base).err(),
                None => read(worlds, &sweep.scenario, &fixed).err(),
            };
            of_variant(wanted, &base, plain, e)
        })?;
        wanted.seeds = compiled.seeds();
        agents = agents.max(compiled.bodies() as u64);
        if first.is_none() {
            first = Some((compiled.world(), compiled.plan().clone()));
            check_metrics(sweep, &source, compiled.as_ref())?;
        }
        each(k, &source, compiled.as_ref())?;
    }
    let (world, of_scenario) = first.expect("a design has at least one variant");
    let base = Base { world, seed: of_scenario.seed, source: &base };
    let plan = Plan::new(sweep, variants, base)?;
    // A sweep without a name of its own goes by that of its scenario.
    let name = if plan.name.is_empty() { of_scenario.name } else { plan.name };
    Ok(Plan { agents, name, ..plan })
}

/// Returns the scenario with what all variants share.
fn base(worlds: Worlds, sweep: &Sweep, fixed: &[String]) -> Result<Source, InputError> {
    match &sweep.given {
        Some(source) => source.clone().with(fixed),
        None => source_of(worlds, &sweep.scenario, fixed),
    }
}

/// Checks that the requested metrics exist: it is better to know before all runs than after them.
fn check_metrics(
    sweep: &Sweep,
    source: &Source,
    compiled: &dyn Compiled,
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
    Err(InputError::new(&sweep.place, cause, nearest(unknown, &known)))
}

/// Returns a variant's scenario.
fn variant(
    worlds: Worlds,
    base: &Source,
    wanted: &Variant,
) -> Result<(Source, Box<dyn Compiled>), InputError> {
    let overrides: Vec<String> = wanted.settings.iter().map(Setting::to_override).collect();
    let source = base.clone().with(&overrides)?;
    let compiled = worlds.compile(&source)?;
    Ok((source, compiled))
}

/// Returns the error of a variant, which names the variant unless all have it: the lines of the text
/// that its settings have edited are nobody's.
fn of_variant(
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
