//! Simulations that Python advances, observes and orders.

use crate::arrays::{UnsignedArg, agent_ids, body_column, body_rows, body_texts, order_values};
use crate::batch::{MAX_WORKERS, bounded_count};
use crate::blocks::Blocks;
use crate::error::{self, ClosedError, argument_error};
use crate::json::to_python;
use crate::notebook::to_html;
use crate::picture::{Pictures, draw_error, parse_look, to_pixels};
use crate::policy::{IndexedTeam, PolicyRun, run_with_policies};
use crate::scenario::{Bundle, LoadedScenario, load};
use crate::space::{ObservationBuffers, Team, find_team, team_at};
use crate::table::Table;
use crate::watch::{ProgressReporter, SignalWatcher, TimeSlice};
use crate::worlds;
use numpy::PyArray3;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};
use sidestep::kernel::control::{self, MultiAgentOrder};
use sidestep::kernel::ports::{ColumnValues, TableSchema};
use sidestep::kernel::view::{Body, BodyId, FrameOptions};
use sidestep::kernel::{Cycle, EntityId, RunConfig, Simulation as AnySimulation};
use sidestep::scenario::{ResolvedScenario, Source};
use sidestep_draw::{AnimationFrame, AnimationLook};
use sidestep_session::{ManagedRun, OutputPaths, RowSelection};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Width in pixels of a picture in a notebook.
const NOTEBOOK_WIDTH_PX: u32 = 480;

/// A run of a scenario, at its start.
///
/// Simulation(scenario, *, seed=None, workers=1, record=False, out=None, replace=False): `scenario` is a Scenario, a path
/// or a dict. With `record` the rows of all tables are kept in memory, or of those in a list of names (see the method `record`,
/// and `tables` and `blocks`); with `out` they go to a run folder, like that of `sidestep run --out`, and `close`
/// completes it. The same scenario and seed give the same bits, with any number of workers, and the same as in the
/// command and the library.
///
/// It may be used from several threads, one at a time; Python's lock is released while it advances, and Ctrl-C stops it between
/// two cycles. Handlers of signals may use it, too: they see it between two cycles. It can be pickled: with its whole
/// state, but without rows.
///
/// Examples of its methods continue from here:
///
/// >>> import sidestep
/// >>> floor = {"world": "robots", "map": {"ascii": "....."}, "robots": [{"count": 2, "behaviour": {"kind": "external"}}]}
/// >>> sim = sidestep.Simulation(floor, record=True)
/// >>> sim.step(10)
/// 10
/// >>> sim.cycle
/// 10
#[pyclass(module = "sidestep", frozen)]
pub(crate) struct Simulation {
    scenario: Arc<LoadedScenario>,
    workers: usize,
    /// Its teams, which never change and are needed in every cycle.
    teams: Vec<Arc<control::AgentTeam>>,
    /// `None` when it is closed.
    run: Mutex<Option<ManagedRun>>,
    pictures: Pictures,
}

impl Simulation {
    /// Starts a scenario while other threads of Python run.
    fn start(
        py: Python<'_>,
        scenario: Arc<LoadedScenario>,
        workers: usize,
        paths: OutputPaths<'_>,
    ) -> PyResult<Self> {
        let run = py.detach(|| {
            // Without a folder, the run is identified by the text that its folder would have: so checkpoints of either can be
            // restored in the other.
            let source = match paths.folder {
                Some(_) => scenario.source()?.clone(),
                None => Source::new("scenario.toml", scenario.identity()?, ""),
            };
            let run = ManagedRun::start(
                worlds::list(),
                scenario.compiled.as_ref(),
                &source,
                workers,
                paths,
            );
            run.map_err(|e| error::session_error(&e))
        })?;
        let teams = run.simulation().agent_teams().iter().cloned().map(Arc::new).collect();
        let run = Mutex::new(Some(run));
        Ok(Self { scenario, workers, teams, run, pictures: Pictures::default() })
    }

