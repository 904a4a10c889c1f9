//! Scattered parts of a broken chain on their way to the places where they are joined again (slide F3).

use super::Acting;
use crate::events::{Event, EventKind};
use crate::rods::TOLERANCE_M;
use crate::rods::geometry::{Point, toward};
use crate::rods::passage::in_the_way;
use crate::rods::sweep::Sweep;
use crate::state::Scattered;
use std::ops::Range;

/// Parts of a step that are tried one after the other where something is in the way.
const SHORTER: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Time for which parts wait for what is in their way, s.
const PATIENCE_S: f64 = 10.0;

/// A try to go on.
#[derive(Debug, Default)]
struct Tried {
    has_moved: bool,
    /// The obstacle that keeps a part from going on.
    blocked_by: Option<u32>,
}

impl<const D: usize> Acting<'_, D> {
    /// Moves scattered parts straight to the places where they are joined again, as far as nothing is in their way; the
    /// chain is whole when all are there and there is room for their rods.
    pub(super) fn come_together(&mut self) {
        let going = |s: &&Scattered| !s.goals_m.is_empty();
        let Some(scattered) = self.body.scattered.as_ref().filter(going) else { return };
        let (first, last) = (scattered.first as usize, scattered.last as usize);
        let step_m = scattered.speed_m_s * self.world.dt_s;
        let goals = scattered.goals_m.chunks_exact(D);
        let goals: Vec<Point<D>> = goals.map(|at| std::array::from_fn(|i| at[i])).collect();
        let mut tried = Tried::default();
        // A whole end that comes along goes as one, because its rods hold.
        let ends = [0..first, last + 1..goals.len()];
        for part in (first..=last).map(|k| k..k + 1).chain(ends) {
            let one = self.gather_part(part, &goals, step_m);
            tried.has_moved |= one.has_moved;
            tried.blocked_by = tried.blocked_by.or(one.blocked_by);
        }
        if self.body.chain.points() != goals {
            return self.wait_for(first, &tried);
        }
        match self.in_a_new_rod(first - 1..last + 1) {
            None => self.is_whole_again(first),
            blocked_by => self.wait_for(first, &Tried { blocked_by, ..tried }),
        }
    }

    /// Ends the state of being broken.
    fn is_whole_again(&mut self, first: usize) {
        self.body.scattered = None;
        self.body.tally.reformed += 1;
        self.tell(EventKind::Reformed, first, 0.0);
    }

    /// Moves connectors and the rods between them toward their places.
    fn gather_part(&mut self, part: Range<usize>, goals: &[Point<D>], step_m: f64) -> Tried {
        let from = self.body.chain.points()[part.clone()].to_vec();
        let goals = &goals[part.clone()];
        let mut tried = Tried::default();
        if from == goals {
            return tried;
        }
        for shorter in SHORTER {
            let ways = from.iter().zip(goals);
            let to: Vec<_> = ways.map(|(p, goal)| toward(*p, *goal, shorter * step_m)).collect();
            match self.in_its_way(part.start, &from, &to) {
                None => {
                    self.body.chain.points_mut()[part].copy_from_slice(&to);
                    return Tried { has_moved: true, ..tried };
                }
                by => tried.blocked_by = tried.blocked_by.or(by),
            }
        }
        tried
    }

    /// Returns the obstacle in the way of connectors, the first of which is `k`, and of the rods between them.
    fn in_its_way(&self, k: usize, from: &[Point<D>], to: &[Point<D>]) -> Option<u32> {
        let (chain, obstacles) = (&self.body.chain, &self.scratch.obstacles);
        let of_connector = |i: usize| {
            let sweep = Sweep { from: [from[i]; 2], to: [to[i]; 2] };
            in_the_way(sweep, chain.connectors()[k + i].radius_m, obstacles)
        };
        let of_rod = |i: usize| {
            let sweep = Sweep { from: [from[i], from[i + 1]], to: [to[i], to[i + 1]] };
            in_the_way(sweep, chain.rods()[k + i].radius_m, obstacles)
        };
        let blocked = (0..from.len()).find_map(of_connector);
        blocked.or_else(|| (0..from.len().saturating_sub(1)).find_map(of_rod))
    }

    /// Returns an obstacle in which one of these rods would be, now that their ends are in place.
    fn in_a_new_rod(&self, mut rods: Range<usize>) -> Option<u32> {
        let chain = &self.body.chain;
        rods.find_map(|rod| {
            let ends = [chain.points()[rod], chain.points()[rod + 1]];
            let radius_m = chain.rods()[rod].radius_m - TOLERANCE_M;
            self.scratch.obstacles.first_at(ends, radius_m)
        })
    }

    /// Counts the time in which nothing went on, and gives up after too much of it.
    fn wait_for(&mut self, first: usize, tried: &Tried) {
        let Some(scattered) = &mut self.body.scattered else { return };
        scattered.waited = if tried.has_moved { 0 } else { scattered.waited.saturating_add(1) };
        if self.world.starts_s(scattered.waited) <= PATIENCE_S {
            return;
        }
        (scattered.speed_m_s, scattered.goals_m, scattered.waited) = (0.0, Vec::new(), 0);
        self.body.tally.not_reformed += 1;
        let off_m = self.body.chain.max_rod_violation_m();
        let event = self.event(EventKind::NotReformed, first, off_m);
        self.scratch.events.push(Event { obstacle: tried.blocked_by, ..event });
    }
}
