//! Pool one: bodies that are due perceive the frozen state, decide, and claim.

use super::decide::{Contact, Decision, Heard, Memory, Percept, Trip};
use super::effector::{Action, Side};
use super::sensor::Reading;
use super::state::{IDLE, KIND_BITS, RobotsState, WALL, pose_word};
use super::world::{Door, Mover, RobotModel, RobotsWorld, Role, purpose};
use super::{Scratch, SensorSample};
use sidestep_kernel::column::Word;
use sidestep_kernel::{Cycle, Slot};

impl RobotsWorld {
    /// One body's share of pool one.
    #[inline]
    pub(super) fn perceive_one(
        &self,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let i = slot as usize;
        let at = state.at(slot);
        state.claims.register(slot, at, now);
        if let Some(frames) = &state.frames {
            let index = i * frames.capacity + (now - frames.first) as usize;
            frames.poses.set(index, pose_word(at, state.facing.get(i)));
        }
        let body = &self.bodies[i];
        let intent = if body.is_due(now) {
            match &self.types[body.ty as usize].role {
                Role::Robot(model) => self.robot_decides(model, state, now, slot, scratch),
                Role::Mover(mover) => self.mover_draws(mover, state, now, slot),
                Role::Door(door) => self.door_wants(door, state, now, slot),
            }
        } else {
            IDLE
        };
        state.intent.set(i, intent);
        if intent != IDLE {
            self.claim(state, slot, intent);
        }
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
        let id = self.bodies[i].id;
        self.sense(model, state, now, slot, scratch);
        scratch.heard.clear();
        if let Some(radio) = &self.radio {
            self.listen(radio, state, now, slot, &mut scratch.heard);
        }
        let percept = Percept {
            now,
            readings: &scratch.readings,
            sectors: &model.body.sectors,
            contact: contact_of_word(state.contact.get(i)),
            at: self.map_position(state.at(slot)),
            heading: state.facing.get(i),
            heard: &scratch.heard,
        };
        let mut memory = memory_of(state, i);
        let mut draws = self.streams.draws(id, now, purpose::DECIDE);
        let decision = model.behaviour.decide(&percept, &mut memory, &mut draws);
        store_memory(state, i, memory);
        self.note(state, now, i, decision);
        let known = (decision.action as usize) < model.body.actions[0].len();
        debug_assert!(known, "behaviours choose among the effector's actions");
        if known { decision.action + 1 } else { IDLE }
    }

