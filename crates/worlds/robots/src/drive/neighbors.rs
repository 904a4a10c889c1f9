//! What a robot hears of the others: words by the radio of the scenario, and requests to make room.
//!
//! It is what a run would let it hear: words of robots in range, and a request only where the robot is the first thing in the
//! direction of the one that asks. Words are not lost by chance as in a run; the network loses them itself.

use super::beacon::DriveBeacon;
use crate::decide::ReceivedMessage;
use crate::decide::pass_request::{MAX_REQUEST_BOXES, own_request};
use crate::effector::HEADINGS;
use crate::world::{RobotsWorld, Role};
use sidestep_kernel::EntityId;
use sidestep_map::Cell;
use sidestep_planners::GridPose;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The other robots as far as they are heard now.
#[derive(Debug)]
pub struct Neighbors {
    world: Arc<RobotsWorld>,
    own: EntityId,
    beacons: BTreeMap<EntityId, DriveBeacon>,
}

impl Neighbors {
    /// Returns the neighbors of a robot, none of which is heard yet.
    pub fn new(world: Arc<RobotsWorld>, own: EntityId) -> Self {
        Self { world, own, beacons: BTreeMap::new() }
    }

    /// Returns the id of the robot that hears.
    pub fn own(&self) -> EntityId {
        self.own
    }

    /// Takes the beacon of another robot of the scenario; those of others are dropped.
    pub fn hear(&mut self, beacon: DriveBeacon) {
        let is_robot = self.world.robot_model(beacon.robot).is_some();
        if is_robot && beacon.robot != self.own && self.is_on_map(&beacon) {
            self.beacons.insert(beacon.robot, beacon);
        }
    }

    /// Forgets a robot that is silent.
    pub fn forget(&mut self, robot: EntityId) {
        self.beacons.remove(&robot);
    }

    /// Returns whether the robot makes room for others who ask it.
    pub fn has_requests(&self) -> bool {
        let model = self.world.robot_model(self.own);
        // One without a program goes to goals, and makes room as `avoidance = "plan"` does.
        model.is_some_and(|model| model.behaviour.has_requests() || model.behaviour.is_external())
    }

    /// Returns the words that it hears at a place, by rising sender.
    pub fn words_heard(&self, at: GridPose) -> Vec<ReceivedMessage> {
        let Some(radio) = &self.world.radio else { return Vec::new() };
        let own = self.center_half_boxes(self.own, at);
        let mut heard = Vec::new();
        for (&sender, beacon) in &self.beacons {
            let Some(word) = beacon.word else { continue };
            if radio.reaches(own, self.center_half_boxes(sender, beacon.at)) {
                heard.push(ReceivedMessage { sender, word });
            }
        }
        heard
    }

    /// Returns the request that it hears at a place: of several the one of the highest rank, 0 for none.
    pub fn request_to(&self, at: GridPose) -> u32 {
        let asked = self.beacons.values().filter(|asking| self.is_asked(at, asking));
        asked.filter_map(|asking| own_request(asking.request)).map(|own| own.1).max().unwrap_or(0)
    }

    /// Returns whether the robot is the first thing in the direction of one that asks.
    fn is_asked(&self, at: GridPose, asking: &DriveBeacon) -> bool {
        let Some(request) = own_request(asking.request) else { return false };
        let east_north = HEADINGS[usize::from(request.0 % 4)];
        for step in 1..=MAX_REQUEST_BOXES {
            let col = asking.at.col as i32 + step * east_north.0;
            let row = asking.at.row as i32 + step * east_north.1;
            let size = self.side(asking.robot);
            let is_in_way = |robot: EntityId, at: GridPose| {
                overlaps([col, row, size], [at.col as i32, at.row as i32, self.side(robot)])
            };
            if is_in_way(self.own, at) {
                return true;
            }
            // Bodies behind what stands in the way are not asked.
            let others = self.beacons.values().filter(|other| other.robot != asking.robot);
            let mut others = others.filter(|other| is_in_way(other.robot, other.at));
            if others.next().is_some() || !self.is_free(col, row, size) {
                return false;
            }
        }
        false
    }

    fn is_free(&self, col: i32, row: i32, size: i32) -> bool {
        let map = &self.world.map;
        let is_free_box = |col: i32, row: i32| {
            let is_inside =
                col >= 0 && row >= 0 && (col as u32) < map.width() && (row as u32) < map.height();
            is_inside && map.cell(col as u32, row as u32) == Cell::Free
        };
        (0..size).all(|up| (0..size).all(|right| is_free_box(col + right, row + up)))
    }

    fn is_on_map(&self, beacon: &DriveBeacon) -> bool {
        let side = self.side(beacon.robot);
        let fits =
            |first: u32, end: u32| first.checked_add(side as u32).is_some_and(|last| last <= end);
        let map = &self.world.map;
        beacon.at.heading < 4
            && fits(beacon.at.col, map.width())
            && fits(beacon.at.row, map.height())
    }

    /// Returns the side of a robot in boxes; one that drives is a square.
    fn side(&self, robot: EntityId) -> i32 {
        self.world.type_of(robot).size.0 as i32
    }

    /// Returns the center of a body in halves of a box, which are whole numbers for every size.
    fn center_half_boxes(&self, robot: EntityId, at: GridPose) -> (i64, i64) {
        let side = i64::from(self.side(robot));
        (2 * i64::from(at.col) + side, 2 * i64::from(at.row) + side)
    }
}

/// Returns whether two squares share a box, each by column, row and side.
fn overlaps(a: [i32; 3], b: [i32; 3]) -> bool {
    (0..2).all(|axis| a[axis] < b[axis] + b[2] && b[axis] < a[axis] + a[2])
}

impl RobotsWorld {
    /// Returns whether a robot acts by what others tell it: it hears words, or makes room.
    pub fn listens_to_others(&self, id: EntityId) -> bool {
        if id as usize >= self.bodies.len() || !matches!(self.type_of(id).role, Role::Robot(_)) {
            return false;
        }
        let is_planned = self.planner_teams.iter().any(|team| team.robots.contains(&id));
        is_planned || self.radio.is_some()
    }
}
