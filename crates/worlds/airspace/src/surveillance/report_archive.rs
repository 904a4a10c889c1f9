//! The reports of the airplanes of a group, and who has received them.

use super::state_report::{present_state, with_navigation_errors};
use super::state_vector::{StateVector, StateVectorHistory};
use super::track::SurveillanceTrack;
use crate::events::{Event, EventKind};
use crate::purpose;
use crate::scratch::PhaseContext;
use crate::settings::SurveillanceSettings;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::distr::normal_pair;
use sidestep_kernel::geometry::{add, scaled};
use sidestep_kernel::math;
use std::sync::Arc;

/// Numbers of the draws of one observer, airplane and report.
const RECEPTION_DRAW: u32 = 0;
const POSITION_DRAW: u32 = 1;
const VELOCITY_DRAW: u32 = 2;

/// The last report that an observer has received of another airplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LastReport {
    /// That of a step, which is recent enough for a track.
    Recent(u64),
    /// That of a step so long ago that there is no track from this cycle on. In the cycle before there was one if the other
    /// airplane was near, which reports do not tell.
    JustDropped(u64),
    /// None for so long that there was no track in the cycle before, either.
    None,
}

/// The reports of the airplanes of a group up to the present cycle.
pub(crate) struct ReportArchive<'a, 'b> {
    context: &'a PhaseContext<'b>,
    settings: SurveillanceSettings,
    /// The step with which the present cycle begins.
    now_step: u64,
    /// The airplanes of the group, by rising id.
    group: &'a [EntitySlot],
    histories: Vec<Arc<StateVectorHistory>>,
    present: Vec<StateVector>,
}

impl<'a, 'b> ReportArchive<'a, 'b> {
    /// Returns the reports of a group, given by rising id; `None` where all see all.
    pub(crate) fn new(context: &'a PhaseContext<'b>, group: &'a [EntitySlot]) -> Option<Self> {
        let PhaseContext { world, state, now, .. } = *context;
        let settings = world.surveillance?;
        Some(Self {
            settings,
            now_step: now * world.timing.points_per_dt() as u64,
            histories: group.iter().map(|&slot| state.state_vectors(slot)).collect(),
            present: group.iter().map(|&slot| present_state(world, state, now, slot)).collect(),
            context,
            group,
        })
    }

    /// Returns the last report that an observer has received of another airplane, by their places in the group.
    pub(super) fn last_report(&self, pair: [usize; 2]) -> LastReport {
        if let Some(step) = self.latest_received(pair, self.now_step) {
            return LastReport::Recent(step);
        }
        let steps_per_cycle = self.context.world.timing.points_per_dt() as u64;
        let before = self.now_step.checked_sub(steps_per_cycle);
        let dropped = before.and_then(|before| self.latest_received(pair, before));
        dropped.map_or(LastReport::None, LastReport::JustDropped)
    }

    /// Returns the step of the latest report from which an observer has a track at a step.
    fn latest_received(&self, pair: [usize; 2], at_step: u64) -> Option<u64> {
        let SurveillanceSettings { interval_steps, latency_steps, coast_steps, .. } = self.settings;
        let latest = at_step.checked_sub(latency_steps)?;
        let oldest = at_step.saturating_sub(coast_steps);
        let [_, subject] = pair;
        let since_first = latest.checked_sub(self.report_offset(subject))?;
        let mut step = latest - since_first % interval_steps;
        while step >= oldest {
            if self.is_received(pair, step) {
                return Some(step);
            }
            step = step.checked_sub(interval_steps)?;
        }
        None
    }

    /// Returns the first step in which an airplane reports: not all do at the same time.
    fn report_offset(&self, subject: usize) -> u64 {
        let interval_steps = self.settings.interval_steps;
        if interval_steps == 1 {
            return 0;
        }
        let streams = self.context.world.streams;
        let [low, high, ..] = streams.block(self.group[subject], 0, purpose::REPORT_OFFSET, 0);
        (u64::from(low) | u64::from(high) << 32) % interval_steps
    }

