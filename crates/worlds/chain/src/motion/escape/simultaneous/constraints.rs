//! The hard constraints, which every motion keeps.

use super::contacts::{Contacts, nearest_points};
use super::posture::{PartPoint, TrialPosture, ends};
use super::solve_input::EscapeSolveInput;
use sidestep_kernel::math::cos;
use sidestep_rods::geometry::{Point, angle_between_rad, distance, normalized, sub};
use sidestep_rods::{
    BEND_TOLERANCE_RAD, Chain, LENGTH_TOLERANCE_M, RodSweep, TOLERANCE_M, is_own_path_clear,
};

/// A bend limit: that of a connector, or its bend before the tick where that was sharper.
#[derive(Debug, Clone, Copy)]
pub(super) struct BendConstraint {
    connector: usize,
    most_rad: f64,
}

impl BendConstraint {
    /// Returns the limit of an inner connector.
    pub(super) fn from_connector<const D: usize>(
        chain: &Chain<D>,
        connector: usize,
    ) -> Option<Self> {
        let limit_rad = chain.connectors()[connector].max_bend_rad;
        let most_rad = chain.bend_rad(connector)?.max(limit_rad);
        Some(Self { connector, most_rad })
    }

    /// Moves the neighbors of a connector that bends too far apart; returns the correction, meters.
    pub(super) fn correct<const D: usize>(&self, posture: &mut TrialPosture<'_, D>) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| posture.points[self.connector - 1 + k]);
        let into_m = distance(a, b);
        let out_m = distance(b, c);
        // The law of cosines: the bend is the outer angle.
        let least2 = into_m * into_m + out_m * out_m + 2.0 * into_m * out_m * cos(self.most_rad);
        let short_m = least2.max(0.0).sqrt() * (1.0 + BEND_MARGIN) - distance(a, c);
        let Some(away) = normalized(sub(c, a)).filter(|_| short_m > 0.0) else { return 0.0 };
        let before = PartPoint::connector(self.connector - 1);
        let after = PartPoint::connector(self.connector + 1);
        posture.separate(before, after, away, short_m);
        short_m
    }

    fn is_met<const D: usize>(&self, points: &[Point<D>]) -> bool {
        let [a, b, c] = [0, 1, 2].map(|k| points[self.connector - 1 + k]);
        angle_between_rad(sub(b, a), sub(c, b)) <= self.most_rad + BEND_TOLERANCE_RAD
    }
}

/// Fraction by which corrected bends stay below their limits.
const BEND_MARGIN: f64 = 1e-6;
/// Rounding of displacements, meters.
const ROUNDING_M: f64 = 1e-12;

pub(super) struct EscapeConstraintChecker<'a, 'b, const D: usize> {
    pub(super) input: &'a EscapeSolveInput<'b, D>,
    pub(super) points: &'a [Point<D>],
}

impl<const D: usize> EscapeConstraintChecker<'_, '_, D> {
    pub(super) fn are_met(&self, contacts: &Contacts<D>, bends: &[BendConstraint]) -> bool {
        let chain = self.input.chain;
        self.are_lengths_met()
            && self.are_travels_met()
            && bends.iter().all(|bend| bend.is_met(self.points))
            && contacts.pairs.iter().all(|pair| {
                let contact_m = pair.keep_m - TOLERANCE_M;
                let is_apart = pair.is_surely_apart(self.points, contact_m)
                    || nearest_points(self.points, pair.parts).distance_m >= contact_m;
                is_apart && is_own_path_clear(chain, [chain.points(), self.points], pair.parts)
            })
            && contacts.walls.iter().all(|wall| {
                let to = ends(self.points, wall.part);
                let apart_m = wall.core.nearest_to_segment(to).distance_m;
                let from = ends(self.input.chain.points(), wall.part);
                apart_m >= wall.keep_m - TOLERANCE_M
                    && RodSweep { from, to }.is_clear(&wall.core, wall.keep_m)
            })
    }

    fn are_lengths_met(&self) -> bool {
        let lengths_m = self.points.windows(2).map(|w| distance(w[0], w[1]));
        lengths_m.zip(self.input.chain.rods()).all(|(length_m, rod)| {
            let allowed = rod.min_m - LENGTH_TOLERANCE_M..=rod.max_m + LENGTH_TOLERANCE_M;
            allowed.contains(&length_m)
        })
    }

    fn are_travels_met(&self) -> bool {
        let EscapeSolveInput { chain, start, .. } = *self.input;
        self.points.iter().enumerate().all(|(k, p)| {
            let connector = &chain.connectors()[k];
            let was = chain.points()[k];
            distance(start[k], *p) <= self.input.max_travel_m(k) + ROUNDING_M
                && connector.mobility.allows(*p, was)
                && (!connector.is_still() || *p == was)
        })
    }
}
