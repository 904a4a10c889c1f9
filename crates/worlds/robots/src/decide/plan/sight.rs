//! Boxes that beams report: the places around a robot where it cannot stand now.

use super::super::Percept;
use crate::ray::crossings;
use crate::ray::turn_crossing;
use crate::sensor::{NOTHING, Reading};
use crate::state::WALL;
use crate::world::{MountedSensor, RobotBody};
use sidestep_map::planning::FreeSpace;
use std::sync::Arc;

/// Distance in boxes up to which a robot plans.
pub(super) const REACH: i32 = 4;
/// Side of the square in which it plans.
pub(super) const SIDE: i32 = 2 * REACH + 1;
/// Columns and rows, from `-REACH` on, of boxes in which something is looked for.
const LOOK: i32 = 32;
/// Most boxes in which one thing is believed to be, where the class does not say more exactly; the
/// nearest class is believed however many boxes it spans.
const VAGUE: usize = 2;

/// A set of places around a robot, by the columns and rows from its own place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Places(u128);

impl Places {
    /// Returns the number of a place, row by row from the southwest; none outside the square.
    pub(super) fn number(col: i32, row: i32) -> Option<usize> {
        let inside = col.abs() <= REACH && row.abs() <= REACH;
        inside.then_some(((row + REACH) * SIDE + col + REACH) as usize)
    }

    /// Returns whether a place is in the set; none outside the square is.
    pub(super) fn has(self, col: i32, row: i32) -> bool {
        Self::number(col, row).is_some_and(|n| self.0 >> n & 1 == 1)
    }

    pub(super) fn add(&mut self, col: i32, row: i32) {
        if let Some(n) = Self::number(col, row) {
            self.0 |= 1 << n;
        }
    }
}

/// Places around a robot where something is that the static map does not show.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sight {
    /// Places where the robot cannot stand.
    pub(super) blocked: Places,
    /// Places of which it cannot stand in some.
    pub(super) vague: Places,
}

/// The eyes of a robot type: its beams, and the walls that it knows.
#[derive(Debug)]
pub(super) struct Eyes {
    walls: Arc<FreeSpace>,
    size: i32,
    /// Whether all readings are true.
    pub(super) are_reliable: bool,
    /// All beams in the order of the readings, at each heading.
    beams: [Box<[Beam]>; 4],
}

/// One beam, as far as a robot plans.
#[derive(Debug)]
struct Beam {
    /// The observation that walls truly have.
    wall: u8,
    crossed: Box<[Crossed]>,
}

/// A box that a beam crosses, seen from the robot's lower-left box.
#[derive(Debug, Clone, Copy)]
struct Crossed {
    col: i32,
    row: i32,
    class: u8,
}

/// Votes of the beams for and against each box that is looked at being free.
struct Votes([[i8; LOOK as usize]; LOOK as usize]);

impl Default for Votes {
    fn default() -> Self {
        Self([[0; LOOK as usize]; LOOK as usize])
    }
}

impl Votes {
    fn add(&mut self, crossed: &Crossed, votes: i8) {
        let sum = &mut self.0[(crossed.row + REACH) as usize][(crossed.col + REACH) as usize];
        *sum = sum.saturating_add(votes);
    }

    fn are_for(&self, crossed: &Crossed) -> bool {
        self.0[(crossed.row + REACH) as usize][(crossed.col + REACH) as usize] > 0
    }
}

/// The boxes in which something was reported: a stretch of a beam.
struct Suspicion<'a> {
    boxes: &'a [Crossed],
    is_near: bool,
}

impl Eyes {
    pub(super) fn new(walls: Arc<FreeSpace>, size: u32, body: &RobotBody, box_size_m: f64) -> Self {
        let at = |heading| {
            let all =
                body.sensors.iter().flat_map(|sensor| beams(sensor, size, heading, box_size_m));
            all.collect()
        };
        let are_reliable = body.sensors.iter().all(MountedSensor::never_errs);
        Self { walls, size: size as i32, are_reliable, beams: [0, 1, 2, 3].map(at) }
    }

