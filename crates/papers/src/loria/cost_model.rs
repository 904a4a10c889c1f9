//! The paper's cost model, fitted to measured phases.
//!
//! The paper's formulas are lost in part; read as
//!
//! ```text
//! T1 = n t_p + m t_o                                  perceive, decide, generate
//! T2 = (n + m) c_d + p (n + m) c_s + f e_u            detect, solve, update
//! ```
//!
//! with `n` agents, `m` active objects, `p` the share of bodies in conflict, and `f` the boxes
//! that change their occupation. (In the paper an update also refreshes the distributions
//! around a body; here those are computed when needed, so a change costs only its boxes.)
//!
//! Each parameter is identified as follows:
//! - `t_p`, `t_o`: by runs of different `n : m`.
//! - `c_s`: by runs of similar `n + m` but different crowding, hence different `p`. `p` itself is
//!   counted, not fitted: bodies in groups of two or more, divided by bodies.
//! - `e_u`: by bodies of different size (a step rewrites two rows of boxes per body).
//! - `c_d`: the cost of detection and reaction per body without the parts of `p` and `f`. It
//!   contains everything that is paid per body: joining claims, judging paths, bookkeeping.
//!
//! Both sides are divided by `n + m` before fitting, so that all runs have equal weight; the share
//! of variance explained is that of the cost *per body*, a harder test than that of whole cycles.

use super::LoriaConfig;
use super::floor::Floor;
use super::timing::Workload;
use crate::case_results::{figure, table};
use crate::study::Progress;
use serde::Serialize;
use sidestep::kernel::Simulation;
use sidestep::statistics::Interval;
use sidestep::statistics::least_squares::Fit;
use sidestep::worlds::robots::RobotsRun;
use sidestep_document::figure::Point as FigurePoint;
use sidestep_document::{Figure, FigureKind, Series, Table};
use std::sync::Arc;

/// A run with one worker, per cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct CostSample {
    /// Robots, `n`.
    pub(super) agents: f64,
    /// People and doors, `m`.
    pub(super) objects: f64,
    /// Side of a robot in boxes.
    pub(super) size: u32,
    /// Bodies in groups of two or more, `p (n + m)`.
    pub(super) in_conflict: f64,
    /// Boxes entered or left, `f`.
    pub(super) boxes: f64,
    /// Time of pool one, ns.
    pub(super) first_ns: f64,
    /// Time of joining and of pool two, ns.
    pub(super) second_ns: f64,
}

impl CostSample {
    fn bodies(&self) -> f64 {
        self.agents + self.objects
    }
}

/// A parameter of the model and its value, ns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Parameter {
    /// Its name in the paper, as read.
    pub(super) name: String,
    /// The work that takes the time, in words.
    pub(super) meaning: String,
    pub(super) value_ns: f64,
    /// 95 % interval in ns.
    pub(super) interval_ns: Option<Interval>,
}

/// The fitted model.
#[derive(Debug, Clone, Serialize)]
pub(super) struct CostModel {
    /// The runs that were fitted, one for each load.
    pub(super) points: Vec<CostSample>,
    /// `t_p`, `t_o`, `c_d`, `c_s`, `e_u`; empty if they cannot be separated.
    pub(super) parameters: Vec<Parameter>,
    /// Share of the variance of the cost per body explained, of step one and of step two.
    pub(super) r_squared: [f64; 2],
    /// Share of the variance of whole cycles' times explained, of both steps together.
    pub(super) r_squared_cycle: f64,
    /// Least and greatest share of bodies in conflict, `p`.
    pub(super) conflict_share: (f64, f64),
}

const PARAMETERS: [(&str, &str); 5] = [
    ("t_p", "an agent perceives and decides"),
    ("t_o", "an active object generates its action"),
    ("c_d", "per body: detect conflicts, judge and make its move"),
    ("c_s", "per body in conflict, besides: gather and order its group"),
    ("e_u", "per box entered or left: update its occupation"),
];

impl CostModel {
    /// Times every load of the grid with one worker, and fits the model to the times.
    pub(super) fn run(plan: &LoriaConfig, report: &mut Progress<'_>) -> Self {
        let loads = grid(plan);
        let mut points = Vec::new();
        for (index, load) in loads.iter().enumerate() {
            report("cost model", index as f64 / loads.len() as f64);
            // Half a timed stretch, because each load is run for [`BLOCKS`] of them.
            points.push(measure(load, plan.timed_robot_cycles / 2));
        }
        Self::fit(points)
    }

