//! A chain whose middle parts are thrown about, or partly gone, is joined again between its two
//! whole ends (slide F3).

use super::Plan;
use super::runs::{Share, draws, grid, median};
use crate::farm::Progress;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::kernel::math::{cos, sin};
use sidestep::kernel::stream::Draws;
use sidestep::worlds::chain::geometry::{Point, along, distance};
use sidestep::worlds::chain::rebuild::{MayCome, Reformed, reform};
use sidestep::worlds::chain::{Chain, Connector, Rod};
use sidestep_document::{Table, estimate::short};

/// Connectors of the whole chain.
const CONNECTORS: usize = 40;
const ROD: Rod = Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.02 };
/// Standard deviation of the bends of the whole chain, radians.
const BEND_RAD: f64 = 0.3;

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// Middle connectors that are thrown about,
    pub scattered: usize,
    /// by this standard deviation.
    pub by_m: f64,
    /// Middle connectors that are gone.
    pub gone: usize,
    /// Whether the end with the last connector may come.
    pub may_come: bool,
}

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// The case.
    pub case: Case,
    /// Runs whose parts reach across the gap.
    pub can: Share,
    /// Runs that are whole again.
    pub whole: Share,
    /// Runs that were refused because the parts do not reach.
    pub too_long: u64,
    /// Of the whole ones the median of passes there and back,
    pub median_passes: f64,
    /// and the most.
    pub most_passes: usize,
    /// Runs whose ends that may not move kept every bit.
    pub ends_kept: Share,
    /// The greatest amount by which a rod is outside its limits when all is whole.
    pub rod_violation_m: f64,
}

struct Run {
    can: bool,
    came: Reformed,
    ends_kept: bool,
    rod_violation_m: f64,
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Broken {
    /// Results by case.
    pub cells: Vec<Cell>,
}

/// A chain that bends a little at every connector.
fn whole(draws: &mut Draws) -> Vec<Point<2>> {
    let (mut at, mut heading_rad) = ([0.0, 0.0], 0.0);
    let mut points = vec![at];
    for _ in 1..CONNECTORS {
        heading_rad += BEND_RAD * normal(draws);
        at = along(at, [cos(heading_rad), sin(heading_rad)], 1.0);
        points.push(at);
    }
    points
}

/// The chain after it broke, and the indices of its scattered connectors.
fn broken(
    case: &Case,
    seed: u64,
) -> Result<(Chain<2>, std::ops::RangeInclusive<usize>), InputError> {
    let draws = &mut draws(seed);
    let mut points = whole(draws);
    let first = (CONNECTORS - case.scattered) / 2;
    points.drain(first..first + case.gone);
    let last = first + case.scattered - case.gone - 1;
    for point in &mut points[first..=last] {
        point.iter_mut().for_each(|x| *x += case.by_m * normal(draws));
    }
    let n = points.len();
    let chain = Chain::broken(points, vec![Connector::free(0.05); n], vec![ROD; n - 1])?;
    Ok((chain, first..=last))
}

/// The same before and after, for the picture.
pub(super) fn before_and_after(seed: u64) -> Result<[Vec<Point<2>>; 2], InputError> {
    let case = Case { scattered: 20, by_m: 5.0, gone: 2, may_come: true };
    let (mut chain, scattered) = broken(&case, seed)?;
    let before = chain.points().to_vec();
    reform(&mut chain, scattered, MayCome::Last)?;
    Ok([before, chain.points().to_vec()])
}

fn joined(case: &Case, seed: u64) -> Result<Run, InputError> {
    let (mut chain, scattered) = broken(case, seed)?;
    let before = chain.points().to_vec();
    let (low, high) = (*scattered.start() - 1, *scattered.end() + 1);
    let can = distance(before[low], before[high]) <= ROD.max_m * (high - low) as f64;
    let may_come = if case.may_come { MayCome::Last } else { MayCome::Nobody };
    let came = reform(&mut chain, scattered, may_come)?;
    let kept = |range: std::ops::Range<usize>| chain.points()[range.clone()] == before[range];
    // An end that may come keeps its place only where it need not.
    let ends_kept = kept(0..low + 1) && ((case.may_come && !can) || kept(high..before.len()));
    Ok(Run { can, came, ends_kept, rod_violation_m: chain.max_rod_violation_m() })
}

impl Broken {
    pub(super) fn run(plan: &Plan, progress: &mut Progress<'_>) -> Result<Self, InputError> {
        let mut cases = Vec::new();
        for scattered in [4, 10, 20] {
            for by_m in [1.0, 10.0, 100.0] {
                cases.push(Case { scattered, by_m, gone: 0, may_come: false });
            }
            for may_come in [false, true] {
                cases.push(Case { scattered, by_m: 10.0, gone: 2, may_come });
            }
        }
        let all = grid((plan, plan.breaks), "broken chains", &cases, progress, joined)?;
        Ok(Self { cells: cases.iter().zip(&all).map(|(case, runs)| cell(*case, runs)).collect() })
    }

    pub(super) fn table(&self) -> Table {
        let note = "40 connectors 1 m apart (rods of 0.9 to 1.1 m), bent at random; of the middle \
                    ones so many are thrown about, two of them are gone where it says so. A gap \
                    that the parts left cannot reach across is refused, or one end comes.";
        let columns = [
            "scattered",
            "by, m",
            "gone",
            "an end may come",
            "parts reach",
            "whole again",
            "refused",
            "passes there and back, median (most)",
            "ends kept",
        ];
        let mut table = Table::new("Broken chains", note, &columns);
        for c in &self.cells {
            table.row([
                c.case.scattered.to_string(),
                c.case.by_m.to_string(),
                c.case.gone.to_string(),
                if c.case.may_come { "yes" } else { "no" }.into(),
                c.can.to_string(),
                c.whole.to_string(),
                c.too_long.to_string(),
                format!("{} ({})", short(c.median_passes), c.most_passes),
                c.ends_kept.to_string(),
            ]);
        }
        table
    }
}

fn cell(case: Case, runs: &[Run]) -> Cell {
    let passes = || {
        runs.iter().filter_map(|r| match r.came {
            Reformed::Whole { double_passes } => Some(double_passes),
            _ => None,
        })
    };
    let is_whole = |r: &Run| matches!(r.came, Reformed::Whole { .. });
    let is_too_long = |r: &&Run| matches!(r.came, Reformed::GapTooLong { .. });
    let violations = runs.iter().filter(|r| is_whole(r)).map(|r| r.rod_violation_m);
    Cell {
        case,
        can: Share::of(runs.iter().map(|r| r.can)),
        whole: Share::of(runs.iter().map(is_whole)),
        too_long: runs.iter().filter(is_too_long).count() as u64,
        median_passes: median(passes().map(|n| n as f64)),
        most_passes: passes().max().unwrap_or(0),
        ends_kept: Share::of(runs.iter().map(|r| r.ends_kept)),
        rod_violation_m: violations.fold(0.0, f64::max),
    }
}
