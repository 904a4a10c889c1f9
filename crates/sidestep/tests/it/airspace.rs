//! D1 for the airspace: the same build, scenario and seed give identical bits for 1, 2, 3 and 8
//! workers, recorded or not, resumed or not. L1 for airplanes: with the shield no two come
//! nearer than the separation, by any method, once the first fallbacks are apart.

use sidestep::kernel::ports::MemoryRecorder;
use sidestep::kernel::{Interrupt, Simulation};
use sidestep::scenario::Source;
use sidestep::worlds::airspace::{AirspaceRun, airspace_run};

/// Random traffic in which several groups form and part, with everything that can err.
pub(crate) fn traffic(more: &str) -> Source {
    let text = format!(
        "format = 1\nworld = \"airspace\"\nseed = 7\n[airspace]\n{more}\n\
         [airspace.generator]\nkind = \"random\"\nn = 24\nradius_m = 16000.0\n"
    );
    Source::new("traffic", text, "")
}

fn run(source: &Source, workers: usize) -> AirspaceRun {
    let mut run = airspace_run(source, workers).expect("a valid scenario");
    run.force_parallel();
    run
}

pub(crate) const ERRING: &str =
    "position_noise_m = 20.0\nheading_noise_deg = 1.0\nwind_m_s = [5.0, -3.0]";

/// No airplane avoids another, so that pairs lose their separation.
pub(crate) const LOSING: &str = "method = \"none\"\nshield = \"off\"";

#[test]
fn any_number_of_workers_gives_the_same_bits() {
    for more in [
        "",
        ERRING,
        "preset = \"paper\"\nmax_rounds = 20",
        "method = \"orca\"",
        "method = \"mvp\"",
        "method = \"bands\"",
    ] {
        let source = traffic(more);
        let mut alone = run(&source, 1);
        alone.advance(40);
        for workers in [2, 3, 8] {
            let mut team = run(&source, workers);
            team.advance(40);
            assert_eq!(team.digest(), alone.digest(), "{workers} workers, {more}");
            assert_eq!(
                team.collector().counters,
                alone.collector().counters,
                "{workers} workers, {more}"
            );
        }
    }
}

#[test]
fn a_resumed_or_recorded_run_gives_the_same_bits() {
    // MVP remembers conflicts from cycle to cycle.
    for more in [ERRING, "method = \"mvp\"\nshield = \"off\""] {
        resumed_and_recorded(&traffic(more));
    }
}

fn resumed_and_recorded(source: &Source) {
    let mut whole = run(source, 2);
    whole.advance(30);
    let mut first = run(source, 1);
    first.start_recording();
    first.advance(13);
    let mut recorder = MemoryRecorder::new(&first.schemas());
    first.record(&mut recorder).expect("memory has room");
    let mut second = run(source, 2);
    second.restore(&first.checkpoint()).expect("its own checkpoint");
    second.advance(17);
    assert_eq!(second.digest(), whole.digest());
    assert_eq!(second.collector().counters, whole.collector().counters);
}

/// Wherever this is run, the bits must be these (D3); a change needs a line in the CHANGELOG
/// (D4), and the lines that this prints in the file.
#[test]
fn the_golden_digests_of_the_super_conflict_are_what_every_machine_gets() {
    let digest = |preset: &str| {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\npreset = \"{preset}\"\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 8\n"
        );
        let mut run = run(&Source::new("golden", text, ""), 2);
        run.advance(60);
        format!("{preset} {}\n", run.digest())
    };
    let found = digest("default") + &digest("paper");
    assert_eq!(found, include_str!("golden/superconflict.txt"), "found:\n{found}");
}

#[test]
fn with_the_shield_no_method_loses_separation_and_everybody_arrives() {
    for method in ["pc", "orca", "mvp", "bands", "none"] {
        for (kind, n) in [("superconflict", 9), ("streams", 9), ("random", 12)] {
            let text = format!(
                "format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\nmethod = \"{method}\"\n\
                 wind_m_s = [4.0, 6.0]\n\
                 [airspace.generator]\nkind = \"{kind}\"\nn = {n}\n"
            );
            let mut run = run(&Source::new(kind, text, ""), 2);
            assert!(run.collector().counters.too_close.is_empty(), "{kind}");
            while run.cycle() < 1000 && !run.is_over() {
                run.advance(50);
            }
            let metrics = run.metrics();
            assert_eq!(metrics.losses_of_separation, 0, "{method}, {kind}");
            assert_eq!(metrics.arrived, metrics.airplanes, "{method}, {kind}");
        }
    }
}

