//! Tables: rows as Arrow and NumPy arrays.

use crate::arrays::UnsignedArg;
use crate::error::{self, argument_error};
use crate::json::to_list;
use crate::notebook::to_html;
use crate::pickle::{self, Pickle};
use crate::worlds;
use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, DictionaryArray, PrimitiveArray, RecordBatch,
    RecordBatchIterator, RecordBatchReader, StringArray, UInt32Array,
};
use arrow_buffer::{NullBuffer, ScalarBuffer};
use arrow_ipc::reader::StreamReader;
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{ArrowError, DataType, Field, Schema};
use numpy::{PyArray1, ToPyArray};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyList, PySlice, PyTuple};
use sidestep::experiment::sweep::{Role, RunColumn};
use sidestep::kernel::ports::{Cells, ColumnSpec, ColumnType, ColumnValues, TableSchema};
use sidestep::scenario::{MetricInfo, metric_label};
use std::collections::HashMap;
use std::sync::Arc;

/// Rows of one table that a run records.
///
/// It has `__arrow_c_stream__`, so `polars.DataFrame(table)`, `pandas.DataFrame.from_arrow(table)`, `pyarrow.table(table)` and DuckDB take it
/// without a copy of the numbers; `table["column"]` is a NumPy array. Examples of its methods continue from here:
///
/// >>> import sidestep
/// >>> sim = sidestep.Simulation({"world": "robots", "map": {"ascii": "....."}, "robots": [{"count": 2}]}, record=True)
/// >>> sim.step(5)
/// 5
/// >>> table = sim.tables()["trajectories"]
/// >>> table["cycle"].tolist()
/// [0, 1, 2, 3, 4, 0, 1, 2, 3, 4]
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Table {
    schema: TableSchema,
    batch: RecordBatch,
}

impl Table {
    /// Returns a table of these rows; numbers are not copied.
    pub(crate) fn new(schema: TableSchema, columns: Vec<ColumnValues>) -> PyResult<Self> {
        let fields = schema.columns.iter().map(field).collect::<Vec<_>>();
        let about = schema.about.iter().cloned().collect::<HashMap<_, _>>();
        let arrow = Arc::new(Schema::new_with_metadata(fields, about));
        let arrays = schema.columns.iter().zip(columns).map(|(spec, values)| array(spec, values));
        let arrays = arrays.collect::<Result<Vec<_>, _>>().map_err(|e| arrow_error(&e))?;
        let batch = RecordBatch::try_new(arrow, arrays).map_err(|e| arrow_error(&e))?;
        Ok(Self { schema, batch })
    }

    /// Returns a table of a sweep's runs; numbers are not copied.
    pub(crate) fn from_runs(name: &str, columns: Vec<RunColumn>, world: &str) -> PyResult<Self> {
        let infos = worlds::list().find(world).map_or(&[][..], |world| world.metric_infos());
        let specs = columns.iter().map(|column| ColumnSpec {
            is_nullable: true,
            ..ColumnSpec::new(
                &column.name,
                column.values.column_type(),
                &column_description(column, infos),
            )
        });
        let schema = TableSchema::new(name, specs.collect());
        Self::new(schema, columns.into_iter().map(|column| column.values).collect())
    }

    /// Returns a table of rows as they were in another one; or says what is wrong with them.
    pub(crate) fn from_arrow(
        name: String,
        about: Vec<(String, String)>,
        batch: RecordBatch,
    ) -> Result<Self, String> {
        let fields = batch.schema().fields().clone();
        let specs = fields.iter().zip(batch.columns()).map(|(field, array)| spec(field, array));
        let columns = specs.collect::<Result<Vec<_>, String>>()?;
        let schema = TableSchema { about, ..TableSchema::new(&name, columns) };
        Ok(Self { schema, batch })
    }

