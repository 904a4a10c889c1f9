//! Who claims which box of a grid, without a lock and with one byte per box.
//!
//! Every body writes its *tag* into each box it claims, an ordinary store; where two bodies
//! claim a box the last writer stays. After a barrier every body reads its boxes again: a
//! foreign tag means a conflict with the body that the tag names. All claimants of a box
//! thus meet in its last writer, whoever that was, so the connected components are the same
//! for every order of stores.
//!
//! A tag is the body's anchor, its column modulo 15 and its row modulo 16 (or 255 and 256).
//! Two bodies that can claim the same box stand nearer than that, so their tags differ, and
//! box and tag together name the anchor. A list per patch of 8 x 8 boxes then names the body.
//! Bodies that never move but may be walked over, such as open doors, share the tag
//! [`FIXED`], since a box belongs to one of them at most.

use super::position::Position;
use crate::column::{Column, Word};
use crate::units::Slot;
use crate::world::Turn;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Names a body among those that can claim one box.
pub type Tag = u16;

/// The tag of bodies that never move, see [`ClaimGrid::fix`].
pub const FIXED: Tag = Tag::MAX;

/// A tag as it is stored.
pub trait StoredTag: Word + PartialEq {
    /// The tag, cut to what is stored; nothing is lost.
    fn of(tag: Tag) -> Self;
    /// The tag.
    fn tag(self) -> Tag;
}

impl StoredTag for u8 {
    #[inline(always)]
    fn of(tag: Tag) -> Self {
        tag as Self
    }
    #[inline(always)]
    fn tag(self) -> Tag {
        if self == Self::MAX { FIXED } else { Tag::from(self) }
    }
}

impl StoredTag for u16 {
    #[inline(always)]
    fn of(tag: Tag) -> Self {
        tag
    }
    #[inline(always)]
    fn tag(self) -> Tag {
        self
    }
}

/// Side of a patch of boxes that share a list of bodies, as a power of two.
const PATCH_BITS: u32 = 3;
const NO_BODY: u32 = u32::MAX;

/// The tags of all boxes; match once, then work on one of the columns.
#[derive(Debug, Clone)]
pub enum Tags {
    /// Anchors modulo 15 and 16.
    Narrow(Column<u8>),
    /// Anchors modulo 255 and 256, for bodies that reach farther.
    Wide(Column<u16>),
}

/// The claims on a grid of `width` x `height` boxes, indexed row by row.
#[derive(Debug)]
pub struct ClaimGrid {
    width: u32,
    reach: u32,
    tags: Tags,
    patches_per_row: u32,
    /// Boxes of fixed bodies.
    fixed: BTreeMap<u32, Slot>,
    /// Per patch: cycle (upper half) and last registered body (lower half).
    first: Vec<AtomicU64>,
    /// Per body: its anchor (upper half), and the body registered in the same patch before it.
    entries: Column<u64>,
}

impl ClaimGrid {
    /// The largest `extent` of [`ClaimGrid::new`].
    pub const MAX_EXTENT: u32 = 255;

    /// An unclaimed grid for `bodies` bodies.
    ///
    /// `reach` is how many boxes before its anchor (towards west or south) a body may claim;
    /// `extent` is the farthest that two bodies' anchors can be apart that may claim one box,
    /// plus 1, in either direction.
    ///
    /// # Panics
    /// When `extent` exceeds [`ClaimGrid::MAX_EXTENT`]; callers refuse such bodies first.
    pub fn new(width: u32, height: u32, bodies: usize, reach: u32, extent: u32) -> Self {
        assert!(extent <= Self::MAX_EXTENT, "bodies reach too far for tags");
        let boxes = width as usize * height as usize;
        let tags = if extent <= 15 {
            Tags::Narrow(Column::filled(boxes, 0))
        } else {
            Tags::Wide(Column::filled(boxes, 0))
        };
        let patches_per_row = (width >> PATCH_BITS) + 1;
        let patches = patches_per_row as usize * ((height >> PATCH_BITS) + 1) as usize;
        let first = (0..patches).map(|_| AtomicU64::new(u64::MAX)).collect();
        let entries = Column::filled(bodies, u64::from(NO_BODY));
        let fixed = BTreeMap::new();
        Self { width, reach, tags, patches_per_row, fixed, first, entries }
    }

    /// The tag of a body anchored at box `anchor`.
    #[inline]
    pub fn tag(&self, anchor: Position) -> Tag {
        let (cols, rows) = match self.tags {
            Tags::Narrow(_) => (anchor.col() % 15, anchor.row() % 16 * 16),
            Tags::Wide(_) => (anchor.col() % 255, anchor.row() % 256 * 256),
        };
        (rows + cols) as Tag
    }

    /// Makes `body` the one that box `at` belongs to when its tag is [`FIXED`].
    pub fn fix(&mut self, at: u32, body: Slot) {
        self.fixed.insert(at, body);
    }

    /// The tags of all boxes.
    #[inline(always)]
    pub fn tags(&self) -> &Tags {
        &self.tags
    }

