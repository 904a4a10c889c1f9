//! Optimal reciprocal collision avoidance (van den Berg and others, 2011), for airplanes that fly
//! with one speed.
//!
//! Each neighbor allows a half-plane of velocities, as in the paper. A velocity in the middle of the
//! allowed ones is of no use to an airplane that cannot slow down: its direction alone, flown with
//! full speed, may lie outside. So the choice is made among the velocities that it can have, which
//! lie on a circle: the allowed heading nearest to the preferred one, or where none is allowed the
//! one that violates the half-planes least. The margin on separations allows for the time that
//! turning takes.

use super::{AircraftState, vector_length};
use crate::flight::Point;
use crate::settings::ReactiveSettings;
use sidestep_kernel::geometry::{dot, sub};
use sidestep_kernel::math;

/// Number of headings among which an airplane chooses, evenly spaced from the preferred one on: 4 degrees apart, as
/// far as the paper's airplane turns in a step, so that it could not fly finer ones.
const HEADINGS: u32 = 90;
/// Weight in meters per second of a turn by one radian, beside violations: of headings that are
/// equally bad, the nearest one is flown.
const TURN_WEIGHT_M_S: f64 = 1e-6;

/// The velocities that one neighbor allows: those with at least `min_m_s` along `normal`.
struct HalfPlane {
    normal: Point,
    min_m_s: f64,
}

/// Returns the heading in radians that an airplane should fly among the others; `None` if it may
/// fly to its way-point. `step_s` is the time until it chooses again.
pub(crate) fn heading_rad<'a>(
    own: &AircraftState,
    others: impl Iterator<Item = &'a AircraftState>,
    settings: ReactiveSettings,
    step_s: f64,
) -> Option<f64> {
    let planes: Vec<HalfPlane> =
        others.map(|other| half_plane(own, other, settings, step_s)).collect();
    let v_m_s = vector_length(own.velocity);
    if min_plane_margin_m_s(&planes, own.preferred_rad, v_m_s) >= 0.0 {
        return None;
    }
    let spacing_rad = std::f64::consts::TAU / f64::from(HEADINGS);
    let ranked = (0..HEADINGS).map(|k| {
        let turn_rad = math::wrap_angle(f64::from(k) * spacing_rad);
        let excess_m_s = min_plane_margin_m_s(&planes, own.preferred_rad + turn_rad, v_m_s);
        // Any allowed heading is better than all others; among equals the nearest one is.
        let is_allowed = excess_m_s >= 0.0;
        let score = excess_m_s.min(0.0) - TURN_WEIGHT_M_S * turn_rad.abs();
        (is_allowed, score, turn_rad)
    });
    let best = ranked.max_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    best.map(|(_, _, turn_rad)| own.preferred_rad + turn_rad)
}

/// Returns by how much the velocity of a heading is within the half-planes, at the one that it satisfies least.
fn min_plane_margin_m_s(planes: &[HalfPlane], heading_rad: f64, v_m_s: f64) -> f64 {
    let velocity = [v_m_s * math::cos(heading_rad), v_m_s * math::sin(heading_rad)];
    planes.iter().map(|p| dot(p.normal, velocity) - p.min_m_s).fold(f64::INFINITY, f64::min)
}