    /// Returns the rows of a slice.
    fn slice(&self, slice: &Bound<'_, PySlice>) -> PyResult<Self> {
        let rows = slice.indices(self.batch.num_rows() as isize)?;
        if rows.step != 1 && rows.slicelength > 1 {
            let cause = format!("the step of a slice of rows is {}", rows.step);
            return Err(PyValueError::new_err(format!("{cause}\n  help: leave the step out")));
        }
        let batch = self.batch.slice(rows.start.max(0) as usize, rows.slicelength);
        Ok(Self { schema: self.schema.clone(), batch })
    }

    fn column_index(&self, name: &str) -> PyResult<usize> {
        let position = self.schema.columns.iter().position(|column| column.name == name);
        position.ok_or_else(|| {
            let table = &self.schema.name;
            let known: Vec<_> = self.schema.columns.iter().map(|c| c.name.as_str()).collect();
            let known = known.join(", ");
            PyKeyError::new_err(format!("no column `{name}` in `{table}`; it has {known}"))
        })
    }
}

#[pymethods]
impl Table {
    /// Name of the table.
    #[getter]
    fn name(&self) -> &str {
        &self.schema.name
    }

    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<&str> {
        self.schema.columns.iter().map(|column| column.name.as_str()).collect()
    }

    /// Units by column, for the columns that have one.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for column in &self.schema.columns {
            if let Some(unit) = column.unit() {
                dict.set_item(&column.name, unit)?;
            }
        }
        Ok(dict)
    }

    /// One sentence about each column, by name.
    #[getter]
    fn meanings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for column in &self.schema.columns {
            dict.set_item(&column.name, &column.meaning)?;
        }
        Ok(dict)
    }

    /// Facts that hold for all rows, such as the side of a box.
    #[getter]
    fn about<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.schema.about.iter().try_for_each(|(name, fact)| dict.set_item(name, fact))?;
        Ok(dict)
    }

    /// The values of a column as a NumPy array, by its name. Missing numbers are NaN, and the array is float64 then; text
    /// and truth values are an array of objects, None where they are missing. By a list of names the table of these columns,
    /// and by a slice that of these rows.
    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        key: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let Ok(name) = key.extract::<String>() {
            let position = self.column_index(&name)?;
            let ty = self.schema.columns[position].ty;
            return to_numpy_column(py, self.batch.column(position), ty);
        }
        if let Ok(slice) = key.cast::<PySlice>() {
            return self.slice(slice)?.into_bound_py_any(py);
        }
        if let Ok(names) = key.extract::<Vec<String>>() {
            return self.select(names)?.into_bound_py_any(py);
        }
        let what = key.get_type().name()?;
        let remedy = "give the name of a column, a list of names, or a slice of rows; `head` has rows as tuples";
        Err(PyTypeError::new_err(format!(
            "a table has no item of the type {what}\n  help: {remedy}"
        )))
    }

    /// Names of the columns: `dict(table)` has all of them as arrays.
    ///
    /// >>> sorted(dict(table)) == sorted(table.columns)
    /// True
    fn keys(&self) -> Vec<&str> {
        self.columns()
    }

    /// Refuses to iterate: over rows or over columns, programs would disagree.
    fn __iter__(&self) -> PyResult<Bound<'_, PyAny>> {
        let remedy = "`columns` has the names, `dict(table)` the columns, `head` rows; a data frame is \
                      pandas.DataFrame.from_arrow(table) or polars.DataFrame(table)";
        Err(PyTypeError::new_err(format!("a table is not iterated\n  help: {remedy}")))
    }

    /// Returns the same rows with only these columns, in this order; nothing is copied.
    ///
    /// Raises KeyError when there is no such column.
    ///
    /// >>> table.select(["body", "cycle"])
    /// Table(trajectories, 10 rows: body, cycle)
    fn select(&self, columns: Vec<String>) -> PyResult<Self> {
        let places =
            columns.iter().map(|name| self.column_index(name)).collect::<PyResult<Vec<_>>>()?;
        let batch = self.batch.project(&places).map_err(|e| arrow_error(&e))?;
        let specs = places.iter().map(|&k| self.schema.columns[k].clone()).collect();
        Ok(Self { schema: TableSchema { columns: specs, ..self.schema.clone() }, batch })
    }

    /// Pickles all rows: a task of a process pool returns what it recorded.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickle<'py, PickledTable<'py>>> {
        let rows = pickle::arrow_bytes(&self.batch).map_err(|e| arrow_error(&e))?;
        let rows = PyBytes::new(py, &rows);
        let checksum = pickle::checksum(&rows)?;
        let TableSchema { name, about, .. } = &self.schema;
        let values = (name.clone(), about.clone(), rows, checksum);
        Ok((pickle::maker(py, "unpack_table")?, values))
    }

    fn __contains__(&self, name: &str) -> bool {
        self.schema.columns.iter().any(|column| column.name == name)
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __repr__(&self) -> String {
        let columns = self.columns().join(", ");
        format!("Table({}, {} rows: {columns})", self.schema.name, self.batch.num_rows())
    }

    /// Returns the first rows, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        to_html(slf.as_any(), "table")
    }

    /// Returns the first rows as tuples of Python values; None where one is missing.
    ///
    /// >>> [row[:2] for row in table.head(2)]
    /// [(0, 0), (1, 0)]
    #[pyo3(signature = (rows=UnsignedArg::new(5)), text_signature = "($self, rows=5)")]
    fn head<'py>(&self, py: Python<'py>, rows: UnsignedArg) -> PyResult<Vec<Bound<'py, PyTuple>>> {
        let rows =
            self.batch.num_rows().min(usize::try_from(rows.named("rows")?).unwrap_or(usize::MAX));
        let first = self.batch.slice(0, rows);
        let mut columns = Vec::new();
        for (array, spec) in first.columns().iter().zip(&self.schema.columns) {
            columns.push(to_python_values(py, array, spec.ty)?);
        }
        let mut head = Vec::with_capacity(rows);
        for k in 0..rows {
            let cells = columns.iter().map(|column: &Bound<'_, PyList>| column.get_item(k));
            head.push(PyTuple::new(py, cells.collect::<PyResult<Vec<_>>>()?)?);
        }
        Ok(head)
    }

    /// The schema as an Arrow capsule.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema =
            FFI_ArrowSchema::try_from(&*self.batch.schema()).map_err(|e| arrow_error(&e))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    /// The rows as an Arrow capsule; the numbers are not copied.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The Arrow PyCapsule protocol allows a producer to ignore it.
        let _ = requested_schema;
        let batches = vec![Ok::<_, ArrowError>(self.batch.clone())];
        let reader: Box<dyn RecordBatchReader + Send> =
            Box::new(RecordBatchIterator::new(batches, self.batch.schema()));
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(reader), c"arrow_array_stream")
    }
}

