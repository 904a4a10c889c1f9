//! Scenes that several tests share.

use super::ground::Corridor;
use super::ground::fields::Field;
use super::rods::chain::{Chain, Connector, Rod};
use super::rods::geometry::{Bounds, Core, Point, between_segments, distance, nearest_on_segment};
use super::rods::obstacle::{Obstacle, Obstacles};
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};

/// Pseudo-random numbers in [0, 1) by (seed, index).
pub(super) struct TestRng {
    streams: Streams,
    next: u64,
}

impl TestRng {
    pub(super) fn new(seed: u64) -> Self {
        Self { streams: Streams::new(Seed(seed)), next: 0 }
    }

    pub(super) fn unit(&mut self) -> f64 {
        self.next += 1;
        f64::from(self.streams.block(0, self.next, Purpose(1), 0)[0]) / 4_294_967_296.0
    }

    pub(super) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(super) fn point<const D: usize>(&mut self, half_m: f64) -> Point<D> {
        std::array::from_fn(|_| self.uniform(-half_m, half_m))
    }
}

/// Poses along the center line of the corridor of the measurements.
pub(super) fn corridor_line(step_m: f64) -> Vec<([f64; 2], f64)> {
    let line = Corridor::pinned(1.0).expect("a width").center_line(step_m);
    line.into_iter().map(|pose| (pose.at, pose.heading_rad)).collect()
}

/// The walls of that corridor.
pub(super) fn corridor_walls(width_m: f64) -> Vec<Obstacle<2>> {
    Corridor::pinned(width_m).expect("a width").walls(0)
}

/// Robots in a row on the first axis, the leader at `lead_m`; the tail of a long convoy is still
/// outside the corridor.
pub(super) fn convoy(lead_m: f64, followers: usize, rod: Rod, radius_m: f64) -> Chain<2> {
    Chain::straight([lead_m, 0.0], [-1.0, 0.0], followers, rod, Connector::free(radius_m))
        .expect("a straight chain is right")
}

/// A wandering leader: every step goes in a random direction within a cone around the last one.
pub(super) struct Wanderer<const D: usize> {
    numbers: TestRng,
    u: Point<D>,
}

impl<const D: usize> Wanderer<D> {
    pub(super) fn new(seed: u64) -> Self {
        Self { numbers: TestRng::new(seed), u: super::rods::geometry::first_axis() }
    }

    pub(super) fn next(&mut self, from: Point<D>, step_m: f64) -> Point<D> {
        let by = self.numbers.point(0.3);
        self.u = super::rods::geometry::normalized(super::rods::geometry::add(self.u, by))
            .expect("not zero");
        super::rods::geometry::add_scaled(from, self.u, step_m)
    }

    /// Turns to any other direction, after a veto.
    pub(super) fn turn_anywhere(&mut self) {
        let by = self.numbers.point(1.0);
        self.u = super::rods::geometry::normalized(by).unwrap_or(self.u);
    }
}

/// Random balls that fill a part of a cube, none near the first axis behind the origin.
pub(super) fn ball_field<const D: usize>(
    seed: u64,
    half_m: f64,
    part: f64,
    radius_m: f64,
    keep_m: f64,
) -> Vec<Obstacle<D>> {
    let mut tail = [0.0; D];
    tail[0] = -half_m;
    let field = Field {
        room: Bounds { lo: [-half_m; D], hi: [half_m; D] },
        part,
        radius_m,
        length_m: 0.0,
        keep_clear: vec![Core::Segment([[0.0; D], tail])],
        keep_m,
    };
    field.fill(Seed(seed), 0).expect("a field")
}

/// Returns the least clearance of any connector and any rod from obstacles, up to 1 m.
pub(super) fn clearance_m<const D: usize>(chain: &Chain<D>, obstacles: &Obstacles<D>) -> f64 {
    let points = chain.points();
    let tip = |i: usize| obstacles.clearance_m([points[i]; 2], chain.connectors()[i].radius_m, 1.0);
    let rod =
        |i: usize| obstacles.clearance_m([points[i], points[i + 1]], chain.rods()[i].radius_m, 1.0);
    let tips = (0..points.len()).map(tip).fold(1.0, f64::min);
    (0..chain.rods().len()).map(rod).fold(tips, f64::min)
}

/// Returns the least clearance of a chain from itself: of discs more than one index apart, rods
/// more than two, and discs from rods that are not neighbors.
pub(super) fn own_clearance_m<const D: usize>(chain: &Chain<D>) -> f64 {
    let (points, rods, connectors) = (chain.points(), chain.rods(), chain.connectors());
    let rod = |i: usize| [points[i], points[i + 1]];
    let mut least_m = f64::INFINITY;
    for i in 0..points.len() {
        for j in i + 2..points.len() {
            let apart_m = distance(points[i], points[j]);
            least_m = least_m.min(apart_m - connectors[i].radius_m - connectors[j].radius_m);
        }
        for j in (0..rods.len()).filter(|&j| i + 1 < j || i > j + 2) {
            let apart_m =
                distance(nearest_on_segment(points[i], points[j], points[j + 1]), points[i]);
            least_m = least_m.min(apart_m - connectors[i].radius_m - rods[j].radius_m);
        }
    }
    for i in 0..rods.len() {
        for j in i + 3..rods.len() {
            let apart_m = between_segments(rod(i), rod(j)).distance_m;
            least_m = least_m.min(apart_m - rods[i].radius_m - rods[j].radius_m);
        }
    }
    least_m
}
