//! Deployments of a group's optimizer: the same algorithm run in several places.
//!
//! - `direct`: one process decides for all. The reference: on a faultless network every other
//!   deployment chooses the same controls, bit for bit.
//! - `team`: an agent per airplane (the paper's Algorithm 1). With sampled expectations each
//!   sends the predicted ways of its samples every round, then its part of their costs; with
//!   exact ones it sends the ways of all its actions once, and then its distribution.
//! - `compact-team`: the same, but an agent sends its state and model once, from which the others
//!   predict its ways themselves; then only its samples' numbers, or its distribution.
//! - `replica-team`: an agent sends once where it is and intends to go, and each makes the whole computation for all,
//!   with the same result. Fewest messages, and the most computation.
//! - `pim`: one coordinator whose state migrates from airplane to airplane (the paper's process
//!   integrated mechanism) and reads an airplane's model only while it is there.
//! - `hierarchical-pim`: a coordinator for each part of the group, and one above them.
//!
//! The programs aboard are [`crate::agents`], and a [`Pilot`](crate::pilot::Pilot) goes with them through the
//! conversations of a cycle. Here those of a group are run over a network in memory (`group.rs`) that has the
//! faults of the scenario ([`sidestep_kernel::network`]).

#[cfg(test)]
mod command_tests;
#[cfg(test)]
mod conversation_tests;
mod group;
#[cfg(test)]
mod grouping_tests;
#[cfg(test)]
mod outage_tests;

pub(crate) use group::decide_group;
#[cfg(test)]
pub(crate) use group::run_pilot_conversations;

#[cfg(test)]
mod tests {
    use super::super::metrics::Metrics;
    use super::super::{AirspaceRun, airspace_run};
    use proptest::prelude::*;
    use sidestep_kernel::network::SIGNATURE_BYTES;
    use sidestep_kernel::{Digest, Simulation};
    use sidestep_scenario::Source;

