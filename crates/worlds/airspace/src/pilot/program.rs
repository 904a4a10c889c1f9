//! The pilot, as a state machine.

mod conclude;
mod cycle_state;

use super::control::{Control, Maneuver, Memory};
use super::conversations::{
    DynParticipant, exchange_participant, grouping_participant, intent_participant,
    optimization_participant,
};
use super::early_packets::EarlyPackets;
use super::percept::Percept;
use super::schedule::{Schedule, retry_policy};
use crate::agents::network_traffic::NetworkTraffic;
use crate::agents::packet::{ConversationId, Protocol};
use crate::agents::traffic_state::TrafficPicture;
use crate::agents::{Conversation, ConversationInfo, EndpointConfig, Participant, Progress};
use crate::avoid::NonCooperativeAvoidance;
use crate::decide::{DecisionStrategy, ManeuverCandidates};
use crate::events::{Event, EventKind};
use crate::settings::Grouping;
use crate::world::AirspaceWorld;
use cycle_state::{ConversationTiming, CyclePhase, CycleState};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{
    DropCounts, DropReason, NetworkAgent, OutgoingPacket, digest, parse_packet,
};
use std::collections::VecDeque;
use std::sync::Arc;

/// Number of ended talks of which questions are answered: those of two cycles.
const MAX_PAST_CONVERSATIONS: usize = 6;

/// The program aboard one airplane: see the [module](super).
pub struct Pilot {
    world: Arc<AirspaceWorld>,
    id: EntityId,
    fingerprint: u64,
    memory: Memory,
    /// The cycle that it is in, or was in last.
    turn: Option<CycleState>,
    /// Talks that have ended for it.
    past: VecDeque<Conversation<dyn Participant>>,
    early: EarlyPackets,
    out: Vec<OutgoingPacket>,
    refused: DropCounts,
}

impl Pilot {
    /// Returns the pilot of an airplane that remembers the `contacts` of earlier cycles.
    ///
    /// # Panics
    /// When there is no such airplane in the world.
    pub fn new(world: Arc<AirspaceWorld>, id: EntityId, contacts: TrafficPicture) -> Self {
        Self::with_memory(world, id, Memory { contacts, ..Memory::default() })
    }

    /// Returns the pilot of an airplane with all that it remembers.
    ///
    /// # Panics
    /// When there is no such airplane in the world.
    pub fn with_memory(world: Arc<AirspaceWorld>, id: EntityId, memory: Memory) -> Self {
        assert!((id as usize) < world.airplanes.len(), "there is no airplane {id}");
        Self {
            fingerprint: world.fingerprint,
            world,
            id,
            memory,
            turn: None,
            past: VecDeque::new(),
            early: EarlyPackets::default(),
            out: Vec::new(),
            refused: DropCounts::default(),
        }
    }

    /// Returns the same pilot, which talks only with those of the same build.
    #[must_use]
    pub fn with_build(self, build: &str) -> Self {
        let fingerprint = digest([build.as_bytes(), &self.world.fingerprint.to_le_bytes()]);
        Self { fingerprint, ..self }
    }

    /// Starts the talks of a cycle. Unfinished talks of an earlier one are given up.
    ///
    /// # Panics
    /// When the sight is that of another airplane, or one that [`Percept::check`] refuses.
    pub fn start(&mut self, sight: Percept, tick: u64) {
        let schedule = Schedule::from_tick(tick, self.world.network.as_ref());
        self.start_with_schedule(sight, schedule);
    }

    /// Starts the talks of a cycle at ticks that all agree on.
    pub(crate) fn start_with_schedule(&mut self, sight: Percept, schedule: Schedule) {
        self.start_cycle(sight, schedule);
        match self.world.groups {
            Grouping::Announced => self.decide(schedule.begins),
            Grouping::Heard => self.start_conversation(Protocol::Group, schedule.begins),
        }
        self.advance(schedule.begins);
    }

