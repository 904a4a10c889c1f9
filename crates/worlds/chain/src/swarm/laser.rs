//! A rotating laser: distances from the robot's middle to its surroundings (slide N2).

use super::drive::Pose2;
use super::ray;
use sidestep_kernel::InputError;
use sidestep_kernel::distr::normal;
use sidestep_kernel::math::{cos, sin, wrap_angle};
use sidestep_kernel::stream::{Draws, Purpose};
use sidestep_rods::geometry::{Aabb, ConvexCore, Point};
use sidestep_rods::{Obstacle, Obstacles, bounds_around};
use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

/// Draws of the errors of a laser's ranges: one stream per chain and cycle.
pub const LASER_NOISE: Purpose = Purpose(1);

/// A body in the way that is not an obstacle of the world: another robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotBody {
    /// Its inner part.
    pub core: ConvexCore<2>,
    /// Its reach beyond its core, meters.
    pub radius_m: f64,
}

impl RobotBody {
    /// Returns a round robot.
    pub fn disc(at: Point<2>, radius_m: f64) -> Self {
        Self { core: ConvexCore::Point(at), radius_m }
    }

    pub(super) fn bounds(&self) -> Aabb<2> {
        self.core.bounds().grown(self.radius_m)
    }
}

/// All that a robot's sensors may meet.
#[derive(Debug, Clone, Copy)]
pub struct NearbyBodies<'a, R> {
    /// Obstacles of the world, the moving ones where they are now.
    pub obstacles: &'a Obstacles<2>,
    /// Bodies of robots, without that of the robot itself.
    pub robots: R,
}

/// A laser with equally spaced beams all around, of which it reads those within its field.
#[derive(Debug, Clone, PartialEq)]
pub struct Laser {
    /// Its range, meters; a beam that meets nothing reads that.
    range_m: f64,
    /// Standard deviation of its errors, meters; 0 for none.
    noise_std_m: f64,
    /// The beams it reads are those up to this many to each side of straight ahead.
    beams_per_side: usize,
    /// Direction of every beam relative to the heading; beam `k` is `k` steps to the left.
    directions: Vec<Point<2>>,
}

/// Ranges of one scan, and which beams met something that moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LaserScan {
    /// Range of every beam of the full circle, as in [`Laser`]; beams that are not read hold 0.
    ranges_m: Vec<f64>,
    /// The same without errors, where wanted.
    true_m: Vec<f64>,
    /// The same without errors and without moving bodies; empty if nothing moves.
    still_m: Vec<f64>,
    /// Whether every beam meets a moving body; empty if nothing moves.
    meets_mover: Vec<bool>,
    /// Whether ranges without errors are kept.
    pub keeps_truth: bool,
}

impl Laser {
    /// Returns a laser with `beams` around the full circle, which reads those within
    /// `half_field_rad` of straight ahead.
    ///
    /// # Errors
    /// When there are no beams, or more than 3600; a range is not above 0; a field is outside (0,
    /// pi]; or errors are not finite or negative.
    pub fn new(
        beams: usize,
        range_m: f64,
        half_field_rad: f64,
        noise_std_m: f64,
    ) -> Result<Self, InputError> {
        // More than ten a degree are taken as a mistake.
        if !(4..=3600).contains(&beams) {
            return Err(laser_error(format!("has {beams} beams"), "give 4 to 3600"));
        }
        if !(range_m > 0.0 && range_m <= 1e4) {
            let cause = format!("has a range of {range_m} m");
            return Err(laser_error(cause, "give more than 0, up to 1e4 m"));
        }
        // Half a turn may have come from degrees, and be a rounding more.
        if !(half_field_rad > 0.0 && half_field_rad <= PI + 1e-9) {
            let cause = format!("sees {half_field_rad} rad to each side");
            return Err(laser_error(cause, "give up to pi"));
        }
        if !(0.0..=range_m).contains(&noise_std_m) {
            return Err(laser_error(format!("errs by {noise_std_m} m"), "give 0 up to its range"));
        }
        let step_rad = TAU / beams as f64;
        let angles_rad = (0..beams).map(|k| k as f64 * step_rad);
        Ok(Self {
            range_m,
            noise_std_m,
            beams_per_side: last_beam_within_angle(half_field_rad, step_rad),
            directions: angles_rad.map(|angle_rad| [cos(angle_rad), sin(angle_rad)]).collect(),
        })
    }

    /// Returns the range of its beams, meters; those that meet nothing read that.
    pub fn range_m(&self) -> f64 {
        self.range_m
    }

    fn beam_step_rad(&self) -> f64 {
        TAU / self.directions.len() as f64
    }

