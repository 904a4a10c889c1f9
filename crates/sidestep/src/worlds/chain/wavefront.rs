//! Several motions of one end of a chain at once, where nothing is in the way.
//!
//! One motion is a chain of dependent square roots and divisions, and a processor that waits.
//! Motion `w` can be at connector `j - w` while motion 0 is at connector `j`: all lanes are
//! independent, and every one computes what the motions one after the other would compute, to
//! the bit.

#![expect(
    clippy::needless_range_loop,
    reason = "an index is a lane or a coordinate of several arrays"
)]

use super::candidates::guided;
use super::chain::{Chain, Rod, is_in_range, out_of_range};
use super::geometry::Point;
use super::propagate::Propagator;
use super::veto::Request;
use super::{Obstacles, Rules};
use sidestep_kernel::InputError;

/// Motions at once. Eight keep the units for roots and divisions busy.
pub const LANES: usize = 8;

/// Moves the first connector through `heads`, one after the other, as as many requests would.
///
/// # Errors
/// A target that is not finite, a chain with a connector that is not free or has a bend limit:
/// somebody might object, and then the motions must be made one by one.
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
    let mut groups = heads.chunks_exact(LANES);
    for group in &mut groups {
        pull_lanes(chain, group);
    }
    let mut propagator = Propagator::new(Rules::default());
    for head in groups.remainder() {
        propagator.propagate(chain, &Obstacles::default(), &Request::exact(0, *head))?;
    }
    Ok(())
}

/// One coordinate of every lane.
type Lane = [f64; LANES];

/// What every lane knows: lane `w` is `w` connectors behind lane 0.
struct Lanes<const D: usize> {
    /// The master's new place.
    master: [Lane; D],
    /// The slave's old place, and the master's.
    slave: [Lane; D],
    was: [Lane; D],
    min_m: Lane,
    max_m: Lane,
}

impl<const D: usize> Lanes<D> {
    /// Hands every lane's connector to the next lane, and a new one to the first.
    #[inline]
    fn shift(&mut self, next: Point<D>, rod: Rod) {
        for i in 0..D {
            self.was[i] = self.slave[i];
            self.slave[i] = shifted(&self.master[i], next[i]);
        }
        self.min_m = shifted(&self.min_m, rod.min_m);
        self.max_m = shifted(&self.max_m, rod.max_m);
    }

    /// The reaction of every lane's slave: [`guided`], lane by lane.
    #[inline]
    fn react(&mut self, least_move_m: f64) {
        let mut g = [[0.0; LANES]; D];
        let mut square = [0.0; LANES];
        for i in 0..D {
            for w in 0..LANES {
                g[i][w] = self.slave[i][w] - self.master[i][w];
                square[w] += g[i][w] * g[i][w];
            }
        }
        let d = square.map(f64::sqrt);
        if d.contains(&0.0) {
            return self.react_one_by_one(least_move_m);
        }
        let (mut part, mut stays) = ([0.0; LANES], [false; LANES]);
        for w in 0..LANES {
            let t = d[w].max(self.min_m[w]).min(self.max_m[w]);
            stays[w] = (t - d[w]).abs() <= least_move_m;
            part[w] = t / d[w];
        }
        for i in 0..D {
            for w in 0..LANES {
                let moved = self.master[i][w] + g[i][w] * part[w];
                self.master[i][w] = if stays[w] { self.slave[i][w] } else { moved };
            }
        }
    }

    #[cold]
    fn react_one_by_one(&mut self, least_move_m: f64) {
        for w in 0..LANES {
            let of = |lanes: &[Lane; D]| -> Point<D> { std::array::from_fn(|i| lanes[i][w]) };
            let places = [of(&self.was), of(&self.master), of(&self.slave)];
            let rod = Rod { min_m: self.min_m[w], max_m: self.max_m[w], radius_m: 0.0 };
            let new = guided(places, rod, least_move_m);
            for i in 0..D {
                self.master[i][w] = new[i];
            }
        }
    }
}

#[inline]
fn shifted(lane: &Lane, first: f64) -> Lane {
    std::array::from_fn(|w| if w == 0 { first } else { lane[w - 1] })
}

/// Eight motions: lanes that are not at a connector yet, or past the last, compute on rods of
/// length 1 that nobody reads.
fn pull_lanes<const D: usize>(chain: &mut Chain<D>, heads: &[Point<D>]) {
    let n = chain.points().len();
    let least_move_m = chain.least_move_m();
    let nobody = Rod { min_m: 1.0, max_m: 1.0, radius_m: 0.0 };
    let mut lanes = Lanes {
        master: [[0.0; LANES]; D],
        slave: [[0.0; LANES]; D],
        was: [[0.0; LANES]; D],
        min_m: [1.0; LANES],
        max_m: [1.0; LANES],
    };
    let mut beyond = super::geometry::first_axis();
    for j in 0..n + LANES - 1 {
        let (point, rod) = if j < n {
            (chain.points()[j], chain.rods()[..n - 1].get(j.wrapping_sub(1)).copied())
        } else {
            // Never at the place before, so that nobody's rod has no length.
            beyond[0] += 4.0;
            (beyond, None)
        };
        lanes.shift(point, rod.unwrap_or(nobody));
        let head = (j < LANES).then(|| heads[j]);
        lanes.react(least_move_m);
        if let Some(head) = head {
            // Lane j is at connector 0: it goes where it is told.
            for i in 0..D {
                lanes.master[i][j] = head[i];
            }
        }
        if j + 1 >= LANES {
            let done = std::array::from_fn(|i| lanes.master[i][LANES - 1]);
            chain.points_mut()[j + 1 - LANES] = done;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::chain::Connector;
    use super::super::scenes::Wanderer;
    use super::*;
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
