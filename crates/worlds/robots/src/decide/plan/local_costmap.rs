//! Boxes that beams report: the places around a robot where it cannot stand now.

use super::super::Percept;
use crate::sensor::{NOTHING, Reading, WALL};
use crate::world::{MountedSensor, RobotBody};
use sidestep_error_models::ray::{crossings, turn_crossing};
use sidestep_map::planning::{FreeSpace, FreeWindow};
use std::sync::Arc;

/// Distance in boxes up to which a robot plans. The square around it then has 81 places, which one word of
/// 128 bits holds as a set.
pub(super) const PLAN_RADIUS_BOXES: i32 = 4;
pub(super) const PLAN_SIDE_BOXES: i32 = 2 * PLAN_RADIUS_BOXES + 1;
/// Columns and rows, from `-PLAN_RADIUS_BOXES` on, of boxes in which something is looked for. The body
/// covers boxes east and north of the one from which all are counted, so there must be more on that side.
const SEARCH_SIDE_BOXES: i32 = FreeWindow::SIDE as i32;
/// Most boxes that one report of a class other than the nearest may block. A class of many boxes with one
/// thing somewhere in them would wall a corridor off; its boxes are vague instead.
const MAX_EXACT_BOXES: usize = 2;
/// Votes of one beam for a box that it has passed, where beams are reliable: it outweighs 63 reports, each
/// of which says only that something is in one of several boxes.
const RELIABLE_VOTES: i8 = 64;

const LOCAL_BOXES: u32 = (PLAN_SIDE_BOXES * PLAN_SIDE_BOXES) as u32;
/// All places of the square.
const ALL_BOXES: u128 = (1 << LOCAL_BOXES) - 1;
/// The places of the column farthest east.
const EASTERNMOST: u128 = {
    let mut column = 0;
    let mut n = PLAN_SIDE_BOXES as u32 - 1;
    while n < LOCAL_BOXES {
        column |= 1 << n;
        n += PLAN_SIDE_BOXES as u32;
    }
    column
};

/// A set of places around a robot, by the columns and rows from its own place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct LocalBoxSet(u128);

impl LocalBoxSet {
    /// Returns the number of a place, row by row from the southwest; none outside the square.
    pub(super) fn index(col: i32, row: i32) -> Option<usize> {
        let inside = col.abs() <= PLAN_RADIUS_BOXES && row.abs() <= PLAN_RADIUS_BOXES;
        inside.then_some(
            ((row + PLAN_RADIUS_BOXES) * PLAN_SIDE_BOXES + col + PLAN_RADIUS_BOXES) as usize,
        )
    }

    /// Returns whether a place is in the set; none outside the square is.
    pub(super) fn contains(self, col: i32, row: i32) -> bool {
        Self::index(col, row).is_some_and(|n| self.0 >> n & 1 == 1)
    }

    /// Returns the places beside those of the set, to the east, north, west and south.
    pub(super) fn neighbors(self) -> Self {
        let east = (self.0 & !EASTERNMOST) << 1;
        let west = (self.0 & !(EASTERNMOST >> (PLAN_SIDE_BOXES - 1))) >> 1;
        // What is moved beyond the last row is cut off by the mask, beyond the first one by the word.
        let north = self.0 << PLAN_SIDE_BOXES & ALL_BOXES;
        let south = self.0 >> PLAN_SIDE_BOXES;
        Self(east | north | west | south)
    }

    pub(super) fn insert(&mut self, col: i32, row: i32) {
        if let Some(n) = Self::index(col, row) {
            self.0 |= 1 << n;
        }
    }
}

/// Places around a robot where something is that the static map does not show.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LocalCostmap {
    /// Places where the robot cannot stand.
    pub(super) blocked: LocalBoxSet,
    /// Places of which it cannot stand in some.
    pub(super) vague: LocalBoxSet,
}

/// The beams of a robot type, and the walls that it knows.
#[derive(Debug)]
pub(super) struct BeamModel {
    walls: Arc<FreeSpace>,
    size: i32,
    /// Whether all readings are true.
    pub(super) are_reliable: bool,
    /// All beams in the order of the readings, at each heading.
    beams: [Box<[BeamPath]>; 4],
}