/// The arguments of [`unpack_table`].
type PickledTable<'py> = (String, Vec<(String, String)>, Bound<'py, PyBytes>, u32);

/// Returns one sentence about a column of a table of runs.
fn column_description(column: &RunColumn, infos: &[MetricInfo]) -> String {
    let description = match column.role {
        Role::Trial => "Number of the run.",
        Role::Variant => "Number of its variant.",
        Role::Replicate => {
            "Number of the run among those of its variant; equal ones have the same seed."
        }
        Role::Seed => "The seed.",
        Role::Parameter => "Value of this key in the scenario.",
        Role::Metric => metric_label(infos, &column.name).meaning,
        Role::Digest => "Digest of the last state.",
        Role::Cost => "A time that the run took; it differs when the run is made again.",
        Role::Cycle => "Number of cycles done before the row.",
        Role::Series => metric_label(infos, &column.name).meaning,
    };
    description.to_string()
}

fn arrow_error(error: &ArrowError) -> PyErr {
    error::RecordError::new_err(format!("this is a bug in sidestep: {error}"))
}

fn field(spec: &ColumnSpec) -> Field {
    let ty = match spec.ty {
        ColumnType::U32 => DataType::UInt32,
        ColumnType::U64 => DataType::UInt64,
        ColumnType::I32 => DataType::Int32,
        ColumnType::I64 => DataType::Int64,
        ColumnType::F64 => DataType::Float64,
        ColumnType::Bool => DataType::Boolean,
        ColumnType::Label => {
            DataType::Dictionary(Box::new(DataType::UInt32), Box::new(DataType::Utf8))
        }
        ColumnType::Text => DataType::Utf8,
    };
    let unit = spec.unit().map(|unit| ("unit".to_string(), unit.to_string()));
    let meaning = ("meaning".to_string(), spec.meaning.clone());
    let about: HashMap<_, _> = [Some(meaning), unit].into_iter().flatten().collect();
    Field::new(&spec.name, ty, spec.is_nullable).with_metadata(about)
}

