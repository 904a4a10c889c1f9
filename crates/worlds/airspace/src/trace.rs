//! Records of one airplane while its group decides and flies.

use crate::agents::ActionChoice;
use crate::agents::network_traffic::NetworkTraffic;
use crate::agents::traffic_state::TrafficPicture;
use crate::decide::ManeuverCandidates;
use crate::events::Event;
use crate::flight::{Action, KnownAircraft};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::pilot::{AirplaneControl, Maneuver, OwnshipState};
use crate::shield::{Fallback, SafeManeuver, ShieldDecision, ShieldedAircraft, TurnProfile};
use crate::surveillance::SurveillanceTrack;
use crate::world::AirspaceWorld;
use sidestep_kernel::{Cycle, EntityId, EntitySlot};

/// Records for an inspection; no run makes any.
#[derive(Debug, Default)]
pub(crate) struct InspectionTrace {
    /// The airplane that is inspected.
    pub(crate) slot: EntitySlot,
    /// The airplanes of its group that the method flies, as all see them.
    pub(crate) group: Vec<KnownAircraft>,
    /// The non-cooperative ones of the group.
    pub(crate) non_cooperative: Vec<NonCooperativeAircraft>,
    /// Its knowledge of others before.
    pub(crate) contacts: TrafficPicture,
    /// Its own tracks of others; none where all see all.
    pub(crate) tracks: Option<Vec<SurveillanceTrack>>,
    /// The actions that the optimizer has chosen for all of the group, if they are known.
    pub(crate) joint: Option<Vec<usize>>,
    /// The optimizer's decision for it.
    pub(crate) choice: Option<ActionChoice>,
    /// Messages of the group's optimization.
    pub(crate) optimization: NetworkTraffic,
    /// Its actions by falling preference; none by methods that give a heading.
    pub(crate) actions: Vec<Action>,
    /// Their different turn profiles for one `dt`.
    pub(crate) profiles: Vec<TurnProfile>,
    /// The shield's decision on that.
    pub(crate) decision: Option<ShieldDecision>,
    /// The airplane as the shield knows it, with its stored fallback before.
    pub(crate) aircraft: Option<ShieldedAircraft>,
    /// The others that keep it from flying its first candidate.
    pub(crate) blockers: Vec<EntityId>,
    /// Beacons by which those of the group have found each other.
    pub(crate) beacons: NetworkTraffic,
    /// Messages of the group's shield.
    pub(crate) exchange: NetworkTraffic,
    /// The turn profile that it flies.
    pub(crate) flown: Option<TurnProfile>,
    /// Events of the cycle in which it has a part.
    pub(crate) events: Vec<Event>,
}

/// The decisions of a group in a cycle, and what they rest on; `own`, `controls` and `considered` by the place of the
/// airplane in the group.
pub(crate) struct GroupDecisions<'a> {
    pub(crate) own: &'a [OwnshipState],
    pub(crate) non_cooperative: &'a [NonCooperativeAircraft],
    /// `None` for an airplane whose pilot has not decided in time.
    pub(crate) controls: &'a [Option<AirplaneControl>],
    pub(crate) considered: &'a [ManeuverCandidates],
}

