//! Airplanes that were recorded, are given orders on their way, or appear later: replayed,
//! flown, and kept apart, to the same bits for any number of workers.

use proptest::prelude::*;
use sidestep::import::{bluesky, traffic};
use sidestep::kernel::Simulation;
use sidestep::scenario::Source;
use sidestep::worlds::airspace::traffic::{from_bluesky, from_tracks};
use sidestep::worlds::airspace::{AirspaceRun, airspace_run};
use sidestep_testing::shared_data as shared;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

fn scenario(airspace: &str, airplanes: &str) -> Source {
    let text = format!("format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n{airplanes}");
    Source::new("traffic", text, "")
}

fn run(source: &Source, workers: usize) -> AirspaceRun {
    let mut run = airspace_run(source, workers).expect("a valid scenario");
    run.force_parallel();
    run
}

fn plane(at: [f64; 2], heading_deg: f64, goal: [f64; 2], more: &str) -> String {
    format!(
        "[[airplanes]]\nat_m = {at:?}\nheading_deg = {heading_deg:?}\nway_points_m = [{goal:?}]\n{more}\n"
    )
}

/// Recorded airplanes that meet in the middle at 100 s, 1000 m per step of 10 s.
fn two_tracks() -> String {
    let row = |k: i32, sign: f64| {
        format!("[{}, {:?}, 0.0, 3000.0]", 10 * k, sign * 1000.0 * (f64::from(k) - 10.0))
    };
    let track = |sign: f64| {
        let rows: Vec<String> = (0..=20).map(|k| row(k, sign)).collect();
        format!("[[airplanes]]\ntrack = [{}]\n", rows.join(", "))
    };
    track(1.0) + &track(-1.0)
}

#[test]
fn recorded_airplanes_fly_exactly_where_they_were_and_their_losses_are_counted() {
    let mut run = run(&scenario("", &two_tracks()), 1);
    assert!(run.collector().counters.too_close.is_empty());
    for cycle in 1..=40_u32 {
        run.advance(1);
        let x_m = (200.0 * 0.5 * f64::from(cycle)).mul_add(5.0, -10_000.0);
        let found = run.snapshot().0.airplanes.iter().map(|a| a.pose.at).collect::<Vec<_>>();
        assert!((found[0][0] - x_m).abs() < 1e-6 && (found[1][0] + x_m).abs() < 1e-6, "{found:?}");
    }
    let metrics = run.metrics();
    assert!(run.is_over());
    assert_eq!((metrics.arrived, metrics.replayed, metrics.losses_of_separation), (2, 2, 1));
    // Closing in with 200 m/s, they are nearer than 500 m for 5 s.
    assert!((metrics.lost_s - 5.0).abs() < 0.3, "{}", metrics.lost_s);
    assert!(metrics.min_separation_m.is_some_and(|d| d < 1e-6));
    assert_eq!((metrics.mean_delay_percent, metrics.shield_overrides), (None, 0));
    assert_eq!(metrics.optimizations, 0, "nobody decides for them");
}

#[test]
fn from_the_hand_over_on_recorded_airplanes_are_kept_apart_and_arrive() {
    for until_s in ["0", "33.0"] {
        let mut run = run(&scenario(&format!("replay_until_s = {until_s}"), &two_tracks()), 1);
        while !run.is_over() && run.cycle() < 400 {
            run.advance(1);
        }
        let metrics = run.metrics();
        assert_eq!((metrics.losses_of_separation, metrics.arrived, metrics.replayed), (0, 2, 0));
        assert!(metrics.too_close.is_empty());
        assert!(
            metrics.mean_delay_percent.is_some_and(|d| (0.0..50.0).contains(&d)),
            "{metrics:?}"
        );
    }
}

