//! The words of a fleet for other programs: metrics for Prometheus, logs as JSON, and the table of all packets.

use crate::processes::{LinkProcess, folder, job};
use crate::support::{superconflict, wide};
use serde_json::Value;
use sidestep_link::wire::endpoint::reserve_port;
use sidestep_session::fleet::{
    AgentName, ClockMode, FleetJob, Job, LinkMessage, NodeJob, Topology,
};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Returns free addresses of this machine; no two are the same, because all are held at once.
pub(crate) fn free_addresses<const N: usize>() -> [String; N] {
    let held = [(); N].map(|()| reserve_port("tcp/127.0.0.1:0").expect("a free port"));
    held.map(|held| held.endpoint.trim_start_matches("tcp/").to_string())
}

/// Asks an address by HTTP, and returns the first line of the answer, and its body.
pub(crate) fn ask(address: &str, method: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).expect("somebody answers");
    write!(stream, "{method} /metrics HTTP/1.1\r\nHost: {address}\r\n\r\n").expect("asked");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("text");
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
    let length = format!("Content-Length: {}", body.len());
    assert!(head.lines().any(|line| line == length), "{head}");
    (head.lines().next().unwrap_or_default().to_string(), body.to_string())
}

/// A family of metrics: its type, and its values by name with labels.
#[derive(Debug, Default)]
pub(crate) struct Family {
    kind: String,
    values: Vec<(String, BTreeMap<String, String>, f64)>,
}

impl Family {
    /// Returns the value with these labels.
    pub(crate) fn value(&self, labels: &[(&str, &str)]) -> Option<f64> {
        let is_it = |own: &BTreeMap<String, String>| {
            own.len() == labels.len()
                && labels.iter().all(|(key, value)| own.get(*key).is_some_and(|own| own == value))
        };
        self.values.iter().find(|(_, own, _)| is_it(own)).map(|(_, _, value)| *value)
    }
}

/// Reads a line of a value: `name{label="value",...} number`.
fn value_of(line: &str) -> (String, BTreeMap<String, String>, f64) {
    let (name, number) = line.rsplit_once(' ').expect("a name and a number");
    let (name, labels) = match name.split_once('{') {
        Some((name, labels)) => (name, labels.strip_suffix('}').expect("a brace")),
        None => (name, ""),
    };
    let is_name = |c: char| c.is_ascii_lowercase() || c == '_';
    assert!(!name.is_empty() && name.chars().all(is_name), "{line}");
    let label = |one: &str| {
        let (key, value) = one.split_once('=').expect("a label");
        assert!(key.chars().all(is_name), "{line}");
        let value = value.strip_prefix('"').and_then(|value| value.strip_suffix('"'));
        let value = value.unwrap_or_else(|| panic!("no quotes: {line}"));
        assert!(!value.contains(['"', '\\']), "{line}");
        (key.to_string(), value.to_string())
    };
    let labels = labels.split(',').filter(|one| !one.is_empty()).map(label).collect();
    (name.into(), labels, number.parse().unwrap_or_else(|_| panic!("no number: {line}")))
}

/// Reads Prometheus' text, line by line, by its format (0.0.4).
pub(crate) fn families(text: &str) -> BTreeMap<String, Family> {
    let mut families: BTreeMap<String, Family> = BTreeMap::new();
    let mut present = String::new();
    assert!(text.ends_with('\n'), "the last line is whole");
    for line in text.lines() {
        if let Some(help) = line.strip_prefix("# HELP ") {
            let (name, words) = help.split_once(' ').expect("a name and help");
            assert!(name.starts_with("sidestep_") && !words.is_empty(), "{line}");
            assert!(families.insert(name.into(), Family::default()).is_none(), "twice: {line}");
            present = name.into();
        } else if let Some(kind) = line.strip_prefix("# TYPE ") {
            let (name, kind) = kind.split_once(' ').expect("a name and a type");
            assert_eq!(name, present, "the type stands below the help");
            assert!(["counter", "gauge", "histogram"].contains(&kind), "{line}");
            assert_eq!(name.ends_with("_total"), kind == "counter", "{line}");
            families.get_mut(name).expect("begun").kind = kind.into();
        } else {
            let (name, labels, value) = value_of(line);
            let family = families.get_mut(&present).expect("a metric");
            let bare = ["_bucket", "_sum", "_count"].iter().find_map(|end| name.strip_suffix(end));
            let is_own = match family.kind.as_str() {
                "histogram" => bare == Some(&present),
                _ => name == present,
            };
            assert!(is_own, "{line} below {present}");
            family.values.push((name, labels, value));
        }
    }
    families
}

