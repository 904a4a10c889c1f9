//! Methods of collision avoidance, compared on the same traffic.

use crate::case_results::{self, TextColumn};
use crate::study::{Progress, run_all, setting};
use serde::Serialize;
use sidestep::experiment::sweep::plan::check_seeds;
use sidestep::experiment::sweep::seeds::seed_remedy;
use sidestep::kernel::{Digest, InputError, Interrupt, Simulation};
use sidestep::scenario::{SeedEffect, Source};
use sidestep::statistics::{Interval, is_tied, wilson};
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::airspace_run;
use sidestep::worlds::airspace::metrics::Metrics;
use sidestep::worlds::airspace::scenario::CompiledAirspace;
use sidestep::worlds::airspace::settings::BuiltInMethod;
use sidestep_document::estimate::format_short;
use sidestep_document::{Estimate, Table};

/// Results of a method over all runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MethodResult {
    /// Name of the method in scenarios.
    pub method: &'static str,
    /// Runs; run `k` of every method has the same traffic.
    pub runs: usize,
    /// The effect of another seed; where it changes nothing, there is one run.
    pub seeds: SeedEffect,
    /// Runs without any loss of separation, and the 95 % interval of their share (Wilson).
    pub loss_free: usize,
    /// See `loss_free`; absent where seeds change nothing.
    pub loss_free_interval: Option<Interval>,
    /// Losses of separation per run.
    pub losses: Estimate,
    /// Closest approach over all runs, meters.
    pub min_separation_m: Option<f64>,
    /// Share of the airplanes that arrived.
    pub arrived: Estimate,
    /// Mean time beyond that of the flight alone, in percent of it.
    pub delay_percent: Estimate,
    /// Time spent deciding per run, seconds.
    pub optimize_cpu_s: Estimate,
    /// Messages per run.
    pub messages: Estimate,
    /// Bytes per run.
    pub bytes: Estimate,
    /// Conflicts per run; no value where the scenario does not measure pairs.
    pub conflicts: Estimate,
    /// Fraction of the conflicts of a run in which separation was not lost (IPR), 0 to 1.
    pub intrusion_prevention_rate: Estimate,
    /// Domino effect parameter (DEP): conflicts over those of the same traffic without any resolution, less 1. No value
    /// where that traffic has no conflict, or cannot be flown.
    pub domino_effect: Estimate,
    /// Mean path over the ground beyond that of the flight alone, in percent of it.
    pub extra_distance_percent: Estimate,
    /// Maneuvers in an hour of flight.
    pub maneuvers_per_flight_hour: Estimate,
    /// Decisions that the shield changed, per run.
    pub shield_overrides: Estimate,
    /// Whether the shield flew with the method.
    pub is_shielded: bool,
    /// The same traffic without the shield; absent where the scenario has none, or is not valid without it.
    pub bare: Option<BareResult>,
}

/// Results of a method without the shield, beside those with it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BareResult {
    /// Runs without the shield.
    pub runs: usize,
    /// The effect of another seed on them, which may differ from that with the shield.
    pub seeds: SeedEffect,
    /// Runs without any loss of separation.
    pub loss_free: usize,
    /// Losses of separation per run.
    pub losses: Estimate,
    /// Domino effect parameter of the method alone, see [`MethodResult::domino_effect`].
    pub domino_effect: Estimate,
    /// Mean time beyond that of the flight alone, in percent of it.
    pub delay_percent: Estimate,
    /// The price of the shield: the mean over runs of the delay with it less that without it, in percent.
    pub price_percent: Estimate,
}

/// The runs of each method, by seeds that follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeedSpan {
    /// Seed of the first run; the others count up from it.
    pub first: u64,
    /// Number of runs of each method, at least 1.
    pub runs: usize,
}

