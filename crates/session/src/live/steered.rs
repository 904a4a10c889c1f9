//! A run that viewers may hold, continue and slow down.

use super::{LOOK, Viewers, ViewersAt};
use crate::Error;
use crate::beat::Beat;
use sidestep::kernel::{Cycle, Simulation};
use sidestep_record::{Playback, Playing, Steering};
use std::time::{Duration, Instant};

/// The longest wait of a held run, after which it looks around again.
const WAIT: Duration = Duration::from_millis(20);

/// The viewers of a run, and their wishes. Until they have any, it goes as fast as it can.
pub struct Steered {
    viewers: Viewers,
    cycle_s: f64,
    playing: Playing,
    speed: f64,
    beat: Option<Beat>,
}

impl Steered {
    /// Starts to serve viewers of a run that goes on.
    ///
    /// # Errors
    /// When the address cannot be taken.
    pub(crate) fn start(at: &ViewersAt, run: &mut dyn Simulation) -> Result<Self, Error> {
        let scenery = run.scenery();
        let cycle_s = scenery.cycle_s;
        let (playing, speed) = (Playing::Playing, 1.0);
        let now = Playback { playing, time_s: time_s(run, cycle_s), speed, did_seek: false };
        let end_s = run.plan().cycles as f64 * cycle_s;
        run.watch();
        let viewers = Viewers::start(at, run, &scenery, end_s, false, now)?;
        Ok(Self { viewers, cycle_s, playing, speed, beat: None })
    }

    /// Shows the run, and returns the cycle up to which it may go now; waits a little if it may not go on.
    pub(crate) fn attend(&mut self, run: &mut dyn Simulation) -> Cycle {
        let now = Instant::now();
        if let Some(wish) = self.viewers.wish() {
            self.heed(wish, now, run.cycle());
        }
        // Viewers that have gone do not hold the run.
        if !self.viewers.are_there() {
            (self.playing, self.beat) = (Playing::Playing, None);
        }
        self.show(run, now);
        let cycle = run.cycle();
        let target = match (self.playing, &mut self.beat) {
            (Playing::Playing, None) => return Cycle::MAX,
            (Playing::Playing, Some(beat)) => beat.target(now, cycle),
            _ => cycle,
        };
        if target <= cycle {
            let due = self.beat.as_ref().map(|beat| beat.next(cycle) - now).unwrap_or(WAIT);
            std::thread::sleep(due.min(WAIT));
        }
        target
    }

    /// Shows the end of the run.
    pub(crate) fn end(&mut self, run: &mut dyn Simulation) {
        self.playing = Playing::Ended;
        self.show(run, Instant::now());
    }

    fn heed(&mut self, wish: Steering, now: Instant, cycle: Cycle) {
        self.speed = wish.speed;
        self.playing = if wish.play { Playing::Playing } else { Playing::Paused };
        self.beat = wish.play.then(|| Beat::new(wish.speed / self.cycle_s, now, cycle));
    }

    fn show(&mut self, run: &mut dyn Simulation, now: Instant) {
        let time_s = time_s(run, self.cycle_s);
        if self.viewers.frame_due(time_s, now) {
            self.viewers.show(run.frame(LOOK), now);
        }
        let (playing, speed) = (self.playing, self.speed);
        self.viewers.tell(Playback { playing, time_s, speed, did_seek: false }, now);
    }
}

fn time_s(run: &dyn Simulation, cycle_s: f64) -> f64 {
    run.cycle() as f64 * cycle_s
}
