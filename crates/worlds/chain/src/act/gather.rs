//! Scattered parts of a broken chain that return to the positions where they are joined again (slide F3).

use super::ChainContext;
use super::event_sink::EventSink;
use crate::events::{Event, EventKind};
use crate::state::{ChainBodyState, unflatten};
use sidestep_rods::geometry::{Point, move_toward};
use sidestep_rods::{Chain, Obstacles, RodSweep, TOLERANCE_M, blocking_obstacle};
use std::ops::Range;

/// Fractions of a step that are tried one after the other where something is in the way.
const STEP_FRACTIONS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Time for which parts wait for an obstacle before they give up, s: a mover may pass, a wall does not.
const GATHER_TIMEOUT_S: f64 = 10.0;

/// The result of an attempt to move parts.
#[derive(Debug, Default)]
struct GatherAttempt {
    has_moved: bool,
    /// The first obstacle that blocks a part.
    blocked_by: Option<u32>,
}

/// The connectors of a broken chain, and the positions where they are joined again.
struct ScatteredParts<'a, const D: usize> {
    chain: &'a mut Chain<D>,
    goals: Vec<Point<D>>,
    obstacles: &'a Obstacles<D>,
    /// Longest motion of a part in a cycle, meters.
    step_m: f64,
}

/// Moves scattered parts straight to the positions where they are joined again, as far as nothing blocks them; the
/// chain is whole when all are there and nothing is where their rods will be.
pub(super) fn gather_parts<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
) {
    let Some(scattered) = &body.scattered else { return };
    if scattered.goals_m.is_empty() {
        return;
    }
    let first = scattered.first as usize;
    let last = scattered.last as usize;
    let step_m = scattered.speed_m_s * context.world.dt_s;
    let goals = unflatten(&scattered.goals_m);
    let obstacles = context.obstacles;
    let mut parts = ScatteredParts { chain: &mut body.chain, goals, obstacles, step_m };
    let attempt = parts.advance(first, last);
    if !parts.have_arrived() {
        return wait_or_give_up(context, body, sink, &attempt);
    }
    match parts.obstacle_in_new_rod(first - 1..last + 1) {
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
    if context.world.cycle_start_time_s(scattered.waited) <= GATHER_TIMEOUT_S {
        return;
    }
    scattered.speed_m_s = 0.0;
    scattered.goals_m = Vec::new();
    scattered.waited = 0;
    let first = scattered.first as usize;
    body.tally.not_reformed += 1;
    let off_m = body.chain.max_rod_violation_m();
    let event = sink.new_event(&body.chain, EventKind::NotReformed, first, off_m);
    sink.events.push(Event { obstacle: attempt.blocked_by, ..event });
}

impl<const D: usize> ScatteredParts<'_, D> {
    /// Moves the scattered connectors, from the first to the last, and the ends beside them.
    fn advance(&mut self, first: usize, last: usize) -> GatherAttempt {
        let mut attempt = GatherAttempt::default();
        // Each end is still whole, so it moves as one: its rods keep their lengths.
        let ends = [0..first, last + 1..self.goals.len()];
        for part in (first..=last).map(|k| k..k + 1).chain(ends) {
            let one = self.gather(part);
            attempt.has_moved |= one.has_moved;
            attempt.blocked_by = attempt.blocked_by.or(one.blocked_by);
        }
        attempt
    }

    fn have_arrived(&self) -> bool {
        self.chain.points() == self.goals
    }

    /// Moves connectors and the rods between them toward their positions.
    fn gather(&mut self, part: Range<usize>) -> GatherAttempt {
        let from = self.chain.points()[part.clone()].to_vec();
        let goals = &self.goals[part.clone()];
        let mut attempt = GatherAttempt::default();
        if from == goals {
            return attempt;
        }
        for shorter in STEP_FRACTIONS {
            let step_m = shorter * self.step_m;
            let pairs = from.iter().zip(goals);
            let to: Vec<_> = pairs.map(|(p, goal)| move_toward(*p, *goal, step_m)).collect();
            match self.blocking_obstacle(part.start, &from, &to) {
                None => {
                    self.chain.points_mut()[part].copy_from_slice(&to);
                    return GatherAttempt { has_moved: true, ..attempt };
                }
                by => attempt.blocked_by = attempt.blocked_by.or(by),
            }
        }
        attempt
    }

    /// Returns the obstacle in the way of connectors, the first of which is `k`, and of the rods between them.
    fn blocking_obstacle(&self, k: usize, from: &[Point<D>], to: &[Point<D>]) -> Option<u32> {
        for i in 0..from.len() {
            let sweep = RodSweep { from: [from[i]; 2], to: [to[i]; 2] };
            let radius_m = self.chain.connectors()[k + i].radius_m;
            if let Some(id) = blocking_obstacle(sweep, radius_m, self.obstacles) {
                return Some(id);
            }
        }
        for i in 0..from.len().saturating_sub(1) {
            let sweep = RodSweep { from: [from[i], from[i + 1]], to: [to[i], to[i + 1]] };
            let radius_m = self.chain.rods()[k + i].radius_m;
            if let Some(id) = blocking_obstacle(sweep, radius_m, self.obstacles) {
                return Some(id);
            }
        }
        None
    }

    /// Returns an obstacle in which one of these rods would be, now that their ends are in place.
    fn obstacle_in_new_rod(&self, mut rods: Range<usize>) -> Option<u32> {
        rods.find_map(|rod| {
            let ends = [self.chain.points()[rod], self.chain.points()[rod + 1]];
            // A body that only touches the rod is not in it.
            let radius_m = self.chain.rods()[rod].radius_m - TOLERANCE_M;
            self.obstacles.first_overlapping_id(ends, radius_m)
        })
    }
}
