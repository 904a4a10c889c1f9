//! Propagation of one motion through the whole chain, or not at all (slides R1 to R7).
//!
//! The initiator moves; from it two sweeps go outward, each slave reacting to its master and
//! becoming the next one's master. Both sweeps write to tentative positions, which are committed
//! only once both have succeeded: a veto leaves every bit of the chain as it was.

use super::candidates::{CandidatePosition, CandidateScratch};
use super::chain::{Chain, is_in_range, out_of_range};
use super::geometry::{Point, distance, lerp};
use super::motion_bounds::SeparationBounds;
use super::motion_context::{
    BlockingPartOwner, IncompleteVeto, MotionContext, MovingPart, SlaveStep, TOLERANCE_M,
    TentativePositions, contact_distance_m, is_length_allowed,
};
use super::obstacle::{Obstacles, swept_bounds};
use super::open::{self, StayRule};
use super::pass::{ChainDirection, MotionEffects};
use super::projection::{ConstraintProjector, ProjectionFailure};
use super::reaction::Reaction;
use super::rod_bvh::RodBvh;
use super::rules::{ReactionRules, RotationRule};
use super::veto::{
    CompletedMotion, MotionOutcome, MotionRequest, RequestedMotion, Veto, VetoEffect, VetoReason,
};
pub(super) use separation::SeparationProofSchedule;
use sidestep_kernel::{InputError, interrupt};
use std::ops::Range;
use std::sync::Arc;

/// Largest number of sub-steps of a request. One that would need more is an input error: it comes from a wrong
/// unit or from a rod of nearly no length, and would seem to hang.
const MAX_SUB_STEPS: f64 = 1e6;
/// Fraction of a sub-step by which a request may be longer than a whole number of them: the length of a request is that
/// of a difference of coordinates, and its rounding must not cost a sub-step.
const SUB_STEP_ROUNDING: f64 = 1e-9;
/// Number of sub-steps between two checks for an interrupt. On a chain of a million connectors 16 sub-steps take about
/// 0.3 s, and on a short one the check costs nothing beside them.
const INTERRUPT_CHECK_INTERVAL: usize = 16;

/// Moves chains by the rules. It owns the buffers of a motion, so that no motion allocates, and
/// remembers nothing from one motion to the next that a result depends on.
#[derive(Debug, Clone, Default)]
pub struct Propagator<const D: usize> {
    /// Rules by which it moves chains; they may change from one request to the next.
    pub rules: ReactionRules,
    /// The reaction of free connectors, unless it is the built-in one.
    reaction: Option<Arc<dyn Reaction>>,
    tentative: TentativePositions<D>,
    pub(super) own_rods: RodBvh<D>,
    motion_bounds: SeparationBounds<D>,
    /// When to try proofs of sub-steps among obstacles.
    proofs: SeparationProofSchedule,
    scratch: CandidateScratch<D>,
    projector: ConstraintProjector<D>,
    alternatives: Vec<BacktrackAlternative<D>>,
    /// Positions before the request, of the run of connectors that have moved since: a veto in a
    /// later sub-step takes back the earlier ones.
    original: TentativePositions<D>,
    tally: MotionEffects,
}

/// A choice point of the depth-first search: another reaction of an earlier slave.
#[derive(Debug, Clone, Copy)]
enum BacktrackAlternative<const D: usize> {
    /// A valid place, worse than the one that was taken.
    Place { slave: usize, candidate: CandidatePosition<D> },
    /// A turn of its rod to the other side. It is computed only on backtracking, because that is
    /// rare and a turn is the costly part of a reaction.
    OtherSide { slave: usize, tried: Point<D> },
}

/// The connectors that are moved from outside: one, or the two of a rod.
#[derive(Debug, Clone, Copy)]
struct InitiatingConnectors<const D: usize> {
    first: usize,
    n: usize,
    to: [Point<D>; 2],
}

impl<const D: usize> InitiatingConnectors<D> {
    fn from_motion(motion: &RequestedMotion<D>) -> Self {
        match *motion {
            RequestedMotion::Connector { k, to } => Self { first: k, n: 1, to: [to, to] },
            RequestedMotion::Rod { i, to } => Self { first: i, n: 2, to },
        }
    }

