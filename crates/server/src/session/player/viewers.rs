//! Viewers beside the page: their views, and their wishes.

use super::Player;
use crate::SPEEDS;
use crate::protocol::{Problem, Speed, State};
use crate::session::stopped;
use sidestep::kernel::Cycle;
use sidestep_session::{Playback, Playing, Steering};
use std::time::Instant;

impl Player {
    /// Shows the run to viewers beside the page, if they are served.
    pub(super) fn show_anew(&mut self) -> Result<(), Problem> {
        let end_s = self.stage.until as f64 * self.scenery.cycle_s;
        let run = self.stage.run.as_mut();
        self.showing.begin(run, &self.scenery, end_s).map_err(|e| stopped(&e))
    }

    /// Shows the run to viewers beside the page, and follows their wishes.
    pub(super) fn attend_viewers(&mut self, now: Instant) {
        let playback = self.playback();
        let run = self.stage.run.as_mut();
        let wish = self.showing.attend(run, &mut self.memory.log, playback, now);
        let Some(Steering { play, speed, seek_s }) = wish else { return };
        let speed = play.then_some(Speed::Times(speed));
        match (seek_s, speed) {
            (Some(time_s), then) => {
                self.go(None, (time_s / self.scenery.cycle_s).round() as Cycle, then);
            }
            (None, Some(speed)) => drop(self.play(speed)),
            (None, None) => {
                self.give_up("the run was paused");
                self.stand();
            }
        }
    }

    /// Returns the state of playback for viewers beside the page.
    fn playback(&self) -> Playback {
        let goes_on = self.errand.is_some_and(|errand| errand.then.is_some());
        let playing = match self.state {
            State::Over => Playing::Ended,
            State::Playing => Playing::Playing,
            _ if goes_on => Playing::Playing,
            _ => Playing::Paused,
        };
        let speed = match self.speed {
            Speed::Times(times) => times,
            Speed::Fastest => *SPEEDS.end(),
        };
        let time_s = self.cycle() as f64 * self.scenery.cycle_s;
        Playback { playing, time_s, speed, did_seek: false }
    }
}
