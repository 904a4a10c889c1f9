//! Frames of a run, kept until all are complete and then drawn, because the view depends on all of
//! them.

use super::FrameSink;
use crate::Error;
use crate::picture::PictureLook;
use sidestep_draw::{
    AnimationFrame, AnimationLook, AnimationRenderer as View, AnimationSize, PictureView,
    TrailChoice, bodies_with_trails,
};
use sidestep_kernel::Simulation;
use sidestep_kernel::text::group_thousands;
use sidestep_kernel::view::{
    Body, BodyId, Frame, FrameOptions, Isometry2, Scenery, Trail, Vec3, corner_of_move,
};
use sidestep_kernel::{Cycle, InputError};
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of bodies in all frames: all frames are in memory until the last one is known.
const MAX_BODIES: usize = 4_000_000;
/// Largest number of cycles for which every place of a track is kept: sixty such tracks take some hundred megabytes.
const MAX_TRACK_CYCLES: Cycle = 50_000;
/// Number of frames before a picture for which tracks are shown: two seconds at the default rate of an animation.
const TRAIL_FRAMES: usize = 30;

/// Frames and tracks of a run, kept until all are complete and the common view is known.
pub(crate) struct AnimationFrames {
    scenery: Scenery,
    choice: TrailChoice,
    view: PictureView,
    every: Cycle,
    frames: Vec<Frame>,
    bodies: usize,
    /// Cycles between places of tracks: one, unless the animation is very long.
    step: Cycle,
    tracks: BTreeMap<BodyId, Track>,
}

/// The places of a body, and its last heading in quarter turns.
#[derive(Default)]
struct Track {
    places: Vec<(Cycle, Vec3)>,
    heading: u32,
}

impl AnimationFrames {
    /// Returns an animation of a run with a frame every `every` cycles, `cycles` long.
    pub(crate) fn new(
        run: &dyn Simulation,
        every: Cycle,
        cycles: Cycle,
        look: &PictureLook,
    ) -> Self {
        Self {
            scenery: run.scenery(),
            // Trails are those of the last frames, whatever the first cycle of all.
            choice: TrailChoice { from: None, ..look.trail_choice() },
            view: look.view,
            every,
            frames: Vec::new(),
            bodies: 0,
            // At most the interval of frames: tracks have a place in each of them.
            step: cycles.div_ceil(MAX_TRACK_CYCLES).clamp(1, every.max(1)),
            tracks: BTreeMap::new(),
        }
    }

    /// Adds the places of the bodies with tracks to show.
    fn add_positions(&mut self, frame: &Frame) {
        let whose: BTreeSet<BodyId> =
            bodies_with_trails(&self.scenery, frame, &self.choice).into_iter().collect();
        for body in frame.bodies.iter().filter(|body| whose.contains(&body.id())) {
            let track = self.tracks.entry(body.id()).or_default();
            if let Some(&(cycle, at_m)) = track.places.last() {
                // A cycle may be both sampled and captured as a frame.
                if cycle >= frame.cycle {
                    continue;
                }
                let corner = corner_before_slip(&self.scenery, body, at_m, track.heading);
                track.places.extend(corner.map(|at_m| (frame.cycle, at_m)));
            }
            track.places.push((frame.cycle, body.pose.at_m));
            track.heading = quarter_turns(&self.scenery, body);
        }
    }

    /// Returns the track of a body up to a frame; empty if the body is not there.
    fn trail(&self, of: BodyId, index: usize) -> Trail {
        let frame = &self.frames[index];
        let from = self.frames[index.saturating_sub(TRAIL_FRAMES)].cycle;
        let is_here = frame.bodies.iter().any(|body| body.id() == of);
        let places = match self.tracks.get(&of) {
            Some(track) if is_here => &track.places[..],
            _ => &[],
        };
        let begin = places.partition_point(|(cycle, _)| *cycle < from);
        let end = places.partition_point(|(cycle, _)| *cycle <= frame.cycle);
        Trail { of, points: places[begin..end.max(begin)].to_vec() }
    }

