//! Viewers of Foxglove's protocol, which watch the session that was opened last.

use crate::chronicle::Chronicle;
use crate::protocol::SessionId;
use sidestep::kernel::Simulation;
use sidestep::kernel::view::Scenery;
use sidestep_session::{Error, Playback, Playing, Steering, Viewers, ViewersAt};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The time between two checks of viewers' wishes.
const LOOK: Duration = Duration::from_millis(40);

/// The one place at which viewers are served. Sessions share it: it goes to the one opened last.
pub(crate) struct Showcase {
    at: ViewersAt,
    shown: Mutex<Option<(SessionId, Viewers)>>,
}

impl Showcase {
    /// Returns the place at an address that is free.
    pub(crate) fn new(at: ViewersAt) -> Self {
        Self { at, shown: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Option<(SessionId, Viewers)>> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The side of one session.
pub(super) struct Showing {
    showcase: Option<Arc<Showcase>>,
    session: SessionId,
    due: Instant,
}

impl Drop for Showing {
    fn drop(&mut self) {
        let Some(showcase) = &self.showcase else { return };
        let mut shown = showcase.lock();
        if shown.as_ref().is_some_and(|(of, _)| *of == self.session) {
            *shown = None;
        }
    }
}

impl Showing {
    pub(super) fn new(showcase: Option<Arc<Showcase>>, session: SessionId) -> Self {
        Self { showcase, session, due: Instant::now() }
    }

    /// Returns whether there may be viewers at all.
    pub(super) fn is_possible(&self) -> bool {
        self.showcase.is_some()
    }

    /// Takes the place for a run of a given number of simulated seconds.
    ///
    /// # Errors
    /// When another program has taken the address.
    pub(super) fn begin(
        &self,
        run: &mut dyn Simulation,
        scenery: &Scenery,
        end_s: f64,
    ) -> Result<(), Error> {
        let Some(showcase) = &self.showcase else { return Ok(()) };
        let mut shown = showcase.lock();
        // Viewers reconnect to a server that tells the new length and the new topics.
        *shown = None;
        let (playing, time_s) = (Playing::Paused, run.cycle() as f64 * scenery.cycle_s);
        let now = Playback { playing, time_s, speed: 1.0, did_seek: false };
        let viewers = Viewers::start(&showcase.at, run, scenery, end_s, true, now)?;
        *shown = Some((self.session, viewers));
        Ok(())
    }

    /// Shows the run to its viewers, and returns their wishes.
    pub(super) fn attend(
        &mut self,
        run: &mut dyn Simulation,
        log: &mut Chronicle,
        playback: Playback,
        now: Instant,
    ) -> Option<Steering> {
        let mut shown = self.showcase.as_ref()?.lock();
        let (_, viewers) = shown.as_mut().filter(|(of, _)| *of == self.session)?;
        self.due = now + LOOK;
        if viewers.frame_due(playback.time_s, now) {
            let mut frame = run.frame(Viewers::LOOK);
            log.note(&mut frame);
            (frame.log, frame.log_left_out) = log.take_for_viewers();
            viewers.show(frame, now);
        }
        viewers.tell(playback, now);
        viewers.wish()
    }

    /// Returns when to check viewers' wishes.
    pub(super) fn due(&self) -> Option<Instant> {
        self.is_possible().then_some(self.due)
    }
}
