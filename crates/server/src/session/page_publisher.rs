//! The output of a session to its page: frames for which there is credit, and the status when it changes.

use crate::MAX_FRAMES_PER_S;
use crate::encode::{FrameEncoder, scan};
use crate::event_store::EventStore;
use crate::outbox::Outbox;
use crate::protocol::{FrameText, ServerNotification, SessionId, SessionStatus};
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{BodyId, Frame, FrameOptions, ScanSelection, Scenery};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two frames.
const FRAME_INTERVAL: Duration = Duration::from_nanos(1_000_000_000 / MAX_FRAMES_PER_S as u64);
/// Time between two reports of the status: faster changes of numbers cannot be read.
const STATUS_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two transfers of events where there is no credit for frames: a simulation keeps only the last some thousands.
const EVENTS_INTERVAL: Duration = Duration::from_millis(250);
/// Maximum credit; any beyond it is ignored, so that sums cannot overflow.
const MAX_CREDIT: u32 = 1000;
/// Maximum number of bodies with scans in a frame: a scan has up to hundreds of beams as text.
pub(super) const MAX_SCANNED_BODIES: usize = 16;

/// A page's view of one session.
pub(super) struct SessionUpdatePublisher {
    session: SessionId,
    outbox: Arc<Outbox>,
    encoder: FrameEncoder,
    /// Number of frames that the page is ready to receive; each one sent takes one.
    credit: u32,
    /// Number of frames that were due and could not be sent.
    left_out: u32,
    /// The bodies with scans in frames, as the page selected them.
    scans_of: Vec<BodyId>,
    /// Whether the last frame is out of date.
    is_stale: bool,
    /// Whether the run has advanced since a frame was last due.
    has_moved: bool,
    frame_due: Instant,
    events_due: Instant,
    status_due: Instant,
    last_status: Option<SessionStatus>,
}

impl SessionUpdatePublisher {
    pub(super) fn new(session: SessionId, outbox: Arc<Outbox>, scenery: &Scenery) -> Self {
        let now = Instant::now();
        Self {
            session,
            outbox,
            encoder: FrameEncoder::new(session, scenery),
            credit: 0,
            left_out: 0,
            scans_of: Vec::new(),
            is_stale: true,
            has_moved: false,
            frame_due: now,
            events_due: now,
            status_due: now,
            last_status: None,
        }
    }

    /// Switches to another run.
    pub(super) fn restart(&mut self, scenery: &Scenery) {
        // An unsent frame of the run before is of no use, and its credit is given back.
        if self.outbox.discard_update(self.session) {
            self.credit += 1;
        }
        self.encoder.restart(scenery);
        self.is_stale = true;
        self.has_moved = false;
        self.last_status = None;
    }

    /// Records that the run is at another cycle.
    pub(super) fn mark_cycle_changed(&mut self) {
        self.is_stale = true;
        self.has_moved = true;
    }

    /// Requests a frame even if the run has not moved.
    pub(super) fn request_frame(&mut self) {
        self.is_stale = true;
    }

    pub(super) fn add_credit(&mut self, frames: u32) {
        self.credit = self.credit.saturating_add(frames).min(MAX_CREDIT);
    }

    /// Selects the bodies with scans, from the next frame on.
    pub(super) fn set_scanned_bodies(&mut self, scans_of: Vec<BodyId>) {
        self.scans_of = scans_of;
        self.is_stale = true;
    }

    /// Sends a frame if one is due and there is credit.
    pub(super) fn send_due_frame(
        &mut self,
        run: &mut dyn Simulation,
        log: &mut EventStore,
        now: Instant,
    ) {
        if !self.is_due(now) {
            return;
        }
        if !self.admit_frame(now) {
            if now >= self.events_due {
                self.record_events(run, log, now);
            }
            return;
        }
        self.events_due = now + EVENTS_INTERVAL;
        let mut frame = run.frame(FrameOptions { scans: ScanSelection::Of(self.scans_of.clone()) });
        log.record(&mut frame);
        self.send_frame(&frame, log);
    }

    /// Forwards a frame of another process, whose events are recorded already, if one is due and there is credit.
    pub(super) fn forward_frame(&mut self, frame: &Frame, log: &mut EventStore, now: Instant) {
        if self.is_due(now) && self.admit_frame(now) {
            self.send_frame(frame, log);
        }
    }

    fn is_due(&self, now: Instant) -> bool {
        self.is_stale && now >= self.frame_due
    }

    /// Returns whether there is credit for the frame that is due. One for which there is none is counted as left out.
    fn admit_frame(&mut self, now: Instant) -> bool {
        let has_credit = self.credit > 0;
        if has_credit {
            self.is_stale = false;
            self.has_moved = false;
        } else if std::mem::take(&mut self.has_moved) {
            self.left_out = self.left_out.saturating_add(1);
        } else {
            return false;
        }
        // Counted from the time when it was due, so that small delays do not lower the rate.
        self.frame_due = (self.frame_due + FRAME_INTERVAL).max(now);
        has_credit
    }

    fn send_frame(&mut self, frame: &Frame, log: &mut EventStore) {
        let (events, events_left_out) = log.take_unsent();
        let scans = frame.scans.iter().map(scan).collect();
        let text = FrameText { scans, events, events_left_out };
        let (bodies, bytes) = self.encoder.encode(frame, &text, self.left_out);
        let bodies = bodies.map(ServerNotification::Bodies);
        let replaces_unsent = self.outbox.send_frame(self.session, bodies.as_ref(), bytes);
        if replaces_unsent {
            // The replaced frame has already cost its credit.
            self.left_out = self.left_out.saturating_add(1);
        } else {
            self.credit -= 1;
        }
    }

    /// Takes the events of a run without showing a frame.
    pub(super) fn record_events(
        &mut self,
        run: &mut dyn Simulation,
        log: &mut EventStore,
        now: Instant,
    ) {
        log.record(&mut run.frame(FrameOptions::WITHOUT_SCANS));
        self.events_due = now + EVENTS_INTERVAL;
    }

    /// Reports the status, if it has changed and a report is due; a change of the session's activity, or of
    /// the cycle at which it is paused, is reported at once.
    pub(super) fn report_status(&mut self, status: SessionStatus, now: Instant) {
        let is_same = self.last_status.as_ref() == Some(&status);
        let is_urgent = self
            .last_status
            .as_ref()
            .is_none_or(|last| last.state != status.state || last.digest != status.digest);
        if is_same || (now < self.status_due && !is_urgent) {
            return;
        }
        self.outbox.send_status(self.session, &ServerNotification::Status(status.clone()));
        self.last_status = Some(status);
        self.status_due = now + STATUS_INTERVAL;
    }

    /// Returns whether the last reported status differs from this one.
    pub(super) fn is_new_status(&self, status: &SessionStatus) -> bool {
        self.last_status.as_ref() != Some(status)
    }

    /// Returns the last reported status; `None` before the first report.
    pub(super) fn last_reported(&self) -> Option<SessionStatus> {
        self.last_status.clone()
    }

    /// Returns when a status may be reported again, if none changes at once.
    pub(super) fn status_due_time(&self) -> Instant {
        self.status_due
    }

    /// Returns when a frame can be sent, if there is one to send.
    pub(super) fn frame_due(&self) -> Option<Instant> {
        (self.is_stale && self.credit > 0).then_some(self.frame_due)
    }
}
