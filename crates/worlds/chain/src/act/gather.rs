//! Scattered parts of a broken chain that return to the positions where they are joined again (slide F3).

use super::event_sink::EventSink;
use super::part_ways::{gather_draws, plan_part_ways};
use super::{ChainContext, ChainCycleState};
use crate::events::{Event, EventKind};
use crate::state::{ChainBodyState, unflatten};
use sidestep_kernel::Cycle;
use sidestep_rods::geometry::{Aabb, Point, move_toward};
use sidestep_rods::{
    Chain, MotionOutcome, MotionRequest, Obstacles, Propagator, RodSweep, TOLERANCE_M,
    blocking_obstacle,
};
use std::ops::Range;

/// Fractions of a step that are tried one after the other where something is in the way.
const STEP_FRACTIONS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Time for which parts wait for an obstacle before they give up, s: a mover may pass, a wall does not.
const GATHER_TIMEOUT_S: f64 = 10.0;
/// Time after which parts that wait look for other ways, s: shorter than the time after which they give up, so that each
/// obstacle that comes to rest in a way is gone around.
const PLAN_INTERVAL_S: f64 = 2.0;

/// The result of an attempt to move parts.
#[derive(Debug, Default)]
struct GatherAttempt {
    has_moved: bool,
    /// The first obstacle that blocks a part.
    blocked_by: Option<u32>,
}

impl GatherAttempt {
    /// Adds the attempt of the next part.
    fn join(&mut self, next: Self) {
        self.has_moved |= next.has_moved;
        self.blocked_by = self.blocked_by.or(next.blocked_by);
    }
}

/// The connectors of a broken chain, and the positions where they are joined again.
struct ScatteredParts<'a, const D: usize> {
    chain: &'a mut Chain<D>,
    goals: Vec<Point<D>>,
    /// See [`ScatteredPartState::way_points_m`](crate::state::ScatteredPartState::way_points_m).
    ways: &'a mut [Vec<f64>],
    obstacles: &'a Obstacles<D>,
    propagator: &'a mut Propagator<D>,
    /// The box that an end may enter; none where no other chain relies on it.
    claim: Option<Aabb<D>>,
    /// The last whole connector before the scattered ones, and the first whole one after them.
    stubs: [usize; 2],
    /// Longest motion of a part in a cycle, meters.
    step_m: f64,
}

/// Moves scattered parts along their ways to the positions where they are joined again, as far as nothing blocks them; the
/// chain is whole when all are there and nothing is where their rods will be.
pub(super) fn gather_parts<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    claim: Aabb<D>,
) {
    let ChainCycleState { body, propagator, sink, .. } = acting;
    let ChainBodyState { chain, scattered, .. } = &mut **body;
    let Some(scattered) = scattered else { return };
    if scattered.goals_m.is_empty() {
        return;
    }
    let first = scattered.first as usize;
    let last = scattered.last as usize;
    let step_m = scattered.speed_m_s * context.world.dt_s;
    let goals = unflatten(&scattered.goals_m);
    let obstacles = context.obstacles;
    let ways = &mut scattered.way_points_m;
    let stubs = [first - 1, last + 1];
    // No other chain relies on the claim of the only one.
    let claim = (context.world.chains.len() > 1).then_some(claim);
    let mut parts =
        ScatteredParts { chain, goals, ways, obstacles, propagator, claim, stubs, step_m };
    let attempt = parts.advance();
    if !parts.have_arrived() {
        return wait_or_give_up(context, body, sink, &attempt);
    }
    match parts.obstacle_in_new_rod() {
        None => mark_whole(body, sink, first),
        blocked_by => {
            wait_or_give_up(context, body, sink, &GatherAttempt { blocked_by, ..attempt })
        }
    }
}

fn mark_whole<const D: usize>(
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
    first: usize,
) {
    body.scattered = None;
    body.tally.reformed += 1;
    sink.record(&body.chain, EventKind::Reformed, first, 0.0);
}

/// Counts the time in which no part moved, and gives up after [`GATHER_TIMEOUT_S`].
fn wait_or_give_up<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
    attempt: &GatherAttempt,
) {
    let Some(scattered) = &mut body.scattered else { return };
    scattered.waited = if attempt.has_moved { 0 } else { scattered.waited.saturating_add(1) };
    let waited = scattered.waited;
    if context.world.cycle_start_time_s(waited) <= GATHER_TIMEOUT_S {
        let interval = ((PLAN_INTERVAL_S / context.world.dt_s).ceil() as Cycle).max(1);
        if waited > 0 && waited.is_multiple_of(interval) {
            // What moves, and other chains, count as they are now: they have been in the way for a while.
            plan_part_ways(body, context.obstacles, &mut gather_draws(context));
        }
        return;
    }
    scattered.speed_m_s = 0.0;
    scattered.goals_m = Vec::new();
    scattered.waited = 0;
    scattered.way_points_m = Vec::new();
    let first = scattered.first as usize;
    body.tally.not_reformed += 1;
    let off_m = body.chain.max_rod_violation_m();
    let event = sink.new_event(&body.chain, EventKind::NotReformed, first, off_m);
    sink.events.push(Event { obstacle: attempt.blocked_by, ..event });
}

