//! The messages of neighbors, and their form on the network. All packets from there are checked here,
//! once, before an agent sees them.

use super::link::MessageBatch;
use serde::{Deserialize, Serialize};
use sidestep_kernel::network::{self, DropReason, PacketBuffer};
use sidestep_rods::geometry::Point;
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{MotionOutcome, RequestSource, Veto, VetoReason, is_in_range};
use std::f64::consts::PI;

/// Largest packet that is read, bytes; the largest that is ever sent is a fraction of it.
const MAX_PACKET_BYTES: usize = 1 << 16;

/// The subject of all that connectors say to each other in a cycle: a motion of their chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MotionProtocol;

impl MotionProtocol {
    // Those of other worlds are below.
    const NUMBER: u8 = 2;
}

impl network::ConversationTopic for MotionProtocol {
    fn wire_number(self) -> u8 {
        Self::NUMBER
    }

    fn from_wire_number(number: u8) -> Option<Self> {
        (number == Self::NUMBER).then_some(Self)
    }
}

/// The message of a packet: all that an agent sends to a neighbor at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Packet<const D: usize> {
    /// The nearest lost connector beyond the sender, as the receiver sees it.
    pub(super) missing: Option<u32>,
    pub(super) parcel: MessageBatch<NeighborMessage<D>>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum NeighborMessage<const D: usize> {
    /// "I am here." The packet around it names the lost connectors.
    Here,
    /// A master's "I am to go there. Can you follow?"
    Prepare(PrepareMessage<D>),
    /// A slave's "I can, and so can all beyond me that have to."
    Consent(ConsentMessage<D>),
    /// A slave's "I cannot, or one beyond me cannot."
    Object(VetoMessage),
    /// A master's "All of that motion is carried out", or none of it.
    Settle {
        /// Number of the motion.
        request: u32,
        /// Whether it is carried out.
        goes: bool,
    },
    /// A leader's question to the far end: "Where are you, and where does your rod point?"
    AskEnd,
    /// The answer: place, and direction out of the chain.
    End(WirePoint<D>, Option<WirePoint<D>>),
    /// A leader's order to the far end: "Lead a motion."
    Order(LeadOrder<D>),
    /// The answer: its outcome; none if the target is beyond all coordinates.
    Done(Option<MotionOutcome<D>>),
    /// A leader's word to all: "I have finished this cycle."
    Over,
}

/// A master's motion in a sub-step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct PrepareMessage<const D: usize> {
    /// Number of the motion in its cycle.
    pub(super) request: u32,
    /// Number of the sub-step; the one before is accepted.
    pub(super) sub_step: u32,
    /// The master before the sub-step,
    #[serde(with = "sidestep_rods::serde_point")]
    pub(super) mo: Point<D>,
    /// and after.
    #[serde(with = "sidestep_rods::serde_point")]
    pub(super) mn: Point<D>,
    /// The connector on the master's other side, if its place is settled.
    pub(super) prev: Option<WirePoint<D>>,
    /// Bend limit of the master, rad.
    pub(super) max_bend_rad: f64,
    /// Whether nothing in the world can object.
    pub(super) is_open: bool,
    /// Whether rods that turn try all their lengths.
    pub(super) all_lengths: bool,
}

/// A slave's consent to a sub-step, with sums over all connectors that react from it outward.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct ConsentMessage<const D: usize> {
    /// The slave's place after the sub-step.
    #[serde(with = "sidestep_rods::serde_point")]
    pub(super) at: Point<D>,
    /// Number of connectors that react, from the slave outward; 0 if it need not move.
    pub(super) touched: u32,
    /// Number of those that move,
    pub(super) changed: u32,
    /// and whose rods turn.
    pub(super) rotated: u32,
    /// Longest displacement of one of them, meters.
    pub(super) longest_m: f64,
}

/// An objection on its way to the initiator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct VetoMessage {
    /// The connector that objects.
    pub(super) by: u32,
    pub(super) reason: VetoReason,
    pub(super) obstacle: Option<u32>,
    /// Whether a rod before it has got past an obstacle by turning,
    pub(super) has_turned: bool,
    /// and whether one could go elsewhere if it tried all its lengths.
    pub(super) may_go_elsewhere: bool,
}

/// A motion that another connector is to lead.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct LeadOrder<const D: usize> {
    /// Number of the motion in its cycle.
    pub(super) request: u32,
    #[serde(with = "sidestep_rods::serde_point")]
    pub(super) to: Point<D>,
    pub(super) source: RequestSource,
    /// Whether there is no obstacle anywhere, and whether nothing in the world can object.
    pub(super) is_empty: bool,
    pub(super) is_open: bool,
    /// Whether to ask only, and not to move.
    pub(super) only_asks: bool,
}

impl<const D: usize> Packet<D> {
    pub(super) fn encode(&self) -> PacketBuffer {
        PacketBuffer::from_message(self)
    }

    /// Reads the message of a packet, in a chain of `n` connectors.
    ///
    /// # Errors
    /// When it is none, or one that no agent sends.
    pub(super) fn decode(message: &[u8], n: u32) -> Result<Self, DropReason> {
        if message.len() > MAX_PACKET_BYTES {
            return Err(DropReason::TooLarge);
        }
        let read = postcard::take_from_bytes::<Self>(message).ok();
        let (packet, _) = read.filter(|(_, rest)| rest.is_empty()).ok_or(DropReason::Unreadable)?;
        let is_right = packet.missing.is_none_or(|k| k < n)
            && packet.parcel.messages.iter().all(|message| message.is_valid(n));
        if is_right { Ok(packet) } else { Err(DropReason::Unsound) }
    }
}

fn is_valid_point<const D: usize>(point: Option<WirePoint<D>>) -> bool {
    point.is_none_or(|WirePoint(at)| is_in_range(&at))
}

fn is_valid_length(length_m: f64) -> bool {
    length_m.is_finite() && length_m >= 0.0
}

impl<const D: usize> NeighborMessage<D> {
    /// Returns whether its numbers make sense in a chain of `n` connectors.
    fn is_valid(&self, n: u32) -> bool {
        match self {
            Self::Here | Self::AskEnd | Self::Over | Self::Done(None) | Self::Settle { .. } => true,
            Self::Prepare(p) => {
                let is_bend = p.max_bend_rad > 0.0 && p.max_bend_rad <= PI;
                is_bend && is_in_range(&p.mo) && is_in_range(&p.mn) && is_valid_point(p.prev)
            }
            Self::Consent(c) => {
                let counts = [c.touched, c.changed, c.rotated];
                counts.iter().all(|&k| k < n) && is_in_range(&c.at) && is_valid_length(c.longest_m)
            }
            Self::Object(objection) => objection.by < n,
            Self::End(at, ahead) => is_in_range(&at.0) && is_valid_point(*ahead),
            Self::Order(order) => is_in_range(&order.to),
            Self::Done(Some(MotionOutcome::Vetoed(veto))) => is_valid_veto(veto, n),
            Self::Done(Some(MotionOutcome::Moved(moved))) => {
                let touched = &moved.touched;
                touched.start <= touched.end
                    && touched.end <= n as usize
                    && is_valid_length(moved.max_slave_step_m)
                    && moved.cut_short.as_ref().is_none_or(|veto| is_valid_veto(veto, n))
            }
        }
    }
}

fn is_valid_veto<const D: usize>(veto: &Veto<D>, n: u32) -> bool {
    veto.by.max(veto.from) < n as usize && is_in_range(&veto.reached)
}