    fn indices(&self) -> Range<usize> {
        self.first..self.first + self.n
    }

    /// Returns their positions after `k` of `n` equal sub-steps; the last one is the target, bit for bit.
    fn positions_at(&self, from: [Point<D>; 2], [k, n]: [usize; 2]) -> [Point<D>; 2] {
        if k == n {
            return self.to;
        }
        let fraction = k as f64 / n as f64;
        [0, 1].map(|h| lerp(from[h], self.to[h], fraction))
    }

    fn positions(&self, chain: &Chain<D>) -> [Point<D>; 2] {
        [chain.points()[self.first], chain.points()[self.first + self.n - 1]]
    }
}

/// A sub-step of a request.
#[derive(Debug, Clone, Copy)]
struct SubStep<const D: usize> {
    driven: InitiatingConnectors<D>,
    /// Whether no later one can make the request take it back.
    is_last: bool,
    /// Whether it may come near no part of the chain; otherwise that was found out already.
    may_be_free: bool,
}

/// The index of the connector that objects, and its objection.
type ConnectorVeto = (usize, IncompleteVeto);

/// The inputs of one sweep outward from the initiator; nothing changes them before the commit.
#[derive(Clone, Copy)]
struct PropagationContext<'a, const D: usize> {
    chain: &'a Chain<D>,
    obstacles: &'a Obstacles<D>,
    direction: ChainDirection,
}

impl<const D: usize> PropagationContext<'_, D> {
    /// Returns the connector after `i`, if there is one.
    fn next(&self, i: usize) -> Option<usize> {
        self.direction.next(i, self.chain.points().len())
    }
}

impl<const D: usize> Propagator<D> {
    /// Returns a propagator with the built-in reaction of free connectors.
    pub fn new(rules: ReactionRules) -> Self {
        Self { rules, ..Self::default() }
    }

    /// Returns the propagator with a reaction of free connectors in place of the built-in one, if one is given.
    #[must_use]
    pub fn with_reaction(self, reaction: Option<Arc<dyn Reaction>>) -> Self {
        Self { reaction, ..self }
    }

    /// Moves a chain as requested, in sub-steps if anything may be in the way.
    ///
    /// # Errors
    /// When a target is not finite or more than 1e6 m from the origin, or the chain does not have
    /// the index. An impossible motion is no error but a veto.
    pub fn propagate(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        request: &MotionRequest<D>,
    ) -> Result<MotionOutcome<D>, InputError> {
        let mut driven = InitiatingConnectors::from_motion(&request.motion);
        check(chain, &driven)?;
        let from = driven.positions(chain);
        self.tally = MotionEffects::start(driven.first);
        self.original.start(chain.points().len(), driven.first);
        if let Err((by, objection)) = project(chain, &mut driven, request.mode) {
            return Ok(MotionOutcome::Vetoed(make_veto(chain, driven.first, by, objection)));
        }
        let n = self.sub_steps(chain, obstacles, &driven, from)?;
        let may_be_whole = self.reaction.is_none() && self.rules.step_m.is_none();
        if may_be_whole && self.try_whole_motion(chain, obstacles, &driven) {
            return Ok(MotionOutcome::Moved(self.completed_motion(None)));
        }
        // The proof of a motion of one sub-step is the same as that of the whole.
        let may_be_free = n > 1 || !may_be_whole;
        for k in 1..=n {
            if k.is_multiple_of(INTERRUPT_CHECK_INTERVAL) {
                interrupt::check();
            }
            let driven = InitiatingConnectors { to: driven.positions_at(from, [k, n]), ..driven };
            let step = SubStep { driven, is_last: k == n, may_be_free };
            if let Err((by, objection)) = self.sub_step(chain, obstacles, step) {
                let veto = make_veto(chain, driven.first, by, objection);
                return Ok(self.end_at_veto(chain, request.mode, veto));
            }
        }
        Ok(MotionOutcome::Moved(self.completed_motion(None)))
    }

