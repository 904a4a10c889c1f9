//! The messages of the public wire, as `docs/src/wire/` defines them, in CDR: the encoding of ROS 2, which has readers in
//! every language.

#![allow(unreachable_pub, reason = "messages are public wherever they are declared")]

use sidestep::import::cdr_message;

cdr_message!(
    /// `sidestep_msgs/msg/SensorDescription`: a sensor of a robot.
    SensorDescription {
        /// Its name in the scenario.
        name: String,
        /// Its range from the robot's boundary, in meters.
        range_m: f64,
        /// Bearings of its beams from the heading, in degrees, positive to the left.
        bearings_deg: Vec<f64>,
        /// What a beam may report, by number; the first is `nothing`.
        observations: Vec<String>,
        /// Names of the distance classes, by number, near to far; the number after the last is nothing in range.
        classes: Vec<String>,
        /// The distances between the classes, in meters, rising.
        class_edges_m: Vec<f64>,
    }
);

cdr_message!(
    /// `sidestep_msgs/msg/RobotDescription`: everything of a robot that stays the same.
    RobotDescription {
        /// The robot's id, from 0.
        robot: u32,
        /// Length of a cycle in seconds of the scenario.
        cycle_s: f64,
        /// Side of a box of the map in meters.
        box_size_m: f64,
        /// Number of columns of the map.
        columns: u32,
        /// Number of rows of the map.
        rows: u32,
        /// Side of the robot in boxes.
        size_boxes: u32,
        /// Its actions, by number.
        actions: Vec<String>,
        /// Kinds of things that it may touch, by number.
        kinds: Vec<String>,
        /// Its sensors, in the order of the readings.
        sensors: Vec<SensorDescription>,
    }
);

cdr_message!(
    /// `sidestep_msgs/msg/RobotPercept`: what a robot knows when it decides.
    RobotPerceptMessage {
        /// The robot's id.
        robot: u32,
        /// The cycle in which it decides.
        cycle: u64,
        /// Column of its lower-left box, from the west.
        column: u32,
        /// Row of its lower-left box, from the south.
        row: u32,
        /// 0 east, 1 north, 2 west, 3 south.
        heading: u8,
        /// Kind of what stopped its last action; [`NO_CONTACT`] for nothing.
        contact_kind: u8,
        /// Its side that touched that: 0 front, 1 left, 2 back, 3 right; [`NO_CONTACT`] for none.
        contact_side: u8,
        /// What each beam reports, the sensors one after the other.
        observations: Vec<u8>,
        /// The distance class that each beam reports.
        classes: Vec<u8>,
        /// Ids of the robots that it hears, rising.
        heard_from: Vec<u32>,
        /// The last word of each of them.
        heard_words: Vec<u64>,
        /// The memory that its last control left, which the world keeps for it.
        memory: [u32; 4],
    }
);

/// Stands for no contact.
pub const NO_CONTACT: u8 = 255;

cdr_message!(
    /// `sidestep_msgs/msg/RobotControl`: a robot's decision in a cycle.
    RobotControlMessage {
        /// The robot's id.
        robot: u32,
        /// The cycle of the percept to which it answers.
        cycle: u64,
        /// The number of the action that it tries.
        action: u8,
        /// A mark on its way: 0 none, 1 a trip has begun, 2 one is done.
        trip: u8,
        /// Whether it says a word over the radio.
        has_broadcast: bool,
        /// The word, which others hear from the next cycle on.
        broadcast: u64,
        /// The memory that its next percept has.
        memory: [u32; 4],
    }
);