    /// Both steps of a cycle are fitted apart, because their times are measured apart.
    pub(super) fn fit(points: Vec<CostSample>) -> Self {
        let first = fit_per_body(&points, first_row, |p| p.first_ns);
        let second = fit_per_body(&points, second_row, |p| p.second_ns);
        let least_share = min_value(&points, |p| p.in_conflict / p.bodies());
        let greatest_share = max_value(&points, |p| p.in_conflict / p.bodies());
        Self {
            parameters: parameters(&first, &second),
            r_squared: [&first, &second].map(|fit| fit.as_ref().map_or(0.0, |fit| fit.r_squared)),
            r_squared_cycle: whole_cycles(&points, &first, &second),
            conflict_share: (least_share, greatest_share),
            points,
        }
    }

    /// `None`, too, where the parameters cannot be separated.
    pub(super) fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// Returns the fitted parameters as a table.
    pub(super) fn table(&self) -> Table {
        let note = format!(
            "{} runs with one worker, n = {:.0} to {:.0} robots of 1 to 3 boxes a side, m = {:.0} \
             to {:.0} people and doors, share in conflict p = {:.3} to {:.3} (counted). Least \
             squares on the cost per body, each time the best of {BLOCKS} blocks; R2 of step one {:.3}, of step two {:.3}, of whole \
             cycles {:.3}. t_p and t_o are told apart by n : m, c_s by crowding, e_u by body \
             size, c_d is the rest per body.",
            self.points.len(),
            min_value(&self.points, |p| p.agents),
            max_value(&self.points, |p| p.agents),
            min_value(&self.points, |p| p.objects),
            max_value(&self.points, |p| p.objects),
            self.conflict_share.0,
            self.conflict_share.1,
            self.r_squared[0],
            self.r_squared[1],
            self.r_squared_cycle,
        );
        table(
            "The cost model, fitted",
            note,
            &self.parameters,
            &[
                ("parameter", &|p| p.name.clone()),
                ("what", &|p| p.meaning.clone()),
                ("ns", &|p| format!("{:.1}", p.value_ns)),
                ("95 % interval", &format_interval),
            ],
        )
    }

    /// Returns a figure of predicted against measured time of a cycle.
    pub(super) fn figure(&self) -> Figure {
        let series = SIZES.map(|size| {
            let points = self.points.iter().filter(|p| p.size == size);
            let points = points.map(|p| {
                let measured_ns = p.first_ns + p.second_ns;
                FigurePoint::new(1e-6 * measured_ns, 1e-6 * self.predict_ns(p))
            });
            Series { name: format!("robots of {size} x {size}"), points: points.collect() }
        });
        let title = "The cost model against measurement";
        let labels = ["measured ms per cycle", "predicted ms per cycle"];
        Figure { kind: FigureKind::Points, ..figure(title, labels, series) }
    }

    /// Returns the time of a cycle by the fitted parameters, T1 + T2.
    fn predict_ns(&self, p: &CostSample) -> f64 {
        let [t_p, t_o, c_d, c_s, e_u] =
            PARAMETERS.map(|(name, _)| self.parameter(name).map_or(0.0, |p| p.value_ns));
        let first = dot(&first_row(p), &[t_p, t_o]);
        first + dot(&second_row(p), &[c_d, c_s, e_u])
    }
}

fn format_interval(parameter: &&Parameter) -> String {
    let interval = parameter.interval_ns;
    interval.map_or("-".into(), |i| format!("[{:.1}, {:.1}]", i.low, i.high))
}

/// Fits the rows of a step to its times, both per body, so that all runs have equal weight.
fn fit_per_body(
    points: &[CostSample],
    row: fn(&CostSample) -> Vec<f64>,
    time_ns: fn(&CostSample) -> f64,
) -> Option<Fit> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut times_ns = Vec::new();
    for point in points {
        let bodies = point.bodies();
        rows.push(row(point).into_iter().map(|value| value / bodies).collect());
        times_ns.push(time_ns(point) / bodies);
    }
    Fit::new(&rows, &times_ns)
}

