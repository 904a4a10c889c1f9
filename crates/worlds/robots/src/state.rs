//! The state of a run, in columns by slot, and its snapshot by entity id.

mod packed;

use super::action_progress::ProgressColumns;
use super::broadcast::BroadcastBuffer;
use super::delay::DelayColumns;
use super::policy::ConflictPolicy;
use super::progress::Progress;
use super::sensor::{FREE, WALL};
use super::submitted_controls::SubmittedControls;
use super::team::TeamState;
use super::world::{Body, BodyType, RobotsWorld};
pub use packed::{Facing, LastContact};
pub(crate) use packed::{Intent, PackedPose};
use serde::{Deserialize, Serialize};
use sidestep_kernel::column::{AtomicCell, Packed};
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::space::{AtomicBitSet, GridPosition, OccupantGrid, OccupantWord};
use sidestep_kernel::{AtomicColumn, Cycle, Digest, EntityId, EntitySlot};
use std::sync::atomic::AtomicU64;

/// Rows of the map that are stored together, see [`RobotsState::arrange`]. One row would leave neighbors above
/// and below far apart in memory, many rows those to the side.
const ROWS_PER_BAND: u32 = 8;

/// Everything that changes during a run. Workers share it, so most of it is atomic.
#[derive(Debug)]
pub struct RobotsState {
    /// The body that stands in, or claims, each box of the padded grid.
    pub(crate) floor: OccupantGrid,
    /// Boxes that a robot has ever covered.
    pub(crate) visited: AtomicBitSet,
    /// The changing part of each body, by slot.
    pub bodies: Box<[BodyState]>,
    /// Kind of each body, by slot; apart from `bodies`, because beams read it of many bodies and nothing else.
    pub(crate) kinds: Box<[u8]>,
    /// Slot of each entity, by id; [`Self::arrange`] rewrites it.
    pub(crate) slot_of_id: Box<[EntitySlot]>,
    /// Number of contacts of each body by kind touched, at `id * kinds + kind`; apart from `bodies`, because
    /// contacts are rare and the number of kinds is the scenario's.
    pub(crate) contacts: AtomicColumn<u32>,
    /// Highest bid per box in the present round; empty unless the policy is `rounds`.
    pub(crate) bids: Box<[AtomicU64]>,
    /// Place of each body in the order of its group's draws, by slot; empty unless the policy is `simultaneous`, and
    /// only within a cycle.
    pub(crate) turns: AtomicColumn<u32>,
    /// The body that has entered each box in this cycle, as its slot plus 1, or 0; as `turns`.
    pub(crate) entered_by: AtomicColumn<u32>,
    /// Delays of each robot; empty where no robot has any.
    pub(crate) delays: DelayColumns,
    /// Actions that take several cycles; empty without any.
    pub(crate) action_progress: ProgressColumns,
    /// The planners of teams.
    pub(crate) planner_teams: Box<[TeamState]>,
    /// Last broadcast of each robot; empty without radio.
    pub(crate) voices: BroadcastBuffer,
    /// The controls of robots that have decided outside of the run. They are those of one cycle, so no snapshot has them.
    pub(crate) submitted: SubmittedControls,
    /// Poses at the start of each cycle, while a run is recorded.
    pub(crate) frames: Option<PoseBuffer>,
    /// Which robots come nearer to their goals; no cycle reads it.
    pub progress: Progress,
    /// Turns of each robot with a goal in which it neither moved nor turned, by id; empty where no robot has goals.
    pub(crate) waits: AtomicColumn<u32>,
}

/// One body's share of the state, in one cache line, because a body mostly reads and writes its own and the
/// next slot may be another worker's.
#[derive(Debug, Clone, Default)]
#[repr(align(64))]
pub struct BodyState {
    /// Lower-left box, as a [`GridPosition`] word.
    pub(crate) anchor: AtomicCell<u32>,
    /// Heading; of a door, whether it is open.
    pub facing: AtomicCell<Facing>,
    /// The action that the body is about to do in this cycle.
    pub(crate) intent: AtomicCell<Intent>,
    /// The obstacle that stopped the last action.
    pub contact: AtomicCell<LastContact>,
    /// A robot's memory; its behavior gives the words their meaning.
    pub memory: [AtomicCell<u32>; 4],
    /// Cycles from one action to the next; constant, and here so that a cycle need not read the world for it.
    pub period: u32,
    /// Unit moves made, in boxes.
    pub moves: AtomicCell<u32>,
    /// Number of boxes that this robot was the first to cover.
    pub first_visits: AtomicCell<u32>,
    /// Number of trips completed.
    pub trips: AtomicCell<u32>,
    /// Cycles spent on completed trips.
    pub trip_cycles: AtomicCell<u64>,
    /// Cycle in which the present trip started.
    pub trip_begun: AtomicCell<u64>,
    /// Entity id; constant.
    pub id: u32,
    /// Index of its type; constant.
    pub ty: u16,
    /// Index of the action that it is about to do, see `BodyType::actions`.
    pub(crate) action: AtomicCell<u16>,
}

