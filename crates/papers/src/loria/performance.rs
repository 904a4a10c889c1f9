//! Parallel performance: 1 to W workers, recorded or not, over density and cost of decisions.
//!
//! Time is measured as the paper does: all cycles and the recording, without initialization, the
//! share of which is given separately. Runs of all worker counts take turns, so that other load on
//! the machine affects all alike. Arithmetic without any world takes its turn too, because its
//! speed-up is the most that the machine could give at that moment.

use super::floor::Floor;
use super::timing::{
    SEGMENTS, TimedRun, Workload, arithmetic, mean_cycle_ms, speed_ups, time_interleaved, time_s,
    times_of,
};
use super::{LoriaConfig, NewRecorder};
use crate::case_results::{figure, median, table};
use crate::study::Progress;
use serde::Serialize;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::RecordError;
use sidestep_document::{Estimate, Figure, Series, Table};
use std::sync::Arc;

/// Times of a load with a number of workers.
#[derive(Debug, Clone, Serialize)]
pub(super) struct LoadTiming {
    /// Index into [`PerformanceResults::loads`].
    pub(super) load: usize,
    /// Number of workers of the run.
    pub(super) workers: usize,
    /// Whether the run was recorded.
    pub(super) recorded: bool,
    /// Milliseconds per cycle.
    pub(super) cycle_ms: Estimate,
    /// Time with one worker divided by time with these, both recorded or both not.
    pub(super) speed_up: Estimate,
    /// Speed-up by repeat, for pairs with other loads.
    pub(super) ratios: Vec<Option<f64>>,
    /// Speed-up of plain arithmetic with as many workers, timed in turn with this.
    pub(super) machine: Estimate,
}

impl LoadTiming {
    /// Returns the speed-up divided by a number of workers or by another speed-up, for a table.
    fn speed_up_per(&self, divisor: f64) -> String {
        format!("{:.2}", self.speed_up.mean_or_zero() / divisor)
    }
}

/// The cost of a run before its first cycle.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct InitializationCost {
    /// Index into [`PerformanceResults::loads`].
    pub(super) load: usize,
    /// Seconds to read the scenario, compile the world and place all bodies.
    pub(super) seconds: f64,
    /// Share of the whole time of a run of [`REFERENCE_CYCLES`] with one worker, by repeat.
    pub(super) share_alone: Estimate,
    /// The same with the most workers.
    pub(super) share_together: Estimate,
}

/// Cycles of the run in which initialization is counted; the paper's number is lost.
pub(super) const REFERENCE_CYCLES: u64 = 1000;

/// Worker counts of which the digests are compared; more than the machine has processors is allowed.
const DIGEST_WORKERS: [usize; 6] = [1, 2, 3, 4, 8, 16];

#[derive(Debug, Clone, Serialize)]
pub(super) struct PerformanceResults {
    /// Processors that the run may use.
    pub(super) processors: usize,
    pub(super) loads: Vec<Workload>,
    /// By load, unrecorded before recorded, and then by number of workers.
    pub(super) timings: Vec<LoadTiming>,
    /// Initialization of each load.
    pub(super) initialization: Vec<InitializationCost>,
    /// Digest after the same cycles of the same run, by number of workers.
    pub(super) digests: Vec<(usize, String)>,
    /// Digest of the same run recorded.
    pub(super) recorded_digest: String,
}

/// Returns the loads of the experiment: sparse and dense, each at every cost of a decision.
pub(super) fn loads(plan: &LoriaConfig) -> Vec<Workload> {
    let floor = Arc::new(Floor::large());
    let mut loads = Vec::new();
    for &robots in &plan.robots {
        for &operations in &plan.operations {
            loads.push(Workload {
                robots,
                // Few people, because the paper's loads vary in robots.
                people: robots / 5,
                size: 2,
                operations,
                floor: Arc::clone(&floor),
            });
        }
    }
    loads
}

/// Returns worker counts from 1 to `max`: all up to 4, then larger and larger steps, because on a large machine timings of all
/// would take hours.
pub(super) fn worker_counts(max: usize) -> Vec<usize> {
    let mut counts: Vec<usize> = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64]
        .into_iter()
        .filter(|&count| count < max)
        .collect();
    counts.push(max.max(1));
    counts
}

