//! The context in which a slave reacts, and the validity check of every position of a part of a chain.
//!
//! A slave's reaction depends on its master's move, its own position, the rod before its master, and its
//! surroundings (slide E4), never on anything farther along the chain.

use super::chain::{Chain, LENGTH_TOLERANCE_M, Rod};
use super::geometry::{Aabb, ConvexCore, Point, angle_between_rad, distance, sub};
use super::obstacle::{Obstacles, swept_bounds};
use super::reaction::Reaction;
use super::rod_bvh::RodBvh;
use super::rules::ReactionRules;
use super::sweep::RodSweep;
use super::veto::VetoReason;
use std::f64::consts::PI;
use std::ops::Range;

/// Clearance that a turn aims at, meters. It is a hundred times the tolerance: a master that touches a wall blocks a
/// half-plane of directions, and with equal values it counts as inside the wall in the next step, which is a veto.
pub const SKIN_M: f64 = 1e-7;
/// Penetration that counts as contact, meters: distances of segments are exact to about 1e-15 m of their coordinates, so
/// rounding is no contact.
pub const TOLERANCE_M: f64 = 1e-9;
/// Tolerance of bend limits, rad: far above the rounding of angles.
pub const BEND_TOLERANCE_RAD: f64 = 1e-9;
/// Distance below which a body without thickness is touched, meters. Its radius less the tolerance would
/// be negative, and it could be passed.
const TOUCH_M: f64 = 1e-12;

/// New positions before they are accepted, for a run of connectors around the initiator.
#[derive(Debug, Clone, Default)]
pub(super) struct TentativePositions<const D: usize> {
    points: Vec<Point<D>>,
    /// First and one past the last connector that has a new position.
    pub(super) from: usize,
    pub(super) to: usize,
}

impl<const D: usize> TentativePositions<D> {
    pub(super) fn start(&mut self, n: usize, first: usize) {
        self.points.resize(n, [0.0; D]);
        self.from = first;
        self.to = first;
    }

    /// Returns the connectors that have a new position.
    pub(super) fn moved_range(&self) -> Range<usize> {
        self.from..self.to
    }

    /// Sets the position of a connector of the run, or of one beside it.
    pub(super) fn set(&mut self, i: usize, p: Point<D>) {
        debug_assert!(self.from <= i + 1 && i <= self.to, "the run would have a gap");
        self.points[i] = p;
        self.from = self.from.min(i);
        self.to = self.to.max(i + 1);
    }

    pub(super) fn get(&self, i: usize) -> Option<Point<D>> {
        (self.from <= i && i < self.to).then(|| self.points[i])
    }

    pub(super) fn positions(&self) -> &[Point<D>] {
        &self.points[self.from..self.to]
    }
}

/// A part that may be in the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BlockingPart<const D: usize> {
    pub(super) core: ConvexCore<D>,
    pub(super) radius_m: f64,
    pub(super) name: BlockingPartOwner,
    /// Whether it is in the way of the rod, and of the connector at its end.
    pub(super) stops_rod: bool,
    pub(super) stops_tip: bool,
}

/// The owner of a block. Its order breaks ties, because the order in which blocks are visited depends on
/// the grid and must not matter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum BlockingPartOwner {
    Obstacle(u32),
    OwnRod(usize),
    OwnConnector(usize),
}

impl BlockingPartOwner {
    #[inline]
    pub(super) fn obstacle_id(self) -> Option<u32> {
        match self {
            Self::Obstacle(id) => Some(id),
            Self::OwnRod(_) | Self::OwnConnector(_) => None,
        }
    }
}

/// An objection, before the length of the motion is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IncompleteVeto {
    /// The constraint that would be broken.
    pub reason: VetoReason,
    /// The obstacle in the way, if there is one.
    pub obstacle: Option<u32>,
}

impl IncompleteVeto {
    #[inline]
    pub(super) fn new(reason: VetoReason) -> Self {
        Self { reason, obstacle: None }
    }

