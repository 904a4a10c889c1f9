//! Sweeps: the plan, the journal and the stopping rule of the command, with runs on threads or by an executor in Python.

use crate::choice::choose;
use crate::error::{self, argument_error};
use crate::json::{to_python, to_toml};
use crate::result::{Fields, ResultClass};
use crate::scenario::{Bundle, LoadedScenario, load};
use crate::table::Table;
use crate::watch::{ProgressReporter, SignalWatcher, run_polling, run_reporting};
use crate::worlds;
use pyo3::exceptions::PyStopIteration;
use pyo3::prelude::*;
use pyo3::types::PyMapping;
use serde_json::json;
use sidestep::experiment::sweep::{
    BaselineSpec, Factor, Outcome, Plan, Precision, RunColumn, SeriesBand, Setting, Sweep,
    SweepOverrides, Trial, series_bands,
};
use sidestep::kernel::ports::{ColumnSpec, ColumnValues, TableSchema};
use sidestep::kernel::workers::available_workers;
use sidestep::kernel::{InputError, Interrupt};
use sidestep::scenario::{ResolvedScenario, Source};
use sidestep::statistics::Interval;
use sidestep::worlds::airspace::scenario::CompiledAirspace;
use sidestep::worlds::airspace::settings::BuiltInMethod;
use sidestep_papers::methods;
use sidestep_session::sweep::{
    self, Engine, Folder, OutcomeSink, SweepEnd, Task, TrialBatch, TrialExecutor,
};
use sidestep_session::{Error, Watcher};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// The changes of a sweep, as passed by `sidestep.sweep`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SweepOptions<'py> {
    vary: Option<Bound<'py, PyMapping>>,
    set: Option<Bound<'py, PyMapping>>,
    replicate: Option<u32>,
    until: Option<String>,
    max_runs: Option<u32>,
    metrics: Vec<String>,
    baseline: Option<Bound<'py, PyMapping>>,
    baseline_name: Option<String>,
    seed: Option<u64>,
    record: bool,
    series: Option<Vec<String>>,
    progress: Option<Bound<'py, PyAny>>,
}

/// A requested sweep, read and not compiled yet.
struct SweepRequest {
    sweep: Sweep,
    /// The scenario that it varies, if it was given one: an unpickled scenario deletes its temporary files when it is
    /// dropped, and the sweep reads them.
    _loaded: Option<Arc<LoadedScenario>>,
}

fn parse_settings(mapping: Option<&Bound<'_, PyMapping>>) -> PyResult<Vec<Setting>> {
    let Some(mapping) = mapping else { return Ok(Vec::new()) };
    let mut settings = Vec::new();
    for entry in mapping.items()?.iter() {
        let (key, value): (String, Bound<'_, PyAny>) = entry.extract()?;
        settings.push(Setting { value: to_toml(&value, &key)?, key });
    }
    Ok(settings)
}

/// Parses the precision that ends a sweep, in the notation of `--until`.
fn parse_precision(text: &str) -> PyResult<Precision> {
    text.parse().map_err(|cause: String| {
        let remedy =
            "write \"ci=0.05\" (half width as a share of the mean) or \"abs=2.5\" (in units)";
        argument_error("until", cause, remedy)
    })
}

impl SweepOptions<'_> {
    fn factors(&self) -> PyResult<Vec<Factor>> {
        let settings = parse_settings(self.vary.as_ref())?;
        settings.into_iter().map(parse_factor).collect()
    }

    fn changes(&self) -> PyResult<SweepOverrides> {
        let has_baseline = self.baseline.is_some() || self.baseline_name.is_some();
        let baseline = BaselineSpec {
            name: self.baseline_name.clone(),
            settings: parse_settings(self.baseline.as_ref())?,
        };
        Ok(SweepOverrides {
            fixed: parse_settings(self.set.as_ref())?,
            factors: self.factors()?,
            until: self.until.as_deref().map(parse_precision).transpose()?,
            replicates: self.replicate,
            max_runs: self.max_runs,
            metrics: self.metrics.clone(),
            baseline: has_baseline.then_some(baseline),
            first_seed: self.seed,
            record: self.record,
            series: self.series.clone(),
        })
    }

    /// Returns the sweep of a file, a dict or a scenario.
    fn request(&self, of: &Bound<'_, PyAny>) -> PyResult<SweepRequest> {
        let (sweep, loaded) = parse_any(of)?;
        if self.max_runs.is_some() && self.until.is_none() && sweep.until.is_none() {
            let cause = "it bounds the runs of a sweep with a target precision";
            return Err(argument_error("max_runs", cause, "give until=\"ci=0.05\" as well"));
        }
        let sweep = sweep.with_overrides(self.changes()?).map_err(|e| error::input_error(&e))?;
        Ok(SweepRequest { sweep, _loaded: loaded })
    }
}

