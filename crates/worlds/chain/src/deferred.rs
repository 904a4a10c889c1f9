//! Motions of an initiator that the rest of its chain has yet to follow, with their measures.
//!
//! Where nothing can object, `sidestep_rods` lets a chain follow several motions at once, in the same bits
//! as one after the other and much faster. The chain follows once enough motions are deferred; one that is
//! read before is copied, and the copy follows. Every bit and every measure is as if it had followed each at once, so it
//! does not matter when it is read.

use super::metrics::ChainTally;
use sidestep_rods::Chain;
use sidestep_rods::geometry::Point;
use sidestep_rods::wavefront;

/// Motions of connector 0 that the others have yet to follow.
#[derive(Debug, Clone, Default)]
pub(crate) struct DeferredMotions<const D: usize> {
    motions: wavefront::DeferredMotions<D>,
    /// Duration of a cycle, s: the measures of the motions become speeds.
    dt_s: f64,
}

impl<const D: usize> DeferredMotions<D> {
    /// Returns whether the chain is where it should be.
    pub(crate) fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Moves connector 0 alone, within a cycle of `dt_s`; returns whether the chain is to follow now,
    /// because as many motions are deferred as are made at once.
    pub(crate) fn move_initiator(&mut self, chain: &mut Chain<D>, to: Point<D>, dt_s: f64) -> bool {
        self.dt_s = dt_s;
        self.motions.move_first(chain, to);
        self.motions.is_full()
    }

    /// Lets the chain follow all deferred motions, and adds their measures to the tally.
    pub(crate) fn apply_to_chain(&mut self, chain: &mut Chain<D>, tally: &mut ChainTally) {
        let Some(measures) = self.motions.apply_to_chain(chain) else { return };
        tally.moved += measures.changed;
        tally.max_slave_step_m = tally.max_slave_step_m.max(measures.longest_m);
        tally.max_speed_m_s = tally.max_speed_m_s.max(measures.longest_m / self.dt_s);
        tally.max_rod_violation_m = tally.max_rod_violation_m.max(measures.max_rod_violation_m);
    }
}
