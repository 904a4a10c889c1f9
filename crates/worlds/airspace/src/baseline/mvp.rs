//! Modified voltage potential, as BlueSky flies it (its version 1.1.1: `STATEBASED`, `MVP`), with resolutions by heading,
//! speed, both, vertical speed or all of these (`RMETHH`, `RMETHV`).
//!
//! A conflict is found from the present velocities, also between two that have already come too near
//! and fly apart. Each airplane then changes its present velocity so that the closest point moves out
//! of the other's zone. It keeps to this, also after the conflict is no longer predicted, until the
//! two are past their closest point and apart; then it flies to its way-point again, on its filed level and with its
//! filed speed. Only what the resolution may change is changed: by speed alone it keeps its heading.
//!
//! Where BlueSky's formula for the vertical resolves nothing, ours differs. It gives both of a pair on one level, or whose
//! vertical speeds are equal, the same direction: both descend, and stay on one level. Ours sends the upper one up and
//! the lower one down (of two on one level that with the smaller number up), and so, too, a pair that already flies apart
//! in the vertical. BlueSky's takes the time until the zone is entered as time to resolve also within the zone,
//! where it is negative; ours is then the time that the fastest change takes.
//!
//! Its authors fly it alone. Beside the shield an airplane may fly something else than it wished, and a conflict of that
//! velocity, or a heading to keep from it, would lead it ever farther astray. So after an override it forgets what it resolves,
//! and looks for conflicts as if it flew to its way-point, until that way is free.

use super::{AircraftState, vector_length};
use crate::flight::{CommandKinds, Point, SpeedFactors};
use crate::settings::{ReactiveSettings, Resolution as Axes, RightOfWayRule};
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

/// Vertical speed in meters per second below which two airplanes do not move against each other in the vertical. BlueSky's
/// value.
const MIN_CLIMB_M_S: f64 = 1e-6;
/// Rate in meters per second at which two that are within each other's zone are to leave it in the vertical: faster than
/// airplanes fly, so that each does what it can.
const IN_ZONE_CLIMB_M_S: f64 = 30.0;

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

    /// Returns whether it has forgotten the conflicts, and found none since.
    pub(crate) fn has_forgotten(&self) -> bool {
        self.is_overridden && self.with.is_empty()
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

/// How MVP resolves conflicts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolutionSettings {
    /// What airplanes change.
    pub resolution: Axes,
    /// Factor on the height between levels, to which conflicts are resolved in the vertical.
    pub vertical_factor: f64,
    /// Seconds before a loss by which levels are apart; 0 as in BlueSky. The shield needs that time, because it plans until
    /// both of a pair orbit.
    pub vertical_lead_s: f64,
    /// The speeds that are commanded.
    pub speeds: SpeedFactors,
}

impl ResolutionSettings {
    /// Returns what is commanded beside headings.
    pub(crate) fn command_kinds(&self) -> CommandKinds {
        CommandKinds {
            levels: self.resolution.changes_level(),
            speeds: self.resolution.changes_speed().then_some(self.speeds),
        }
    }
}

/// The rules by which conflicts are found and resolved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MvpRules {
    pub(crate) settings: ReactiveSettings,
    pub(crate) resolution: ResolutionSettings,
    /// Height between levels that is enough, in meters.
    pub(crate) vertical_m: f64,
    /// The rule that says who resolves a conflict, and whether in the vertical.
    pub(crate) right_of_way: RightOfWayRule,
}

/// What an airplane flies to resolve its conflicts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Resolution {
    /// Heading in radians.
    pub(crate) heading_rad: f64,
    /// Airspeed in meters per second; none if it keeps to what was commanded before, or speeds are not changed.
    pub(crate) v_m_s: Option<f64>,
    /// Change of level; none likewise.
    pub(crate) vertical: Option<VerticalResolution>,
}

/// A vertical speed for some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VerticalResolution {
    /// Rate of climb in meters per second, negative downward.
    pub(crate) climb_m_s: f64,
    /// Seconds after which the conflict is resolved.
    pub(crate) within_s: f64,
}