/// Methods to compare on the traffic of one scenario.
#[derive(Debug)]
pub struct Comparison<'a> {
    /// The scenario, of the airspace world; its own method is not used.
    pub source: &'a Source,
    /// The methods, in the order of the results.
    pub methods: &'a [BuiltInMethod],
    /// The runs of each method.
    pub seeds: SeedSpan,
    /// Number of runs at the same time; only the time depends on it.
    pub workers: usize,
    /// Ends the comparison by unwinding when it is raised.
    pub interrupt: Interrupt,
}

impl Comparison<'_> {
    /// Runs the scenario with each method and each seed, until all airplanes have arrived or its cycles are over; once
    /// where no random number is drawn, and where two runs with different seeds end in the same state.
    ///
    /// # Errors
    /// When the scenario is wrong.
    pub fn run(&self, progress: &mut Progress<'_>) -> Result<Vec<MethodResult>, InputError> {
        check_seeds(self.seeds.first, self.seeds.runs as u64).map_err(|cause| {
            let remedy = "begin with a smaller seed, or run less often";
            InputError::new(self.source.file_place(), cause, remedy)
        })?;
        let unresolved = self.run_unresolved(progress)?;
        let mut results = Vec::new();
        for &method in self.methods {
            let source = self.source_of(method)?;
            let bare_source = bare_source(&source);
            let is_shielded = CompiledAirspace::new(&source)?.world.shield;
            // Nothing resolves these conflicts, so that the reference is of the same runs.
            let is_reference = |is_bare: bool| method == BuiltInMethod::None && is_bare;
            let reference = |is_bare: bool| unresolved.clone().filter(|_| is_reference(is_bare));
            let runs = match reference(!is_shielded) {
                Some(known) => known,
                None => self.run_seeds(&source, method.name(), progress)?,
            };
            let bare = match (&bare_source, reference(true)) {
                (Some(_), Some(known)) => Some(known),
                (Some(bare), None) => {
                    let name = format!("{} without the shield", method.name());
                    Some(self.run_seeds(bare, &name, progress)?)
                }
                (None, _) => None,
            };
            let unresolved = unresolved.as_ref().map_or(&[][..], |runs| &runs.metrics);
            let mut result = method_result(method.name(), &runs, unresolved);
            result.is_shielded = is_shielded;
            result.bare = bare.map(|bare| bare_result(&runs, &bare, unresolved));
            results.push(result);
        }
        Ok(results)
    }

    /// Returns the scenario with a method.
    fn source_of(&self, method: BuiltInMethod) -> Result<Source, InputError> {
        let overrides = [setting("airspace.method", method.name()).to_override()];
        self.source.clone().with_overrides(&overrides)
    }

    /// Runs the same traffic without any resolution, as the reference of the domino effect; `None` if that is not valid,
    /// or if the scenario does not measure pairs.
    fn run_unresolved(
        &self,
        progress: &mut Progress<'_>,
    ) -> Result<Option<SeededRuns>, InputError> {
        let source = self.source_of(BuiltInMethod::None)?;
        let Ok(compiled) = CompiledAirspace::new(&source) else { return Ok(None) };
        let bare = if compiled.world.shield { bare_source(&source) } else { Some(source) };
        let Some(bare) = bare.filter(|_| compiled.world.measures.pairs.is_some()) else {
            return Ok(None);
        };
        self.run_seeds(&bare, "the same traffic without resolution", progress).map(Some)
    }

    fn run_seeds(
        &self,
        source: &Source,
        name: &str,
        progress: &mut Progress<'_>,
    ) -> Result<SeededRuns, InputError> {
        let runs = MethodRuns { source, workers: self.workers, interrupt: &self.interrupt };
        let (seeds, metrics) = runs.run_seeds(self.seeds, |share| progress(name, share))?;
        Ok(SeededRuns { seeds, metrics })
    }
}

/// The runs of a scenario with several seeds, in their order.
#[derive(Debug, Clone)]
struct SeededRuns {
    /// The effect of another seed; where it changes nothing, there is one run.
    seeds: SeedEffect,
    metrics: Vec<Metrics>,
}

