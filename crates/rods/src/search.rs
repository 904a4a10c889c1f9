//! A search for a direction of a rod in space that is free of all obstacles nearby. Unlike the blocked
//! directions in the plane, those on a sphere are no intervals, so none is computed exactly.
//!
//! First the rod turns away from the worst obstacle, again and again; that is nearly always enough.
//! If it is not, rings of directions around the wanted one are tried from the narrowest on, and the
//! first free direction is brought as near to the wanted one as it stays free.

use super::chain::SKIN_M;
use super::geometry::{
    Point, add, add_scaled, angle_between_rad, dot, norm, normalized, perpendicular, scaled, sub,
};
use super::motion_context::{BlockingPart, BlockingPartOwner, SlaveStep, contact_distance_m};
use sidestep_kernel::math;
use std::f64::consts::{PI, TAU};

/// Largest number of turns away from single obstacles before the rings: where two obstacles turn the rod back and forth,
/// more turns do not end it. Rings are then needed in at most 0.1 % of reactions, in fields of spheres and capsules that
/// fill up to 30 % of space.
const MAX_TURNS: usize = 24;
/// Cosine of the turn beyond which turning away is given up: 100 degrees. So large a turn throws the slave
/// around its master.
const LOST_COSINE: f64 = -0.173_648;
/// Directions on a ring, 15 degrees apart. With these rings no motion among the fields above ended in a veto.
const AZIMUTHS: usize = 24;
/// The narrowest ring, rad: about one degree, for obstacles that hardly touch the rod.
const MIN_RING_RAD: f64 = 0.02;
/// The widest ring, rad: still wider ones would throw the slave around its master.
const MAX_RING_RAD: f64 = 2.0;
/// Bisection steps that bring a free direction near the wanted one: to a millionth of the distance of two rings.
const BISECTIONS: usize = 20;

/// A rod of one length at its master, and the blocks that may be in its way. The master is inside
/// none of them.
pub(super) struct DirectionSearch<'a, const D: usize> {
    pub(super) step: &'a SlaveStep<D>,
    pub(super) length_m: f64,
    pub(super) blocks: &'a [BlockingPart<D>],
}

/// The point to turn away from.
struct WorstBlock<const D: usize> {
    depth_m: f64,
    point: Point<D>,
    radius_m: f64,
    /// Whether the connector at the rod's end is in it, not the rod.
    by_tip: bool,
    name: BlockingPartOwner,
}

impl<const D: usize> WorstBlock<D> {
    /// Becomes the worst block if it is deeper; of equal depths the lower name counts, because blocks come in no
    /// particular order.
    #[inline]
    fn replace_if_worse(self, worst: &mut Option<Self>) {
        let is_worse = worst.as_ref().is_none_or(|w| {
            self.depth_m > w.depth_m || self.depth_m == w.depth_m && self.name < w.name
        });
        if self.depth_m > 0.0 && is_worse {
            *worst = Some(self);
        }
    }
}

