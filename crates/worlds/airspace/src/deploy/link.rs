//! What an agent needs to talk over a network that loses, delays, doubles and reorders messages.
//!
//! Every agent says all it says to all the others of its group. An [`Endpoint`] numbers what its
//! agent says and keeps it; whoever misses something asks for it again. One that does not answer
//! although it was asked several times is given up for this talk: the agent goes on with what it
//! knows of it. Whoever was not heard in the talk before is asked once. So nobody waits for ever,
//! and a loss costs time instead of agreement.
//!
//! Endpoints and agents are state machines without input or output of their own.

use super::network::Ended;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// An agent as a state machine: messages in, messages to all others out. Others are known by
/// their place in the group.
pub(super) trait Agent {
    /// What it sends and receives.
    type Message: Serialize + DeserializeOwned;
    /// What it comes to.
    type Outcome;

    /// What it says before it has heard anything.
    fn start(&mut self) -> Vec<Self::Message>;

    /// Takes a message of agent `from`, and says what it has to say then. Messages come in any
    /// order, each once.
    fn on_message(&mut self, from: usize, message: Self::Message) -> Vec<Self::Message>;

    /// Whose messages it needs in order to go on.
    fn awaits(&self) -> Vec<usize>;

    /// Whether an answer of agent `other` can be expected.
    fn expects(&self, _other: usize) -> bool {
        true
    }

    /// Nothing more will come of agent `other`: goes on with what is known of it. It is settled
    /// if it has come to an end itself, rather than fallen silent.
    fn without(&mut self, other: usize, is_settled: bool) -> Vec<Self::Message>;

    /// Time is up: makes the best of what it knows.
    fn at_deadline(&mut self);

    /// What it has come to, when it has.
    fn outcome(&self) -> Option<Self::Outcome>;
}

/// What goes over the wire.
#[derive(Debug, Serialize, Deserialize)]
enum Packet<M> {
    /// The message of this number of the sender's.
    Said(u32, M),
    /// "Say again whatever you have said from this number on."
    Ask(u32),
    /// "I have said no more than that yet."
    Wait,
    /// "I have said no more than that, and shall not."
    Done,
}

/// A packet on its way out, to one other or to all.
#[derive(Debug)]
pub(super) struct Outgoing {
    pub(super) to: Option<usize>,
    pub(super) payload: Vec<u8>,
}

/// An agent with all that makes its messages arrive.
#[derive(Debug)]
pub(super) struct Endpoint<A> {
    agent: A,
    me: usize,
    /// What it has said, serialized, by number.
    said: Vec<Vec<u8>>,
    others: Vec<Other>,
    patience: Patience,
    quiet_since: u64,
    late: bool,
}

/// How long and how often an endpoint asks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patience {
    /// Ticks without anything new after which it asks.
    pub(super) ticks: u64,
    /// How often somebody is asked before it is given up.
    pub(super) tries: u32,
}

/// What an endpoint knows of another one.
#[derive(Debug, Clone, Default)]
struct Other {
    /// All messages below this number have come,
    next: u32,
    /// and these.
    early: BTreeSet<u32>,
    unanswered: u32,
    gone: bool,
    unheard: bool,
}

impl Other {
    /// Whether a number is new.
    fn takes(&mut self, number: u32) -> bool {
        let is_new = number >= self.next && self.early.insert(number);
        while self.early.remove(&self.next) {
            self.next += 1;
        }
        is_new
    }
}

/// A packet as it goes over the wire.
pub(super) fn bytes_of<M: Serialize>(message: &M) -> Vec<u8> {
    postcard::to_stdvec(message).expect("messages are plain data")
}

impl<A: Agent> Endpoint<A> {
    /// The endpoint of agent `me` of a group, and its first packets.
    pub(super) fn new(
        mut agent: A,
        (me, group): (usize, usize),
        patience: Patience,
        tick: u64,
    ) -> (Self, Vec<Outgoing>) {
        let first = agent.start();
        let others = vec![Other::default(); group];
        let mut endpoint =
            Self { agent, me, said: Vec::new(), others, patience, quiet_since: tick, late: false };
        let said = endpoint.say(first);
        (endpoint, said)
    }

