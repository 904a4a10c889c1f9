//! Percepts, memory and decisions of a robot.

use super::Inspector;
use crate::Scratch;
use crate::decide::{Decision, Memory, Sector, TripEvent};
use crate::kinds;
use crate::sensor::{NOTHING, Reading};
use crate::view::{center_to_boundary_m, class_middle_m};
use crate::world::{MountedSensor, RobotModel, Role};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::view::{self, BodyId, FactSection, FactTable, FactValue, MarkShape};

/// One row of the table of readings: what a beam truly meets, and what its sensor makes of that.
struct BeamReading<'a, T> {
    sensor: &'a MountedSensor,
    bearing_deg: f64,
    sector: Sector,
    /// The thing that it meets, and the distance to that in boxes.
    met: Option<(T, f64)>,
    truth: Reading,
    reported: Reading,
}

impl<T: OccupantWord> Inspector<'_, T> {
    /// Adds the percept and the decision of a robot; nothing of other bodies, which have neither.
    pub(super) fn add_percept(&mut self, scratch: &mut Scratch) {
        let body = self.cycle.body(self.slot);
        let Role::Robot(model) = &self.cycle.type_of(body).role else { return };
        let is_turn = self.cycle.is_turn(body);
        let is_delayed = self.cycle.delay_cycles(body, is_turn) > 0;
        let is_due = is_turn && !is_delayed;
        let before = super::super::perceive::memory_of(body);
        let (decision, after) = self.cycle.decision(model, self.slot, scratch);
        self.add_readings(model, &scratch.readings);
        self.add_messages(scratch);
        let after = if is_due { after } else { before };
        self.add_memory(before, after);
        let section = FactSection::new("Decides");
        let section = if is_due {
            with_decision(section, model, decision)
        } else if is_delayed {
            section.fact("action", "none: it is delayed")
        } else if self.cycle.is_in_action(body) {
            section.fact("action", "none: its last one goes on")
        } else {
            section.fact("action", "none: it is not its turn")
        };
        self.inspection.add_section(section);
    }

    fn add_readings(&mut self, model: &RobotModel, readings: &[Reading]) {
        let mut table = FactTable::new([
            "sensor",
            "bearing",
            "sector",
            "truth",
            "true class",
            "true range",
            "report",
            "reported class",
            "reported range",
            "chance of the report",
        ]);
        let mut k = 0;
        for sensor in &model.body.sensors {
            let met = self.cycle.beam_hits(sensor, self.cycle.body(self.slot));
            for (&bearing_deg, met) in sensor.model.bearings_deg.iter().zip(met) {
                let reported = readings[k];
                let sector = model.body.sectors[k];
                k += 1;
                let truth = self.truth(sensor, met);
                let beam = BeamReading { sensor, bearing_deg, sector, met, truth, reported };
                table.push_row(self.row(&beam));
                self.draw_beam(&beam);
            }
        }
        self.inspection.add_section(FactSection::new("Perceives").table(table));
    }

    fn truth(&self, sensor: &MountedSensor, met: Option<(T, f64)>) -> Reading {
        let Some((word, boxes)) = met else { return sensor.nothing };
        let class = sensor.model.class_of(boxes, self.cycle.world.map.box_size_m);
        sensor.truth(self.cycle.state.kind_of(word), class)
    }

    fn row(&self, beam: &BeamReading<'_, T>) -> [FactValue; 10] {
        let BeamReading { sensor, truth, reported, .. } = *beam;
        let sector = ["ahead", "left", "behind", "right"][beam.sector as usize];
        let (true_name, true_class) = sensor.model.names_of(truth);
        let (reported_name, reported_class) = sensor.model.names_of(reported);
        let row = sensor.model.reading_row(truth, sensor.is_reliable());
        let chance = row.iter().filter(|(reading, _)| *reading == reported).map(|(_, p)| p).sum();
        [
            sensor.model.name.as_str().into(),
            FactValue::number(beam.bearing_deg, "°"),
            sector.into(),
            true_name.into(),
            true_class.into(),
            FactValue::meters(self.true_range_m(beam)),
            reported_name.into(),
            reported_class.into(),
            FactValue::meters(class_middle_m(&sensor.model, reported)),
            FactValue::Share(chance),
        ]
    }

    /// Returns the distance from the body's boundary to the thing that a beam meets, whether seen or not.
    fn true_range_m(&self, beam: &BeamReading<'_, T>) -> f64 {
        beam.met.map_or(f64::INFINITY, |(_, boxes)| boxes * self.cycle.world.map.box_size_m)
    }

    fn draw_beam(&mut self, beam: &BeamReading<'_, T>) {
        let model = &beam.sensor.model;
        let true_m = self.true_range_m(beam);
        let true_line = self.beam_line(beam, true_m);
        let reported_line = self.beam_line(beam, class_middle_m(model, beam.reported));
        self.inspection.add_weighted_mark(
            view::MarkRole::True,
            model.names_of(beam.truth).0,
            beam_weight(true_m.is_finite()),
            true_line,
        );
        self.inspection.add_weighted_mark(
            view::MarkRole::Reported,
            model.names_of(beam.reported).0,
            beam_weight(beam.reported.observation != NOTHING),
            reported_line,
        );
    }

    /// Returns the line of a beam from the middle of the robot to a distance beyond its boundary, at most
    /// the sensor's range.
    fn beam_line(&self, beam: &BeamReading<'_, T>, beyond_m: f64) -> MarkShape {
        let world = self.cycle.world;
        let body = self.cycle.body(self.slot);
        let bearing_rad = beam.bearing_deg.to_radians();
        let to_boundary_m = center_to_boundary_m(world.side_m(self.id), bearing_rad);
        let reach_m = to_boundary_m + beyond_m.min(beam.sensor.model.range_m);
        let toward_rad = world.heading_rad(body.facing.get().heading()) + bearing_rad;
        let [x_m, y_m, z_m] = self.position_m();
        let end_m = [x_m + reach_m * cos(toward_rad), y_m + reach_m * sin(toward_rad), z_m];
        MarkShape::Line { points_m: vec![[x_m, y_m, z_m], end_m] }
    }

    fn add_messages(&mut self, scratch: &Scratch) {
        let mut table = FactTable::new(["sender", "word"]);
        for heard in &scratch.heard {
            let sender = BodyId::new(kinds::ROBOT, heard.sender, None);
            table.push_row([sender.into(), format!("{:#018x}", heard.word).into()]);
        }
        if self.cycle.world.radio.is_some() {
            let said = self.cycle.state.voices.last_broadcast(self.id, self.cycle.now);
            let said = said.map(|word| format!("{word:#018x}"));
            let heard = FactValue::count(scratch.heard.len());
            let section = FactSection::new("Radio").fact("hears", heard).fact("has said", said);
            self.inspection.add_section(section.table(table));
        }
    }

    fn add_memory(&mut self, before: Memory, after: Memory) {
        let mut table = FactTable::new(["word", "now", "after deciding"]);
        for (k, (before, after)) in before.words.into_iter().zip(after.words).enumerate() {
            let before = FactValue::number(f64::from(before), "");
            let after = FactValue::number(f64::from(after), "");
            table.push_row([FactValue::count(k), before, after]);
        }
        self.inspection.add_section(FactSection::new("Memory").table(table));
    }
}

/// Returns the weight of a beam's line: beams that end at nothing are many, and drawn faintly.
fn beam_weight(ends_at_something: bool) -> f64 {
    if ends_at_something { 1.0 } else { 0.25 }
}

fn with_decision(section: FactSection, model: &RobotModel, decision: Decision) -> FactSection {
    let action = model.body.effector.actions.get(usize::from(decision.action)).cloned();
    let trip = decision.trip.map(|trip| match trip {
        TripEvent::Started => "begins",
        TripEvent::Completed => "is done, the next begins",
    });
    let broadcast = decision.broadcast.map(|word| format!("{word:#018x}"));
    section.fact("action", action).fact_if("trip", trip).fact_if("broadcasts", broadcast)
}
