//! Seeks: started, redirected, and cancelled.

use super::Player;
use crate::protocol::{Problem, ReplyBody, SessionState, Speed};
use sidestep_kernel::Cycle;
use std::time::Instant;

/// A seek in progress.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seek {
    /// The request that is answered at the target; none for a viewer's.
    pub(super) id: Option<u32>,
    pub(super) target: Cycle,
    /// The speed at which the run is played from there; none if it pauses.
    pub(super) then: Option<Speed>,
}

impl Player {
    /// Answers the request for a seek that is cancelled before its end.
    pub(in super::super) fn cancel_seek(&mut self, cause: &str) {
        if let Some(Seek { id: Some(id), target, .. }) = self.seek.take() {
            let place = format!("cycle {target}");
            self.send_reply(id, Err(Problem::new(place, cause, "ask again to go there")));
        }
    }

    /// Advances by some cycles from the present one, or from the target of a seek in progress: so steps that are requested
    /// faster than they are computed add up.
    pub(super) fn step(&mut self, id: u32, cycles: u32) {
        let from = self.seek.map_or(self.cycle(), |seek| seek.target);
        if let Some(Seek { id: Some(earlier), .. }) = self.seek.take() {
            self.send_reply(earlier, Ok(ReplyBody::Done));
        }
        self.start_seek(Some(id), from.saturating_add(u64::from(cycles)), None);
    }

    /// Starts a seek to a cycle, from the present cycle or from a keyframe, whichever is nearer before it.
    pub(super) fn start_seek(&mut self, id: Option<u32>, cycle: Cycle, then: Option<Speed>) {
        self.cancel_seek("replaced by another request");
        let target = cycle.min(self.open_run.until);
        self.state = SessionState::Seeking;
        self.seek = Some(Seek { id, target, then });
        let present = self.cycle();
        let Some((at, checkpoint)) = self.history.keyframes.latest_until(target) else { return };
        if target < present || at > present {
            let run = self.open_run.run.as_mut();
            self.publisher.record_events(run, &mut self.history.log, Instant::now());
            // A keyframe that cannot be restored is a bug: the panic ends the session, with its message.
            run.restore(checkpoint).unwrap_or_else(|error| panic!("a keyframe: {error}"));
            self.digest = None;
            self.publisher.mark_cycle_changed();
        }
    }
}
