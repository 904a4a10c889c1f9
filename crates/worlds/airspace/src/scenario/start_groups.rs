//! The memory that the groups at the start of a run need.

use crate::decide::max_group_memory_bytes;
use crate::flight::KnownAircraft;
use crate::join::form_groups;
use crate::perceive::known_aircraft;
use crate::scratch::{PhaseContext, Scratch};
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::ports::ManualClock;

/// Returns the size of the group that needs most memory at the start of a run, and its bytes.
pub(super) fn largest_start_group(world: &AirspaceWorld, state: &AirspaceState) -> (usize, u64) {
    let n = world.airplanes.len();
    let mut scratch = Scratch::default();
    let clock = &ManualClock::default();
    let context = &mut PhaseContext { world, state, now: 0, clock, scratch: &mut scratch };
    let groups = form_groups(context);
    let mut members = Vec::new();
    let leaders =
        (0..n as EntitySlot).filter(|&slot| groups.is_leader(slot) && !groups.is_singleton(slot));
    leaders
        .map(|leader| {
            groups.members(leader, &mut members);
            let known: Vec<KnownAircraft> = members
                .iter()
                .filter(|&&slot| !world.is_replayed(slot, 0))
                .map(|&slot| known_aircraft(world, state, 0, slot))
                .collect();
            (known.len(), max_group_memory_bytes(world, &known))
        })
        .max_by_key(|(_, bytes)| *bytes)
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::CompiledAirspace;
    use sidestep_scenario::Source;

    /// Returns the bytes of four airplanes, all near each other, and the number of each one's
    /// actions.
    fn start_group_bytes(deployment: &str, preset: &str) -> (u64, u64) {
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
        // 200 points of two coordinates.
        let profile = 200 * 16;
        for preset in ["default", "paper"] {
            let (direct, actions) = start_group_bytes("direct", preset);
            let tables = 6 * actions * actions * 24;
            let profiles = 4 * actions * profile;
            assert_eq!(direct, tables + profiles, "{preset}");
            assert_eq!(start_group_bytes("pim", preset).0, direct);
            assert_eq!(start_group_bytes("hierarchical-pim", preset).0, direct);
            let (team, _) = start_group_bytes("team", preset);
            let (compact_team, _) = start_group_bytes("compact-team", preset);
            if preset == "default" {
                assert_eq!(team, 2 * tables + 4 * profiles);
                assert_eq!(compact_team, 2 * tables + 4 * profiles);
            } else {
                assert_eq!(team, profiles + 2 * 12 * 20 * profile);
                assert_eq!(compact_team, 4 * direct);
            }
        }
    }
}
