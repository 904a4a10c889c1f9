//! The memory that the groups at the start of a run take.

use crate::decide::max_group_bytes;
use crate::flight::KnownAircraft;
use crate::join::groups;
use crate::perceive::known_aircraft;
use crate::scratch::{PhaseContext, Scratch};
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::Slot;
use sidestep_kernel::ports::ManualClock;

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
    use super::*;
    use crate::scenario::CompiledAirspace;
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
