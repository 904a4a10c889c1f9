//! Several motions of one end of a chain at once, if nothing is in the way.
//!
//! One motion is a series of dependent square roots and divisions, each of which the processor
//! waits for. Motion `w` can be at connector `j - w` while motion 0 is at connector `j`: all lanes
//! are independent, and each computes the same bits as the motions one after the other.

#![expect(
    clippy::needless_range_loop,
    reason = "an index is a lane or a coordinate of several arrays"
)]

use super::candidates::{clamped, guided};
use super::chain::{Chain, Rod, is_in_range, out_of_range};
use super::geometry::Point;
use super::propagate::Propagator;
use super::veto::Request;
use super::{Obstacles, Rules};
use sidestep_kernel::InputError;

/// Motions at once: enough to keep the units for roots and divisions busy.
pub const LANES: usize = 12;

/// Number of motions below which one after the other is faster.
const WORTH_IT: usize = 3;

/// Moves the first connector through `heads`, one after the other, like the same number of
/// requests.
///
/// # Errors
/// When a target is not finite, or the chain has a connector that is not free or has a bend limit:
/// then a connector might object, and the motions must be made one by one.
pub fn pull_first<const D: usize>(
    chain: &mut Chain<D>,
    heads: &[Point<D>],
) -> Result<(), InputError> {
    if !chain.is_plain() {
        return Err(InputError::new(
            "chain",
            "has a connector that may object",
            "move it by single requests",
        ));
    }
    if let Some(head) = heads.iter().find(|head| !is_in_range(head)) {
        return Err(out_of_range(head));
    }
    let mut propagator = Propagator::new(Rules::default());
    for group in heads.chunks(LANES) {
        if group.len() >= WORTH_IT {
            pull_lanes(chain, group);
            continue;
        }
        for head in group {
            propagator.propagate(chain, &Obstacles::default(), &Request::exact(0, *head))?;
        }
    }
    Ok(())
}

/// One coordinate of the connectors that lanes are at: lane `w` has its slave at `w` and its
/// master at `w + 1`, which is where lane `w + 1` has its slave.
type Row = [f64; LANES + 1];

/// Positions of the connectors that lanes are at, lane 0 farthest along the chain.
#[derive(Clone, Copy)]
struct Front<const D: usize> {
    rows: [Row; D],
}

impl<const D: usize> Front<D> {
    /// Returns positions apart from each other, which nothing reads.
    fn nobody() -> Self {
        Self { rows: [std::array::from_fn(|w| -4.0 * w as f64); D] }
    }

    fn get(&self, k: usize) -> Point<D> {
        std::array::from_fn(|i| self.rows[i][k])
    }

    fn set(&mut self, k: usize, p: Point<D>) {
        for i in 0..D {
            self.rows[i][k] = p[i];
        }
    }
}

/// Limits of the rods that lanes are at.
struct Limits {
    min_m: [f64; LANES],
    max_m: [f64; LANES],
    /// Number of rods in a row that equal the last.
    alike: usize,
}

impl Limits {
    /// Passes every lane's rod on to the next lane, and a new one to the first.
    #[inline]
    fn shift(&mut self, next: Rod) {
        let is_as_last = next.min_m == self.min_m[0] && next.max_m == self.max_m[0];
        self.alike = if is_as_last { self.alike + 1 } else { 0 };
        if self.alike < LANES {
            self.min_m.copy_within(..LANES - 1, 1);
            self.max_m.copy_within(..LANES - 1, 1);
            (self.min_m[0], self.max_m[0]) = (next.min_m, next.max_m);
        }
    }
}

/// Computes the reaction of every lane's slave: [`guided`], lane by lane. Before the call, `next`
/// holds the positions of one connector ago; after it, those of the slaves that now become masters.
#[inline]
fn react<const D: usize>(now: &Front<D>, next: &mut Front<D>, limits: &Limits, least_move_m: f64) {
    let mut g = [[0.0; LANES]; D];
    let mut square = [0.0; LANES];
    for i in 0..D {
        for w in 0..LANES {
            g[i][w] = now.rows[i][w] - now.rows[i][w + 1];
            square[w] += g[i][w] * g[i][w];
        }
    }
    let d = square.map(f64::sqrt);
    if any(d.map(|d| d == 0.0)) {
        return react_one_by_one(now, next, limits, least_move_m);
    }
    let (mut part, mut stays) = ([0.0; LANES], [false; LANES]);
    for w in 0..LANES {
        let t = clamped(d[w], limits.min_m[w], limits.max_m[w]);
        stays[w] = (t - d[w]).abs() <= least_move_m;
        part[w] = t / d[w];
    }
    for i in 0..D {
        for w in 0..LANES {
            next.rows[i][w + 1] = now.rows[i][w + 1] + g[i][w] * part[w];
        }
    }
    if any(stays) {
        for w in (0..LANES).filter(|&w| stays[w]) {
            next.set(w + 1, now.get(w));
        }
    }
}

