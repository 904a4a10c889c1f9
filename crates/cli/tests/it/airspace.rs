//! The airspace world by the real command: run, record, replay, compare, other programs' files.

use crate::support::{TestFolder, names};
use serde_json::Value;

const SIX: &str = "format = 1\nworld = \"airspace\"\nname = \"Six\"\n\
                   [airspace.generator]\nkind = \"superconflict\"\nn = 6\n";

#[test]
fn a_run_ends_when_all_have_arrived_and_says_what_came_of_it() {
    let place = TestFolder::new();
    place.write("six.toml", SIX);
    let told = place.json(&["run", "six.toml", "--out", "six"]);
    let metrics = &told["metrics"];
    assert_eq!(told["status"], "complete");
    assert_eq!((&metrics["airplanes"], &metrics["arrived"]), (&Value::from(6), &Value::from(6)));
    assert_eq!(metrics["losses_of_separation"], 0);
    assert!(metrics["min_separation_m"].as_f64().is_some_and(|d| d >= 500.0));
    for key in [
        "mean_delay_percent",
        "conflicts",
        "intrusion_prevention_rate",
        "well_clear_violations",
        "mean_extra_distance_percent",
        "maneuvers_per_flight_hour",
        "messages",
        "bytes",
        "optimizations",
        "rounds_mean",
        "optimize_cpu_s",
        "shield_overrides",
    ] {
        assert!(metrics[key].is_number(), "{key}");
    }
    assert!(told["digest"].as_str().is_some_and(|d| d.len() == 32));
    let written = names(&place.path("six"));
    assert!(written.contains(&"trajectories.png".to_string()), "{written:?}");
    let replayed = place.run(&["replay", "six", "--cycle", "20"]);
    assert_eq!(replayed.code(), 0, "{}", replayed.err());
    assert!(replayed.out().contains("equal to the 6 recorded poses"), "{}", replayed.out());
    assert_eq!(place.json(&["resume", "six"])["digest"], told["digest"], "told again");
}

/// Each key of a table that a `kind` selects, call signs and orders are checked like all others.
#[test]
fn keys_of_tables_with_a_kind_call_signs_and_orders_are_refused_where_they_are_wrong() {
    let head = "format = 1\nworld = \"airspace\"\n";
    let update = "[airspace]\nupdate = { kind = \"brouwer\", step = 0.5, foo = 3 }\n";
    let exact = "[airspace]\nestimator = { kind = \"exact\", block = 3 }\n";
    let sampled =
        "[airspace]\nestimator = { kind = \"sampled\", block = 3, ageing = 0.5, bar = 1 }\n";
    let table = "[airspace.update]\nkind = \"brouwer\"\nstep = 0.5\nfoo = 3\n";
    let circle = "[airspace.generator]\nkind = \"superconflict\"\nn = 4\n";
    let airplane = |y: u32, more: &str| {
        format!(
            "[[airplanes]]\nat_m = [0, {y}]\nheading_deg = 0\nway_points_m = [[9000, {y}]]\n{more}\n"
        )
    };
    let after =
        airplane(0, "orders = [{ at_s = 5, leaves = true }, { at_s = 9, heading_deg = 3 }]");
    let twins = airplane(0, "callsign = \"A\"") + &airplane(5000, "callsign = \"A\"");
    for (text, place_of, said) in [
        (format!("{head}{update}{circle}"), "s.toml:4:42: ", "unknown key `foo`"),
        (format!("{head}{exact}{circle}"), "s.toml:4:31: ", "unknown key `block`"),
        (format!("{head}{sampled}{circle}"), "s.toml:4:58: ", "unknown key `bar`"),
        (format!("{head}{table}{circle}"), "s.toml:6:1: ", "unknown key `foo`"),
        (format!("{head}{after}"), "s.toml:7:40: ", "an order after the airplane has left"),
        (format!("{head}{twins}"), "s.toml:12:12: ", "that of another airplane at the same time"),
    ] {
        let place = TestFolder::new();
        place.write("s.toml", &text);
        let ended = place.run(&["check", "s.toml"]);
        assert_eq!(ended.code(), 2, "{text}");
        let err = ended.err();
        assert!(err.contains(place_of) && err.contains(said), "{text}\n{err}");
    }
    // One that comes when its namesake has left is no twin.
    let left = airplane(0, "callsign = \"A\"\norders = [{ at_s = 5, leaves = true }]");
    let next = airplane(5000, "callsign = \"A\"\nappears_s = 6");
    let place = TestFolder::new();
    place.write("s.toml", format!("{head}{left}{next}"));
    let ended = place.run(&["check", "s.toml"]);
    assert_eq!(ended.code(), 0, "{}", ended.err());
}

