//! Teams of agents, and the spaces of their observations and orders.

use crate::error::{self, argument_error};
use crate::json::to_list;
use crate::pickle::{self, Pickle, SpaceBounds};
use numpy::{
    PyArray1, PyArrayDyn, PyArrayMethods, PyReadwriteArrayDyn, PyUntypedArrayMethods, ToPyArray,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use sidestep::kernel::control::{self, BufferMut, ValueDomain};
use std::sync::Arc;

/// One quantity of every agent of a team.
///
/// ``low`` and ``high`` are the least and the greatest value, both included; ``choices`` names the values of a
/// choice, by number from 0, and is None for other quantities.
///
/// >>> import sidestep
/// >>> floor = {"world": "robots", "map": {"ascii": "....."}, "robots": [{"count": 2, "behaviour": {"kind": "external"}}]}
/// >>> action = sidestep.Simulation(floor).teams[0].ordered[0]
/// >>> action.name, action.shape, action.choices
/// ('action', (), ['forward', 'left', 'right', 'stay'])
#[pyclass(module = "sidestep", frozen)]
#[derive(Clone)]
pub(crate) struct Space(pub(crate) control::ValueSpace);

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
        if self.0.is_integer() { "int64" } else { "float64" }
    }

    /// The names of the values of a choice; None for other quantities.
    #[getter]
    fn choices(&self) -> Option<Vec<String>> {
        match &self.0.kind {
            ValueDomain::Discrete(names) => Some(names.clone()),
            _ => None,
        }
    }

    /// The least value.
    #[getter]
    fn low(&self) -> f64 {
        match self.0.kind {
            ValueDomain::Discrete(_) => 0.0,
            ValueDomain::Integer { low, .. } => low as f64,
            ValueDomain::Real { low, .. } => low,
        }
    }

    /// The greatest value.
    #[getter]
    fn high(&self) -> f64 {
        match &self.0.kind {
            ValueDomain::Discrete(names) => names.len() as f64 - 1.0,
            &ValueDomain::Integer { high, .. } => high as f64,
            &ValueDomain::Real { high, .. } => high,
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

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickle<'py, PickledSpace>> {
        let control::ValueSpace { name, shape, kind, meaning } = &self.0;
        let values = (name.clone(), shape.clone(), kind.into(), meaning.clone());
        Ok((pickle::maker(py, "unpack_space")?, values))
    }

    fn __repr__(&self) -> String {
        format!("Space({}, shape={:?}: {})", self.0.name, self.0.shape, self.0.describe())
    }
}

/// Agents with the same observations and orders.
///
/// >>> import sidestep
/// >>> floor = {"world": "robots", "map": {"ascii": "....."}, "robots": [{"count": 2, "behaviour": {"kind": "external"}}]}
/// >>> team = sidestep.Simulation(floor).teams[0]
/// >>> team.name, team.agents.tolist(), [space.name for space in team.action_spaces]
/// ('robot', [0, 1], ['action', 'trip'])
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Team(pub(crate) Arc<control::AgentTeam>);

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

    /// The spaces of their observations.
    #[getter]
    fn observation_spaces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        to_list(py, self.0.observation_spaces.iter().cloned().map(Space))
    }

    /// The spaces of orders to them; empty for agents that decide for themselves.
    #[getter]
    fn action_spaces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        to_list(py, self.0.action_spaces.iter().cloned().map(Space))
    }

    /// The same as `observation_spaces`.
    #[getter]
    fn observed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.observation_spaces(py)
    }

    /// The same as `action_spaces`.
    #[getter]
    fn ordered<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.action_spaces(py)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickle<'py, PickledTeam<'py>>> {
        let values = (
            self.0.name.clone(),
            self.0.agents.clone(),
            self.observation_spaces(py)?,
            self.action_spaces(py)?,
        );
        Ok((pickle::maker(py, "unpack_team")?, values))
    }

    fn __len__(&self) -> usize {
        self.0.agents.len()
    }

    fn __repr__(&self) -> String {
        let control::AgentTeam { name, agents, observation_spaces, action_spaces } = &*self.0;
        let n = agents.len();
        let observed = joined_names(observation_spaces);
        let ordered = joined_names(action_spaces);
        format!("Team({name}, {n} agents, observed: {observed}; ordered: {ordered})")
    }
}

