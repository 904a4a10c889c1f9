//! Sensors that measure ranges: the report of each beam is drawn from the beam model at the true distance, and reaches
//! the robot as a distance class.

use super::alias_table::SampledReading;
use super::cycle_context::CycleContext;
use super::decide::Sector;
use super::sensor::{NOTHING, Reading};
use super::state::BodyState;
use super::world::MountedSensor;
use super::{RangeSample, SensorSample, purpose};
use sidestep_error_models::beam::{BEAMS_PER_DRAW, BeamModel};
use sidestep_kernel::space::OccupantWord;

/// A sensor whose reports come from a beam model.
pub(super) struct RangeSensor<'a> {
    pub(super) sensor: &'a MountedSensor,
    pub(super) beam: &'a BeamModel,
    /// Its number on its robot.
    pub(super) number: usize,
}

/// The readings of a sensor's beams, and what else is kept of them.
pub(super) struct RangeReadings<'a> {
    pub(super) readings: &'a mut [Reading],
    /// The sector of each beam.
    pub(super) sectors: &'a [Sector],
    /// The nearest class that each sector reports.
    pub(super) nearest: &'a mut [u8; 4],
    /// Where a log is wanted, its samples.
    pub(super) samples: Option<(&'a mut Vec<SensorSample>, &'a mut Vec<RangeSample>)>,
}

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Draws the range that each beam of a sensor reports.
    pub(super) fn sense_ranges(
        &self,
        of: &RangeSensor<'_>,
        body: &BodyState,
        mut into: RangeReadings<'_>,
    ) {
        let RangeSensor { sensor, beam, number } = *of;
        let model = &sensor.model;
        let hits = self.beam_hits(sensor, body);
        for (index, hit) in hits.into_iter().enumerate() {
            let seen = hit.map(|(word, boxes)| (self.state.kind_of(word), boxes));
            // A kind that the sensor does not see reads as nothing, and hides what is behind it.
            let seen = seen.filter(|(kind, _)| sensor.designated_observation(*kind) != NOTHING);
            let true_m = seen.map(|(_, boxes)| boxes * sensor.box_size_m);
            let truth = seen.map_or(sensor.nothing, |(kind, boxes)| {
                sensor.truth(kind, model.class_of(boxes, sensor.box_size_m))
            });
            let words = |draw: u16| {
                let block = index as u16 + draw * BEAMS_PER_DRAW;
                self.world.streams.block(body.id, self.now, purpose::sense(number), block)
            };
            let reported_m = beam.sample(true_m, model.range_m, words);
            let reported = model.reading_of_range(reported_m);
            into.readings[index] = reported;
            let nearest = &mut into.nearest[into.sectors[index] as usize];
            *nearest = SampledReading::from(reported).nearness.min(*nearest);
            if let Some((sensor_samples, range_samples)) = &mut into.samples {
                let cycle = self.now;
                let robot = body.id;
                let sensor = number as u16;
                sensor_samples.push(SensorSample { cycle, robot, sensor, truth, reported });
                let beam = index as u16;
                range_samples.push(RangeSample { cycle, robot, sensor, beam, true_m, reported_m });
            }
        }
    }
}