/// In a circle without avoidance all pairs meet at the center, and the seed only turns the circle.
#[test]
fn seeds_that_only_turn_a_circle_give_no_interval_no_p_value_and_no_precision() {
    let place = TestFolder::new();
    place.write("six.toml", SIX);
    let bare = ["--set", "airspace.shield=off", "--set", "airspace.method=none"];
    let vary = ["--vary", "airspace.generator.n=1,8", "--replicate", "5"];
    let swept = place.run(&[&["sweep", "six.toml"], &bare[..], &vary[..]].concat());
    assert_eq!(swept.code(), 0, "{}", swept.err());
    let shown = swept.out();
    assert!(!shown.contains("28, 28") && !shown.contains("0.0001"), "{shown}");
    assert!(shown.contains("Seeds change nothing that a metric shows"), "{shown}");
    let until = ["--set", "airspace.generator.n=8", "--until", "ci=0.05"];
    let stopped = place.json(&[&["sweep", "six.toml"], &bare[..], &until[..]].concat());
    assert_eq!(stopped["stopped"][0]["reason"], "unseen", "{}", stopped["stopped"]);
    assert_eq!(stopped["runs"], 10);
}

#[test]
fn every_deployment_gives_the_digest_of_one_process() {
    let place = TestFolder::new();
    place.write("six.toml", SIX);
    let digest = |deployment: &str| {
        let set = format!("airspace.deployment={deployment}");
        let args =
            ["run", "six.toml", "--cycles", "12", "--set", &set, "--set", "airspace.generator.n=3"];
        place.json(&args)["digest"].clone()
    };
    for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
        assert_eq!(digest(deployment), digest("direct"), "{deployment}");
    }
}

/// One airplane's radio is dead from half-way, every tenth message is lost; all arrive, that one
/// by the traffic that it sees.
#[test]
fn trouble_on_the_network_is_told_and_recorded_and_nobody_comes_too_near() {
    let place = TestFolder::new();
    place.write("six.toml", SIX);
    let silent = "airspace.network.silent=[{airplane=2,from_s=150.0}]";
    let set = |key: &'static str| ["--set", key];
    let args = [
        &["run", "six.toml", "--cycles", "150", "--out", "six"][..],
        &set("airspace.deployment=compact-team"),
        &set("airspace.network.loss=0.1"),
        &set(silent),
    ]
    .concat();
    let told = place.run(&args);
    assert_eq!(told.code(), 0, "{}", told.err());
    for words in ["losses of separation  none", "contacts lost", "arrived               6 of 6"] {
        assert!(told.out().contains(words), "{}", told.out());
    }
    let written = names(&place.path("six"));
    for table in ["events", "optimizations", "pairs"] {
        assert!(written.contains(&table.to_string()), "{written:?}");
    }
    let summary: Value = serde_json::from_str(&place.read("six/summary.json")).expect("JSON");
    assert!(summary["per_pair"].as_array().is_some_and(|pairs| !pairs.is_empty()));
}

