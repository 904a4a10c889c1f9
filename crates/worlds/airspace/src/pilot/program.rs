//! The pilot, as a state machine.

mod conclude;
mod cycle_state;

use super::common_knowledge::plan_certainty;
use super::common_plans::CommonPlans;
use super::control::{AirplaneControl, Maneuver, PilotMemory};
use super::conversations::{
    DynParticipant, PilotKnowledge, grouping_participant, intent_participant,
    optimization_participant, shield_exchange_participant,
};
use super::early_packets::EarlyPackets;
use super::percept::Percept;
use super::schedule::{ConversationSchedule, retry_policy};
use crate::agents::network_traffic::NetworkTraffic;
use crate::agents::packet::{ConversationId, Protocol};
use crate::agents::traffic_state::TrafficPicture;
use crate::agents::{
    Conversation, ConversationProgress, ConversationSetup, EndpointConfig, Participant,
};
use crate::avoid::NonCooperativeAvoidance;
use crate::decide::{DecisionStrategy, ManeuverCandidates};
use crate::events::{Event, EventKind};
use crate::settings::Grouping;
use crate::shield::PlanCertainty;
use crate::world::AirspaceWorld;
use cycle_state::{ConversationMismatch, PilotCyclePhase, PilotCycleState};
use sidestep_kernel::network::{
    DropCounts, DropReason, NetworkAgent, OutgoingPacket, PacketOutbox, digest_pieces, parse_packet,
};
use sidestep_kernel::{Cycle, EntityId};
use std::collections::VecDeque;
use std::sync::Arc;

/// Number of ended conversations of which questions are answered: those of two cycles, because no airplane is more
/// than one cycle behind another.
const MAX_PAST_CONVERSATIONS: usize = 6;

/// The program aboard one airplane: see the [module](super).
pub struct Pilot {
    world: Arc<AirspaceWorld>,
    id: EntityId,
    fingerprint: u64,
    memory: PilotMemory,
    /// The cycle that it is in, or was in last.
    state: Option<PilotCycleState>,
    /// The common plans of the cycle that it starts next.
    plans: CommonPlans,
    /// Talks that have ended for it.
    past: VecDeque<Conversation<dyn Participant>>,
    early: EarlyPackets,
    out: PacketOutbox,
    dropped: DropCounts,
}

impl Pilot {
    /// Returns the pilot of an airplane that remembers the `contacts` of earlier cycles.
    ///
    /// # Panics
    /// When there is no such airplane in the world.
    pub fn new(world: Arc<AirspaceWorld>, id: EntityId, contacts: TrafficPicture) -> Self {
        Self::with_memory(world, id, PilotMemory { contacts, ..PilotMemory::default() })
    }

    /// Returns the pilot of an airplane with all that it remembers.
    ///
    /// # Panics
    /// When there is no such airplane in the world.
    pub fn with_memory(world: Arc<AirspaceWorld>, id: EntityId, memory: PilotMemory) -> Self {
        assert!((id as usize) < world.airplanes.len(), "there is no airplane {id}");
        Self {
            fingerprint: world.fingerprint,
            out: PacketOutbox::for_network(world.network.as_ref()),
            world,
            id,
            memory,
            state: None,
            plans: CommonPlans::default(),
            past: VecDeque::new(),
            early: EarlyPackets::default(),
            dropped: DropCounts::default(),
        }
    }

    /// Returns the same pilot, which talks only with those of the same build.
    #[must_use]
    pub fn with_build_id(self, build: &str) -> Self {
        let fingerprint = digest_pieces([build.as_bytes(), &self.world.fingerprint.to_le_bytes()]);
        Self { fingerprint, ..self }
    }

    /// Shares the plans that all compute in the next cycle with other pilots of the process.
    pub(crate) fn share_common_plans(&mut self, plans: &CommonPlans) {
        self.plans = plans.clone();
    }

    /// Starts the conversations of a cycle. Unfinished conversations of an earlier one are given up.
    ///
    /// # Panics
    /// When the percept is that of another airplane, or one that [`Percept::check`] refuses.
    pub fn start(&mut self, percept: Percept, tick: u64) {
        let schedule =
            ConversationSchedule::from_start_tick(tick, self.world.conversation_windows());
        self.start_with_schedule(percept, schedule);
    }

    /// Starts the conversations of a cycle at ticks that all agree on.
    pub(crate) fn start_with_schedule(&mut self, percept: Percept, schedule: ConversationSchedule) {
        self.start_cycle(percept, schedule);
        match self.world.groups {
            Grouping::Announced => self.decide(schedule.begins),
            Grouping::Heard => self.start_conversation(Protocol::Group, schedule.begins),
        }
        self.advance(schedule.begins);
    }

