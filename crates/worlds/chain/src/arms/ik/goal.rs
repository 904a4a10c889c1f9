//! What is wanted of a chain, and what came of it.

use crate::rods::geometry::Point;
use crate::rods::veto::Veto;
use std::fmt;

/// How a posture is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Engine {
    /// What is fastest: without constraints the chain's own rule up to 10 rods and damped least
    /// squares beyond; otherwise a motion by the rules of the chain, then postures.
    #[default]
    Auto,
    /// The chain's own rule, there and back. With rods of fixed length it is FABRIK. Where
    /// something constrains the chain: a motion from the present posture, and nothing else.
    Chain,
    /// Damped least squares: of all postures the nearest. Where something constrains the chain:
    /// postures alone.
    Dls,
    /// Closed form: straight but for two bends. The others come to it where they do not converge.
    Direct,
}

impl Engine {
    /// Its name in files and commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Chain => "chain",
            Self::Dls => "dls",
            Self::Direct => "direct",
        }
    }
}

/// A connector that is to be somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal<const D: usize> {
    /// The connector.
    pub k: usize,
    /// The connector that keeps its place.
    pub base: usize,
    /// Where `k` shall be.
    pub target: Point<D>,
    /// How near counts as there, meters.
    pub tolerance_m: f64,
    /// How a posture is found.
    pub engine: Engine,
    /// Postures to start from, beside the present one, where something is in the way.
    pub restarts: usize,
    /// What the random ones of them grow from.
    pub seed: u64,
    /// Whether only a motion from the present posture counts.
    pub motion_only: bool,
}

impl<const D: usize> Goal<D> {
    /// Connector `k` at `target` to 1e-6 m, with 100 restarts.
    pub fn new(k: usize, base: usize, target: Point<D>) -> Self {
        Self {
            k,
            base,
            target,
            tolerance_m: 1e-6,
            engine: Engine::Auto,
            restarts: 100,
            seed: 0,
            motion_only: false,
        }
    }
}

/// What an answer is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The chain can go there from where it is: every state on the way has been checked.
    Motion,
    /// Good in itself; whether the chain can get there has not been looked at.
    Posture,
}

/// What came of a goal.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer<const D: usize> {
    /// Whether the posture meets the goal and all constraints.
    pub reached: bool,
    /// Distance of the connector from the target.
    pub error_m: f64,
    /// All connectors of the chain. They meet all constraints, reached or not.
    pub points: Vec<Point<D>>,
    /// Steps or passes of the engine, over all starts.
    pub iterations: usize,
    /// What found the posture.
    pub engine: Engine,
    /// Whether a motion leads to it.
    pub kind: Kind,
    /// Why the goal is not met; `None` if it is.
    pub reason: Option<Unreached<D>>,
}

/// Why a goal is not met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unreached<const D: usize> {
    /// The rods are too short.
    TooFar {
        /// Distance of the target from the base.
        far_m: f64,
        /// The greatest that the rods allow.
        reach_m: f64,
    },
    /// One rod is longer than all the others together.
    TooNear {
        /// Distance of the target from the base.
        far_m: f64,
        /// The least that the rods allow.
        hole_m: f64,
    },
    /// A constraint is in the way of the best that was found.
    Blocked {
        /// Who objects, and which constraint it is.
        veto: Veto<D>,
    },
    /// The search was given up.
    NotFound {
        /// Postures that it started from.
        tries: usize,
    },
}

impl<const D: usize> fmt::Display for Unreached<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFar { far_m, reach_m } => {
                write!(f, "the target is {far_m} m from the base, and the rods reach {reach_m} m")
            }
            Self::TooNear { far_m, hole_m } => write!(
                f,
                "the target is {far_m} m from the base, and the tip comes no nearer than {hole_m} m"
            ),
            Self::Blocked { veto } => {
                write!(f, "connector {} objects: {}", veto.by, veto.reason)?;
                veto.obstacle.map_or(Ok(()), |id| write!(f, " (obstacle {id})"))
            }
            Self::NotFound { tries } => write!(f, "no posture was found from {tries} starts"),
        }
    }
}