impl<const D: usize> ScatteredParts<'_, D> {
    /// Moves the scattered connectors, from the first to the last, and then the ends beside them.
    fn advance(&mut self) -> GatherAttempt {
        let [low, high] = self.stubs;
        let mut attempt = GatherAttempt::default();
        for k in low + 1..high {
            attempt.join(self.advance_part(k));
        }
        attempt.join(self.advance_end(low, 0..high - 1));
        attempt.join(self.advance_end(high, high..self.goals.len()));
        attempt
    }

    /// Moves a scattered connector toward its next way point.
    fn advance_part(&mut self, k: usize) -> GatherAttempt {
        let next = self.next_place(k);
        let at = self.chain.points()[k];
        let mut attempt = GatherAttempt::default();
        if at == next {
            self.leave_way_point(k, next);
            return attempt;
        }
        let radius_m = self.chain.connectors()[k].radius_m;
        for shorter in STEP_FRACTIONS {
            let to = move_toward(at, next, shorter * self.step_m);
            let sweep = RodSweep { from: [at; 2], to: [to; 2] };
            let Some(id) = blocking_obstacle(sweep, radius_m, self.obstacles) else {
                self.chain.points_mut()[k] = to;
                self.leave_way_point(k, next);
                return GatherAttempt { has_moved: true, ..attempt };
            };
            attempt.blocked_by = attempt.blocked_by.or(Some(id));
        }
        attempt
    }

    /// Leads a whole end by its stub toward the next way point of the stub: the rest follows as any chain does.
    fn advance_end(&mut self, stub: usize, end: Range<usize>) -> GatherAttempt {
        let next = self.next_place(stub);
        let at = self.chain.points()[stub];
        let mut attempt = GatherAttempt::default();
        if at == next {
            self.leave_way_point(stub, next);
            return attempt;
        }
        for shorter in STEP_FRACTIONS {
            let to = move_toward(at, next, shorter * self.step_m);
            let request = MotionRequest::from_operator(stub - end.start, to);
            // Neither fails: the end was a part of a chain, and the goal is in range.
            let Ok(mut alone) = self.chain.part(end.clone()) else { return attempt };
            let outcome = self.propagator.propagate(&mut alone, self.obstacles, &request);
            match outcome {
                // A rod that turns aside throws others far; a shorter step throws them less far.
                Ok(MotionOutcome::Moved(_)) if !self.may_be_at(alone.points()) => {}
                Ok(MotionOutcome::Moved(_)) => {
                    self.chain.points_mut()[end].copy_from_slice(alone.points());
                    self.leave_way_point(stub, next);
                    return GatherAttempt { has_moved: true, ..attempt };
                }
                Ok(MotionOutcome::Vetoed(veto)) => {
                    attempt.blocked_by = attempt.blocked_by.or(veto.obstacle);
                }
                Err(_) => return attempt,
            }
        }
        attempt
    }

    /// Returns whether the connectors of an end may be at some places, because the chain has claimed them.
    fn may_be_at(&self, points: &[Point<D>]) -> bool {
        let is_in =
            |claim: Aabb<D>| points.iter().all(|p| claim.intersects(&Aabb::from_points(&[*p])));
        self.claim.is_none_or(is_in)
    }

    /// Returns the next way point of a connector, after the last one its goal.
    fn next_place(&self, k: usize) -> Point<D> {
        let way = self.ways.get(k - self.stubs[0]).map_or(&[][..], Vec::as_slice);
        unflatten(way).first().copied().unwrap_or(self.goals[k])
    }

    /// Removes the next way point of a connector from its way once it is there.
    fn leave_way_point(&mut self, k: usize, next: Point<D>) {
        if self.chain.points()[k] != next {
            return;
        }
        if let Some(way) = self.ways.get_mut(k - self.stubs[0]) {
            // The goal is no way point: a connector that is there has none left.
            way.drain(..D.min(way.len()));
        }
    }

    /// Returns whether the scattered parts and the stubs are where their rods are whole; the rest of an end that has come
    /// is wherever it has followed.
    fn have_arrived(&self) -> bool {
        let [low, high] = self.stubs;
        self.chain.points()[low..=high] == self.goals[low..=high]
    }

    /// Returns an obstacle in which one of the new rods would be, now that their ends are in place.
    fn obstacle_in_new_rod(&self) -> Option<u32> {
        let [low, high] = self.stubs;
        (low..high).find_map(|rod| {
            let ends = [self.chain.points()[rod], self.chain.points()[rod + 1]];
            // A body that only touches the rod is not in it.
            let radius_m = self.chain.rods()[rod].radius_m - TOLERANCE_M;
            self.obstacles.first_overlapping_id(ends, radius_m)
        })
    }
}
