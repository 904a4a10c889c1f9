//! Numbers, chains and surroundings that several tests share.

pub(super) mod convoy;
pub(super) mod random_worlds;

use super::ground::Corridor;
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_rods::geometry::{
    Point, add, add_scaled, between_segments, distance, first_axis, nearest_on_segment, normalized,
};
use sidestep_rods::{Chain, Connector, Obstacle, Obstacles, Rod};

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

/// A straight chain on the first axis, its leader at `lead_m`; the tail of a long one is still outside
/// the corridor.
pub(super) fn straight_chain(lead_m: f64, followers: usize, rod: Rod, radius_m: f64) -> Chain<2> {
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
        Self { numbers: TestRng::new(seed), u: first_axis() }
    }

    pub(super) fn next(&mut self, from: Point<D>, step_m: f64) -> Point<D> {
        let by = self.numbers.point(0.3);
        self.u = normalized(add(self.u, by)).expect("not zero");
        add_scaled(from, self.u, step_m)
    }
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
