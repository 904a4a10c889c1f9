//! Groups that are heard, beside groups that are announced: the same where nothing is lost, and safe where
//! airplanes disagree.

use super::outage_tests::RandomScenario;
use crate::metrics::Metrics;
use crate::shield::guarantee_tests::lost_and_named;
use crate::{AirspaceRun, airspace_run};
use proptest::prelude::*;
use sidestep_kernel::{Digest, Simulation};
use sidestep_scenario::Source;

fn run(text: &str, more: &str) -> AirspaceRun {
    let text = text.replacen("[airspace]\n", &format!("[airspace]\n{more}\n"), 1);
    airspace_run(&Source::new("heard", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

/// Flies a scenario with groups announced and with groups heard. Returns the digests and the metrics.
fn both(text: &str, cycles: u64) -> [(Digest, Metrics); 2] {
    ["announced", "heard"].map(|groups| {
        let mut run = run(text, &format!("groups = \"{groups}\""));
        run.advance(cycles);
        (run.digest(), run.metrics())
    })
}

/// Checks that a scenario is flown alike, however groups are found.
fn is_alike(text: &str, cycles: u64) {
    let [(announced_digest, announced), (heard_digest, heard)] = both(text, cycles);
    assert_eq!(heard_digest, announced_digest, "{text}");
    assert_eq!(
        (heard.messages, heard.bytes, heard.rounds_mean),
        (announced.messages, announced.bytes, announced.rounds_mean)
    );
    assert_eq!(announced.beacons, 0);
    assert!(heard.beacons > 0 && heard.beacon_bytes > 0, "{heard:?}");
}

/// Streams that meet: long groups, in which hardly any airplane sees all.
const STREAMS: &str = "[airspace.generator]\nkind = \"streams\"\nn = 12\n";
const CONFLICT: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 5\nradius_m = 3000.0\n";
/// Intruders, the same of which may be seen by two airplanes that do not see each other, and an
/// airplane that comes in late.
const NON_COOPERATIVE: &str = "[airspace.generator]\nkind = \"random\"\nn = 8\nradius_m = 16000.0\n\
    [[airplanes]]\nat_m = [-9000, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\nintruder = true\n\
    [[airplanes]]\nat_m = [0, 9000]\nheading_deg = -90\nway_points_m = [[0, -9000]]\nintruder = true\n\
    [[airplanes]]\nat_m = [12000, 0]\nheading_deg = 180\nway_points_m = [[-9000, 0]]\nappears_s = 40.0\n";

fn scenario(airspace: &str, airplanes: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nseed = 5\n[airspace]\n{airspace}\nmax_rounds = 12\n{airplanes}"
    )
}

#[test]
fn every_deployment_decides_alike_whether_groups_are_heard_or_announced() {
    for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
        for airplanes in [CONFLICT, NON_COOPERATIVE] {
            let deployment = format!("deployment = \"{deployment}\"");
            is_alike(&scenario(&deployment, airplanes), 12);
        }
    }
    is_alike(&scenario("deployment = \"compact-team\"\npreset = \"paper\"", CONFLICT), 12);
    is_alike(&scenario("deployment = \"team\"", STREAMS), 12);
}

#[test]
fn scenarios_that_are_shipped_are_flown_alike() {
    let shipped = [
        include_str!("../default.toml"),
        include_str!("../../../../../scenarios/airspace/superconflict.toml"),
        include_str!("../../../../papers/scenarios/agentfly/superconflict.toml"),
    ];
    for text in shipped {
        let digest = |groups: &str| {
            let keys = ["airspace.deployment=compact-team", &format!("airspace.groups={groups}")];
            let source = Source::new("shipped", text, "").with_overrides(&keys.map(String::from));
            let mut run = airspace_run(&source.expect("right"), 1).expect("a scenario");
            run.advance(12);
            run.digest()
        };
        assert_eq!(digest("heard"), digest("announced"), "{text}");
    }
}

#[test]
fn one_process_that_decides_for_all_hears_nobody() {
    let text = scenario("groups = \"heard\"", CONFLICT);
    let error = airspace_run(&Source::new("s", text, ""), 1).expect_err("refused");
    assert!(error.to_string().contains("set deployment to team"), "{error}");
}

#[test]
fn every_method_decides_alike_whether_groups_are_heard_or_announced() {
    for method in ["mvp", "orca", "bands", "none"] {
        is_alike(
            &scenario(&format!("deployment = \"team\"\nmethod = \"{method}\""), NON_COOPERATIVE),
            20,
        );
    }
}

/// Flights as fast as scenarios allow: a filed one, and a glitch of a recording in a wind.
const FAST: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 5000.0\n\
    [[airplanes]]\nat_m = [0, -4000]\nheading_deg = 90\nway_points_m = [[0, 5e8]]\nv_m_s = 1e6\nintruder = true\n\
    [[airplanes]]\ntrack = [[0, 0, -4000, 0], [10, 0, -3000, 0], [11, 999995, -3000, 0], [12, 0, -2800, 0], [90, 0, 5000, 0]]\n";

#[test]
fn intruders_of_any_speed_that_a_scenario_allows_are_heard_of() {
    for wind in ["", "wind_m_s = [-20, 10]\n"] {
        for network in ["", "network = { duplication = 0.3 }\n"] {
            let scenario = scenario(&format!("deployment = \"team\"\n{wind}{network}"), FAST);
            let mut run = run(&scenario, "groups = \"heard\"");
            run.advance(4);
            let metrics = run.metrics();
            assert_eq!((metrics.contacts_lost, metrics.deadlines_missed), (0, 0), "{metrics:?}");
        }
        is_alike(&scenario(&format!("deployment = \"team\"\n{wind}"), FAST), 4);
    }
}

/// A network that may lose messages, and loses none: airplanes report those that they hear.
#[test]
fn who_loses_nothing_and_cannot_know_it_finds_the_same_group() {
    let network =
        "deployment = \"compact-team\"\nnetwork = { duplication = 0.3, max_delay_s = 0.004 }";
    for airplanes in [CONFLICT, NON_COOPERATIVE, STREAMS] {
        let [(_, announced), (_, heard)] = both(&scenario(network, airplanes), 15);
        assert_eq!((heard.contacts_lost, heard.deadlines_missed), (0, 0), "{heard:?}");
        let flown =
            |m: &Metrics| (m.min_separation_m, m.shield_overrides, m.rounds_mean, m.arrived);
        assert_eq!(flown(&heard), flown(&announced));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10))]

    #[test]
    fn random_traffic_is_flown_alike(
        seed in any::<u32>(), n in 2usize..14, radius_m in 4000.0f64..25_000.0,
        deployment in prop::sample::select(vec!["team", "compact-team", "pim"]),
        intruder in prop::option::of(-8000.0f64..8000.0),
    ) {
        let airplanes = intruder.map_or(String::new(), |x| format!(
            "[[airplanes]]\nat_m = [{x}, 9000]\nheading_deg = -90\nway_points_m = [[{x}, -9000]]\n\
             intruder = true\n"
        ));
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = {seed}\n[airspace]\ndeployment = \"{deployment}\"\n\
             max_rounds = 8\n[airspace.generator]\nkind = \"random\"\nn = {n}\nradius_m = {radius_m}\n\
             {airplanes}"
        );
        // A small circle has no room for many airplanes.
        let found = airspace_run(&Source::new("heard", text.as_str(), ""), 1);
        prop_assume!(!found.is_err_and(|error| error.cause().starts_with("no place is left")));
        let [(announced, _), (heard, _)] = both(&text, 10);
        prop_assert_eq!(heard, announced);
    }
}

