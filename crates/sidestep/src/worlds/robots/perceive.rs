//! Pool one: bodies that are due perceive the frozen state, decide, and claim.

use super::decide::{Contact, Decision, Heard, Memory, Percept, Trip};
use super::effector::{Side, Sweep};
use super::sensor::Reading;
use super::state::{BodyCell, CLEAR, FREE, IDLE, KIND_BITS, RobotsState, WALL, pose_word};
use super::world::{BEAM_STEP, Door, Mover, RobotModel, RobotsWorld, Role, purpose};
use super::{Scratch, SensorSample};
use sidestep_kernel::Column;
use sidestep_kernel::column::Word;
use sidestep_kernel::space::{StoredTag, Tag, Tags};
use sidestep_kernel::world::Turn;
use sidestep_kernel::{Cycle, Slot};

impl RobotsWorld {
    /// One body's share of pool one.
    #[inline]
    pub(super) fn perceive_one(
        &self,
        state: &RobotsState,
        turn: Turn,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let (i, now) = (slot as usize, turn.now);
        let cell = &state.bodies[i];
        let at = cell.at();
        if let Some(frames) = &state.frames {
            let index = i * frames.capacity + (now - frames.first) as usize;
            frames.poses.set(index, pose_word(at, cell.facing.get()));
        }
        let role = &self.types[usize::from(cell.ty)].role;
        if !matches!(role, Role::Door(_)) {
            state.claims.register(slot, at, turn);
        }
        let intent = if self.bodies[i].is_due(now) {
            match role {
                Role::Robot(model) => self.robot_decides(model, state, now, slot, scratch),
                Role::Mover(mover) => self.mover_draws(mover, state, now, slot),
                Role::Door(door) => self.door_wants(door, state, now, slot),
            }
        } else {
            IDLE
        };
        let clear = intent != IDLE && self.claim(state, slot, intent);
        cell.intent.set(if clear { intent | CLEAR } else { intent });
    }

    #[inline]
    fn robot_decides(
        &self,
        model: &RobotModel,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) -> u8 {
        let i = slot as usize;
        let cell = &state.bodies[i];
        let id = cell.id;
        self.sense(model, state, now, slot, scratch);
        scratch.heard.clear();
        if let Some(radio) = &self.radio {
            self.listen(radio, state, now, slot, &mut scratch.heard);
        }
        let percept = Percept {
            now,
            readings: &scratch.readings,
            sectors: &model.body.sectors,
            contact: contact_of_word(cell.contact.get()),
            at: self.map_position(cell.at()),
            heading: cell.facing.get(),
            heard: &scratch.heard,
        };
        let mut memory = memory_of(cell);
        let mut draws = self.streams.draws(id, now, purpose::DECIDE);
        let decision = model.behaviour.decide(&percept, &mut memory, &mut draws);
        store_memory(cell, memory);
        self.note(state, now, i, decision);
        let known = usize::from(decision.action) < model.body.effector.actions.len();
        debug_assert!(known, "behaviours choose among the effector's actions");
        if known { decision.action + 1 } else { IDLE }
    }

    /// Counts what the decision says beside the action.
    #[inline]
    fn note(&self, state: &RobotsState, now: Cycle, i: usize, decision: Decision) {
        if let Some(trip) = decision.trip {
            let cell = &state.bodies[i];
            if trip == Trip::Done {
                cell.trips.set(cell.trips.get() + 1);
                cell.trip_cycles.set(cell.trip_cycles.get() + now - cell.trip_begun.get());
            }
            cell.trip_begun.set(now);
        }
        if self.radio.is_some() {
            let (heard_now, heard_next) =
                (&state.voice[(now % 2) as usize], &state.voice[((now + 1) % 2) as usize]);
            heard_next.set(i, decision.broadcast.unwrap_or_else(|| heard_now.get(i)));
        }
    }

