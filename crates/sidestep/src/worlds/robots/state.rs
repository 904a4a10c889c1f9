//! All that changes in a run, in columns by slot, and its snapshot by entity id.

use super::resolve::ConflictPolicy;
use super::world::{RobotsWorld, Role};
use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Shared;
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::space::{ClaimGrid, FIXED, Position, Tag};
use sidestep_kernel::{Column, Cycle, Digest, Slot};
use std::sync::atomic::AtomicU64;

/// A box of the grid in one byte: its kind, and whether an agent has ever been there.
pub const KIND_BITS: u8 = 0x7f;
/// Set in a box's byte once a robot has covered it.
pub const VISITED: u8 = 0x80;
/// Nothing stands here.
pub const FREE: u8 = 0;
/// The static map's walls.
pub const WALL: u8 = 1;

/// Nothing intended; otherwise an action's id plus 1, with or without [`CLEAR`].
pub const IDLE: u8 = 0;
/// Added to an intent when every box that the action may sweep is free.
pub const CLEAR: u8 = 0x80;

/// The state of a robots world.
#[derive(Debug)]
pub struct RobotsState {
    /// Kind and visited bit per box of the padded grid.
    pub grid: Column<u8>,
    /// Who claims which box this cycle.
    pub claims: ClaimGrid,
    /// What changes of each body, by slot.
    pub bodies: Box<[BodyCell]>,
    /// Contacts of each body by kind touched: `slot * kinds + kind`.
    pub contacts: Column<u32>,
    /// Highest bid per box in the present round; empty unless the policy is `rounds`.
    pub bids: Box<[AtomicU64]>,
    /// Last broadcast of each robot, by parity of the cycle in which it is read; empty
    /// columns without radio.
    pub voice: [Column<u64>; 2],
    /// Poses at the start of each cycle, while a run is recorded.
    pub frames: Option<Frames>,
}

/// One body's share of the state, in one cache line.
#[derive(Debug, Default)]
#[repr(align(64))]
pub struct BodyCell {
    /// Lower-left box, a [`Position`] word.
    pub anchor: Shared<u32>,
    /// Heading (0 east, 1 north, 2 west, 3 south); of a door: 1 open, 0 closed.
    pub facing: Shared<u8>,
    /// What the body is about to do this cycle.
    pub intent: Shared<u8>,
    /// Outcome of the last action, see [`contact_word`].
    pub contact: Shared<u16>,
    /// A robot's memory.
    pub memory: [Shared<u32>; 4],
    /// Unit moves made, in boxes.
    pub moves: Shared<u32>,
    /// Boxes this robot was the first to cover.
    pub first_visits: Shared<u32>,
    /// Trips completed.
    pub trips: Shared<u32>,
    /// Cycles spent on completed trips.
    pub trip_cycles: Shared<u64>,
    /// Cycle in which the present trip began.
    pub trip_begun: Shared<u64>,
    /// The entity, constant.
    pub id: u32,
    /// Its type, constant.
    pub ty: u16,
    /// Which of its type's actions it is about to do, see `BodyType::actions`.
    pub action: Shared<u16>,
}

impl BodyCell {
    /// The lower-left box.
    #[inline(always)]
    pub fn at(&self) -> Position {
        Position::from_word(self.anchor.get())
    }
}

/// Poses of all bodies over some cycles; each body's are together.
#[derive(Debug)]
pub struct Frames {
    /// Cycle of the first pose.
    pub first: Cycle,
    /// Room for this many cycles.
    pub capacity: usize,
    /// `slot * capacity + cycle - first`, see [`pose_word`].
    pub poses: Column<u32>,
}

impl Frames {
    /// Room for `capacity` cycles of `bodies` bodies, from `first` on.
    pub fn new(first: Cycle, capacity: usize, bodies: usize) -> Self {
        Self { first, capacity, poses: Column::filled(capacity * bodies, 0) }
    }
}

/// Column, row and heading in one word: `heading << 30 | row << 15 | col`.
#[inline]
pub fn pose_word(at: Position, facing: u8) -> u32 {
    u32::from(facing) << 30 | at.row() << 15 | at.col()
}

