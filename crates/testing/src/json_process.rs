//! A program of a test that talks in lines of JSON.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A program that reads and writes lines of JSON. It is killed when it is dropped.
#[derive(Debug)]
pub struct JsonProcess<T> {
    /// The program.
    pub child: Child,
    /// What it reads; without it, the program sees the end of its input.
    pub stdin: Option<ChildStdin>,
    /// What it has written, line by line.
    pub lines: Receiver<T>,
}

impl<T: DeserializeOwned + Send + 'static> JsonProcess<T> {
    /// Starts a program.
    ///
    /// # Panics
    /// When it does not start. A line that is not as expected ends what can be received.
    #[must_use]
    pub fn start(mut command: Command) -> Self {
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let stdin = child.stdin.take();
        let out = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                let read = serde_json::from_str(&line);
                let read = read.unwrap_or_else(|error| panic!("{line}: {error}"));
                if sender.send(read).is_err() {
                    return;
                }
            }
        });
        Self { child, stdin, lines }
    }

    /// Starts a program, and writes its first line.
    ///
    /// # Panics
    /// When it does not start, or does not read.
    #[must_use]
    pub fn start_with(command: Command, first: &impl Serialize) -> Self {
        let mut process = Self::start(command);
        process.write(first);
        process
    }

    /// Writes a line.
    ///
    /// # Panics
    /// When its input has ended.
    pub fn write(&mut self, line: &impl Serialize) {
        let line = serde_json::to_string(line).expect("plain data");
        let stdin = self.stdin.as_mut().expect("its input is open");
        writeln!(stdin, "{line}").expect("it reads");
    }

    /// Returns the next line.
    ///
    /// # Panics
    /// When none comes within some time.
    pub fn next(&self, what: &str, within: Duration) -> T {
        let line = self.lines.recv_timeout(within);
        line.unwrap_or_else(|error| panic!("waited for {what}: {error}"))
    }
}

impl<T> Drop for JsonProcess<T> {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