impl PerformanceResults {
    /// Times every load and its initialization, and compares the digests.
    ///
    /// # Errors
    /// When a recording fails.
    pub(super) fn run(
        plan: &LoriaConfig,
        recorders: &mut NewRecorder<'_>,
        report: &mut Progress<'_>,
    ) -> Result<Self, RecordError> {
        let loads = loads(plan);
        let mut timings = Vec::new();
        let mut initialization = Vec::new();
        for (index, load) in loads.iter().enumerate() {
            report("parallel performance", index as f64 / loads.len() as f64);
            let times = time_load(plan, load, recorders)?;
            let of_load = timings.len()..;
            timings.extend(times.into_iter().map(|timing| LoadTiming { load: index, ..timing }));
            initialization.push(initialize(index, load, &timings[of_load], plan.repeats));
        }
        let (digests, recorded_digest) = digests(&loads[0], recorders)?;
        Ok(Self {
            processors: sidestep::kernel::workers::available_workers(),
            loads,
            timings,
            initialization,
            digests,
            recorded_digest,
        })
    }

    /// Returns whether every number of workers, recorded or not, gives one digest.
    pub(super) fn is_deterministic(&self) -> bool {
        self.digests.iter().all(|(_, digest)| *digest == self.recorded_digest)
    }

    /// Returns the greatest number of workers that was timed.
    pub(super) fn max_workers(&self) -> usize {
        self.timings.iter().map(|timing| timing.workers).max().unwrap_or(1)
    }

    pub(super) fn at_max_workers(&self, recorded: bool) -> impl Iterator<Item = &LoadTiming> {
        let most = self.max_workers();
        self.timings.iter().filter(move |t| t.workers == most && t.recorded == recorded)
    }

    /// Returns whether the machine itself gave less than this share of the workers' worth: then other
    /// processes were using it, and times mean little.
    pub(super) fn is_machine_busy(&self) -> bool {
        // Less than 1, because processors slow down somewhat when all of them work.
        const SHARE: f64 = 0.85;
        let min_speed_up = SHARE * self.max_workers() as f64;
        self.at_max_workers(false).any(|timing| timing.machine.mean_or_zero() < min_speed_up)
    }

    /// Returns the mean efficiency of all loads, unrecorded, with the most workers, by repeat.
    pub(super) fn efficiency(&self) -> Estimate {
        let workers = self.max_workers() as f64;
        let loads: Vec<&LoadTiming> = self.at_max_workers(false).collect();
        let repeats = loads.iter().map(|t| t.ratios.len()).min().unwrap_or(0);
        Estimate::from_factors((0..repeats).map(|repeat| {
            let speed_ups: Option<Vec<f64>> = loads.iter().map(|t| t.ratios[repeat]).collect();
            Some(sidestep::statistics::mean(&speed_ups?)? / workers)
        }))
    }

    /// Returns the speed-up of the costliest decisions minus that of the cheapest, same robots,
    /// unrecorded, with the most workers; one value per repeat and number of robots.
    pub(super) fn gain_by_cost(&self) -> Estimate {
        let least = self.loads.iter().map(|load| load.operations).min();
        let most = self.loads.iter().map(|load| load.operations).max();
        let mut cheap = Vec::new();
        let mut costly = Vec::new();
        // Loads are by number of robots, so that both lists have the same numbers in the same order.
        for timing in self.at_max_workers(false) {
            let operations = Some(self.loads[timing.load].operations);
            if operations == least {
                cheap.extend(timing.ratios.iter().copied());
            } else if operations == most {
                costly.extend(timing.ratios.iter().copied());
            }
        }
        Estimate::paired_difference(&costly, &cheap)
    }

    pub(super) fn tables(&self) -> Vec<Table> {
        vec![self.times_table(), self.initialization_table(), self.digest_table()]
    }

