//! Airplanes in the air during one `dt`.

use crate::Turn;
use crate::flight::{Levels, Point, Pose, Stage, Track};
use crate::shield::Way;
use crate::state::End;
use sidestep_kernel::{Cycle, Slot};

/// One step of `dtau`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment {
    pub(super) now: Cycle,
    /// Number of the step in this `dt`,
    pub(super) k: usize,
    /// and in the run.
    pub(super) step: u64,
    /// Its beginning, seconds after the start.
    pub(super) step_s: f64,
}

/// One airplane in this `dt`.
pub(super) struct Flight<'a> {
    pub(super) slot: Slot,
    pub(super) course: Course<'a>,
    pub(super) pose: Pose,
    pub(super) altitude_m: f64,
    /// Time at which it came into the air, seconds after the start.
    pub(super) since_s: f64,
    pub(super) next: usize,
    /// Its end, if it has come.
    pub(super) ended: Option<End>,
}

/// The course of an airplane.
pub(super) enum Course<'a> {
    /// A decided way.
    Way(Way, Stage<'a>),
    /// Its recorded way.
    Track(&'a Track),
}

impl<'a> Flight<'a> {
    /// An airplane as it is at the start of the cycle.
    pub(super) fn new(turn: &Turn<'_>, slot: Slot, course: Course<'a>) -> Self {
        let Turn { world, state, .. } = turn;
        let cell = &state.airplanes[slot as usize];
        let track = &world.airplanes[slot as usize].track;
        let recorded_s = track.as_ref().map_or(0.0, Track::begins_s);
        let since_s = world.starts_s(world.appears_in(slot as usize)).max(recorded_s);
        let (pose, altitude_m) = (cell.pose(), cell.altitude_m.get());
        let next = cell.next.get() as usize;
        Self { slot, course, pose, altitude_m, since_s, next, ended: None }
    }

    /// Its altitude some seconds after `altitude_m`, on a decided way.
    pub(super) fn altitude_after_m(&self, stage: &Stage<'_>, seconds: f64) -> f64 {
        let most_m = stage.climb_m_s * seconds;
        self.altitude_m + (stage.altitude_m - self.altitude_m).clamp(-most_m, most_m)
    }

    /// Returns its place and altitude `t_s` after the start of a step; `None` while it is not in
    /// the air.
    pub(super) fn at(&self, wind_m_s: Point, moment: Moment, t_s: f64) -> Option<(Point, f64)> {
        match &self.course {
            Course::Way(way, stage) => {
                let omega = way.omegas_rad_s[moment.k];
                let [x, y] = self.pose.step(stage.model.v_m_s, omega, t_s).at;
                let [wx, wy] = wind_m_s;
                Some(([x + wx * t_s, y + wy * t_s], self.altitude_after_m(stage, t_s)))
            }
            Course::Track(track) => {
                let now_s = moment.step_s + t_s;
                let at = || (track.pose_at(now_s).at, track.altitude_at_m(now_s));
                track.covers(now_s).then(at)
            }
        }
    }

    /// All levels that it is on during one step.
    pub(super) fn levels(&self, dtau_s: f64) -> Levels {
        match &self.course {
            Course::Way(_, stage) => {
                Levels::between(self.altitude_m, self.altitude_after_m(stage, dtau_s))
            }
            Course::Track(_) => Levels::ALL,
        }
    }
}
