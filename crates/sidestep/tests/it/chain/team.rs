//! Chains that are moved by an agent per connector: the bits of one process, and the same bits however a
//! run is made.

use super::*;
use std::path::Path;

/// Settings that make a team possible, and that the reference needs to have in common with it.
const LOCAL: [&str; 3] =
    ["chain.self_collision=false", "chain.backtracks=0", "chain.escape=\"off\""];

/// A chain on a network that loses packets and, for a while, a connector.
const SILENT: &str = "
[chain]
dt_s = 0.05
self_collision = false
backtracks = 0
deployment = \"team\"
[chain.network]
loss = 0.2
duplication = 0.1
max_delay_s = 3e-5
silent = [{ connector = 4, from_s = 1.0, until_s = 2.0 }, { connector = 3, chain = 1, from_s = 1.5, until_s = 3.0 }]
[[fields]]
lo_m = [-4.0, -4.0]
hi_m = [4.0, 4.0]
part = 0.05
radius_m = 0.2
[[chains]]
count = 2
apart_m = [0.0, 1.0]
connectors = 8
at_m = [0.0, -1.5]
rod_m = [0.25, 0.35]
radius_m = 0.08
[[chains.tasks]]
kind = \"wander\"
turn_deg = 60
within_m = [[-2.5, -2.5], [2.5, 2.5]]
patience_s = 1000.0
";

#[test]
fn a_team_that_loses_packets_and_connectors_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(SILENT, 80, &[0, 1, 20, 21, 35, 41, 60, 79]);
}

/// The digest of a scenario that is shipped, with some keys set, after some cycles.
fn shipped<const D: usize>(name: &str, deployment: &str, more: &[&str], cycles: u64) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain");
    let path = Path::new(folder).join(name);
    let deployed = format!("chain.deployment=\"{deployment}\"");
    let sets = LOCAL.iter().chain(more).map(ToString::to_string).chain([deployed]);
    let source = Source::read(&path, &sets.collect::<Vec<_>>()).expect("a scenario");
    let mut run = run::<D>(&source, 1);
    advance_to(&mut run, cycles);
    format!("{} {}", run.digest(), outcome(&run).replace(char::is_whitespace, " "))
}

/// Counts of the network are no part of the comparison.
fn without_network(outcome: &str) -> String {
    let fields = outcome.split(", ");
    let kept = fields.filter(|f| !f.starts_with("messages: ") && !f.starts_with("bytes: "));
    kept.collect::<Vec<_>>().join(", ")
}

#[test]
fn shipped_scenarios_in_the_plane_end_as_in_one_process_bit_for_bit() {
    for (name, cycles) in
        [("serpentine.toml", 700), ("pushed-and-pulled.toml", 4000), ("movers.toml", 300)]
    {
        let [direct, team] = ["direct", "team"]
            .map(|deployment| without_network(&shipped::<2>(name, deployment, &[], cycles)));
        assert_eq!(team, direct, "{name}");
    }
}

#[test]
fn shipped_scenarios_in_space_end_as_in_one_process_bit_for_bit() {
    for (name, cycles) in [("snake3d.toml", 40), ("hemmed-in.toml", 40)] {
        let [direct, team] = ["direct", "team"]
            .map(|deployment| without_network(&shipped::<3>(name, deployment, &[], cycles)));
        assert_eq!(team, direct, "{name}");
    }
}