    fn flown(preset: &str, deployment: &str, more: &str) -> (Digest, Metrics) {
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = 5\n[airspace]\npreset = \"{preset}\"\n\
             deployment = \"{deployment}\"\nmax_rounds = 60\nshield = \"off\"\n{more}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 5\n"
        );
        let mut run = airspace_run(&Source::new("s", text, ""), 1).expect("a scenario");
        run.advance(25);
        (run.digest(), run.metrics())
    }

    /// On a faultless network, with exact expectations in sequence and in parallel, and with
    /// sampled ones and drawn controls.
    #[test]
    fn every_deployment_chooses_the_same_controls_bit_for_bit() {
        let parallel = "order = \"parallel\"";
        for (preset, more) in [("default", ""), ("default", parallel), ("paper", "")] {
            let (direct, alone) = flown(preset, "direct", more);
            assert_eq!((alone.messages, alone.bytes), (0, 0));
            for deployment in ["team", "compact-team", "replica-team", "pim", "hierarchical-pim"] {
                let (digest, metrics) = flown(preset, deployment, more);
                assert_eq!(digest, direct, "{deployment}, {preset} {more}");
                assert_eq!(metrics.rounds_mean, alone.rounds_mean);
                assert!(metrics.messages > 0 && metrics.bytes > 0);
            }
        }
    }

    /// Checks parts of the paper's figures 6 and 7, and the savings of compact messages.
    #[test]
    fn a_coordinator_sends_fewer_messages_than_a_team_and_more_bytes_than_one_that_multicasts() {
        let [team, compact, pim] =
            ["team", "compact-team", "pim"].map(|deployment| flown("paper", deployment, "").1);
        assert!(pim.messages < team.messages);
        assert!(pim.bytes > 2 * team.multicast_bytes);
        assert!(compact.bytes * 20 < team.bytes, "{} {}", compact.bytes, team.bytes);
    }

    const FAULTS: &str = "network = { loss = 0.1, duplication = 0.05, max_delay_s = 0.003, \
         silent = [{ airplane = 2, from_s = 60.0 }] }";

    fn over_a_bad_network(preset: &str, deployment: &str, more: &str, seed: u64) -> AirspaceRun {
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = {seed}\n[airspace]\npreset = \"{preset}\"\n\
             deployment = \"{deployment}\"\nmax_rounds = 40\n{more}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 5\n"
        );
        airspace_run(&Source::new("s", text, ""), 1).expect("a scenario")
    }

    /// Despite any losses all agents end in time, no airplanes come too near, and all arrive except
    /// the silent one, which waits on its orbit.
    #[test]
    fn on_a_network_that_loses_messages_and_an_airplane_the_shield_keeps_all_apart() {
        for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
            for (preset, seed) in [("default", 1), ("default", 2), ("paper", 1)] {
                // The messages of the paper's optimizer are large where each agent sends its own.
                if preset == "paper" && deployment != "compact-team" {
                    continue;
                }
                let mut run = over_a_bad_network(preset, deployment, FAULTS, seed);
                run.advance(300);
                let metrics = run.metrics();
                let what = format!("{deployment}, {preset}, seed {seed}: {metrics:?}");
                assert_eq!(metrics.losses_of_separation, 0, "{what}");
                assert_eq!(metrics.arrived, 5, "{what}");
                assert!(metrics.contacts_lost >= 4, "{what}");
            }
        }
    }

    /// The same where most messages are lost, and where time is up before anything is agreed on.
    #[test]
    fn with_hardly_any_message_or_any_time_the_shield_keeps_all_apart() {
        let worse = [
            "network = { loss = 0.7, duplication = 0.2, max_delay_s = 0.02 }",
            "network = { loss = 0.2, latency_s = 0.02, deadline_s = 0.5 }",
        ];
        for (deployment, more) in [("team", worse[0]), ("pim", worse[0]), ("team", worse[1])] {
            let mut run = over_a_bad_network("default", deployment, more, 3);
            run.advance(60);
            let metrics = run.metrics();
            assert_eq!(metrics.losses_of_separation, 0, "{deployment}, {more}: {metrics:?}");
            assert!(metrics.deadlines_missed + metrics.contacts_lost > 0, "{more}: {metrics:?}");
        }
    }

    /// Delays that leave time for few questions only: a silent airplane is given up soon enough.
    #[test]
    fn a_silent_airplane_stops_nobody_where_messages_are_slow() {
        for deployment in ["team", "pim"] {
            let network = "network = { loss = 0.1, max_delay_s = 0.05, \
                           silent = [{ airplane = 1, from_s = 60.0 }] }";
            let mut run = over_a_bad_network("default", deployment, network, 1);
            run.advance(300);
            let metrics = run.metrics();
            assert_eq!((metrics.losses_of_separation, metrics.arrived), (0, 5), "{metrics:?}");
        }
    }

    /// Distributions of others mean nothing where their options are only presumed.
    #[test]
    fn agents_that_never_hear_a_model_do_not_mind_what_it_samples() {
        for seed in 1..4 {
            let more = "network = { loss = 0.9 }";
            let mut run = over_a_bad_network("paper", "compact-team", more, seed);
            run.advance(40);
            assert_eq!(run.metrics().losses_of_separation, 0);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        /// Whichever airplane falls silent, wherever and whenever, met before or not, and whichever
        /// enters later: all airplanes that had orbits apart when they entered stay apart.
        #[test]
        fn nobody_comes_near_a_silent_airplane(
            seed in any::<u32>(), n in 3usize..9, loss in 0.0f64..0.6, deployment in 0usize..2,
            silent in prop::collection::vec((0usize..9, 0.0f64..200.0), 0..3),
            appears_s in 0.0f64..100.0, x in -4000.0f64..4000.0,
        ) {
            let silent: Vec<String> = silent.iter()
                .map(|(k, from_s)| format!("{{ airplane = {}, from_s = {from_s:?} }}", k % n))
                .collect();
            let text = format!(
                "format = 1\nworld = \"airspace\"\nseed = {seed}\n[airspace]\nmethod = \"none\"\n\
                 deployment = \"{}\"\n\
                 network = {{ loss = {loss:?}, max_delay_s = 0.01, silent = [{}] }}\n\
                 [airspace.generator]\nkind = \"random\"\nn = {n}\nradius_m = 7000.0\n\
                 [[airplanes]]\nat_m = [{x}, 6000]\nheading_deg = -90\nappears_s = {appears_s:?}\n\
                 way_points_m = [[{x}, -6000]]\n",
                ["team", "pim"][deployment], silent.join(", "),
            );
            let mut run = airspace_run(&Source::new("s", text, ""), 1).expect("valid");
            run.advance(90);
            let metrics = run.metrics();
            let too_close = &metrics.too_close;
            prop_assert!(
                metrics.losses_of_separation == 0 || !too_close.is_empty(), "{metrics:?}"
            );
        }
    }

    /// Six of ten messages are lost, and as many answers: agents ask until they hear each other,
    /// because the deadlines leave time for that.
    #[test]
    fn heavy_losses_cost_questions_and_hardly_any_delay() {
        let text = "format = 1\nworld = \"airspace\"\nseed = 1\n[airspace]\ndeployment = \"team\"\n\
                    network = { loss = 0.6 }\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 10\n";
        let mut run = airspace_run(&Source::new("s", text, ""), 1).expect("a scenario");
        run.advance(100);
        let metrics = run.metrics();
        assert_eq!((metrics.losses_of_separation, metrics.arrived), (0, 10), "{metrics:?}");
        assert!(metrics.mean_delay_percent.is_some_and(|delay| delay < 20.0), "{metrics:?}");
    }

    /// Even and odd ids do not hear each other from 50 s on, and all arrive.
    #[test]
    fn in_a_partition_all_keep_apart_and_nobody_waits_for_ever() {
        let more = "network = { partitions = [{ from_s = 50.0, sides = [[0, 2, 4], [1, 3]] }] }";
        for (deployment, seed) in [("team", 1), ("team", 2), ("pim", 1)] {
            let mut run = over_a_bad_network("default", deployment, more, seed);
            run.advance(300);
            let metrics = run.metrics();
            assert_eq!((metrics.losses_of_separation, metrics.arrived), (0, 5), "{metrics:?}");
        }
    }

    /// A coordinator's state goes over one link after the other, and agents' messages over all at
    /// the same time.
    #[test]
    fn messages_take_time_by_their_size() {
        let network_s = |deployment: &str, bandwidth: &str| {
            let more = format!("shield = \"off\"\nnetwork = {{ {bandwidth} }}");
            let mut run = over_a_bad_network("paper", deployment, &more, 5);
            run.advance(3);
            run.metrics().network_s.expect("a network")
        };
        let [team, pim] = ["team", "pim"].map(|name| network_s(name, "bandwidth_bit_s = 1e8"));
        assert!(pim > 3.0 * team, "{pim} s, {team} s");
        assert!(pim > 1.5 * network_s("pim", ""), "{pim} s");
    }

    /// What all airplanes put on the air, signatures included, stays within the budget; what does not fit is counted, and
    /// costs time and not separation.
    #[test]
    fn a_radio_carries_no_more_than_its_budget_and_the_shield_keeps_all_apart() {
        for (deployment, budget_bytes_s) in [("compact-team", 8000.0), ("team", 2000.0)] {
            let network = format!("network = {{ budget_bytes_s = {budget_bytes_s} }}");
            let mut run = over_a_bad_network("default", deployment, &network, 1);
            run.advance(60);
            let metrics = run.metrics();
            let what = format!("{deployment}, {budget_bytes_s} bytes/s: {metrics:?}");
            let signatures = SIGNATURE_BYTES as u64 * metrics.multicasts;
            let on_air = (metrics.multicast_bytes + signatures) as f64;
            assert!(on_air <= budget_bytes_s * 60.0 * 5.0, "{what}");
            assert!(metrics.budget_dropped > 0, "{what}");
            assert_eq!(metrics.losses_of_separation, 0, "{what}");
        }
    }

    /// A radio of 31.5 kbit/s: what it defers, it carries in time, with the proposals of all.
    #[test]
    fn a_replica_team_of_ten_flies_on_a_slow_radio_as_on_one_without_a_limit() {
        let flown = |budget_bytes_s: &str| {
            let text = format!(
                "format = 1\nworld = \"airspace\"\nseed = 1\n[airspace]\ndeployment = \"replica-team\"\n\
                 network = {{ budget_bytes_s = {budget_bytes_s} }}\n\
                 [airspace.generator]\nkind = \"superconflict\"\nn = 10\n"
            );
            let mut run = airspace_run(&Source::new("s", text, ""), 1).expect("a scenario");
            run.advance(88);
            (run.metrics(), run.digest())
        };
        let (slow, digest) = flown("3937.0");
        let (fast, fast_digest) = flown("1e9");
        assert_eq!(digest, fast_digest);
        assert_eq!((slow.arrived, slow.budget_dropped, slow.losses_of_separation), (10, 0, 0));
        assert!(slow.budget_deferred > 0 && fast.budget_deferred == 0);
        assert_eq!(slow.multicasts, fast.multicasts);
    }

    /// A budget that is never spent defers messages by a tick or two, and changes no flight.
    #[test]
    fn with_a_budget_that_suffices_airplanes_fly_as_without_one() {
        let flown = |network: &str| {
            let mut run = over_a_bad_network("default", "compact-team", network, 1);
            run.advance(40);
            (run.metrics().budget_dropped, run.digest())
        };
        assert_eq!(flown("network = { budget_bytes_s = 1e9 }"), flown("network = {}"));
    }

    /// Without the shield, too, no agent waits forever; an airplane that is not heard flies on.
    #[test]
    fn without_the_shield_a_silent_airplane_stops_nobody() {
        for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
            let more = format!("shield = \"off\"\n{FAULTS}");
            let mut run = over_a_bad_network("default", deployment, &more, 1);
            run.advance(300);
            assert_eq!(run.metrics().arrived, 5, "{deployment}");
        }
    }

    #[test]
    fn a_network_needs_agents_that_use_it_and_sane_numbers() {
        let wrong = [
            ("direct", "loss = 0.1", "one process decides for all"),
            ("team", "loss = 1.5", "give 0 or more and less than 1"),
            ("team", "deadline_s = 4.0", "at most half of dt_s"),
            ("team", "silent = [{ airplane = 9 }]", "ids from 0 to 2"),
            ("team", "silent = [{ airplane = 1, from_s = 9, until_s = 3 }]", "end after the start"),
            ("team", "partitions = [{ sides = [[0, 1], [2, 3]] }]", "ids from 0 to 2"),
            ("team", "partitions = [{ sides = [[0, 1], [1, 2]] }]", "name each airplane once"),
            ("team", "partitions = [{ sides = [[0, 1]] }]", "at least two"),
            ("team", "partitions = [{ sides = [[0], [1]], from_s = nan }]", "end after the start"),
            ("team", "one_way = [{ sender = 1, receiver = 1 }]", "name each airplane once"),
            ("team", "bursts = { loss = 0.5, lasts_s = 0, every_s = 1 }", "a number above 0"),
            ("team", "range_m = -1", "a number above 0"),
            ("team", "bandwidth_bit_s = 0", "at least 1 bit/s"),
            ("team", "budget_bytes_s = 0", "a number above 0"),
            ("team", "budget_bytes_s = 100", "give more than 144 bytes/s"),
        ];
        for (deployment, network, cause) in wrong {
            let text = format!(
                "format = 1\nworld = \"airspace\"\n[airspace]\ndeployment = \"{deployment}\"\n\
                 [airspace.network]\n{network}\n\
                 [airspace.generator]\nkind = \"superconflict\"\nn = 3\n"
            );
            let error = airspace_run(&Source::new("s", text, ""), 1).expect_err("refused");
            assert!(error.to_string().contains(cause), "{error}");
        }
    }

    #[test]
    fn agents_that_sample_in_sequence_are_refused() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\npreset = \"paper\"\n\
                    order = \"sequence\"\ndeployment = \"team\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 3\n";
        let error = airspace_run(&Source::new("s", text, ""), 1).expect_err("refused");
        assert!(error.to_string().contains("parallel"), "{error}");
    }
}
