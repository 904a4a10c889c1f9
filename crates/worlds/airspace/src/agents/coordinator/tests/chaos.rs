//! Hosts on networks with faults of every kind, from seeds.

use super::super::epoch::{CoordinatorEpoch, is_majority};
use super::super::host::CoordinatorHost;
use super::{TestCoordinator, hosts};
use proptest::prelude::*;
use sidestep_kernel::network::RetryPolicy;
use std::collections::BTreeMap;

/// A period in which some hosts hear no others: from tick, to tick, and the side of each host.
#[derive(Debug, Clone)]
pub(super) struct Cut {
    pub while_ticks: (u64, u64),
    pub sides: Vec<bool>,
    /// Whether the first side hears the other one.
    pub is_one_way: bool,
}

/// A network with faults; all draws follow from the seed, the link, the tick and the message's number.
#[derive(Debug, Clone, Default)]
pub(super) struct Faults {
    pub seed: u64,
    pub loss: f64,
    pub duplication: f64,
    pub max_delay: u64,
    pub cuts: Vec<Cut>,
    /// Hosts that crash, and the ticks in which they do.
    pub crashes: Vec<(usize, u64)>,
}

impl Faults {
    /// Returns a number in [0, 1) that is drawn for a purpose.
    fn draw(&self, key: [u64; 5]) -> f64 {
        let mixed = key.iter().fold(self.seed, |sum, word| {
            let z = (sum ^ word).wrapping_add(0x9E37_79B9_7F4A_7C15);
            let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        });
        (mixed >> 11) as f64 / (1u64 << 53) as f64
    }

    fn is_cut(&self, from: usize, to: usize, tick: u64) -> bool {
        self.cuts.iter().any(|cut| {
            let (begin, end) = cut.while_ticks;
            let is_apart = cut.sides[from] != cut.sides[to] && (!cut.is_one_way || cut.sides[from]);
            (begin..end).contains(&tick) && is_apart
        })
    }

    /// Returns the ticks in which a message arrives.
    fn arrivals(&self, from: usize, to: usize, tick: u64, number: u64) -> Vec<u64> {
        let draw = |purpose| self.draw([purpose, from as u64, to as u64, tick, number]);
        let delayed = |purpose| tick + 1 + (draw(purpose) * (self.max_delay + 1) as f64) as u64;
        match () {
            () if self.is_cut(from, to, tick) || draw(0) < self.loss => Vec::new(),
            () if draw(1) < self.duplication => vec![delayed(2), delayed(3)],
            () => vec![delayed(2)],
        }
    }
}

/// A group of hosts on a network.
pub(super) struct Group {
    pub hosts: Vec<CoordinatorHost<TestCoordinator>>,
    pub is_alive: Vec<bool>,
    pub tick: u64,
    pub faults: Faults,
    sent: u64,
    /// Messages with sender and receiver, by tick of arrival and number.
    under_way: BTreeMap<(u64, u64), (usize, usize, Vec<u8>)>,
}

impl Group {
    pub(super) fn new(mut hosts: Vec<CoordinatorHost<TestCoordinator>>, faults: Faults) -> Self {
        hosts.iter_mut().for_each(|host| host.start(0));
        let is_alive = vec![true; hosts.len()];
        let mut group =
            Self { hosts, is_alive, tick: 0, faults, sent: 0, under_way: BTreeMap::new() };
        (0..group.hosts.len()).for_each(|k| group.send(k));
        group
    }

    fn send(&mut self, k: usize) {
        for sent in self.hosts[k].take_messages() {
            let others = (0..self.hosts.len()).filter(|&to| to != k);
            for to in sent.to.map_or_else(|| others.collect(), |to| vec![to]) {
                for at in self.faults.arrivals(k, to, self.tick, self.sent) {
                    self.sent += 1;
                    let bytes = sent.message.serialized_message().to_vec();
                    self.under_way.insert((at, self.sent), (k, to, bytes));
                }
                self.sent += 1;
            }
        }
    }

