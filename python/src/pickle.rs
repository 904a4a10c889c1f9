//! What travels between processes: each class is made again from plain values, by a function of the native module.

use arrow_array::RecordBatch;
use arrow_ipc::writer::StreamWriter;
use arrow_schema::ArrowError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sidestep::kernel::control::ValueDomain;
use std::path::PathBuf;

/// A pickle: the function that makes a class again, and its arguments.
pub(crate) type Pickle<'py, T> = (Bound<'py, PyAny>, T);

/// Returns a function of the native module, by which a class is made again.
pub(crate) fn maker<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("sidestep._native")?.getattr(name)
}

/// The bounds of a space: its choices, or its least and greatest value.
#[derive(FromPyObject, IntoPyObject)]
pub(crate) enum SpaceBounds {
    Choices(Vec<String>),
    Whole((i64, i64)),
    Real((f64, f64)),
}

impl From<&ValueDomain> for SpaceBounds {
    fn from(domain: &ValueDomain) -> Self {
        match domain {
            ValueDomain::Discrete(names) => Self::Choices(names.clone()),
            &ValueDomain::Integer { low, high } => Self::Whole((low, high)),
            &ValueDomain::Real { low, high } => Self::Real((low, high)),
        }
    }
}

impl From<SpaceBounds> for ValueDomain {
    fn from(bounds: SpaceBounds) -> Self {
        match bounds {
            SpaceBounds::Choices(names) => Self::Discrete(names),
            SpaceBounds::Whole((low, high)) => Self::Integer { low, high },
            SpaceBounds::Real((low, high)) => Self::Real { low, high },
        }
    }
}

/// Returns rows as a stream of Arrow's own format.
pub(crate) fn arrow_bytes(batch: &RecordBatch) -> Result<Vec<u8>, ArrowError> {
    let mut writer = StreamWriter::try_new(Vec::new(), &batch.schema())?;
    writer.write(batch)?;
    writer.into_inner()
}

/// Returns a checksum: readers of Arrow's format trust lengths, and end the program where these are damaged.
pub(crate) fn checksum(rows: &Bound<'_, PyBytes>) -> PyResult<u32> {
    rows.py().import("zlib")?.call_method1("crc32", (rows,))?.extract()
}

/// The files of an arm: paths, and their texts as they were read.
#[derive(Clone, FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ArmSource {
    pub(crate) urdf: (PathBuf, String),
    pub(crate) srdf: Option<(PathBuf, String)>,
    pub(crate) base: Option<String>,
    pub(crate) tip: Option<String>,
    pub(crate) group: Option<String>,
}