/// One beam, as far as a robot plans.
#[derive(Debug)]
struct BeamPath {
    /// The observation that walls truly have.
    wall: u8,
    crossed: Box<[BeamBox]>,
}

/// A box that a beam crosses, seen from the robot's lower-left box.
#[derive(Debug, Clone, Copy)]
struct BeamBox {
    col: i32,
    row: i32,
    class: u8,
}

impl BeamPath {
    /// Returns the stretch of the beam in which there is something that is not the wall behind it.
    fn occupied_segment(&self, reading: Reading, free: &FreeWindow) -> Option<OccupiedSegment<'_>> {
        if reading.observation == NOTHING {
            return None;
        }
        let first = self.crossed.iter().position(|c| c.class >= reading.class)?;
        let mut end = first;
        for crossed in &self.crossed {
            if crossed.is_wall(free) {
                let explains = crossed.class == reading.class && reading.observation == self.wall;
                // A report from behind a wall is an error, because no beam goes through.
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
        let boxes = &self.crossed[first..end];
        (!boxes.is_empty()).then_some(OccupiedSegment { boxes, is_near: reading.class == 0 })
    }
}

impl BeamBox {
    /// Returns whether a wall is in the box, by the free boxes that are searched.
    #[inline(always)]
    fn is_wall(&self, free: &FreeWindow) -> bool {
        let (row, col) = OccupancyVotes::index(self);
        !free.is_free(col, row)
    }
}

/// Votes of the beams for and against each box that is looked at being free.
struct OccupancyVotes([[i8; SEARCH_SIDE_BOXES as usize]; SEARCH_SIDE_BOXES as usize]);

impl Default for OccupancyVotes {
    fn default() -> Self {
        Self([[0; SEARCH_SIDE_BOXES as usize]; SEARCH_SIDE_BOXES as usize])
    }
}

impl OccupancyVotes {
    fn add(&mut self, crossed: &BeamBox, votes: i8) {
        let (row, col) = Self::index(crossed);
        let sum = &mut self.0[row][col];
        *sum = sum.saturating_add(votes);
    }

    fn is_free(&self, crossed: &BeamBox) -> bool {
        let (row, col) = Self::index(crossed);
        self.0[row][col] > 0
    }

    #[inline(always)]
    fn index(crossed: &BeamBox) -> (usize, usize) {
        let row = crossed.row + PLAN_RADIUS_BOXES;
        let col = crossed.col + PLAN_RADIUS_BOXES;
        (row as usize, col as usize)
    }
}

/// The boxes in which something was reported: a stretch of a beam.
struct OccupiedSegment<'a> {
    boxes: &'a [BeamBox],
    is_near: bool,
}

impl BeamModel {
    pub(super) fn new(walls: Arc<FreeSpace>, size: u32, body: &RobotBody, box_size_m: f64) -> Self {
        let beams = [0, 1, 2, 3].map(|heading| {
            let sensors = body.sensors.iter();
            sensors.flat_map(|sensor| beam_paths(sensor, size, heading, box_size_m)).collect()
        });
        let are_reliable = body.sensors.iter().all(MountedSensor::is_error_free);
        Self { walls, size: size as i32, are_reliable, beams }
    }

    /// Returns the things that the robot's readings report and the static map does not explain; none
    /// where there are no such things, near or far.
    pub(super) fn local_costmap(&self, percept: &Percept<'_>) -> Option<LocalCostmap> {
        // On an open floor most robots sense nothing at all.
        if percept.readings.iter().all(|reading| reading.observation == NOTHING) {
            return None;
        }
        let (col, row) = percept.at;
        let free =
            &self.walls.window(col as i32 - PLAN_RADIUS_BOXES, row as i32 - PLAN_RADIUS_BOXES);
        // Mostly nothing unknown is there, and then the free boxes need not be found.
        self.occupied_segments(percept, free).next()?;
        let mut votes = OccupancyVotes::default();
        for (beam, &reading) in self.reports(percept) {
            self.vote_free(beam, reading, free, &mut votes);
        }
        for segment in self.occupied_segments(percept, free) {
            segment.boxes.iter().for_each(|crossed| votes.add(crossed, -1));
        }
        // Only now, because a box is free or not by the votes of all beams.
        let mut costmap = LocalCostmap::default();
        for segment in self.occupied_segments(percept, free) {
            let occupied = segment.boxes.iter().filter(|crossed| !votes.is_free(crossed));
            let is_exact = segment.is_near || occupied.clone().count() <= MAX_EXACT_BOXES;
            let places = if is_exact { &mut costmap.blocked } else { &mut costmap.vague };
            occupied.for_each(|crossed| self.block(crossed, places));
        }
        Some(costmap)
    }