    /// Works with the run while other threads of Python run.
    fn with_run<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut ManagedRun) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        py.detach(|| {
            let mut run = self.run.lock().unwrap_or_else(PoisonError::into_inner);
            work(run.as_mut().ok_or_else(closed_error)?)
        })
    }

    fn read<T: Send>(
        &self,
        py: Python<'_>,
        query: impl FnOnce(&dyn AnySimulation) -> T + Send,
    ) -> PyResult<T> {
        self.with_run(py, |run| Ok(query(run.simulation())))
    }

    fn checkpoint_bytes(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        self.with_run(py, |run| run.checkpoint().map_err(|e| error::record_error(&e)))
    }

    /// Advances to the goal, or to the end of the run, and returns the number of cycles done.
    ///
    /// Signals are checked between two slices, while no code holds the run: their handlers are functions of Python on
    /// this thread, and may call the simulation in any way.
    fn advance_to_goal(
        &self,
        py: Python<'_>,
        mut goal: Goal,
        reporter: Option<&ProgressReporter>,
    ) -> PyResult<u64> {
        let mut done = 0;
        loop {
            py.check_signals()?;
            let slice = self.advance_slice(py, goal)?;
            done += slice.done;
            if let Some(reporter) = reporter {
                reporter.report(py, slice.now, slice.until)?;
            }
            if slice.is_last {
                return Ok(done);
            }
            goal = goal.remaining(slice.done);
        }
    }

    /// Advances toward a goal for one time slice.
    ///
    /// The cycle is read and the run advanced under one lock, with no other thread in between: of two threads that
    /// step at once, each adds its own step.
    fn advance_slice(&self, py: Python<'_>, goal: Goal) -> PyResult<SliceOutcome> {
        py.detach(|| {
            let mut guard = self.run.lock().unwrap_or_else(PoisonError::into_inner);
            let run = guard.as_mut().ok_or_else(closed_error)?;
            let from = run.cycle();
            let until = goal.end_from(from);
            if let Err(error) = run.advance_to(until, &TimeSlice::default()) {
                // The state may be in the middle of a cycle, so it is not used further.
                *guard = None;
                return Err(error::session_error(&error));
            }
            let now = run.cycle();
            let is_last = now >= until || run.simulation().is_over();
            Ok(SliceOutcome { done: now - from, now, until, is_last })
        })
    }

    /// Returns a team by number or name, with its number; the first one without either.
    fn find_team(&self, team: Option<&Bound<'_, PyAny>>) -> PyResult<IndexedTeam> {
        find_team(&self.teams, team).map(|(number, team)| (number, Arc::clone(team)))
    }

    /// Returns the team of an agent; the first one for an agent that is in none, whose order the run then refuses with a
    /// reason.
    fn team_of(&self, agent: Option<EntityId>) -> PyResult<IndexedTeam> {
        let position = agent.and_then(|id| {
            self.teams.iter().position(|team| team.agents.binary_search(&id).is_ok())
        });
        let number = position.unwrap_or(0);
        team_at(&self.teams, number).map(|(number, team)| (number, Arc::clone(team)))
    }

    fn observations<'py>(
        &self,
        py: Python<'py>,
        number: usize,
        team: &Arc<control::AgentTeam>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut buffers = ObservationBuffers::from_team(team);
        let buffers = self.with_run(py, |run| {
            let observed = run.simulation().observe(number, &mut buffers.buffers_mut());
            observed.map_err(|e| error::order_error(&e)).map(|()| buffers)
        });
        buffers?.into_dict(py, team)
    }

    /// Gives an order to some agents of a team, while other threads of Python run.
    fn order_agents(
        &self,
        order: &str,
        values: &Bound<'_, PyAny>,
        agents: &[EntityId],
        team: &control::AgentTeam,
    ) -> PyResult<()> {
        let py = values.py();
        let shape =
            team.action_spaces.iter().find(|space| space.name == order).map(|s| &s.shape[..]);
        let values = order_values(py, order, values, agents.len(), shape)?;
        self.with_run(py, |run| {
            let orders = MultiAgentOrder { order, agents, values: &values };
            run.order(&orders).map_err(|e| error::order_error(&e))
        })
    }

    fn draw(&self, py: Python<'_>, look: AnimationLook) -> PyResult<(AnimationFrame, (u32, u32))> {
        self.with_run(py, |run| self.pictures.draw(run.simulation_mut(), look))
    }

    /// Returns the end: `until`, or else the one planned by the scenario.
    fn end_cycle(&self, until: Option<Cycle>) -> Cycle {
        until.unwrap_or_else(|| self.scenario.compiled.plan().cycles)
    }
}

