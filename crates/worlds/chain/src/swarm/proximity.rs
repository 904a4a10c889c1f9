//! Short-range sensors around a round body: they report the directions of imminent collisions
//! (slide E2: the followers' simpler sensors).

use super::drive::Pose2;
use super::laser::RobotBody;
use super::ray;
use sidestep_kernel::math::{atan2, cos, sin, wrap_angle};
use sidestep_rods::geometry::sub;
use sidestep_rods::{Obstacles, bounds_around};
use std::f64::consts::TAU;

/// Number of sensors. The first looks ahead, the others follow counterclockwise. Eight tell a wall beside a robot from one
/// ahead, and are still much simpler than the leader's laser, as the slides want them.
pub(crate) const SECTORS: usize = 8;
/// The angle that one sensor watches.
pub(crate) const SECTOR_RAD: f64 = TAU / SECTORS as f64;

/// The gap between the body and the nearest obstacle, sector by sector, up to the sensors' range.
pub(crate) type SectorGaps = [f64; SECTORS];

/// A ring of sensors around a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorRing {
    /// Radius of the body.
    pub radius_m: f64,
    /// Range of the sensors beyond the body, meters.
    pub range_m: f64,
}

impl SensorRing {
    /// Reads all sensors: the least gap in each sector, exactly; 0 in contact.
    pub fn read(
        &self,
        pose: &Pose2,
        obstacles: &Obstacles<2>,
        bodies: impl IntoIterator<Item = RobotBody>,
    ) -> SectorGaps {
        let mut gaps = [self.range_m; SECTORS];
        let near = bounds_around(pose.at, self.radius_m + self.range_m);
        let borders: [[f64; 2]; SECTORS] = std::array::from_fn(|k| {
            let toward = pose.heading_rad + (k as f64 + 0.5) * SECTOR_RAD;
            [cos(toward), sin(toward)]
        });
        obstacles.visit(&near, |o| {
            let body = RobotBody { core: o.core, radius_m: o.radius_m };
            self.sense_body(pose, &borders, &body, &mut gaps);
        });
        for body in bodies.into_iter().filter(|body| body.bounds().intersects(&near)) {
            self.sense_body(pose, &borders, &body, &mut gaps);
        }
        gaps
    }

    /// Finds the nearest point of a convex body in a sector: the nearest of all, or one on a
    /// border.
    fn sense_body(
        &self,
        pose: &Pose2,
        borders: &[[f64; 2]; SECTORS],
        body: &RobotBody,
        gaps: &mut SectorGaps,
    ) {
        let RobotBody { core, radius_m } = *body;
        let nearest = core.nearest_to_point(pose.at);
        let gap_m = (nearest.distance_m - radius_m - self.radius_m).max(0.0);
        if gap_m >= self.range_m {
            return;
        }
        if nearest.distance_m <= radius_m {
            return gaps.fill(0.0);
        }
        let to = sub(nearest.on_core, pose.at);
        let sector = sector_of(atan2(to[1], to[0]) - pose.heading_rad);
        gaps[sector] = gaps[sector].min(gap_m);
        for (k, &u) in borders.iter().enumerate() {
            if let Some(hit_m) = ray::distance_m(pose.at, u, &core, radius_m) {
                let gap_m = (hit_m - self.radius_m).max(0.0);
                for side in [k, (k + 1) % SECTORS] {
                    gaps[side] = gaps[side].min(gap_m);
                }
            }
        }
    }
}

/// Returns the sensor that looks into a direction relative to the heading.
fn sector_of(bearing_rad: f64) -> usize {
    let k = (wrap_angle(bearing_rad) / SECTOR_RAD).round() as isize;
    k.rem_euclid(SECTORS as isize) as usize
}

/// Returns the speed at which a body may go into a direction relative to its heading without
/// reaching a static obstacle within `horizon_s`. It may turn by up to `slack_rad` meanwhile.
pub(crate) fn safe_speed_m_s(
    gaps: &SectorGaps,
    bearing_rad: f64,
    slack_rad: f64,
    horizon_s: f64,
) -> f64 {
    let mut safe_m_s = f64::INFINITY;
    for (k, gap_m) in gaps.iter().enumerate() {
        let off_rad = wrap_angle(k as f64 * SECTOR_RAD - bearing_rad).abs();
        // The obstacle may be at the nearer border of the sector, and the body may turn toward it.
        let closing = cos((off_rad - 0.5 * SECTOR_RAD - slack_rad).max(0.0));
        if closing > 0.0 {
            safe_m_s = safe_m_s.min(gap_m / (horizon_s * closing));
        }
    }
    safe_m_s
}

#[cfg(test)]
mod tests {
    use super::super::ray::tests::core_strategy;
    use super::*;
    use proptest::prelude::*;
    use sidestep_rods::Obstacle;

    const RING: SensorRing = SensorRing { radius_m: 0.25, range_m: 0.15 };

    proptest! {
        #[test]
        fn a_sector_reads_what_the_nearest_of_many_rays_does(
            cores in prop::collection::vec((core_strategy(), 0.01..0.5f64), 1..12),
            at in prop::array::uniform2(-3.0..3.0f64), heading_rad in -3.1..3.1f64,
        ) {
            let all = cores.iter().map(|(core, r)| Obstacle::new_static(1, *core, *r)).collect();
            let obstacles = Obstacles::new(all, 1.0).unwrap();
            let gaps = RING.read(&Pose2 { at, heading_rad }, &obstacles, []);
            for (k, gap_m) in gaps.iter().enumerate() {
                let mut least_m = RING.range_m;
                for i in -100..=100 {
                    let off_rad = (k as f64 + f64::from(i) / 200.0) * SECTOR_RAD;
                    let u = [cos(heading_rad + off_rad), sin(heading_rad + off_rad)];
                    for (core, r) in &cores {
                        if let Some(m) = ray::distance_m(at, u, core, *r) {
                            least_m = least_m.min((m - RING.radius_m).max(0.0));
                        }
                    }
                }
                prop_assert!(*gap_m <= least_m + 1e-9 && *gap_m > least_m - 0.02, "{k} {gap_m} {least_m}");
            }
        }
    }

    #[test]
    fn other_robots_are_seen_too() {
        let pose = Pose2 { at: [0.0, 0.0], heading_rad: std::f64::consts::FRAC_PI_2 };
        let gaps = RING.read(&pose, &Obstacles::default(), [RobotBody::disc([0.6, 0.0], 0.25)]);
        // It is on the right: the seventh of eight, counterclockwise from ahead.
        assert!((gaps[6] - 0.1).abs() < 1e-12);
        assert_eq!(gaps[0], 0.15);
    }

    #[test]
    fn who_goes_along_a_wall_is_held_less_than_who_goes_at_it() {
        let mut gaps = [0.15; SECTORS];
        gaps[0] = 0.01;
        assert!((safe_speed_m_s(&gaps, 0.0, 0.0, 0.1) - 0.1).abs() < 1e-12);
        assert!(safe_speed_m_s(&gaps, 1.5, 0.0, 0.1) > 0.2);
        assert!(safe_speed_m_s(&gaps, std::f64::consts::PI, 0.0, 0.1) > 1.0);
    }
}
