//! Requests between robots that stand before each other: "let me pass".
//!
//! No radio is needed: as people do in a doorway, a robot is noticed by the one before it. A behavior
//! that takes part ([`Behaviour::asks`](super::Behaviour::asks)) keeps its request in one word of its
//! memory. After all have decided, the world hands it to the robot that stands in the way of a step
//! in the request's direction, at most [`MAX_REQUEST_BOXES`] away. Of several requests a robot hears the
//! one of the highest rank.

use super::Memory;

/// Index of the memory's word that holds the robot's own request in its low bits.
pub(crate) const OWN_REQUEST_WORD: usize = 2;
/// Index of the memory's word that holds the request it has heard; 0 for none.
pub(crate) const HEARD_REQUEST_WORD: usize = 3;
/// Distance in boxes up to which a request is noticed.
pub(crate) const MAX_REQUEST_BOXES: i32 = 2;
/// Bits of the word [`OWN_REQUEST_WORD`] that belong to the request; the others are up to the behavior.
pub(super) const REQUEST_BITS: u32 = 14;

/// A request to make room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PassRequest {
    /// The higher one is obeyed; at least 1.
    pub(super) rank: u8,
    /// Direction in which the asking robot wants to go: 0 east, 1 north, 2 west, 3 south.
    pub(super) toward: u8,
    /// Direction in which it wants to go on from there, if it goes on.
    pub(super) then: Option<u8>,
}

impl PassRequest {
    /// Returns the request as a word that is greater for a higher rank, and never 0.
    pub(super) fn word(self) -> u32 {
        u32::from(self.rank) << 5 | u32::from(self.then.unwrap_or(4)) << 2 | u32::from(self.toward)
    }

    fn from_word(word: u32) -> Option<Self> {
        let then = (word >> 2 & 7) as u8;
        let ask = Self {
            rank: (word >> 5) as u8,
            toward: (word & 3) as u8,
            then: (then < 4).then_some(then),
        };
        (ask.rank > 0).then_some(ask)
    }

    /// Takes the request that a robot has heard out of its memory.
    pub(super) fn take_heard(memory: &mut Memory) -> Option<Self> {
        Self::from_word(std::mem::take(&mut memory.words[HEARD_REQUEST_WORD]))
    }
}

/// Returns the direction of a robot's own request, and the word that the asked robot hears.
pub(crate) fn own_request(asking: u32) -> Option<(u8, u32)> {
    let word = asking & ((1 << REQUEST_BITS) - 1);
    PassRequest::from_word(word).map(|ask| (ask.toward, word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_survives_its_word_and_the_higher_rank_is_the_greater_word() {
        let ask = |rank, toward, then| PassRequest { rank, toward, then };
        for one in [ask(1, 3, None), ask(255, 0, Some(2))] {
            assert_eq!(PassRequest::from_word(one.word()), Some(one));
            assert_eq!(own_request(one.word() | 1 << REQUEST_BITS), Some((one.toward, one.word())));
        }
        assert!(ask(8, 0, Some(0)).word() > ask(7, 3, None).word());
        assert_eq!(own_request(0), None);
    }
}