/// The cycle to advance to.
#[derive(Clone, Copy)]
enum Goal {
    /// This many cycles after the present one.
    Further(u64),
    /// To this cycle, counted from the start of the run.
    Until(Cycle),
}

impl Goal {
    /// Returns the cycle to advance to from `now`.
    fn end_from(self, now: Cycle) -> Cycle {
        match self {
            Self::Further(cycles) => now.saturating_add(cycles),
            Self::Until(until) => until.max(now),
        }
    }

    /// Returns the remaining goal once a number of cycles are done.
    fn remaining(self, done: u64) -> Self {
        match self {
            Self::Further(cycles) => Self::Further(cycles - done),
            Self::Until(_) => self,
        }
    }
}

/// How far one time slice got.
struct SliceOutcome {
    /// Cycles done.
    done: u64,
    /// The cycle of the run, and that to which it goes.
    now: Cycle,
    until: Cycle,
    /// Whether the goal is reached, or the run is over.
    is_last: bool,
}

fn condition_name(body: &Body) -> String {
    format!("{:?}", body.state).to_lowercase()
}

/// Refuses an order in which an agent has two values, of which only the last would count.
fn refuse_repeated(agents: &[EntityId]) -> PyResult<()> {
    let mut sorted = agents.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => {
            let cause = format!("`agents` has {} twice; give each agent one value", pair[0]);
            Err(error::OrderError::new_err(cause))
        }
        None => Ok(()),
    }
}

/// Returns a dict of tables by name, also of those without rows.
fn tables_dict(
    py: Python<'_>,
    rows: Vec<(TableSchema, Vec<ColumnValues>)>,
) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (schema, columns) in rows {
        dict.set_item(schema.name.clone(), Table::new(schema, columns)?)?;
    }
    Ok(dict)
}

/// The argument `record`: whether rows are kept, or the tables of the kept rows.
pub(crate) struct RecordArgument(Option<RowSelection>);

impl FromPyObject<'_, '_> for RecordArgument {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        if let Ok(is_recorded) = value.extract::<bool>() {
            return Ok(Self(is_recorded.then(RowSelection::default)));
        }
        let names = value.extract::<Vec<String>>().map_err(|_| {
            let remedy = "give True, False, or a list of names: record=[\"events\"]";
            argument_error("record", format!("{} is no list of tables", &*value), remedy)
        })?;
        Ok(Self(Some(RowSelection { tables: Some(names), frames: None })))
    }
}

