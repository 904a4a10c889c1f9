//! Views of the fleet for its viewers.

use crate::wire::view_server::{VIEWER_TIMEOUT, ViewServer};
use sidestep::kernel::Cycle;
use sidestep::kernel::view::{Frame, LogEvent};
use sidestep_session::fleet::{FleetFrame, FleetScene, FleetStatus};

/// Maximum number of events in a view, which has the last ones: a viewer may have missed any of the views before.
const MAX_EVENTS: usize = 200;

/// The newest frame and the last events, from which views are made.
#[derive(Debug)]
pub(super) struct ViewPublisher {
    server: ViewServer,
    /// Number of the last view.
    number: u64,
    /// The newest frame, without its events.
    frame: Option<Frame>,
    events: Vec<LogEvent>,
}

impl ViewPublisher {
    pub(super) fn new(server: ViewServer) -> Self {
        Self { server, number: 0, frame: None, events: Vec::new() }
    }

    /// Returns whether there is a viewer, and no frame of this cycle yet.
    pub(super) fn wants_frame(&self, cycle: Cycle) -> bool {
        self.frame.as_ref().is_none_or(|frame| frame.cycle != cycle) && self.server.is_watched()
    }

    /// Receives a frame, and keeps its events.
    pub(super) fn push_frame(&mut self, mut frame: Frame) {
        self.events.append(&mut frame.log);
        let excess = self.events.len().saturating_sub(MAX_EVENTS);
        self.events.drain(..excess);
        frame.log_left_out += excess as u64;
        self.frame = Some(frame);
    }

    /// Publishes the newest frame with the present state of the nodes.
    pub(super) fn publish_view(&mut self, fleet: &FleetStatus, is_over: bool) {
        let Some(frame) = &self.frame else { return };
        self.number += 1;
        let frame = Frame { log: self.events.clone(), ..frame.clone() };
        let view = FleetFrame { number: self.number, frame, fleet: fleet.clone(), is_over };
        self.server.set_latest(self.number, to_json(&view));
    }

    pub(super) fn is_watched(&self) -> bool {
        self.server.is_watched()
    }

    /// Waits a little until the last view was fetched.
    pub(super) fn wait_for_viewers(&self) {
        self.server.wait_until_fetched(VIEWER_TIMEOUT);
    }
}

pub(super) fn scene_json(scene: &FleetScene) -> String {
    to_json(scene)
}

fn to_json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("scenes and views are plain data")
}
