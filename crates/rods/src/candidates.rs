//! Candidate positions of a slave whose master has moved: push, pull, resize, rotate (slides A1 to A8).

use super::chain::{Mobility, Rod, SKIN_M};
use super::geometry::{
    ConvexCore, Cuboid, Point, add, add_scaled, angle_between_rad, convert_dimensions, distance,
    dot, lerp, norm, normalized, scaled, sub, unit_x,
};
use super::interval::{
    self, AngleInterval, RodTurnCircle, TurnDirection, add_tip_blocked_arcs, bend_forbidden_arc,
    block_rod, min_turn_to_free_rad,
};
use super::motion_context::{
    BlockingPart, BlockingPartOwner, IncompleteVeto, MotionContext, SlaveStep, is_length_allowed,
};
use super::obstacle::bounds_around;
use super::reaction::{MasterMove, Reaction};
use super::rules::RotationRule;
use super::search::{DirectionSearch, blocking_half_angle_cosine, direction_at_angle};
use super::veto::VetoReason;
use std::f64::consts::PI;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CandidatePosition<const D: usize> {
    pub(super) at: Point<D>,
    /// Whether the rod turned from the guide line.
    pub(super) rotated: bool,
    turn_rad: f64,
}

/// Buffers and options of the search for candidates, kept from one slave to the next so that nothing is
/// allocated.
#[derive(Debug, Clone, Default)]
pub(super) struct CandidateScratch<const D: usize> {
    blocks: Vec<BlockingPart<D>>,
    arcs: BlockedArcs,
    /// Whether a rod that turns tries all its lengths, or others only if its present one is
    /// blocked.
    pub(super) all_lengths: bool,
    /// Whether a planar rod looks for a free direction on both sides, or on the farther one only if the
    /// nearer has none.
    pub(super) both_sides: bool,
    /// Positions found by [`MotionContext::candidates`], best first.
    pub(super) found: Vec<CandidatePosition<D>>,
    /// Whether one side has not been examined yet.
    pub(super) has_other_side: bool,
    /// Whether any rod has found a free direction by turning since this was last reset; if none has,
    /// trying all lengths finds the same positions.
    pub(super) has_turned: bool,
}

/// Pushes, pulls or resizes one rod; returns the slave's new place, bit-identical if it stays.
#[inline]
pub(super) fn guide_line_slave_position<const D: usize>(
    [mo, mn, so]: [Point<D>; 3],
    rod: Rod,
    min_move_m: f64,
) -> Point<D> {
    let g = sub(so, mn);
    let d = norm(g);
    let t = clamped(d, rod.min_m, rod.max_m);
    if (t - d).abs() <= min_move_m {
        so
    } else if d > 0.0 {
        add_scaled(mn, g, t / d)
    } else {
        add_scaled(mn, normalized(sub(so, mo)).unwrap_or(unit_x()), t)
    }
}

/// Returns the length within a rod's limits that is nearest to `d`. Unlike `f64::clamp` it does not
/// handle NaN, and so takes only two instructions.
#[inline]
pub(super) fn clamped(d: f64, min_m: f64, max_m: f64) -> f64 {
    let t = if d > min_m { d } else { min_m };
    if t < max_m { t } else { max_m }
}

/// Largest number of alternating projections onto a box and onto the allowed lengths of the rod. They converge
/// slowly where the two sets only touch; then the slave objects, although there may be a place.
const MAX_BOX_ROUNDS: usize = 200;

/// Relative margin beyond which a direction is skipped without a check because it is too far: well above rounding, so
/// that none is skipped that the check itself would accept.
const ROUNDING: f64 = 1e-9;

/// Direction of the guide line (A1), or of the old rod if the master is at the slave's place.
fn guide_line_direction<const D: usize>(step: &SlaveStep<D>) -> Point<D> {
    normalized(sub(step.so, step.mn)).or(normalized(sub(step.so, step.mo))).unwrap_or(unit_x())
}

