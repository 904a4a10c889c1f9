//! Requests to move, and their outcomes: a move, or a veto with the objecting part and the reason.
//!
//! A veto is an outcome, not an error (slides R1, R6 to R9). The source of the request decides the next
//! step: an autonomous mover plans again, a planner or an operator gets a report.

use super::geometry::Point;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// Who asks for a motion (slide R4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum RequestSource {
    /// The connector itself, which plans again after a veto.
    Autonomous,
    /// A planner, which reports a veto.
    Planner,
    /// A person, who gets a report of a veto.
    Operator,
}

/// Effect of a veto before the end of the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VetoEffect {
    /// The motion takes place as a whole or not at all.
    Exact,
    /// The part of the path before the veto is kept.
    AsFarAsPossible,
}

/// What moves, and where to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RequestedMotion<const D: usize> {
    /// One connector, which all others follow.
    Connector {
        /// Which one, counted from 0.
        k: usize,
        /// Where to, meters.
        to: Point<D>,
    },
    /// A rod: both its connectors in one request.
    Rod {
        /// Which one: that between connectors `i` and `i + 1`.
        i: usize,
        /// Where to, for connectors `i` and `i + 1`, meters.
        to: [Point<D>; 2],
    },
}

/// A motion that is wanted of a chain, and what a veto means for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionRequest<const D: usize> {
    /// What is to move, and where to.
    pub motion: RequestedMotion<D>,
    /// Who asked, and handles a veto.
    pub source: RequestSource,
    /// Effect of a veto before the end of the path.
    pub mode: VetoEffect,
}

impl<const D: usize> MotionRequest<D> {
    /// Returns an operator's request that connector `k` goes to `to`, or nothing moves.
    pub fn from_operator(k: usize, to: Point<D>) -> Self {
        Self {
            motion: RequestedMotion::Connector { k, to },
            source: RequestSource::Operator,
            mode: VetoEffect::Exact,
        }
    }
}

/// The constraint that forbids a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum VetoReason {
    /// A fixed connector would have to move.
    Fixed,
    /// A failed connector would have to move.
    Failed,
    /// A connector would leave the line, plane or box that it belongs on.
    Mobility,
    /// An obstacle blocks the initiator's target.
    TargetBlocked,
    /// Every direction of a rod is blocked.
    BothSidesBlocked,
    /// The part was in an obstacle before, and would be deeper in it.
    Inside,
    /// A rod would pass through an obstacle between two good positions.
    WouldTunnel,
    /// A bend would be sharper than its limit.
    BendLimit,
    /// The chain would run into itself.
    SelfCollision,
    /// A slave would have to move farther in one step than it may.
    StepLimit,
    /// The search for a detour reached its limit and was given up.
    Limit,
    /// No posture of the chain reaches the target, or none was found.
    OutOfReach,
    /// A joint of an arm would leave its limits.
    JointLimit,
}

impl VetoReason {
    /// All reasons, by number.
    pub const ALL: [Self; 13] = [
        Self::Fixed,
        Self::Failed,
        Self::Mobility,
        Self::TargetBlocked,
        Self::BothSidesBlocked,
        Self::Inside,
        Self::WouldTunnel,
        Self::BendLimit,
        Self::SelfCollision,
        Self::StepLimit,
        Self::Limit,
        Self::OutOfReach,
        Self::JointLimit,
    ];

    /// Returns its place in [`Self::ALL`].
    #[inline]
    pub fn number(self) -> usize {
        self as usize
    }

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Failed => "failed",
            Self::Mobility => "mobility",
            Self::TargetBlocked => "target-blocked",
            Self::BothSidesBlocked => "both-sides-blocked",
            Self::Inside => "inside",
            Self::WouldTunnel => "would-tunnel",
            Self::BendLimit => "bend-limit",
            Self::SelfCollision => "self-collision",
            Self::StepLimit => "step-limit",
            Self::Limit => "limit",
            Self::OutOfReach => "out-of-reach",
            Self::JointLimit => "joint-limit",
        }
    }
}

impl fmt::Display for VetoReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fixed => "it is fixed",
            Self::Failed => "it has failed",
            Self::Mobility => "it would leave the place where it may be",
            Self::TargetBlocked => "its target is blocked",
            Self::BothSidesBlocked => "its rod is blocked on both sides",
            Self::Inside => "it would go deeper into an obstacle",
            Self::WouldTunnel => "its rod would pass through an obstacle",
            Self::BendLimit => "its rod would bend too far",
            Self::SelfCollision => "the chain would run into itself",
            Self::StepLimit => "it would have to move too far in one step",
            Self::Limit => "the search for a way out was given up",
            Self::OutOfReach => "no posture of the chain reaches there",
            Self::JointLimit => "a joint would leave its limits",
        })
    }
}

/// A connector's objection to a motion, or to the rest of one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Veto<const D: usize> {
    /// The connector that objects; the path of the veto is from the initiator to it.
    pub by: usize,
    /// The connector that was to lead the motion.
    pub from: usize,
    /// The constraint that `by` would break.
    pub reason: VetoReason,
    /// The obstacle concerned, if any.
    pub obstacle: Option<u32>,
    /// The place that the initiator could have reached.
    #[serde(with = "super::serde_point")]
    pub reached: Point<D>,
}

impl<const D: usize> fmt::Display for Veto<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "connector {} objects: {}", self.by, self.reason)?;
        if let Some(id) = self.obstacle {
            write!(f, " (obstacle {id})")?;
        }
        write!(f, "; connector {} could go as far as {:?}", self.from, self.reached)
    }
}

/// A motion that took place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CompletedMotion<const D: usize> {
    /// Connectors that reacted, including the initiator.
    pub touched: Range<usize>,
    /// Number of connectors that moved, summed over the sub-steps.
    pub changed: usize,
    /// Number of times that a rod was turned to avoid something.
    pub rotated: usize,
    /// Longest distance that a connector other than the initiator moved in one sub-step, meters.
    pub max_slave_step_m: f64,
    /// The veto that ended the motion early, if the mode allows that.
    pub cut_short: Option<Veto<D>>,
}

/// Outcome of a request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum MotionOutcome<const D: usize> {
    /// The chain moved, all of the way unless that was cut short.
    Moved(CompletedMotion<D>),
    /// Nothing moved; every bit is as before.
    Vetoed(Veto<D>),
}

impl<const D: usize> MotionOutcome<D> {
    /// Returns the motion, if there was one.
    pub fn motion(&self) -> Option<&CompletedMotion<D>> {
        match self {
            Self::Moved(moved) => Some(moved),
            Self::Vetoed(_) => None,
        }
    }

    /// Returns the veto, if nothing moved.
    pub fn veto(&self) -> Option<&Veto<D>> {
        match self {
            Self::Moved(_) => None,
            Self::Vetoed(veto) => Some(veto),
        }
    }
}
