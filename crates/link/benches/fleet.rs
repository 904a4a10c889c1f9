//! Benchmarks of fleets: a round of a team, a whole super-conflict beside one process, the processor time of both, the
//! time that a group takes to go on after the loss of a member, memory and bytes of nodes.
//!
//! Percentiles, and ratios within one run: `cargo bench -p sidestep-link`. Words select parts: `round`, `conflict`,
//! `cost`, `recovery`, `nodes`. `SIDESTEP_BENCH_S` is the number of seconds that the last one flies (60).

use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_link::protocol::{FleetMember, Incarnation};
use sidestep_link::wire::endpoint::reserve_port;
use sidestep_link::wire::zenoh::ZenohWire;
use sidestep_link::wire::{PeerId, Wire};
use sidestep_session::fleet::{
    ClockMode, CommonSettings, FleetJob, FleetStatus, Job, JobScenario, LinkMessage, Topology,
    link_command,
};
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Barrier};
use std::time::{Duration, Instant};

const TIMEOUT: Duration = Duration::from_secs(60);

fn main() {
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let is_wanted = |name: &str| words.is_empty() || words.iter().any(|word| word == name);
    if is_wanted("round") {
        rounds(10, 2_000);
    }
    if is_wanted("conflict") {
        conflict(10);
    }
    if is_wanted("cost") {
        for topology in [Topology::Mesh, Topology::Multicast] {
            cost(10, topology);
        }
    }
    if is_wanted("recovery") {
        recovery(6, 24);
    }
    if is_wanted("nodes") {
        let seconds = std::env::var("SIDESTEP_BENCH_S").ok().and_then(|text| text.parse().ok());
        for topology in [Topology::Mesh, Topology::Multicast] {
            nodes(50, Duration::from_secs(seconds.unwrap_or(60)), topology);
        }
    }
}

/// Prints the time of a round in which each of a team hears all others.
fn rounds(team: u32, rounds: usize) {
    let free = || reserve_port("tcp/127.0.0.1:0").expect("a free port");
    let server = free().endpoint;
    let _server = ZenohWire::server_wire(std::slice::from_ref(&server), None).expect("a server");
    let held: Vec<_> = (0..team).map(|_| free()).collect();
    let members: Vec<FleetMember> = (0..)
        .zip(&held)
        .map(|(agent, held)| FleetMember {
            agent,
            incarnation: Incarnation(0),
            listens: vec![held.endpoint.clone()],
            session: None,
        })
        .collect();
    drop(held);
    let barrier = Arc::new(Barrier::new(team as usize));
    let nodes: Vec<_> = (0..team)
        .map(|agent| {
            let (server, members, barrier) = (server.clone(), members.clone(), barrier.clone());
            std::thread::spawn(move || {
                let me = PeerId::Node(agent);
                let wire = ZenohWire::node_wire(me, &[server], None, TIMEOUT).expect("it answers");
                let own = members[agent as usize].listens.iter();
                let held = own.map(|endpoint| reserve_port(endpoint).expect("free")).collect();
                let mut wire = wire.with_listeners(held);
                wire.connect_mesh(agent, &members).expect("a mesh");
                barrier.wait();
                meet(&mut wire, agent, team);
                barrier.wait();
                (0..rounds as u32)
                    .map(|round| one_round(&mut wire, (agent, team), round + 1))
                    .collect::<Vec<_>>()
            })
        })
        .collect();
    let times = nodes.into_iter().map(|node| node.join().expect("no panic"));
    let mut times: Vec<Duration> = times.flatten().collect();
    times.sort_unstable();
    println!("one round of a team of {team}, 500 B, all hear all: {}", percentiles(&times));
}

/// Returns the percentiles of times in rising order, in words.
fn percentiles(times: &[Duration]) -> String {
    let at = |part: f64| 1e3 * times[(part * (times.len() - 1) as f64) as usize].as_secs_f64();
    format!("p50 {:.2} ms, p99 {:.2} ms", at(0.5), at(0.99))
}

/// A frame of a round: its number, the sender, and the payload of a small message.
fn frame(round: u32, agent: u32) -> Vec<u8> {
    let mut frame = [round.to_le_bytes(), agent.to_le_bytes()].concat();
    frame.resize(500, 0);
    frame
}