impl BodyState {
    fn from_body(body: &Body) -> Self {
        let &Body { id, ty, period, .. } = body;
        Self { id, ty, period, ..Self::default() }
    }

    /// Returns the position of the lower-left box.
    #[inline(always)]
    pub fn position(&self) -> GridPosition {
        GridPosition::from_word(self.anchor.get())
    }
}

/// Poses of all bodies over some cycles; those of one cycle are stored together.
#[derive(Debug)]
pub(crate) struct PoseBuffer {
    /// Cycle of the first pose; moves on whenever poses are recorded.
    pub(crate) first: Cycle,
    /// Number of cycles for which there is room.
    pub(crate) capacity: usize,
    /// Number of poses per cycle, one for each body.
    pub(crate) bodies: usize,
    /// Poses at `(cycle - first) * bodies + id`.
    pub(crate) poses: AtomicColumn<PackedPose>,
}

impl PoseBuffer {
    /// Returns room for `capacity` cycles of `bodies` bodies, starting with cycle `first`.
    pub(crate) fn new(first: Cycle, capacity: usize, bodies: usize) -> Self {
        let poses = AtomicColumn::filled(capacity * bodies, PackedPose::default());
        Self { first, capacity, bodies, poses }
    }
}

/// One body in a snapshot.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodyRecord {
    /// Column and row of the lower-left box, in map coordinates.
    pub at: (u32, u32),
    /// See [`BodyState::facing`].
    pub facing: Facing,
    /// See [`BodyState::contact`].
    pub contact: LastContact,
    /// The robot's memory; all 0 for other bodies.
    pub memory: [u32; 4],
    /// Last broadcast, if there was one.
    pub voice: Option<u64>,
    /// Number of moves, first visits and trips.
    pub counts: [u32; 3],
    /// Cycles spent on completed trips, and the cycle in which the present one started.
    pub trip: [u64; 2],
    /// Contacts by the number of the kind touched; where some robots have delays, then four words of the body's delays:
    /// the cycles left, those since the last action, those in all, and the turns missed. They stand here so that
    /// checkpoints of worlds without delays do not depend on them. For the same reason, where some actions take several
    /// cycles, five words of the body's action follow: the cycles left, the anchor before it, its walk, the steps made,
    /// and the cycles in which actions went on in all. Of a robot that a planner leads, the
    /// words of its task come then, and last those that the planner remembers of it.
    pub contacts: Vec<u32>,
}

/// A state in the order of entity ids, independent of storage: the content of a checkpoint, and the
/// input of a digest.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Number of cycles done.
    pub cycle: Cycle,
    /// The bodies by id.
    pub bodies: Vec<BodyRecord>,
    /// Visited boxes of the map, one bit each, row by row.
    pub visited: Vec<u8>,
    /// Which robots come nearer to their goals. It follows from the states before, so the digest of bodies leaves it out.
    pub progress: Progress,
    /// Turns of each robot in which it waited, by id; as `progress`.
    pub waits: Vec<u32>,
}

impl RobotsState {
    /// Returns an empty building, in which no body stands yet.
    pub(super) fn empty(world: &RobotsWorld) -> Self {
        let n = world.bodies.len();
        let ids = world.storage.ids(world);
        let mut slot_of_id: Box<[EntitySlot]> = vec![0; n].into();
        (0..).zip(&ids).for_each(|(slot, &id)| slot_of_id[id as usize] = slot);
        let in_rounds = world.policy == ConflictPolicy::Rounds;
        let bids = if in_rounds { world.walls.len() } else { 0 };
        let is_at_once = world.policy == ConflictPolicy::Simultaneous;
        let columns = |len| AtomicColumn::filled(if is_at_once { len } else { 0 }, 0);
        Self {
            floor: OccupantGrid::new(world.walls.iter().map(|&kind| kind == WALL), n),
            visited: AtomicBitSet::empty(world.walls.len()),
            kinds: ids.iter().map(|&id| world.type_of(id).kind).collect(),
            bodies: ids
                .iter()
                .map(|&id| BodyState::from_body(&world.bodies[id as usize]))
                .collect(),
            slot_of_id,
            contacts: AtomicColumn::filled(n * world.kinds.len(), 0),
            bids: (0..bids).map(|_| AtomicU64::new(0)).collect(),
            turns: columns(n),
            entered_by: columns(world.walls.len()),
            delays: DelayColumns::new(if world.has_delays { n } else { 0 }),
            action_progress: ProgressColumns::new(if world.has_long_actions { n } else { 0 }),
            planner_teams: world.new_team_states(),
            voices: BroadcastBuffer::new(if world.radio.is_some() { n } else { 0 }),
            submitted: SubmittedControls::default(),
            frames: None,
            progress: Progress::default(),
            waits: AtomicColumn::filled(world.waits_len(), 0),
        }
    }

