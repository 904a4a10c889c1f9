//! Measures of a chain at the end of each of its cycles.

use super::joint_motion::arm_clearance;
use super::{ChainContext, ChainCycleState};
use crate::clearance::min_clearance;
use crate::events::EventKind;
use crate::metrics::PENETRATION_THRESHOLD_M;
use sidestep_kernel::Cycle;
use sidestep_rods::geometry::distance;
use sidestep_rods::{RodBvh, nearest_own_parts};

/// Number of rods up to which a chain's gap to itself is measured in each cycle: the measurement takes time that
/// grows faster than the chain.
const MAX_MEASURED_RODS: usize = 32;
/// Number of cycles between two measurements of longer chains, a third of a second of the usual cycles, for each
/// thousand of their rods: so a measurement takes the same share of the time of a cycle however long the chain is.
const MEASURE_INTERVAL_CYCLES: u64 = 16;
/// The rods for which that is the interval.
const RODS_PER_INTERVAL: usize = 1024;

/// Returns whether the gap of a chain to itself is measured in a cycle. Parts that cross stay crossed for many cycles, so
/// rare measurements of a long chain find them, too.
pub(super) fn is_own_gap_due(now: Cycle, rods: usize) -> bool {
    let interval = MEASURE_INTERVAL_CYCLES * rods.div_ceil(RODS_PER_INTERVAL) as u64;
    rods <= MAX_MEASURED_RODS || now.is_multiple_of(interval)
}

/// Measures a chain after its cycle; `robots_gap_m` is the least gap around its robots.
pub(super) fn measure_chain<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    own: &mut RodBvh<D>,
    robots_gap_m: f64,
) {
    let ChainContext { world, now, obstacles, .. } = context;
    let look_m = world.look_m;
    let arm = arm_clearance(context, acting.body);
    let chain = &acting.body.chain;
    let tally = &mut acting.body.tally;
    tally.steps += 1;
    let moves = acting.actual.points.iter().zip(chain.points());
    let longest_m = moves.map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max);
    tally.max_speed_m_s = tally.max_speed_m_s.max(longest_m / world.dt_s);
    // In a broken chain only the parts count, because its rods hold nothing.
    let is_whole = acting.body.scattered.is_none();
    if is_whole {
        tally.max_rod_violation_m = tally.max_rod_violation_m.max(chain.max_rod_violation_m());
    }
    let mut own_part = None;
    let is_due = is_own_gap_due(now, chain.rods().len());
    if is_whole && is_due && world.rules.self_collision {
        match &arm {
            Some(arm) => tally.add_own_gap(arm.own_m),
            None => {
                let nearest = nearest_own_parts(chain, own, tally.own_gap_to_find_m(look_m));
                own_part = nearest.map(|nearest| nearest.parts[0].connector());
                tally.add_own_gap(nearest.map_or(f64::INFINITY, |nearest| nearest.gap_m));
            }
        }
    }
    let (least_m, part) = match &arm {
        Some(arm) => (arm.obstacles_m, arm.connector),
        None => min_clearance(chain, obstacles, look_m, is_whole),
    };
    if least_m < look_m {
        tally.min_clearance_m = tally.min_clearance_m.min(least_m);
    }
    let is_in_obstacle = least_m.min(robots_gap_m) < -PENETRATION_THRESHOLD_M;
    let own_depth_m = if is_whole { tally.own_depth_m } else { 0.0 };
    let is_inside = is_in_obstacle || own_depth_m > PENETRATION_THRESHOLD_M;
    if tally.record_inside(is_inside) {
        let kind = if is_inside { EventKind::Penetration } else { EventKind::Clear };
        // The part that is deepest: in another one of the chain, or in an obstacle.
        let part = own_part.filter(|_| own_depth_m > -least_m).unwrap_or(part);
        acting.sink.record(chain, kind, part, own_depth_m.max(-least_m).max(0.0));
    }
}
