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
        let mut results = Vec::new();
        for method in self.methods {
            let overrides = [setting("airspace.method", method.name()).to_override()];
            let source = self.source.clone().with_overrides(&overrides)?;
            let runs =
                MethodRuns { source: &source, workers: self.workers, interrupt: &self.interrupt };
            let (effect, metrics) =
                runs.run_seeds(self.seeds, |share| progress(method.name(), share))?;
            let bare = match bare_source(&source) {
                Some(bare) => {
                    let runs = MethodRuns { source: &bare, ..runs };
                    let name = format!("{} without the shield", method.name());
                    Some(runs.run_seeds(self.seeds, |share| progress(&name, share))?)
                }
                None => None,
            };
            let mut result = method_result(method.name(), effect, &metrics);
            result.is_shielded = CompiledAirspace::new(&source)?.world.shield;
            result.bare = bare.map(|(effect, bare)| bare_result(effect, &metrics, &bare));
            results.push(result);
        }
        Ok(results)
    }
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

fn method_result(method: &'static str, seeds: SeedEffect, all: &[Metrics]) -> MethodResult {
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
        shield_overrides: mean(all, |m| Some(m.shield_overrides as f64)),
        is_shielded: false,
        bare: None,
    }
}

/// Returns the results of runs without the shield beside those with it.
fn bare_result(seeds: SeedEffect, shielded: &[Metrics], bare: &[Metrics]) -> BareResult {
    // Where seeds change nothing on one side, its one run stands for all.
    let of_seed = |all: &[Metrics], k: usize| all.get(k).or(all.first())?.mean_delay_percent;
    let prices = (0..shielded.len().max(bare.len()))
        .map(|k| Some(of_seed(shielded, k)? - of_seed(bare, k)?));
    BareResult {
        runs: bare.len(),
        seeds,
        loss_free: bare.iter().filter(|m| m.losses_of_separation == 0).count(),
        losses: mean(bare, |m| Some(m.losses_of_separation as f64)),
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
    if !results.iter().any(|result| result.is_shielded) {
        columns.retain(|(head, _)| *head != "changed by the shield");
    }
    case_results::table(title, table_note(results), results, &columns)
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
