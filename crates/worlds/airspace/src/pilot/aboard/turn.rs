//! A cycle of one airplane, up to its present stage.

use crate::agents::contact::Contacts;
use crate::agents::packet::{TalkId, Topic};
use crate::agents::traffic::Traffic;
use crate::agents::{Ended, Talk};
use crate::decide::Considered;
use crate::events::{Event, EventKind};
use crate::pilot::control::Control;
use crate::pilot::schedule::Schedule;
use crate::pilot::sight::{Sight, Sighted};
use crate::pilot::talks::{Came, Speaker};
use crate::world::AirspaceWorld;
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// A cycle of one airplane.
pub(super) struct Turn {
    pub(super) sight: Sight,
    pub(super) schedule: Schedule,
    /// Ids of the airplanes that decide together as far as it knows, rising.
    pub(super) members: Arc<[EntityId]>,
    /// Airplanes near it that are not among them, by rising id.
    pub(super) unheard: Vec<Sighted>,
    pub(super) stage: Stage,
    pub(super) considered: Considered,
    /// Its control, as far as that is decided.
    pub(super) control: Control,
}

/// The part of a cycle that an airplane is in.
pub(super) enum Stage {
    /// A talk that finds the group.
    Grouping(Talk<Speaker>),
    /// A talk about the wishes of each.
    Deciding(Talk<Speaker>),
    /// It has chosen its wishes, and waits until the shield's exchange starts.
    Decided,
    /// The shield's exchange; the places of the ways that it has proposed, among all that it considers.
    Shielding(Talk<Speaker>, Vec<usize>),
    /// The control is there.
    Over,
}

/// The place of a talk beside those of a cycle.
pub(super) enum Stands {
    /// It comes later.
    Before,
    /// It comes so much later that no airplane can be there.
    FarBefore,
    /// It is of the same cycle and subject, and of other members.
    Beside,
    /// It is over.
    Beyond,
}

impl Turn {
    /// Returns the talk that it is in.
    pub(super) fn talk(&mut self) -> Option<&mut Talk<Speaker>> {
        match &mut self.stage {
            Stage::Grouping(talk) | Stage::Deciding(talk) | Stage::Shielding(talk, _) => Some(talk),
            Stage::Decided | Stage::Over => None,
        }
    }

    /// Returns where a talk stands that is none of those that it has been in.
    pub(super) fn stands_at(&self, talk: &TalkId) -> Stands {
        let topic = match self.stage {
            Stage::Grouping(_) => Topic::Group,
            Stage::Deciding(_) | Stage::Decided => Topic::Decision,
            Stage::Shielding(..) | Stage::Over => Topic::Shield,
        };
        let here = TalkId { topic, ..TalkId::new(self.sight.cycle, topic, &self.members) };
        // No airplane begins a cycle before all have ended the one before it.
        let last = self.sight.cycle.saturating_add(1);
        match () {
            () if talk.cycle > last => Stands::FarBefore,
            () if here.is_before(talk) => Stands::Before,
            () if (talk.cycle, talk.topic) == (here.cycle, here.topic) => Stands::Beside,
            () => Stands::Beyond,
        }
    }

    /// Notes the packets of the talk that it is in, and the time that it took.
    pub(super) fn note_traffic(&mut self, ticks: u64) {
        let (traffic, noted) = match &self.stage {
            Stage::Grouping(talk) => (talk.traffic(), &mut self.control.grouping),
            Stage::Deciding(talk) => (talk.traffic(), &mut self.control.deciding),
            Stage::Shielding(talk, _) => (talk.traffic(), &mut self.control.shielding),
            Stage::Decided | Stage::Over => return,
        };
        *noted = Traffic { ticks, ..traffic };
    }

    /// Notes how a talk has ended, and the others that it no longer hears.
    pub(super) fn note_end(
        &mut self,
        world: &AirspaceWorld,
        end: &Ended<Came>,
        contacts: &Contacts,
    ) {
        // Where groups are found, missing airplanes are noted once the members are known.
        let is_group = matches!(self.stage, Stage::Grouping(_));
        let missing = end.unheard.iter().filter(|_| !is_group);
        self.note_unheard(world, missing.map(|&place| self.spoken_to()[place]).collect(), contacts);
        if end.late {
            let event = Event::of(self.sight.cycle, EventKind::Deadline, self.sight.own.id);
            self.control.events.push(event);
        }
    }

    /// Returns the ids of those that the party to a talk is to know, rising.
    pub(super) fn known_in(&self, topic: Topic) -> Arc<[EntityId]> {
        match topic {
            Topic::Shield => self.in_scene().into(),
            Topic::Group | Topic::Decision => self.members.clone(),
        }
    }

    /// Returns the ids of the airplanes that the party to the present talk knows, by their places.
    fn spoken_to(&self) -> Vec<EntityId> {
        match self.stage {
            Stage::Shielding(..) => self.in_scene(),
            _ => self.members.to_vec(),
        }
    }

    /// Returns the ids of all airplanes that the shield minds: its group, and those nearby that are not heard,
    /// rising.
    fn in_scene(&self) -> Vec<EntityId> {
        let unheard = self.unheard.iter().map(|one| one.id);
        let mut all: Vec<EntityId> = self.members.iter().copied().chain(unheard).collect();
        all.sort_unstable();
        all
    }

    /// Notes the others that are no longer heard.
    pub(super) fn note_unheard(
        &mut self,
        world: &AirspaceWorld,
        unheard: Vec<EntityId>,
        contacts: &Contacts,
    ) {
        let (id, now) = (self.sight.own.id, self.sight.cycle);
        let heard_in = |other: &EntityId| match contacts.get(other) {
            Some(contact) => contact.heard_in,
            None => world.appears_in(*other as usize),
        };
        let lost = unheard.into_iter().filter(|other| heard_in(other) + 1 >= now);
        let lost: Vec<Event> =
            lost.map(|other| Event::of_pair(now, EventKind::Unheard, id, other)).collect();
        self.control.events.extend(lost);
    }
}
