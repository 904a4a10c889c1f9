//! Levels and speeds that agents choose and command: the same bits in every deployment, and the promise of the shield over
//! networks that lose messages.

use crate::AirspaceRun;
use crate::act::command_tests::{AtRandom, by_mvp, meeting, run, run_own};
use crate::act::performance_tests::mixed_crowd;
use crate::metrics::Metrics;
use crate::shield::guarantee_tests::{crowd, lost_and_named, plane};
use proptest::prelude::*;
use sidestep_kernel::{Digest, Simulation};

/// Number of cases of the long test.
const MANY: u32 = 4000;
const AGENTS: [&str; 5] = ["team", "compact-team", "replica-team", "pim", "hierarchical-pim"];

/// Four that meet on one level, of which one is ordered to another level and speed in flight.
fn crossing(keys: &str) -> String {
    let level = "altitude_m = 1000.0";
    let ordered = "altitude_m = 1000.0\norders = [{ at_s = 25.0, altitude_m = 1100.0, climb_m_s = 4.0 }, \
                   { at_s = 30.0, speed_m_s = 38.0 }]";
    let changes = format!("[airplane]\nturns = 3\nacceleration_m_s2 = 0.8\n{keys}\n");
    changes
        + &plane([-2600.0, 0.0], 0.0, [4000.0, 0.0], level)
        + &plane([0.0, -2600.0], 90.0, [0.0, 4000.0], ordered)
        + &plane([2600.0, 50.0], 180.0, [-4000.0, 50.0], level)
        + &plane([50.0, 2600.0], -90.0, [50.0, -4000.0], level)
}

/// Flies some cycles, and returns how the run has come out and the largest difference from the level of the start in meters.
fn flown(mut run: AirspaceRun, cycles: u64) -> (Digest, Metrics, f64) {
    let start_m: Vec<f64> = altitudes_m(&run);
    let mut farthest_m: f64 = 0.0;
    for _ in 0..cycles {
        run.advance(1);
        let changes = altitudes_m(&run).into_iter().zip(&start_m);
        farthest_m = changes.fold(farthest_m, |most, (now, start)| most.max((now - start).abs()));
    }
    (run.digest(), run.metrics(), farthest_m)
}

fn altitudes_m(run: &AirspaceRun) -> Vec<f64> {
    run.state().airplanes.iter().map(|one| one.altitude_m.get()).collect()
}

#[test]
fn every_deployment_chooses_the_same_tuples_of_turns_levels_and_speeds_bit_for_bit() {
    let keys = "level_changes_m = [-160.0, 160.0]\nspeed_changes_m_s = [-5.0]";
    let paper = "preset = \"paper\"\nmax_rounds = 8\ncombinations = \"none\"";
    let parallel = "order = \"parallel\"\nmax_rounds = 10\ncombinations = \"all\"";
    for settings in ["max_rounds = 10", parallel, paper] {
        let fly = |deployment: &str| {
            let airspace = format!(
                "deployment = \"{deployment}\"\nvertical_m = 150.0\nlevel_weight = 0.01\n{settings}"
            );
            flown(run(&airspace, &crossing(keys)), 14)
        };
        let (direct, alone, farthest_m) = fly("direct");
        assert!(farthest_m > 60.0, "{settings}: {farthest_m}");
        for deployment in AGENTS {
            let (digest, metrics, _) = fly(deployment);
            assert_eq!(digest, direct, "{deployment} {settings}");
            assert_eq!(metrics.rounds_mean, alone.rounds_mean, "{deployment} {settings}");
        }
    }
}

#[test]
fn every_deployment_flies_what_reactive_methods_command_bit_for_bit() {
    for resolution in ["vertical", "speed", "heading-speed-vertical"] {
        let (direct, alone, _) = flown(run(&by_mvp(resolution, ""), &meeting()), 30);
        let heard = "groups = \"heard\"\ndeployment = \"team\"";
        let agents = AGENTS.map(|deployment| format!("deployment = \"{deployment}\""));
        for airspace in agents.iter().map(String::as_str).chain([heard]) {
            let (digest, metrics, _) = flown(run(&by_mvp(resolution, airspace), &meeting()), 30);
            assert_eq!(digest, direct, "{airspace} {resolution}");
            assert_eq!(metrics.commands_held, alone.commands_held, "{airspace} {resolution}");
        }
    }
    let (direct, ..) = flown(run_own(AtRandom, "", &meeting()), 40);
    for deployment in ["team", "pim"] {
        let airspace = format!("deployment = \"{deployment}\"");
        let (digest, ..) = flown(run_own(AtRandom, &airspace, &meeting()), 40);
        assert_eq!(digest, direct, "{deployment}");
    }
}

