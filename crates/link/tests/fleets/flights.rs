//! Flights in real time whose processes are killed: what was flown is on disk, and nothing else is made of it.

use crate::processes::{LinkProcess, folder, job, signal, wait_until_gone};
use crate::support::{superconflict, wide};
use sidestep::kernel::Cycle;
use sidestep::kernel::ports::ColumnValues;
use sidestep::worlds::WORLDS;
use sidestep_record::{CycleOrigin, Manifest, OriginRange, RunReader, Status, read_table, tables};
use sidestep_session::fleet::{ClockMode, FleetJob, FleetStatus, Job, Topology};
use sidestep_session::{
    Error, ManagedRun, NoWatcher, RecordedRun, RunStatus, close_flight, replay_all, replay_to,
};
use sidestep_testing::try_signal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time longer than anything here takes.
const TIMEOUT: Duration = Duration::from_secs(300);

/// A fleet that flies, and its folder.
struct Flight {
    program: LinkProcess,
    out: PathBuf,
    _folder: tempfile::TempDir,
}

impl Flight {
    /// Starts a flight of 4 airplanes that would last for an hour.
    fn start() -> Self {
        let folder = folder(&wide(&superconflict(4, "compact-team", 100_000, ""), 1_000_000));
        let out = folder.path().join("run");
        let clock = ClockMode::Realtime { speed: 30.0 };
        let common = job(folder.path(), Topology::Mesh, clock);
        let job = FleetJob { out: Some(out.clone()), ..common };
        Self { program: LinkProcess::start(&Job::Fleet(job)), out, _folder: folder }
    }

    fn manifest(&self) -> Manifest {
        manifest(&self.out)
    }

    /// Waits until the first cycles are on disk while the fleet flies; returns the fleet.
    fn wait_until_recorded(&self, cycles: Cycle) -> FleetStatus {
        let fleet = self.program.fleet("all to fly", |now| now.cycle >= cycles);
        let until = Instant::now() + TIMEOUT;
        while self.manifest().cycles_done < cycles {
            assert!(Instant::now() < until, "nothing is on disk");
            std::thread::sleep(Duration::from_millis(5));
        }
        fleet
    }
}

fn manifest(out: &Path) -> Manifest {
    RunReader::open(out).expect("a run").manifest
}

fn flown(until: Cycle) -> OriginRange {
    OriginRange { from: 0, until, origin: CycleOrigin::Flown }
}

/// Returns the last cycle of which a table has rows.
fn last_cycle(out: &Path, table: &str) -> Option<Cycle> {
    let table = read_table(out, table, ..).expect("a table");
    let Some(ColumnValues::U64(cycles)) = table.column("cycle") else { panic!("no cycles") };
    cycles.iter().copied().max()
}

/// Checks everything that can be asked of a flight that was killed after some cycles.
fn check_killed_flight(out: &Path, at_least: Cycle) -> Cycle {
    let killed = manifest(out);
    let done = killed.cycles_done;
    assert!(
        done >= at_least && killed.status == Status::Running && killed.origins == [flown(done)]
    );
    for table in ["controls", "trajectories"] {
        assert!(last_cycle(out, table) >= Some(done - 1), "{table} {:?}", tables(out));
    }
    let Err(Error::Input(refused)) = ManagedRun::resume(&WORLDS, out, 1, None) else {
        panic!("a flight is not continued unasked")
    };
    assert!(refused.cause().contains(&format!("flown until cycle {done}")), "{refused}");
    assert_eq!(manifest(out), killed, "a refusal changes nothing");

    let closed = close_flight(&WORLDS, out, &NoWatcher).expect("closed");
    assert_eq!(closed.cycles, done);
    assert!(closed.to_error().to_string().contains("cut off"));
    let summary = closed.summary.expect("a summary of what was flown");
    assert_eq!((&summary["status"], &summary["cycles"]), (&"incomplete".into(), &done.into()));
    let cut = manifest(out);
    assert!(cut.is_cut_off && cut.status == Status::Incomplete && cut.origins == [flown(done)]);
    for table in tables(out).expect("tables") {
        assert!(last_cycle(out, &table).is_none_or(|last| last < done), "{table}");
        assert!(out.join(&table).is_dir(), "{table} is whole");
    }
    close_flight(&WORLDS, out, &NoWatcher).expect("closed already");
    assert_eq!(manifest(out), cut);
    let recorded = RecordedRun::open(&WORLDS, out).expect("a run");
    for cycle in [0, done / 2, done - 1] {
        let replayed = replay_to(&recorded, cycle, 1, &NoWatcher).expect("as it was flown");
        assert_eq!(replayed.compared_poses, 4, "cycle {cycle}");
    }
    let unknown = replay_all(&recorded, 1, &NoWatcher).err().expect("no digest was recorded");
    assert!(unknown.to_string().contains("cut off"), "{unknown}");
    done
}

