//! A validity check of postures (OMPL's state validity checker): rods, bends, mobilities, obstacles and
//! the chain's own body, as propagation checks them, but without a motion that leads there.

use sidestep_rods::geometry::{Aabb, Point, angle_between_rad, between_segments, distance, sub};
use sidestep_rods::{
    BEND_TOLERANCE_RAD, Chain, ChainPart, Obstacle, Obstacles, Veto, VetoReason,
    contact_distance_m, is_length_allowed, part_pairs,
};
use std::f64::consts::PI;

#[derive(Clone, Copy)]
pub(crate) struct ConstraintChecker<'a, const D: usize> {
    pub(crate) chain: &'a Chain<D>,
    pub(crate) obstacles: &'a Obstacles<D>,
    pub(crate) self_collision: bool,
}

impl<const D: usize> ConstraintChecker<'_, D> {
    /// Returns the first objection to a posture, in the order of the connectors. Parts at their old
    /// places in the chain are not checked: the chain may start in violation, and must be able to move.
    pub(crate) fn find_veto(&self, points: &[Point<D>], k: usize) -> Option<Veto<D>> {
        // Connectors first, because their checks take far less time than those of rods against all bodies.
        let (by, reason, obstacle) = (0..points.len())
            .find_map(|i| self.check_connector(points, i))
            .or_else(|| (0..self.chain.rods().len()).find_map(|i| self.check_rod(points, i)))?;
        Some(Veto { by, from: k, reason, obstacle, reached: points[k] })
    }

    fn has_moved(&self, points: &[Point<D>], i: usize) -> bool {
        points[i] != self.chain.points()[i]
    }

    fn check_connector(
        &self,
        points: &[Point<D>],
        i: usize,
    ) -> Option<(usize, VetoReason, Option<u32>)> {
        let connector = &self.chain.connectors()[i];
        if self.has_moved(points, i) {
            if connector.is_still() {
                let reason = if connector.failed { VetoReason::Failed } else { VetoReason::Fixed };
                return Some((i, reason, None));
            }
            if !connector.mobility.allows(points[i], points[i]) {
                return Some((i, VetoReason::Mobility, None));
            }
        }
        let around = i.saturating_sub(1)..(i + 2).min(points.len());
        let has_limit = connector.max_bend_rad < PI
            && around.len() == 3
            && around.clone().any(|j| self.has_moved(points, j));
        let exceeds =
            has_limit && bend_rad(points, i) > connector.max_bend_rad + BEND_TOLERANCE_RAD;
        exceeds.then_some((i, VetoReason::BendLimit, None))
    }

    fn check_rod(&self, points: &[Point<D>], i: usize) -> Option<(usize, VetoReason, Option<u32>)> {
        if !self.has_moved(points, i) && !self.has_moved(points, i + 1) {
            return self.check_own_body(points, i);
        }
        if !is_length_allowed(self.chain.rods()[i], distance(points[i], points[i + 1])) {
            return Some((i + 1, VetoReason::Mobility, None));
        }
        let mut hit: Option<u32> = None;
        self.visit_near(&points[i..i + 2], i, 0.0, |o| {
            // The least id, because the order of visits depends on how obstacles are stored.
            if hit.is_none_or(|id| o.id < id) && self.touches(points, i, o) {
                hit = Some(o.id);
            }
        });
        if hit.is_some() {
            return Some((i + 1, VetoReason::BothSidesBlocked, hit));
        }
        self.check_own_body(points, i)
    }

    /// Checks rod `i` against the later parts of the chain, of which one or the other has moved.
    fn check_own_body(
        &self,
        points: &[Point<D>],
        i: usize,
    ) -> Option<(usize, VetoReason, Option<u32>)> {
        let hits_itself = self.self_collision
            && self.own_pairs(points, i, 0.0).any(|pair| {
                let mut ends = pair.ends.into_iter().flatten();
                ends.any(|k| self.has_moved(points, k)) && pair.depth_m() > pair.slack_m()
            });
        hits_itself.then_some((i + 1, VetoReason::SelfCollision, None))
    }

    fn touches(&self, points: &[Point<D>], i: usize, o: &Obstacle<D>) -> bool {
        let keep_m = contact_distance_m(o.radius_m + self.chain.rods()[i].radius_m);
        !o.core.is_clear_of_segment([points[i], points[i + 1]], keep_m)
            || self.is_connector_touching(points, i, o)
            || self.is_connector_touching(points, i + 1, o)
    }

    fn is_connector_touching(&self, points: &[Point<D>], i: usize, o: &Obstacle<D>) -> bool {
        let keep_m = contact_distance_m(o.radius_m + self.chain.connectors()[i].radius_m);
        self.has_moved(points, i) && !o.core.is_clear_of_point(points[i], keep_m)
    }

    /// Visits the obstacles that rod `i` and its connectors at `ends` may meet.
    pub(super) fn visit_near<'a>(
        &'a self,
        ends: &[Point<D>],
        i: usize,
        margin_m: f64,
        visit: impl FnMut(&'a Obstacle<D>),
    ) {
        let connectors = self.chain.connectors();
        let by_m = connectors[i].radius_m.max(connectors[i + 1].radius_m) + margin_m;
        self.obstacles.visit(&Aabb::from_points(ends).grown(by_m), visit);
    }

    /// Returns the later parts of the chain that rod `i` and its inner connector may run into.
    pub(super) fn own_pairs<'a>(
        &'a self,
        points: &'a [Point<D>],
        i: usize,
        margin_m: f64,
    ) -> impl Iterator<Item = OwnPair<D>> + 'a {
        let near = self.bounds(points, i).grown(margin_m);
        (i + 1..self.chain.rods().len())
            .filter(move |&j| self.bounds(points, j).intersects(&near))
            .flat_map(move |j| self.own_pairs_of(points, i, j))
    }

    fn bounds(&self, points: &[Point<D>], i: usize) -> Aabb<D> {
        let connectors = self.chain.connectors();
        let by_m = connectors[i].radius_m.max(connectors[i + 1].radius_m);
        Aabb::from_points(&[points[i], points[i + 1]]).grown(by_m)
    }

    /// Returns the pairs that two rods with their connectors make, except those that share a joint.
    fn own_pairs_of<'a>(
        &'a self,
        points: &'a [Point<D>],
        i: usize,
        j: usize,
    ) -> impl Iterator<Item = OwnPair<D>> + 'a {
        part_pairs(i, j, self.chain.rods().len()).filter_map(|[one, other]| {
            let ends = |part: ChainPart| [part.connector(), part.last_connector()];
            Some(OwnPair {
                ends: [ends(one), ends(other)],
                at: [one.ends(points), other.ends(points)],
                keep_m: self.chain.min_separation_m(one, other)?,
            })
        })
    }
}

/// Two parts of a chain: rods, or connectors as rods without length.
#[derive(Debug, Clone, Copy)]
pub(super) struct OwnPair<const D: usize> {
    pub(super) ends: [[usize; 2]; 2],
    pub(super) at: [[Point<D>; 2]; 2],
    pub(super) keep_m: f64,
}

impl<const D: usize> OwnPair<D> {
    fn depth_m(&self) -> f64 {
        self.keep_m - between_segments(self.at[0], self.at[1]).distance_m
    }

    fn slack_m(&self) -> f64 {
        self.keep_m - contact_distance_m(self.keep_m)
    }
}

/// Returns the angle between the directions of the rods at an inner connector.
pub(super) fn bend_rad<const D: usize>(points: &[Point<D>], i: usize) -> f64 {
    angle_between_rad(sub(points[i], points[i - 1]), sub(points[i + 1], points[i]))
}