impl SeededRuns {
    /// Returns the metrics of a run; where seeds change nothing, its one run stands for all.
    fn of_seed(all: &[Metrics], k: usize) -> Option<&Metrics> {
        all.get(k).or(all.first())
    }
}

/// Returns the domino effect parameter of each run: how many conflicts it has beside each of the unresolved ones, less 1.
///
/// Krozel, Peters, Bilimoria, Lee and Mitchell, "System Performance Characteristics of Centralized and Decentralized Air
/// Traffic Separation Strategies" (2001): `DEP = S_on / S_off - 1`.
fn domino_effect(runs: &[Metrics], unresolved: &[Metrics]) -> Estimate {
    let effects = (0..runs.len().max(unresolved.len())).map(|k| {
        let conflicts = SeededRuns::of_seed(runs, k)?.conflicts?;
        let without = SeededRuns::of_seed(unresolved, k)?.conflicts.filter(|all| *all > 0)?;
        Some(conflicts as f64 / without as f64 - 1.0)
    });
    mean_of(effects)
}

/// Returns a scenario without its shield; `None` if it has none, or rules that need it.
fn bare_source(source: &Source) -> Option<Source> {
    if !CompiledAirspace::new(source).is_ok_and(|compiled| compiled.world.shield) {
        return None;
    }
    let overrides = [setting("airspace.shield", "off").to_override()];
    let bare = source.clone().with_overrides(&overrides).ok()?;
    CompiledAirspace::new(&bare).is_ok().then_some(bare)
}

/// The runs of a scenario with several seeds.
struct MethodRuns<'a> {
    source: &'a Source,
    workers: usize,
    interrupt: &'a Interrupt,
}

/// Number of runs that show whether seeds change anything, where the world does not know it: two final states that are equal
/// to the bit, though their seeds differ, do not come about by chance.
const PILOT_RUNS: usize = 2;

impl MethodRuns<'_> {
    /// Runs with as many seeds as are of use, and returns the effect of seeds.
    fn run_seeds(
        &self,
        SeedSpan { first, runs }: SeedSpan,
        mut report: impl FnMut(f64),
    ) -> Result<(SeedEffect, Vec<Metrics>), InputError> {
        let seeds: Vec<u64> = (first..first + runs as u64).collect();
        let first = match CompiledAirspace::new(self.source)?.seeds {
            SeedEffect::Nothing => {
                return Ok((SeedEffect::Nothing, metrics_of(&self.run_each(&seeds[..1], report)?)));
            }
            SeedEffect::Perhaps if runs > PILOT_RUNS => {
                self.run_each(&seeds[..PILOT_RUNS], &mut report)?
            }
            SeedEffect::Perhaps | SeedEffect::Decide => Vec::new(),
        };
        if let [(one, digest), (_, other)] = &first[..]
            && digest == other
        {
            return Ok((SeedEffect::Perhaps, vec![one.clone()]));
        }
        let rest = self.run_each(&seeds[first.len()..], report)?;
        Ok((SeedEffect::Decide, metrics_of(&[first, rest].concat())))
    }

    fn run_each(
        &self,
        seeds: &[u64],
        report: impl FnMut(f64),
    ) -> Result<Vec<(Metrics, Digest)>, InputError> {
        run_all(seeds, self.workers, report, |seed| {
            let source = self.source.clone().with_overrides(&[format!("seed={seed}")])?;
            run_to_end(&source, self.interrupt)
        })
    }
}

fn metrics_of(runs: &[(Metrics, Digest)]) -> Vec<Metrics> {
    runs.iter().map(|(metrics, _)| metrics.clone()).collect()
}

