//! Frames of a run, kept until all are there and then drawn, because the view depends on all of
//! them.

use super::Film;
use crate::Error;
use sidestep::kernel::Simulation;
use sidestep::kernel::view::{Frame, Look, Scenery, Trail, Who};
use sidestep::kernel::words::grouped;
use sidestep::kernel::{Cycle, InputError};
use sidestep_draw::{Film as View, Still, worth_a_trail};

/// Largest number of bodies in all frames; more would take too much memory.
const MOST_BODIES: usize = 4_000_000;
/// Number of frames before a picture whose tracks are shown.
const TRAIL: usize = 30;

/// The frames of an animation.
pub(crate) struct Pictures {
    scenery: Scenery,
    every: Cycle,
    frames: Vec<Frame>,
    bodies: usize,
}

impl Pictures {
    /// Returns an animation of a run with a frame every `every` cycles.
    pub(crate) fn new(run: &dyn Simulation, every: Cycle) -> Self {
        Self { scenery: run.scenery(), every, frames: Vec::new(), bodies: 0 }
    }

    /// Returns the number of frames.
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Returns the view that all frames share.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub(crate) fn view(&self, width_px: u32) -> Result<View, Error> {
        Ok(View::new(self.scenery.clone(), &self.frames, width_px)?)
    }

    /// Draws one frame.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub(crate) fn draw(&self, view: &View, index: usize) -> Result<Still, Error> {
        let frame = &self.frames[index];
        let frames = &self.frames[index.saturating_sub(TRAIL)..=index];
        let whose = worth_a_trail(&self.scenery, frame);
        let trails: Vec<Trail> = whose.into_iter().map(|of| trail(of, frames)).collect();
        Ok(view.still(frame, &trails, &self.caption(frame))?)
    }

    fn caption(&self, frame: &Frame) -> String {
        let cycle = grouped(frame.cycle);
        let when = match self.scenery.cycle_s {
            1.0 => format!("cycle {cycle}"),
            _ => format!("{:.1} s, cycle {cycle}", frame.time_s),
        };
        match self.scenery.name.as_str() {
            "" => when,
            name => format!("{name}: {when}"),
        }
    }
}

impl Film for Pictures {
    fn every(&self) -> Cycle {
        self.every
    }

    fn shoot(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let frame = run.frame(Look::BODIES);
        self.bodies += frame.bodies.len();
        if self.bodies > MOST_BODIES {
            let cause = format!("more than {MOST_BODIES} bodies on all pictures together");
            let remedy = "take fewer pictures: a larger --every, or a part with --from and --until";
            return Err(InputError::new(format!("--every {}", self.every), cause, remedy).into());
        }
        self.frames.push(frame);
        Ok(())
    }
}

/// Returns the track of a body in these frames; empty if it is not in the last of them.
fn trail(of: Who, frames: &[Frame]) -> Trail {
    let find = |frame: &Frame| {
        frame.bodies.iter().find(|body| body.who() == of).map(|body| body.pose.at_m)
    };
    let is_here = frames.last().is_some_and(|frame| find(frame).is_some());
    let frames = frames.iter().filter(|_| is_here);
    Trail { of, way: frames.filter_map(|frame| Some((frame.cycle, find(frame)?))).collect() }
}