fn number(bytes: &[u8]) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|k| bytes[k]))
}

/// Sends frames until all others have been heard, and lets them hear it, too.
fn meet(wire: &mut dyn Wire, agent: u32, team: u32) {
    let mut heard = BTreeMap::new();
    let until = Instant::now() + TIMEOUT;
    while heard.len() + 1 < team as usize && Instant::now() < until {
        send_frame(wire, agent, team, 0);
        while let Some(bytes) = wire.receive(Duration::from_millis(20)) {
            heard.insert(number(&bytes[4..]), ());
        }
    }
    assert!(heard.len() + 1 == team as usize, "not all are there");
    send_frame(wire, agent, team, 0);
    std::thread::sleep(Duration::from_millis(500));
    while wire.receive(Duration::from_millis(50)).is_some() {}
}

fn send_frame(wire: &mut dyn Wire, agent: u32, team: u32, round: u32) {
    let others: Vec<PeerId> = (0..team).filter(|other| *other != agent).map(PeerId::Node).collect();
    wire.send(&others, &frame(round, agent));
}

fn one_round(wire: &mut dyn Wire, (agent, team): (u32, u32), round: u32) -> Duration {
    thread_local! {
        static EARLY: std::cell::RefCell<BTreeMap<u32, u32>> = const { std::cell::RefCell::new(BTreeMap::new()) };
    }
    let began = Instant::now();
    send_frame(wire, agent, team, round);
    EARLY.with_borrow_mut(|heard| {
        while heard.get(&round).copied().unwrap_or(0) + 1 < team {
            let bytes = wire.receive(TIMEOUT).expect("nothing is lost on loopback");
            *heard.entry(number(&bytes)).or_default() += 1;
        }
        heard.remove(&round);
    });
    began.elapsed()
}

fn text(n: u32, cycles: u64) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nseed = 1\ncycles = {cycles}\n[airspace]\n\
         deployment = \"compact-team\"\n[airspace.generator]\nkind = \"superconflict\"\nn = {n}\n"
    )
}

fn job(folder: &Path, clock: ClockMode) -> FleetJob {
    let build = WORLDS.build().into();
    let flown = JobScenario { file: folder.join("s.toml"), overrides: Vec::new(), build };
    let (tls, metrics, log) = (None, None, "error".to_string());
    FleetJob {
        common: CommonSettings {
            flown,
            tls,
            is_insecure: false,
            lease_s: 30.0,
            metrics,
            json_log: false,
            log,
        },
        nodes: None,
        clock,
        topology: Topology::Mesh,
        multicast_group: None,
        listen: vec!["tcp/127.0.0.1:0".into()],
        out: None,
        replace: false,
        packets: false,
    }
}

/// Flies a fleet; `look` may end it. Returns the digest, and the fleet at the end.
fn fly(job: FleetJob, mut look: impl FnMut(&FleetStatus) -> bool) -> (String, FleetStatus) {
    let mut command = link_command(env!("CARGO_BIN_EXE_sidestep-link"));
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program starts");
    let mut stdin = child.stdin.take();
    writeln!(stdin.as_mut().expect("a pipe"), "{}", serde_json::json!(Job::Fleet(job)))
        .expect("told");
    let mut ended = None;
    for line in BufReader::new(child.stdout.take().expect("a pipe")).lines().map_while(Result::ok) {
        match serde_json::from_str(&line).expect("a line that is known") {
            LinkMessage::Fleet(now) if !look(&now) => drop(stdin.take()),
            LinkMessage::Ended { summary, fleet, .. } => {
                ended = Some((summary["digest"].as_str().unwrap_or_default().to_string(), fleet));
            }
            LinkMessage::Failed(failed) if !failed.is_interrupted => panic!("{failed:?}"),
            _ => {}
        }
    }
    child.wait().expect("it ends");
    ended.expect("it has ended")
}

