//! *Claim*, the paper's first pool: bodies that are due perceive the frozen state, decide, and claim the boxes
//! that they may come to cover.

use super::action::SweptVolume;
use super::agents::RobotPercept;
use super::alias_table::RowIndex;
use super::cycle_context::{CycleContext, are_free, box_index};
use super::decide::{Decision, Memory, Percept, ReceivedMessage, Sector, TripEvent, UNSEEN};
use super::purpose;
use super::ranges::{RangeReadings, RangeSensor};
use super::sensor::Reading;
use super::state::{BodyState, Facing, Intent, PackedPose};
use super::submitted_controls::SubmittedControls;
use super::world::{BeamBoxes, Door, MountedSensor, Mover, Radio, RobotModel, Role};
use super::{Scratch, SensorSample};
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::{AtomicColumn, EntitySlot};

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Lets a body perceive and decide, and claims the boxes that it may come to cover.
    #[inline]
    pub(super) fn perceive(&self, slot: EntitySlot, scratch: &mut Scratch) {
        let world = self.world;
        let body = self.body(slot);
        if let Some(frames) = &self.state.frames {
            let index = (self.now - frames.first) as usize * frames.bodies + body.id as usize;
            frames.poses.set(index, PackedPose::new(body.position(), body.facing.get()));
        }
        // Most bodies act in every cycle, and their constant part need not be read.
        let is_turn = body.period == 1 || world.bodies[body.id as usize].is_due(self.now);
        let is_in_action = self.is_in_action(body);
        let is_turn = is_turn && !is_in_action;
        let is_delayed = world.has_delays && self.spend_delay(body, is_turn, scratch);
        if is_in_action {
            self.state.action_progress.spend(body.id, is_delayed);
        }
        let is_due = is_turn && !is_delayed;
        if !is_due && world.radio.is_some() {
            // The word of a robot that does not decide goes on to the page that is read next.
            self.state.voices.record(body.id, self.now, None);
        }
        let intent = match &self.type_of(body).role {
            _ if !is_due => Intent::IDLE,
            Role::Robot(model) => self.decide_robot(model, slot, scratch),
            Role::Mover(mover) => self.mover_intent(mover, body),
            Role::Door(door) => self.door_intent(door, body),
        };
        let is_clear = !intent.is_idle() && self.claim(slot, intent);
        body.intent.set(if is_clear { intent.with_clear() } else { intent });
        if world.has_long_actions && !intent.is_idle() && !world.is_door(body.id) {
            self.begin_action(body, intent.number());
        }
    }

    #[inline]
    fn decide_robot(&self, model: &RobotModel, slot: EntitySlot, scratch: &mut Scratch) -> Intent {
        let body = self.body(slot);
        let (decision, memory) = self.decision(model, slot, scratch);
        store_memory(body, memory);
        self.record_decision(body, decision);
        // Behaviors may be a user's own, and those of the library act by a memory that another process may have sent.
        let is_known = usize::from(decision.action) < model.body.effector.actions.len();
        if is_known { Intent::from_action(decision.action) } else { Intent::IDLE }
    }

    /// Returns a robot's decision, and its memory after that, which is not stored yet; its readings and the
    /// words that it hears are in the scratch.
    #[inline(always)]
    pub(super) fn decision(
        &self,
        model: &RobotModel,
        slot: EntitySlot,
        scratch: &mut Scratch,
    ) -> (Decision, Memory) {
        let body = self.body(slot);
        let nearest = self.fill_percept(model, slot, scratch);
        let mut memory = memory_of(body);
        if let Some(controls) = self.submitted_controls(model) {
            return controls.decision(body.id, memory);
        }
        let percept = Percept {
            now: self.now,
            id: body.id,
            readings: &scratch.readings,
            sectors: &model.body.sectors,
            nearest_in: nearest,
            contact: body.contact.get().get(),
            at: self.world.map_position(body.position()),
            heading: body.facing.get().heading(),
            heard: &scratch.heard,
        };
        let is_logged = model.is_external == scratch.logs_external;
        if let Some(log) = scratch.percept_log.as_mut().filter(|_| is_logged) {
            log.push(RobotPercept::new(&percept, memory));
        }
        let mut draws = self.world.streams.draws(body.id, self.now, purpose::DECIDE);
        let decision = model.behaviour.decide(&percept, &mut memory, &mut draws);
        (decision, memory)
    }

    /// Fills the scratch with the readings and the heard words of a robot, and returns the nearest
    /// class reported per sector. A robot decided from outside was observed before the cycle:
    /// perceiving again would show the same, and is left out unless readings are recorded.
    #[inline(always)]
    fn fill_percept(&self, model: &RobotModel, slot: EntitySlot, scratch: &mut Scratch) -> [u8; 4] {
        scratch.heard.clear();
        let is_decided_outside = model.is_external || self.submitted_controls(model).is_some();
        if is_decided_outside && !scratch.keep_readings {
            scratch.readings.clear();
            return [UNSEEN; 4];
        }
        let nearest = self.sense(model, self.body(slot), scratch);
        if let Some(radio) = &self.world.radio {
            self.listen(radio, slot, &mut scratch.heard);
        }
        nearest
    }

    /// Returns the controls of this cycle if robots of this type decide outside of the run in it. Those that follow the
    /// orders of a caller carry them out in any cycle.
    #[inline(always)]
    fn submitted_controls(&self, model: &RobotModel) -> Option<&SubmittedControls> {
        self.state.submitted.of_cycle(self.now).filter(|_| !model.is_external)
    }

    /// Records the parts of a decision beside the action: trips and broadcasts.
    #[inline]
    fn record_decision(&self, body: &BodyState, decision: Decision) {
        let now = self.now;
        if let Some(trip) = decision.trip {
            if trip == TripEvent::Completed {
                body.trips.set(body.trips.get() + 1);
                body.trip_cycles.set(body.trip_cycles.get() + now - body.trip_begun.get());
            }
            body.trip_begun.set(now);
        }
        if self.world.radio.is_some() {
            self.state.voices.record(body.id, now, decision.broadcast);
        }
    }

    /// Fills `scratch.readings` with each beam's report, and returns the nearest class reported per
    /// sector.
    #[inline]
    pub(super) fn sense(
        &self,
        model: &RobotModel,
        body: &BodyState,
        scratch: &mut Scratch,
    ) -> [u8; 4] {
        let id = body.id;
        let Scratch { readings, truths, .. } = scratch;
        readings.resize(model.body.sectors.len(), Reading::default());
        let mut nearest = [UNSEEN; 4];
        let mut first = 0;
        for (number, sensor) in model.body.sensors.iter().enumerate() {
            let beams = first..first + sensor.ends.len();
            first = beams.end;
            let readings = &mut readings[beams.clone()];
            let sectors = &model.body.sectors[beams];
            if let Some(beam) = sensor.erring_beam() {
                let samples = scratch
                    .keep_readings
                    .then_some((&mut scratch.sensor_samples, &mut scratch.range_samples));
                let into = RangeReadings { readings, sectors, nearest: &mut nearest, samples };
                self.sense_ranges(&RangeSensor { sensor, beam, number }, body, into);
                continue;
            }
            cast_beams(self, sensor, body, truths);
            sample_reports(
                sensor,
                truths,
                |block| self.world.streams.block(id, self.now, purpose::sense(number), block),
                readings.iter_mut().zip(sectors),
                &mut nearest,
            );
            if scratch.keep_readings {
                let samples = truths.iter().zip(&*readings).map(|(&row, &reported)| {
                    let truth = sensor.table.truth(row);
                    let sensor = number as u16;
                    SensorSample { cycle: self.now, robot: id, sensor, truth, reported }
                });
                scratch.sensor_samples.extend(samples);
            }
        }
        nearest
    }

    /// Returns for each beam of a sensor the first thing that it meets, and the distance to that in boxes.
    pub(super) fn beam_hits(
        &self,
        sensor: &MountedSensor,
        body: &BodyState,
    ) -> Vec<Option<(T, f64)>> {
        let base = self.base(body);
        let boxes = &*sensor.boxes[usize::from(body.facing.get().heading())];
        let mut hits = Vec::with_capacity(sensor.ends.len());
        let mut first = 0;
        for &end in &sensor.ends {
            let beam = first..usize::from(end);
            first = beam.end;
            let chunks = boxes[beam.clone()].iter().zip(&sensor.distances[beam]);
            let mut on_beam = chunks.flat_map(|(chunk, distances)| {
                let words = chunk.offsets.iter().map(|&o| self.floor.get(box_index(base, o)));
                words.zip(*distances)
            });
            hits.push(on_beam.find(|(word, _)| !word.is_free()));
        }
        hits
    }

    /// Returns the intent of a mover: people and the like continue as before or draw a new
    /// direction.
    fn mover_intent(&self, mover: &Mover, body: &BodyState) -> Intent {
        let words = self.world.streams.block(body.id, self.now, purpose::MOVE, 0);
        if !mover.straight.sample(words[0]) {
            body.facing.set(Facing::from_heading((words[1] >> 30) as u8));
        }
        Intent::ONLY_ACTION
    }

    /// Returns the intent of a door: it tries to toggle when its schedule says so. A closing that
    /// a body blocks waits.
    fn door_intent(&self, door: &Door, body: &BodyState) -> Intent {
        let is_open = body.facing.get().is_open();
        let wants_open = door.wants_open(is_open, self.now, || {
            self.world.streams.block(body.id, self.now, purpose::DOOR, 0)[0]
        });
        if wants_open == is_open { Intent::IDLE } else { Intent::ONLY_ACTION }
    }

    /// Claims every free box that the body may come to cover, and returns whether all of them are
    /// free.
    ///
    /// Of several bodies that claim a box at once one stays written in it; each of the others meets that one
    /// there when it joins, so that all are in one group.
    #[inline]
    fn claim(&self, slot: EntitySlot, intent: Intent) -> bool {
        let floor = self.floor;
        let body = self.body(slot);
        let claim = T::from_claim(slot);
        let base = self.base(body);
        let ty = self.type_of(body);
        if !ty.actions.is_empty() {
            let action = ty.action_index(body.facing.get().heading(), intent.number());
            body.action.set(action);
            let boxes = &*ty.actions[usize::from(action)].claims;
            if are_free(floor, base, boxes) {
                boxes.iter().for_each(|&offset| floor.set(box_index(base, offset), claim));
                return true;
            }
        }
        self.for_each_claimed(slot, |index, word| {
            if word.is_free() {
                floor.set(index, claim);
            }
        });
        false
    }

    /// Calls `each` for every box that the body may come to cover, walls excepted, with the present
    /// content of the box: boxes outside the body, or a door's own boxes. The body must not be
    /// idle.
    pub(super) fn for_each_claimed(&self, slot: EntitySlot, mut each: impl FnMut(usize, T)) {
        let floor = self.floor;
        let body = self.body(slot);
        let base = self.base(body);
        let ty = self.type_of(body);
        match ty.actions.get(usize::from(body.action.get())) {
            Some(action) => for_each_swept(floor, &action.sweep, base, each),
            None => ty.own.iter().for_each(|&offset| {
                let index = box_index(base, offset);
                each(index, floor.get(index));
            }),
        }
    }

    /// Collects the last broadcasts of the robots in range, by sender; each reception may be lost.
    /// Robots that have said nothing yet are left out.
    pub(super) fn listen(&self, radio: &Radio, slot: EntitySlot, heard: &mut Vec<ReceivedMessage>) {
        let world = self.world;
        let state = self.state;
        let id = self.body(slot).id;
        for &sender in &world.robots {
            let other = state.slot_of_id[sender as usize];
            if other == slot || !self.in_radio_range(radio, slot, other) {
                continue;
            }
            let Some(word) = state.voices.last_broadcast(sender, self.now) else { continue };
            // Drawn per pair, because each listener loses a word or not by itself.
            let draws = world.streams.words_for_pair(id, sender, self.now, purpose::RADIO, 0);
            if !radio.loss.sample(draws[0]) {
                heard.push(ReceivedMessage { sender, word });
            }
        }
    }

    fn in_radio_range(&self, radio: &Radio, a: EntitySlot, b: EntitySlot) -> bool {
        radio.reaches(self.center_half_boxes(a), self.center_half_boxes(b))
    }

    /// Returns the center of a body in halves of a box, which are whole numbers for every size.
    fn center_half_boxes(&self, slot: EntitySlot) -> (i64, i64) {
        let body = self.body(slot);
        let at = body.position();
        let (width, height) = self.type_of(body).size;
        (2 * i64::from(at.col()) + i64::from(width), 2 * i64::from(at.row()) + i64::from(height))
    }
}