/// Returns the specification of a column from its field and its values.
fn spec(field: &Field, array: &ArrayRef) -> Result<ColumnSpec, String> {
    let ty = match field.data_type() {
        DataType::UInt32 => ColumnType::U32,
        DataType::UInt64 => ColumnType::U64,
        DataType::Int32 => ColumnType::I32,
        DataType::Int64 => ColumnType::I64,
        DataType::Float64 => ColumnType::F64,
        DataType::Boolean => ColumnType::Bool,
        DataType::Utf8 => ColumnType::Text,
        DataType::Dictionary(keys, values)
            if **keys == DataType::UInt32 && **values == DataType::Utf8 =>
        {
            ColumnType::Label
        }
        other => return Err(format!("column `{}` has the type {other}", field.name())),
    };
    let mut labels = Vec::new();
    if let Some(dictionary) = array.as_dictionary_opt::<UInt32Type>() {
        let names = dictionary.values().as_string::<i32>();
        labels.extend(names.iter().map(|name| name.unwrap_or_default().to_string()));
    }
    let meaning = field.metadata().get("meaning").map_or("", String::as_str);
    Ok(ColumnSpec {
        labels,
        is_nullable: field.is_nullable(),
        ..ColumnSpec::new(field.name(), ty, meaning)
    })
}

fn array(spec: &ColumnSpec, values: ColumnValues) -> Result<ArrayRef, ArrowError> {
    Ok(match values {
        ColumnValues::U32(cells) => numbers::<_, UInt32Type>(cells),
        ColumnValues::U64(cells) => numbers::<_, UInt64Type>(cells),
        ColumnValues::I32(cells) => numbers::<_, Int32Type>(cells),
        ColumnValues::I64(cells) => numbers::<_, Int64Type>(cells),
        ColumnValues::F64(cells) => numbers::<_, Float64Type>(cells),
        ColumnValues::Bool(cells) => {
            Arc::new(cells.iter_with_missing().map(|cell| cell.copied()).collect::<BooleanArray>())
        }
        ColumnValues::Label(cells) => {
            let (keys, valid) = cells.into_parts();
            let keys = UInt32Array::new(ScalarBuffer::from(keys), valid.map(NullBuffer::from));
            let labels: ArrayRef = Arc::new(StringArray::from_iter_values(&spec.labels));
            Arc::new(DictionaryArray::<UInt32Type>::try_new(keys, labels)?)
        }
        ColumnValues::Text(texts) => Arc::new(texts.iter_with_missing().collect::<StringArray>()),
    })
}

/// Returns numbers as an Arrow array, without a copy.
fn numbers<T, A>(cells: Cells<T>) -> ArrayRef
where
    A: arrow_array::ArrowPrimitiveType<Native = T>,
    T: arrow_buffer::ArrowNativeType,
{
    let (values, valid) = cells.into_parts();
    let nulls = valid.map(NullBuffer::from);
    Arc::new(PrimitiveArray::<A>::new(ScalarBuffer::from(values), nulls))
}

