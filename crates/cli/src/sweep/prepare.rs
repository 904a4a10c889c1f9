//! Every variant of a sweep, compiled once: what is wrong in any of them is told before any runs.

use crate::exit::Failure;
use crate::plan::source_of;
use crate::progress::Stages;
use sidestep::experiment::sweep::cell::metric_names;
use sidestep::experiment::sweep::{Plan, Setting, Sweep, Variant};
use sidestep::kernel::InputError;
use sidestep::scenario::{Compiled, Source, nearest};
use sidestep::worlds::WORLDS;

/// Compiles every variant, hands it to `each` with its number, and makes the plan.
///
/// # Errors
/// When the design or a variant is wrong, or `each` fails.
pub(super) fn prepare(
    sweep: &Sweep,
    stages: &Stages,
    mut each: impl FnMut(u32, &Source, &dyn Compiled) -> Result<(), Failure>,
) -> Result<Plan, Failure> {
    let fixed: Vec<String> = sweep.fixed.iter().map(Setting::to_override).collect();
    let base = source_of(&sweep.scenario, &fixed)?;
    let variants = sweep.design.variants(&sweep.place)?;
    Plan::check_size(variants.len(), sweep.replicates, &sweep.place)?;
    let (mut agents, mut first) = (0, None);
    let count = variants.len();
    for (k, settings) in (0u32..).zip(&variants) {
        stages.at("checking variants", f64::from(k) / count as f64);
        let (source, compiled) = variant(&base, settings)?;
        agents = agents.max(compiled.bodies() as u64);
        if first.is_none() {
            first = Some((compiled.world(), compiled.plan().seed));
            check_metrics(sweep, &source, compiled.as_ref())?;
        }
        each(k, &source, compiled.as_ref())?;
    }
    let first = first.expect("a design has at least one variant");
    Ok(Plan { agents, ..Plan::new(sweep, variants, first)? })
}

/// The metrics that are named must be there: better told now than after all runs.
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
    // Some metrics are there only once something has happened.
    simulation.advance(1);
    let known = metric_names(simulation.as_ref());
    let Some(unknown) = wanted.find(|name| !known.contains(name)) else { return Ok(()) };
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    let cause = format!("`{unknown}` is no metric of the world `{}`", compiled.world());
    Err(InputError::new(&sweep.place, cause, nearest(unknown, &known)))
}

/// A variant's scenario; an error says which variant it is.
fn variant(base: &Source, settings: &[Setting]) -> Result<(Source, Box<dyn Compiled>), InputError> {
    let overrides: Vec<String> = settings.iter().map(Setting::to_override).collect();
    let compiled = base.clone().with(&overrides).and_then(|source| {
        let compiled = WORLDS.compile(&source)?;
        Ok((source, compiled))
    });
    compiled.map_err(|e| {
        if settings.is_empty() {
            return e;
        }
        let variant = Variant { settings: settings.to_vec() };
        let place = format!("{}, where {variant}", e.place());
        let error = InputError::new(place, e.cause(), e.remedy());
        e.position().map_or(error.clone(), |(line, column)| error.at(line, column))
    })
}
