//! Probability collectives: games of tables, or of an objective in Python.

use crate::choice::choose;
use crate::error::argument_error;
use crate::json::to_list;
use crate::result::{Fields, ResultClass};
use crate::watch::{catch_interrupt, run_interruptible};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyList;
use sidestep::collectives::{
    Choice, Estimator, Game, LocalSearch, OptimizeResult, OptimizerConfig, PairwiseGame,
    StopCriterion, Update, UpdateOrder, Utility, optimize,
};
use sidestep::kernel::Seed;
use sidestep::kernel::interrupt::{self, Interrupt};
use sidestep::kernel::stream::{Purpose, Streams};
use std::sync::{Mutex, PoisonError};

/// The random streams of the players' samples.
const SAMPLES_PURPOSE: Purpose = Purpose(0);

/// The settings of an optimization, as passed by `sidestep.collectives.minimize`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct MinimizeOptions {
    estimator: String,
    block: usize,
    ageing: f64,
    update: String,
    step: f64,
    order: String,
    utility: String,
    cooling: f64,
    threshold: f64,
    calm_rounds: u32,
    max_rounds: u32,
    choice: String,
    local_search: String,
    random_starts: u32,
    seed: u64,
}

/// Refuses a number outside of (0, 1].
fn check_fraction(name: &str, value: f64) -> PyResult<f64> {
    if value > 0.0 && value <= 1.0 {
        return Ok(value);
    }
    Err(argument_error(name, format!("is {value}"), "give a number above 0, up to 1"))
}

impl MinimizeOptions {
    fn settings(&self) -> PyResult<OptimizerConfig> {
        if self.block == 0 || !(0.0..=1.0).contains(&self.ageing) {
            let cause = format!("blocks of {} samples that age by {}", self.block, self.ageing);
            return Err(argument_error(
                "block",
                cause,
                "give 1 sample or more, and an ageing from 0 to 1",
            ));
        }
        let step = check_fraction("step", self.step)?;
        let sampled = Estimator::Sampled { block: self.block, ageing: self.ageing };
        let newton = Update::NearestNewton { step };
        let brouwer = Update::Brouwer { step };
        Ok(OptimizerConfig {
            estimator: choose(
                "estimator",
                &self.estimator,
                &[("exact", Estimator::Exact), ("sampled", sampled)],
            )?,
            update: choose("update", &self.update, &[("newton", newton), ("brouwer", brouwer)])?,
            order: choose(
                "order",
                &self.order,
                &[("parallel", UpdateOrder::Parallel), ("sequence", UpdateOrder::Sequence)],
            )?,
            utility: choose(
                "utility",
                &self.utility,
                &[("joint", Utility::Joint), ("private", Utility::Private)],
            )?,
            cooling: check_fraction("cooling", self.cooling)?,
            stop: StopCriterion {
                threshold: self.threshold,
                calm_rounds: self.calm_rounds.max(1),
                max_rounds: self.max_rounds,
            },
            choice: choose(
                "choice",
                &self.choice,
                &[("argmax", Choice::Argmax), ("draw", Choice::Draw)],
            )?,
            local_search: choose(
                "local_search",
                &self.local_search,
                &[
                    ("none", LocalSearch::None),
                    ("pairs", LocalSearch::Pairs),
                    ("branch-and-bound", LocalSearch::BranchAndBound),
                ],
            )?,
            random_starts: self.random_starts,
        })
    }

    fn uniform(&self) -> impl Fn(usize, u64) -> f64 + use<> {
        let streams = Streams::new(Seed(self.seed));
        // The stream is keyed by player and draw, so that a number depends on no other draw and on no order of players.
        move |player, k| streams.draws(player as u32, k, SAMPLES_PURPOSE).uniform()
    }
}

/// Returns the error of an interrupted optimization: another exception has already been raised at the interrupt.
fn interrupted_error() -> PyErr {
    argument_error("minimize", "it was interrupted", "call it again")
}

