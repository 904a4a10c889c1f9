//! What a group perceives of the airplanes that do not tell where they are.

use super::observations::GroupObservations;
use super::report_archive::ReportArchive;
use crate::events::{Event, EventKind};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::perceive::{non_cooperative_at, true_non_cooperative_at};
use crate::scratch::PhaseContext;
use sidestep_kernel::EntitySlot;

/// What a group perceives of others in a cycle.
#[derive(Debug, Default)]
pub(crate) struct PerceivedTraffic {
    /// The non-cooperative airplanes of the group, as it sees them, by id.
    pub(crate) non_cooperative: Vec<NonCooperativeAircraft>,
    /// Those of which nobody in the group has a track, as they are: the run alone knows it, which names pairs with them.
    pub(crate) unseen: Vec<NonCooperativeAircraft>,
    /// The observations of each airplane; `None` where all see all.
    pub(crate) observations: Option<GroupObservations>,
}

impl PerceivedTraffic {
    /// Returns what a group, given by rising id, perceives.
    pub(crate) fn new(context: &PhaseContext<'_>, group: &[EntitySlot]) -> Self {
        Self::by_observations(context, group, GroupObservations::new(context, group))
    }

    /// Returns the non-cooperative airplanes of a group, given by rising id, as it sees them.
    pub(crate) fn non_cooperative_aircraft(
        context: &PhaseContext<'_>,
        group: &[EntitySlot],
    ) -> Vec<NonCooperativeAircraft> {
        let observations = GroupObservations::of_non_cooperative(context, group);
        Self::by_observations(context, group, observations).non_cooperative
    }

    fn by_observations(
        context: &PhaseContext<'_>,
        group: &[EntitySlot],
        observations: Option<GroupObservations>,
    ) -> Self {
        let mut all = Self::default();
        let PhaseContext { world, now, .. } = *context;
        for &slot in group.iter().filter(|slot| world.is_non_cooperative(**slot, now)) {
            let Some(observations) = &observations else {
                all.non_cooperative.push(non_cooperative_at(context, slot));
                continue;
            };
            match observations.latest_track(slot) {
                Some(track) => all.non_cooperative.push(track.non_cooperative_aircraft(world)),
                None => all.unseen.push(true_non_cooperative_at(context, slot)),
            }
        }
        all.observations = observations;
        all
    }

    /// Records what a run counts of it: observations, tracks that were dropped, and reports of non-cooperative airplanes
    /// with errors beyond the bounds of the shield.
    pub(crate) fn record(&self, context: &mut PhaseContext<'_>, group: &[EntitySlot]) {
        let Some(observations) = &self.observations else { return };
        observations.record(context);
        if !context.world.shield || self.non_cooperative.is_empty() {
            return;
        }
        let mut beyond = Vec::new();
        if let Some(archive) = ReportArchive::new(context, group) {
            for one in &self.non_cooperative {
                let track = observations.latest_track(one.slot);
                let ratio = track.map_or(0.0, |track| archive.error_ratio(track));
                if ratio > 1.0 {
                    let event = Event::new(context.now, EventKind::BeyondBound, one.slot);
                    beyond.push(event.with_value(ratio));
                }
            }
        }
        context.scratch.events.extend(beyond);
    }
}
