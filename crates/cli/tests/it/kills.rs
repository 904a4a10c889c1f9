//! Runs, exports and flights that are killed at any time: nothing is lost, nothing is invented, and every command says what
//! is there. Sweeps are in [`sweep_faults`](crate::sweep_faults).

use crate::fleet::{child_process, is_there, place as fleet_place};
use crate::support::{TestFolder, fractions, kill_count, runs_until, try_kill, wait_for};
use sidestep_record::{RunReader, Status};
use std::process::Child;
use std::time::{Duration, Instant};

/// Kills a process after a while, unless it ends before; returns whether it was killed.
fn kill_after(mut child: Child, delay: Duration) -> bool {
    let started = Instant::now();
    let is_killed = runs_until(&mut child, || started.elapsed() >= delay);
    child.kill().expect("killed or over");
    child.wait().expect("gone");
    is_killed
}

/// Asserts that every file of a run or an export is as it was written.
fn assert_whole(place: &TestFolder, path: &str) {
    let verified = place.run(&["verify", path]);
    assert_eq!(verified.code(), 0, "{}{}", verified.out(), verified.err());
}

#[test]
#[ignore = "some minutes: `.ci/soak 60 kills` makes it"]
fn a_run_that_is_killed_at_any_time_is_whole_and_resumes_to_the_same_digest_and_rows() {
    let place = TestFolder::new();
    let args = ["run", "s.toml", "--cycles", "9000", "--mcap", "m.mcap", "--out"];
    let began = Instant::now();
    let whole = place.json(&[&args[..], &["whole", "--replace"]].concat());
    let a_run = began.elapsed();
    let mut kills = 0;
    // Runs that were met at work.
    let mut begun = 0;
    let mut fractions = fractions();
    while kills < kill_count(20) {
        let child = place.start(&[&args[..], &["r", "--replace"]].concat());
        let fraction = fractions.next().expect("endless");
        if !kill_after(child, a_run.mul_f64(fraction)) {
            continue;
        }
        kills += 1;
        if RunReader::open(&place.path("r")).is_err() {
            // Killed before there was a folder.
            assert!(!place.path("r").exists(), "half a folder");
            continue;
        }
        assert_whole(&place, "r");
        // The one before may have been complete already, and this one killed before it began.
        let status = RunReader::open(&place.path("r")).expect("a run").manifest.status;
        if status != Status::Complete {
            begun += 1;
            // Resumed runs are killed, too.
            let again = place.start(&["resume", "r"]);
            let later = fractions.next().expect("endless");
            kills += usize::from(kill_after(again, a_run.mul_f64(later)));
            assert_whole(&place, "r");
        }
        let status = RunReader::open(&place.path("r")).expect("a run").manifest.status;
        if status != Status::Complete {
            assert_eq!(place.json(&["resume", "r"])["digest"], whole["digest"]);
        }
        assert_eq!(place.json(&["replay", "r"])["digest"], whole["digest"]);
        assert_whole(&place, "r");
        std::fs::remove_dir_all(place.path("r")).expect("removed");
    }
    println!("{kills} kills, {begun} runs met at work");
    assert!(begun >= kills / 5, "kills must meet runs at work: {begun} of {kills} did");
}

