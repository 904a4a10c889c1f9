//! Tests of which parts may start a motion, and which may object (slides R4, R5, R7, R8), and
//! whether bends keep their limits (slide F1).

use super::{SerpentineConfig, draws};
use crate::case_results::{Proportion, table};
use crate::study::{Progress, downcast, run_all, run_to_end, setting, source};
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::kernel::distr::normal;
use sidestep::kernel::stream::Draws;
use sidestep::rods::geometry::{Point, add_scaled, distance, normalized};
use sidestep::rods::{
    BEND_TOLERANCE_RAD, Chain, Connector, Mobility, MotionOutcome, MotionRequest, Obstacles,
    Propagator, Rod, VetoReason,
};
use sidestep::worlds::chain::{ChainRun, chain_run};
use sidestep_document::Table;

const FAILING: &str = include_str!("../../scenarios/serpentine/failing.toml");

/// Connectors of the chain: an arm as redundant as the snake robot of 25 degrees of freedom that the slides cite (Overgaard).
const CONNECTORS: usize = 26;
/// Length of an initiator's step.
const STEP_M: f64 = 0.05;
/// Motions of each chain with bend limits.
const MOTIONS: usize = 400;
/// Bend limits in degrees, and whether in space.
const BEND_LIMITS: [(f64, bool); 5] =
    [(90.0, false), (60.0, false), (30.0, false), (60.0, true), (30.0, true)];

/// Every connector as initiator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct InitiatorResults {
    /// Motions that every connector of a free chain started, and that were made.
    pub(super) moved: Proportion,
    /// The share of motions of a connector in the middle after which each half is where it would be
    /// as a chain of its own, to the bit.
    pub(super) halves_alike: Proportion,
    /// Motions of a chain with a fixed base to which the base objected, as fixed.
    pub(super) base_objected: Proportion,
    /// Motions of a chain with a failed connector to which that one objected, as failed.
    pub(super) failed_objected: Proportion,
    /// Vetoes that left every bit of the chain as it was.
    pub(super) kept: Proportion,
    /// Runs of a world in which a connector fails on the way, and the veto that the operator
    /// receives names that one.
    pub(super) told: Proportion,
    /// In the order of [`BEND_LIMITS`].
    pub(super) bends: Vec<BendLimitResult>,
}

/// Results of motions under one bend limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct BendLimitResult {
    /// Largest angle between two rods that is allowed.
    pub(super) limit_deg: f64,
    /// Whether in space, or in the plane.
    pub(super) in_space: bool,
    /// Motions that were made.
    pub(super) moved: Proportion,
    /// Vetoes for another reason than the limit.
    pub(super) other_vetoes: u64,
    /// Motions after which a bend was beyond the limit.
    pub(super) exceeded: u64,
    /// Sharpest bend after any of the motions.
    pub(super) sharpest_deg: f64,
}

#[derive(Default)]
struct InitiatorCounts {
    moved: Vec<bool>,
    halves_alike: Vec<bool>,
    base_objected: Vec<bool>,
    failed_objected: Vec<bool>,
    kept: Vec<bool>,
}

fn direction<const D: usize>(draws: &mut Draws) -> Point<D> {
    let random = std::array::from_fn(|_| normal(draws));
    normalized(random).unwrap_or_else(|| std::array::from_fn(|i| if i == 0 { 1.0 } else { 0.0 }))
}

/// A chain of fixed rods that turns a little at every connector.
fn chain<const D: usize>(draws: &mut Draws, max_bend_rad: f64) -> Result<Chain<D>, InputError> {
    let mut u: Point<D> = direction(draws);
    let mut points = vec![[0.0; D]];
    for i in 1..CONNECTORS {
        u = normalized(add_scaled(u, direction(draws), 0.2)).unwrap_or(u);
        points.push(add_scaled(points[i - 1], u, 0.5));
    }
    let connector = Connector { max_bend_rad, ..Connector::free(0.05) };
    let rods = points
        .windows(2)
        .map(|ends| Rod::with_fixed_length(distance(ends[0], ends[1]), 0.02))
        .collect();
    Chain::new(points, vec![connector; CONNECTORS], rods)
}

/// The connectors `range` as a chain of their own.
fn part(chain: &Chain<3>, range: std::ops::RangeInclusive<usize>) -> Result<Chain<3>, InputError> {
    let (first, last) = (*range.start(), *range.end());
    Chain::new(
        chain.points()[range.clone()].to_vec(),
        chain.connectors()[range].to_vec(),
        chain.rods()[first..last].to_vec(),
    )
}