    fn start_cycle(&mut self, sight: Percept, schedule: Schedule) {
        assert_eq!(sight.own.id, self.id, "the sight is that of another airplane");
        if let Some(turn) = self.turn.take()
            && let CyclePhase::Grouping(talk)
            | CyclePhase::Deciding(talk)
            | CyclePhase::Shielding(talk, _) = turn.phase
        {
            self.push_past(talk);
        }
        let control = Control::stay_on_orbit(self.id, sight.cycle, Memory::default());
        self.turn = Some(CycleState {
            members: sight.members().into(),
            unheard: Vec::new(),
            schedule,
            phase: CyclePhase::Decided,
            candidates: ManeuverCandidates::default(),
            control,
            percept: sight,
        });
    }

    /// Returns the tick in which the talks of the present cycle end at the latest.
    pub fn deadline(&self) -> u64 {
        self.turn.as_ref().map_or(u64::MAX, |turn| turn.schedule.ends)
    }

    /// Returns the ids of the group that it talks with, its own among them, rising.
    pub fn group(&self) -> &[EntityId] {
        self.turn.as_ref().map_or(&[], |turn| &turn.members)
    }

    /// Returns its control in the present cycle, once that is decided.
    pub fn control(&self) -> Option<Control> {
        let turn = self.turn.as_ref().filter(|turn| matches!(turn.phase, CyclePhase::Over))?;
        let mut control = turn.control.clone();
        // Questions have been answered since.
        for talk in self.past.iter().filter(|talk| talk.info().id.cycle == control.cycle) {
            let traffic = match talk.info().id.topic {
                Protocol::Group => &mut control.grouping,
                Protocol::Decision => &mut control.deciding,
                Protocol::Shield => &mut control.shielding,
            };
            *traffic = NetworkTraffic { ticks: traffic.ticks, ..talk.traffic() };
        }
        Some(control)
    }

    /// Returns whether it knows its group in the present cycle.
    pub fn has_group(&self) -> bool {
        self.turn.as_ref().is_some_and(|turn| !matches!(turn.phase, CyclePhase::Grouping(_)))
    }

    /// Returns whether it has chosen its wishes in the present cycle.
    pub fn has_decided(&self) -> bool {
        let is_open = |turn: &CycleState| {
            matches!(turn.phase, CyclePhase::Grouping(_) | CyclePhase::Deciding(_))
        };
        self.turn.as_ref().is_some_and(|turn| !is_open(turn))
    }

    /// Returns whether it has come to an end in the present cycle.
    pub fn is_done(&self) -> bool {
        self.turn.as_ref().is_some_and(|turn| matches!(turn.phase, CyclePhase::Over))
    }

    /// Returns its control in the present cycle, and the ways that it has considered; `None` before that is decided.
    pub(crate) fn into_outcome(mut self) -> Option<(Control, ManeuverCandidates)> {
        let control = self.control()?;
        Some((control, self.turn.take()?.candidates))
    }

    /// Returns its control where its group does not come to an end in the present cycle: it stays on its orbit.
    ///
    /// # Panics
    /// When it has not begun a cycle.
    pub(crate) fn into_fallback(mut self) -> (Control, ManeuverCandidates) {
        let mut turn = self.turn.take().expect("it has begun a cycle");
        let (is_over, now) = (matches!(turn.phase, CyclePhase::Over), turn.percept.cycle);
        turn.record_traffic(0);
        let mut control = Control { course: Maneuver::Orbit, memory: self.memory, ..turn.control };
        if !is_over {
            control.events.push(Event::new(now, EventKind::Deadline, self.id));
        }
        (control, ManeuverCandidates::default())
    }

    /// Returns how far it has come in the talk that it is in, if it is in one.
    pub fn progress(&self) -> Option<Progress> {
        match &self.turn.as_ref()?.phase {
            CyclePhase::Grouping(talk)
            | CyclePhase::Deciding(talk)
            | CyclePhase::Shielding(talk, _) => Some(talk.progress()),
            CyclePhase::Decided | CyclePhase::Over => None,
        }
    }

