//! Viewers of Foxglove's protocol, which watch the session that was opened last.

use crate::event_store::EventStore;
use crate::protocol::SessionId;
use sidestep_kernel::Simulation;
use sidestep_kernel::view::Scenery;
use sidestep_session::{
    Error, Playback, PlaybackPhase, PlaybackRequest, ViewerAddress, ViewerServer,
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The time between two checks of viewers' wishes.
const POLL_INTERVAL: Duration = Duration::from_millis(40);

/// The one place at which viewers are served. Sessions share it: it goes to the one opened last.
pub(crate) struct FoxgloveHost {
    at: ViewerAddress,
    shown: Mutex<Option<(SessionId, ViewerServer)>>,
}

impl FoxgloveHost {
    /// Returns the place at an address that is free.
    pub(crate) fn new(at: ViewerAddress) -> Self {
        Self { at, shown: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Option<(SessionId, ViewerServer)>> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The side of one session.
pub(super) struct FoxgloveLease {
    showcase: Option<Arc<FoxgloveHost>>,
    session: SessionId,
    due: Instant,
}

impl Drop for FoxgloveLease {
    fn drop(&mut self) {
        let Some(showcase) = &self.showcase else { return };
        let mut shown = showcase.lock();
        if shown.as_ref().is_some_and(|(of, _)| *of == self.session) {
            *shown = None;
        }
    }
}

impl FoxgloveLease {
    pub(super) fn new(showcase: Option<Arc<FoxgloveHost>>, session: SessionId) -> Self {
        Self { showcase, session, due: Instant::now() }
    }

    /// Returns whether there may be viewers at all.
    pub(super) fn is_enabled(&self) -> bool {
        self.showcase.is_some()
    }

    /// Takes the place for a run of a given number of simulated seconds.
    ///
    /// # Errors
    /// When another program has taken the address.
    pub(super) fn start(
        &self,
        run: &mut dyn Simulation,
        scenery: &Scenery,
        end_s: f64,
    ) -> Result<(), Error> {
        let Some(showcase) = &self.showcase else { return Ok(()) };
        let mut shown = showcase.lock();
        // Viewers reconnect to a server that tells the new length and the new topics.
        *shown = None;
        let (playing, time_s) = (PlaybackPhase::Paused, run.cycle() as f64 * scenery.cycle_s);
        let now = Playback { playing, time_s, speed: 1.0, did_seek: false };
        let viewers = ViewerServer::start(&showcase.at, run, scenery, end_s, true, now)?;
        *shown = Some((self.session, viewers));
        Ok(())
    }

    /// Shows the run to its viewers, and returns their wishes.
    pub(super) fn update(
        &mut self,
        run: &mut dyn Simulation,
        log: &mut EventStore,
        playback: Playback,
        now: Instant,
    ) -> Option<PlaybackRequest> {
        let mut shown = self.showcase.as_ref()?.lock();
        let (_, viewers) = shown.as_mut().filter(|(of, _)| *of == self.session)?;
        self.due = now + POLL_INTERVAL;
        if viewers.is_frame_due(playback.time_s, now) {
            let mut frame = run.frame(ViewerServer::FRAME_OPTIONS);
            log.record(&mut frame);
            (frame.log, frame.log_left_out) = log.take_for_viewers();
            viewers.send_frame(frame, now);
        }
        viewers.send_playback(playback, now);
        viewers.take_request()
    }

    /// Returns when to check viewers' wishes.
    pub(super) fn next_update(&self) -> Option<Instant> {
        self.is_enabled().then_some(self.due)
    }
}
