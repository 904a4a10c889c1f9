//! The memory that optimizing a group takes, computed in advance.

use super::deploy::Deployment;
use super::flight::{KnownAircraft, Point, distance_m};
use super::join::groups;
use super::perceive::known_aircraft;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use super::{PhaseContext, Scratch};
use sidestep_collectives::{Estimator, PairwiseGame};
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::{Slot, interrupt};

/// Returns the largest number of bytes that optimizing a group takes: tables of its pairs, and
/// predictions, in all the copies that its deployment has of them.
pub(super) fn max_group_bytes(world: &AirspaceWorld, group: &[KnownAircraft]) -> u64 {
    let (tables, predictions) = (table_bytes(world, group), prediction_bytes(world, group));
    let members = group.len() as u64;
    match (world.deployment, world.settings.estimator) {
        (Deployment::Direct | Deployment::Pim | Deployment::HierarchicalPim, _) => {
            tables + predictions
        }
        // Each agent has the tables of its own pairs, and the predictions of all.
        (Deployment::Team | Deployment::CompactTeam, Estimator::Exact) => {
            2 * tables + members * predictions
        }
        // Each agent computes the costs of all samples to all members.
        (Deployment::CompactTeam, Estimator::Sampled { .. }) => members * (tables + predictions),
        // Each has the sampled ways of all others, of this round and the one before.
        (Deployment::Team, Estimator::Sampled { block, .. }) => {
            let way = world.timing.horizon as u64 * size_of::<Point>() as u64;
            predictions + 2 * members * members.saturating_sub(1) * block as u64 * way
        }
    }
}

/// Returns the bytes of the predicted ways of all actions of a group.
fn prediction_bytes(world: &AirspaceWorld, group: &[KnownAircraft]) -> u64 {
    let ways: u64 = group.iter().map(|known| world.actions(known.slot).len() as u64).sum();
    ways * world.timing.horizon as u64 * size_of::<Point>() as u64
}

/// Returns the largest number of bytes that the tables of a group's pairs take.
fn table_bytes(world: &AirspaceWorld, group: &[KnownAircraft]) -> u64 {
    let actions = |known: &KnownAircraft| world.actions(known.slot).len() as u64;
    let look_m = |a: &KnownAircraft, b: &KnownAircraft| {
        world.interaction_range_m(a.slot as usize, b.slot as usize)
    };
    let widest_m = group.iter().map(|known| look_m(known, known)).fold(0.0, f64::max);
    // Sorted by x, so that only neighbors in that order have to be compared.
    let mut by_x: Vec<&KnownAircraft> = group.iter().collect();
    by_x.sort_unstable_by(|a, b| a.pose.at[0].total_cmp(&b.pose.at[0]));
    let mut entries = 0;
    for (k, a) in by_x.iter().enumerate() {
        let beside = by_x[k + 1..].iter().take_while(|b| b.pose.at[0] - a.pose.at[0] <= widest_m);
        let meets = |b: &&&KnownAircraft| {
            interrupt::check();
            (a.altitude_m - b.altitude_m).abs() < world.vertical_m
                && distance_m(a.pose.at, b.pose.at) <= look_m(a, b)
        };
        entries += beside.filter(meets).map(|b| actions(a) * actions(b)).sum::<u64>();
    }
    entries * PairwiseGame::BYTES_PER_ENTRY
}

/// Returns the size of the group that takes most memory at the start of a run, and its bytes.
pub(super) fn largest_start_group(world: &AirspaceWorld, state: &AirspaceState) -> (usize, u64) {
    let n = world.airplanes.len();
    let mut scratch = Scratch::default();
    let clock = &ManualClock::default();
    let turn = &mut PhaseContext { world, state, now: 0, clock, scratch: &mut scratch };
    let groups = groups(turn);
    let mut members = Vec::new();
    let leaders =
        (0..n as Slot).filter(|&slot| groups.is_leader(slot) && !groups.is_singleton(slot));
    let taken = leaders.map(|leader| {
        groups.members(leader, &mut members);
        let flown = members.iter().filter(|&&slot| !world.is_replayed(slot, 0));
        let known: Vec<KnownAircraft> =
            flown.map(|&slot| known_aircraft(world, state, 0, slot)).collect();
        (known.len(), max_group_bytes(world, &known))
    });
    taken.max_by_key(|(_, bytes)| *bytes).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::super::scenario::CompiledAirspace;
    use super::*;
    use sidestep_scenario::Source;

    /// Returns the bytes of four airplanes, all near each other, and the number of each one's
    /// actions.
    fn taken(deployment: &str, preset: &str) -> (u64, u64) {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\npreset = \"{preset}\"\nhorizon_s = 200.0\n\
             deployment = \"{deployment}\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 4\n"
        );
        let compiled = CompiledAirspace::new(&Source::new("m", text, "")).expect("a scenario");
        let state = AirspaceState::restore(&compiled.world, &compiled.start_snapshot());
        let (airplanes, bytes) = largest_start_group(&compiled.world, &state);
        assert_eq!(airplanes, 4);
        (bytes, compiled.world.actions(0).len() as u64)
    }

    #[test]
    fn every_deployment_is_estimated_by_the_copies_that_it_has() {
        let way = 200 * 16;
        for preset in ["default", "paper"] {
            let (once, actions) = taken("direct", preset);
            let (tables, ways) = (6 * actions * actions * 24, 4 * actions * way);
            assert_eq!(once, tables + ways, "{preset}");
            assert_eq!((taken("pim", preset).0, taken("hierarchical-pim", preset).0), (once, once));
            let (team, compact) = (taken("team", preset).0, taken("compact-team", preset).0);
            if preset == "default" {
                assert_eq!((team, compact), (2 * tables + 4 * ways, 2 * tables + 4 * ways));
            } else {
                assert_eq!((team, compact), (ways + 2 * 12 * 20 * way, 4 * once));
            }
        }
    }
}
