//! What travels between processes: each class is made again from plain values, by a function of the native module.

use crate::arm::Arm;
use crate::batch::Batch;
use crate::error::{self, argument_error};
use crate::scenario::{Bundle, unpack_scenario};
use crate::space::{Space, Team};
use crate::table::Table;
use arrow_array::RecordBatch;
use arrow_ipc::reader::StreamReader;
use arrow_ipc::writer::StreamWriter;
use arrow_schema::ArrowError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sidestep::arms::kinematics::ArmFiles;
use sidestep::kernel::control::{AgentTeam, ValueDomain, ValueSpace};
use std::path::PathBuf;
use std::sync::Arc;

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

/// Makes a space again.
#[pyfunction]
pub(crate) fn unpack_space(
    name: String,
    shape: Vec<usize>,
    bounds: SpaceBounds,
    meaning: String,
) -> Space {
    Space(ValueSpace::new(name, bounds.into(), meaning).with_shape(shape))
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
    Team(Arc::new(AgentTeam {
        name,
        agents,
        observation_spaces: spaces(observed),
        action_spaces: spaces(ordered),
    }))
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
    if checksum(rows)? != expected {
        return Err(damaged("they do not have their checksum".into()));
    }
    let mut reader =
        StreamReader::try_new(rows.as_bytes(), None).map_err(|e| damaged(e.to_string()))?;
    let batch = reader.next().ok_or_else(|| damaged("they hold no rows".into()))?;
    Table::from_arrow(name, about, batch.map_err(|e| damaged(e.to_string()))?).map_err(damaged)
}

/// The files of an arm: paths, and their texts as they were read.
#[derive(Clone, FromPyObject, IntoPyObject)]
pub(crate) struct ArmSource {
    pub(crate) urdf: (PathBuf, String),
    pub(crate) srdf: Option<(PathBuf, String)>,
    pub(crate) base: Option<String>,
    pub(crate) tip: Option<String>,
    pub(crate) group: Option<String>,
}

/// Makes an arm again: from its files, where they still hold the same texts, as they do on the same machine; else from
/// these texts alone, without the meshes that the files name.
///
/// Raises InputError when a text is wrong.
#[pyfunction]
pub(crate) fn unpack_arm(source: ArmSource) -> PyResult<Arm> {
    let is_there = |(path, text): &(PathBuf, String)| {
        std::fs::read_to_string(path).is_ok_and(|found| found == *text)
    };
    if is_there(&source.urdf) && source.srdf.as_ref().is_none_or(is_there) {
        return Arm::load(source);
    }
    let folder = tempfile::tempdir().map_err(|e| error::RecordError::new_err(e.to_string()))?;
    let copy = |name: &str, text: &str| -> PyResult<PathBuf> {
        let copy = folder.path().join(name);
        let written = std::fs::write(&copy, text);
        written.map_err(|e| error::RecordError::new_err(format!("{}: {e}", copy.display())))?;
        Ok(copy)
    };
    let files = ArmFiles {
        urdf: copy("arm.urdf", &source.urdf.1)?,
        srdf: source.srdf.as_ref().map(|(_, text)| copy("arm.srdf", text)).transpose()?,
        base: source.base.clone(),
        tip: source.tip.clone(),
        group: source.group.clone(),
    };
    Arm::load_files(&files, source)
}

/// Makes many worlds again, each in its state.
///
/// Raises InputError when a state is damaged or of another build.
#[pyfunction]
pub(crate) fn unpack_batch(
    py: Python<'_>,
    scenario: Bundle,
    seeds: Vec<u64>,
    workers: usize,
    states: Vec<Vec<u8>>,
) -> PyResult<Batch> {
    let scenario = unpack_scenario(py, scenario.0, scenario.1)?;
    Batch::from_states(py, scenario.0, &seeds, workers, states)
}
