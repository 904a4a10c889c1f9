//! The context in which a slave reacts, and the validity check of every position of a part of a chain.
//!
//! A slave's reaction depends on its master's move, its own position, the rod before its master, and its
//! surroundings (slide E4), never on anything farther along the chain.

use super::chain::{Chain, LENGTH_TOLERANCE_M, Rod};
use super::geometry::{Aabb, ConvexCore, Point, angle_between_rad, distance, sub};
use super::obstacle::{Obstacles, swept_bounds};
use super::own_body::ChainPart;
use super::reaction::Reaction;
use super::rod_bvh::RodBvh;
use super::rules::ReactionRules;
use super::sweep::{RodPairSweep, RodSweep};
use super::veto::VetoReason;
use std::f64::consts::PI;
use std::ops::Range;

/// Penetration that counts as contact, meters: distances of segments are exact to about 1e-15 m of their coordinates,
/// so rounding is no contact.
pub const TOLERANCE_M: f64 = 1e-9;
/// Tolerance of bend limits, rad: far above the rounding of angles.
pub const BEND_TOLERANCE_RAD: f64 = 1e-9;
/// Distance below which a body without thickness is touched, meters. Its radius less the tolerance would
/// be negative, and it could be passed.
const TOUCH_M: f64 = 1e-12;

/// Rounding of the depth of two parts that move alike, meters.
const DEPTH_ROUNDING_M: f64 = 1e-12;

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

/// A part that may be in the way of a rod, or of the connector at its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BlockingPart<const D: usize> {
    pub(super) core: ConvexCore<D>,
    pub(super) name: BlockingPartOwner,
    /// Least distance of the rod's core line from the core, meters; none if it is not in the way of the rod.
    pub(super) rod_separation_m: Option<f64>,
    /// The same of the middle of the connector at the rod's end.
    pub(super) tip_separation_m: Option<f64>,
    /// The ends of its core line before the motion; none of an obstacle, which stands still in it.
    pub(super) before: Option<[Point<D>; 2]>,
}

impl<const D: usize> BlockingPart<D> {
    /// Returns the greatest distance that anything keeps from it, meters.
    pub(super) fn max_separation_m(&self) -> f64 {
        self.rod_separation_m.unwrap_or(0.0).max(self.tip_separation_m.unwrap_or(0.0))
    }

    fn core_before(&self) -> ConvexCore<D> {
        self.before.map_or(self.core, ConvexCore::Segment)
    }
}

/// What moves: a connector, and the rod to its master, unless it leads.
#[derive(Debug, Clone, Copy)]
pub(super) struct MovingPart {
    pub(super) tip: usize,
    pub(super) tip_radius_m: f64,
    /// Index and radius of the rod.
    pub(super) rod: Option<(usize, f64)>,
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
    /// Returns the slave and its rod as what moves.
    pub(super) fn moving_part(&self) -> MovingPart {
        let rod = self.master.min(self.slave);
        MovingPart {
            tip: self.slave,
            tip_radius_m: self.tip_radius_m,
            rod: Some((rod, self.rod.radius_m)),
        }
    }

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

    /// Visits every block that may be in the way of a moving part.
    pub(super) fn visit_blocking_parts(
        &self,
        near: &Aabb<D>,
        moving: &MovingPart,
        mut visit_one: impl FnMut(&BlockingPart<D>),
    ) {
        self.obstacles.visit(near, |o| {
            visit_one(&BlockingPart {
                core: o.core,
                name: BlockingPartOwner::Obstacle(o.id),
                rod_separation_m: moving.rod.map(|(_, radius_m)| o.radius_m + radius_m),
                tip_separation_m: Some(o.radius_m + moving.tip_radius_m),
                before: None,
            });
        });
        if self.rules.self_collision {
            self.own_rods.visit(near, |other| {
                // Each rod stands for the connector at its lower end, so that none is visited twice; the last one for both.
                let is_last = other + 2 == self.chain.connectors().len();
                let upper = is_last.then_some(ChainPart::Connector(other + 1));
                let parts = [Some(ChainPart::Rod(other)), Some(ChainPart::Connector(other)), upper];
                for part in parts.into_iter().flatten() {
                    if let Some(block) = self.own_blocking_part(part, moving) {
                        visit_one(&block);
                    }
                }
            });
        }
    }

    /// Returns a part of the chain as an obstacle to a moving one; none if it is in the way of neither its rod nor its
    /// connector.
    #[inline]
    fn own_blocking_part(&self, part: ChainPart, moving: &MovingPart) -> Option<BlockingPart<D>> {
        let separation_m = |moves: ChainPart| {
            let is_settled = !part.is_near_along_chain(moves) || self.is_settled(part, moving);
            if is_settled { self.chain.min_separation_m(moves, part) } else { None }
        };
        let rod_separation_m = moving.rod.and_then(|(rod, _)| separation_m(ChainPart::Rod(rod)));
        let tip_separation_m = separation_m(ChainPart::Connector(moving.tip));
        if rod_separation_m.is_none() && tip_separation_m.is_none() {
            return None;
        }
        let ends = [part.connector(), part.last_connector()].map(|k| self.position(k));
        let before = Some(part.ends(self.chain.points()));
        let (core, name) = match part {
            ChainPart::Connector(k) => {
                (ConvexCore::Point(ends[0]), BlockingPartOwner::OwnConnector(k))
            }
            ChainPart::Rod(i) => (ConvexCore::Segment(ends), BlockingPartOwner::OwnRod(i)),
        };
        Some(BlockingPart { core, name, rod_separation_m, tip_separation_m, before })
    }

