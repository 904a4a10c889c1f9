//! The objective of the paper (eq. 8 to 11): separation against deviation.
//!
//! ```text
//! G(x)       = sum_{i != j} Gcol_i(x_i, x_j) + alpha sum_i Gdev_i(x_i)                (8, 9, 10)
//! Gcol_i     = sum_k beta^(k-1) max(R_i - |f_i(x_i, k) - f_j(x_j, k)|, 0)^2           (9)
//! Gdev_i     = |f_i(x_i, kmax) - f_i(x_i_opt, kmax)|^2                                (10)
//! ```

mod action_predictions;
mod group_game;
mod slices;
#[cfg(test)]
mod tests;

pub(crate) use action_predictions::ActionChanges;
pub use action_predictions::ActionPredictions;
pub use group_game::build_group_game;
pub(super) use group_game::{add_pair_costs, own_costs};

use super::flight::{PairPlane, Point, Prediction};
use super::non_cooperative::NonCooperativeAircraft;
use serde::{Deserialize, Serialize};
use sidestep_kernel::geometry::{norm_squared, sub};
use slices::SLICE;

/// The weights of separation and deviation.
///
/// Where actions change levels and speeds, a deviation is of all three:
/// `|dx|^2 + level_weight dh^2 + speed_weight (dv T)^2`, with the difference `dx` of places at the horizon `T` as in the
/// paper, `dh` of altitudes, and `dv` of speeds. Airplanes that are on levels apart at a step add no cost then.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Objective {
    /// Weight of deviations from the optimal path.
    pub alpha: f64,
    /// Factor on penalties per step into the future, in (0, 1].
    pub beta: f64,
    /// Factor on separations in the objective; above 1, it asks for a margin.
    pub inflation: f64,
    /// Whether steps after the arrival of either airplane do not count.
    pub mask: bool,
    /// Airplanes at least this many meters above each other add no cost to each other.
    pub vertical_m: f64,
    /// Weight of a square meter of altitude against one of place.
    pub level_weight: f64,
    /// Weight of the square of the way that a change of speed makes longer or shorter, beside that of the place.
    pub speed_weight: f64,
}

impl Objective {
    /// Returns the cost of a prediction of an airplane with this separation beside a non-cooperative one in its frame,
    /// which is assumed to fly straight on.
    fn non_cooperative_cost(
        &self,
        one: &NonCooperativeAircraft,
        prediction: &Prediction,
        separation_m: f64,
        dtau_s: f64,
    ) -> f64 {
        let points: Vec<Point> =
            (1..=prediction.points.len()).map(|k| one.position_after(k as f64 * dtau_s)).collect();
        let straight = Prediction { counted: points.len(), points };
        let r = [one.required_clearance_m(separation_m), 0.0];
        self.collision_costs(&PairPlane::ONE_FRAME, prediction, &straight, r)[0]
    }

    /// Returns `Gcol_i` and `Gcol_j` of two predictions in the frames of a pair, for separations `r` of `i` and `j` in
    /// meters (eq. 9). Sums slice by slice of time, so that a caller that skips slices which are
    /// apart gets the same bits.
    pub fn collision_costs(
        &self,
        plane: &PairPlane,
        a: &Prediction,
        b: &Prediction,
        r: [f64; 2],
    ) -> [f64; 2] {
        self.collision_costs_where(plane, [a, b], r, |_| true)
    }

    /// Returns the same of the points alone at which the two are on levels that meet, as `meets` tells by their number.
    pub(super) fn collision_costs_where(
        &self,
        plane: &PairPlane,
        [a, b]: [&Prediction; 2],
        r: [f64; 2],
        meets: impl Fn(usize) -> bool,
    ) -> [f64; 2] {
        let end = self.counted_points(a).min(self.counted_points(b));
        let mut sums = [0.0; 2];
        let mut weight = 1.0;
        let slices = a.points[..end].chunks(SLICE).zip(b.points[..end].chunks(SLICE));
        let terms = PairTerms { plane, r };
        for (k, (of_a, of_b)) in slices.enumerate() {
            let meets_in_slice = |point: usize| meets(k * SLICE + point);
            let parts = self.slice_collision_costs(terms, [of_a, of_b], weight, meets_in_slice);
            sums[0] += parts[0];
            sums[1] += parts[1];
            weight = self.next_slice_weight(weight);
        }
        sums
    }

    /// Returns the distance in meters beyond which two of a separation cost each other nothing.
    fn gap_m(&self, separation_m: f64) -> f64 {
        // Slightly more, so that no rounding of bounds leaves out points that add a cost.
        self.inflation * separation_m * (1.0 + 1e-9)
    }

    fn counted_points(&self, prediction: &Prediction) -> usize {
        if self.mask { prediction.counted } else { prediction.points.len() }
    }

    /// Returns the same over the points of one slice, of which the first has the weight `weight`. `counts` tells whether
    /// the two are on levels that meet at a point of the slice.
    // Inlined, so that where all points count no call is left.
    #[inline(always)]
    fn slice_collision_costs(
        &self,
        PairTerms { plane, r }: PairTerms<'_>,
        [a, b]: [&[Point]; 2],
        mut weight: f64,
        counts: impl Fn(usize) -> bool,
    ) -> [f64; 2] {
        let [ra, rb] = r.map(|r| r * self.inflation);
        let max_square_m2 = ra.max(rb) * ra.max(rb);
        let squares_m2 = plane.squared_distances_m2::<SLICE>(a, b);
        // Nearly all points are farther apart than that, and need neither weight nor root. No early exit: all of them are
        // compared at once.
        let is_any_near = squares_m2
            .iter()
            .fold(false, |is_any, square_m2| is_any | (*square_m2 < max_square_m2));
        let mut sums = [0.0; 2];
        if !is_any_near {
            return sums;
        }
        for (k, square_m2) in squares_m2.into_iter().enumerate() {
            if square_m2 < max_square_m2 && counts(k) {
                let distance_m = square_m2.sqrt();
                let shortfall_a_m = (ra - distance_m).max(0.0);
                let shortfall_b_m = (rb - distance_m).max(0.0);
                sums[0] += weight * shortfall_a_m * shortfall_a_m;
                sums[1] += weight * shortfall_b_m * shortfall_b_m;
            }
            weight *= self.beta;
        }
        sums
    }

    /// Returns the weight of a slice's first point if that of the slice before has the weight
    /// `weight`. It is multiplied step by step, as within a slice, and not by a power, which rounds differently.
    fn next_slice_weight(&self, weight: f64) -> f64 {
        (0..SLICE).fold(weight, |weight, _| weight * self.beta)
    }

    /// Returns `Gdev_i`, from the ends of a prediction and of the optimal one (eq. 10).
    pub fn deviation_cost(&self, of: &Prediction, optimal: &Prediction) -> f64 {
        match (of.points.last(), optimal.points.last()) {
            (Some(p), Some(q)) => norm_squared(sub(*p, *q)),
            _ => 0.0,
        }
    }

    /// Returns the same where two predictions are farthest from each other: the largest square of a deviation.
    pub fn max_deviation_cost(&self, of: &Prediction, optimal: &Prediction) -> f64 {
        let pairs = of.points.iter().zip(&optimal.points);
        pairs.map(|(p, q)| norm_squared(sub(*p, *q))).fold(0.0, f64::max)
    }
}

/// What all slices of a pair have in common.
#[derive(Debug, Clone, Copy)]
struct PairTerms<'a> {
    plane: &'a PairPlane,
    /// The separations of the two, in meters.
    r: [f64; 2],
}