    /// Reads every beam of the field: the distance from the robot's middle to the nearest obstacle
    /// or body, with a random error if the laser has errors, up to the range.
    ///
    /// One query of the obstacles' grid serves all beams; each obstacle is then checked only by the
    /// beams that may meet it.
    pub fn scan(
        &self,
        pose: &Pose2,
        around: NearbyBodies<'_, impl IntoIterator<Item = RobotBody>>,
        noise: &mut Draws,
        scan: &mut LaserScan,
    ) {
        scan.ranges_m.clear();
        scan.ranges_m.resize(self.directions.len(), 0.0);
        for beam in self.beam_indices() {
            scan.ranges_m[beam] = self.range_m;
        }
        let view = ScanPose { pose, turn: [cos(pose.heading_rad), sin(pose.heading_rad)] };
        let near = bounds_around(pose.at, self.range_m);
        let mut some_move = false;
        // Movers come last, because a beam records whether a mover is what it meets first.
        around.obstacles.visit(&near, |o| {
            if is_moving(o) {
                some_move = true;
            } else {
                self.scan_body(&view, &obstacle_body(o), scan);
            }
        });
        for robot in around.robots.into_iter().filter(|robot| robot.bounds().intersects(&near)) {
            self.scan_body(&view, &robot, scan);
        }
        scan.meets_mover.clear();
        if some_move {
            self.scan_movers(&view, around.obstacles, scan);
        }
        if scan.keeps_truth {
            scan.true_m.clone_from(&scan.ranges_m);
        }
        if self.noise_std_m > 0.0 {
            for beam in self.beam_indices() {
                let error_m = self.noise_std_m * normal(noise);
                let range_m = &mut scan.ranges_m[beam];
                *range_m = (*range_m + error_m).clamp(0.0, self.range_m);
            }
        }
    }

    /// Shortens the beams that meet a moving obstacle, and records which they are.
    fn scan_movers(&self, view: &ScanPose<'_>, obstacles: &Obstacles<2>, scan: &mut LaserScan) {
        scan.still_m.clone_from(&scan.ranges_m);
        obstacles.visit(&bounds_around(view.pose.at, self.range_m), |o| {
            if is_moving(o) {
                self.scan_body(view, &obstacle_body(o), scan);
            }
        });
        let nearer = scan.ranges_m.iter().zip(&scan.still_m).map(|(with, still)| with < still);
        scan.meets_mover.extend(nearer);
    }

    /// Returns the beams it reads, from the rightmost to the leftmost.
    fn beam_indices(&self) -> impl Iterator<Item = usize> {
        let n = self.directions.len();
        let m = self.beams_per_side;
        (0..(2 * m + 1).min(n)).map(move |k| (n + k - m) % n)
    }

    /// Shortens the beams that meet a body.
    fn scan_body(&self, view: &ScanPose<'_>, body: &RobotBody, scan: &mut LaserScan) {
        let RobotBody { core, radius_m } = body;
        match core {
            ConvexCore::Point(c) => self.scan_segment(view, [*c; 2], body, scan),
            ConvexCore::Segment(ends) => self.scan_segment(view, *ends, body, scan),
            ConvexCore::Cuboid(cuboid) => {
                // From inside, the edges are not visible in every direction.
                if core.nearest_to_point(view.pose.at).distance_m <= *radius_m {
                    return scan.ranges_m.fill(0.0);
                }
                for edge in cuboid.edges_2d() {
                    let side = RobotBody { core: ConvexCore::Segment(edge), radius_m: *radius_m };
                    self.scan_segment(view, edge, &side, scan);
                }
            }
        }
    }

    /// Shortens the beams that meet a body, whose core lies around the segment `ends`.
    fn scan_segment(
        &self,
        view: &ScanPose<'_>,
        ends: [Point<2>; 2],
        body: &RobotBody,
        scan: &mut LaserScan,
    ) {
        let ScanPose { pose, turn } = *view;
        let n = self.directions.len();
        let (first, count) = match ray::capsule_extent_rad(pose.at, ends, body.radius_m) {
            None => (0, n),
            Some((middle, half)) => {
                let right = wrap_angle(middle - pose.heading_rad) - half;
                // One more at each end, and one for the fraction that is cut off: a beam too many costs a test, a beam
                // too few passes through the body.
                let beams = (2.0 * half / self.beam_step_rad()) as usize + 3;
                let first = (right / self.beam_step_rad()).floor() as isize;
                (first.rem_euclid(n as isize) as usize, beams.min(n))
            }
        };
        for k in 0..count {
            let beam = (first + k) % n;
            // Beams out of the field hold 0 and are never shortened.
            let so_far_m = scan.ranges_m[beam];
            if so_far_m > 0.0 {
                let [c, s] = self.directions[beam];
                let u = [c * turn[0] - s * turn[1], s * turn[0] + c * turn[1]];
                let hit_m = ray::distance_m(pose.at, u, &body.core, body.radius_m);
                scan.ranges_m[beam] = hit_m.map_or(so_far_m, |m| m.min(so_far_m));
            }
        }
    }