/// Column, row and heading of a [`pose_word`].
pub fn pose_of_word(word: u32) -> (u32, u32, u8) {
    (word & 0x7fff, word >> 15 & 0x7fff, (word >> 30) as u8)
}

/// `1 << 15 | side << 8 | kind` for a contact; 0 for none.
#[inline]
pub fn contact_word(kind: u8, side: u8) -> u16 {
    1 << 15 | u16::from(side) << 8 | u16::from(kind)
}

/// One body in a snapshot.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodyRecord {
    /// Column and row of the lower-left box, in map coordinates.
    pub at: (u32, u32),
    /// See [`RobotsState::facing`].
    pub facing: u8,
    /// See [`contact_word`].
    pub contact: u16,
    /// The robot's memory.
    pub memory: [u32; 4],
    /// Last broadcast.
    pub voice: u64,
    /// moves, first visits, trips.
    pub counts: [u32; 3],
    /// Cycles of completed trips, and the cycle in which the present one began.
    pub trip: [u64; 2],
    /// Contacts by kind.
    pub contacts: Vec<u32>,
}

/// A state in the order of entity ids, independent of storage: what a checkpoint holds and
/// a digest covers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Cycles done.
    pub cycle: Cycle,
    /// The bodies by id.
    pub bodies: Vec<BodyRecord>,
    /// Visited boxes of the map, one bit each, row by row.
    pub visited: Vec<u8>,
}

impl RobotsState {
    /// An empty building: no body stands anywhere yet.
    pub(super) fn empty(world: &RobotsWorld) -> Self {
        let n = world.bodies.len();
        let radio = || Column::filled(if world.radio.is_some() { n } else { 0 }, 0u64);
        let (reach, extent) = world.extent;
        let in_rounds = world.policy == ConflictPolicy::Rounds;
        let bids = if in_rounds { world.walls.len() } else { 0 };
        let mut claims = ClaimGrid::new(world.stride, world.rows, n, reach, extent);
        world.door_boxes().for_each(|(index, door)| claims.fix(index, door));
        Self {
            grid: world.walls.iter().copied().collect(),
            claims,
            bodies: world
                .bodies
                .iter()
                .map(|b| BodyCell { id: b.id, ty: b.ty, ..BodyCell::default() })
                .collect(),
            contacts: Column::filled(n * world.kinds.len(), 0),
            bids: (0..bids).map(|_| AtomicU64::new(0)).collect(),
            voice: [radio(), radio()],
            frames: None,
        }
    }

    /// Kind that stands in the box with this index.
    #[inline(always)]
    pub fn kind_at(&self, index: u32) -> u8 {
        self.grid.get(index as usize) & KIND_BITS
    }

    /// The anchor of a body.
    #[inline(always)]
    pub fn at(&self, slot: Slot) -> Position {
        self.bodies[slot as usize].at()
    }

    /// What a body claims with.
    #[inline]
    pub fn tag(&self, world: &RobotsWorld, slot: Slot) -> Tag {
        if world.body_type(slot).actions.is_empty() {
            FIXED
        } else {
            self.claims.tag(self.at(slot))
        }
    }

    /// The state in the order of ids after `cycle` cycles.
    pub fn snapshot(&self, world: &RobotsWorld, cycle: Cycle) -> Snapshot {
        let bodies = world.slot_of_id.iter().map(|&slot| self.record(world, slot as usize, cycle));
        Snapshot { cycle, bodies: bodies.collect(), visited: self.visited(world) }
    }

    fn record(&self, world: &RobotsWorld, i: usize, cycle: Cycle) -> BodyRecord {
        let body = &self.bodies[i];
        let kinds = world.kinds.len();
        let voice = &self.voice[(cycle % 2) as usize];
        BodyRecord {
            at: world.map_position(body.at()),
            facing: body.facing.get(),
            contact: body.contact.get(),
            memory: std::array::from_fn(|k| body.memory[k].get()),
            voice: if voice.is_empty() { 0 } else { voice.get(i) },
            counts: [body.moves.get(), body.first_visits.get(), body.trips.get()],
            trip: [body.trip_cycles.get(), body.trip_begun.get()],
            contacts: (0..kinds).map(|k| self.contacts.get(i * kinds + k)).collect(),
        }
    }

