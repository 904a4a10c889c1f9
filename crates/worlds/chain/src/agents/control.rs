//! Decision of an agent at the end of a cycle.

use super::traffic::NetworkTraffic;
use crate::motion::recovery::{RecoveryMemory, RecoveryOutcome};
use serde::{Deserialize, Serialize};
use sidestep_kernel::Cycle;
use sidestep_rods::Veto;
use sidestep_rods::geometry::Point;

/// A connector's motion in a cycle, and the outcome of its talk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConnectorControl<const D: usize> {
    /// The connector's number in its chain.
    pub connector: u32,
    /// The cycle that it decides; it is refused in any other.
    pub cycle: Cycle,
    /// Whether its connector moves, and where to.
    pub goes: ConnectorMove<D>,
    /// The motion that it led and that is carried out, if there is one.
    pub led: Option<ExecutedMotion>,
    /// How its intention ended, if it leads the chain; none where time was up before.
    pub ended: Option<LeaderOutcome<D>>,
    /// The nearest lost connectors below and above.
    pub missing: [Option<u32>; 2],
    /// Whether time was up before its leader had finished.
    pub is_late: bool,
    /// The count of its packets.
    pub traffic: NetworkTraffic,
}

/// What a connector does in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ConnectorMove<const D: usize> {
    /// It took part in no motion that is carried out.
    Stays,
    /// It goes, in the motion with a number.
    To {
        /// Number of the motion in its cycle, the same for all connectors that take part.
        request: u32,
        /// Its new place, meters.
        #[serde(with = "sidestep_rods::serde_point")]
        to: Point<D>,
    },
    /// It has consented to a motion and heard nothing further of it: it goes if its master goes.
    WithItsMaster {
        /// Number of that motion in its cycle.
        request: u32,
        /// Its new place, meters.
        #[serde(with = "sidestep_rods::serde_point")]
        to: Point<D>,
    },
}

/// A motion to which all have consented, as its leader reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExecutedMotion {
    /// Its number in its cycle, which [`ConnectorMove::To`] repeats.
    pub request: u32,
    /// The first connector that takes part.
    pub first: u32,
    /// The last one, which takes part as well.
    pub last: u32,
}

/// How the intention of a leader ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum LeaderOutcome<const D: usize> {
    /// It was carried out, or not, by the ladder.
    Climbed {
        /// Where on the ladder it ended.
        climbed: RecoveryOutcome<D>,
        /// The objection to the intention itself, if there was one.
        objection: Option<Veto<D>>,
        /// Its memory after that.
        memory: RecoveryMemory,
    },
    /// The chain stands, because a connector is lost.
    Stands {
        /// The nearest lost connector that the leader knows of.
        missing: u32,
    },
    /// There was no intention: the chain rests.
    Rested,
}