    /// Returns its knowledge of others.
    pub fn traffic_picture(&self) -> &TrafficPicture {
        &self.memory.contacts
    }

    /// Returns the counts of packets that were dropped.
    pub fn drop_counts(&self) -> DropCounts {
        self.refused
    }

    /// Reads a packet, and hands its message to the talk that it belongs to.
    fn receive(&mut self, from: EntityId, bytes: &[u8], tick: u64) -> Result<(), DropReason> {
        let (seal, message) = parse_packet(bytes, self.fingerprint)?;
        let is_other = from != self.id && (from as usize) < self.world.airplanes.len();
        if seal.sender != from || !is_other {
            return Err(DropReason::Sender);
        }
        let Self { turn, past, early, out, .. } = self;
        if let Some(turn) = turn {
            if self.world.is_silent(self.id, turn.percept.cycle) {
                return Ok(());
            }
            if let Some(talk) = turn.conversation()
                && talk.info().id == seal.conversation
            {
                return talk.receive(from, message, tick, out);
            }
        }
        if let Some(talk) = past.iter_mut().find(|talk| talk.info().id == seal.conversation) {
            return talk.receive(from, message, tick, out);
        }
        match turn.as_ref().map(|turn| turn.timing_of(&seal.conversation)) {
            None | Some(ConversationTiming::Later) => early.push(seal.conversation, from, message),
            Some(ConversationTiming::OtherMembers) => Err(DropReason::OtherGroup),
            Some(ConversationTiming::Past) => Err(DropReason::Stale),
            Some(ConversationTiming::TooFarAhead) => Err(DropReason::NoRoom),
        }
    }

    /// Continues as far as the talks and the time have come.
    fn advance(&mut self, tick: u64) {
        while let Some(turn) = &mut self.turn {
            match &mut turn.phase {
                CyclePhase::Grouping(talk)
                | CyclePhase::Deciding(talk)
                | CyclePhase::Shielding(talk, _)
                    if talk.is_done() || tick >= talk.info().end_tick =>
                {
                    let ended = talk.finish();
                    // Where nothing is lost, messages take no time that counts.
                    let ticks = match self.world.network {
                        Some(_) => {
                            tick.min(talk.info().end_tick).saturating_sub(talk.info().start_tick)
                        }
                        None => 0,
                    };
                    turn.record_traffic(ticks);
                    self.on_conversation_end(ended, tick);
                }
                CyclePhase::Decided if tick >= turn.schedule.shield_from => {
                    self.start_conversation(Protocol::Shield, tick);
                }
                _ => return,
            }
        }
    }

    /// Starts a talk with the others of the group.
    fn start_conversation(&mut self, topic: Protocol, tick: u64) {
        let Some(turn) = &mut self.turn else { return };
        let world = &*self.world;
        let known = turn.members_of(topic);
        let CycleState {
            percept: sight, schedule, members, unheard, candidates: considered, ..
        } = turn;
        let (begins, ends) = schedule.conversation_ticks(topic, tick);
        let id = match topic {
            // Its members are not known yet.
            Protocol::Group => ConversationId::new(sight.cycle, topic, &[]),
            Protocol::Decision | Protocol::Shield => {
                ConversationId::new(sight.cycle, topic, members)
            }
        };
        let is_silent = world.is_silent(self.id, sight.cycle);
        let radio = EndpointConfig {
            me: known.binary_search(&self.id).expect("an airplane knows itself"),
            group: known,
            patience: retry_policy(world.network.as_ref(), topic),
            // A clock that has jumped may leave no time for it.
            ticks: ends.saturating_sub(begins),
            is_silent,
        };
        let (me, members, fingerprint) = (self.id, members.clone(), self.fingerprint);
        let frame = ConversationInfo {
            id,
            members,
            me,
            fingerprint,
            start_tick: begins,
            end_tick: ends,
            is_silent,
        };
        let Memory { contacts, resolving } = &self.memory;
        turn.phase = match topic {
            Protocol::Shield => {
                let allowed = allowed_profiles(world, sight, considered);
                let ways: Vec<_> = allowed.iter().map(|&k| considered.ways[k].clone()).collect();
                let party = exchange_participant(world, sight, unheard, contacts, &ways, radio);
                CyclePhase::Shielding(Conversation::new(frame, party), allowed)
            }
            Protocol::Group => CyclePhase::Grouping(Conversation::new(
                frame,
                grouping_participant(world, sight, contacts, radio),
            )),
            Protocol::Decision if DecisionStrategy::is_reactive(world) => {
                let party = intent_participant(world, sight, contacts, resolving, radio);
                CyclePhase::Deciding(Conversation::new(frame, party))
            }
            Protocol::Decision => {
                let party = optimization_participant(world, sight, unheard, contacts, radio);
                CyclePhase::Deciding(Conversation::new(frame, party))
            }
        };
        self.deliver_early_packets(id, tick);
    }

