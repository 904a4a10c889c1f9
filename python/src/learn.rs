//! Error models of sensors and effectors, learned from tables.

use crate::columns::LogColumns;
use crate::error::{self, argument_error};
use crate::json::to_python;
use crate::pickle::{self, Pickle};
use crate::watch::{ProgressReporter, run_counting};
use pyo3::prelude::*;
use serde_json::Value;
use sidestep::kernel::InputError;
use sidestep::learn::EstimateOptions;
use sidestep::learn::columns::ColumnTable;
use sidestep::learn::effector::{self, EffectorOptions, LearnedEffector};
use sidestep::learn::log_table::LogTable;
use sidestep::learn::profile;
use sidestep::learn::sensor::{self, LearnedSensor, RunSensorOptions, SensorOptions};
use sidestep::learn::watched_table::WatchedTable;
use sidestep_session::{RecordedCsv, csv_table};
use std::path::PathBuf;

/// A learned error model: its counts, probabilities with intervals, and its form in a profile.
///
/// What the learner knows beside is not kept: of these parts a pickle makes it again.
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Learned {
    kind: &'static str,
    /// All the output of `sidestep learn --json`.
    report: Value,
    /// The report for people.
    text: String,
    /// A profile of it alone.
    profile: String,
}

const SENSOR: &str = "sensor";
const EFFECTOR: &str = "effector";

impl Learned {
    fn from_sensor(model: &LearnedSensor) -> PyResult<Self> {
        Ok(Self {
            kind: SENSOR,
            report: serde_json::to_value(&model.report).map_err(|e| json_error(&e))?,
            text: model.report.to_string(),
            profile: profile::of_sensor(model).map_err(|e| error::input_error(&e))?,
        })
    }

    fn from_effector(model: &LearnedEffector) -> PyResult<Self> {
        Ok(Self {
            kind: EFFECTOR,
            report: serde_json::to_value(&model.report).map_err(|e| json_error(&e))?,
            text: model.report.to_string(),
            profile: profile::of_effector(model).map_err(|e| error::input_error(&e))?,
        })
    }
}

fn json_error(error: &serde_json::Error) -> PyErr {
    error::RecordError::new_err(error.to_string())
}

#[pymethods]
impl Learned {
    /// The kind of the device: a sensor or an effector.
    #[getter]
    fn kind(&self) -> &'static str {
        self.kind
    }

    /// All the output of `sidestep learn --json`: counts, probabilities with their counts and 95 % intervals, thin
    /// rows, tests of the fit on events held out, warnings.
    #[getter]
    fn report(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &self.report)
    }

    /// Returns the text of a profile with it under this name: a new one, or `text` with it added or replaced.
    ///
    /// Raises InputError when the text is no profile, or the name does not fit.
    ///
    /// See :func:`sidestep.learn.effector` for an example.
    #[pyo3(signature = (name, text=None))]
    fn profile(&self, name: &str, text: Option<&str>) -> PyResult<String> {
        let empty = profile::empty(name);
        let written = profile::with_learned("profile", text.unwrap_or(&empty), name, &self.profile);
        written.map_err(|e| error::input_error(&e))
    }

    /// Pickles it: a task of a process pool returns what it learned.
    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Pickle<'py, (&'static str, String, String, String)>> {
        let values = (self.kind, self.report.to_string(), self.text.clone(), self.profile.clone());
        Ok((pickle::maker(py, "unpack_learned")?, values))
    }

    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        format!("Learned({})", self.kind)
    }
}

/// Makes a learned error model again.
///
/// Raises InputError when the texts are not those of one.
#[pyfunction]
pub(crate) fn unpack_learned(
    kind: &str,
    report: &str,
    text: String,
    profile: String,
) -> PyResult<Learned> {
    let damaged = |cause: String| {
        argument_error("learned", cause, "give the texts that a pickle holds, unchanged")
    };
    let kind = match kind {
        SENSOR => SENSOR,
        EFFECTOR => EFFECTOR,
        other => return Err(damaged(format!("`{other}` is no kind of device"))),
    };
    let report = serde_json::from_str(report).map_err(|e| damaged(e.to_string()))?;
    profile::with_learned("profile", &profile::empty("any"), "any", &profile)
        .map_err(|e| damaged(e.cause().to_string()))?;
    Ok(Learned { kind, report, text, profile })
}

/// A table, and how to learn from it, as passed by `sidestep.learn`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LearnOptions {
    /// The columns of the table.
    columns: Option<Py<LogColumns>>,
    /// Or the folder of a run that recorded it.
    run: Option<PathBuf>,
    /// What the recording says of all rows of the columns, if they come from one.
    facts: Vec<(String, String)>,
    alpha: f64,
    hold_out_every: usize,
    max_unexplained: f64,
    /// A function that is told the rows that are read and all, or True for a bar.
    progress: Option<Py<PyAny>>,
}

impl LearnOptions {
    /// Takes the columns as a table; `name` stands for it in errors.
    fn take_table(&self, py: Python<'_>, name: &str) -> PyResult<ColumnTable> {
        let taken = match &self.columns {
            Some(columns) => columns.borrow_mut(py).take_table(name),
            None => ColumnTable::new(name, Vec::new()),
        };
        taken.map_err(|e| error::input_error(&e))
    }