    /// Writes `tag` into the box with this index.
    #[inline]
    pub fn claim(&self, at: u32, tag: Tag) {
        match &self.tags {
            Tags::Narrow(tags) => tags.set(at as usize, u8::of(tag)),
            Tags::Wide(tags) => tags.set(at as usize, tag),
        }
    }

    /// The tag in the box with this index.
    #[inline]
    pub fn claimant(&self, at: u32) -> Tag {
        match &self.tags {
            Tags::Narrow(tags) => tags.get(at as usize).tag(),
            Tags::Wide(tags) => tags.get(at as usize),
        }
    }

    /// Lists a body under its anchor for this cycle. Every body must, once a cycle.
    #[inline]
    pub fn register(&self, body: Slot, anchor: Position, turn: Turn) {
        let stamp = u64::from(turn.now as u32) << 32;
        let (first, entry) = (&self.first[self.patch(anchor)], stamp | u64::from(body));
        let before = if turn.alone {
            // Nobody else writes: the exchange need not be atomic, which is many times faster.
            let before = first.load(Relaxed);
            first.store(entry, Relaxed);
            before
        } else {
            first.swap(entry, Relaxed)
        };
        let next = if before >> 32 == stamp >> 32 { before as u32 } else { NO_BODY };
        self.entries.set(body as usize, u64::from(anchor.word()) << 32 | u64::from(next));
    }

    /// The body registered under an anchor.
    ///
    /// # Panics
    /// When no body was registered there in this cycle, which is a bug: a tag always names
    /// a registered body.
    pub fn body(&self, anchor: Position) -> Slot {
        let mut body = self.first[self.patch(anchor)].load(Relaxed) as u32;
        loop {
            let entry = self.entries.get(body as usize);
            if (entry >> 32) as u32 == anchor.word() {
                return body;
            }
            body = entry as u32;
            assert!(body != NO_BODY, "a tag names a registered body");
        }
    }

    /// The fixed body that box `at` belongs to.
    ///
    /// # Panics
    /// When there is none, which is a bug.
    pub fn fixed_body(&self, at: u32) -> Slot {
        *self.fixed.get(&at).expect("only boxes of fixed bodies have their tag")
    }

    /// The only anchor from which `tag` can have come into box `at`.
    pub fn anchor(&self, at: u32, tag: Tag) -> Position {
        let at = Position::from_index(at, self.width);
        let (cols, rows) = match self.tags {
            Tags::Narrow(_) => (15, 16),
            Tags::Wide(_) => (255, 256),
        };
        let nearest = |at: u32, residue: u32, modulus: u32| {
            let last = at + self.reach;
            last - (last + modulus - residue) % modulus
        };
        let tag = u32::from(tag);
        Position::new(nearest(at.col(), tag % rows, cols), nearest(at.row(), tag / rows, rows))
    }

    #[inline]
    fn patch(&self, anchor: Position) -> usize {
        let (col, row) = (anchor.col(), anchor.row());
        ((row >> PATCH_BITS) * self.patches_per_row + (col >> PATCH_BITS)) as usize
    }

    /// Bytes on the heap that grow with the boxes, and with the bodies.
    pub fn heap_bytes(&self) -> (usize, usize) {
        let tags = match &self.tags {
            Tags::Narrow(tags) => tags.heap_bytes(),
            Tags::Wide(tags) => tags.heap_bytes(),
        };
        (tags + self.first.len() * 8, self.entries.heap_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

        /// Bodies of extent up to `reach + size + reach` in random places: every claimed box
        /// names one of its claimants, whatever the order of the stores.
        #[test]
        fn a_tag_names_the_body_that_wrote_it(
            anchors in prop::collection::btree_set((4u32..45, 4u32..45), 1..60),
            wide in any::<bool>(),
        ) {
            let anchors: Vec<Position> = anchors.iter().map(|&(c, r)| Position::new(c, r)).collect();
            let (reach, after) = if wide { (4, 16) } else { (2, 12) };
            let grid = ClaimGrid::new(80, 80, anchors.len(), reach, reach + after + 1);
            let anchor_of = |slot: Slot| anchors[slot as usize];
            let claims = |slot: Slot| {
                let a = anchor_of(slot);
                let side = 0..=(reach + after);
                side.clone().flat_map(move |dy| side.clone().map(move |dx| {
                    Position::new(a.col() - reach + dx, a.row() - reach + dy).index(80)
                })).collect::<Vec<_>>()
            };
            for now in 7..9 {
                let slots = || 0..anchors.len() as Slot;
                slots().for_each(|s| grid.register(s, anchor_of(s), Turn { now, alone: now == 7 }));
                slots().for_each(|s| claims(s).iter().for_each(|&b| grid.claim(b, grid.tag(anchor_of(s)))));
                for slot in slots() {
                    for at in claims(slot) {
                        let named = grid.body(grid.anchor(at, grid.claimant(at)));
                        prop_assert!(claims(named).contains(&at));
                    }
                }
            }
        }
    }
}