    /// Returns whether a part near along the chain has its place for this motion. One that has yet to follow would
    /// object where it is now, though it is about to be pushed on; when its turn comes it is checked against what has
    /// moved.
    fn is_settled(&self, part: ChainPart, moving: &MovingPart) -> bool {
        let Some((rod, _)) = moving.rod else { return false };
        let goes_up = moving.tip > rod;
        if goes_up {
            // The connectors below the initiator follow in the second sweep, after those above it.
            self.tentative.from <= part.connector() && part.last_connector() <= moving.tip
        } else {
            part.connector() >= moving.tip
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
        let travel_m = step.rod_sweep(s).max_travel_m();
        self.visit_blocking_parts(&near, &step.moving_part(), |block| {
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
    let is_tip_clear = block
        .tip_separation_m
        .is_none_or(|tip_m| core.is_clear_of_point(s, contact_distance_m(tip_m)));
    // One distance clears both the end of the path and the path itself: the usual case.
    let approach_m = travel_m + block_travel_m(block);
    let is_surely_clear = |separation_m: f64| {
        let path_m = RodSweep::<D>::safe_distance_m(approach_m, separation_m);
        core.is_clear_of_segment(rod, contact_distance_m(separation_m).max(path_m))
    };
    let separation_m = block.rod_separation_m.or(block.tip_separation_m);
    if is_tip_clear && separation_m.is_none_or(is_surely_clear) {
        return None;
    }
    let is_rod_clear = block
        .rod_separation_m
        .is_none_or(|rod_m| core.is_clear_of_segment(rod, contact_distance_m(rod_m)));
    if is_rod_clear && is_tip_clear {
        let is_path_clear = is_path_clear(step, s, travel_m, block);
        return (!is_path_clear).then_some((0.0, VetoReason::WouldTunnel));
    }
    let now_m = depth_m([step.mn, s], core, block);
    let before_m = depth_m([step.mo, step.so], &block.core_before(), block);
    let was_inside = before_m > TOLERANCE_M;
    // A part that starts inside may stay, but must not go deeper, nor through another part of its chain.
    let is_no_deeper = match block.before {
        None => now_m <= before_m,
        Some(_) => now_m <= before_m + DEPTH_ROUNDING_M && is_path_clear(step, s, travel_m, block),
    };
    if was_inside && is_no_deeper {
        return None;
    }
    let reason = if was_inside { VetoReason::Inside } else { VetoReason::BothSidesBlocked };
    Some((now_m, reason))
}

/// Returns the longest distance that a point of a block moves in the motion, meters.
fn block_travel_m<const D: usize>(block: &BlockingPart<D>) -> f64 {
    let Some(from) = block.before else { return 0.0 };
    RodSweep { from, to: core_ends(&block.core) }.max_travel_m()
}

/// Returns the ends of the core line of a part of a chain.
fn core_ends<const D: usize>(core: &ConvexCore<D>) -> [Point<D>; 2] {
    match core {
        ConvexCore::Point(at) => [*at; 2],
        ConvexCore::Segment(ends) => *ends,
        ConvexCore::Cuboid(cuboid) => [cuboid.center; 2],
    }
}

/// Returns whether the rod to a slave, or the slave alone, passes through no block on its way.
fn is_path_clear<const D: usize>(
    step: &SlaveStep<D>,
    s: Point<D>,
    travel_m: f64,
    block: &BlockingPart<D>,
) -> bool {
    let sweep = step.rod_sweep(s);
    // A part of the chain moves as well, and may start too near.
    if let Some(from) = block.before {
        let other = RodSweep { from, to: core_ends(&block.core) };
        return match (block.rod_separation_m, block.tip_separation_m) {
            (Some(rod_m), _) => RodPairSweep { one: sweep, other }.is_clear(rod_m),
            (None, Some(tip_m)) => {
                let tip = RodSweep { from: [step.so; 2], to: [s; 2] };
                RodPairSweep { one: tip, other }.is_clear(tip_m)
            }
            (None, None) => true,
        };
    }
    let Some(rod_m) = block.rod_separation_m else { return true };
    // A rod that starts inside has no clear path, and must be able to get out.
    sweep.is_path_clear(&block.core, rod_m, travel_m)
        || depth_m([step.mo, step.so], &block.core, block) > TOLERANCE_M
}

/// Returns the depth of a rod, or of the connector at its second end, in the core of a block, meters; negative outside.
fn depth_m<const D: usize>(
    rod: [Point<D>; 2],
    core: &ConvexCore<D>,
    block: &BlockingPart<D>,
) -> f64 {
    let rod_m = block
        .rod_separation_m
        .map_or(f64::NEG_INFINITY, |rod_m| rod_m - core.nearest_to_segment(rod).distance_m);
    let tip_m = block
        .tip_separation_m
        .map_or(f64::NEG_INFINITY, |tip_m| tip_m - core.nearest_to_point(rod[1]).distance_m);
    rod_m.max(tip_m)
}

/// Returns whether a rod's length is within its limits, up to the tolerance.
#[inline]
pub fn is_length_allowed(rod: Rod, length_m: f64) -> bool {
    (rod.min_m - LENGTH_TOLERANCE_M..=rod.max_m + LENGTH_TOLERANCE_M).contains(&length_m)
}