#[test]
fn methods_are_compared_on_the_same_traffic() {
    let place = TestFolder::new();
    place.write("six.toml", SIX);
    let args = [
        "compare",
        "six.toml",
        "--methods",
        "pc,none",
        "--runs",
        "2",
        "--set",
        "airspace.shield=off",
    ];
    let told = place.json(&args);
    assert_eq!(
        (&told["methods"][0]["method"], &told["methods"][0]["loss_free"]),
        (&Value::from("pc"), &Value::from(2))
    );
    assert_eq!(
        (&told["methods"][1]["method"], &told["methods"][1]["loss_free"]),
        (&Value::from("none"), &Value::from(0))
    );
    let other = place.run(&["compare", "s.toml"]);
    assert_eq!(other.code(), 2);
    assert!(other.err().contains("airspace"), "{}", other.err());
}

#[test]
fn seeds_that_run_over_are_told_as_such() {
    let place = TestFolder::new();
    place.write("six.toml", SIX);
    let last = ["compare", "six.toml", "--methods", "none", "--seed", "9223372036854775807"];
    let told = place.run(&[&last[..], &["--runs", "2"]].concat());
    assert_eq!((told.code(), told.out().as_str()), (2, ""));
    let cause = "2 seeds from 9223372036854775807 on exceed 2^63 - 1";
    assert!(told.err().contains(cause) && !told.err().contains("line"), "{}", told.err());
    assert_eq!(place.run(&[&last[..], &["--runs", "1"]].concat()).code(), 0);
}

#[test]
fn methods_are_compared_with_and_without_the_shield_where_there_is_one() {
    let place = TestFolder::new();
    place.write("six.toml", SIX);
    let compare = ["compare", "six.toml", "--methods", "none", "--runs", "1"];
    let told = &place.json(&compare)["methods"][0];
    assert_eq!([&told["loss_free"], &told["bare"]["loss_free"]], [1, 0]);
    assert_eq!(told["bare"]["delay_percent"]["mean"], 0.0, "without it they fly straight on");
    assert_eq!(told["bare"]["price_percent"]["mean"], told["delay_percent"]["mean"]);
    // Straight flight without the shield is what the domino effect compares with.
    assert_eq!(told["bare"]["domino_effect"]["mean"], 0.0);
    assert!(told["domino_effect"]["mean"].is_number(), "{told}");
    let shielded = place.run(&compare).out();
    assert!(shielded.contains("bare: losses") && shielded.contains("DEP"), "{shielded}");
    let without = [&compare[..], &["--set", "airspace.shield=off"]].concat();
    assert_eq!(place.json(&without)["methods"][0]["bare"], Value::Null);
    assert!(!place.run(&without).out().contains("bare"));
}

