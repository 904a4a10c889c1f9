//! The messages of each topic, for any taker.

use std::collections::{BTreeMap, BTreeSet};

use foxglove::Encode;
use foxglove::messages::{
    FrameTransforms, Grid, LaserScan, LocationFix, Log, PosesInFrame, SceneUpdate,
};
use sidestep_kernel::ports::RecordError;
use sidestep_kernel::view::{Body, BodyKind, EarthChart, Frame, Scenery};

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
    /// Time of the run's start in nanoseconds since 1970, UTC, or 0.
    pub(super) start_ns: u64,
    dimensions: u8,
    /// The map of the earth that positions are on, if they are.
    chart: Option<EarthChart>,
    /// Names of bodies that have their own.
    names: BTreeMap<(BodyKind, u32), String>,
    /// Bodies of the previous frame, by name.
    shown: BTreeSet<String>,
}

impl FrameEncoder {
    /// Returns an encoder of frames whose times are those since the start of the run.
    pub(super) fn new(scenery: &Scenery) -> Self {
        let Scenery { cycle_s, dimensions, earth, .. } = *scenery;
        let names = scenery.names.iter();
        let names = names.map(|(kind, number, name)| ((*kind, *number), name.clone())).collect();
        Self { cycle_s, start_ns: 0, dimensions, chart: earth.chart, names, shown: BTreeSet::new() }
    }

    /// Returns an encoder of frames whose times are UTC, where the run has a date.
    pub(super) fn with_utc(scenery: &Scenery) -> Self {
        let start_ns = scenery.earth.start_utc_s.map_or(0, messages::to_ns);
        Self { start_ns, ..Self::new(scenery) }
    }

    /// Returns the topic of where on earth a body is: by its own name, or its kind and number.
    fn fix_topic(&self, body: &Body) -> String {
        match self.names.get(&(body.kind, body.number)) {
            Some(name) => format!("/fix/{name}"),
            None => format!("/fix/{}", body.name()),
        }
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
            let grid = messages::grid(floor, self.start_ns);
            sink.write::<Grid>("/map", self.start_ns, &grid)?;
        }
        let scenery = messages::scenery(scenery, self.start_ns);
        sink.write::<SceneUpdate>("/scenery", self.start_ns, &scenery)
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
        for entry in messages::log(frame, self.cycle_s, self.start_ns) {
            sink.write::<Log>("/log", messages::log_time_ns(&entry), &entry)?;
        }
        let now_ns = self.start_ns + messages::to_ns(frame.time_s);
        let mut scene = messages::scene(frame, now_ns, self.dimensions, &mut self.shown);
        if sink.is_lossy() {
            scene.deletions = messages::delete_all(now_ns);
        }
        sink.write::<SceneUpdate>("/scene", now_ns, &scene)?;
        sink.write::<FrameTransforms>("/tf", now_ns, &messages::transforms(frame, now_ns))?;
        for (kind, poses) in messages::poses_by_kind(frame, now_ns) {
            sink.write::<PosesInFrame>(&format!("/poses/{kind}"), now_ns, &poses)?;
        }
        if let Some(chart) = &self.chart {
            for (body, fix) in messages::location_fixes(frame, chart, now_ns) {
                sink.write::<LocationFix>(&self.fix_topic(body), now_ns, &fix)?;
            }
        }
        for scan in &frame.scans {
            let topic = format!("/scan/{}", scan.name());
            sink.write::<LaserScan>(&topic, now_ns, &messages::laser_scan(scan, now_ns))?;
        }
        Ok(())
    }
}