impl<const D: usize> MotionContext<'_, D> {
    /// Puts all valid positions of a slave, best first, into `scratch.found`; only the one on the guide
    /// line if it is valid.
    pub(super) fn candidates(
        &self,
        step: &SlaveStep<D>,
        scratch: &mut CandidateScratch<D>,
    ) -> Result<(), IncompleteVeto> {
        scratch.found.clear();
        scratch.has_other_side = false;
        let connector = &self.chain.connectors()[step.slave];
        if connector.is_still() {
            return self.add_immovable_slave_candidate(step, scratch);
        }
        if matches!(connector.mobility, Mobility::OnSegment(_) | Mobility::OnPlane { .. }) {
            return self.add_line_candidates(step, scratch);
        }
        let guided = guide_line_slave_position(
            [step.mo, step.mn, step.so],
            step.rod,
            self.chain.min_move_m(),
        );
        if let Some(reaction) = self.reaction {
            return self.place_by_reaction(reaction, step, guided, scratch);
        }
        let Err(objection) = self.check_place(step, guided) else {
            scratch.found.push(CandidatePosition { at: guided, rotated: false, turn_rad: 0.0 });
            return Ok(());
        };
        // Lines and planes were handled above, so it is a box that forbids the place.
        if objection.reason == VetoReason::Mobility
            && let Some(at) = self.project_into_box(step, guided)
            && self.check_slave(step, at).is_ok()
        {
            scratch.found.push(CandidatePosition { at, rotated: false, turn_rad: 0.0 });
            return Ok(());
        }
        match self.rules.rotation {
            RotationRule::Never => Err(objection),
            RotationRule::Literal => self.rotate_once(step, guided, scratch),
            RotationRule::Union => self.find_turn_candidates(step, guided, objection, scratch),
        }
    }

    /// Handles a slave by a reaction of the program's own; `guided` is its place on the guide line.
    fn place_by_reaction(
        &self,
        reaction: &dyn Reaction,
        step: &SlaveStep<D>,
        guided: Point<D>,
        scratch: &mut CandidateScratch<D>,
    ) -> Result<(), IncompleteVeto> {
        let check = |at_m: Point<3>| {
            let checked = self.check_rod_and_place(step, convert_dimensions(at_m));
            checked.map_err(|objection| objection.reason)
        };
        let percept = MasterMove {
            at_m: convert_dimensions(step.so),
            master_from_m: convert_dimensions(step.mo),
            master_to_m: convert_dimensions(step.mn),
            behind_master_m: step.prev.map(convert_dimensions),
            guided_m: convert_dimensions(guided),
            rod_m: [step.rod.min_m, step.rod.max_m],
            radius_m: step.tip_radius_m,
            max_bend_rad: step.max_bend_rad,
            check: &check,
        };
        let at = convert_dimensions(reaction.react(&percept).map_err(IncompleteVeto::new)?);
        self.check_rod_and_place(step, at)?;
        scratch.found.push(CandidatePosition { at, rotated: at != guided, turn_rad: 0.0 });
        Ok(())
    }

    /// Checks a place of a slave that may be at any distance from its master.
    fn check_rod_and_place(&self, step: &SlaveStep<D>, at: Point<D>) -> Result<(), IncompleteVeto> {
        // No comparison holds for a coordinate that is no number.
        if !is_length_allowed(step.rod, distance(step.mn, at)) {
            // A rod out of its limits has no reason of its own: it limits where its slave may be.
            return Err(IncompleteVeto::new(VetoReason::Mobility));
        }
        self.check_place(step, at)
    }

    /// Returns a position that the rod allows for a slave confined to a box, by alternating projections
    /// onto the box and onto the rod's lengths.
    fn project_into_box(&self, step: &SlaveStep<D>, guided: Point<D>) -> Option<Point<D>> {
        let mobility = &self.chain.connectors()[step.slave].mobility;
        let mut at = guided;
        for _ in 0..MAX_BOX_ROUNDS {
            at = mobility.project(at, step.so);
            let d = distance(at, step.mn);
            if is_length_allowed(step.rod, d) {
                return Some(at);
            }
            let t = d.max(step.rod.min_m).min(step.rod.max_m);
            at = add_scaled(step.mn, sub(at, step.mn), t / d.max(f64::MIN_POSITIVE));
        }
        None
    }

    fn check_place(&self, step: &SlaveStep<D>, at: Point<D>) -> Result<(), IncompleteVeto> {
        if !self.may_be_at(step.slave, at) {
            return Err(IncompleteVeto::new(VetoReason::Mobility));
        }
        self.check_slave(step, at)
    }

    /// Handles a slave that never moves: it objects unless the rod is within its limits as it is.
    fn add_immovable_slave_candidate(
        &self,
        step: &SlaveStep<D>,
        scratch: &mut CandidateScratch<D>,
    ) -> Result<(), IncompleteVeto> {
        if !is_length_allowed(step.rod, distance(step.mn, step.so)) {
            return Err(IncompleteVeto::new(self.chain.connectors()[step.slave].still_reason()));
        }
        self.check_slave(step, step.so)?;
        scratch.found.push(CandidatePosition { at: step.so, rotated: false, turn_rad: 0.0 });
        Ok(())
    }

    /// Handles a slave on a line or in a plane: finds the nearest places there that the rod allows.
    fn add_line_candidates(
        &self,
        step: &SlaveStep<D>,
        scratch: &mut CandidateScratch<D>,
    ) -> Result<(), IncompleteVeto> {
        let d = distance(step.mn, step.so);
        let t = d.max(step.rod.min_m).min(step.rod.max_m);
        let places = if (t - d).abs() <= self.chain.min_move_m() {
            [Some(step.so), None]
        } else {
            match self.chain.connectors()[step.slave].mobility {
                Mobility::OnSegment(ends) => segment_points_at_distance(step.mn, t, ends),
                Mobility::OnPlane { normal, offset_m } => {
                    plane_points_at_distance(step.mn, t, step.so, normal, offset_m)
                }
                _ => [None; 2],
            }
        };
        let mut last_objection = IncompleteVeto::new(VetoReason::Mobility);
        for at in places.into_iter().flatten() {
            match self.check_slave(step, at) {
                Ok(()) => {
                    scratch.found.push(CandidatePosition { at, rotated: false, turn_rad: 0.0 })
                }
                Err(objection) => last_objection = objection,
            }
        }
        sort(step, &mut scratch.found);
        if scratch.found.is_empty() { Err(last_objection) } else { Ok(()) }
    }

    /// Applies the slides' rule literally (A7): one turn to the tangent of the obstacle nearest to the
    /// master, without a check of the result.
    fn rotate_once(
        &self,
        step: &SlaveStep<D>,
        guided: Point<D>,
        scratch: &mut CandidateScratch<D>,
    ) -> Result<(), IncompleteVeto> {
        self.collect_blocking_parts(step, distance(step.mn, guided), scratch);
        let hits = scratch
            .blocks
            .iter()
            .filter_map(|block| RodObstacleHit::from_blocking_part(step, guided, block));
        let first = hits
            .min_by(|a, b| a.from_master_m.total_cmp(&b.from_master_m).then(a.name.cmp(&b.name)));
        let at = first.and_then(|hit| hit.tangent_place(step, guided)).unwrap_or(guided);
        if !self.may_be_at(step.slave, at) {
            return Err(IncompleteVeto::new(VetoReason::Mobility));
        }
        scratch.found.push(CandidatePosition { at, rotated: true, turn_rad: 0.0 });
        Ok(())
    }

    /// Applies the union rule: for the rod's length, and for others it may have, finds the nearest
    /// directions free of all obstacles.
    fn find_turn_candidates(
        &self,
        step: &SlaveStep<D>,
        guided: Point<D>,
        objection: IncompleteVeto,
        scratch: &mut CandidateScratch<D>,
    ) -> Result<(), IncompleteVeto> {
        let Rod { min_m, max_m, .. } = step.rod;
        self.collect_blocking_parts(step, max_m, scratch);
        // The present length first, because it is nearly always free and moves the slave least. Of all others in the
        // interval these three stand for a short, a long and a middle one.
        let own_m = distance(step.mn, guided);
        let lengths_m = [own_m, min_m, max_m, 0.5 * (min_m + max_m)];
        let n = if min_m < max_m { 4 } else { 1 };
        let mut informative = None;
        let mut inside = None;
        for &length_m in &lengths_m[..n] {
            if scratch.found.is_empty() || scratch.all_lengths {
                inside =
                    inside.or(self.add_turn_candidates(step, length_m, scratch, &mut informative));
            }
        }
        sort(step, &mut scratch.found);
        if !scratch.found.is_empty() {
            scratch.has_turned = true;
            return Ok(());
        }
        let inside =
            inside.map(|name| IncompleteVeto::from_blocking_owner(VetoReason::Inside, name));
        Err(informative.or(inside).unwrap_or(objection))
    }

    /// Adds the good places for one length of the rod; returns the block that contains the master.
    fn add_turn_candidates(
        &self,
        step: &SlaveStep<D>,
        length_m: f64,
        scratch: &mut CandidateScratch<D>,
        informative: &mut Option<IncompleteVeto>,
    ) -> Option<BlockingPartOwner> {
        let u0 = guide_line_direction(step);
        let CandidateScratch { blocks, arcs, found, has_other_side, .. } = scratch;
        let finds_all = scratch.all_lengths || scratch.both_sides;
        let mut turns = RodTurnCandidates { context: self, step, length_m, u0, found, informative };
        if D == 2 {
            let plane = PlanarDirectionSearch { step, length_m, u0: to_plane(u0), blocks };
            let mut sides = plane.free_directions(arcs);
            while let Some(u) = sides.next(|u| turns.is_useless_direction(u)) {
                if turns.add(u) && !finds_all {
                    *has_other_side = sides.has_more();
                    break;
                }
            }
            return arcs.inside;
        }
        // A master inside an obstacle cannot turn out of it.
        let inside = blocks.iter().filter(|b| contains_master(step, b)).map(|b| b.name).min();
        blocks.retain(|b| !contains_master(step, b));
        let search = DirectionSearch { step, length_m, blocks };
        if search.turn_away(u0).is_some_and(|u| turns.add(u)) {
            return inside;
        }
        if let Some(u) = search.search_rings(u0, |u| turns.is_valid(u)) {
            turns.add(u);
        }
        inside
    }

    /// Returns whether a position is surely farther from the slave than it may move in one step.
    fn is_too_far(&self, step: &SlaveStep<D>, at: Point<D>) -> bool {
        distance(step.so, at) > self.rules.slave_step_max_m * (1.0 + ROUNDING)
    }

    /// Collects all blocks that a rod of a length may meet on any side. The order is that of the grid
    /// or the tree, and must not matter, so ties go to the lower name.
    fn collect_blocking_parts(
        &self,
        step: &SlaveStep<D>,
        length_m: f64,
        scratch: &mut CandidateScratch<D>,
    ) {
        // Twice the skin that turned rods keep, so that rounding misses no block that bounds a
        // turn.
        let reach_m = length_m + step.rod.radius_m.max(step.tip_radius_m) + 2.0 * SKIN_M;
        scratch.blocks.clear();
        let near = bounds_around(step.mn, reach_m);
        self.visit_blocking_parts(&near, &step.moving_part(), |block| {
            let touch_m = length_m + block.max_separation_m() + 2.0 * SKIN_M;
            if !block.core.is_clear_of_point(step.mn, touch_m) {
                scratch.blocks.push(*block);
            }
        });
    }
}