    fn say(&mut self, messages: Vec<A::Message>) -> Vec<Outgoing> {
        let mut out = Vec::with_capacity(messages.len());
        for message in messages {
            let payload = bytes_of(&Packet::Said(self.said.len() as u32, message));
            self.said.push(payload.clone());
            out.push(Outgoing { to: None, payload });
        }
        out
    }

    /// Takes a packet. One that cannot be read is as good as lost.
    pub(super) fn on_packet(&mut self, from: usize, bytes: &[u8], tick: u64) -> Vec<Outgoing> {
        let Ok(packet) = postcard::from_bytes::<Packet<A::Message>>(bytes) else {
            return Vec::new();
        };
        self.others[from].unanswered = 0;
        match packet {
            Packet::Said(number, message) if self.others[from].takes(number) => {
                self.quiet_since = tick;
                let said = self.agent.on_message(from, message);
                self.say(said)
            }
            Packet::Said(..) | Packet::Wait => Vec::new(),
            Packet::Ask(number) => self.answer(from, number),
            // Whoever says so was asked for what had not come: all of it has come.
            Packet::Done => self.go_on_without(from, true),
        }
    }

    fn answer(&self, to: usize, from_number: u32) -> Vec<Outgoing> {
        let missing = self.said.get(from_number as usize..).unwrap_or_default();
        let again = |payload: &Vec<u8>| Outgoing { to: Some(to), payload: payload.clone() };
        if !missing.is_empty() {
            return missing.iter().map(again).collect();
        }
        let nothing = if self.is_done() { Packet::<A::Message>::Done } else { Packet::Wait };
        vec![again(&bytes_of(&nothing))]
    }

    fn go_on_without(&mut self, other: usize, is_settled: bool) -> Vec<Outgoing> {
        if self.others[other].gone {
            return Vec::new();
        }
        self.others[other].gone = true;
        let said = self.agent.without(other, is_settled);
        self.say(said)
    }

    /// Asks whom it waits for, if it has waited long enough, and gives up who never answers.
    pub(super) fn on_timer(&mut self, tick: u64) -> Vec<Outgoing> {
        if self.next_timer().is_none_or(|due| due > tick) {
            return Vec::new();
        }
        self.quiet_since = tick;
        let mut out = Vec::new();
        for j in self.agent.awaits() {
            let tries = if self.agent.expects(j) { self.patience.tries } else { 1 };
            let other = &mut self.others[j];
            if other.unanswered < tries {
                other.unanswered += 1;
                let payload = bytes_of(&Packet::<A::Message>::Ask(other.next));
                out.push(Outgoing { to: Some(j), payload });
            } else {
                other.unheard = true;
                out.extend(self.go_on_without(j, false));
            }
        }
        out
    }

    /// The tick in which its patience ends.
    pub(super) fn next_timer(&self) -> Option<u64> {
        (!self.is_done()).then(|| self.quiet_since.saturating_add(self.patience.ticks))
    }

    /// Nobody hears it, and it hears nobody.
    pub(super) fn is_alone(&mut self) {
        let me = self.me;
        for j in (0..self.others.len()).filter(|&j| j != me) {
            self.others[j].unheard = true;
            self.go_on_without(j, false);
        }
    }

    pub(super) fn is_done(&self) -> bool {
        self.agent.outcome().is_some()
    }

    /// The end of the talk.
    pub(super) fn end(mut self) -> Ended<A::Outcome> {
        if !self.is_done() {
            self.late = true;
            self.agent.at_deadline();
        }
        let unheard = (0..self.others.len()).filter(|&j| self.others[j].unheard).collect();
        Ended { outcome: self.agent.outcome(), unheard, late: self.late }
    }
}

#[cfg(test)]
mod tests {
    use super::super::network::{Network, Silence, Talk, Topic, run};
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::Streams;

    /// Tells a number in each of some rounds, and adds up what all have told; who is given up
    /// counts 1000 from then on.
    struct Adder {
        me: usize,
        rounds: u32,
        round: u32,
        told: Vec<Vec<Option<u64>>>,
        sum: u64,
        is_over: bool,
    }

    impl Adder {
        fn new(me: usize, group: usize, rounds: u32) -> Self {
            let told = vec![vec![None; group]; rounds as usize];
            Self { me, rounds, round: 0, told, sum: 0, is_over: false }
        }

        fn number(&self) -> u64 {
            u64::from(self.round) * 7 + self.me as u64
        }