/// A closest approach that two airplanes will have, or have had, if both fly straight on.
struct ClosestApproach {
    /// The other's position then, relative to the airplane.
    at: Point,
    /// Seconds from now.
    in_s: f64,
    /// Seconds until the one enters the other's zone, negative within it.
    enters_in_s: f64,
}

/// Returns the resolution of each airplane; `None` for one that flies as filed.
/// `meets` returns the second of two, by their places, as the first sees it, if they are on one level and near enough to
/// be in conflict.
pub(crate) fn resolutions(
    all: &[AircraftState],
    resolving: &mut [ActiveResolutions],
    rules: &MvpRules,
    meets: impl Fn(usize, usize) -> Option<AircraftState>,
) -> Vec<Option<Resolution>> {
    let settings = rules.settings;
    let intended: Vec<AircraftState> =
        all.iter().zip(&*resolving).map(|(own, memory)| intended_state(own, memory)).collect();
    let mut conflicts = Vec::with_capacity(all.len());
    for (i, own) in intended.iter().enumerate() {
        let mut own_conflicts = Vec::new();
        for j in (0..all.len()).filter(|&j| all[j].slot != own.slot) {
            if let Some(other) = meets(i, j)
                && let Some(closest) = rules.find_conflict(own, &other)
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
            let velocity = resolved_velocity(own, own_conflicts, settings);
            let is_turning = rules.resolution.resolution.changes_heading();
            let direction = velocity.filter(|_| is_turning);
            memory.heading_rad = direction.map_or(own.heading_rad, |[vx, vy]| math::atan2(vy, vx));
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
    let each = resolving.iter().zip(intended.iter().zip(&conflicts));
    each.map(|(memory, (own, own_conflicts))| {
        (!memory.with.is_empty()).then(|| Resolution {
            heading_rad: memory.heading_rad,
            v_m_s: rules.resolved_speed_m_s(own, own_conflicts),
            vertical: rules.vertical_resolution(own, own_conflicts),
        })
    })
    .collect()
}

/// An airplane with which another one is in conflict, as that one sees it, and their closest approach.
type Conflict = (AircraftState, ClosestApproach);

impl MvpRules {
    /// Returns the closest approach of two airplanes in conflict. By levels these are pairs on one level; where levels are
    /// changed, those that enter each other's zone in the vertical, too, at the same time.
    fn find_conflict(&self, own: &AircraftState, other: &AircraftState) -> Option<ClosestApproach> {
        if !self.resolution.resolution.changes_level() {
            return find_conflict(own, other, self.settings);
        }
        let closest = find_conflict(own, other, self.settings)?;
        let [from_s, until_s] = vertical_conflict_s(own, other, self.vertical_m);
        let leaves_in_s = 2.0 * closest.in_s - closest.enters_in_s;
        let enters_in_s = closest.enters_in_s.max(from_s);
        let is_at_once = enters_in_s <= leaves_in_s.min(until_s) && leaves_in_s.min(until_s) > 0.0;
        (is_at_once && enters_in_s < self.settings.look_ahead_s)
            .then_some(ClosestApproach { enters_in_s, ..closest })
    }

    /// Returns the airspeed that resolves conflicts, if speeds are changed and there are any.
    fn resolved_speed_m_s(&self, own: &AircraftState, conflicts: &[Conflict]) -> Option<f64> {
        if !self.resolution.resolution.changes_speed() {
            return None;
        }
        resolved_velocity(own, conflicts, self.settings).map(vector_length)
    }

    /// Returns the vertical speed that resolves conflicts, if levels are changed and there are any: all changes added, for
    /// the shortest of the times that the conflicts leave.
    fn vertical_resolution(
        &self,
        own: &AircraftState,
        conflicts: &[Conflict],
    ) -> Option<VerticalResolution> {
        if !self.resolution.resolution.changes_level() || conflicts.is_empty() {
            return None;
        }
        let mut climb_m_s = own.climb_m_s;
        let mut within_s = f64::INFINITY;
        for (other, closest) in conflicts {
            let share = self.right_of_way.vertical_share(own, other);
            if share > 0.0 {
                let change = self.vertical_change(own, other, closest);
                climb_m_s += share * change.climb_m_s;
                within_s = within_s.min(change.within_s);
            }
        }
        // Without any it keeps to its level, which a rate without a time would not say.
        within_s.is_finite().then_some(VerticalResolution { climb_m_s, within_s })
    }

    /// Returns the change of vertical speed by which an airplane alone resolves a conflict, and the time that this takes.
    fn vertical_change(
        &self,
        own: &AircraftState,
        other: &AircraftState,
        closest: &ClosestApproach,
    ) -> VerticalResolution {
        let zone_m = self.vertical_m * self.resolution.vertical_factor;
        let above_m = other.altitude_m - own.altitude_m;
        let closing_m_s = other.climb_m_s - own.climb_m_s;
        let is_crossing = above_m * closing_m_s < 0.0;
        let crosses_in_s = (above_m / closing_m_s).abs();
        let least_s = 0.5 * zone_m / IN_ZONE_CLIMB_M_S;
        let enters_in_s = if closest.enters_in_s > 0.0 {
            let ahead_s = closest.enters_in_s - self.resolution.vertical_lead_s;
            // The lead leaves as little time as two have that are too near already.
            ahead_s.max(least_s.min(closest.enters_in_s))
        } else {
            least_s
        };
        // Who is to come out above: the one that is above now, or of two on one level the one with the smaller number.
        let is_upper = above_m < 0.0 || (above_m == 0.0 && own.slot < other.slot);
        let away = if is_upper { 1.0 } else { -1.0 };
        let crosses_in_time = is_crossing && crosses_in_s <= self.settings.look_ahead_s;
        let within_s = if crosses_in_time { crosses_in_s } else { enters_in_s };
        let keeps_gap = closing_m_s == 0.0;
        let shortfall_m = if keeps_gap { zone_m - above_m.abs() } else { zone_m };
        VerticalResolution { climb_m_s: away * shortfall_m / within_s, within_s }
    }
}

/// Returns the times in seconds between which two airplanes are nearer to each other in the vertical than `vertical_m`.
fn vertical_conflict_s(own: &AircraftState, other: &AircraftState, vertical_m: f64) -> [f64; 2] {
    let above_m = other.altitude_m - own.altitude_m;
    let closing_m_s = other.climb_m_s - own.climb_m_s;
    if closing_m_s.abs() < MIN_CLIMB_M_S {
        let is_near = above_m.abs() < vertical_m;
        return if is_near {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            [f64::INFINITY, f64::NEG_INFINITY]
        };
    }
    let times_s = [-vertical_m, vertical_m].map(|gap_m| (gap_m - above_m) / closing_m_s);
    [times_s[0].min(times_s[1]), times_s[0].max(times_s[1])]
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
    (in_s + half_s > 0.0 && in_s - half_s < settings.look_ahead_s).then_some(ClosestApproach {
        at,
        in_s,
        enters_in_s: in_s - half_s,
    })
}

/// Returns the horizontal velocity that resolves an airplane's conflicts; `None` without any.
fn resolved_velocity(
    own: &AircraftState,
    conflicts: &[Conflict],
    settings: ReactiveSettings,
) -> Option<Point> {
    if conflicts.is_empty() {
        return None;
    }
    let [mut vx, mut vy] = own.velocity;
    for (other, closest) in conflicts {
        let [change_x, change_y] = resolution_velocity_change(own, other, closest, settings);
        vx -= change_x;
        vy -= change_y;
    }
    Some([vx, vy])
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

    fn rules(resolution: Axes) -> MvpRules {
        let speeds = SpeedFactors { least: 0.5, largest: 2.0 };
        let resolution =
            ResolutionSettings { resolution, vertical_factor: 1.05, vertical_lead_s: 0.0, speeds };
        let right_of_way = RightOfWayRule::None;
        MvpRules { settings: SETTINGS, resolution, vertical_m: 300.0, right_of_way }
    }

    fn looked(all: &[AircraftState], memory: &mut [ActiveResolutions]) -> Vec<Option<f64>> {
        let found = resolutions(all, memory, &rules(Axes::Heading), |_, j| Some(all[j]));
        found.into_iter().map(|one| one.map(|one| one.heading_rad)).collect()
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

    /// An airplane with its altitude and its rate of climb.
    fn test_aircraft_in_space(
        slot: EntitySlot,
        (at, deg, altitude_m, climb_m_s): (Point, f64, f64, f64),
    ) -> AircraftState {
        let flat = test_aircraft(slot, at, deg.to_radians());
        AircraftState { altitude_m, climb_m_s, ..flat }
    }

    /// Returns the resolutions of some airplanes that had no conflicts before.
    fn resolved(poses: &[(Point, f64, f64, f64)], axes: Axes) -> Vec<Option<Resolution>> {
        let all: Vec<AircraftState> =
            (0..).zip(poses).map(|(slot, &pose)| test_aircraft_in_space(slot, pose)).collect();
        let mut memory = vec![ActiveResolutions::default(); all.len()];
        resolutions(&all, &mut memory, &rules(axes), |_, j| Some(all[j]))
    }

    /// What BlueSky 1.1.1 commands after one look (`traf.cr.trk`, `tas`, `vs` and `alt`) with `RMETHH SPD`, `RMETHH BOTH`,
    /// `RMETHV V/S` and `RMETHH OFF`, a zone of 500 m and 300 m, `RFACH 1.05`, `RFACV 1.05`, `DTLOOK 90` and limits that
    /// nobody comes to; as degrees counterclockwise from east, and meters above the altitude 0 of the poses.
    #[test]
    fn speeds_are_those_of_bluesky() {
        let crossing = [([0.0, 0.0], 0.0, 0.0, 0.0), ([2000.0, -1900.0], 90.0, 0.0, 0.0)];
        let third = ([2500.0, 100.0], 170.0, 0.0, 0.0);
        let three = [crossing[0], crossing[1], third];
        let near = [([0.0, 0.0], 0.0, 0.0, 0.0), ([-300.0, 50.0], 180.0, 0.0, 0.0)];
        let cases: [(&[_], &[(f64, f64)]); 3] = [
            (&crossing, &[(-11.3667, 29.7246), (81.8404, 41.2762)]),
            (&three, &[(-22.2605, 30.9344), (81.8404, 41.2762), (160.6297, 35.993)]),
            (&near, &[(-72.4744, 116.2283), (107.5256, 116.2283)]),
        ];
        for (poses, expected) in cases {
            let by_speed = resolved(poses, Axes::Speed);
            let by_both = resolved(poses, Axes::HeadingSpeed);
            for (k, &(deg, v_m_s)) in expected.iter().enumerate() {
                let speed = by_speed[k].expect("a conflict");
                let both = by_both[k].expect("a conflict");
                assert_eq!(speed.heading_rad, poses[k].1.to_radians(), "it keeps its heading");
                assert!((both.heading_rad.to_degrees() - deg).abs() < 1e-3, "{both:?}");
                for found in [speed, both] {
                    assert!((found.v_m_s.expect("a speed") - v_m_s).abs() < 1e-3, "{found:?}");
                    assert_eq!(found.vertical, None);
                }
            }
        }
    }

    #[test]
    fn vertical_speeds_are_those_of_bluesky() {
        let head_on = |at_m: [f64; 2], climbs_m_s: [f64; 2]| {
            [
                ([0.0, 0.0], 0.0, at_m[0], climbs_m_s[0]),
                ([3000.0, 0.0], 180.0, at_m[1], climbs_m_s[1]),
            ]
        };
        let climbing = head_on([250.0, -150.0], [0.0, 5.0]);
        let hardly_descending = head_on([0.0, 120.0], [0.0, -0.5]);
        let descending = [([0.0, 0.0], 0.0, 0.0, 2.0), ([2000.0, -1900.0], 90.0, 200.0, -4.0)];
        let three = [
            ([0.0, 0.0], 0.0, 0.0, 3.0),
            ([3000.0, 0.0], 180.0, 250.0, 0.0),
            ([2000.0, -1900.0], 90.0, 200.0, -4.0),
        ];
        let cases: [(&[_], &[(f64, f64)]); 4] = [
            (&climbing, &[(1.9688, 407.5), (3.0312, 92.5)]),
            (&hardly_descending, &[(-4.41, -157.5), (3.91, 259.643)]),
            (&descending, &[(-2.725, -90.833), (0.725, 224.167)]),
            (&three, &[(-4.4025, -125.786), (1.89, 407.5), (1.5125, 243.214)]),
        ];
        for (poses, expected) in cases {
            for axes in [Axes::Vertical, Axes::HeadingSpeedVertical] {
                let found = resolved(poses, axes);
                for ((found, pose), &(climb_m_s, to_m)) in found.iter().zip(poses).zip(expected) {
                    let vertical = found.expect("a conflict").vertical.expect("a vertical one");
                    assert!((vertical.climb_m_s - climb_m_s).abs() < 1e-3, "{vertical:?}");
                    let reached_m = pose.2 + vertical.climb_m_s * vertical.within_s;
                    assert!((reached_m - to_m).abs() < 2e-2, "{reached_m} for {to_m}");
                }
            }
        }
        let all = resolved(&climbing, Axes::HeadingSpeedVertical)[0].expect("a conflict");
        assert!((all.heading_rad.to_degrees() - 19.2191).abs() < 1e-3, "{all:?}");
        assert!((all.v_m_s.expect("a speed") - 37.0658).abs() < 1e-3, "{all:?}");
    }

    /// BlueSky sends both of them down: by 2.73 m/s of these two, of which each is to descend by 97.5 m.
    #[test]
    fn of_two_that_keep_their_levels_the_upper_one_climbs_as_fast_as_bluesky_lets_both_descend() {
        let climbs = |above_m: f64| {
            let poses = [([0.0, 0.0], 0.0, 0.0, 0.0), ([3000.0, 0.0], 180.0, above_m, 0.0)];
            let vertical = |one: Option<Resolution>| one.and_then(|one| one.vertical);
            resolved(&poses, Axes::Vertical)
                .into_iter()
                .map(|one| vertical(one).expect("a vertical one"))
                .collect::<Vec<_>>()
        };
        for (above_m, sign) in [(120.0, 1.0), (-120.0, -1.0)] {
            let found = climbs(above_m);
            assert!((found[1].climb_m_s - sign * 2.73).abs() < 1e-3, "{found:?}");
            assert_eq!(found[0].climb_m_s, -found[1].climb_m_s);
            assert!((found[0].climb_m_s * found[0].within_s + sign * 97.5).abs() < 1e-2);
        }
        let on_one_level = climbs(0.0);
        assert!(on_one_level[0].climb_m_s > 0.0 && on_one_level[1].climb_m_s < 0.0);
    }

    #[test]
    fn a_pair_that_is_apart_in_the_vertical_when_it_is_near_is_in_no_conflict() {
        // The other has climbed past its level long before they meet.
        let passes = [([0.0, 0.0], 0.0, 0.0, 0.0), ([6000.0, 0.0], 180.0, -200.0, 9.0)];
        assert_eq!(resolved(&passes, Axes::Vertical), [None, None]);
        let meets = [([0.0, 0.0], 0.0, 0.0, 0.0), ([6000.0, 0.0], 180.0, -200.0, 2.0)];
        assert!(resolved(&meets, Axes::Vertical).iter().all(Option::is_some));
        let above = [([0.0, 0.0], 0.0, 0.0, 0.0), ([6000.0, 0.0], 180.0, 300.0, 0.0)];
        assert_eq!(resolved(&above, Axes::Vertical), [None, None]);
    }

    #[test]
    fn two_within_each_others_zone_leave_it_in_the_vertical_as_fast_as_they_can() {
        let inside = [([0.0, 0.0], 0.0, 0.0, 0.0), ([300.0, 0.0], 180.0, 50.0, 0.0)];
        for (found, sign) in resolved(&inside, Axes::Vertical).into_iter().zip([-1.0, 1.0]) {
            let vertical = found.and_then(|one| one.vertical).expect("a vertical one");
            assert!(sign * vertical.climb_m_s > 20.0, "{vertical:?}");
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