/// Returns the velocities of `own` that avoid one neighbor: if that one yields, it does its half.
fn half_plane(
    own: &AircraftState,
    other: &AircraftState,
    settings: ReactiveSettings,
    step_s: f64,
) -> HalfPlane {
    let apart = sub(other.at, own.at);
    let relative = sub(own.velocity, other.velocity);
    let radius_m = own.zone_m(other, settings);
    let distance2 = dot(apart, apart);
    let is_too_near = distance2 <= radius_m * radius_m;
    // A pair that is already too near has to be out of the zone by the next step.
    let within_s = if is_too_near { step_s } else { settings.look_ahead_s };
    let from_center = [relative[0] - apart[0] / within_s, relative[1] - apart[1] / within_s];
    let size = vector_length(from_center).max(1e-9);
    let along = dot(from_center, apart);
    // The velocity obstacle is a cone whose tip is cut off by a disc: the nearest point of its border is on the disc.
    let is_nearest_on_disc = along < 0.0 && along * along > radius_m * radius_m * size * size;
    let (normal, needed_m_s) = if is_too_near || is_nearest_on_disc {
        // To the rim of the disc of velocities that lead into the zone at the end of the time.
        let normal = [from_center[0] / size, from_center[1] / size];
        (normal, radius_m / within_s - size)
    } else {
        // To the nearer leg of the cone of velocities that lead into the zone before.
        let leg_m = (distance2 - radius_m * radius_m).sqrt();
        let turn =
            if apart[0] * from_center[1] - apart[1] * from_center[0] > 0.0 { 1.0 } else { -1.0 };
        let normal = [
            -(apart[0] * radius_m + turn * apart[1] * leg_m) / distance2,
            -(apart[1] * radius_m - turn * apart[0] * leg_m) / distance2,
        ];
        (normal, -dot(relative, normal))
    };
    let share = if other.yields { 0.5 } else { 1.0 };
    HalfPlane { normal, min_m_s: dot(own.velocity, normal) + share * needed_m_s }
}

#[cfg(test)]
mod tests {
    use super::super::test_aircraft;
    use super::*;
    use dodgy_2d::{Agent, AvoidanceOptions, Vec2};
    use proptest::prelude::*;
    use std::borrow::Cow;

    const SETTINGS: ReactiveSettings =
        ReactiveSettings { look_ahead_s: 60.0, margin: 1.05, resolution_factor: 1.0 };

    /// The velocity that another implementation chooses, without a limit of speed.
    fn by_library(own: &AircraftState, other: &AircraftState) -> Point {
        let plain = |v: Point| Vec2::new(v[0] as f32, v[1] as f32);
        let agent = |m: &AircraftState| Agent {
            position: plain(m.at),
            velocity: plain(m.velocity),
            radius: (0.5 * 500.0 * SETTINGS.margin) as f32,
            avoidance_responsibility: 1.0,
        };
        let options = AvoidanceOptions {
            obstacle_margin: 0.0,
            time_horizon: SETTINGS.look_ahead_s as f32,
            obstacle_time_horizon: 0.0,
        };
        let (neighbors, wanted) = ([Cow::Owned(agent(other))], plain(own.velocity));
        let chosen =
            agent(own).compute_avoiding_velocity(&neighbors, &[], wanted, 1e4, 1.0, &options);
        [f64::from(chosen.x), f64::from(chosen.y)]
    }

    proptest! {
        /// With its velocity free, an airplane would choose the nearest one of the half-plane, as a library does.
        #[test]
        fn the_half_planes_are_those_of_the_paper(
            x in -4000.0f64..4000.0, y in -4000.0f64..4000.0, heading_rad in -3.1f64..3.1,
        ) {
            let (own, other) = (test_aircraft(0, [0.0, 0.0], 0.3), test_aircraft(1, [x, y], heading_rad));
            let HalfPlane { normal, min_m_s } = half_plane(&own, &other, SETTINGS, 1.0);
            let lacks = (min_m_s - dot(normal, own.velocity)).max(0.0);
            let nearest = [own.velocity[0] + lacks * normal[0], own.velocity[1] + lacks * normal[1]];
            let theirs = by_library(&own, &other);
            let off = sub(nearest, theirs);
            prop_assert!(vector_length(off) < 0.02 + 1e-3 * lacks, "{nearest:?} {theirs:?}");
        }

        /// Alone with one neighbor, both headings together keep the zone.
        #[test]
        fn a_heading_is_one_that_all_allow(x in 600.0f64..4000.0, y in -800.0f64..800.0) {
            let (own, other) = (test_aircraft(0, [0.0, 0.0], 0.0), test_aircraft(1, [x, y], 3.1));
            let plane = half_plane(&own, &other, SETTINGS, 1.0);
            let excess = |rad: f64| {
                dot(plane.normal, [35.0 * math::cos(rad), 35.0 * math::sin(rad)]) - plane.min_m_s
            };
            match heading_rad(&own, [other].iter(), SETTINGS, 1.0) {
                Some(rad) => prop_assert!(excess(rad) >= 0.0 && excess(0.0) < 0.0),
                None => prop_assert!(excess(0.0) >= 0.0),
            }
        }
    }
}
