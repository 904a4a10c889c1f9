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

/// Reports the airplanes of a group that are farther from where all see them, or from the orbit that those of `flown`
/// hold, than the bounds allow. Both are by id.
pub(super) fn report_beyond_bound(
    context: &mut PhaseContext<'_>,
    group: &[EntitySlot],
    flown: &[EntitySlot],
) {
    let PhaseContext { world, now, .. } = *context;
    if world.disturbance.heading_rad == 0.0 && !world.has_position_errors {
        return;
    }
    for &slot in group {
        let ratio = if flown.binary_search(&slot).is_ok() {
            error_ratio(context, slot)
        } else if world.is_non_cooperative(slot, now) && world.surveillance.is_none() {
            // Those that are seen by reports are reported with their tracks (`PerceivedTraffic::record`).
            position_error_ratio(context, slot)
        } else {
            0.0
        };
        if ratio > 1.0 {
            let event = Event::new(context.now, EventKind::BeyondBound, slot);
            context.scratch.events.push(event.with_value(ratio));
        }
    }
}

/// Returns the distance of an airplane from where all see it, as a multiple of its bound.
fn position_error_ratio(context: &PhaseContext<'_>, slot: EntitySlot) -> f64 {
    let PhaseContext { world, state, now, .. } = *context;
    let pose = state.airplanes[slot as usize].pose();
    let error_m = world.surface.distance_m(observed_pose(world, slot, now, pose).at, pose.at);
    ratio_to_bound(error_m, world.position_bound_m(slot as usize))
}

/// Returns an error as a multiple of its bound, which may be 0 where there is no error, either.
fn ratio_to_bound(error: f64, bound: f64) -> f64 {
    if error > 0.0 { error / bound } else { 0.0 }
}

/// Returns the largest error of an airplane that is flown, as a multiple of its bound.
fn error_ratio(context: &PhaseContext<'_>, slot: EntitySlot) -> f64 {
    let PhaseContext { world, state, .. } = *context;
    let pose = state.airplanes[slot as usize].pose();
    let v_m_s = world.top_m_s[slot as usize];
    let Pose2 { at, heading_rad } = state.orbit_pose(slot);
    let heading_error_rad = wrap_angle(pose.heading_rad - heading_rad).abs();
    let max_deviation_m = world.bounds.max_deviation_m(v_m_s, world.timing.dt_s);
    // The bounds on which the argument in `shield/errors.rs` rests.
    let place_ratio = ratio_to_bound(world.surface.distance_m(pose.at, at), max_deviation_m);
    let heading_ratio = ratio_to_bound(heading_error_rad, 2.0 * world.bounds.heading_rad);
    position_error_ratio(context, slot).max(place_ratio).max(heading_ratio)
}