/// Prints the time of a whole super-conflict, as processes beside one process.
fn conflict(n: u32) {
    let folder = tempfile::tempdir().expect("a folder");
    let text = text(n, 1000);
    std::fs::write(folder.path().join("s.toml"), &text).expect("written");
    let source = Source::new("s.toml", &*text, "");
    let compiled = WORLDS.compile(&source).expect("a scenario");
    let mut ratios = Vec::new();
    for _ in 0..3 {
        let began = Instant::now();
        let journey =
            ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, OutputPaths::default())
                .expect("started");
        let alone = journey.run_to_end(&NoWatcher).expect("flown");
        let alone_s = began.elapsed().as_secs_f64();
        let mut first = None;
        let (digest, fleet) = fly(job(folder.path(), ClockMode::Lockstep), |now| {
            // Processes start once, however long the flight is.
            first = first.or(now.has_begun.then(Instant::now));
            true
        });
        let fleet_s = first.map_or(f64::NAN, |first| first.elapsed().as_secs_f64());
        assert_eq!(digest, alone.digest, "the digest of one process");
        ratios.push(fleet_s / alone_s);
        let packets: u64 = fleet.nodes.iter().map(|node| node.packets).sum();
        println!(
            "a super-conflict of {n}, {} cycles: one process {alone_s:.2} s, {n} processes {fleet_s:.2} s, \
             {packets} packets; talks p50 {:.0} ms, p99 {:.0} ms",
            alone.cycles,
            fleet.talk_p50_ms.unwrap_or(f64::NAN),
            fleet.talk_p99_ms.unwrap_or(f64::NAN)
        );
    }
    ratios.sort_by(f64::total_cmp);
    println!("  median of the ratios: {:.1}", ratios[1]);
}

/// Processor and wall time, in seconds.
#[derive(Clone, Copy)]
struct Cost {
    cpu_s: f64,
    wall_s: f64,
}

/// Prints the processor time of a whole super-conflict, as processes beside one process: of all processes together, with
/// and without their start.
fn cost(n: u32, topology: Topology) {
    let mut ratios = Vec::new();
    for _ in 0..3 {
        let (alone, alone_digest) = cost_of_one_process(n);
        let (start, _) = cost_of_fleet(n, 1, topology);
        let (fleet, digest) = cost_of_fleet(n, 1000, topology);
        assert_eq!(digest, alone_digest, "the digest of one process");
        println!(
            "processor time of a super-conflict of {n}, {topology:?}: one process {:.2} s, {n} processes {:.2} s, {:.2} s of it \
             for the start and one cycle",
            alone.cpu_s, fleet.cpu_s, start.cpu_s
        );
        let without_start = (fleet.cpu_s - start.cpu_s) / alone.cpu_s;
        ratios.push([fleet.cpu_s / alone.cpu_s, without_start, fleet.wall_s / alone.wall_s]);
    }
    let median = |k: usize| {
        let mut values: Vec<f64> = ratios.iter().map(|ratio| ratio[k]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    println!(
        "  medians of the ratios: processor time {:.1}, without the start {:.1}; time by the clock {:.1}",
        median(0),
        median(1),
        median(2)
    );
}

/// Returns what a super-conflict costs in this process, and its digest.
fn cost_of_one_process(n: u32) -> (Cost, String) {
    let source = Source::new("s.toml", &*text(n, 1000), "");
    let began = Instant::now();
    let cpu_s = cpu_seconds();
    let compiled = WORLDS.compile(&source).expect("a scenario");
    let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, OutputPaths::default())
        .expect("started");
    let digest = run.run_to_end(&NoWatcher).expect("flown").digest;
    let wall_s = began.elapsed().as_secs_f64();
    (Cost { cpu_s: cpu_seconds() - cpu_s, wall_s }, digest)
}

/// Returns what a super-conflict costs as a fleet, from the start of its processes to the end of the last one, and its
/// digest.
fn cost_of_fleet(n: u32, cycles: u64, topology: Topology) -> (Cost, String) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.toml"), text(n, cycles)).expect("written");
    let began = Instant::now();
    let cpu_s = cpu_seconds();
    let job = FleetJob { topology, ..job(folder.path(), ClockMode::Lockstep) };
    let (digest, _) = fly(job, |_| true);
    let wall_s = began.elapsed().as_secs_f64();
    (Cost { cpu_s: cpu_seconds() - cpu_s, wall_s }, digest)
}

