//! Percepts, memory and decisions of a robot.

use super::Looking;
use crate::Scratch;
use crate::decide::{Decision, Memory, Sector, Trip};
use crate::sensor::{NOTHING, Reading};
use crate::view::{beyond_boundary_m, to_boundary_m};
use crate::world::{MountedSensor, RobotModel, Role};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::space::BoxWord;
use sidestep_kernel::view::{self, Kind, MarkShape, Section, Table, Value, Who};

/// One beam.
struct Beam<'a, T> {
    sensor: &'a MountedSensor,
    bearing_deg: f64,
    sector: Sector,
    /// The thing that it meets, and the distance to that in boxes.
    met: Option<(T, f64)>,
    truth: Reading,
    reported: Reading,
}

impl<T: BoxWord> Looking<'_, T> {
    /// Tells the percept and the decision of a robot; nothing of other bodies, which have neither.
    pub(super) fn perceives(&mut self, scratch: &mut Scratch) {
        let cell = self.scene.cell(self.slot);
        let Role::Robot(model) = &self.scene.type_of(cell).role else { return };
        let is_due = self.scene.world.bodies[self.id as usize].is_due(self.scene.now);
        let before = super::super::perceive::memory_of(cell);
        let (decision, after) = self.scene.decision(model, self.slot, scratch);
        self.sees(model, &scratch.readings);
        self.hears(scratch);
        let after = if is_due { after } else { before };
        self.remembers(before, after);
        let section = Section::new("Decides");
        self.told.tell(match is_due {
            true => said(section, model, decision),
            false => section.fact("action", "none: it is not its turn"),
        });
    }

    fn sees(&mut self, model: &RobotModel, readings: &[Reading]) {
        let mut table = Table::new([
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
            let met = self.scene.met(sensor, self.scene.cell(self.slot));
            for (&bearing_deg, met) in sensor.model.bearings_deg.iter().zip(met) {
                let (reported, sector) = (readings[k], model.body.sectors[k]);
                k += 1;
                let truth = self.truth(sensor, met);
                let beam = Beam { sensor, bearing_deg, sector, met, truth, reported };
                table.row(self.row(&beam));
                self.draw(&beam);
            }
        }
        self.told.tell(Section::new("Perceives").table(table));
    }

    fn truth(&self, sensor: &MountedSensor, met: Option<(T, f64)>) -> Reading {
        let Some((word, boxes)) = met else { return sensor.nothing };
        let class = sensor.model.class_of(boxes, self.scene.world.map.box_size_m);
        sensor.truth(self.scene.state.kind_of(word), class)
    }

    fn row(&self, beam: &Beam<'_, T>) -> [Value; 10] {
        let Beam { sensor, truth, reported, .. } = *beam;
        let sector = ["ahead", "left", "behind", "right"][beam.sector as usize];
        let names = |reading| crate::perceive::name_of(reading, &sensor.model);
        let row = sensor.model.reading_row(truth, sensor.is_reliable());
        let chance = row.iter().filter(|(reading, _)| *reading == reported).map(|(_, p)| p).sum();
        [
            sensor.model.name.as_str().into(),
            Value::number(beam.bearing_deg, "°"),
            sector.into(),
            names(truth).0.into(),
            names(truth).1.into(),
            Value::meters(self.true_m(beam)),
            names(reported).0.into(),
            names(reported).1.into(),
            Value::meters(beyond_boundary_m(&sensor.model, reported)),
            Value::Share(chance),
        ]
    }

    /// Returns the distance from the body's boundary to the thing that a beam meets, whether seen or not.
    fn true_m(&self, beam: &Beam<'_, T>) -> f64 {
        beam.met.map_or(f64::INFINITY, |(_, boxes)| boxes * self.scene.world.map.box_size_m)
    }

    fn draw(&mut self, beam: &Beam<'_, T>) {
        let (world, cell) = (self.scene.world, self.scene.cell(self.slot));
        let bearing_rad = beam.bearing_deg.to_radians();
        let to_boundary_m = to_boundary_m(world.side_m(self.id), bearing_rad);
        let toward_rad = world.heading_rad(cell.facing.get().heading()) + bearing_rad;
        let [x_m, y_m, z_m] = self.place();
        let line = |beyond_m: f64| {
            let reach_m = to_boundary_m + beyond_m.min(beam.sensor.model.range_m);
            let end_m = [x_m + reach_m * cos(toward_rad), y_m + reach_m * sin(toward_rad), z_m];
            MarkShape::Line { points_m: vec![[x_m, y_m, z_m], end_m] }
        };
        let name = |reading| crate::perceive::name_of(reading, &beam.sensor.model).0;
        let true_m = self.true_m(beam);
        let weight = |is_there: bool| if is_there { 1.0 } else { 0.25 };
        let (is_met, is_reported) = (true_m.is_finite(), beam.reported.observation != NOTHING);
        let said_m = beyond_boundary_m(&beam.sensor.model, beam.reported);
        self.told.weigh(view::Role::True, name(beam.truth), weight(is_met), line(true_m));
        let label = name(beam.reported);
        self.told.weigh(view::Role::Reported, label, weight(is_reported), line(said_m));
    }

    fn hears(&mut self, scratch: &Scratch) {
        let mut table = Table::new(["sender", "word"]);
        for heard in &scratch.heard {
            let sender = Who::new(Kind::Robot, heard.sender, None);
            table.row([sender.into(), format!("{:#018x}", heard.word).into()]);
        }
        if self.scene.world.radio.is_some() {
            let said = self.scene.state.voices.heard(self.id, self.scene.now);
            let said = said.map(|word| format!("{word:#018x}"));
            let heard = Value::count(scratch.heard.len());
            self.told.tell(
                Section::new("Radio").fact("hears", heard).fact("has said", said).table(table),
            );
        }
    }

    fn remembers(&mut self, before: Memory, after: Memory) {
        let mut table = Table::new(["word", "now", "after deciding"]);
        for (k, (before, after)) in before.words.into_iter().zip(after.words).enumerate() {
            let number = |word: u32| Value::number(f64::from(word), "");
            table.row([Value::count(k), number(before), number(after)]);
        }
        self.told.tell(Section::new("Memory").table(table));
    }
}

/// Adds a decision in words.
fn said(section: Section, model: &RobotModel, decision: Decision) -> Section {
    let action = model.body.effector.actions.get(usize::from(decision.action)).cloned();
    let trip = decision.trip.map(|trip| match trip {
        Trip::Begun => "begins",
        Trip::Done => "is done, the next begins",
    });
    let broadcast = decision.broadcast.map(|word| format!("{word:#018x}"));
    section.fact("action", action).fact_if("trip", trip).fact_if("broadcasts", broadcast)
}
