//! Robots as processes for a given time, of which one is decided by a vehicle in Python, with random kills and stops.
//!
//! `SIDESTEP_SOAK_S` and `PROPTEST_RNG_SEED` are as in `soak.rs`.

use crate::processes::{LinkProcess, folder, wait_until_gone};
use crate::soak::{own_memory_kb, variable};
use crate::vehicles::{MODULES, Vehicle, fleet_without_the_last_of, listens, vehicle_job};
use sidestep::kernel::Seed;
use sidestep::kernel::stream::{Purpose, Streams};
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::{ClockMode, FleetStatus, LinkMessage, NodeStatus};
use sidestep_session::{NoWatcher, RecordedRun, replay_all};
use sidestep_testing::{ProcessFault, StoppedProcesses, has_modules, root};
use std::time::{Duration, Instant};

/// The shipped fleet has six; the last one is decided by the vehicle.
const ROBOTS: u32 = 6;

/// Cycles in a second: twice as many as robots make steps by themselves.
const SPEED: f64 = 5.0;

/// Longest time in which a robot makes no step: a stop, the wait before its node is started again, and joining.
const MAX_ABSENCE: Duration = Duration::from_secs(60);

/// Returns times since the beginning, robots and faults, by rising time.
fn faults(seed: u64, lasts: Duration) -> Vec<(Duration, u32, ProcessFault)> {
    let streams = Streams::new(Seed(seed));
    let mut faults = Vec::new();
    let mut at = Duration::from_secs(5);
    for k in 0.. {
        let [gap, who, what, how_long] = streams.block(0, k, Purpose(1), 0);
        at += Duration::from_millis(1_000 + u64::from(gap % 9_000));
        if at >= lasts {
            break;
        }
        faults.push((at, who % ROBOTS, ProcessFault::random(what, how_long)));
    }
    faults
}

/// When each robot has last made a step.
struct Steps(Vec<(u64, Instant)>);

impl Steps {
    fn check(&mut self, now: &FleetStatus) {
        for (node, (flown, since)) in now.nodes.iter().zip(&mut self.0) {
            if node.flown > *flown {
                *flown = node.flown;
                *since = Instant::now();
            }
            assert!(since.elapsed() < MAX_ABSENCE, "robot {} hangs: {now:?}", node.agent);
        }
    }
}

#[test]
#[ignore = "a minute, or as long as SIDESTEP_SOAK_S says: see .ci/soak"]
fn robots_whose_nodes_and_vehicle_are_killed_and_stopped_go_on_and_are_replayed() {
    if !has_modules(MODULES) {
        return;
    }
    let lasts = Duration::from_secs(variable("SIDESTEP_SOAK_S").unwrap_or(60));
    let seed = variable("PROPTEST_RNG_SEED").unwrap_or(1);
    let shipped = std::fs::read_to_string(root().join("scenarios/robots/fleet.toml"));
    let text = shipped.expect("shipped").replace("cycles = 300", "cycles = 1000000");
    let folder = folder(&text);
    let clock = ClockMode::Realtime { speed: SPEED };
    let (mut fleet, job, server) = fleet_without_the_last_of(folder.path(), clock, ROBOTS);
    let node = LinkProcess::start(&vehicle_job(&job, &server, "tcp/127.0.0.1:0", ROBOTS - 1));
    let endpoint = listens(&node);
    let start = || Vehicle::start(ROBOTS - 1, &endpoint, 1_000_000_000);
    let mut vehicle = start();
    let planned = faults(seed, lasts);
    let mut faults = planned.iter().peekable();
    let mut stopped = StoppedProcesses::default();
    let mut steps = Steps(vec![(0, Instant::now()); ROBOTS as usize]);
    let began = Instant::now();
    let mut early_kb = None;
    let now = loop {
        let now = fleet.fleet("news of the fleet", |now| now.has_begun);
        steps.check(&now);
        // A twelfth of the time, as for airplanes.
        if early_kb.is_none() && began.elapsed() > lasts / 12 {
            early_kb = own_memory_kb(fleet.child.id());
        }
        stopped.wake();
        while let Some(&(_, robot, fault)) = faults.next_if(|(at, ..)| *at <= began.elapsed()) {
            // Its node is not the server's to start again, so the vehicle itself fails.
            let process = if robot == ROBOTS - 1 {
                Some(vehicle.id())
            } else {
                now.nodes[robot as usize].process
            };
            let Some(process) = process else { continue };
            if robot == ROBOTS - 1 && fault == ProcessFault::Kill {
                vehicle = start();
            } else {
                stopped.inflict(process, fault);
            }
        }
        if began.elapsed() > lasts {
            break now;
        }
    };
    drop(stopped);
    let late_kb = own_memory_kb(fleet.child.id());
    if let (Some(early_kb), Some(late_kb)) = (early_kb, late_kb) {
        println!("memory of the server: {early_kb} kB early, {late_kb} kB at the end");
        let most_kb = early_kb as f64 * 1.1 + 1024.0;
        assert!((late_kb as f64) <= most_kb, "the server grows: {early_kb} kB, then {late_kb} kB");
    }
    drop(fleet.stdin.take());
    fleet.until("the end", |message| matches!(message, LinkMessage::Ended { .. }).then_some(()));
    assert_eq!(fleet.end().0, Some(130), "it was told to end");
    drop(vehicle);
    wait_until_gone(&now, Duration::from_secs(5));
    let recorded = RecordedRun::open(&WORLDS, &folder.path().join("run")).expect("a run");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
    let sum = |count: fn(&NodeStatus) -> u64| now.nodes.iter().map(count).sum::<u64>();
    println!(
        "{} faults, {} cycles: {} controls carried out, {} late; {} lives; percept to control {:?} ms (half), \
         {:?} ms (99 %)",
        planned.len(),
        now.cycle,
        sum(|node| node.flown),
        sum(|node| node.late),
        sum(|node| node.lives),
        now.talk_p50_ms,
        now.talk_p99_ms
    );
}
