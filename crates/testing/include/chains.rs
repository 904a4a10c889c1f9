//! Numbers, chains of rods and their surroundings that the tests of several crates share.
//!
//! The unit tests of `sidestep-rods` and of `sidestep-chain` include this file as a module. It is no module of
//! `sidestep-testing`, because a library built for its own unit tests is another crate than the one that its
//! dependencies see, so that their types would differ.

use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_rods::geometry::{
    Core, Cuboid, NearestPoints, Point, add, add_scaled, between_segments, distance, dot,
    first_axis, nearest_on_segment, normalized, perpendicular, scaled, sub,
};
use sidestep_rods::{
    Chain, Connector, Mobility, Motion, Obstacle, Obstacles, Request, RequestSource, Rod, Rules,
    VetoEffect,
};
use std::f64::consts::PI;

/// Pseudo-random numbers in [0, 1) by (seed, index).
pub(crate) struct TestRng {
    streams: Streams,
    next: u64,
}

impl TestRng {
    pub(crate) fn new(seed: u64) -> Self {
        Self { streams: Streams::new(Seed(seed)), next: 0 }
    }

    pub(crate) fn unit(&mut self) -> f64 {
        self.next += 1;
        f64::from(self.streams.block(0, self.next, Purpose(1), 0)[0]) / 4_294_967_296.0
    }

    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn point<const D: usize>(&mut self, half_m: f64) -> Point<D> {
        std::array::from_fn(|_| self.uniform(-half_m, half_m))
    }
}

/// A wandering leader: every step goes in a random direction within a cone around the last one.
pub(crate) struct Wanderer<const D: usize> {
    numbers: TestRng,
    u: Point<D>,
}

impl<const D: usize> Wanderer<D> {
    pub(crate) fn new(seed: u64) -> Self {
        Self { numbers: TestRng::new(seed), u: first_axis() }
    }

    pub(crate) fn next(&mut self, from: Point<D>, step_m: f64) -> Point<D> {
        let by = self.numbers.point(0.3);
        self.u = normalized(add(self.u, by)).expect("not zero");
        add_scaled(from, self.u, step_m)
    }

    /// Turns to any other direction, after a veto.
    pub(crate) fn turn_anywhere(&mut self) {
        let by = self.numbers.point(1.0);
        self.u = normalized(by).unwrap_or(self.u);
    }
}

/// Draws of the places of obstacles.
const PLACES: Purpose = Purpose(101);

