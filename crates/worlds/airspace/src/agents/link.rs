//! Conversations over a network that loses, delays, duplicates and reorders messages.
//!
//! Every agent sends all its messages to all the others of its group. An [`ReliableEndpoint`] numbers its
//! agent's messages and keeps them; an endpoint that misses one asks for it again. One that does
//! not answer, although asked so often that it can hardly be alive and reachable, or until the time
//! for this step is up, is given up for this conversation: the agent goes on with its knowledge of it. One that
//! was not heard in the conversation before is asked less often. So no agent waits forever, and a loss costs time
//! instead of agreement.
//!
//! Endpoints and agents are state machines without a clock or a network of their own: ticks and
//! messages are handed in, and messages are taken out.

pub(crate) use super::participant::ConversationEnd;
use super::participant::{
    ConversationProgress, FinishableParticipant, InvalidMessage, OutgoingMessage, Participant,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{HEADER_BYTES, PacketBuffer, RetryPolicy, RetryTimer};
use std::collections::BTreeSet;
use std::sync::Arc;

/// An agent as a state machine: messages in, messages to all others out. Others are known by their
/// place in the group.
pub trait ProtocolAgent {
    /// What agents say to each other.
    type Message: Serialize + DeserializeOwned;
    /// What it comes to, e.g. the group that it has found.
    type Outcome;

    /// Returns its messages before it has heard anything.
    fn start(&mut self) -> Vec<Self::Message>;

    /// Checks a message of agent `from`: [`Self::on_message`] must be able to handle every message that passes.
    ///
    /// # Errors
    /// When its content is impossible.
    fn check_message(&self, from: usize, message: &Self::Message) -> Result<(), InvalidMessage>;

    /// Returns the largest number of bytes of a message, and of messages of one agent in a conversation.
    fn message_limits(&self) -> MessageLimits;

    /// Takes a message of agent `from`, and returns its own messages in response. Messages come in
    /// any order, each once.
    fn on_message(&mut self, from: usize, message: Self::Message) -> Vec<Self::Message>;

    /// Returns the number of rounds made.
    fn round(&self) -> u32 {
        0
    }

    /// Returns the places of the members from which it needs messages in order to go on.
    fn awaited_members(&self) -> Vec<usize>;

    /// Returns whether an answer of agent `other` can be expected.
    fn is_expected(&self, _other: usize) -> bool {
        true
    }

    /// Returns the part of the conversation, from 0 to 1, after which it goes on without those that it
    /// waits for now.
    fn wait_fraction(&self) -> f64 {
        1.0
    }

    /// Goes on without agent `other`, from which nothing more will come. The other is settled if it
    /// has ended regularly, rather than fallen silent.
    fn on_peer_gone(&mut self, other: usize, is_settled: bool) -> Vec<Self::Message>;

    /// Ends because time is up, with the best outcome that its knowledge allows.
    fn on_deadline(&mut self);

    /// Returns whether it has come to its outcome.
    fn is_done(&self) -> bool;

    /// Returns its outcome, if it has one.
    fn outcome(&self) -> Option<Self::Outcome>;
}

/// Bounds on the messages that an agent may be sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageLimits {
    /// Largest number of bytes of a message; a longer one is dropped unread.
    pub bytes: usize,
    /// Largest number of messages of one agent in a conversation.
    pub messages: u32,
}

/// A message between endpoints: what an agent says, or a question about that and its answer.
#[derive(Debug, Serialize, Deserialize)]
enum WireMessage<M> {
    /// A message, with its number among the sender's.
    Said(u32, M),
    /// "Send again all your messages from this number on."
    Ask(u32),
    /// "I have not sent more than that yet."
    Wait,
    /// "I have not sent more than that, and shall not."
    Done,
}

/// Largest number of bytes of a [`WireMessage`] around its content: its kind and its number, with some to spare.
const MAX_WIRE_BYTES: usize = 16;

/// Settings of an endpoint.
#[derive(Debug, Clone)]
pub struct EndpointConfig {
    /// Ids of the group, rising.
    pub group: Arc<[EntityId]>,
    /// Place of its airplane in the group.
    pub me: usize,
    /// The time that it waits for others.
    pub patience: RetryPolicy,
    /// Number of ticks after which the conversation ends.
    pub ticks: u64,
    /// Whether the radio is dead: it sends nothing, hears nothing, and knows it.
    pub is_silent: bool,
}