fn propagate(chain: &mut Chain<3>, k: usize, to: Point<3>) -> Result<MotionOutcome<3>, InputError> {
    Propagator::default().propagate(
        chain,
        &Obstacles::default(),
        &MotionRequest::from_operator(k, to),
    )
}

fn count_motions(seed: u64) -> Result<InitiatorCounts, InputError> {
    let draws = &mut draws(seed);
    let free = chain::<3>(draws, std::f64::consts::PI)?;
    let mut seen = InitiatorCounts::default();
    for k in 0..CONNECTORS {
        let to = add_scaled(free.points()[k], direction(draws), STEP_M);
        let mut moved = free.clone();
        seen.moved.push(propagate(&mut moved, k, to)?.motion().is_some());
        // The chain is two sub-chains from its initiator on; at an end one of them is the whole.
        if (1..CONNECTORS - 1).contains(&k) {
            let mut low = part(&free, 0..=k)?;
            let mut high = part(&free, k..=CONNECTORS - 1)?;
            propagate(&mut low, k, to)?;
            propagate(&mut high, 0, to)?;
            let alike =
                low.points() == &moved.points()[..=k] && high.points() == &moved.points()[k..];
            seen.halves_alike.push(alike);
        }
        for other in (0..CONNECTORS).filter(|&other| other != k) {
            let mut failing = free.clone();
            failing.set_connector_failed(other, true);
            let expected = ExpectedVeto { by: other, reason: VetoReason::Failed };
            let objected = is_vetoed_as_expected(&mut failing, k, to, expected, &mut seen)?;
            seen.failed_objected.push(objected);
        }
        if k > 0 {
            let mut arm = free.clone();
            arm.set_mobility(0, Mobility::Fixed)?;
            let expected = ExpectedVeto { by: 0, reason: VetoReason::Fixed };
            let objected = is_vetoed_as_expected(&mut arm, k, to, expected, &mut seen)?;
            seen.base_objected.push(objected);
        }
    }
    Ok(seen)
}

/// The connector that has to object, and for which reason.
struct ExpectedVeto {
    by: usize,
    reason: VetoReason,
}

/// Returns whether the motion of connector `k` is vetoed by the expected connector, for the expected reason.
fn is_vetoed_as_expected(
    chain: &mut Chain<3>,
    k: usize,
    to: Point<3>,
    expected: ExpectedVeto,
    seen: &mut InitiatorCounts,
) -> Result<bool, InputError> {
    let before = chain.points().to_vec();
    let outcome = propagate(chain, k, to)?;
    let Some(veto) = outcome.veto() else { return Ok(false) };
    seen.kept.push(chain.points() == before);
    Ok(veto.by == expected.by && veto.reason == expected.reason)
}

/// Lets an operator lead a chain of which a connector fails; returns whether the veto names it.
fn veto_names_failed(seed: u64) -> Result<bool, InputError> {
    // Any connector of the scenario's 16 but the two ends, of which the first one leads.
    let failing = 1 + (draws(seed).uniform_below(14)) as usize;
    let source = source(
        FAILING,
        &[setting("chains.changes.connector", failing as i64), setting("seed", seed as i64)],
    )?;
    let mut run = chain_run(&source, 1)?;
    run_to_end(&mut *run, |_| ());
    let metrics = downcast::<ChainRun<2>>(&*run).metrics();
    let names_it = metrics.given_up.iter().all(|given_up| {
        let what = &given_up.what;
        what.by == Some(failing as u32) && what.reason.as_deref() == Some(VetoReason::Failed.name())
    });
    Ok(!metrics.given_up.is_empty() && names_it)
}

/// Results of a wandering head with a bend limit.
struct BendLimitRun {
    moved: Vec<bool>,
    other_vetoes: u64,
    exceeded: u64,
    sharpest_rad: f64,
}

