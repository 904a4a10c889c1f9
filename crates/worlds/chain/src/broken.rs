//! What happens to chains: parts that fail, and chains that break and are joined again (slides R8,
//! R10, F3).

use super::act::Step;
use super::driver::towards;
use super::events::EventKind;
use super::rods::geometry::{Point, add, distance};
use super::rods::rebuild::{MayCome, Reformed, reform};
use super::state::{Body, Scattered, flat};
use super::world::{ChainWorld, FARTHEST_THROW, Scratch, What, purpose};
use sidestep_kernel::distr::normal;
use std::ops::RangeInclusive;

/// How often a free place is looked for where a part may fall.
const THROWS: usize = 100;

impl<const D: usize> ChainWorld<D> {
    /// What happens to a chain at the begin of a cycle.
    pub(super) fn change(&self, body: &mut Body<D>, turn: Step<'_, D>, scratch: &mut Scratch<D>) {
        for change in turn.spec.changes.iter().filter(|change| change.cycle == turn.now) {
            change.constrain(&mut body.chain);
            match &change.what {
                What::Failed { connector, .. }
                | What::Mobility { connector, .. }
                | What::MaxBend { connector, .. } => {
                    scratch.events.push(turn.event(EventKind::Changed, *connector, 0.0));
                }
                What::Scatter { connectors, by_m, apart_m } => {
                    self.scatter(body, turn, (connectors, *by_m), scratch);
                    for point in &mut body.chain.points_mut()[connectors.end() + 1..] {
                        *point = add(*point, *apart_m);
                    }
                    let n = connectors.clone().count() as f64;
                    scratch.events.push(turn.event(EventKind::Broken, *connectors.start(), n));
                }
                What::Reform { may_come, speed_m_s } => {
                    self.begin_reform(body, turn, (*may_come, *speed_m_s), scratch);
                }
            }
        }
    }

    /// Throws parts about: each to some place near where it is that is free, if there is one. Who
    /// is fixed or has failed stays.
    fn scatter(
        &self,
        body: &mut Body<D>,
        turn: Step<'_, D>,
        (connectors, by_m): (&RangeInclusive<usize>, f64),
        scratch: &Scratch<D>,
    ) {
        let draws = &mut self.streams.draws(turn.slot, turn.now, purpose::SCATTER);
        for k in connectors.clone() {
            if body.chain.connectors()[k].is_still() {
                continue;
            }
            let (at, radius_m) = (body.chain.points()[k], body.chain.connectors()[k].radius_m);
            let mut throw = || normal(draws).clamp(-FARTHEST_THROW, FARTHEST_THROW);
            let mut place = || at.map(|x| x + by_m * throw());
            let is_free =
                |p: &Point<D>| scratch.obstacles.clearance_m([*p; 2], radius_m, 1.0) > 0.0;
            let free = (0..THROWS).map(|_| place()).find(is_free);
            body.chain.points_mut()[k] = free.unwrap_or(at);
        }
        body.scattered = Some(Scattered {
            first: *connectors.start() as u32,
            last: *connectors.end() as u32,
            speed_m_s: 0.0,
            goals_m: Vec::new(),
        });
    }

    /// Finds where the scattered parts have to be.
    fn begin_reform(
        &self,
        body: &mut Body<D>,
        turn: Step<'_, D>,
        (may_come, speed_m_s): (MayCome, f64),
        scratch: &mut Scratch<D>,
    ) {
        let Some(scattered) = &mut body.scattered else { return };
        let mut whole = body.chain.clone();
        let (first, last) = (scattered.first as usize, scattered.last as usize);
        // An end cannot come out of the world.
        let came = reform(&mut whole, first..=last, may_come)
            .unwrap_or(Reformed::NotReached { off_m: body.chain.max_rod_violation_m() });
        let stays = |k: &usize| body.chain.connectors()[*k].is_still();
        let would_move = |k: usize| whole.points()[k] != body.chain.points()[k];
        let came = match (0..whole.points().len()).filter(stays).find(|&k| would_move(k)) {
            None => came,
            Some(k) => {
                let off_m = distance(whole.points()[k], body.chain.points()[k]);
                Reformed::NotReached { off_m }
            }
        };
        let event = match came {
            Reformed::Whole { double_passes } => {
                scattered.goals_m = flat(whole.points());
                scattered.speed_m_s = speed_m_s;
                turn.event(EventKind::Reforming, first, double_passes as f64)
            }
            Reformed::GapTooLong { have_m, need_m } => {
                body.tally.not_reformed += 1;
                turn.event(EventKind::GapTooLong, first, need_m - have_m)
            }
            Reformed::NotReached { off_m } => {
                body.tally.not_reformed += 1;
                turn.event(EventKind::NotReformed, first, off_m)
            }
        };
        scratch.events.push(event);
    }

    /// Scattered parts go to where they are joined again, each straight, and the chain is whole
    /// when all are there.
    pub(super) fn come_together(
        &self,
        body: &mut Body<D>,
        turn: Step<'_, D>,
        scratch: &mut Scratch<D>,
    ) {
        let Some(scattered) = body.scattered.as_ref().filter(|s| !s.goals_m.is_empty()) else {
            return;
        };
        let step_m = scattered.speed_m_s * self.dt_s;
        let goals = scattered.goals_m.chunks_exact(D);
        let mut all_there = true;
        for (point, goal) in body.chain.points_mut().iter_mut().zip(goals) {
            let goal = std::array::from_fn(|i| goal[i]);
            *point = towards(*point, goal, step_m);
            all_there &= *point == goal;
        }
        if all_there {
            scratch.events.push(turn.event(EventKind::Reformed, scattered.first as usize, 0.0));
            body.scattered = None;
            body.tally.reformed += 1;
        }
    }
}