    /// Lets the next tick pass in which anything happens. Returns whether there is one.
    pub(super) fn step(&mut self) -> bool {
        let alive = (0..self.hosts.len()).filter(|&k| self.is_alive[k]);
        let timers = alive.filter_map(|k| self.hosts[k].next_timer());
        let arrivals = self.under_way.keys().next().map(|(at, _)| *at);
        let Some(next) = timers.chain(arrivals).min() else { return false };
        self.tick = next.max(self.tick);
        for &(k, at) in &self.faults.crashes {
            self.is_alive[k] &= at > self.tick;
        }
        while let Some(entry) = self.under_way.first_entry()
            && entry.key().0 <= self.tick
        {
            let (from, to, bytes) = entry.remove();
            if self.is_alive[to] {
                self.hosts[to].on_message(from, &bytes, self.tick).expect("sound");
                self.send(to);
            }
        }
        for k in 0..self.hosts.len() {
            if self.is_alive[k] {
                self.hosts[k].on_timer(self.tick);
                self.send(k);
            }
        }
        true
    }

    pub(super) fn is_done(&self) -> bool {
        (0..self.hosts.len()).all(|k| !self.is_alive[k] || self.hosts[k].services.is_done())
    }

    /// Returns the epochs of the coordinators that are on hosts which are alive.
    pub(super) fn is_here(&self) -> Vec<CoordinatorEpoch> {
        let alive = (0..self.hosts.len()).filter(|&k| self.is_alive[k]);
        let replicas =
            alive.map(|k| &self.hosts[k].replicas[0]).filter(|replica| replica.is_hosting());
        replicas.map(|replica| replica.accepted.epoch).collect()
    }

    /// Returns whether a majority has accepted an epoch and no newer one.
    pub(super) fn is_accepted(&self, epoch: CoordinatorEpoch) -> bool {
        let accepts = |host: &CoordinatorHost<TestCoordinator>| host.replicas[0].promised == epoch;
        is_majority(&self.hosts.iter().map(accepts).collect::<Vec<_>>())
    }
}

const RETRY_POLICY: RetryPolicy =
    RetryPolicy { ticks: 8, bits_per_tick: f64::INFINITY, tries: 8, first_tries: 3 };

fn cuts(group: usize) -> impl Strategy<Value = Vec<Cut>> {
    let sides = prop::collection::vec(any::<bool>(), group);
    let cut = (0u64..600, 1u64..2000, sides, any::<bool>()).prop_map(
        |(from, long, sides, is_one_way)| Cut {
            while_ticks: (from, from + long),
            sides,
            is_one_way,
        },
    );
    prop::collection::vec(cut, 0..4)
}

fn faults(group: usize) -> impl Strategy<Value = Faults> {
    let crashes = prop::collection::vec((0..group, 0u64..800), 0..3);
    let rates = (0.0f64..0.5, 0.0f64..0.3, 0u64..12);
    (any::<u64>(), rates, cuts(group), crashes).prop_map(
        |(seed, (loss, duplication, max_delay), cuts, crashes)| Faults {
            seed,
            loss,
            duplication,
            max_delay,
            cuts,
            crashes,
        },
    )
}

/// Flies a group until all have ended, and checks each tick.
fn one_rules(group: usize, rounds: u8, faults: Faults) -> Result<(), TestCaseError> {
    let mut group = Group::new(hosts(group, rounds, RETRY_POLICY, 120), faults);
    while !group.is_done() {
        prop_assert!(group.tick < 60_000, "somebody waits forever");
        prop_assert!(group.step(), "nothing happens any more");
        let is_here = group.is_here();
        for (k, epoch) in is_here.iter().enumerate() {
            prop_assert!(!is_here[..k].contains(epoch), "two coordinators of {epoch:?}");
        }
        let ruling = is_here.iter().filter(|epoch| group.is_accepted(**epoch)).count();
        prop_assert!(ruling <= 1, "{ruling} coordinators are accepted by majorities");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Over losses, delays, copies, cuts and crashes no coordinator has a twin, at most one is accepted by a
    /// majority, and no host waits forever.
    #[test]
    fn whatever_the_network_does_one_coordinator_rules_at_any_tick(
        (group, faults) in (2usize..8).prop_flat_map(|n| (Just(n), faults(n))), rounds in 1u8..6,
    ) {
        one_rules(group, rounds, faults)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30_000))]

    #[test]
    #[ignore = "minutes of processor time"]
    fn on_30_000_networks_one_coordinator_rules_at_any_tick(
        (group, faults) in (2usize..12).prop_flat_map(|n| (Just(n), faults(n))), rounds in 1u8..8,
    ) {
        one_rules(group, rounds, faults)?;
    }
}
