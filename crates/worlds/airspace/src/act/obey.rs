//! The controls of a group, booked and carried out.

use super::protect::{name_intruders, note};
use crate::Turn;
use crate::agents::traffic::Traffic;
use crate::decide::Optimization;
use crate::events::{Event, EventKind};
use crate::intruder::Intruder;
use crate::pilot::{Control, Course, Optimized, Own};
use crate::shield::Way;
use sidestep_kernel::EntityId;

/// Books the controls of the airplanes of a group that the method flies, and returns the ways that they
/// fly. One without a control stays on its stored orbit.
pub(super) fn obey(
    turn: &mut Turn<'_>,
    own: &[Own],
    intruders: &[Intruder],
    mut controls: Vec<Option<Control>>,
) -> Vec<Way> {
    let Turn { world, state, .. } = *turn;
    book(turn, own, &controls);
    if world.shield && world.network.is_none() && controls.iter().any(Option::is_none) {
        // Plans that are sure are safe only if all fly them, and orbits always are.
        controls.iter_mut().flatten().for_each(|control| control.course = Course::Orbit);
    }
    state.drop_wishes(&own.iter().map(|own| own.id).collect::<Vec<_>>());
    let mut ways = Vec::with_capacity(own.len());
    for (own, control) in own.iter().zip(controls) {
        let course = match control {
            Some(Control { course, memory, .. }) => {
                state.put_memory(own.id, memory);
                course
            }
            None => Course::Orbit,
        };
        note(turn, own.id, &course);
        let way = match course {
            Course::Way { way, .. } => way,
            Course::Orbit => own.on_orbit(world),
        };
        if world.shield {
            name_intruders(turn, own, intruders, &way);
        }
        ways.push(way);
    }
    ways
}

/// Books the outcome of the talks of a group, and missing controls.
fn book(turn: &mut Turn<'_>, own: &[Own], controls: &[Option<Control>]) {
    let (now, scratch) = (turn.now, &mut *turn.scratch);
    for (own, control) in own.iter().zip(controls) {
        match control {
            Some(control) => scratch.events.extend_from_slice(&control.events),
            None => scratch.events.push(Event::of(now, EventKind::Absent, own.id)),
        }
    }
    let all = || controls.iter().flatten();
    let sum = |of: fn(&Control) -> Traffic| {
        all().map(of).fold(Traffic::default(), |mut sum, traffic| {
            sum.add_beside(traffic);
            sum
        })
    };
    let (deciding, shielding) = (sum(|control| control.deciding), sum(|control| control.shielding));
    scratch.grouped.add(sum(|control| control.grouping));
    scratch.exchanged.add(shielding);
    let optimized: Vec<Optimized> = all().filter_map(|control| control.optimized).collect();
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
