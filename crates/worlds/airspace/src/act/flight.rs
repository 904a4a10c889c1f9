//! Airplanes in the air during one `dt`.

use crate::flight::{
    ConstantRateLeg, FlightConditions, FlightLevelRange, Frame, InterOrderSegment, Point, Pose2,
    RoutePosition, Track,
};
use crate::measures::FlightEffort;
use crate::scratch::PhaseContext;
use crate::shield::{Fallback, TurnProfile};
use crate::state::FlightEnd;
use crate::surveillance::StateVector;
use sidestep_kernel::{Cycle, EntitySlot};
use std::borrow::Cow;

/// One step of `dtau`.
#[derive(Debug, Clone, Copy)]
pub(super) struct SubStep {
    pub(super) now: Cycle,
    /// Number of the step in this `dt`.
    pub(super) k: usize,
    /// Number of the step in the run.
    pub(super) step: u64,
    /// Start of the step, in seconds after the start of the run.
    pub(super) step_s: f64,
}

/// One airplane in this `dt`.
pub(super) struct AircraftCycleMotion<'a> {
    pub(super) slot: EntitySlot,
    pub(super) path: FlightPathSource<'a>,
    /// Its position at the start of this `dt`, in coordinates of the scenario.
    pub(super) from: Point,
    /// The frame in which it flies: on the earth that which touches where it starts, or at the center of its orbit.
    pub(super) frame: Frame,
    /// The way-points of its route in the frame, as far as it can get in this `dt`.
    pub(super) mission: Cow<'a, [Point]>,
    /// The air through which it flies.
    pub(super) air: FlightConditions,
    /// Its pose in the frame.
    pub(super) pose: Pose2,
    pub(super) altitude_m: f64,
    /// Time at which it came into the air, in seconds after the start of the run.
    pub(super) since_s: f64,
    pub(super) next: usize,
    /// Legs of the present step in the frame, with times after its start.
    pub(super) legs: Vec<ConstantRateLeg>,
    /// Legs flown in this `dt` in the frame, with times after the start of the run.
    pub(super) flown: Vec<ConstantRateLeg>,
    /// Its states at the start of the steps of this `dt`; none where all see all.
    pub(super) states: Vec<StateVector>,
    /// What its flight has cost; none where that is not measured, or it flies a recorded track.
    pub(super) effort: Option<FlightEffort>,
    /// Set as soon as its flight has ended: from then on it neither flies nor meets others.
    pub(super) end: Option<FlightEnd>,
}

/// The path of an airplane, decided for this `dt` or recorded.
pub(super) enum FlightPathSource<'a> {
    /// The turn rates that were decided, the fallback on which they keep the airplane, if they do, and the
    /// segment of the flight.
    Profile { profile: TurnProfile, fallback: Option<Fallback>, segment: InterOrderSegment<'a> },
    /// A recorded track, flown as it is.
    Track(&'a Track),
}

impl<'a> AircraftCycleMotion<'a> {
    /// Returns an airplane as it is at the start of the cycle.
    pub(super) fn new(
        context: &PhaseContext<'_>,
        slot: EntitySlot,
        path: FlightPathSource<'a>,
    ) -> Self {
        let PhaseContext { world, state, .. } = context;
        let current = &state.airplanes[slot as usize];
        let track = &world.airplanes[slot as usize].track;
        let recorded_s = track.as_ref().map_or(0.0, Track::start_s);
        let since_s = world.cycle_start_s(world.appearance_cycle(slot as usize)).max(recorded_s);
        let from = current.pose();
        let frame = match &path {
            FlightPathSource::Profile { fallback: Some(fallback), segment, .. } => {
                let omega = fallback.omega_rad_s(world.orbit_rad_s[slot as usize]);
                world.surface.fallback_frame(state.orbit_pose(slot), segment.model.v_m_s, omega)
            }
            _ => world.surface.frame_at(from.at),
        };
        let pose = frame.pose_to_local(from);
        let air = world.flown_air(slot, context.now, (from.at, current.altitude_m.get()));
        let next = current.next.get() as usize;
        let mission = match &path {
            FlightPathSource::Profile { segment, .. } => {
                let InterOrderSegment { model, mission, .. } = segment;
                let route = RoutePosition { mission, next, pose };
                air.local_mission(frame, model, route, world.timing.dt_s)
            }
            FlightPathSource::Track(_) => Cow::default(),
        };
        let effort = match &path {
            FlightPathSource::Profile { .. } => state.effort(slot),
            FlightPathSource::Track(_) => None,
        };
        Self {
            slot,
            path,
            from: from.at,
            frame,
            mission,
            air,
            pose,
            altitude_m: current.altitude_m.get(),
            since_s,
            next,
            legs: Vec::new(),
            flown: Vec::new(),
            states: Vec::new(),
            effort,
            end: None,
        }
    }

    /// Finds the legs that it flies in one step.
    pub(super) fn find_step_legs(&mut self, moment: SubStep, dtau_s: f64) {
        self.legs.clear();
        match &self.path {
            FlightPathSource::Profile { profile, segment, .. } => {
                let omega = profile.omegas_rad_s[moment.k];
                let whole =
                    ConstantRateLeg::new(0.0, dtau_s, self.pose, segment.model.v_m_s, omega);
                let to_climb_m = segment.altitude_m - self.altitude_m;
                // A level that is reached within the step splits it into two legs.
                let vertical_m_s = segment.vertical_m_s(self.altitude_m);
                let climbs_s = if vertical_m_s > 0.0 && to_climb_m != 0.0 {
                    to_climb_m.abs() / vertical_m_s
                } else {
                    0.0
                };
                let climb_m_s = if climbs_s > 0.0 { to_climb_m / climbs_s } else { 0.0 };
                let first = whole.with_climb(self.altitude_m, climb_m_s).in_wind(self.air.wind_m_s);
                self.legs.push(first.with_times(0.0, dtau_s.min(climbs_s)));
                if climbs_s < dtau_s {
                    self.legs.push(first.remainder(climbs_s).with_climb(segment.altitude_m, 0.0));
                }
                self.legs.retain(|leg| leg.from_s < leg.until_s);
            }
            FlightPathSource::Track(track) => {
                let times_s = [moment.step_s, moment.step_s + dtau_s];
                track.add_legs_in_interval(self.frame, times_s, &mut self.legs);
            }
        }
        self.record_legs(moment.step_s);
    }

    /// Records its state at the start of a step, as its reports tell it.
    pub(super) fn record_state(&mut self, step: u64) {
        let leg = self.legs.first();
        self.states.extend(leg.map(|leg| StateVector::from_leg(step, self.frame, leg)));
    }

    /// Adds the legs of a step to those flown in this `dt`.
    fn record_legs(&mut self, step_s: f64) {
        for leg in &self.legs {
            let leg = leg.with_times(step_s + leg.from_s, step_s + leg.until_s);
            match self.flown.last_mut().filter(|last| last.is_continued_by(&leg)) {
                Some(last) => last.until_s = leg.until_s,
                None => self.flown.push(leg),
            }
        }
    }

    /// Returns all levels that it is on during one step.
    pub(super) fn levels(&self, dtau_s: f64) -> FlightLevelRange {
        match &self.path {
            FlightPathSource::Profile { segment, .. } => {
                segment.levels_within(self.altitude_m, dtau_s)
            }
            // Within a step a track may leave the levels of its ends.
            FlightPathSource::Track(_) => FlightLevelRange::ALL,
        }
    }
}