    /// Moves all parts of a chain at once by as little as it takes to bring connector `k` to a target, or vetoes. Held
    /// connectors stay where they may be; whether the rules of single parts would lead there does not matter, but
    /// everything that they keep is kept.
    pub fn move_at_once(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        k: usize,
        to: Point<D>,
    ) -> Result<(), Veto<D>> {
        let before = chain.points().to_vec();
        let mut points = before.clone();
        points[k] = to;
        let projected = self.projector.project(chain, &mut points, k, self.rules.self_collision);
        if let Err(failure) = projected {
            let reason = match failure {
                ProjectionFailure::Lengths => VetoReason::Mobility,
                ProjectionFailure::OwnBody => VetoReason::SelfCollision,
            };
            return Err(Veto { by: k, from: k, reason, obstacle: None, reached: before[k] });
        }
        chain.points_mut().copy_from_slice(&points);
        let veto = self.find_motion_veto(chain, obstacles, &before, k);
        if let Some(veto) = veto {
            chain.points_mut().copy_from_slice(&before);
            return Err(veto);
        }
        Ok(())
    }

    /// Returns as many sub-steps as the connector needs that goes farthest.
    fn sub_steps(
        &self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        driven: &InitiatingConnectors<D>,
        from: [Point<D>; 2],
    ) -> Result<usize, InputError> {
        let travel_m =
            distance(from[0], driven.to[0]).max(distance(from[1], driven.to[driven.n - 1]));
        count_sub_steps(&self.rules, chain.step_m(), obstacles.is_empty(), travel_m)
    }

    /// Ends a request at a veto: keeps the sub-steps so far, or takes them back.
    fn end_at_veto(
        &mut self,
        chain: &mut Chain<D>,
        mode: VetoEffect,
        veto: Veto<D>,
    ) -> MotionOutcome<D> {
        if mode == VetoEffect::AsFarAsPossible && self.tally.changed > 0 {
            return MotionOutcome::Moved(self.completed_motion(Some(veto)));
        }
        let run = self.original.moved_range();
        chain.points_mut()[run].copy_from_slice(self.original.positions());
        MotionOutcome::Vetoed(veto)
    }

    fn completed_motion(&self, cut_short: Option<Veto<D>>) -> CompletedMotion<D> {
        let MotionEffects { from, to, changed, rotated, max_slave_step_m } = self.tally;
        CompletedMotion { touched: from..to, changed, rotated, max_slave_step_m, cut_short }
    }

    /// Makes one sub-step: all of it, or nothing.
    fn sub_step(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        step: SubStep<D>,
    ) -> Result<(), ConnectorVeto> {
        let SubStep { driven, is_last, may_be_free } = step;
        if has_arrived(chain, &driven) {
            return Ok(());
        }
        // From the cheapest motion to the dearest. Each gives the bits of the last one where it
        // applies, so which of them runs is a matter of speed alone. The cheap ones know the built-in
        // reaction only.
        let is_built_in = self.reaction.is_none();
        let is_open = is_built_in && can_only_self_collide(chain, obstacles, &driven);
        if is_open && !self.rules.self_collision {
            open::pull_chain_by_connector(
                chain,
                driven.first,
                driven.to[0],
                StayRule::Exactly,
                &mut self.tally,
            );
            return Ok(());
        }
        if is_open && may_be_free && self.try_collision_free_pull(chain, &driven, is_last) {
            return Ok(());
        }
        if self.rules.self_collision {
            if is_built_in && !is_open && self.try_self_clear_sweep(chain, obstacles, &driven) {
                return Ok(());
            }
            let points = chain.points();
            let rods = 0..chain.rods().len();
            let ends = |i: usize| [points[i], points[i + 1]];
            self.own_rods.refit(rods.map(|i| chain.rod_bounds(i, ends(i), 0.0)));
        }
        let rotated = self.tally.rotated;
        let followed = self.propagate_from_driven(chain, obstacles, &driven);
        match followed {
            Ok(()) => self.commit(chain, &driven),
            Err(_) => self.tally.rotated = rotated,
        }
        followed
    }

    /// Finds new places for the driven connectors and all that follow them.
    fn propagate_from_driven(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        driven: &InitiatingConnectors<D>,
    ) -> Result<(), ConnectorVeto> {
        self.tentative.start(chain.points().len(), driven.first);
        self.place_driven_connectors(chain, obstacles, driven)?;
        // A fixed order: the second sweep sees the new places of the first one, for the bend at the
        // initiator and for collisions of the chain with itself.
        let up = PropagationContext { chain, obstacles, direction: ChainDirection::Up };
        let down = PropagationContext { direction: ChainDirection::Down, ..up };
        self.sweep(up, driven.first + driven.n - 1)?;
        self.sweep(down, driven.first)?;
        self.check_own_paths(chain)
    }

