//! Loads to time, and the timing of them.

use super::NewRecorder;
use super::floor::Floor;
use crate::study::{setting, source};
use serde::Serialize;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{Clock, RecordError, Recorder, SystemClock};
use sidestep::kernel::stream::Draws;
use sidestep::kernel::workers;
use sidestep::scenario::Source;
use sidestep::worlds::robots::RobotsRun;
use sidestep::worlds::robots::decide::{Behaviour, Decision, Memory, Percept, Wander};
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};
use sidestep_document::Estimate;
use std::hint::black_box;
use std::sync::Arc;

const SMALL: &str = include_str!("../../scenarios/loria/wander-small.toml");
const LARGE: &str = include_str!("../../scenarios/loria/wander-large.toml");

/// Number of operations that take about as long as a decision with its sensing.
const DECISION_OPERATIONS: u32 = 500;

/// Robots that wander on a floor among people and doors, at a given density and cost.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Workload {
    /// Number of robots, all of them with [`CostlyBehaviour`].
    pub(super) robots: u32,
    /// People, of 2 x 2 boxes.
    pub(super) people: u32,
    /// Robots cover `size` x `size` boxes.
    pub(super) size: u32,
    /// Multiply-and-adds that every decision costs beside its own work.
    pub(super) operations: u32,
    #[serde(skip)]
    pub(super) floor: Arc<Floor>,
}

impl Workload {
    /// Returns the share of the free boxes that robots and people cover.
    pub(super) fn density(&self) -> f64 {
        let free = self.floor.office.map.count(sidestep::map::Cell::Free).max(1);
        f64::from(self.robots * self.size * self.size + self.people * 4) / free as f64
    }

    /// Returns its name in tables.
    pub(super) fn name(&self) -> String {
        format!(
            "{} robots, {:.0} % covered, {} operations",
            self.robots,
            100.0 * self.density(),
            self.operations
        )
    }

    /// Returns the number of cycles that take about as long as `robot_cycles` decisions without
    /// extra cost.
    pub(super) fn cycles(&self, robot_cycles: u64) -> u64 {
        let bodies = u64::from(self.robots + self.people).max(1);
        (robot_cycles / (bodies * (1 + u64::from(self.operations / DECISION_OPERATIONS)))).max(10)
    }

    /// Its robots have the behavior `costly`, which [`Self::compiled`] adds.
    fn source(&self) -> Source {
        let costly = toml::Table::from_iter([("kind".to_string(), "costly".into())]);
        let settings = [
            setting("robots.count", self.robots),
            setting("robots.size", self.size),
            setting("robots.behaviour", costly),
            setting("people.count", self.people),
        ];
        let text = if self.floor.name == "small" { SMALL } else { LARGE };
        source(text, &settings).expect("the experiments' scenarios are valid")
    }

    /// Returns the compiled world.
    ///
    /// # Panics
    /// If the load does not fit its floor; the experiments' own do.
    pub(super) fn compiled(&self) -> Compiled {
        let costly = CostlyBehaviour { wander: Wander::default(), operations: self.operations };
        let behaviours = Behaviours::from([("costly".into(), Arc::new(costly) as _)]);
        Compiled::new(&self.source(), &behaviours, StorageOrder::Spatial)
            .expect("the experiments' scenarios are valid")
    }

    pub(super) fn simulation(&self, workers: usize) -> RobotsRun {
        self.compiled().start(&self.source(), workers)
    }
}

/// A behavior that thinks longer: it decides as `wander` does, after extra operations.
#[derive(Debug, Clone)]
struct CostlyBehaviour {
    wander: Wander,
    /// Dependent multiply-and-adds per decision.
    operations: u32,
}

impl Behaviour for CostlyBehaviour {
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        spend_time(percept.now, self.operations);
        self.wander.decide(percept, memory, draws)
    }
}

/// Does `operations` dependent multiply-and-adds, only to spend time: each needs the one before, so
/// that neither the compiler nor the processor does several at once. The numbers are those of
/// Knuth's generator MMIX; others would do as well.
fn spend_time(mut x: u64, operations: u32) {
    for _ in 0..operations {
        x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    }
    black_box(x);
}

/// Returns the seconds that `work` takes, and its result.
pub(super) fn time_s<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let clock = SystemClock::default();
    let result = work();
    (clock.now_ns() as f64 * 1e-9, result)
}

/// Number of segments of which the shortest counts as one repeat.
pub(super) const SEGMENTS: usize = 8;