fn parse_factor(setting: Setting) -> PyResult<Factor> {
    let Setting { key, value } = setting;
    match value {
        toml::Value::Array(values) if !values.is_empty() => Ok(Factor { key, values }),
        _ => {
            let remedy = "give a list, such as {\"robots.count\": [10, 20]}; what does not vary belongs into `set`";
            Err(argument_error("vary", format!("`{key}` has no list of values"), remedy))
        }
    }
}

/// Returns the sweep of a sweep file, or of a dict of the same keys, or of a scenario in any form; and the scenario, in
/// the last case.
fn parse_any(of: &Bound<'_, PyAny>) -> PyResult<(Sweep, Option<Arc<LoadedScenario>>)> {
    if let Ok(path) = of.extract::<PathBuf>() {
        return Ok((Sweep::read(&path).map_err(|e| error::input_error(&e))?, None));
    }
    if let Ok(mapping) = of.cast::<PyMapping>()
        && mapping.contains("scenario")?
    {
        let mut table = crate::json::to_toml_table(mapping, "")?;
        table.entry("format").or_insert(toml::Value::Integer(1));
        let text = toml::to_string(&table).map_err(|e| {
            argument_error("sweep", e.to_string(), "give what a sweep file may hold")
        })?;
        let source = Source::new("sweep", text, "");
        return Ok((Sweep::parse(&source).map_err(|e| error::dict_input_error(&e))?, None));
    }
    let loaded = load(of)?;
    let sweep = Sweep::from_source(loaded.source()?.clone());
    Ok((sweep, Some(loaded)))
}

/// The outcome of a sweep.
struct SweepResult {
    results: Vec<RunColumn>,
    timings: Vec<RunColumn>,
    /// Metrics over time by run and cycle, and their means over the runs of each variant.
    series: Vec<RunColumn>,
    bands: Vec<SeriesBand>,
    /// The same JSON as that of `sidestep sweep --json`.
    summary: serde_json::Value,
    world: String,
}

/// Runs a sweep with an engine, in a folder or in memory.
fn run(
    sweep: &Sweep,
    out: Option<&PathBuf>,
    engine: Engine<'_>,
    watcher: &dyn Watcher,
) -> Result<Option<SweepResult>, Error> {
    let Some(out) = out else {
        let (plan, end) = sweep::run_in_memory(worlds::list(), sweep, engine, watcher)?;
        let SweepEnd::Done(done) = end else { return Ok(None) };
        return Ok(Some(sweep_result(&plan, None, &done)?));
    };
    let folder =
        sweep::open_or_create(worlds::list(), sweep, out, engine.planning_workers(), watcher)?;
    let end = sweep::run_remaining(worlds::list(), &folder, engine, watcher)?;
    let SweepEnd::Done(done) = end else { return Ok(None) };
    Ok(Some(sweep_result(folder.plan(), Some(&folder), &done)?))
}

fn sweep_result(
    plan: &Plan,
    folder: Option<&Folder>,
    done: &sweep::SweepResult,
) -> Result<SweepResult, InputError> {
    let summary = plan.summary(worlds::list(), &done.table)?;
    Ok(SweepResult {
        results: done.table.results().into_iter().cloned().collect(),
        timings: done.table.timings().into_iter().cloned().collect(),
        series: done.series.columns.clone(),
        bands: series_bands(&done.table, &done.series),
        summary: done.to_json(plan, folder, &summary),
        world: plan.world.clone(),
    })
}

