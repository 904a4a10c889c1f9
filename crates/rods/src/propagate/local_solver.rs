//! One connector by itself: its reaction to its master, and its checks as an initiator, by the code that
//! propagates motions through whole chains. Its inputs are messages from its neighbors and its own
//! surroundings, and nothing else (slide E4), so that it can run as an agent aboard a robot.

use super::{InitiatingConnectors, check, count_sub_steps, project};
use crate::candidates::{CandidateScratch, guide_line_slave_position};
use crate::chain::{Chain, Rod};
use crate::geometry::{Point, distance};
use crate::motion_context::{
    IncompleteVeto, MotionContext, SlaveStep, TentativePositions, is_length_allowed,
};
use crate::obstacle::Obstacles;
use crate::reaction::Reaction;
use crate::rod_bvh::RodBvh;
use crate::rules::{ReactionRules, RotationRule};
use crate::veto::{RequestedMotion, VetoEffect};
use sidestep_kernel::InputError;
use std::sync::Arc;

/// Index of the connector in a chain of its own.
const SELF_INDEX: usize = 0;
/// Index that its master would have in that chain. Nothing is looked up there.
const MASTER_INDEX: usize = 1;

/// A connector by itself.
#[derive(Debug, Clone)]
pub struct ConnectorReactionSolver<const D: usize> {
    /// A chain of this connector only. It has the least move and the step length of the whole one,
    /// so that the connector decides as it would inside it.
    chain: Chain<D>,
    rules: ReactionRules,
    /// Its reaction, unless it is the built-in one.
    reaction: Option<Arc<dyn Reaction>>,
    scratch: CandidateScratch<D>,
    tentative: TentativePositions<D>,
    own_rods: RodBvh<D>,
}

/// A master's motion, as its message to the slave describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MasterMotion<const D: usize> {
    /// Position of the master before the motion.
    pub mo: Point<D>,
    /// Position of the master after it.
    pub mn: Point<D>,
    /// The connector on the master's other side, if its new position is settled.
    pub prev: Option<Point<D>>,
    /// Bend limit of the master, rad; it is the slave that checks it, and knows both rods.
    pub max_bend_rad: f64,
    /// Whether nothing in the world can object.
    pub is_open: bool,
    /// Whether a rod that turns tries all its lengths.
    pub all_lengths: bool,
}

/// A slave, and the part of the chain beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlavePosition<const D: usize> {
    /// Its position before the motion.
    pub so: Point<D>,
    /// The rod to its master.
    pub rod: Rod,
    /// The connector beyond it, and the rod to that one; `None` at the end of the chain.
    pub next: Option<(Point<D>, Rod)>,
}

/// Where a slave goes, and what a second sweep could change about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlaveReaction<const D: usize> {
    /// Its new position; the old one, bit for bit, if it stays.
    pub at: Point<D>,
    /// Whether the motion ends here, because the slave stays and everything beyond it meets its constraints.
    pub ends: bool,
    /// Whether its rod turned from the guide line.
    pub rotated: bool,
    /// Whether it could have gone elsewhere.
    pub has_others: bool,
    /// Whether its rod found a free direction by turning.
    pub has_turned: bool,
}

impl<const D: usize> ConnectorReactionSolver<D> {
    /// Returns connector `k` of a chain, which reacts by the chain's rules, except that it does not
    /// check for collisions of the chain with itself: it does not know where the other parts are.
    pub fn new(chain: &Chain<D>, k: usize, rules: &ReactionRules) -> Self {
        let rules = ReactionRules { self_collision: false, ..*rules };
        Self {
            chain: chain.single_connector(k),
            rules,
            reaction: None,
            scratch: CandidateScratch::default(),
            tentative: TentativePositions::default(),
            own_rods: RodBvh::default(),
        }
    }

    /// Returns the connector with a reaction in place of the built-in one, if one is given.
    #[must_use]
    pub fn with_reaction(self, reaction: Option<Arc<dyn Reaction>>) -> Self {
        Self { reaction, ..self }
    }

    /// Returns its bend limit, rad, which its slaves need.
    pub fn max_bend_rad(&self) -> f64 {
        self.chain.connectors()[SELF_INDEX].max_bend_rad
    }

    /// Sets its bend limit, rad.
    ///
    /// # Errors
    /// When the limit is out of range.
    pub fn set_max_bend_rad(&mut self, max_bend_rad: f64) -> Result<(), InputError> {
        self.chain.set_max_bend_rad(SELF_INDEX, max_bend_rad)
    }

    /// Returns whether trying all lengths could find more places than trying one, for the rod to a master.
    pub fn has_more_places(rod: Rod) -> bool {
        D == 2 || rod.min_m < rod.max_m
    }

    /// Returns whether a sweep that ended in a veto is to be repeated with all lengths, if rods have turned.
    pub fn should_repeat_sweep(&self) -> bool {
        self.rules.rotation == RotationRule::Union
    }

