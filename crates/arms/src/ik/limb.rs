//! The part of a chain that a solve moves: the rods from the base to the connector that has a
//! target, in that order.

use sidestep_rods::geometry::{Point, norm, scaled, sub, unit_x};
use sidestep_rods::{Chain, Mobility, Rod};

/// Rods from a base outward, and the target of the tip, relative to the base.
#[derive(Debug, Clone, Default)]
pub(super) struct Limb<const D: usize> {
    /// Their least and greatest lengths.
    pub(super) spans: Vec<RodLengthRange>,
    /// Each rod as a vector from its inner to its outer connector.
    pub(super) vectors: Vec<Point<D>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RodLengthRange {
    pub(super) min_m: f64,
    pub(super) max_m: f64,
}

impl RodLengthRange {
    pub(super) fn from_rod(rod: &Rod) -> Self {
        Self { min_m: rod.min_m, max_m: rod.max_m }
    }

    #[inline]
    pub(super) fn clamp_m(&self, length_m: f64) -> f64 {
        length_m.max(self.min_m).min(self.max_m)
    }
}

/// Least and greatest distance of a limb's tip from its base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachShell {
    /// 0 unless one rod is longer than all the others together.
    pub hole_m: f64,
    /// The sum of the greatest lengths.
    pub reach_m: f64,
}

impl ReachShell {
    /// Returns the distances at which these rods can hold their ends, if they bend without limit.
    pub(super) fn from_length_ranges(spans: &[RodLengthRange]) -> Self {
        let reach_m: f64 = spans.iter().map(|s| s.max_m).sum();
        // Take one rod as short as possible, against all others as long as possible.
        let longest_m = spans.iter().map(|s| s.min_m + s.max_m).fold(0.0, f64::max);
        Self { hole_m: (longest_m - reach_m).max(0.0), reach_m }
    }

    /// Returns the point nearest to `target` that a tip can reach, from a base at the origin.
    pub(super) fn nearest<const D: usize>(&self, target: Point<D>) -> Point<D> {
        let far_m = norm(target);
        if far_m > self.reach_m {
            scaled(target, self.reach_m / far_m)
        } else if far_m >= self.hole_m {
            target
        } else if far_m > 0.0 {
            scaled(target, self.hole_m / far_m)
        } else {
            scaled(unit_x(), self.hole_m)
        }
    }
}

/// Returns the indices of the connectors from `base` to `k`, both included.
pub(super) fn connector_indices(base: usize, k: usize) -> impl Iterator<Item = usize> + Clone {
    let n = base.abs_diff(k);
    (0..=n).map(move |i| if k > base { base + i } else { base - i })
}

impl<const D: usize> Limb<D> {
    /// Reads the rods from `base` to `k` of a chain with its connectors at `points`.
    pub(super) fn read(&mut self, chain: &Chain<D>, points: &[Point<D>], base: usize, k: usize) {
        self.spans.clear();
        self.vectors.clear();
        let rods = chain.rods();
        if k > base {
            self.spans.extend(rods[base..k].iter().map(RodLengthRange::from_rod));
            self.vectors.extend(points[base..=k].windows(2).map(|p| sub(p[1], p[0])));
        } else {
            self.spans.extend(rods[k..base].iter().rev().map(RodLengthRange::from_rod));
            self.vectors.extend(points[k..=base].windows(2).rev().map(|p| sub(p[0], p[1])));
        }
    }
}

/// Returns the connector nearest to `k` between it and `base` that never moves: the effective base.
pub(super) fn nearest_fixed_connector<const D: usize>(
    chain: &Chain<D>,
    base: usize,
    k: usize,
) -> usize {
    let inward = connector_indices(k, base).skip(1);
    let mut still = inward.filter(|&i| chain.connectors()[i].is_still());
    still.next().unwrap_or(base)
}

/// Returns whether all connectors except the base move and bend without limit.
pub(super) fn is_unconstrained<const D: usize>(chain: &Chain<D>, base: usize) -> bool {
    let mut all = chain.connectors().iter().enumerate();
    chain.is_plain()
        || all.all(|(i, c)| {
            i == base
                || c.mobility == Mobility::Free
                    && !c.failed
                    && c.max_bend_rad >= std::f64::consts::PI
        })
}
