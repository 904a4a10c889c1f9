//! Propagation of one motion through the whole chain, or not at all (slides R1 to R7).
//!
//! The initiator moves; from it two sweeps go outward, each slave reacting to its master and
//! becoming the next one's master. New positions are kept apart until both sweeps have agreed: a
//! veto leaves every bit of the chain as it was.

use super::candidates::{Candidate, CandidateScratch};
use super::chain::{Chain, is_in_range, out_of_range};
use super::geometry::{Bounds, Point, distance, lerp};
use super::motion_bounds::MotionBounds;
use super::motion_context::{
    BlockOwner, MotionContext, PendingVeto, SlaveStep, TOLERANCE_M, TentativePositions,
    contact_distance_m, is_length_allowed,
};
use super::obstacle::{Obstacles, swept_bounds};
use super::open::{self, StayRule};
use super::pass::{Direction, MotionTally};
use super::rod_bvh::RodBvh;
use super::rules::{Rotation, Rules};
use super::veto::{CompletedMotion, Motion, Outcome, Request, Veto, VetoEffect, VetoReason};
use separation::ProofSchedule;
use sidestep_kernel::{InputError, interrupt};
use std::ops::Range;

/// Most sub-steps of a request; one that would need more is refused.
const MAX_SUB_STEPS: f64 = 1e6;
/// Number of sub-steps from one look at whether to go on to the next.
const INTERRUPT_CHECK_INTERVAL: usize = 16;

/// Moves chains by the rules. It owns the buffers of a motion, so that no motion allocates, and
/// remembers nothing from one motion to the next that a result depends on.
#[derive(Debug, Clone, Default)]
pub struct Propagator<const D: usize> {
    /// Rules by which chains react.
    pub rules: Rules,
    overlay: TentativePositions<D>,
    own: RodBvh<D>,
    leeway: MotionBounds<D>,
    proofs: ProofSchedule,
    /// Proofs of all sub-steps of a request at once.
    whole_proofs: ProofSchedule,
    work: CandidateScratch<D>,
    untried: Vec<Alternative<D>>,
    /// Positions before the request, for the run of connectors that have moved.
    before: TentativePositions<D>,
    tally: MotionTally,
}

/// An alternative for an earlier slave.
#[derive(Debug, Clone, Copy)]
enum Alternative<const D: usize> {
    /// Another place.
    Place { slave: usize, candidate: Candidate<D> },
    /// A turn of its rod to the other side, which has not been examined yet.
    OtherSide { slave: usize, tried: Point<D> },
}

/// The connectors that are moved from outside: one, or the two of a rod.
#[derive(Debug, Clone, Copy)]
struct DrivenConnectors<const D: usize> {
    first: usize,
    n: usize,
    to: [Point<D>; 2],
}

impl<const D: usize> DrivenConnectors<D> {
    fn from_motion(motion: &Motion<D>) -> Self {
        match *motion {
            Motion::Connector { k, to } => Self { first: k, n: 1, to: [to, to] },
            Motion::Rod { i, to } => Self { first: i, n: 2, to },
        }
    }

    fn indices(&self) -> Range<usize> {
        self.first..self.first + self.n
    }

    /// Returns their positions after `k` of `n` equal parts of their way.
    fn positions_at(&self, from: [Point<D>; 2], [k, n]: [usize; 2]) -> [Point<D>; 2] {
        let part = k as f64 / n as f64;
        [0, 1].map(|h| if k == n { self.to[h] } else { lerp(from[h], self.to[h], part) })
    }

    /// Returns their positions.
    fn positions(&self, chain: &Chain<D>) -> [Point<D>; 2] {
        [chain.points()[self.first], chain.points()[self.first + self.n - 1]]
    }
}

/// An objection and the connector that raised it.
type ConnectorVeto = (usize, PendingVeto);

