//! Notes on one airplane while its group decides and flies.

use crate::agents::ActionChoice;
use crate::agents::network_traffic::NetworkTraffic;
use crate::agents::traffic_state::TrafficPicture;
use crate::decide::ManeuverCandidates;
use crate::events::Event;
use crate::flight::{Action, KnownAircraft};
use crate::non_cooperative::NonCooperative;
use crate::pilot::{Control, Maneuver, OwnshipState};
use crate::shield::{SafeManeuver, ShieldDecision, ShieldedAircraft, Side, TurnProfile};
use crate::world::AirspaceWorld;
use sidestep_kernel::{EntityId, Slot};

/// Notes for an inspection; no run makes any.
#[derive(Debug, Default)]
pub(crate) struct InspectionTrace {
    /// The airplane.
    pub(crate) slot: Slot,
    /// The airplanes of its group that the method flies, as all see them.
    pub(crate) group: Vec<KnownAircraft>,
    /// Those of the group that mind no other.
    pub(crate) intruders: Vec<NonCooperative>,
    /// Its knowledge of others before.
    pub(crate) contacts: TrafficPicture,
    /// The optimizer's decision for it.
    pub(crate) choice: Option<ActionChoice>,
    /// Messages of the group's optimization.
    pub(crate) optimization: NetworkTraffic,
    /// Its actions in the order in which it wants them; none by methods that give a heading.
    pub(crate) wishes: Vec<Action>,
    /// The different ways of those for one `dt`.
    pub(crate) ways: Vec<TurnProfile>,
    /// The shield's decision on that.
    pub(crate) decision: Option<ShieldDecision>,
    /// Its stored orbit before.
    pub(crate) aircraft: Option<ShieldedAircraft>,
    /// The others that keep it from flying its first wish.
    pub(crate) blockers: Vec<EntityId>,
    /// Beacons by which those of the group have found each other.
    pub(crate) beacons: NetworkTraffic,
    /// Messages of the group's shield.
    pub(crate) exchange: NetworkTraffic,
    /// The way that it flies.
    pub(crate) flown: Option<TurnProfile>,
    /// Its events.
    pub(crate) events: Vec<Event>,
}

impl InspectionTrace {
    /// Notes the knowledge, the considerations and the decisions of a group.
    pub(crate) fn record_decisions(
        &mut self,
        world: &AirspaceWorld,
        own: &[OwnshipState],
        intruders: &[NonCooperative],
        controls: &[Option<Control>],
        considered: &[ManeuverCandidates],
    ) {
        let Some(me) = self.place(own.iter().map(|own| own.id)) else { return };
        self.group = own.iter().map(OwnshipState::known_aircraft).collect();
        self.intruders = intruders.to_vec();
        let ManeuverCandidates { actions, ways, decided } = considered[me].clone();
        (self.wishes, self.ways, self.choice) = (actions, ways, decided);
        for control in controls.iter().flatten() {
            self.beacons.merge_participant(control.grouping);
            self.optimization.merge_participant(control.deciding);
            self.exchange.merge_participant(control.shielding);
        }
        if world.shield {
            let flyers: Vec<ShieldedAircraft> =
                own.iter().map(|own| own.shielded_aircraft(world)).collect();
            let wishes: Vec<&[TurnProfile]> = considered.iter().map(|one| &one.ways[..]).collect();
            let decision = |(flyer, control): (&ShieldedAircraft, &Option<Control>)| {
                let course = control.as_ref().map_or(&Maneuver::Orbit, |control| &control.course);
                course.shield_decision(flyer.fallback)
            };
            let decisions: Vec<ShieldDecision> =
                flyers.iter().zip(controls).map(decision).collect();
            self.record_shield(me, &flyers, &wishes, &decisions, world.timing.dtau_s);
        }
    }

    /// Returns its place in a group.
    fn place(&self, mut group: impl Iterator<Item = Slot>) -> Option<usize> {
        group.position(|slot| slot == self.slot)
    }

    /// Returns the part of it among those of its group.
    pub(crate) fn own_part<'a, T>(&self, of_all: &'a [T]) -> Option<&'a T> {
        of_all.get(self.place(self.group.iter().map(|known| known.slot))?)
    }

    /// Notes the shield's decision, and the others because of which it refused the first wish.
    fn record_shield(
        &mut self,
        me: usize,
        flyers: &[ShieldedAircraft],
        wishes: &[&[TurnProfile]],
        decisions: &[ShieldDecision],
        dtau_s: f64,
    ) {
        self.aircraft = Some(flyers[me].clone());
        self.decision = Some(decisions[me]);
        let Some(wish) = wishes[me].first().filter(|_| decisions[me].candidate != Some(0)) else {
            return;
        };
        let steps = wish.omegas_rad_s.len();
        let fallback = |k: usize| SafeManeuver::fallback(flyers[k].clone(), steps, dtau_s);
        let plan = |k: usize, way: Option<usize>, side: Side| match way.map(|way| &wishes[k][way]) {
            Some(way) => SafeManeuver::new(flyers[k].clone(), way, dtau_s, side),
            None => fallback(k),
        };
        let wanted = SafeManeuver::new(flyers[me].clone(), wish, dtau_s, flyers[me].fallback);
        let against = |other: &dyn Fn(usize) -> SafeManeuver| -> Vec<EntityId> {
            let refuses = |k: &usize| *k != me && !wanted.is_compatible(&other(*k));
            (0..flyers.len()).filter(refuses).map(|k| flyers[k].id).collect()
        };
        // It gave way to the way that another one flies, to the one that the other wanted before it gave way too, or
        // to the orbit on which the other may always stay.
        let flown = |k: usize| plan(k, decisions[k].candidate, decisions[k].fallback);
        let first = |k: usize| plan(k, (!wishes[k].is_empty()).then_some(0), flyers[k].fallback);
        let all = [against(&flown), against(&first), against(&fallback)];
        self.blockers = all.into_iter().find(|some| !some.is_empty()).unwrap_or_default();
    }
}
