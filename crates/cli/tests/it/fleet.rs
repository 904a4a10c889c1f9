//! Fleets: a process for each airplane, by the program `sidestep-link` where it is built.

use crate::studio::Studio;
use crate::support::{CommandOutput, TestFolder, signal, wait_for};
use serde_json::json;
use sidestep_testing::require;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Child;

const RING: &str = "format = 1\nworld = \"airspace\"\nseed = 5\ncycles = 12\n[airspace]\n\
    deployment = \"compact-team\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 3\n";

/// Returns whether the program of fleets is there: the tests of its own crate build it beside `sidestep`.
pub(crate) fn is_there() -> bool {
    let beside = Path::new(env!("CARGO_BIN_EXE_sidestep")).with_file_name("sidestep-link");
    if !beside.is_file() {
        require("link", "sidestep-link is not built: cargo build --release -p sidestep-link");
    }
    beside.is_file()
}

pub(crate) fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("ring.toml", RING);
    place
}

#[test]
fn where_the_program_is_missing_it_is_said_how_to_get_it() {
    let place = place();
    let args = ["fleet", "ring.toml", "--out", "r"];
    let output = place.command(&args).env("SIDESTEP_LINK", "nowhere").output().expect("it starts");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("cargo install --path crates/link"), "{said}");
    assert!(!place.path("r").exists());
}

#[test]
fn a_fleet_has_the_digest_of_a_run_and_its_folder_is_one_for_all_other_commands() {
    if !is_there() {
        return;
    }
    let place = place();
    let alone = place.json(&["run", "ring.toml"]);
    let fleet = place.json(&["fleet", "ring.toml", "--out", "r"]);
    assert_eq!(fleet["digest"], alone["digest"]);
    assert_eq!(fleet["metrics"]["messages"], alone["metrics"]["messages"]);
    assert_eq!(fleet["fleet"]["nodes"].as_array().map(Vec::len), Some(3));
    assert_eq!(place.json(&["replay", "r"])["digest"], alone["digest"]);
    assert_eq!(place.run(&["report", "r"]).code(), 0);
    assert_eq!(place.run(&["export", "r", "--to", "csv"]).code(), 0);
    let words = place.run(&["fleet", "ring.toml", "--topology", "star"]).out();
    assert!(words.contains("3 in a star, lockstep"), "{words}");
    assert!(words.contains("percept to control"), "{words}");
    let of_nodes = fleet["fleet"]["nodes"].as_array().expect("nodes");
    assert!(of_nodes.iter().all(|node| node["frame_bytes"].is_u64()), "{fleet}");
}

#[test]
fn the_shipped_chains_run_as_processes_with_the_digest_of_a_run_and_an_ordinary_folder() {
    if !is_there() {
        return;
    }
    let place = place();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain/fleet.toml");
    let alone = place.json(&["run", scenario]);
    let fleet = place.json(&["fleet", scenario, "--out", "r"]);
    assert_eq!(fleet["digest"], alone["digest"]);
    assert_eq!(fleet["metrics"]["messages"], alone["metrics"]["messages"]);
    let nodes = fleet["fleet"]["nodes"].as_array().expect("nodes");
    assert_eq!((nodes.len(), &nodes[4]["name"]), (6, &json!("1.1")));
    assert_eq!(place.json(&["replay", "r"])["digest"], alone["digest"]);
    assert_eq!(place.run(&["report", "r"]).code(), 0);
}

#[test]
fn the_shipped_robots_run_as_processes_with_the_digest_of_a_run_and_an_ordinary_folder() {
    if !is_there() {
        return;
    }
    let place = place();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/robots/fleet.toml");
    let alone = place.json(&["run", scenario]);
    let fleet = place.json(&["fleet", scenario, "--out", "r"]);
    assert_eq!(fleet["digest"], alone["digest"]);
    let nodes = fleet["fleet"]["nodes"].as_array().expect("nodes");
    assert_eq!((nodes.len(), &nodes[4]["name"]), (6, &json!("4")));
    assert_eq!(place.json(&["replay", "r"])["digest"], alone["digest"]);
    assert_eq!(place.run(&["report", "r"]).code(), 0);
}

