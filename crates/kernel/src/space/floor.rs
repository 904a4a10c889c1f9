//! The occupants and claimants of the boxes of a grid: one word per box, and no lock.
//!
//! A box is free, a wall, or has a body standing in it. Bodies that may move into a free box write
//! a *claim* into it, an ordinary store; where several do, the last write stays. For perception a
//! claimed box is a free one. After a barrier every body reads its boxes again: the number of any
//! other body, whether it stands there or claims the box, means a conflict with that body. All
//! claimants of a box thus meet in its last writer, whichever that was, so the connected components
//! are the same for every order of stores.
//!
//! Claims are not withdrawn, because a claim of an earlier cycle is only ever read by a body that
//! has written its own over it.

use crate::column::{AtomicColumn, AtomicValue};
use crate::units::EntitySlot;
use std::ops::BitAnd;

/// The content of a box in one word. The highest bit means that nothing stands there, so the
/// bitwise conjunction of several boxes is free when all are.
pub trait OccupantWord: AtomicValue + Eq + BitAnd<Output = Self> {
    /// Nothing stands here, and no body claims it.
    const FREE: Self;
    /// A wall stands here.
    const WALL: Self;
    /// The number of bodies that can be distinguished.
    const MAX_BODIES: usize;
    /// The body in `slot` stands here.
    fn from_body(slot: EntitySlot) -> Self;
    /// Nothing stands here; the body in `slot` claims it.
    fn from_claim(slot: EntitySlot) -> Self;
    /// Returns whether nothing stands here.
    fn is_free(self) -> bool;
    /// The slot of the body that stands here or claims it; an invalid slot for a wall or an
    /// unclaimed box.
    fn slot(self) -> EntitySlot;
}

macro_rules! box_word {
    ($t:ty) => {
        impl OccupantWord for $t {
            const FREE: Self = <$t>::MAX;
            const WALL: Self = <$t>::MAX >> 1;
            const MAX_BODIES: usize = (<$t>::MAX >> 1) as usize;
            #[inline(always)]
            fn from_body(slot: EntitySlot) -> Self {
                slot as Self
            }
            #[inline(always)]
            fn from_claim(slot: EntitySlot) -> Self {
                slot as Self | !(Self::MAX >> 1)
            }
            #[inline(always)]
            fn is_free(self) -> bool {
                self > Self::MAX >> 1
            }
            #[inline(always)]
            fn slot(self) -> EntitySlot {
                EntitySlot::from(self & Self::MAX >> 1)
            }
        }
    };
}
box_word! { u16 }
box_word! { u32 }

/// The boxes of a grid, row by row; match once, then work on one of the columns.
#[derive(Debug, Clone)]
pub enum OccupantGrid {
    /// Indices of up to 32,767 bodies.
    Narrow(AtomicColumn<u16>),
    /// Indices of more bodies.
    Wide(AtomicColumn<u32>),
}

/// The occupant of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Occupant {
    /// Nothing stands there; a claim does not count.
    Empty,
    /// A wall, which stays for the whole run.
    Wall,
    /// The body in this slot.
    Body(EntitySlot),
}

impl OccupantGrid {
    /// Creates a floor for `bodies` bodies, none of which stands on it yet; `walls` has one entry
    /// per box.
    pub fn new(walls: impl Iterator<Item = bool>, bodies: usize) -> Self {
        fn column<T: OccupantWord>(walls: impl Iterator<Item = bool>) -> AtomicColumn<T> {
            walls.map(|wall| if wall { T::WALL } else { T::FREE }).collect()
        }
        // Half the memory where the slots fit: the boxes around a body then lie in fewer cache lines.
        if bodies <= u16::MAX_BODIES {
            Self::Narrow(column(walls))
        } else {
            Self::Wide(column(walls))
        }
    }

    /// Returns what stands in the box with this index, row by row from the first; claims do not count.
    pub fn occupant(&self, index: usize) -> Occupant {
        fn occupant<T: OccupantWord>(word: T) -> Occupant {
            match word {
                _ if word.is_free() => Occupant::Empty,
                _ if word == T::WALL => Occupant::Wall,
                _ => Occupant::Body(word.slot()),
            }
        }
        match self {
            Self::Narrow(boxes) => occupant(boxes.get(index)),
            Self::Wide(boxes) => occupant(boxes.get(index)),
        }
    }

    /// Places the body in `slot` on the box with this index.
    pub fn place(&self, index: usize, slot: EntitySlot) {
        match self {
            Self::Narrow(boxes) => boxes.set(index, OccupantWord::from_body(slot)),
            Self::Wide(boxes) => boxes.set(index, OccupantWord::from_body(slot)),
        }
    }

    /// Bytes on the heap: 2 or 4 per box, by the variant.
    pub fn heap_bytes(&self) -> usize {
        match self {
            Self::Narrow(boxes) => boxes.heap_bytes(),
            Self::Wide(boxes) => boxes.heap_bytes(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn words_tell_all_states_apart<T: OccupantWord + std::fmt::Debug>(slot: EntitySlot) {
        let (standing, claimed) = (T::from_body(slot), T::from_claim(slot));
        assert!(!standing.is_free() && !T::WALL.is_free());
        assert!(claimed.is_free() && T::FREE.is_free());
        assert_eq!((standing.slot(), claimed.slot()), (slot, slot));
        assert!(standing != T::WALL && claimed != T::FREE);
        assert!((T::FREE & claimed).is_free());
        assert!(!(T::FREE & standing & claimed).is_free());
    }

    proptest! {
        #[test]
        fn a_box_is_free_claimed_walled_or_stood_in(slot in 0..(u16::MAX_BODIES as EntitySlot)) {
            words_tell_all_states_apart::<u16>(slot);
            words_tell_all_states_apart::<u32>(slot);
            words_tell_all_states_apart::<u32>(slot << 15);
        }
    }

    #[test]
    fn a_floor_shows_who_stands_on_it_whatever_its_width() {
        for bodies in [2, u16::MAX_BODIES, u16::MAX_BODIES + 1] {
            let floor = OccupantGrid::new([false, true, false].into_iter(), bodies);
            let last = bodies as EntitySlot - 1;
            floor.place(2, last);
            let seen = [0, 1, 2].map(|index| floor.occupant(index));
            assert_eq!(seen, [Occupant::Empty, Occupant::Wall, Occupant::Body(last)]);
        }
    }
}
