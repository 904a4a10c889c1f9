//! Modified voltage potential, as BlueSky flies it with resolutions by heading only (its version
//! 1.1.1: `STATEBASED`, `MVP`, `RMETHH HDG`).
//!
//! A conflict is found from the present velocities, also between two that have already come too near
//! and fly apart. Each airplane then changes its present velocity so that the closest point moves out
//! of the other's zone. It keeps to this, also after the conflict is no longer predicted, until the
//! two are past their closest point and apart; then it flies to its way-point again.
//!
//! Its authors fly it alone. Beside the shield an airplane may fly something else than it wished, and a conflict of that
//! velocity, or a heading to keep from it, would lead it ever farther astray. So after an override it forgets what it resolves,
//! and looks for conflicts as if it flew to its way-point, until that way is free.

use super::{AircraftState, vector_length};
use crate::flight::Point;
use crate::settings::ReactiveSettings;
use serde::{Deserialize, Serialize};
use sidestep_kernel::geometry::{dot, sub};
use sidestep_kernel::{EntitySlot, math};

/// Closest approaches nearer than this have no direction of their own, so every airplane turns to the
/// left of the line of sight.
const MAX_HEAD_ON_M: f64 = 10.0;
/// Difference of headings in radians below which two airplanes near each other fly side by side: they
/// would soon be in conflict again. BlueSky's value.
const MAX_SIDE_BY_SIDE_RAD: f64 = 30.0 * std::f64::consts::PI / 180.0;
/// Squared speed in m²/s² below which two airplanes do not move against each other.
const MIN_SPEED_SQUARED: f64 = 1e-6;

/// The conflicts that an airplane resolves, from one step to the next.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ActiveResolutions {
    /// The others, by slot.
    with: Vec<EntitySlot>,
    /// The heading that resolves them, in radians.
    heading_rad: f64,
    /// Whether the shield has overridden its wish, and the way to its way-point was not free since.
    is_overridden: bool,
}

impl ActiveResolutions {
    /// Forgets the conflicts, because the airplane does not fly what would resolve them.
    pub(crate) fn record_override(&mut self) {
        self.with.clear();
        self.is_overridden = true;
    }

    /// The others, by rising slot.
    pub(crate) fn conflicting_aircraft(&self) -> &[EntitySlot] {
        &self.with
    }

    /// The heading that resolves the conflicts with them, in radians.
    pub(crate) fn heading_rad(&self) -> f64 {
        self.heading_rad
    }
}

/// A closest approach that two airplanes will have, or have had, if both fly straight on.
struct ClosestApproach {
    /// The other's position then, relative to the airplane.
    at: Point,
    /// Seconds from now.
    in_s: f64,
}

/// Returns the heading of each airplane, in radians; `None` for one that flies to its way-point.
/// `meets` returns the second of two, by their places, as the first sees it, if they are on one level and near enough to
/// be in conflict.
pub(crate) fn resolution_headings(
    all: &[AircraftState],
    resolving: &mut [ActiveResolutions],
    settings: ReactiveSettings,
    meets: impl Fn(usize, usize) -> Option<AircraftState>,
) -> Vec<Option<f64>> {
    let intended: Vec<AircraftState> =
        all.iter().zip(&*resolving).map(|(own, memory)| intended_state(own, memory)).collect();
    let mut conflicts = Vec::with_capacity(all.len());
    for (i, own) in intended.iter().enumerate() {
        let mut own_conflicts = Vec::new();
        for j in (0..all.len()).filter(|&j| all[j].slot != own.slot) {
            if let Some(other) = meets(i, j)
                && let Some(closest) = find_conflict(own, &other, settings)
            {
                own_conflicts.push((other, closest));
            }
        }
        conflicts.push(own_conflicts);
    }
    let by_slot = sorted_by_slot(all);
    // As in BlueSky, the headings are kept only while no airplane is in conflict.
    let has_conflict = conflicts.iter().any(|own_conflicts| !own_conflicts.is_empty());
    let each = intended.iter().zip(&conflicts).enumerate();
    for ((i, (own, own_conflicts)), memory) in each.zip(&mut *resolving) {
        if has_conflict {
            memory.heading_rad = resolution_heading_rad(own, own_conflicts, settings);
        }
        memory.with.extend(own_conflicts.iter().map(|(other, _)| other.slot));
        memory.with.sort_unstable();
        memory.with.dedup();
        memory.with.retain(|&slot| {
            find_aircraft_by_slot(all, &by_slot, slot)
                .and_then(|j| meets(i, j))
                .is_some_and(|other| is_conflict_active(own, &other, settings))
        });
        memory.is_overridden &= !memory.with.is_empty();
    }
    resolving.iter().map(|memory| (!memory.with.is_empty()).then_some(memory.heading_rad)).collect()
}