    fn start_cycle(&mut self, percept: Percept, schedule: ConversationSchedule) {
        assert_eq!(percept.own.id, self.id, "the percept is that of another airplane");
        if let Some(state) = self.state.take()
            && let PilotCyclePhase::Grouping(conversation)
            | PilotCyclePhase::Deciding(conversation)
            | PilotCyclePhase::Shielding(conversation, _) = state.phase
        {
            self.keep_ended(conversation);
        }
        self.out.clear_waiting();
        if percept.own.is_overridden {
            self.memory.resolving.record_override();
        }
        let control =
            AirplaneControl::stay_on_orbit(self.id, percept.cycle, PilotMemory::default());
        self.state = Some(PilotCycleState {
            members: percept.members().into(),
            unheard: Vec::new(),
            schedule,
            phase: PilotCyclePhase::Decided,
            candidates: ManeuverCandidates::default(),
            control,
            percept,
            plans: std::mem::take(&mut self.plans),
        });
    }

    /// Returns the tick in which the conversations of the present cycle end at the latest.
    pub fn deadline(&self) -> u64 {
        self.state.as_ref().map_or(u64::MAX, |state| state.schedule.ends)
    }

    /// Returns the ids of the group that it talks with, its own among them, rising.
    pub fn group(&self) -> &[EntityId] {
        self.state.as_ref().map_or(&[], |state| &state.members)
    }

    /// Returns its control in the present cycle, once that is decided.
    pub fn control(&self) -> Option<AirplaneControl> {
        let state =
            self.state.as_ref().filter(|state| matches!(state.phase, PilotCyclePhase::Over))?;
        let mut control = state.control.clone();
        // Questions have been answered since.
        for conversation in
            self.past.iter().filter(|conversation| conversation.info().id.cycle == control.cycle)
        {
            let traffic = match conversation.info().id.topic {
                Protocol::Group => &mut control.grouping,
                Protocol::Decision => &mut control.deciding,
                Protocol::Shield => &mut control.shielding,
            };
            *traffic = NetworkTraffic { ticks: traffic.ticks, ..conversation.network_traffic() };
        }
        Some(control)
    }

    /// Returns whether it knows its group in the present cycle.
    pub fn has_group(&self) -> bool {
        self.state
            .as_ref()
            .is_some_and(|state| !matches!(state.phase, PilotCyclePhase::Grouping(_)))
    }

    /// Returns whether it has chosen its candidates in the present cycle.
    pub fn has_decided(&self) -> bool {
        self.state.as_ref().is_some_and(|state| {
            !matches!(state.phase, PilotCyclePhase::Grouping(_) | PilotCyclePhase::Deciding(_))
        })
    }

    /// Returns whether it has come to an end in the present cycle.
    pub fn is_done(&self) -> bool {
        self.state.as_ref().is_some_and(|state| matches!(state.phase, PilotCyclePhase::Over))
    }

    /// Returns its control in the present cycle, and what it has considered; `None` before that is decided.
    pub(crate) fn into_outcome(mut self) -> Option<(AirplaneControl, ManeuverCandidates)> {
        let control = self.control()?;
        Some((control, self.state.take()?.candidates))
    }

    /// Returns its control where its group does not come to an end in the present cycle: it stays on its fallback.
    ///
    /// # Panics
    /// When it has not begun a cycle.
    pub(crate) fn into_fallback(mut self) -> (AirplaneControl, ManeuverCandidates) {
        let mut state = self.state.take().expect("it has begun a cycle");
        let is_over = matches!(state.phase, PilotCyclePhase::Over);
        let now = state.percept.cycle;
        state.record_traffic(0);
        if self.world.has_resolution_memory() {
            self.memory.record_maneuver(&Maneuver::Orbit);
        }
        let mut control =
            AirplaneControl { maneuver: Maneuver::Orbit, memory: self.memory, ..state.control };
        if !is_over {
            control.events.push(Event::new(now, EventKind::Deadline, self.id));
        }
        (control, ManeuverCandidates::default())
    }

    /// Returns its control in a cycle in which it talks with nobody, because it does not know where some others are that
    /// may be near: it stays on its stored fallback. The others are those `unheard`.
    pub fn stay_on_fallback(&mut self, cycle: Cycle, unheard: &[EntityId]) -> AirplaneControl {
        if self.world.has_resolution_memory() {
            self.memory.record_maneuver(&Maneuver::Orbit);
        }
        let mut control = AirplaneControl::stay_on_orbit(self.id, cycle, self.memory.clone());
        for &other in unheard {
            let event = Event::new_for_pair(cycle, EventKind::Unheard, self.id, other);
            control.events.push(event);
        }
        control
    }

