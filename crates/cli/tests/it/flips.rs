//! E2: a flipped bit in any file of a run, a flight, a sweep, a report or an export is noticed by `verify`, and by every
//! command that reads the file.

use crate::support::TestFolder;
use crate::sweep::place;
use sidestep_record::verify::verify;
use std::path::{Path, PathBuf};

/// Flips of each file in the usual run of the tests.
const FEW: usize = 2;
/// Flips in all by the long test; `SIDESTEP_FLIPS` is another number.
const MANY: usize = 1000;
/// Where the flips are, if `PROPTEST_RNG_SEED` does not say so.
const SEED: u64 = 36;

/// Random bits, the same ones for the same seed.
struct Flips(u64);

impl Flips {
    fn new() -> Self {
        let seed = std::env::var("PROPTEST_RNG_SEED").ok().and_then(|text| text.parse().ok());
        Self(seed.unwrap_or(SEED))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        self.0 >> 17
    }

    /// Flips a bit of a file while `look` looks at it.
    fn flip<T>(&mut self, file: &Path, look: impl FnOnce() -> T) -> (u64, T) {
        let whole = std::fs::read(file).expect("a file");
        let bit = self.next() % (8 * whole.len() as u64);
        let mut flipped = whole.clone();
        flipped[(bit / 8) as usize] ^= 1 << (bit % 8);
        std::fs::write(file, flipped).expect("written");
        let seen = look();
        std::fs::write(file, whole).expect("written");
        (bit, seen)
    }
}

/// Returns the files below a path that hold anything, sorted; without locks, which hold the id of a process that was killed.
fn files_of(path: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    let Ok(entries) = std::fs::read_dir(path) else { return vec![path.to_path_buf()] };
    for entry in entries {
        all.extend(files_of(&entry.expect("an entry").path()));
    }
    let is_lock = |file: &PathBuf| file.extension().is_some_and(|ending| ending == "lock");
    all.retain(|file| !is_lock(file) && file.metadata().is_ok_and(|found| found.len() > 0));
    all.sort();
    all
}

/// A path to verify, and its files.
type Verified = (PathBuf, Vec<PathBuf>);

/// A run with a report, its exports, and a flight.
fn recorded() -> (TestFolder, Vec<Verified>) {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--cycles", "200", "--out", "r", "--mcap", "r.mcap"]);
    for form in ["csv", "svg", "rosbag"] {
        place.json(&["export", "r", "--to", form]);
    }
    place.json(&["export", "r", "--to", "parquet", "--table", "events"]);
    fly(&place);
    place.json(&["report", "r", "--out", "page.html"]);
    let whole = ["r", "flight", "r-csv", "r-rosbag", "r.mcap"];
    let mut all: Vec<_> =
        whole.map(|name| (place.path(name), files_of(&place.path(name)))).into_iter().collect();
    let of_one = |name: &str| {
        let list = place.path(&format!("{name}.manifest.json"));
        (place.path(name), vec![place.path(name), list])
    };
    all.push(of_one("r.svg"));
    all.push(of_one("r-events.parquet"));
    let mut page = files_of(&place.path("page-figures"));
    page.extend(["page.html", "page.md", "page.manifest.json"].map(|name| place.path(name)));
    all.push((place.path("page.html"), page));
    (place, all)
}

/// Makes a folder `flight` that is the run `r` as if it had been flown.
fn fly(place: &TestFolder) {
    for file in files_of(&place.path("r")) {
        let name = file.strip_prefix(place.path("r")).expect("in it").to_path_buf();
        let to = place.path("flight").join(name);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("made");
        std::fs::copy(file, to).expect("copied");
    }
    let manifest = place.read("flight/run.json");
    let flown = manifest.replace("\"simulated\"", "\"flown\"");
    assert_ne!(flown, manifest);
    place.write("flight/run.json", sidestep_record::seal_again(&flown));
}

/// A sweep with recorded runs and a report, and one that was killed in its second share.
fn swept() -> (TestFolder, Vec<Verified>) {
    let place = place();
    let plan = ["sweep", "plan", "sweep.toml", "--set", "cycles=100"];
    place.json(&[&plan[..], &["--out", "half"]].concat());
    place.json(&["sweep", "run", "half", "--shard", "0/2"]);
    let journal = place.path("half/shares/1-of-2.journal");
    let mut child = place.start(&["sweep", "run", "half", "--shard", "1/2", "--workers", "1"]);
    crate::support::wait_for("a run", || {
        std::fs::metadata(&journal).is_ok_and(|found| found.len() > 500)
            || child.try_wait().expect("a child of ours").is_some()
    });
    child.kill().expect("killed or over");
    child.wait().expect("waited");
    let whole = ["sweep", "s.toml", "--cycles", "50", "--replicate", "2", "--record-runs"];
    place.json(&[&whole[..], &["--out", "whole"]].concat());
    place.json(&["report", "whole"]);
    let mut all = vec![place.path("half"), place.path("whole")];
    let all = all.drain(..).map(|path| (path.clone(), files_of(&path))).collect();
    (place, all)
}