fn wander<const D: usize>(limit_rad: f64, seed: u64) -> Result<BendLimitRun, InputError> {
    let draws = &mut draws(seed);
    let mut chain = chain::<D>(draws, limit_rad)?;
    let mut propagator = Propagator::default();
    let nothing = Obstacles::default();
    let mut u: Point<D> = direction(draws);
    let mut came =
        BendLimitRun { moved: Vec::new(), other_vetoes: 0, exceeded: 0, sharpest_rad: 0.0 };
    for _ in 0..MOTIONS {
        u = normalized(add_scaled(u, direction(draws), 0.3)).unwrap_or(u);
        let k = draws.uniform_below(CONNECTORS as u32) as usize;
        let to = add_scaled(chain.points()[k], u, STEP_M);
        let outcome =
            propagator.propagate(&mut chain, &nothing, &MotionRequest::from_operator(k, to))?;
        came.moved.push(outcome.motion().is_some());
        let is_other = outcome.veto().is_some_and(|veto| veto.reason != VetoReason::BendLimit);
        came.other_vetoes += u64::from(is_other);
        let sharpest_rad = (0..CONNECTORS).filter_map(|i| chain.bend_rad(i)).fold(0.0, f64::max);
        came.exceeded += u64::from(sharpest_rad > limit_rad + BEND_TOLERANCE_RAD);
        came.sharpest_rad = came.sharpest_rad.max(sharpest_rad);
    }
    Ok(came)
}

impl InitiatorResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let seeds: Vec<u64> = (1..=plan.seeds as u64).collect();
        let mut report = |share| progress("who begins, who objects", share);
        let all = run_all(&seeds, plan.workers, &mut report, |seed| count_motions(*seed))?;
        let all = InitiatorCounts::total(all);
        let told = run_all(&seeds, plan.workers, &mut report, |seed| veto_names_failed(*seed))?;
        let mut bends = Vec::new();
        for (limit_deg, in_space) in BEND_LIMITS {
            let limit_rad = f64::to_radians(limit_deg);
            let wander = if in_space { wander::<3> } else { wander::<2> };
            let runs = run_all(&seeds, plan.workers, &mut report, |&seed| wander(limit_rad, seed))?;
            bends.push(bend_limit_result(limit_deg, in_space, &runs));
        }
        Ok(Self {
            moved: Proportion::from_flags(all.moved),
            halves_alike: Proportion::from_flags(all.halves_alike),
            base_objected: Proportion::from_flags(all.base_objected),
            failed_objected: Proportion::from_flags(all.failed_objected),
            kept: Proportion::from_flags(all.kept),
            told: Proportion::from_flags(told),
            bends,
        })
    }

    pub(super) fn tables(&self) -> [Table; 2] {
        let note = "26 connectors in space, bent at random; every connector begins a motion of \
                    5 cm, with nothing fixed, with the first one fixed, and with every other one \
                    failed in turn.";
        let mut who = Table::new("Who begins, who objects", note, &["what", "share"]);
        let rows = [
            ("motions of a free chain that are made, whoever begins", &self.moved),
            (
                "halves that are where they would be as chains of their own, to the bit",
                &self.halves_alike,
            ),
            ("motions that the fixed base objects to, as fixed", &self.base_objected),
            ("motions that the failed connector objects to, as failed", &self.failed_objected),
            ("vetoes that leave every bit as it was", &self.kept),
            ("operators who are told that the connector that fails on the way objects", &self.told),
        ];
        for (what, share) in rows {
            who.push_row([what.to_string(), share.to_string()]);
        }
        let note = "The same chain is moved 400 times by 5 cm, by connectors at random; where the limit \
                    would be exceeded, rods turn back into it, or somebody objects.";

        let bends = table(
            "Bend limits",
            note,
            &self.bends,
            &[
                ("limit, deg", &|b| b.limit_deg.to_string()),
                ("in", &|b| if b.in_space { "space" } else { "plane" }.into()),
                ("moved", &|b| b.moved.to_string()),
                ("other vetoes", &|b| b.other_vetoes.to_string()),
                ("exceeded", &|b| b.exceeded.to_string()),
                ("sharpest, deg", &|b| format!("{:.3}", b.sharpest_deg)),
            ],
        );
        [who, bends]
    }
}

fn bend_limit_result(limit_deg: f64, in_space: bool, runs: &[BendLimitRun]) -> BendLimitResult {
    BendLimitResult {
        limit_deg,
        in_space,
        moved: Proportion::from_flags(runs.iter().flat_map(|r| r.moved.iter().copied())),
        other_vetoes: runs.iter().map(|r| r.other_vetoes).sum(),
        exceeded: runs.iter().map(|r| r.exceeded).sum(),
        sharpest_deg: runs.iter().map(|r| r.sharpest_rad).fold(0.0, f64::max).to_degrees(),
    }
}

impl InitiatorCounts {
    fn total(runs: Vec<Self>) -> Self {
        runs.into_iter().fold(Self::default(), |mut all, run| {
            all.moved.extend(run.moved);
            all.halves_alike.extend(run.halves_alike);
            all.base_objected.extend(run.base_objected);
            all.failed_objected.extend(run.failed_objected);
            all.kept.extend(run.kept);
            all
        })
    }
}