/// Times candidates in turn. Each gets `repeats` values, and every value is the shortest of [`SEGMENTS`] short segments: the
/// time of the machine when nothing else disturbs it. Candidates take turns segment by segment, so that disturbances affect
/// all alike.
///
/// # Errors
/// The first error that `run` returns.
pub(super) fn time_interleaved<C, E>(
    candidates: &mut [C],
    repeats: usize,
    mut run: impl FnMut(&mut C) -> Result<f64, E>,
) -> Result<Vec<Vec<Option<f64>>>, E> {
    let mut times_s = vec![Vec::with_capacity(repeats); candidates.len()];
    for _ in 0..repeats {
        let mut best_s = vec![f64::INFINITY; candidates.len()];
        for _ in 0..SEGMENTS {
            for (best_s, candidate) in best_s.iter_mut().zip(&mut *candidates) {
                *best_s = best_s.min(run(candidate)?);
            }
        }
        for (all, best_s) in times_s.iter_mut().zip(best_s) {
            all.push(Some(best_s));
        }
    }
    Ok(times_s)
}

/// Returns the seconds that arithmetic without any world takes, shared among workers: the most that
/// the machine itself can give at the moment.
pub(super) fn arithmetic(workers: usize, robot_cycles: u64) -> f64 {
    let (took_s, ()) = time_s(|| {
        workers::run(&mut vec![(); workers], |worker, (): &mut ()| {
            worker.for_each_chunk(0, robot_cycles as usize, |tasks| {
                tasks.for_each(|task| spend_time(task as u64, DECISION_OPERATIONS));
            });
        });
    });
    took_s
}

/// Returns the times of the first candidate for which this holds; none if there is no such candidate.
pub(super) fn times_of<'a, C>(
    candidates: &[C],
    times_s: &'a [Vec<Option<f64>>],
    holds: impl Fn(&C) -> bool,
) -> &'a [Option<f64>] {
    let position = candidates.iter().position(holds);
    position.map_or(&[], |k| &times_s[k][..])
}

/// Returns the reference's time divided by the own, repeat by repeat.
pub(super) fn speed_ups(reference_s: &[Option<f64>], own_s: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut ratios = Vec::with_capacity(own_s.len());
    for (reference_s, own_s) in reference_s.iter().zip(own_s) {
        ratios.push(reference_s.zip(*own_s).map(|(reference_s, own_s)| reference_s / own_s));
    }
    ratios
}

/// Returns the mean time of a cycle, ms, from times of so many cycles.
pub(super) fn mean_cycle_ms(times_s: &[Option<f64>], cycles: u64) -> Estimate {
    Estimate::from_values(times_s.iter().map(|time_s| time_s.map(|s| 1e3 * s / cycles as f64)))
}

/// A run, with the destination of its rows if it is recorded.
pub(super) struct TimedRun {
    simulation: RobotsRun,
    recorder: Option<Box<dyn Recorder>>,
}

impl TimedRun {
    pub(super) fn new(load: &Workload, workers: usize) -> Self {
        Self { simulation: load.simulation(workers), recorder: None }
    }

    /// Returns a recorded run.
    ///
    /// # Errors
    /// When the recorder cannot be made.
    pub(super) fn recorded(
        load: &Workload,
        workers: usize,
        recorders: &mut NewRecorder<'_>,
    ) -> Result<Self, RecordError> {
        let mut simulation = load.simulation(workers);
        simulation.start_recording();
        let recorder = Some(recorders(&simulation.schemas())?);
        Ok(Self { simulation, recorder })
    }

    /// Runs `cycles` cycles, and returns the seconds they took, recording included.
    ///
    /// # Errors
    /// When rows cannot be stored.
    pub(super) fn run(&mut self, cycles: u64) -> Result<f64, RecordError> {
        let (took_s, result) = time_s(|| {
            let mut done = 0;
            while done < cycles {
                done += self.simulation.advance(cycles - done);
                if let Some(recorder) = &mut self.recorder {
                    self.simulation.record(&mut **recorder)?;
                }
            }
            Ok(())
        });
        result.map(|()| took_s)
    }

    /// For its digest after it was timed.
    pub(super) fn simulation(&self) -> &RobotsRun {
        &self.simulation
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// When the last rows cannot be stored.
    pub(super) fn finish(mut self) -> Result<(), RecordError> {
        self.recorder.as_mut().map_or(Ok(()), |recorder| recorder.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_repeat_is_the_best_of_its_stretches() {
        let mut n = [0.0, 0.0];
        let outcome: Result<_, ()> = time_interleaved(&mut [0, 1], 2, |&mut k| {
            n[k] += 1.0;
            Ok(100.0 - n[k])
        });
        let expected = vec![Some(92.0), Some(84.0)];
        assert_eq!(outcome, Ok(vec![expected.clone(), expected]));
        assert_eq!(time_interleaved(&mut [0], 2, |_| Err("full")), Err("full"));
        assert!(arithmetic(2, 100) > 0.0);
    }

    #[test]
    fn costlier_loads_are_run_for_fewer_cycles() {
        let floor = Arc::new(Floor::small());
        let load = |operations| Workload {
            robots: 20,
            people: 5,
            size: 2,
            operations,
            floor: floor.clone(),
        };
        assert!(load(10_000).cycles(100_000) * 10 < load(0).cycles(100_000));
        assert!(load(0).density() > 0.01 && load(0).density() < 0.1);
    }
}