#[test]
fn a_flight_whose_server_is_killed_is_on_disk_and_is_continued_only_if_asked_for() {
    let mut flight = Flight::start();
    let fleet = flight.wait_until_recorded(20);
    flight.program.child.kill().expect("killed");
    flight.program.child.wait().expect("ended");
    wait_until_gone(&fleet, TIMEOUT);
    let done = check_killed_flight(&flight.out, 20);

    // What is simulated from there is marked, also when it stops again and is resumed.
    let run = ManagedRun::simulate_flight(&WORLDS, &flight.out, 1, Some(done + 3)).expect("asked");
    assert_eq!(run.cycle(), done);
    let summary = run.run_to_end(&NoWatcher).expect("simulated");
    assert_eq!((summary.status, summary.cycles), (RunStatus::Incomplete, done + 3));
    let run = ManagedRun::resume(&WORLDS, &flight.out, 1, Some(done + 5)).expect("a simulation");
    assert_eq!(run.cycle(), done + 3);
    run.run_to_end(&NoWatcher).expect("simulated");
    let simulated = manifest(&flight.out);
    let rest = OriginRange { from: done, until: done + 5, origin: CycleOrigin::Simulated };
    assert!(simulated.origins == [flown(done), rest] && !simulated.is_cut_off, "{simulated:?}");
    let recorded = RecordedRun::open(&WORLDS, &flight.out).expect("a run");
    for cycle in [1, done - 1, done, done + 4] {
        let replayed = replay_to(&recorded, cycle, 1, &NoWatcher).expect("as recorded");
        assert_eq!(replayed.compared_poses, 4, "cycle {cycle}");
    }
}

#[test]
fn a_flight_of_which_all_processes_are_killed_is_on_disk() {
    let mut flight = Flight::start();
    let fleet = flight.wait_until_recorded(20);
    for node in fleet.nodes.iter().filter_map(|node| node.process) {
        let _ = try_signal(node, "KILL");
    }
    flight.program.child.kill().expect("killed");
    flight.program.child.wait().expect("ended");
    check_killed_flight(&flight.out, 20);
}

#[test]
fn a_flight_goes_on_without_a_node_that_is_killed_and_its_end_is_known_when_it_is_ended() {
    let mut flight = Flight::start();
    let fleet = flight.wait_until_recorded(5);
    signal(fleet.nodes[2].process.expect("a process"), "KILL");
    let later = flight.manifest().cycles_done + 10;
    flight.wait_until_recorded(later);
    drop(flight.program.stdin.take());
    let Flight { program, out, _folder } = flight;
    assert_eq!(program.end().0, Some(130));
    let ended = manifest(&out);
    let done = ended.cycles_done;
    assert!(ended.is_cut_off && done >= later && ended.origins == [flown(done)], "{ended:?}");
    assert!(last_cycle(&out, "trajectories") >= Some(done - 1));
    // The server knew its last state, so that the replay of the flight is confirmed.
    let recorded = RecordedRun::open(&WORLDS, &out).expect("a run");
    replay_all(&recorded, 1, &NoWatcher).expect("as it was flown");
    assert!(ManagedRun::resume(&WORLDS, &out, 1, None).is_err());
}
