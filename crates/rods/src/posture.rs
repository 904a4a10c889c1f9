//! The check of a motion that no reaction has made: of the places at which the connectors end up, and of their paths.

use super::chain::{Chain, LENGTH_TOLERANCE_M};
use super::geometry::{Aabb, Point, angle_between_rad, distance, sub};
use super::motion_context::{BEND_TOLERANCE_RAD, TOLERANCE_M};
use super::obstacle::Obstacles;
use super::own_body::{ChainPart, ROUNDING_M, deepest_new_overlap, find_own_passage};
use super::propagate::Propagator;
use super::tunneling::find_tunneling;
use super::veto::{Veto, VetoReason};
use std::f64::consts::PI;

/// A part that objects, with the reason, and the obstacle in its way.
type PartVeto = (usize, VetoReason, Option<u32>);

impl<const D: usize> Propagator<D> {
    /// Returns the objection to a motion of connector `k` that brought a chain from `before` to its present place,
    /// every connector on a straight path; none if it keeps all that a motion by the rules keeps. What was violated
    /// before may stay so, and must not get worse.
    pub fn find_motion_veto(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        before: &[Point<D>],
        k: usize,
    ) -> Option<Veto<D>> {
        let veto = find_connector_veto(chain, before)
            .or_else(|| find_obstacle_veto(chain, obstacles, before))
            .or_else(|| self.find_own_veto(chain, before))
            .or_else(|| self.find_passage_veto(chain, obstacles, before));
        veto.map(|veto| make_veto(veto, before, k))
    }

    /// Returns the same for the paths alone: an obstacle that a rod tunneled through or, where its own parts are solid,
    /// a part of the chain. The places at its ends are not checked.
    pub fn find_path_veto(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        before: &[Point<D>],
        k: usize,
    ) -> Option<Veto<D>> {
        let veto = self.find_passage_veto(chain, obstacles, before);
        veto.map(|veto| make_veto(veto, before, k))
    }

    fn find_own_veto(&mut self, chain: &Chain<D>, before: &[Point<D>]) -> Option<PartVeto> {
        if !self.rules.self_collision {
            return None;
        }
        let overlap = deepest_new_overlap(chain, before, &mut self.own_rods, TOLERANCE_M)?;
        let [_, other] = overlap.parts;
        Some((other.last_connector(), VetoReason::SelfCollision, None))
    }

    fn find_passage_veto(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        before: &[Point<D>],
    ) -> Option<PartVeto> {
        if let Some(tunneled) = find_tunneling(chain, before, obstacles, 0.0) {
            return Some((tunneled.rod + 1, VetoReason::WouldTunnel, Some(tunneled.obstacle)));
        }
        if !self.rules.self_collision {
            return None;
        }
        let [_, other] = find_own_passage(chain, before, &mut self.own_rods)?;
        Some((other.last_connector(), VetoReason::SelfCollision, None))
    }
}

/// Returns the veto of a motion of connector `k`, which has reached nothing: it was at `before`.
fn make_veto<const D: usize>(
    (by, reason, obstacle): PartVeto,
    before: &[Point<D>],
    k: usize,
) -> Veto<D> {
    Veto { by, from: k, reason, obstacle, reached: before[k] }
}

/// Returns the first connector that is where it may not be, whose rod is out of its limits, or that bends too far.
fn find_connector_veto<const D: usize>(chain: &Chain<D>, before: &[Point<D>]) -> Option<PartVeto> {
    let points = chain.points();
    for (i, connector) in chain.connectors().iter().enumerate() {
        if connector.is_still() && points[i] != before[i] {
            return Some((i, connector.still_reason(), None));
        }
        if !connector.mobility.allows(points[i], points[i]) {
            return Some((i, VetoReason::Mobility, None));
        }
        let bend_rad = |points: &[Point<D>]| {
            angle_between_rad(sub(points[i], points[i - 1]), sub(points[i + 1], points[i]))
        };
        let has_limit = connector.max_bend_rad < PI && i > 0 && i + 1 < points.len();
        if has_limit
            && bend_rad(points) > connector.max_bend_rad.max(bend_rad(before)) + BEND_TOLERANCE_RAD
        {
            return Some((i, VetoReason::BendLimit, None));
        }
    }
    for (i, rod) in chain.rods().iter().enumerate() {
        let error_m = |points: &[Point<D>]| {
            let length_m = distance(points[i], points[i + 1]);
            (length_m - rod.max_m).max(rod.min_m - length_m)
        };
        if error_m(points) > LENGTH_TOLERANCE_M.max(error_m(before)) {
            return Some((i + 1, VetoReason::Mobility, None));
        }
    }
    None
}

/// Returns the first part that is in an obstacle, deeper than before, and the obstacle of the lowest id.
fn find_obstacle_veto<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    before: &[Point<D>],
) -> Option<PartVeto> {
    if obstacles.is_empty() {
        return None;
    }
    let points = chain.points();
    let connectors = (0..points.len()).map(ChainPart::Connector);
    let parts = connectors.chain((0..chain.rods().len()).map(ChainPart::Rod));
    for part in parts {
        let radius_m = chain.part_radius_m(part);
        let ends = part.ends(points);
        let mut hit: Option<(u32, VetoReason)> = None;
        obstacles.visit(&Aabb::from_points(&ends).grown(radius_m), |o| {
            let depth_m = |ends| radius_m + o.radius_m - o.core.nearest_to_segment(ends).distance_m;
            let was_m: f64 = depth_m(part.ends(before));
            if depth_m(ends) > TOLERANCE_M.max(was_m + ROUNDING_M)
                && hit.is_none_or(|(id, _)| o.id < id)
            {
                let was_inside = was_m > TOLERANCE_M;
                let reason =
                    if was_inside { VetoReason::Inside } else { VetoReason::BothSidesBlocked };
                hit = Some((o.id, reason));
            }
        });
        if let Some((id, reason)) = hit {
            return Some((part.last_connector(), reason, Some(id)));
        }
    }
    None
}