/// An agent with all that makes its messages arrive.
#[derive(Debug)]
pub struct ReliableEndpoint<A> {
    agent: A,
    config: EndpointConfig,
    limits: MessageLimits,
    /// Number of its agent's messages so far.
    count: u32,
    /// These, serialized, by number; none on a network that loses nothing, where nobody asks for them again.
    sent: Vec<PacketBuffer>,
    others: Vec<PeerState>,
    /// Messages that wait to be sent.
    out: Vec<OutgoingMessage>,
    start_tick: u64,
    retry: RetryTimer,
    is_late: bool,
}

/// An endpoint's knowledge of another one.
#[derive(Debug, Clone, Default)]
struct PeerState {
    /// All messages below this number have come.
    next: u32,
    /// Later messages that have come out of order.
    early: BTreeSet<u32>,
    unanswered: u32,
    /// Whether anything has come from it in this conversation.
    is_there: bool,
    /// Whether nothing more will come from it.
    is_gone: bool,
    /// Whether it was given up, rather than done.
    is_unheard: bool,
}

impl PeerState {
    /// Records the number of a message that has come. Returns whether it has not come before.
    fn record_message_number(&mut self, number: u32) -> bool {
        let is_new = number >= self.next && self.early.insert(number);
        while self.early.remove(&self.next) {
            self.next += 1;
        }
        is_new
    }
}

/// Returns a message in the form in which it travels.
pub(crate) fn to_bytes<M: Serialize>(message: &M) -> Vec<u8> {
    postcard::to_stdvec(message).expect("messages are plain data")
}

impl<A: ProtocolAgent> ReliableEndpoint<A> {
    /// Returns an endpoint with an agent that has not sent anything yet.
    pub fn new(agent: A, config: EndpointConfig) -> Self {
        let others = vec![PeerState::default(); config.group.len()];
        let retry = RetryTimer::new(config.patience);
        Self {
            limits: agent.message_limits(),
            agent,
            config,
            count: 0,
            sent: Vec::new(),
            others,
            out: Vec::new(),
            start_tick: 0,
            retry,
            is_late: false,
        }
    }

    fn send_to(&mut self, to: usize, message: PacketBuffer) {
        self.send(Some(self.config.group[to]), message);
    }

    fn send(&mut self, to: Option<EntityId>, message: PacketBuffer) {
        self.retry.record_packet_size(message.len());
        self.out.push(OutgoingMessage { to, message });
    }

    /// Numbers messages of the agent, and sends them to all others.
    fn broadcast(&mut self, messages: Vec<A::Message>) {
        for message in messages {
            let message = PacketBuffer::from_message(&WireMessage::Said(self.count, message));
            self.count += 1;
            if self.config.patience.is_enabled() {
                self.sent.push(message.clone());
            }
            self.send(None, message);
        }
    }

    /// Reads a message of another one, and checks it so that nothing has changed when it is refused.
    fn read(&self, from: usize, bytes: &[u8]) -> Result<WireMessage<A::Message>, InvalidMessage> {
        let (message, rest) = postcard::take_from_bytes::<WireMessage<A::Message>>(bytes)
            .map_err(|_| InvalidMessage::Form)?;
        InvalidMessage::Form.ensure(rest.is_empty())?;
        if let WireMessage::Said(number, content) = &message {
            InvalidMessage::Round.ensure(*number < self.limits.messages)?;
            self.agent.check_message(from, content)?;
        }
        Ok(message)
    }

    fn resend_from(&mut self, to: usize, from_number: u32) {
        let missing = self.sent.get(from_number as usize..).unwrap_or_default().to_vec();
        if missing.is_empty() {
            let reply = if self.agent.is_done() {
                WireMessage::<A::Message>::Done
            } else {
                WireMessage::Wait
            };
            self.send_to(to, PacketBuffer::from_message(&reply));
        }
        for message in missing {
            self.send_to(to, message);
        }
    }