/// Minimizes a sum over players and pairs: the native part of `sidestep.collectives.minimize`.
#[pyfunction]
pub(crate) fn minimize_pairs<'py>(
    py: Python<'py>,
    own: Vec<PyReadonlyArray1<'py, f64>>,
    pairs: Vec<(usize, usize, PyReadonlyArray2<'py, f64>)>,
    options: MinimizeOptions,
) -> PyResult<Bound<'py, PyAny>> {
    let own: Vec<Vec<f64>> = own.iter().map(|costs| costs.as_array().to_vec()).collect();
    let sizes: Vec<usize> = own.iter().map(Vec::len).collect();
    if own.is_empty() || sizes.contains(&0) {
        return Err(argument_error(
            "own",
            "a player has no strategy",
            "give each player's costs, one or more",
        ));
    }
    let mut game = PairwiseGame::new(own);
    for (a, b, costs) in &pairs {
        let costs = costs.as_array();
        let place = format!("pairs[{a}, {b}]");
        if a == b || *a >= sizes.len() || *b >= sizes.len() {
            let remedy = format!("give two different numbers below {}", sizes.len());
            return Err(argument_error(&place, "these are no two players", remedy));
        }
        if costs.dim() != (sizes[*a], sizes[*b]) {
            let cause = format!("has the shape {:?}", costs.dim());
            let remedy = format!("give a row per strategy of {a}: ({}, {})", sizes[*a], sizes[*b]);
            return Err(argument_error(&place, cause, remedy));
        }
        game.add_pair(*a, *b, costs.iter().copied().collect());
    }
    let settings = options.settings()?;
    let uniform = options.uniform();
    let outcome = run_interruptible(py, || optimize(&game, &settings, uniform))?;
    minimize_result(py, &outcome)
}

/// A game with a cost that Python computes.
struct Objective {
    strategies: Vec<usize>,
    cost: Py<PyAny>,
    raised: Mutex<Option<PyErr>>,
    interrupt: Interrupt,
}

impl Objective {
    fn evaluate(&self, joint: &[usize]) -> PyResult<f64> {
        Python::attach(|py| {
            let joint = integers(joint).to_pyarray(py);
            let cost: f64 = self.cost.bind(py).call1((joint,))?.extract()?;
            if cost.is_nan() {
                return Err(argument_error(
                    "objective",
                    "its cost is not a number",
                    "return a number",
                ));
            }
            py.check_signals().map(|()| cost)
        })
    }
}

impl Game for Objective {
    fn strategies(&self) -> &[usize] {
        &self.strategies
    }

    fn cost(&self, joint: &[usize]) -> f64 {
        self.evaluate(joint).unwrap_or_else(|error| {
            *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            // Unwinds out of the optimizer, whose games have no errors: there is no cost to continue with.
            self.interrupt.raise();
            interrupt::check();
            f64::NAN
        })
    }
}

/// Minimizes a cost that Python computes, by samples: the native part of `sidestep.collectives.minimize`.
#[pyfunction]
pub(crate) fn minimize_objective<'py>(
    py: Python<'py>,
    strategies: Vec<usize>,
    objective: Py<PyAny>,
    options: MinimizeOptions,
) -> PyResult<Bound<'py, PyAny>> {
    if strategies.is_empty() || strategies.contains(&0) {
        let remedy = "give a number of strategies for each player, 1 or more";
        return Err(argument_error("strategies", "a player has no strategy", remedy));
    }
    let game = Objective {
        strategies,
        cost: objective,
        raised: Mutex::default(),
        interrupt: Interrupt::default(),
    };
    let settings = options.settings()?;
    let uniform = options.uniform();
    let result = catch_interrupt(&game.interrupt, || optimize(&game, &settings, uniform));
    let raised = game.raised.into_inner().unwrap_or_else(PoisonError::into_inner);
    raised.map_or(Ok(()), Err)?;
    let outcome = result.ok_or_else(interrupted_error)?;
    minimize_result(py, &outcome)
}

fn minimize_result<'py>(py: Python<'py>, outcome: &OptimizeResult) -> PyResult<Bound<'py, PyAny>> {
    Fields::new(py)
        .with("joint", integers(&outcome.joint).to_pyarray(py))?
        .with("cost", outcome.cost)?
        .with("bound", outcome.bound)?
        .with("q", to_arrays(py, &outcome.q)?)?
        .with("expected", to_arrays(py, &outcome.expected)?)?
        .with("rounds", outcome.rounds)?
        .with("converged", outcome.converged)?
        .build(ResultClass("sidestep.collectives", "MinimizeResult"))
}

/// Returns the numbers of strategies in the type that NumPy uses for indices.
fn integers(joint: &[usize]) -> Vec<i64> {
    joint.iter().map(|k| *k as i64).collect()
}

fn to_arrays<'py>(py: Python<'py>, rows: &[Vec<f64>]) -> PyResult<Bound<'py, PyList>> {
    to_list(py, rows.iter().map(|row| PyArray1::from_slice(py, row)))
}