    fn place_driven_connectors(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        driven: &InitiatingConnectors<D>,
    ) -> Result<(), ConnectorVeto> {
        // Both are checked before one is placed: the ends of a driven rod move at once, so neither
        // is an obstacle to the other at a new place.
        for (h, k) in driven.indices().enumerate() {
            let context = self.context(chain, obstacles);
            context.check_initiator(k, driven.to[h]).map_err(|objection| (k, objection))?;
        }
        for (h, k) in driven.indices().enumerate() {
            self.place(chain, k, driven.to[h]);
        }
        if driven.n == 2 {
            self.check_driven_rod(chain, obstacles, driven)?;
        }
        Ok(())
    }

    /// Checks the rod between two driven connectors, as if its second end were a slave of the first.
    fn check_driven_rod(
        &self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        driven: &InitiatingConnectors<D>,
    ) -> Result<(), ConnectorVeto> {
        let slave = driven.first + 1;
        let context = self.context(chain, obstacles);
        let step = SlaveStep { mn: driven.to[0], ..context.slave_step(slave, ChainDirection::Up) };
        if !is_length_allowed(step.rod, distance(driven.to[0], driven.to[1])) {
            return Err((slave, IncompleteVeto::new(VetoReason::Mobility)));
        }
        // Its bends are checked by the sweeps, when the connectors on both sides are placed.
        let without_bend = SlaveStep { prev: None, ..step };
        context.check_slave(&without_bend, driven.to[1]).map_err(|objection| (slave, objection))
    }

