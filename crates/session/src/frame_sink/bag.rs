//! A run as a ROS 2 bag: the records that its robots would have made, and the truth.

use super::FrameSink;
use super::mcap::FRAME_OPTIONS;
use crate::Error;
use crate::VERSION;
use crate::trajectory::ros_name;
use sidestep_import::bag::cdr::encode;
use sidestep_import::bag::messages::{
    Header, LaserScan, Message, Odometry, Pose as RosPose, PoseStamped, PoseWithCovariance,
    TfMessage, Time, TransformStamped, TwistWithCovariance,
};
use sidestep_import::write::map_files;
use sidestep_kernel::math::wrap_angle;
use sidestep_kernel::view::{BodyId, Frame, Isometry2, Occupancy, OccupancyGrid, Pose, Scan};
use sidestep_kernel::{Cycle, InputError, Simulation};
use sidestep_map::Cell;
use sidestep_record::{BagSchema, BagWriter};
use std::path::Path;

/// The fixed frame that the map, the starts and the true poses share.
const MAP_FRAME: &str = "map";

/// A bag that is written while a run advances.
pub(crate) struct BagSink {
    writer: BagWriter,
    every: Cycle,
    /// Odometry of the frame before, with its time.
    before: Option<(f64, Vec<(BodyId, Pose)>)>,
}

impl BagSink {
    /// Starts a bag in a folder, with the map of the run; from now on wheels are watched.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn start(
        folder: &Path,
        every: Cycle,
        run: &mut dyn Simulation,
    ) -> Result<Self, Error> {
        if let Some(floor) = &run.scenery().floor {
            for (name, bytes) in map_files_with_border(floor) {
                let path = folder.join(name);
                std::fs::write(&path, bytes).map_err(|e| Error::cannot_store(&path, &e))?;
            }
        }
        run.enable_odometry();
        Ok(Self { writer: BagWriter::create(folder, VERSION)?, every, before: None })
    }

    /// Finishes the bag.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn finish(self) -> Result<(), Error> {
        Ok(self.writer.finish()?)
    }

    fn write<T: Message>(&mut self, topic: &str, time_s: f64, message: &T) -> Result<(), Error> {
        let schema = BagSchema { name: T::NAME, definition: T::DEFINITION };
        Ok(self.writer.write(topic, schema, to_ns(time_s), &encode(message))?)
    }

    fn write_odometry(&mut self, frame: &Frame) -> Result<(), Error> {
        let mut transforms = Vec::new();
        for (who, claimed) in &frame.odometry {
            let message = Odometry {
                header: header(frame.time_s, odometry_frame(*who)),
                child_frame_id: base_frame(*who),
                pose: PoseWithCovariance { pose: ros_pose(claimed), covariance: [0.0; 36] },
                twist: self.twist(frame, *who, claimed),
            };
            self.write(&format!("/{}/odom", namespace(*who)), frame.time_s, &message)?;
            transforms.push(TransformStamped {
                header: message.header,
                child_frame_id: message.child_frame_id,
                transform: message.pose.pose,
            });
        }
        self.write("/tf", frame.time_s, &TfMessage { transforms })
    }

    /// Returns the mean velocity since the frame before, in the frame of the robot at that time.
    fn twist(&self, frame: &Frame, who: BodyId, claimed: &Pose) -> TwistWithCovariance {
        let mut twist = TwistWithCovariance {
            linear_mps: [0.0; 3],
            angular_radps: [0.0; 3],
            covariance: [0.0; 36],
        };
        let Some((time_s, odometry)) = &self.before else { return twist };
        let Some((_, before)) = odometry.iter().find(|(other, _)| *other == who) else {
            return twist;
        };
        let step_s = frame.time_s - time_s;
        if step_s > 0.0 {
            let moved: [f64; 3] = std::array::from_fn(|i| claimed.at_m[i] - before.at_m[i]);
            let [x, y, z, w] = before.turn;
            let inverse = Pose { at_m: [0.0; 3], turn: [-x, -y, -z, w] };
            twist.linear_mps = inverse.rotate(moved).map(|along| along / step_s);
            twist.angular_radps[2] = wrap_angle(yaw_rad(claimed) - yaw_rad(before)) / step_s;
        }
        twist
    }

    fn write_truth(&mut self, frame: &Frame) -> Result<(), Error> {
        for (who, _) in &frame.odometry {
            let body = frame.bodies.iter().find(|body| body.id() == *who);
            let Some(body) = body else { continue };
            // A floor has no height, even if pictures show one.
            let [x_m, y_m, _] = body.pose.at_m;
            let pose = ros_pose(&Pose { at_m: [x_m, y_m, 0.0], ..body.pose });
            let message = PoseStamped { header: header(frame.time_s, MAP_FRAME.into()), pose };
            self.write(&format!("/{}/ground_truth", namespace(*who)), frame.time_s, &message)?;
        }
        Ok(())
    }

    /// Places the scanners in the middle of their robots, from which ranges are reported.
    fn write_mounts(&mut self, frame: &Frame) -> Result<(), Error> {
        let mount = |scan: &Scan| TransformStamped {
            header: header(frame.time_s, base_frame(scan.of)),
            child_frame_id: scan_frame(scan),
            transform: ros_pose(&Pose::from_position([0.0; 3])),
        };
        let transforms = frame.scans.iter().map(mount).collect();
        self.write("/tf_static", frame.time_s, &TfMessage { transforms })
    }

    fn write_scans(&mut self, frame: &Frame) -> Result<(), Error> {
        for scan in &frame.scans {
            let topic = format!("/{}", scan_frame(scan));
            self.write(&topic, frame.time_s, &laser_scan(frame.time_s, scan))?;
        }
        Ok(())
    }
}

