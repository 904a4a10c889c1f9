//! Runs for tests that hold for any number of workers and any storage.

use crate::RobotsRun;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use sidestep_scenario::Source;

/// Returns a run that always uses all its workers.
pub(crate) fn run_in_order(text: &str, workers: usize, order: StorageOrder) -> RobotsRun {
    let source = Source::new("test", text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), order);
    let mut run = compiled.unwrap_or_else(|e| panic!("{e}")).start(&source, workers);
    run.force_parallel();
    run
}
