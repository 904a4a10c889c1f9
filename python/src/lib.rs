//! The native part of the Python package: scenarios, simulations, tables.
//!
//! ```text
//! scenario.rs    a file, text or dict -> a compiled scenario
//! simulation.rs  a run that Python advances, observes and orders
//! blocks.rs      the rows of a long run     batch.rs        many worlds that step together
//! space.rs       spaces of numbers          policy.rs       functions in Python that decide
//! table.rs       rows -> Arrow, NumPy       arrays.rs       ids, values and columns of bodies
//! read.rs        folders -> tables          inspect.rs      files -> import reports
//! sweep.rs       many runs, by threads or by an executor
//! arm.rs         kinematics of arms         learn.rs        error models from tables
//! columns.rs     arrays and data frames -> tables that are learned from
//! stats.rs       intervals and pairs        collectives.rs  games of tables or of an objective
//! json.rs        values of other kinds      notebook.rs     output of notebook cells
//! result.rs      results, by name           choice.rs       words that choose a value
//! pickle.rs      what travels between processes            picture.rs      states -> pixels
//! error.rs       the exceptions             watch.rs        Ctrl-C
//! worlds.rs      the list of worlds, and what each declares
//! ```
//!
//! It builds on the crate `session`, like the command: the same scenario and seed give the same bits. It is a library,
//! which makes a native module of a list of worlds: that of the package (`python/native`), and one for its tests
//! (`python/tests/pond`).

mod arm;
mod arrays;
mod batch;
mod blocks;
mod choice;
mod collectives;
mod columns;
mod error;
mod fleet;
mod inspect;
mod json;
mod learn;
mod notebook;
mod pickle;
mod picture;
mod policy;
mod read;
mod result;
mod scenario;
mod simulation;
mod space;
mod stats;
mod sweep;
mod table;
mod watch;
mod worlds;

use pyo3::prelude::*;
use sidestep::scenario::Worlds;

/// Adds all classes and functions to a native module, whose scenarios are of these worlds.
///
/// # Errors
/// When Python cannot add them.
pub fn fill(module: &Bound<'_, PyModule>, worlds: Worlds) -> PyResult<()> {
    worlds::set(worlds);
    module.add("__version__", sidestep::VERSION)?;
    add_simulation(module)?;
    add_sweeps(module)?;
    add_analysis(module)
}

fn add_simulation(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<scenario::Scenario>()?;
    module.add_class::<simulation::Simulation>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<blocks::Blocks>()?;
    module.add_class::<space::Space>()?;
    module.add_class::<space::Team>()?;
    module.add_class::<table::Table>()?;
    module.add_function(wrap_pyfunction!(arrays::rows_by_name, module)?)?;
    module.add_function(wrap_pyfunction!(inspect::inspect, module)?)?;
    module.add_function(wrap_pyfunction!(inspect::write_clean, module)?)?;
    module.add_function(wrap_pyfunction!(arm::unpack_arm, module)?)?;
    module.add_function(wrap_pyfunction!(batch::unpack_batch, module)?)?;
    module.add_function(wrap_pyfunction!(space::unpack_space, module)?)?;
    module.add_function(wrap_pyfunction!(table::unpack_table, module)?)?;
    module.add_function(wrap_pyfunction!(space::unpack_team, module)?)?;
    module.add_function(wrap_pyfunction!(read::read, module)?)?;
    module.add_function(wrap_pyfunction!(read::table_names, module)?)?;
    module.add_function(wrap_pyfunction!(scenario::schema, module)?)?;
    module.add_function(wrap_pyfunction!(scenario::unpack_scenario, module)?)?;
    module.add_function(wrap_pyfunction!(simulation::rebuild, module)?)?;
    module.add_function(wrap_pyfunction!(worlds::world_facts, module)?)?;
    module.add_function(wrap_pyfunction!(worlds::worlds, module)?)
}

fn add_sweeps(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(fleet::build, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::has_loopback_multicast, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::compare_methods, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::run_sweep, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::run_task, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::sweep_status, module)?)
}

fn add_analysis(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<arm::Arm>()?;
    module.add_function(wrap_pyfunction!(arm::arm_trajectories, module)?)?;
    module.add_class::<columns::LogColumns>()?;
    module.add_class::<learn::Learned>()?;
    module.add_function(wrap_pyfunction!(learn::unpack_learned, module)?)?;
    module.add_function(wrap_pyfunction!(collectives::minimize_objective, module)?)?;
    module.add_function(wrap_pyfunction!(collectives::minimize_pairs, module)?)?;
    module.add_function(wrap_pyfunction!(learn::learn_effector, module)?)?;
    module.add_function(wrap_pyfunction!(learn::learn_sensor, module)?)?;
    module.add_function(wrap_pyfunction!(stats::stats_correlation, module)?)?;
    module.add_function(wrap_pyfunction!(stats::stats_holm, module)?)?;
    module.add_function(wrap_pyfunction!(stats::stats_mean, module)?)?;
    module.add_function(wrap_pyfunction!(stats::stats_next, module)?)?;
    module.add_function(wrap_pyfunction!(stats::stats_paired, module)?)?;
    module.add_function(wrap_pyfunction!(stats::stats_quantile, module)?)?;
    module.add_function(wrap_pyfunction!(stats::stats_share, module)?)
}