/// An obstacle that a rod meets in the direction of its guide line.
struct RodObstacleHit<const D: usize> {
    /// The point of the obstacle's core that is nearest to the rod.
    on_core: Point<D>,
    radius_m: f64,
    /// Distance from the master at which the rod meets it.
    from_master_m: f64,
    name: BlockingPartOwner,
}

impl<const D: usize> RodObstacleHit<D> {
    fn from_blocking_part(
        step: &SlaveStep<D>,
        guided: Point<D>,
        block: &BlockingPart<D>,
    ) -> Option<Self> {
        let radius_m = block.rod_separation_m?;
        let nearest = block.core.nearest_to_segment([step.mn, guided]);
        (nearest.distance_m < radius_m).then(|| Self {
            on_core: nearest.on_core,
            radius_m,
            from_master_m: distance(nearest.on_body, step.mn),
            name: block.name,
        })
    }

    /// Returns the slave's place when the rod has turned to the tangent of the obstacle.
    fn tangent_place(&self, step: &SlaveStep<D>, guided: Point<D>) -> Option<Point<D>> {
        let length_m = distance(step.mn, guided);
        let to = sub(self.on_core, step.mn);
        let cosine = blocking_half_angle_cosine(norm(to), self.radius_m, length_m, false)?;
        let u = direction_at_angle(guide_line_direction(step), normalized(to)?, cosine);
        Some(add_scaled(step.mn, u, length_m))
    }
}

