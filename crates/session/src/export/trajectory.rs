//! The motions of arms as ROS 2 and others take them: a folder that is a bag, with a CSV and a JSON file for each arm.
//!
//! The bag has `/NAME/joint_trajectory` (`trajectory_msgs/msg/JointTrajectory`), one message with all points at the
//! time of the first, and `/NAME/joint_states` (`sensor_msgs/msg/JointState`), one for each point.

use super::target::Target;
use super::{ExportContext, ExportResult};
use crate::files::write_file;
use crate::trajectory::{ArmTrajectory, arm_trajectories};
use crate::{Error, VERSION};
use serde_json::{Value, json};
use sidestep_import::bag::cdr::encode;
use sidestep_import::bag::messages::{
    Header, JointState, JointTrajectory, JointTrajectoryPoint, Message, Time,
};
use sidestep_kernel::InputError;
use sidestep_record::{BagSchema, BagWriter};
use std::io::Write;
use std::path::Path;

/// Exports the motions of all arms.
pub(super) fn export(job: &ExportContext<'_>) -> Result<ExportResult, Error> {
    let cycles = job.span.from..=job.span.until;
    let arms = arm_trajectories(job.recorded, cycles, job.wanted.every.unwrap_or(1))?;
    if arms.is_empty() {
        let cause = "no joints are recorded in these cycles";
        let remedy = "give --from and --until around a cycle that is a multiple of record.every and of --every";
        return Err(InputError::new(job.recorded.path.display(), cause, remedy).into());
    }
    let target = Target::for_folder(job, "-trajectory")?;
    target.write_folder(job.watcher, |folder| {
        for arm in &arms {
            write_csv(arm, &folder.join(format!("{}.csv", arm.name)))?;
            write_json(arm, &folder.join(format!("{}.json", arm.name)))?;
        }
        write_bag(&arms, folder)
    })?;
    Ok(ExportResult::single_file(target.path(), false))
}

fn write_csv(arm: &ArmTrajectory, to: &Path) -> Result<(), Error> {
    write_file(to, |out| {
        let mut csv = csv::Writer::from_writer(out);
        let quantities = ["position", "velocity", "acceleration"];
        let columns = arm
            .joints
            .iter()
            .flat_map(|joint| quantities.map(|quantity| format!("{joint}.{quantity}")));
        csv.write_record(std::iter::once("time_s".to_string()).chain(columns))?;
        for (i, time_s) in arm.times_s.iter().enumerate() {
            let values = (0..arm.joints.len()).flat_map(|joint| {
                [arm.positions[i][joint], arm.velocities[i][joint], arm.accelerations[i][joint]]
            });
            let fields = std::iter::once(*time_s).chain(values).map(|value| value.to_string());
            csv.write_record(fields)?;
        }
        csv.flush()
    })
    .map_err(|e| Error::cannot_store(to, &e))
}

/// Writes a trajectory in the shape of its ROS message.
fn write_json(arm: &ArmTrajectory, to: &Path) -> Result<(), Error> {
    let points = (0..arm.times_s.len()).map(|i| {
        let time = time_from_start(arm, i);
        json!({
            "positions": arm.positions[i],
            "velocities": arm.velocities[i],
            "accelerations": arm.accelerations[i],
            "time_from_start": { "sec": time.sec, "nanosec": time.nanosec },
        })
    });
    let trajectory = json!({
        "joint_names": arm.joints,
        "points": points.collect::<Vec<Value>>(),
    });
    write_file(to, |out| {
        serde_json::to_writer(&mut *out, &trajectory)?;
        out.write_all(b"\n")
    })
    .map_err(|e| Error::cannot_store(to, &e))
}

fn write_bag(arms: &[ArmTrajectory], folder: &Path) -> Result<(), Error> {
    let mut bag = BagWriter::create(folder, VERSION)?;
    for arm in arms {
        let topic = format!("/{}/joint_trajectory", arm.name);
        write(&mut bag, &topic, arm.times_s[0], &trajectory_message(arm))?;
    }
    let mut order: Vec<(u64, &ArmTrajectory, usize)> = Vec::new();
    for arm in arms {
        order.extend(arm.times_s.iter().enumerate().map(|(i, time_s)| (to_ns(*time_s), arm, i)));
    }
    // Players of bags want messages by time; at one time arms stay in their order.
    order.sort_by_key(|(time_ns, ..)| *time_ns);
    for (_, arm, i) in order {
        let state = JointState {
            header: header(arm.times_s[i]),
            name: arm.joints.clone(),
            position: arm.positions[i].clone(),
            velocity: arm.velocities[i].clone(),
            effort: Vec::new(),
        };
        write(&mut bag, &format!("/{}/joint_states", arm.name), arm.times_s[i], &state)?;
    }
    Ok(bag.finish()?)
}

fn write<T: Message>(
    bag: &mut BagWriter,
    topic: &str,
    time_s: f64,
    message: &T,
) -> Result<(), Error> {
    let schema = BagSchema { name: T::NAME, definition: T::DEFINITION };
    Ok(bag.write(topic, schema, to_ns(time_s), &encode(message))?)
}

fn trajectory_message(arm: &ArmTrajectory) -> JointTrajectory {
    let point = |i: usize| JointTrajectoryPoint {
        positions: arm.positions[i].clone(),
        velocities: arm.velocities[i].clone(),
        accelerations: arm.accelerations[i].clone(),
        effort: Vec::new(),
        time_from_start: time_from_start(arm, i),
    };
    JointTrajectory {
        header: header(arm.times_s[0]),
        joint_names: arm.joints.clone(),
        points: (0..arm.times_s.len()).map(point).collect(),
    }
}

/// Returns the time of a point since the first one, to the nanosecond.
fn time_from_start(arm: &ArmTrajectory, i: usize) -> Time {
    Time::from_ns(to_ns(arm.times_s[i]) - to_ns(arm.times_s[0]))
}

fn header(time_s: f64) -> Header {
    Header { stamp: Time::from_ns(to_ns(time_s)), frame_id: String::new() }
}

fn to_ns(time_s: f64) -> u64 {
    (time_s.max(0.0) * 1e9).round() as u64
}
