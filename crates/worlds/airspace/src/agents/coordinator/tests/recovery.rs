//! The time that it takes to bring back a coordinator after its host has died.

use super::chaos::{Faults, Group};
use super::hosts;
use sidestep_kernel::network::RetryPolicy;

/// Rounds that a coordinator makes, so that its host dies in any of them.
const ROUNDS: u8 = 20;

/// Chances that a message is lost, and the number of tries after which it is given up: the defaults of networks with
/// such a loss.
const LOSSES: [(f64, u32); 3] = [(0.0, 1), (0.1, 14), (0.3, 32)];

/// Returns the patience of hosts where a message takes a tick, and the ticks after which a group misses its
/// coordinator: the defaults of networks.
fn retry_policy(group: usize, tries: u32) -> (RetryPolicy, u64) {
    let bits_per_tick = f64::INFINITY;
    let patience = RetryPolicy { ticks: 3, bits_per_tick, tries, first_tries: tries };
    (patience, 3 * (group as u64 + u64::from(tries)))
}

/// Kills the host that the coordinator is on in a tick. Returns the ticks from then on until another host has it,
/// accepted by a majority, and until all living hosts have their controls.
fn recovery(group: usize, (loss, tries): (f64, u32), seed: u64) -> Option<(u64, u64)> {
    let (patience, miss_ticks) = retry_policy(group, tries);
    let mut hosts = hosts(group, ROUNDS, patience, miss_ticks);
    hosts.iter_mut().for_each(|host| host.services.is_restless = true);
    let mut group = Group::new(hosts, Faults { seed, loss, ..Faults::default() });
    // Somewhere in the first rounds, over all airplanes.
    let dies_at = 1 + seed % (10 * group.hosts.len() as u64);
    while group.tick < dies_at {
        assert!(group.step() && !group.is_done());
    }
    let farthest = (0..group.hosts.len()).max_by_key(|&k| group.hosts[k].replicas[0].accepted)?;
    let lost = group.hosts[farthest].replicas[0].accepted.epoch;
    (group.is_alive[farthest], group.faults.crashes) = (false, vec![(farthest, 0)]);
    let died_at = group.tick;
    let mut back_at = None;
    while !group.is_done() {
        assert!(group.step());
        let newest = group.hosts.iter().map(|host| host.replicas[0].accepted.epoch).max()?;
        if newest > lost && group.is_accepted(newest) {
            back_at.get_or_insert(group.tick);
        }
    }
    Some((back_at? - died_at, group.tick - died_at))
}

/// Returns the median and the 99th percentile.
fn percentiles(mut all: Vec<u64>) -> (u64, u64) {
    all.sort_unstable();
    (all[all.len() / 2], all[all.len() * 99 / 100])
}

/// At a millisecond for a tick the conversation of a cycle of 5 s has 2,250 ticks: the control of the same cycle
/// comes in time.
#[test]
fn a_coordinator_whose_host_dies_is_back_long_before_the_talk_ends() {
    for (group, loss) in [3, 5, 10, 20].into_iter().flat_map(|n| LOSSES.map(|loss| (n, loss))) {
        let (back, results): (Vec<u64>, Vec<u64>) =
            (0..200).filter_map(|seed| recovery(group, loss, seed)).unzip();
        let loss = loss.0;
        assert_eq!(back.len(), 200, "{group} hosts, loss {loss}: it is brought back every time");
        let (back, results) = (percentiles(back), percentiles(results));
        println!(
            "{group} hosts, loss {loss}: back p50, p99 {back:?}, all results {results:?} ticks"
        );
        assert!(
            back.1 < 400 && results.1 < 2250,
            "{group} hosts, loss {loss}: {back:?}, {results:?}"
        );
    }
}
