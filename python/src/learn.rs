//! Error models of sensors and effectors, learned from tables.

use crate::error;
use crate::json::to_python;
use pyo3::prelude::*;
use sidestep::import::table::CsvTable;
use sidestep::kernel::InputError;
use sidestep::learn::EstimateOptions;
use sidestep::learn::effector::{self, EffectorOptions, LearnedEffector};
use sidestep::learn::profile;
use sidestep::learn::sensor::{self, LearnedSensor, RunSensorOptions, SensorOptions};
use sidestep_session::{RecordedCsv, csv_table};
use std::path::PathBuf;

/// A learned error model: its counts, probabilities with intervals, and its form in a profile.
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Learned(Model);

enum Model {
    Sensor(Box<LearnedSensor>),
    Effector(Box<LearnedEffector>),
}

#[pymethods]
impl Learned {
    /// The kind of the device: a sensor or an effector.
    #[getter]
    fn kind(&self) -> &'static str {
        match self.0 {
            Model::Sensor(_) => "sensor",
            Model::Effector(_) => "effector",
        }
    }

    /// All the output of `sidestep learn --json`: counts, probabilities with their counts and 95 % intervals, thin
    /// rows, tests of the fit on events held out, warnings.
    #[getter]
    fn report(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let value = match &self.0 {
            Model::Sensor(model) => serde_json::to_value(&model.report),
            Model::Effector(model) => serde_json::to_value(&model.report),
        };
        let value = value.map_err(|e| error::RecordError::new_err(e.to_string()))?;
        to_python(py, &value)
    }

    /// Returns the text of a profile with it under this name: a new one, or `text` with it added or replaced.
    ///
    /// Raises InputError when the text is no profile, or the name does not fit.
    ///
    /// See :func:`sidestep.learn.effector` for an example.
    #[pyo3(signature = (name, text=None))]
    fn profile(&self, name: &str, text: Option<&str>) -> PyResult<String> {
        let empty = profile::empty(name);
        let text = text.unwrap_or(&empty);
        let written = match &self.0 {
            Model::Sensor(model) => profile::with_sensor("profile", text, name, model),
            Model::Effector(model) => profile::with_effector("profile", text, name, model),
        };
        written.map_err(|e| error::input_error(&e))
    }

    fn __str__(&self) -> String {
        match &self.0 {
            Model::Sensor(model) => model.report.to_string(),
            Model::Effector(model) => model.report.to_string(),
        }
    }

    fn __repr__(&self) -> String {
        format!("Learned({})", self.kind())
    }
}

/// A table, and how to learn from it, as passed by `sidestep.learn`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LearnOptions {
    /// The table as CSV text.
    text: Option<String>,
    /// Or the folder of a run that recorded it.
    run: Option<PathBuf>,
    /// What the recording says of all rows of the text, if they come from one.
    facts: Vec<(String, String)>,
    alpha: f64,
    hold_out_every: usize,
    max_unexplained: f64,
}

impl LearnOptions {
    /// Returns the table that was passed as text; `name` stands for it in errors.
    fn parse_table(&self, name: &str) -> Result<CsvTable, InputError> {
        CsvTable::parse(&name, self.text.as_deref().unwrap_or_default())
    }

    fn estimate(&self) -> EstimateOptions {
        let Self { alpha, hold_out_every, max_unexplained, .. } = *self;
        EstimateOptions { alpha, hold_out_every, max_unexplained, ..EstimateOptions::default() }
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
    let learned = py.detach(|| match &options.run {
        Some(run) => {
            let recorded = csv_table(run, "motions")?;
            effector::learn_run(&recorded.table, &recorded.facts, &chosen)
        }
        None if options.facts.is_empty() => {
            effector::learn_csv(&options.parse_table("motions")?, &chosen)
        }
        None => effector::learn_run(&options.parse_table("motions")?, &options.facts, &chosen),
    });
    let model = learned.map_err(|e| error::input_error(&e))?;
    Ok(Learned(Model::Effector(Box::new(model))))
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
    let learned = py.detach(|| match &options.run {
        Some(run) => {
            let mut recorded = csv_table(run, "readings")?;
            let RecordedCsv { table, facts } = &recorded;
            let name = sensor::recorded_table(table, facts, shape.sensor.as_deref());
            if name != "readings" {
                recorded = csv_table(run, name)?;
            }
            let chosen = run_options(options.estimate(), shape);
            sensor::learn_run(&recorded.table, &recorded.facts, &chosen)
        }
        None if !options.facts.is_empty() => {
            let chosen = run_options(options.estimate(), shape);
            sensor::learn_run(&options.parse_table("readings")?, &options.facts, &chosen)
        }
        None => {
            let default = SensorOptions::default();
            let sensor_options = SensorOptions {
                estimate: options.estimate(),
                distance_edges_m: shape.edges_m.unwrap_or(default.distance_edges_m),
                distance_classes: shape.classes,
                bearings_deg: shape.bearings_deg.unwrap_or(default.bearings_deg),
                range_m: shape.range_m.unwrap_or(default.range_m),
                sensor: shape.sensor,
                beam: shape.beam,
            };
            sensor::learn_csv(&options.parse_table("readings")?, &sensor_options)
        }
    });
    let model = learned.map_err(|e| error::input_error(&e))?;
    Ok(Learned(Model::Sensor(Box::new(model))))
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