impl InspectionTrace {
    /// Records the knowledge, the considerations and the decisions of a group.
    pub(crate) fn record_decisions(
        &mut self,
        world: &AirspaceWorld,
        now: Cycle,
        decided: &GroupDecisions<'_>,
    ) {
        let &GroupDecisions { own, non_cooperative, controls, considered } = decided;
        let Some(me) = self.place_in_group(own.iter().map(|own| own.id)) else { return };
        self.group = own.iter().map(OwnshipState::as_known_aircraft).collect();
        self.non_cooperative = non_cooperative.to_vec();
        self.joint =
            considered.iter().map(|one| one.decided.as_ref().map(|choice| choice.chosen)).collect();
        let candidates = considered[me].clone();
        self.actions = candidates.actions;
        self.profiles = candidates.profiles;
        self.choice = candidates.decided;
        for control in controls.iter().flatten() {
            self.beacons.add_participant_traffic(control.grouping);
            self.optimization.add_participant_traffic(control.deciding);
            self.exchange.add_participant_traffic(control.shielding);
        }
        if world.shield {
            let group: Vec<ShieldedAircraft> =
                own.iter().map(|own| own.shielded_aircraft(world, now)).collect();
            let mut decisions = Vec::with_capacity(group.len());
            for (aircraft, control) in group.iter().zip(controls) {
                let maneuver = control.as_ref().map_or(&Maneuver::Orbit, |one| &one.maneuver);
                decisions.push(maneuver.to_shield_decision(aircraft.fallback));
            }
            self.aircraft = Some(group[me].clone());
            self.decision = Some(decisions[me]);
            let shield = ShieldOutcome {
                group: &group,
                candidates: considered,
                decisions: &decisions,
                dtau_s: world.timing.dtau_s,
            };
            self.blockers = shield.blockers(me);
        }
    }

    /// Returns its place in a group; `None` in one of others.
    fn place_in_group(&self, mut group: impl Iterator<Item = EntitySlot>) -> Option<usize> {
        group.position(|slot| slot == self.slot)
    }

    /// Returns the part of it among those of its group.
    pub(crate) fn own_part<'a, T>(&self, of_all: &'a [T]) -> Option<&'a T> {
        of_all.get(self.place_in_group(self.group.iter().map(|known| known.slot))?)
    }
}

/// What the shield of a group has decided, and on what.
struct ShieldOutcome<'a> {
    group: &'a [ShieldedAircraft],
    candidates: &'a [ManeuverCandidates],
    decisions: &'a [ShieldDecision],
    dtau_s: f64,
}

impl ShieldOutcome<'_> {
    /// Returns the others because of which the shield refused the first candidate of an airplane.
    fn blockers(&self, me: usize) -> Vec<EntityId> {
        let own = &self.group[me];
        let Some(preferred) = self.candidates[me].profiles.first() else { return Vec::new() };
        if self.decisions[me].candidate == Some(0) {
            return Vec::new();
        }
        let steps = preferred.omegas_rad_s.len();
        let preferred = SafeManeuver::new(own.clone(), preferred, self.dtau_s, own.fallback);
        // It gave way to the plan that another one flies, to the one that the other preferred before it gave way too,
        // or to the orbit on which the other may always stay.
        let flown = |k: usize| {
            let ShieldDecision { candidate, fallback, .. } = self.decisions[k];
            self.plan(k, candidate, fallback, steps)
        };
        let first = |k: usize| {
            let candidate = (!self.candidates[k].profiles.is_empty()).then_some(0);
            self.plan(k, candidate, self.group[k].fallback, steps)
        };
        let orbit = |k: usize| SafeManeuver::on_fallback(self.group[k].clone(), steps, self.dtau_s);
        let plans: [&dyn Fn(usize) -> SafeManeuver; 3] = [&flown, &first, &orbit];
        for plan in plans {
            let others = (0..self.group.len()).filter(|&k| k != me);
            let blockers: Vec<EntityId> = others
                .filter(|&k| !preferred.is_compatible(&plan(k)))
                .map(|k| self.group[k].id)
                .collect();
            if !blockers.is_empty() {
                return blockers;
            }
        }
        Vec::new()
    }

    /// Returns the plan of an airplane with a candidate, or else on its stored fallback.
    fn plan(
        &self,
        k: usize,
        candidate: Option<usize>,
        fallback: Fallback,
        steps: usize,
    ) -> SafeManeuver {
        let aircraft = self.group[k].clone();
        match candidate {
            Some(candidate) => {
                let profile = &self.candidates[k].profiles[candidate];
                SafeManeuver::new(aircraft, profile, self.dtau_s, fallback)
            }
            None => SafeManeuver::on_fallback(aircraft, steps, self.dtau_s),
        }
    }
}