impl<const D: usize> DirectionSearch<'_, D> {
    /// Returns a free direction near `wanted`, found by turning away from the worst block, if that
    /// works.
    pub(super) fn turn_away(&self, wanted: Point<D>) -> Option<Point<D>> {
        let mut u = self.clamp_to_bend_limit(wanted);
        for _ in 0..MAX_TURNS {
            let Some(hit) = self.worst_block(u) else { return Some(u) };
            u = self.clamp_to_bend_limit(self.turn_past_block(u, &hit)?);
            if dot(u, wanted) < LOST_COSINE {
                return None;
            }
        }
        None
    }

    /// Returns the first free direction on rings around `wanted`, brought near it.
    pub(super) fn search_rings(
        &self,
        wanted: Point<D>,
        is_valid: impl Fn(Point<D>) -> bool,
    ) -> Option<Point<D>> {
        let e1 = perpendicular(wanted);
        let e2 = other_perpendicular(wanted, e1);
        let mut inner_rad = 0.0;
        let mut ring_rad = MIN_RING_RAD;
        while ring_rad <= MAX_RING_RAD {
            for k in 0..AZIMUTHS {
                let azimuth_rad = TAU * k as f64 / AZIMUTHS as f64;
                let c = math::cos(azimuth_rad);
                let s = math::sin(azimuth_rad);
                let side = add(scaled(e1, c), scaled(e2, s));
                let u = turned_toward(wanted, side, ring_rad);
                if self.is_free(u) && is_valid(u) {
                    let free_rad = nearest_free_rad(inner_rad, ring_rad, |rad| {
                        let u = turned_toward(wanted, side, rad);
                        self.is_free(u) && is_valid(u)
                    });
                    return Some(turned_toward(wanted, side, free_rad));
                }
            }
            inner_rad = ring_rad;
            // Denser near the wanted direction, where a free one is worth most.
            ring_rad = ring_rad * 1.15 + 0.005;
        }
        None
    }

    /// Returns whether no block and no bend limit forbids a direction.
    fn is_free(&self, u: Point<D>) -> bool {
        self.is_bend_allowed(u) && self.worst_block(u).is_none()
    }

    fn is_bend_allowed(&self, u: Point<D>) -> bool {
        self.step.is_bend_allowed_at(add_scaled(self.step.mn, u, self.length_m))
    }

    /// Returns the direction itself, or the nearest on the cone of the bend limit.
    fn clamp_to_bend_limit(&self, u: Point<D>) -> Point<D> {
        let Some(prev) = self.step.prev.filter(|_| self.step.max_bend_rad < PI) else { return u };
        let Some(into) = normalized(sub(self.step.mn, prev)) else { return u };
        if angle_between_rad(into, u) <= self.step.max_bend_rad {
            return u;
        }
        let side = perpendicular_toward(into, u);
        let c = math::cos(self.step.max_bend_rad);
        let s = math::sin(self.step.max_bend_rad);
        add(scaled(into, c), scaled(side, s))
    }

    /// Returns the block that a rod in a direction is deepest in.
    fn worst_block(&self, u: Point<D>) -> Option<WorstBlock<D>> {
        let s = add_scaled(self.step.mn, u, self.length_m);
        let mut worst: Option<WorstBlock<D>> = None;
        for block in self.blocks {
            let rod = [self.step.mn, s];
            if let Some(rod_m) = block.rod_separation_m
                && !block.core.is_clear_of_segment(rod, contact_distance_m(rod_m))
            {
                let nearest = block.core.nearest_to_segment(rod);
                let hit = WorstBlock {
                    depth_m: contact_distance_m(rod_m) - nearest.distance_m,
                    point: nearest.on_core,
                    radius_m: rod_m,
                    by_tip: false,
                    name: block.name,
                };
                hit.replace_if_worse(&mut worst);
            }
            if let Some(tip_m) = block.tip_separation_m
                && !block.core.is_clear_of_point(s, contact_distance_m(tip_m))
            {
                let nearest = block.core.nearest_to_point(s);
                let hit = WorstBlock {
                    depth_m: contact_distance_m(tip_m) - nearest.distance_m,
                    point: nearest.on_core,
                    radius_m: tip_m,
                    by_tip: true,
                    name: block.name,
                };
                hit.replace_if_worse(&mut worst);
            }
        }
        worst
    }

    /// Returns the direction turned from `u` until the rod only touches the block; `None` if there is none.
    fn turn_past_block(&self, u: Point<D>, hit: &WorstBlock<D>) -> Option<Point<D>> {
        let to = sub(hit.point, self.step.mn);
        let apart_m = norm(to);
        let radius_m = hit.radius_m + SKIN_M;
        let cosine = blocking_half_angle_cosine(apart_m, radius_m, self.length_m, hit.by_tip)?;
        Some(direction_at_angle(u, scaled(to, 1.0 / apart_m), cosine))
    }
}

/// Returns the direction at an angle from `wanted` toward a unit vector perpendicular to it.
#[inline]
fn turned_toward<const D: usize>(wanted: Point<D>, side: Point<D>, angle_rad: f64) -> Point<D> {
    add(scaled(wanted, math::cos(angle_rad)), scaled(side, math::sin(angle_rad)))
}

/// Returns the direction at an angle from `d`, in the plane of both, on the side of `u`.
pub(super) fn direction_at_angle<const D: usize>(
    u: Point<D>,
    d: Point<D>,
    cosine: f64,
) -> Point<D> {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let turned = add(scaled(d, cosine), scaled(perpendicular_toward(d, u), sine));
    normalized(turned).unwrap_or(u)
}

/// Returns the unit vector perpendicular to `d` on the side of `u`.
fn perpendicular_toward<const D: usize>(d: Point<D>, u: Point<D>) -> Point<D> {
    let across = add_scaled(u, d, -dot(u, d));
    if norm(across) > 1e-9 { normalized(across).unwrap_or(across) } else { perpendicular(d) }
}

/// Returns the cosine of half the angle under which a ball blocks a rod or its end; `None` if there
/// is no such direction.
#[inline]
pub(super) fn blocking_half_angle_cosine(
    apart_m: f64,
    radius_m: f64,
    length_m: f64,
    by_tip: bool,
) -> Option<f64> {
    if apart_m <= 0.0 {
        return None;
    }
    let tangent2 = apart_m * apart_m - radius_m * radius_m;
    if !by_tip && tangent2 <= length_m * length_m {
        return Some(tangent2.max(0.0).sqrt() / apart_m);
    }
    let cosine = (length_m * length_m + tangent2) / (2.0 * apart_m * length_m);
    (cosine >= -1.0).then_some(cosine.min(1.0))
}

fn other_perpendicular<const D: usize>(u: Point<D>, e1: Point<D>) -> Point<D> {
    if D == 2 {
        return scaled(e1, -1.0);
    }
    std::array::from_fn(|i| {
        let j = (i + 1) % 3;
        let k = (i + 2) % 3;
        u[j] * e1[k] - u[k] * e1[j]
    })
}

/// Returns the least free angle, between one that is blocked and one that is free, rad.
fn nearest_free_rad(mut blocked_rad: f64, mut free_rad: f64, is_free: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle_rad = 0.5 * (blocked_rad + free_rad);
        if is_free(middle_rad) {
            free_rad = middle_rad;
        } else {
            blocked_rad = middle_rad;
        }
    }
    free_rad
}
