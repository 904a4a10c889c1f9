//! What all experiments share: runs of scenario texts, one cell per case, and shares of runs.

use super::Plan;
use crate::farm::{self, Progress};
use serde::Serialize;
use sidestep::kernel::stream::{Draws, Purpose, Streams};
use sidestep::kernel::{InputError, Seed, Simulation};
use sidestep::scenario::Source;
use sidestep::statistics::{Interval, clopper_pearson, percentile};
use sidestep::worlds::chain::scenario::Compiled;
use sidestep::worlds::chain::simulation::ChainSimulation;
use sidestep_document::figure::Point as FigurePoint;
use std::fmt;

/// How fast initiators go, m/s, as the prototypes' did.
pub(super) const SPEED_M_S: f64 = 0.5;
/// What a cycle takes unless an experiment is about it.
pub(super) const DT_S: f64 = 0.02;

/// The begin of every scenario, up to and into the section `[chain]`.
pub(super) fn head<const D: usize>(seed: u64, cycles: u64) -> String {
    format!(
        "format = 1\nworld = \"chain\"\nseed = {seed}\ncycles = {cycles}\n\
         [chain]\ndimensions = {D}\n"
    )
}

/// A run of a scenario at its start.
pub(super) fn begun<const D: usize>(text: String) -> Result<ChainSimulation<D>, InputError> {
    let source = Source::new("a scenario of this experiment", text, "");
    Ok(ChainSimulation::new(Compiled::new(&source)?, &source, 1))
}

/// Runs to the end, and tells `look` of every cycle.
pub(super) fn finish<const D: usize>(
    run: &mut ChainSimulation<D>,
    mut look: impl FnMut(&ChainSimulation<D>),
) {
    while run.cycle() < run.compiled().cycles && !run.is_over() {
        run.advance(1);
        look(run);
    }
}

/// Runs every case with seeds 1 to `seeds`; results by case, then by seed.
pub(super) fn grid<C: Sync, T: Send>(
    (plan, seeds): (&Plan, usize),
    what: &str,
    cases: &[C],
    progress: &mut Progress<'_>,
    run: impl Fn(&C, u64) -> Result<T, InputError> + Sync,
) -> Result<Vec<Vec<T>>, InputError> {
    let all = farm::in_batches(
        plan.workers,
        cases.len() * seeds,
        |share| progress(what, share),
        |i| run(&cases[i / seeds], (i % seeds) as u64 + 1),
    );
    let mut all = all.into_iter();
    cases.iter().map(|_| all.by_ref().take(seeds).collect()).collect()
}

/// Random numbers of an experiment that drives no world.
pub(super) fn draws(seed: u64) -> Draws {
    Streams::new(Seed(seed)).draws(0, 0, Purpose(1))
}

/// How many of some runs, and between which shares of all runs that may lie: 95 %, by Clopper
/// and Pearson.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Runs in which it was so,
    pub hits: u64,
    /// of so many.
    pub n: u64,
    /// Interval of the share, 0 to 1.
    pub interval: Interval,
}

impl Share {
    /// The share of those that are true.
    pub fn of(all: impl IntoIterator<Item = bool>) -> Self {
        let (mut hits, mut n) = (0, 0);
        for hit in all {
            hits += u64::from(hit);
            n += 1;
        }
        Self { hits, n, interval: clopper_pearson(hits, n) }
    }

    /// All of one or more.
    pub fn is_all(&self) -> bool {
        self.n > 0 && self.hits == self.n
    }

    /// Percent, 0 without runs.
    pub fn percent(&self) -> f64 {
        100.0 * self.hits as f64 / self.n.max(1) as f64
    }

    /// A point of a figure at `x`, in percent.
    pub(super) fn point(&self, x: f64) -> FigurePoint {
        let Interval { low, high } = self.interval;
        let interval = Some((100.0 * low, 100.0 * high));
        FigurePoint::new(x, self.percent()).with_interval(interval).of_runs(self.n as usize)
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Interval { low, high } = self.interval;
        let percent = |x: f64| (100.0 * x).round();
        write!(f, "{}/{} [{}, {}] %", self.hits, self.n, percent(low), percent(high))
    }
}

/// The one in the middle; 0 of none.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    percentile(&values, 0.5).unwrap_or(0.0)
}

/// The least of some that are there.
pub(super) fn least(values: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    values.into_iter().flatten().reduce(f64::min)
}

/// The greatest; 0 of none.
pub(super) fn most(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// A length in millimeters, with its sign; what is nowhere near is told as such.
pub(super) fn mm(value_m: Option<f64>) -> String {
    match value_m {
        None => "far".into(),
        Some(m) if m.abs() < 1e-6 => "0.000".into(),
        Some(m) => format!("{:.3}", 1e3 * m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_says_how_sure_it_is() {
        let share = Share::of([true, true, true, false]);
        assert_eq!(share.to_string(), "3/4 [19, 99] %");
        assert!(!share.is_all() && Share::of([true; 2]).is_all() && !Share::of([]).is_all());
    }

    #[test]
    fn results_of_a_grid_are_by_case_and_seed() {
        let plan = Plan::quick();
        let run = |case: &u64, seed| Ok(10 * case + seed);
        let all = grid((&plan, 2), "", &[1, 2, 3], &mut |_, _| (), run).unwrap();
        assert_eq!(all, [[11, 12], [21, 22], [31, 32]]);
    }
}
