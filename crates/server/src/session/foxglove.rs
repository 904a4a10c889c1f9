//! Viewers by Foxglove's protocol, which watch the session that was opened last.

use crate::event_store::EventStore;
use crate::protocol::SessionId;
use sidestep_kernel::Simulation;
use sidestep_kernel::view::Scenery;
use sidestep_session::{
    Error, Playback, PlaybackPhase, PlaybackRequest, ViewerAddress, ViewerOptions, ViewerServer,
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time between two checks of viewers' requests: a key press in a viewer seems to act at once.
const POLL_INTERVAL: Duration = Duration::from_millis(40);

/// The one address at which viewers are served. Sessions share it: the one opened last has the lease.
pub(crate) struct FoxgloveHost {
    address: ViewerAddress,
    current: Mutex<Option<(SessionId, ViewerServer)>>,
}

impl FoxgloveHost {
    /// Returns a host that no session has leased yet.
    pub(crate) fn new(address: ViewerAddress) -> Self {
        Self { address, current: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Option<(SessionId, ViewerServer)>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A session's lease of the host, which the next session takes over.
pub(super) struct FoxgloveLease {
    /// None where viewers are not served.
    host: Option<Arc<FoxgloveHost>>,
    session: SessionId,
    due: Instant,
}

impl Drop for FoxgloveLease {
    fn drop(&mut self) {
        let Some(host) = &self.host else { return };
        let mut current = host.lock();
        if current.as_ref().is_some_and(|(session, _)| *session == self.session) {
            *current = None;
        }
    }
}

impl FoxgloveLease {
    pub(super) fn new(host: Option<Arc<FoxgloveHost>>, session: SessionId) -> Self {
        Self { host, session, due: Instant::now() }
    }

    /// Returns whether viewers are served at all.
    pub(super) fn is_enabled(&self) -> bool {
        self.host.is_some()
    }

    /// Takes over the lease for a run of a given number of simulated seconds.
    ///
    /// # Errors
    /// When another program uses the address.
    pub(super) fn start(
        &self,
        run: &mut dyn Simulation,
        scenery: &Scenery,
        end_s: f64,
    ) -> Result<(), Error> {
        let Some(host) = &self.host else { return Ok(()) };
        let mut current = host.lock();
        // A server announces the length and the topics of one run. Viewers reconnect to the new one.
        *current = None;
        let playback = Playback {
            playing: PlaybackPhase::Paused,
            time_s: run.cycle() as f64 * scenery.cycle_s,
            speed: 1.0,
            did_seek: false,
        };
        let options = ViewerOptions { end_s, can_seek: true, playback };
        let viewers = ViewerServer::start(&host.address, run, scenery, options)?;
        *current = Some((self.session, viewers));
        Ok(())
    }

    /// Sends the run to its viewers, and returns their request, if there is one.
    pub(super) fn update_viewers(
        &mut self,
        run: &mut dyn Simulation,
        log: &mut EventStore,
        playback: Playback,
        now: Instant,
    ) -> Option<PlaybackRequest> {
        let mut current = self.host.as_ref()?.lock();
        let (_, viewers) = current.as_mut().filter(|(session, _)| *session == self.session)?;
        self.due = now + POLL_INTERVAL;
        if viewers.is_frame_due(playback.time_s, now) {
            let mut frame = run.frame(ViewerServer::FRAME_OPTIONS);
            log.record(&mut frame);
            // Those of the frame alone would lack the events of frames that only the page got.
            (frame.log, frame.log_left_out) = log.take_for_viewers();
            viewers.send_frame(frame, now);
        }
        viewers.send_playback(playback, now);
        viewers.take_request()
    }

    /// Returns when to check viewers' requests; `None` where viewers are not served.
    pub(super) fn next_update(&self) -> Option<Instant> {
        self.is_enabled().then_some(self.due)
    }
}