#[test]
fn pairs_that_are_too_close_at_the_hand_over_are_told() {
    // 600 m apart and closing in, no orbit is apart from the other's.
    let mut run = run(&scenario("replay_until_s = 97.0", &two_tracks()), 1);
    run.advance(40);
    let too_close = run.metrics().too_close;
    assert_eq!(too_close.len(), 1);
    assert_eq!((too_close[0].at_s, too_close[0].airplanes), (100.0, [0, 1]));
}

#[test]
fn levels_of_recorded_airplanes_count_as_they_were_at_the_time() {
    // One climbs through the level of the other, long before or just when it is there.
    let track = |altitude: [f64; 3]| {
        let [a, b, c] = altitude;
        format!(
            "[[airplanes]]\ntrack = [[0.0, -1e4, 0.0, 3000.0], [200.0, 1e4, 0.0, 3000.0]]\n\
             [[airplanes]]\ntrack = [[0.0, 1e4, 0.0, {a:?}], [100.0, 0.0, 0.0, {b:?}], \
             [200.0, -1e4, 0.0, {c:?}]]\n"
        )
    };
    for (altitude, losses) in [([3000.0, 3400.0, 3000.0], 0), ([2000.0, 3000.0, 4000.0], 1)] {
        let mut run = run(&scenario("", &track(altitude)), 1);
        run.advance(50);
        assert_eq!(run.metrics().losses_of_separation, losses, "{altitude:?}");
    }
}