    fn visited(&self, world: &RobotsWorld) -> Vec<u8> {
        let mut bits = vec![0u8; world.map_boxes().div_ceil(8)];
        for (k, index) in world.map_indices().enumerate() {
            if self.grid.get(index) & VISITED != 0 {
                bits[k / 8] |= 1 << (k % 8);
            }
        }
        bits
    }

    /// The state that a snapshot describes.
    pub(super) fn restore(world: &RobotsWorld, snapshot: &Snapshot) -> Self {
        let state = Self::empty(world);
        for (k, index) in world.map_indices().enumerate() {
            if snapshot.visited[k / 8] >> (k % 8) & 1 == 1 {
                state.grid.set(index, state.grid.get(index) | VISITED);
            }
        }
        for (record, &slot) in snapshot.bodies.iter().zip(&world.slot_of_id) {
            state.put(world, slot as usize, record);
        }
        state
    }

    fn put(&self, world: &RobotsWorld, i: usize, record: &BodyRecord) {
        let body = &self.bodies[i];
        body.facing.set(record.facing);
        body.contact.set(record.contact);
        (0..4).for_each(|k| body.memory[k].set(record.memory[k]));
        self.voice.iter().filter(|v| !v.is_empty()).for_each(|v| v.set(i, record.voice));
        let [moves, first_visits, trips] = record.counts;
        body.moves.set(moves);
        body.first_visits.set(first_visits);
        body.trips.set(trips);
        body.trip_cycles.set(record.trip[0]);
        body.trip_begun.set(record.trip[1]);
        let kinds = world.kinds.len();
        record.contacts.iter().enumerate().for_each(|(k, &c)| self.contacts.set(i * kinds + k, c));
        body.anchor.set(world.grid_position(record.at).word());
        let is_open_door =
            matches!(world.body_type(i as Slot).role, Role::Door(_)) && record.facing == 1;
        if !is_open_door {
            self.occupy(world, i as Slot);
        }
    }

    /// Writes a body's kind and tag into the boxes it covers.
    pub(super) fn occupy(&self, world: &RobotsWorld, slot: Slot) {
        let body = world.body_type(slot);
        let at = self.at(slot);
        let index = at.index(world.stride);
        let tag = self.tag(world, slot);
        for &offset in &body.own {
            let at = index.wrapping_add_signed(offset);
            self.grid
                .set(at as usize, self.grid.get(at as usize) & VISITED | body.kind | body.marks);
            self.claims.claim(at, tag);
        }
    }

    /// Bytes on the heap that grow with the boxes, and with the bodies.
    pub fn heap_bytes(&self) -> (usize, usize) {
        let (claims_boxes, claims_bodies) = self.claims.heap_bytes();
        let bodies = std::mem::size_of_val(&*self.bodies)
            + self.contacts.heap_bytes()
            + self.voice.iter().map(Column::heap_bytes).sum::<usize>();
        let boxes = self.grid.heap_bytes() + size_of_val(&*self.bids) + claims_boxes;
        (boxes, bodies + claims_bodies)
    }
}

impl Snapshot {
    /// The digest of this state (promise D1): every value, by id, little-endian.
    pub fn digest(&self) -> Digest {
        let mut hasher = Hasher::default();
        hasher.u64(self.cycle);
        hasher.u64(self.bodies.len() as u64);
        for body in &self.bodies {
            hasher.u32(body.at.0);
            hasher.u32(body.at.1);
            hasher.u8(body.facing);
            hasher.u32(u32::from(body.contact));
            body.trip.iter().chain([&body.voice]).for_each(|&w| hasher.u64(w));
            let words = body.memory.iter().chain(&body.counts).chain(&body.contacts);
            words.for_each(|&w| hasher.u32(w));
        }
        hasher.bytes(&self.visited);
        hasher.finish()
    }
}