#[test]
fn a_node_is_told_its_airplane_its_connector_or_its_robot_and_only_one_of_them() {
    let place = place();
    let node = |named: &[&str]| {
        let args = [&["node", "ring.toml", "--connect", "tcp/127.0.0.1:9"], named].concat();
        let ended = place.run(&args);
        assert_eq!(ended.code(), 2, "{}", ended.err());
        ended.err()
    };
    let nobody = node(&[]);
    assert!(nobody.contains("--airplane") && nobody.contains("--robot"), "{nobody}");
    assert!(nobody.contains("--connector"), "{nobody}");
    assert!(node(&["--airplane", "0", "--connector", "0.1"]).contains("cannot be used with"));
    assert!(node(&["--airplane", "0", "--robot", "0"]).contains("cannot be used with"));
    let wrong = node(&["--connector", "3"]);
    assert!(wrong.contains("give the numbers of chain and connector, e.g. 0.3"), "{wrong}");
}

#[test]
fn ctrl_c_ends_a_fleet_in_good_order() {
    if !is_there() {
        return;
    }
    let place = place();
    let args = ["fleet", "ring.toml", "--cycles", "1000000", "--out", "r", "--log", "info"];
    let child = place.start(&args);
    wait_for("the folder", || place.path("r/scenario.toml").exists());
    signal(&child, "INT");
    let ended = CommandOutput(child.wait_with_output().expect("ended"));
    assert_eq!(ended.code(), 130, "{}", ended.err());
    let folder = sidestep_record::RunReader::open(&place.path("r"));
    assert!(folder.is_ok(), "it can be looked at: {:?}", folder.err());
}

#[test]
fn a_fleet_whose_folder_or_table_is_deleted_while_it_flies_ends_and_names_it() {
    if !is_there() {
        return;
    }
    let realtime = ["--clock", "realtime", "--speed", "30"];
    let simulated_tables = ["events", "optimizations", "pairs", "series", "trajectories"];
    let flown_tables = ["controls", "events", "optimizations", "pairs", "series", "trajectories"];
    for (clock, names, gone) in [
        (&[][..], &simulated_tables[..], "r"),
        (&realtime, &flown_tables, "r"),
        (&realtime, &flown_tables, "r/trajectories.partial"),
        (&realtime, &flown_tables, "r/events.partial"),
    ] {
        let place = place();
        let endless = ["fleet", "ring.toml", "--cycles", "1000000", "--out", "r", "--json"];
        let far = ["--set", "airspace.generator.radius_m=1000000"];
        let child = place.start(&[&endless[..], &far, clock].concat());
        // All of them, so that none is begun after the others are gone.
        let is_begun = |name: &&str| place.path(&format!("r/{name}.partial")).exists();
        wait_for("the tables", || names.iter().all(is_begun));
        std::fs::rename(place.path(gone), place.path("gone")).expect("moved");
        let ended = CommandOutput(child.wait_with_output().expect("ended"));
        assert_eq!((ended.code(), ended.out().as_str()), (1, ""), "{gone}: {}", ended.err());
        let told = ended.err();
        assert!(told.contains(gone) && told.contains("deleted"), "{gone}: {told}");
        assert!(told.contains("help:"), "{gone}: {told}");
        assert!(!place.path(gone).exists(), "{gone}");
    }
}

/// Waits until a fleet reports where its server listens; returns the endpoint.
fn endpoint(fleet: &mut Child) -> String {
    let mut lines = BufReader::new(fleet.stderr.as_mut().expect("errors")).lines();
    let mut told = lines.by_ref().map(|line| line.expect("text"));
    let line = told.find(|line| line.contains("listens at")).expect("it says where");
    line.rsplit(' ').next().expect("an endpoint").to_string()
}

