//! Discs run into a chain on open ground, slower and faster than it (slides P2, N6): without a
//! reaction, with one when touched, and with one before.

use super::corridor::{MAX_SPEED, OWN_GAP, ROD_VIOLATION};
use super::{SPEED_M_S, SerpentineConfig};
use crate::cells::{CaseResults, Columns, Value, column, figure, series};
use crate::study::{Progress, Study, setting_number};
use serde::Serialize;
use sidestep::experiment::sweep::Variant;
use sidestep::kernel::InputError;
use sidestep_document::figure::Scale;
use sidestep_document::{Figure, Table};

const SCENARIO: &str = include_str!("../../scenarios/serpentine/movers.toml");
const SWEEP: &str = include_str!("../../scenarios/serpentine/movers.sweep.toml");
const DISCS: &str = "fields.n";
const SPEED: &str = "fields.speed_m_s";

/// Ways to react: not at all, when touched, before, and before without the limits that robots
/// have: parts pass through each other, as fast as they need.
pub(super) const ESCAPES: [&str; 4] = ["off", "touch", "look-ahead", "look-ahead, no limits"];

const COLUMNS: Columns = Columns {
    case: &[
        column("moves", "leader", |r| Value::Yes(moves(r.variant())))
            .with_format(|c| if c.is_true("moves") { "wanders" } else { "rests" }.into()),
        column("escape", "reaction", |r| match r.variant().value("chain.self_collision") {
            Some(_) => Value::Word(ESCAPES[3].into()),
            None => r.setting("chain.escape"),
        }),
        column("discs", "discs", |r| r.setting(DISCS)),
        column("speed_ratio", "disc / leader speed", |r| Value::Number(ratio(r.variant()))),
    ],
    results: &[
        column("inside_percent", "steps inside, %", |r| {
            r.mean_proportion(|run| run.percent_of_steps("penetrations"))
        }),
        column("veto_percent", "vetoes, %", |r| r.mean_rate("vetoes")),
        column("stuck_percent", "no way out, %", |r| r.mean_rate("escapes.vetoes")),
        MAX_SPEED,
        OWN_GAP,
        ROD_VIOLATION,
    ],
};

/// Returns whether the leader wanders, or rests.
fn moves(case: &Variant) -> bool {
    let task = case.value("chains.tasks").and_then(|tasks| tasks.get(0));
    task.and_then(|task| task.get("kind")).is_some_and(|kind| kind.as_str() == Some("wander"))
}

/// Returns the speed of the discs divided by the leader's.
fn ratio(case: &Variant) -> f64 {
    setting_number(case, SPEED) / SPEED_M_S
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct MoverResults {
    /// Results by case.
    pub(super) cells: Vec<CaseResults>,
}

/// Returns the sweep of a plan.
pub(super) fn study(plan: &SerpentineConfig) -> Result<Study, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?;
    let study = study.filtered(|v| plan.mover_discs.contains(&(setting_number(v, DISCS) as usize)));
    let study = study.filtered(|v| plan.speed_ratios.contains(&ratio(v)));
    Ok(study.with_size(plan.seeds, Some(plan.mover_cycles)))
}

impl MoverResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let results = study(plan)?.run(plan.workers, "discs that move", progress)?;
        Ok(Self { cells: COLUMNS.cells(&results) })
    }

    /// Returns the cells of a way to react.
    pub(super) fn cells_with_escape<'a>(
        &'a self,
        escape: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        self.cells.iter().filter(move |c| c.has_text("escape", escape))
    }

    pub(super) fn table(&self) -> Table {
        let note = "16 connectors of 0.25 m on 16 m x 16 m; discs of 0.2 to 0.5 m, each at the \
                    speed given, which is that over the leader's 0.5 m/s whether it wanders or \
                    rests. A part counts as inside from 1 um on. Parts that get out of the way \
                    do so at most twice as fast as the faster of leader and discs, but for `no \
                    limits`, where the chain may also pass through itself.";
        COLUMNS.table("Discs that run into a chain", note, &self.cells)
    }

    pub(super) fn figure(&self) -> Figure {
        let most_discs = self.cells.iter().map(|c| c.count("discs")).max();
        let mut lines = Vec::new();
        for (moves, word) in [(true, "leader wanders"), (false, "leader rests")] {
            for escape in ESCAPES {
                let cells = self.cells_with_escape(escape).filter(|c| c.is_true("moves") == moves);
                let cells = cells.filter(|c| Some(c.count("discs")) == most_discs);
                let name = format!("{escape}, {word}");
                lines.push(series(name, cells, ["speed_ratio", "inside_percent"]));
            }
        }
        let labels = ["speed of the discs over the leader's", "steps inside, %"];
        let title = "Steps with a part of the chain in a moving disc";
        Figure { x_scale: Scale::Log, ..figure(title, labels, lines) }
    }
}