/// Airplane 0 and airplane 1 do not hear each other, and both hear airplane 2.
#[test]
fn two_that_do_not_hear_each_other_are_in_one_group_by_way_of_one_that_hears_both() {
    let three = "[airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 4000.0\n";
    let flown = |sides: &str| {
        let cut = format!("network = {{ partitions = [{{ sides = {sides} }}] }}");
        let text = scenario(&format!("deployment = \"compact-team\"\n{cut}"), three);
        let mut run = run(&text, "groups = \"heard\"");
        run.advance(250);
        let metrics = run.metrics();
        assert_eq!((metrics.losses_of_separation, metrics.arrived), (0, 3), "{sides}: {metrics:?}");
        metrics.mean_delay_percent.expect("all arrive")
    };
    let joined = flown("[[0], [1]]");
    let alone = flown("[[0], [1], [2]]");
    assert!(joined < 0.6 * alone, "{joined} %, {alone} % where no two hear each other");
}

/// Flies a scenario of faults of [`RandomScenario`] by groups that are heard. Returns the pairs that lose separation
/// without being named, if there are any.
fn fault(seed: u64) -> Option<String> {
    let text = RandomScenario::new(seed).text();
    let mut run = run(&text, "groups = \"heard\"");
    run.advance(60);
    let (lost, named) = lost_and_named(&run);
    (!lost.is_subset(&named))
        .then(|| format!("seed {seed}: {lost:?} lost, {named:?} named\n{text}"))
}

