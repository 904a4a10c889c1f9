//! Motions of a chain in its own way in which no part comes near another.

use super::{DrivenConnectors, MotionTally, Propagator, is_open};
use crate::chain::Chain;
use crate::geometry::distance;
use crate::motion_bounds::MotionBounds;
use crate::obstacle::Obstacles;
use crate::open::{self, StayRule};
use std::ops::Range;

/// Motions among obstacles until a proof is tried again. Where one fails, its effort is lost, so every
/// failure doubles the time to the next. No result depends on it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ProofSchedule {
    until_next: u32,
    pause: u32,
}

/// Most motions from one proof to the next.
const MAX_PAUSE: u32 = 256;

impl ProofSchedule {
    /// Returns whether a proof is to be tried now.
    #[inline]
    fn is_due(&mut self) -> bool {
        let is_due = self.until_next == 0;
        self.until_next = self.until_next.saturating_sub(1);
        is_due
    }

    #[inline]
    fn record(&mut self, holds: bool) {
        self.pause = if holds { 0 } else { (2 * self.pause).clamp(1, MAX_PAUSE) };
        self.until_next = self.pause;
    }

    /// Returns the proofs of a propagator that never tries one.
    #[cfg(test)]
    pub(super) fn never() -> Self {
        Self { until_next: u32::MAX, pause: 0 }
    }
}

impl<const D: usize> Propagator<D> {
    /// Makes a motion if no part comes near another in it; then nothing can object, and the chain moves
    /// as if it were not in its own way.
    pub(super) fn pull_if_separated(
        &mut self,
        chain: &mut Chain<D>,
        heads: &DrivenConnectors<D>,
        goes_on: bool,
    ) -> bool {
        if !MotionBounds::is_worthwhile(chain) {
            return false;
        }
        self.leeway.record(chain);
        let mut tally = MotionTally::start(heads.first);
        let head_m = distance(chain.points()[heads.first], heads.to[0]);
        open::pull(chain, heads.first, heads.to[0], StayRule::Nearly, &mut tally);
        let way_m = head_m.max(tally.max_slave_step_m);
        let may = self.is_proven(chain, &tally, way_m);
        if may {
            if goes_on {
                self.save_positions(heads.first, tally.from..tally.to);
            }
            self.tally.add(&tally);
            self.leeway.accept(chain);
        }
        may
    }

    /// Makes all sub-steps of a request alone at once, if no part comes near another in any of them. Every part is then
    /// where it would be after one sub-step after the other, each with a proof of its own or none.
    pub(super) fn pull_all_if_separated(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        heads: &DrivenConnectors<D>,
        n: usize,
    ) -> bool {
        let may = self.rules.self_collision
            && (2..=open::MAX_BATCH).contains(&n)
            && is_open(chain, obstacles, heads)
            && MotionBounds::is_worthwhile(chain);
        let k = heads.first;
        let from = heads.positions(chain);
        // A sub-step too short to count is none.
        let is_long = distance(from[0], heads.to[0]) > 2.0 * n as f64 * chain.min_move_m();
        if !may || !is_long || !self.whole_proofs.is_due() {
            return false;
        }
        self.leeway.record(chain);
        let mut tally = MotionTally::start(k);
        let mut to = [heads.to[0]; open::MAX_BATCH];
        for (j, to) in to[..n].iter_mut().enumerate() {
            *to = heads.positions_at(from, [j + 1, n])[0];
        }
        let way_m = open::pull_batch(chain, k, &to[..n], &mut tally);
        let holds = self.is_proven(chain, &tally, way_m);
        if holds {
            self.tally.add(&tally);
            self.leeway.accept(chain);
        }
        self.whole_proofs.record(holds);
        holds
    }

    /// Returns whether a motion from the noted places, in which connectors went `way_m` at most, is allowed;
    /// otherwise it is taken back.
    fn is_proven(&mut self, chain: &mut Chain<D>, tally: &MotionTally, way_m: f64) -> bool {
        let may = tally.max_slave_step_m <= self.rules.slave_step_max_m
            && self.leeway.allows(chain, way_m);
        if !may {
            let run = tally.from..tally.to;
            chain.points_mut()[run.clone()].copy_from_slice(&self.leeway.recorded_points()[run]);
            self.leeway.revert(way_m);
        }
        may
    }

    /// Makes a motion among obstacles if no rod turns and no part comes near another in it: every part is then where
    /// it would be if each had been looked at.
    pub(super) fn sweep_if_separated(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        heads: &DrivenConnectors<D>,
    ) -> bool {
        if !MotionBounds::is_worthwhile(chain) || !self.proofs.is_due() {
            return false;
        }
        let rotated = self.tally.rotated;
        self.rules.self_collision = false;
        let followed = self.sweep_from(chain, obstacles, heads);
        self.rules.self_collision = true;
        // A rod that turns past an obstacle may have to turn past a part as well.
        let holds = followed.is_ok() && self.tally.rotated == rotated && self.are_separated(chain);
        if holds {
            self.commit(chain, heads);
            self.leeway.accept(chain);
        }
        self.tally.rotated = rotated;
        self.proofs.record(holds);
        holds
    }

    /// Returns whether the new places bring no part near another.
    fn are_separated(&mut self, chain: &mut Chain<D>) -> bool {
        self.leeway.record(chain);
        let run = self.overlay.from..self.overlay.to;
        let ways = self.overlay.positions().iter().zip(&chain.points()[run.clone()]);
        let way_m = ways.map(|(new, old)| distance(*new, *old)).fold(0.0, f64::max);
        chain.points_mut()[run.clone()].copy_from_slice(self.overlay.positions());
        let are_apart = self.leeway.allows(chain, way_m);
        chain.points_mut()[run.clone()].copy_from_slice(&self.leeway.recorded_points()[run]);
        if !are_apart {
            self.leeway.revert(way_m);
        }
        are_apart
    }

    /// Keeps the positions before a motion that the request may have to take back.
    fn save_positions(&mut self, head: usize, run: Range<usize>) {
        for i in (head..run.end).chain((run.start..head).rev()) {
            if self.before.get(i).is_none() {
                self.before.set(i, self.leeway.recorded_points()[i]);
            }
        }
    }
}