    fn times_table(&self) -> Table {
        let note = format!(
            "Mean [95 % interval] over repeats, each the best of {SEGMENTS} stretches that take \
             turns; {} processors. Time includes recording where it says so, and excludes \
             initialization. The machine's speed-up is that of mere arithmetic, timed in turn: \
             where it is well below the number of workers, others were using the machine. The \
             engine measures now and then whether all workers are faster than one, and keeps \
             to the faster.",
            self.processors
        );
        table(
            "Execution time, speed-up and efficiency",
            note,
            &self.timings,
            &[
                ("load", &|timing| self.loads[timing.load].name()),
                ("workers", &|timing| timing.workers.to_string()),
                ("recorded", &|timing| if timing.recorded { "yes" } else { "no" }.into()),
                ("ms per cycle", &|timing| timing.cycle_ms.to_string()),
                ("speed-up", &|timing| timing.speed_up.to_string()),
                ("efficiency", &|timing| timing.speed_up_per(timing.workers as f64)),
                ("the machine's speed-up", &|timing| timing.machine.to_string()),
                ("share of it", &|timing| {
                    timing.speed_up_per(timing.machine.mean_or_zero().max(f64::MIN_POSITIVE))
                }),
            ],
        )
    }

    fn initialization_table(&self) -> Table {
        let most = self.max_workers();
        let title = format!("Initialization, of a run of {REFERENCE_CYCLES} cycles");
        let together = format!("share, {most} workers");
        let note = "Median of seconds, mean of shares over repeats. Initialization is not parallel: \
                    the scenario is read, the world compiled, all bodies placed. Shares from the \
                    measured time per cycle, unrecorded.";
        table(
            title,
            note,
            &self.initialization,
            &[
                ("load", &|i| self.loads[i.load].name()),
                ("seconds", &|i| format!("{:.4}", i.seconds)),
                ("share, 1 worker", &|i| i.share_alone.to_string()),
                (&together, &|i| i.share_together.to_string()),
            ],
        )
    }

    fn digest_table(&self) -> Table {
        let note = "The same run, so many cycles, with more workers than processors too. Compare \
                    the digest with that of another machine.";
        let mut table = Table::new("The same bits", note, &["workers", "recorded", "digest"]);
        for (workers, digest) in &self.digests {
            table.push_row([workers.to_string(), "no".into(), digest.clone()]);
        }
        table.push_row(["2".into(), "yes".into(), self.recorded_digest.clone()]);
        table
    }

    /// Returns the figures of this experiment: speed-up and time over workers.
    pub(super) fn figures(&self) -> Vec<Figure> {
        vec![
            self.figure("Speed-up", "time of 1 worker / time", false, |t| &t.speed_up),
            self.figure("Speed-up, recorded", "time of 1 worker / time", true, |t| &t.speed_up),
            self.figure("Execution time", "ms per cycle", false, |t| &t.cycle_ms),
        ]
    }

    fn figure(
        &self,
        title: &str,
        y_label: &str,
        recorded: bool,
        quantity: fn(&LoadTiming) -> &Estimate,
    ) -> Figure {
        let mut lines = Vec::new();
        for (index, load) in self.loads.iter().enumerate() {
            let timings = self.timings.iter().filter(|t| t.load == index && t.recorded == recorded);
            let points = timings.filter_map(|t| quantity(t).point(t.workers as f64)).collect();
            lines.push(Series { name: load.name(), points });
        }
        figure(title, ["workers", y_label], lines)
    }
}

/// A participant of the timings, which take turns.
enum TimedCandidate {
    /// A run with a number of workers, recorded or not.
    Run(Box<TimedRun>, usize, bool),
    /// Arithmetic with a number of workers.
    Arithmetic(usize),
}

impl TimedCandidate {
    fn is_run(&self, workers: usize, recorded: bool) -> bool {
        matches!(self, Self::Run(_, own, is_recorded) if (*own, *is_recorded) == (workers, recorded))
    }

    fn is_arithmetic(&self, workers: usize) -> bool {
        matches!(self, Self::Arithmetic(own) if *own == workers)
    }
}

/// Returns all candidates of a load: unrecorded, recorded, and arithmetic, each with every number
/// of workers; each has been run once.
fn timed_candidates(
    plan: &LoriaConfig,
    load: &Workload,
    recorders: &mut NewRecorder<'_>,
) -> Result<Vec<TimedCandidate>, RecordError> {
    let counts = worker_counts(plan.most_workers);
    let mut all = Vec::new();
    for &workers in &counts {
        let mut plain = TimedRun::new(load, workers);
        let mut recorded = TimedRun::recorded(load, workers, recorders)?;
        for run in [&mut plain, &mut recorded] {
            run.run(load.cycles(plan.timed_robot_cycles))?;
        }
        all.push(TimedCandidate::Run(Box::new(plain), workers, false));
        all.push(TimedCandidate::Run(Box::new(recorded), workers, true));
    }
    all.extend(counts.into_iter().map(TimedCandidate::Arithmetic));
    Ok(all)
}

