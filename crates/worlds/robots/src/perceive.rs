//! Pool one: bodies that are due perceive the frozen state, decide, and claim.

use super::decide::{Contact, Decision, Heard, Memory, Percept, Sector, Trip, UNSEEN};
use super::effector::{Side, Sweep};
use super::sensor::{Reading, Row};
use super::state::{BodyCell, CLEAR, IDLE, RobotsState, pose_word};
use super::world::{Crossed, Door, MountedSensor, Mover, RobotModel, RobotsWorld, Role, purpose};
use super::{Scratch, SensorSample};
use sidestep_kernel::Column;
use sidestep_kernel::space::{BoxWord, Floor};
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
        match &state.floor {
            Floor::Narrow(floor) => self.perceive_on(floor, state, now, slot, scratch),
            Floor::Wide(floor) => self.perceive_on(floor, state, now, slot, scratch),
        }
    }

    #[inline]
    fn perceive_on<T: BoxWord>(
        &self,
        floor: &Column<T>,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let cell = &state.bodies[slot as usize];
        if let Some(frames) = &state.frames {
            let index = (now - frames.first) as usize * frames.bodies + cell.id as usize;
            frames.poses.set(index, pose_word(cell.at(), cell.facing.get()));
        }
        let role = &self.types[usize::from(cell.ty)].role;
        let intent = if cell.period == 1 || self.bodies[cell.id as usize].is_due(now) {
            match role {
                Role::Robot(model) => self.robot_decides(model, (floor, state), now, slot, scratch),
                Role::Mover(mover) => self.mover_draws(mover, state, now, slot),
                Role::Door(door) => self.door_wants(door, state, now, slot),
            }
        } else {
            IDLE
        };
        let clear = intent != IDLE && self.claim(floor, state, slot, intent);
        cell.intent.set(if clear { intent | CLEAR } else { intent });
    }

    #[inline]
    fn robot_decides<T: BoxWord>(
        &self,
        model: &RobotModel,
        (floor, state): (&Column<T>, &RobotsState),
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) -> u8 {
        let cell = &state.bodies[slot as usize];
        let id = cell.id;
        let nearest = self.sense(model, (floor, state), now, cell, scratch);
        scratch.heard.clear();
        if let Some(radio) = &self.radio {
            self.listen(radio, state, now, slot, &mut scratch.heard);
        }
        let percept = Percept {
            now,
            readings: &scratch.readings,
            sectors: &model.body.sectors,
            nearest_in: nearest,
            contact: contact_of_word(cell.contact.get()),
            at: self.map_position(cell.at()),
            heading: cell.facing.get(),
            heard: &scratch.heard,
        };
        let mut memory = memory_of(cell);
        let mut draws = self.streams.draws(id, now, purpose::DECIDE);
        let decision = model.behaviour.decide(&percept, &mut memory, &mut draws);
        store_memory(cell, memory);
        self.note(state, now, cell, decision);
        let known = usize::from(decision.action) < model.body.effector.actions.len();
        debug_assert!(known, "behaviours choose among the effector's actions");
        if known { decision.action + 1 } else { IDLE }
    }

    /// Counts what the decision says beside the action.
    #[inline]
    fn note(&self, state: &RobotsState, now: Cycle, cell: &BodyCell, decision: Decision) {
        if let Some(trip) = decision.trip {
            if trip == Trip::Done {
                cell.trips.set(cell.trips.get() + 1);
                cell.trip_cycles.set(cell.trip_cycles.get() + now - cell.trip_begun.get());
            }
            cell.trip_begun.set(now);
        }
        if self.radio.is_some() {
            let (heard_now, heard_next) =
                (&state.voice[(now % 2) as usize], &state.voice[((now + 1) % 2) as usize]);
            let i = cell.id as usize;
            heard_next.set(i, decision.broadcast.unwrap_or_else(|| heard_now.get(i)));
        }
    }

    /// Fills `scratch.readings` with what each beam reports of what it truly meets, and
    /// returns the nearest class reported per sector.
    #[inline]
    pub(super) fn sense<T: BoxWord>(
        &self,
        model: &RobotModel,
        (floor, state): (&Column<T>, &RobotsState),
        now: Cycle,
        cell: &BodyCell,
        scratch: &mut Scratch,
    ) -> [u8; 4] {
        let (id, heading) = (cell.id, usize::from(cell.facing.get()));
        let base = cell.at().index(self.stride);
        let Scratch { readings, truths, .. } = scratch;
        readings.resize(model.body.sectors.len(), Reading::default());
        let mut nearest = [UNSEEN; 4];
        let mut first = 0;
        for (s, sensor) in model.body.sensors.iter().enumerate() {
            let beams = first..first + sensor.ends.len();
            first = beams.end;
            let (readings, sectors) = (&mut readings[beams.clone()], &model.body.sectors[beams]);
            cast(sensor, floor, state, (base, heading), truths);
            let words = |block| self.streams.block(id, now, purpose::sense(s), block);
            report(sensor, truths, words, readings.iter_mut().zip(sectors), &mut nearest);
            if scratch.keep_samples {
                let samples = truths.iter().zip(&*readings).map(|(&row, &reported)| {
                    let (truth, sensor) = (sensor.table.truth(row), s as u16);
                    SensorSample { cycle: now, robot: id, sensor, truth, reported }
                });
                scratch.sensor_samples.extend(samples);
            }
        }
        nearest
    }

    /// People and other movers go on as before or draw a new direction.
    fn mover_draws(&self, mover: &Mover, state: &RobotsState, now: Cycle, slot: Slot) -> u8 {
        let i = slot as usize;
        let words = self.streams.block(state.bodies[i].id, now, purpose::MOVE, 0);
        if !mover.straight.happens(words[0]) {
            state.bodies[i].facing.set((words[1] >> 30) as u8);
        }
        1
    }

    /// A door tries to toggle when its schedule says so; a closing that is in the way waits.
    fn door_wants(&self, door: &Door, state: &RobotsState, now: Cycle, slot: Slot) -> u8 {
        let is_open = state.bodies[slot as usize].facing.get() == 1;
        let wants_open = door.wants_open(is_open, now, || {
            self.streams.block(state.bodies[slot as usize].id, now, purpose::DOOR, 0)[0]
        });
        u8::from(wants_open != is_open)
    }

    /// Claims every free box that the body may come to cover, and says whether all of them
    /// are free.
    #[inline]
    fn claim<T: BoxWord>(
        &self,
        floor: &Column<T>,
        state: &RobotsState,
        slot: Slot,
        intent: u8,
    ) -> bool {
        let cell = &state.bodies[slot as usize];
        let (base, claim) = (cell.at().index(self.stride), T::claimed(slot));
        let body = &self.types[usize::from(cell.ty)];
        if !body.actions.is_empty() {
            let action = body.action_index(cell.facing.get(), intent - 1);
            cell.action.set(action);
            let boxes = &*body.actions[usize::from(action)].claims;
            if all_free(floor, base, boxes) {
                let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
                boxes.iter().for_each(|&offset| floor.set(at(offset), claim));
                return true;
            }
        }
        self.for_each_claimed(floor, state, slot, |index, word| {
            if word.is_free() {
                floor.set(index, claim);
            }
        });
        false
    }

    /// Calls `each` for every box that the body may come to cover, walls excepted, with what
    /// it holds now: boxes outside the body, of a door its own. The body is not idle.
    pub(super) fn for_each_claimed<T: BoxWord>(
        &self,
        floor: &Column<T>,
        state: &RobotsState,
        slot: Slot,
        mut each: impl FnMut(usize, T),
    ) {
        let cell = &state.bodies[slot as usize];
        let base = cell.at().index(self.stride);
        let body = &self.types[usize::from(cell.ty)];
        match body.actions.get(usize::from(cell.action.get())) {
            Some(action) => sweep(floor, &action.sweep, base, each),
            None => body.own.iter().for_each(|&offset| {
                let index = base.wrapping_add_signed(offset) as usize;
                each(index, floor.get(index));
            }),
        }
    }
}