    /// Learns in another thread, where `learn` gets a function that has its table watched.
    fn run<T: Send>(
        &self,
        py: Python<'_>,
        learn: impl FnOnce(&TableReader<'_>) -> Result<T, InputError> + Send,
    ) -> PyResult<T> {
        let asked = self.progress.as_ref().map(|progress| progress.bind(py));
        let reporter = ProgressReporter::from_argument(asked, "row")?;
        let learned = run_counting(py, reporter.as_ref(), |count| learn(&TableReader { count }));
        if let Some(reporter) = &reporter {
            reporter.close(py)?;
        }
        learned?.map_err(|e| error::input_error(&e))
    }

    fn estimate(&self) -> EstimateOptions {
        let Self { alpha, hold_out_every, max_unexplained, .. } = *self;
        EstimateOptions { alpha, hold_out_every, max_unexplained, ..EstimateOptions::default() }
    }
}

/// Counts the rows of the tables that are learned from.
struct TableReader<'c> {
    count: &'c (dyn Fn(u64, u64) -> bool + Sync),
}

impl TableReader<'_> {
    /// Learns from a table whose rows are counted.
    fn read<T>(&self, table: &dyn LogTable, learn: impl FnOnce(&dyn LogTable) -> T) -> T {
        let all = table.row_count() as u64;
        let watch = |rows: usize| (self.count)(rows as u64, all);
        learn(&WatchedTable::new(table, &watch))
    }
}

/// The effector to learn, as passed by `sidestep.learn.effector`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct EffectorChoice {
    box_m: Option<f64>,
    effector: Option<String>,
    robots: Vec<u32>,
}

/// Learns an effector: the native part of `sidestep.learn.effector`.
#[pyfunction]
pub(crate) fn learn_effector(
    py: Python<'_>,
    options: LearnOptions,
    choice: EffectorChoice,
) -> PyResult<Learned> {
    let EffectorChoice { box_m, effector, robots } = choice;
    let chosen = EffectorOptions { estimate: options.estimate(), box_m, effector, robots };
    let table = options.take_table(py, "motions")?;
    let LearnOptions { run, facts, .. } = &options;
    let learned = options.run(py, |reader| match run {
        Some(run) => {
            let RecordedCsv { table, facts } = csv_table(run, "motions")?;
            reader.read(&table, |table| effector::learn_run(table, &facts, &chosen))
        }
        None if facts.is_empty() => {
            reader.read(&table, |table| effector::learn_csv(table, &chosen))
        }
        None => reader.read(&table, |table| effector::learn_run(table, facts, &chosen)),
    });
    Learned::from_effector(&learned?)
}

/// The shape of a sensor, as passed by `sidestep.learn.sensor`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SensorShape {
    edges_m: Option<Vec<f64>>,
    classes: Vec<String>,
    bearings_deg: Option<Vec<f64>>,
    range_m: Option<f64>,
    sensor: Option<String>,
    beam: bool,
}

/// Learns a sensor: the native part of `sidestep.learn.sensor`.
#[pyfunction]
pub(crate) fn learn_sensor(
    py: Python<'_>,
    options: LearnOptions,
    shape: SensorShape,
) -> PyResult<Learned> {
    let table = options.take_table(py, "readings")?;
    let LearnOptions { run, facts, .. } = &options;
    let estimate = options.estimate();
    let learned = options.run(py, |reader| match run {
        Some(run) => {
            let mut recorded = csv_table(run, "readings")?;
            let RecordedCsv { table, facts } = &recorded;
            let name = sensor::recorded_table(table, facts, shape.sensor.as_deref());
            if name != "readings" {
                recorded = csv_table(run, name)?;
            }
            let chosen = run_options(estimate, shape);
            let RecordedCsv { table, facts } = &recorded;
            reader.read(table, |table| sensor::learn_run(table, facts, &chosen))
        }
        None if !facts.is_empty() => {
            let chosen = run_options(estimate, shape);
            reader.read(&table, |table| sensor::learn_run(table, facts, &chosen))
        }
        None => {
            let default = SensorOptions::default();
            let sensor_options = SensorOptions {
                estimate,
                distance_edges_m: shape.edges_m.unwrap_or(default.distance_edges_m),
                distance_classes: shape.classes,
                bearings_deg: shape.bearings_deg.unwrap_or(default.bearings_deg),
                range_m: shape.range_m.unwrap_or(default.range_m),
                sensor: shape.sensor,
                beam: shape.beam,
            };
            reader.read(&table, |table| sensor::learn_csv(table, &sensor_options))
        }
    });
    Learned::from_sensor(&learned?)
}

/// Returns the options for a recording, which knows what is left out of the shape.
fn run_options(estimate: EstimateOptions, shape: SensorShape) -> RunSensorOptions {
    RunSensorOptions {
        estimate,
        sensor: shape.sensor,
        distance_edges_m: shape.edges_m,
        distance_classes: shape.classes,
        bearings_deg: shape.bearings_deg,
        range_m: shape.range_m,
    }
}
