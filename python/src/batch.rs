//! Many worlds of one scenario, stepped together.

use crate::arrays::{UnsignedArg, order_values};
use crate::error::{self, argument_error};
use crate::json::{to_list, to_python};
use crate::pickle::{self, Pickle};
use crate::picture::{Pictures, parse_look, to_pixels};
use crate::scenario::{Bundle, LoadedScenario, Scenario, load, unpack_scenario};
use crate::space::{OutArrays, Team, zeroed_arrays};
use numpy::{PyArray1, PyArray3, PyReadonlyArray1, PyUntypedArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use sidestep::kernel::batch::{self, BatchError, SimulationFactory};
use sidestep::kernel::control;
use sidestep::scenario::{ResolvedScenario, Source};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time after which Python is asked for signals, between two cycles: too short for users to notice.
const SIGNAL_POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Largest number of worlds. A world of one robot on five boxes takes 4 KiB, so that as many take 4 GiB: without a bound a
/// mistaken number would take all memory before anything could be reported.
const MAX_WORLDS: usize = 1 << 20;
/// Largest number of workers, as for a sweep.
pub(crate) const MAX_WORKERS: usize = 1024;

/// Many worlds of one scenario that step together, each with its own seed.
///
/// Batch(scenario, worlds, *, workers=1, seeds=None): `scenario` is a Scenario, a path or a dict; `seeds` has one for each
/// world, by default the scenario's and those that follow it. Arrays have a row for each world: (worlds, agents, ...).
/// Each world has the bits of a `Simulation` with its seed, for any number of workers; nothing is recorded.
///
/// Python's lock is released while worlds advance, and Ctrl-C stops them between two cycles, all at the same one. A world that
/// breaks off (which is a bug) is named in the error, and the others continue once it has been reset.
///
/// Examples of its methods continue from here:
///
/// >>> import sidestep
/// >>> scenario = {"world": "robots", "map": {"ascii": "....."},
/// ...             "robots": [{"count": 2, "behaviour": {"kind": "external"}}]}
/// >>> batch = sidestep.Batch(scenario, 3, seeds=[5, 6, 7])
/// >>> batch.order("action", [[0, 1], [1, 1], [0, 0]])
/// >>> batch.step()
/// >>> batch.observe()["at_boxes"].shape
/// (3, 2, 2)
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Batch {
    scenario: Arc<LoadedScenario>,
    /// Its teams, which never change.
    teams: Vec<Arc<control::AgentTeam>>,
    worlds: usize,
    workers: usize,
    batch: Mutex<batch::Batch>,
    pictures: Pictures,
}

impl Batch {
    /// Works with the worlds while other threads of Python run.
    fn with_worlds<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut batch::Batch) -> Result<T, BatchError> + Send,
    ) -> PyResult<T> {
        py.detach(|| {
            let mut batch = self.batch.lock().unwrap_or_else(PoisonError::into_inner);
            work(&mut batch).map_err(|e| batch_error(&e))
        })
    }

    /// Starts a world with each of the seeds.
    fn start(
        py: Python<'_>,
        scenario: Arc<LoadedScenario>,
        seeds: &[u64],
        workers: usize,
    ) -> PyResult<Self> {
        let start = start_function(&scenario)?;
        let batch = py.detach(|| batch::Batch::new(start, seeds, workers));
        let batch = batch.map_err(|e| batch_error(&e))?;
        let teams = batch.agent_teams().iter().cloned().map(Arc::new).collect();
        let worlds = seeds.len();
        let pictures = Pictures::default();
        Ok(Self { scenario, teams, worlds, workers, batch: Mutex::new(batch), pictures })
    }

    /// Starts a world with each of the seeds, and continues it from a state.
    pub(crate) fn from_states(
        py: Python<'_>,
        scenario: Arc<LoadedScenario>,
        seeds: &[u64],
        workers: usize,
        states: Vec<Vec<u8>>,
    ) -> PyResult<Self> {
        let batch = Self::start(py, scenario, seeds, workers)?;
        batch.with_worlds(py, |worlds| worlds.restore(&states))?;
        Ok(batch)
    }

    fn find_team(&self, team: Option<&Bound<'_, PyAny>>) -> PyResult<(usize, &control::AgentTeam)> {
        let (number, team) = crate::space::find_team(&self.teams, team)?;
        Ok((number, &**team))
    }

    /// Returns a truth value for each world; `None` stands for all worlds.
    fn parse_mask(&self, mask: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Vec<bool>>> {
        let Some(mask) = mask else { return Ok(None) };
        let array: Option<PyReadonlyArray1<'_, bool>> = mask.extract().ok();
        match array.filter(|array| array.len() == self.worlds) {
            Some(array) => Ok(Some(array.as_array().to_vec())),
            None => Err(self.row_count_error("mask", "truth values (bool)", mask)),
        }
    }

    /// Returns a seed for each world, of a list or an array of whole numbers.
    fn parse_seeds(&self, seeds: &Bound<'_, PyAny>) -> PyResult<Vec<u64>> {
        whole_numbers(seeds)
            .filter(|seeds| seeds.len() == self.worlds)
            .ok_or_else(|| self.row_count_error("seeds", "seeds (whole numbers from 0 on)", seeds))
    }

    fn row_count_error(&self, key: &str, what: &str, given: &Bound<'_, PyAny>) -> PyErr {
        let shape = given.getattr("shape").map(|shape| shape.to_string());
        let found = shape.or_else(|_| given.len().map(|n| n.to_string()));
        let found = found.unwrap_or_else(|_| given.to_string());
        let cause = match given.len() {
            Ok(n) if n == self.worlds => format!("they are not {what}"),
            _ => format!("there are {} worlds, and not {found} {what}", self.worlds),
        };
        argument_error(key, cause, format!("give an array of {} {what}", self.worlds))
    }
}

