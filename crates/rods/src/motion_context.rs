//! The perception and the options of one slave: the judge of every position of a chain's part.
//!
//! A slave's reaction depends on its master's move, its own place, the rod before, and its
//! surroundings (slide E4), never on anything farther along the chain.

use super::chain::{Chain, LENGTH_TOLERANCE_M, Rod};
use super::geometry::{Bounds, Core, Point, angle_rad, distance, sub};
use super::obstacle::{Obstacles, swept_bounds};
use super::rod_bvh::RodBvh;
use super::rules::Rules;
use super::sweep::Sweep;
use super::veto::VetoReason;
use std::f64::consts::PI;
use std::ops::Range;

/// Clearance that a turn aims at, meters. It is at least ten times the tolerance, because otherwise
/// the next step would start "inside".
pub const SKIN_M: f64 = 1e-7;
/// Penetration that counts as contact, meters.
pub const TOLERANCE_M: f64 = 1e-9;
/// Tolerance of bend limits, rad.
pub const BEND_TOLERANCE_RAD: f64 = 1e-9;
/// Distance below which a body without any thickness is touched, meters.
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
        (self.from, self.to) = (first, first);
    }

    /// Returns the connectors that have a new position.
    pub(super) fn run(&self) -> Range<usize> {
        self.from..self.to
    }

    /// Sets the position of a connector of the run, or of one beside it.
    pub(super) fn set(&mut self, i: usize, p: Point<D>) {
        debug_assert!(self.from <= i + 1 && i <= self.to, "the run would have a gap");
        self.points[i] = p;
        (self.from, self.to) = (self.from.min(i), self.to.max(i + 1));
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
pub(super) struct Block<const D: usize> {
    pub(super) core: Core<D>,
    pub(super) radius_m: f64,
    pub(super) name: BlockOwner,
    /// Whether it is in the way of the rod, and of the connector at its end.
    pub(super) stops_rod: bool,
    pub(super) stops_tip: bool,
}

/// The owner of a block; its order breaks ties.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum BlockOwner {
    Obstacle(u32),
    OwnRod(usize),
    OwnConnector(usize),
}

impl BlockOwner {
    #[inline]
    pub(super) fn obstacle(self) -> Option<u32> {
        match self {
            Self::Obstacle(id) => Some(id),
            Self::OwnRod(_) | Self::OwnConnector(_) => None,
        }
    }
}

/// An objection, before the length of the motion is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PendingVeto {
    /// Its reason.
    pub reason: VetoReason,
    /// The obstacle in the way, if there is one.
    pub obstacle: Option<u32>,
}

impl PendingVeto {
    #[inline]
    pub(super) fn new(reason: VetoReason) -> Self {
        Self { reason, obstacle: None }
    }

    #[inline]
    pub(super) fn from_owner(reason: VetoReason, name: BlockOwner) -> Self {
        let reason = if name.obstacle().is_none() { VetoReason::SelfCollision } else { reason };
        Self { reason, obstacle: name.obstacle() }
    }
}

/// A master that moved, and its slave.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlaveStep<const D: usize> {
    pub(super) master: usize,
    pub(super) slave: usize,
    /// The master before and after, and the slave before.
    pub(super) mo: Point<D>,
    pub(super) mn: Point<D>,
    pub(super) so: Point<D>,
    /// The connector on the master's other side, if its place is settled.
    pub(super) prev: Option<Point<D>>,
    pub(super) rod: Rod,
    /// Radius of the slave's body and bend limit of the master.
    pub(super) tip_radius_m: f64,
    pub(super) max_bend_rad: f64,
}

impl<const D: usize> SlaveStep<D> {
    fn sweep(&self, s: Point<D>) -> Sweep<D> {
        Sweep { from: [self.mo, self.so], to: [self.mn, s] }
    }

    pub(super) fn is_bend_allowed_at(&self, s: Point<D>) -> bool {
        let Some(prev) = self.prev else { return true };
        self.max_bend_rad >= PI
            || angle_rad(sub(self.mn, prev), sub(s, self.mn))
                <= self.max_bend_rad + BEND_TOLERANCE_RAD
    }
}

/// Returns the distance at which a body and an obstacle only touch, meters.
#[inline]
pub fn contact_distance_m(radius_m: f64) -> f64 {
    (radius_m - TOLERANCE_M).max(TOUCH_M)
}

/// The inputs of a motion.
pub(super) struct MotionContext<'a, const D: usize> {
    pub(super) chain: &'a Chain<D>,
    pub(super) obstacles: &'a Obstacles<D>,
    pub(super) rules: &'a Rules,
    pub(super) tentative: &'a TentativePositions<D>,
    pub(super) own_rods: &'a RodBvh<D>,
}

impl<'a, const D: usize> MotionContext<'a, D> {
    /// Returns the current place of a connector: its new place if it has one.
    pub(super) fn position(&self, i: usize) -> Point<D> {
        self.tentative.get(i).unwrap_or(self.chain.points()[i])
    }

    /// Visits every block that may be in the way of a rod and the connector at its end. If `rod` is
    /// `None`, the connector `tip` is alone.
    pub(super) fn visit_blocks(
        &self,
        near: &Bounds<D>,
        rod: Option<usize>,
        tip: usize,
        mut visit_one: impl FnMut(&Block<D>),
    ) {
        self.obstacles.visit(near, |o| {
            visit_one(&Block {
                core: o.core,
                radius_m: o.radius_m,
                name: BlockOwner::Obstacle(o.id),
                stops_rod: true,
                stops_tip: true,
            });
        });
        if self.rules.self_collision {
            self.own_rods.visit(near, |other| {
                for block in self.own_blocks(other, rod, tip).into_iter().flatten() {
                    visit_one(&block);
                }
            });
        }
    }