#[test]
fn a_bluesky_file_is_a_scenario_and_check_counts_its_commands() {
    let place = TestFolder::new();
    place.write(
        "two.scn",
        "00:00:00.00>CRE A1,B744,0,-0.4,90,FL200,250\n\
         00:00:00.00>CRE B2,B744,0,0.4,270,FL200,250\n\
         00:00:00.00>PAN 0 0\n00:00:01.00>MCRE 3,B744\n00:00:02.00>CRE broken\n",
    );
    let told = place.json(&["check", "two.scn"]);
    assert_eq!(told["command_lines"], 5, "{told}");
    assert_eq!(told["commands"]["CRE"], 3, "{told}");
    assert_eq!(told["not_understood"]["MCRE"], 1, "{told}");
    assert_eq!(told["unparsed_lines"], 1, "{told}");
    place.write("nowhere.scn", "00:00:00.00>CRE A1,B744,EHAM,RWY18L,90,FL200,250\n");
    let [checked, ran] = ["check", "run"].map(|command| place.run(&[command, "nowhere.scn"]));
    assert_eq!((checked.code(), ran.code()), (2, 2), "they agree on what is wrong");
    assert_eq!(checked.err(), ran.err());
    assert!(checked.out().contains("A1 at EHAM RWY18L"), "{}", checked.out());
    let lost = (1..=7).map(|k| format!("00:00:00.00>CRE X{k},B744,EHAM,RWY18L,90,FL200,250\n"));
    let settings = "00:00:00.00>ASAS ON\n00:00:00.00>RESO MVP\n00:00:00.00>CDMETHOD STATEBASED\n\
                    00:00:00.00>DTLOOK 120\n00:00:00.00>CRE A1,B744,0,-0.4,90,FL200,250\n\
                    00:00:00.00>ADDWPT A1 ARTIP\n00:00:00.00>ADDWPT A1 ARTIP\n";
    place.write("lost.scn", settings.to_string() + &lost.collect::<String>());
    let told = place.json(&["check", "lost.scn"]);
    assert_eq!(told["not_flown"], serde_json::json!({}), "{told}");
    assert_eq!(
        (&told["method"], &told["refused"]),
        (&"mvp".into(), &serde_json::json!([])),
        "{told}"
    );
    place.write("refused.scn", format!("{settings}00:00:00.00>RESO SSD\n"));
    let told = place.json(&["check", "refused.scn"]);
    assert!(
        told["refused"][0].as_str().is_some_and(|e| e.contains("refused.scn:8:1: RESO")),
        "{told}"
    );
    assert_eq!(told["unresolved_names"][0], "ARTIP", "{told}");
    let words = in_one_line(&place.run(&["check", "lost.scn"]).out());
    assert!(words.contains("X5 at EHAM RWY18L and 2 more"), "{words}");
    assert!(words.contains("unknown way-points") && !words.contains("X6"), "{words}");
    assert!(words.contains("ARTIP (ADDWPT of A1, line 6, and 1 more)"), "{words}");
    for wrong in ["airspace.method=magic", "airspace.dt_s=-1.0", "airspce.dt_s=1.0"] {
        let ended = place.run(&["check", "two.scn", "--set", wrong]);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{wrong}: {}", ended.err());
        assert!(ended.err().contains("help: "), "{wrong}: {}", ended.err());
    }
    let ran = place.json(&["run", "two.scn", "--cycles", "5", "--out", "two"]);
    assert_eq!(ran["metrics"]["airplanes"], 2);
    assert!(place.read("two/scenario.toml").contains("[[airplanes]]"));
    assert_eq!(ran["file"]["not_understood"]["MCRE"], 1, "{ran}");
    assert_eq!(ran["file"]["unparsed_lines"], 1, "{ran}");
    let report = in_one_line(&place.run(&["run", "two.scn", "--cycles", "5"]).out());
    for expected in ["MCRE: aircraft that", "line 4", "PAN 1", "two.scn:5:13"] {
        assert!(report.contains(expected), "{expected} is missing in\n{report}");
    }
}

#[test]
fn a_bluesky_file_calls_files_beside_it_and_finds_places_in_the_users_tables() {
    let place = TestFolder::new();
    place.write(
        "a.scn",
        "00:00:00.00>PCALL sub.scn KL001 4.0\n00:01:00.00>PCALL sub.scn KL002 5.0\n",
    );
    place.write(
        "sub.scn",
        "00:00:00.00>CRE %0,A320,52.0,%1,090,FL300,270\n00:00:00.00>ADDWPT %0 SPY\n",
    );
    std::fs::create_dir(place.path("nav")).expect("made");
    place.write("nav/fix.dat", " 52.5 8.0 SPY\n");
    let unknown = place.run(&["check", "a.scn"]);
    assert_eq!(unknown.code(), 0, "{}", unknown.err());
    let words = in_one_line(&unknown.out());
    assert!(words.contains("give --navdata") && words.contains("sub.scn line 2"), "{words}");
    let told = place.json(&["check", "a.scn", "--navdata", "nav"]);
    assert_eq!((&told["airplanes"], &told["unresolved_places"]), (&2.into(), &0.into()), "{told}");
    let ran = place.json(&["run", "a.scn", "--navdata", "nav", "--cycles", "3", "--out", "a"]);
    assert_eq!(ran["metrics"]["airplanes"], 2, "{ran}");
    let wrong = place.run(&["run", "a.scn", "--navdata", "nowhere"]);
    assert_eq!(wrong.code(), 2);
    assert!(wrong.err().contains("fix.dat"), "{}", wrong.err());
    let sweep = place.run(&["run", "a.scn", "--navdata", "nav", "--replicate", "2"]);
    assert_eq!(sweep.code(), 2);
    // The advice that it gives.
    assert!(sweep.err().contains("then give DIR/scenario.toml"), "{}", sweep.err());
    assert_eq!(
        place.run(&["run", "a/scenario.toml", "--replicate", "2", "--cycles", "2"]).code(),
        0
    );
}