fn closed_error() -> PyErr {
    ClosedError::new_err(
        "the simulation is closed; make a new one, and restore a checkpoint in that",
    )
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scenario, *, seed=None, workers=UnsignedArg::new(1), record=RecordArgument(None), out=None, replace=false), text_signature = "(scenario, *, seed=None, workers=1, record=False, out=None, replace=False)")]
    fn new(
        scenario: &Bound<'_, PyAny>,
        seed: Option<UnsignedArg>,
        workers: UnsignedArg,
        record: RecordArgument,
        out: Option<PathBuf>,
        replace: bool,
    ) -> PyResult<Self> {
        let py = scenario.py();
        let workers = bounded_count("workers", workers, MAX_WORKERS)?;
        let mut scenario = load(scenario)?;
        let seed = seed.map(|seed| seed.named("seed")).transpose()?;
        if let Some(seed) = seed.filter(|&seed| seed != scenario.compiled.plan().seed) {
            scenario = Arc::new(scenario.reseeded(py, seed)?);
        }
        let paths = OutputPaths { folder: out.as_deref(), replace, ..OutputPaths::default() };
        let simulation = Self::start(py, scenario, workers, paths)?;
        if let RecordArgument(Some(selection)) = record {
            let mut run = simulation.run.lock().unwrap_or_else(PoisonError::into_inner);
            let run = run.as_mut().ok_or_else(closed_error)?;
            run.keep_rows(&selection).map_err(|e| error::input_error(&e))?;
        }
        Ok(simulation)
    }

    /// Advances by `cycles` cycles (one by default), and returns the number of cycles done: fewer when nothing can
    /// happen anymore.
    ///
    /// >>> sim.step(), sim.step(5)
    /// (1, 5)
    #[pyo3(signature = (cycles=UnsignedArg::new(1)), text_signature = "($self, cycles=1)")]
    fn step(&self, py: Python<'_>, cycles: UnsignedArg) -> PyResult<u64> {
        self.advance_to_goal(py, Goal::Further(cycles.named("cycles")?), None)
    }

    /// Advances to cycle `until`, by default the planned end, and returns the number of cycles done.
    ///
    /// With `decide`, a function or a dict of functions by team, agents are decided from outside: before each
    /// cycle it is called with a dict of the observations of all agents of a team (arrays of the shape (agents, ...))
    /// and with `state`, and returns their orders: a dict of arrays by name, or the array of the only or first order.
    ///
    /// >>> def decide(observed, state):
    /// ...     return (observed["contact"] > 0).astype(int)        # left where it touched something, else forward
    /// >>> sim.run(30, decide=decide)
    /// 20
    ///
    /// `progress` is a function that is told the cycle and the last one now and then, or True for a bar of tqdm.
    #[pyo3(signature = (until=None, *, decide=None, state=None, progress=None))]
    fn run(
        slf: &Bound<'_, Self>,
        until: Option<UnsignedArg>,
        decide: Option<&Bound<'_, PyAny>>,
        state: Option<Bound<'_, PyAny>>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<u64> {
        let py = slf.py();
        let simulation = slf.get();
        let until = simulation.end_cycle(until.map(|until| until.named("until")).transpose()?);
        let reporter = ProgressReporter::from_argument(progress, "cycle")?;
        let reported = reporter.as_ref();
        let done = match decide {
            None => simulation.advance_to_goal(py, Goal::Until(until), reported),
            Some(decide) => run_with_policies(simulation, decide, state, until, reported),
        };
        if let Some(reporter) = &reporter {
            reporter.close(py)?;
        }
        done
    }

    /// The scenario.
    #[getter]
    fn scenario(&self) -> crate::scenario::Scenario {
        crate::scenario::Scenario(Arc::clone(&self.scenario))
    }

    /// Number of workers.
    #[getter]
    fn workers(&self) -> usize {
        self.workers
    }

    /// Cycles done.
    #[getter]
    fn cycle(&self, py: Python<'_>) -> PyResult<u64> {
        self.read(py, |run| run.cycle())
    }

    /// Returns whether nothing can happen anymore, e.g. because all have arrived.
    #[getter]
    fn is_over(&self, py: Python<'_>) -> PyResult<bool> {
        self.read(py, |run| run.is_over())
    }

    /// Digest of the state, in hexadecimal: equal for equal scenario, seed, cycle and orders.
    #[getter]
    fn digest(&self, py: Python<'_>) -> PyResult<String> {
        self.read(py, |run| run.digest().to_string())
    }

    /// Returns the measurements of the run so far, as in the command's summary.
    ///
    /// >>> sim.metrics()["contacts"]
    /// 0
    fn metrics(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &self.read(py, |run| run.metrics())?)
    }

    /// Returns the measurements of each agent.
    ///
    /// >>> len(sim.agent_metrics())
    /// 2
    fn agent_metrics(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &self.read(py, |run| run.agent_metrics())?)
    }

    /// The teams: agents with the same observations and orders.
    #[getter]
    fn teams<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        crate::json::to_list(py, self.teams.iter().cloned().map(Team))
    }

    /// Returns the observations of a team's agents (by number or name) before the next cycle: arrays by name, of the
    /// shape (agents, ...), in the order of `AgentTeam.agents`. They are the percepts of an agent that decides for itself,
    /// errors included.
    ///
    /// Raises OrderError when there is no such team.
    ///
    /// >>> sim.observe()["at_boxes"].shape
    /// (2, 2)
    #[pyo3(signature = (team=None))]
    fn observe<'py>(
        &self,
        py: Python<'py>,
        team: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (number, team) = self.find_team(team)?;
        self.observations(py, number, &team)
    }

    /// Gives agents an order for the next cycle: `order("action", [0, 2])`. `values` has a row for each
    /// of `agents` (all of the team, by default), or is one number for all. An order stands until its agent has
    /// acted.
    ///
    /// Raises OrderError; no agent gets an order then.
    ///
    /// >>> sim.order("action", [0, 1])
    /// >>> sim.order("action", 0, agents=[1])
    #[pyo3(signature = (name, values, *, agents=None, team=None))]
    fn order(
        &self,
        name: &str,
        values: &Bound<'_, PyAny>,
        agents: Option<&Bound<'_, PyAny>>,
        team: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let agents = agents.map(|agents| agent_ids(agents.py(), agents)).transpose()?;
        if let Some(agents) = &agents {
            refuse_repeated(agents)?;
        }
        let (_, team) = match (team, &agents) {
            (None, Some(agents)) => self.team_of(agents.first().copied())?,
            (team, _) => self.find_team(team)?,
        };
        let agents = agents.as_deref().unwrap_or(&team.agents);
        self.order_agents(name, values, agents, &team)
    }

    /// Returns the state as bytes, for `restore`; run folders of the same scenario hold such checkpoints.
    ///
    /// >>> isinstance(sim.checkpoint(), bytes)
    /// True
    fn checkpoint<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.checkpoint_bytes(py)?))
    }

    /// Continues from a checkpoint of the same scenario. Rows kept in memory lose those of its cycle and of later ones:
    /// `tables` gives the rows of a run that never went there. Rows that `tables` has already given are up to you.
    ///
    /// Raises CheckpointError when it is damaged, or belongs to another scenario or version. Recorded rows have one
    /// past: it is also raised if rows of earlier cycles are kept and this simulation did not make the checkpoint on
    /// its way, and if rows go to a folder (`out`) and it is not the present state: restore it in a `copy`, or in a
    /// new Simulation without a folder.
    ///
    /// >>> before = sim.checkpoint()
    /// >>> sim.step(5)
    /// 5
    /// >>> sim.restore(before)
    /// >>> sim.cycle
    /// 10
    fn restore(&self, py: Python<'_>, checkpoint: Vec<u8>) -> PyResult<()> {
        self.with_run(py, |run| run.restore(&checkpoint).map_err(|e| error::restore_error(&e)))
    }

    /// Returns an independent copy in the same state, which records nothing.
    ///
    /// >>> sim.copy().digest == sim.digest
    /// True
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        let bytes = self.checkpoint_bytes(py)?;
        let copy =
            Self::start(py, Arc::clone(&self.scenario), self.workers, OutputPaths::default())?;
        copy.restore(py, bytes)?;
        Ok(copy)
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copy(py)
    }

    /// Pickles the simulation with its scenario, all files of that, and its state.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, PickledArgs<'py>)> {
        let py = slf.py();
        let simulation = slf.get();
        let maker = py.import("sidestep._native")?.getattr("rebuild")?;
        let ResolvedScenario { text, files } = simulation.scenario.resolved()?.clone();
        Ok((maker, ((text, files), simulation.workers, simulation.checkpoint(py)?)))
    }

    /// Returns all bodies as arrays: `kind` and `condition` (text), `number`, `part` (-1 where there are no parts), `at_m` (n, 3),
    /// `turn` (n, 4: a unit quaternion x, y, z, w), `velocity_m_s` (n, 3), besides `cycle` and `time_s`.
    ///
    /// >>> sim.snapshot()["at_m"].shape
    /// (2, 3)
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frame =
            self.with_run(py, |run| Ok(run.simulation_mut().frame(FrameOptions::WITHOUT_SCANS)))?;
        let bodies = &frame.bodies;
        let dict = PyDict::new(py);
        dict.set_item("cycle", frame.cycle)?;
        dict.set_item("time_s", frame.time_s)?;
        dict.set_item("kind", body_texts(py, bodies, |body| body.kind.name().to_string())?)?;
        dict.set_item("number", body_column(py, bodies, |body| body.number))?;
        dict.set_item("part", body_column(py, bodies, |body| body.part.map_or(-1, i64::from)))?;
        dict.set_item("at_m", body_rows(py, bodies, |body| body.pose.at_m)?)?;
        dict.set_item("turn", body_rows(py, bodies, |body| body.pose.turn)?)?;
        dict.set_item("velocity_m_s", body_rows(py, bodies, |body| body.velocity_m_s)?)?;
        dict.set_item("condition", body_texts(py, bodies, condition_name)?)?;
        Ok(dict)
    }

    /// Renders the present state as an image: an array (height, width, 3) of red, green and blue (uint8).
    ///
    /// `width` is its longer side in pixels; with `size`, (width, height), it is exactly as large, with its line of text.
    /// The agents with the numbers `agents` stand out, the others are pale. `view` is the side from which a run in space
    /// is seen: "top", "side", "front", or degrees about the vertical and above the horizon, "-60,30".
    ///
    /// Raises InputError when a side is 0 or above 4096 pixels, no agent has such a number, or there is no such view.
    ///
    /// >>> sim.render(100).shape[1:]
    /// (100, 3)
    /// >>> sim.render(size=(320, 200), agents=[1], view="top").shape
    /// (200, 320, 3)
    #[pyo3(signature = (width=640, *, size=None, agents=Vec::new(), view=None))]
    fn render<'py>(
        slf: PyRef<'py, Self>,
        width: u32,
        size: Option<[u32; 2]>,
        agents: Vec<u32>,
        view: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let py = slf.py();
        let (still, size_px) = slf.draw(py, parse_look(width, size, agents, view)?)?;
        to_pixels(py, &still, size_px)
    }

    /// The same as `render`.
    ///
    /// >>> bool((sim.picture(100) == sim.render(100)).all())
    /// True
    #[pyo3(signature = (width=640, *, size=None, agents=Vec::new(), view=None))]
    fn picture<'py>(
        slf: PyRef<'py, Self>,
        width: u32,
        size: Option<[u32; 2]>,
        agents: Vec<u32>,
        view: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        Self::render(slf, width, size, agents, view)
    }

    /// Returns the present frame as a table, one row for each body: kind, place, orientation, velocity and condition.
    ///
    /// >>> len(sim.frame()), sim.frame().units["x_m"]
    /// (2, 'm')
    fn frame(&self, py: Python<'_>) -> PyResult<Table> {
        let rows = self.with_run(py, |run| Ok(run.frame_rows()));
        rows.and_then(|(schema, columns)| Table::new(schema, columns))
    }

    /// Returns the percepts and decisions of a body in the next cycle, and their outcome, as a dict; None if there is
    /// nothing to show. Looking changes nothing.
    ///
    /// Raises InputError when there is no such kind.
    ///
    /// >>> [section["title"] for section in sim.inspect("robot", 0)["sections"]][:2]
    /// ['Now', 'Memory']
    #[pyo3(signature = (kind, number, part=None))]
    fn inspect(
        &self,
        py: Python<'_>,
        kind: &str,
        number: u32,
        part: Option<u32>,
    ) -> PyResult<Py<PyAny>> {
        let kinds = worlds::list().kinds();
        let kind = kinds.find(kind).ok_or_else(|| {
            argument_error(
                "kind",
                format!("there is no kind `{kind}`"),
                format!("one of {}", kinds.names().join(", ")),
            )
        })?;
        let inspection = self.read(py, |run| {
            let inspection = run.inspect(BodyId::new(kind, number, part));
            inspection.and_then(|it| serde_json::to_value(it).ok()).unwrap_or_default()
        })?;
        to_python(py, &inspection)
    }

    /// Keeps rows in memory from now on: those of all tables, or of these; with `frames=n` also the table `frames`, with all
    /// bodies at every n-th cycle. `tables` and `blocks` hand them over.
    ///
    /// Raises InputError when there is no such table, or rows are already kept or go to a folder.
    ///
    /// >>> sim = sidestep.Simulation(floor)
    /// >>> sim.record(["trajectories"], frames=5)
    /// >>> sim.step(10)
    /// 10
    /// >>> {name: len(table) for name, table in sim.tables().items()}
    /// {'trajectories': 20, 'frames': 6}
    #[pyo3(signature = (tables=None, *, frames=None))]
    fn record(
        &self,
        py: Python<'_>,
        tables: Option<RecordArgument>,
        frames: Option<UnsignedArg>,
    ) -> PyResult<()> {
        let RecordArgument(selection) =
            tables.unwrap_or(RecordArgument(Some(RowSelection::default())));
        let Some(selection) = selection else {
            return Err(argument_error(
                "record",
                "rows that are kept are not dropped",
                "leave it out",
            ));
        };
        let frames = frames.map(|frames| frames.named("frames")).transpose()?;
        let selection = RowSelection { frames, ..selection };
        self.with_run(py, |run| run.keep_rows(&selection).map_err(|e| error::input_error(&e)))
    }

    /// Takes the rows recorded since the last call: tables by name. Needs `record=True`, or `record` before.
    ///
    /// Raises InputError when rows are not kept in memory.
    ///
    /// >>> len(sim.tables()["trajectories"])
    /// 20
    fn tables<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rows = self.with_run(py, |run| {
            if !run.keeps_rows() {
                let remedy =
                    "make it with record=True; with `out` read its folder when it is closed";
                return Err(argument_error(
                    "tables",
                    "the rows of this run are not kept in memory",
                    remedy,
                ));
            }
            run.take_rows().map_err(|e| error::record_error(&e))
        })?;
        tables_dict(py, rows)
    }

    /// Runs on to cycle `until` (the planned end, by default) and hands the rows over as they come: an iterator that
    /// advances by `cycles` cycles at a time, and gives the tables of those, by name. So a run of any length takes the
    /// memory of one block. `decide` and `state` are those of `run`. Rows of all tables are kept from now on, unless
    /// `record` has named some.
    ///
    /// >>> sim = sidestep.Simulation(floor)
    /// >>> for tables in sim.blocks(40, until=100):
    /// ...     print(sim.cycle, len(tables["trajectories"]))
    /// 40 80
    /// 80 80
    /// 100 40
    #[pyo3(
        signature = (cycles=UnsignedArg::new(1024), until=None, *, decide=None, state=None),
        text_signature = "($self, cycles=1024, until=None, *, decide=None, state=None)"
    )]
    fn blocks(
        slf: Bound<'_, Self>,
        cycles: UnsignedArg,
        until: Option<UnsignedArg>,
        decide: Option<Py<PyAny>>,
        state: Option<Py<PyAny>>,
    ) -> PyResult<Blocks> {
        let py = slf.py();
        let simulation = slf.get();
        let cycles = cycles.named("cycles")?;
        if cycles == 0 {
            return Err(argument_error(
                "cycles",
                "a block of 0 cycles never ends",
                "give 1 or more",
            ));
        }
        simulation.with_run(py, |run| {
            if run.keeps_rows() {
                return Ok(());
            }
            run.keep_rows(&RowSelection::default()).map_err(|e| error::input_error(&e))
        })?;
        let until = simulation.end_cycle(until.map(|until| until.named("until")).transpose()?);
        // Functions keep their state from block to block, as from cycle to cycle.
        let state = state.unwrap_or_else(|| PyDict::new(py).into_any().unbind());
        let simulation = slf.into_any().unbind();
        Ok(Blocks { simulation, cycles, until, decide, state })
    }

    /// Ends the run. A run folder gets its summary and picture: it is complete at the planned end, and otherwise can
    /// be resumed. Returns the summary as a dict; None if it was closed before.
    ///
    /// Raises RecordError when something cannot be stored.
    ///
    /// >>> sim.close()["cycles"]
    /// 10
    fn close(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let signals = SignalWatcher::default();
        let summary = py.detach(|| {
            let run = self.run.lock().unwrap_or_else(PoisonError::into_inner).take();
            run.map(|run| run.finish(&signals)).transpose()
        });
        match summary.map_err(|e| error::session_error(&e))? {
            None => Ok(py.None()),
            Some(summary) => to_python(py, &serde_json::to_value(&summary).unwrap_or_default()),
        }
    }

    fn __enter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    #[pyo3(signature = (*_raised))]
    fn __exit__(&self, py: Python<'_>, _raised: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py).map(drop)
    }

    /// Returns the picture and the measurements, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        to_html(slf.as_any(), "simulation")
    }

    /// Returns the picture as PNG, for notebooks; None when it is closed.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyBytes>>> {
        match self.draw(py, AnimationLook::longer_side(NOTEBOOK_WIDTH_PX)) {
            Ok((still, _)) => {
                let bytes = still.to_png().map_err(|e| draw_error(&e))?;
                Ok(Some(PyBytes::new(py, &bytes)))
            }
            Err(raised) if raised.is_instance_of::<ClosedError>(py) => Ok(None),
            Err(raised) => Err(raised),
        }
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let plan = self.scenario.compiled.plan();
        match self.cycle(py) {
            Ok(cycle) => format!("Simulation({}, cycle {cycle} of {})", plan.name, plan.cycles),
            Err(_) => format!("Simulation({}, closed)", plan.name),
        }
    }
}