    fn context<'a>(
        &'a self,
        chain: &'a Chain<D>,
        obstacles: &'a Obstacles<D>,
    ) -> MotionContext<'a, D> {
        let Self { rules, tentative, own_rods, .. } = self;
        let reaction = self.reaction.as_deref();
        MotionContext { chain, obstacles, rules, tentative, own_rods, reaction }
    }

    /// Sweeps from a driven connector outward. Rods keep their lengths when they turn, which is cheap
    /// and nearly always enough; if that ends in a veto, the sweep is repeated with every length they
    /// may have. Without a rod that has turned the repetition would end in the same veto.
    fn sweep(
        &mut self,
        sweep: PropagationContext<'_, D>,
        head: usize,
    ) -> Result<(), ConnectorVeto> {
        let rotated = self.tally.rotated;
        self.scratch.all_lengths = false;
        self.scratch.has_turned = false;
        let followed = self.follow(sweep, head);
        let Some(first) = sweep.next(head) else { return followed };
        if followed.is_ok()
            || self.rules.rotation != RotationRule::Union
            || !self.scratch.has_turned
            || !has_more_places(sweep.chain, head, sweep.direction)
        {
            return followed;
        }
        self.revert(sweep.chain, first, sweep.direction);
        self.tally.rotated = rotated;
        self.scratch.all_lengths = true;
        self.follow(sweep, head)
    }

    /// Follows the chain from a driven connector outward, until a slave need not move or the chain ends.
    fn follow(
        &mut self,
        sweep: PropagationContext<'_, D>,
        head: usize,
    ) -> Result<(), ConnectorVeto> {
        self.alternatives.clear();
        let chain = sweep.chain;
        let mut first_objection: Option<ConnectorVeto> = None;
        let mut backtracks_left = self.rules.backtracks;
        let mut master = head;
        while let Some(slave) = sweep.next(master) {
            let (at_slave, chosen) = match self.react(sweep, slave) {
                Ok(chosen) => (slave, chosen),
                Err(objection) => {
                    // The first one is reported: the later ones are those of detours around it.
                    let first = *first_objection.get_or_insert((slave, objection));
                    self.backtrack_to_alternative(sweep, &mut backtracks_left, first)?
                }
            };
            let so = chain.points()[at_slave];
            let stays = distance(chosen.at, so) <= chain.min_move_m();
            if stays && self.can_stop_propagation(sweep, at_slave) {
                return Ok(());
            }
            self.place(chain, at_slave, if stays { so } else { chosen.at });
            self.tally.rotated += usize::from(chosen.rotated);
            master = at_slave;
        }
        Ok(())
    }

    /// Returns the best place for a slave; its alternatives are remembered.
    fn react(
        &mut self,
        sweep: PropagationContext<'_, D>,
        slave: usize,
    ) -> Result<CandidatePosition<D>, IncompleteVeto> {
        self.find_slave_places(sweep, slave)?;
        let Self { scratch, alternatives, .. } = self;
        let chosen = scratch.found[0];
        // A stack: the next best goes on top, and the side not examined yet above all, because it may hold a shorter
        // move than the places found on this side.
        let rest = scratch.found[1..].iter().rev();
        alternatives
            .extend(rest.map(|&candidate| BacktrackAlternative::Place { slave, candidate }));
        if scratch.has_other_side {
            alternatives.push(BacktrackAlternative::OtherSide { slave, tried: chosen.at });
        }
        Ok(chosen)
    }

    /// Fills `scratch.found` with places for a slave.
    fn find_slave_places(
        &mut self,
        PropagationContext { chain, obstacles, direction }: PropagationContext<'_, D>,
        slave: usize,
    ) -> Result<(), IncompleteVeto> {
        let Self { rules, reaction, tentative, own_rods, scratch, .. } = self;
        let reaction = reaction.as_deref();
        let context = MotionContext { chain, obstacles, rules, tentative, own_rods, reaction };
        context.candidates(&context.slave_step(slave, direction), scratch)
    }

    /// Backtracks after an objection: the latest of the earlier slaves with an alternative takes it.
    /// Returns that slave and its new place, or the objection if no alternative is left.
    fn backtrack_to_alternative(
        &mut self,
        sweep: PropagationContext<'_, D>,
        backtracks_left: &mut usize,
        objection: ConnectorVeto,
    ) -> Result<(usize, CandidatePosition<D>), ConnectorVeto> {
        while let Some(alternative) = self.alternatives.pop() {
            if *backtracks_left == 0 {
                let (by, veto) = objection;
                return Err((by, IncompleteVeto { reason: VetoReason::Limit, ..veto }));
            }
            *backtracks_left -= 1;
            match alternative {
                BacktrackAlternative::Place { slave, candidate } => {
                    self.revert(sweep.chain, slave, sweep.direction);
                    return Ok((slave, candidate));
                }
                BacktrackAlternative::OtherSide { slave, tried } => {
                    self.revert(sweep.chain, slave, sweep.direction);
                    self.scratch.both_sides = true;
                    let result = self.find_slave_places(sweep, slave);
                    self.scratch.both_sides = false;
                    let other = self.scratch.found.iter().find(|c| c.at != tried);
                    if let (Ok(()), Some(&candidate)) = (result, other) {
                        return Ok((slave, candidate));
                    }
                }
            }
        }
        Err(objection)
    }

    /// Returns whether the rest of the chain has nothing to react to: this slave stays, and the bend at it
    /// and the rod beyond it are allowed as they are.
    fn can_stop_propagation(&self, sweep: PropagationContext<'_, D>, slave: usize) -> bool {
        let Some(next) = sweep.next(slave) else { return true };
        let step = self.context(sweep.chain, sweep.obstacles).slave_step(next, sweep.direction);
        // The bend counts as well: its inner rod has turned, though its outer one stays. Without this
        // test a chain with a limit of 60 degrees stopped at 86.
        is_length_allowed(step.rod, distance(step.so, step.mn))
            && step.is_bend_allowed_at(step.so)
            && self.context(sweep.chain, sweep.obstacles).may_end_at(sweep, slave)
    }

    fn place(&mut self, chain: &Chain<D>, i: usize, at: Point<D>) {
        self.tentative.set(i, at);
        self.refresh_own_rods(chain, i);
    }

    /// Updates the boxes of the rods at a connector whose tentative position has changed.
    fn refresh_own_rods(&mut self, chain: &Chain<D>, i: usize) {
        if !self.rules.self_collision {
            return;
        }
        for rod in i.saturating_sub(1)..(i + 1).min(chain.rods().len()) {
            let ends = [rod, rod + 1].map(|k| self.tentative.get(k).unwrap_or(chain.points()[k]));
            self.own_rods.set(rod, chain.rod_bounds(rod, ends, 0.0));
        }
    }

    /// Forgets the new places from a slave outward.
    fn revert(&mut self, chain: &Chain<D>, slave: usize, direction: ChainDirection) {
        let Range { start, end } = self.tentative.moved_range();
        let reverted = match direction {
            ChainDirection::Up => {
                self.tentative.to = slave.min(end);
                slave..end
            }
            ChainDirection::Down => {
                self.tentative.from = (slave + 1).max(start);
                start..slave + 1
            }
        };
        for i in reverted {
            self.refresh_own_rods(chain, i);
        }
    }

    /// Moves the chain; where a connector was before the request is kept the first time that it
    /// moves.
    fn commit(&mut self, chain: &mut Chain<D>, driven: &InitiatingConnectors<D>) {
        let run = self.tentative.moved_range();
        // Outward from the driven connectors, so that the run of original positions has no gap.
        for i in (driven.first..run.end).chain((run.start..driven.first).rev()) {
            let old = chain.points()[i];
            let new = self.tentative.get(i).unwrap_or(old);
            if self.original.get(i).is_none() {
                self.original.set(i, old);
            }
            self.tally.changed += usize::from(old != new);
            if !driven.indices().contains(&i) {
                self.tally.record_slave_move(distance(old, new));
            }
            chain.points_mut()[i] = new;
        }
        self.tally.record_touched_range(run);
    }
}