    /// Returns the tracks up to the last frame: since the first one, if there are few.
    pub(crate) fn last_trails(&self) -> Vec<Trail> {
        let Some(last) = self.frames.len().checked_sub(1) else { return Vec::new() };
        let whose = bodies_with_trails(&self.scenery, &self.frames[last], &self.choice);
        whose.into_iter().map(|of| self.trail(of, last)).collect()
    }

    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Returns the view that all frames share: it contains the bodies of all of them.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub(crate) fn view(&self, size: AnimationSize) -> Result<View, Error> {
        let look = AnimationLook { size, trails: self.choice.clone(), view: self.view };
        Ok(View::new(self.scenery.clone(), &self.frames, &look)?)
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub(crate) fn draw(&self, view: &View, index: usize) -> Result<AnimationFrame, Error> {
        let frame = &self.frames[index];
        let whose = bodies_with_trails(&self.scenery, frame, &self.choice);
        let trails: Vec<Trail> = whose.into_iter().map(|of| self.trail(of, index)).collect();
        Ok(view.render(frame, &trails, &self.caption(frame))?)
    }

    fn caption(&self, frame: &Frame) -> String {
        let cycle = group_thousands(frame.cycle);
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

impl FrameSink for AnimationFrames {
    fn interval(&self) -> Cycle {
        self.every
    }

    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let frame = run.frame(FrameOptions::WITHOUT_SCANS);
        self.bodies += frame.bodies.len();
        if self.bodies > MAX_BODIES {
            let cause = format!("more than {MAX_BODIES} bodies on all pictures together");
            let remedy = "take fewer pictures: a larger --every, or a part with --from and --until";
            return Err(InputError::new(format!("--every {}", self.every), cause, remedy).into());
        }
        self.add_positions(&frame);
        self.frames.push(frame);
        Ok(())
    }

    fn sample_interval(&self) -> Option<Cycle> {
        Some(self.step)
    }

    fn sample(&mut self, run: &mut dyn Simulation) {
        let frame = run.frame(FrameOptions::WITHOUT_SCANS);
        self.add_positions(&frame);
    }
}

/// Returns the place where a body was if it went ahead before it slipped to a side: it left `from` with a heading in
/// quarter turns. `None` for a straight motion, and for bodies that do not stand on boxes.
fn corner_before_slip(scenery: &Scenery, body: &Body, from: Vec3, quarters: u32) -> Option<Vec3> {
    let plane = &scenery.floor.as_ref()?.plane;
    // In the frame of the floor, where motions are along the axes.
    let from = to_floor(plane, from);
    let to = to_floor(plane, body.pose.at_m);
    // In meters: rounding of the turn into the floor's frame moves a place less, and any motion of a body more.
    let has_moved_x = (from[0] - to[0]).abs() > 1e-9;
    let has_moved_y = (from[1] - to[1]).abs() > 1e-9;
    let [x, y, z] = corner_of_move(from, quarters, to);
    let [x, y] = plane.transform_point([x, y]);
    (has_moved_x && has_moved_y).then_some([x, y, z])
}

fn to_floor(plane: &Isometry2, [x, y, z]: Vec3) -> Vec3 {
    let [x, y] = plane.inverse_transform_point([x, y]);
    [x, y, z]
}

/// Returns the heading of a body in quarter turns from the floor's first axis.
fn quarter_turns(scenery: &Scenery, body: &Body) -> u32 {
    let Some(floor) = &scenery.floor else { return 0 };
    let [x, y, _] = body.pose.rotate([1.0, 0.0, 0.0]);
    let [x0, y0] = floor.plane.inverse_transform_point([0.0; 2]);
    let [x1, y1] = floor.plane.inverse_transform_point([x, y]);
    // Opposite headings have the same corner, so 0 and 1 are enough.
    u32::from((y1 - y0).abs() > (x1 - x0).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NoWatcher;
    use crate::driver::{Sinks, drive};
    use crate::testing::WORLDS;
    use sidestep_robots::kinds::ROBOT;
    use sidestep_scenario::Source;

    /// Robots among walls that slip to the side, watched for 200 cycles.
    const SCENARIO: &str = "format = 1\nworld = \"robots\"\nregime = \"both\"\n\
                            [map]\nbox_size_m = 0.5\nascii = \"\"\"\n\
                            ############\n#..........#\n#..#.......#\n#..#..##...#\n#..........#\n############\n\
                            \"\"\"\n[robots]\ncount = 2\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n";

    #[test]
    fn a_way_has_every_cycle_however_far_apart_frames_are_and_no_step_cuts_a_corner() {
        let source = Source::new("t", SCENARIO, "");
        let compiled = WORLDS.compile(&source).expect("a scenario");
        let mut run = compiled.start(&source, 1);
        let mut alone = compiled.start(&source, 1);
        let mut pictures = AnimationFrames::new(run.as_ref(), 67, 200, &PictureLook::default());
        let sinks = Sinks { frames: Some(&mut pictures), ..Sinks::default() };
        drive(run.as_mut(), 200, sinks, &NoWatcher).expect("a film");
        alone.advance(200);
        assert_eq!(run.digest(), alone.digest(), "looking changes nothing");
        let last = pictures.len() - 1;
        for of in bodies_with_trails(&pictures.scenery, &pictures.frames[last], &pictures.choice) {
            let way = pictures.trail(of, last).points;
            let mut cycles: Vec<Cycle> = way.iter().map(|(cycle, _)| *cycle).collect();
            cycles.dedup();
            assert_eq!(cycles, (0..=200).collect::<Vec<Cycle>>());
            for pair in way.windows(2) {
                let moved = |k: usize| (pair[1].1[k] - pair[0].1[k]).abs();
                // An action that errs may carry two boxes ahead.
                assert!(moved(0).max(moved(1)) < 1.01 && moved(0).min(moved(1)) < 1e-9, "{pair:?}");
            }
        }
        assert!(pictures.trail(BodyId::new(ROBOT, 9, None), last).points.is_empty());
    }
}
