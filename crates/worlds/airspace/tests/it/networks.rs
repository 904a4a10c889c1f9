//! D3 for agents: their results over a network, faultless or not, are the same bits on every
//! machine, and so are their messages.

use sidestep_airspace::airspace_run;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

const FAULTS: &str = "network = { loss = 0.15, duplication = 0.1, max_delay_s = 0.005, \
                      silent = [{ airplane = 2, from_s = 40.0 }] }";

/// The digest of a run of five that meet, and its traffic on the network.
fn digest_and_traffic(preset: &str, deployment: &str, more: &str) -> String {
    let text = format!(
        "format = 1\nworld = \"airspace\"\nseed = 11\n[airspace]\npreset = \"{preset}\"\n\
         deployment = \"{deployment}\"\nmax_rounds = 30\n{more}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = 5\n"
    );
    let mut run = airspace_run(&Source::new("agents", text, ""), 1).expect("a scenario");
    run.advance(20);
    let (digest, m) = (run.digest(), run.metrics());
    let network = if more.is_empty() { "faultless" } else { "faulty" };
    format!(
        "{preset} {deployment} {network} {digest} {} {} {} {}\n",
        m.messages, m.bytes, m.multicasts, m.multicast_bytes
    )
}

/// A change needs a line in the CHANGELOG (D4), and the lines that this prints in the file.
#[test]
fn the_golden_digests_of_agents_are_what_every_machine_gets() {
    let mut found = String::new();
    for network in ["", FAULTS] {
        for preset in ["default", "paper"] {
            for deployment in ["team", "compact-team", "replica-team", "pim", "hierarchical-pim"] {
                found += &digest_and_traffic(preset, deployment, network);
            }
        }
    }
    assert_eq!(found, include_str!("../golden/networks.txt"), "found:\n{found}");
}