fn joined_names(spaces: &[control::ValueSpace]) -> String {
    spaces.iter().map(|space| space.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Returns a team by number or name, the first one without either, with its number.
pub(crate) fn find_team<'a>(
    teams: &'a [Arc<control::AgentTeam>],
    team: Option<&Bound<'_, PyAny>>,
) -> PyResult<(usize, &'a Arc<control::AgentTeam>)> {
    let Some(team) = team else { return team_at(teams, 0) };
    if let Ok(number) = team.extract::<usize>() {
        return team_at(teams, number);
    }
    let name: String = team.extract()?;
    let position = teams.iter().position(|team| team.name == name);
    position.map(|k| (k, &teams[k])).ok_or_else(|| {
        let names: Vec<_> = teams.iter().map(|team| team.name.as_str()).collect();
        let names = names.join(", ");
        error::OrderError::new_err(format!("there is no team `{name}`; the scenario has {names}"))
    })
}

/// Returns a team by number; an error lists how many there are.
pub(crate) fn team_at(
    teams: &[Arc<control::AgentTeam>],
    number: usize,
) -> PyResult<(usize, &Arc<control::AgentTeam>)> {
    teams.get(number).map(|team| (number, team)).ok_or_else(|| {
        let message =
            format!("there is no team {number}; the scenario has {}, from 0", teams.len());
        error::OrderError::new_err(message)
    })
}

/// Buffers for the observations of a team, in the order of its spaces: the run fills all in one pass.
pub(crate) struct ObservationBuffers(Vec<Buffer>);

enum Buffer {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

impl Buffer {
    /// Returns a buffer for a quantity of this many agents.
    fn zeroed(space: &control::ValueSpace, agents: usize) -> Self {
        let n = agents * space.value_count();
        if space.is_integer() { Self::Whole(vec![0; n]) } else { Self::Real(vec![0.0; n]) }
    }

    fn as_buffer_mut(&mut self) -> BufferMut<'_> {
        match self {
            Self::Whole(values) => BufferMut::Integer(values),
            Self::Real(values) => BufferMut::Real(values),
        }
    }
}

impl ObservationBuffers {
    /// Returns zeroed buffers of the right lengths for all agents of `team`.
    pub(crate) fn from_team(team: &control::AgentTeam) -> Self {
        let spaces = team.observation_spaces.iter();
        Self(spaces.map(|space| Buffer::zeroed(space, team.agents.len())).collect())
    }

    pub(crate) fn buffers_mut(&mut self) -> Vec<BufferMut<'_>> {
        self.0.iter_mut().map(Buffer::as_buffer_mut).collect()
    }

    /// Returns the written values as arrays of the shape (agents, ...), by name.
    pub(crate) fn into_dict<'py>(
        self,
        py: Python<'py>,
        team: &control::AgentTeam,
    ) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (space, buffer) in team.observation_spaces.iter().zip(self.0) {
            let shape: Vec<usize> =
                [team.agents.len()].iter().chain(&space.shape).copied().collect();
            match buffer {
                Buffer::Whole(values) => {
                    dict.set_item(&space.name, to_array(py, values, shape)?)?
                }
                Buffer::Real(values) => dict.set_item(&space.name, to_array(py, values, shape)?)?,
            }
        }
        Ok(dict)
    }
}

fn to_array<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: Vec<usize>,
) -> PyResult<Bound<'_, PyArrayDyn<T>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Returns arrays for the observations of a team in many worlds, by name.
pub(crate) fn zeroed_arrays<'py>(
    py: Python<'py>,
    team: &control::AgentTeam,
    worlds: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for space in &team.observation_spaces {
        let shape = shape(space, team, worlds);
        if space.is_integer() {
            dict.set_item(&space.name, PyArrayDyn::<i64>::zeros(py, shape, false))?;
        } else {
            dict.set_item(&space.name, PyArrayDyn::<f64>::zeros(py, shape, false))?;
        }
    }
    Ok(dict)
}