    /// Fills `scratch.readings`: what each beam truly meets, and what it reports.
    #[inline]
    fn sense(
        &self,
        model: &RobotModel,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let i = slot as usize;
        let base = state.at(slot).index(self.stride);
        let heading = usize::from(state.bodies[i].facing.get());
        let boxes = state.grid.cells();
        scratch.readings.clear();
        for (s, sensor) in model.body.sensors.iter().enumerate() {
            let rays = &sensor.rays[heading];
            let mut from = 0;
            for (block, ends) in rays.ends.chunks(4).enumerate() {
                let words = if sensor.table.reliable {
                    [0; 4]
                } else {
                    let (id, purpose) = (state.bodies[i].id, purpose::sense(s));
                    self.streams.block(id, now, purpose, block as u16)
                };
                for (&end, word) in ends.iter().zip(words) {
                    let end = usize::from(end);
                    let truth = match first_hit(boxes, base, &rays.offsets[from..end]) {
                        Some((step, kind)) => sensor.truth(kind, sensor.classes[from + step]),
                        None => sensor.nothing,
                    };
                    let reported = sensor.table.report(truth, word);
                    scratch.readings.push(reported);
                    if scratch.keep_samples {
                        let (robot, sensor) = (self.bodies[i].id, s as u16);
                        let sample = SensorSample { cycle: now, robot, sensor, truth, reported };
                        scratch.sensor_samples.push(sample);
                    }
                    from = end;
                }
            }
        }
    }

    /// People and other movers go on as before or draw a new direction.
    fn mover_draws(&self, mover: &Mover, state: &RobotsState, now: Cycle, slot: Slot) -> u8 {
        let i = slot as usize;
        let words = self.streams.block(self.bodies[i].id, now, purpose::MOVE, 0);
        if !mover.straight.happens(words[0]) {
            state.bodies[i].facing.set((words[1] >> 30) as u8);
        }
        1
    }

    /// A door tries to toggle when its schedule says so; a closing that is in the way waits.
    fn door_wants(&self, door: &Door, state: &RobotsState, now: Cycle, slot: Slot) -> u8 {
        let is_open = state.bodies[slot as usize].facing.get() == 1;
        let wants_open = door.wants_open(is_open, now, || {
            self.streams.block(self.bodies[slot as usize].id, now, purpose::DOOR, 0)[0]
        });
        u8::from(wants_open != is_open)
    }

    /// Writes the body's tag into every free box that it may come to cover, and says whether
    /// all of them are free. Boxes in which a body stands keep that body's tag.
    #[inline]
    fn claim(&self, state: &RobotsState, slot: Slot, intent: u8) -> bool {
        let at = state.at(slot);
        let (base, tag) = (at.index(self.stride), state.tag(self, slot));
        match state.claims.tags() {
            Tags::Narrow(tags) => self.claim_in(tags, state, slot, (base, tag), intent),
            Tags::Wide(tags) => self.claim_in(tags, state, slot, (base, tag), intent),
        }
    }

    #[inline]
    fn claim_in<T: StoredTag>(
        &self,
        tags: &Column<T>,
        state: &RobotsState,
        slot: Slot,
        (base, tag): (u32, Tag),
        intent: u8,
    ) -> bool {
        let (cell, tag) = (&state.bodies[slot as usize], T::of(tag));
        let body = &self.types[usize::from(cell.ty)];
        if !body.actions.is_empty() {
            let action = body.action_index(cell.facing.get(), intent - 1);
            cell.action.set(action);
            let boxes = &*body.actions[usize::from(action)].claims;
            let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
            let met = boxes.iter().fold(0, |met, &o| met | state.grid.get(at(o)));
            if met & KIND_BITS == FREE {
                boxes.iter().for_each(|&o| tags.set(at(o), tag));
                return true;
            }
        }
        self.for_each_claimed(state, slot, base, |index, kind| {
            if kind == FREE {
                tags.set(index, tag);
            }
        });
        false
    }

    /// Calls `each` for every box outside the body (of a door: inside) that it may come to
    /// cover, walls excepted, with the kind that stands there now. The body is not idle.
    pub(super) fn for_each_claimed(
        &self,
        state: &RobotsState,
        slot: Slot,
        base: u32,
        each: impl FnMut(usize, u8),
    ) {
        let cell = &state.bodies[slot as usize];
        let body = &self.types[usize::from(cell.ty)];
        match body.actions.get(usize::from(cell.action.get())) {
            Some(action) => sweep(&state.grid, &action.sweep, base, each),
            None => sweep_own(&state.grid, &body.own, base, each),
        }
    }
}