impl FrameSink for BagSink {
    fn interval(&self) -> Cycle {
        self.every
    }

    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let mut frame = run.frame(FRAME_OPTIONS);
        if frame.odometry.is_empty() {
            let cause = format!("the world {} has no robots with odometry", run.world_name());
            let remedy = "export a run of robots, or use --to mcap; of arms, use --to trajectory";
            return Err(InputError::new("--to rosbag", cause, remedy).into());
        }
        mount_on_robots(&mut frame);
        if self.before.is_none() {
            self.write_mounts(&frame)?;
        }
        self.write_odometry(&frame)?;
        self.write_truth(&frame)?;
        self.write_scans(&frame)?;
        self.before = Some((frame.time_s, frame.odometry));
        Ok(())
    }
}

/// Names the robot that carries each scanner: in a chain of robots, scans are those of the connector that a robot keeps
/// to.
fn mount_on_robots(frame: &mut Frame) {
    for scan in &mut frame.scans {
        let [number, part] = [Some(scan.of.number), scan.of.part];
        let mut robots = frame.odometry.iter().map(|(who, _)| *who);
        let carrier = robots.find(|who| [Some(who.number), who.part] == [number, part]);
        scan.of = carrier.unwrap_or(scan.of);
    }
}

/// Returns the map with a wall around it, because nothing leaves the floor, not even a beam.
fn map_files_with_border(floor: &OccupancyGrid) -> [(&'static str, Vec<u8>); 2] {
    let [width, height] = [floor.width + 2, floor.height + 2];
    let mut cells = vec![Cell::Wall; width as usize * height as usize];
    let inside = cells.chunks_exact_mut(width as usize).skip(1);
    for (row, boxes) in inside.zip(floor.boxes.chunks_exact(floor.width.max(1) as usize)) {
        for (cell, occupancy) in row[1..].iter_mut().zip(boxes) {
            *cell = match occupancy {
                Occupancy::Free => Cell::Free,
                Occupancy::Wall => Cell::Wall,
                Occupancy::Unknown => Cell::Unknown,
            };
        }
    }
    let origin_m = floor.plane.transform_point([-floor.box_m; 2]);
    map_files([width, height], floor.box_m, Isometry2 { origin_m, ..floor.plane }, &cells)
}

fn to_ns(time_s: f64) -> u64 {
    (time_s.max(0.0) * 1e9).round() as u64
}

fn header(time_s: f64, frame_id: String) -> Header {
    Header { stamp: Time::from_ns(to_ns(time_s)), frame_id }
}

/// Returns e.g. `robot_3`, or `robot_0_3` for a part of a body: names in ROS begin with a letter and have no spaces.
fn namespace(who: BodyId) -> String {
    let part = who.part.map_or(String::new(), |part| format!("_{part}"));
    format!("{}_{}{part}", ros_name(&who.kind.to_string()), who.number)
}

fn odometry_frame(who: BodyId) -> String {
    format!("{}/odom", namespace(who))
}

fn base_frame(who: BodyId) -> String {
    format!("{}/base_link", namespace(who))
}

fn scan_frame(scan: &Scan) -> String {
    format!("{}/{}", namespace(scan.of), ros_name(&scan.sensor))
}

fn ros_pose(pose: &Pose) -> RosPose {
    RosPose { position: pose.at_m, orientation: pose.turn }
}

fn yaw_rad(pose: &Pose) -> f64 {
    let ahead = pose.rotate([1.0, 0.0, 0.0]);
    sidestep_kernel::math::atan2(ahead[1], ahead[0])
}

/// Returns a scan; directions without a beam have no number.
fn laser_scan(time_s: f64, scan: &Scan) -> LaserScan {
    let (first_rad, last_rad, ranges_m) = scan.resample_evenly(f64::NAN);
    let steps = ranges_m.len().max(2) - 1;
    LaserScan {
        header: header(time_s, scan_frame(scan)),
        angle_min_rad: first_rad as f32,
        angle_max_rad: last_rad as f32,
        angle_increment_rad: ((last_rad - first_rad) / steps as f64) as f32,
        time_increment_s: 0.0,
        scan_time_s: 0.0,
        range_min_m: 0.0,
        range_max_m: scan.range_m as f32,
        ranges_m: ranges_m.into_iter().map(|range_m| range_m as f32).collect(),
        intensities: Vec::new(),
    }
}