    /// Returns a copy on which a cycle can be tried. It leaves out visited boxes and poses, which nothing in a
    /// cycle reads.
    pub(super) fn trial_copy(&self, world: &RobotsWorld) -> Self {
        Self {
            floor: self.floor.clone(),
            visited: AtomicBitSet::empty(world.walls.len()),
            bodies: self.bodies.clone(),
            kinds: self.kinds.clone(),
            slot_of_id: self.slot_of_id.clone(),
            contacts: self.contacts.clone(),
            bids: Box::default(),
            turns: self.turns.clone(),
            entered_by: self.entered_by.clone(),
            delays: self.delays.clone(),
            action_progress: self.action_progress.clone(),
            planner_teams: self.planner_teams.iter().map(TeamState::trial_copy).collect(),
            voices: self.voices.clone(),
            submitted: self.submitted.clone(),
            frames: None,
            progress: Progress::default(),
            waits: self.waits.clone(),
        }
    }

    /// Returns the kind of the occupant that a word of the floor stands for.
    #[inline(always)]
    pub(crate) fn kind_of<T: OccupantWord>(&self, word: T) -> u8 {
        match word {
            _ if word.is_free() => FREE,
            _ if word == T::WALL => WALL,
            _ => self.kinds[word.slot() as usize],
        }
    }

    /// Returns the changing part of the body with this id.
    pub fn body(&self, id: EntityId) -> &BodyState {
        &self.bodies[self.slot_of_id[id as usize] as usize]
    }

    /// Returns the anchor of the body in a slot.
    #[inline(always)]
    pub fn position(&self, slot: EntitySlot) -> GridPosition {
        self.bodies[slot as usize].position()
    }

