//! One connector by itself: its reaction to its master, and its part as an initiator, by the code that
//! judges whole chains. It knows its neighbors' messages and its own surroundings, and nothing else.

use super::{Heads, check, n_sub_steps, project};
use crate::rods::candidates::{Work, guided};
use crate::rods::chain::{Chain, Rod};
use crate::rods::geometry::{Point, distance};
use crate::rods::obstacle::Obstacles;
use crate::rods::own_body::OwnBody;
use crate::rods::rules::{Rotation, Rules};
use crate::rods::scene::{Overlay, Refusal, Scene, Step, fits};
use crate::rods::veto::{Mode, Motion};
use sidestep_kernel::InputError;

/// Index of the connector in a chain of its own, and the one that its master would have.
const ME: usize = 0;
const MASTER: usize = 1;

/// A connector by itself.
#[derive(Debug, Clone)]
pub(crate) struct Alone<const D: usize> {
    /// A chain of this connector only, with the measures of the whole one.
    chain: Chain<D>,
    rules: Rules,
    work: Work<D>,
    overlay: Overlay<D>,
    own: OwnBody<D>,
}

/// A master's motion, as its slave hears of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pull<const D: usize> {
    /// The master before,
    pub(crate) mo: Point<D>,
    /// and after.
    pub(crate) mn: Point<D>,
    /// The connector on the master's other side, if its place is settled.
    pub(crate) prev: Option<Point<D>>,
    /// Bend limit of the master, rad.
    pub(crate) max_bend_rad: f64,
    /// Whether nothing in the world can object.
    pub(crate) is_open: bool,
    /// Whether a rod that turns tries all its lengths.
    pub(crate) all_lengths: bool,
}

/// A slave's reaction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reaction<const D: usize> {
    /// Its new place; the old one, bit for bit, if it stays.
    pub(crate) at: Point<D>,
    /// Whether the motion ends here, because the slave stays and everything beyond it is good as it is.
    pub(crate) ends: bool,
    /// Whether its rod turned from the guide line.
    pub(crate) rotated: bool,
    /// Whether it could have gone elsewhere.
    pub(crate) has_others: bool,
    /// Whether its rod found a way by turning.
    pub(crate) has_turned: bool,
}

impl<const D: usize> Alone<D> {
    /// Returns a connector of a chain, which reacts by the chain's rules. Parts of its own chain are not
    /// in its way.
    pub(crate) fn new(chain: &Chain<D>, k: usize, rules: &Rules) -> Self {
        let rules = Rules { self_collision: false, ..*rules };
        let (work, overlay, own) = (Work::default(), Overlay::default(), OwnBody::default());
        Self { chain: chain.alone(k), rules, work, overlay, own }
    }

    /// Returns its bend limit, rad.
    pub(crate) fn max_bend_rad(&self) -> f64 {
        self.chain.connectors()[ME].max_bend_rad
    }

    /// Gives it another bend limit.
    ///
    /// # Errors
    /// When the limit is out of range.
    pub(crate) fn set_max_bend_rad(&mut self, max_bend_rad: f64) -> Result<(), InputError> {
        self.chain.set_max_bend_rad(ME, max_bend_rad)
    }

    /// Returns whether trying all lengths could find more places than trying one, for the rod to a master.
    pub(crate) fn may_go_elsewhere(rod: Rod) -> bool {
        D == 2 || rod.min_m < rod.max_m
    }

    /// Returns whether a sweep that ended in a veto is to be repeated with all lengths, if rods have turned.
    pub(crate) fn repeats(&self) -> bool {
        self.rules.rotation == Rotation::Union
    }