/// Checks that the classes of a histogram add up.
fn check_histogram(name: &str, family: &Family) {
    let of = |end: &str| {
        let name = format!("{name}_{end}");
        family.values.iter().filter(move |(own, ..)| *own == name)
    };
    let buckets: Vec<(f64, f64)> = of("bucket")
        .map(|(_, labels, count)| (labels["le"].parse().expect("a bound"), *count))
        .collect();
    assert!(buckets.len() > 2, "{name}");
    assert!(buckets.is_sorted_by(|a, b| a.0 < b.0 && a.1 <= b.1), "{name}: {buckets:?}");
    let last = *buckets.last().expect("some");
    let single = |end: &str| of(end).map(|(.., value)| *value).collect::<Vec<_>>();
    assert_eq!((last.0, vec![last.1]), (f64::INFINITY, single("count")), "{name}");
    let sum = single("sum");
    assert!(sum.len() == 1 && sum[0] >= 0.0, "{name}: {sum:?}");
}

const COMMON: [&str; 6] =
    ["packets_total", "packet_bytes_total", "epoch", "heard", "retries_total", "dropped_total"];

#[test]
fn metrics_of_the_server_and_of_a_node_are_prometheus_text_of_what_happens() {
    let folder = folder(&wide(&superconflict(3, "compact-team", 1_000_000, ""), 3_500));
    let [at_server, at_node] = free_addresses();
    let mut fleet = job(folder.path(), Topology::Star, ClockMode::Realtime { speed: 20.0 });
    let common = fleet.common.clone();
    fleet.common.metrics = Some(at_server.clone());
    fleet.nodes = Some(2);
    let server = LinkProcess::start(&Job::Fleet(fleet));
    let connect = server.until("its endpoints", |message| match message {
        LinkMessage::Listens(endpoints) => Some(endpoints),
        _ => None,
    });
    let common =
        sidestep_session::fleet::CommonSettings { metrics: Some(at_node.clone()), ..common };
    let (agent, listen, patience_s) = (AgentName::new("airplane", 2, None), Vec::new(), 30.0);
    let _node =
        LinkProcess::start(&Job::Node(NodeJob { common, agent, connect, listen, patience_s }));
    let now = server.fleet("some cycles", |now| now.cycle > 4 && now.nodes[2].flown > 2);
    let (status, text) = ask(&at_server, "GET");
    assert_eq!(status, "HTTP/1.1 200 OK");
    let server_tells = families(&text);
    let names = "cycle talk_seconds advance_seconds late_seconds late_cycles_total absurd_controls_total \
         refused_total denied_total frames_total frame_bytes_total frames_dropped_total node_up controls_flown_total \
         controls_late_total node_lives_total node_frame_bytes_total node_processor_seconds_total";
    let all = |names: &[&str]| -> BTreeSet<String> {
        names.iter().chain(&COMMON).map(|name| format!("sidestep_{name}")).collect()
    };
    let names: Vec<&str> = names.split_whitespace().collect();
    assert_eq!(server_tells.keys().cloned().collect::<BTreeSet<_>>(), all(&names));
    for (name, family) in server_tells.iter().filter(|(_, family)| family.kind == "histogram") {
        check_histogram(name, family);
    }
    let value = |name: &str, labels: &[(&str, &str)]| {
        server_tells[&format!("sidestep_{name}")].value(labels).expect("a value")
    };
    assert!(value("cycle", &[]) >= now.cycle as f64);
    let flown = value("controls_flown_total", &[("airplane", "2")]);
    assert!(flown >= now.nodes[2].flown as f64, "{flown}");
    for airplane in ["0", "1", "2"] {
        assert_eq!(value("node_up", &[("airplane", airplane)]), 1.0);
        assert!(value("packets_total", &[("airplane", airplane)]) > 0.0);
    }
    let until = Instant::now() + Duration::from_secs(30);
    loop {
        let (_, text) = ask(&at_node, "GET");
        let node_tells = families(&text);
        assert_eq!(node_tells.keys().cloned().collect::<BTreeSet<_>>(), all(&["node_cycle"]));
        // Each talk begins without any heard.
        if node_tells["sidestep_heard"].value(&[("airplane", "2")]) == Some(2.0) {
            break;
        }
        assert!(Instant::now() < until, "{text}");
    }
    assert_eq!(ask(&at_node, "POST").0, "HTTP/1.1 405 Method Not Allowed");
}

