//! Chains with every property that a chain may have, among obstacles of every kind.

use super::*;
use crate::fixtures::own_clearance_m;
use crate::geometry::{Core, Cuboid, NearestPoints, dot, normalized, perpendicular};
use std::f64::consts::PI;

/// A chain, its surroundings, and the rules of its reactions. All is well at the start.
pub(super) struct AnyWorld<const D: usize> {
    pub(super) chain: Chain<D>,
    pub(super) all: Vec<Obstacle<D>>,
    pub(super) obstacles: Obstacles<D>,
    pub(super) rules: Rules,
    pub(super) numbers: TestRng,
}

impl<const D: usize> AnyWorld<D> {
    pub(super) fn new(seed: u64) -> Self {
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
    pub(super) fn any_request(&mut self, half_m: f64) -> Request<D> {
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
    let (mut points, mut rods) = (vec![[0.0; D]], Vec::new());
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
    let normal = normalized(numbers.point(1.0)).unwrap_or(crate::geometry::first_axis());
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
    let u = normalized(numbers.point(1.0)).unwrap_or(crate::geometry::first_axis());
    let v = perpendicular(u);
    let w = std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % D, (i + 2) % D);
        u[j] * v[k] - u[k] * v[j]
    });
    std::array::from_fn(|axis| [u, v, w][axis])
}

/// Returns the distance of a chain from an obstacle.
pub(super) fn apart_m<const D: usize>(chain: &Chain<D>, o: &Obstacle<D>) -> f64 {
    (0..chain.points().len()).map(|i| -depth_of_part_m(chain, i, o)).fold(f64::INFINITY, f64::min)
}

/// Returns the depth of connector `i` and the rod before it in an obstacle.
pub(super) fn depth_of_part_m<const D: usize>(chain: &Chain<D>, i: usize, o: &Obstacle<D>) -> f64 {
    let p = chain.points();
    let depth_m =
        |nearest: NearestPoints<D>, radius_m: f64| radius_m + o.radius_m - nearest.distance_m;
    let tip_m = depth_m(o.core.nearest_to_point(p[i]), chain.connectors()[i].radius_m);
    let rod_m =
        |r: usize| depth_m(o.core.nearest_to_segment([p[r], p[r + 1]]), chain.rods()[r].radius_m);
    i.checked_sub(1).map_or(tip_m, |r| tip_m.max(rod_m(r)))
}