#[test]
fn a_fleet_that_the_studio_watches_is_seen_to_its_end_steered_by_nobody_and_has_the_same_digest() {
    if !is_there() {
        return;
    }
    let place = place();
    let alone = place.json(&["run", "ring.toml"]);
    // It waits for a node that is not started yet, so a watcher sees all of it.
    let mut fleet = place.start(&["fleet", "ring.toml", "--nodes", "2", "--out", "r"]);
    let at = endpoint(&mut fleet);
    let studio = Studio::start(&place, &[&at]);
    let mut page = studio.page();
    assert_eq!(page.read()["open"], json!([{ "kind": "fleet", "path": at }]));
    let what = json!({ "kind": "fleet", "path": at });
    let opened = page.ask(json!({ "do": "open", "target": what, "seed": null }));
    let session = opened["session"].clone();
    assert_eq!(
        (&opened["scene"]["agent"], &opened["status"]["state"]),
        (&"airplane".into(), &"watched".into())
    );
    page.ask(json!({ "do": "credit", "session": session, "frames": 100 }));
    for call in ["play", "seek", "restart", "inspect", "edit", "save"] {
        let request = match call {
            "play" => json!({ "do": call, "session": session, "speed": "fastest" }),
            "seek" => json!({ "do": call, "session": session, "cycle": 3 }),
            "restart" => json!({ "do": call, "session": session, "seed": 1, "text": null }),
            "inspect" => {
                let who = json!({ "kind": "airplane", "number": 0, "part": null });
                json!({ "do": call, "session": session, "body": who })
            }
            "edit" => json!({ "do": call, "session": session, "text": "", "edits": [] }),
            _ => {
                json!({ "do": call, "session": session, "text": "", "to": null, "overwrite": true })
            }
        };
        assert!(page.reply(request)["problem"].is_object(), "{call}");
    }
    let node = ["node", "ring.toml", "--airplane", "2", "--connect", &at];
    let node = place.start(&[&node[..], &["--listen", "tcp/127.0.0.1:0"]].concat());
    let over = page.over(&session);
    let nodes = over["fleet"]["nodes"].as_array().expect("nodes");
    assert_eq!((over["cycle"].as_f64(), nodes.len()), (alone["cycles"].as_f64(), 3), "{over}");
    assert!(nodes.iter().all(|node| node["flown"] == 12), "{nodes:?}");
    assert!(page.frames().iter().all(|frame| frame.starts_with(b"SSTF")));
    let ended = CommandOutput(fleet.wait_with_output().expect("it ends"));
    assert_eq!(ended.code(), 0, "{}", ended.err());
    assert_eq!(node.wait_with_output().expect("it ends").status.code(), Some(0));
    assert_eq!(place.json(&["replay", "r"])["digest"], alone["digest"]);
}

/// Makes an authority, and a certificate for the server and for each of some airplanes, by the commands of the book;
/// each node has only its own key, in a folder of its own. Returns whether it has.
fn make_certificates(place: &TestFolder, airplanes: usize) -> bool {
    let page = include_str!("../../../../docs/src/fleet-threats.md");
    let block = page.split("```sh ignore\n").nth(1).and_then(|rest| rest.split("```").next());
    let block = block.expect("the commands of the book").replace("10.77.0.1", "127.0.0.1");
    let start = block.find("echo \"subjectAltName=IP:10.77.0.2").expect("a node");
    let common = &block[..start];
    let node = block[start..].replace("10.77.0.2", "127.0.0.1");
    let mut script = format!("set -e\n{common}");
    for airplane in 0..airplanes {
        let name = format!("airplane-{airplane}");
        script += &node.replace("airplane-0", &name).replace("node0", &format!("node{airplane}"));
        script += &format!(
            "mkdir m{airplane}\ncp ring.toml ca.pem m{airplane}\nmv node{airplane}.pem node{airplane}.key m{airplane}\n"
        );
    }
    script += "rm ca.key\n";
    let mut shell = std::process::Command::new("sh");
    let made = shell.args(["-c", &script]).current_dir(place.path("")).output().expect("a shell");
    if !made.status.success() {
        require("link", &format!("openssl makes no certificates: {made:?}"));
    }
    made.status.success()
}

