//! Motions of an initiator that the rest of its chain has yet to follow.
//!
//! Where nothing can object, a chain follows its initiator in one way only, and following several
//! motions at once is much faster ([`pull_and_measure`]). So the chain is put off until enough motions
//! wait or it is looked at. Every bit is as if it had followed each at once, and so is every measure;
//! therefore it does not matter when it is looked at.

use super::metrics::ChainTally;
use sidestep_rods::Chain;
use sidestep_rods::geometry::Point;
use sidestep_rods::wavefront::{LANES, pull_and_measure};

/// Motions of connector 0 that wait.
#[derive(Debug, Clone, Default)]
pub(crate) struct DeferredMotions<const D: usize> {
    /// The place of connector 0 before the first motion that waits.
    from: Option<Point<D>>,
    /// The places of connector 0 after each of them.
    heads: Vec<Point<D>>,
    /// Duration of a cycle, s.
    dt_s: f64,
}

impl<const D: usize> DeferredMotions<D> {
    /// Returns whether the chain is where it should be.
    pub(crate) fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Moves connector 0 alone, within a cycle of `dt_s`; returns whether as many motions wait as are
    /// made at once.
    pub(crate) fn move_initiator(&mut self, chain: &mut Chain<D>, to: Point<D>, dt_s: f64) -> bool {
        let head = &mut chain.points_mut()[0];
        self.from.get_or_insert(*head);
        self.dt_s = dt_s;
        self.heads.push(to);
        *head = to;
        self.heads.len() == LANES
    }

    /// Lets the chain follow all motions that wait.
    pub(crate) fn catch_up(&mut self, chain: &mut Chain<D>, tally: &mut ChainTally) {
        let Some(from) = self.from.take() else { return };
        chain.points_mut()[0] = from;
        let measured = pull_and_measure(chain, &self.heads);
        self.heads.clear();
        tally.moved += measured.changed;
        tally.max_slave_step_m = tally.max_slave_step_m.max(measured.longest_m);
        tally.max_speed_m_s = tally.max_speed_m_s.max(measured.longest_m / self.dt_s);
        tally.max_rod_violation_m = tally.max_rod_violation_m.max(measured.max_rod_violation_m);
    }
}