/// Flips a bit of each file, `times` times, and asks `verify`.
fn check_verify(flips: &mut Flips, all: &[Verified], times: usize) {
    for (path, files) in all {
        let before = verify(path).expect("a recording");
        assert_eq!(before.damaged, [], "{}", path.display());
        assert!(before.others.is_empty(), "{:?}", before.others);
        for file in files {
            for _ in 0..times {
                let (bit, found) = flips.flip(file, || verify(path));
                // A sweep names the folder of a scenario, of which it has one digest.
                let is_named = |found: &PathBuf| file.starts_with(found);
                let is_noticed = found
                    .as_ref()
                    .is_ok_and(|found| found.damaged.iter().any(|damaged| is_named(&damaged.path)));
                assert!(is_noticed || found.is_err(), "{}, bit {bit}: {found:?}", file.display());
            }
        }
    }
}

/// Commands that read a run, each of which must notice every flip.
const READERS: [&[&str]; 4] = [
    &["replay", "r"],
    &["export", "r", "--to", "csv", "--table", "events", "--out", "x.csv"],
    &["report", "r", "--out", "x.html"],
    &["resume", "r"],
];

/// Flips bits of files that commands read.
fn check_readers(flips: &mut Flips, place: &TestFolder, files: &[PathBuf], readers: &[&[&str]]) {
    let before = place.names();
    for file in files {
        let reader = readers[(flips.next() % readers.len() as u64) as usize];
        let (bit, ended) = flips.flip(file, || place.run(reader));
        let at = format!("{reader:?} of {}, bit {bit}: {}", file.display(), ended.err());
        assert!([1, 2].contains(&ended.code()) && ended.out().is_empty(), "{at}");
        assert_eq!(place.names(), before, "{at}");
    }
}

#[test]
fn a_flip_in_any_file_of_a_run_a_flight_a_report_or_an_export_is_noticed() {
    let (place, all) = recorded();
    let mut flips = Flips::new();
    check_verify(&mut flips, &all, FEW);
    let of_run: Vec<_> = files_of(&place.path("r"));
    check_readers(&mut flips, &place, &of_run, &READERS);
    let of_file: [&[&str]; 2] = [&["replay", "r.mcap"], &["export", "r.mcap", "--to", "gif"]];
    check_readers(&mut flips, &place, &vec![place.path("r.mcap"); FEW], &of_file);
}

#[test]
fn a_flip_in_any_file_of_a_sweep_is_noticed() {
    let (place, all) = swept();
    let mut flips = Flips::new();
    check_verify(&mut flips, &all, 1);
    let results = ["sweep.json", "results.manifest.json", "results.parquet"];
    let results = results.map(|name| place.path("whole").join(name));
    check_readers(&mut flips, &place, &results, &[&["report", "whole", "--out", "x.html"]]);
    // A variant is read only while it has runs to make, and a journal may end in a line that a kill has cut.
    let planned = ["sweep.json", "shares/0-of-2.manifest.json", "shares/0-of-2.parquet"];
    let planned = planned.map(|name| place.path("half").join(name));
    check_readers(&mut flips, &place, &planned, &[&["resume", "half"]]);
}

#[test]
#[ignore = "a thousand flips take minutes: see `.ci/soak`"]
fn a_thousand_flips_are_noticed() {
    let count = std::env::var("SIDESTEP_FLIPS").ok().and_then(|text| text.parse().ok());
    let count = count.unwrap_or(MANY);
    let mut flips = Flips::new();
    let (place, all) = recorded();
    let (of_sweeps, sweeps) = swept();
    let both = [all, sweeps].concat();
    let files: usize = both.iter().map(|(_, files)| files.len()).sum();
    let rounds = count.div_ceil(2 * files);
    check_verify(&mut flips, &both, rounds);
    let of_run = files_of(&place.path("r"));
    let results = ["sweep.json", "results.manifest.json", "results.parquet"];
    let results = results.map(|name| of_sweeps.path("whole").join(name));
    let of_file: [&[&str]; 2] = [&["replay", "r.mcap"], &["export", "r.mcap", "--to", "gif"]];
    for _ in 0..(count / 2).div_ceil(of_run.len() + results.len() + 2) {
        check_readers(&mut flips, &place, &of_run, &READERS);
        check_readers(&mut flips, &place, &vec![place.path("r.mcap"); 2], &of_file);
        let report: [&[&str]; 1] = [&["report", "whole", "--out", "x.html"]];
        check_readers(&mut flips, &of_sweeps, &results, &report);
    }
    println!("{count} flips of {files} files were noticed");
}
