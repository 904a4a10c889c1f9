//! Escape from moving obstacles (slides P2, R4).
//!
//! ```text
//! literal.rs       the slides' method: one part after the other, the deepest first
//! simultaneous/    all parts of a tick at once, an exit for a part that is caught, and a leader that looks ahead
//! threat.rs        the parts near an obstacle
//! ```
//!
//! Two obstacles that close in on a chain from both sides hold it like a pair of tongs, at any
//! speed. The literal escape leaves it there. The simultaneous one takes it through the obstacle
//! that it leaves soonest, by rollouts of a few exits.

mod literal;
mod simultaneous;
#[cfg(test)]
mod tests;
mod threat;

use literal::LiteralEscape;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::InputError;
pub(crate) use sidestep_rods::ChainPart;
use sidestep_rods::geometry::{Point, norm};
use sidestep_rods::{Chain, Obstacle, Obstacles, Propagator, Veto};
pub use simultaneous::EscapePlan;
use simultaneous::SimultaneousEscape;
pub(crate) use simultaneous::{LeadMotion, LeaderChoice};

/// The method by which a chain escapes from moving obstacles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Method")]
pub enum EscapeMethod {
    /// All constraints of a tick are solved at once; caught parts are led out.
    #[default]
    Simultaneous,
    /// One part after the other becomes an initiator, the deepest first (slide P2).
    Literal,
}

/// Rules of escapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObstacleEscapeRules {
    /// Length of a tick, s.
    pub dt_s: f64,
    /// Maximum speed: no connector is farther from its position at the start of the tick than this
    /// times the tick; infinite for no limit.
    pub speed_max_m_s: f64,
    /// Number of ticks before contact at which parts escape, with a margin of 0.05 m; 0 to escape only
    /// on contact.
    pub ticks_ahead: f64,
    /// Most violations that the literal escape handles in a tick; at least half of them are
    /// contacts.
    pub most: usize,
    /// How parts get out of the way.
    pub method: EscapeMethod,
}

impl ObstacleEscapeRules {
    /// Returns rules of the usual method with a look-ahead of 20 ticks and, where it counts them, up
    /// to 40 violations a tick.
    pub fn new(dt_s: f64, speed_max_m_s: f64) -> Self {
        Self {
            dt_s,
            speed_max_m_s,
            ticks_ahead: TICKS_AHEAD,
            most: MAX_VIOLATIONS,
            method: EscapeMethod::default(),
        }
    }

    fn check(&self) -> Result<(), InputError> {
        if !(self.dt_s > 0.0 && self.dt_s.is_finite()) {
            let cause = format!("has ticks of {} s", self.dt_s);
            return Err(InputError::new("escape", cause, "give a positive number"));
        }
        if self.speed_max_m_s.is_nan() || self.speed_max_m_s < 0.0 {
            let cause = format!("has the greatest speed {} m/s", self.speed_max_m_s);
            return Err(InputError::new("escape", cause, "give 0 or more"));
        }
        if !(0.0..=1e6).contains(&self.ticks_ahead) {
            let cause = format!("looks {} ticks ahead", self.ticks_ahead);
            return Err(InputError::new("escape", cause, "give 0 to 1e6"));
        }
        Ok(())
    }

    fn max_step_m(&self) -> f64 {
        self.speed_max_m_s * self.dt_s
    }

    fn look_ahead_margin(&self) -> EscapeMargin {
        if self.ticks_ahead > 0.0 {
            EscapeMargin { ahead_s: self.ticks_ahead * self.dt_s, spare_m: MARGIN_M }
        } else {
            EscapeMargin::NONE
        }
    }
}

/// What an escape moved, and what it left inside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EscapeReport<const D: usize> {
    /// Motions that brought a part farther away.
    pub moves: usize,
    /// Violations that no motion reduced.
    pub vetoes: usize,
    /// Number of those for which the speed limit was the only reason.
    pub capped: usize,
    /// Depth of the deepest part still in a moving obstacle, meters; 0 if none is.
    pub deepest_m: f64,
    /// The deepest part that is still in one.
    pub left: Option<TrappedPart<D>>,
    /// The first part that got away: its connector, or the one at the start of its rod, and the
    /// obstacle that it got away from.
    pub first: Option<(usize, u32)>,
    /// Whether the chain is pressed: it needs all its speed to escape, so its leader should rest.
    /// Only the simultaneous escape reports that.
    pub is_pressed: bool,
}

/// A part that is still in a moving obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrappedPart<const D: usize> {
    /// The connector or rod that did not get out.
    pub part: ChainPart,
    /// Id of the obstacle that it is in.
    pub obstacle: u32,
    /// The reason why it could not leave; `None` if the tick's motions were used up.
    pub veto: Option<Veto<D>>,
}