/// Walks the tree of an action's steps, and leaves out the boxes behind a wall.
#[inline]
fn for_each_swept<T: OccupantWord>(
    floor: &AtomicColumn<T>,
    sweep: &SweptVolume,
    base: u32,
    mut each: impl FnMut(usize, T),
) {
    let mut node = 0;
    while let Some(step) = sweep.nodes.get(node) {
        let mut is_walled = false;
        for &offset in &sweep.boxes[step.first as usize..step.end as usize] {
            let index = box_index(base, offset);
            let word = floor.get(index);
            if word == T::WALL {
                is_walled = true;
            } else {
                each(index, word);
            }
        }
        node = if is_walled { step.after as usize } else { node + 1 };
    }
}

/// Writes the row of each beam's true reading.
///
/// This and [`sample_reports`] are two small loops, each in a function of its own, because together they
/// would run out of registers.
#[inline(never)]
fn cast_beams<T: OccupantWord>(
    cycle: &CycleContext<'_, T>,
    sensor: &MountedSensor,
    body: &BodyState,
    truths: &mut Vec<RowIndex>,
) {
    let floor = cycle.floor;
    let state = cycle.state;
    let base = cycle.base(body);
    let boxes = &*sensor.boxes[usize::from(body.facing.get().heading())];
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

/// Returns the first box along a beam that holds something: its content and distance class.
#[inline]
fn first_hit<T: OccupantWord>(
    floor: &AtomicColumn<T>,
    base: u32,
    beam: &[BeamBoxes],
) -> Option<(T, u8)> {
    for BeamBoxes { offsets, classes } in beam {
        let words = offsets.map(|offset| floor.get(box_index(base, offset)));
        let [a, b, c, d] = words;
        // Free is the highest bit of a word, so one branch answers for all four boxes.
        if !(a & b & c & d).is_free() {
            let first = words.iter().position(|word| !word.is_free())?;
            return Some((words[first], classes[first]));
        }
    }
    None
}

/// Draws each beam's report from its true reading, and keeps the nearest class per sector; `words`
/// returns a block of the sensor's draws, which holds four.
#[inline(never)]
fn sample_reports<'a>(
    sensor: &MountedSensor,
    truths: &[RowIndex],
    words: impl Fn(u16) -> [u32; 4],
    mut readings: impl Iterator<Item = (&'a mut Reading, &'a Sector)>,
    nearest: &mut [u8; 4],
) {
    for (block, truths) in (0..).zip(truths.chunks(4)) {
        // A reliable table reports the truth for every word, and a block of the stream is dear.
        let words = if sensor.table.reliable { [0; 4] } else { words(block) };
        for ((&truth, word), (reading, &sector)) in truths.iter().zip(words).zip(&mut readings) {
            let reported = sensor.table.sample(truth, word);
            *reading = reported.reading;
            let nearest = &mut nearest[sector as usize];
            *nearest = reported.nearness.min(*nearest);
        }
    }
}

#[inline]
pub(super) fn memory_of(body: &BodyState) -> Memory {
    Memory { words: std::array::from_fn(|k| body.memory[k].get()) }
}

#[inline]
fn store_memory(body: &BodyState, memory: Memory) {
    body.memory.iter().zip(memory.words).for_each(|(word, value)| word.set(value));
}
