//! Motions of a chain in its own way in which no part comes near another.

use super::{Heads, Propagator, Tally};
use crate::rods::chain::Chain;
use crate::rods::geometry::distance;
use crate::rods::leeway::Leeway;
use crate::rods::open::{self, Stays};
use std::ops::Range;

impl<const D: usize> Propagator<D> {
    /// Makes a motion in which no part comes near another, if it is one; then nothing can object,
    /// and the chain moves as if it were not in its own way.
    pub(super) fn pull_apart(
        &mut self,
        chain: &mut Chain<D>,
        heads: &Heads<D>,
        goes_on: bool,
    ) -> bool {
        if !Leeway::is_for(chain) {
            return false;
        }
        self.leeway.note(chain);
        let mut tally = Tally::start(heads.first);
        let head_m = distance(chain.points()[heads.first], heads.to[0]);
        open::pull(chain, heads.first, heads.to[0], Stays::Nearly, &mut tally);
        let way_m = head_m.max(tally.max_slave_step_m);
        let may = tally.max_slave_step_m <= self.rules.slave_step_max_m
            && self.leeway.allows(chain, way_m);
        if may {
            if goes_on {
                self.remember(heads.first, tally.from..tally.to);
            }
            self.tally.add(&tally);
        } else {
            let run = tally.from..tally.to;
            chain.points_mut()[run.clone()].copy_from_slice(&self.leeway.noted()[run]);
        }
        self.leeway.ended(chain, way_m, !may);
        may
    }

    /// Keeps the positions before a motion that the request may have to take back.
    fn remember(&mut self, head: usize, run: Range<usize>) {
        for i in (head..run.end).chain((run.start..head).rev()) {
            if self.before.get(i).is_none() {
                self.before.set(i, self.leeway.noted()[i]);
            }
        }
    }
}