/// The places of a slave found by turning its rod, at one length of it.
struct RodTurnCandidates<'a, const D: usize> {
    context: &'a MotionContext<'a, D>,
    step: &'a SlaveStep<D>,
    length_m: f64,
    u0: Point<D>,
    found: &'a mut Vec<CandidatePosition<D>>,
    informative: &'a mut Option<IncompleteVeto>,
}

impl<const D: usize> RodTurnCandidates<'_, D> {
    fn place(&self, u: Point<D>) -> Point<D> {
        add_scaled(self.step.mn, u, self.length_m)
    }

    fn is_valid(&self, u: Point<D>) -> bool {
        self.context.check_place(self.step, self.place(u)).is_ok()
    }

    /// Returns whether a direction, and any farther from the guide line, neither gives a place nor a better reason.
    fn is_useless_direction(&self, u: Point<D>) -> bool {
        self.informative.is_some() && self.context.is_too_far(self.step, self.place(u))
    }

    /// Adds the place in a direction if it is valid; returns whether it is.
    fn add(&mut self, u: Point<D>) -> bool {
        let at = self.place(u);
        match self.context.check_place(self.step, at) {
            Ok(()) => {
                let turn_rad = angle_between_rad(self.u0, u);
                self.found.push(CandidatePosition { at, rotated: true, turn_rad });
                true
            }
            Err(objection) => {
                keep_informative_veto(self.informative, objection);
                false
            }
        }
    }
}

