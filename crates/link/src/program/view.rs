//! The fleet as shown to its watchers.

use crate::wire::view_server::ViewServer;
use sidestep::kernel::Cycle;
use sidestep::kernel::view::{Frame, LogEvent};
use sidestep_session::fleet::{FleetFrame, FleetScene, FleetStatus};
use std::time::Duration;

/// Number of events that a view holds, the last ones.
const MAX_EVENTS: usize = 200;

/// Time that the last view stays for its watchers at the end.
const LAST_VIEW_TIMEOUT: Duration = Duration::from_secs(1);

/// The view of a fleet, shown at a window.
#[derive(Debug)]
pub(super) struct ViewPublisher {
    window: ViewServer,
    number: u64,
    /// The newest frame, without its events.
    frame: Option<Frame>,
    events: Vec<LogEvent>,
}

impl ViewPublisher {
    pub(super) fn new(window: ViewServer) -> Self {
        Self { window, number: 0, frame: None, events: Vec::new() }
    }

    /// Returns whether a watcher has no frame of this cycle yet.
    pub(super) fn wants_frame(&self, cycle: Cycle) -> bool {
        self.frame.as_ref().is_none_or(|frame| frame.cycle != cycle) && self.window.is_watched()
    }

    /// Takes a frame.
    pub(super) fn push_frame(&mut self, mut frame: Frame) {
        self.events.append(&mut frame.log);
        let too_many = self.events.len().saturating_sub(MAX_EVENTS);
        self.events.drain(..too_many);
        frame.log_left_out += too_many as u64;
        self.frame = Some(frame);
    }

    /// Shows the newest frame with the nodes as they are now.
    pub(super) fn publish(&mut self, fleet: &FleetStatus, is_over: bool) {
        let Some(frame) = &self.frame else { return };
        self.number += 1;
        let frame = Frame { log: self.events.clone(), ..frame.clone() };
        let seen = FleetFrame { number: self.number, frame, fleet: fleet.clone(), is_over };
        self.window.publish(self.number, to_json(&seen));
    }

    /// Returns whether there is a watcher.
    pub(super) fn is_watched(&self) -> bool {
        self.window.is_watched()
    }

    /// Leaves the last view to its watchers for a while.
    pub(super) fn wait_for_viewers(&self) {
        self.window.wait_until_fetched(LAST_VIEW_TIMEOUT);
    }
}

/// Returns the scene as a text.
pub(super) fn scene_json(staged: &FleetScene) -> String {
    to_json(staged)
}

fn to_json(what: &impl serde::Serialize) -> String {
    serde_json::to_string(what).expect("what is seen is plain data")
}
