//! What a rod does that hits an obstacle (slide A7): turn to the nearest direction that is free of
//! everything, turn once as the slides say, or do not turn.

use super::Plan;
use super::runs::{SPEED_M_S, Share, begun, finish, grid, head, least, mm, most};
use crate::farm::Progress;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::worlds::chain::metrics::Metrics;
use sidestep_document::figure::Point;
use sidestep_document::{Estimate, Figure, FigureKind, Series, Table};

/// The rules; the second is the slides'.
pub(super) const RULES: [&str; 3] = ["union", "literal", "never"];
/// Length of the corridor's middle from the start to the end is taken by points so far apart.
const LINE_STEP_M: f64 = 0.1;

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// The rule.
    pub rotation: &'static str,
    /// How far the leader goes in a step.
    pub step_m: f64,
    /// Width of the corridor.
    pub width_m: f64,
}

impl Case {
    fn text(&self, seed: u64, cycles: u64) -> String {
        let Self { rotation, step_m, width_m } = self;
        format!(
            "{}rotation = \"{rotation}\"\ndt_s = {:?}\nstep_m = {step_m:?}\n\
             [ground]\ncorridor = {{ width_m = {width_m:?} }}\n\
             [[chains]]\nconnectors = 16\nat_m = [12.3, 0.0]\nheading_deg = 0\n\
             rod_m = [0.6, 0.8]\nradius_m = 0.25\nrod_radius_m = 0.05\n\
             [[chains.tasks]]\nkind = \"navigate\"\nspeed_m_s = {SPEED_M_S:?}\npatience_s = 10.0\n\
             navigator = {{ noise_m = 0.01 }}\n",
            head::<2>(seed, cycles),
            step_m / SPEED_M_S,
        )
    }
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The case.
    pub case: Case,
    /// Runs whose leader came to the end.
    pub arrived: Share,
    /// The part of the corridor that was passed, percent.
    pub progress_percent: Estimate,
    /// Vetoes of all runs.
    pub vetoes: u64,
    /// Steps with a part in a wall, of all runs,
    pub penetrations: u64,
    /// and steps.
    pub steps: u64,
    /// The least distance of any part from a wall.
    pub min_clearance_m: Option<f64>,
    /// The longest way of a follower in a step, over the leader's.
    pub slave_over_master: f64,
    /// The greatest amount by which a rod was outside its limits.
    pub rod_violation_m: f64,
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rotations {
    /// Results by case.
    pub cells: Vec<Cell>,
}

struct Ride {
    metrics: Metrics,
    progress: f64,
}

fn ride(case: &Case, seed: u64, cycles: u64) -> Result<Ride, InputError> {
    // As long a time for steps of every length.
    let cycles = (cycles as f64 * 0.01 / case.step_m).ceil() as u64;
    let mut run = begun::<2>(case.text(seed, cycles))?;
    let mut furthest = 0.0_f64;
    finish(&mut run, |run| {
        let body = run.state().body(0);
        if body.driving.task == 0 {
            furthest = furthest.max(run.world().progress(0, &body));
        }
    });
    let metrics = run.chain_metrics();
    Ok(Ride { progress: if metrics.done == 1 { 1.0 } else { furthest }, metrics })
}

impl Rotations {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for rotation in RULES {
            for &step_m in &plan.steps_m {
                let widths = plan.widths_m.iter().filter(|w| (1.6..=2.0).contains(*w));
                cases.extend(widths.map(|&width_m| Case { rotation, step_m, width_m }));
            }
        }
        let run = |case: &Case, seed| ride(case, seed, plan.corridor_cycles);
        let all = grid((plan, plan.seeds), "rules of rotation", &cases, progress, run)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, rides)| cell(*case, rides)).collect() })
    }

    /// Cells of a rule.
    pub(super) fn of<'a>(&'a self, rotation: &'a str) -> impl Iterator<Item = &'a Cell> {
        self.cells.iter().filter(move |cell| cell.case.rotation == rotation)
    }

    pub(super) fn table(&self) -> Table {
        let note = format!(
            "15 followers without wheels (connectors of 0.25 m, rods of 0.05 m); progress by \
             points of the corridor's middle, {LINE_STEP_M} m apart. `literal` is the slides' \
             rule: one turn to the tangent of the obstacle that is hit nearest to the master."
        );
        let columns = [
            "rotation",
            "step, m",
            "width, m",
            "arrived",
            "progress, %",
            "vetoes",
            "steps inside",
            "steps",
            "clearance, mm",
            "follower / leader",
        ];
        let mut table = Table::new("Rules of rotation", note, &columns);
        for c in &self.cells {
            table.row([
                c.case.rotation.into(),
                c.case.step_m.to_string(),
                c.case.width_m.to_string(),
                c.arrived.to_string(),
                c.progress_percent.to_string(),
                c.vetoes.to_string(),
                c.penetrations.to_string(),
                c.steps.to_string(),
                mm(c.min_clearance_m),
                format!("{:.2}", c.slave_over_master),
            ]);
        }
        table
    }

    pub(super) fn figure(&self) -> Figure {
        let mut steps_m: Vec<f64> = self.of(RULES[0]).map(|c| c.case.step_m).collect();
        steps_m.dedup();
        let deepest = |rule: &str, step_m: f64| {
            let cells = self.of(rule).filter(|c| c.case.step_m == step_m);
            let least_m = least(cells.map(|c| c.min_clearance_m)).unwrap_or(0.0);
            1e3 * (-least_m).max(0.0)
        };
        let series = RULES.map(|rule| Series {
            name: rule.into(),
            points: steps_m.iter().map(|&s| Point::new(1e3 * s, deepest(rule, s))).collect(),
        });
        Figure {
            title: "How deep parts get into walls, by rule of rotation".into(),
            x_label: "step of the leader, mm".into(),
            y_label: "deepest, mm".into(),
            kind: FigureKind::Lines,
            series: series.into(),
            ..Figure::default()
        }
    }
}

fn cell(case: Case, rides: &[Ride]) -> Cell {
    let sum = |count: fn(&Metrics) -> u64| rides.iter().map(|r| count(&r.metrics)).sum();
    Cell {
        case,
        arrived: Share::of(rides.iter().map(|r| r.metrics.done == 1)),
        progress_percent: Estimate::of(rides.iter().map(|r| Some(100.0 * r.progress))),
        vetoes: sum(|m| m.vetoes),
        penetrations: sum(|m| m.penetrations),
        steps: sum(|m| m.steps),
        min_clearance_m: least(rides.iter().map(|r| r.metrics.min_clearance_m)),
        slave_over_master: most(rides.iter().map(|r| r.metrics.max_slave_step_m)) / case.step_m,
        rod_violation_m: most(rides.iter().map(|r| r.metrics.max_rod_violation_m)),
    }
}