/// Keeps the first informative objection: a direction free of obstacles that fails for another reason.
#[inline]
fn keep_informative_veto(informative: &mut Option<IncompleteVeto>, objection: IncompleteVeto) {
    if !matches!(objection.reason, VetoReason::BothSidesBlocked | VetoReason::BendLimit) {
        informative.get_or_insert(objection);
    }
}

fn contains_master<const D: usize>(step: &SlaveStep<D>, block: &BlockingPart<D>) -> bool {
    block
        .rod_separation_m
        .is_some_and(|rod_m| block.core.nearest_to_point(step.mn).distance_m < rod_m)
}

fn sort<const D: usize>(step: &SlaveStep<D>, found: &mut [CandidatePosition<D>]) {
    // The sort is stable, so of equal candidates the counterclockwise one, found first, stays
    // first.
    found.sort_by(|a, b| {
        let a_m = distance(a.at, step.so);
        let b_m = distance(b.at, step.so);
        a_m.total_cmp(&b_m).then(a.turn_rad.total_cmp(&b.turn_rad))
    });
}

/// Blocked directions, computed only where needed.
#[derive(Debug, Clone, Default)]
struct BlockedArcs {
    arcs: Vec<AngleInterval>,
    /// Whether the arcs of each block have been computed.
    known: Vec<bool>,
    /// The block that contains the master.
    inside: Option<BlockingPartOwner>,
}

