//! Results that cannot be written are reported, with exit code 1; a reader that has seen enough is no fault.
#![cfg(target_os = "linux")]

use crate::support::{CommandOutput, TestFolder};
use std::fs::OpenOptions;
use std::process::Stdio;

/// Commands that print a result, or help, each by itself.
const PRINTING: [&[&str]; 9] = [
    &["run", "s.toml", "--cycles", "10", "--json"],
    &["check", "s.toml"],
    &["schema", "robots"],
    &["completions", "bash"],
    &["new", "robots", "new.toml", "--json"],
    &["man", "man1"],
    &["sweep", "s.toml", "--cycles", "10", "--replicate", "2"],
    &["--help"],
    &["run", "--help"],
];

#[test]
fn output_that_cannot_be_written_ends_with_an_error_and_exit_code_1() {
    let place = TestFolder::new();
    for args in PRINTING {
        let full = OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let ended =
            CommandOutput(place.command(args).stdout(full).output().expect("the binary starts"));
        assert_eq!(ended.code(), 1, "{args:?}: {}", ended.err());
        let told = ended.err();
        assert!(told.contains("cannot write to standard output"), "{args:?}: {told}");
        assert!(told.contains("help"), "{args:?}: {told}");
    }
}

#[test]
fn a_reader_that_has_closed_the_pipe_is_no_error() {
    let place = TestFolder::new();
    for args in [&["schema", "robots"][..], &["completions", "bash"], &["--help"]] {
        let mut command = place.command(args);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = child.expect("the binary starts");
        drop(child.stdout.take());
        let ended = CommandOutput(child.wait_with_output().expect("ended"));
        assert_eq!((ended.code(), ended.err()), (0, String::new()), "{args:?}");
    }
}
