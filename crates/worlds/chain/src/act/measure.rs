//! Measures of a chain at the end of each of its cycles.

use super::Acting;
use crate::events::EventKind;
use crate::metrics::PENETRATION_M;
use crate::rods::chain::Chain;
use crate::rods::geometry::{Bounds, distance};
use crate::rods::obstacle::Obstacles;

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
        let (least_m, part) = least_clearance(chain, &self.scratch.obstacles, look_m, is_whole);
        if least_m < look_m {
            tally.min_clearance_m = tally.min_clearance_m.min(least_m);
        }
        let is_inside = least_m.min(self.scratch.robots_gap_m) < -PENETRATION_M;
        tally.penetrations += u64::from(is_inside);
        let was_inside = std::mem::replace(&mut tally.is_inside, is_inside);
        if is_inside != was_inside {
            let kind = if is_inside { EventKind::Penetration } else { EventKind::Clear };
            self.tell(kind, part, (-least_m).max(0.0));
        }
    }
}

/// Returns the least distance of any connector, and of any rod if rods count, from obstacles, up to
/// `look_m`, and the connector at or before that part.
fn least_clearance<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    look_m: f64,
    with_rods: bool,
) -> (f64, usize) {
    if obstacles.is_empty() {
        return (look_m, 0);
    }
    let points = chain.points();
    let mut least = (look_m, 0);
    let mut tell = |apart_m: f64, part: usize| {
        if apart_m < least.0 {
            least = (apart_m, part);
        }
    };
    // One query serves a rod and its ends, because obstacles near one of them are mostly near all.
    for k in 0..points.len() {
        let end = if with_rods { (k + 1).min(points.len() - 1) } else { k };
        let radii_m = [k, end].map(|i| chain.connectors()[i].radius_m);
        let rod_m = chain.rods().get(k).map_or(0.0, |rod| rod.radius_m);
        let near = Bounds::of(&[points[k], points[end]]).grown(radii_m[0].max(radii_m[1]) + look_m);
        obstacles.visit(&near, |o| {
            let ball_m = o.core.nearest_to_point(points[k]).distance_m - radii_m[0];
            let rod_m = o.core.nearest_to_segment([points[k], points[end]]).distance_m - rod_m;
            tell(ball_m.min(rod_m) - o.radius_m, k);
        });
    }
    least
}