/// An executor of trials in Python (such as one for Dask or Ray): a generator that is driven from here, so that its code
/// runs on the caller's thread and needs no callbacks into Rust.
struct PyExecutor {
    /// Called with the trials; returns a generator of requests and outcomes.
    begin: Py<PyAny>,
    /// Number of trials that it runs at the same time.
    parallelism: usize,
    /// The exception of the generator, which [`Error`] cannot carry.
    raised: Mutex<Option<PyErr>>,
}

/// A trial in the form used in Python, a named tuple of these: its number, variant, replicate and seed.
type TrialTuple = (u64, u32, u32, u64);

/// Returns a trial as `sidestep._engines.Trial`.
fn to_python_trial<'py>(py: Python<'py>, trial: &Trial) -> PyResult<Bound<'py, PyAny>> {
    Fields::new(py)
        .with("id", trial.id)?
        .with("variant", trial.variant)?
        .with("replicate", trial.replicate)?
        .with("seed", trial.seed)?
        .build(ResultClass("sidestep._engines", "Trial"))
}

impl PyExecutor {
    /// Drives the generator: it yields the number of a variant to request its scenario, or a list of outcomes. Scenarios are
    /// sent on request, since a resumed sweep may have no trials left of most variants.
    fn drive(
        &self,
        py: Python<'_>,
        batch: &TrialBatch<'_>,
        store: &mut OutcomeSink<'_>,
    ) -> PyResult<()> {
        let trials = batch.trials().iter().map(|trial| to_python_trial(py, trial));
        let trials = trials.collect::<PyResult<Vec<_>>>()?;
        let series = batch.series().map(<[String]>::to_vec);
        let generator = self.begin.bind(py).call1((worlds::list().build(), trials, series))?;
        let mut answer = py.None();
        loop {
            let yielded = match generator.call_method1("send", (answer,)) {
                Err(raised) if raised.is_instance_of::<PyStopIteration>(py) => return Ok(()),
                yielded => yielded?,
            };
            answer = py.None();
            if let Ok(variant) = yielded.extract::<u32>() {
                let ResolvedScenario { text, files } =
                    batch.scenario(variant).map_err(|e| error::input_error(&e))?;
                answer = (text, files).into_pyobject(py)?.into_any().unbind();
                continue;
            }
            for outcome in yielded.extract::<Vec<String>>()? {
                store(parse_outcome(&outcome)?).map_err(|e| error::session_error(&e))?;
            }
        }
    }
}

/// Returns an outcome from JSON that [`run_task`] has written, maybe on another machine.
fn parse_outcome(text: &str) -> PyResult<Outcome> {
    serde_json::from_str(text).map_err(|e| {
        let remedy = "install the same build of sidestep wherever tasks run";
        argument_error("an outcome of a task", e.to_string(), remedy)
    })
}

impl TrialExecutor for PyExecutor {
    fn run(&self, batch: &TrialBatch<'_>, store: &mut OutcomeSink<'_>) -> Result<(), Error> {
        Python::attach(|py| self.drive(py, batch, store)).map_err(|raised| {
            *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(raised);
            // `run_sweep` raises the exception itself; this error only ends the sweep.
            Error::Interrupted
        })
    }

    fn parallelism(&self) -> usize {
        self.parallelism
    }
}

/// Runs a sweep on threads, all processors if `workers` is 0, or by an executor: the native part of `sidestep.sweep`.
#[pyfunction]
#[pyo3(signature = (sweep, options, out, workers, begin))]
pub(crate) fn run_sweep<'py>(
    sweep: &Bound<'py, PyAny>,
    options: SweepOptions<'py>,
    out: Option<PathBuf>,
    workers: usize,
    begin: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = sweep.py();
    let reporter = ProgressReporter::from_argument(options.progress.as_ref(), "run")?;
    let runners = Runners { workers, begin };
    let result = execute_sweep(sweep, &options, out.as_ref(), runners, reporter.as_ref());
    if let Some(reporter) = &reporter {
        reporter.close(py)?;
    }
    let result = result?;
    let results = Table::from_runs("results", result.results, &result.world)?;
    let timings = Table::from_runs("timings", result.timings, &result.world)?;
    let series = Table::from_runs("series", result.series, &result.world)?;
    Fields::new(py)
        .with("results", results)?
        .with("timings", timings)?
        .with("series", series)?
        .with("bands", bands_table(&result.bands)?)?
        .with("output", to_python(py, &result.summary)?)?
        .build(ResultClass("sidestep._sweep", "Sweep"))
}