/// Walks the tree of an action's steps; what lies behind a wall is left out.
#[inline]
fn sweep(grid: &Column<u8>, sweep: &Sweep, base: u32, mut each: impl FnMut(usize, u8)) {
    let mut node = 0;
    while let Some(step) = sweep.nodes.get(node) {
        let mut walled = false;
        for &offset in &sweep.boxes[step.first as usize..step.end as usize] {
            let index = base.wrapping_add_signed(offset) as usize;
            let kind = grid.get(index) & KIND_BITS;
            if kind == WALL {
                walled = true;
            } else {
                each(index, kind);
            }
        }
        node = if walled { step.after as usize } else { node + 1 };
    }
}

/// A door claims the boxes it opens or closes.
fn sweep_own(grid: &Column<u8>, own: &[i32], base: u32, mut each: impl FnMut(usize, u8)) {
    for &offset in own {
        let index = base.wrapping_add_signed(offset) as usize;
        each(index, grid.get(index) & KIND_BITS);
    }
}

/// The first box along a beam that holds something: its place in the list, and its kind.
///
/// Boxes are read four at a time, so lists come in fours and may reach past a wall; the
/// grid's border is wide enough for that.
#[inline]
fn first_hit(boxes: &[<u8 as Word>::Cell], base: u32, offsets: &[i32]) -> Option<(usize, u8)> {
    let kind = |o: i32| u8::load(&boxes[base.wrapping_add_signed(o) as usize]) & KIND_BITS;
    for (k, four) in offsets.as_chunks::<BEAM_STEP>().0.iter().enumerate() {
        let kinds = four.map(kind);
        if u32::from_ne_bytes(kinds) != 0 {
            let first = kinds.iter().position(|&kind| kind != FREE)?;
            return Some((BEAM_STEP * k + first, kinds[first]));
        }
    }
    None
}

/// The contact of a [`super::state::contact_word`].
pub(super) fn contact_of_word(word: u16) -> Option<Contact> {
    let side = Side::ALL[usize::from(word >> 8 & 3)];
    (word != 0).then_some(Contact { kind: (word & 0x7f) as u8, side })
}

#[inline]
fn memory_of(cell: &BodyCell) -> Memory {
    Memory { words: std::array::from_fn(|k| cell.memory[k].get()) }
}

#[inline]
fn store_memory(cell: &BodyCell, memory: Memory) {
    cell.memory.iter().zip(memory.words).for_each(|(word, value)| word.set(value));
}

/// A true or reported reading by name of its sensor's entries, for logs.
pub(super) fn name_of(reading: Reading, sensor: &super::sensor::SensorModel) -> (&str, &str) {
    let observation = &sensor.observations[usize::from(reading.observation)];
    let class = sensor.distance_classes.get(usize::from(reading.class));
    (observation, class.map_or("beyond", String::as_str))
}

impl RobotsWorld {
    /// What the robots in range last broadcast, by sender; each reception may be lost.
    fn listen(
        &self,
        radio: &super::world::Radio,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        heard: &mut Vec<Heard>,
    ) {
        let id = self.bodies[slot as usize].id;
        let voice = &state.voice[(now % 2) as usize];
        for &other in &self.robot_slots {
            if other == slot || !self.in_radio_range(radio, state, slot, other) {
                continue;
            }
            let sender = self.bodies[other as usize].id;
            let words = self.streams.pair(id, sender, now, purpose::RADIO, 0);
            if !radio.loss.happens(words[0]) {
                heard.push(Heard { sender, word: voice.get(other as usize) });
            }
        }
        heard.sort_unstable_by_key(|h| h.sender);
    }

    fn in_radio_range(
        &self,
        radio: &super::world::Radio,
        state: &RobotsState,
        a: Slot,
        b: Slot,
    ) -> bool {
        // Twice the distance between centers, so that all is integer.
        let center = |slot: Slot| {
            let (at, size) = (state.at(slot), self.body_type(slot).size);
            (
                2 * i64::from(at.col()) + i64::from(size.0),
                2 * i64::from(at.row()) + i64::from(size.1),
            )
        };
        let (a, b) = (center(a), center(b));
        let (dx, dy) = (a.0 - b.0, a.1 - b.1);
        ((dx * dx + dy * dy) as u64) <= radio.reach2_half_boxes
    }
}