    #[inline]
    pub(super) fn from_blocking_owner(reason: VetoReason, name: BlockingPartOwner) -> Self {
        let reason = if name.obstacle_id().is_none() { VetoReason::SelfCollision } else { reason };
        Self { reason, obstacle: name.obstacle_id() }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct SlaveStep<const D: usize> {
    pub(super) master: usize,
    pub(super) slave: usize,
    /// The master's old position.
    pub(super) mo: Point<D>,
    /// The master's new position.
    pub(super) mn: Point<D>,
    /// The slave's old position.
    pub(super) so: Point<D>,
    /// The connector on the master's other side, if its place is settled.
    pub(super) prev: Option<Point<D>>,
    pub(super) rod: Rod,
    /// Radius of the slave's body, meters.
    pub(super) tip_radius_m: f64,
    /// Bend limit of the master, rad.
    pub(super) max_bend_rad: f64,
}

impl<const D: usize> SlaveStep<D> {
    fn rod_sweep(&self, s: Point<D>) -> RodSweep<D> {
        RodSweep { from: [self.mo, self.so], to: [self.mn, s] }
    }

    /// Returns whether the master's bend is within its limit with the slave at `s`.
    pub(super) fn is_bend_allowed_at(&self, s: Point<D>) -> bool {
        let Some(prev) = self.prev else { return true };
        self.max_bend_rad >= PI
            || angle_between_rad(sub(self.mn, prev), sub(s, self.mn))
                <= self.max_bend_rad + BEND_TOLERANCE_RAD
    }
}

/// Returns the distance at which a body and an obstacle only touch, meters.
#[inline]
pub fn contact_distance_m(radius_m: f64) -> f64 {
    (radius_m - TOLERANCE_M).max(TOUCH_M)
}

/// The inputs of a slave's reaction: the chain as it was, the tentative positions so far, and the
/// surroundings.
pub(super) struct MotionContext<'a, const D: usize> {
    pub(super) chain: &'a Chain<D>,
    pub(super) obstacles: &'a Obstacles<D>,
    pub(super) rules: &'a ReactionRules,
    pub(super) tentative: &'a TentativePositions<D>,
    pub(super) own_rods: &'a RodBvh<D>,
    /// The reaction of free connectors, unless it is the built-in one.
    pub(super) reaction: Option<&'a dyn Reaction>,
}

impl<'a, const D: usize> MotionContext<'a, D> {
    /// Returns the current place of a connector: its new place if it has one.
    pub(super) fn position(&self, i: usize) -> Point<D> {
        self.tentative.get(i).unwrap_or(self.chain.points()[i])
    }

    /// Visits every block that may be in the way of a rod and the connector at its end. If `rod` is
    /// `None`, the connector `tip` is alone.
    pub(super) fn visit_blocking_parts(
        &self,
        near: &Aabb<D>,
        rod: Option<usize>,
        tip: usize,
        mut visit_one: impl FnMut(&BlockingPart<D>),
    ) {
        self.obstacles.visit(near, |o| {
            visit_one(&BlockingPart {
                core: o.core,
                radius_m: o.radius_m,
                name: BlockingPartOwner::Obstacle(o.id),
                stops_rod: true,
                stops_tip: true,
            });
        });
        if self.rules.self_collision {
            self.own_rods.visit(near, |other| {
                for block in self.own_blocking_parts(other, rod, tip).into_iter().flatten() {
                    visit_one(&block);
                }
            });
        }
    }

    /// Returns a rod of the chain and its connectors (the last rod's both) as obstacles to another.
    /// Neighbors are exempt because they touch by construction, or nearly so in a tight bend.
    fn own_blocking_parts(
        &self,
        other: usize,
        rod: Option<usize>,
        tip: usize,
    ) -> [Option<BlockingPart<D>>; 3] {
        let own_rod = BlockingPart {
            core: ConvexCore::Segment([self.position(other), self.position(other + 1)]),
            radius_m: self.chain.rods()[other].radius_m,
            name: BlockingPartOwner::OwnRod(other),
            stops_rod: rod.is_some_and(|r| other.abs_diff(r) > 2),
            stops_tip: tip + 1 < other || tip > other + 2,
        };
        // Each rod stands for the connector at its lower end, so that none is visited twice.
        let is_last = other + 2 == self.chain.connectors().len();
        let lower = self.own_connector_blocking_part(other, rod, tip);
        let upper = is_last.then(|| self.own_connector_blocking_part(other + 1, rod, tip));
        [Some(own_rod), Some(lower), upper].map(|b| b.filter(|b| b.stops_rod || b.stops_tip))
    }

    #[inline]
    fn own_connector_blocking_part(
        &self,
        c: usize,
        rod: Option<usize>,
        tip: usize,
    ) -> BlockingPart<D> {
        BlockingPart {
            core: ConvexCore::Point(self.position(c)),
            radius_m: self.chain.connectors()[c].radius_m,
            name: BlockingPartOwner::OwnConnector(c),
            stops_rod: rod.is_some_and(|r| c + 1 < r || c > r + 2),
            stops_tip: c.abs_diff(tip) > 1,
        }
    }

