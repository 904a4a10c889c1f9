//! A chain with middle parts that are thrown about, or partly missing, is joined again between its
//! two whole ends (slide F3).

use super::{SerpentineConfig, draws};
use crate::case_results::{CaseResults, CaseRuns, Columns, Format, Summary, Value, column};
use crate::study::{Progress, Study, outcome_from_values, setting, setting_number};
use serde::Serialize;
use serde_json::{Value as Json, json};
use sidestep::experiment::sweep::{Setting, Variant};
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::kernel::math::{cos, sin};
use sidestep::kernel::stream::Draws;
use sidestep::rods::geometry::{Point, add_scaled, distance};
use sidestep::rods::rebuild::{MovableEnd, ReformResult, reform_chain};
use sidestep::rods::{Chain, Connector, Rod};
use sidestep_document::{Table, estimate::format_short};

/// Connectors of the whole chain: twice as many as are thrown about at most.
const CONNECTORS: usize = 40;
const ROD: Rod = Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.02 };
/// Standard deviation of the bends of the whole chain, radians.
const BEND_RAD: f64 = 0.3;

const COLUMNS: Columns = Columns {
    case: &[
        column("scattered", "scattered", Summary::Setting("scattered")),
        column("by_m", "by, m", Summary::Setting("by_m")),
        column("gone", "gone", Summary::Setting("gone")),
        column("may_come", "an end may come", Summary::Setting("may_come")),
    ],
    results: &[
        column("can", "parts reach", Summary::Share("can")),
        column("whole", "whole again", Summary::Share("whole")),
        column("too_long", "refused", Summary::Count("too_long")),
        column("median_passes", "passes there and back, median (most)", Summary::Median("passes"))
            .with_format(Format::Computed(format_passes)),
        column("most_passes", "", Summary::Computed(most_passes)),
        column("ends_kept", "ends kept", Summary::Share("ends_kept")),
        column("rod_violation_m", "", Summary::Max("rod_violation_m")),
    ],
};

fn most_passes(case: &CaseRuns<'_>) -> Value {
    Value::Count(case.max_value("passes") as u64)
}

fn format_passes(case: &CaseResults) -> String {
    let median = format_short(case.number("median_passes"));
    format!("{median} ({})", case.count("most_passes"))
}

#[derive(Debug, Clone, Copy)]
struct BreakCase {
    /// Middle connectors that are thrown about,
    scattered: usize,
    /// by this standard deviation.
    by_m: f64,
    /// Middle connectors that are missing.
    gone: usize,
    /// Whether the end with the last connector may come.
    may_come: bool,
}

impl BreakCase {
    fn settings(self) -> Vec<Setting> {
        vec![
            setting("scattered", self.scattered as i64),
            setting("by_m", self.by_m),
            setting("gone", self.gone as i64),
            setting("may_come", self.may_come),
        ]
    }

    fn from_variant(variant: &Variant) -> Self {
        Self {
            scattered: setting_number(variant, "scattered") as usize,
            by_m: setting_number(variant, "by_m"),
            gone: setting_number(variant, "gone") as usize,
            may_come: variant.value("may_come").and_then(toml::Value::as_bool) == Some(true),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct BreakResults {
    /// By number of scattered connectors, those of which none are gone first.
    #[serde(rename = "cells")]
    pub(super) cases: Vec<CaseResults>,
}

/// Returns a chain that bends a little at every connector.
fn intact_points(draws: &mut Draws) -> Vec<Point<2>> {
    let mut at = [0.0, 0.0];
    let mut heading_rad = 0.0;
    let mut points = vec![at];
    for _ in 1..CONNECTORS {
        heading_rad += BEND_RAD * normal(draws);
        at = add_scaled(at, [cos(heading_rad), sin(heading_rad)], 1.0);
        points.push(at);
    }
    points
}

/// Returns the chain after it broke, and the indices of its scattered connectors.
fn broken_chain(
    case: &BreakCase,
    seed: u64,
) -> Result<(Chain<2>, std::ops::RangeInclusive<usize>), InputError> {
    let draws = &mut draws(seed);
    let mut points = intact_points(draws);
    let first = (CONNECTORS - case.scattered) / 2;
    points.drain(first..first + case.gone);
    let last = first + case.scattered - case.gone - 1;
    for point in &mut points[first..=last] {
        for x in point {
            *x += case.by_m * normal(draws);
        }
    }
    let n = points.len();
    let chain = Chain::new_broken(points, vec![Connector::free(0.05); n], vec![ROD; n - 1])?;
    Ok((chain, first..=last))
}

/// Returns the same chain before and after, for the picture.
pub(super) fn before_and_after(seed: u64) -> Result<[Vec<Point<2>>; 2], InputError> {
    let case = BreakCase { scattered: 20, by_m: 5.0, gone: 2, may_come: true };
    let (mut chain, scattered) = broken_chain(&case, seed)?;
    let before = chain.points().to_vec();
    reform_chain(&mut chain, scattered, MovableEnd::Last)?;
    Ok([before, chain.points().to_vec()])
}

fn rejoin(case: &BreakCase, seed: u64) -> Result<Json, InputError> {
    let (mut chain, scattered) = broken_chain(case, seed)?;
    let before = chain.points().to_vec();
    let (low, high) = (*scattered.start() - 1, *scattered.end() + 1);
    let can = distance(before[low], before[high]) <= ROD.max_m * (high - low) as f64;
    let may_come = if case.may_come { MovableEnd::Last } else { MovableEnd::Nobody };
    let came = reform_chain(&mut chain, scattered, may_come)?;
    let passes = match came {
        ReformResult::Whole { double_passes } => Some(double_passes),
        _ => None,
    };
    let after = chain.points();
    let first_end_kept = after[..=low] == before[..=low];
    // An end that may come need not keep its place if the gap is too long.
    let last_end_kept = (case.may_come && !can) || after[high..] == before[high..];
    Ok(json!({
        "can": can,
        "whole": passes.is_some(),
        "too_long": matches!(came, ReformResult::GapTooLong { .. }),
        "passes": passes,
        "ends_kept": first_end_kept && last_end_kept,
        "rod_violation_m": passes.map(|_| chain.max_rod_violation_m()),
    }))
}

impl BreakResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for scattered in [4, 10, 20] {
            for by_m in [1.0, 10.0, 100.0] {
                cases.push(BreakCase { scattered, by_m, gone: 0, may_come: false });
            }
            // With fewer parts (slide F3) the gap may be too wide for the rods that are left.
            for may_come in [false, true] {
                cases.push(BreakCase { scattered, by_m: 10.0, gone: 2, may_come });
            }
        }
        let variants = cases.into_iter().map(BreakCase::settings).collect();
        let study = Study::from_variants("", variants).with_size(plan.breaks, None);
        let what = "broken chains";
        let results = study.run_by(plan.workers, what, progress, |_, case, trial| {
            Ok(outcome_from_values(trial, rejoin(&BreakCase::from_variant(case), trial.seed)?))
        })?;
        Ok(Self { cases: COLUMNS.cases(&results) })
    }

    pub(super) fn table(&self) -> Table {
        let note = "40 connectors 1 m apart (rods of 0.9 to 1.1 m), bent at random; of the middle \
                    ones so many are thrown about, two of them are gone where it says so. A gap \
                    that the parts left cannot reach across is refused, or one end comes.";
        COLUMNS.table("Broken chains", note, &self.cases)
    }
}