impl<const D: usize> Propagator<D> {
    /// Returns a propagator for rules.
    pub fn new(rules: Rules) -> Self {
        Self { rules, ..Self::default() }
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
        request: &Request<D>,
    ) -> Result<Outcome<D>, InputError> {
        let mut heads = DrivenConnectors::from_motion(&request.motion);
        check(chain, &heads)?;
        let from = heads.positions(chain);
        self.tally = MotionTally::start(heads.first);
        self.before.start(chain.points().len(), heads.first);
        if let Err((by, refusal)) = project(chain, &mut heads, request.mode) {
            return Ok(Outcome::Vetoed(make_veto(chain, heads.first, by, refusal)));
        }
        let n = self.sub_steps(chain, obstacles, &heads, from)?;
        if self.pull_all_if_separated(chain, obstacles, &heads, n) {
            return Ok(Outcome::Moved(self.completed_motion(None)));
        }
        for k in 1..=n {
            if k.is_multiple_of(INTERRUPT_CHECK_INTERVAL) {
                interrupt::check();
            }
            let heads = DrivenConnectors { to: heads.positions_at(from, [k, n]), ..heads };
            if let Err((by, refusal)) = self.sub_step(chain, obstacles, heads, k < n) {
                let veto = make_veto(chain, heads.first, by, refusal);
                return Ok(self.stop(chain, request.mode, veto));
            }
        }
        Ok(Outcome::Moved(self.completed_motion(None)))
    }

    fn sub_steps(
        &self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        heads: &DrivenConnectors<D>,
        from: [Point<D>; 2],
    ) -> Result<usize, InputError> {
        let way_m = distance(from[0], heads.to[0]).max(distance(from[1], heads.to[heads.n - 1]));
        count_sub_steps(&self.rules, chain.step_m(), obstacles.is_empty(), way_m)
    }

    fn stop(&mut self, chain: &mut Chain<D>, mode: VetoEffect, veto: Veto<D>) -> Outcome<D> {
        if mode == VetoEffect::AsFarAsPossible && self.tally.changed > 0 {
            return Outcome::Moved(self.completed_motion(Some(veto)));
        }
        let run = self.before.from..self.before.to;
        chain.points_mut()[run].copy_from_slice(self.before.positions());
        Outcome::Vetoed(veto)
    }

    fn completed_motion(&self, cut_short: Option<Veto<D>>) -> CompletedMotion<D> {
        let MotionTally { from, to, changed, rotated, max_slave_step_m } = self.tally;
        CompletedMotion { touched: from..to, changed, rotated, max_slave_step_m, cut_short }
    }

    /// Makes one short motion, after which the request goes on or ends: all of it, or none.
    fn sub_step(
        &mut self,
        chain: &mut Chain<D>,
        obstacles: &Obstacles<D>,
        heads: DrivenConnectors<D>,
        goes_on: bool,
    ) -> Result<(), ConnectorVeto> {
        let is_there =
            |(h, k): (usize, usize)| distance(heads.to[h], chain.points()[k]) <= chain.min_move_m();
        if heads.indices().enumerate().all(is_there) {
            return Ok(());
        }
        let is_open = is_open(chain, obstacles, &heads);
        if is_open && !self.rules.self_collision {
            open::pull(chain, heads.first, heads.to[0], StayRule::Exactly, &mut self.tally);
            return Ok(());
        }
        if is_open && self.pull_if_separated(chain, &heads, goes_on) {
            return Ok(());
        }
        if self.rules.self_collision {
            if !is_open && self.sweep_if_separated(chain, obstacles, &heads) {
                return Ok(());
            }
            let rods = 0..chain.rods().len();
            self.own.refit(rods.map(|i| rod_box(chain, i, |k| chain.points()[k])));
        }
        let rotated = self.tally.rotated;
        let followed = self.sweep_from(chain, obstacles, &heads);
        match followed {
            Ok(()) => self.commit(chain, &heads),
            Err(_) => self.tally.rotated = rotated,
        }
        followed
    }

    /// Finds new places for the heads and all connectors that follow them.
    fn sweep_from(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        heads: &DrivenConnectors<D>,
    ) -> Result<(), ConnectorVeto> {
        self.overlay.start(chain.points().len(), heads.first);
        self.place_heads(chain, obstacles, heads)?;
        self.sweep(chain, obstacles, heads.first + heads.n - 1, Direction::Up)?;
        self.sweep(chain, obstacles, heads.first, Direction::Down)
    }

    fn place_heads(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        heads: &DrivenConnectors<D>,
    ) -> Result<(), ConnectorVeto> {
        for (h, k) in heads.indices().enumerate() {
            let scene = self.scene(chain, obstacles);
            scene.check_initiator(k, heads.to[h]).map_err(|refusal| (k, refusal))?;
        }
        for (h, k) in heads.indices().enumerate() {
            self.place(chain, k, heads.to[h]);
        }
        if heads.n == 2 {
            let [m, s] = [heads.first, heads.first + 1];
            let step = SlaveStep {
                mn: heads.to[0],
                ..self.scene(chain, obstacles).step(m, s, Direction::Up, chain.points()[s])
            };
            if !is_length_allowed(step.rod, distance(heads.to[0], heads.to[1])) {
                return Err((s, PendingVeto::new(VetoReason::Mobility)));
            }
            let alone = SlaveStep { prev: None, ..step };
            self.scene(chain, obstacles).check_slave(&alone, heads.to[1]).map_err(|r| (s, r))?;
        }
        Ok(())
    }

