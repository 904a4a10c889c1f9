//! A run that viewers may pause, continue and slow down.

use super::{FRAME_OPTIONS, ViewerAddress, ViewerOptions, ViewerServer};
use crate::Error;
use crate::pacer::Pacer;
use sidestep_kernel::{Cycle, Simulation};
use sidestep_record::{Playback, PlaybackPhase, PlaybackRequest};
use std::time::{Duration, Instant};

/// The longest wait of a paused run, after which it checks for requests again; as long as a slice of a running one.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// The viewers of a run, and their last request. Before the first one, it runs as fast as it can.
pub struct LiveControl {
    viewers: ViewerServer,
    cycle_s: f64,
    playing: PlaybackPhase,
    speed: f64,
    /// `None` for a run as fast as it can, and for a paused one.
    pacer: Option<Pacer>,
}

impl LiveControl {
    /// Starts to serve viewers of a run that advances.
    ///
    /// # Errors
    /// When the address cannot be taken.
    pub(crate) fn start(at: &ViewerAddress, run: &mut dyn Simulation) -> Result<Self, Error> {
        let scenery = run.scenery();
        let cycle_s = scenery.cycle_s;
        let playing = PlaybackPhase::Playing;
        let speed = 1.0;
        let playback = Playback { playing, time_s: time_s(run, cycle_s), speed, did_seek: false };
        let end_s = run.config().cycles as f64 * cycle_s;
        run.enable_events();
        // A run that is recorded cannot go back, so viewers may not seek.
        let options = ViewerOptions { end_s, can_seek: false, playback };
        let viewers = ViewerServer::start(at, run, &scenery, options)?;
        Ok(Self { viewers, cycle_s, playing, speed, pacer: None })
    }

    /// Shows the run, and returns the cycle up to which it may advance now; waits a little if it may not advance.
    pub(crate) fn next_target(&mut self, run: &mut dyn Simulation) -> Cycle {
        let now = Instant::now();
        if let Some(request) = self.viewers.take_request() {
            self.apply(request, now, run.cycle());
        }
        // A run that was paused by viewers who have left would stand still for ever.
        if !self.viewers.has_viewers() {
            self.playing = PlaybackPhase::Playing;
            self.pacer = None;
        }
        self.send_updates(run, now);
        let cycle = run.cycle();
        let target = match (self.playing, &mut self.pacer) {
            (PlaybackPhase::Playing, None) => return Cycle::MAX,
            (PlaybackPhase::Playing, Some(pacer)) => pacer.target(now, cycle),
            _ => cycle,
        };
        if target <= cycle {
            let wait = match &self.pacer {
                Some(pacer) => pacer.next_due(cycle) - now,
                None => MAX_WAIT,
            };
            std::thread::sleep(wait.min(MAX_WAIT));
        }
        target
    }

    /// Sends the last state, so that viewers show the end and stop their clocks.
    pub(crate) fn finish(&mut self, run: &mut dyn Simulation) {
        self.playing = PlaybackPhase::Ended;
        self.send_updates(run, Instant::now());
    }

    fn apply(&mut self, request: PlaybackRequest, now: Instant, cycle: Cycle) {
        self.speed = request.speed;
        if request.play {
            self.playing = PlaybackPhase::Playing;
            self.pacer = Some(Pacer::new(request.speed / self.cycle_s, now, cycle));
        } else {
            self.playing = PlaybackPhase::Paused;
            self.pacer = None;
        }
    }

    fn send_updates(&mut self, run: &mut dyn Simulation, now: Instant) {
        let time_s = time_s(run, self.cycle_s);
        if self.viewers.is_frame_due(time_s, now) {
            self.viewers.send_frame(run.frame(FRAME_OPTIONS), now);
        }
        let playback =
            Playback { playing: self.playing, time_s, speed: self.speed, did_seek: false };
        self.viewers.send_playback(playback, now);
    }
}

fn time_s(run: &dyn Simulation, cycle_s: f64) -> f64 {
    run.cycle() as f64 * cycle_s
}