/// Returns the cells of a column as Python values.
fn to_python_values<'py>(
    py: Python<'py>,
    array: &ArrayRef,
    ty: ColumnType,
) -> PyResult<Bound<'py, PyList>> {
    match ty {
        ColumnType::U32 => to_list(py, array.as_primitive::<UInt32Type>()),
        ColumnType::U64 => to_list(py, array.as_primitive::<UInt64Type>()),
        ColumnType::I32 => to_list(py, array.as_primitive::<Int32Type>()),
        ColumnType::I64 => to_list(py, array.as_primitive::<Int64Type>()),
        ColumnType::F64 => to_list(py, array.as_primitive::<Float64Type>()),
        ColumnType::Bool => to_list(py, array.as_boolean()),
        ColumnType::Text => to_list(py, array.as_string::<i32>()),
        ColumnType::Label => {
            let labels = array.as_dictionary::<UInt32Type>();
            let names = labels.values().as_string::<i32>();
            to_list(py, labels.keys().iter().map(|key| key.map(|key| names.value(key as usize))))
        }
    }
}

/// Returns a column for NumPy; integers of which some are missing become floats, because only those have NaN.
fn to_numpy_column<'py>(
    py: Python<'py>,
    array: &ArrayRef,
    ty: ColumnType,
) -> PyResult<Bound<'py, PyAny>> {
    match ty {
        ColumnType::U32 => to_numpy(array.as_primitive::<UInt32Type>(), py, f64::from),
        ColumnType::U64 => to_numpy(array.as_primitive::<UInt64Type>(), py, |value| value as f64),
        ColumnType::I32 => to_numpy(array.as_primitive::<Int32Type>(), py, f64::from),
        ColumnType::I64 => to_numpy(array.as_primitive::<Int64Type>(), py, |value| value as f64),
        ColumnType::F64 => to_numpy(array.as_primitive::<Float64Type>(), py, |value| value),
        // As objects, because they may be missing (None); they can still be compared and used as a mask.
        ColumnType::Bool | ColumnType::Text | ColumnType::Label => {
            py.import("numpy")?.call_method1("array", (to_python_values(py, array, ty)?, "O"))
        }
    }
}

fn to_numpy<'py, A>(
    array: &PrimitiveArray<A>,
    py: Python<'py>,
    as_real: impl Fn(A::Native) -> f64,
) -> PyResult<Bound<'py, PyAny>>
where
    A: arrow_array::ArrowPrimitiveType,
    A::Native: numpy::Element,
{
    if array.null_count() == 0 {
        return PyArray1::from_slice(py, array.values()).into_bound_py_any(py);
    }
    let real: Vec<f64> = array.iter().map(|cell| cell.map_or(f64::NAN, &as_real)).collect();
    real.to_pyarray(py).into_bound_py_any(py)
}

/// Makes a table again.
///
/// Raises InputError when the bytes are damaged.
#[pyfunction]
pub(crate) fn unpack_table(
    name: String,
    about: Vec<(String, String)>,
    rows: &Bound<'_, PyBytes>,
    expected: u32,
) -> PyResult<Table> {
    let damaged = |cause: String| {
        argument_error("rows", cause, "give the bytes that a pickle of a table holds, unchanged")
    };
    if pickle::checksum(rows)? != expected {
        return Err(damaged("they do not have their checksum".into()));
    }
    let mut reader =
        StreamReader::try_new(rows.as_bytes(), None).map_err(|e| damaged(e.to_string()))?;
    let batch = reader.next().ok_or_else(|| damaged("they hold no rows".into()))?;
    Table::from_arrow(name, about, batch.map_err(|e| damaged(e.to_string()))?).map_err(damaged)
}
