//! What robots that are driven tell each other, as `docs/src/wire/RobotBeacon.msg` defines it. Whoever reaches the network can
//! send such messages: what cannot be read, is of another scenario or plan, or is not new is dropped and counted.

use crate::ros2::rmw::RosType;
use sidestep::import::bag::cdr::decode;
use sidestep::import::bag::messages::Message;
use sidestep::import::cdr_message;
use sidestep::kernel::{Digest, EntityId};
use sidestep::planners::GridPose;
use sidestep::worlds::robots::drive::beacon::DriveBeacon;
use sidestep_session::fleet::BeaconCounts;
use std::collections::BTreeMap;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

cdr_message!(
    /// `sidestep_msgs/msg/RobotBeacon`: what a robot that is driven tells the others.
    RobotBeacon {
        /// The robot's id.
        robot: u32,
        /// It grows with each beacon, also when the program of the robot starts anew.
        number: u64,
        /// Digest of what all have in common.
        digest: [u8; 16],
        /// Column of its lower-left box, from the west.
        column: u32,
        /// Row of its lower-left box, from the south.
        row: u32,
        /// 0 east, 1 north, 2 west, 3 south.
        heading: u8,
        /// Whether it has said a word over the radio.
        has_word: bool,
        /// Its last word.
        word: u64,
        /// Its request to make room; 0 for none.
        request: u32,
        /// Whether it has a plan, and knows how far it is.
        has_done: bool,
        /// Number of actions of its plan that it has done.
        done: u32,
        /// Ids of the robots of which it knows how far they are, rising.
        heard_from: Vec<u32>,
        /// Number of actions that each of them has done.
        heard_done: Vec<u32>,
    }
);

impl Message for RobotBeacon {
    const NAME: &'static str = "sidestep_msgs/msg/RobotBeacon";
    const DEFINITION: &'static str = include_str!("../../../../docs/src/wire/RobotBeacon.msg");
}

/// The type of beacons. Its hash is what `rosbags` computes of the definition; a test compares them.
pub const BEACON_TYPE: RosType = RosType {
    name: RobotBeacon::NAME,
    hash: "RIHS01_a0de5f0cf6c96e9cc38bf72647bbad7ac155acec84d2e74ae93830bf7774fb60",
};

/// Time between two beacons of a robot with which nothing happens.
const BEACON_INTERVAL: Duration = Duration::from_millis(250);

/// What was heard of a robot.
#[derive(Debug, Clone, Copy)]
struct HeardRobot {
    number: u64,
    arrived: Instant,
    is_silent: bool,
}

/// The beacons of a robot and of the others.
#[derive(Debug)]
pub struct Beacons {
    own: EntityId,
    /// Number of robots of the scenario, whose ids are those below.
    robots: u32,
    digest: Digest,
    patience: Duration,
    /// The number of the next beacon.
    number: u64,
    last: Option<(DriveBeacon, Instant)>,
    heard: BTreeMap<EntityId, HeardRobot>,
    counts: BeaconCounts,
}

/// What the robots of a scenario have in common.
#[derive(Debug, Clone, Copy)]
pub struct CommonGround {
    /// Number of robots.
    pub robots: u32,
    /// Digest of the scenario and the plan.
    pub digest: Digest,
}

