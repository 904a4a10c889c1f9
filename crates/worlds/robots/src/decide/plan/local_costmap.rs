//! Boxes that beams report: the places around a robot where it cannot stand now.

use super::super::Percept;
use super::local_box_set::{LocalBoxSet, PLAN_RADIUS_BOXES};
use crate::effector::HEADINGS;
use crate::sensor::{NOTHING, Reading, WALL};
use crate::world::{MountedSensor, RobotBody};
use sidestep_error_models::ray::{crossings, turn_crossing};
use sidestep_map::planning::{FREE_WINDOW_COLUMNS, FreeSpace};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Columns and rows, from `-PLAN_RADIUS_BOXES` on, of boxes in which something is looked for. The body
/// covers boxes east and north of the one from which all are counted, so there must be more on that side.
const SEARCH_SIDE_BOXES: i32 = FREE_WINDOW_COLUMNS as i32;

/// The walls among the boxes in which something is looked for.
type FreeWindow = sidestep_map::planning::FreeWindow<FREE_WINDOW_COLUMNS>;

/// Most boxes that a report of a thing in one of them blocks, if its class is not the nearest. Many boxes with one thing
/// somewhere in them would wall a corridor off; they are vague instead.
const MAX_EXACT_BOXES: usize = 2;
/// Votes of a beam for each box that it has passed, and against each of a few boxes in one of which it reports something.
/// Over more boxes they are spread, so that a report of one in many does not outweigh a beam that has passed.
const BEAM_VOTES: i32 = 60;
/// Votes of a beam for a box that it has passed, where beams are reliable: more than all reports have together.
const RELIABLE_VOTES: i32 = 1 << 16;

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
    /// Whether all readings are true.
    pub(super) are_reliable: bool,
    /// All beams in the order of the readings, at each heading.
    beams: [Box<[BeamPath]>; 4],
    /// By heading: the beams that cross each box, box by box ([`BeamBox::crossings`]).
    crossings: [Box<[Crossing]>; 4],
    /// By heading and by direction of the next step: the beams that cross the boxes that matter to it.
    step_beams: [[Box<[StepBeam]>; 4]; 4],
}

/// A beam that crosses some of the boxes that matter to a step.
#[derive(Debug)]
struct StepBeam {
    /// Number of the beam.
    beam: usize,
    /// The first and the last of these boxes, and those between, by their numbers along the beam.
    boxes: Range<usize>,
    /// Distance classes of these boxes, a bit each.
    classes: u32,
}

/// One beam, as far as a robot plans.
#[derive(Debug)]
struct BeamPath {
    /// The observation that walls truly have.
    wall: u8,
    crossed: Box<[BeamBox]>,
    /// By distance class: the number of its first box.
    starts: Box<[usize]>,
    /// Boxes of the last of these classes that are beyond those that are looked at.
    unsearched: usize,
}

/// A box that a beam crosses, seen from the robot's lower-left box.
#[derive(Debug, Clone)]
struct BeamBox {
    col: i32,
    row: i32,
    class: u8,
    /// The places from which the robot would cover it.
    places: LocalBoxSet,
    /// All beams that cross it, in the list of all.
    crossings: Range<u32>,
}

/// A beam that crosses a box, and the number of that box along it.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    beam: u32,
    number: u32,
}

impl BeamPath {
    /// Returns a beam that crosses these boxes, as far as they are looked at.
    fn new(wall: u8, all: Vec<BeamBox>) -> Self {
        let is_beyond = |one: &BeamBox| !(is_searched(one.col) && is_searched(one.row));
        let searched = all.iter().position(is_beyond).unwrap_or(all.len());
        let (crossed, beyond) = all.split_at(searched);
        // A class is one of distance, which grows along a beam.
        debug_assert!(crossed.is_sorted_by_key(|one| one.class), "classes rise along a beam");
        let last_class = crossed.last().map_or(0, |one| one.class);
        let first_of_class = |class: u8| crossed.partition_point(|one| one.class < class);
        // One more than there are, so that each class ends where the next one begins.
        let starts = (0..=last_class + 1).map(first_of_class).collect();
        let unsearched = beyond.iter().filter(|one| one.class == last_class).count();
        Self { wall, crossed: crossed.into(), starts, unsearched }
    }

    /// Returns the number of the first box of a class, or of a later one; that of all boxes where there is none.
    fn start_of(&self, class: u8) -> usize {
        self.starts.get(usize::from(class)).copied().unwrap_or(self.crossed.len())
    }

    /// Returns the number of the first box with a wall; that of all boxes where there is none.
    fn first_wall(&self, free: &FreeWindow) -> usize {
        let first = self.crossed.iter().position(|crossed| crossed.is_wall(free));
        first.unwrap_or(self.crossed.len())
    }