    /// Returns how far it has come in the conversation that it is in, if it is in one.
    pub fn progress(&self) -> Option<ConversationProgress> {
        match &self.state.as_ref()?.phase {
            PilotCyclePhase::Grouping(conversation)
            | PilotCyclePhase::Deciding(conversation)
            | PilotCyclePhase::Shielding(conversation, _) => Some(conversation.progress()),
            PilotCyclePhase::Decided | PilotCyclePhase::Over => None,
        }
    }

    /// Returns its knowledge of others.
    pub fn traffic_picture(&self) -> &TrafficPicture {
        &self.memory.contacts
    }

    /// Returns the counts of packets that were dropped.
    pub fn drop_counts(&self) -> DropCounts {
        self.dropped
    }

    /// Reads a packet, and hands its message to the conversation that it belongs to.
    fn receive(&mut self, from: EntityId, bytes: &[u8], tick: u64) -> Result<(), DropReason> {
        let (header, message) = parse_packet(bytes, self.fingerprint)?;
        let is_other = from != self.id && (from as usize) < self.world.airplanes.len();
        if header.sender != from || !is_other {
            return Err(DropReason::Sender);
        }
        let Self { state, past, early, out, .. } = self;
        if let Some(state) = state {
            if self.world.is_radio_off(self.id, state.percept.cycle) {
                return Ok(());
            }
            if let Some(conversation) = state.conversation()
                && conversation.info().id == header.conversation
            {
                return conversation.receive(from, message, tick, out);
            }
        }
        if let Some(conversation) =
            past.iter_mut().find(|conversation| conversation.info().id == header.conversation)
        {
            return conversation.receive(from, message, tick, out);
        }
        match state.as_ref().map(|state| state.relative_conversation_timing(&header.conversation)) {
            None | Some(ConversationMismatch::Later) => {
                early.push(header.conversation, from, message)
            }
            Some(ConversationMismatch::OtherMembers) => Err(DropReason::OtherGroup),
            Some(ConversationMismatch::Past) => Err(DropReason::Stale),
            Some(ConversationMismatch::TooFarAhead) => Err(DropReason::NoRoom),
        }
    }

    /// Continues as far as the conversations and the time have come.
    fn advance(&mut self, tick: u64) {
        while let Some(state) = &mut self.state {
            match &mut state.phase {
                PilotCyclePhase::Grouping(conversation)
                | PilotCyclePhase::Deciding(conversation)
                | PilotCyclePhase::Shielding(conversation, _)
                    if conversation.is_done() || tick >= conversation.info().end_tick =>
                {
                    let ended = conversation.finish();
                    // Where nothing is lost, messages take no time that counts.
                    let ticks = match self.world.network {
                        Some(_) => tick
                            .min(conversation.info().end_tick)
                            .saturating_sub(conversation.info().start_tick),
                        None => 0,
                    };
                    state.record_traffic(ticks);
                    self.on_conversation_end(ended, tick);
                }
                PilotCyclePhase::Decided if tick >= state.schedule.shield_from => {
                    self.start_conversation(Protocol::Shield, tick);
                }
                _ => return,
            }
        }
    }

    /// Starts a conversation with the others of the group.
    fn start_conversation(&mut self, topic: Protocol, tick: u64) {
        let Some(state) = &mut self.state else { return };
        let world = &*self.world;
        let known = state.topic_members(topic);
        let PilotCycleState { percept, schedule, members, unheard, candidates, plans, .. } = state;
        let (start_tick, end_tick) = schedule.conversation_tick_range(topic, tick);
        let id = match topic {
            // Its members are not known yet.
            Protocol::Group => ConversationId::new(percept.cycle, topic, &[]),
            Protocol::Decision | Protocol::Shield => {
                ConversationId::new(percept.cycle, topic, members)
            }
        };
        let is_silent = world.is_radio_off(self.id, percept.cycle);
        let config = EndpointConfig {
            me: known.binary_search(&self.id).expect("an airplane knows itself"),
            group: known,
            patience: retry_policy(world.network.as_ref(), topic),
            // A clock that has jumped may leave no time for it.
            ticks: end_tick.saturating_sub(start_tick),
            is_silent,
        };
        let info = ConversationSetup {
            id,
            members: members.clone(),
            me: self.id,
            fingerprint: self.fingerprint,
            start_tick,
            end_tick,
            is_silent,
        };
        let PilotMemory { contacts, resolving, .. } = &self.memory;
        state.phase = match topic {
            Protocol::Shield => {
                let allowed = allowed_profiles(world, percept, candidates);
                let profiles: Vec<_> =
                    allowed.iter().map(|&k| candidates.profiles[k].clone()).collect();
                let knowledge = PilotKnowledge { world, percept, unheard, contacts, plans };
                let participant = shield_exchange_participant(knowledge, &profiles, config);
                PilotCyclePhase::Shielding(Conversation::new(info, participant), allowed)
            }
            Protocol::Group => PilotCyclePhase::Grouping(Conversation::new(
                info,
                grouping_participant(world, percept, contacts, config),
            )),
            Protocol::Decision if DecisionStrategy::needs_intents_alone(world) => {
                let participant = intent_participant(world, percept, contacts, resolving, config);
                PilotCyclePhase::Deciding(Conversation::new(info, participant))
            }
            Protocol::Decision => {
                let knowledge = PilotKnowledge { world, percept, unheard, contacts, plans };
                let participant = optimization_participant(knowledge, config);
                PilotCyclePhase::Deciding(Conversation::new(info, participant))
            }
        };
        self.deliver_early_packets(id, tick);
    }

