//! The controls of a group, booked and carried out.

use super::protect::{exempt_non_cooperative, store_maneuver};
use crate::agents::network_traffic::NetworkTraffic;
use crate::decide::Optimization;
use crate::events::{Event, EventKind};
use crate::non_cooperative::NonCooperative;
use crate::pilot::{Control, Maneuver, OptimizerStats, OwnshipState};
use crate::scratch::PhaseContext;
use crate::shield::TurnProfile;
use sidestep_kernel::EntityId;

/// Books the controls of the airplanes of a group that the method flies, and returns the ways that they
/// fly. One without a control stays on its stored orbit.
pub(super) fn apply_controls(
    turn: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    intruders: &[NonCooperative],
    mut controls: Vec<Option<Control>>,
) -> Vec<TurnProfile> {
    let PhaseContext { world, state, .. } = *turn;
    record_outcomes(turn, own, &controls);
    if world.shield && world.network.is_none() && controls.iter().any(Option::is_none) {
        // Plans that are sure are safe only if all fly them, and orbits always are.
        controls.iter_mut().flatten().for_each(|control| control.course = Maneuver::Orbit);
    }
    state.drop_external_actions(&own.iter().map(|own| own.id).collect::<Vec<_>>());
    let mut ways = Vec::with_capacity(own.len());
    for (own, control) in own.iter().zip(controls) {
        let course = match control {
            Some(Control { course, memory, .. }) => {
                state.put_memory(own.id, memory);
                course
            }
            None => Maneuver::Orbit,
        };
        store_maneuver(turn, own.id, &course);
        let way = match course {
            Maneuver::Way { way, .. } => way,
            Maneuver::Orbit => own.orbit_profile(world),
        };
        if world.shield {
            exempt_non_cooperative(turn, own, intruders, &way);
        }
        ways.push(way);
    }
    ways
}

/// Books the outcome of the talks of a group, and missing controls.
fn record_outcomes(
    turn: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    controls: &[Option<Control>],
) {
    let (now, scratch) = (turn.now, &mut *turn.scratch);
    for (own, control) in own.iter().zip(controls) {
        match control {
            Some(control) => scratch.events.extend_from_slice(&control.events),
            None => scratch.events.push(Event::new(now, EventKind::Absent, own.id)),
        }
    }
    let all = || controls.iter().flatten();
    let sum = |of: fn(&Control) -> NetworkTraffic| {
        all().map(of).fold(NetworkTraffic::default(), |mut sum, traffic| {
            sum.merge_participant(traffic);
            sum
        })
    };
    let (deciding, shielding) = (sum(|control| control.deciding), sum(|control| control.shielding));
    scratch.grouped.add(sum(|control| control.grouping));
    scratch.exchanged.add(shielding);
    let optimized: Vec<OptimizerStats> = all().filter_map(|control| control.optimized).collect();
    if optimized.is_empty() {
        return scratch.exchanged.add(deciding);
    }
    let ids = own.iter().map(|own| own.id);
    scratch.optimizations.push(Optimization {
        cycle: now,
        airplane: ids.min().unwrap_or(EntityId::MAX),
        airplanes: own.len() as u32,
        rounds: optimized.iter().find(|one| one.is_decided).map_or(0, |one| one.rounds),
        converged: optimized.iter().any(|one| one.is_decided)
            && optimized.iter().all(|one| one.converged || !one.is_decided),
        traffic: deciding,
    });
}
