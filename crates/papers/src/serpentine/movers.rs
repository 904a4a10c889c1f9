//! Discs run into a chain on open ground, slower and faster than it (slides P2, N6): without a
//! reaction, with one when touched, and with one before.

use super::corridor::{MAX_SPEED, OWN_GAP, ROD_VIOLATION};
use super::{SPEED_M_S, SerpentineConfig};
use crate::case_results::{
    CaseResults, CaseRuns, Columns, Format, Summary, Value, column, figure, series,
};
use crate::study::{Progress, Study, setting_number};
use crate::trial_file::TrialFile;
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
        column("moves", "leader", Summary::Computed(leader_moves))
            .with_format(Format::Computed(format_leader)),
        column("escape", "reaction", Summary::Computed(escape)),
        column("discs", "discs", Summary::Setting(DISCS)),
        column("speed_ratio", "disc / leader speed", Summary::Computed(speed_ratio)),
    ],
    results: &[
        column("inside_percent", "steps inside, %", Summary::SharePercent("penetrations")),
        column("veto_percent", "vetoes, %", Summary::RatePercent("vetoes")),
        column("stuck_percent", "no way out, %", Summary::RatePercent("escapes.vetoes")),
        MAX_SPEED,
        OWN_GAP,
        ROD_VIOLATION,
    ],
};

fn leader_moves(case: &CaseRuns<'_>) -> Value {
    Value::Yes(moves(case.variant()))
}

fn format_leader(case: &CaseResults) -> String {
    let word = if case.is_true("moves") { "wanders" } else { "rests" };
    word.into()
}

fn escape(case: &CaseRuns<'_>) -> Value {
    // Of the sweep's variants only those without limits set this key.
    if case.variant().value("chain.self_collision").is_some() {
        Value::Word(ESCAPES[3].into())
    } else {
        case.setting("chain.escape")
    }
}

fn speed_ratio(case: &CaseRuns<'_>) -> Value {
    Value::Number(ratio(case.variant()))
}

/// Returns whether the leader wanders, or rests.
fn moves(case: &Variant) -> bool {
    let task = case.value("chains.tasks").and_then(|tasks| tasks.get(0));
    task.and_then(|task| task.get("kind")).is_some_and(|kind| kind.as_str() == Some("wander"))
}

/// Returns the speed of the discs divided by the leader's.
fn ratio(case: &Variant) -> f64 {
    setting_number(case, SPEED) / SPEED_M_S
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct MoverResults {
    /// In the order of the sweep's variants.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

/// The sweep's variants that have the plan's numbers and speeds of discs.
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
        let results =
            study(plan)?.run(plan.workers, "discs that move", &TrialFile::none(), progress)?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    pub(super) fn cases_with_escape<'a>(
        &'a self,
        escape: &'a str,
    ) -> impl Iterator<Item = &'a CaseResults> {
        self.cases.iter().filter(move |c| c.has_text("escape", escape))
    }

    pub(super) fn table(&self) -> Table {
        let note = "16 connectors of 0.25 m on 16 m x 16 m; discs of 0.2 to 0.5 m, each at the \
                    speed given, which is that over the leader's 0.5 m/s whether it wanders or \
                    rests. A part counts as inside from 1 um on. Parts that get out of the way \
                    do so at most twice as fast as the faster of leader and discs, but for `no \
                    limits`, where the chain may also pass through itself.";
        COLUMNS.table("Discs that run into a chain", note, &self.cases)
    }

    pub(super) fn figure(&self) -> Figure {
        let most_discs = self.cases.iter().map(|c| c.count("discs")).max();
        let mut lines = Vec::new();
        for (moves, word) in [(true, "leader wanders"), (false, "leader rests")] {
            for escape in ESCAPES {
                let cases = self.cases_with_escape(escape).filter(|c| c.is_true("moves") == moves);
                let cases = cases.filter(|c| Some(c.count("discs")) == most_discs);
                let name = format!("{escape}, {word}");
                lines.push(series(name, cases, ["speed_ratio", "inside_percent"]));
            }
        }
        let labels = ["speed of the discs over the leader's", "steps inside, %"];
        let title = "Steps with a part of the chain in a moving disc";
        Figure { x_scale: Scale::Log, ..figure(title, labels, lines) }
    }
}