    /// Returns the number of boxes beyond those that are looked at in which a report of something in a stretch may be, too.
    fn unsearched_after(&self, end: usize) -> usize {
        if end == self.crossed.len() { self.unsearched } else { 0 }
    }

    /// Returns the stretch of the beam in which there is something that is not the wall behind it; `first_wall` is that of
    /// the beam.
    fn occupied_range(&self, reading: Reading, first_wall: usize) -> Option<Range<usize>> {
        if reading.observation == NOTHING {
            return None;
        }
        let first = self.start_of(reading.class);
        // Classes that no box of the beam has are beyond what is looked at.
        let end = self.start_of(reading.class.saturating_add(1));
        if first_wall >= end {
            return (first < end).then_some(first..end);
        }
        // A report from behind a wall is an error, because no beam goes through, and one of the wall is explained.
        let is_explained = first_wall < first || reading.observation == self.wall;
        (!is_explained && first < first_wall).then_some(first..first_wall)
    }

    /// Returns what a reading says of one of the boxes: votes for it being free, fewer than 0 if something may be in
    /// it, and 0 of a box that it knows nothing of. `first_wall` is that of the beam.
    fn votes(&self, number: usize, reading: Reading, first_wall: usize, passed: i32) -> i32 {
        let class = self.crossed[number].class;
        let is_passed = reading.observation == NOTHING || class < reading.class;
        let is_behind_wall = first_wall <= number;
        if is_behind_wall || !is_passed && class > reading.class {
            return 0;
        }
        if is_passed {
            return passed;
        }
        // The thing is in a box of this class; where it is the wall behind them, they are free.
        let end_of_class = self.start_of(class.saturating_add(1));
        let is_explained = reading.observation == self.wall && first_wall < end_of_class;
        if is_explained {
            return passed;
        }
        let end = end_of_class.min(first_wall);
        let boxes = end - self.start_of(class) + self.unsearched_after(end);
        let shares = if boxes <= MAX_EXACT_BOXES { 1 } else { boxes as i32 };
        -BEAM_VOTES / shares
    }
}

/// Where the beams around a robot meet walls: each is looked for once, when it is asked for, because most beams never are.
struct BeamWalls<'a> {
    free: &'a FreeWindow,
    beams: &'a [BeamPath],
    /// By beam; [`UNKNOWN_WALL`] for those that were not looked for yet. Beams beyond are looked for each time.
    first: [u8; MAX_KEPT_WALLS],
}

const UNKNOWN_WALL: u8 = u8::MAX;
const MAX_KEPT_WALLS: usize = 64;

impl<'a> BeamWalls<'a> {
    fn new(free: &'a FreeWindow, beams: &'a [BeamPath]) -> Self {
        Self { free, beams, first: [UNKNOWN_WALL; MAX_KEPT_WALLS] }
    }

    /// Returns the number of the first box of a beam with a wall; that of all boxes where there is none.
    fn first_wall(&mut self, beam: usize) -> usize {
        match self.first.get_mut(beam) {
            Some(first) if *first != UNKNOWN_WALL => usize::from(*first),
            kept => {
                let found = self.beams[beam].first_wall(self.free);
                // Beams are as long as the square is wide: there is room for the number of any box.
                if let (Some(first), Ok(found)) = (kept, u8::try_from(found)) {
                    *first = found;
                }
                found
            }
        }
    }
}

impl BeamBox {
    /// Returns whether a wall is in the box, by the free boxes that are searched.
    #[inline(always)]
    fn is_wall(&self, free: &FreeWindow) -> bool {
        let [col, row] = [self.col, self.row].map(|offset| (offset + PLAN_RADIUS_BOXES) as usize);
        !free.is_free(col, row)
    }
}

/// The boxes in which something was reported: a stretch of a beam.
struct OccupiedSegment<'a> {
    boxes: &'a [BeamBox],
    /// Boxes beyond those that are looked at in which it may be as well.
    unsearched: usize,
    is_near: bool,
}

impl BeamModel {
    pub(super) fn new(walls: Arc<FreeSpace>, size: u32, body: &RobotBody, box_size_m: f64) -> Self {
        let mut beams: [Box<[BeamPath]>; 4] = [0, 1, 2, 3].map(|heading| {
            let sensors = body.sensors.iter();
            sensors.flat_map(|sensor| beam_paths(sensor, size, heading, box_size_m)).collect()
        });
        let crossings = beams.each_mut().map(|beams| link_crossings(beams));
        let are_reliable = body.sensors.iter().all(MountedSensor::is_error_free);
        let step_beams = beams
            .each_ref()
            .map(|beams| [0, 1, 2, 3].map(|direction| step_beams(beams, size as i32, direction)));
        Self { walls, are_reliable, beams, crossings, step_beams }
    }

