//! Requests between robots that stand before each other: "let me pass".
//!
//! No radio is needed: as people do in a doorway, a robot is noticed by the one before it. A behavior
//! that takes part ([`Behaviour::has_requests`](super::Behaviour::has_requests)) keeps its request in one
//! word of its memory. After all have decided, the world hands it to the robot that stands in the way of a
//! step in the request's direction, at most [`MAX_REQUEST_BOXES`] away. Of several requests a robot hears
//! the one of the highest rank.

use super::Memory;

/// Index of the memory's word that holds the robot's own request in its low bits.
pub(crate) const OWN_REQUEST_WORD: usize = 2;
/// Index of the memory's word that holds the request it has heard; 0 for none.
pub(crate) const HEARD_REQUEST_WORD: usize = 3;
/// Distance in boxes up to which a request is noticed: the next step and the one after it, because the robot
/// that is asked needs a decision to make room.
pub(crate) const MAX_REQUEST_BOXES: i32 = 2;
/// Bits of the word [`OWN_REQUEST_WORD`] that belong to the request: 2 of the direction, 3 of the one after
/// it, 8 of the rank, and a spare one; the others are up to the behavior.
pub(super) const REQUEST_BITS: u32 = 14;

/// Stands in the word for no direction after the first.
const NO_DIRECTION: u8 = 4;

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
    /// Returns the request as a word that is greater for a higher rank, so that a robot that several ask
    /// keeps the greatest word; never 0.
    pub(super) fn word(self) -> u32 {
        let then = self.then.unwrap_or(NO_DIRECTION);
        u32::from(self.rank) << 5 | u32::from(then) << 2 | u32::from(self.toward)
    }

    fn from_word(word: u32) -> Option<Self> {
        let then = (word >> 2 & 7) as u8;
        let request = Self {
            rank: (word >> 5) as u8,
            toward: (word & 3) as u8,
            then: (then < NO_DIRECTION).then_some(then),
        };
        (request.rank > 0).then_some(request)
    }

    /// Takes the request that a robot has heard out of its memory.
    pub(super) fn take_heard(memory: &mut Memory) -> Option<Self> {
        Self::from_word(std::mem::take(&mut memory.words[HEARD_REQUEST_WORD]))
    }
}

/// Returns the direction of a robot's own request, and the word that the asked robot hears.
pub(crate) fn own_request(memory_word: u32) -> Option<(u8, u32)> {
    let word = memory_word & ((1 << REQUEST_BITS) - 1);
    PassRequest::from_word(word).map(|request| (request.toward, word))
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