/// Whether nothing stands in any of some boxes.
#[inline]
pub(super) fn all_free<T: BoxWord>(floor: &Column<T>, base: u32, offsets: &[i32]) -> bool {
    let at = |offset: i32| base.wrapping_add_signed(offset) as usize;
    offsets.iter().fold(T::FREE, |all, &offset| all & floor.get(at(offset))).is_free()
}

/// Walks the tree of an action's steps; what lies behind a wall is left out.
#[inline]
fn sweep<T: BoxWord>(floor: &Column<T>, sweep: &Sweep, base: u32, mut each: impl FnMut(usize, T)) {
    let mut node = 0;
    while let Some(step) = sweep.nodes.get(node) {
        let mut walled = false;
        for &offset in &sweep.boxes[step.first as usize..step.end as usize] {
            let index = base.wrapping_add_signed(offset) as usize;
            let word = floor.get(index);
            if word == T::WALL {
                walled = true;
            } else {
                each(index, word);
            }
        }
        node = if walled { step.after as usize } else { node + 1 };
    }
}

/// Writes the row of what each beam truly meets.
///
/// This and [`report`] are two small loops, each with a function to itself, since together
/// they would run out of registers.
#[inline(never)]
fn cast<T: BoxWord>(
    sensor: &MountedSensor,
    floor: &Column<T>,
    state: &RobotsState,
    (base, heading): (u32, usize),
    truths: &mut Vec<Row>,
) {
    let boxes = &*sensor.boxes[heading];
    truths.clear();
    let mut from = 0;
    truths.extend(sensor.ends.iter().map(|&end| {
        let beam = &boxes[from..usize::from(end)];
        from = usize::from(end);
        match first_hit(floor, base, beam) {
            Some((word, class)) => sensor.table.row(sensor.truth(state.kind_of(word), class)),
            None => sensor.nothing_row,
        }
    }));
}