#[test]
fn a_fleet_in_which_each_node_has_its_own_certificate_has_the_digest_of_a_run() {
    let place = place();
    if !is_there() || !make_certificates(&place, 3) {
        return;
    }
    let alone = place.json(&["run", "ring.toml"]);
    for topology in ["mesh", "star"] {
        let args = "fleet ring.toml --nodes 0 --listen tls/127.0.0.1:0 --tls-ca ca.pem --tls-cert server.pem --tls-key \
                    server.key --topology";
        let args: Vec<&str> =
            args.split_whitespace().chain([topology, "--out", topology]).collect();
        let mut fleet = place.start(&args);
        let at = endpoint(&mut fleet);
        let listen = if topology == "mesh" { "--listen tls/127.0.0.1:0" } else { "" };
        // A key and the airplane for which it is used.
        let words = |key: usize, airplane: usize| {
            format!(
                "node m{key}/ring.toml --airplane {airplane} --connect {at} {listen} --tls-ca m{key}/ca.pem \
                 --tls-cert m{key}/node{key}.pem --tls-key m{key}/node{key}.key"
            )
        };
        let other = words(1, 0);
        let refused = place.run(&other.split_whitespace().collect::<Vec<_>>());
        assert_eq!(refused.code(), 2, "{}", refused.err());
        assert!(refused.err().contains("it is for `airplane-1`"), "{}", refused.err());
        let mut nodes = Vec::new();
        for airplane in 0..3 {
            let own = words(airplane, airplane);
            nodes.push(place.start(&own.split_whitespace().collect::<Vec<_>>()));
        }
        let ended = CommandOutput(fleet.wait_with_output().expect("it ends"));
        assert_eq!(ended.code(), 0, "{}", ended.err());
        for node in nodes {
            let ended = CommandOutput(node.wait_with_output().expect("it ends"));
            assert_eq!(ended.code(), 0, "{}", ended.err());
        }
        assert_eq!(place.json(&["replay", topology])["digest"], alone["digest"], "{topology}");
    }
}

#[test]
fn an_address_where_no_fleet_flies_is_refused_before_a_page_is_served() {
    let place = place();
    let missing = place.command(&["studio", "--no-open", "tcp/127.0.0.1:9"]);
    let ended =
        { missing }.env("SIDESTEP_LINK", "nowhere").output().map(CommandOutput).expect("it starts");
    assert_eq!(ended.code(), 2, "{}", ended.err());
    assert!(ended.err().contains("cargo install --path crates/link"), "{}", ended.err());
    if !is_there() {
        return;
    }
    let ended = place.run(&["studio", "--no-open", "tcp/127.0.0.1:9"]);
    assert_eq!((ended.code(), ended.out()), (1, String::new()));
    assert!(ended.err().contains("no answer from tcp/127.0.0.1:9"), "{}", ended.err());
    let elsewhere = place.run(&["studio", "--no-open", "tcp/192.0.2.1:9"]);
    assert_eq!((elsewhere.code(), elsewhere.out()), (2, String::new()));
    assert!(elsewhere.err().contains("tcp/192.0.2.1:9: it is not of this"), "{}", elsewhere.err());
    let trusted = place.run(&["studio", "--no-open", "--insecure", "tcp/127.0.0.1:9"]);
    assert_eq!(trusted.code(), 1, "{}", trusted.err());
}

/// Returns the cycles of a run that are on disk for certain.
fn recorded_cycles(folder: &Path) -> u64 {
    sidestep_record::RunReader::open(folder).map_or(0, |run| run.manifest.cycles_done)
}

/// Returns a process that another one has started, if it has.
pub(crate) fn child_process(of: u32) -> Option<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{of}/task")).ok()?;
    let mut children = tasks.filter_map(|task| {
        let list = std::fs::read_to_string(task.ok()?.path().join("children")).ok()?;
        list.split_whitespace().next()?.parse().ok()
    });
    children.next()
}