    /// Starts the talk that it is in, and hands over earlier messages of others in it.
    fn deliver_early_packets(&mut self, id: ConversationId, tick: u64) {
        let Some(talk) = self.turn.as_mut().and_then(CycleState::conversation) else { return };
        talk.start(tick, &mut self.out);
        let (early, [stale, other_group]) = self.early.take(&id);
        (0..stale).for_each(|_| self.refused.record(DropReason::Stale));
        (0..other_group).for_each(|_| self.refused.record(DropReason::OtherGroup));
        for (from, message) in early {
            if let Err(why) = talk.receive(from, &message, tick, &mut self.out) {
                self.refused.record(why);
            }
        }
    }

    /// Keeps a talk that has ended here, to answer questions about it.
    fn push_past(&mut self, talk: Conversation<DynParticipant>) {
        if self.past.len() == MAX_PAST_CONVERSATIONS {
            self.past.pop_front();
        }
        self.past.push_back(talk.into_past());
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
            self.refused.record(why);
        }
        self.advance(tick);
    }

    fn on_timer(&mut self, tick: u64) {
        self.advance(tick);
        if let Some(talk) = self.turn.as_mut().and_then(CycleState::conversation) {
            talk.on_timer(tick, &mut self.out);
        }
        // Others may still depend on it in a talk that has ended for it.
        for talk in self.past.iter_mut().filter(|talk| tick < talk.info().end_tick) {
            talk.on_timer(tick, &mut self.out);
        }
        self.advance(tick);
    }

    fn next_timer(&self) -> Option<u64> {
        let turn = self.turn.as_ref()?;
        let present = match &turn.phase {
            CyclePhase::Grouping(talk)
            | CyclePhase::Deciding(talk)
            | CyclePhase::Shielding(talk, _) => {
                let ends = talk.info().end_tick;
                Some(talk.next_timer().map_or(ends, |due| due.min(ends)))
            }
            CyclePhase::Decided => Some(turn.schedule.shield_from),
            CyclePhase::Over => None,
        };
        let of_cycle = self.past.iter().filter(|talk| talk.info().id.cycle == turn.percept.cycle);
        let past =
            of_cycle.filter_map(|talk| talk.next_timer().filter(|due| *due < talk.info().end_tick));
        present.into_iter().chain(past).min()
    }

    fn take_packets(&mut self) -> Vec<OutgoingPacket> {
        std::mem::take(&mut self.out)
    }
}

/// Returns the places of the ways that intruders leave to an airplane, among all that it considers.
fn allowed_profiles(
    world: &AirspaceWorld,
    sight: &Percept,
    considered: &ManeuverCandidates,
) -> Vec<usize> {
    let flyer = sight.own.shielded_aircraft(world);
    let beset = NonCooperativeAvoidance::new(&flyer, &sight.intruders, world.timing.dtau_s);
    beset.allowed_profiles(&considered.ways, || sight.own.orbit_profile(world))
}