/// The first box along a beam that holds something: what it holds, and its distance class.
#[inline]
fn first_hit<T: BoxWord>(floor: &Column<T>, base: u32, beam: &[Crossed]) -> Option<(T, u8)> {
    let look = |offset: i32| floor.get(base.wrapping_add_signed(offset) as usize);
    for Crossed { offsets: [a, b, c, d], classes } in beam {
        let four = [look(*a), look(*b), look(*c), look(*d)];
        let [a, b, c, d] = four;
        if !(a & b & c & d).is_free() {
            let first = four.iter().position(|word| !word.is_free())?;
            return Some((four[first], classes[first]));
        }
    }
    None
}

/// Draws what each beam reports of what it truly meets, and notes the nearest per sector;
/// `words` are the sensor's draws, four at a time.
#[inline(never)]
fn report<'a>(
    sensor: &MountedSensor,
    truths: &[Row],
    words: impl Fn(u16) -> [u32; 4],
    mut readings: impl Iterator<Item = (&'a mut Reading, &'a Sector)>,
    nearest: &mut [u8; 4],
) {
    for (block, truths) in (0..).zip(truths.chunks(4)) {
        let words = if sensor.table.reliable { [0; 4] } else { words(block) };
        for ((&truth, word), (reading, &sector)) in truths.iter().zip(words).zip(&mut readings) {
            let reported = sensor.table.report(truth, word);
            *reading = reported.reading;
            let nearest = &mut nearest[sector as usize];
            *nearest = reported.nearness.min(*nearest);
        }
    }
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
        let id = state.bodies[slot as usize].id;
        let voice = &state.voice[(now % 2) as usize];
        for &sender in &self.robots {
            let other = state.slot_of_id[sender as usize];
            if other == slot || !self.in_radio_range(radio, state, slot, other) {
                continue;
            }
            let words = self.streams.pair(id, sender, now, purpose::RADIO, 0);
            if !radio.loss.happens(words[0]) {
                heard.push(Heard { sender, word: voice.get(sender as usize) });
            }
        }
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
            let (at, size) = (state.at(slot), state.type_in(self, slot).size);
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
