//! The program `sidestep-link`, which alone contains the network stack: it is found, started, given a job, and ended.

use crate::exit::Failure;
use crate::interrupt;
use crate::worlds;
use clap::Args;
use sidestep::kernel::InputError;
use sidestep_session::fleet::{
    CommonSettings, Job, JobError, JobScenario, LINK_PROGRAM, LinkMessage, Tls, link_command,
};
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// Environment variable with the path of the program, if it is not beside this one.
const PATH_VARIABLE: &str = "SIDESTEP_LINK";

/// Time between two checks for an interrupt: a key press seems to act at once.
const STOP_POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Options of the server and of nodes.
#[derive(Debug, Clone, Args)]
pub(crate) struct LinkArgs {
    /// Timeout: seconds of silence after which a node or the server is taken to be gone
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = parse_seconds)]
    lease: f64,

    /// Serve metrics in Prometheus format at this address, e.g. 127.0.0.1:9100; one that others
    /// reach needs certificates or --insecure
    #[arg(long, value_name = "HOST:PORT")]
    metrics: Option<String>,

    /// Log level on standard error: off, error, warn, info, debug or trace
    #[arg(long, value_name = "LEVEL", default_value = "warn")]
    log: String,

    /// Write each line of the log as a JSON object
    #[arg(long)]
    log_json: bool,

    /// Allow links that leave this machine without certificates: whoever reaches them can take part, read and change
    #[arg(long, conflicts_with = "tls_ca", help_heading = "Encryption")]
    insecure: bool,

    #[command(flatten)]
    tls: TlsArgs,
}

/// Options of certificates, with which both ends of every link prove their identity (mutual TLS).
#[derive(Debug, Clone, Args)]
pub(crate) struct TlsArgs {
    /// Certificate of the authority (CA) that signed those of all parties (PEM)
    #[arg(long, value_name = "FILE", requires_all = ["tls_cert", "tls_key"], help_heading = "Encryption")]
    tls_ca: Option<PathBuf>,

    /// Certificate of this party (PEM)
    #[arg(long, value_name = "FILE", requires = "tls_ca", help_heading = "Encryption")]
    tls_cert: Option<PathBuf>,

    /// Private key of this party (PEM)
    #[arg(long, value_name = "FILE", requires = "tls_ca", help_heading = "Encryption")]
    tls_key: Option<PathBuf>,
}

/// Parses a time in seconds, from 0.1 to a day.
fn parse_seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|s| (0.1..=86_400.0).contains(s));
    number.ok_or_else(|| "give seconds from 0.1 to 86400".into())
}

impl LinkArgs {
    pub(crate) fn common_settings(&self, file: PathBuf, overrides: Vec<String>) -> CommonSettings {
        let build = worlds().build().into();
        CommonSettings {
            flown: JobScenario { file, overrides, build },
            tls: self.tls.files(),
            is_insecure: self.insecure,
            lease_s: self.lease,
            metrics: self.metrics.clone(),
            json_log: self.log_json,
            log: self.log.clone(),
        }
    }

    /// Returns whether links are encrypted.
    pub(crate) fn is_encrypted(&self) -> bool {
        self.tls.tls_ca.is_some()
    }

    /// Returns the protocol of endpoints, by which both ends know whether to encrypt.
    pub(crate) fn protocol(&self) -> &'static str {
        if self.is_encrypted() { "tls" } else { "tcp" }
    }
}

impl TlsArgs {
    /// Returns the certificates; `None` where links are not encrypted.
    pub(crate) fn files(&self) -> Option<Tls> {
        match (self.tls_ca.clone(), self.tls_cert.clone(), self.tls_key.clone()) {
            (Some(authority), Some(certificate), Some(key)) => {
                Some(Tls { authority, certificate, key })
            }
            // The command line gives all of them or none.
            _ => None,
        }
    }
}

