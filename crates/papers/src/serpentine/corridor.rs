//! One robot with a laser finds its way through the winding corridor, others follow as a snake
//! (slides E2, N1 to N6): widths, numbers of followers, and readings of "leaving a wall".

use super::Plan;
use super::runs::{DT_S, SPEED_M_S, Share, begun, finish, grid, head, least, mm, most};
use crate::farm::Progress;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::worlds::chain::metrics::Metrics;
use sidestep::worlds::chain::simulation::ChainSimulation;
use sidestep_document::{Estimate, Figure, FigureKind, Series, Table};

/// The slides' band of distances from walls, meters from the robot's middle.
const BAND_M: [f64; 2] = [0.7, 0.9];
/// What the laser errs by, so that runs differ.
const NOISE_M: f64 = 0.01;
/// The readings of "leaving a wall"; the first is ours, the last the slides' words.
pub(super) const READINGS: [&str; 3] = ["latched", "range", "level"];

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// Width of the corridor.
    pub width_m: f64,
    /// Robots behind the leader.
    pub followers: usize,
    /// When a wall counts as being left.
    pub leaving: &'static str,
}

impl Case {
    /// The scenario, of at most `cycles` cycles.
    pub(super) fn text(&self, seed: u64, cycles: u64) -> String {
        let Self { width_m, followers, leaving } = self;
        format!(
            "{}dt_s = {DT_S:?}\n[ground]\ncorridor = {{ width_m = {width_m:?} }}\n\
             [[chains]]\nname = \"swarm\"\nconnectors = {}\nat_m = [12.3, 0.0]\nheading_deg = 0\n\
             rod_m = [0.6, 0.8]\nrod_radius_m = 0.05\n\
             robots = {{ radius_m = 0.25, margin_m = 0.08 }}\n\
             [[chains.tasks]]\nkind = \"navigate\"\nspeed_m_s = {SPEED_M_S:?}\npatience_s = 30.0\n\
             navigator = {{ leaving = \"{leaving}\", noise_m = {NOISE_M:?} }}\n",
            head::<2>(seed, cycles),
            followers + 1,
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
    /// Vetoes of all runs.
    pub vetoes: u64,
    /// Steps with a part in a wall, of all runs,
    pub penetrations: u64,
    /// and steps.
    pub steps: u64,
    /// The least distance of any connector or rod from a wall.
    pub min_clearance_m: Option<f64>,
    /// The greatest amount by which a rod was outside its limits.
    pub rod_violation_m: f64,
    /// Times that bumpers were pressed, of all runs.
    pub bumper_events: u64,
    /// The least air between a robot and anything.
    pub min_gap_m: f64,
    /// Mean distance of robots from their connectors,
    pub mean_lag_m: Estimate,
    /// and the greatest.
    pub max_lag_m: f64,
    /// Mean speed of the leader, m/s.
    pub speed_m_s: Estimate,
    /// Percent of steps that begin with the leader's nearest wall in the slides' band.
    pub in_band_percent: Estimate,
}

struct Ride {
    metrics: Metrics,
    way_m: f64,
    in_band: u64,
}

fn ride(case: &Case, seed: u64, cycles: u64) -> Result<Ride, InputError> {
    let mut run = begun::<2>(case.text(seed, cycles))?;
    let mut in_band = 0;
    finish(&mut run, |run| in_band += u64::from(is_in_band(run)));
    let way_m = run.state().body(0).tally.way_m;
    Ok(Ride { metrics: run.chain_metrics(), way_m, in_band })
}

fn is_in_band(run: &ChainSimulation<2>) -> bool {
    let leader = run.state().body(0).chain.points()[0];
    let apart_m = run.world().obstacles.clearance_m([leader; 2], 0.0, 1.0);
    (BAND_M[0]..=BAND_M[1]).contains(&apart_m)
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Corridor {
    /// Results by case.
    pub cells: Vec<Cell>,
}

impl Corridor {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        // Other readings are about the leader: the fewest followers will do.
        let fewest = plan.followers.iter().min().copied();
        let mut cases = Vec::new();
        for leaving in READINGS {
            for &width_m in &plan.widths_m {
                let case = |&followers: &usize| Case { width_m, followers, leaving };
                cases.extend(plan.followers.iter().map(case));
            }
        }
        cases.retain(|c| c.leaving == READINGS[0] || Some(c.followers) == fewest);
        let run = |case: &Case, seed| ride(case, seed, plan.corridor_cycles);
        let all = grid((plan, plan.seeds), "swarm in the corridor", &cases, progress, run)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, rides)| cell(*case, rides)).collect() })
    }

    /// Cells of a reading, the fewest followers first.
    pub(super) fn of<'a>(&'a self, leaving: &'a str) -> impl Iterator<Item = &'a Cell> {
        self.cells.iter().filter(move |cell| cell.case.leaving == leaving)
    }

    pub(super) fn table(&self) -> Table {
        let note = "Runs differ by the laser's error of 1 cm. Clearance is of connectors and rods, \
                    which keep 8 cm of room for the robots that follow them on wheels; gap, bumpers \
                    and lag are those robots'. `level` is the slides' wording taken literally.";
        let columns = [
            "leaving",
            "width, m",
            "followers",
            "arrived",
            "vetoes",
            "steps inside",
            "clearance, mm",
            "bumper events",
            "gap, mm",
            "mean lag, m",
            "max lag, m",
            "speed, m/s",
            "0.7-0.9 m, %",
        ];
        let mut table = Table::new("A swarm in the winding corridor", note, &columns);
        for c in &self.cells {
            table.row([
                c.case.leaving.into(),
                c.case.width_m.to_string(),
                c.case.followers.to_string(),
                c.arrived.to_string(),
                c.vetoes.to_string(),
                c.penetrations.to_string(),
                mm(c.min_clearance_m),
                c.bumper_events.to_string(),
                mm(Some(c.min_gap_m)),
                c.mean_lag_m.to_string(),
                format!("{:.3}", c.max_lag_m),
                c.speed_m_s.to_string(),
                c.in_band_percent.to_string(),
            ]);
        }
        table
    }

    pub(super) fn figures(&self) -> Vec<Figure> {
        let fewest = self.cells.iter().map(|c| c.case.followers).min();
        let figure = |title: &str, y_label: &str, value: fn(&Cell) -> Estimate| Figure {
            title: title.into(),
            x_label: "width of the corridor, m".into(),
            y_label: y_label.into(),
            kind: FigureKind::Lines,
            series: READINGS
                .map(|reading| Series {
                    name: reading.into(),
                    points: self
                        .of(reading)
                        .filter(|c| Some(c.case.followers) == fewest)
                        .filter_map(|c| value(c).point(c.case.width_m))
                        .collect(),
                })
                .into(),
            ..Figure::default()
        };
        vec![
            figure("Speed of a leader that wants 0.5 m/s", "m/s", |c| c.speed_m_s),
            figure("Time within the band of 0.7 to 0.9 m", "%", |c| c.in_band_percent),
        ]
    }
}

