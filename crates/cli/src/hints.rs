//! Tests of the commands that texts of this program advise: the command line reads each of them.

use crate::args::command;
use clap::error::ErrorKind;
use std::path::{Path, PathBuf};

/// A command in the source, and where it stands.
struct Hint {
    place: String,
    command: String,
}

/// Returns the root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn source_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries {
        let path = entry.expect("an entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let is_skipped =
            ["tests", "examples", "benches", "target", "node_modules"].contains(&&*name);
        if path.is_dir() && !is_skipped {
            source_files(&path, files);
        } else if name.ends_with(".rs") && !name.ends_with("tests.rs") && name != "hints.rs" {
            files.push(path);
        }
    }
}

/// Returns the text of a source file without comments and tests, and each literal on one line.
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).expect("a source file");
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let mut code = String::new();
    let mut continues = false;
    for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
        let line = if continues { line.trim_start() } else { line };
        continues = line.ends_with('\\') && !line.ends_with("\\n\\");
        code.push_str(line.trim_end_matches('\\'));
        if !continues {
            code.push('\n');
        }
    }
    code
}

/// Returns the commands in backticks, those made of a path, and the examples of helps.
fn hints() -> Vec<Hint> {
    let mut files = Vec::new();
    for folder in ["crates", "python/src"] {
        source_files(&root().join(folder), &mut files);
    }
    let mut hints = Vec::new();
    for path in &files {
        let place = path.display().to_string();
        let code = code(path);
        let mut add = |command: &str| {
            hints.push(Hint { place: place.clone(), command: command.to_string() });
        };
        for part in code.split("`sidestep ").skip(1) {
            add(part.split('`').next().unwrap_or_default());
        }
        for part in code.split("sidestep_command(\"").skip(1) {
            add(&format!("{} PATH", part.split('"').next().unwrap_or_default()));
        }
        for line in code.lines().filter_map(|line| line.strip_prefix("  sidestep ")) {
            // What the example does, and what is done with its output, stands behind it.
            let behind = ["  ", " | ", " && ", " > ", "\";"];
            let ends = behind.iter().filter_map(|mark| line.find(mark));
            add(&line[..ends.min().unwrap_or(line.len())]);
        }
    }
    hints
}

/// Returns the words of a command, with values in place of what is filled in.
fn words(command: &str) -> Vec<String> {
    let mut words = vec!["sidestep".to_string()];
    for word in command.trim_end_matches('"').split_whitespace() {
        let name = word.split('{').next().unwrap_or_default();
        words.push(match word {
            "{}" if words.last().is_some_and(|last| last == "new") => "robots".to_string(),
            "N" | "B" | "{}" => "1".to_string(),
            // What a shell would not fill in is meant so.
            _ if word.starts_with('\'') && word.contains("{}") => word.replace('\'', ""),
            _ if word.contains('{') && !name.is_empty() => name.to_string(),
            _ => word.replace(['\'', '"'], ""),
        });
    }
    words
}

/// Returns whether words name a command alone, or one of its options, as texts do that speak of it.
fn is_name(words: &[String]) -> bool {
    let mut command = command();
    // Options of all commands are added to each.
    command.build();
    words[1..].iter().all(|word| match command.find_subcommand(word) {
        None if word.starts_with("--") => {
            command.get_arguments().any(|known| known.get_long() == Some(&word[2..]))
        }
        Some(found) => {
            command = found.clone();
            true
        }
        None => false,
    })
}

#[test]
fn every_command_that_a_text_advises_is_one_of_the_command_line() {
    let hints = hints();
    assert!(hints.len() > 60, "only {} commands were found", hints.len());
    let mut wrong = Vec::new();
    for Hint { place, command: hint } in hints {
        let words = words(&hint);
        if is_name(&words) {
            continue;
        }
        let Err(error) = command().try_get_matches_from(&words) else { continue };
        let is_help = matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
        if !is_help {
            wrong.push(format!("{place}: sidestep {hint}\n{error}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_command_on_a_path_is_made_by_the_function_that_quotes_it() {
    let mut files = Vec::new();
    source_files(&root().join("crates"), &mut files);
    for path in files {
        let code = code(&path);
        for (start, _) in code.match_indices("sidestep ") {
            let rest = &code[start..];
            let line = rest.split(['`', '\n']).next().unwrap_or_default();
            // A path that is filled in without quotes.
            let names_path = ["{path}", "{folder}", "{file}", "{dir}", "{out}", "{there}"];
            let is_bare = names_path.iter().any(|name| line.contains(name));
            assert!(!is_bare, "{}: {line}: use sidestep_command", path.display());
        }
        assert!(!code.contains("sidestep resume {}") && !code.contains("sidestep report {}"));
    }
}
