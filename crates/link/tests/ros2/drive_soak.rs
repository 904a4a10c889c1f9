//! Robots that are driven for a given time, while their programs are killed, stopped and interrupted, and their measurements stop.
//!
//! `SIDESTEP_SOAK_S` is the number of seconds (60 if not set), `PROPTEST_RNG_SEED` the seed of the faults.

use crate::PEER;
use crate::drive::{DriveProcess, Plants, ScenarioFolder, job};
use serde_json::{Value, json};
use sidestep::kernel::Seed;
use sidestep::kernel::stream::{Purpose, Streams};
use sidestep_session::fleet::{DriveJob, DriveStatus};
use sidestep_testing::{ProcessFault, StoppedProcesses, has_modules, try_signal};
use std::path::Path;
use std::time::{Duration, Instant};

/// The start of each robot, a column, a row and degrees, and the other end of its trips, a column and a row.
const WAYS: [([u32; 3], [u32; 2]); 4] =
    [([0, 0, 0], [10, 6]), ([11, 7, 180], [1, 1]), ([0, 7, 270], [10, 1]), ([11, 0, 90], [1, 6])];

/// Longest time without a new action: a stop, a start, and others that stand in the way.
const MAX_ABSENCE: Duration = Duration::from_secs(120);

/// Steps of a twentieth of a second after which a base without commands stands.
const BASE_TIMEOUT_STEPS: u32 = 10;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// Its program is killed and started again, or stopped for a time.
    Program(ProcessFault),
    /// Its program is told to end, and started again.
    Interrupt,
    /// No robot measures anything for a time.
    Silence(Duration),
}

impl Fault {
    fn random(what: u32, how_long: u32) -> Self {
        match what % 6 {
            0 => Self::Interrupt,
            1 => Self::Silence(Duration::from_millis(u64::from(500 + how_long % 4_000))),
            _ => Self::Program(ProcessFault::random(what / 6, how_long)),
        }
    }
}

/// Returns times since the beginning, robots and faults, by rising time.
fn faults(seed: u64, lasts: Duration) -> Vec<(Duration, usize, Fault)> {
    let streams = Streams::new(Seed(seed));
    let mut faults = Vec::new();
    let mut at = Duration::from_secs(5);
    for k in 0.. {
        let [gap, who, what, how_long] = streams.block(0, k, Purpose(1), 0);
        at += Duration::from_millis(2_000 + u64::from(gap % 9_000));
        if at >= lasts {
            break;
        }
        faults.push((at, who as usize % WAYS.len(), Fault::random(what, how_long)));
    }
    faults
}

/// Returns the scenario: each robot goes back and forth for as long as there are goals.
fn scenario(trips: usize) -> String {
    let ways = WAYS.map(|(start, there)| {
        let back = [start[0], start[1]];
        let goals: Vec<[u32; 2]> = [there, back].into_iter().cycle().take(trips).collect();
        (start, goals)
    });
    crate::drive::scenario_with(1_000_000, &ways)
}

/// A robot's program, and what it has done so far.
struct Driver {
    drive: DriveProcess,
    last: DriveStatus,
    moved: Instant,
    /// Of all its lives.
    actions: u64,
    trips: u64,
}

impl Driver {
    fn start(file: &Path, robot: usize, port: u16) -> Self {
        let job = job(file, robot as u32, port);
        let drive = DriveProcess::start(DriveJob { trips: None, ..job });
        Self { drive, last: DriveStatus::default(), moved: Instant::now(), actions: 0, trips: 0 }
    }

    fn read(&mut self) {
        let Some(now) = self.drive.news() else { return };
        if now.actions > self.last.actions {
            self.moved = Instant::now();
        }
        self.last = now;
    }

    /// Counts what this life has done.
    fn sum(&mut self) {
        self.actions += self.last.actions;
        self.trips += self.last.trips;
        assert_eq!(self.last.unreadable, 0, "{:?}", self.last);
        self.last = DriveStatus::default();
    }

