//! One conversation, as one airplane takes part in it: a participant, and the packets around its messages.

use super::network_traffic::NetworkTraffic;
use super::packet::{ConversationId, PacketHeader};
use super::participant::{
    ConversationEnd, ConversationProgress, FinishableParticipant, OutgoingMessage, Participant,
};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{DropReason, OutgoingPacket, PacketAdmission, PacketOutbox};
use std::sync::Arc;

/// The identity, participants and times of a conversation.
#[derive(Debug, Clone)]
pub struct ConversationSetup {
    /// Cycle, subject and members, by which packets find their conversation.
    pub id: ConversationId,
    /// Ids of all participants, rising.
    pub members: Arc<[EntityId]>,
    /// Id of the airplane that takes part, one of `members`.
    pub me: EntityId,
    /// Digest of scenario and build.
    pub fingerprint: u64,
    /// The tick in which it starts for this airplane; others may be earlier or later.
    pub start_tick: u64,
    /// The tick in which it ends for this airplane at the latest.
    pub end_tick: u64,
    /// Whether the radio is dead: nothing that the participant says is sent.
    pub is_silent: bool,
}

/// A conversation, with the participant that is aboard.
pub struct Conversation<P: ?Sized> {
    info: ConversationSetup,
    others: Arc<[EntityId]>,
    /// Number of packets sent so far.
    sent: u32,
    traffic: NetworkTraffic,
    participant: Box<P>,
}

impl<P: Participant + ?Sized> Conversation<P> {
    /// Returns a conversation in which nothing has been said yet.
    pub fn new(info: ConversationSetup, participant: Box<P>) -> Self {
        let others = info.members.iter().copied().filter(|&id| id != info.me).collect();
        Self { info, others, sent: 0, traffic: NetworkTraffic::default(), participant }
    }

    /// Its identity, members and times.
    pub fn info(&self) -> &ConversationSetup {
        &self.info
    }

    /// Returns how far the participant has come.
    pub fn progress(&self) -> ConversationProgress {
        self.participant.progress()
    }

    /// Returns the counts of the packets sent by this airplane so far.
    pub fn network_traffic(&self) -> NetworkTraffic {
        self.traffic
    }

    /// Starts it, and adds the first packets to `out`.
    pub fn start(&mut self, tick: u64, out: &mut PacketOutbox) {
        self.participant.start(tick);
        self.send(tick, out);
    }

    /// Takes a message of another airplane.
    ///
    /// # Errors
    /// When that one takes no part in it, or its message has impossible content; nothing has changed then.
    pub fn receive(
        &mut self,
        from: EntityId,
        message: &[u8],
        tick: u64,
        out: &mut PacketOutbox,
    ) -> Result<(), DropReason> {
        if from == self.info.me || self.info.members.binary_search(&from).is_err() {
            return Err(DropReason::Sender);
        }
        if message.len() > self.participant.max_message_bytes() {
            return Err(DropReason::TooLarge);
        }
        self.participant.on_message(from, message, tick)?;
        self.send(tick, out);
        Ok(())
    }

    /// Performs the actions that are due by a tick.
    pub fn on_timer(&mut self, tick: u64, out: &mut PacketOutbox) {
        self.participant.on_timer(tick);
        self.send(tick, out);
    }

    /// Returns the tick in which something is due, unless a message comes before it.
    pub fn next_timer(&self) -> Option<u64> {
        self.participant.next_timer()
    }

    /// Returns whether the participant has come to its outcome.
    pub fn is_done(&self) -> bool {
        self.participant.is_done()
    }

    /// Seals all that the participant has to send, and counts it.
    fn send(&mut self, tick: u64, out: &mut PacketOutbox) {
        let ConversationSetup { id, me, fingerprint, end_tick, is_silent, .. } = self.info;
        for OutgoingMessage { to, message } in self.participant.take_messages() {
            let to = to.map_or_else(|| self.others.clone(), |one| Arc::from([one]));
            if is_silent || to.is_empty() {
                continue;
            }
            let sequence = self.sent;
            let header = PacketHeader { fingerprint, conversation: id, sender: me, sequence };
            let payload = message.into_packet(&header);
            let receivers = to.len();
            let bytes = payload.len();
            match out.push(OutgoingPacket { to, sequence, payload }, tick, end_tick) {
                PacketAdmission::Dropped => {
                    self.traffic.dropped += 1;
                    continue;
                }
                PacketAdmission::Deferred => self.traffic.deferred += 1,
                PacketAdmission::Sent => {}
            }
            self.traffic.count_message(receivers, bytes);
            self.sent += 1;
        }
    }
}

impl<P: FinishableParticipant + ?Sized> Conversation<P> {
    /// Returns the end of the conversation; a participant that is not done ends because time is up.
    pub fn finish(&mut self) -> ConversationEnd<P::Outcome> {
        self.participant.finish()
    }
}

impl<O> Conversation<dyn FinishableParticipant<Outcome = O>> {
    /// Returns the conversation as it remains for others once it has ended here: it answers their questions.
    pub fn into_ended(self) -> Conversation<dyn Participant> {
        let Self { info, others, sent, traffic, participant } = self;
        Conversation { info, others, sent, traffic, participant }
    }
}
