//! Holds: the shield keeps airplanes on their fallbacks, or off the levels to which they change. Also holds that are
//! dangerous themselves, and flights that last longer than the fuel.

use crate::events::{Event, EventKind};
use crate::scratch::PhaseContext;
use crate::state::HoldState;
use sidestep_kernel::EntitySlot;

/// Reports what is new of the holds of this `dt`, once the maneuvers of a group are stored. `flown` are the group's
/// airplanes that the method flies, by id.
pub(super) fn report_holds(context: &mut PhaseContext<'_>, flown: &[EntitySlot]) {
    for &slot in flown {
        report_hold(context, slot);
        report_endurance(context, slot);
    }
}

fn report_hold(context: &mut PhaseContext<'_>, slot: EntitySlot) {
    let PhaseContext { world, state, now, .. } = *context;
    let Some(before) = state.hold(slot) else { return };
    let current = &state.airplanes[slot as usize];
    let altitude_m = current.altitude_m.get();
    let is_level_off = is_held_short(context, slot);
    let is_held = is_level_off || current.orbiting.get() > 0;
    let is_low = is_held && world.safe_altitude_m.is_some_and(|safe_m| altitude_m < safe_m);
    // One that goes on is told once.
    let begins = [
        (EventKind::LevelOff, is_level_off && !before.is_level_off),
        (EventKind::LowHold, is_low && !before.is_low),
    ];
    for (kind, _) in begins.into_iter().filter(|(_, begins)| *begins) {
        context.scratch.events.push(Event::new(now, kind, slot).with_value(altitude_m));
    }
    let level_offs = before.level_offs + u32::from(is_level_off);
    state.set_hold(slot, HoldState { level_offs, is_level_off, is_low });
}

/// Returns whether the shield lets an airplane change its level in this `dt` less far than it could.
fn is_held_short(context: &PhaseContext<'_>, slot: EntitySlot) -> bool {
    let PhaseContext { world, state, .. } = *context;
    let segment = state.segment(world, slot);
    let altitude_m = state.airplanes[slot as usize].altitude_m.get();
    let is_changing = segment.vertical_m_s(altitude_m) > 0.0 && altitude_m != segment.altitude_m;
    is_changing && state.cleared_segment(world, slot).altitude_m != segment.altitude_m
}

/// Reports an airplane in the `dt` in which it is in the air for longer than its endurance.
fn report_endurance(context: &mut PhaseContext<'_>, slot: EntitySlot) {
    let &mut PhaseContext { world, now, ref mut scratch, .. } = context;
    let endurance_s = world.airplanes[slot as usize].performance.endurance_s;
    let joined_s = world.cycle_start_s(world.first_controlled_cycle(slot as usize));
    let flown_s = world.cycle_start_s(now) - joined_s;
    let ends_s = flown_s + world.timing.dt_s;
    if flown_s <= endurance_s && endurance_s < ends_s {
        let event = Event::new(now, EventKind::EnduranceExceedance, slot);
        scratch.events.push(event.with_value(endurance_s));
    }
}

#[cfg(test)]
mod tests {
    use crate::shield::guarantee_tests::{plane, run};
    use sidestep_kernel::Simulation;

    /// One climbs straight below another, which leaves after 200 s.
    fn climb_below_another() -> String {
        let climbs = "orders = [{ at_s = 10.0, altitude_m = 1500.0, climb_m_s = 10.0 }]";
        let leaves = "altitude_m = 1000.0\norders = [{ at_s = 200.0, leaves = true }]";
        plane([0.0, 0.0], 90.0, [0.0, 90_000.0], climbs)
            + &plane([0.0, 0.0], 90.0, [0.0, 90_000.0], leaves)
    }

    #[test]
    fn a_level_off_is_no_delayed_order_and_is_told_once() {
        let mut run = run("method = \"none\"\nsafe_altitude_m = 600.0", &climb_below_another());
        run.advance(38);
        let metrics = run.metrics();
        assert!(metrics.shield_level_offs > 10, "{metrics:?}");
        assert_eq!((metrics.orders_delayed, metrics.low_holds), (0, Some(0)));
        let counters = &run.collector().counters;
        assert_eq!(counters.events.get(&super::EventKind::LevelOff), Some(&1));
    }

    #[test]
    fn a_hold_below_the_safe_altitude_is_told_once_for_each_hold() {
        let keys = "method = \"none\"\nsafe_altitude_m = 900.0";
        let mut held = run(keys, &climb_below_another());
        held.advance(60);
        assert_eq!(held.metrics().low_holds, Some(1));
        let unshielded = format!("{keys}\nshield = \"off\"");
        let mut free = run(&unshielded, &climb_below_another());
        free.advance(60);
        assert_eq!(free.metrics().low_holds, Some(0));
        let mut unknown = run("method = \"none\"", &climb_below_another());
        unknown.advance(60);
        assert_eq!(unknown.metrics().low_holds, None);
    }

    #[test]
    fn holds_are_part_of_a_checkpoint() {
        let keys = "method = \"none\"\nsafe_altitude_m = 900.0";
        let mut whole = run(keys, &climb_below_another());
        let mut first = run(keys, &climb_below_another());
        let mut second = run(keys, &climb_below_another());
        whole.advance(60);
        first.advance(30);
        second.restore(&first.checkpoint()).expect("its own checkpoint");
        second.advance(30);
        let counts = |run: &crate::AirspaceRun| {
            let metrics = run.metrics();
            (metrics.shield_level_offs, metrics.low_holds, metrics.orders_delayed)
        };
        assert_eq!(counts(&second), counts(&whole));
        assert_eq!(second.digest(), whole.digest());
    }

    #[test]
    fn a_flight_longer_than_its_endurance_is_told_once() {
        let flight = |endurance_s: f64| {
            let more = format!("endurance_s = {endurance_s:?}");
            let mut run = run("", &plane([0.0, 0.0], 0.0, [7000.0, 0.0], &more));
            run.advance(60);
            run.metrics().endurance_exceedances
        };
        // It flies for 197 s.
        assert_eq!([100.0, 152.5, 300.0].map(flight), [Some(1), Some(1), Some(0)]);
        let mut unlimited = run("", &plane([0.0, 0.0], 0.0, [7000.0, 0.0], ""));
        unlimited.advance(10);
        assert_eq!(unlimited.metrics().endurance_exceedances, None);
    }
}
