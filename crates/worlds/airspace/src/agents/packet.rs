//! Protocols of airplanes, and their packets.

use serde::{Deserialize, Serialize};
use sidestep_kernel::network;

/// The subject of a conversation: each cycle has one conversation of each at most, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Protocol {
    /// The choice of the airplanes that decide together, where groups are not announced.
    Group,
    /// The choice of the action that each wants to fly.
    Decision,
    /// The shield's exchange, which checks that these actions are safe.
    Shield,
}

impl network::ConversationTopic for Protocol {
    fn wire_number(self) -> u8 {
        self as u8
    }

    fn from_wire_number(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::Group),
            1 => Some(Self::Decision),
            2 => Some(Self::Shield),
            _ => None,
        }
    }
}

/// The identity of a conversation of airplanes.
pub type ConversationId = network::ConversationId<Protocol>;

/// The statements of an airplane's packet about its message.
pub type PacketHeader = network::PacketHeader<Protocol>;
