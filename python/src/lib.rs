//! The Python package's native part: scenarios, simulations, tables.
//!
//! ```text
//! scenario.rs    a file, text or dict -> a compiled scenario
//! simulation.rs  a run that Python advances, observes and orders
//! blocks.rs      the rows of a long run     batch.rs        many worlds that step together
//! space.rs       spaces of numbers          policy.rs       functions in Python that decide
//! table.rs       rows -> Arrow, NumPy       arrays.rs       ids, values and columns of bodies
//! read.rs        folders -> tables
//! sweep.rs       many runs, by threads or by an executor
//! arm.rs         kinematics of arms         learn.rs        error models from tables
//! stats.rs       intervals and pairs        collectives.rs  games of tables or of an objective
//! json.rs        values of other kinds      notebook.rs     output of notebook cells
//! result.rs      results, by name           choice.rs       words that choose a value
//! error.rs       the exceptions             watch.rs        Ctrl-C
//! ```
//!
//! It builds on the crate `session`, like the command: the same scenario and seed give the same bits.

mod arm;
mod arrays;
mod batch;
mod blocks;
mod choice;
mod collectives;
mod error;
mod json;
mod learn;
mod notebook;
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

use pyo3::prelude::*;

/// The native part of `sidestep`.
#[pymodule(gil_used = false)]
mod _native {
    #[pymodule_export]
    use super::arrays::rows_by_name;
    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::blocks::Blocks;
    #[pymodule_export]
    use super::scenario::{Scenario, schema, unpack_scenario, worlds};
    #[pymodule_export]
    use super::simulation::{Simulation, rebuild};
    #[pymodule_export]
    use super::space::{Space, Team};
    // Sweeps and analysis.
    #[pymodule_export]
    use super::arm::Arm;
    #[pymodule_export]
    use super::collectives::{minimize_objective, minimize_pairs};
    #[pymodule_export]
    use super::learn::{Learned, learn_effector, learn_sensor};
    #[pymodule_export]
    use super::read::{read, table_names};
    #[pymodule_export]
    use super::stats::{
        stats_correlation, stats_holm, stats_mean, stats_next, stats_paired, stats_quantile,
        stats_share,
    };
    #[pymodule_export]
    use super::sweep::{compare_methods, run_sweep, run_task, sweep_status};
    #[pymodule_export]
    use super::table::Table;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", sidestep::VERSION)
    }
}
