//! All interleavings of three hosts and some faults: every order in which messages may arrive and
//! time may run out, by a search over all states that real hosts can come to.

use super::super::epoch::{CoordinatorEpoch, is_majority};
use super::super::replica::ReplicaRole;
use super::{TestCoordinator, TestHost, hosts};
use crate::agents::coordinator::host::CoordinatorHost;
use sidestep_kernel::network::RetryPolicy;
use std::collections::{BTreeMap, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};

const GROUP: usize = 3;
const RETRY_POLICY: RetryPolicy =
    RetryPolicy { ticks: 10, bits_per_tick: f64::INFINITY, tries: 3, first_tries: 3 };
const MISS_TICKS: u64 = 400;

/// A message under way.
type InFlightMessage = (usize, usize, Vec<u8>);

/// A state of the whole: hosts and a network.
#[derive(Clone)]
struct SystemState {
    hosts: Vec<CoordinatorHost<TestCoordinator>>,
    tick: u64,
    is_alive: [bool; GROUP],
    /// Flights in sorted order, because only the messages under way matter, not how long they have
    /// been under way.
    flights: Vec<InFlightMessage>,
    faults_left: u8,
    /// The hosts that have ever accepted each epoch.
    accepted: BTreeMap<CoordinatorEpoch, [bool; GROUP]>,
}

/// A thing that may happen next.
#[derive(Debug, Clone, Copy)]
enum Transition {
    Arrives(usize),
    IsDue(usize),
    Crashes(usize),
    IsLost(usize),
    IsDoubled(usize),
    /// Time runs out before messages under way have arrived.
    IsDueEarly(usize),
}

impl SystemState {
    fn new(faults: u8) -> Self {
        let mut whole = Self {
            hosts: hosts(GROUP, 1, RETRY_POLICY, MISS_TICKS),
            tick: 0,
            is_alive: [true; GROUP],
            flights: Vec::new(),
            faults_left: faults,
            accepted: BTreeMap::new(),
        };
        (0..GROUP).for_each(|k| whole.hosts[k].start(0));
        (0..GROUP).for_each(|k| whole.collect(k));
        whole
    }

    fn services(&self, k: usize) -> &TestHost {
        &self.hosts[k].services
    }

    /// Collects the messages that a host has sent, and notes the epoch that it has accepted.
    fn collect(&mut self, k: usize) {
        for sent in self.hosts[k].take_messages() {
            let others = (0..GROUP).filter(|&to| to != k);
            let to: Vec<usize> = sent.to.map_or_else(|| others.collect(), |to| vec![to]);
            let flights = to.into_iter().filter(|&to| self.is_alive[to]);
            let bytes = sent.message.serialized_message();
            self.flights.extend(flights.map(|to| (k, to, bytes.to_vec())));
        }
        self.flights.sort_unstable();
        let promised = self.hosts[k].replicas[0].promised;
        self.accepted.entry(promised).or_insert([false; GROUP])[k] = true;
    }

    /// Returns the next tick in which something is due, and the hosts for which it is due.
    fn next_due(&self) -> Option<(u64, Vec<usize>)> {
        let alive = (0..GROUP).filter(|&k| self.is_alive[k]);
        let timers: Vec<(u64, usize)> =
            alive.filter_map(|k| Some((self.hosts[k].next_timer()?, k))).collect();
        let next = timers.iter().map(|(due, _)| *due).min()?;
        Some((next, timers.into_iter().filter(|(due, _)| *due == next).map(|(_, k)| k).collect()))
    }

    /// Returns all that may happen next.
    fn choices(&self) -> Vec<Transition> {
        let different = |&k: &usize| k == 0 || self.flights[k] != self.flights[k - 1];
        let flights: Vec<usize> = (0..self.flights.len()).filter(different).collect();
        let mut all: Vec<Transition> = flights.iter().map(|&k| Transition::Arrives(k)).collect();
        let due = self.next_due().map_or(Vec::new(), |(_, hosts)| hosts);
        if flights.is_empty() {
            all.extend(due.iter().map(|&k| Transition::IsDue(k)));
        }
        if self.faults_left > 0 {
            if !flights.is_empty() {
                all.extend(due.iter().map(|&k| Transition::IsDueEarly(k)));
            }
            all.extend(
                flights.iter().flat_map(|&k| [Transition::IsLost(k), Transition::IsDoubled(k)]),
            );
            all.extend((0..GROUP).filter(|&k| self.is_alive[k]).map(Transition::Crashes));
        }
        all
    }

    /// Returns the state after something has happened.
    fn after(&self, what: Transition) -> Self {
        let mut next = self.clone();
        match what {
            Transition::Arrives(k) => {
                let (from, to, bytes) = next.flights.remove(k);
                next.hosts[to].on_message(from, &bytes, next.tick).expect("sound");
                next.collect(to);
            }
            Transition::IsDue(k) | Transition::IsDueEarly(k) => {
                let due = next.hosts[k].next_timer().expect("due");
                next.tick = next.tick.max(due);
                next.hosts[k].on_timer(next.tick);
                next.collect(k);
            }
            Transition::IsLost(k) => drop(next.flights.remove(k)),
            Transition::IsDoubled(k) => next.flights.insert(k, next.flights[k].clone()),
            Transition::Crashes(k) => {
                next.is_alive[k] = false;
                next.flights.retain(|(_, to, _)| *to != k);
            }
        }
        let is_fault = !matches!(what, Transition::Arrives(_) | Transition::IsDue(_));
        next.faults_left -= u8::from(is_fault);
        next
    }