    /// Returns whether no reading speaks of something unknown in the boxes of the next step, beyond them, or to the
    /// right of them, from where another robot may come into them.
    pub(super) fn is_clear(&self, percept: &Percept<'_>, direction: u8) -> bool {
        let heading = usize::from(percept.heading);
        let beams = &self.beams[heading];
        let mut free = None;
        for step_beam in &self.step_beams[heading][usize::from(direction)] {
            let reading = percept.readings[step_beam.beam];
            let is_relevant =
                reading.observation != NOTHING && step_beam.classes >> reading.class & 1 == 1;
            if !is_relevant {
                continue;
            }
            // Only now, because most readings speak of nothing near.
            let free = free.get_or_insert_with(|| self.free_window(percept.at));
            let beam = &beams[step_beam.beam];
            let occupied = beam.occupied_range(reading, beam.first_wall(free));
            let meets = |range: Range<usize>| {
                range.start < step_beam.boxes.end && step_beam.boxes.start < range.end
            };
            if occupied.is_some_and(meets) {
                return false;
            }
        }
        true
    }

    fn free_window(&self, (col, row): (u32, u32)) -> FreeWindow {
        self.walls.window(col as i32 - PLAN_RADIUS_BOXES, row as i32 - PLAN_RADIUS_BOXES)
    }

    /// Returns the things that the robot's readings report and the static map does not explain; none
    /// where there are no such things, near or far.
    pub(super) fn local_costmap(&self, percept: &Percept<'_>) -> Option<LocalCostmap> {
        // On an open floor most robots sense nothing at all.
        if percept.readings.iter().all(|reading| reading.observation == NOTHING) {
            return None;
        }
        let free = self.free_window(percept.at);
        let beams = &self.beams[usize::from(percept.heading)];
        let mut walls = BeamWalls::new(&free, beams);
        let mut costmap = None;
        for (number, (beam, &reading)) in beams.iter().zip(percept.readings).enumerate() {
            if reading.observation == NOTHING {
                continue;
            }
            let Some(range) = beam.occupied_range(reading, walls.first_wall(number)) else {
                continue;
            };
            let segment = OccupiedSegment {
                unsearched: beam.unsearched_after(range.end),
                boxes: &beam.crossed[range],
                is_near: reading.class == 0,
            };
            let costmap = costmap.get_or_insert_with(LocalCostmap::default);
            self.block(&segment, percept, &mut walls, costmap);
        }
        costmap
    }

    /// Blocks the places from which the robot would cover a box of a stretch, unless the other beams say that it is
    /// free.
    fn block(
        &self,
        segment: &OccupiedSegment<'_>,
        percept: &Percept<'_>,
        walls: &mut BeamWalls<'_>,
        costmap: &mut LocalCostmap,
    ) {
        let mut places = LocalBoxSet::default();
        let mut boxes = 0;
        for crossed in segment.boxes {
            if self.is_free(crossed, percept, walls) {
                continue;
            }
            places = places.union(crossed.places);
            boxes += 1;
        }
        let is_exact = segment.is_near || boxes + segment.unsearched <= MAX_EXACT_BOXES;
        let all = if is_exact { &mut costmap.blocked } else { &mut costmap.vague };
        *all = all.union(places);
    }

    /// Returns whether the votes of all beams that cross a box say that it is free: one beam that has passed it decides
    /// where beams are reliable, and the weight of all where they are not.
    fn is_free(&self, crossed: &BeamBox, percept: &Percept<'_>, walls: &mut BeamWalls<'_>) -> bool {
        let heading = usize::from(percept.heading);
        let passed = if self.are_reliable { RELIABLE_VOTES } else { BEAM_VOTES };
        let crossings = crossed.crossings.start as usize..crossed.crossings.end as usize;
        let mut votes = 0;
        for crossing in &self.crossings[heading][crossings] {
            let beam = crossing.beam as usize;
            let first_wall = walls.first_wall(beam);
            let reading = percept.readings[beam];
            let number = crossing.number as usize;
            votes += self.beams[heading][beam].votes(number, reading, first_wall, passed);
        }
        votes > 0
    }
}

