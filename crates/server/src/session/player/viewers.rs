//! Viewers by Foxglove's protocol: their frames, and their requests.

use super::Player;
use crate::SPEED_RANGE;
use crate::protocol::{Problem, SessionState, Speed};
use crate::session::problem_of;
use sidestep_kernel::Cycle;
use sidestep_session::{Playback, PlaybackPhase, PlaybackRequest};
use std::time::Instant;

impl Player {
    /// Starts serving the run to viewers, if they are served.
    pub(super) fn restart_viewers(&mut self) -> Result<(), Problem> {
        let end_s = self.open_run.until as f64 * self.scenery.cycle_s;
        let run = self.open_run.run.as_mut();
        self.foxglove.start(run, &self.scenery, end_s).map_err(|e| problem_of(&e))
    }

    /// Sends the run to viewers, and carries out their requests.
    pub(super) fn update_viewers(&mut self, now: Instant) {
        let playback = self.playback_status();
        let run = self.open_run.run.as_mut();
        let request = self.foxglove.update_viewers(run, &mut self.history.log, playback, now);
        let Some(PlaybackRequest { play, speed, seek_s }) = request else { return };
        let speed = play.then_some(Speed::Times(speed));
        match (seek_s, speed) {
            (Some(time_s), then) => {
                self.start_seek(None, (time_s / self.scenery.cycle_s).round() as Cycle, then);
            }
            (None, Some(speed)) => drop(self.play(speed)),
            (None, None) => {
                self.cancel_seek("the run was paused");
                self.pause();
            }
        }
    }

    /// Returns the state of playback in the words of viewers: a seek after which the run plays on counts as playing.
    fn playback_status(&self) -> Playback {
        let plays_after_seek = self.seek.is_some_and(|seek| seek.then.is_some());
        let playing = match self.state {
            SessionState::Over => PlaybackPhase::Ended,
            SessionState::Playing => PlaybackPhase::Playing,
            _ if plays_after_seek => PlaybackPhase::Playing,
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