    fn restart(&mut self, file: &Path, robot: usize, port: u16) {
        self.sum();
        let Self { actions, trips, moved, .. } = *self;
        *self = Self { actions, trips, moved, ..Self::start(file, robot, port) };
    }
}

#[test]
#[ignore = "a minute, or as long as SIDESTEP_SOAK_S says: see .ci/soak"]
fn robots_whose_programs_are_killed_stopped_and_interrupted_go_on_and_touch_nothing() {
    if !has_modules(PEER) {
        return;
    }
    let seconds = std::env::var("SIDESTEP_SOAK_S").ok().and_then(|word| word.parse().ok());
    let lasts = Duration::from_secs(seconds.unwrap_or(60));
    let seed = std::env::var("PROPTEST_RNG_SEED").ok().and_then(|word| word.parse().ok());
    let planned = faults(seed.unwrap_or(1), lasts);
    // A trip takes longer than ten seconds.
    let folder = ScenarioFolder::new(&scenario(2 + lasts.as_secs() as usize / 10));
    let file = folder.path("s.toml");
    let starts = WAYS.map(|(start, _)| start);
    let mut plants = Plants::start_with(&starts, json!({ "stop_after": BASE_TIMEOUT_STEPS }));
    let port = plants.port;
    let mut drivers: Vec<Driver> =
        (0..WAYS.len()).map(|robot| Driver::start(&file, robot, port)).collect();
    let mut faults = planned.iter().peekable();
    let mut stopped = StoppedProcesses::default();
    let mut silent_until: Option<Instant> = None;
    let began = Instant::now();
    while began.elapsed() < lasts {
        for (robot, driver) in drivers.iter_mut().enumerate() {
            driver.read();
            assert!(driver.moved.elapsed() < MAX_ABSENCE, "robot {robot}: {:?}", driver.last);
        }
        stopped.wake();
        if silent_until.take_if(|until| *until <= Instant::now()).is_some() {
            assert_eq!(plants.ask("speak"), "speaks");
        }
        while let Some(&(_, robot, fault)) = faults.next_if(|(at, ..)| *at <= began.elapsed()) {
            match fault {
                Fault::Program(ProcessFault::Kill) => drivers[robot].restart(&file, robot, port),
                Fault::Program(fault) => {
                    stopped.inflict(drivers[robot].drive.id(), fault);
                }
                Fault::Interrupt => {
                    // It may be stopped, and would not hear.
                    try_signal(drivers[robot].drive.id(), "CONT");
                    drivers[robot].last = drivers[robot].drive.interrupt();
                    drivers[robot].restart(&file, robot, port);
                }
                Fault::Silence(time) => {
                    silent_until = Some(Instant::now() + time);
                    // It answers once all of them stand, by their program or by their base.
                    plants.ask("silence");
                }
            }
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    // All hear that it is the end.
    drop(stopped);
    plants.ask("speak");
    for driver in &mut drivers {
        driver.last = driver.drive.interrupt();
        driver.sum();
    }
    assert_eq!(plants.ask("silence")["velocities"], json!(vec![[0.0, 0.0]; WAYS.len()]));
    let report = plants.ask("report");
    let sum = |name: &str| -> u64 {
        let robots = report.as_array().expect("robots");
        robots.iter().map(|robot: &Value| robot[name].as_u64().expect("a count")).sum()
    };
    let actions: u64 = drivers.iter().map(|driver| driver.actions).sum();
    let trips: u64 = drivers.iter().map(|driver| driver.trips).sum();
    println!(
        "{} s: {} faults; {actions} actions, {trips} trips, {} commands; bases stood by themselves {} times; {} touches",
        lasts.as_secs(),
        planned.len(),
        sum("commands"),
        sum("timeouts"),
        sum("touches")
    );
    assert_eq!(sum("touches"), 0, "{report}");
}