/// Who runs the trials of a sweep.
struct Runners {
    /// Threads, all processors if it is 0; or trials that the executor runs at the same time.
    workers: usize,
    /// The executor: see [`PyExecutor`]; none for threads.
    begin: Option<Py<PyAny>>,
}

/// Runs a sweep until it is done.
///
/// # Errors
/// When an argument is wrong, a folder cannot be written or the executor fails; and the exception of a signal.
fn execute_sweep(
    sweep: &Bound<'_, PyAny>,
    options: &SweepOptions<'_>,
    out: Option<&PathBuf>,
    Runners { workers, begin }: Runners,
    reporter: Option<&ProgressReporter>,
) -> PyResult<SweepResult> {
    let py = sweep.py();
    let workers = if workers == 0 { available_workers() } else { workers };
    let request = options.request(sweep)?;
    let sweep = &request.sweep;
    let result = match begin {
        None => {
            let engine = Engine::Workers(workers);
            run_reporting(py, reporter, |watcher| run(sweep, out, engine, watcher))?
        }
        Some(begin) => {
            let signals = SignalWatcher::new(reporter);
            let executor = PyExecutor { begin, parallelism: workers, raised: Mutex::default() };
            let result = py.detach(|| run(sweep, out, Engine::Executor(&executor), &signals));
            let raised = executor.raised.into_inner().unwrap_or_else(PoisonError::into_inner);
            raised.map_or(Ok(()), Err)?;
            signals.into_result()?;
            result
        }
    };
    // A sweep without a result was interrupted by a signal, whose exception has been raised above.
    let result = result.and_then(|result| result.ok_or(Error::Interrupted));
    result.map_err(|e| error::session_error(&e))
}

/// Returns the means of metrics over time as a table, one row for each variant, metric and cycle.
fn bands_table(bands: &[SeriesBand]) -> PyResult<Table> {
    let rows = || bands.iter().flat_map(|band| band.points.iter().map(move |point| (band, point)));
    let bound = |of: fn(Interval) -> f64| {
        ColumnValues::F64(rows().map(|(_, point)| point.interval.map(of)).collect())
    };
    let metrics = rows().map(|(band, _)| Some(band.metric.clone()));
    let columns = [
        (
            "variant",
            "Number of the variant.",
            integers(rows().map(|(band, _)| band.variant.into())),
        ),
        ("metric", "Name of the metric.", ColumnValues::Text(metrics.collect())),
        ("cycle", "Number of cycles done.", integers(rows().map(|(_, point)| point.cycle))),
        (
            "runs",
            "Number of runs in which the metric has a value.",
            integers(rows().map(|(_, point)| point.runs as u64)),
        ),
        (
            "mean",
            "Mean over these runs.",
            ColumnValues::F64(rows().map(|(_, point)| Some(point.mean)).collect()),
        ),
        ("mean_low", "Lower end of the 95 % interval of the mean.", bound(|ends| ends.low)),
        ("mean_high", "Upper end of the 95 % interval of the mean.", bound(|ends| ends.high)),
    ];
    let spec = |(name, meaning, values): &(&str, &str, ColumnValues)| ColumnSpec {
        is_nullable: true,
        ..ColumnSpec::new(name, values.column_type(), meaning)
    };
    let schema = TableSchema::new("bands", columns.iter().map(spec).collect());
    Table::new(schema, columns.into_iter().map(|(_, _, values)| values).collect())
}

fn integers(values: impl Iterator<Item = u64>) -> ColumnValues {
    ColumnValues::I64(values.map(|value| Some(value as i64)).collect())
}