/// Returns whether every driven connector is at its target, up to the least move.
fn has_arrived<const D: usize>(chain: &Chain<D>, driven: &InitiatingConnectors<D>) -> bool {
    driven
        .indices()
        .enumerate()
        .all(|(h, k)| distance(driven.to[h], chain.points()[k]) <= chain.min_move_m())
}

/// Returns whether only the chain itself can be in the way of a motion.
fn can_only_self_collide<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    driven: &InitiatingConnectors<D>,
) -> bool {
    obstacles.is_empty() && chain.is_plain() && driven.n == 1
}

/// Returns the number of sub-steps in which an initiator moves by `travel_m`. `is_empty` says that
/// there is no obstacle.
fn count_sub_steps(
    rules: &ReactionRules,
    default_step_m: f64,
    is_empty: bool,
    travel_m: f64,
) -> Result<usize, InputError> {
    let step_m = match rules.step_m {
        Some(step_m) if step_m > 0.0 => step_m,
        // Where nothing can object, one long step is as safe as many short ones.
        _ if is_empty && !rules.self_collision => f64::INFINITY,
        _ => default_step_m,
    };
    let n = (travel_m / step_m - SUB_STEP_ROUNDING).ceil().max(1.0);
    if n > MAX_SUB_STEPS {
        return Err(InputError::new(
            "target",
            format!("is {travel_m} m away, which takes {n} steps of {step_m} m"),
            "go there in several requests",
        ));
    }
    Ok(n as usize)
}

/// Returns whether a second try finds slaves more places: rods of other lengths, and in the plane also the
/// other side.
fn has_more_places<const D: usize>(
    chain: &Chain<D>,
    head: usize,
    direction: ChainDirection,
) -> bool {
    let rods = match direction {
        ChainDirection::Up => &chain.rods()[head..],
        ChainDirection::Down => &chain.rods()[..head],
    };
    D == 2 || rods.iter().any(|rod| rod.min_m < rod.max_m)
}