    fn scene<'a>(
        &'a self,
        chain: &'a Chain<D>,
        obstacles: &'a Obstacles<D>,
    ) -> MotionContext<'a, D> {
        let Self { rules, overlay, own, .. } = self;
        MotionContext { chain, obstacles, rules, overlay, own }
    }

    /// Sweeps from a head outward. Rods keep their lengths when they turn, which is cheap and
    /// nearly always enough; if that ends in a veto, the sweep is repeated with every length they
    /// may have. Without a rod that has turned the repetition would end in the same veto.
    fn sweep(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        head: usize,
        direction: Direction,
    ) -> Result<(), ConnectorVeto> {
        let rotated = self.tally.rotated;
        (self.work.all_lengths, self.work.has_turned) = (false, false);
        let followed = self.follow(chain, obstacles, head, direction);
        let Some(first) = direction.next(head, chain.points().len()) else { return followed };
        if followed.is_ok()
            || self.rules.rotation != Rotation::Union
            || !self.work.has_turned
            || !has_more_places(chain, head, direction)
        {
            return followed;
        }
        self.revert(chain, first, direction);
        self.tally.rotated = rotated;
        self.work.all_lengths = true;
        self.follow(chain, obstacles, head, direction)
    }

    /// Follows the chain from a head outward, until a slave need not move or the chain ends.
    fn follow(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        head: usize,
        direction: Direction,
    ) -> Result<(), ConnectorVeto> {
        self.untried.clear();
        let mut first_objection: Option<ConnectorVeto> = None;
        let mut left = self.rules.backtracks;
        let mut master = head;
        while let Some(slave) = direction.next(master, chain.points().len()) {
            let (at_slave, chosen) = match self.react(chain, obstacles, slave, direction) {
                Ok(chosen) => (slave, chosen),
                Err(refusal) => {
                    let objection = *first_objection.get_or_insert((slave, refusal));
                    self.step_back(chain, obstacles, direction, &mut left, objection)?
                }
            };
            let so = chain.points()[at_slave];
            let stays = distance(chosen.at, so) <= chain.min_move_m();
            if stays && self.may_stop(chain, obstacles, at_slave, direction) {
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
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        slave: usize,
        direction: Direction,
    ) -> Result<Candidate<D>, PendingVeto> {
        self.find_candidates(chain, obstacles, slave, direction)?;
        let Self { work, untried, .. } = self;
        let chosen = work.found[0];
        let rest = work.found[1..].iter().rev();
        untried.extend(rest.map(|&candidate| Alternative::Place { slave, candidate }));
        if work.has_other_side {
            untried.push(Alternative::OtherSide { slave, tried: chosen.at });
        }
        Ok(chosen)
    }

    /// Fills `work.found` with places for a slave.
    fn find_candidates(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        slave: usize,
        direction: Direction,
    ) -> Result<(), PendingVeto> {
        let Self { rules, overlay, own, work, .. } = self;
        let scene = MotionContext { chain, obstacles, rules, overlay, own };
        let master = direction.master(slave);
        scene.candidates(&scene.step(master, slave, direction, chain.points()[slave]), work)
    }

    /// Steps back after an objection: the latest of the earlier slaves with an alternative takes
    /// it.
    fn step_back(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        direction: Direction,
        left: &mut usize,
        objection: ConnectorVeto,
    ) -> Result<(usize, Candidate<D>), ConnectorVeto> {
        while let Some(untried) = self.untried.pop() {
            if *left == 0 {
                return Err((
                    objection.0,
                    PendingVeto { reason: VetoReason::Limit, ..objection.1 },
                ));
            }
            *left -= 1;
            match untried {
                Alternative::Place { slave, candidate } => {
                    self.revert(chain, slave, direction);
                    return Ok((slave, candidate));
                }
                Alternative::OtherSide { slave, tried } => {
                    self.revert(chain, slave, direction);
                    self.work.both_sides = true;
                    let found = self.find_candidates(chain, obstacles, slave, direction);
                    self.work.both_sides = false;
                    let other = self.work.found.iter().find(|c| c.at != tried);
                    if let (Ok(()), Some(&candidate)) = (found, other) {
                        return Ok((slave, candidate));
                    }
                }
            }
        }
        Err(objection)
    }

    /// Returns whether the rest of the chain has nothing to react to: this slave stays, and the bend at it
    /// and the rod beyond it are good as they are.
    fn may_stop(
        &self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        slave: usize,
        direction: Direction,
    ) -> bool {
        let Some(next) = direction.next(slave, chain.points().len()) else { return true };
        let scene = self.scene(chain, obstacles);
        let step = scene.step(slave, next, direction, chain.points()[next]);
        is_length_allowed(step.rod, distance(step.so, step.mn)) && step.exceeds_bend_at(step.so)
    }

    fn place(&mut self, chain: &Chain<D>, i: usize, at: Point<D>) {
        self.overlay.set(i, at);
        self.refresh_own(chain, i);
    }

    fn refresh_own(&mut self, chain: &Chain<D>, i: usize) {
        if !self.rules.self_collision {
            return;
        }
        for rod in i.saturating_sub(1)..(i + 1).min(chain.rods().len()) {
            let at = |k: usize| self.overlay.get(k).unwrap_or(chain.points()[k]);
            let bounds = rod_box(chain, rod, at);
            self.own.set(rod, bounds);
        }
    }

    /// Forgets the new places from a slave outward.
    fn revert(&mut self, chain: &Chain<D>, slave: usize, direction: Direction) {
        let (from, to) = (self.overlay.from, self.overlay.to);
        let forgotten = match direction {
            Direction::Up => slave..to,
            Direction::Down => from..slave + 1,
        };
        match direction {
            Direction::Up => self.overlay.to = slave.min(to),
            Direction::Down => self.overlay.from = (slave + 1).max(from),
        }
        for i in forgotten {
            self.refresh_own(chain, i);
        }
    }

    fn commit(&mut self, chain: &mut Chain<D>, heads: &DrivenConnectors<D>) {
        // Outward from the head, so that the run of old positions has no gap.
        let (from, to) = (self.overlay.from, self.overlay.to);
        for i in (heads.first..to).chain((from..heads.first).rev()) {
            let old = chain.points()[i];
            let new = self.overlay.get(i).unwrap_or(old);
            if self.before.get(i).is_none() {
                self.before.set(i, old);
            }
            self.tally.changed += usize::from(old != new);
            if !heads.indices().contains(&i) {
                self.tally.record_slave_move(distance(old, new));
            }
            chain.points_mut()[i] = new;
        }
        self.tally.record_run(from..to);
    }
}

/// Returns whether only the chain itself can be in the way of a motion.
fn is_open<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    heads: &DrivenConnectors<D>,
) -> bool {
    obstacles.is_empty() && chain.is_plain() && heads.n == 1
}