/// Returns the processor time of this process, and of all that it and its children have waited for, in seconds.
fn cpu_seconds() -> f64 {
    /// Clock ticks in a second: Linux counts in these on every machine.
    const TICKS_PER_S: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").expect("Linux");
    // The name of the program, in parentheses, may have spaces.
    let after_name = text.rsplit(')').next().unwrap_or_default();
    // In user mode and in the kernel, of this process and of its children.
    let ticks = after_name.split_whitespace().skip(11).take(4);
    ticks.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / TICKS_PER_S
}

/// News of a fleet: its state, or the part of a cycle to which an airplane has come.
enum FleetNews {
    Fleet(FleetStatus),
    Part { airplane: u32, cycle: u64, talk: String, at: Instant },
}

/// Starts a fleet; the second channel tells its news until it ends.
fn start_watched(job: FleetJob) -> (Child, Receiver<FleetNews>) {
    let mut command = link_command(env!("CARGO_BIN_EXE_sidestep-link"));
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let stdin = child.stdin.as_mut().expect("a pipe");
    writeln!(stdin, "{}", serde_json::json!(Job::Fleet(job))).expect("told");
    let (tells, news) = channel();
    let out = BufReader::new(child.stdout.take().expect("a pipe"));
    let logs = BufReader::new(child.stderr.take().expect("a pipe"));
    let message = tells.clone();
    std::thread::spawn(move || {
        for line in out.lines().map_while(Result::ok) {
            if let Ok(LinkMessage::Fleet(now)) = serde_json::from_str(&line) {
                let _ = message.send(FleetNews::Fleet(now));
            }
        }
    });
    std::thread::spawn(move || {
        for line in logs.lines().map_while(Result::ok) {
            let line: serde_json::Value = serde_json::from_str(&line).expect("JSON");
            let number = |name: &str| line[name].as_u64();
            if let (Some(airplane), Some(cycle), Some(talk)) =
                (number("agent"), number("cycle"), line["talk"].as_str())
            {
                let (airplane, talk, at) = (airplane as u32, talk.to_string(), Instant::now());
                let _ = tells.send(FleetNews::Part { airplane, cycle, talk, at });
            }
        }
    });
    (child, news)
}

/// A node that was killed, and the others that have had their controls since then.
struct KilledNode {
    at: Instant,
    cycle: u64,
    done: BTreeSet<u32>,
}

/// Returns airplanes side by side on paths that cross far ahead: they decide together in every cycle, for half an
/// hour.
fn abreast(n: u32) -> String {
    let airplane = |k: u32| {
        let aside_m = 700.0 * (f64::from(k) - f64::from(n - 1) / 2.0);
        format!(
            "[[airplanes]]\nat_m = [-60000.0, {aside_m:?}]\nheading_deg = 0.0\nway_points_m = [[60000.0, {:?}]]\n",
            -aside_m
        )
    };
    let head = "format = 1\nworld = \"airspace\"\nseed = 1\ncycles = 1000000\n[airspace]\ndeployment = \"pim\"\n";
    std::iter::once(head.to_string()).chain((0..n).map(airplane)).collect()
}

