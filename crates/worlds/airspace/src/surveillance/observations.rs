//! The observations of a group in a cycle: the tracks of each observer, and what a run counts of them.

use super::observation_counts::ObservationCounts;
use super::report_archive::{LastReport, ReportArchive};
use super::track::SurveillanceTrack;
use crate::decide::DecisionStrategy;
use crate::events::Event;
use crate::join::have_to_avoid_each_other;
use crate::method::MethodKind;
use crate::scratch::PhaseContext;
use crate::settings::Deployment;
use crate::world::AirspaceWorld;
use sidestep_kernel::EntitySlot;

/// The tracks that one airplane has of others.
#[derive(Debug)]
struct ObserverTracks {
    observer: EntitySlot,
    /// By rising id of the airplane that is tracked.
    tracks: Vec<SurveillanceTrack>,
}

/// The observations of the airplanes of a group in a cycle.
#[derive(Debug, Default)]
pub(crate) struct GroupObservations {
    /// By rising id of the observer.
    observers: Vec<ObserverTracks>,
    counts: ObservationCounts,
    /// Tracks that were dropped in this cycle.
    dropped: Vec<Event>,
}

impl GroupObservations {
    /// Returns the observations that the airplanes of a group make, given by rising id: of non-cooperative airplanes,
    /// and of the others if each decides by itself from where it sees them. `None` where all see all.
    pub(crate) fn new(context: &PhaseContext<'_>, group: &[EntitySlot]) -> Option<Self> {
        let looks_at_all = each_decides_by_tracks(context.world);
        Self::of_subjects(context, group, |is_non_cooperative| is_non_cooperative || looks_at_all)
    }

    /// Returns the observations of non-cooperative airplanes alone.
    pub(crate) fn of_non_cooperative(
        context: &PhaseContext<'_>,
        group: &[EntitySlot],
    ) -> Option<Self> {
        Self::of_subjects(context, group, |is_non_cooperative| is_non_cooperative)
    }

    fn of_subjects(
        context: &PhaseContext<'_>,
        group: &[EntitySlot],
        looks_at: impl Fn(bool) -> bool,
    ) -> Option<Self> {
        let PhaseContext { world, now, .. } = *context;
        world.surveillance?;
        let mut all = Self::default();
        let is_non_cooperative: Vec<bool> =
            group.iter().map(|&slot| world.is_non_cooperative(slot, now)).collect();
        if !is_non_cooperative.iter().any(|&one| looks_at(one)) {
            return Some(all);
        }
        let archive = ReportArchive::new(context, group)?;
        let observers = (0..group.len()).filter(|&place| !is_non_cooperative[place]);
        for observer in observers {
            let mut tracks = Vec::new();
            for subject in (0..group.len()).filter(|&k| looks_at(is_non_cooperative[k])) {
                let is_near = || have_to_avoid_each_other(context, group[observer], group[subject]);
                if subject != observer && is_near() {
                    tracks.extend(all.observe(&archive, [observer, subject]));
                }
            }
            all.observers.push(ObserverTracks { observer: group[observer], tracks });
        }
        Some(all)
    }

    /// Counts an observation, and returns its track.
    fn observe(
        &mut self,
        archive: &ReportArchive<'_, '_>,
        pair: [usize; 2],
    ) -> Option<SurveillanceTrack> {
        self.counts.observations += 1;
        match archive.last_report(pair) {
            LastReport::Recent(step) => {
                self.counts.tracked += 1;
                self.counts.age_steps += archive.age_steps(step);
                archive.track(pair, step)
            }
            LastReport::JustDropped(step) => {
                self.dropped.push(archive.dropped_event(pair, step));
                None
            }
            LastReport::None => None,
        }
    }

    /// Returns the tracks of an observer, by rising id of the airplane that is tracked.
    pub(crate) fn tracks_of(&self, observer: EntitySlot) -> &[SurveillanceTrack] {
        let place = self.observers.binary_search_by_key(&observer, |one| one.observer);
        place.map_or(&[], |place| &self.observers[place].tracks)
    }

    /// Returns the latest track that any observer has of an airplane, with the observer: of equally late ones that of the
    /// smallest id.
    pub(crate) fn latest_track(&self, slot: EntitySlot) -> Option<&SurveillanceTrack> {
        let mut latest: Option<&SurveillanceTrack> = None;
        for one in &self.observers {
            let Ok(place) = one.tracks.binary_search_by_key(&slot, |track| track.slot) else {
                continue;
            };
            let track = &one.tracks[place];
            if latest.is_none_or(|before| track.step > before.step) {
                latest = Some(track);
            }
        }
        latest
    }

    /// Records the counts, and the tracks that were dropped.
    pub(crate) fn record(&self, context: &mut PhaseContext<'_>) {
        context.scratch.observed.add(self.counts);
        context.scratch.events.extend_from_slice(&self.dropped);
    }
}

/// Returns whether airplanes decide each by itself from where it sees others, and nobody tells it where they are.
pub(crate) fn each_decides_by_tracks(world: &AirspaceWorld) -> bool {
    let is_alone = world.deployment == Deployment::Direct;
    matches!(world.method, MethodKind::External) || is_alone && DecisionStrategy::is_reactive(world)
}