    /// Returns the bearing, left positive, and the range of every beam that it reads, from the
    /// rightmost on.
    pub fn readings<'a>(&'a self, scan: &'a LaserScan) -> impl Iterator<Item = (f64, f64)> + 'a {
        let rightmost = -(self.beams_per_side as f64);
        let step_rad = self.beam_step_rad();
        let ranges_m = self.read_beam_values(&scan.ranges_m).enumerate();
        ranges_m.map(move |(k, range_m)| ((rightmost + k as f64) * step_rad, range_m))
    }

    /// Returns the ranges without errors in the order of [`Self::readings`]; none unless they were
    /// kept.
    pub fn true_ranges<'a>(&'a self, scan: &'a LaserScan) -> impl Iterator<Item = f64> + 'a {
        self.read_beam_values(&scan.true_m)
    }

    /// Returns the values of the beams that it reads, from the rightmost on.
    fn read_beam_values<'a>(&'a self, of_all: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.beam_indices().filter_map(|beam| of_all.get(beam).copied())
    }

    /// Returns the least range within a sector of beams, given by its ends relative to the heading,
    /// left positive; `None` if [`Self::can_see_sector`] returns false.
    pub fn min_sector_range_m(&self, scan: &LaserScan, sector_rad: [f64; 2]) -> Option<f64> {
        let n = self.directions.len() as isize;
        let beams = self.sector_beams(sector_rad)?;
        let ranges_m = beams.map(|k| scan.ranges_m[k.rem_euclid(n) as usize]);
        Some(ranges_m.fold(self.range_m, f64::min))
    }

    /// Returns the least range of the beams of a sector that meet a moving body, or of the others, as
    /// [`Self::min_sector_range_m`].
    pub fn min_range_where_moving_m(
        &self,
        scan: &LaserScan,
        sector_rad: [f64; 2],
        moves: bool,
    ) -> Option<f64> {
        let n = self.directions.len() as isize;
        let mut least_m = self.range_m;
        for k in self.sector_beams(sector_rad)? {
            let beam = k.rem_euclid(n) as usize;
            let meets_mover = scan.meets_mover.get(beam).copied().unwrap_or(false);
            if meets_mover == moves {
                least_m = least_m.min(scan.ranges_m[beam]);
            }
        }
        Some(least_m)
    }

    /// Returns whether a sector lies completely in the field and has a beam.
    pub fn can_see_sector(&self, sector_rad: [f64; 2]) -> bool {
        self.sector_beams(sector_rad).is_some()
    }

    /// Returns the beams of a sector; negative ones are to the right.
    fn sector_beams(&self, [from_rad, to_rad]: [f64; 2]) -> Option<RangeInclusive<isize>> {
        // Ends that are multiples of the step count as inside, whatever their rounding.
        let first = (from_rad / self.beam_step_rad() - 1e-9).ceil() as isize;
        let last = (to_rad / self.beam_step_rad() + 1e-9).floor() as isize;
        let side = self.beams_per_side as isize;
        let n = self.directions.len() as isize;
        let sees_all = 2 * side + 1 >= n && last.saturating_sub(first) < n;
        let is_seen = sees_all || (-side <= first && last <= side);
        // NaN would become beam 0.
        (from_rad <= to_rad && first <= last && is_seen).then_some(first..=last)
    }
}

/// The place from which a scan is made.
struct ScanPose<'a> {
    pose: &'a Pose2,
    /// The direction of the heading, by which each beam's direction is turned.
    turn: Point<2>,
}

fn obstacle_body(o: &Obstacle<2>) -> RobotBody {
    RobotBody { core: o.core, radius_m: o.radius_m }
}

fn laser_error(cause: String, remedy: &str) -> InputError {
    InputError::new("laser", cause, remedy)
}

fn is_moving(o: &Obstacle<2>) -> bool {
    o.velocity_m_s != [0.0; 2]
}

/// Returns the number of the last beam at an angle; a beam exactly there counts, whatever its rounding.
fn last_beam_within_angle(angle_rad: f64, step_rad: f64) -> usize {
    (angle_rad / step_rad + 1e-9) as usize
}

