//! Motions of an initiator that the rest of its chain has yet to follow, with their measures.
//!
//! Where nothing can object, `sidestep_rods` lets a chain follow several motions at once, in the same bits
//! as one after the other and much faster; a chain with a solid body but for its first rods.
//!
//! The chain follows once enough motions are deferred; one that is read before is copied, and the copy follows. Every bit
//! and every measure is as if it had followed each at once, so it does not matter when it is read.

use super::metrics::ChainTally;
use sidestep_rods::geometry::Point;
use sidestep_rods::wavefront::{self, MotionBatchMeasures};
use sidestep_rods::{Chain, DeferredSolidMotions, ReactionRules};

/// A motion of connector 0 within a cycle.
#[derive(Clone, Copy)]
pub(crate) struct InitiatorMotion<'a, const D: usize> {
    pub(crate) to: Point<D>,
    pub(crate) rules: &'a ReactionRules,
    /// Duration of the cycle, s.
    pub(crate) dt_s: f64,
}

/// Motions of connector 0 that others have yet to follow.
#[derive(Debug, Clone, Default)]
pub(crate) struct DeferredMotions<const D: usize> {
    /// Those of a chain that may pass through itself.
    motions: wavefront::DeferredMotions<D>,
    /// Those of a chain with a solid body.
    solid: DeferredSolidMotions<D>,
    /// Duration of a cycle, s: the measures of the motions become speeds.
    dt_s: f64,
}

impl<const D: usize> DeferredMotions<D> {
    /// Returns whether the chain is where it should be.
    pub(crate) fn is_empty(&self) -> bool {
        self.motions.is_empty() && self.solid.is_empty()
    }

    /// Moves connector 0 within a cycle, alone or with those to which something could object. Returns whether it has
    /// moved: if not, the chain is to follow all deferred motions, and to make this one at once.
    pub(crate) fn move_initiator(
        &mut self,
        chain: &mut Chain<D>,
        motion: InitiatorMotion<'_, D>,
        tally: &mut ChainTally,
    ) -> bool {
        let InitiatorMotion { to, rules, dt_s } = motion;
        self.dt_s = dt_s;
        let is_full = if rules.self_collision {
            let Some(measures) = self.solid.try_move(chain, rules, to) else { return false };
            self.record(measures, tally);
            self.solid.is_full()
        } else {
            self.motions.move_first(chain, to);
            self.motions.is_full()
        };
        // As many motions are deferred as are made at once.
        if is_full {
            self.apply_to_chain(chain, tally);
        }
        true
    }

    /// Lets the chain follow all deferred motions, and adds their measures to the tally.
    pub(crate) fn apply_to_chain(&mut self, chain: &mut Chain<D>, tally: &mut ChainTally) {
        let measures = [self.motions.apply_to_chain(chain), self.solid.apply_to_chain(chain)];
        measures.into_iter().flatten().for_each(|measures| self.record(measures, tally));
    }

    fn record(&self, measures: MotionBatchMeasures, tally: &mut ChainTally) {
        tally.moved += measures.changed;
        tally.max_slave_step_m = tally.max_slave_step_m.max(measures.longest_m);
        tally.max_speed_m_s = tally.max_speed_m_s.max(measures.longest_m / self.dt_s);
        tally.max_rod_violation_m = tally.max_rod_violation_m.max(measures.max_rod_violation_m);
    }
}
