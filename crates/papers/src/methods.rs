//! Methods of collision avoidance, compared on the same traffic.

use crate::cells;
use crate::study::{Progress, all_of, setting};
use serde::Serialize;
use sidestep::experiment::sweep::Setting;
use sidestep::kernel::{InputError, Simulation};
use sidestep::scenario::Source;
use sidestep::statistics::{Interval, wilson};
use sidestep::worlds::airspace::airspace_run;
use sidestep::worlds::airspace::metrics::Metrics;
use sidestep::worlds::airspace::world::Method;
use sidestep_document::{Estimate, Table};

/// Results of a method over all runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MethodResult {
    /// Its name.
    pub method: &'static str,
    /// Runs; run `k` of every method has the same traffic.
    pub runs: usize,
    /// Runs without any loss of separation, and the 95 % interval of their share (Wilson).
    pub loss_free: usize,
    /// See `loss_free`.
    pub loss_free_interval: Interval,
    /// Losses of separation per run.
    pub losses: Estimate,
    /// Closest approach over all runs, meters.
    pub min_separation_m: Option<f64>,
    /// Share of the airplanes that arrived.
    pub arrived: Estimate,
    /// Mean delay, percent.
    pub delay_percent: Estimate,
    /// Time spent deciding per run, seconds.
    pub optimise_cpu_s: Estimate,
    /// Messages per run.
    pub messages: Estimate,
    /// Bytes per run.
    pub bytes: Estimate,
    /// Decisions that the shield changed, per run.
    pub shield_overrides: Estimate,
}

/// Runs `source` with each method and `runs` seeds, starting at its own, until all airplanes have
/// arrived or its cycles are over.
///
/// # Errors
/// When the scenario is wrong.
pub fn compare(
    source: &Source,
    methods: &[Method],
    (seed, runs): (u64, usize),
    workers: usize,
    progress: &mut Progress<'_>,
) -> Result<Vec<MethodResult>, InputError> {
    let mut results = Vec::new();
    for method in methods {
        let seeds: Vec<u64> = (seed..seed + runs as u64).collect();
        let run = |seed: &u64| {
            let settings =
                [setting("airspace.method", method.name()), setting("seed", *seed as i64)];
            flown(&source.clone().with(&settings.map(|s| Setting::to_override(&s)))?)
        };
        let report = |share| progress(method.name(), share);
        results.push(result(method.name(), &all_of(&seeds, workers, report, run)?));
    }
    Ok(results)
}

/// Runs a scenario to its end.
fn flown(source: &Source) -> Result<Metrics, InputError> {
    let mut run = airspace_run(source, 1)?;
    let cycles = run.plan().cycles;
    while run.cycle() < cycles && !run.is_over() {
        run.advance(cycles - run.cycle());
    }
    Ok(run.metrics())
}

fn result(method: &'static str, all: &[Metrics]) -> MethodResult {
    let of = |value: fn(&Metrics) -> Option<f64>| Estimate::of(all.iter().map(value));
    let loss_free = all.iter().filter(|m| m.losses_of_separation == 0).count();
    MethodResult {
        method,
        runs: all.len(),
        loss_free,
        loss_free_interval: wilson(loss_free as f64, all.len() as f64),
        losses: of(|m| Some(m.losses_of_separation as f64)),
        min_separation_m: all.iter().filter_map(|m| m.min_separation_m).reduce(f64::min),
        arrived: of(|m| Some(m.arrived as f64 / m.airplanes.max(1) as f64)),
        delay_percent: of(|m| m.mean_delay_percent),
        optimise_cpu_s: of(|m| Some(m.optimise_cpu_s)),
        messages: of(|m| Some(m.messages as f64)),
        bytes: of(|m| Some(m.bytes as f64)),
        shield_overrides: of(|m| Some(m.shield_overrides as f64)),
    }
}

/// Returns a table of the results side by side.
pub fn table(title: &str, results: &[MethodResult]) -> Table {
    let note = "Means over runs with their 95 % intervals; every method flies the same traffic.";
    let loss_free = |r: &MethodResult| {
        let Interval { low, high } = r.loss_free_interval;
        format!("{}/{} [{low:.2}, {high:.2}]", r.loss_free, r.runs)
    };
    cells::table(
        title,
        note,
        results,
        &[
            ("method", &|r| r.method.to_string()),
            ("runs without loss", &|r| loss_free(r)),
            ("losses", &|r| r.losses.to_string()),
            ("nearest of all runs, m", &|r| {
                r.min_separation_m.map_or("-".into(), |d| format!("{d:.1}"))
            }),
            ("arrived", &|r| r.arrived.to_string()),
            ("delay, %", &|r| r.delay_percent.to_string()),
            ("deciding, s", &|r| r.optimise_cpu_s.to_string()),
            ("messages", &|r| r.messages.to_string()),
            ("bytes", &|r| r.bytes.to_string()),
            ("changed by the shield", &|r| r.shield_overrides.to_string()),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_fly_the_same_traffic_and_doing_nothing_is_no_method() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\nshield = \"off\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 4\n";
        let source = Source::new("four", text, "");
        let methods = [Method::Pc, Method::None];
        let found = compare(&source, &methods, (1, 3), 2, &mut |_, _| ()).expect("valid");
        assert_eq!((found[0].loss_free, found[1].loss_free), (3, 0));
        assert_eq!(found[0].arrived.mean, Some(1.0));
        let table = table("t", &found);
        let [pc, none] = &table.rows[..] else { panic!("two rows: {table:?}") };
        assert!(pc[0] == "pc" && pc[1].starts_with("3/3"), "{pc:?}");
        assert!(none[0] == "none" && none[1].starts_with("0/3"), "{none:?}");
    }
}
