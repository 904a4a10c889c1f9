//! One talk, as one airplane takes part in it: a party, and the packets around its messages.

use super::packet::{Packet, Seal, TalkId};
use super::party::{Concludes, Ended, Outgoing, Party, Progress};
use super::traffic::Traffic;
use sidestep_kernel::EntityId;
use sidestep_kernel::network::Refusal;
use std::sync::Arc;

/// The identity, participants and times of a talk.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The talk.
    pub id: TalkId,
    /// Ids of all participants, rising.
    pub members: Arc<[EntityId]>,
    /// Id of the airplane itself.
    pub me: EntityId,
    /// Digest of scenario and build.
    pub fingerprint: u64,
    /// The tick in which it starts.
    pub begins: u64,
    /// The tick in which it ends at the latest.
    pub ends: u64,
    /// Whether the radio is dead.
    pub is_silent: bool,
}

/// A talk, with the party that is aboard.
pub struct Talk<P: ?Sized> {
    frame: Frame,
    others: Arc<[EntityId]>,
    /// Number of packets sent so far.
    sent: u32,
    traffic: Traffic,
    party: Box<P>,
}

impl<P: Party + ?Sized> Talk<P> {
    /// Returns a talk in which nothing has been said yet.
    pub fn new(frame: Frame, party: Box<P>) -> Self {
        let others = frame.members.iter().copied().filter(|&id| id != frame.me).collect();
        Self { frame, others, sent: 0, traffic: Traffic::default(), party }
    }

    /// Its identity, members and times.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns how far the party has come.
    pub fn progress(&self) -> Progress {
        self.party.progress()
    }

    /// Returns the count of its packets so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Starts it.
    pub fn start(&mut self, tick: u64, out: &mut Vec<Packet>) {
        self.party.start(tick);
        self.send(out);
    }

    /// Takes a message of another airplane.
    ///
    /// # Errors
    /// When that one takes no part in it, or its message has impossible content; nothing has changed then.
    pub fn hear(
        &mut self,
        from: EntityId,
        message: &[u8],
        tick: u64,
        out: &mut Vec<Packet>,
    ) -> Result<(), Refusal> {
        if from == self.frame.me || self.frame.members.binary_search(&from).is_err() {
            return Err(Refusal::Sender);
        }
        if message.len() > self.party.most_bytes() {
            return Err(Refusal::TooLarge);
        }
        self.party.on_message(from, message, tick)?;
        self.send(out);
        Ok(())
    }

    /// Performs the actions that are due by a tick.
    pub fn on_timer(&mut self, tick: u64, out: &mut Vec<Packet>) {
        self.party.on_timer(tick);
        self.send(out);
    }

    /// Returns the tick in which something is due, unless a message comes before it.
    pub fn next_timer(&self) -> Option<u64> {
        self.party.next_timer()
    }

    /// Returns whether the party has come to its outcome.
    pub fn is_done(&self) -> bool {
        self.party.is_done()
    }

    /// Seals all that the party has to send, and counts it.
    fn send(&mut self, out: &mut Vec<Packet>) {
        let Frame { id, me, fingerprint, is_silent, .. } = self.frame;
        for Outgoing { to, message } in self.party.take_messages() {
            let to = to.map_or_else(|| self.others.clone(), |one| Arc::from([one]));
            if is_silent || to.is_empty() {
                continue;
            }
            let sequence = self.sent;
            let seal = Seal { fingerprint, talk: id, sender: me, sequence };
            let payload = message.sealed(&seal);
            self.traffic.count(to.len(), payload.len());
            out.push(Packet { to, sequence, payload });
            self.sent += 1;
        }
    }
}

impl<P: Concludes + ?Sized> Talk<P> {
    /// Returns the end of the talk; a party that is not done ends because time is up.
    pub fn end(&mut self) -> Ended<P::Outcome> {
        self.party.end()
    }
}

impl<O> Talk<dyn Concludes<Outcome = O>> {
    /// Returns the talk as it remains for others once it has ended here: it answers their questions.
    pub fn past(self) -> Talk<dyn Party> {
        let Self { frame, others, sent, traffic, party } = self;
        Talk { frame, others, sent, traffic, party }
    }
}
