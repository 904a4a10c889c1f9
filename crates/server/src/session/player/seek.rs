//! Ways to a cycle: begun, gone on with, and given up.

use super::Player;
use crate::protocol::{Problem, ReplyBody, SessionState, Speed};
use sidestep_kernel::Cycle;
use std::time::Instant;

/// A way to a cycle that a page waits for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seek {
    /// The request that is answered on arrival; none for a viewer's.
    pub(super) id: Option<u32>,
    pub(super) target: Cycle,
    /// The speed at which the run goes on from there.
    pub(super) then: Option<Speed>,
}

impl Player {
    /// Answers the request for a way that is given up before its end.
    pub(in super::super) fn cancel_seek(&mut self, cause: &str) {
        if let Some(Seek { id: Some(id), target, .. }) = self.errand.take() {
            let place = format!("cycle {target}");
            self.reply(id, Err(Problem::new(place, cause, "ask again to go there")));
        }
    }

    /// Goes some cycles on from where it is, or is going to: steps requested faster than they are done add up.
    pub(super) fn step(&mut self, id: u32, cycles: u32) {
        let from = self.errand.map_or(self.cycle(), |errand| errand.target);
        if let Some(Seek { id: Some(earlier), .. }) = self.errand.take() {
            self.reply(earlier, Ok(ReplyBody::Done));
        }
        self.seek(Some(id), from.saturating_add(u64::from(cycles)), None);
    }

    /// Sets out to a cycle, from the nearest place that is known.
    pub(super) fn seek(&mut self, id: Option<u32>, cycle: Cycle, then: Option<Speed>) {
        self.cancel_seek("another way was asked for");
        let target = cycle.min(self.stage.until);
        (self.state, self.errand) = (SessionState::Seeking, Some(Seek { id, target, then }));
        let here = self.cycle();
        let Some((at, checkpoint)) = self.memory.keyframes.before(target) else { return };
        if target < here || at > here {
            let run = self.stage.run.as_mut();
            self.viewer.drain(run, &mut self.memory.log, Instant::now());
            // A bug ends the session, with its message.
            run.restore(checkpoint).unwrap_or_else(|error| panic!("a keyframe: {error}"));
            self.digest = None;
            self.viewer.mark_moved();
        }
    }
}