    fn drop_peer(&mut self, other: usize, is_settled: bool) {
        if !self.others[other].is_gone {
            self.others[other].is_gone = true;
            let outgoing = self.agent.on_peer_gone(other, is_settled);
            self.broadcast(outgoing);
        }
    }

    /// Ends the conversation of an airplane that is not heard and hears no other.
    fn drop_all_peers(&mut self) {
        let me = self.config.me;
        for j in (0..self.others.len()).filter(|&j| j != me) {
            self.others[j].is_unheard = true;
            self.drop_peer(j, false);
        }
    }
}

impl<A: ProtocolAgent + Send> Participant for ReliableEndpoint<A> {
    fn progress(&self) -> ConversationProgress {
        ConversationProgress { round: self.agent.round(), ..ConversationProgress::default() }
    }

    fn start(&mut self, tick: u64) {
        self.start_tick = tick;
        self.retry.restart(tick);
        // Also with a dead radio, because the agent decides alone then. Its messages are dropped in the conversation.
        let first = self.agent.start();
        self.broadcast(first);
        if self.config.is_silent {
            self.drop_all_peers();
        }
    }

    fn on_message(
        &mut self,
        from: EntityId,
        bytes: &[u8],
        tick: u64,
    ) -> Result<(), InvalidMessage> {
        let place = self.config.group.binary_search(&from).map_err(|_| InvalidMessage::Airplane)?;
        InvalidMessage::Airplane.ensure(place != self.config.me)?;
        let message = self.read(place, bytes)?;
        self.others[place].unanswered = 0;
        self.others[place].is_there = true;
        // The header was cut off on receipt; a message that is sent already counts it.
        self.retry.record_packet_size(HEADER_BYTES + bytes.len());
        match message {
            WireMessage::Said(number, content)
                if self.others[place].record_message_number(number) =>
            {
                self.retry.restart(tick);
                let outgoing = self.agent.on_message(place, content);
                self.broadcast(outgoing);
            }
            WireMessage::Said(..) | WireMessage::Wait => {}
            WireMessage::Ask(number) => self.resend_from(place, number),
            // This answers a request for missing messages, so all of them have come.
            WireMessage::Done => self.drop_peer(place, true),
        }
        Ok(())
    }

    /// Asks those that it waits for, if it has waited long enough, and gives up those that never
    /// answer.
    fn on_timer(&mut self, tick: u64) {
        if self.next_timer().is_none_or(|due| due > tick) {
            return;
        }
        self.retry.restart(tick);
        let waited = tick.saturating_sub(self.start_tick) as f64;
        let has_time = waited < self.agent.wait_fraction() * self.config.ticks as f64;
        for j in self.agent.awaited_members() {
            let RetryPolicy { tries, first_tries, .. } = self.config.patience;
            let is_expected = self.others[j].is_there || self.agent.is_expected(j);
            let tries = if is_expected { tries } else { first_tries };
            let other = &mut self.others[j];
            if other.unanswered < tries && has_time {
                other.unanswered += 1;
                let request = WireMessage::<A::Message>::Ask(other.next);
                self.send_to(j, PacketBuffer::from_message(&request));
            } else {
                other.is_unheard = true;
                self.drop_peer(j, false);
            }
        }
    }

    fn next_timer(&self) -> Option<u64> {
        (!self.is_done()).then(|| self.retry.due_tick())
    }

    fn is_done(&self) -> bool {
        self.agent.is_done()
    }

    fn take_messages(&mut self) -> Vec<OutgoingMessage> {
        std::mem::take(&mut self.out)
    }

    fn max_message_bytes(&self) -> usize {
        self.limits.bytes + MAX_WIRE_BYTES
    }
}

impl<A: ProtocolAgent + Send> FinishableParticipant for ReliableEndpoint<A> {
    type Outcome = A::Outcome;

    fn finish(&mut self) -> ConversationEnd<A::Outcome> {
        if !self.is_done() {
            self.is_late = true;
            self.agent.on_deadline();
        }
        let unheard = (0..self.others.len()).filter(|&j| self.others[j].is_unheard).collect();
        ConversationEnd { outcome: self.agent.outcome(), unheard, late: self.is_late }
    }
}