fn shape(space: &control::ValueSpace, team: &control::AgentTeam, worlds: usize) -> Vec<usize> {
    [worlds, team.agents.len()].iter().chain(&space.shape).copied().collect()
}

/// Arrays of a caller for the observations of many worlds.
pub(crate) struct OutArrays<'py>(Vec<Array<'py>>);

enum Array<'py> {
    Whole(PyReadwriteArrayDyn<'py, i64>),
    Real(PyReadwriteArrayDyn<'py, f64>),
}

impl<'py> OutArrays<'py> {
    /// Returns the arrays of `out`, if they are those that a team needs.
    pub(crate) fn from_dict(
        out: &Bound<'py, PyDict>,
        team: &control::AgentTeam,
        worlds: usize,
    ) -> PyResult<Self> {
        let mut arrays = Vec::with_capacity(team.observation_spaces.len());
        for space in &team.observation_spaces {
            let shape = shape(space, team, worlds);
            let array = out.get_item(&space.name)?;
            let array = array.and_then(|array| {
                if space.is_integer() {
                    writable_array(&array, &shape).map(Array::Whole)
                } else {
                    writable_array(&array, &shape).map(Array::Real)
                }
            });
            arrays.push(array.ok_or_else(|| out_array_error(space, &shape))?);
        }
        Ok(Self(arrays))
    }

    pub(crate) fn buffers_mut(&mut self) -> PyResult<Vec<BufferMut<'_>>> {
        self.0.iter_mut().map(Array::as_buffer_mut).collect()
    }
}

fn out_array_error(space: &control::ValueSpace, shape: &[usize]) -> PyErr {
    let dtype = if space.is_integer() { "int64" } else { "float64" };
    let cause = "it is missing, in use, or another array than an earlier call returned";
    let shape = format_shape(shape);
    let remedy = format!("give a writable array in C order of the shape {shape}, {dtype}");
    argument_error(&format!("out.{}", space.name), cause, remedy)
}

impl Array<'_> {
    fn as_buffer_mut(&mut self) -> PyResult<BufferMut<'_>> {
        Ok(match self {
            Self::Whole(array) => BufferMut::Integer(array.as_slice_mut()?),
            Self::Real(array) => BufferMut::Real(array.as_slice_mut()?),
        })
    }
}

/// Returns an array that can be written from front to back.
fn writable_array<'py, T: numpy::Element>(
    array: &Bound<'py, PyAny>,
    shape: &[usize],
) -> Option<PyReadwriteArrayDyn<'py, T>> {
    let array = array.cast::<PyArrayDyn<T>>().ok()?;
    let fits = array.shape() == shape && array.is_c_contiguous();
    fits.then(|| array.try_readwrite().ok())?
}

/// Returns a shape in the notation of Python.
fn format_shape(shape: &[usize]) -> String {
    let numbers: Vec<_> = shape.iter().map(ToString::to_string).collect();
    format!("({})", numbers.join(", "))
}

/// The arguments of [`unpack_space`].
type PickledSpace = (String, Vec<usize>, SpaceBounds, String);

/// The arguments of [`unpack_team`].
type PickledTeam<'py> = (String, Vec<u32>, Bound<'py, PyList>, Bound<'py, PyList>);

/// Makes a space again.
#[pyfunction]
pub(crate) fn unpack_space(
    name: String,
    shape: Vec<usize>,
    bounds: SpaceBounds,
    meaning: String,
) -> Space {
    Space(control::ValueSpace::new(name, bounds.into(), meaning).with_shape(shape))
}

/// Makes a team again.
#[pyfunction]
pub(crate) fn unpack_team(
    name: String,
    agents: Vec<u32>,
    observed: Vec<PyRef<'_, Space>>,
    ordered: Vec<PyRef<'_, Space>>,
) -> Team {
    let spaces = |list: Vec<PyRef<'_, Space>>| list.iter().map(|space| space.0.clone()).collect();
    Team(Arc::new(control::AgentTeam {
        name,
        agents,
        observation_spaces: spaces(observed),
        action_spaces: spaces(ordered),
    }))
}
