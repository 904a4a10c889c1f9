//! Airplanes with errors beyond the bounds for which the shield allows: they are named.
//!
//! The shield keeps on treating them like all others, but its promise about their pairs holds again
//! only once their plans have been made within the bounds.

use crate::Turn;
use crate::events::{Event, EventKind};
use crate::flight::{Pose, distance_m};
use crate::perceive::seen;
use sidestep_kernel::Slot;
use sidestep_kernel::math::wrap_angle;

/// Names the airplanes of `flown` that are farther from where all see them, or from the orbit that
/// they hold, than the bounds allow.
pub(super) fn name(turn: &mut Turn<'_>, flown: &[Slot]) {
    let world = turn.world;
    if world.disturbance == Default::default() {
        return;
    }
    for &slot in flown {
        let beyond = beyond(turn, slot);
        if beyond > 1.0 {
            let event = Event::of(turn.now, EventKind::BeyondBound, slot);
            turn.scratch.events.push(event.with(beyond));
        }
    }
}

/// Returns the largest error of an airplane, as a multiple of its bound.
fn beyond(turn: &Turn<'_>, slot: Slot) -> f64 {
    let Turn { world, state, now, .. } = *turn;
    let pose = state.airplanes[slot as usize].pose();
    let v_m_s = world.top_m_s[slot as usize];
    let Pose { at, heading_rad } = state.held(slot);
    let off_rad = wrap_angle(pose.heading_rad - heading_rad).abs();
    let strays_m = world.bounds.strays_m(v_m_s, world.timing.dt_s);
    let parts = [
        (distance_m(seen(world, slot, now, pose).at, pose.at), world.bounds.position_m),
        (distance_m(pose.at, at), strays_m),
        (off_rad, 2.0 * world.bounds.heading_rad),
    ];
    let of_bound = |(error, bound): (f64, f64)| if error > 0.0 { error / bound } else { 0.0 };
    parts.map(of_bound).into_iter().fold(0.0, f64::max)
}
