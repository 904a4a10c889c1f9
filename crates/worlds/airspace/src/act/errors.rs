//! Airplanes with errors beyond the bounds for which the shield allows: they are reported.
//!
//! The shield keeps on treating them like all others, but its guarantee for their pairs holds again
//! only once their plans have been made within the bounds.

use crate::events::{Event, EventKind};
use crate::flight::Pose2;
use crate::perceive::observed_pose;
use crate::scratch::PhaseContext;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::math::wrap_angle;

/// Reports the airplanes of `flown` that are farther from where all see them, or from the orbit that
/// they hold, than the bounds allow.
pub(super) fn report_beyond_bound(context: &mut PhaseContext<'_>, flown: &[EntitySlot]) {
    let world = context.world;
    if world.disturbance.heading_rad == 0.0 && !world.has_position_errors {
        return;
    }
    for &slot in flown {
        let ratio = error_ratio(context, slot);
        if ratio > 1.0 {
            let event = Event::new(context.now, EventKind::BeyondBound, slot);
            context.scratch.events.push(event.with_value(ratio));
        }
    }
}

/// Returns the largest error of an airplane, as a multiple of its bound.
fn error_ratio(context: &PhaseContext<'_>, slot: EntitySlot) -> f64 {
    let PhaseContext { world, state, now, .. } = *context;
    let pose = state.airplanes[slot as usize].pose();
    let v_m_s = world.top_m_s[slot as usize];
    let Pose2 { at, heading_rad } = state.orbit_pose(slot);
    let heading_error_rad = wrap_angle(pose.heading_rad - heading_rad).abs();
    let max_deviation_m = world.bounds.max_deviation_m(v_m_s, world.timing.dt_s);
    // The bounds on which the argument in `shield/errors.rs` rests.
    let errors_and_bounds = [
        (
            world.surface.distance_m(observed_pose(world, slot, now, pose).at, pose.at),
            world.position_bound_m(slot as usize),
        ),
        (world.surface.distance_m(pose.at, at), max_deviation_m),
        (heading_error_rad, 2.0 * world.bounds.heading_rad),
    ];
    // A bound may be 0 where there is no error, either.
    errors_and_bounds
        .map(|(error, bound)| if error > 0.0 { error / bound } else { 0.0 })
        .into_iter()
        .fold(0.0, f64::max)
}