    /// Returns a rod of the chain and its connectors (the last rod's both) as obstacles to another.
    /// Neighbors are exempt because they touch by construction.
    fn own_blocks(&self, other: usize, rod: Option<usize>, tip: usize) -> [Option<Block<D>>; 3] {
        let connectors = self.chain.connectors();
        let connector = |c: usize| {
            let far_from_rod = rod.is_some_and(|r| c + 1 < r || c > r + 2);
            Block {
                core: Core::Point(self.position(c)),
                radius_m: connectors[c].radius_m,
                name: BlockOwner::OwnConnector(c),
                stops_rod: far_from_rod,
                stops_tip: c.abs_diff(tip) > 1,
            }
        };
        let own_rod = Block {
            core: Core::Segment([self.position(other), self.position(other + 1)]),
            radius_m: self.chain.rods()[other].radius_m,
            name: BlockOwner::OwnRod(other),
            stops_rod: rod.is_some_and(|r| other.abs_diff(r) > 2),
            stops_tip: tip + 1 < other || tip > other + 2,
        };
        let is_last = other + 2 == connectors.len();
        [Some(own_rod), Some(connector(other)), is_last.then(|| connector(other + 1))]
            .map(|b| b.filter(|b| b.stops_rod || b.stops_tip))
    }

    /// Checks whether the slave may be at `s`; returns the first objection otherwise.
    pub(super) fn check_slave(&self, step: &SlaveStep<D>, s: Point<D>) -> Result<(), PendingVeto> {
        if !step.is_bend_allowed_at(s) {
            return Err(PendingVeto::new(VetoReason::BendLimit));
        }
        let longest_m = self.rules.slave_step_max_m;
        if longest_m < f64::INFINITY && distance(step.so, s) > longest_m {
            return Err(PendingVeto::new(VetoReason::StepLimit));
        }
        let reach_m = step.rod.radius_m.max(step.tip_radius_m);
        let near = swept_bounds([step.mo, step.so, step.mn, s], reach_m);
        let mut worst: Option<(f64, BlockOwner, VetoReason)> = None;
        let rod = step.master.min(step.slave);
        let way_m = step.sweep(s).max_travel_m();
        self.visit_blocks(&near, Some(rod), step.slave, |block| {
            if let Some((depth_m, reason)) = depth_and_reason(step, s, way_m, block) {
                let deeper = worst
                    .is_none_or(|(w, name, _)| depth_m > w || (depth_m == w && block.name < name));
                if deeper {
                    worst = Some((depth_m, block.name, reason));
                }
            }
        });
        worst.map_or(Ok(()), |(_, name, reason)| Err(PendingVeto::from_owner(reason, name)))
    }

    /// Returns whether the slave stays where it is allowed to be.
    pub(super) fn may_be_at(&self, i: usize, p: Point<D>) -> bool {
        let connector = &self.chain.connectors()[i];
        if connector.is_still() {
            return p == self.chain.points()[i];
        }
        connector.mobility.allows(p, p)
    }
}

/// Returns the depth of a rod or its end in a block, and the reason; `None` if all is well. No point of
/// the rod moves by more than `way_m`.
fn depth_and_reason<const D: usize>(
    step: &SlaveStep<D>,
    s: Point<D>,
    way_m: f64,
    block: &Block<D>,
) -> Option<(f64, VetoReason)> {
    let (rod, core) = ([step.mn, s], &block.core);
    let rod_m = block.radius_m + step.rod.radius_m;
    let tip_m = block.radius_m + step.tip_radius_m;
    let tip_is_clear = !block.stops_tip || core.is_clear_of_point(s, contact_distance_m(tip_m));
    let sure_m = contact_distance_m(rod_m).max(Sweep::<D>::safe_distance_m(way_m, rod_m));
    if tip_is_clear && (!block.stops_rod || core.is_clear_of_segment(rod, sure_m)) {
        return None;
    }
    let rod_is_clear = !block.stops_rod || core.is_clear_of_segment(rod, contact_distance_m(rod_m));
    if rod_is_clear && tip_is_clear {
        let passes =
            step.sweep(s).is_clear_on_the_way(core, rod_m, way_m) || was_inside(step, block);
        return (!passes).then_some((0.0, VetoReason::WouldTunnel));
    }
    let (now_m, before_m) =
        (depth_m(step.mn, s, step, block), depth_m(step.mo, step.so, step, block));
    // A part that starts inside may stay, but must not go deeper.
    if before_m > TOLERANCE_M && now_m <= before_m {
        return None;
    }
    let reason =
        if before_m > TOLERANCE_M { VetoReason::Inside } else { VetoReason::BothSidesBlocked };
    Some((now_m, reason))
}

fn was_inside<const D: usize>(step: &SlaveStep<D>, block: &Block<D>) -> bool {
    depth_m(step.mo, step.so, step, block) > TOLERANCE_M
}

/// Returns the depth of a rod, or of the connector at its end, in a block, meters; negative outside.
fn depth_m<const D: usize>(m: Point<D>, s: Point<D>, step: &SlaveStep<D>, block: &Block<D>) -> f64 {
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
