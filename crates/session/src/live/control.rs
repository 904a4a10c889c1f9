//! A run that viewers may hold, continue and slow down.

use super::{FRAME_OPTIONS, ViewerAddress, ViewerServer};
use crate::Error;
use crate::pacer::Pacer;
use sidestep_kernel::{Cycle, Simulation};
use sidestep_record::{Playback, PlaybackPhase, PlaybackRequest};
use std::time::{Duration, Instant};

/// The longest wait of a held run, after which it looks around again.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// The viewers of a run, and their wishes. Until they have any, it goes as fast as it can.
pub struct LiveControl {
    viewers: ViewerServer,
    cycle_s: f64,
    playing: PlaybackPhase,
    speed: f64,
    beat: Option<Pacer>,
}

impl LiveControl {
    /// Starts to serve viewers of a run that goes on.
    ///
    /// # Errors
    /// When the address cannot be taken.
    pub(crate) fn start(at: &ViewerAddress, run: &mut dyn Simulation) -> Result<Self, Error> {
        let scenery = run.scenery();
        let cycle_s = scenery.cycle_s;
        let (playing, speed) = (PlaybackPhase::Playing, 1.0);
        let now = Playback { playing, time_s: time_s(run, cycle_s), speed, did_seek: false };
        let end_s = run.config().cycles as f64 * cycle_s;
        run.enable_events();
        let viewers = ViewerServer::start(at, run, &scenery, end_s, false, now)?;
        Ok(Self { viewers, cycle_s, playing, speed, beat: None })
    }

    /// Shows the run, and returns the cycle up to which it may go now; waits a little if it may not go on.
    pub(crate) fn next_target(&mut self, run: &mut dyn Simulation) -> Cycle {
        let now = Instant::now();
        if let Some(wish) = self.viewers.take_request() {
            self.apply(wish, now, run.cycle());
        }
        // Viewers that have gone do not hold the run.
        if !self.viewers.has_viewers() {
            (self.playing, self.beat) = (PlaybackPhase::Playing, None);
        }
        self.send_updates(run, now);
        let cycle = run.cycle();
        let target = match (self.playing, &mut self.beat) {
            (PlaybackPhase::Playing, None) => return Cycle::MAX,
            (PlaybackPhase::Playing, Some(beat)) => beat.target(now, cycle),
            _ => cycle,
        };
        if target <= cycle {
            let due = self.beat.as_ref().map(|beat| beat.next_due(cycle) - now).unwrap_or(MAX_WAIT);
            std::thread::sleep(due.min(MAX_WAIT));
        }
        target
    }

    /// Shows the end of the run.
    pub(crate) fn finish(&mut self, run: &mut dyn Simulation) {
        self.playing = PlaybackPhase::Ended;
        self.send_updates(run, Instant::now());
    }

    fn apply(&mut self, wish: PlaybackRequest, now: Instant, cycle: Cycle) {
        self.speed = wish.speed;
        self.playing = if wish.play { PlaybackPhase::Playing } else { PlaybackPhase::Paused };
        self.beat = wish.play.then(|| Pacer::new(wish.speed / self.cycle_s, now, cycle));
    }

    fn send_updates(&mut self, run: &mut dyn Simulation, now: Instant) {
        let time_s = time_s(run, self.cycle_s);
        if self.viewers.is_frame_due(time_s, now) {
            self.viewers.send_frame(run.frame(FRAME_OPTIONS), now);
        }
        let (playing, speed) = (self.playing, self.speed);
        self.viewers.send_playback(Playback { playing, time_s, speed, did_seek: false }, now);
    }
}

fn time_s(run: &dyn Simulation, cycle_s: f64) -> f64 {
    run.cycle() as f64 * cycle_s
}