    /// Returns each beam at the robot's heading with its reading.
    #[inline(always)]
    fn reports<'a>(
        &'a self,
        percept: &'a Percept<'_>,
    ) -> impl Iterator<Item = (&'a BeamPath, &'a Reading)> {
        self.beams[usize::from(percept.heading)].iter().zip(percept.readings)
    }

    /// Returns the stretches of all beams in which something unknown is.
    #[inline(always)]
    fn occupied_segments<'a>(
        &'a self,
        percept: &'a Percept<'_>,
        free: &'a FreeWindow,
    ) -> impl Iterator<Item = OccupiedSegment<'a>> {
        let reports = self.reports(percept);
        reports.filter_map(|(beam, &reading)| beam.occupied_segment(reading, free))
    }

    /// Votes for the boxes that a beam has passed: all up to the wall if it reports nothing or that
    /// wall, else those that are nearer than the thing it reports. One beam decides where beams are
    /// reliable, and most of them where they are not.
    fn vote_free(
        &self,
        beam: &BeamPath,
        reading: Reading,
        free: &FreeWindow,
        votes: &mut OccupancyVotes,
    ) {
        let to_wall = beam.crossed.iter().position(|crossed| crossed.is_wall(free));
        let wall_reading =
            to_wall.map(|n| Reading { observation: beam.wall, class: beam.crossed[n].class });
        let is_clear = reading.observation == NOTHING || wall_reading == Some(reading);
        let before_wall = &beam.crossed[..to_wall.unwrap_or(beam.crossed.len())];
        let weight = if self.are_reliable { RELIABLE_VOTES } else { 1 };
        let passed =
            before_wall.iter().take_while(|crossed| is_clear || crossed.class < reading.class);
        passed.for_each(|crossed| votes.add(crossed, weight));
    }

    /// Blocks the places from which the robot would cover a box.
    fn block(&self, crossed: &BeamBox, blocked: &mut LocalBoxSet) {
        for row in 0..self.size {
            (0..self.size).for_each(|col| blocked.insert(crossed.col - col, crossed.row - row));
        }
    }
}

/// Returns the beams of a sensor at a heading, as far as their boxes are looked at.
fn beam_paths(sensor: &MountedSensor, size: u32, heading: u8, box_size_m: f64) -> Vec<BeamPath> {
    let model = &sensor.model;
    // A box farther off along an axis blocks no place of the square; times 1.5, because a diagonal is
    // longer than its side by the square root of 2.
    let reach = f64::from(PLAN_RADIUS_BOXES + 1 + size as i32) * 1.5;
    let range = (model.range_m / box_size_m).min(reach);
    let wall = model.designates[usize::from(WALL)];
    let mut paths = Vec::with_capacity(model.bearings_deg.len());
    for &bearing_deg in &model.bearings_deg {
        let beam_boxes = crossings(size, bearing_deg, range).into_iter().map(|crossing| {
            let turned = turn_crossing(crossing, size, heading);
            let class = model.class_of(crossing.distance, box_size_m);
            BeamBox { col: turned.dx, row: turned.dy, class }
        });
        let crossed = beam_boxes.take_while(|one| is_searched(one.col) && is_searched(one.row));
        paths.push(BeamPath { wall, crossed: crossed.collect() });
    }
    paths
}

/// Returns whether something is looked for in boxes of this column or row.
fn is_searched(offset: i32) -> bool {
    (-PLAN_RADIUS_BOXES..SEARCH_SIDE_BOXES - PLAN_RADIUS_BOXES).contains(&offset)
}