/// Returns an airplane as it means to fly: with its velocity, or after an override with that toward its way-point.
fn intended_state(own: &AircraftState, memory: &ActiveResolutions) -> AircraftState {
    if !memory.is_overridden {
        return *own;
    }
    let v_m_s = vector_length(own.velocity);
    let heading_rad = own.preferred_rad;
    let velocity = [v_m_s * math::cos(heading_rad), v_m_s * math::sin(heading_rad)];
    AircraftState { heading_rad, velocity, ..*own }
}

/// Returns the places of all airplanes by rising slot, because each looks for many of the others among them.
fn sorted_by_slot(all: &[AircraftState]) -> Vec<usize> {
    let mut by_slot: Vec<usize> = (0..all.len()).collect();
    // A stable sort: of those with one slot the first one counts.
    by_slot.sort_by_key(|&k| all[k].slot);
    by_slot
}

/// Returns the place of the first airplane with a slot, if there is one.
fn find_aircraft_by_slot(
    all: &[AircraftState],
    by_slot: &[usize],
    slot: EntitySlot,
) -> Option<usize> {
    let first = by_slot.partition_point(|&k| all[k].slot < slot);
    by_slot.get(first).copied().filter(|&k| all[k].slot == slot)
}

/// Returns whether one of two airplanes enters the other's zone within the look-ahead time, or has entered it, if both
/// fly straight on.
pub(crate) fn is_in_conflict(
    own: &AircraftState,
    other: &AircraftState,
    settings: ReactiveSettings,
) -> bool {
    find_conflict(own, other, settings).is_some()
}

/// Returns the closest approach of two airplanes if one enters the other's zone within the look-ahead time, or has
/// entered it.
fn find_conflict(
    own: &AircraftState,
    other: &AircraftState,
    settings: ReactiveSettings,
) -> Option<ClosestApproach> {
    let zone_m = own.zone_m(other, settings);
    let apart = sub(other.at, own.at);
    let closing = sub(other.velocity, own.velocity);
    let speed2 = dot(closing, closing).max(MIN_SPEED_SQUARED);
    let in_s = -dot(apart, closing) / speed2;
    let at = [apart[0] + closing[0] * in_s, apart[1] + closing[1] * in_s];
    let miss2 = dot(at, at);
    if miss2 >= zone_m * zone_m {
        return None;
    }
    let half_s = (zone_m * zone_m - miss2).sqrt() / speed2.sqrt();
    (in_s + half_s > 0.0 && in_s - half_s < settings.look_ahead_s)
        .then_some(ClosestApproach { at, in_s })
}

/// Returns the heading that resolves an airplane's conflicts; its present one without any.
fn resolution_heading_rad(
    own: &AircraftState,
    conflicts: &[(AircraftState, ClosestApproach)],
    settings: ReactiveSettings,
) -> f64 {
    if conflicts.is_empty() {
        return own.heading_rad;
    }
    let [mut vx, mut vy] = own.velocity;
    for (other, closest) in conflicts {
        let [change_x, change_y] = resolution_velocity_change(own, other, closest, settings);
        vx -= change_x;
        vy -= change_y;
    }
    math::atan2(vy, vx)
}