fn first_row(p: &CostSample) -> Vec<f64> {
    vec![p.agents, p.objects]
}

fn second_row(p: &CostSample) -> Vec<f64> {
    vec![p.agents + p.objects, p.in_conflict, p.boxes]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn min_value(points: &[CostSample], of: fn(&CostSample) -> f64) -> f64 {
    points.iter().map(of).fold(f64::INFINITY, f64::min)
}

fn max_value(points: &[CostSample], of: fn(&CostSample) -> f64) -> f64 {
    points.iter().map(of).fold(0.0, f64::max)
}

fn parameters(first: &Option<Fit>, second: &Option<Fit>) -> Vec<Parameter> {
    let (Some(first), Some(second)) = (first, second) else { return Vec::new() };
    let mut values = Vec::new();
    for fit in [first, second] {
        for (k, &value_ns) in fit.coefficients.iter().enumerate() {
            values.push((value_ns, fit.intervals.as_ref().map(|all| all[k])));
        }
    }
    let mut parameters = Vec::new();
    for ((name, meaning), (value_ns, interval_ns)) in PARAMETERS.into_iter().zip(values) {
        let name = name.into();
        parameters.push(Parameter { name, meaning: meaning.into(), value_ns, interval_ns });
    }
    parameters
}

/// Returns the share of the variance of whole cycles' times that both fits together explain.
fn whole_cycles(points: &[CostSample], first: &Option<Fit>, second: &Option<Fit>) -> f64 {
    let (Some(first), Some(second)) = (first, second) else { return 0.0 };
    let measured: Vec<f64> = points.iter().map(|p| p.first_ns + p.second_ns).collect();
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let unexplained = points.iter().zip(&measured).map(|(p, measured)| {
        let predicted = first.predict(&first_row(p)) + second.predict(&second_row(p));
        (measured - predicted) * (measured - predicted)
    });
    let unexplained: f64 = unexplained.sum();
    let all: f64 = measured.iter().map(|measured| (measured - mean) * (measured - mean)).sum();
    // Of equal times there is no variance to explain.
    1.0 - unexplained / all.max(f64::MIN_POSITIVE)
}

/// Sides of robots in boxes; three, so that the price of a box is that of a line, and not of two
/// points.
const SIZES: [u32; 3] = [1, 2, 3];

/// Returns loads of different numbers, crowding and size.
fn grid(plan: &LoriaConfig) -> Vec<Workload> {
    let small = (Arc::new(Floor::small()), [20, 50, 80], [0, 30, 80]);
    let large = (Arc::new(Floor::large()), [100, 300, 800], [0, 200, 600]);
    let mut loads = Vec::new();
    for (floor, agents, objects) in [small, large] {
        for robots in agents {
            for people in objects {
                for size in SIZES {
                    let floor = Arc::clone(&floor);
                    loads.push(Workload { robots, people, size, operations: 0, floor });
                }
            }
        }
    }
    // A step that divides neither the sizes nor the numbers, so that a rehearsal has some of each.
    let step = if plan.quick { 5 } else { 1 };
    loads.into_iter().step_by(step).collect()
}

/// Blocks in which a load is timed; the shortest time per cycle of each phase counts, because other load on the machine
/// only ever adds to it.
const BLOCKS: usize = 16;

/// Sums over a run so far.
#[derive(Debug, Clone, Copy)]
struct Totals {
    /// Time of pool one.
    first_ns: f64,
    /// Time of joining and of pool two.
    second_ns: f64,
    /// Bodies that were in no conflict.
    alone: f64,
    /// Boxes entered or left.
    boxes: f64,
}

fn measure(load: &Workload, robot_cycles: u64) -> CostSample {
    let cycles = load.cycles(robot_cycles);
    let mut run = load.simulation(1);
    // A first block that is not counted: it fills buffers, which later ones do not.
    advance(&mut run, cycles);
    let mut totals = vec![Totals::of(&run)];
    for _ in 0..BLOCKS {
        advance(&mut run, cycles);
        totals.push(Totals::of(&run));
    }
    let agents = f64::from(load.robots);
    let bodies = run.world().bodies.len() as f64;
    // Counts are averaged, times are those of the block that nothing disturbed.
    CostSample {
        agents,
        objects: bodies - agents,
        size: load.size,
        in_conflict: bodies - mean_per_cycle(&totals, cycles, |t| t.alone),
        boxes: mean_per_cycle(&totals, cycles, |t| t.boxes),
        first_ns: least_per_cycle(&totals, cycles, |t| t.first_ns),
        second_ns: least_per_cycle(&totals, cycles, |t| t.second_ns),
    }
}

/// Returns a quantity per cycle, block by block.
fn per_cycle(totals: &[Totals], cycles: u64, of: fn(&Totals) -> f64) -> impl Iterator<Item = f64> {
    totals.windows(2).map(move |pair| (of(&pair[1]) - of(&pair[0])) / cycles as f64)
}

fn mean_per_cycle(totals: &[Totals], cycles: u64, of: fn(&Totals) -> f64) -> f64 {
    per_cycle(totals, cycles, of).sum::<f64>() / BLOCKS as f64
}

fn least_per_cycle(totals: &[Totals], cycles: u64, of: fn(&Totals) -> f64) -> f64 {
    per_cycle(totals, cycles, of).fold(f64::INFINITY, f64::min)
}

fn advance(run: &mut RobotsRun, cycles: u64) {
    let mut done = 0;
    while done < cycles {
        done += run.advance(cycles - done);
    }
}

impl Totals {
    fn of(run: &RobotsRun) -> Self {
        let times = run.phase_times();
        // A step enters a row of boxes and leaves one; bodies that move are square.
        let boxes = run.state().bodies.iter().map(|body| {
            let side = run.world().types[usize::from(body.ty)].size.0;
            f64::from(2 * body.moves.get()) * f64::from(side)
        });
        Self {
            first_ns: times.claim_ns as f64,
            second_ns: (times.join_ns + times.act_ns) as f64,
            alone: run.metrics().group_sizes.first().copied().unwrap_or(0) as f64,
            boxes: boxes.sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_recovers_the_parameters_it_is_made_from() {
        let truth = [900.0, 60.0, 80.0, 45.0, 3.0];
        let mut points = Vec::new();
        for (k, n) in [20.0, 100.0, 400.0, 800.0].into_iter().enumerate() {
            for (m, size) in [(0.0, 1), (n / 2.0, 2), (3.0 * n, 3)] {
                let (in_conflict, boxes) = (0.1 * k as f64 * n, f64::from(size) * n);
                let mut p = CostSample {
                    agents: n,
                    objects: m,
                    size,
                    in_conflict,
                    boxes,
                    first_ns: 0.0,
                    second_ns: 0.0,
                };
                p.first_ns = dot(&first_row(&p), &truth[..2]);
                p.second_ns = dot(&second_row(&p), &truth[2..]);
                points.push(p);
            }
        }
        let model = CostModel::fit(points);
        for (p, truth) in model.parameters.iter().zip(truth) {
            assert!((p.value_ns - truth).abs() < 1e-6 * truth, "{} = {}", p.name, p.value_ns);
        }
        assert_eq!(model.parameters.len(), 5);
        assert!(
            model.r_squared.iter().all(|&r| r > 0.999_999) && model.r_squared_cycle > 0.999_999
        );
    }

    #[test]
    fn parameters_that_cannot_be_told_apart_are_not_given() {
        let p = CostSample {
            agents: 9.0,
            objects: 9.0,
            size: 1,
            in_conflict: 1.0,
            boxes: 1.0,
            first_ns: 5.0,
            second_ns: 5.0,
        };
        assert!(CostModel::fit(vec![p; 8]).parameters.is_empty());
        assert!(CostModel::fit(Vec::new()).parameters.is_empty());
    }

    #[test]
    fn measured_bodies_and_conflicts_are_plausible() {
        let floor = Arc::new(Floor::small());
        let load = Workload { robots: 50, people: 30, size: 2, operations: 0, floor };
        let p = measure(&load, 20_000);
        assert_eq!((p.agents, p.objects), (50.0, 38.0), "30 people and 8 doors");
        assert!(p.in_conflict > 1.0 && p.in_conflict < 88.0);
        assert!(p.boxes > 50.0 && p.boxes < 88.0 * 6.0);
        assert!(p.first_ns > 0.0 && p.second_ns > 0.0);
    }
}