/// Random balls that fill a part of a cube, none near the first axis behind the origin.
pub(crate) fn ball_field<const D: usize>(
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
pub(crate) fn clearance_m<const D: usize>(chain: &Chain<D>, obstacles: &Obstacles<D>) -> f64 {
    let points = chain.points();
    let tip = |i: usize| obstacles.clearance_m([points[i]; 2], chain.connectors()[i].radius_m, 1.0);
    let rod =
        |i: usize| obstacles.clearance_m([points[i], points[i + 1]], chain.rods()[i].radius_m, 1.0);
    let tips = (0..points.len()).map(tip).fold(1.0, f64::min);
    (0..chain.rods().len()).map(rod).fold(tips, f64::min)
}

/// Returns the least clearance of a chain from itself: of discs more than one index apart, rods
/// more than two, and discs from rods that are not neighbors.
pub(crate) fn own_clearance_m<const D: usize>(chain: &Chain<D>) -> f64 {
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

/// A chain, its surroundings, and the rules of its reactions. All is well at the start.
pub(crate) struct AnyWorld<const D: usize> {
    pub(crate) chain: Chain<D>,
    pub(crate) all: Vec<Obstacle<D>>,
    pub(crate) obstacles: Obstacles<D>,
    pub(crate) rules: Rules,
    pub(crate) numbers: TestRng,
}

impl<const D: usize> AnyWorld<D> {
    pub(crate) fn new(seed: u64) -> Self {
        let mut numbers = TestRng::new(seed);
        let mut chain = any_chain(seed, &mut numbers);
        constrain(&mut chain, &mut numbers);
        let n = (numbers.unit() * 40.0) as u32;
        let all: Vec<_> = (0..n).map(|id| any_obstacle(id, &mut numbers)).collect();
        let all: Vec<_> = all.into_iter().filter(|o| apart_m(&chain, o) > 1e-3).collect();
        let obstacles = Obstacles::new(all.clone(), 0.8).unwrap();
        let self_collision = numbers.unit() < 0.5 && own_clearance_m(&chain) > 1e-3;
        let slave_step_max_m = if numbers.unit() < 0.25 { 0.1 } else { f64::INFINITY };
        let rules = Rules { self_collision, slave_step_max_m, ..Rules::default() };
        Self { chain, all, obstacles, rules, numbers }
    }

    /// A request that moves a connector to within `half_m` of its place, or a rod rigidly.
    pub(crate) fn any_request(&mut self, half_m: f64) -> Request<D> {
        let numbers = &mut self.numbers;
        let n = self.chain.points().len();
        let k = (numbers.unit() * n as f64) as usize;
        let by = numbers.point(half_m);
        let at = |k: usize| add(self.chain.points()[k], by);
        let motion = if k + 1 < n && numbers.unit() < 0.2 {
            Motion::Rod { i: k, to: [at(k), at(k + 1)] }
        } else {
            Motion::Connector { k, to: at(k) }
        };
        let mode =
            if numbers.unit() < 0.3 { VetoEffect::AsFarAsPossible } else { VetoEffect::Exact };
        Request { motion, source: RequestSource::Planner, mode }
    }
}

fn any_chain<const D: usize>(seed: u64, numbers: &mut TestRng) -> Chain<D> {
    let n_rods = 1 + (numbers.unit() * 10.0) as usize;
    let mut walk = Wanderer::<D>::new(seed);
    let mut points = vec![[0.0; D]];
    let mut rods = Vec::new();
    let radii_m: Vec<f64> = (0..=n_rods).map(|_| numbers.uniform(0.02, 0.1)).collect();
    for i in 0..n_rods {
        let length_m = numbers.uniform(0.3, 0.6);
        let slack_m = if numbers.unit() < 0.5 { 0.0 } else { numbers.uniform(0.0, 0.1) };
        let radius_m = radii_m[i].min(radii_m[i + 1]) * numbers.unit();
        rods.push(Rod { min_m: length_m - slack_m, max_m: length_m + slack_m, radius_m });
        points.push(walk.next(points[i], length_m));
    }
    Chain::new(points, radii_m.into_iter().map(Connector::free).collect(), rods).unwrap()
}

/// Bend limits for some chains, and one connector that is not free for some.
fn constrain<const D: usize>(chain: &mut Chain<D>, numbers: &mut TestRng) {
    let n = chain.points().len();
    if numbers.unit() < 0.5 {
        for i in 0..n {
            let bend_rad = chain.bend_rad(i).unwrap_or(0.0);
            let limit_rad = numbers.uniform(0.4, PI).max(bend_rad + 0.05).min(PI);
            chain.set_max_bend_rad(i, limit_rad).unwrap();
        }
    }
    let k = (numbers.unit() * n as f64) as usize;
    let at = chain.points()[k];
    let normal = normalized(numbers.point(1.0)).unwrap_or(first_axis());
    let mobility = match (numbers.unit() * 15.0) as usize {
        0 => Mobility::Fixed,
        1 => Mobility::OnPlane { normal, offset_m: dot(normal, at) },
        2 => Mobility::OnSegment([sub(at, scaled(normal, 0.2)), add(at, scaled(normal, 0.3))]),
        3 => Mobility::InBox { lo: at.map(|x| x - 0.1), hi: at.map(|x| x + 0.2) },
        4 => return chain.set_failed(k, true),
        _ => Mobility::Free,
    };
    chain.set_mobility(k, mobility).unwrap();
}

fn any_obstacle<const D: usize>(id: u32, numbers: &mut TestRng) -> Obstacle<D> {
    let at: Point<D> = numbers.point(3.0);
    let thin_m = if numbers.unit() < 0.5 { 0.0005 } else { numbers.uniform(0.01, 0.3) };
    match (numbers.unit() * 3.0) as usize {
        0 => Obstacle::ball(id, at, thin_m.max(0.02)),
        1 => Obstacle::capsule(id, [at, add(at, numbers.point(0.8))], thin_m),
        _ => {
            let half_m = std::array::from_fn(|_| numbers.uniform(0.001, 0.4));
            let axes = any_axes(numbers);
            Obstacle::still(id, Core::Cuboid(Cuboid { center: at, axes, half_m }), 0.1 * thin_m)
        }
    }
}

fn any_axes<const D: usize>(numbers: &mut TestRng) -> [Point<D>; D] {
    let u = normalized(numbers.point(1.0)).unwrap_or(first_axis());
    let v = perpendicular(u);
    let w = std::array::from_fn(|i| {
        let j = (i + 1) % D;
        let k = (i + 2) % D;
        u[j] * v[k] - u[k] * v[j]
    });
    std::array::from_fn(|axis| [u, v, w][axis])
}

/// Returns the distance of a chain from an obstacle.
pub(crate) fn apart_m<const D: usize>(chain: &Chain<D>, o: &Obstacle<D>) -> f64 {
    (0..chain.points().len()).map(|i| -depth_of_part_m(chain, i, o)).fold(f64::INFINITY, f64::min)
}

/// Returns the depth of connector `i` and the rod before it in an obstacle.
pub(crate) fn depth_of_part_m<const D: usize>(chain: &Chain<D>, i: usize, o: &Obstacle<D>) -> f64 {
    let p = chain.points();
    let depth_m =
        |nearest: NearestPoints<D>, radius_m: f64| radius_m + o.radius_m - nearest.distance_m;
    let tip_m = depth_m(o.core.nearest_to_point(p[i]), chain.connectors()[i].radius_m);
    let rod_m =
        |r: usize| depth_m(o.core.nearest_to_segment([p[r], p[r + 1]]), chain.rods()[r].radius_m);
    i.checked_sub(1).map_or(tip_m, |r| tip_m.max(rod_m(r)))
}