#[test]
fn messages_of_flights_that_command_nothing_at_the_time_are_no_longer() {
    let airspace =
        |resolution: &str| by_mvp(resolution, "deployment = \"team\"\nnetwork = { loss = 0.1 }");
    // All fly side by side, so that there is nothing to resolve.
    let beside: String = (0..3)
        .map(|k| plane([0.0, 2000.0 * f64::from(k)], 0.0, [9000.0, 2000.0 * f64::from(k)], ""))
        .collect();
    let [turning, climbing] =
        ["heading", "vertical"].map(|resolution| flown(run(&airspace(resolution), &beside), 10).1);
    assert!(turning.bytes > 0);
    assert_eq!((turning.messages, turning.bytes), (climbing.messages, climbing.bytes));
}

#[test]
fn where_nobody_talks_levels_and_speeds_are_seen_and_all_are_kept_apart() {
    let silent = "network = { silent = [{ airplane = 0 }, { airplane = 1 }, { airplane = 2 }, { airplane = 3 }] }";
    for deployment in ["team", "pim"] {
        let agents = format!("deployment = \"{deployment}\"\n{silent}");
        for resolution in ["vertical", "heading-speed-vertical"] {
            let (_, metrics, _) = flown(run(&by_mvp(resolution, &agents), &meeting()), 90);
            assert_eq!(metrics.losses_of_separation, 0, "{agents} {resolution}");
        }
        let airspace =
            format!("vertical_m = 150.0\nlevel_weight = 0.01\nmax_rounds = 20\n{agents}");
        let keys = "level_changes_m = [-160.0, 160.0]\nspeed_changes_m_s = [-5.0, 5.0]";
        let unordered = crossing(keys).replace("orders = [", "# orders = [");
        let (_, metrics, _) = flown(run(&airspace, &unordered), 300);
        assert_eq!((metrics.losses_of_separation, metrics.arrived), (0, 4), "{agents}");
    }
}

/// A network with every kind of fault.
fn network() -> impl Strategy<Value = String> {
    let silent = prop::collection::vec((0u32..2, 0.0f64..200.0), 0..3);
    (0.0f64..0.8, 0.0f64..0.02, silent, any::<bool>()).prop_map(
        |(loss, max_delay_s, silent, is_one_way)| {
            let silent: Vec<String> = silent
                .iter()
                .map(|(id, from_s)| {
                    let until_s = from_s + 120.0;
                    format!("{{ airplane = {id}, from_s = {from_s:?}, until_s = {until_s:?} }}")
                })
                .collect();
            let one_way = if is_one_way { "{ sender = 0, receiver = 1 }" } else { "" };
            format!(
                "network = {{ loss = {loss:?}, max_delay_s = {max_delay_s:?}, silent = [{}], \
                 one_way = [{one_way}] }}",
                silent.join(", ")
            )
        },
    )
}

/// Airplanes whose orders, which are refused over a network where they change speeds or levels, are left out.
fn crowd_without_orders() -> impl Strategy<Value = String> {
    let airplanes = prop_oneof![crowd(), mixed_crowd()];
    airplanes.prop_map(|airplanes| airplanes.replace("orders = [", "# orders = ["))
}

fn agents() -> impl Strategy<Value = String> {
    let deployment = prop::sample::select(&AGENTS[..]);
    let groups = prop::sample::select(vec!["announced", "heard"]);
    let noise = prop::sample::select(vec!["", "position_noise_m = 5.0\n"]);
    (deployment, groups, noise, network()).prop_map(|(deployment, groups, noise, network)| {
        format!("deployment = \"{deployment}\"\ngroups = \"{groups}\"\n{noise}{network}")
    })
}

/// Flies airplanes whose levels and speeds are commanded over a network: at random, by MVP, or as tuples.
fn only_named_pairs_lose(kind: &str, agents: &str, airplanes: &str) -> Result<(), TestCaseError> {
    let mut run = match kind {
        "random" => run_own(AtRandom, agents, airplanes),
        "tuples" => {
            let airspace = format!("level_weight = 0.1\nmax_rounds = 10\n{agents}");
            let changes = "[airplane]\nturns = 3\nlevel_changes_m = [-310.0, 150.0]\n\
                           speed_changes_m_s = [-2.0, 6.0]\nacceleration_m_s2 = 0.8\n";
            run(&airspace, &format!("{changes}{airplanes}"))
        }
        resolution => run(&by_mvp(resolution, agents), airplanes),
    };
    run.advance(100);
    let (lost, named) = lost_and_named(&run);
    prop_assert!(
        lost.is_subset(&named),
        "{lost:?} but only {named:?} were named\n{kind}\n{agents}\n{airplanes}"
    );
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn no_pair_that_is_not_named_loses_separation_by_commands_over_a_network_that_loses_messages(
        airplanes in crowd_without_orders(), agents in agents(),
    ) {
        only_named_pairs_lose("random", &agents, &airplanes)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(MANY))]

    #[test]
    #[ignore = "thousands of runs: minutes"]
    fn no_pair_that_is_not_named_loses_by_commands_over_a_network_in_thousands_of_runs(
        airplanes in crowd_without_orders(), agents in agents(),
        kind in prop::sample::select(
            &["random", "random", "vertical", "speed", "heading-speed-vertical", "tuples"][..]
        ),
    ) {
        only_named_pairs_lose(kind, &agents, &airplanes)?;
    }
}