    /// Returns its reaction as a slave to the motion of its master.
    ///
    /// # Errors
    /// The constraint because of which it objects.
    pub fn react(
        &mut self,
        slave: &SlavePosition<D>,
        obstacles: &Obstacles<D>,
        pull: &MasterMotion<D>,
    ) -> Result<SlaveReaction<D>, IncompleteVeto> {
        if pull.is_open && self.reaction.is_none() {
            return Ok(self.free_reaction(slave, pull));
        }
        let SlavePosition { so, rod, next } = *slave;
        self.chain.points_mut()[SELF_INDEX] = so;
        let Self { chain, rules, reaction, scratch, tentative, own_rods } = self;
        scratch.all_lengths = pull.all_lengths;
        scratch.has_turned = false;
        let reaction = reaction.as_deref();
        let context = MotionContext { chain, obstacles, rules, tentative, own_rods, reaction };
        let connector = &chain.connectors()[SELF_INDEX];
        let step = SlaveStep {
            master: MASTER_INDEX,
            slave: SELF_INDEX,
            mo: pull.mo,
            mn: pull.mn,
            so,
            prev: pull.prev,
            rod,
            tip_radius_m: connector.radius_m,
            max_bend_rad: pull.max_bend_rad,
        };
        context.candidates(&step, scratch)?;
        let chosen = scratch.found[0];
        let stays = distance(chosen.at, so) <= chain.min_move_m();
        // The same test as that of a whole chain (`Propagator::may_stop`), with this connector as the master.
        let may_stop = next.is_none_or(|(next_at, next_rod)| {
            let next_step = SlaveStep {
                mo: so,
                mn: so,
                so: next_at,
                prev: Some(pull.mn),
                rod: next_rod,
                max_bend_rad: connector.max_bend_rad,
                ..step
            };
            is_length_allowed(next_rod, distance(next_at, so))
                && next_step.is_bend_allowed_at(next_at)
        });
        Ok(SlaveReaction {
            at: if stays { so } else { chosen.at },
            ends: stays && may_stop,
            rotated: chosen.rotated,
            has_others: scratch.found.len() > 1 || scratch.has_other_side,
            has_turned: scratch.has_turned,
        })
    }

    /// Returns its reaction where nothing can object.
    fn free_reaction(&self, slave: &SlavePosition<D>, pull: &MasterMotion<D>) -> SlaveReaction<D> {
        let SlavePosition { so, rod, next } = *slave;
        let at = guide_line_slave_position([pull.mo, pull.mn, so], rod, self.chain.min_move_m());
        let is_next_allowed =
            next.is_none_or(|(beyond, rod)| is_length_allowed(rod, distance(so, beyond)));
        let ends = at == so && is_next_allowed;
        SlaveReaction { at, ends, rotated: false, has_others: false, has_turned: false }
    }

    /// Returns the number of sub-steps in which it moves to a target as an initiator.
    /// `is_empty` says that there is no obstacle anywhere.
    ///
    /// # Errors
    /// When the target is out of the range of coordinates, or too far away.
    pub fn sub_steps(
        &self,
        from: Point<D>,
        to: Point<D>,
        is_empty: bool,
    ) -> Result<usize, InputError> {
        check(
            &self.chain,
            &InitiatingConnectors::from_motion(&RequestedMotion::Connector { k: SELF_INDEX, to }),
        )?;
        count_sub_steps(&self.rules, self.chain.step_m(), is_empty, distance(from, to))
    }

    /// Checks whether its own constraint allows it to move to a target as an initiator.
    ///
    /// # Errors
    /// The constraint because of which it objects.
    pub fn may_lead(&mut self, from: Point<D>, to: Point<D>) -> Result<(), IncompleteVeto> {
        self.chain.points_mut()[SELF_INDEX] = from;
        let mut driven =
            InitiatingConnectors::from_motion(&RequestedMotion::Connector { k: SELF_INDEX, to });
        project(&self.chain, &mut driven, VetoEffect::Exact).map_err(|(_, objection)| objection)
    }

    /// Returns whether a sub-step is too short to count.
    pub fn is_negligible(&self, from: Point<D>, to: Point<D>) -> bool {
        distance(to, from) <= self.chain.min_move_m()
    }

    /// Checks whether its path as an initiator is free of obstacles.
    ///
    /// # Errors
    /// The constraint because of which it objects.
    pub fn check_initiator(
        &mut self,
        from: Point<D>,
        to: Point<D>,
        obstacles: &Obstacles<D>,
    ) -> Result<(), IncompleteVeto> {
        self.chain.points_mut()[SELF_INDEX] = from;
        let Self { chain, rules, tentative, own_rods, .. } = &*self;
        let reaction = self.reaction.as_deref();
        MotionContext { chain, obstacles, rules, tentative, own_rods, reaction }
            .check_initiator(SELF_INDEX, to)
    }
}