impl<const D: usize> MotionContext<'_, D> {
    /// Returns the step of a slave whose master's new place is settled.
    fn slave_step(&self, slave: usize, direction: ChainDirection) -> SlaveStep<D> {
        let points = self.chain.points();
        let master = direction.master(slave);
        let behind_master = match direction {
            ChainDirection::Up => master.checked_sub(1),
            ChainDirection::Down => (master + 1 < points.len()).then_some(master + 1),
        };
        // In the first sweep the connector on the initiator's other side has yet to move, and the
        // second sweep will check the bend.
        let prev = behind_master
            .filter(|&b| direction == ChainDirection::Down || self.tentative.get(b).is_some());
        SlaveStep {
            master,
            slave,
            mo: points[master],
            mn: self.position(master),
            so: points[slave],
            prev: prev.map(|b| self.position(b)),
            rod: self.chain.rod_between(master, slave),
            tip_radius_m: self.chain.connectors()[slave].radius_m,
            max_bend_rad: self.chain.connectors()[master].max_bend_rad,
        }
    }

    /// Checks whether the path of an initiator is free of obstacles and of the chain's own parts.
    fn check_initiator(&self, k: usize, to: Point<D>) -> Result<(), IncompleteVeto> {
        // The slides know collisions with obstacles only, so without any there is nothing to check.
        if self.rules.rotation == RotationRule::Literal && self.obstacles.is_empty() {
            return Ok(());
        }
        let from = self.chain.points()[k];
        let radius_m = self.chain.connectors()[k].radius_m;
        let near = swept_bounds([from, from, to, to], radius_m);
        let mut worst: Option<(f64, BlockingPartOwner, VetoReason)> = None;
        let moving = MovingPart { tip: k, tip_radius_m: radius_m, rod: None };
        self.visit_blocking_parts(&near, &moving, |block| {
            let Some(keep_m) = block.tip_separation_m else { return };
            if block.core.is_clear_of_segment([from, to], contact_distance_m(keep_m)) {
                return;
            }
            let before_m = keep_m - block.core.nearest_to_point(from).distance_m;
            let after_m = keep_m - block.core.nearest_to_point(to).distance_m;
            let was_inside = before_m > TOLERANCE_M;
            // An initiator that starts inside, e.g. because an obstacle has moved, must be able to get
            // out; only deeper it must not go.
            if was_inside && after_m <= before_m {
                return;
            }
            let reason = if was_inside { VetoReason::Inside } else { VetoReason::TargetBlocked };
            // Of equal depths the lower name counts, because blocks come in no particular order.
            let is_deeper =
                worst.is_none_or(|(w, name, _)| after_m > w || (after_m == w && block.name < name));
            if is_deeper {
                worst = Some((after_m, block.name, reason));
            }
        });
        worst.map_or(Ok(()), |(_, name, reason)| {
            Err(IncompleteVeto::from_blocking_owner(reason, name))
        })
    }
}

/// Projects the targets of driven connectors to allowed places, or returns the objection.
fn project<const D: usize>(
    chain: &Chain<D>,
    driven: &mut InitiatingConnectors<D>,
    mode: VetoEffect,
) -> Result<(), ConnectorVeto> {
    for (h, k) in driven.indices().enumerate() {
        let connector = &chain.connectors()[k];
        let at = chain.points()[k];
        if driven.to[h] == at {
            continue;
        }
        if connector.is_still() && distance(driven.to[h], at) > chain.min_move_m() {
            return Err((k, IncompleteVeto::new(connector.still_reason())));
        }
        if !connector.mobility.allows(driven.to[h], at) {
            if mode == VetoEffect::Exact || driven.n > 1 {
                return Err((k, IncompleteVeto::new(VetoReason::Mobility)));
            }
            driven.to[h] = connector.mobility.project(driven.to[h], at);
        }
    }
    Ok(())
}

/// Returns the veto of an objection, with the chain where its motion has ended.
fn make_veto<const D: usize>(
    chain: &Chain<D>,
    from: usize,
    by: usize,
    objection: IncompleteVeto,
) -> Veto<D> {
    let IncompleteVeto { reason, obstacle } = objection;
    Veto { by, from, reason, obstacle, reached: chain.points()[from] }
}

/// Refuses a motion of connectors that the chain does not have, or to a target out of range.
fn check<const D: usize>(
    chain: &Chain<D>,
    driven: &InitiatingConnectors<D>,
) -> Result<(), InputError> {
    if driven.first + driven.n > chain.points().len() {
        return Err(InputError::new(
            "initiator",
            format!(
                "is number {}, and the chain has {} connectors",
                driven.first,
                chain.points().len()
            ),
            "count from 0",
        ));
    }
    driven.to.iter().find(|to| !is_in_range(to)).map_or(Ok(()), |to| Err(out_of_range(to)))
}

pub mod local_solver;
mod own_body;
mod separation;
#[cfg(test)]
mod tests;