    /// Checks whether the slave may be at `s`; returns the first objection otherwise.
    pub(super) fn check_slave(
        &self,
        step: &SlaveStep<D>,
        s: Point<D>,
    ) -> Result<(), IncompleteVeto> {
        if !step.is_bend_allowed_at(s) {
            return Err(IncompleteVeto::new(VetoReason::BendLimit));
        }
        let max_step_m = self.rules.slave_step_max_m;
        if max_step_m < f64::INFINITY && distance(step.so, s) > max_step_m {
            return Err(IncompleteVeto::new(VetoReason::StepLimit));
        }
        let reach_m = step.rod.radius_m.max(step.tip_radius_m);
        let near = swept_bounds([step.mo, step.so, step.mn, s], reach_m);
        let mut worst: Option<(f64, BlockingPartOwner, VetoReason)> = None;
        let rod = step.master.min(step.slave);
        let travel_m = step.rod_sweep(s).max_travel_m();
        self.visit_blocking_parts(&near, Some(rod), step.slave, |block| {
            if let Some((depth_m, reason)) = depth_and_reason(step, s, travel_m, block) {
                // Of equal depths the lower name counts, because blocks come in no particular order.
                let is_deeper = worst
                    .is_none_or(|(w, name, _)| depth_m > w || (depth_m == w && block.name < name));
                if is_deeper {
                    worst = Some((depth_m, block.name, reason));
                }
            }
        });
        worst.map_or(Ok(()), |(_, name, reason)| {
            Err(IncompleteVeto::from_blocking_owner(reason, name))
        })
    }

    /// Returns whether a connector's mobility allows a position.
    pub(super) fn may_be_at(&self, i: usize, p: Point<D>) -> bool {
        let connector = &self.chain.connectors()[i];
        if connector.is_still() {
            return p == self.chain.points()[i];
        }
        connector.mobility.allows(p, p)
    }
}

/// Returns the depth of a rod or its end in a block, and the reason of the veto; `None` if the block is
/// not in the way. No point of the rod moves by more than `travel_m`.
fn depth_and_reason<const D: usize>(
    step: &SlaveStep<D>,
    s: Point<D>,
    travel_m: f64,
    block: &BlockingPart<D>,
) -> Option<(f64, VetoReason)> {
    let rod = [step.mn, s];
    let core = &block.core;
    let rod_m = block.radius_m + step.rod.radius_m;
    let tip_m = block.radius_m + step.tip_radius_m;
    let tip_is_clear = !block.stops_tip || core.is_clear_of_point(s, contact_distance_m(tip_m));
    // One distance clears both the end of the path and the path itself: the usual case.
    let sure_m = contact_distance_m(rod_m).max(RodSweep::<D>::safe_distance_m(travel_m, rod_m));
    if tip_is_clear && (!block.stops_rod || core.is_clear_of_segment(rod, sure_m)) {
        return None;
    }
    let rod_is_clear = !block.stops_rod || core.is_clear_of_segment(rod, contact_distance_m(rod_m));
    if rod_is_clear && tip_is_clear {
        // A rod that starts inside has no clear path, and must be able to get out.
        let is_allowed =
            step.rod_sweep(s).is_path_clear(core, rod_m, travel_m) || was_inside(step, block);
        return (!is_allowed).then_some((0.0, VetoReason::WouldTunnel));
    }
    let now_m = depth_m(step.mn, s, step, block);
    let before_m = depth_m(step.mo, step.so, step, block);
    // A part that starts inside may stay, but must not go deeper.
    if before_m > TOLERANCE_M && now_m <= before_m {
        return None;
    }
    let reason =
        if before_m > TOLERANCE_M { VetoReason::Inside } else { VetoReason::BothSidesBlocked };
    Some((now_m, reason))
}

fn was_inside<const D: usize>(step: &SlaveStep<D>, block: &BlockingPart<D>) -> bool {
    depth_m(step.mo, step.so, step, block) > TOLERANCE_M
}

/// Returns the depth of a rod, or of the connector at its end, in a block, meters; negative outside.
fn depth_m<const D: usize>(
    m: Point<D>,
    s: Point<D>,
    step: &SlaveStep<D>,
    block: &BlockingPart<D>,
) -> f64 {
    let rod_m =
        block.radius_m + step.rod.radius_m - block.core.nearest_to_segment([m, s]).distance_m;
    let tip_m = block.radius_m + step.tip_radius_m - block.core.nearest_to_point(s).distance_m;
    let rod_m = if block.stops_rod { rod_m } else { f64::NEG_INFINITY };
    let tip_m = if block.stops_tip { tip_m } else { f64::NEG_INFINITY };
    rod_m.max(tip_m)
}

/// Returns whether a rod's length is within its limits, up to the tolerance.
#[inline]
pub fn is_length_allowed(rod: Rod, length_m: f64) -> bool {
    (rod.min_m - LENGTH_TOLERANCE_M..=rod.max_m + LENGTH_TOLERANCE_M).contains(&length_m)
}