#[cfg(target_os = "linux")]
#[test]
fn every_command_tells_the_truth_about_a_flight_whose_server_was_killed() {
    if !is_there() {
        return;
    }
    let place = place();
    let args = ["fleet", "ring.toml", "--cycles", "100000", "--out", "r", "--set"];
    let clock = ["airspace.generator.radius_m=1000000", "--clock", "realtime", "--speed", "30"];
    let fleet = place.start(&[&args[..], &clock[..]].concat());
    wait_for("cycles on disk", || recorded_cycles(&place.path("r")) >= 10);
    let server = child_process(fleet.id()).expect("the program of fleets").to_string();
    let killed = std::process::Command::new("kill").args(["-KILL", &server]).status();
    assert!(killed.expect("kill is there").success());
    let ended = CommandOutput(fleet.wait_with_output().expect("it ends"));
    assert_eq!(ended.code(), 1);
    assert!(ended.err().contains("on disk up to the last second"), "{}", ended.err());

    let done = recorded_cycles(&place.path("r"));
    let origin = format!("cycles 0 to {} flown", done - 1);
    assert_eq!(place.run(&["report", "r"]).code(), 0);
    assert!(place.read("r/report.md").contains(&origin), "{}", place.read("r/report.md"));
    let exported = place.run(&["export", "r", "--to", "csv"]);
    assert!(exported.err().contains("under way, or was killed"), "{}", exported.err());
    let origins = format!("from_cycle,until_cycle,origin\n0,{done},flown\n");
    assert_eq!(place.read("r-csv/flown-or-simulated.csv"), origins);
    assert!(place.read("r-csv/trajectories.csv").lines().count() as u64 >= 3 * done);
    let inspected = place.run(&["inspect", "r"]).out();
    assert!(inspected.contains(&origin) && inspected.contains("was killed"), "{inspected}");

    for _ in 0..2 {
        let resumed = place.run(&["resume", "r"]);
        assert_eq!(resumed.code(), 1, "{}", resumed.err());
        assert!(resumed.err().contains(&format!("flown until cycle {done}")), "{}", resumed.err());
    }
    assert_eq!(place.run(&["report", "r"]).code(), 0);
    let report = place.read("r/report.md");
    assert!(report.contains("cut off") && report.contains(&origin), "{report}");
    let replay = place.run(&["replay", "r"]);
    assert!(replay.code() == 2 && replay.err().contains("cut off"), "{}", replay.err());
    assert_eq!(place.run(&["replay", "r", "--cycle", &(done - 1).to_string()]).code(), 0);
    let json = place.json(&["export", "r", "--to", "csv", "--replace"]);
    assert_eq!(json["origins"], json!([{ "from": 0, "until": done, "origin": "flown" }]));

    let end = (done + 2).to_string();
    let simulated = place.run(&["resume", "r", "--simulate", "--cycles", &end]);
    assert_eq!(simulated.code(), 0, "{}", simulated.err());
    assert!(simulated.err().contains("marked as simulated"), "{}", simulated.err());
    let exported = place.run(&["export", "r", "--to", "parquet"]).out();
    let both = format!("{origin}, cycles {done} to {} simulated", done + 1);
    assert!(exported.contains(&both), "{exported}");
}

#[test]
fn a_flight_of_which_nothing_is_on_disk_is_an_error_and_no_empty_table() {
    let place = place();
    let flight = sidestep_record::NewRun {
        world: "airspace".into(),
        build: "an earlier one".into(),
        origin: sidestep_record::Provenance {
            program_version: "0.1.0".into(),
            scenario: RING.into(),
            seed: 5,
        },
        cycles_planned: 12,
        cycle_origin: sidestep_record::CycleOrigin::Flown,
        mcap: None,
        series_every: 0,
    };
    let refuse = sidestep_record::IfExists::Refuse;
    drop(sidestep_record::RunFolder::create(&place.path("r"), &flight, refuse).expect("created"));
    for args in [
        &["report", "r"][..],
        &["export", "r", "--to", "csv"],
        &["export", "r", "--to", "gif"],
        &["replay", "r"],
    ] {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out()), (2, String::new()), "{args:?}: {}", ended.err());
    }
    assert!(place.run(&["report", "r"]).err().contains("nothing of this run is on disk"));
    assert!(!place.path("r-csv").exists() && !place.path("r/report.html").exists());
    let resumed = place.run(&["resume", "r"]);
    assert_eq!(resumed.code(), 1);
    assert!(resumed.err().contains("flown until cycle 0 of 12, cut off"), "{}", resumed.err());
    assert_eq!(place.run(&["resume", "r", "--simulate"]).code(), 2, "of another build");
}