#[test]
fn orders_are_carried_out_at_their_times() {
    let orders = "orders = [\n{ at_s = 20.0, heading_deg = 90.0 },\n{ at_s = 100.0, speed_m_s = 70.0 },\n\
                  { at_s = 120.0, altitude_m = 100.0, climb_m_s = 2.0 },\n\
                  { at_s = 200.0, proceeds = true },\n{ at_s = 900.0, leaves = true }]";
    let mut run = run(&scenario("", &plane([0.0, 0.0], 0.0, [1e6, 0.0], orders)), 1);
    let now = |run: &AirspaceRun| run.snapshot().0.airplanes[0];
    run.advance(4);
    assert!((now(&run).pose.at[0] - 700.0).abs() < 1e-6);
    run.advance(16);
    let turned = now(&run);
    assert!((turned.pose.heading_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{turned:?}");
    run.advance(4);
    let faster = now(&run);
    assert!((faster.pose.at[1] - turned.pose.at[1] - 1400.0).abs() < 1e-3, "{faster:?}");
    run.advance(6);
    assert!((now(&run).altitude_m - 60.0).abs() < 1e-9);
    run.advance(6);
    assert!((now(&run).altitude_m - 100.0).abs() < 1e-9);
    run.advance(40);
    assert!(now(&run).pose.heading_rad.abs() < 0.05, "to the way-point again");
    run.advance(400);
    let metrics = run.metrics();
    assert!(run.is_over());
    assert_eq!(
        (metrics.left, metrics.arrived, metrics.orders, metrics.orders_delayed),
        (1, 0, 4, 0)
    );
    assert_eq!(metrics.mean_delay_percent, None);
}

#[test]
fn a_new_route_replaces_the_old_one() {
    let orders = "orders = [{ at_s = 50.0, way_points_m = [[2000.0, 3000.0]] }]";
    let mut run = run(&scenario("", &plane([0.0, 0.0], 0.0, [1e6, 0.0], orders)), 1);
    run.advance(200);
    assert!(run.is_over());
    let at = run.snapshot().0.airplanes[0].pose.at;
    assert!((at[0] - 2000.0).hypot(at[1] - 3000.0) < 200.0, "{at:?}");
}

/// With the shield an order waits as long as it would take the fallback away; without, it does not.
#[test]
fn an_order_that_would_take_the_fallback_away_waits() {
    // A row ahead, too dense to turn in front of it or to pass through it.
    let beside = |y: f64| plane([1500.0, y], 0.0, [40_000.0, y], "omega_max_deg_s = 6.0");
    let told = "orders = [{ at_s = 10.0, speed_m_s = 140.0 }]";
    let row: String = (-4..=4).map(|k| beside(800.0 * f64::from(k))).collect();
    let all = row + &plane([0.0, 0.0], 0.0, [40_000.0, 0.0], told);
    let delayed = |shield: &str| {
        let mut run = run(&scenario(&format!("shield = \"{shield}\""), &all), 1);
        assert!(run.collector().counters.too_close.is_empty());
        run.advance(100);
        let metrics = run.metrics();
        assert_eq!((metrics.losses_of_separation, metrics.orders), (0, u64::from(shield == "off")));
        metrics.orders_delayed
    };
    assert!(delayed("on") > 50);
    assert_eq!(delayed("off"), 0);
}

/// One below another, 300 m beside it and 3 km higher, which leaves long before it gets there.
#[test]
fn a_climb_waits_for_nobody_far_above() {
    let climbs = "orders = [{ at_s = 10.0, altitude_m = 3048.0 }]";
    let leaves = "altitude_m = 3048.0\norders = [{ at_s = 200.0, leaves = true }]";
    let all = plane([0.0, 0.0], 90.0, [0.0, 90_000.0], climbs)
        + &plane([300.0, 0.0], 90.0, [300.0, 90_000.0], leaves);
    let altitudes_m = |shield: &str| {
        let mut run =
            run(&scenario(&format!("vertical_m = 305.0\nshield = \"{shield}\""), &all), 1);
        let mut all_m = Vec::new();
        while run.metrics().left == 0 {
            run.advance(1);
            all_m.push(run.snapshot().0.airplanes[0].altitude_m);
        }
        let metrics = run.metrics();
        assert_eq!((metrics.orders_delayed, metrics.shield_level_offs), (0, 0), "{shield}");
        all_m
    };
    assert_eq!(altitudes_m("on"), altitudes_m("off"));
}

/// One straight below another, until that leaves.
#[test]
fn a_climb_levels_off_below_one_in_the_way_and_goes_on_when_that_is_gone() {
    let climbs = "orders = [{ at_s = 10.0, altitude_m = 1500.0, climb_m_s = 10.0 }]";
    let leaves = "altitude_m = 1000.0\norders = [{ at_s = 200.0, leaves = true }]";
    let all = plane([0.0, 0.0], 90.0, [0.0, 90_000.0], climbs)
        + &plane([0.0, 0.0], 90.0, [0.0, 90_000.0], leaves);
    let mut run = run(&scenario("method = \"none\"\nvertical_m = 300.0", &all), 1);
    assert!(run.collector().counters.too_close.is_empty(), "they start on levels that do not meet");
    let altitude_m = |run: &AirspaceRun| run.snapshot().0.airplanes[0].altitude_m;
    // 300 m below the other, where their levels just do not meet.
    run.advance(38);
    let held_m = altitude_m(&run);
    assert!((699.9..=700.0).contains(&held_m), "{held_m}");
    let metrics = run.metrics();
    assert!(metrics.shield_level_offs > 10 && metrics.orders_delayed == 0, "{metrics:?}");
    run.advance(40);
    assert!((altitude_m(&run) - 1500.0).abs() < 1e-9);
    assert_eq!(run.metrics().losses_of_separation, 0);
}

fn orders_in_words() -> impl Strategy<Value = String> {
    let order = (10.0f64..300.0, 0u8..6, 0.0f64..1.0).prop_map(|(at_s, kind, part)| {
        let what = match kind {
            0 => format!("heading_deg = {:?}", 360.0 * part),
            1 => format!("speed_m_s = {:?}", 20.0 + 30.0 * part),
            2 => format!("altitude_m = {:?}", if part < 0.5 { 0.0 } else { 400.0 }),
            3 => "proceeds = true".to_string(),
            4 => format!("way_points_m = [[{:?}, 0.0]]", 8000.0 * (part - 0.5)),
            _ => "leaves = true".to_string(),
        };
        (at_s, what)
    });
    prop::collection::vec(order, 0..4).prop_map(|mut orders| {
        orders.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Nobody gives an order to an airplane that has left.
        let leaves = orders.iter().position(|(_, what)| what.starts_with("leaves"));
        orders.truncate(leaves.map_or(orders.len(), |last| last + 1));
        let words: Vec<String> =
            orders.iter().map(|(at_s, what)| format!("{{ at_s = {at_s:?}, {what} }}")).collect();
        format!("orders = [{}]", words.join(", "))
    })
}

/// Airplanes that appear at any time in a small space, and are given various orders.
fn appearing() -> impl Strategy<Value = String> {
    let coordinate = || -6000.0f64..6000.0;
    let one = (
        [coordinate(), coordinate(), coordinate(), coordinate()],
        -180.0f64..180.0,
        0.0f64..200.0,
        orders_in_words(),
    )
        .prop_map(|([x, y, to_x, to_y], heading_deg, appears_s, orders)| {
            let appears_s = if appears_s < 60.0 { 0.0 } else { appears_s };
            let more = format!("appears_s = {appears_s:?}\n{orders}");
            plane([x, y], heading_deg, [to_x, to_y], &more)
        });
    prop::collection::vec(one, 2..10).prop_map(|all| all.concat())
}

type Pairs = BTreeSet<(u32, u32)>;

/// Pairs that lost separation, and pairs that were reported to be too close when they came in.
fn lost_and_reported_pairs(run: &AirspaceRun) -> (Pairs, Pairs) {
    let ledger = &run.collector().counters;
    let lost = ledger.pairs.iter().filter(|(_, record)| record.losses > 0).map(|(pair, _)| *pair);
    (lost.collect(), ledger.too_close.keys().copied().collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// L1 for traffic that comes and goes and follows orders: only pairs that were reported to
    /// be too close when they came in ever lose separation.
    #[test]
    fn the_shield_keeps_all_pairs_apart_that_did_not_come_in_too_close(
        airplanes in appearing(), method in prop::sample::select(vec!["none", "mvp"]),
    ) {
        let mut run = run(&scenario(&format!("method = \"{method}\""), &airplanes), 1);
        run.advance(120);
        let (lost, told) = lost_and_reported_pairs(&run);
        prop_assert!(lost.is_subset(&told), "{lost:?} but only {told:?} were told");
        for &(a, b) in &told {
            prop_assert!(a < b);
        }
    }
}

/// Everything at once: a generator, airplanes that appear and are given orders, and tracks.
fn everything() -> Source {
    let mut airplanes = two_tracks();
    for k in 0..12 {
        let (x, sign) = (f64::from(k) * 900.0 - 5000.0, if k % 2 == 0 { 1.0 } else { -1.0 });
        let more = format!(
            "appears_s = {:?}\norders = [{{ at_s = 60.0, speed_m_s = {:?} }}, \
             {{ at_s = 90.0, altitude_m = {:?} }}, {{ at_s = 110.0, heading_deg = 10.0 }}, \
             {{ at_s = 150.0, proceeds = true }}]",
            f64::from(k) * 7.0,
            30.0 + f64::from(k),
            f64::from(k % 3) * 250.0,
        );
        airplanes.push_str(&plane([x, sign * 4000.0], -90.0 * sign, [x, -sign * 4000.0], &more));
    }
    // Right behind the first one: an airplane that comes in there is too close.
    airplanes.push_str(&plane([-5000.0, 4000.0], -90.0, [-5000.0, -4000.0], "appears_s = 5.0"));
    let more = "replay_until_s = 62.0\n[airspace.generator]\nkind = \"random\"\nn = 8\nradius_m = 9000.0\n";
    scenario(more, &airplanes)
}

#[test]
fn any_number_of_workers_gives_the_same_bits_and_so_does_a_resumed_run() {
    let source = everything();
    let mut alone = run(&source, 1);
    alone.advance(50);
    assert!(!alone.collector().counters.too_close.is_empty(), "some come in too close");
    for workers in [2, 3, 8] {
        let mut team = run(&source, workers);
        team.advance(50);
        assert_eq!(team.digest(), alone.digest(), "{workers} workers");
        assert_eq!(team.collector().counters, alone.collector().counters, "{workers} workers");
    }
    // Before the hand-over, in the middle of climbs, and after all orders.
    for pause in [7, 19, 40] {
        let mut first = run(&source, 2);
        first.advance(pause);
        let mut second = run(&source, 1);
        second.restore(&first.checkpoint()).expect("its own checkpoint");
        second.advance(50 - pause);
        assert_eq!(second.digest(), alone.digest(), "from {pause}");
        assert_eq!(second.collector().counters, alone.collector().counters, "from {pause}");
    }
}

#[test]
fn every_deployment_knows_what_airplanes_were_told() {
    let digest = |deployment: &str| {
        let mut source = everything();
        let set = format!("airspace.deployment=\"{deployment}\"");
        source = source.with_overrides(&[set]).expect("a known key");
        let mut run = run(&source, 1);
        run.advance(30);
        run.digest()
    };
    for deployment in ["team", "compact-team", "pim"] {
        assert_eq!(digest(deployment), digest("direct"), "{deployment}");
    }
}

#[test]
fn wrong_tracks_and_orders_are_refused_with_a_remedy() {
    let told = |orders: &str| plane([0.0, 0.0], 0.0, [1.0, 1.0], &format!("orders = [{orders}]"));
    let wrong = [
        ("", "[[airplanes]]\ntrack = [[0.0, 0.0, 0.0, 0.0]]\n".to_string(), "rising"),
        ("", "[[airplanes]]\ntrack = [[5, 0, 0, 0], [1, 0, 0, 0]]\n".to_string(), "rising"),
        (
            "",
            plane([0.0, 0.0], 0.0, [1.0, 1.0], "track = [[0, 0, 0, 0], [1, 0, 0, 0]]"),
            "leave out",
        ),
        ("", "[[airplanes]]\nheading_deg = 3.0\nway_points_m = [[1, 1]]\n".to_string(), "at_m"),
        ("", told("{ at_s = 9.0, speed_m_s = 3.0 }, { at_s = 8.0, leaves = true }"), "sort"),
        ("", told("{ at_s = 9.0, speed_m_s = 3.0, leaves = true }"), "give one of"),
        ("", told("{ at_s = 9.0 }"), "give one of"),
        ("", told("{ at_s = 9.0, speed_m_s = 0.0 }"), "speed_m_s = 0"),
        ("", told("{ at_s = 9.0, heading_deg = nan }"), "heading_deg = NaN"),
        ("", told("{ at_s = 9.0, climb_m_s = 3.0 }"), "altitude_m"),
        ("", told("{ at_s = 9.0, turn = 3.0 }"), "unknown key"),
        ("wind_m_s = [30.0, 0.0]", told("{ at_s = 9.0, speed_m_s = 20.0 }"), "wind"),
        ("replay_until_s = 60.0", plane([0.0, 0.0], 0.0, [1.0, 1.0], ""), "leave it out"),
        (
            "[airspace.generator]\nkind = \"random\"\nn = 2\njitter_m = 9.0",
            String::new(),
            "leave it out",
        ),
        ("replay_until_s = -1.0", plane([0.0, 0.0], 0.0, [1.0, 1.0], ""), "inf"),
    ];
    for (airspace, airplanes, remedy) in wrong {
        let source = scenario(airspace, &airplanes);
        let error = airspace_run(&source, 1).expect_err(&airplanes).to_string();
        assert!(error.contains(remedy), "{airplanes}: {error}");
    }
}

#[test]
fn every_shared_bluesky_file_is_a_scenario_with_all_its_placed_aircraft() {
    let Some(folder) = shared("airspace/bluesky") else { return };
    let files = std::fs::read_dir(folder).expect("a folder").map(|f| f.expect("a file").path());
    let mut files: Vec<PathBuf> = files.collect();
    files.sort();
    assert_eq!(files.len(), 33);
    let (mut aircraft, mut told, mut still) = (0, 0, 0);
    for file in files {
        let scn = bluesky::read(&file).expect("a text");
        let name = file.display().to_string();
        let Some(text) = from_bluesky(&name, &scn) else {
            assert_eq!(scn.traffic.aircraft.len(), 0, "{name}");
            continue;
        };
        let mut run = run(&Source::new(&*name, text, ""), 1);
        still += scn.traffic.aircraft.len() - run.agent_count();
        aircraft += run.agent_count();
        if run.agent_count() < 100 {
            run.advance(60);
            told += run.metrics().orders;
        }
    }
    println!("{aircraft} aircraft, {told} orders carried out in ten minutes");
    assert!(told > 0);
    assert_eq!(still, 34, "aircraft that never get a speed are left out, by name");
}

/// Pairs of aircraft by their addresses that lost separation, with their closest approach in
/// nautical miles, found where all samples are of the same instants.
fn expected_losses() -> BTreeMap<String, f64> {
    let path = shared("expected/opensky.json").expect("beside the recording");
    let text = std::fs::read_to_string(path).expect("a text");
    let all: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let of_file = &all["airspace/opensky/switzerland_20180801_dev.csv"]["los"];
    let pairs = of_file.as_object().expect("pairs").iter();
    pairs.map(|(pair, of)| (pair.clone(), of["min_nm"].as_f64().expect("a number"))).collect()
}

#[test]
fn the_recording_over_switzerland_replays_with_its_losses_and_is_flown_anew_with_fewer() {
    let Some(path) = shared("airspace/opensky/switzerland_20180801_dev.csv") else { return };
    let recorded = traffic::read(&path).expect("a table");
    let names: Vec<&str> = recorded.tracks.iter().map(|t| t.icao24.as_str()).collect();
    let text = from_tracks("ch", &recorded).expect("it has tracks");
    let source = Source::new("ch", text, "");
    let mut replayed = run(&source, 2);
    while !replayed.is_over() {
        replayed.advance(50);
    }
    let metrics = replayed.metrics();
    assert_eq!((metrics.replayed, metrics.airplanes), (names.len() as u64, names.len() as u64));
    let lost = replayed.collector().counters.pairs.iter().filter(|(_, record)| record.losses > 0);
    let found: BTreeMap<String, f64> = lost
        .map(|(&(a, b), r)| {
            (format!("{}-{}", names[a as usize], names[b as usize]), r.nearest_m / 1852.0)
        })
        .collect();
    println!("replayed: {found:?}, {} s in all", metrics.lost_s);
    for (pair, min_nm) in expected_losses() {
        let nearest = found.get(&pair).unwrap_or_else(|| panic!("{pair} is missing in {found:?}"));
        // Between samples they are nearer still; the plane errs by up to two in a hundred.
        assert!(*nearest < min_nm * 1.02 && *nearest > min_nm - 1.0, "{pair}: {nearest} {min_nm}");
    }
    for until_s in [0.0, 600.0] {
        let set = [format!("airspace.replay_until_s={until_s:?}")];
        let mut anew = run(&source.clone().with_overrides(&set).expect("a known key"), 2);
        anew.advance(400);
        let metrics = anew.metrics();
        let (lost, told) = lost_and_reported_pairs(&anew);
        println!(
            "anew from {until_s} s: {} pairs lost, {:.0} s, {} told too close, {} arrived, delay {:?} %",
            lost.len(),
            metrics.lost_s,
            told.len(),
            metrics.arrived,
            metrics.mean_delay_percent,
        );
        assert!(until_s > 0.0 || lost.is_subset(&told), "{lost:?} {told:?}");
        assert!(metrics.lost_s < 0.6 * replayed.metrics().lost_s);
    }
}