/// Runs some trials of a sweep that another process drives, and returns their outcomes as JSON: the function that
/// tasks of `sidestep.sweep` call, on any machine.
///
/// Raises InputError when the sweep is of another build of sidestep.
#[pyfunction]
#[pyo3(signature = (build, scenarios, trials, series=None))]
pub(crate) fn run_task(
    py: Python<'_>,
    build: String,
    scenarios: Vec<(u32, Bundle)>,
    trials: Vec<TrialTuple>,
    series: Option<Vec<String>>,
) -> PyResult<Vec<String>> {
    let scenarios = scenarios
        .into_iter()
        .map(|(variant, (text, files))| (variant, ResolvedScenario { text, files }))
        .collect();
    let trials = trials
        .into_iter()
        .map(|(id, variant, replicate, seed)| Trial { id, variant, replicate, seed })
        .collect();
    let task = Task { build, scenarios, trials, series };
    let outcomes = run_polling(py, |watcher| task.run(worlds::list(), watcher))?;
    let outcomes = outcomes.map_err(|e| error::session_error(&e))?;
    outcomes.iter().map(outcome_text).collect()
}

/// Returns an outcome as JSON, for [`parse_outcome`].
fn outcome_text(outcome: &Outcome) -> PyResult<String> {
    serde_json::to_string(outcome)
        .map_err(|e| error::RecordError::new_err(format!("an outcome cannot be sent: {e}")))
}

/// Returns the state of the sweep in a folder: the native part of `sidestep.sweep_status`.
///
/// Raises InputError when there is no sweep, or something in it cannot be read.
#[pyfunction]
pub(crate) fn sweep_status(py: Python<'_>, folder: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let status = py.detach(|| sweep::read_status(&Folder::open(&folder)?));
    let status = status.map_err(|e: InputError| error::input_error(&e))?;
    let status = serde_json::to_value(&status).unwrap_or_default();
    Fields::from_json(py, &status)?.build(ResultClass("sidestep._status", "SweepStatus"))
}

/// Compares methods of collision avoidance on the same air traffic: the native part of `sidestep.compare`.
#[pyfunction]
pub(crate) fn compare_methods(
    scenario: &Bound<'_, PyAny>,
    methods: Vec<String>,
    runs: usize,
    seed: Option<u64>,
    workers: usize,
) -> PyResult<Py<PyAny>> {
    let py = scenario.py();
    let loaded = load(scenario)?;
    let source = loaded.source()?;
    let known = BuiltInMethod::ALL.map(|method| (method.name(), method));
    let methods = methods.iter().map(|name| choose("methods", name, &known));
    let methods = methods.collect::<PyResult<Vec<BuiltInMethod>>>()?;
    let Some(compiled) = loaded.compiled.as_any().downcast_ref::<CompiledAirspace>() else {
        let cause = "methods of collision avoidance are of the world `airspace` alone";
        return Err(argument_error("scenario", cause, "give a scenario with world = \"airspace\""));
    };
    let seeds = methods::SeedSpan { first: seed.unwrap_or(compiled.seed), runs };
    let workers = if workers == 0 { available_workers() } else { workers };
    let results = run_polling(py, |watcher| {
        let interrupt = watcher.interrupt();
        let comparison = methods::Comparison {
            source,
            methods: &methods,
            seeds,
            workers,
            interrupt: interrupt.clone(),
        };
        catch_unwind(AssertUnwindSafe(|| comparison.run(&mut |_, _| ())))
            .unwrap_or_else(|payload| resume_unless(payload, &interrupt))
    })?;
    let results = results.map_err(|e| error::input_error(&e))?;
    to_python(py, &json!({ "name": compiled.name, "seed": seeds.first, "methods": results }))
}

/// Resumes unwinding, unless the interrupt has caused it: then the caller raises the exception of the signal and uses no
/// result.
fn resume_unless<T>(
    payload: Box<dyn Any + Send>,
    interrupt: &Interrupt,
) -> Result<Vec<T>, InputError> {
    if interrupt.has_caused_unwind(payload.as_ref()) {
        return Ok(Vec::new());
    }
    resume_unwind(payload)
}