/// Returns the change of the other's velocity, seen from `own`, with which it would miss the zone.
fn resolution_velocity_change(
    own: &AircraftState,
    other: &AircraftState,
    closest: &ClosestApproach,
    settings: ReactiveSettings,
) -> Point {
    let zone_m = own.zone_m(other, settings) * settings.resolution_factor;
    let apart = sub(other.at, own.at);
    // Two in one place have no line of sight, but its direction must be a number.
    let distance_m = vector_length(apart).max(1e-9);
    let mut at = closest.at;
    let mut miss_m = vector_length(at);
    if miss_m <= MAX_HEAD_ON_M {
        miss_m = MAX_HEAD_ON_M;
        at = [apart[1] / distance_m * miss_m, -apart[0] / distance_m * miss_m];
    }
    let mut reach_m = zone_m;
    if zone_m < distance_m && miss_m < distance_m {
        // The path past the zone is its tangent, so a shift to its rim would cut it.
        let angle_rad = math::asin(zone_m / distance_m) - math::asin(miss_m / distance_m);
        reach_m /= math::cos(angle_rad);
    }
    // At the closest point itself no finite change would do, so it is as if a moment were left.
    let size = (reach_m - miss_m) / (closest.in_s.abs().max(1e-6) * miss_m);
    [at[0] * size, at[1] * size]
}

/// Returns whether a conflict that was found is still to be resolved.
fn is_conflict_active(
    own: &AircraftState,
    other: &AircraftState,
    settings: ReactiveSettings,
) -> bool {
    let apart = sub(other.at, own.at);
    let closing = sub(other.velocity, own.velocity);
    let distance_m = vector_length(apart);
    let zone_m = own.zone_m(other, settings);
    let is_past = dot(apart, closing) > 0.0;
    let angle_rad = math::wrap_angle(own.heading_rad - other.heading_rad).abs();
    let is_side_by_side =
        angle_rad < MAX_SIDE_BY_SIDE_RAD && distance_m < zone_m * settings.resolution_factor;
    !is_past || distance_m < zone_m || is_side_by_side
}

#[cfg(test)]
mod tests {
    use super::super::test_aircraft;
    use super::*;

    const SETTINGS: ReactiveSettings =
        ReactiveSettings { look_ahead_s: 90.0, margin: 1.0, resolution_factor: 1.05 };

    fn looked(all: &[AircraftState], memory: &mut [ActiveResolutions]) -> Vec<Option<f64>> {
        resolution_headings(all, memory, SETTINGS, |_, j| Some(all[j]))
    }

    /// The headings that BlueSky 1.1.1 commands for the same poses after one look (`traf.cr.trk`, as
    /// degrees counterclockwise from east), with `RMETHH HDG`, a zone of 500 m, `RFACH 1.05`,
    /// `DTLOOK 90`, and the bearings of its module `_geo`.
    #[test]
    fn headings_are_those_of_bluesky() {
        type Poses = &'static [(Point, f64)];
        let cases: [(Poses, &[f64]); 5] = [
            (&[([0.0, 0.0], 0.0), ([2000.0, -1900.0], 90.0)], &[-11.3667, 81.8404]),
            (&[([0.0, 0.0], 0.0), ([-300.0, 50.0], 180.0)], &[-72.4744, 107.5256]),
            (&[([0.0, 0.0], 0.0), ([3000.0, 0.0], 180.0)], &[19.2191, -160.7809]),
            (
                &[([0.0, 0.0], 0.0), ([2000.0, -1900.0], 90.0), ([2500.0, 100.0], 170.0)],
                &[-22.2605, 81.8404, 160.6297],
            ),
            (&[([0.0, 0.0], 0.0), ([100.0, -480.0], 10.0)], &[-1.0022, 9.2841]),
        ];
        for (poses, expected_deg) in cases {
            let one = |(slot, (at, deg)): (EntitySlot, &(Point, f64))| {
                test_aircraft(slot, *at, deg.to_radians())
            };
            let all: Vec<AircraftState> = (0..).zip(poses).map(one).collect();
            let found = looked(&all, &mut vec![ActiveResolutions::default(); all.len()]);
            for (found, expected) in found.iter().zip(expected_deg) {
                let found_deg = found.expect("a conflict").to_degrees();
                assert!((found_deg - expected).abs() < 1e-3, "{found_deg} for {expected}");
            }
        }
    }