    /// Starts the conversation that it is in, and hands over earlier messages of others in it.
    fn deliver_early_packets(&mut self, id: ConversationId, tick: u64) {
        let Some(conversation) = self.state.as_mut().and_then(PilotCycleState::conversation) else {
            return;
        };
        conversation.start(tick, &mut self.out);
        let early = self.early.take(&id);
        for _ in 0..early.stale {
            self.dropped.record(DropReason::Stale);
        }
        for _ in 0..early.of_other_groups {
            self.dropped.record(DropReason::OtherGroup);
        }
        for (from, message) in early.messages {
            if let Err(why) = conversation.receive(from, &message, tick, &mut self.out) {
                self.dropped.record(why);
            }
        }
    }

    /// Keeps a conversation that has ended here, to answer questions about it.
    fn keep_ended(&mut self, conversation: Conversation<DynParticipant>) {
        if self.past.len() == MAX_PAST_CONVERSATIONS {
            self.past.pop_front();
        }
        self.past.push_back(conversation.into_ended());
    }
}

impl NetworkAgent for Pilot {
    fn id(&self) -> EntityId {
        self.id
    }

    fn on_packet(&mut self, from: EntityId, bytes: &[u8], tick: u64) {
        // Actions due by then are done first, because they may make it too late for the packet.
        self.advance(tick);
        if let Err(why) = self.receive(from, bytes, tick) {
            self.dropped.record(why);
        }
        self.advance(tick);
    }

    fn on_timer(&mut self, tick: u64) {
        self.advance(tick);
        if let Some(conversation) = self.state.as_mut().and_then(PilotCycleState::conversation) {
            conversation.on_timer(tick, &mut self.out);
        }
        // Others may still depend on it in a conversation that has ended for it.
        for conversation in
            self.past.iter_mut().filter(|conversation| tick < conversation.info().end_tick)
        {
            conversation.on_timer(tick, &mut self.out);
        }
        self.advance(tick);
        self.out.release(tick);
    }

    fn next_timer(&self) -> Option<u64> {
        let state = self.state.as_ref()?;
        let present = match &state.phase {
            PilotCyclePhase::Grouping(conversation)
            | PilotCyclePhase::Deciding(conversation)
            | PilotCyclePhase::Shielding(conversation, _) => {
                let end_tick = conversation.info().end_tick;
                Some(conversation.next_timer().map_or(end_tick, |due| due.min(end_tick)))
            }
            PilotCyclePhase::Decided => Some(state.schedule.shield_from),
            PilotCyclePhase::Over => None,
        };
        let of_cycle = self
            .past
            .iter()
            .filter(|conversation| conversation.info().id.cycle == state.percept.cycle);
        let past = of_cycle.filter_map(|conversation| {
            conversation.next_timer().filter(|due| *due < conversation.info().end_tick)
        });
        present.into_iter().chain(past).chain(self.out.next_due()).min()
    }

    fn take_packets(&mut self) -> Vec<OutgoingPacket> {
        self.out.take_ready()
    }
}

/// Returns the places of the candidates that an airplane proposes: all that non-cooperative aircraft leave to it; or all,
/// where all are sure to know all of each other, and order candidates alike.
fn allowed_profiles(
    world: &AirspaceWorld,
    percept: &Percept,
    candidates: &ManeuverCandidates,
) -> Vec<usize> {
    if plan_certainty(world) == PlanCertainty::Sure {
        return (0..candidates.profiles.len()).collect();
    }
    let aircraft = percept.own.shielded_aircraft(world, percept.cycle);
    let avoidance =
        NonCooperativeAvoidance::new(&aircraft, &percept.non_cooperative, world.timing.dtau_s);
    avoidance.allowed_profiles(&candidates.profiles, || percept.own.fallback_profile(world))
}
