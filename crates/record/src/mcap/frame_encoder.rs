//! The messages of each topic, for any taker.

use std::collections::BTreeSet;

use foxglove::Encode;
use foxglove::messages::{FrameTransforms, Grid, LaserScan, Log, PosesInFrame, SceneUpdate};
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::view::{Frame, Scenery};

use super::messages;

/// A taker of messages: a file, or viewers.
pub(super) trait MessageSink {
    /// Takes a message of a topic.
    ///
    /// # Errors
    /// When it cannot be stored.
    fn write<T: Encode>(
        &mut self,
        topic: &str,
        log_time: u64,
        message: &T,
    ) -> Result<(), RecordError>;

    /// Returns whether a message may get lost, so that each has to stand for itself.
    fn is_lossy(&self) -> bool {
        false
    }
}

/// The state that goes from frame to frame.
pub(super) struct FrameEncoder {
    pub(super) cycle_s: f64,
    dimensions: u8,
    /// Bodies of the previous frame, by name.
    shown: BTreeSet<String>,
}

impl FrameEncoder {
    pub(super) fn new(scenery: &Scenery) -> Self {
        let Scenery { cycle_s, dimensions, .. } = *scenery;
        Self { cycle_s, dimensions, shown: BTreeSet::new() }
    }

    /// Passes on everything that never moves.
    ///
    /// # Errors
    /// Those of the sink.
    pub(super) fn write_scenery(
        &self,
        scenery: &Scenery,
        sink: &mut impl MessageSink,
    ) -> Result<(), RecordError> {
        if let Some(floor) = &scenery.floor {
            sink.write::<Grid>("/map", 0, &messages::grid(floor))?;
        }
        sink.write::<SceneUpdate>("/scenery", 0, &messages::scenery(scenery))
    }

    /// Passes on a frame; frames come in order of time.
    ///
    /// # Errors
    /// Those of the sink.
    pub(super) fn write_frame(
        &mut self,
        frame: &Frame,
        sink: &mut impl MessageSink,
    ) -> Result<(), RecordError> {
        for entry in messages::log(frame, self.cycle_s) {
            sink.write::<Log>("/log", messages::log_time_ns(&entry), &entry)?;
        }
        let now_ns = messages::to_ns(frame.time_s);
        let mut scene = messages::scene(frame, self.dimensions, &mut self.shown);
        if sink.is_lossy() {
            scene.deletions = messages::delete_all(now_ns);
        }
        sink.write::<SceneUpdate>("/scene", now_ns, &scene)?;
        sink.write::<FrameTransforms>("/tf", now_ns, &messages::transforms(frame))?;
        for (kind, poses) in messages::poses_by_kind(frame) {
            sink.write::<PosesInFrame>(&format!("/poses/{kind}"), now_ns, &poses)?;
        }
        for scan in &frame.scans {
            let topic = format!("/scan/{}", scan.name());
            sink.write::<LaserScan>(&topic, now_ns, &messages::laser_scan(scan, now_ns))?;
        }
        Ok(())
    }
}