/// A plane rod of one length that looks for a free direction near `u0`.
struct PlanarDirectionSearch<'a, const D: usize> {
    step: &'a SlaveStep<D>,
    length_m: f64,
    u0: Point<2>,
    blocks: &'a [BlockingPart<D>],
}

impl<const D: usize> PlanarDirectionSearch<'_, D> {
    /// Returns the nearest free directions to the left and to the right, the nearer one first.
    fn free_directions<'a>(&'a self, known: &'a mut BlockedArcs) -> FreeDirections<'a, D> {
        known.arcs.clear();
        known.known.clear();
        known.known.resize(self.blocks.len(), false);
        known.inside = None;
        let step = self.step;
        if let Some(prev) = step.prev.filter(|_| step.max_bend_rad < PI) {
            known.arcs.push(bend_forbidden_arc(to_plane(sub(step.mn, prev)), step.max_bend_rad));
        }
        let start_rad = interval::direction_rad(self.u0);
        FreeDirections { plane: self, known, start_rad, is_open: [true; 2] }
    }

    /// Adds the arcs of all blocks that a rod in a direction meets; returns whether there were any.
    fn add_arcs_at(&self, u: Point<D>, known: &mut BlockedArcs) -> bool {
        let s = add_scaled(self.step.mn, u, self.length_m);
        let mut has_added = false;
        for (k, block) in self.blocks.iter().enumerate() {
            if !known.known[k] && self.intersects_blocking_part(s, block) {
                known.known[k] = true;
                self.add_blocked_arcs(block, known);
                has_added = true;
            }
        }
        has_added
    }

    fn intersects_blocking_part(&self, s: Point<D>, block: &BlockingPart<D>) -> bool {
        // More than the skin in the arcs, so that no direction in an arc looks free by rounding.
        let near_m = 2.0 * SKIN_M;
        let rod = [self.step.mn, s];
        let core = &block.core;
        block.rod_separation_m.is_some_and(|rod_m| !core.is_clear_of_segment(rod, rod_m + near_m))
            || block
                .tip_separation_m
                .is_some_and(|tip_m| !core.is_clear_of_point(s, tip_m + near_m))
    }

    fn add_blocked_arcs(&self, block: &BlockingPart<D>, known: &mut BlockedArcs) {
        let reach = RodTurnCircle { master: to_plane(self.step.mn), length_m: self.length_m };
        let core = project_core_to_plane(&block.core);
        if let Some(rod_m) = block.rod_separation_m {
            let apart_m = core.nearest_to_point(reach.master).distance_m;
            // If the master is within the skin of a surface, the half-plane behind it is blocked; with the
            // whole skin it would count as inside.
            let skinned_m = if apart_m >= rod_m { (rod_m + SKIN_M).min(apart_m) } else { rod_m };
            if !block_rod(&reach, &core, skinned_m, &mut known.arcs) {
                known.inside = Some(known.inside.map_or(block.name, |name| name.min(block.name)));
            }
        }
        // Arcs of a connector no thicker than its rod lie within those of the rod.
        let is_thicker = block.tip_separation_m > block.rod_separation_m;
        if let Some(tip_m) = block.tip_separation_m.filter(|_| is_thicker) {
            add_tip_blocked_arcs(&reach, &core, tip_m + SKIN_M, &mut known.arcs);
        }
    }
}

/// An iterator over the free directions on both sides, the nearer one first.
///
/// Only blocks that the rod meets while it turns become arcs: a direction that is the first outside
/// all these arcs, and in which the rod meets no other block, is also the first outside the arcs of
/// all blocks.
struct FreeDirections<'a, const D: usize> {
    plane: &'a PlanarDirectionSearch<'a, D>,
    known: &'a mut BlockedArcs,
    start_rad: f64,
    /// Whether there may be a direction to the left, and one to the right.
    is_open: [bool; 2],
}