#[cfg(test)]
mod tests {
    use super::super::ray::tests::{core_strategy, marched_m};
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::Streams;
    use sidestep_rods::Obstacle;
    use sidestep_rods::geometry::add_scaled;

    fn draws() -> Draws {
        Streams::new(Seed(5)).draws(0, 0, LASER_NOISE)
    }

    fn scanned(
        laser: &Laser,
        pose: &Pose2,
        obstacles: &Obstacles<2>,
        bodies: &[RobotBody],
    ) -> LaserScan {
        let mut scan = LaserScan::default();
        let around = NearbyBodies { obstacles, robots: bodies.iter().copied() };
        laser.scan(pose, around, &mut draws(), &mut scan);
        scan
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn every_beam_goes_as_far_as_marching_does(
            cores in prop::collection::vec((core_strategy(), 0.01..0.5f64), 1..8),
            body in (core_strategy(), 0.01..0.5f64),
            at in prop::array::uniform2(-3.0..3.0f64), heading_rad in -3.1..3.1f64,
        ) {
            let laser = Laser::new(180, 3.2, PI, 0.0).unwrap();
            let pose = Pose2 { at, heading_rad };
            let all = cores.iter().map(|(core, r)| Obstacle::new_static(1, *core, *r)).collect();
            let obstacles = Obstacles::new(all, 1.0).unwrap();
            let bodies = [RobotBody { core: body.0, radius_m: body.1 }];
            let scan = scanned(&laser, &pose, &obstacles, &bodies);
            for beam in 0..180 {
                let toward = heading_rad + beam as f64 * TAU / 180.0;
                let u = [cos(toward), sin(toward)];
                let marched = cores.iter().chain([&body])
                    .filter_map(|(core, r)| marched_m(at, u, core, *r)).fold(3.2, f64::min);
                let seen = scan.ranges_m[beam];
                let grazes = cores.iter().chain([&body]).any(|(core, r)| {
                    let least = core.nearest_to_segment([at, add_scaled(at, u, 3.2)]).distance_m;
                    (least - r).abs() < 1e-6
                });
                prop_assert!((seen - marched).abs() < 1e-3 || grazes, "{beam}: {seen} {marched}");
            }
        }
    }

    #[test]
    fn sectors_hold_their_ends() {
        let laser = Laser::new(180, 3.2, f64::to_radians(90.0), 0.0).unwrap();
        let wall = Obstacle::capsule(0, [[-9.0, 0.6], [9.0, 0.6]], 0.0);
        let obstacles = Obstacles::new(vec![wall], 1.0).unwrap();
        let pose = Pose2 { at: [0.0, 0.0], heading_rad: 0.0 };
        let scan = scanned(&laser, &pose, &obstacles, &[]);
        let side = f64::to_radians(90.0);
        assert!((laser.min_sector_range_m(&scan, [0.0, side]).unwrap() - 0.6).abs() < 1e-12);
        assert_eq!(laser.min_sector_range_m(&scan, [-side, 0.0]), Some(3.2));
        assert_eq!(laser.min_sector_range_m(&scan, [0.0, side + 0.1]), None, "beyond the field");
    }

    #[test]
    fn errors_have_their_spread_and_belong_to_the_cycle() {
        let laser = Laser::new(180, 3.2, PI, 0.02).unwrap();
        let ring = Obstacle::ball(0, [0.0, 0.0], 0.1);
        let obstacles = Obstacles::new(vec![ring], 1.0).unwrap();
        let pose = Pose2 { at: [1.0, 0.0], heading_rad: PI };
        let mut ahead_m = Vec::new();
        for cycle in 0..500 {
            let mut scan = LaserScan::default();
            let mut noise = Streams::new(Seed(5)).draws(0, cycle, LASER_NOISE);
            let around = NearbyBodies { obstacles: &obstacles, robots: [] };
            laser.scan(&pose, around, &mut noise, &mut scan);
            ahead_m.push(scan.ranges_m[0]);
        }
        let mean = ahead_m.iter().sum::<f64>() / 500.0;
        let square = |x: f64| (x - mean) * (x - mean);
        let spread = (ahead_m.iter().map(|&x| square(x)).sum::<f64>() / 500.0).sqrt();
        assert!((mean - 0.9).abs() < 0.005 && (spread - 0.02).abs() < 0.003, "{mean} {spread}");
    }

    #[test]
    fn wrong_lasers_are_refused() {
        assert!(Laser::new(0, 3.2, PI, 0.0).is_err());
        assert!(Laser::new(180, 0.0, PI, 0.0).is_err());
        assert!(Laser::new(180, 3.2, 4.0, 0.0).is_err());
        assert!(Laser::new(180, 3.2, PI, f64::NAN).is_err());
    }
}
