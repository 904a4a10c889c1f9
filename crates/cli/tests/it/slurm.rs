//! The array of `docs/src/clusters.md` on a real Slurm of one machine.

use crate::support::{TestFolder, wait_for};
use crate::sweep::place;
use sidestep_testing::require;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// A Slurm with all its files in one folder, as long as this lives.
struct Slurm {
    conf: PathBuf,
    daemons: Vec<Child>,
}

impl Slurm {
    /// Starts the daemons in `folder`.
    fn start(folder: &Path) -> Self {
        std::fs::create_dir(folder).expect("made");
        let conf = folder.join("slurm.conf");
        std::fs::write(&conf, configuration(folder)).expect("written");
        for name in ["state", "spool"] {
            std::fs::create_dir(folder.join(name)).expect("made");
        }
        let mut slurm = Self { conf, daemons: Vec::new() };
        slurm.daemon(folder, munge(folder));
        let socket = folder.join("munge/socket");
        wait_for("munge", || socket.exists());
        slurm.daemon(folder, command("slurmctld", &["-D", "-f"], &slurm.conf));
        slurm.daemon(folder, command("slurmd", &["-D", "-N", "one", "-f"], &slurm.conf));
        wait_for("an idle node", || slurm.run("sinfo", &["-h", "-o", "%t"]).trim() == "idle");
        slurm
    }

    fn daemon(&mut self, folder: &Path, mut command: Command) {
        let log = folder.join(format!("daemon-{}.log", self.daemons.len()));
        let log = std::fs::File::create(log).expect("made");
        command.stdin(Stdio::null()).stdout(log.try_clone().expect("a handle")).stderr(log);
        self.daemons.push(command.spawn().expect("the daemon starts"));
    }

    /// The output of a client command.
    fn run(&self, program: &str, args: &[&str]) -> String {
        let output = Command::new(program).args(args).env("SLURM_CONF", &self.conf).output();
        let output = output.expect("the client starts");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        for daemon in self.daemons.iter_mut().rev() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

fn command(program: &str, args: &[&str], conf: &Path) -> Command {
    let mut command = Command::new(program);
    command.args(args).arg(conf);
    command
}

/// Munge as its own user would not see a temporary folder of ours, so it runs as we do.
fn munge(folder: &Path) -> Command {
    let home = folder.join("munge");
    std::fs::create_dir(&home).expect("made");
    std::fs::write(home.join("key"), [7u8; 128]).expect("written");
    let only_us = |path: &Path, mode: u32| {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).expect("set");
    };
    only_us(&home.join("key"), 0o400);
    only_us(&home, 0o711);
    let mut munged = Command::new("munged");
    munged.args(["--foreground", "--force", "--num-threads=2"]);
    for (option, file) in [
        ("key-file", "key"),
        ("socket", "socket"),
        ("pid-file", "pid"),
        ("seed-file", "seed"),
        ("log-file", "log"),
    ] {
        munged.arg(format!("--{option}={}", home.join(file).display()));
    }
    munged
}

fn configuration(folder: &Path) -> String {
    let at = |name: &str| folder.join(name).display().to_string();
    let [controller, daemon] = free_ports();
    format!(
        "ClusterName=test\nSlurmctldHost=localhost(127.0.0.1)\nSlurmUser=root\n\
         SlurmctldPort={controller}\nSlurmdPort={daemon}\nAuthInfo=socket={}\n\
         CredType=cred/munge\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\n\
         SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\n\
         JobAcctGatherType=jobacct_gather/none\nReturnToService=2\nMpiDefault=none\n\
         StateSaveLocation={}\nSlurmdSpoolDir={}\nSlurmctldPidFile={}\nSlurmdPidFile={}\n\
         NodeName=one NodeHostname=localhost NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN\n\
         PartitionName=all Nodes=one Default=YES State=UP OverSubscribe=NO\n",
        at("munge/socket"),
        at("state"),
        at("spool"),
        at("controller.pid"),
        at("daemon.pid"),
    )
}

fn free_ports() -> [u16; 2] {
    let free = || std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    [free(), free()].map(|listener| listener.local_addr().expect("bound").port())
}

/// The script of the page, for four tasks of one processor.
fn script(binary: &Path) -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/clusters.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let begin = page.find("#!/bin/sh").expect("a script");
    let script = &page[begin..begin + page[begin..].find("```").expect("its end")];
    let path = binary.parent().expect("a folder").display();
    script
        .replace("--array=0-15", "--array=0-3")
        .replace("--cpus-per-task=4", "--cpus-per-task=1")
        .replace("exec sidestep", &format!("PATH={path}:$PATH\nexec sidestep"))
}

#[test]
fn an_array_of_tasks_runs_a_sweep_to_the_same_table() {
    let has = |program: &str| Command::new(program).arg("--version").output().is_ok();
    let is_root = std::fs::metadata("/proc/self").is_ok_and(|m| {
        use std::os::unix::fs::MetadataExt;
        m.uid() == 0
    });
    let missing =
        ["munged", "slurmctld", "slurmd", "sbatch", "sinfo"].into_iter().find(|p| !has(p));
    if !is_root || missing.is_some() {
        let why = missing.map_or("only root can start Slurm".into(), |p| format!("no `{p}` here"));
        return require("slurm", &why);
    }
    let place: TestFolder = place();
    place.json(&["sweep", "sweep.toml", "--out", "whole"]);
    place.json(&["sweep", "plan", "sweep.toml", "--out", "d"]);
    place.write("sweep.sbatch", script(Path::new(env!("CARGO_BIN_EXE_sidestep"))));
    let slurm = Slurm::start(&place.path("slurm"));
    let file = |name: &str| place.path(name).display().to_string();
    let log = format!("--output={}/task-%a.log", file("slurm"));
    let job = slurm.run("sbatch", &["--parsable", &log, &file("sweep.sbatch"), &file("d")]);
    assert!(!job.trim().is_empty(), "the array was not taken");
    wait_for("the array", || slurm.run("squeue", &["-h"]).trim().is_empty());
    for k in 0..4 {
        let log = place.read(&format!("slurm/task-{k}.log"));
        assert!(log.contains(&format!("Share {k}/4 is finished")), "{log}");
    }
    place.json(&["sweep", "collect", "d"]);
    let results = |folder: &str| {
        std::fs::read(place.path(&format!("{folder}/results.parquet"))).expect("there")
    };
    assert!(results("d") == results("whole"), "the array gives the table of one process");
}