/// Returns the lines of a fleet's log as JSON, once something holds for one of them.
fn logs_until(program: &LinkProcess, holds: impl Fn(&Value) -> bool) -> Vec<Value> {
    let until = Instant::now() + Duration::from_secs(60);
    loop {
        let lines = program.logged();
        let read = |line: &String| serde_json::from_str(line);
        let read: Result<Vec<Value>, _> = lines.iter().map(read).collect();
        let read = read.unwrap_or_else(|e| panic!("{e} in {lines:?}"));
        if read.iter().any(&holds) {
            return read;
        }
        assert!(Instant::now() < until, "it is not logged: {lines:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn logs_are_json_on_request_and_say_of_what_cycle_talk_and_agent_they_are() {
    let folder = folder(&wide(&superconflict(3, "compact-team", 1_000_000, ""), 3_500));
    let mut fleet = job(folder.path(), Topology::Mesh, ClockMode::Realtime { speed: 20.0 });
    (fleet.common.json_log, fleet.common.log) = (true, "debug".into());
    let program = LinkProcess::start(&Job::Fleet(fleet));
    let lines = logs_until(&program, |line| line["talk"] == "done" && line["cycle"] == 3);
    for line in &lines {
        assert!(line["timestamp"].is_string() && line["message"].is_string(), "{line}");
        assert!(line["level"].as_str().is_some_and(|level| !level.is_empty()), "{line}");
    }
    let joined = lines.iter().filter(|line| line["message"] == "a node has joined");
    let joined: BTreeSet<u64> = joined.filter_map(|line| line["agent"].as_u64()).collect();
    assert_eq!(joined, BTreeSet::from([0, 1, 2]));
    for airplane in 0..3 {
        let own = lines.iter().filter(|line| line["agent"] == airplane && line["cycle"] == 2);
        let talks: Vec<&str> = own.filter_map(|line| line["talk"].as_str()).collect();
        assert_eq!(talks.last(), Some(&"done"), "airplane {airplane}: {talks:?}");
    }
}

#[test]
fn the_table_of_packets_has_a_row_for_each_that_was_counted() {
    for network in ["", "network = { loss = 0.1, duplication = 0.1, max_delay_s = 0.003 }"] {
        let folder = folder(&superconflict(3, "compact-team", 8, network));
        let out = folder.path().join("run");
        let (out_there, packets) = (Some(out.clone()), true);
        let lockstep = job(folder.path(), Topology::Mesh, ClockMode::Lockstep);
        let fleet = FleetJob { out: out_there, packets, ..lockstep };
        let program = LinkProcess::start(&Job::Fleet(fleet));
        let (summary, fleet) = program.complete();
        assert_eq!(program.end(), (Some(0), None));
        let table = sidestep_record::read_table(&out, "packets", ..).expect("a table");
        let column = |name: &str| -> Vec<u64> {
            let values = table.column(name).unwrap_or_else(|| panic!("no column {name}"));
            let number = |row| values.number(row).expect("none is missing");
            (0..table.rows()).map(|row| number(row) as u64).collect()
        };
        assert_eq!(summary["metrics"]["messages"], table.rows(), "{network}");
        let bytes: u64 = column("bytes").iter().sum();
        assert_eq!(bytes, fleet.nodes.iter().map(|node| node.bytes).sum::<u64>(), "{network}");
        let senders = column("sender");
        for node in &fleet.nodes {
            let own = senders.iter().filter(|sender| **sender == u64::from(node.agent)).count();
            assert_eq!(own as u64, node.packets, "airplane {} {network}", node.agent);
        }
        let (sent, arrives, copies) = (column("sent"), column("arrives"), column("copies"));
        for k in 0..table.rows() {
            let has_come = copies[k] > 0;
            assert_eq!(has_come, arrives[k] > 0, "row {k}");
            assert!(!has_come || arrives[k] > sent[k], "row {k}: it takes time");
        }
        let is_lossy = !network.is_empty();
        for count in [0, 2] {
            assert_eq!(copies.contains(&count), is_lossy, "copies {count} {network}");
        }
    }
}