impl Beacons {
    /// Returns the beacons of a robot that has told and heard nothing yet. Others are silent after the given time.
    pub fn new(own: EntityId, common: CommonGround, patience: Duration) -> Self {
        Self {
            own,
            robots: common.robots,
            digest: common.digest,
            patience,
            number: first_number(),
            last: None,
            heard: BTreeMap::new(),
            counts: BeaconCounts::default(),
        }
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> BeaconCounts {
        self.counts
    }

    /// Counts messages that were dropped because too many came at once.
    pub fn count_overflow(&mut self, messages: u64) {
        self.counts.unreadable += messages;
    }

    /// Reads a message, and returns what it tells; none of what has to be dropped.
    pub fn read(&mut self, bytes: &[u8], now: Instant) -> Option<DriveBeacon> {
        let message = decode::<RobotBeacon>(bytes).ok();
        let message =
            message.filter(|message| message.heard_from.len() == message.heard_done.len());
        let Some(message) = message.filter(|message| message.heading < 4) else {
            self.counts.unreadable += 1;
            return None;
        };
        // On a topic of all robots its own beacons come back.
        if message.robot == self.own && message.digest == *self.digest.as_bytes() {
            return None;
        }
        if message.robot >= self.robots || message.digest != *self.digest.as_bytes() {
            self.counts.foreign += 1;
            return None;
        }
        let before = self.heard.get(&message.robot);
        if before.is_some_and(|before| message.number <= before.number) {
            self.counts.outdated += 1;
            return None;
        }
        self.counts.heard += 1;
        let heard = HeardRobot { number: message.number, arrived: now, is_silent: false };
        self.heard.insert(message.robot, heard);
        Some(beacon_of(message))
    }

    /// Returns the robots that have fallen silent since the last call.
    pub fn find_silent(&mut self, now: Instant) -> Vec<EntityId> {
        let mut silent = Vec::new();
        for (&robot, heard) in &mut self.heard {
            let is_old = now.saturating_duration_since(heard.arrived) > self.patience;
            if is_old && !heard.is_silent {
                heard.is_silent = true;
                silent.push(robot);
            }
        }
        silent
    }

    /// Returns the robots that were heard before, and are silent now.
    pub fn silent(&self) -> Vec<EntityId> {
        let silent = self.heard.iter().filter(|(_, heard)| heard.is_silent);
        silent.map(|(&robot, _)| robot).collect()
    }

    /// Returns a robot's next message: when it has something new to tell, and else a few times in a second.
    pub fn next_message(&mut self, beacon: DriveBeacon, now: Instant) -> Option<RobotBeacon> {
        let is_old = |sent: Instant| now.saturating_duration_since(sent) >= BEACON_INTERVAL;
        let is_told = self.last.as_ref().is_some_and(|last| last.0 == beacon && !is_old(last.1));
        if is_told {
            return None;
        }
        let message = message_of(&beacon, self.number, &self.digest);
        self.number += 1;
        self.counts.sent += 1;
        self.last = Some((beacon, now));
        Some(message)
    }
}

/// Returns a number above those of a program that ran before: it grows by a million in a second, and by a few for each of
/// the beacons in that time. No result depends on it.
fn first_number() -> u64 {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
    since_1970.map_or(0, |since| u64::try_from(since.as_micros()).unwrap_or(0))
}

fn message_of(beacon: &DriveBeacon, number: u64, digest: &Digest) -> RobotBeacon {
    RobotBeacon {
        robot: beacon.robot,
        number,
        digest: *digest.as_bytes(),
        column: beacon.at.col,
        row: beacon.at.row,
        heading: beacon.at.heading,
        has_word: beacon.word.is_some(),
        word: beacon.word.unwrap_or(0),
        request: beacon.request,
        has_done: beacon.done.is_some(),
        done: beacon.done.unwrap_or(0),
        heard_from: beacon.heard_done.iter().map(|heard| heard.0).collect(),
        heard_done: beacon.heard_done.iter().map(|heard| heard.1).collect(),
    }
}

fn beacon_of(message: RobotBeacon) -> DriveBeacon {
    DriveBeacon {
        robot: message.robot,
        at: GridPose::new(message.column, message.row, message.heading),
        word: message.has_word.then_some(message.word),
        request: message.request,
        done: message.has_done.then_some(message.done),
        heard_done: message.heard_from.into_iter().zip(message.heard_done).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::import::bag::cdr::encode;

    const PATIENCE: Duration = Duration::from_secs(2);

    fn beacons(own: EntityId, scenario: &str) -> Beacons {
        let digest = Digest::hash_bytes(scenario.as_bytes());
        Beacons::new(own, CommonGround { robots: 3, digest }, PATIENCE)
    }

    fn beacon() -> DriveBeacon {
        DriveBeacon {
            robot: 1,
            at: GridPose::new(4, 5, 3),
            word: Some(0),
            request: 48,
            done: Some(7),
            heard_done: vec![(0, 2), (2, 9)],
        }
    }

    fn bytes(of: &mut Beacons, at: Instant) -> Vec<u8> {
        encode(&of.next_message(beacon(), at).expect("it is due"))
    }

    #[test]
    fn a_beacon_comes_as_it_was_told_at_each_change_and_a_few_times_in_a_second() {
        let now = Instant::now();
        let mut speaker = beacons(1, "hall");
        let mut listener = beacons(0, "hall");
        let message = bytes(&mut speaker, now);
        assert_eq!(listener.read(&message, now), Some(beacon()));
        assert_eq!(speaker.next_message(beacon(), now), None, "it is told already");
        let changed = DriveBeacon { done: Some(8), ..beacon() };
        assert!(speaker.next_message(changed.clone(), now).is_some());
        assert!(speaker.next_message(changed, now + BEACON_INTERVAL).is_some());
        assert_eq!(speaker.counts().sent, 3);
        assert_eq!(listener.counts(), BeaconCounts { heard: 1, ..BeaconCounts::default() });
    }

    #[test]
    fn damaged_bytes_are_dropped_and_counted_and_never_a_panic() {
        let now = Instant::now();
        let message = bytes(&mut beacons(1, "hall"), now);
        let mut listener = beacons(0, "hall");
        for length in 0..message.len() {
            assert_eq!(listener.read(&message[..length], now), None, "{length} bytes");
        }
        assert_eq!(listener.counts().unreadable, message.len() as u64);
        for index in 0..message.len() {
            let mut damaged = message.clone();
            damaged[index] ^= 0x5a;
            listener.read(&damaged, now);
        }
        let mut uneven = beacons(1, "hall").next_message(beacon(), now).expect("due");
        uneven.heard_done.pop();
        let before = listener.counts().unreadable;
        assert_eq!(listener.read(&encode(&uneven), now), None);
        assert_eq!(listener.counts().unreadable, before + 1);
    }

    #[test]
    fn beacons_of_another_scenario_of_unknown_robots_and_old_ones_are_dropped_each_by_its_reason() {
        let now = Instant::now();
        let mut listener = beacons(0, "hall");
        let other = bytes(&mut beacons(1, "office"), now);
        assert_eq!(listener.read(&other, now), None);
        let stranger = DriveBeacon { robot: 3, ..beacon() };
        let stranger = beacons(3, "hall").next_message(stranger, now).expect("due");
        assert_eq!(listener.read(&encode(&stranger), now), None);
        assert_eq!(listener.counts().foreign, 2);
        let mut speaker = beacons(1, "hall");
        let first = bytes(&mut speaker, now);
        let second = bytes(&mut speaker, now + BEACON_INTERVAL);
        assert!(listener.read(&second, now).is_some());
        assert_eq!(listener.read(&first, now), None);
        assert_eq!(listener.read(&second, now), None);
        assert_eq!((listener.counts().outdated, listener.counts().heard), (2, 1));
        let own = DriveBeacon { robot: 0, ..beacon() };
        let own = beacons(0, "hall").next_message(own, now).expect("due");
        assert_eq!(listener.read(&encode(&own), now), None, "its own comes back");
        assert_eq!(listener.counts().foreign, 2);
    }

    #[test]
    fn a_robot_is_silent_after_the_patience_and_is_back_with_its_next_beacon() {
        let now = Instant::now();
        let mut speaker = beacons(1, "hall");
        let mut listener = beacons(0, "hall");
        listener.read(&bytes(&mut speaker, now), now);
        assert!(listener.find_silent(now + PATIENCE).is_empty());
        let late = now + PATIENCE + Duration::from_millis(1);
        assert_eq!(listener.find_silent(late), [1]);
        assert!(listener.find_silent(late).is_empty(), "it is told once");
        assert_eq!(listener.silent(), [1]);
        assert!(listener.read(&bytes(&mut speaker, late), late).is_some());
        assert!(listener.silent().is_empty());
    }
}
