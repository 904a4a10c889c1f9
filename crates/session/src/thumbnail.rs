//! A small picture of a run: its last frame, with the tracks that led to it.

use crate::Error;
use sidestep_draw::{
    AnimationFrame, AnimationLook, AnimationRenderer, TrailChoice, bodies_with_trails,
};
use sidestep_kernel::view::{BodyId, Frame, FrameOptions, Scenery, Trail, Vec3};
use sidestep_kernel::{Cycle, Simulation};
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of places of a track: more than a small picture has pixels.
const MAX_PLACES: usize = 400;
/// Largest number of tracks: more hide each other.
const MAX_TRACKS: usize = 200;

/// The frames of a run, as far as a small picture shows them.
pub struct Thumbnail {
    scenery: Scenery,
    tracks: BTreeMap<BodyId, Vec<(Cycle, Vec3)>>,
    /// Frames whose bodies the view contains.
    in_view: Vec<Frame>,
    frames: usize,
}

impl Thumbnail {
    /// Returns the picture of a run of which no frame was added.
    pub fn new(run: &dyn Simulation) -> Self {
        let scenery = run.scenery();
        Self { scenery, tracks: BTreeMap::new(), in_view: Vec::new(), frames: 0 }
    }

    /// Adds a frame, later than those before.
    pub fn add(&mut self, frame: &Frame) {
        // The first one, and those whose numbers are powers of two: few, however long the run is.
        if self.frames == 0 || self.frames.is_power_of_two() {
            self.in_view.push(frame.clone());
        }
        self.frames += 1;
        let all = TrailChoice::default();
        let with_trails: BTreeSet<BodyId> =
            bodies_with_trails(&self.scenery, frame, &all).into_iter().collect();
        for body in frame.bodies.iter().filter(|body| with_trails.contains(&body.id())) {
            if self.tracks.len() >= MAX_TRACKS && !self.tracks.contains_key(&body.id()) {
                continue;
            }
            let track = self.tracks.entry(body.id()).or_default();
            track.push((frame.cycle, body.pose.at_m));
            // The last places are kept; now and then, because each cut moves all of them.
            if track.len() >= 2 * MAX_PLACES {
                track.drain(..MAX_PLACES);
            }
        }
    }

    /// Returns the picture of the present state of the run as PNG, with its longer side in pixels.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub fn png(self, run: &mut dyn Simulation, width_px: u32) -> Result<Vec<u8>, Error> {
        Ok(self.draw(run, width_px)?.to_png()?)
    }

    fn draw(mut self, run: &mut dyn Simulation, width_px: u32) -> Result<AnimationFrame, Error> {
        let last = run.frame(FrameOptions::WITHOUT_SCANS);
        // Bodies that are gone by now have tracks, too: those of airplanes are all that is left of a flight.
        let trails = self.tracks.into_iter().map(|(of, mut points)| {
            points.drain(..points.len().saturating_sub(MAX_PLACES));
            Trail { of, points }
        });
        let trails: Vec<Trail> = trails.collect();
        self.in_view.push(last.clone());
        let look = AnimationLook::longer_side(width_px);
        let view = AnimationRenderer::new(self.scenery, &self.in_view, &look)?;
        Ok(view.render(&last, &trails, "")?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::WORLDS;
    use sidestep_scenario::Source;

    const AIRPLANES: &str = "format = 1\nworld = \"airspace\"\nseed = 7\ncycles = 400\n[airspace]\nmethod = \"none\"\n\
        shield = \"off\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 6\n";

    /// The number of pixels of a picture that are not gray.
    fn colored_pixels(picture: &AnimationFrame) -> usize {
        let pixels = picture.rgba().chunks_exact(4);
        pixels.filter(|pixel| pixel[0].abs_diff(pixel[2]) > 40).count()
    }

    #[test]
    fn tracks_of_airplanes_that_are_gone_are_shown() {
        let source = Source::new("s.toml", AIRPLANES, "");
        let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
        let mut thumbnail = Thumbnail::new(run.as_ref());
        while run.cycle() < 400 && !run.is_over() {
            thumbnail.add(&run.frame(FrameOptions::WITHOUT_SCANS));
            run.advance(1);
        }
        let without = Thumbnail::new(run.as_ref()).draw(run.as_mut(), 320).expect("drawn");
        let with = thumbnail.draw(run.as_mut(), 320).expect("drawn");
        let counts = [with, without].map(|picture| colored_pixels(&picture));
        assert!(counts[0] > counts[1] + 300, "six lines through the middle: {counts:?}");
    }
}
