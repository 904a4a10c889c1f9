//! Changes to chains: parts that fail, and chains that break and are joined again (slides R8, R10,
//! F3).

use super::ChainContext;
use super::event_sink::EventSink;
use super::part_ways::{gather_draws, plan_part_ways};
use crate::events::{Event, EventKind};
use crate::state::{ChainBodyState, ScatteredPartState, flatten};
use crate::world::{ChainChange, ChainChangeKind, MAX_THROW_SIGMAS, purpose};
use sidestep_kernel::distr::normal;
use sidestep_kernel::stream::Draws;
use sidestep_rods::geometry::{Point, add, add_scaled, distance, lerp};
use sidestep_rods::rebuild::{MovableEnd, ReformResult, reform_chain};
use sidestep_rods::{Chain, Obstacles};
use std::ops::RangeInclusive;

/// Attempts to find a free position where a part may fall; without one it stays: among obstacles that leave a twentieth of
/// the places free, that happens to one part in 170.
const MAX_PLACEMENT_TRIES: usize = 100;

/// Random layouts of the scattered parts that are tried where the nearest places of a whole chain are in an obstacle.
const MAX_LAYOUTS: usize = 64;
/// Standard deviation of a part's place off its bow, as a fraction of the greatest bow: enough to bend a second time.
const LAYOUT_NOISE: f64 = 0.25;

/// Applies the changes at the start of a cycle.
pub(super) fn apply_changes<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
) {
    let ChainContext { spec, now, .. } = context;
    for change in spec.changes.iter().filter(|change| change.cycle == now) {
        apply_change(change, context, body, sink);
    }
}

fn apply_change<const D: usize>(
    change: &ChainChange<D>,
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
) {
    body.apply_deferred_motions();
    // Its path was planned for the chain as it was.
    body.plan = None;
    change.apply_limit_change(&mut body.chain);
    match &change.what {
        ChainChangeKind::Failed { connector, .. }
        | ChainChangeKind::Mobility { connector, .. }
        | ChainChangeKind::MaxBend { connector, .. } => {
            sink.record(&body.chain, EventKind::Changed, *connector, 0.0);
        }
        ChainChangeKind::Scatter { connectors, by_m, apart_m } => {
            scatter(context, body, connectors, *by_m);
            for point in &mut body.chain.points_mut()[connectors.end() + 1..] {
                *point = add(*point, *apart_m);
            }
            let n = connectors.clone().count() as f64;
            sink.record(&body.chain, EventKind::Broken, *connectors.start(), n);
        }
        ChainChangeKind::Reform { may_come, speed_m_s } => {
            let order = ReformOrder { may_come: *may_come, speed_m_s: *speed_m_s };
            start_reform(context, body, sink, order);
        }
    }
}

/// Throws parts about: each to a free place near its own, if there is one. Parts that are fixed
/// or have failed stay.
fn scatter<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    connectors: &RangeInclusive<usize>,
    by_m: f64,
) {
    let draws = &mut context.random_draws(purpose::SCATTER);
    let chain = &mut body.chain;
    for k in connectors.clone() {
        if chain.connectors()[k].is_still() {
            continue;
        }
        let at = chain.points()[k];
        let radius_m = chain.connectors()[k].radius_m;
        for _ in 0..MAX_PLACEMENT_TRIES {
            let place =
                at.map(|x| x + by_m * normal(draws).clamp(-MAX_THROW_SIGMAS, MAX_THROW_SIGMAS));
            // Only the sign counts, so that it does not matter how far around the place is
            // measured.
            if context.obstacles.clearance_m([place; 2], radius_m, 1.0) > 0.0 {
                chain.points_mut()[k] = place;
                break;
            }
        }
    }
    body.scattered = Some(ScatteredPartState {
        first: *connectors.start() as u32,
        last: *connectors.end() as u32,
        speed_m_s: 0.0,
        goals_m: Vec::new(),
        waited: 0,
        way_points_m: Vec::new(),
    });
}

/// How the scattered parts of a chain are to come back.
struct ReformOrder {
    /// The end that comes with them if they are too few.
    may_come: MovableEnd,
    speed_m_s: f64,
}

/// Finds the places where the scattered parts have to be, and their ways there. A chain that an earlier change has joined
/// stays as it is.
fn start_reform<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
    ReformOrder { may_come, speed_m_s }: ReformOrder,
) {
    let Some(scattered) = &mut body.scattered else { return };
    let first = scattered.first as usize;
    let last = scattered.last as usize;
    // What moves may be elsewhere by the time that the parts get there.
    let still = &context.world.obstacles;
    let draws = &mut gather_draws(context);
    let (whole, result) =
        ReformSearch { chain: &body.chain, first, last, may_come }.find_goals(still, draws);
    let (kind, value) = match result {
        ReformResult::Whole { double_passes } => {
            scattered.goals_m = flatten(&whole);
            scattered.speed_m_s = speed_m_s;
            scattered.waited = 0;
            (EventKind::Reforming, double_passes as f64)
        }
        ReformResult::GapTooLong { have_m, need_m, missing } => {
            return record_gap_too_long(body, sink, first, need_m - have_m, missing);
        }
        ReformResult::NotReached { off_m } => (EventKind::NotReformed, off_m),
    };
    if kind == EventKind::Reforming {
        plan_part_ways(body, still, draws);
    }
    body.tally.not_reformed += u64::from(kind != EventKind::Reforming);
    sink.record(&body.chain, kind, first, value);
}