/// Returns the number of sub-steps of a way. `is_empty` says that there is no obstacle.
fn count_sub_steps(
    rules: &Rules,
    least_step_m: f64,
    is_empty: bool,
    way_m: f64,
) -> Result<usize, InputError> {
    let step_m = match rules.step_m {
        Some(step_m) if step_m > 0.0 => step_m,
        _ if is_empty && !rules.self_collision => f64::INFINITY,
        _ => least_step_m,
    };
    let n = (way_m / step_m).ceil().max(1.0);
    if n > MAX_SUB_STEPS {
        return Err(InputError::new(
            "target",
            format!("is {way_m} m away, which takes {n} steps of {step_m} m"),
            "go there in several requests",
        ));
    }
    Ok(n as usize)
}

/// Returns whether a second try finds slaves more places: rods of other lengths, and in the plane also the
/// other side.
fn has_more_places<const D: usize>(chain: &Chain<D>, head: usize, direction: Direction) -> bool {
    let rods = match direction {
        Direction::Up => &chain.rods()[head..],
        Direction::Down => &chain.rods()[..head],
    };
    D == 2 || rods.iter().any(|rod| rod.min_m < rod.max_m)
}

impl<const D: usize> MotionContext<'_, D> {
    /// Returns the step of a slave whose master's new place is settled.
    fn step(
        &self,
        master: usize,
        slave: usize,
        direction: Direction,
        so: Point<D>,
    ) -> SlaveStep<D> {
        let points = self.chain.points();
        let before = match direction {
            Direction::Up => master.checked_sub(1),
            Direction::Down => (master + 1 < points.len()).then_some(master + 1),
        };
        // In the first sweep the connector on the initiator's other side has yet to move, and the
        // second sweep will check the bend.
        let prev =
            before.filter(|&b| direction == Direction::Down || self.overlay.get(b).is_some());
        SlaveStep {
            master,
            slave,
            mo: points[master],
            mn: self.position(master),
            so,
            prev: prev.map(|b| self.position(b)),
            rod: self.chain.rod_between(master, slave),
            tip_radius_m: self.chain.connectors()[slave].radius_m,
            max_bend_rad: self.chain.connectors()[master].max_bend_rad,
        }
    }

    /// Checks whether the way of an initiator is free of obstacles and of the chain's own parts.
    fn check_initiator(&self, k: usize, to: Point<D>) -> Result<(), PendingVeto> {
        if self.rules.rotation == Rotation::Literal && self.obstacles.is_empty() {
            return Ok(());
        }
        let from = self.chain.points()[k];
        let radius_m = self.chain.connectors()[k].radius_m;
        let near = swept_bounds([from, from, to, to], radius_m);
        let mut worst: Option<(f64, BlockOwner, VetoReason)> = None;
        self.visit_blocks(&near, None, k, |block| {
            let keep_m = block.radius_m + radius_m;
            if !block.stops_tip
                || block.core.is_clear_of_segment([from, to], contact_distance_m(keep_m))
            {
                return;
            }
            let before_m = keep_m - block.core.nearest_to_point(from).distance_m;
            let after_m = keep_m - block.core.nearest_to_point(to).distance_m;
            let was_inside = before_m > TOLERANCE_M;
            if was_inside && after_m <= before_m {
                return;
            }
            let reason = if was_inside { VetoReason::Inside } else { VetoReason::TargetBlocked };
            let deeper =
                worst.is_none_or(|(w, name, _)| after_m > w || (after_m == w && block.name < name));
            if deeper {
                worst = Some((after_m, block.name, reason));
            }
        });
        worst.map_or(Ok(()), |(_, name, reason)| Err(PendingVeto::from_owner(reason, name)))
    }
}