#[test]
#[ignore = "some minutes: `.ci/soak 60 kills` makes it"]
fn an_export_that_is_killed_at_any_time_leaves_nothing_that_is_taken_for_one() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "9000", "--out", "r"]);
    let mut kills = 0;
    let mut fractions = fractions();
    let forms = [("csv", "r-csv"), ("parquet", "r-parquet"), ("mcap", "r.mcap")];
    let times = forms.map(|(form, _)| {
        let began = Instant::now();
        place.json(&["export", "r", "--to", form]);
        began.elapsed()
    });
    for (form, (to, name)) in (0..forms.len()).zip(forms).cycle() {
        if kills >= kill_count(20) {
            break;
        }
        let path = place.path(name);
        if path.is_dir() {
            std::fs::remove_dir_all(&path).expect("removed");
        } else if path.exists() {
            std::fs::remove_file(&path).expect("removed");
        }
        let child = place.start(&["export", "r", "--to", to]);
        let fraction = fractions.next().expect("endless");
        if !kill_after(child, times[form].mul_f64(fraction)) {
            continue;
        }
        kills += 1;
        let is_there = path.exists();
        // What a kill has left of a file is replaced only by who asks for that.
        let is_begun = place.path(&format!("{name}.partial")).exists();
        let again = place.run(&["export", "r", "--to", to]);
        let expected = if is_there || is_begun { 2 } else { 0 };
        assert_eq!(again.code(), expected, "{}", again.err());
        if is_begun {
            let replaced = place.run(&["export", "r", "--to", to, "--replace"]);
            assert_eq!(replaced.code(), 0, "{}", replaced.err());
        }
    }
    println!("{kills} kills");
    let left: Vec<_> = place.names().into_iter().filter(|name| name.contains("partial")).collect();
    assert_eq!(left, Vec::<String>::new(), "what a kill left goes with the next export");
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "some minutes: `.ci/soak 60 kills` makes it"]
fn a_flight_that_is_killed_at_any_time_is_on_disk_until_the_last_second_and_is_not_continued() {
    if !is_there() {
        return;
    }
    let place = fleet_place();
    let args = ["fleet", "ring.toml", "--cycles", "100000", "--out", "r", "--replace", "--set"];
    let clock = ["airspace.generator.radius_m=1000000", "--clock", "realtime", "--speed", "30"];
    let mut kills = 0;
    let mut flown = 0;
    for fraction in fractions() {
        if kills >= kill_count(20) {
            break;
        }
        let mut fleet = place.start(&[&args[..], &clock[..]].concat());
        let started = Instant::now();
        let delay = Duration::from_secs(6).mul_f64(fraction);
        if !runs_until(&mut fleet, || started.elapsed() >= delay) {
            let ended = fleet.wait_with_output().expect("its output");
            panic!("a flight of hours: {}", String::from_utf8_lossy(&ended.stderr));
        }
        // The program of fleets, the command, or both; the other one ends by itself.
        let server = child_process(fleet.id());
        if let Some(server) = server.filter(|_| kills % 3 != 1) {
            try_kill(server);
        }
        if kills % 3 != 0 {
            fleet.kill().expect("killed");
        }
        fleet.wait().expect("ended");
        let server = server.map(|server| format!("/proc/{server}/exe"));
        wait_for("the end of the server", || {
            server.as_ref().is_none_or(|at| std::fs::read_link(at).is_err())
        });
        kills += 1;
        let Ok(reader) = RunReader::open(&place.path("r")) else { continue };
        if reader.manifest.status == Status::Running && reader.manifest.cycles_done > 0 {
            assert_whole(&place, "r");
        }
        let resumed = place.run(&["resume", "r"]);
        assert!([1, 2].contains(&resumed.code()), "{}", resumed.err());
        let manifest = RunReader::open(&place.path("r")).expect("a run").manifest;
        assert!(manifest.is_flight(), "a flight is marked before its first cycle");
        assert!(manifest.origins.len() == 1 && manifest.status != Status::Complete);
        let done = manifest.cycles_done;
        if done == 0 {
            continue;
        }
        flown += 1;
        assert_whole(&place, "r");
        assert_eq!(place.run(&["replay", "r", "--cycle", &(done - 1).to_string()]).code(), 0);
        let exported = place.json(&["export", "r", "--to", "csv", "--replace"]);
        assert_eq!(exported["origins"][0]["until"], done);
        let rows = place.read("r-csv/trajectories.csv").lines().count() as u64;
        assert!(rows >= 3 * done, "{rows} rows of {done} cycles");
    }
    println!("{kills} kills, {flown} of flights with cycles on disk");
    assert!(flown >= kills / 5, "kills must meet flights under way: {flown} of {kills} did");
}