impl PolicyRun for Simulation {
    fn now(&self, py: Python<'_>) -> PyResult<Cycle> {
        self.cycle(py)
    }

    fn has_ended(&self, py: Python<'_>) -> PyResult<bool> {
        self.is_over(py)
    }

    fn plan(&self) -> RunConfig {
        self.scenario.compiled.plan()
    }

    fn team(&self, team: &Bound<'_, PyAny>) -> PyResult<IndexedTeam> {
        self.find_team(Some(team))
    }

    fn ordered_teams(&self) -> Vec<IndexedTeam> {
        let teams = self.teams.iter().cloned().enumerate();
        teams.filter(|(_, team)| !team.action_spaces.is_empty()).collect()
    }

    fn observed<'py>(&self, py: Python<'py>, team: &IndexedTeam) -> PyResult<Bound<'py, PyDict>> {
        self.observations(py, team.0, &team.1)
    }

    fn give_order(
        &self,
        order: &str,
        values: &Bound<'_, PyAny>,
        team: &control::AgentTeam,
    ) -> PyResult<()> {
        self.order_agents(order, values, &team.agents, team)
    }

    fn advance(&self, py: Python<'_>) -> PyResult<()> {
        self.advance_to_goal(py, Goal::Further(1), None).map(drop)
    }
}

/// The arguments of [`rebuild`].
type PickledArgs<'py> = (Bundle, usize, Bound<'py, PyBytes>);

/// Returns a pickled simulation.
#[pyfunction]
pub(crate) fn rebuild(
    py: Python<'_>,
    scenario: Bundle,
    workers: usize,
    checkpoint: Vec<u8>,
) -> PyResult<Simulation> {
    let (text, files) = scenario;
    let scenario = Arc::new(LoadedScenario::from_bundle(py, ResolvedScenario { text, files })?);
    let simulation = Simulation::start(py, scenario, workers, OutputPaths::default())?;
    simulation.restore(py, checkpoint)?;
    Ok(simulation)
}
