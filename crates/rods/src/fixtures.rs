//! Numbers, chains and surroundings that several tests share.

use crate::geometry::{
    Point, add, add_scaled, between_segments, distance, first_axis, nearest_on_segment, normalized,
};
use crate::{Chain, Obstacle, Obstacles};
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};
use std::f64::consts::PI;

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

    /// Turns to any other direction, after a veto.
    pub(super) fn turn_anywhere(&mut self) {
        let by = self.numbers.point(1.0);
        self.u = normalized(by).unwrap_or(self.u);
    }
}

/// Draws of the places of obstacles.
const PLACES: Purpose = Purpose(101);

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
    let r = radius_m;
    let ball_size = if D == 2 { PI * r * r } else { 4.0 / 3.0 * PI * r * r * r };
    let cube_size: f64 = [2.0 * half_m; D].iter().product();
    let count = (part * cube_size / ball_size) as u32;
    let streams = Streams::new(Seed(seed));
    let ball = |id: u32| {
        let mut draws = streams.draws(id, 0, PLACES);
        let center: Point<D> = std::array::from_fn(|_| half_m * (2.0 * draws.uniform() - 1.0));
        let is_clear =
            distance(nearest_on_segment(center, [0.0; D], tail), center) > radius_m + keep_m;
        is_clear.then(|| Obstacle::ball(id, center, radius_m))
    };
    (0..count).filter_map(ball).collect()
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
    let points = chain.points();
    let rods = chain.rods();
    let connectors = chain.connectors();
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