/// A type of OpenAP whose files have only what is read of them.
fn write_openap(place: &TestFolder) {
    for folder in ["openap", "openap/aircraft", "openap/wrap"] {
        std::fs::create_dir(place.path(folder)).expect("made");
    }
    place.write(
        "openap/aircraft/a320.yml",
        "vmo: 350\nmmo: 0.82\nceiling: 12500\ncruise:\n  height: 11000\n  mach: 0.78\n",
    );
    place.write(
        "openap/wrap/a320.txt",
        "ic_vs_avg initial_climb Mean vertical rate 12.59 9.15 10.0 norm 12.59|2.09\n\
         fa_va_avg final_approach Mean airspeed 72 67 77 norm 72.43|3.49\n",
    );
}

#[test]
fn a_bluesky_file_flies_within_the_limits_of_openaps_types_where_they_are_given() {
    let place = TestFolder::new();
    write_openap(&place);
    place.write(
        "a.scn",
        "00:00:00>CRE A1,A320,52.0,4.0,090,FL300,270\n00:00:00>DEST A1 52.0 6.0\n\
         00:00:20>SPD A1 M0.9\n00:00:30>ALT A1 FL350 4000\n\
         00:00:00>CRE A2,XY99,53.0,4.0,090,FL300,270\n00:00:00>DEST A2 53.0 6.0\n",
    );
    let without = in_one_line(&place.run(&["check", "a.scn"]).out());
    assert!(without.contains("types of aircraft"), "{without}");
    let with = place.run(&["check", "a.scn", "--openap", "openap"]);
    assert_eq!(with.code(), 0, "{}", with.err());
    let with = in_one_line(&with.out());
    assert!(!with.contains("types of aircraft:"), "{with}");
    for words in [
        "types that OpenAP does not have, XY99",
        "speeds beyond what the type can fly",
        "vertical speeds beyond what the type can fly",
    ] {
        assert!(with.contains(words), "{words}: {with}");
    }
    let ran = place.json(&["run", "a.scn", "--openap", "openap", "--cycles", "60", "--out", "a"]);
    assert_eq!(ran["metrics"]["airplanes"], 2, "{ran}");
    // The run folder needs no OpenAP.
    std::fs::remove_dir_all(place.path("openap")).expect("removed");
    assert_eq!(place.run(&["check", "a/scenario.toml"]).code(), 0);
    let sweep = place.run(&["run", "a.scn", "--openap", "openap", "--replicate", "2"]);
    assert!(sweep.err().contains("run the file once with --openap"), "{}", sweep.err());
}

/// Returns a text without the line ends that fit it to a terminal.
fn in_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Rows of two airplanes on one level over the equator that meet head on after 400 s.
fn head_on_csv() -> String {
    let header = "time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt,track_deg,vs_fpm\n";
    let row = |k: i32, (name, sign, track): (&str, f64, u32)| {
        let lon_deg = sign * (-1.0 + f64::from(k) / 40.0);
        format!("{},{name},,0.0,{lon_deg},35000,540,{track},\n", 1_000_000 + 10 * k)
    };
    let both = |k: i32| [("a", 1.0, 90), ("b", -1.0, 270)].map(|who| row(k, who)).concat();
    (0..=80).map(both).fold(header.to_string(), |text, rows| text + &rows)
}

