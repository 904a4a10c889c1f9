//! What remains of the earth's roundness in the plane of a pair, as far as the shield allows for it.
//!
//! Two airplanes are compared in a plane (`flight/pair_plane.rs`): each flies in the plane that touches the earth at its
//! own position, and both planes are laid into one, at the middle between them. On a sphere of radius `R` a place at a
//! distance `d` from where its plane touches, laid into a plane that touches elsewhere, is off by at most a few tenths
//! of `L^3 / R^2`, where all places concerned are within `L` of the middle. The shield takes
//!
//! ```text
//! e = L^3 / (3 R^2),  L = (R_max + 2 r_max) / 2 + r_max
//! ```
//!
//! for each of the two airplanes, with the largest separation `R_max` and the largest reach `r_max` (one `dt` of flight,
//! the longest way until an orbit begins, and the diameter of an orbit) of all airplanes, and the smallest radius of
//! curvature of the ellipsoid: farther apart
//! than `R_max + 2 r_max` no two are compared. New plans keep `2 e` more than the separation, as for errors of position
//! (`errors.rs`). Sampled pairs are off by less than half of that (a test), so that what is flown on the earth, and what
//! is measured in the planes of later steps, both keep the separation.
//!
//! **Forever.** A stored orbit is kept as a pose on the earth, and flown as a circle about its center there, at a fixed
//! rate (`Surface::fallback_frame`). So it is the same circle at all times and in whichever pair it is compared, and the
//! error of a comparison does not grow with the time that the orbit is flown.
//!
//! **Wind.** A wind is not part of this, and no wider margin would make it so. In a plane it moves all alike and changes
//! no distance. On the earth east is another direction for each of two airplanes: of two that are `d` apart from south to
//! north at latitude `phi`, an east wind `w` moves one past the other at `w d tan(phi) / R`, which at 30 m/s, 20 km and 47
//! degrees is 0.1 m/s or 360 m an hour, and stored orbits are flown without end. What keeps all distances on the ellipsoid
//! is a rotation about its axis alone, which is a wind along the parallels that grows with the distance from the axis:
//! none that a scenario can give. A scenario on the earth with a wind has no shield.

use sidestep_kernel::geodesy::MIN_CURVATURE_RADIUS_M;

/// Returns the bound on how far an airplane may be from where it is in the plane of a pair, for the largest separation
/// and the largest reach of all airplanes, in meters.
pub(crate) fn curvature_error_m(max_gap_m: f64, max_reach_m: f64) -> f64 {
    let size_m = 0.5 * (max_gap_m + 2.0 * max_reach_m) + max_reach_m;
    let ratio = size_m / MIN_CURVATURE_RADIUS_M;
    size_m * ratio * ratio / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{PairPlane, Pose2, Surface, coordinates_from_degrees};
    use proptest::prelude::*;
    use sidestep_kernel::math;

    fn polar(length_m: f64, rad: f64) -> [f64; 2] {
        [length_m * math::cos(rad), length_m * math::sin(rad)]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]

        /// Two airplanes that are compared, at any moment of a plan, an orbit of theirs, or a later step: the plane of
        /// the pair and the earth differ by less than what the shield keeps for that.
        #[test]
        fn what_the_earth_takes_from_a_distance_in_the_plane_is_less_than_the_margin(
            lat in prop_oneof![-90.0f64..=90.0, 88.0f64..=90.0], lon in -180.0f64..180.0,
            gap_m in 500.0f64..20_000.0, reach_m in 2000.0f64..60_000.0,
            apart in 0.0f64..1.0, directions in prop::array::uniform3(-3.2f64..3.2),
            parts in prop::array::uniform2(0.0f64..=1.0),
        ) {
            let a = coordinates_from_degrees([lat, lon]);
            let frame_a = Surface::Earth.frame_at(a);
            let b = frame_a.to_world(polar(apart * (gap_m + 2.0 * reach_m), directions[0]));
            let frame_b = Surface::Earth.frame_at(b);
            let p = polar(parts[0] * reach_m, directions[1]);
            let q = polar(parts[1] * reach_m, directions[2]);
            let flat_m = PairPlane::between(frame_a, frame_b).distance_m(p, q);
            let true_m = Surface::Earth.distance_m(frame_a.to_world(p), frame_b.to_world(q));
            let margin_m = 2.0 * curvature_error_m(gap_m, reach_m);
            // Only distances near the separation decide anything.
            if true_m < 2.0 * gap_m {
                prop_assert!(2.0 * (flat_m - true_m).abs() <= margin_m, "{flat_m} {true_m} {margin_m}");
            }
        }
    }

    proptest! {
        // Each flies thousands of steps.
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// An orbit that is flown for days from frame to frame is still the same circle, at the same phase.
        #[test]
        fn an_orbit_on_the_earth_is_the_same_circle_however_long_it_is_flown(
            lat in -89.9f64..89.9, lon in -180.0f64..180.0, heading_rad in -3.1f64..3.1, left in any::<bool>(),
        ) {
            let omega_rad_s = if left { 0.018 } else { -0.018 };
            let v_m_s = 250.0;
            let start = Pose2 { at: coordinates_from_degrees([lat, lon]), heading_rad };
            let turns = 40;
            let steps = 50;
            let dt_s = std::f64::consts::TAU / 0.018 / f64::from(steps);
            let mut pose = start;
            for _ in 0..turns * steps {
                let frame = Surface::Earth.fallback_frame(pose, v_m_s, omega_rad_s);
                pose = frame.pose_to_world(frame.pose_to_local(pose).step(v_m_s, omega_rad_s, dt_s));
            }
            let off_m = Surface::Earth.distance_m(start.at, pose.at);
            prop_assert!(off_m < 1e-3, "{off_m}");
        }
    }
}