/// Escapes of chains. It owns its buffers and keeps nothing from tick to tick; a chain's memory is its
/// [`EscapePlan`].
#[derive(Debug, Clone)]
pub struct ObstacleEscaper<const D: usize> {
    rules: ObstacleEscapeRules,
    literal: LiteralEscape<D>,
    simultaneous: SimultaneousEscape<D>,
}

/// A chain that may have to escape in a tick, and its surroundings.
#[derive(Debug)]
pub struct ObstacleEscapeInput<'a, const D: usize> {
    /// The chain, which the escape moves.
    pub chain: &'a mut Chain<D>,
    /// Obstacles around it, with those that move.
    pub obstacles: &'a Obstacles<D>,
    /// Moves it, by the rules that it was made with.
    pub propagator: &'a mut Propagator<D>,
    /// Positions of its connectors at the start of the tick.
    pub start: &'a [Point<D>],
}

/// The free space required around moving obstacles.
#[derive(Debug, Clone, Copy, PartialEq)]
struct EscapeMargin {
    ahead_s: f64,
    spare_m: f64,
}

impl EscapeMargin {
    const NONE: Self = Self { ahead_s: 0.0, spare_m: 0.0 };

    fn required_gap_m<const D: usize>(self, mover: &Obstacle<D>) -> f64 {
        norm(mover.velocity_m_s) * self.ahead_s + self.spare_m
    }
}

/// Gap that is kept beyond the distance that an obstacle travels in the look-ahead, meters. With it and two ticks, parts
/// inside fell from 0.1 to 0.4 % of the steps of an escape on contact to 0.0 to 0.2 %.
const MARGIN_M: f64 = 0.05;
/// Time from one choice of a leader to the next, s. If it is shorter, rollouts cost more: up to
/// 300 solves a choice. If it is longer, the leader reacts later: at 0.5 m/s it goes 0.1 m between two choices. The value
/// lies between the two; no measurement of others is known.
const LEADER_CHOICE_INTERVAL_S: f64 = 0.2;
/// Ticks before contact at which parts escape, unless they are given: 0.4 s at 50 ticks a second.
const TICKS_AHEAD: f64 = 20.0;
/// Violations that the literal escape handles in a tick, unless they are given: enough for all 31 parts of the measured
/// chains of 16 robots.
const MAX_VIOLATIONS: usize = 40;

impl<const D: usize> ObstacleEscaper<D> {
    /// Returns an escaper; it is [`Self::escape`] that checks the rules.
    pub fn new(rules: ObstacleEscapeRules) -> Self {
        Self {
            rules,
            literal: LiteralEscape::new(rules),
            simultaneous: SimultaneousEscape::new(rules),
        }
    }

    /// Returns the rules that it was made with.
    pub fn rules(&self) -> &ObstacleEscapeRules {
        &self.rules
    }

    /// Returns the ticks from one choice of a leader to the next; none if leaders choose nothing, because the chain
    /// escapes on contact only, or by the literal method.
    pub(crate) fn choice_interval_ticks(&self) -> Option<u64> {
        let ObstacleEscapeRules { dt_s, ticks_ahead, method, .. } = self.rules;
        if method == EscapeMethod::Literal || ticks_ahead == 0.0 {
            return None;
        }
        Some((LEADER_CHOICE_INTERVAL_S / dt_s).round().max(1.0) as u64)
    }

    /// Returns whether the leader of a chain should rest instead of moving as it wants: whether that keeps parts of the
    /// chain inside moving obstacles for less time.
    pub(crate) fn should_leader_rest(
        &self,
        choice: &LeaderChoice<'_, D>,
        escape_plan: &mut EscapePlan,
    ) -> bool {
        self.simultaneous.should_leader_rest(choice, escape_plan)
    }

    /// Moves the parts of a chain that are too near to a moving obstacle. `escape_plan` is the chain's memory: the
    /// default at first, and then as the last tick left it.
    ///
    /// # Errors
    /// When a tick is not positive, a speed limit is below 0, or the start of the tick belongs to another chain.
    pub fn escape(
        &mut self,
        mut tick: ObstacleEscapeInput<'_, D>,
        escape_plan: &mut EscapePlan,
    ) -> Result<EscapeReport<D>, InputError> {
        self.rules.check()?;
        let n = tick.chain.points().len();
        if tick.start.len() != n {
            let cause = format!("has {} places for {n}", tick.start.len());
            return Err(InputError::new("start of the tick", cause, "give one a connector"));
        }
        if self.rules.method == EscapeMethod::Simultaneous {
            return Ok(self.simultaneous.escape(&mut tick, escape_plan));
        }
        // Slaves of a part that escapes are no faster than it; the limit of led motion holds again afterward.
        let step_max_m = tick.propagator.rules.slave_step_max_m;
        tick.propagator.rules.slave_step_max_m = step_max_m.min(self.rules.max_step_m());
        let escaped = self.literal.escape(&mut tick);
        tick.propagator.rules.slave_step_max_m = step_max_m;
        escaped
    }
}
