//! A chain in a straight corridor is pushed back by its head until some part objects, and pulled
//! back by its tail (slides A3, A4, R4).

use super::{SerpentineConfig, draws};
use crate::case_results::{
    CaseResults, CaseRuns, Columns, Format, Summary, Value, bars, column, figure,
};
use crate::study::{Progress, Study, outcome_from_values, setting, setting_number};
use serde::Serialize;
use serde_json::{Value as Json, json};
use sidestep::experiment::sweep::{Setting, Variant};
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::rods::geometry::add_scaled;
use sidestep::rods::{
    Chain, Connector, MotionOutcome, MotionRequest, Obstacles, Propagator, ReactionRules, Rod,
};
use sidestep::worlds::chain::ground::{Corridor, CorridorLeg};
use sidestep_document::{Figure, FigureKind, Table};
use std::collections::BTreeSet;

/// Standard deviation of the head's targets across the corridor, because pushing a straight chain
/// exactly along itself would never fold it.
const NOISE_M: f64 = 0.001;
const STEP_M: f64 = 0.01;
/// Number of the last connector, and of the rods: one leader and 15 followers, as the slides' swarm has.
const TAIL: usize = 15;
/// Distance that it is to go.
const DISTANCE_M: f64 = 12.0;
const WIDTH_M: f64 = 2.0;

const COLUMNS: Columns = Columns {
    case: &[
        column("by_head", "back by", Summary::Setting("by_head"))
            .with_format(Format::Computed(format_direction)),
        column("self_collision", "self-collision", Summary::Setting("self_collision")),
        column("max_bend_deg", "bend limit, deg", Summary::Setting("max_bend_deg")),
    ],
    results: &[
        column("way_m", "way, m", Summary::Mean("way_m")),
        column("vetoed", "vetoed", Summary::Computed(vetoed))
            .with_format(Format::Computed(format_vetoed)),
        column("runs", "", Summary::Computed(runs)),
        column("reasons", "reasons", Summary::Computed(reasons)),
        column("sharpest_deg", "sharpest bend, deg", Summary::Computed(sharpest_deg))
            .with_format(Format::Decimals(0)),
        column("rod_violation_m", "", Summary::Max("rod_violation_m")),
    ],
};

fn format_direction(case: &CaseResults) -> String {
    let words = if case.is_true("by_head") { "head (push)" } else { "tail (pull)" };
    words.into()
}

fn vetoed(case: &CaseRuns<'_>) -> Value {
    case.count(|run| !run.text("veto").is_empty())
}

fn runs(case: &CaseRuns<'_>) -> Value {
    case.count(|_| true)
}

fn format_vetoed(case: &CaseResults) -> String {
    format!("{}/{}", case.count("vetoed"), case.count("runs"))
}

fn reasons(case: &CaseRuns<'_>) -> Value {
    let reasons: BTreeSet<String> = case.iter_runs().map(|run| run.text("veto")).collect();
    Value::Words(reasons.into_iter().filter(|reason| !reason.is_empty()).collect())
}

fn sharpest_deg(case: &CaseRuns<'_>) -> Value {
    Value::Number(case.max_value("sharpest_rad").to_degrees())
}

