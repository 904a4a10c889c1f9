//! The rows of a long run, block by block.

use crate::arrays::Whole;
use crate::decide::Deciding;
use crate::simulation::Simulation;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sidestep::kernel::Cycle;

/// An iterator over the rows of a run, as `Simulation.blocks` makes it: each step advances the run, and gives the tables of
/// these cycles by name.
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Blocks {
    pub(crate) simulation: Py<Simulation>,
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

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let run = self.simulation.bind(py);
        let now = run.get().now(py)?;
        if now >= self.until || run.get().has_ended(py)? {
            return Ok(None);
        }
        let goal = now.saturating_add(self.cycles).min(self.until);
        let decide = self.decide.as_ref().map(|decide| decide.bind(py));
        let state = Some(self.state.bind(py).clone());
        Simulation::run(run, Some(Whole(goal)), decide, state)?;
        run.get().tables(py).map(Some)
    }
}