    /// Counts what the decision says beside the action.
    #[inline]
    fn note(&self, state: &RobotsState, now: Cycle, i: usize, decision: Decision) {
        let tally = &state.tally;
        tally.actions.add(i, 1);
        if let Some(trip) = decision.trip {
            if trip == Trip::Done {
                tally.trips.add(i, 1);
                tally.trip_cycles.add(i, now - tally.trip_begun.get(i));
            }
            tally.trip_begun.set(i, now);
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
        let heading = usize::from(state.facing.get(i));
        let boxes = state.grid.cells();
        scratch.readings.clear();
        for (s, sensor) in model.body.sensors.iter().enumerate() {
            let rays = &sensor.rays[heading];
            let mut words = [0; 4];
            let mut from = 0;
            for (beam, &end) in rays.ends.iter().enumerate() {
                let truth = match first_hit(boxes, base, &rays.offsets[from..usize::from(end)]) {
                    Some((step, kind)) => sensor.truth(kind, sensor.classes[from + step]),
                    None => sensor.nothing,
                };
                from = usize::from(end);
                let reported = if sensor.table.reliable {
                    truth
                } else {
                    if beam % 4 == 0 {
                        let purpose = purpose::sense(s);
                        words =
                            self.streams.block(self.bodies[i].id, now, purpose, (beam / 4) as u16);
                    }
                    sensor.table.report(truth, words[beam % 4])
                };
                scratch.readings.push(reported);
                if scratch.keep_samples {
                    let robot = self.bodies[i].id;
                    scratch.sensor_samples.push(SensorSample {
                        cycle: now,
                        robot,
                        sensor: s as u16,
                        truth,
                        reported,
                    });
                }
            }
        }
    }

    /// People and other movers go on as before or draw a new direction.
    fn mover_draws(&self, mover: &Mover, state: &RobotsState, now: Cycle, slot: Slot) -> u8 {
        let i = slot as usize;
        let words = self.streams.block(self.bodies[i].id, now, purpose::MOVE, 0);
        if !mover.straight.happens(words[0]) {
            state.facing.set(i, (words[1] >> 30) as u8);
        }
        state.tally.actions.add(i, 1);
        1
    }

    /// A door tries to toggle when its schedule says so; a closing that is in the way waits.
    fn door_wants(&self, door: &Door, state: &RobotsState, now: Cycle, slot: Slot) -> u8 {
        let is_open = state.facing.get(slot as usize) == 1;
        let wants_open = door.wants_open(is_open, now, || {
            self.streams.block(self.bodies[slot as usize].id, now, purpose::DOOR, 0)[0]
        });
        u8::from(wants_open != is_open)
    }

    /// Writes the body's tag into every free box that it may come to cover. Boxes in which a
    /// body stands keep that body's tag.
    #[inline]
    fn claim(&self, state: &RobotsState, slot: Slot, intent: u8) {
        let at = state.at(slot);
        let (base, tag) = (at.index(self.stride), state.claims.tag(at));
        self.for_each_claimed(state, slot, base, intent, |index, kind| {
            if kind == 0 {
                state.claims.claim(index, tag);
            }
        });
    }

    /// Calls `each` for every box outside the body (of a door: inside) that it may come to
    /// cover, walls excepted, with the kind that stands there now.
    #[inline]
    pub(super) fn for_each_claimed(
        &self,
        state: &RobotsState,
        slot: Slot,
        base: u32,
        intent: u8,
        mut each: impl FnMut(u32, u8),
    ) {
        match &self.body_type(slot).role {
            Role::Robot(model) => {
                let heading = usize::from(state.facing.get(slot as usize));
                sweep(
                    state,
                    &model.body.actions[heading][usize::from(intent - 1)],
                    base,
                    &mut each,
                );
            }
            Role::Mover(mover) => {
                let heading = usize::from(state.facing.get(slot as usize));
                sweep(state, &mover.steps[heading], base, &mut each);
            }
            Role::Door(_) => {
                for &offset in &self.body_type(slot).own {
                    let index = base.wrapping_add_signed(offset);
                    each(index, state.kind_at(index));
                }
            }
        }
    }
}

/// Walks the tree of an action's steps; what lies behind a wall is left out.
#[inline]
fn sweep(state: &RobotsState, action: &Action, base: u32, each: &mut impl FnMut(u32, u8)) {
    let mut node = 0;
    while let Some(step) = action.sweep.get(node) {
        let mut walled = false;
        for &offset in &step.enter {
            let index = base.wrapping_add_signed(offset);
            let kind = state.kind_at(index);
            if kind == WALL {
                walled = true;
            } else {
                each(index, kind);
            }
        }
        node += if walled { step.skip as usize } else { 1 };
    }
}

/// The first box along a beam that holds something: its place in the list, and its kind.
///
/// Boxes are read four at a time; the grid's border is wide enough for that.
#[inline]
fn first_hit(boxes: &[<u8 as Word>::Cell], base: u32, offsets: &[i32]) -> Option<(usize, u8)> {
    let kind =
        |offset: i32| u8::load(&boxes[base.wrapping_add_signed(offset) as usize]) & KIND_BITS;
    let mut chunks = offsets.chunks_exact(4);
    let mut step = 0;
    for four in &mut chunks {
        let kinds = [kind(four[0]), kind(four[1]), kind(four[2]), kind(four[3])];
        if kinds[0] | kinds[1] | kinds[2] | kinds[3] != 0 {
            let first = kinds.iter().position(|&k| k != 0).unwrap_or(0);
            return Some((step + first, kinds[first]));
        }
        step += 4;
    }
    for &offset in chunks.remainder() {
        let kind = kind(offset);
        if kind != 0 {
            return Some((step, kind));
        }
        step += 1;
    }
    None
}

/// The contact of a [`super::state::contact_word`].
pub(super) fn contact_of_word(word: u16) -> Option<Contact> {
    let side = Side::ALL[usize::from(word >> 8 & 3)];
    (word != 0).then_some(Contact { kind: (word & 0x7f) as u8, side })
}

#[inline]
fn memory_of(state: &RobotsState, i: usize) -> Memory {
    let [a, b] = [state.memory[0].get(i), state.memory[1].get(i)];
    Memory { words: [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32] }
}

#[inline]
fn store_memory(state: &RobotsState, i: usize, memory: Memory) {
    let [a, b, c, d] = memory.words.map(u64::from);
    state.memory[0].set(i, a | b << 32);
    state.memory[1].set(i, c | d << 32);
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
