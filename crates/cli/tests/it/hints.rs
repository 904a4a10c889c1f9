//! What the program advises works when it is pasted into a shell, whatever the names of files are; and what files
//! contain does not act on the terminal.

use crate::support::{CommandOutput, TestFolder};
use std::path::Path;
use std::process::{Command, Stdio};

/// Name of a folder that a shell, and a command line, would read otherwise.
const NAME: &str = "--out dir/it's \"$HOME\" `x`; 東京 & co";

/// A sweep of four short runs.
const SWEEP: &str = "format = 1\nscenario = \"s.toml\"\nreplicates = 2\n[set]\ncycles = 50\n\
                     [vary]\npeople.count = [0, 1]\n";

fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("sweep.toml", SWEEP);
    place
}

/// Runs a line in a shell, as a user pastes it.
fn paste(place: &TestFolder, line: &str) -> CommandOutput {
    let program = Path::new(env!("CARGO_BIN_EXE_sidestep"));
    let folder = program.parent().expect("a folder").display();
    let path = format!("{folder}:{}", std::env::var("PATH").unwrap_or_default());
    let mut shell = Command::new("sh");
    shell.args(["-c", line]).env("PATH", path).current_dir(place.path(""));
    CommandOutput(shell.stdin(Stdio::null()).output().expect("a shell"))
}

/// Returns the commands of this program in a text: in backticks, and at the ends of lines.
fn commands(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in text.lines() {
        let Some(start) = line.find("sidestep ") else { continue };
        let is_quoted = line[..start].ends_with('`');
        let command = &line[start..];
        // The last backtick of the line, because names may have some.
        let end = if is_quoted { command.rfind('`') } else { None };
        found.push(command[..end.unwrap_or(command.len())].to_string());
    }
    found
}

/// Pastes all commands of an output, of which there are `count`.
fn paste_all(place: &TestFolder, output: &CommandOutput, count: usize) {
    let text = output.out() + &output.err();
    let all = commands(&text);
    assert_eq!(all.len(), count, "{text}");
    for command in all {
        let ended = paste(place, &command);
        assert_eq!(ended.code(), 0, "{command}\n{}", ended.err());
    }
}

#[test]
fn what_a_run_advises_works_when_pasted() {
    let place = place();
    let run = place.run(&["run", "s.toml", "--cycles", "50", &format!("--out={NAME}")]);
    assert_eq!(run.code(), 0, "{}", run.err());
    // A page of the run.
    paste_all(&place, &run, 1);
    assert!(place.path(NAME).join("report.html").exists());
}

#[test]
fn what_a_new_scenario_advises_works_when_pasted() {
    let place = TestFolder::new();
    let new = place.run(&["new", "airspace", "a b's.toml"]);
    let advised = commands(&new.out());
    assert_eq!(advised.len(), 2, "{}", new.out());
    let checked = paste(&place, &advised[0]);
    assert_eq!(checked.code(), 0, "{}", checked.err());
    // The scenario is a long one.
    let run = paste(&place, &format!("{} --cycles 5", advised[1]));
    assert_eq!(run.code(), 0, "{}", run.err());
}

#[test]
fn what_a_sweep_advises_works_when_pasted() {
    let place = place();
    let out = format!("--out={NAME}");
    // All its runs, then their table.
    let plan = place.run(&["sweep", "plan", "sweep.toml", &out]);
    paste_all(&place, &plan, 2);
    // A page of it.
    let status = place.run(&["sweep", "status", "--", NAME]);
    paste_all(&place, &status, 1);
    // The same folder for another sweep: the advice is to continue this one.
    let other = place.run(&["sweep", "sweep.toml", "--replicate", "3", &out]);
    assert_eq!(other.code(), 2, "{}", other.err());
    paste_all(&place, &other, 1);
}

#[test]
fn what_an_unfinished_sweep_advises_works_when_pasted() {
    let place = place();
    place.run(&["sweep", "plan", "sweep.toml", &format!("--out={NAME}")]);
    let collected = place.run(&["sweep", "collect", "--", NAME]);
    assert_eq!(collected.code(), 1);
    paste_all(&place, &collected, 1);
    assert!(place.path(NAME).join("results.parquet").exists());
}

#[test]
fn what_a_file_contains_does_not_act_on_the_terminal() {
    let place = place();
    place.write("esc.toml", "a\x1b[31mRED\x1b]0;pwned\x07 = ");
    place.write("bytes.toml", b"PAR1\x15\x04\xff\x00\x1b[31m");
    place.write("key.toml", "format = 1\nworld = \"robots\"\n\"\\u001b[2J\\u202e\" = 1\n");
    let named = place.path("n\x1b[31m.toml");
    std::fs::write(&named, "format = 1\nworld = \"\\u001b[5m\"\n").expect("written");
    let named = named.display().to_string();
    for args in [
        ["check", "esc.toml"],
        ["check", "bytes.toml"],
        ["check", "key.toml"],
        ["check", &named],
        ["run", &named],
        ["map", "bytes.toml"],
        ["sweep", "esc.toml"],
        ["report", "no\x1b[31mfolder"],
        ["check", "--\x1b[31m"],
    ] {
        let ended = place.run(&args);
        assert_eq!(ended.code(), 2, "{args:?}");
        for text in [ended.out(), ended.err()] {
            let acts =
                |c: char| (c.is_control() && c != '\n') || ('\u{202a}'..='\u{202e}').contains(&c);
            assert!(!text.contains(acts), "{args:?}: {text:?}");
        }
        assert!(!ended.err().is_empty());
    }
    let binary = place.run(&["check", "bytes.toml"]).err();
    assert!(binary.contains("is a Parquet file"), "{binary}");
}

#[test]
fn names_with_controls_are_the_same_in_json() {
    let place = TestFolder::new();
    let scenario =
        place.read("s.toml").replace("name = \"small\"", "name = \"a\\u001b[31m\\u009b\"");
    place.write("s.toml", scenario);
    let run = place.run(&["run", "s.toml", "--cycles", "10", "--json"]);
    assert!(!run.out().contains(|c: char| c.is_control() && c != '\n'), "{:?}", run.out());
    assert_eq!(run.json()["name"], "a\u{1b}[31m\u{9b}");
}