#[test]
fn recorded_tracks_are_replayed_or_flown_anew_from_a_chosen_time() {
    let place = TestFolder::new();
    place.write("tracks.csv", head_on_csv() + "1000000,c,,1.0,0.0,35000,540,90,\n");
    let replayed = place.json(&["run", "tracks.csv", "--out", "replayed"]);
    let metrics = &replayed["metrics"];
    assert_eq!((&metrics["airplanes"], &metrics["replayed"]), (&2.into(), &2.into()), "{replayed}");
    assert_eq!(
        (&metrics["losses_of_separation"], &metrics["optimizations"]),
        (&1.into(), &0.into())
    );
    assert!(metrics["mean_delay_percent"].is_null());
    assert_eq!(
        (&replayed["file"]["rows"], &replayed["file"]["aircraft_of_one_row"]),
        (&163.into(), &1.into())
    );
    assert!(place.read("replayed/scenario.toml").contains("replay_until_s = inf"));
    let again = place.run(&["replay", "replayed", "--cycle", "20"]);
    assert!(
        again.out().contains("equal to the 2 recorded poses"),
        "{}{}",
        again.out(),
        again.err()
    );
    for until in ["0", "100"] {
        let set = format!("airspace.replay_until_s={until}");
        let anew = place.json(&["run", "tracks.csv", "--set", &set]);
        let metrics = &anew["metrics"];
        assert_eq!(metrics["losses_of_separation"], 0, "{anew}");
        assert_eq!((&metrics["arrived"], &metrics["replayed"]), (&2.into(), &0.into()), "{anew}");
        assert!(metrics["mean_delay_percent"].is_number(), "{anew}");
    }
    let late = place.run(&["run", "tracks.csv", "--set", "airspace.replay_until_s=390"]);
    assert!(late.out().contains("too close for the shield: a and b at 390 s"), "{}", late.out());
    let told = place.run(&["check", "tracks.csv"]);
    assert!(told.out().contains("replayed all") && told.out().contains("162 of 163 kept"));
}

#[test]
fn commands_of_a_bluesky_file_are_flown_at_their_times() {
    let place = TestFolder::new();
    place.write(
        "told.scn",
        "00:00:00.00>CRE A1,B744,0,0,90,FL200,250\n00:00:00.00>DEST A1 0,1.0\n\
         00:01:00.00>A1 HDG 180\n00:02:00.00>A1 SPD 300\n00:03:00.00>ALT A1 FL210 2000\n\
         00:05:00.00>A1 LNAV ON\n00:06:00.00>A1 VNAV ON\n\
         00:00:00.00>CRE B2,B744,5,5,90,FL200,250\n00:04:00.00>DEL B2\n\
         00:00:00.00>CRE C3,B744,-5,5,0,FL200,250\n00:02:00.00>ADDWPT C3 -5,6\n",
    );
    let ran = place.json(&["run", "told.scn", "--out", "told"]);
    let metrics = &ran["metrics"];
    assert_eq!((&metrics["arrived"], &metrics["left"]), (&2.into(), &1.into()), "{ran}");
    // Three changes, the true airspeeds of the climb and the way-point again for A1; a heading and its route for C3.
    assert_eq!((&metrics["orders"], &metrics["orders_delayed"]), (&9.into(), &0.into()), "{ran}");
    assert_eq!(ran["file"]["not_flown"]["VNAV"], 1, "{ran}");
    let scenario = place.read("told/scenario.toml");
    for order in [
        "{ at_s = 60.0, heading_deg = -90.0 }",
        "climb_m_s = 10.16",
        "{ at_s = 240.0, leaves = true }",
    ] {
        assert!(scenario.contains(order), "{order} is missing in\n{scenario}");
    }
    let report = place.run(&["run", "told.scn"]).out();
    for expected in ["9 carried out", "1 before they had arrived", "VNAV ON", "line 7"] {
        assert!(report.contains(expected), "{expected} is missing in\n{report}");
    }
}

/// A run is driven in slices, the first of one cycle.
#[test]
fn a_run_that_is_over_where_a_slice_ends_is_recorded_all_the_same() {
    let place = TestFolder::new();
    let rows: Vec<String> = head_on_csv().lines().take(5).map(|row| format!("{row}\n")).collect();
    place.write("short.csv", rows.concat());
    assert_eq!(place.json(&["run", "short.csv", "--out", "short"])["cycles"], 1);
    let replayed = place.run(&["replay", "short", "--cycle", "0"]);
    assert!(replayed.out().contains("equal to the 2 recorded poses"), "{}", replayed.out());
}
