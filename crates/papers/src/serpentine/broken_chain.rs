//! A chain with middle parts that are thrown about, or partly missing, is joined again between its
//! two whole ends (slide F3).

use super::{SerpentineConfig, draws};
use crate::cells::{CaseResults, Columns, Value, column};
use crate::study::{Progress, Study, outcome_from_values, setting, setting_number};
use serde::Serialize;
use serde_json::{Value as Json, json};
use sidestep::experiment::sweep::{Setting, Variant};
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::kernel::math::{cos, sin};
use sidestep::kernel::stream::Draws;
use sidestep::rods::geometry::{Point, add_scaled, distance};
use sidestep::rods::rebuild::{MovableEnd, ReformResult, reform};
use sidestep::rods::{Chain, Connector, Rod};
use sidestep_document::{Table, estimate::format_short};

/// Connectors of the whole chain.
const CONNECTORS: usize = 40;
const ROD: Rod = Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.02 };
/// Standard deviation of the bends of the whole chain, radians.
const BEND_RAD: f64 = 0.3;

const COLUMNS: Columns = Columns {
    case: &[
        column("scattered", "scattered", |r| r.setting("scattered")),
        column("by_m", "by, m", |r| r.setting("by_m")),
        column("gone", "gone", |r| r.setting("gone")),
        column("may_come", "an end may come", |r| r.setting("may_come")),
    ],
    results: &[
        column("can", "parts reach", |r| r.proportion(|run| run.is_true("can"))),
        column("whole", "whole again", |r| r.proportion(|run| run.is_true("whole"))),
        column("too_long", "refused", |r| r.count(|run| run.is_true("too_long"))),
        column("median_passes", "passes there and back, median (most)", |r| {
            Value::Number(r.median("passes"))
        })
        .with_format(|c| {
            format!("{} ({})", format_short(c.number("median_passes")), c.count("most_passes"))
        }),
        column("most_passes", "", |r| Value::Count(r.max_value("passes") as u64)),
        column("ends_kept", "ends kept", |r| r.proportion(|run| run.is_true("ends_kept"))),
        column("rod_violation_m", "", |r| Value::Number(r.max_value("rod_violation_m"))),
    ],
};

/// A case of the experiment.
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
        let [scattered, gone] =
            ["scattered", "gone"].map(|key| setting_number(variant, key) as usize);
        let may_come = variant.value("may_come").and_then(toml::Value::as_bool) == Some(true);
        Self { scattered, by_m: setting_number(variant, "by_m"), gone, may_come }
    }
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct BreakResults {
    /// Results by case.
    pub(super) cells: Vec<CaseResults>,
}

/// Returns a chain that bends a little at every connector.
fn intact_points(draws: &mut Draws) -> Vec<Point<2>> {
    let (mut at, mut heading_rad) = ([0.0, 0.0], 0.0);
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
        point.iter_mut().for_each(|x| *x += case.by_m * normal(draws));
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
    reform(&mut chain, scattered, MovableEnd::Last)?;
    Ok([before, chain.points().to_vec()])
}

fn rejoin(case: &BreakCase, seed: u64) -> Result<Json, InputError> {
    let (mut chain, scattered) = broken_chain(case, seed)?;
    let before = chain.points().to_vec();
    let (low, high) = (*scattered.start() - 1, *scattered.end() + 1);
    let can = distance(before[low], before[high]) <= ROD.max_m * (high - low) as f64;
    let may_come = if case.may_come { MovableEnd::Last } else { MovableEnd::Nobody };
    let came = reform(&mut chain, scattered, may_come)?;
    let kept = |range: std::ops::Range<usize>| chain.points()[range.clone()] == before[range];
    let passes = match came {
        ReformResult::Whole { double_passes } => Some(double_passes),
        _ => None,
    };
    Ok(json!({
        "can": can,
        "whole": passes.is_some(),
        "too_long": matches!(came, ReformResult::GapTooLong { .. }),
        "passes": passes,
        // An end that may come need not keep its place if the gap is too long.
        "ends_kept": kept(0..low + 1) && ((case.may_come && !can) || kept(high..before.len())),
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
            let case =
                |by_m, gone, may_come| BreakCase { scattered, by_m, gone, may_come }.settings();
            cases.extend([1.0, 10.0, 100.0].map(|by_m| case(by_m, 0, false)));
            cases.extend([false, true].map(|may_come| case(10.0, 2, may_come)));
        }
        let study = Study::from_variants("", cases).with_size(plan.breaks, None);
        let what = "broken chains";
        let results = study.run_by(plan.workers, what, progress, |_, case, cell| {
            Ok(outcome_from_values(cell, rejoin(&BreakCase::from_variant(case), cell.seed)?))
        })?;
        Ok(Self { cells: COLUMNS.cells(&results) })
    }

    pub(super) fn table(&self) -> Table {
        let note = "40 connectors 1 m apart (rods of 0.9 to 1.1 m), bent at random; of the middle \
                    ones so many are thrown about, two of them are gone where it says so. A gap \
                    that the parts left cannot reach across is refused, or one end comes.";
        COLUMNS.table("Broken chains", note, &self.cells)
    }
}