/// Returns a number of things, which must be from 1 to `max`.
pub(crate) fn bounded_count(name: &str, count: UnsignedArg, max: usize) -> PyResult<usize> {
    let count = usize::try_from(count.named(name)?).unwrap_or(usize::MAX);
    if (1..=max).contains(&count) {
        return Ok(count);
    }
    Err(argument_error(name, format!("is {count}"), format!("give a number from 1 to {max}")))
}

/// Returns whole numbers, of a list or an array.
fn whole_numbers(values: &Bound<'_, PyAny>) -> Option<Vec<u64>> {
    let values = match values.getattr("tolist") {
        Ok(to_list) => to_list.call0().ok()?,
        Err(_) => values.clone(),
    };
    values.extract().ok()
}

fn batch_error(error: &BatchError) -> PyErr {
    match error {
        BatchError::Start { world, seed, error } => {
            let cause = format!("world {world} cannot start with seed {seed}: {}", error.cause());
            argument_error(error.place(), cause, error.remedy())
        }
        BatchError::Empty | BatchError::Shape { .. } => {
            argument_error("worlds", error.to_string(), "give worlds of one scenario, at least one")
        }
        BatchError::Restore { .. } | BatchError::Count { what: "checkpoints", .. } => {
            argument_error("states", error.to_string(), "pickle the batch again, with this build")
        }
        BatchError::Broken { .. } => error::ReplayError::new_err(error.to_string()),
        _ => error::OrderError::new_err(error.to_string()),
    }
}