    #[test]
    fn others_are_found_by_their_slots_in_whatever_order_they_come() {
        let all = [7, 2, 9, 2, 4].map(|slot| test_aircraft(slot, [f64::from(slot), 0.0], 0.0));
        let by_slot = sorted_by_slot(&all);
        for slot in 0..12 {
            assert_eq!(
                find_aircraft_by_slot(&all, &by_slot, slot),
                all.iter().position(|one| one.slot == slot),
                "{slot}"
            );
        }
        assert_eq!(find_aircraft_by_slot(&all, &by_slot, 2), Some(1), "the first of two");
    }

    #[test]
    fn a_conflict_is_minded_until_past_the_closest_point() {
        let mut memory = [ActiveResolutions::default(), ActiveResolutions::default()];
        let far = [
            test_aircraft(0, [0.0, 0.0], 0.0),
            test_aircraft(1, [4000.0, 0.0], std::f64::consts::PI),
        ];
        assert!(looked(&far, &mut memory).iter().all(Option::is_some));
        // Both have turned away, so no conflict is predicted any more.
        let turned = [
            test_aircraft(0, [1000.0, 0.0], 0.5),
            test_aircraft(1, [3000.0, 0.0], 0.5 - std::f64::consts::PI),
        ];
        let kept = looked(&turned, &mut memory);
        assert!(kept.iter().all(Option::is_some), "{kept:?}");
        let past = [
            test_aircraft(0, [2500.0, 400.0], 0.0),
            test_aircraft(1, [1500.0, -400.0], std::f64::consts::PI),
        ];
        assert_eq!(looked(&past, &mut memory), [None, None]);
    }

    #[test]
    fn who_was_overridden_resolves_conflicts_on_its_way_and_not_where_it_was_turned() {
        let goes_east = AircraftState {
            preferred_rad: 0.0,
            ..test_aircraft(0, [0.0, 0.0], std::f64::consts::FRAC_PI_2)
        };
        let from_north = [goes_east, test_aircraft(1, [0.0, 4000.0], -std::f64::consts::FRAC_PI_2)];
        let from_east = [goes_east, test_aircraft(1, [4000.0, 0.0], std::f64::consts::PI)];
        let after = |is_overridden: bool, all: &[AircraftState]| {
            let mut memory = [ActiveResolutions::default(), ActiveResolutions::default()];
            if is_overridden {
                memory[0].record_override();
            }
            let found = looked(all, &mut memory)[0];
            (found.is_some(), memory[0].is_overridden)
        };
        assert_eq!(after(false, &from_north), (true, false));
        assert_eq!(after(true, &from_north), (false, false), "its way is free");
        assert_eq!(after(false, &from_east), (false, false));
        assert_eq!(after(true, &from_east), (true, true), "until its way is free");
    }

    #[test]
    fn two_that_have_lost_separation_and_fly_apart_still_resolve() {
        let mut memory = [ActiveResolutions::default(), ActiveResolutions::default()];
        let inside = [
            test_aircraft(0, [0.0, 0.0], 0.0),
            test_aircraft(1, [-300.0, 50.0], std::f64::consts::PI),
        ];
        assert!(looked(&inside, &mut memory).iter().all(Option::is_some));
        let beyond = [
            test_aircraft(0, [600.0, 0.0], 0.0),
            test_aircraft(1, [-300.0, 50.0], std::f64::consts::PI),
        ];
        assert_eq!(looked(&beyond, &mut memory), [None, None]);
    }
}