#[test]
fn doing_nothing_loses_separation_and_says_so() {
    let text = "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"none\"\nshield = \"off\"\n\
                [airspace.generator]\nkind = \"superconflict\"\nn = 6\n";
    let mut run = run(&Source::new("s", text, ""), 1);
    run.advance(100);
    let metrics = run.metrics();
    assert_eq!(metrics.losses_of_separation, 15, "every pair meets once");
    assert!(metrics.min_separation_m.is_some_and(|d| d < 100.0) && metrics.lost_s > 10.0);
}

#[test]
fn streams_meet_where_they_merge() {
    let lost = |shield: &str| {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"none\"\nshield = \"{shield}\"\n\
             [airspace.generator]\nkind = \"streams\"\nn = 9\n"
        );
        let mut run = run(&Source::new("s", text, ""), 1);
        run.advance(150);
        run.metrics().losses_of_separation
    };
    // Three pairs at each of the three places.
    assert!(lost("off") >= 9, "{}", lost("off"));
    assert_eq!(lost("on"), 0);
}

/// Two that meet later than at the start, and may not take 20 kB then.
#[test]
fn a_group_too_large_for_memory_is_not_optimized_and_that_is_said() {
    let text = "format = 1\nworld = \"airspace\"\n[airspace]\ngroup_memory_gib = 0.00002\n\
                [airspace.generator]\nkind = \"superconflict\"\nn = 2\n";
    let mut run = run(&Source::new("s", text, ""), 1);
    run.advance(200);
    let metrics = run.metrics();
    assert!(metrics.groups_too_large > 0 && metrics.optimizations == 0, "{metrics:?}");
    assert_eq!((metrics.losses_of_separation, metrics.arrived), (0, 2));
}

