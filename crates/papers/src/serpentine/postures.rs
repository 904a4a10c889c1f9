//! Inverse kinematics by the chain's own rules (slides F2, E3): a tip is pulled to a target while
//! the base objects, while it is free, and there and back; and damped least squares beside it.

use super::Plan;
use super::runs::{Share, draws, grid, median};
use crate::farm::Progress;
use cpu_time::ThreadTime;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::kernel::math::powf;
use sidestep::kernel::stream::Draws;
use sidestep::worlds::chain::geometry::{Point, along, distance, scaled, unit};
use sidestep::worlds::chain::ik::{Engine, Goal, Solver};
use sidestep::worlds::chain::{
    Chain, Connector, Mobility, Obstacles, Propagator, Request, Rod, Rules,
};
use sidestep_document::figure::{Point as FigurePoint, Scale};
use sidestep_document::{Figure, FigureKind, Series, Table};

/// Targets are within this part of the reach.
const WITHIN: f64 = 0.9;
/// Near enough, in parts of the reach.
const TOLERANCE: f64 = 1e-4;

/// Ways to bring a tip to a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// One motion of the tip; the base always objects to being moved, as the slides have it.
    Veto,
    /// One motion of the tip, nobody is fixed.
    FreeBase,
    /// The chain's rule there and back until tip and base are where they belong.
    ThereAndBack,
    /// Damped least squares.
    LeastSquares,
}

impl Way {
    const ALL: [Self; 4] = [Self::Veto, Self::FreeBase, Self::ThereAndBack, Self::LeastSquares];

    fn name(self) -> &'static str {
        match self {
            Self::Veto => "one pull, base objects",
            Self::FreeBase => "one pull, base free",
            Self::ThereAndBack => "there and back",
            Self::LeastSquares => "damped least squares",
        }
    }
}

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// How.
    pub way: Way,
    /// Rods.
    pub links: usize,
    /// How much longer and shorter than their mean rods may be.
    pub slack: f64,
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The case.
    pub case: Case,
    /// Targets that were reached with base and rods in order.
    pub reached: Share,
    /// Those that the way itself did not reach, and that were finished in closed form.
    pub finished: u64,
    /// Processor time, microseconds, median.
    pub median_us: f64,
    /// Passes or steps, median.
    pub median_iterations: f64,
}