/// Prints the time until all others of a group have their controls after a member, where the coordinator is or
/// comes next, is killed while they decide.
fn recovery(n: u32, kills: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.toml"), abreast(n)).expect("written");
    let mut job = job(folder.path(), ClockMode::Realtime { speed: 5.0 });
    (job.common.json_log, job.common.log) = (true, "debug".into());
    let (mut child, news) = start_watched(job);
    let mut killer = Killer::new();
    let (mut times, mut killed): (Vec<Duration>, Option<KilledNode>) = (Vec::new(), None);
    let (mut now, mut since) = (FleetStatus::default(), Instant::now());
    while times.len() < kills {
        assert!(since.elapsed() < TIMEOUT, "nobody could be killed, or has come back: {now:?}");
        let victim = times.len() as u32 % n;
        match news.recv_timeout(TIMEOUT).expect("the fleet flies") {
            FleetNews::Fleet(fleet) => now = fleet,
            FleetNews::Part { airplane, cycle, talk, at } => match &mut killed {
                None if airplane == victim && talk == "decide" => {
                    let Some(node) = now.nodes.get(victim as usize) else { continue };
                    // All have recovered from the kill before.
                    let is_whole = now.nodes.iter().all(|node| node.heard + 1 == n as usize);
                    if let Some(process) = node.process.filter(|_| is_whole) {
                        killer.kill(process);
                        let done = BTreeSet::new();
                        killed = Some(KilledNode { at: Instant::now(), cycle, done });
                    }
                }
                Some(lost) if airplane != victim && talk == "done" && cycle >= lost.cycle => {
                    lost.done.insert(airplane);
                    if lost.done.len() + 1 == n as usize {
                        times.push(at.saturating_duration_since(lost.at));
                        (killed, since) = (None, Instant::now());
                    }
                }
                _ => {}
            },
        }
    }
    drop(child.stdin.take());
    child.wait().expect("it ends");
    times.sort_unstable();
    println!(
        "a host of the coordinator is killed, {n} airplanes, {kills} times, dt 1 s: the others have their controls after {}",
        percentiles(&times)
    );
}

/// A shell that kills processes: to start a program for each would take longer than a talk.
struct Killer(Child);

impl Killer {
    fn new() -> Self {
        let mut shell = Command::new("sh");
        shell.args(["-c", "while read process; do kill -KILL $process; done"]);
        Self(shell.stdin(Stdio::piped()).spawn().expect("a shell"))
    }

    fn kill(&mut self, process: u32) {
        writeln!(self.0.stdin.as_mut().expect("a pipe"), "{process}").expect("told");
    }
}

impl Drop for Killer {
    fn drop(&mut self) {
        drop(self.0.stdin.take());
        let _ = self.0.wait();
    }
}

/// Prints the cost of many nodes in real time: deadlines missed, memory, bytes.
fn nodes(n: u32, flown_for: Duration, topology: Topology) {
    let folder = tempfile::tempdir().expect("a folder");
    // As wide as the distance that they fly in that time, so that they meet in the middle of it.
    let radius_m = 8_000.0 + 35.0 * flown_for.as_secs_f64() / 2.0;
    let text = format!("{}radius_m = {radius_m:?}\n", text(n, 1_000_000));
    std::fs::write(folder.path().join("s.toml"), text).expect("written");
    let (mut first, mut memory_kb) = (None, [0, 0]);
    let job = FleetJob { topology, ..job(folder.path(), ClockMode::Realtime { speed: 1.0 }) };
    let (_, fleet) = fly(job, |now| {
        if now.has_begun {
            let since = *first.get_or_insert(Instant::now());
            let nodes = now.nodes.iter();
            let each: Vec<[u64; 2]> = nodes.filter_map(|node| memory(node.process?)).collect();
            memory_kb = [0, 1].map(|k| each.iter().map(|kb| kb[k]).max().unwrap_or(0));
            return since.elapsed() < flown_for;
        }
        true
    });
    let flown_s = flown_for.as_secs_f64();
    let late: u64 = fleet.nodes.iter().map(|node| node.late).sum();
    let bytes: u64 = fleet.nodes.iter().map(|node| node.bytes).sum();
    println!(
        "{n} nodes, {topology:?}, for {flown_s} s, {} cycles: {late} controls late, {} cycles of the server late; \
         {:.0} bytes a node and second; memory of a node at most {:.1} MB resident, {:.1} MB as its share",
        fleet.cycle,
        fleet.late_cycles,
        bytes as f64 / f64::from(n) / flown_s,
        memory_kb[0] as f64 / 1e3,
        memory_kb[1] as f64 / 1e3,
    );
}

/// Returns the memory of a process in kB: all that is resident, and its share of it. The program itself is resident once
/// for all nodes.
fn memory(process: u32) -> Option<[u64; 2]> {
    let text = std::fs::read_to_string(format!("/proc/{process}/smaps_rollup")).ok()?;
    let of = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name))?;
        line.split_whitespace().nth(1)?.parse().ok()
    };
    Some([of("Rss:")?, of("Pss:")?])
}