    /// Returns the epochs of the coordinators that are on hosts which are alive.
    fn is_here(&self) -> Vec<CoordinatorEpoch> {
        let replicas = (0..GROUP).filter(|&k| self.is_alive[k]).map(|k| &self.hosts[k].replicas[0]);
        replicas
            .filter(|replica| replica.is_hosting())
            .map(|replica| replica.accepted.epoch)
            .collect()
    }

    /// Returns whether a majority has accepted an epoch and no newer one; those that have crashed
    /// count as they were.
    fn is_accepted(&self, epoch: CoordinatorEpoch) -> bool {
        let have: Vec<bool> =
            self.hosts.iter().map(|host| host.replicas[0].promised == epoch).collect();
        is_majority(&have)
    }

    /// Checks all that must hold at any time.
    fn check(&self) {
        let is_here = self.is_here();
        for (k, epoch) in is_here.iter().enumerate() {
            assert!(!is_here[..k].contains(epoch), "two coordinators of {epoch:?}");
        }
        let rule = is_here.iter().filter(|epoch| self.is_accepted(**epoch)).count();
        assert!(rule <= 1, "{rule} coordinators are accepted by majorities");
        for k in 0..GROUP {
            if let Some(epoch) = self.services(k).concluded {
                let had = self.accepted.get(&epoch);
                assert!(had.is_some_and(|had| is_majority(had)), "{k} has a result of {epoch:?}");
            }
        }
    }

    /// Checks that no host goes back to an older epoch.
    fn check_after(&self, before: &Self) {
        for (now, then) in self.hosts.iter().zip(&before.hosts) {
            assert!(now.replicas[0].promised >= then.replicas[0].promised);
        }
    }

    /// Checks the end: every living host has ended, and with a control if a majority is alive.
    fn check_end(&self) {
        for k in (0..GROUP).filter(|&k| self.is_alive[k]) {
            let services = self.services(k);
            assert!(services.is_done(), "{k} waits forever");
            if is_majority(&self.is_alive) {
                assert!(services.concluded.is_some(), "{k} is cut off, and a majority is alive");
            }
        }
    }

    /// Returns whether all have ended and nothing more is under way.
    fn is_over(&self) -> bool {
        self.flights.is_empty() && self.next_due().is_none()
    }

    /// Returns a digest of everything that can affect the future: times are given as remaining
    /// times.
    fn digest(&self) -> u128 {
        let mut bytes = Vec::with_capacity(512);
        let mut add = |piece: &dyn erased::Plain| piece.write(&mut bytes);
        for k in 0..GROUP {
            add(&(self.is_alive[k], self.services(k).is_rested, self.services(k).is_cut_off));
            add(&self.services(k).concluded);
            let (replica, now) = (&self.hosts[k].replicas[0], self.tick);
            let left = |tick: u64| tick.saturating_sub(now);
            add(&(replica.promised, replica.newest, replica.accepted, replica.candidate_number));
            add(&(left(replica.election_due_tick()), left(replica.quiet_until)));
            add(&replica.unanswering);
            add(&replica.copy.as_ref().map(|copy| (copy.at, copy.state.to_vec())));
            match &replica.role {
                ReplicaRole::Idle => add(&0u8),
                ReplicaRole::Hosting(stay) => {
                    add(&(1u8, left(stay.heartbeat_at), left(stay.timeout_at)));
                    add(&stay.coordinator);
                }
                ReplicaRole::Sending { to, tries_left, due, heartbeat_at } => {
                    add(&(2u8, *to, *tries_left, left(*due), left(*heartbeat_at)));
                }
                ReplicaRole::Candidate(one) => {
                    add(&(3u8, &one.request, one.lost, one.tries_left, left(one.due)));
                    add(&(&one.votes, &one.heard));
                }
            }
        }
        add(&(&self.flights, self.faults_left));
        let accepted: Vec<_> = self.accepted.iter().collect();
        add(&accepted);
        let half = |salt: u8| {
            let mut hasher = DefaultHasher::new();
            (salt, &bytes).hash(&mut hasher);
            u128::from(hasher.finish())
        };
        half(0) << 64 | half(1)
    }
}

/// Values that differ if their serialized forms do.
mod erased {
    use serde::Serialize;

    pub(super) trait Plain {
        fn write(&self, bytes: &mut Vec<u8>);
    }

    impl<T: Serialize> Plain for T {
        fn write(&self, bytes: &mut Vec<u8>) {
            bytes.extend(postcard::to_stdvec(self).expect("plain data"));
        }
    }
}

/// Visits every state that can be reached with some faults. Returns the number of states, and of ends.
fn search(faults: u8) -> (usize, usize) {
    let start = SystemState::new(faults);
    let (mut known, mut ends) = (HashSet::from([start.digest()]), 0);
    let mut left = vec![start];
    while let Some(whole) = left.pop() {
        whole.check();
        if whole.is_over() {
            whole.check_end();
            ends += 1;
        }
        for what in whole.choices() {
            let next = whole.after(what);
            next.check_after(&whole);
            if known.insert(next.digest()) {
                left.push(next);
            }
        }
    }
    println!("{faults} faults: {} states, {ends} ends", known.len());
    (known.len(), ends)
}

/// Half a second of processor time. The numbers of states show that the search has left nothing out: a protocol that
/// does less has fewer.
#[test]
fn in_all_interleavings_of_three_hosts_and_two_faults_one_coordinator_rules_and_all_come_to_an_end()
{
    let found: Vec<_> = (0..=2).map(search).collect();
    assert!(found.iter().all(|(_, ends)| *ends > 0));
    assert!(found.windows(2).all(|pair| pair[0].0 * 10 < pair[1].0), "{found:?}");
}

#[test]
#[ignore = "minutes of processor time"]
fn in_all_interleavings_of_three_hosts_and_three_faults_the_same_holds() {
    assert!(search(3).0 > 500_000);
}
