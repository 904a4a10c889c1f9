//! Goals of a chain, and the answers.

use sidestep_rods::Veto;
use sidestep_rods::geometry::Point;
use std::fmt;

/// Methods to find a posture, which differ in time and in which posture they find.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum IkEngine {
    /// The fastest: without constraints the chain's own rule up to 10 rods and damped least squares
    /// beyond; otherwise a motion by the rules of the chain, then postures.
    #[default]
    Auto,
    /// The chain's own rule, there and back. With rods of fixed length it is FABRIK. If anything
    /// constrains the chain: only a motion from the present posture.
    Chain,
    /// Damped least squares, which find the nearest of all postures. If anything constrains the
    /// chain: postures alone.
    Dls,
    /// Closed form: straight except for two bends. The others fall back to it if they do not
    /// converge.
    Direct,
}

impl IkEngine {
    /// Returns its name in files and commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Chain => "chain",
            Self::Dls => "dls",
            Self::Direct => "direct",
        }
    }
}

/// Where a connector is to be, and how long to search for a posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainIkGoal<const D: usize> {
    /// The connector that is to be there, counted from 0.
    pub k: usize,
    /// The connector that keeps its place, unless one between it and `k` never moves.
    pub base: usize,
    /// Where `k` is to be, in m.
    pub target: Point<D>,
    /// Distance at which the target counts as reached, meters.
    pub tolerance_m: f64,
    /// The method to use; the result has the one that found the posture.
    pub engine: IkEngine,
    /// Postures to start from, besides the present one, if an obstacle is in the way.
    pub restarts: usize,
    /// Random seed of these postures: the same one gives the same result.
    pub seed: u64,
    /// Whether only a motion from the present posture counts.
    pub motion_only: bool,
}

impl<const D: usize> ChainIkGoal<D> {
    /// Returns a goal for connector `k` at `target` to 1e-6 m, with 100 restarts.
    pub fn new(k: usize, base: usize, target: Point<D>) -> Self {
        Self {
            k,
            base,
            target,
            tolerance_m: 1e-6,
            engine: IkEngine::Auto,
            restarts: 100,
            seed: 0,
            motion_only: false,
        }
    }
}

/// Whether anything is known about the path to a posture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionOrPosture {
    /// A motion: the chain can go there from its present posture, and every state of the path has been
    /// checked.
    Motion,
    /// A posture: good in itself; it has not been checked whether the chain can get there.
    Posture,
}

/// The posture that meets a goal, or else the best one found.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainIkResult<const D: usize> {
    /// Whether the posture meets the goal and all constraints.
    pub reached: bool,
    /// Distance of the connector from the target, meters.
    pub error_m: f64,
    /// All connectors of the chain. They meet all constraints, reached or not.
    pub points: Vec<Point<D>>,
    /// Steps or passes of the engine, over all starts.
    pub iterations: usize,
    /// The engine that found the posture.
    pub engine: IkEngine,
    /// Whether a motion leads to it.
    pub kind: MotionOrPosture,
    /// The reason why the goal is not met; `None` if it is.
    pub reason: Option<ChainIkFailure<D>>,
}

/// Why a goal is not met: a distance that the rods rule out, before all else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ChainIkFailure<const D: usize> {
    /// The rods are too short.
    TooFar {
        /// Distance of the target from the base, meters.
        far_m: f64,
        /// The greatest distance that the rods allow, meters.
        reach_m: f64,
    },
    /// One rod is longer than all the others together.
    TooNear {
        /// Distance of the target from the base, meters.
        far_m: f64,
        /// The least distance that the rods allow, meters.
        hole_m: f64,
    },
    /// A constraint forbids the best posture that was found.
    Blocked {
        /// The objection, with the connector and the constraint.
        veto: Veto<D>,
    },
    /// The search was given up.
    NotFound {
        /// Postures that it started from.
        tries: usize,
    },
}

impl<const D: usize> fmt::Display for ChainIkFailure<D> {
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