/// The digest is that of the state at the end of all cycles, or when all airplanes have arrived.
fn run_to_end(source: &Source, interrupt: &Interrupt) -> Result<(Metrics, Digest), InputError> {
    let mut run = airspace_run(source, 1)?;
    run.set_interrupt(interrupt.clone());
    let cycles = run.config().cycles;
    while run.cycle() < cycles && !run.is_over() {
        run.advance(cycles - run.cycle());
    }
    Ok((run.metrics(), run.digest()))
}

fn method_result(method: &'static str, runs: &SeededRuns, unresolved: &[Metrics]) -> MethodResult {
    let SeededRuns { seeds, metrics: all } = runs;
    let seeds = *seeds;
    let loss_free = all.iter().filter(|m| m.losses_of_separation == 0).count();
    // Where seeds change nothing there is one run, of which an interval would claim that it is a sample of others.
    let loss_free_interval =
        (seeds == SeedEffect::Decide).then(|| wilson(loss_free as f64, all.len() as f64));
    MethodResult {
        method,
        runs: all.len(),
        seeds,
        loss_free,
        loss_free_interval,
        losses: mean(all, |m| Some(m.losses_of_separation as f64)),
        min_separation_m: all.iter().filter_map(|m| m.min_separation_m).reduce(f64::min),
        arrived: mean(all, |m| Some(m.arrived as f64 / m.airplanes.max(1) as f64)),
        delay_percent: mean(all, |m| m.mean_delay_percent),
        optimize_cpu_s: mean(all, |m| Some(m.optimize_cpu_s)),
        messages: mean(all, |m| Some(m.messages as f64)),
        bytes: mean(all, |m| Some(m.bytes as f64)),
        conflicts: mean(all, |m| m.conflicts.map(|conflicts| conflicts as f64)),
        intrusion_prevention_rate: mean(all, |m| m.intrusion_prevention_rate),
        domino_effect: domino_effect(all, unresolved),
        extra_distance_percent: mean(all, |m| m.mean_extra_distance_percent),
        maneuvers_per_flight_hour: mean(all, |m| m.maneuvers_per_flight_hour),
        shield_overrides: mean(all, |m| Some(m.shield_overrides as f64)),
        is_shielded: false,
        bare: None,
    }
}

/// Returns the results of runs without the shield beside those with it.
fn bare_result(shielded: &SeededRuns, bare: &SeededRuns, unresolved: &[Metrics]) -> BareResult {
    let SeededRuns { seeds, metrics: bare } = bare;
    let delay = |all: &[Metrics], k: usize| SeededRuns::of_seed(all, k)?.mean_delay_percent;
    let prices = (0..shielded.metrics.len().max(bare.len()))
        .map(|k| Some(delay(&shielded.metrics, k)? - delay(bare, k)?));
    BareResult {
        runs: bare.len(),
        seeds: *seeds,
        loss_free: bare.iter().filter(|m| m.losses_of_separation == 0).count(),
        losses: mean(bare, |m| Some(m.losses_of_separation as f64)),
        domino_effect: domino_effect(bare, unresolved),
        delay_percent: mean(bare, |m| m.mean_delay_percent),
        price_percent: mean_of(prices),
    }
}

/// Returns the mean over all runs. Where they are equal it has no interval: one without width would claim that no other
/// run is different.
fn mean(all: &[Metrics], value: fn(&Metrics) -> Option<f64>) -> Estimate {
    mean_of(all.iter().map(value))
}

/// The same of values that are known already.
fn mean_of(values: impl Iterator<Item = Option<f64>>) -> Estimate {
    let all: Vec<Option<f64>> = values.collect();
    let mut estimate = Estimate::from_values(all.iter().copied());
    let values: Vec<f64> = all.into_iter().flatten().collect();
    if is_tied(&values) {
        estimate.interval = None;
    }
    estimate
}