    /// Returns the things that the robot's readings report and the static map does not explain; none
    /// where there are no such things, near or far.
    pub(super) fn look(&self, percept: &Percept<'_>) -> Option<Sight> {
        let beams = &self.beams[usize::from(percept.heading)];
        let mut sight = Sight::default();
        let reports = || beams.iter().zip(percept.readings);
        // Mostly nothing unknown is there, and then the free boxes need not be found.
        if !reports().any(|(beam, &reading)| self.suspect(beam, reading, percept.at).is_some()) {
            return None;
        }
        let suspicions = || reports().filter_map(|(b, &r)| self.suspect(b, r, percept.at));
        let mut votes = Votes::default();
        for (beam, &reading) in reports() {
            self.vote_free(beam, reading, percept.at, &mut votes);
        }
        for suspicion in suspicions() {
            suspicion.boxes.iter().for_each(|c| votes.add(c, -1));
        }
        for suspicion in suspicions() {
            let left = || suspicion.boxes.iter().filter(|c| !votes.are_for(c));
            let is_exact = suspicion.is_near || left().count() <= VAGUE;
            let places = if is_exact { &mut sight.blocked } else { &mut sight.vague };
            left().for_each(|c| self.block(c, places));
        }
        Some(sight)
    }

    fn is_wall(&self, (col, row): (u32, u32), crossed: &Crossed) -> bool {
        let at = (col.wrapping_add_signed(crossed.col), row.wrapping_add_signed(crossed.row));
        !self.walls.is_free(at.0, at.1)
    }

    /// Returns the stretch of a beam in which there is something that is not the wall behind it.
    fn suspect<'a>(
        &self,
        beam: &'a Beam,
        reading: Reading,
        at: (u32, u32),
    ) -> Option<Suspicion<'a>> {
        if reading.observation == NOTHING {
            return None;
        }
        let first = beam.crossed.iter().position(|c| c.class >= reading.class)?;
        let mut end = first;
        for crossed in &beam.crossed {
            if self.is_wall(at, crossed) {
                let explains = crossed.class == reading.class && reading.observation == beam.wall;
                if explains || crossed.class < reading.class {
                    return None;
                }
                break;
            }
            if crossed.class > reading.class {
                break;
            }
            end += usize::from(crossed.class == reading.class);
        }
        let boxes = &beam.crossed[first..end];
        (!boxes.is_empty()).then_some(Suspicion { boxes, is_near: reading.class == 0 })
    }

    /// Votes for the boxes that a beam has passed: all up to the wall if it reports nothing or that
    /// wall, else those that are nearer than the thing it reports. One beam decides where beams are
    /// reliable, and most of them where they are not.
    fn vote_free(&self, beam: &Beam, reading: Reading, at: (u32, u32), votes: &mut Votes) {
        let to_wall = beam.crossed.iter().position(|c| self.is_wall(at, c));
        let wall =
            to_wall.map(|n| Reading { observation: beam.wall, class: beam.crossed[n].class });
        let is_clear = reading.observation == NOTHING || wall == Some(reading);
        let before_wall = &beam.crossed[..to_wall.unwrap_or(beam.crossed.len())];
        let passed = before_wall.iter().take_while(|c| is_clear || c.class < reading.class);
        let weight = if self.are_reliable { 64 } else { 1 };
        passed.for_each(|c| votes.add(c, weight));
    }

    /// Blocks the places from which the robot would cover a box.
    fn block(&self, crossed: &Crossed, blocked: &mut Places) {
        for row in 0..self.size {
            (0..self.size).for_each(|col| blocked.add(crossed.col - col, crossed.row - row));
        }
    }
}

/// Returns the beams of a sensor at a heading, as far as their boxes are looked at.
fn beams(sensor: &MountedSensor, size: u32, heading: u8, box_size_m: f64) -> Vec<Beam> {
    let model = &sensor.model;
    let reach = f64::from(REACH + 1 + size as i32) * 1.5;
    let range = (model.range_m / box_size_m).min(reach);
    let inside = |v: i32| (-REACH..LOOK - REACH).contains(&v);
    let beam = |&deg: &f64| {
        let crossed = crossings(size, deg, range).into_iter().map(|c| {
            let turned = turn_crossing(c, size, heading);
            Crossed {
                col: turned.dx,
                row: turned.dy,
                class: model.class_of(c.distance, box_size_m),
            }
        });
        let crossed = crossed.take_while(|c| inside(c.col) && inside(c.row)).collect();
        Beam { wall: model.designates[usize::from(WALL)], crossed }
    };
    model.bearings_deg.iter().map(beam).collect()
}
