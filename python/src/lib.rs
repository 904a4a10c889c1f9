//! The Python package's native part: scenarios, simulations, tables.
//!
//! ```text
//! scenario.rs    a file, text or dict -> a compiled scenario
//! simulation.rs  a run that Python advances, observes and orders
//! batch.rs       many worlds that step together
//! space.rs       what goes in and out       decide.rs  functions in Python that decide
//! table.rs       rows -> Arrow, NumPy       arrays.rs  ids, values and columns of bodies
//! json.rs        values of other sorts
//! error.rs       the exceptions             watch.rs   Ctrl-C
//! ```
//!
//! It stands on the crate `session`, as the command does: the same scenario and seed give the same bits.

mod arrays;
mod batch;
mod decide;
mod error;
mod json;
mod scenario;
mod simulation;
mod space;
mod table;
mod watch;

use pyo3::prelude::*;

/// The native part of `sidestep`.
#[pymodule(gil_used = false)]
mod _native {
    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::scenario::{Scenario, schema, unpack_scenario, worlds};
    #[pymodule_export]
    use super::simulation::{Simulation, rebuild};
    #[pymodule_export]
    use super::space::{Space, Team};
    #[pymodule_export]
    use super::table::{Table, read};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", sidestep::VERSION)
    }
}