/// Returns a table of the results side by side.
pub fn table(title: &str, results: &[MethodResult]) -> Table {
    let mut columns: Vec<TextColumn<'_, &MethodResult>> = vec![
        ("method", &|r| r.method.to_string()),
        ("runs without loss", &|r| format_loss_free(r)),
        ("bare: runs without loss", &|r| {
            format_bare(r, |bare| format!("{}/{}", bare.loss_free, bare.runs))
        }),
        ("losses", &|r| format_mean(r.seeds, &r.losses)),
        ("bare: losses", &|r| format_bare(r, |bare| format_mean(bare.seeds, &bare.losses))),
        ("conflicts", &|r| format_mean(r.seeds, &r.conflicts)),
        ("IPR", &|r| format_mean(r.seeds, &r.intrusion_prevention_rate)),
        ("DEP", &|r| format_mean(r.seeds, &r.domino_effect)),
        ("bare: DEP", &|r| format_bare(r, |bare| format_mean(bare.seeds, &bare.domino_effect))),
        ("delay, %", &|r| format_mean(r.seeds, &r.delay_percent)),
        ("bare: delay, %", &|r| {
            format_bare(r, |bare| format_mean(bare.seeds, &bare.delay_percent))
        }),
        ("by the shield, %", &|r| {
            format_bare(r, |bare| {
                // A difference depends on seeds if either side does.
                let seeds = if r.runs > 1 { r.seeds } else { bare.seeds };
                format_mean(seeds, &bare.price_percent)
            })
        }),
        ("extra distance, %", &|r| format_mean(r.seeds, &r.extra_distance_percent)),
        ("maneuvers per flight hour", &|r| format_mean(r.seeds, &r.maneuvers_per_flight_hour)),
        ("changed by the shield", &|r| format_mean(r.seeds, &r.shield_overrides)),
        ("nearest of all runs, m", &|r| {
            r.min_separation_m.map_or("-".into(), |d| format!("{d:.1}"))
        }),
        ("arrived", &|r| format_mean(r.seeds, &r.arrived)),
        ("deciding, s", &|r| format_mean(r.seeds, &r.optimize_cpu_s)),
        ("messages", &|r| format_mean(r.seeds, &r.messages)),
        ("bytes", &|r| format_mean(r.seeds, &r.bytes)),
    ];
    // Without a shield all runs are bare.
    if results.iter().all(|result| result.bare.is_none()) {
        columns.retain(|(head, _)| !head.starts_with("bare: ") && *head != "by the shield, %");
    }
    // Without measures of pairs there is no conflict to count, and without a reference no domino effect.
    if results.iter().all(|result| result.conflicts.n == 0) {
        columns.retain(|(head, _)| !["conflicts", "IPR"].contains(head));
    }
    if !has_domino_effect(results) {
        columns.retain(|(head, _)| !["DEP", "bare: DEP"].contains(head));
    }
    if !results.iter().any(|result| result.is_shielded) {
        columns.retain(|(head, _)| *head != "changed by the shield");
    }
    case_results::table(title, table_note(results), results, &columns)
}

fn has_domino_effect(results: &[MethodResult]) -> bool {
    results.iter().any(|result| result.domino_effect.n > 0)
}

/// Returns a result without the shield; a dash where there is none.
fn format_bare(result: &MethodResult, format: impl Fn(&BareResult) -> String) -> String {
    result.bare.as_ref().map_or_else(|| "-".into(), format)
}

fn format_loss_free(result: &MethodResult) -> String {
    let runs = format!("{}/{}", result.loss_free, result.runs);
    match result.loss_free_interval {
        Some(Interval { low, high }) => format!("{runs} [{low:.2}, {high:.2}]"),
        None => runs,
    }
}

/// Returns a mean over runs; the number alone where there is one.
fn format_mean(seeds: SeedEffect, estimate: &Estimate) -> String {
    match (seeds, estimate.mean) {
        (SeedEffect::Nothing | SeedEffect::Perhaps, Some(mean)) => format_short(mean),
        _ => estimate.to_string(),
    }
}

