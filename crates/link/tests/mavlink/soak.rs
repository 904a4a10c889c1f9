//! Flights of vehicles by MAVLink, one after the other for a given time, with random faults of vehicles, links and nodes.
//!
//! `SIDESTEP_SOAK_S` is the number of seconds (60 if not set), `PROPTEST_RNG_SEED` the seed of the faults.

use crate::PEER;
use crate::flights::{Flight, guard, scenario, separation_m};
use serde_json::json;
use sidestep::kernel::Seed;
use sidestep::kernel::stream::{Purpose, Streams};
use sidestep::worlds::WORLDS;
use sidestep_session::{NoWatcher, RecordedRun, replay_all};
use sidestep_testing::{ProcessFault, StoppedProcesses, has_modules};
use std::time::{Duration, Instant, SystemTime};

const AIRPLANES: usize = 6;

/// Cycles of a second in a flight, which leads all of them through the middle of a circle.
const CYCLES: u64 = 24;

/// Time in which all find each other and take up their speed.
const GATHERING_TIME: Duration = Duration::from_secs(30);

/// What happens to a vehicle, to its link, or to its node.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// Its node is killed and started again, or stopped for a time.
    Node(ProcessFault),
    /// Its autopilot boots, for so many seconds.
    Reboot(f64),
    /// All that it says comes so many seconds later from now on.
    Lag(f64),
    /// It says nothing anymore.
    Silence,
    /// A pilot takes over by another mode.
    Mode,
    /// The clock in its messages stands.
    FrozenClock,
    /// It refuses to brake and to loiter, and its node is stopped for so long that it has to be handed over.
    Refusal(Duration),
}

impl Fault {
    fn random(what: u32, how_much: u32) -> Self {
        let amount = f64::from(how_much % 1_000) / 1_000.0;
        match what % 8 {
            0 | 1 => Self::Node(ProcessFault::random(what / 8, how_much)),
            2 => Self::Reboot(0.5 + 6.0 * amount),
            3 => Self::Lag(6.0 * amount),
            4 => Self::Silence,
            5 => Self::Mode,
            6 => Self::FrozenClock,
            _ => Self::Refusal(Duration::from_secs_f64(1.0 + 4.0 * amount)),
        }
    }

    fn inflict(self, flight: &mut Flight, vehicle: usize, stopped: &mut StoppedProcesses) {
        let process = flight.nodes[vehicle].process_id();
        match self {
            Self::Node(ProcessFault::Kill) => flight.restart(vehicle),
            Self::Node(fault) => {
                stopped.inflict(process, fault);
            }
            Self::Reboot(seconds) => {
                let request = json!({ "do": "reboot", "vehicle": vehicle, "seconds": seconds });
                assert_eq!(flight.vehicles.ask(&request), "done");
            }
            Self::Lag(seconds) => {
                flight.vehicles.set(&json!({ "vehicle": vehicle, "lag": seconds }));
            }
            Self::Silence => flight.vehicles.set(&json!({ "vehicle": vehicle, "silent": true })),
            // It loiters.
            Self::Mode => flight.vehicles.set(&json!({ "vehicle": vehicle, "mode": 5 })),
            Self::FrozenClock => {
                flight.vehicles.set(&json!({ "vehicle": vehicle, "frozen": true }))
            }
            Self::Refusal(time) => {
                let deny = json!({ "vehicle": vehicle, "deny": { "176": 2, "17": 4 } });
                flight.vehicles.set(&deny);
                stopped.inflict(process, ProcessFault::Stop(time));
            }
        }
    }
}

/// Returns times since the first cycle, vehicles and faults of a flight, by rising time: of three vehicles at most.
fn faults(seed: u64, round: u32) -> Vec<(Duration, usize, Fault)> {
    let streams = Streams::new(Seed(seed));
    let [count, ..] = streams.block(round, 0, Purpose(1), 0);
    let mut faults = Vec::new();
    let mut at = Duration::ZERO;
    for k in 0..u64::from(count % 4) {
        let [gap, who, what, how_much] = streams.block(round, k, Purpose(2), 0);
        at += Duration::from_millis(500 + u64::from(gap % 6_000));
        faults.push((at, who as usize % AIRPLANES, Fault::random(what, how_much)));
    }
    faults
}

fn variable(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

/// Flies one time with the faults, and returns the vehicles of which something is promised.
fn fly(flight: &mut Flight, faults: &[(Duration, usize, Fault)]) -> Vec<usize> {
    let mut stopped = StoppedProcesses::default();
    flight.wait_for("the first cycle", |nodes| nodes.iter().all(|node| node.last.cycle >= 1));
    let began = Instant::now();
    let mut faults_left = faults.iter().peekable();
    while !flight.has_ended() {
        flight.read();
        stopped.wake();
        while let Some(&(_, vehicle, fault)) =
            faults_left.next_if(|(at, ..)| *at <= began.elapsed())
        {
            fault.inflict(flight, vehicle, &mut stopped);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(stopped);
    flight.read();
    let mut without = flight.handed_over();
    without.extend(faults.iter().map(|&(_, vehicle, _)| vehicle));
    without.sort_unstable();
    without.dedup();
    (0..AIRPLANES).filter(|vehicle| !without.contains(vehicle)).collect()
}

#[test]
#[ignore = "a minute, or as long as SIDESTEP_SOAK_S says: see .ci/soak"]
fn vehicles_that_no_fault_meets_keep_apart_whatever_happens_to_the_others() {
    if !has_modules(PEER) {
        return;
    }
    let lasts = Duration::from_secs(variable("SIDESTEP_SOAK_S").unwrap_or(60));
    let seed = variable("PROPTEST_RNG_SEED").unwrap_or(1);
    let flown = scenario(AIRPLANES, 100.0, CYCLES);
    let least_m = separation_m(&flown);
    let began = Instant::now();
    let mut rounds = 0;
    let mut fault_count = 0;
    let mut judged = 0;
    let mut handed_over = 0;
    let mut overall_nearest_m = f64::INFINITY;
    while began.elapsed() < lasts {
        let faults = faults(seed, rounds);
        println!("flight {rounds}: {faults:?}");
        let folder = tempfile::tempdir().expect("a folder");
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("after 1970");
        let start_s = Some((now + GATHERING_TIME).as_secs_f64());
        let mut flight = Flight::start_at(folder.path(), &flown, &guard(), start_s);
        let healthy = fly(&mut flight, &faults);
        let without: Vec<usize> = (0..AIRPLANES).filter(|k| !healthy.contains(k)).collect();
        let nearest_m = flight.tell(&without);
        let recorded = RecordedRun::open(&WORLDS, &folder.path().join("run")).expect("a run");
        replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
        assert!(nearest_m >= least_m, "{nearest_m} m, without {without:?}");
        overall_nearest_m = overall_nearest_m.min(nearest_m);
        judged += healthy.len();
        handed_over += flight.handed_over().len();
        fault_count += faults.len();
        rounds += 1;
    }
    println!(
        "seed {seed}, {} s, {rounds} flights of {AIRPLANES}: {fault_count} faults, {handed_over} vehicles handed over; \
         {judged} vehicles without faults, of which no two were nearer than {overall_nearest_m:.1} m ({least_m} m promised)",
        began.elapsed().as_secs()
    );
}
