//! Postures to start from: the present one, its mirror image, and random ones.

use super::ChainIkGoal;
use super::limb;
use sidestep_kernel::Seed;
use sidestep_kernel::distr::normal;
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use sidestep_rods::Chain;
use sidestep_rods::geometry::{Point, add, add_scaled, dot, normalized, scaled, sub, unit_x};

/// A stream of its own, so that no other draw shifts these.
const START: Purpose = Purpose(0x1C);

/// Lengths of the random vector that is added to the direction of each rod: from nearly straight limbs, which go past
/// obstacles, to coiled ones, which fit between them.
const SPREADS: [f64; 4] = [0.15, 0.4, 0.8, 1.5];

/// Returns start number `index`: 0 is the present posture, 1 its mirror image across the line from
/// base to target, the others are random walks of random stiffness.
pub(super) fn start<const D: usize>(
    chain: &Chain<D>,
    goal: &ChainIkGoal<D>,
    index: usize,
) -> Vec<Point<D>> {
    let mut points = chain.points().to_vec();
    let end = if goal.k > goal.base { points.len() - 1 } else { 0 };
    match index {
        0 => {}
        1 => mirror(&mut points, goal, end),
        _ => place_random_walk(&mut points, chain, goal, end, index),
    }
    points
}

fn mirror<const D: usize>(points: &mut [Point<D>], goal: &ChainIkGoal<D>, end: usize) {
    let home = points[goal.base];
    let u = normalized(sub(goal.target, home)).unwrap_or(unit_x());
    for i in limb::connector_indices(goal.base, end).skip(1) {
        let v = sub(points[i], home);
        points[i] = add_scaled(add(home, scaled(u, 2.0 * dot(v, u))), v, -1.0);
    }
}

fn place_random_walk<const D: usize>(
    points: &mut [Point<D>],
    chain: &Chain<D>,
    goal: &ChainIkGoal<D>,
    end: usize,
    index: usize,
) {
    let mut draws = Streams::new(Seed(goal.seed)).draws(0, index as u64, START);
    let spread = SPREADS[draws.uniform_below(SPREADS.len() as u32) as usize];
    let mut u = random_direction(&mut draws);
    let mut inner = goal.base;
    for i in limb::connector_indices(goal.base, end).skip(1) {
        points[i] = add_scaled(points[inner], u, chain.length_m(inner.min(i)));
        u = normalized(add_scaled(u, random_direction(&mut draws), spread)).unwrap_or(u);
        inner = i;
    }
}

fn random_direction<const D: usize>(draws: &mut Draws) -> Point<D> {
    let drawn: Point<D> = std::array::from_fn(|_| normal(draws));
    normalized(drawn).unwrap_or(unit_x())
}