        fn go_on(&mut self) -> Vec<(u32, u64)> {
            let mut said = Vec::new();
            while self.round < self.rounds && self.awaits().is_empty() {
                self.sum += self.told[self.round as usize].iter().flatten().sum::<u64>();
                self.sum += self.number();
                self.round += 1;
                if self.round < self.rounds {
                    said.push((self.round, self.number()));
                }
            }
            said
        }
    }

    impl Agent for Adder {
        type Message = (u32, u64);
        type Outcome = u64;

        fn start(&mut self) -> Vec<Self::Message> {
            vec![(0, self.number())]
        }

        fn on_message(
            &mut self,
            from: usize,
            (round, number): Self::Message,
        ) -> Vec<Self::Message> {
            let told = &mut self.told[round as usize][from];
            assert!(told.is_none(), "each message comes once");
            *told = Some(number);
            self.go_on()
        }

        fn awaits(&self) -> Vec<usize> {
            let Some(told) = self.told.get(self.round as usize) else { return Vec::new() };
            let others = (0..told.len()).filter(|&j| j != self.me);
            others.filter(|&j| told[j].is_none()).collect()
        }

        fn without(&mut self, other: usize, _: bool) -> Vec<Self::Message> {
            for told in &mut self.told[self.round as usize..] {
                told[other].get_or_insert(1000);
            }
            self.go_on()
        }

        fn at_deadline(&mut self) {
            self.is_over = true;
        }

        fn outcome(&self) -> Option<u64> {
            (self.is_over || self.round == self.rounds).then_some(self.sum)
        }
    }

    fn talk(network: Option<&Network>, seed: u64) -> Talk<'_> {
        let streams = Streams::new(Seed(seed));
        Talk { network, streams, topic: Topic::Optimization, now: 3, at_s: 15.0 }
    }

    fn network(loss: f64, max_delay_s: f64, silences: Vec<Silence>) -> Network {
        Network {
            loss,
            duplication: 0.2,
            latency_s: 0.001,
            max_delay_s,
            patience_s: 3.0 * (0.001 + max_delay_s),
            deadline_s: 1000.0,
            silences,
        }
    }

    fn sums(network: Option<&Network>, seed: u64, group: usize, rounds: u32) -> Vec<Ended<u64>> {
        let ids: Vec<u32> = (0..group as u32).map(|id| 3 * id).collect();
        let agents = (0..group).map(|me| Adder::new(me, group, rounds)).collect();
        run(&talk(network, seed), &ids, agents).0
    }

    proptest! {
        /// Messages that are lost, doubled and overtaken arrive once all the same.
        #[test]
        fn losses_cost_time_and_not_agreement(
            seed in any::<u64>(), loss in 0.0f64..0.1, delay_s in 0.0f64..0.01,
            group in 2usize..6, rounds in 1u32..12,
        ) {
            let faultless = sums(None, seed, group, rounds);
            let network = network(loss, delay_s, Vec::new());
            let found = sums(Some(&network), seed, group, rounds);
            for (end, expected) in found.iter().zip(&faultless) {
                // At most two waits in a thousand million end with a dozen questions unanswered.
                prop_assert!(end.unheard.is_empty() && !end.late);
                prop_assert_eq!(end.outcome, expected.outcome);
            }
        }
    }

    #[test]
    fn one_that_never_answers_is_given_up_and_named() {
        let silences = vec![Silence { airplane: 6, from_s: 10.0, until_s: f64::INFINITY }];
        let network = network(0.1, 0.0, silences);
        let ends = sums(Some(&network), 5, 4, 3);
        // Places 0, 1, 3 and 1000 for the silent one, in rounds 0 to 2.
        let expected = (4 + 1000) + (4 + 21 + 1000) + (4 + 42 + 1000);
        for (place, end) in ends.iter().enumerate().filter(|(place, _)| *place != 2) {
            assert_eq!((end.outcome, &end.unheard), (Some(expected), &vec![2]), "{place}");
        }
        assert_eq!(ends[2].unheard, [0, 1, 3], "it knows that it is alone");
    }

    #[test]
    fn a_deadline_ends_what_does_not_end() {
        let network = Network { deadline_s: 0.002, ..network(0.9, 0.0, Vec::new()) };
        assert!(sums(Some(&network), 1, 4, 30).iter().all(|end| end.late && end.outcome.is_some()));
    }
}
