//! Policies: functions in Python that decide for a team, between observing and acting.

use crate::error::OrderError;
use crate::watch::ProgressReporter;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use sidestep::kernel::control::AgentTeam;
use sidestep::kernel::{Cycle, RunConfig};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two reports of progress: bars look smooth, and a function costs nothing.
const REPORT_INTERVAL: Duration = Duration::from_millis(50);

/// A team, preceded by its number.
pub(crate) type IndexedTeam = (usize, Arc<AgentTeam>);

/// The part of a run that policies need.
pub(crate) trait PolicyRun {
    fn now(&self, py: Python<'_>) -> PyResult<Cycle>;
    /// Returns whether nothing can happen anymore.
    fn has_ended(&self, py: Python<'_>) -> PyResult<bool>;
    fn plan(&self) -> RunConfig;
    /// Returns a team by number or name, with its number, by which the run knows it.
    fn team(&self, team: &Bound<'_, PyAny>) -> PyResult<IndexedTeam>;
    /// Returns the teams that take orders, with their numbers.
    fn ordered_teams(&self) -> Vec<IndexedTeam>;
    /// Returns the observations of a team before the next cycle, one array by name for each space.
    fn observed<'py>(&self, py: Python<'py>, team: &IndexedTeam) -> PyResult<Bound<'py, PyDict>>;
    /// Gives an order to all agents of a team for the next cycle.
    fn give_order(&self, order: &str, values: &Bound<'_, PyAny>, team: &AgentTeam) -> PyResult<()>;
    /// Advances by one cycle.
    fn advance(&self, py: Python<'_>) -> PyResult<()>;
}

/// A team, its number, and the function that decides for it.
struct TeamPolicy<'py> {
    team: IndexedTeam,
    decide: Bound<'py, PyAny>,
}

/// Advances a run to a cycle under the control of policies, and returns the number of cycles done.
pub(crate) fn run_with_policies(
    run: &impl PolicyRun,
    decide: &Bound<'_, PyAny>,
    state: Option<Bound<'_, PyAny>>,
    until: Cycle,
    reporter: Option<&ProgressReporter>,
) -> PyResult<u64> {
    let py = decide.py();
    let policies = team_policies(run, decide)?;
    let state = state.unwrap_or_else(|| PyDict::new(py).into_any());
    let from = run.now(py)?;
    let mut last_report = Instant::now();
    while run.now(py)? < until && !run.has_ended(py)? {
        let cycle = run.now(py)?;
        for policy in &policies {
            policy.order(py, run, &state).inspect_err(|raised| {
                // Without the note, the exception itself still reaches the user.
                let _ = add_cycle_note(py, run, raised);
            })?;
        }
        if run.now(py)? != cycle {
            let cause = "`decide` has advanced the run itself: its orders are for the cycle that it was asked about";
            return Err(OrderError::new_err(cause));
        }
        run.advance(py)?;
        if let Some(reporter) = reporter
            && last_report.elapsed() >= REPORT_INTERVAL
        {
            reporter.report(py, cycle + 1, until)?;
            last_report = Instant::now();
        }
    }
    let now = run.now(py)?;
    if let Some(reporter) = reporter {
        reporter.report(py, now, until)?;
    }
    Ok(now - from)
}

/// Adds the cycle of the run to an exception of a function, in versions of Python that can do so.
fn add_cycle_note(py: Python<'_>, run: &impl PolicyRun, raised: &PyErr) -> PyResult<()> {
    let plan = run.plan();
    let cycle = run.now(py)?;
    let note = format!(
        "deciding for cycle {cycle} of `{}`, seed {}, sidestep {}; the run is at that cycle still",
        plan.name,
        plan.seed,
        sidestep::VERSION
    );
    raised.value(py).call_method1("add_note", (note,)).map(drop)
}

/// Returns the functions by team: one function decides for all that take orders.
fn team_policies<'py>(
    run: &impl PolicyRun,
    decide: &Bound<'py, PyAny>,
) -> PyResult<Vec<TeamPolicy<'py>>> {
    let mut policies = Vec::new();
    if let Ok(by_team) = decide.cast::<PyMapping>() {
        for entry in by_team.items()?.iter() {
            let (team, decide): (Bound<'_, PyAny>, Bound<'_, PyAny>) = entry.extract()?;
            policies.push(TeamPolicy::new(run.team(&team)?, &decide)?);
        }
        return Ok(policies);
    }
    for team in run.ordered_teams() {
        policies.push(TeamPolicy::new(team, decide)?);
    }
    if policies.is_empty() {
        return Err(OrderError::new_err(
            "no agent of this scenario takes orders; let it say that some are `external`",
        ));
    }
    Ok(policies)
}

impl<'py> TeamPolicy<'py> {
    /// Returns the policy of a team: the function, or the one that its `of_team` returns for this team.
    fn new(team: IndexedTeam, decide: &Bound<'py, PyAny>) -> PyResult<Self> {
        let decide = match decide.getattr_opt("of_team")? {
            Some(of_team) => of_team.call1((crate::space::Team(Arc::clone(&team.1)),))?,
            None => decide.clone(),
        };
        Ok(Self { team, decide })
    }

    /// Calls the function, and gives its orders.
    fn order(
        &self,
        py: Python<'_>,
        run: &impl PolicyRun,
        state: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let observed = run.observed(py, &self.team)?;
        let decided = self.decide.call1((observed, state))?;
        let (_, team) = &self.team;
        if decided.is_none() {
            // This is far more often a forgotten `return` than a decision.
            let message = format!(
                "the function that decides for team `{}` returned None; return its orders, {{}} for none",
                team.name
            );
            return Err(OrderError::new_err(message));
        }
        // A bare array stands for the first order: most teams have only one, and its name would be noise. It is also
        // what the documentation of `Simulation.run` promises.
        let Ok(by_name) = decided.cast::<PyMapping>() else {
            let Some(first) = team.action_spaces.first() else {
                let message = format!("the agents of team `{}` decide for themselves", team.name);
                return Err(OrderError::new_err(message));
            };
            return run.give_order(&first.name, &decided, team);
        };
        for entry in by_name.items()?.iter() {
            let (order, values): (String, Bound<'_, PyAny>) = entry.extract()?;
            run.give_order(&order, &values, team)?;
        }
        Ok(())
    }
}