/// Returns the cases: whether the chain's own parts are obstacles to it, the greatest angle between
/// two rods (180 for none), and whether the head leads, and pushes, or the tail, and pulls.
fn cases() -> Vec<Vec<Setting>> {
    let mut cases = Vec::new();
    for by_head in [true, false] {
        // From what folds most easily to what folds least.
        for (self_collision, max_bend_deg) in
            [(false, 180.0), (true, 180.0), (true, 60.0), (true, 30.0)]
        {
            cases.push(vec![
                setting("by_head", by_head),
                setting("self_collision", self_collision),
                setting("max_bend_deg", max_bend_deg),
            ]);
        }
    }
    cases
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct PushingResults {
    /// Those pushed by the head first, from what folds most easily on.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

fn chain(max_bend_deg: f64) -> Result<Chain<2>, InputError> {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
    let connector = Connector { max_bend_rad: max_bend_deg.to_radians(), ..Connector::free(0.25) };
    // The head is at the far end.
    Chain::straight([30.0, 0.0], [-1.0, 0.0], TAIL, rod, connector)
}

/// Runs a case until some part objects; returns the distance and the measures on the way.
fn push(case: &Variant, seed: u64) -> Result<Json, InputError> {
    let walls = Corridor::new(vec![CorridorLeg::Straight { length_m: 40.0 }], WIDTH_M)?.walls(0);
    // The longest rod, 0.8 m, with the radii of its ends.
    let obstacles = Obstacles::new(walls, 1.3)?;
    let mut chain = chain(setting_number(case, "max_bend_deg"))?;
    let rules = ReactionRules {
        self_collision: is_set(case, "self_collision"),
        ..ReactionRules::default()
    };
    let mut propagator = Propagator::new(rules);
    let draws = &mut draws(seed);
    let k = if is_set(case, "by_head") { 0 } else { TAIL };
    let start = chain.points()[k];
    let mut gone_m = 0.0;
    let mut reason = None;
    let mut sharpest_rad = 0.0;
    let mut rod_violation_m = 0.0_f64;
    for step in 1..=(DISTANCE_M / STEP_M) as usize {
        let way_m = STEP_M * step as f64;
        let to =
            add_scaled(add_scaled(start, [-1.0, 0.0], way_m), [0.0, 1.0], NOISE_M * normal(draws));
        if let MotionOutcome::Vetoed(veto) =
            propagator.propagate(&mut chain, &obstacles, &MotionRequest::from_operator(k, to))?
        {
            reason = Some(veto.reason.name());
            break;
        }
        gone_m = way_m;
        let bends = (0..chain.points().len()).filter_map(|i| chain.bend_rad(i));
        sharpest_rad = bends.fold(sharpest_rad, f64::max);
        rod_violation_m = rod_violation_m.max(chain.max_rod_violation_m());
    }
    Ok(json!({
        "way_m": gone_m,
        "veto": reason,
        "sharpest_rad": sharpest_rad,
        "rod_violation_m": rod_violation_m,
    }))
}

fn is_set(case: &Variant, key: &str) -> bool {
    case.value(key).and_then(toml::Value::as_bool) == Some(true)
}

/// Returns the name of the limits of a case, below its bars.
fn limit_name(case: &CaseResults) -> String {
    let max_bend_deg = case.number("max_bend_deg");
    if !case.is_true("self_collision") {
        "no self-collision".into()
    } else if max_bend_deg == 180.0 {
        "self-collision".into()
    } else {
        format!("bends up to {max_bend_deg}\u{b0}")
    }
}

impl PushingResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let study = Study::from_variants("", cases()).with_size(plan.seeds, None);
        let results =
            study.run_by(plan.workers, "pushed and pulled", progress, |_, case, trial| {
                Ok(outcome_from_values(trial, push(case, trial.seed)?))
            })?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    pub(super) fn cases_by_direction(&self, by_head: bool) -> impl Iterator<Item = &CaseResults> {
        self.cases.iter().filter(move |c| c.is_true("by_head") == by_head)
    }

    pub(super) fn table(&self) -> Table {
        let note = "16 connectors in a straight corridor of 2 m; where the head is told to go errs \
                    by 1 mm across, 12 m in all. Without self-collision a pushed chain folds onto \
                    itself, which no robots can.";
        COLUMNS.table("Pushed by the head, pulled by the tail", note, &self.cases)
    }

    pub(super) fn figure(&self) -> Figure {
        let pushed = bars("pushed by the head", self.cases_by_direction(true), "way_m");
        let pulled = bars("pulled by the tail", self.cases_by_direction(false), "way_m");
        let categories = self.cases_by_direction(true).map(limit_name).collect();
        let kind = FigureKind::Bars { categories };
        let title = "How far a chain goes back until somebody objects";
        Figure { kind, ..figure(title, ["", "way of 12 m, m"], [pushed, pulled]) }
    }
}