/// Whether any lane is true; looks at all lanes at once, because a search would branch at each.
#[inline]
fn any(lanes: [bool; LANES]) -> bool {
    lanes.iter().fold(false, |any, &is| any | is)
}

#[cold]
fn react_one_by_one<const D: usize>(
    now: &Front<D>,
    next: &mut Front<D>,
    limits: &Limits,
    least_move_m: f64,
) {
    // Downward, because lane w - 1 still needs its master's old position, at w - 1.
    for w in (0..LANES).rev() {
        let places = [next.get(w), now.get(w + 1), now.get(w)];
        let rod = Rod { min_m: limits.min_m[w], max_m: limits.max_m[w], radius_m: 0.0 };
        next.set(w + 1, guided(places, rod, least_move_m));
    }
}

/// Makes as many motions as there are heads, at most one per lane. Lanes without a head, not yet at
/// a connector, or past the last one compute values that nothing reads.
fn pull_lanes<const D: usize>(chain: &mut Chain<D>, heads: &[Point<D>]) {
    let least_move_m = chain.least_move_m();
    let (points, rods) = chain.parts_mut();
    let nobody = Rod { min_m: 1.0, max_m: 1.0, radius_m: 0.0 };
    let mut limits = Limits { min_m: [1.0; LANES], max_m: [1.0; LANES], alike: LANES };
    let (mut now, mut next) = (Front::nobody(), Front::nobody());
    for j in 0..points.len() + heads.len() - 1 {
        // Past the last, never at the place before, so that no rod has length zero.
        let beyond = || super::geometry::scaled(super::geometry::first_axis(), 4.0 * j as f64);
        now.set(0, points.get(j).copied().unwrap_or_else(beyond));
        limits.shift(rods.get(j.wrapping_sub(1)).copied().unwrap_or(nobody));
        react(&now, &mut next, &limits, least_move_m);
        if let Some(head) = heads.get(j) {
            // Lane j is at connector 0, which goes to its head.
            next.set(j + 1, *head);
        }
        if j + 1 >= heads.len() {
            points[j + 1 - heads.len()] = next.get(heads.len());
        }
        std::mem::swap(&mut now, &mut next);
    }
}

#[cfg(test)]
mod tests {
    use super::super::chain::Connector;
    use super::*;
    use crate::scenes::Wanderer;
    use proptest::prelude::*;

    fn same_bits<const D: usize>(n_rods: usize, rod: Rod, n_heads: usize, step_m: f64, seed: u64) {
        let axis = super::super::geometry::first_axis();
        let mut one_by_one =
            Chain::<D>::straight([0.0; D], axis, n_rods, rod, Connector::free(0.0)).unwrap();
        let mut walk = Wanderer::new(seed);
        let mut heads: Vec<Point<D>> = Vec::new();
        let mut at = [0.0; D];
        for _ in 0..n_heads {
            at = walk.next(at, step_m);
            heads.push(at);
        }
        let mut at_once = one_by_one.clone();
        let mut propagator = Propagator::default();
        for head in &heads {
            let request = Request::exact(0, *head);
            propagator.propagate(&mut one_by_one, &Obstacles::default(), &request).unwrap();
        }
        pull_first(&mut at_once, &heads).unwrap();
        assert_eq!(at_once.points(), one_by_one.points());
    }

    proptest! {
        #[test]
        fn lanes_are_motions_one_after_the_other(
            n_rods in 0usize..40, slack in 0.0..0.5f64, n_heads in 0usize..30,
            step_m in 0.01..2.0f64, seed in 0u64..100,
        ) {
            let rod = Rod { min_m: 1.0 - slack, max_m: 1.0, radius_m: 0.0 };
            same_bits::<2>(n_rods, rod, n_heads, step_m, seed);
            same_bits::<3>(n_rods, rod, n_heads, step_m, seed);
        }
    }

    #[test]
    fn a_head_on_its_slave_is_no_trouble() {
        let rod = Rod::fixed(1.0, 0.0);
        let mut chain =
            Chain::straight([0.0; 2], [1.0, 0.0], 3, rod, Connector::free(0.0)).unwrap();
        let mut single = chain.clone();
        pull_first(&mut chain, &[[1.0, 0.0]; LANES]).unwrap();
        let request = Request::exact(0, [1.0, 0.0]);
        Propagator::default().propagate(&mut single, &Obstacles::default(), &request).unwrap();
        assert_eq!(chain.points(), single.points());
    }
}