/// Returns the function that creates a world at its start. All seeds share one text: it identifies the checkpoints by which
/// a batch is pickled, each of which has the seed of its world in its state.
fn start_function(scenario: &Arc<LoadedScenario>) -> PyResult<Arc<SimulationFactory>> {
    let source = Source::new("scenario.toml", scenario.identity()?, "");
    let scenario = Arc::clone(scenario);
    let first_seed = scenario.compiled.plan().seed;
    Ok(Arc::new(move |seed| {
        if seed == first_seed {
            return Ok(scenario.compiled.start(&source, 1));
        }
        let fresh = match scenario.compiled.reseeded(seed) {
            Some(fresh) => fresh?,
            None => scenario.compiled_with(seed)?,
        };
        Ok(fresh.start(&source, 1))
    }))
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(
        signature = (scenario, worlds, *, workers=UnsignedArg::new(1), seeds=None),
        text_signature = "(scenario, worlds, *, workers=1, seeds=None)"
    )]
    fn new(
        py: Python<'_>,
        scenario: &Bound<'_, PyAny>,
        worlds: UnsignedArg,
        workers: UnsignedArg,
        seeds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let worlds = bounded_count("worlds", worlds, MAX_WORLDS)?;
        let workers = bounded_count("workers", workers, MAX_WORKERS)?;
        let scenario = load(scenario)?;
        let first = scenario.compiled.plan().seed;
        let seeds = match seeds {
            None => (0..worlds as u64).map(|k| first.wrapping_add(k)).collect(),
            Some(seeds) => {
                whole_numbers(seeds).filter(|seeds| seeds.len() == worlds).ok_or_else(|| {
                    let cause = format!("{worlds} worlds, and not as many seeds");
                    argument_error(
                        "seeds",
                        cause,
                        format!("give {worlds} whole numbers of at least 0"),
                    )
                })?
            }
        };
        Self::start(py, scenario, &seeds, workers)
    }

    /// The scenario.
    #[getter]
    fn scenario(&self) -> Scenario {
        Scenario(Arc::clone(&self.scenario))
    }

    /// Number of workers.
    #[getter]
    fn workers(&self) -> usize {
        self.workers
    }

    /// The teams of each world: agents with the same observations and orders.
    #[getter]
    fn teams<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        to_list(py, self.teams.iter().cloned().map(Team))
    }

    /// The seed of each world (uint64).
    #[getter]
    fn seeds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u64>>> {
        Ok(self.with_worlds(py, |batch| Ok(batch.seeds()))?.to_pyarray(py))
    }

    /// The cycles that each world has done (uint64).
    #[getter]
    fn cycles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u64>>> {
        Ok(self.with_worlds(py, |batch| batch.cycles())?.to_pyarray(py))
    }

    /// Returns whether nothing can happen anymore, for each world (bool).
    #[getter]
    fn is_over<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        Ok(self.with_worlds(py, |batch| batch.is_over())?.to_pyarray(py))
    }

    /// Digest of the state of each world, in hexadecimal; orders waiting for the next step are not in it.
    #[getter]
    fn digests(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with_worlds(py, |batch| batch.map_worlds(|run| run.digest().to_string()))
    }

    /// Returns the measurements of each world so far, a list of dicts; with `mask` (bool, one for each world) None for those
    /// for which it is false.
    ///
    /// >>> [world["actions"] for world in batch.metrics()]
    /// [2, 2, 2]
    #[pyo3(signature = (*, mask=None))]
    fn metrics(&self, py: Python<'_>, mask: Option<&Bound<'_, PyAny>>) -> PyResult<Py<PyAny>> {
        let mask = self.parse_mask(mask)?;
        let is_asked = |world: usize| mask.as_ref().is_none_or(|mask| mask[world]);
        let all: Vec<_> = self.with_worlds(py, |batch| {
            let metrics = |world: usize| {
                let asked = is_asked(world).then(|| batch.with_world(world, |run| run.metrics()));
                asked.unwrap_or(Ok(serde_json::Value::Null))
            };
            (0..self.worlds).map(metrics).collect()
        })?;
        to_python(py, &serde_json::Value::from(all))
    }

    /// Renders the present state of a world as an image: an array (height, width, 3) of red, green and blue (uint8). The
    /// other arguments are those of `Simulation.render`.
    ///
    /// Raises InputError when there is no such world, or as `Simulation.render`.
    ///
    /// >>> batch.render(2, 100).shape[1:]
    /// (100, 3)
    #[pyo3(signature = (world=0, width=640, *, size=None, view=None))]
    fn render<'py>(
        slf: PyRef<'py, Self>,
        world: usize,
        width: u32,
        size: Option<[u32; 2]>,
        view: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let py = slf.py();
        if world >= slf.worlds {
            let remedy = format!("give a number from 0 to {}", slf.worlds - 1);
            return Err(argument_error("world", format!("there is no world {world}"), remedy));
        }
        let look = parse_look(width, size, Vec::new(), view)?;
        let Self { pictures, .. } = &*slf;
        let drawn =
            slf.with_worlds(py, |batch| batch.with_world(world, |run| pictures.draw(run, look)));
        let (still, size_px) = drawn??;
        to_pixels(py, &still, size_px)
    }

    /// Gives an order to all agents of a team (by number or name) in all worlds for the next step: an array of the
    /// shape (worlds, agents, ...), or one number for all.
    ///
    /// Raises OrderError; no agent gets an order then.
    ///
    /// >>> batch.order("action", 0)
    #[pyo3(signature = (name, values, *, team=None))]
    fn order(
        &self,
        py: Python<'_>,
        name: &str,
        values: &Bound<'_, PyAny>,
        team: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (number, team) = self.find_team(team)?;
        let space = team.action_spaces.iter().find(|space| space.name == name);
        let shape: Option<Vec<usize>> =
            space.map(|space| [team.agents.len()].iter().chain(&space.shape).copied().collect());
        let values = match &shape {
            Some(shape) => order_values(py, name, values, self.worlds, Some(shape))?,
            // The batch refuses an unknown order, with the names of the known ones.
            None => vec![0.0; self.worlds * team.agents.len()],
        };
        self.with_worlds(py, |batch| batch.order(number, name, values))
    }

    /// Advances all worlds by `cycles` cycles (one by default), or those for which `mask` (bool, one for each
    /// world) is true; orders to the others are dropped. A world that is over stays the same.
    ///
    /// Raises ReplayError when a world breaks off; the others have advanced then.
    ///
    /// >>> import numpy as np
    /// >>> batch.step(4)
    /// >>> batch.step(mask=np.array([True, False, True]))
    /// >>> batch.cycles.tolist()
    /// [6, 5, 6]
    #[pyo3(signature = (cycles=UnsignedArg::new(1), *, mask=None), text_signature = "($self, cycles=1, *, mask=None)")]
    fn step(
        &self,
        py: Python<'_>,
        cycles: UnsignedArg,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let mask = self.parse_mask(mask)?;
        let mut remaining = cycles.named("cycles")?;
        let mut chunk = 1;
        loop {
            let now = remaining.min(chunk);
            let start = Instant::now();
            self.with_worlds(py, |batch| batch.advance(now, mask.as_deref()))?;
            remaining -= now;
            if remaining == 0 {
                return Ok(());
            }
            py.check_signals()?;
            // Signals can be checked only between two calls, each of which wakes all workers: the number of cycles per call
            // grows as long as twice as many take less than the interval.
            chunk = if start.elapsed() < SIGNAL_POLL_INTERVAL / 2 {
                chunk * 2
            } else {
                (chunk / 2).max(1)
            };
        }
    }

    /// Returns the observations of a team's agents (by number or name) in all worlds before the next cycle: arrays by
    /// name, of the shape (worlds, agents, ...). With `out`, arrays of an earlier call are overwritten and returned.
    ///
    /// Raises OrderError when there is no such team, InputError when `out` has other arrays.
    ///
    /// >>> out = batch.observe()
    /// >>> batch.step()
    /// >>> batch.observe(out=out) is out
    /// True
    #[pyo3(signature = (team=None, *, out=None))]
    fn observe<'py>(
        &self,
        py: Python<'py>,
        team: Option<&Bound<'py, PyAny>>,
        out: Option<Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (number, team) = self.find_team(team)?;
        let out = match out {
            Some(out) => out,
            None => zeroed_arrays(py, team, self.worlds)?,
        };
        let mut arrays = OutArrays::from_dict(&out, team, self.worlds)?;
        let buffers = &mut arrays.buffers_mut()?;
        self.with_worlds(py, |batch| batch.observe(number, buffers))?;
        Ok(out)
    }

    /// Restarts worlds with these seeds, one for each world; with `mask` (bool, one for each world) only those for
    /// which it is true. Waiting orders are dropped.
    ///
    /// Raises InputError when a world cannot start with its seed; it then stays as it was.
    ///
    /// >>> batch.reset([8, 9, 10])
    /// >>> batch.seeds.tolist(), batch.cycles.tolist()
    /// ([8, 9, 10], [0, 0, 0])
    #[pyo3(signature = (seeds, *, mask=None))]
    fn reset(
        &self,
        py: Python<'_>,
        seeds: &Bound<'_, PyAny>,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let seeds = self.parse_seeds(seeds)?;
        let mask = self.parse_mask(mask)?;
        let mut seeds: Vec<Option<u64>> = seeds.into_iter().map(Some).collect();
        if let Some(mask) = mask {
            for (seed, is_reset) in seeds.iter_mut().zip(mask) {
                *seed = seed.filter(|_| is_reset);
            }
        }
        self.with_worlds(py, |batch| batch.restart(&seeds))
    }

    /// Pickles the worlds in their states; orders that wait for the next step are not in it.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickle<'py, PickledBatch<'py>>> {
        let ResolvedScenario { text, files } = self.scenario.resolved()?.clone();
        let (seeds, states) = self.with_worlds(py, |batch| {
            Ok((batch.seeds(), batch.map_worlds(|run| run.checkpoint())?))
        })?;
        let states = states.iter().map(|state| PyBytes::new(py, state)).collect();
        Ok((pickle::maker(py, "unpack_batch")?, ((text, files), seeds, self.workers, states)))
    }

    fn __len__(&self) -> usize {
        self.worlds
    }

    fn __repr__(&self) -> String {
        let name = self.scenario.compiled.plan().name;
        format!("Batch({name}, {} worlds, {} workers)", self.worlds, self.workers)
    }
}

/// The arguments of [`unpack_batch`].
type PickledBatch<'py> = (Bundle, Vec<u64>, usize, Vec<Bound<'py, PyBytes>>);

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
