//! Airplanes with errors beyond the bounds for which the shield allows: they are named.
//!
//! The shield keeps on treating them like all others, but its promise about their pairs holds again
//! only once their plans have been made within the bounds.

use crate::events::{Event, EventKind};
use crate::flight::{Pose2, distance_m};
use crate::perceive::observed_pose;
use crate::scratch::PhaseContext;
use sidestep_kernel::Slot;
use sidestep_kernel::math::wrap_angle;

/// Names the airplanes of `flown` that are farther from where all see them, or from the orbit that
/// they hold, than the bounds allow.
pub(super) fn report_beyond_bound(turn: &mut PhaseContext<'_>, flown: &[Slot]) {
    let world = turn.world;
    if world.disturbance == Default::default() {
        return;
    }
    for &slot in flown {
        let beyond = error_ratio(turn, slot);
        if beyond > 1.0 {
            let event = Event::new(turn.now, EventKind::BeyondBound, slot);
            turn.scratch.events.push(event.with_value(beyond));
        }
    }
}

/// Returns the largest error of an airplane, as a multiple of its bound.
fn error_ratio(turn: &PhaseContext<'_>, slot: Slot) -> f64 {
    let PhaseContext { world, state, now, .. } = *turn;
    let pose = state.airplanes[slot as usize].pose();
    let v_m_s = world.top_m_s[slot as usize];
    let Pose2 { at, heading_rad } = state.orbit_pose(slot);
    let off_rad = wrap_angle(pose.heading_rad - heading_rad).abs();
    let strays_m = world.bounds.max_deviation_m(v_m_s, world.timing.dt_s);
    let parts = [
        (distance_m(observed_pose(world, slot, now, pose).at, pose.at), world.bounds.position_m),
        (distance_m(pose.at, at), strays_m),
        (off_rad, 2.0 * world.bounds.heading_rad),
    ];
    let of_bound = |(error, bound): (f64, f64)| if error > 0.0 { error / bound } else { 0.0 };
    parts.map(of_bound).into_iter().fold(0.0, f64::max)
}
