//! A run as a ROS 2 bag: the records that its robots would have made, and the truth.

use super::FrameSink;
use super::mcap::FRAME_OPTIONS;
use crate::Error;
use crate::VERSION;
use crate::ros::{RobotTopics, RosMessage, map_files_with_border, mounts, static_frames};
use sidestep_kernel::{Cycle, InputError, Simulation};
use sidestep_record::{BagSchema, BagWriter};
use std::path::Path;

/// A bag that is written while a run advances.
pub(crate) struct BagSink {
    writer: BagWriter,
    every: Cycle,
    robots: RobotTopics,
    has_mounts: bool,
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
        let writer = BagWriter::create(folder, VERSION)?;
        Ok(Self { writer, every, robots: RobotTopics::default(), has_mounts: false })
    }

    /// Finishes the bag.
    ///
    /// # Errors
    /// An I/O error.
    pub(crate) fn finish(self) -> Result<(), Error> {
        Ok(self.writer.finish()?)
    }

    fn write(&mut self, message: &RosMessage) -> Result<(), Error> {
        let schema = BagSchema { name: message.type_name, definition: message.definition };
        Ok(self.writer.write(&message.topic, schema, message.time_ns, &message.bytes)?)
    }
}

impl FrameSink for BagSink {
    fn interval(&self) -> Cycle {
        self.every
    }

    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let frame = run.frame(FRAME_OPTIONS);
        if frame.odometry.is_empty() {
            let cause = format!("the world {} has no robots with odometry", run.world_name());
            let remedy = "export a run of robots, or use --to mcap; of arms, use --to trajectory";
            return Err(InputError::new("--to rosbag", cause, remedy).into());
        }
        if !self.has_mounts {
            self.write(&static_frames(frame.time_s, mounts(&frame)))?;
            self.has_mounts = true;
        }
        for message in self.robots.messages(&frame) {
            self.write(&message)?;
        }
        Ok(())
    }
}