    fn is_received(&self, pair: [usize; 2], step: u64) -> bool {
        let [observer, subject] = pair;
        let there = self.state_at(observer, step).zip(self.state_at(subject, step));
        let Some((receiver, sender)) = there else { return false };
        let SurveillanceSettings { reception, range_m, .. } = self.settings;
        let is_in_range = || {
            let surface = self.context.world.surface;
            let level_m = surface.distance_m(receiver.pose.at, sender.pose.at);
            math::hypot(level_m, receiver.altitude_m - sender.altitude_m) <= range_m
        };
        let [word, ..] = self.draw(pair, step, RECEPTION_DRAW);
        reception.sample(word) && (range_m == f64::INFINITY || is_in_range())
    }

    fn draw(&self, [observer, subject]: [usize; 2], step: u64, index: u32) -> [u32; 4] {
        let streams = self.context.world.streams;
        let observer = self.group[observer];
        streams.words_for_pair(observer, self.group[subject], step, purpose::REPORT, index)
    }

    /// Returns the state of an airplane at the start of a step, without errors.
    fn state_at(&self, place: usize, step: u64) -> Option<&StateVector> {
        if step == self.now_step {
            return self.present.get(place);
        }
        self.histories[place].at_step(step)
    }

    /// Returns the track that an observer has by the report of a step.
    pub(super) fn track(&self, pair: [usize; 2], step: u64) -> Option<SurveillanceTrack> {
        let [_, subject] = pair;
        let world = self.context.world;
        let slot = self.group[subject];
        let state = *self.state_at(subject, step)?;
        let reported = with_navigation_errors(self.context, slot, state);
        let SurveillanceSettings { position_noise_m, velocity_noise_m_s, .. } = self.settings;
        let mut at = reported.pose.at;
        if position_noise_m > 0.0 {
            let error = normal_pair(self.draw(pair, step, POSITION_DRAW));
            let frame = world.surface.frame_at(at);
            at = frame.to_world(add(frame.to_local(at), scaled(error, position_noise_m)));
        }
        let mut velocity_m_s = reported.velocity_m_s;
        if velocity_noise_m_s > 0.0 {
            let error = normal_pair(self.draw(pair, step, VELOCITY_DRAW));
            velocity_m_s = add(velocity_m_s, scaled(error, velocity_noise_m_s));
        }
        Some(SurveillanceTrack {
            slot,
            step,
            age_s: self.age_s(step),
            at,
            velocity_m_s,
            altitude_m: reported.altitude_m,
            climb_m_s: reported.climb_m_s,
        })
    }

    /// Returns the age of a report in steps.
    pub(super) fn age_steps(&self, step: u64) -> u64 {
        self.now_step - step
    }

    /// Returns the age of a report in seconds.
    fn age_s(&self, step: u64) -> f64 {
        self.age_steps(step) as f64 * self.context.world.timing.dtau_s
    }

    /// Returns the event of a track that was dropped, whose report was of a step.
    pub(super) fn dropped_event(&self, [observer, subject]: [usize; 2], step: u64) -> Event {
        let pair = [observer, subject].map(|place| self.group[place]);
        let event =
            Event::new_for_pair(self.context.now, EventKind::TrackDropped, pair[0], pair[1]);
        event.with_value(self.age_s(step))
    }

    /// Returns the error of the position of a report as a multiple of its bound.
    pub(super) fn error_ratio(&self, track: &SurveillanceTrack) -> f64 {
        let world = self.context.world;
        let bound_m = world.position_bound_m(track.slot as usize) + self.settings.position_bound_m;
        let place = self.group.binary_search(&track.slot).ok();
        let state = place.and_then(|place| self.state_at(place, track.step));
        let error_m = state.map_or(0.0, |one| world.surface.distance_m(one.pose.at, track.at));
        // A bound may be 0 where there is no error, either.
        if error_m > 0.0 { error_m / bound_m } else { 0.0 }
    }
}