impl<const D: usize> FreeDirections<'_, D> {
    fn has_more(&self) -> bool {
        self.is_open != [false; 2]
    }

    /// Returns the next free direction; none once `is_useless` rejects a direction, and so any that is
    /// farther from the start.
    fn next(&mut self, is_useless: impl Fn(Point<D>) -> bool) -> Option<Point<D>> {
        loop {
            let turns_rad = [TurnDirection::Left, TurnDirection::Right].map(|side| {
                let is_open = self.is_open[side as usize];
                is_open
                    .then(|| min_turn_to_free_rad(&self.known.arcs, self.start_rad, side))
                    .flatten()
            });
            self.is_open = turns_rad.map(|turn| turn.is_some());
            let (side, turn_rad) = match turns_rad {
                [Some(left), Some(right)] if right < left => (TurnDirection::Right, right),
                [Some(left), _] => (TurnDirection::Left, left),
                [None, Some(right)] => (TurnDirection::Right, right),
                [None, None] => return None,
            };
            let turned = interval::turn(self.plane.u0, turn_rad, side);
            let u: Point<D> = std::array::from_fn(|i| turned[i]);
            if is_useless(u) {
                return None;
            }
            if !self.plane.add_arcs_at(u, self.known) {
                self.is_open[side as usize] = false;
                return Some(u);
            }
        }
    }
}

fn to_plane<const D: usize>(p: Point<D>) -> Point<2> {
    [p[0], p[1]]
}

fn project_core_to_plane<const D: usize>(core: &ConvexCore<D>) -> ConvexCore<2> {
    match core {
        ConvexCore::Point(c) => ConvexCore::Point(to_plane(*c)),
        ConvexCore::Segment([a, b]) => ConvexCore::Segment([to_plane(*a), to_plane(*b)]),
        ConvexCore::Cuboid(c) => ConvexCore::Cuboid(Cuboid {
            center: to_plane(c.center),
            axes: [to_plane(c.axes[0]), to_plane(c.axes[1])],
            half_m: to_plane(c.half_m),
        }),
    }
}

/// Returns the points of a segment at distance `t` from `m`, the one nearer to its start first.
fn segment_points_at_distance<const D: usize>(
    m: Point<D>,
    t: f64,
    [a, b]: [Point<D>; 2],
) -> [Option<Point<D>>; 2] {
    let d = sub(b, a);
    let r = sub(a, m);
    let dd = dot(d, d);
    let dr = dot(d, r);
    let discriminant = dr * dr - dd * (dot(r, r) - t * t);
    if discriminant < 0.0 || dd <= 0.0 {
        return [None; 2];
    }
    [-discriminant.sqrt(), discriminant.sqrt()].map(|root| {
        let fraction = (-dr + root) / dd;
        (0.0..=1.0).contains(&fraction).then(|| lerp(a, b, fraction))
    })
}

/// Returns the points of a plane at a given distance from `m` that are nearest to and farthest from
/// `so`.
fn plane_points_at_distance<const D: usize>(
    m: Point<D>,
    t: f64,
    so: Point<D>,
    normal: Point<D>,
    offset_m: f64,
) -> [Option<Point<D>>; 2] {
    let height_m = offset_m - dot(normal, m);
    let foot = add_scaled(m, normal, height_m);
    let radius2 = t * t - height_m * height_m;
    if radius2 < 0.0 {
        return [None; 2];
    }
    let flat = sub(so, foot);
    let flat = add_scaled(flat, normal, -dot(normal, flat));
    let u = normalized(flat).unwrap_or_else(|| super::geometry::perpendicular(normal));
    [1.0, -1.0].map(|side| Some(add(foot, scaled(u, side * radius2.sqrt()))))
}
