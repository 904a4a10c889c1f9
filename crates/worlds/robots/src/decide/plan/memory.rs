//! The memory of a planning robot, packed into two words: one of the four belongs to its list of goals, and
//! one to the requests that it hears.

use super::super::Memory;
use super::super::pass_request::{self, OWN_REQUEST_WORD, PassRequest};

/// Index of the first word; the second is shared with the robot's request.
const PLANNER_MEMORY_WORD: usize = 1;

/// Most decisions to stand still before something that a robot can count.
pub(super) const MAX_WAITED: u8 = 31;

/// Everything that a planning robot remembers between its actions, beside its progress on its list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct PlannerMemory {
    /// Its own rank among the robots that ask; 0 before it is drawn.
    pub(super) rank: u8,
    /// Actions without progress, less those with progress; up to 255.
    pub(super) stuck: u8,
    /// Column and row at its last decision, modulo 16 each, which is enough to find its last move.
    pub(super) place: u8,
    /// Direction of its last move plus 1; 0 before the first.
    pub(super) moved: u8,
    /// Direction in which it touched something.
    pub(super) bump: u8,
    /// Decisions for which the touched thing is still believed to be there; up to 7.
    pub(super) bump_left: u8,
    /// Its request as a word, 0 for none.
    pub(super) request: u32,
    /// Decisions for which it makes room, or keeps away from the room it has made; up to 1.
    pub(super) yield_left: u8,
    /// Direction in which it makes room.
    pub(super) yield_to: u8,
    /// Whether it still has to move for that.
    pub(super) yield_pending: bool,
    /// Rank of the request that it follows, in steps of 8 to save bits; its own request has that rank.
    pub(super) yield_rank: u8,
    /// Decisions to stand still before something since the last move; up to 31.
    pub(super) waited: u8,
    /// Actions left of a walk at random out of a deadlock, or of a detour; up to 15.
    pub(super) stray_left: u8,
}

impl PlannerMemory {
    /// Reads the fields in the order in which [`Self::store`] writes them.
    pub(super) fn from_memory(memory: &Memory) -> Self {
        let mut one = BitReader(memory.words[PLANNER_MEMORY_WORD]);
        let mut two = BitReader(memory.words[OWN_REQUEST_WORD]);
        Self {
            rank: one.read_u8(8),
            stuck: one.read_u8(8),
            place: one.read_u8(8),
            moved: one.read_u8(3),
            bump: one.read_u8(2),
            bump_left: one.read_u8(3),
            request: two.read_u32(pass_request::REQUEST_BITS),
            yield_left: two.read_u8(1),
            yield_to: two.read_u8(2),
            yield_pending: two.read_u8(1) == 1,
            yield_rank: two.read_u8(5),
            waited: two.read_u8(5),
            stray_left: two.read_u8(4),
        }
    }

    /// Fills both words to the last bit: a new field needs bits of another one.
    pub(super) fn store(&self, memory: &mut Memory) {
        let mut one = BitWriter::default();
        one.write_u8(self.rank, 8);
        one.write_u8(self.stuck, 8);
        one.write_u8(self.place, 8);
        one.write_u8(self.moved, 3);
        one.write_u8(self.bump, 2);
        one.write_u8(self.bump_left, 3);
        memory.words[PLANNER_MEMORY_WORD] = one.word;
        let mut two = BitWriter { word: self.request, used: pass_request::REQUEST_BITS };
        two.write_u8(self.yield_left, 1);
        two.write_u8(self.yield_to, 2);
        two.write_u8(u8::from(self.yield_pending), 1);
        two.write_u8(self.yield_rank, 5);
        two.write_u8(self.waited, 5);
        two.write_u8(self.stray_left, 4);
        memory.words[OWN_REQUEST_WORD] = two.word;
    }

    /// Returns whether it goes around something that it has waited for as long as it can. A walk at random begins without
    /// having waited.
    pub(super) fn is_on_detour(&self) -> bool {
        self.stray_left > 0 && self.waited == MAX_WAITED
    }

    /// Returns whether it does something else than to go to its goal, or believes that something is in its way.
    pub(super) fn is_occupied(&self) -> bool {
        self.yield_left > 0 || self.stray_left > 0 || self.bump_left > 0
    }

    /// Asks the body that stands in a direction to make room.
    pub(super) fn set_request(&mut self, rank: u8, toward: u8, then: Option<u8>) {
        self.request = PassRequest { rank: rank.max(1), toward, then }.word();
    }
}

/// A word that is read from its low bits.
struct BitReader(u32);

impl BitReader {
    fn read_u32(&mut self, bits: u32) -> u32 {
        let value = self.0 & ((1 << bits) - 1);
        self.0 >>= bits;
        value
    }

    fn read_u8(&mut self, bits: u32) -> u8 {
        self.read_u32(bits) as u8
    }
}

/// A word that is filled from its low bits; values that are too large count as the largest one, so that a
/// counter stops instead of starting again.
#[derive(Default)]
struct BitWriter {
    word: u32,
    used: u32,
}

impl BitWriter {
    fn write_u8(&mut self, value: u8, bits: u32) {
        self.word |= u32::from(value).min((1 << bits) - 1) << self.used;
        self.used += bits;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_memory_survives_its_words_and_large_counts_stop_at_their_largest() {
        let mut planner = PlannerMemory {
            rank: 200,
            stuck: 77,
            place: 0xa5,
            moved: 4,
            bump: 3,
            bump_left: 7,
            request: 0,
            yield_left: 1,
            yield_to: 2,
            yield_pending: true,
            yield_rank: 31,
            waited: 5,
            stray_left: 15,
        };
        planner.set_request(9, 1, Some(2));
        let mut memory = Memory::default();
        planner.store(&mut memory);
        assert_eq!(PlannerMemory::from_memory(&memory), planner);
        PlannerMemory { waited: 200, ..planner }.store(&mut memory);
        assert_eq!(PlannerMemory::from_memory(&memory), PlannerMemory { waited: 31, ..planner });
        assert_eq!(memory.words[0], 0);
    }
}