/// Reports the length and the number of parts that are missing.
fn record_gap_too_long<const D: usize>(
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
    first: usize,
    wanting_m: f64,
    missing: usize,
) {
    let tally = &mut body.tally;
    tally.not_reformed += 1;
    tally.missing_parts = tally.missing_parts.max(missing as u64);
    let event = sink.new_event(&body.chain, EventKind::GapTooLong, first, wanting_m);
    sink.events.push(Event { missing: missing as u32, ..event });
}

/// A search for the places of a chain's connectors when it is whole again.
#[derive(Clone, Copy)]
struct ReformSearch<'a, const D: usize> {
    chain: &'a Chain<D>,
    /// The first scattered connector.
    first: usize,
    /// The last scattered connector.
    last: usize,
    may_come: MovableEnd,
}

impl<const D: usize> ReformSearch<'_, D> {
    /// Returns where the connectors would be if the chain were whole, in no obstacle if such places are found, and whether
    /// it can be whole.
    fn find_goals(
        self,
        obstacles: &Obstacles<D>,
        draws: &mut Draws,
    ) -> (Vec<Point<D>>, ReformResult) {
        let nearest = reform_goals(self.chain, self.first..=self.last, self.may_come);
        let is_whole = |result| matches!(result, ReformResult::Whole { .. });
        if !is_whole(nearest.1) || self.is_free(&nearest.0, obstacles) {
            return nearest;
        }
        for _ in 0..MAX_LAYOUTS {
            let layout = self.bulged_layout(draws);
            let (goals, result) = reform_goals(&layout, self.first..=self.last, self.may_come);
            if is_whole(result) && self.is_free(&goals, obstacles) {
                return (goals, result);
            }
        }
        // The obstacle that is in the way is told when the parts have waited for it.
        nearest
    }

    /// Returns whether the scattered parts and their rods would be in no obstacle.
    fn is_free(self, goals: &[Point<D>], obstacles: &Obstacles<D>) -> bool {
        let is_part_free = |k: usize| {
            let radius_m = self.chain.connectors()[k].radius_m;
            obstacles.first_overlapping_id([goals[k]; 2], radius_m).is_none()
        };
        let is_rod_free = |rod: usize| {
            let radius_m = self.chain.rods()[rod].radius_m;
            obstacles.first_overlapping_id([goals[rod], goals[rod + 1]], radius_m).is_none()
        };
        (self.first..=self.last).all(is_part_free) && (self.first - 1..=self.last).all(is_rod_free)
    }

    /// Returns the chain with its scattered parts on a bow to a random side of the gap, each a little off it: what the
    /// passes make of it lies on that side.
    fn bulged_layout(self, draws: &mut Draws) -> Chain<D> {
        let mut layout = self.chain.clone();
        let [a, b] = [self.first - 1, self.last + 1].map(|k| self.chain.points()[k]);
        let reach_m: f64 =
            self.chain.rods()[self.first - 1..=self.last].iter().map(|r| r.max_m).sum();
        let gap_m = distance(a, b);
        // The height of a triangle whose legs are half of the reach.
        let sag_m = 0.5 * (reach_m * reach_m - gap_m * gap_m).max(0.0).sqrt();
        let bow: Point<D> = std::array::from_fn(|_| sag_m * normal(draws));
        let rods = (self.last - self.first + 2) as f64;
        for k in self.first..=self.last {
            let noise: Point<D> = std::array::from_fn(|_| LAYOUT_NOISE * sag_m * normal(draws));
            if self.chain.connectors()[k].is_still() {
                continue;
            }
            let fraction = (k - self.first + 1) as f64 / rods;
            let height = 4.0 * fraction * (1.0 - fraction);
            let on_bow = add_scaled(lerp(a, b, fraction), bow, height);
            layout.points_mut()[k] = add(on_bow, noise);
        }
        layout
    }
}

/// Returns where the connectors would be if the chain were whole, and whether it can be.
/// Connectors that never move do not move for that either.
fn reform_goals<const D: usize>(
    chain: &Chain<D>,
    scattered: RangeInclusive<usize>,
    may_come: MovableEnd,
) -> (Vec<Point<D>>, ReformResult) {
    let mut whole = chain.clone();
    // Beyond the range of coordinates nothing is joined.
    let result = reform_chain(&mut whole, scattered, may_come)
        .unwrap_or(ReformResult::NotReached { off_m: chain.max_rod_violation_m() });
    let goals = whole.points().to_vec();
    for (k, connector) in chain.connectors().iter().enumerate() {
        let at = chain.points()[k];
        if connector.is_still() && goals[k] != at {
            let off_m = distance(goals[k], at);
            return (goals, ReformResult::NotReached { off_m });
        }
    }
    (goals, result)
}
