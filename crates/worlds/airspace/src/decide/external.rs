//! Wishes that a caller has ordered.

use super::Considered;
use super::velocity::{beside, step};
use super::wishes::straight;
use crate::flight::Known;
use crate::shield::Way;
use crate::wish::Wish;
use crate::world::AirspaceWorld;
use sidestep_kernel::math;

/// Returns the ways that an airplane considers: the ordered one, and then the others by rank, or by how little they
/// differ from it. Without an order it follows its flight plan.
pub(super) fn as_ordered(world: &AirspaceWorld, known: Known, wish: Option<&Wish>) -> Considered {
    match wish {
        Some(&Wish::TurnRate(omega_rad_s)) => {
            let omegas_rad_s = vec![omega_rad_s; world.timing.points_per_dt()];
            Considered::of_ways(beside(world, known, Way { omegas_rad_s }))
        }
        Some(&Wish::Velocity([vx, vy])) => {
            let way = toward(world, known, math::atan2(vy, vx));
            Considered::of_ways(beside(world, known, way))
        }
        Some(Wish::Ranking(order)) => {
            let actions = world.actions_of(known.slot);
            let ranked = order.iter().map(|&k| actions[usize::from(k)]).collect();
            Considered::of(world, known, ranked)
        }
        None => Considered::of(world, known, straight(world, known)),
    }
}

/// Returns the way of one `dt` on which an airplane turns to a heading as fast as it can.
fn toward(world: &AirspaceWorld, mut known: Known, heading_rad: f64) -> Way {
    let turn = |_| step(world, &mut known, Some(heading_rad));
    Way { omegas_rad_s: (0..world.timing.points_per_dt()).map(turn).collect() }
}