fn nobody_is_lost(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        if let Some(fault) = fault(seed) {
            panic!("{fault}");
        }
        if seed % 500 == 0 {
            println!("nobody is lost up to seed {seed}");
        }
    }
}

#[test]
fn airplanes_that_disagree_about_their_group_stay_apart() {
    nobody_is_lost(0..12);
}

#[test]
#[ignore = "minutes of processor time; 10,000 scenarios with the other half"]
fn airplanes_that_disagree_about_their_group_stay_apart_in_5_000_scenarios() {
    nobody_is_lost(12..5_012);
}

#[test]
#[ignore = "minutes of processor time; 10,000 scenarios with the other half"]
fn airplanes_that_disagree_about_their_group_stay_apart_in_5_000_more_scenarios() {
    nobody_is_lost(5_012..10_012);
}

/// The figures of the README: delay and traffic over several networks, beside groups that are announced.
#[test]
#[ignore = "prints a table of means over 20 seeds; minutes of processor time"]
fn the_cost_of_hearing_is_measured() {
    let networks = [
        ("nothing is lost", "{}"),
        ("loss 0.1", "{ loss = 0.1 }"),
        ("loss 0.5", "{ loss = 0.5 }"),
        ("two halves", "{ partitions = [{ sides = [[0, 2, 4, 6], [1, 3, 5, 7]] }] }"),
        (
            "two halves for 60 s",
            "{ partitions = [{ from_s = 60, until_s = 120, sides = [[0, 2, 4, 6], [1, 3, 5, 7]] }] }",
        ),
        (
            "four one-way links",
            "{ one_way = [{ sender = 0, receiver = 3 }, { sender = 1, receiver = 4 }, { sender = 2, receiver = 5 }, { sender = 3, receiver = 6 }] }",
        ),
        ("range 3 km", "{ range_m = 3000.0 }"),
    ];
    for (name, network) in networks {
        for groups in ["announced", "heard"] {
            let (mut delays, mut lost, mut bytes, mut beacons, mut arrived) = (0.0, 0, 0, 0, 0);
            for seed in 1..=20 {
                let text = format!(
                    "format = 1\nworld = \"airspace\"\nseed = {seed}\n[airspace]\ngroups = \"{groups}\"\n\
                     deployment = \"compact-team\"\nnetwork = {network}\n\
                     [airspace.generator]\nkind = \"superconflict\"\nn = 8\n"
                );
                let mut run = airspace_run(&Source::new("cost", text, ""), 1).expect("valid");
                run.advance(400);
                let metrics = run.metrics();
                delays += metrics.mean_delay_percent.unwrap_or(f64::NAN) / 20.0;
                lost += metrics.losses_of_separation;
                arrived += metrics.arrived;
                (bytes, beacons) =
                    (bytes + metrics.bytes / 20, beacons + metrics.beacon_bytes / 20);
            }
            println!(
                "{name}, {groups}: delay {delays:.2} %, {lost} losses, {arrived} of 160 arrived, \
                 {bytes} B, beacons {beacons} B"
            );
        }
    }
}