#[test]
fn wrong_scenarios_are_refused_with_a_remedy() {
    let wrong = [
        ("[airplane]\nturns = 4\n", "odd"),
        ("[airplane]\nturns = 1\n", "odd"),
        ("[airplane]\nseparation_m = 0.0\n", "separation_m"),
        ("[airplane]\nv_m_s = -3.0\n", "v_m_s"),
        ("[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = []\n", "way-points"),
        ("[[airplanes]]\nat_m = [nan, 0]\nheading_deg = 0\nway_points_m = [[1, 1]]\n", "number"),
        ("[airspace]\nmethod = \"magic\"\n", "unknown"),
        (
            "[airspace]\ngroup_memory_gib = 0.0001\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 30\n",
            "30 airplanes near each other need",
        ),
        ("[airspace]\ndt_s = 5.0\ndtau_s = 2.0\n", "divides"),
        ("[airspace]\nmax_rounds = 0\n", "give 1 or more"),
        ("[airspace]\nestimator = { kind = \"sampled\", block = 0, ageing = 0.7 }\n", "1 to 10000"),
        (
            "[airspace]\nestimator = { kind = \"sampled\", block = 10001, ageing = 0.7 }\n",
            "1 to 10",
        ),
        (
            "[airspace]\nestimator = { kind = \"sampled\", block = 20, ageing = nan }\n",
            "from 0 to 1",
        ),
        (
            "[airspace]\nestimator = { kind = \"sampled\", block = 20, ageing = 1.5 }\n",
            "from 0 to 1",
        ),
        ("[airspace]\nupdate = { kind = \"brouwer\", step = nan }\n", "above 0 and at most 1"),
        ("[airspace]\nupdate = { kind = \"nearest-newton\", step = 0.0 }\n", "above 0 and at most"),
        ("[airspace]\nposition_noise_m = 1e300\n", "give 0 to 1e6"),
        ("[airspace]\nheading_noise_deg = 1e300\n", "nothing is left of a heading"),
        ("[airspace]\ndt_s = 1e12\ndtau_s = 1e12\n", "one decision per hour"),
        ("[airspace]\ndt_s = 3600\n", "up to 1000"),
        ("[airspace]\ndt_s = 1e-9\ndtau_s = 1e-9\n", "0.01 to 3600 s"),
        ("[airspace]\nhorizon = 60\ndtau_s = 5.0\n", "write horizon_s = 300.0"),
        ("[airspace]\nhorizon_s = 4.0\n", "at least dt_s = 5"),
        ("[airspace]\nhorizon_s = 1e300\n", "predictions are limited to one day"),
        ("[airspace]\nhorizon_s = 20000\n", "10000 steps"),
        ("[airspace]\ntolerance_m = 1e300\n", "0.001 to 1e6 m"),
        ("[airspace]\nalpha = 1e300\n", "1e-12 to 1e6"),
        ("[airspace]\nbeta = 1e-300\n", "0.001 to 1"),
        ("[airspace]\ninflation = 1e9\n", "0.1 to 10"),
        ("[airspace]\ncooling = 1e-300\n", "0.01 to 1"),
        ("[airspace]\nvertical_m = 1e-7\n", "1 to 1e9 m"),
        ("[airspace]\ngroup_memory_gib = 1e300\n", "1e-6 to 1024 GiB"),
        ("[airspace]\nholds_s = [1e300]\n", "0.001 to 86400 s"),
        ("[airspace]\nlegs = { turns_s = [90.0], until_s = [60.0] }\n", "ends after 60 s"),
        ("[airspace]\nlegs = { turns_s = [9.0] }\n", "give both"),
        ("[airspace]\nutility = \"private\"\n", "expectations are exact"),
        (
            "[airplane]\nturns = 99\n[airspace]\nhorizon_s = 9000\nholds_s = [1, 2, 3]\n",
            "steps to compare all of two airplanes",
        ),
        (
            "[airspace]\ndeployment = \"team\"\n\
             network = { silent = [{ airplane = 1, from_s = 9, until_s = 3 }] }\n",
            "the end after the start",
        ),
        (
            "[[airplanes]]\ntrack = [[0, 0, 0, 0], [1e-9, 1000, 0, 0], [9, 0, 0, 0]]\n",
            "faster than 1e6 m/s",
        ),
        (
            "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9, 9]]\n\
             intruder = true\nnon_cooperative = true\n",
            "earlier name of `non_cooperative`",
        ),
        ("[airspace]\nshield = false\n", "give \"on\" or \"off\""),
        ("[airspace]\npreset = \"paper\"\nmax_rounds = 4000000000\n", "up to 10000"),
        (
            "[airspace]\npreset = \"paper\"\norder = \"sequence\"\nmax_rounds = 4000\n",
            "order = \"parallel\"",
        ),
        ("[airplane]\nomega_max_deg_s = 1e-9\n", "0.001 to 360"),
        ("[airplane]\nomega_max_deg_s = 400.0\n", "0.001 to 360"),
        ("[airplane]\nv_m_s = inf\n", "0.001 to 1e6 m/s"),
        ("[airplane]\nv_m_s = 1e7\n", "0.001 to 1e6 m/s"),
        ("[airspace]\nwind_m_s = [40.0, 0.0]\n", "wind"),
        ("[airspace.generator]\nkind = \"random\"\nn = 500\nradius_m = 3000.0\n", "no place"),
        ("", "no airplanes"),
    ];
    for (section, cause) in wrong {
        let mut text = format!("format = 1\nworld = \"airspace\"\n{section}");
        if !section.contains("airplanes]") && !section.contains("generator") && !section.is_empty()
        {
            text.push_str("[airspace.generator]\nkind = \"superconflict\"\nn = 3\n");
        }
        let error = airspace_run(&Source::new("w.toml", text, ""), 1).expect_err(section);
        assert!(error.to_string().contains(cause), "{section}: {error}");
    }
}

/// Counts looks instead of time: between two of them lies at most the work of one pair of airplanes, or
/// of one player, with a size that the scenario's bounds limit.
#[test]
fn no_cycle_of_many_airplanes_works_long_without_a_look_at_the_interrupt() {
    let looks = |n: u64, more: &str| {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\n{more}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = {n}\n"
        );
        let mut run = run(&Source::new("s", text, ""), 1);
        let interrupt = Interrupt::default();
        run.set_interrupt(interrupt.clone());
        run.advance(1);
        interrupt.total_checks()
    };
    let team = "deployment = \"compact-team\"";
    for more in ["", "shield = \"off\"", team, "preset = \"paper\""] {
        for n in [10, 20] {
            let (pairs, found) = (n * (n - 1) / 2, looks(n, more));
            assert!(found >= pairs, "{more}, {n} airplanes: {found} looks, {pairs} pairs");
        }
    }
}

/// Counts looks, of which there is one for each comparison and each step that is flown in advance.
#[test]
fn starting_up_takes_nearly_linear_work() {
    let looks = |n: u32| {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"random\"\nn = {n}\n"
        );
        let interrupt = Interrupt::default();
        let heeded = interrupt.attach();
        let started = run(&Source::new("s", text, ""), 1);
        drop(heeded);
        assert_eq!(started.agent_count(), n as usize);
        interrupt.total_checks() as f64
    };
    // Four times as many may take eight times the work; the square would be sixteen.
    let ratio = looks(1600) / looks(400);
    assert!((3.0..8.0).contains(&ratio), "{ratio}");
}
