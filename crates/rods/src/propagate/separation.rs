//! Motions with self-collision in which no part of the chain comes near another.
//!
//! Most motions are like that. They are made without a test of each pair of parts, and
//! [`SeparationBounds`](crate::motion_bounds::SeparationBounds) proves afterwards that no test could have objected; where
//! the proof fails, the motion is taken back and made with all tests. A sub-step has the same bits either way. A whole
//! request that is proven is one step instead of several, whatever the worker did before.

use super::{InitiatingConnectors, MotionEffects, Propagator, can_only_self_collide, has_arrived};
use crate::chain::Chain;
use crate::geometry::distance;
use crate::motion_bounds::ProvenMotion;
use crate::obstacle::Obstacles;
use crate::open::{self, StayRule};
use std::ops::Range;

/// The schedule of proofs: exponential backoff. The effort of a proof that fails is lost, so every
/// failure doubles the number of motions until the next attempt. No result depends on it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SeparationProofSchedule {
    until_next: u32,
    pause: u32,
}

/// Largest number of motions from one proof to the next. A coiled chain loses at most one proof in 257 motions, and one
/// that has opened up again moves fast after 256 motions at the latest. The value trades these off, and was not tuned.
const MAX_PAUSE: u32 = 256;

impl SeparationProofSchedule {
    /// Returns whether a proof is due for this motion, and counts the motion.
    #[inline]
    pub(crate) fn is_due(&mut self) -> bool {
        let is_due = self.until_next == 0;
        self.until_next = self.until_next.saturating_sub(1);
        is_due
    }

    /// A proof that holds is followed by another at once, one that fails by a longer pause than
    /// before.
    #[inline]
    pub(crate) fn record(&mut self, holds: bool) {
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
    /// Makes a sub-step without obstacles if no part comes near another in it: then nothing can object,
    /// and the chain moves as it does without self-collision. Returns whether it was made.
    pub(super) fn try_collision_free_pull(
        &mut self,
        chain: &mut Chain<D>,
        driven: &InitiatingConnectors<D>,
        is_last: bool,
    ) -> bool {
        let Some(tally) = self.pull_and_prove(chain, driven, StayRule::Nearly) else {
            return false;
        };
        let run = tally.from..tally.to;
        // A later sub-step may end in a veto, which takes back the whole request.
        if !is_last {
            self.save_positions(driven.first, run.clone());
        }
        self.motion_bounds.accept(chain, run);
        self.tally.add(&tally);
        true
    }

    /// Makes all of a request in one motion, as in the open, if no part comes near another in it: one long step is then
    /// as safe as many short ones, and has the bits that it has without an own body. Whether it does follows from the
    /// chain and the request alone. Returns whether it was made.
    pub(super) fn try_whole_motion(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        driven: &InitiatingConnectors<D>,
    ) -> bool {
        let may_prove = self.rules.self_collision
            && can_only_self_collide(chain, obstacles, driven)
            && !has_arrived(chain, driven);
        if !may_prove {
            return false;
        }
        let tally = self.pull_and_prove(chain, driven, StayRule::Exactly);
        if let Some(tally) = &tally {
            self.motion_bounds.accept(chain, tally.from..tally.to);
            self.tally.add(tally);
        }
        tally.is_some()
    }

    /// Moves the chain as in the open; the tally of it, or none if the motion is not proven to be allowed and was taken
    /// back. The caller accepts it, which forgets the positions before.
    fn pull_and_prove(
        &mut self,
        chain: &mut Chain<D>,
        driven: &InitiatingConnectors<D>,
        stays: StayRule,
    ) -> Option<MotionEffects> {
        self.motion_bounds.record(chain);
        let mut tally = MotionEffects::start(driven.first);
        let head_m = distance(chain.points()[driven.first], driven.to[0]);
        open::pull_chain_by_connector(chain, driven.first, driven.to[0], stays, &mut tally);
        let travel_m = head_m.max(tally.max_slave_step_m);
        let motion = ProvenMotion {
            moved: tally.from..tally.to,
            travel_m,
            in_turn: false,
            is_whole: stays == StayRule::Exactly,
        };
        self.prove_or_revert(chain, &tally, motion).then_some(tally)
    }

    /// Returns whether a motion from the recorded places is proven to be allowed; otherwise it is taken back.
    fn prove_or_revert(
        &mut self,
        chain: &mut Chain<D>,
        tally: &MotionEffects,
        motion: ProvenMotion,
    ) -> bool {
        let run = motion.moved.clone();
        let travel_m = motion.travel_m;
        let holds = tally.max_slave_step_m <= self.rules.slave_step_max_m
            && self.motion_bounds.allows(chain, &motion);
        if !holds {
            chain.points_mut()[run.clone()]
                .copy_from_slice(&self.motion_bounds.recorded_points()[run]);
            self.motion_bounds.revert(travel_m);
        }
        holds
    }

    /// Makes a sub-step among obstacles without tests of the chain against itself, if no rod turns and
    /// no part comes near another in it: then those tests would have changed nothing. Returns whether
    /// it was made.
    pub(super) fn try_self_clear_sweep(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        driven: &InitiatingConnectors<D>,
    ) -> bool {
        if !self.proofs.is_due() {
            return false;
        }
        let rotated = self.tally.rotated;
        self.rules.self_collision = false;
        let followed = self.propagate_from_driven(chain, obstacles, driven);
        self.rules.self_collision = true;
        // A rod that turns past an obstacle may have to turn past a part as well.
        let holds = followed.is_ok() && self.tally.rotated == rotated && self.are_separated(chain);
        if holds {
            let moved = self.tentative.moved_range();
            self.commit(chain, driven);
            self.motion_bounds.accept(chain, moved);
        }
        self.tally.rotated = rotated;
        self.proofs.record(holds);
        holds
    }

    /// Returns whether the new places bring no part near another.
    fn are_separated(&mut self, chain: &mut Chain<D>) -> bool {
        self.motion_bounds.record(chain);
        let run = self.tentative.moved_range();
        let moves = self.tentative.positions().iter().zip(&chain.points()[run.clone()]);
        let travel_m = moves.map(|(new, old)| distance(*new, *old)).fold(0.0, f64::max);
        // The bounds measure a chain, so it is moved for them and put back.
        chain.points_mut()[run.clone()].copy_from_slice(self.tentative.positions());
        let motion = ProvenMotion { moved: run.clone(), travel_m, in_turn: true, is_whole: false };
        let are_separated = self.motion_bounds.allows(chain, &motion);
        chain.points_mut()[run.clone()].copy_from_slice(&self.motion_bounds.recorded_points()[run]);
        if !are_separated {
            self.motion_bounds.revert(travel_m);
        }
        are_separated
    }

    /// Saves the positions before a motion that the request may have to take back.
    fn save_positions(&mut self, head: usize, run: Range<usize>) {
        // Outward from the initiator, so that the run of original positions has no gap.
        for i in (head..run.end).chain((run.start..head).rev()) {
            if self.original.get(i).is_none() {
                self.original.set(i, self.motion_bounds.recorded_points()[i]);
            }
        }
    }
}