/// Returns the program: as the variable says, beside this one, or on the path.
pub(crate) fn find_program() -> Result<PathBuf, InputError> {
    let variable = std::env::var_os(PATH_VARIABLE).map(PathBuf::from);
    let file = format!("{LINK_PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let beside = std::env::current_exe().ok().map(|program| program.with_file_name(&file));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let on_path = std::env::split_paths(&path).map(|folder| folder.join(&file));
    let found = match variable {
        // A user who set the variable wants no other program in its place.
        Some(path) => Some(path).filter(|path| path.is_file()),
        None => beside.into_iter().chain(on_path).find(|path| path.is_file()),
    };
    found.ok_or_else(|| {
        let cause = "not found; fleet networking is a separate program";
        let remedy = format!(
            "get it with `cargo install --path crates/link`, or build it beside sidestep with \
             `cargo build --release -p {LINK_PROGRAM}`; {PATH_VARIABLE} may hold its path"
        );
        InputError::new(LINK_PROGRAM, cause, remedy)
    })
}

/// Lets the program do a job, and calls `on_message` with its messages. Ctrl-C asks it to end in good order.
///
/// # Errors
/// When it is not there, cannot do it, or ends before it is done.
pub(crate) fn run_job(job: &Job, mut on_message: impl FnMut(LinkMessage)) -> Result<(), Failure> {
    interrupt::listen()?;
    let job = job_line(job)?;
    let mut child = spawn_program()?;
    let messages = receive_messages(&mut child);
    let mut stdin = child.stdin.take();
    send_job(stdin.as_mut(), &job);
    let mut error = None;
    loop {
        match messages.recv_timeout(STOP_POLL_INTERVAL) {
            Ok(LinkMessage::Failed(reason)) => error = Some(reason),
            Ok(message) => on_message(message),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if interrupt::is_requested() {
            // The program ends when its standard input is closed.
            drop(stdin.take());
        }
    }
    let status = child.wait().map_err(|e| cannot_start_error(&e))?;
    exit_result(status, error)
}

fn spawn_program() -> Result<Child, Failure> {
    let mut command = link_command(find_program()?);
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    // A terminal sends Ctrl-C to a whole process group. In a group of its own, the program does not get it: this process asks it
    // to end, so that the fleet can finish its cycle.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn().map_err(|e| cannot_start_error(&e))
}

fn cannot_start_error(error: &std::io::Error) -> Failure {
    let remedy = format!("see whether it can be executed: {LINK_PROGRAM} --version");
    Failure::other(format!("cannot start {LINK_PROGRAM}: {error}"), remedy)
}

/// Returns the job as a line of text, the form in which the program reads it.
///
/// # Errors
/// When a path in it is no text: the program could not find it.
fn job_line(job: &Job) -> Result<String, InputError> {
    let text = serde_json::to_string(job).map_err(|e| {
        let remedy = "give scenario, folder and certificates in UTF-8: the job is sent as text";
        InputError::new("the job of a fleet", e.to_string(), remedy)
    })?;
    Ok(text + "\n")
}

/// Sends the job. A failure to write is not reported here: the program has ended then, and its own message or exit status says
/// why.
fn send_job(stdin: Option<&mut ChildStdin>, line: &str) {
    if let Some(stdin) = stdin {
        let _ = stdin.write_all(line.as_bytes()).and_then(|()| stdin.flush());
    }
}

/// Returns the messages of the program as they arrive. Lines that are no messages are dropped.
fn receive_messages(child: &mut Child) -> Receiver<LinkMessage> {
    let (sender, messages) = channel();
    let out = child.stdout.take();
    std::thread::spawn(move || {
        let kinds = worlds().kinds();
        for line in
            out.into_iter().flat_map(|out| BufReader::new(out).lines()).map_while(Result::ok)
        {
            if let Ok(message) = kinds.resolve_names_during(|| serde_json::from_str(&line))
                && sender.send(message).is_err()
            {
                return;
            }
        }
    });
    messages
}

/// The remedy where the server of a fleet has ended unasked.
pub(crate) const LOST_SERVER_REMEDY: &str = "its nodes end by themselves; start it again";

fn exit_result(status: ExitStatus, error: Option<JobError>) -> Result<(), Failure> {
    match error {
        Some(error) => Err(error.into_error()),
        None if status.success() => Ok(()),
        None if interrupt::is_requested() => Err(Failure::Interrupted),
        None => {
            let cause = format!("{LINK_PROGRAM} has ended before it was done ({status})");
            Err(Failure::other(cause, LOST_SERVER_REMEDY))
        }
    }
}
