//! A snake of 450 and more connectors creeps at random through space (slides E1, V6, F4): among
//! balls that stand, and balls that fly.

use super::Plan;
use super::runs::{DT_S, SPEED_M_S, begun, finish, grid, head, least, mm, most};
use crate::farm::Progress;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::worlds::chain::metrics::Metrics;
use sidestep_document::{Estimate, Table};

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// The part of the room that balls fill.
    pub filled: f64,
    /// Balls that fly in it.
    pub movers: usize,
    /// Connectors.
    pub connectors: usize,
}

impl Case {
    /// The scenario, of at most `cycles` cycles.
    pub(super) fn text(&self, seed: u64, cycles: u64) -> String {
        let Self { filled, movers, connectors } = self;
        let (lo, hi, inner) = ([-8.0; 3], [8.0; 3], [[-7.0; 3], [7.0; 3]]);
        let mut fields = String::new();
        if *filled > 0.0 {
            fields += &format!(
                "[[fields]]\nlo_m = {lo:?}\nhi_m = {hi:?}\npart = {filled:?}\nradius_m = 0.4\n"
            );
        }
        if *movers > 0 {
            fields += &format!(
                "[[fields]]\nlo_m = {lo:?}\nhi_m = {hi:?}\nn = {movers}\nradius_m = [0.2, 0.4]\n\
                 speed_m_s = [0.1, 0.5]\n"
            );
        }
        format!(
            "{}dt_s = {DT_S:?}\n{fields}[[chains]]\nname = \"snake\"\nconnectors = {connectors}\n\
             at_m = [-6.0, -6.0, -6.0]\nalong = [0.0, 0.0, -1.0]\nrod_m = 0.1\nradius_m = 0.03\n\
             rod_radius_m = 0.02\n\
             [[chains.tasks]]\nkind = \"wander\"\nspeed_m_s = {SPEED_M_S:?}\nturn_deg = 40\n\
             within_m = {inner:?}\npatience_s = 1e5\n",
            head::<3>(seed, cycles),
        )
    }
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The case.
    pub case: Case,
    /// Steps per second of processor time,
    pub steps_per_s: Estimate,
    /// over those that a second of the world has.
    pub real_time: Estimate,
    /// Vetoes that the head met with, percent of steps.
    pub veto_percent: Estimate,
    /// Steps with a part in a ball, of all runs,
    pub penetrations: u64,
    /// and steps.
    pub steps: u64,
    /// The least distance of any part from a ball.
    pub min_clearance_m: Option<f64>,
    /// The part of the wanted way that the head went, percent.
    pub way_percent: Estimate,
    /// The greatest amount by which a rod was outside its limits.
    pub rod_violation_m: f64,
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Snakes {
    /// Results by case.
    pub cells: Vec<Cell>,
}

impl Snakes {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for &connectors in &plan.snake_connectors {
            for (filled, movers) in [(0.0, 0), (0.1, 0), (0.3, 0), (0.1, 60)] {
                cases.push(Case { filled, movers, connectors });
            }
        }
        let run = |case: &Case, seed: u64| -> Result<Metrics, InputError> {
            let mut run = begun::<3>(case.text(seed, plan.snake_cycles))?;
            finish(&mut run, |_| ());
            Ok(run.chain_metrics())
        };
        let all = grid((plan, plan.snake_seeds), "snake in space", &cases, progress, run)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, runs)| cell(*case, runs)).collect() })
    }

    /// Cells among balls that all stand.
    pub(super) fn at_rest(&self) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(|c| c.case.movers == 0 && c.case.filled > 0.0)
    }

    pub(super) fn table(&self) -> Table {
        let note = "Rods of 0.1 m, balls of 0.4 m in a room of 16 m, steps of 1 cm; a step \
                    includes looking for the least distance of every part. Real time is 50 steps \
                    a second.";
        let columns = [
            "connectors",
            "filled, %",
            "flying balls",
            "steps / CPU s",
            "times real time",
            "vetoes, %",
            "steps inside",
            "steps",
            "clearance, mm",
            "way, %",
        ];
        let mut table = Table::new("A snake in space", note, &columns);
        for c in &self.cells {
            table.row([
                c.case.connectors.to_string(),
                (100.0 * c.case.filled).to_string(),
                c.case.movers.to_string(),
                c.steps_per_s.to_string(),
                c.real_time.to_string(),
                c.veto_percent.to_string(),
                c.penetrations.to_string(),
                c.steps.to_string(),
                mm(c.min_clearance_m),
                c.way_percent.to_string(),
            ]);
        }
        table
    }
}

fn cell(case: Case, runs: &[Metrics]) -> Cell {
    let of = |value: &dyn Fn(&Metrics) -> f64| Estimate::of(runs.iter().map(|m| Some(value(m))));
    Cell {
        case,
        steps_per_s: of(&|m| m.steps_per_cpu_s),
        real_time: of(&|m| m.steps_per_cpu_s * DT_S),
        veto_percent: of(&|m| 100.0 * m.vetoes as f64 / m.steps as f64),
        penetrations: runs.iter().map(|m| m.penetrations).sum(),
        steps: runs.iter().map(|m| m.steps).sum(),
        min_clearance_m: least(runs.iter().map(|m| m.min_clearance_m)),
        way_percent: of(&|m| 100.0 * m.progress),
        rod_violation_m: most(runs.iter().map(|m| m.max_rod_violation_m)),
    }
}
