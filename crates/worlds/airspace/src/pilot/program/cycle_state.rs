//! A cycle of one airplane, up to its present phase.

use crate::agents::network_traffic::NetworkTraffic;
use crate::agents::packet::{ConversationId, Protocol};
use crate::agents::traffic_state::TrafficPicture;
use crate::agents::{Conversation, ConversationEnd};
use crate::decide::ManeuverCandidates;
use crate::events::{Event, EventKind};
use crate::pilot::common_plans::CommonPlans;
use crate::pilot::control::AirplaneControl;
use crate::pilot::conversations::{ConversationOutcome, DynParticipant};
use crate::pilot::percept::{Percept, SurveillanceReport};
use crate::pilot::schedule::ConversationSchedule;
use crate::world::AirspaceWorld;
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// A cycle of one airplane.
pub(super) struct PilotCycleState {
    pub(super) percept: Percept,
    pub(super) schedule: ConversationSchedule,
    /// Ids of the airplanes that decide together as far as it knows, rising.
    pub(super) members: Arc<[EntityId]>,
    /// Airplanes near it that are not among them, by rising id.
    pub(super) unheard: Vec<SurveillanceReport>,
    pub(super) phase: PilotCyclePhase,
    pub(super) candidates: ManeuverCandidates,
    /// What all compute for each member, from what all see.
    pub(super) plans: CommonPlans,
    /// Its control, as far as that is decided.
    pub(super) control: AirplaneControl,
}

/// The part of a cycle that an airplane is in.
pub(super) enum PilotCyclePhase {
    /// A conversation that finds the group.
    Grouping(Conversation<DynParticipant>),
    /// A conversation in which candidates are chosen.
    Deciding(Conversation<DynParticipant>),
    /// It has chosen its candidates, and waits until the shield's exchange starts.
    Decided,
    /// The shield's exchange; the places of the profiles that it has proposed, among all candidates.
    Shielding(Conversation<DynParticipant>, Vec<usize>),
    /// The control is there.
    Over,
}

/// When a conversation takes place, compared with those of a cycle.
pub(super) enum ConversationMismatch {
    /// It comes later.
    Later,
    /// It comes so much later that no airplane can be there.
    TooFarAhead,
    /// It is of the same cycle and subject, and of other members.
    OtherMembers,
    /// It is over.
    Past,
}

impl PilotCycleState {
    /// Returns the conversation that it is in; `None` between two of them and after the last.
    pub(super) fn conversation(&mut self) -> Option<&mut Conversation<DynParticipant>> {
        match &mut self.phase {
            PilotCyclePhase::Grouping(conversation)
            | PilotCyclePhase::Deciding(conversation)
            | PilotCyclePhase::Shielding(conversation, _) => Some(conversation),
            PilotCyclePhase::Decided | PilotCyclePhase::Over => None,
        }
    }

    /// Returns where a conversation stands that is none of those that it has been in.
    pub(super) fn relative_conversation_timing(
        &self,
        conversation: &ConversationId,
    ) -> ConversationMismatch {
        let topic = match self.phase {
            PilotCyclePhase::Grouping(_) => Protocol::Group,
            PilotCyclePhase::Deciding(_) | PilotCyclePhase::Decided => Protocol::Decision,
            PilotCyclePhase::Shielding(..) | PilotCyclePhase::Over => Protocol::Shield,
        };
        let here = ConversationId {
            topic,
            ..ConversationId::new(self.percept.cycle, topic, &self.members)
        };
        // No airplane begins a cycle before all have ended the one before it.
        let last = self.percept.cycle.saturating_add(1);
        if conversation.cycle > last {
            ConversationMismatch::TooFarAhead
        } else if here.is_before(conversation) {
            ConversationMismatch::Later
        } else if (conversation.cycle, conversation.topic) == (here.cycle, here.topic) {
            ConversationMismatch::OtherMembers
        } else {
            ConversationMismatch::Past
        }
    }

    /// Records the packets of the conversation that it is in, and the time that it took.
    pub(super) fn record_traffic(&mut self, ticks: u64) {
        let (traffic, recorded) = match &self.phase {
            PilotCyclePhase::Grouping(conversation) => {
                (conversation.network_traffic(), &mut self.control.grouping)
            }
            PilotCyclePhase::Deciding(conversation) => {
                (conversation.network_traffic(), &mut self.control.deciding)
            }
            PilotCyclePhase::Shielding(conversation, _) => {
                (conversation.network_traffic(), &mut self.control.shielding)
            }
            PilotCyclePhase::Decided | PilotCyclePhase::Over => return,
        };
        *recorded = NetworkTraffic { ticks, ..traffic };
    }

    /// Records how a conversation has ended, and the others that it no longer hears.
    pub(super) fn record_conversation_end(
        &mut self,
        world: &AirspaceWorld,
        end: &ConversationEnd<ConversationOutcome>,
        contacts: &TrafficPicture,
    ) {
        // Where groups are found, missing airplanes are noted once the members are known.
        let is_group = matches!(self.phase, PilotCyclePhase::Grouping(_));
        let missing = end.unheard.iter().filter(|_| !is_group);
        self.record_unheard(
            world,
            missing.map(|&place| self.conversation_members()[place]).collect(),
            contacts,
        );
        if end.late {
            let event = Event::new(self.percept.cycle, EventKind::Deadline, self.percept.own.id);
            self.control.events.push(event);
        }
    }

    /// Returns the ids of those that the participant of a conversation is to know, rising.
    pub(super) fn topic_members(&self, topic: Protocol) -> Arc<[EntityId]> {
        match topic {
            Protocol::Shield => self.exchange_members().into(),
            Protocol::Group | Protocol::Decision => self.members.clone(),
        }
    }

    /// Returns the ids of the airplanes that the participant to the present conversation knows, by their places.
    fn conversation_members(&self) -> Vec<EntityId> {
        match self.phase {
            PilotCyclePhase::Shielding(..) => self.exchange_members(),
            _ => self.members.to_vec(),
        }
    }

    /// Returns the ids of all airplanes that the shield considers: its group, and those nearby that are not heard,
    /// rising.
    fn exchange_members(&self) -> Vec<EntityId> {
        let unheard = self.unheard.iter().map(|one| one.id);
        let mut all: Vec<EntityId> = self.members.iter().copied().chain(unheard).collect();
        all.sort_unstable();
        all
    }

    /// Records the others that are no longer heard.
    pub(super) fn record_unheard(
        &mut self,
        world: &AirspaceWorld,
        unheard: Vec<EntityId>,
        contacts: &TrafficPicture,
    ) {
        let id = self.percept.own.id;
        let now = self.percept.cycle;
        for other in unheard {
            let heard_in = match contacts.get(&other) {
                Some(contact) => contact.heard_in,
                None => world.appearance_cycle(other as usize),
            };
            // One that has been unheard for longer was recorded then.
            if heard_in + 1 >= now {
                self.control.events.push(Event::new_for_pair(now, EventKind::Unheard, id, other));
            }
        }
    }
}