    /// Returns its reaction as a slave at `so` on a rod to its master. `next` is the connector beyond
    /// it, and the rod to that one.
    ///
    /// # Errors
    /// The constraint because of which it objects.
    pub(crate) fn react(
        &mut self,
        so: Point<D>,
        rod: Rod,
        next: Option<(Point<D>, Rod)>,
        obstacles: &Obstacles<D>,
        pull: &Pull<D>,
    ) -> Result<Reaction<D>, Refusal> {
        if pull.is_open {
            return Ok(self.pulled(so, rod, next, pull));
        }
        self.chain.points_mut()[ME] = so;
        let Self { chain, rules, work, overlay, own } = self;
        (work.all_lengths, work.has_turned) = (pull.all_lengths, false);
        let scene = Scene { chain, obstacles, rules, overlay, own };
        let connector = &chain.connectors()[ME];
        let step = Step {
            master: MASTER,
            slave: ME,
            mo: pull.mo,
            mn: pull.mn,
            so,
            prev: pull.prev,
            rod,
            tip_radius_m: connector.radius_m,
            max_bend_rad: pull.max_bend_rad,
        };
        scene.candidates(&step, work)?;
        let chosen = work.found[0];
        let stays = distance(chosen.at, so) <= chain.least_move_m();
        let is_good = |(at, rod): (Point<D>, Rod)| {
            let (prev, max_bend_rad) = (Some(pull.mn), connector.max_bend_rad);
            let beyond = Step { mo: so, mn: so, so: at, prev, rod, max_bend_rad, ..step };
            fits(rod, distance(at, so)) && beyond.bends_at(at)
        };
        Ok(Reaction {
            at: if stays { so } else { chosen.at },
            ends: stays && next.is_none_or(is_good),
            rotated: chosen.rotated,
            has_others: work.found.len() > 1 || work.has_other_side,
            has_turned: work.has_turned,
        })
    }

    /// Returns its reaction where nothing can object.
    fn pulled(
        &self,
        so: Point<D>,
        rod: Rod,
        next: Option<(Point<D>, Rod)>,
        pull: &Pull<D>,
    ) -> Reaction<D> {
        let at = guided([pull.mo, pull.mn, so], rod, self.chain.least_move_m());
        let is_good = |(beyond, rod): (Point<D>, Rod)| fits(rod, distance(so, beyond));
        let ends = at == so && next.is_none_or(is_good);
        Reaction { at, ends, rotated: false, has_others: false, has_turned: false }
    }

    /// Returns the number of sub-steps in which it goes from its place to a target as an initiator.
    /// `is_empty` says that there is no obstacle anywhere.
    ///
    /// # Errors
    /// When the target is out of the range of coordinates, or too far away.
    pub(crate) fn sub_steps(
        &self,
        from: Point<D>,
        to: Point<D>,
        is_empty: bool,
    ) -> Result<usize, InputError> {
        check(&self.chain, &Heads::of(&Motion::Connector { k: ME, to }))?;
        n_sub_steps(&self.rules, self.chain.step_m(), is_empty, distance(from, to))
    }

    /// Returns whether its own constraint allows it to go from its place to a target as an initiator.
    ///
    /// # Errors
    /// The constraint because of which it objects.
    pub(crate) fn may_lead(&mut self, from: Point<D>, to: Point<D>) -> Result<(), Refusal> {
        self.chain.points_mut()[ME] = from;
        let mut heads = Heads::of(&Motion::Connector { k: ME, to });
        project(&self.chain, &mut heads, Mode::Exact).map_err(|(_, refusal)| refusal)
    }

    /// Returns whether a sub-step is too short to count.
    pub(crate) fn is_there(&self, from: Point<D>, to: Point<D>) -> bool {
        distance(to, from) <= self.chain.least_move_m()
    }

    /// Checks whether its way as an initiator is free of obstacles.
    ///
    /// # Errors
    /// The constraint because of which it objects.
    pub(crate) fn judge_initiator(
        &mut self,
        from: Point<D>,
        to: Point<D>,
        obstacles: &Obstacles<D>,
    ) -> Result<(), Refusal> {
        self.chain.points_mut()[ME] = from;
        let Self { chain, rules, overlay, own, .. } = &*self;
        Scene { chain, obstacles, rules, overlay, own }.judge_initiator(ME, to)
    }
}
