//! Actions that a caller orders.

use super::{Behaviour, Decision, Memory, Percept, TripEvent};
use crate::effector::{ActionId, STAY};
use sidestep_kernel::column::AtomicCell;
use sidestep_kernel::stream::Draws;

/// Follows the order that the caller gave before the cycle; stays when there is none.
///
/// Its memory holds the orders, so that they are part of a checkpoint: they stand until the robot's next
/// turn, and are gone after it. Word 0 has the action plus 1 in bits 0 to 7 (0 for no order), the mark of the
/// trip in bits 8 to 15, and in bit 16 whether there is a broadcast; words 1 and 2 are that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct External;

const TRIP_SHIFT: u32 = 8;
const HAS_BROADCAST: u32 = 1 << 16;

impl External {
    /// The order to try an action, by its number.
    pub const ACTION: &'static str = "action";
    /// The order to mark a trip: 0 none, 1 it has begun, 2 it is done.
    pub const TRIP: &'static str = "trip";
    /// The order to say a word over the radio.
    pub const BROADCAST: &'static str = "broadcast";

    /// Records an order; it takes the place of one of the same name.
    pub(crate) fn record_order(memory: &[AtomicCell<u32>; 4], order: &str, value: u64) {
        let first = memory[0].get();
        match order {
            Self::ACTION => memory[0].set(first & !0xff | (value as u32 + 1)),
            Self::TRIP => {
                memory[0].set(first & !(0xff << TRIP_SHIFT) | (value as u32) << TRIP_SHIFT)
            }
            _ => {
                memory[0].set(first | HAS_BROADCAST);
                memory[1].set(value as u32);
                memory[2].set((value >> 32) as u32);
            }
        }
    }
}

impl Behaviour for External {
    fn decide(&self, _: &Percept<'_>, memory: &mut Memory, _: &mut Draws) -> Decision {
        let [first, low, high, _] = std::mem::take(&mut memory.words);
        let action = match first & 0xff {
            0 => STAY,
            order => (order - 1) as ActionId,
        };
        let trip = match first >> TRIP_SHIFT & 0xff {
            1 => Some(TripEvent::Started),
            2 => Some(TripEvent::Completed),
            _ => None,
        };
        let word = u64::from(high) << 32 | u64::from(low);
        Decision { action, trip, broadcast: (first & HAS_BROADCAST != 0).then_some(word) }
    }

    fn is_external(&self) -> bool {
        true
    }
}
