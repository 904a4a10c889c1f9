//! The memory that optimizing a group takes, computed in advance.

use crate::flight::{KnownAircraft, Point};
use crate::settings::Deployment;
use crate::world::AirspaceWorld;
use sidestep_collectives::{Estimator, PairwiseGame};
use sidestep_kernel::interrupt;

/// Returns the largest number of bytes that optimizing a group takes: tables of its pairs, and
/// predictions, in all the copies that its deployment has of them.
pub(crate) fn max_group_memory_bytes(world: &AirspaceWorld, group: &[KnownAircraft]) -> u64 {
    let tables = table_bytes(world, group);
    let predictions = predictions_memory_bytes(world, group);
    let members = group.len() as u64;
    match (world.deployment, world.settings.estimator) {
        (Deployment::Direct | Deployment::Pim | Deployment::HierarchicalPim, _) => {
            tables + predictions
        }
        // Each agent decides for all.
        (Deployment::ReplicaTeam, _) => members * (tables + predictions),
        // Each agent has the tables of its own pairs, and the predictions of all.
        (Deployment::Team | Deployment::CompactTeam, Estimator::Exact) => {
            2 * tables + members * predictions
        }
        // Each agent computes the costs of all samples to all members.
        (Deployment::CompactTeam, Estimator::Sampled { .. }) => members * (tables + predictions),
        // Each has the sampled predictions of all others, of this round and the one before.
        (Deployment::Team, Estimator::Sampled { block, .. }) => {
            let one = world.timing.horizon as u64 * size_of::<Point>() as u64;
            predictions + 2 * members * members.saturating_sub(1) * block as u64 * one
        }
    }
}

/// Returns the bytes of one copy of the predictions of all actions of a group.
fn predictions_memory_bytes(world: &AirspaceWorld, group: &[KnownAircraft]) -> u64 {
    let count: u64 = group.iter().map(|known| world.actions(known.slot).len() as u64).sum();
    count * world.timing.horizon as u64 * size_of::<Point>() as u64
}

/// Returns the largest number of bytes that the tables of a group's pairs take.
fn table_bytes(world: &AirspaceWorld, group: &[KnownAircraft]) -> u64 {
    let actions = |known: &KnownAircraft| world.actions(known.slot).len() as u64;
    let range_m = |a: &KnownAircraft, b: &KnownAircraft| {
        world.interaction_range_m(a.slot as usize, b.slot as usize)
    };
    let max_range_m = group.iter().map(|known| range_m(known, known)).fold(0.0, f64::max);
    // Sorted along one direction, so that only neighbors in that order have to be compared.
    let sweep_m = |known: &KnownAircraft| world.surface.sweep_m(known.pose.at);
    let mut by_x: Vec<(f64, &KnownAircraft)> =
        group.iter().map(|known| (sweep_m(known), known)).collect();
    by_x.sort_unstable_by(|(a_m, _), (b_m, _)| a_m.total_cmp(b_m));
    let mut entries = 0;
    for (k, (a_m, a)) in by_x.iter().enumerate() {
        let next = by_x[k + 1..].iter().take_while(|(b_m, _)| b_m - a_m <= max_range_m);
        for (_, b) in next {
            interrupt::check();
            if (a.altitude_m - b.altitude_m).abs() < world.vertical_m
                && world.surface.is_within(a.pose.at, b.pose.at, range_m(a, b))
            {
                entries += actions(a) * actions(b);
            }
        }
    }
    entries * PairwiseGame::BYTES_PER_ENTRY
}