    /// As [`RobotsWorld::type_of`], for a slot instead of an id.
    #[inline]
    pub(crate) fn body_type<'a>(&self, world: &'a RobotsWorld, slot: EntitySlot) -> &'a BodyType {
        &world.types[usize::from(self.bodies[slot as usize].ty)]
    }

    /// Stores bodies that are near on the map near in memory, because bodies mostly read the boxes
    /// around them: in bands of rows, each from west to east.
    pub(super) fn arrange(&mut self, world: &RobotsWorld) {
        // What it leaves has another slot's number after this.
        self.release_boxes(world);
        self.bodies.sort_unstable_by_key(|body| {
            let band = body.position().row() / ROWS_PER_BAND;
            (band, body.position().col(), body.id)
        });
        for slot in 0..self.bodies.len() {
            let body = &self.bodies[slot];
            self.kinds[slot] = world.types[usize::from(body.ty)].kind;
            self.slot_of_id[body.id as usize] = slot as EntitySlot;
            if !self.is_open_door(world, slot as EntitySlot) {
                self.occupy(world, slot as EntitySlot);
            }
        }
    }

    /// An open door covers no box, unlike every other body.
    pub(super) fn is_open_door(&self, world: &RobotsWorld, slot: EntitySlot) -> bool {
        let body = &self.bodies[slot as usize];
        world.is_door(body.id) && body.facing.get().is_open()
    }

    /// Returns the state in the order of ids after `cycle` cycles.
    pub fn snapshot(&self, world: &RobotsWorld, cycle: Cycle) -> Snapshot {
        let bodies = self.slot_of_id.iter().map(|&slot| self.body_record(world, slot, cycle));
        Snapshot {
            cycle,
            bodies: bodies.collect(),
            visited: self.visited_bits(world),
            progress: self.progress.clone(),
            waits: self.waits.iter().collect(),
        }
    }

    fn body_record(&self, world: &RobotsWorld, slot: EntitySlot, cycle: Cycle) -> BodyRecord {
        let body = &self.bodies[slot as usize];
        let kinds = world.kinds.len();
        let first_contact = body.id as usize * kinds;
        BodyRecord {
            at: world.map_position(body.position()),
            facing: body.facing.get(),
            contact: body.contact.get(),
            memory: std::array::from_fn(|k| body.memory[k].get()),
            voice: self.voices.last_broadcast(body.id, cycle),
            counts: [body.moves.get(), body.first_visits.get(), body.trips.get()],
            trip: [body.trip_cycles.get(), body.trip_begun.get()],
            contacts: (0..kinds)
                .map(|kind| self.contacts.get(first_contact + kind))
                .chain(self.delays.words(body.id))
                .chain(self.action_progress.words(body.id))
                .chain(self.task_words(world, body.id))
                .chain(self.plan_words(world, body.id))
                .collect(),
        }
    }

    fn visited_bits(&self, world: &RobotsWorld) -> Vec<u8> {
        let mut bits = vec![0u8; world.map_boxes().div_ceil(8)];
        for (k, index) in world.map_indices().enumerate() {
            if self.visited.contains(index) {
                bits[k / 8] |= 1 << (k % 8);
            }
        }
        bits
    }

    /// Floor and slots are made anew; `snapshot` must be of the same bodies on the same map.
    pub(super) fn restore(world: &RobotsWorld, snapshot: &Snapshot) -> Self {
        let mut state = Self::empty(world);
        for (k, index) in world.map_indices().enumerate() {
            if snapshot.visited[k / 8] >> (k % 8) & 1 == 1 {
                state.visited.insert(index);
            }
        }
        for (record, &slot) in snapshot.bodies.iter().zip(&state.slot_of_id) {
            state.restore_body(world, slot, record);
        }
        state.progress = snapshot.progress.clone();
        (0..).zip(&snapshot.waits).for_each(|(id, &waits)| state.waits.set(id, waits));
        state.restore_plans(world, &snapshot.bodies, snapshot.cycle);
        state
    }

    fn restore_body(&self, world: &RobotsWorld, slot: EntitySlot, record: &BodyRecord) {
        let body = &self.bodies[slot as usize];
        body.facing.set(record.facing);
        body.contact.set(record.contact);
        (0..4).for_each(|k| body.memory[k].set(record.memory[k]));
        if let Some(word) = record.voice {
            self.voices.restore(body.id, word);
        }
        let [moves, first_visits, trips] = record.counts;
        body.moves.set(moves);
        body.first_visits.set(first_visits);
        body.trips.set(trips);
        body.trip_cycles.set(record.trip[0]);
        body.trip_begun.set(record.trip[1]);
        let kinds = world.kinds.len();
        let first_contact = body.id as usize * kinds;
        for (kind, &count) in record.contacts.iter().take(kinds).enumerate() {
            self.contacts.set(first_contact + kind, count);
        }
        self.delays.restore(body.id, record.contacts.get(kinds..).unwrap_or_default());
        let words_before = kinds + self.delays.words(body.id).count();
        self.action_progress
            .restore(body.id, record.contacts.get(words_before..).unwrap_or_default());
        body.anchor.set(world.grid_position(record.at.0, record.at.1).word());
        if !self.is_open_door(world, slot) {
            self.occupy(world, slot);
        }
    }

    /// Writes a body into the boxes it covers.
    pub(super) fn occupy(&self, world: &RobotsWorld, slot: EntitySlot) {
        let body = self.body_type(world, slot);
        let base = self.position(slot).row_major_index(world.stride);
        for &offset in &body.own {
            let index = base.wrapping_add_signed(offset) as usize;
            self.floor.place(index, slot);
            if body.marks {
                self.visited.insert(index);
            }
        }
        self.hold_way(world, slot);
    }

    /// Returns the bytes on the heap that grow with the number of boxes, and with that of bodies.
    pub(crate) fn heap_bytes(&self) -> (usize, usize) {
        let bodies = std::mem::size_of_val(&*self.bodies)
            + std::mem::size_of_val(&*self.kinds)
            + std::mem::size_of_val(&*self.slot_of_id)
            + self.contacts.heap_bytes()
            + self.turns.heap_bytes()
            + self.delays.heap_bytes()
            + self.action_progress.heap_bytes()
            + self.waits.heap_bytes()
            + self.voices.heap_bytes();
        let boxes = self.floor.heap_bytes()
            + self.visited.heap_bytes()
            + self.entered_by.heap_bytes()
            + size_of_val(&*self.bids);
        (boxes, bodies)
    }
}

impl Snapshot {
    /// Returns the digest of this state (promise D1): every value, by id, little-endian.
    pub fn digest(&self) -> Digest {
        let mut hasher = Hasher::default();
        hasher.write_u64(self.cycle);
        hasher.write_u64(self.bodies.len() as u64);
        for body in &self.bodies {
            hasher.write_u32(body.at.0);
            hasher.write_u32(body.at.1);
            hasher.write_u8(body.facing.to_bits());
            hasher.write_u32(u32::from(body.contact.to_bits()));
            let voice = body.voice.unwrap_or(0);
            body.trip.iter().chain([&voice]).for_each(|&w| hasher.write_u64(w));
            let words = body.memory.iter().chain(&body.counts).chain(&body.contacts);
            words.for_each(|&w| hasher.write_u32(w));
        }
        hasher.write_bytes(&self.visited);
        // A word of 0 and silence differ here, and nothing is added where no robot has spoken, so that
        // the digests of worlds without radio do not depend on it.
        let spoke = (0u32..).zip(&self.bodies).filter(|(_, body)| body.voice.is_some());
        spoke.for_each(|(id, _)| hasher.write_u32(id));
        hasher.finish()
    }
}