/// Times one load, unrecorded and recorded, with every number of workers.
fn time_load(
    plan: &LoriaConfig,
    load: &Workload,
    recorders: &mut NewRecorder<'_>,
) -> Result<Vec<LoadTiming>, RecordError> {
    let cycles = load.cycles(plan.timed_robot_cycles);
    let mut all = timed_candidates(plan, load, recorders)?;
    let times_s = time_interleaved(&mut all, plan.repeats, |candidate| match candidate {
        TimedCandidate::Run(run, ..) => run.run(cycles),
        TimedCandidate::Arithmetic(workers) => Ok(arithmetic(*workers, plan.timed_robot_cycles)),
    })?;
    let mut timings = Vec::new();
    for (candidate, own_s) in all.iter().zip(&times_s) {
        let &TimedCandidate::Run(_, workers, recorded) = candidate else { continue };
        let alone_s = times_of(&all, &times_s, |other| other.is_run(1, recorded));
        let ratios = speed_ups(alone_s, own_s);
        let machine_alone_s = times_of(&all, &times_s, |other| other.is_arithmetic(1));
        let machine_s = times_of(&all, &times_s, |other| other.is_arithmetic(workers));
        timings.push(LoadTiming {
            load: 0,
            workers,
            recorded,
            cycle_ms: mean_cycle_ms(own_s, cycles),
            speed_up: Estimate::from_factors(ratios.iter().copied()),
            ratios,
            machine: Estimate::geometric_ratio(machine_alone_s, machine_s),
        });
    }
    timings.sort_by_key(|timing| (timing.recorded, timing.workers));
    for candidate in all {
        if let TimedCandidate::Run(run, ..) = candidate {
            run.finish()?;
        }
    }
    Ok(timings)
}

fn initialize(
    index: usize,
    load: &Workload,
    timings: &[LoadTiming],
    repeats: usize,
) -> InitializationCost {
    let times_s: Vec<f64> = (0..repeats).map(|_| time_s(|| load.simulation(1)).0).collect();
    // Timings are by number of workers: the first is that of one, the last that of the most.
    let mut unrecorded = timings.iter().filter(|t| !t.recorded);
    let alone = unrecorded.clone().next();
    let together = unrecorded.next_back();
    InitializationCost {
        load: index,
        seconds: median(times_s.iter().copied()),
        share_alone: initialization_share(&times_s, alone),
        share_together: initialization_share(&times_s, together),
    }
}

/// Returns the share that initialization has of a whole run of [`REFERENCE_CYCLES`], over repeats.
fn initialization_share(times_s: &[f64], timing: Option<&LoadTiming>) -> Estimate {
    let cycle_s = timing.map_or(0.0, |t| t.cycle_ms.mean_or_zero()) * 1e-3;
    let shares = times_s.iter().map(|s| Some(s / (s + cycle_s * REFERENCE_CYCLES as f64)));
    Estimate::from_values(shares)
}

/// Returns the digests of one run by number of workers, and of the recorded run.
fn digests(
    load: &Workload,
    recorders: &mut NewRecorder<'_>,
) -> Result<(Vec<(usize, String)>, String), RecordError> {
    // Bodies meet often enough in so many cycles that a wrong order would show in the digest.
    const CYCLES: u64 = 100;
    let mut digests = Vec::new();
    for workers in DIGEST_WORKERS {
        let mut run = load.simulation(workers);
        run.advance(CYCLES);
        digests.push((workers, run.digest().to_string()));
    }
    let mut run = TimedRun::recorded(load, 2, recorders)?;
    run.run(CYCLES)?;
    let recorded = run.simulation().digest().to_string();
    run.finish()?;
    Ok((digests, recorded))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worker_counts_begin_with_one_and_end_with_the_most() {
        assert_eq!(worker_counts(1), [1]);
        assert_eq!(worker_counts(2), [1, 2]);
        assert_eq!(worker_counts(5), [1, 2, 3, 4, 5]);
        assert_eq!(worker_counts(16), [1, 2, 3, 4, 6, 8, 12, 16]);
    }
}
