//! Notes on one airplane while its group decides and flies.

use crate::agents::Decided;
use crate::agents::contact::Contacts;
use crate::agents::traffic::Traffic;
use crate::decide::Considered;
use crate::events::Event;
use crate::flight::{Action, Known};
use crate::intruder::Intruder;
use crate::pilot::{Control, Course, Own};
use crate::shield::{Decision, Flyer, Plan, Side, Way};
use crate::world::AirspaceWorld;
use sidestep_kernel::{EntityId, Slot};

/// Notes for an inspection; no run makes any.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    /// The airplane.
    pub(crate) slot: Slot,
    /// The airplanes of its group that the method flies, as all see them.
    pub(crate) group: Vec<Known>,
    /// Those of the group that mind no other.
    pub(crate) intruders: Vec<Intruder>,
    /// Its knowledge of others before.
    pub(crate) contacts: Contacts,
    /// The optimizer's decision for it.
    pub(crate) decided: Option<Decided>,
    /// Messages of the group's optimization.
    pub(crate) talk: Traffic,
    /// Its actions in the order in which it wants them; none by methods that give a heading.
    pub(crate) wishes: Vec<Action>,
    /// The different ways of those for one `dt`.
    pub(crate) ways: Vec<Way>,
    /// The shield's decision on that.
    pub(crate) decision: Option<Decision>,
    /// Its stored orbit before.
    pub(crate) flyer: Option<Flyer>,
    /// The others that keep it from flying its first wish.
    pub(crate) because: Vec<EntityId>,
    /// Beacons by which those of the group have found each other.
    pub(crate) beacons: Traffic,
    /// Messages of the group's shield.
    pub(crate) exchanged: Traffic,
    /// The way that it flies.
    pub(crate) flown: Option<Way>,
    /// Its events.
    pub(crate) events: Vec<Event>,
}

impl Notes {
    /// Notes the knowledge, the considerations and the decisions of a group.
    pub(crate) fn decided(
        &mut self,
        world: &AirspaceWorld,
        own: &[Own],
        intruders: &[Intruder],
        controls: &[Option<Control>],
        considered: &[Considered],
    ) {
        let Some(me) = self.place(own.iter().map(|own| own.id)) else { return };
        self.group = own.iter().map(Own::known).collect();
        self.intruders = intruders.to_vec();
        let Considered { actions, ways, decided } = considered[me].clone();
        (self.wishes, self.ways, self.decided) = (actions, ways, decided);
        for control in controls.iter().flatten() {
            self.beacons.add_beside(control.grouping);
            self.talk.add_beside(control.deciding);
            self.exchanged.add_beside(control.shielding);
        }
        if world.shield {
            let flyers: Vec<Flyer> = own.iter().map(|own| own.flyer(world)).collect();
            let wishes: Vec<&[Way]> = considered.iter().map(|one| &one.ways[..]).collect();
            let decision = |(flyer, control): (&Flyer, &Option<Control>)| {
                let course = control.as_ref().map_or(&Course::Orbit, |control| &control.course);
                course.decision(flyer.fallback)
            };
            let decisions: Vec<Decision> = flyers.iter().zip(controls).map(decision).collect();
            self.shielded(me, &flyers, &wishes, &decisions, world.timing.dtau_s);
        }
    }

    /// Returns its place in a group.
    fn place(&self, mut group: impl Iterator<Item = Slot>) -> Option<usize> {
        group.position(|slot| slot == self.slot)
    }

    /// Returns the part of it among those of its group.
    pub(crate) fn own<'a, T>(&self, of_all: &'a [T]) -> Option<&'a T> {
        of_all.get(self.place(self.group.iter().map(|known| known.slot))?)
    }

    /// Notes the shield's decision, and the others because of which it refused the first wish.
    fn shielded(
        &mut self,
        me: usize,
        flyers: &[Flyer],
        wishes: &[&[Way]],
        decisions: &[Decision],
        dtau_s: f64,
    ) {
        self.flyer = Some(flyers[me].clone());
        self.decision = Some(decisions[me]);
        let Some(wish) = wishes[me].first().filter(|_| decisions[me].candidate != Some(0)) else {
            return;
        };
        let steps = wish.omegas_rad_s.len();
        let fallback = |k: usize| Plan::fallback(flyers[k].clone(), steps, dtau_s);
        let plan = |k: usize, way: Option<usize>, side: Side| match way.map(|way| &wishes[k][way]) {
            Some(way) => Plan::new(flyers[k].clone(), way, dtau_s, side),
            None => fallback(k),
        };
        let wanted = Plan::new(flyers[me].clone(), wish, dtau_s, flyers[me].fallback);
        let against = |other: &dyn Fn(usize) -> Plan| -> Vec<EntityId> {
            let refuses = |k: &usize| *k != me && !wanted.is_compatible(&other(*k));
            (0..flyers.len()).filter(refuses).map(|k| flyers[k].id).collect()
        };
        // It gave way to the way that another one flies, to the one that the other wanted before it gave way too, or
        // to the orbit on which the other may always stay.
        let flown = |k: usize| plan(k, decisions[k].candidate, decisions[k].fallback);
        let first = |k: usize| plan(k, (!wishes[k].is_empty()).then_some(0), flyers[k].fallback);
        let all = [against(&flown), against(&first), against(&fallback)];
        self.because = all.into_iter().find(|some| !some.is_empty()).unwrap_or_default();
    }
}
