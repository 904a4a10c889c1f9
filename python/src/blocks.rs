//! The rows of a long run, block by block.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use sidestep::kernel::Cycle;

/// An iterator over the rows of a run, made by `Simulation.blocks`: each step advances the run, and gives the tables
/// of these cycles by name.
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Blocks {
    /// The simulation, called as by any code in Python.
    pub(crate) simulation: Py<PyAny>,
    pub(crate) cycles: Cycle,
    pub(crate) until: Cycle,
    pub(crate) decide: Option<Py<PyAny>>,
    pub(crate) state: Py<PyAny>,
}

#[pymethods]
impl Blocks {
    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let run = self.simulation.bind(py);
        let now: Cycle = run.getattr("cycle")?.extract()?;
        if now >= self.until || run.getattr("is_over")?.extract()? {
            return Ok(None);
        }
        let arguments = PyDict::new(py);
        arguments.set_item("decide", &self.decide)?;
        arguments.set_item("state", &self.state)?;
        let goal = now.saturating_add(self.cycles).min(self.until);
        run.call_method("run", (goal,), Some(&arguments))?;
        run.call_method0("tables").map(Some)
    }
}