struct Solved {
    reached: bool,
    finished: bool,
    us: f64,
    iterations: usize,
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Postures {
    /// Results by case.
    pub cells: Vec<Cell>,
}

fn direction(draws: &mut Draws) -> Point<3> {
    unit([0; 3].map(|_: u8| normal(draws))).unwrap_or([1.0, 0.0, 0.0])
}

/// A chain at random whose rods are as long as on average.
fn chain(case: &Case, draws: &mut Draws) -> Result<Chain<3>, InputError> {
    let (slack, n) = (case.slack, case.links);
    let rod = Rod { min_m: 1.0 - slack, max_m: 1.0 + slack, radius_m: 0.01 };
    let mut points = vec![[0.0; 3]];
    let mut u = direction(draws);
    for i in 0..n {
        let turned = along(u, direction(draws), 0.5);
        u = unit(turned).unwrap_or(u);
        points.push(along(points[i], u, 1.0));
    }
    let mut connectors = vec![Connector::free(0.02); n + 1];
    if case.way == Way::Veto {
        connectors[0].mobility = Mobility::Fixed;
    }
    // Of fixed length to the bit: as long as they came out.
    let rods = points.windows(2).map(|ends| match slack {
        0.0 => Rod::fixed(distance(ends[0], ends[1]), 0.01),
        _ => rod,
    });
    let rods = rods.collect();
    Chain::new(points, connectors, rods)
}

fn solved(case: &Case, seed: u64) -> Result<Solved, InputError> {
    let draws = &mut draws(seed);
    let mut chain = chain(case, draws)?;
    let (tip, reach_m) = (case.links, case.links as f64);
    let part = powf(draws.uniform(), 1.0 / 3.0);
    let target = scaled(direction(draws), WITHIN * reach_m * part);
    let engine = match case.way {
        Way::Veto | Way::FreeBase => return pulled(&mut chain, tip, target),
        Way::ThereAndBack => Engine::Chain,
        Way::LeastSquares => Engine::Dls,
    };
    let goal = Goal { engine, tolerance_m: TOLERANCE * reach_m, ..Goal::new(tip, 0, target) };
    let mut solver = Solver::new(Rules::default());
    let began = ThreadTime::now();
    let answer = solver.solve(&chain, &Obstacles::default(), &goal)?;
    let us = 1e6 * began.elapsed().as_secs_f64();
    let finished = answer.engine == Engine::Direct;
    Ok(Solved { reached: answer.reached, finished, us, iterations: answer.iterations })
}

fn pulled(chain: &mut Chain<3>, tip: usize, target: Point<3>) -> Result<Solved, InputError> {
    let request = Request::exact(tip, target);
    let began = ThreadTime::now();
    let outcome = Propagator::default().propagate(chain, &Obstacles::default(), &request)?;
    let us = 1e6 * began.elapsed().as_secs_f64();
    Ok(Solved { reached: outcome.moved().is_some(), finished: false, us, iterations: 1 })
}

impl Postures {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for &links in &plan.ik_links {
            for slack in [0.0, 0.1] {
                cases.extend(Way::ALL.map(|way| Case { way, links, slack }));
            }
        }
        let all = grid((plan, plan.ik_targets), "targets of tips", &cases, progress, solved)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, runs)| cell(*case, runs)).collect() })
    }

    /// Cells of a way.
    pub(super) fn of(&self, way: Way) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(move |c| c.case.way == way)
    }

    pub(super) fn table(&self) -> Table {
        let note = "Targets uniform within 0.9 of the reach in space, to 1e-4 of it, from a posture at \
                    random; nothing in the way. `finished`: not reached by the way itself, but in \
                    closed form. With a free base one motion always is enough.";
        let columns =
            ["links", "slack", "way", "reached", "finished", "median, us", "passes or steps"];
        let mut table = Table::new("Inverse kinematics", note, &columns);
        for c in &self.cells {
            table.row([
                c.case.links.to_string(),
                format!("{} %", 100.0 * c.case.slack),
                c.case.way.name().into(),
                c.reached.to_string(),
                c.finished.to_string(),
                format!("{:.1}", c.median_us),
                c.median_iterations.to_string(),
            ]);
        }
        table
    }

    pub(super) fn figure(&self) -> Figure {
        let mut links: Vec<usize> = self.cells.iter().map(|c| c.case.links).collect();
        links.dedup();
        let series = |way: Way, slack: f64| {
            let cells = self.of(way).filter(move |c| c.case.slack == slack);
            let points = (0..).zip(cells).map(|(k, c)| FigurePoint::new(f64::from(k), c.median_us));
            let rods = if slack == 0.0 {
                "fixed rods".into()
            } else {
                format!("\u{b1}{} %", 100.0 * slack)
            };
            Series { name: format!("{}, {rods}", way.name()), points: points.collect() }
        };
        Figure {
            title: "Time to bring a tip to its target".into(),
            x_label: "links".into(),
            y_label: "median, microseconds".into(),
            y_scale: Scale::Log,
            kind: FigureKind::Bars { categories: links.iter().map(ToString::to_string).collect() },
            series: vec![
                series(Way::ThereAndBack, 0.0),
                series(Way::ThereAndBack, 0.1),
                series(Way::LeastSquares, 0.0),
                series(Way::LeastSquares, 0.1),
            ],
            ..Figure::default()
        }
    }
}

fn cell(case: Case, runs: &[Solved]) -> Cell {
    Cell {
        case,
        reached: Share::of(runs.iter().map(|r| r.reached)),
        finished: runs.iter().filter(|r| r.finished).count() as u64,
        median_us: median(runs.iter().map(|r| r.us)),
        median_iterations: median(runs.iter().map(|r| r.iterations as f64)),
    }
}
