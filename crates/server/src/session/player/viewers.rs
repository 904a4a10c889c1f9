//! Viewers beside the page: their views, and their wishes.

use super::Player;
use crate::SPEED_RANGE;
use crate::protocol::{Problem, SessionState, Speed};
use crate::session::problem_of;
use sidestep_kernel::Cycle;
use sidestep_session::{Playback, PlaybackPhase, PlaybackRequest};
use std::time::Instant;

impl Player {
    /// Shows the run to viewers beside the page, if they are served.
    pub(super) fn restart_viewers(&mut self) -> Result<(), Problem> {
        let end_s = self.stage.until as f64 * self.scenery.cycle_s;
        let run = self.stage.run.as_mut();
        self.showing.start(run, &self.scenery, end_s).map_err(|e| problem_of(&e))
    }

    /// Shows the run to viewers beside the page, and follows their wishes.
    pub(super) fn update_viewers(&mut self, now: Instant) {
        let playback = self.playback();
        let run = self.stage.run.as_mut();
        let wish = self.showing.update(run, &mut self.memory.log, playback, now);
        let Some(PlaybackRequest { play, speed, seek_s }) = wish else { return };
        let speed = play.then_some(Speed::Times(speed));
        match (seek_s, speed) {
            (Some(time_s), then) => {
                self.seek(None, (time_s / self.scenery.cycle_s).round() as Cycle, then);
            }
            (None, Some(speed)) => drop(self.play(speed)),
            (None, None) => {
                self.cancel_seek("the run was paused");
                self.pause();
            }
        }
    }

    /// Returns the state of playback for viewers beside the page.
    fn playback(&self) -> Playback {
        let goes_on = self.errand.is_some_and(|errand| errand.then.is_some());
        let playing = match self.state {
            SessionState::Over => PlaybackPhase::Ended,
            SessionState::Playing => PlaybackPhase::Playing,
            _ if goes_on => PlaybackPhase::Playing,
            _ => PlaybackPhase::Paused,
        };
        let speed = match self.speed {
            Speed::Times(times) => times,
            Speed::Fastest => *SPEED_RANGE.end(),
        };
        let time_s = self.cycle() as f64 * self.scenery.cycle_s;
        Playback { playing, time_s, speed, did_seek: false }
    }
}
