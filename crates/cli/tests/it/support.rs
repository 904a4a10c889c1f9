//! A temporary folder for the program to run in.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Three robots of two sizes, a person and a door in a small building.
pub(crate) const SCENARIO: &str = r##"format = 1
world = "robots"
name = "small"
seed = 5
cycles = 3000

[map]
box_size_m = 0.25
ascii = """
########################
#..........#...........#
#..........#...........#
#......................#
#......................#
#..........#...........#
#..........#...........#
########################
"""

[[robots]]
count = 2
size = 2
sensors = ["sonar-8"]
effector = "nomad"
behaviour = { kind = "shuttle", a = [1, 3, 2, 2], b = [19, 3, 2, 2] }

[[robots]]
count = 1
sensors = ["bumper-4"]
effector = "nomad"

[people]
count = 1

[doors]
at = [[11, 3]]
size = [1, 2]
random = { p_open = 0.05, p_close = 0.02 }

[record]
checkpoint_every = 700
"##;

/// A temporary folder, and the program run in it.
pub(crate) struct TestFolder(tempfile::TempDir);

impl TestFolder {
    /// A place with [`SCENARIO`] as `s.toml`.
    pub(crate) fn new() -> Self {
        let place = Self(tempfile::tempdir().expect("a temporary folder"));
        place.write("s.toml", SCENARIO);
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("written");
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect(name)
    }

    /// Names in the folder, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        names(self.0.path())
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sidestep"));
        command.args(args).current_dir(self.0.path()).stdin(Stdio::null());
        command
    }

    /// Runs the program to its end.
    pub(crate) fn run(&self, args: &[&str]) -> CommandOutput {
        CommandOutput(self.command(args).output().expect("the binary starts"))
    }

    /// Starts the program and keeps its output.
    pub(crate) fn start(&self, args: &[&str]) -> Child {
        let mut command = self.command(args);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary starts")
    }

    /// Returns the JSON of a command that must succeed.
    pub(crate) fn json(&self, args: &[&str]) -> Value {
        let mut all = args.to_vec();
        all.push("--json");
        let ended = self.run(&all);
        assert_eq!(ended.code(), 0, "{args:?}: {}", ended.err());
        ended.json()
    }
}

pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The output of a command.
pub(crate) struct CommandOutput(pub(crate) Output);

impl CommandOutput {
    pub(crate) fn code(&self) -> i32 {
        self.0.status.code().expect("ended by itself")
    }

    pub(crate) fn out(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).expect("text")
    }

    pub(crate) fn err(&self) -> String {
        String::from_utf8(self.0.stderr.clone()).expect("text")
    }

    /// Standard output as exactly one JSON object.
    pub(crate) fn json(&self) -> Value {
        let value: Value = serde_json::from_str(&self.out()).expect("one JSON value");
        assert!(value.is_object(), "{value}");
        value
    }
}

/// Waits until `ready` holds.
pub(crate) fn wait_for(what: &str, mut ready: impl FnMut() -> bool) {
    let started = Instant::now();
    while !ready() {
        assert!(started.elapsed() < Duration::from_secs(60), "waited too long for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Returns the number of processes that a test kills: `default`, or as many as `.ci/soak` asks for.
pub(crate) fn kill_count(default: usize) -> usize {
    let asked = std::env::var("SIDESTEP_SOAK_KILLS");
    asked.map_or(default, |text| text.parse().expect("SIDESTEP_SOAK_KILLS is a number"))
}

/// The same numbers in every run of the tests, spread over 0 to 1.
pub(crate) fn fractions() -> impl Iterator<Item = f64> {
    let next = |x: &u64| Some(x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1));
    let states = std::iter::successors(Some(1u64), next).skip(1);
    states.map(|x| (x >> 11) as f64 / (1u64 << 53) as f64)
}

/// Waits until `ready`, or until the process is over; whether it still runs then.
pub(crate) fn runs_until(child: &mut Child, mut ready: impl FnMut() -> bool) -> bool {
    loop {
        if child.try_wait().expect("a child of ours").is_some() {
            return false;
        }
        if ready() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Kills a process, unless it has ended.
pub(crate) fn try_kill(process: u32) {
    let _ = Command::new("kill").args(["-KILL", &process.to_string()]).output();
}

/// Sends a signal, as a terminal would.
pub(crate) fn signal(child: &Child, name: &str) {
    let pid = child.id().to_string();
    let sent = Command::new("kill").args([&format!("-{name}"), &pid]).status();
    assert!(sent.expect("kill is there").success());
}

/// Stops a process, and waits until it stands still.
pub(crate) fn stop(child: &Child) {
    signal(child, "STOP");
    wait_for("a standstill", || {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id()));
        // Its state follows the name of the program, in parentheses. Other systems have no such file.
        stat.map_or(true, |stat| stat.rsplit(") ").next().is_some_and(|rest| rest.starts_with('T')))
    });
}

/// A small file system that lasts as long as this value.
pub(crate) struct SmallDisk<'a>(&'a Path);

impl<'a> SmallDisk<'a> {
    /// Mounts it; `None` if this user may not mount.
    pub(crate) fn mount(at: &'a Path, size: &str) -> Option<Self> {
        std::fs::create_dir(at).expect("made");
        mount(&["-t", "tmpfs", "-o", &format!("size={size}"), "tmpfs"], at).then_some(Self(at))
    }

    pub(crate) fn grow(&self, size: &str) {
        assert!(mount(&["-o", &format!("remount,size={size}")], self.0));
    }

    pub(crate) fn forbid_writing(&self) {
        assert!(mount(&["-o", "remount,ro"], self.0));
    }
}

impl Drop for SmallDisk<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

fn mount(options: &[&str], at: &Path) -> bool {
    let tried = Command::new("mount").args(options).arg(at).output();
    tried.is_ok_and(|o| o.status.success())
}

/// Lists the trajectories of another run in the manifest of a run, as if it had recorded them.
pub(crate) fn list_other_rows(place: &TestFolder, run: &str, other: &str) {
    let read = |run: &str| -> serde_json::Value {
        serde_json::from_str(&place.read(&format!("{run}/run.json"))).expect("JSON")
    };
    let mut manifest = read(run);
    let of_other = read(other)["files"].as_object().expect("files").clone();
    let files = manifest["files"].as_object_mut().expect("files");
    files.retain(|name, _| !name.starts_with("trajectories/"));
    files.extend(of_other.into_iter().filter(|(name, _)| name.starts_with("trajectories/")));
    let text = sidestep_record::seal_again(&manifest.to_string());
    place.write(&format!("{run}/run.json"), text);
}