/// Returns the sentence without which the actions of the shield would pass for those of a method.
fn shield_note(results: &[MethodResult]) -> Option<String> {
    if results.iter().any(|result| result.is_shielded && result.bare.is_none()) {
        return Some(
            "The shield flew with every method, and is part of each result: with airspace.shield=off this scenario is not \
             valid, so that no method is flown alone."
                .into(),
        );
    }
    results.iter().any(|result| result.bare.is_some()).then(|| {
        "Columns with \"bare\" are of the same traffic without the shield, by the method alone; what the shield adds to the \
         delay is the mean difference, run by run."
            .into()
    })
}

/// Returns the names of the methods for which this holds, if there are any.
fn method_names(results: &[MethodResult], holds: impl Fn(&MethodResult) -> bool) -> Option<String> {
    let mut names = Vec::new();
    for result in results {
        if holds(result) {
            names.push(result.method);
        }
    }
    (!names.is_empty()).then(|| names.join(", "))
}

/// Returns the note that a reader must know about the runs.
fn table_note(results: &[MethodResult]) -> String {
    let mut sentences = vec!["Every method flies the same traffic.".to_string()];
    sentences.extend(shield_note(results));
    if has_domino_effect(results) {
        sentences.push(
            "IPR is the share of conflicts in which separation is kept. DEP (domino effect parameter) compares the \
             conflicts with those of the same traffic without any resolution: 0.5 is half as many again, and below 0 a \
             method prevents more than it causes."
                .into(),
        );
    }
    if results.iter().any(|result| result.seeds == SeedEffect::Decide) {
        sentences.push(
            "Means over runs, with their 95 % intervals; none where all runs are equal.".into(),
        );
    }
    if let Some(names) = method_names(results, |r| r.seeds == SeedEffect::Nothing) {
        sentences.push(format!(
            "Seeds change nothing with {names}: no random number is drawn. So there is one run, and \
             no interval."
        ));
    }
    if let Some(names) = method_names(results, |r| r.seeds == SeedEffect::Perhaps) {
        sentences.push(format!(
            "Seeds are taken to change nothing with {names}: two runs with different seeds ended in \
             the same state, to the bit. So there is no interval."
        ));
    }
    if results.iter().all(|result| result.seeds != SeedEffect::Decide) {
        sentences.extend(WORLDS.find("airspace").and_then(seed_remedy));
    }
    sentences.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare(source: &Source, methods: &[BuiltInMethod], runs: usize) -> Vec<MethodResult> {
        let seeds = SeedSpan { first: 1, runs };
        let interrupt = Interrupt::default();
        let comparison = Comparison { source, methods, seeds, workers: 2, interrupt };
        comparison.run(&mut |_, _| ()).expect("valid")
    }

    #[test]
    fn traffic_that_no_seed_changes_is_flown_once_and_has_no_interval() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\nshield = \"off\"\n\
                    [[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\n\
                    [[airplanes]]\nat_m = [9000, 500]\nheading_deg = 180\nway_points_m = [[0, 500]]\n";
        let source = Source::new("two", text, "");
        let results = compare(&source, &BuiltInMethod::ALL, 5);
        let table = table("t", &results);
        for (result, row) in results.iter().zip(&table.rows) {
            assert_eq!((result.runs, result.losses.n), (1, 1), "{}", result.method);
            assert!(result.loss_free_interval.is_none());
            let has_mark = |cell: &String| cell.contains("[") || cell.contains("n=");
            assert!(!row.iter().any(has_mark), "{row:?}");
        }
        assert!(table.note.contains("no random number is drawn"), "{}", table.note);
        assert!(table.note.contains("nothing with pc: two runs"), "{}", table.note);
        assert!(table.note.contains("airspace.position_noise_m"), "{}", table.note);
    }

    #[test]
    fn methods_fly_the_same_traffic_and_doing_nothing_is_no_method() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\nshield = \"off\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 4\n";
        let source = Source::new("four", text, "");
        let methods = [BuiltInMethod::Pc, BuiltInMethod::None];
        let results = compare(&source, &methods, 3);
        assert_eq!((results[0].loss_free, results[1].loss_free), (3, 0));
        assert_eq!(results[0].arrived.mean, Some(1.0));
        assert_eq!(results[0].arrived.interval, None, "three equal runs show no spread");
        let table = table("t", &results);
        let [pc, none] = &table.rows[..] else { panic!("two rows: {table:?}") };
        assert!(pc[0] == "pc" && pc[1].starts_with("3/3"), "{pc:?}");
        assert!(none[0] == "none" && none[1].starts_with("0/3"), "{none:?}");
        assert!(!table.note.contains("shield"), "{}", table.note);
    }

    #[test]
    fn the_domino_effect_is_that_beside_the_same_traffic_without_resolution() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\nshield = \"off\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 6\n";
        let source = Source::new("six", text, "");
        let methods = [BuiltInMethod::Mvp, BuiltInMethod::None];
        let results = compare(&source, &methods, 3);
        let [mvp, none] = &results[..] else { panic!("two methods: {results:?}") };
        assert_eq!(none.domino_effect.mean, Some(0.0), "it is its own reference");
        // All pairs of six meet, and none keeps its separation.
        assert_eq!(
            (none.conflicts.mean, none.intrusion_prevention_rate.mean),
            (Some(15.0), Some(0.0))
        );
        assert_eq!(mvp.intrusion_prevention_rate.mean, Some(1.0));
        let effects = (1..=3).map(|seed| {
            let conflicts = |method: &str| {
                let overrides = [format!("seed={seed}"), format!("airspace.method=\"{method}\"")];
                let source = source.clone().with_overrides(&overrides).expect("keys");
                let interrupt = Interrupt::default();
                run_to_end(&source, &interrupt).expect("valid").0.conflicts.expect("measured")
                    as f64
            };
            conflicts("mvp") / conflicts("none") - 1.0
        });
        let mean = effects.sum::<f64>() / 3.0;
        assert!(mvp.domino_effect.mean.is_some_and(|found| (found - mean).abs() < 1e-12), "{mean}");
        // The reference is flown for a method alone, too.
        let alone = compare(&source, &methods[..1], 3);
        assert_eq!(alone[0].domino_effect, mvp.domino_effect);
        assert!(table("t", &alone).columns.iter().any(|head| head == "DEP"));
    }

    #[test]
    fn without_measures_of_pairs_there_are_no_columns_of_conflicts() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\nshield = \"off\"\n\
                    measures = { pairs = \"off\" }\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 2\n";
        let results = compare(&Source::new("two", text, ""), &[BuiltInMethod::None], 1);
        let table = table("t", &results);
        for head in ["conflicts", "IPR", "DEP"] {
            assert!(!table.columns.iter().any(|column| column == head), "{head}");
        }
    }

    #[test]
    fn what_the_shield_did_is_not_taken_for_a_methods_own() {
        let text = "format = 1\nworld = \"airspace\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 4\n";
        let source = Source::new("four", text, "");
        let results = compare(&source, &[BuiltInMethod::None], 2);
        let bare = results[0].bare.as_ref().expect("a shield to do without");
        assert_eq!((results[0].loss_free, bare.loss_free, bare.runs), (2, 0, 2));
        assert_eq!(bare.delay_percent.mean, Some(0.0), "without it they fly straight on");
        assert_eq!(bare.price_percent.mean, results[0].delay_percent.mean);
        let table = table("t", &results);
        let cell = |head: &str| {
            let column = table.columns.iter().position(|h| h == head).expect("a column");
            table.rows[0][column].clone()
        };
        assert_eq!(cell("bare: runs without loss"), "0/2");
        assert!(table.note.contains("without the shield"), "{}", table.note);
    }
}
