//! Participants of a fleet, by which messages and wires identify sender and receiver.

use serde::{Deserialize, Serialize};
use sidestep::kernel::EntityId;
use std::fmt;

/// A participant of a fleet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum PeerId {
    /// The server of the world.
    Server,
    /// The node of an agent.
    Node(EntityId),
}

impl fmt::Display for PeerId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Server => write!(f, "server"),
            Self::Node(id) => write!(f, "{id}"),
        }
    }
}
