//! Measures of a chain at the end of each of its cycles.

use super::Acting;
use crate::clearance::{least_clearance, own_gap_m};
use crate::events::EventKind;
use crate::metrics::PENETRATION_M;
use crate::rods::geometry::distance;

/// Most rods of a chain whose own parts are measured in each cycle.
const MOST_LOOKED_AT: usize = 32;
/// Number of cycles between two measurements of longer ones.
const LOOKS_EVERY: u64 = 16;

impl<const D: usize> Acting<'_, D> {
    /// Measures the chain after its cycle.
    pub(super) fn measure(&mut self) {
        let (look_m, dt_s) = (self.world.look_m, self.world.dt_s);
        let (chain, tally) = (&self.body.chain, &mut self.body.tally);
        tally.steps += 1;
        let ways = self.scratch.before.iter().zip(chain.points());
        let longest_m = ways.map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max);
        tally.max_speed_m_s = tally.max_speed_m_s.max(longest_m / dt_s);
        // In a broken chain only the parts count, because its rods hold nothing.
        let is_whole = self.body.scattered.is_none();
        if is_whole {
            tally.max_rod_violation_m = tally.max_rod_violation_m.max(chain.max_rod_violation_m());
        }
        // Parts that cross stay so for long, so a long chain need not look every time.
        let looks = chain.rods().len() <= MOST_LOOKED_AT || self.now.is_multiple_of(LOOKS_EVERY);
        if is_whole && looks && self.world.rules.self_collision {
            let within_m = tally.min_own_gap_m.min(look_m);
            let gap_m = own_gap_m(chain, &mut self.scratch.own, within_m);
            tally.min_own_gap_m = if gap_m < within_m { gap_m } else { tally.min_own_gap_m };
        }
        let (least_m, part) = least_clearance(chain, &self.scratch.obstacles, look_m, is_whole);
        if least_m < look_m {
            tally.min_clearance_m = tally.min_clearance_m.min(least_m);
        }
        let is_inside = least_m.min(self.scratch.robots_gap_m) < -PENETRATION_M;
        if tally.note_inside(is_inside) {
            let kind = if is_inside { EventKind::Penetration } else { EventKind::Clear };
            self.tell(kind, part, (-least_m).max(0.0));
        }
    }
}