fn cell(case: Case, rides: &[Ride]) -> Cell {
    let sum = |count: fn(&Metrics) -> u64| rides.iter().map(|r| count(&r.metrics)).sum();
    let robots = || rides.iter().filter_map(|r| r.metrics.robots.as_ref());
    let of = |value: &dyn Fn(&Ride) -> f64| Estimate::of(rides.iter().map(|r| Some(value(r))));
    Cell {
        case,
        arrived: Share::of(rides.iter().map(|r| r.metrics.done == 1)),
        vetoes: sum(|m| m.vetoes),
        penetrations: sum(|m| m.penetrations),
        steps: sum(|m| m.steps),
        min_clearance_m: least(rides.iter().map(|r| r.metrics.min_clearance_m)),
        rod_violation_m: most(rides.iter().map(|r| r.metrics.max_rod_violation_m)),
        bumper_events: robots().map(|r| r.bumper_events).sum(),
        min_gap_m: robots().map(|r| r.min_gap_m).fold(1.0, f64::min),
        mean_lag_m: Estimate::of(robots().map(|r| Some(r.mean_lag_m))),
        max_lag_m: most(robots().map(|r| r.max_lag_m)),
        speed_m_s: of(&|r| r.way_m / (r.metrics.steps as f64 * DT_S)),
        in_band_percent: of(&|r| 100.0 * r.in_band as f64 / r.metrics.steps as f64),
    }
}
