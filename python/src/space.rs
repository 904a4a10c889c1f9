//! Teams of agents, and the spaces of the numbers that go in and out.

use crate::json::list;
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use sidestep::kernel::control::{self, Bounds, CellsMut};
use std::sync::Arc;

/// One quantity of every agent of a team.
///
/// ``low`` and ``high`` are the least and the greatest value, both included; ``choices`` names the values of a
/// choice, by number from 0, and is None for other quantities.
#[pyclass(module = "sidestep", frozen)]
#[derive(Clone)]
pub(crate) struct Space(pub(crate) control::Space);

#[pymethods]
impl Space {
    /// Name; ends in the unit where the quantity has one.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Shape of one agent's share; ``()`` for a single number.
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.0.shape)
    }

    /// ``"int64"`` or ``"float64"``, the type of its arrays.
    #[getter]
    fn dtype(&self) -> &'static str {
        if self.0.is_whole() { "int64" } else { "float64" }
    }

    /// The names of the values of a choice; None for other quantities.
    #[getter]
    fn choices(&self) -> Option<Vec<String>> {
        match &self.0.bounds {
            Bounds::Choice(names) => Some(names.clone()),
            _ => None,
        }
    }

    /// The least value.
    #[getter]
    fn low(&self) -> f64 {
        match self.0.bounds {
            Bounds::Choice(_) => 0.0,
            Bounds::Whole { least, .. } => least as f64,
            Bounds::Real { least, .. } => least,
        }
    }

    /// The greatest value.
    #[getter]
    fn high(&self) -> f64 {
        match &self.0.bounds {
            Bounds::Choice(names) => names.len() as f64 - 1.0,
            &Bounds::Whole { most, .. } => most as f64,
            &Bounds::Real { most, .. } => most,
        }
    }

    /// The unit; None for plain numbers.
    #[getter]
    fn unit(&self) -> Option<&'static str> {
        self.0.unit()
    }

    /// One sentence about it.
    #[getter]
    fn meaning(&self) -> &str {
        &self.0.meaning
    }

    fn __repr__(&self) -> String {
        format!("Space({}, shape={:?}: {})", self.0.name, self.0.shape, self.0.words())
    }
}

/// Agents that observe, and are ordered, alike.
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Team(pub(crate) Arc<control::Team>);

#[pymethods]
impl Team {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Ids of its agents (uint32), rising; rows of arrays are in this order.
    #[getter]
    fn agents<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        self.0.agents.to_pyarray(py)
    }

    /// The spaces of what they observe.
    #[getter]
    fn observed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        list(py, self.0.observed.iter().cloned().map(Space))
    }

    /// The spaces of what may be ordered of them; empty for agents that decide for themselves.
    #[getter]
    fn ordered<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        list(py, self.0.ordered.iter().cloned().map(Space))
    }

    fn __len__(&self) -> usize {
        self.0.agents.len()
    }

    fn __repr__(&self) -> String {
        let names = |spaces: &[control::Space]| {
            spaces.iter().map(|space| space.name.as_str()).collect::<Vec<_>>().join(", ")
        };
        let control::Team { name, agents, observed, ordered } = &*self.0;
        let (n, observed, ordered) = (agents.len(), names(observed), names(ordered));
        format!("Team({name}, {n} agents, observed: {observed}; ordered: {ordered})")
    }
}

/// Room for the observations of a team, one buffer for each of its spaces.
pub(crate) struct Room(Vec<Buffer>);

enum Buffer {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

impl Buffer {
    fn cells(&mut self) -> CellsMut<'_> {
        match self {
            Self::Whole(room) => CellsMut::Whole(room),
            Self::Real(room) => CellsMut::Real(room),
        }
    }
}

impl Room {
    /// Returns room for what `team` observes.
    pub(crate) fn of(team: &control::Team) -> Self {
        let buffer = |space: &control::Space| {
            let n = team.agents.len() * space.width();
            if space.is_whole() { Buffer::Whole(vec![0; n]) } else { Buffer::Real(vec![0.0; n]) }
        };
        Self(team.observed.iter().map(buffer).collect())
    }

    /// Returns the room to write into.
    pub(crate) fn cells(&mut self) -> Vec<CellsMut<'_>> {
        self.0.iter_mut().map(Buffer::cells).collect()
    }

    /// Returns what was written as arrays of the shape (agents, ...), by name.
    pub(crate) fn into_dict<'py>(
        self,
        py: Python<'py>,
        team: &control::Team,
    ) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (space, buffer) in team.observed.iter().zip(self.0) {
            let shape: Vec<usize> =
                [team.agents.len()].iter().chain(&space.shape).copied().collect();
            match buffer {
                Buffer::Whole(values) => dict.set_item(&space.name, shaped(py, values, shape)?)?,
                Buffer::Real(values) => dict.set_item(&space.name, shaped(py, values, shape)?)?,
            }
        }
        Ok(dict)
    }
}

fn shaped<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: Vec<usize>,
) -> PyResult<Bound<'_, PyArrayDyn<T>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}
