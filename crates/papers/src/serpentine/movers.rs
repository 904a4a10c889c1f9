//! Discs run into a chain on open ground, slower and faster than it (slides P2, N6): without a
//! reaction, with one when touched, and with one before.

use super::Plan;
use super::runs::{DT_S, SPEED_M_S, begun, finish, grid, head, most};
use crate::farm::Progress;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::worlds::chain::metrics::Metrics;
use sidestep_document::figure::Scale;
use sidestep_document::{Estimate, Figure, FigureKind, Series, Table};

/// Ways to react: not at all, when touched, before, and before without the limits that robots
/// have: parts pass through each other, as fast as they need.
pub(super) const ESCAPES: [&str; 4] = ["off", "touch", "look-ahead", "look-ahead, no limits"];
/// Half the side of the ground.
const HALF_M: f64 = 8.0;

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// Discs of 0.2 to 0.5 m.
    pub discs: usize,
    /// Their speed over the leader's.
    pub speed_ratio: f64,
    /// How the chain reacts.
    pub escape: &'static str,
    /// Whether its leader wanders, or rests.
    pub moves: bool,
}

impl Case {
    fn text(&self, seed: u64, cycles: u64) -> String {
        let Self { discs, speed_ratio, escape, moves } = self;
        let speed = speed_ratio * SPEED_M_S;
        let (lo, hi) = ([-HALF_M; 2], [HALF_M; 2]);
        let inner = [[1.0 - HALF_M; 2], [HALF_M - 1.0; 2]];
        let task = match moves {
            true => format!("kind = \"wander\"\nturn_deg = 30\nwithin_m = {inner:?}"),
            false => "kind = \"rest\"".into(),
        };
        let reaction = match *escape == ESCAPES[3] {
            true => {
                "escape = \"look-ahead\"\nself_collision = false\nescape_speed_m_s = 1000.0".into()
            }
            false => format!("escape = \"{escape}\""),
        };
        format!(
            "{}dt_s = {DT_S:?}\n{reaction}\n\
             [[fields]]\nlo_m = {lo:?}\nhi_m = {hi:?}\nn = {discs}\nradius_m = [0.2, 0.5]\n\
             speed_m_s = [{speed:?}, {speed:?}]\n\
             [[chains]]\nconnectors = 16\nat_m = [5.0, 0.0]\nrod_m = [0.6, 0.8]\nradius_m = 0.25\n\
             rod_radius_m = 0.05\n\
             [[chains.tasks]]\n{task}\nspeed_m_s = {SPEED_M_S:?}\npatience_s = 1e5\n",
            head::<2>(seed, cycles),
        )
    }
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The case.
    pub case: Case,
    /// Percent of steps at whose end a part is in a disc.
    pub inside_percent: Estimate,
    /// Vetoes that the leader met with, percent of steps.
    pub veto_percent: Estimate,
    /// Pushes away that came to nothing, percent of steps.
    pub stuck_percent: Estimate,
    /// The greatest speed of any connector.
    pub max_speed_m_s: f64,
    /// The greatest amount by which a rod was outside its limits.
    pub rod_violation_m: f64,
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Movers {
    /// Results by case.
    pub cells: Vec<Cell>,
}

impl Movers {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for moves in [true, false] {
            for escape in ESCAPES {
                for &discs in &plan.mover_discs {
                    let case = |&speed_ratio: &f64| Case { discs, speed_ratio, escape, moves };
                    cases.extend(plan.speed_ratios.iter().map(case));
                }
            }
        }
        let run = |case: &Case, seed: u64| -> Result<Metrics, InputError> {
            let mut run = begun::<2>(case.text(seed, plan.mover_cycles))?;
            finish(&mut run, |_| ());
            Ok(run.chain_metrics())
        };
        let all = grid((plan, plan.seeds), "discs that move", &cases, progress, run)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, runs)| cell(*case, runs)).collect() })
    }

    /// Cells of a way to react.
    pub(super) fn of<'a>(&'a self, escape: &'a str) -> impl Iterator<Item = &'a Cell> {
        self.cells.iter().filter(move |c| c.case.escape == escape)
    }

    pub(super) fn table(&self) -> Table {
        let note = "16 connectors of 0.25 m on 16 m x 16 m; discs of 0.2 to 0.5 m, each at the \
                    speed given, which is that over the leader's 0.5 m/s whether it wanders or \
                    rests. A part counts as inside from 1 um on. Parts that get out of the way \
                    do so at most twice as fast as the faster of leader and discs, but for `no \
                    limits`, where the chain may also pass through itself.";
        let columns = [
            "leader",
            "reaction",
            "discs",
            "disc / leader speed",
            "steps inside, %",
            "vetoes, %",
            "no way out, %",
            "fastest part, m/s",
        ];
        let mut table = Table::new("Discs that run into a chain", note, &columns);
        for c in &self.cells {
            table.row([
                if c.case.moves { "wanders" } else { "rests" }.into(),
                c.case.escape.into(),
                c.case.discs.to_string(),
                c.case.speed_ratio.to_string(),
                c.inside_percent.to_string(),
                c.veto_percent.to_string(),
                c.stuck_percent.to_string(),
                format!("{:.2}", c.max_speed_m_s),
            ]);
        }
        table
    }

    pub(super) fn figure(&self) -> Figure {
        let most_discs = self.cells.iter().map(|c| c.case.discs).max();
        let mut series = Vec::new();
        for (moves, word) in [(true, "leader wanders"), (false, "leader rests")] {
            for escape in ESCAPES {
                let is_its = |c: &&Cell| c.case.moves == moves && Some(c.case.discs) == most_discs;
                let cells = self.of(escape).filter(is_its);
                series.push(Series {
                    name: format!("{escape}, {word}"),
                    points: cells
                        .filter_map(|c| c.inside_percent.point(c.case.speed_ratio))
                        .collect(),
                });
            }
        }
        Figure {
            title: "Steps with a part of the chain in a moving disc".into(),
            x_label: "speed of the discs over the leader's".into(),
            y_label: "steps inside, %".into(),
            x_scale: Scale::Log,
            kind: FigureKind::Lines,
            series,
            ..Figure::default()
        }
    }
}

fn cell(case: Case, runs: &[Metrics]) -> Cell {
    let percent = |count: fn(&Metrics) -> u64| {
        Estimate::of(runs.iter().map(|m| Some(100.0 * count(m) as f64 / m.steps as f64)))
    };
    Cell {
        case,
        inside_percent: percent(|m| m.penetrations),
        veto_percent: percent(|m| m.vetoes),
        stuck_percent: percent(|m| m.escapes.vetoes),
        max_speed_m_s: most(runs.iter().map(|m| m.max_speed_m_s)),
        rod_violation_m: most(runs.iter().map(|m| m.max_rod_violation_m)),
    }
}