/// Projects the targets to allowed places of the heads, or returns the objection.
fn project<const D: usize>(
    chain: &Chain<D>,
    heads: &mut DrivenConnectors<D>,
    mode: VetoEffect,
) -> Result<(), ConnectorVeto> {
    for (h, k) in heads.indices().enumerate() {
        let (connector, at) = (&chain.connectors()[k], chain.points()[k]);
        if heads.to[h] == at {
            continue;
        }
        if connector.is_still() && distance(heads.to[h], at) > chain.min_move_m() {
            return Err((k, PendingVeto::new(connector.still_reason())));
        }
        if !connector.mobility.allows(heads.to[h], at) {
            if mode == VetoEffect::Exact || heads.n > 1 {
                return Err((k, PendingVeto::new(VetoReason::Mobility)));
            }
            heads.to[h] = connector.mobility.project(heads.to[h], at);
        }
    }
    Ok(())
}

fn rod_box<const D: usize>(
    chain: &Chain<D>,
    i: usize,
    at: impl Fn(usize) -> Point<D>,
) -> Bounds<D> {
    // Rods are no thicker than their connectors.
    let radius_m = chain.connectors()[i].radius_m.max(chain.connectors()[i + 1].radius_m);
    Bounds::from_points(&[at(i), at(i + 1)]).grown(radius_m)
}

fn make_veto<const D: usize>(
    chain: &Chain<D>,
    from: usize,
    by: usize,
    refusal: PendingVeto,
) -> Veto<D> {
    let PendingVeto { reason, obstacle } = refusal;
    Veto { by, from, reason, obstacle, reached: chain.points()[from] }
}

fn check<const D: usize>(chain: &Chain<D>, heads: &DrivenConnectors<D>) -> Result<(), InputError> {
    if heads.first + heads.n > chain.points().len() {
        return Err(InputError::new(
            "initiator",
            format!(
                "is number {}, and the chain has {} connectors",
                heads.first,
                chain.points().len()
            ),
            "count from 0",
        ));
    }
    heads.to.iter().find(|to| !is_in_range(to)).map_or(Ok(()), |to| Err(out_of_range(to)))
}

pub mod local_solver;
mod separation;
#[cfg(test)]
mod tests;
