//! Arrays: ids and values that come from Python, and columns of bodies that go to it.

use crate::error;
use crate::json::to_list;
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyOverflowError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};
use sidestep::kernel::EntityId;
use sidestep::kernel::view::Body;

/// An argument that is a whole number from 0 on, which may be larger in Python than in Rust.
#[derive(Debug, Clone)]
pub(crate) struct UnsignedArg(Result<u64, String>);

impl UnsignedArg {
    pub(crate) const fn new(number: u64) -> Self {
        Self(Ok(number))
    }

    /// Returns the number; the error of one that is out of range has the name of the argument, which the conversion
    /// itself does not know.
    pub(crate) fn named(self, name: &str) -> PyResult<u64> {
        self.0.map_err(|number| {
            let remedy = format!("give a whole number from 0 to {}", u64::MAX);
            error::argument_error(name, format!("{number} is out of range"), remedy)
        })
    }
}

impl FromPyObject<'_, '_> for UnsignedArg {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        match value.extract::<u64>() {
            Err(raised) if raised.is_instance_of::<PyOverflowError>(value.py()) => {
                Ok(Self(Err(value.to_string())))
            }
            number => number.map(Self::new),
        }
    }
}

/// Returns the ids of agents; truth values are no ids, although they are integers in Python.
pub(crate) fn agent_ids(py: Python<'_>, agents: &Bound<'_, PyAny>) -> PyResult<Vec<EntityId>> {
    let array = py.import("numpy")?.call_method1("atleast_1d", (agents,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let is_empty = array.len()? == 0;
    match kind.as_str() {
        "i" | "u" => array.call_method0("tolist")?.extract().map_err(|_| not_ids()),
        // NumPy gives an empty list the type of floats.
        _ if is_empty => Ok(Vec::new()),
        _ => Err(not_ids()),
    }
}

fn not_ids() -> PyErr {
    error::OrderError::new_err(
        "`agents` must be ids: whole numbers; of a mask, `team.agents[mask]`",
    )
}

/// Returns the values of an order as floats, one agent after the other: an array with a row for each agent, or one number
/// for all.
pub(crate) fn order_values(
    py: Python<'_>,
    order: &str,
    values: &Bound<'_, PyAny>,
    agents: usize,
    shape: Option<&[usize]>,
) -> PyResult<Vec<f64>> {
    refuse_loss(py, order, values)?;
    let float = py.import("numpy")?.getattr("float64")?;
    let array = py.import("numpy")?.call_method1("asarray", (values, float));
    let array = array.map_err(|e| {
        let cause = format!("must be numbers: {}", e.value(py));
        refused_order(order, &cause)
    })?;
    let array =
        array.cast::<PyArrayDyn<f64>>().map_err(|e| refused_order(order, &e.to_string()))?;
    // The run refuses an unknown order, with the names of the known ones.
    let Some(shape) = shape else { return Ok(array.to_vec().unwrap_or_default()) };
    let expected: Vec<usize> = [agents].iter().chain(shape).copied().collect();
    if array.ndim() == 0 {
        let len: usize = expected.iter().product();
        return Ok(vec![array.readonly().as_array().iter().copied().next().unwrap_or(0.0); len]);
    }
    if array.shape() != expected {
        let found = PyTuple::new(py, array.shape())?;
        let expected = PyTuple::new(py, &expected)?;
        let cause = format!("needs an array of the shape {expected}, not {found}");
        return Err(refused_order(order, &cause));
    }
    let array = array.readonly();
    // Contiguous values are copied as one block.
    Ok(array
        .as_slice()
        .map_or_else(|_| array.as_array().iter().copied().collect(), <[f64]>::to_vec))
}

/// Refuses arrays of which NumPy would drop something: the mask, or imaginary parts.
fn refuse_loss(py: Python<'_>, order: &str, values: &Bound<'_, PyAny>) -> PyResult<()> {
    let Ok(dtype) = values.getattr(intern!(py, "dtype")) else { return Ok(()) };
    let kind: String =
        dtype.getattr(intern!(py, "kind")).and_then(|kind| kind.extract()).unwrap_or_default();
    if kind == "c" {
        return Err(refused_order(order, "must be real numbers, not complex ones"));
    }
    let mask = values.getattr(intern!(py, "mask"));
    if mask.is_ok_and(|mask| {
        mask.call_method0("any").is_ok_and(|any| any.is_truthy().unwrap_or(false))
    }) {
        let cause = "has masked values; give a number for each agent, or order some by `agents`";
        return Err(refused_order(order, cause));
    }
    Ok(())
}

fn refused_order(order: &str, cause: &str) -> PyErr {
    error::OrderError::new_err(format!("the order `{order}` {cause}"))
}

/// Returns a dict for each of `names`: the k-th one has the k-th cell of each column, by its name. This is the form
/// of observations in PettingZoo, for which loops in Python take twice as long.
#[pyfunction]
pub(crate) fn rows_by_name<'py>(
    py: Python<'py>,
    names: Vec<Bound<'py, PyString>>,
    columns: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyDict>> {
    // A copy of a dict that has all keys allocates once; a growing one allocates again and again.
    let template = PyDict::new(py);
    let mut cells = Vec::with_capacity(columns.len());
    for (key, column) in columns {
        template.set_item(&key, py.None())?;
        cells.push((key, column.cast_into::<PyList>()?));
    }
    let rows = PyDict::new(py);
    for (k, name) in names.into_iter().enumerate() {
        let row = template.copy()?;
        for (key, column) in &cells {
            row.set_item(key, column.get_item(k)?)?;
        }
        rows.set_item(name, row)?;
    }
    Ok(rows)
}

pub(crate) fn body_column<'py, T: numpy::Element>(
    py: Python<'py>,
    bodies: &[Body],
    of: impl Fn(&Body) -> T,
) -> Bound<'py, PyArray1<T>> {
    PyArray1::from_iter(py, bodies.iter().map(of))
}

/// Returns N numbers for each body, in an array of the shape (bodies, N).
pub(crate) fn body_rows<'py, const N: usize>(
    py: Python<'py>,
    bodies: &[Body],
    of: impl Fn(&Body) -> [f64; N],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = bodies.iter().flat_map(of).collect();
    PyArray1::from_vec(py, flat).reshape([bodies.len(), N])
}

pub(crate) fn body_texts<'py>(
    py: Python<'py>,
    bodies: &[Body],
    of: impl Fn(&Body) -> String,
) -> PyResult<Bound<'py, PyAny>> {
    let list = to_list(py, bodies.iter().map(of))?;
    py.import("numpy")?.call_method1("array", (list,))
}