/// Notes for each box of the beams at a heading where the list of all beams that cross it is, and returns these lists.
fn link_crossings(beams: &mut [BeamPath]) -> Box<[Crossing]> {
    let mut by_box: BTreeMap<(i32, i32), Vec<Crossing>> = BTreeMap::new();
    for (beam, path) in (0..).zip(&*beams) {
        for (number, one) in (0..).zip(&path.crossed) {
            by_box.entry((one.row, one.col)).or_default().push(Crossing { beam, number });
        }
    }
    let mut all: Vec<Crossing> = Vec::new();
    for list in by_box.values() {
        let first = all.len() as u32;
        all.extend(list);
        for crossing in list {
            let one = &mut beams[crossing.beam as usize].crossed[crossing.number as usize];
            one.crossings = first..all.len() as u32;
        }
    }
    all.into()
}

/// Returns the places from which a body covers a box.
fn covering_places(size: u32, (box_col, box_row): (i32, i32)) -> LocalBoxSet {
    let mut places = LocalBoxSet::default();
    for row in 0..size as i32 {
        (0..size as i32).for_each(|col| places.insert(box_col - col, box_row - row));
    }
    places
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
            let places = covering_places(size, (turned.dx, turned.dy));
            BeamBox { col: turned.dx, row: turned.dy, class, places, crossings: 0..0 }
        });
        paths.push(BeamPath::new(wall, beam_boxes.collect()));
    }
    paths
}

/// Returns the beams that cross boxes that matter to a step: those that the body comes into, and those from which
/// another one may come into them, from ahead or from the right.
fn step_beams(beams: &[BeamPath], size: i32, direction: u8) -> Box<[StepBeam]> {
    let (east, north) = HEADINGS[usize::from(direction)];
    let (right_east, right_north) = HEADINGS[usize::from((direction + 3) % 4)];
    let covers = |anchor: (i32, i32), one: &BeamBox| {
        (anchor.0..anchor.0 + size).contains(&one.col)
            && (anchor.1..anchor.1 + size).contains(&one.row)
    };
    let matters = |one: &BeamBox| {
        let anchors =
            [(east, north), (2 * east, 2 * north), (east + right_east, north + right_north)];
        !covers((0, 0), one) && anchors.into_iter().any(|anchor| covers(anchor, one))
    };
    let of_beam = |(beam, path): (usize, &BeamPath)| {
        let mut numbers = (0..path.crossed.len()).filter(|&n| matters(&path.crossed[n]));
        let first = numbers.next()?;
        let end = numbers.next_back().unwrap_or(first) + 1;
        let boxes = first..end;
        let classes = path.crossed[boxes.clone()].iter().fold(0, |bits, one| bits | 1 << one.class);
        Some(StepBeam { beam, boxes, classes })
    };
    beams.iter().enumerate().filter_map(of_beam).collect()
}

/// Returns whether something is looked for in boxes of this column or row.
fn is_searched(offset: i32) -> bool {
    (-PLAN_RADIUS_BOXES..SEARCH_SIDE_BOXES - PLAN_RADIUS_BOXES).contains(&offset)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::UNSEEN;
    use crate::scenario::StorageOrder;
    use crate::test_runs::run_in_order;
    use crate::world::Role;

    /// Observation and distance class of a robot that a sonar ring sees at 0.3 to 1.5 m.
    const MEDIUM_ROBOT: Reading = Reading { observation: 4, class: 1 };

    #[test]
    fn a_report_ahead_says_the_same_of_the_places_ahead_at_all_four_headings() {
        let text = "format = 1\nworld = \"robots\"\nregime = \"both\"\nmap.ascii = \"...\"\n\
                    [[robots]]\nat = [[1, 0, 0]]\nsensors = [\"sonar-ring\"]\n";
        let run = run_in_order(text, 1, StorageOrder::Spatial);
        let Role::Robot(model) = &run.world().type_of(0).role else { panic!("it is a robot") };
        let walls = Arc::new(FreeSpace::new(40, 40, |_, _| true));
        let beam_model = BeamModel::new(walls, 1, &model.body, 0.25);
        let nothing = Reading { observation: NOTHING, class: 0 };
        let mut readings = vec![nothing; model.body.sectors.len()];
        readings[0] = MEDIUM_ROBOT;
        let sizes = [0, 1, 2, 3].map(|heading| {
            let percept = Percept {
                now: 0,
                id: 0,
                readings: &readings,
                sectors: &model.body.sectors,
                nearest_in: [UNSEEN; 4],
                contact: None,
                at: (20, 20),
                heading,
                heard: &[],
            };
            let costmap = beam_model.local_costmap(&percept).expect("something is noticed");
            (costmap.blocked.len(), costmap.vague.len())
        });
        assert!(sizes[0].1 > 0, "it may be in one of several places: {sizes:?}");
        assert_eq!(sizes, [sizes[0]; 4]);
    }
}
