//! Every command that the README and the book show runs as it stands, from a fresh copy of the files of a clone.
//!
//! Commands are the lines of blocks in the language `sh` that begin with `sidestep` or
//! `cargo run --release --`. A block that no test can run is marked `sh ignore`, and its page says why.

use crate::support::TestFolder;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const BINARY: &str = env!("CARGO_BIN_EXE_sidestep");
/// Files that commands of the pages read.
const INPUTS: [&str; 2] = ["examples", "scenarios"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the commands of a page in their order, each on one line.
fn commands(page: &str) -> Vec<String> {
    // Every other part is a block, and begins with its language.
    let blocks = page.split("```").skip(1).step_by(2);
    let shell = blocks.filter_map(|block| block.strip_prefix("sh\n"));
    let joined = shell.map(|block| block.replace("\\\n", " ")).collect::<String>();
    let from_source = |line: &str| line.replacen("cargo run --release --", "sidestep", 1);
    let lines = joined.lines().map(from_source);
    lines.filter(|line| line.starts_with("sidestep ")).collect()
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir(to).expect("a new folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let copied = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy(&path, &copied);
        } else {
            std::fs::copy(&path, copied).expect("copied");
        }
    }
}

/// Runs the commands of a page as a shell would, in a folder of its own; returns how many there are.
fn run_all(page: &Path) -> usize {
    let place = tempfile::tempdir().expect("a temporary folder");
    for input in INPUTS {
        copy(&root().join(input), &place.path().join(input));
    }
    let binaries = Path::new(BINARY).parent().expect("a folder").display();
    let path = format!("{binaries}:{}", std::env::var("PATH").unwrap_or_default());
    let mut all = commands(&std::fs::read_to_string(page).expect("the page"));
    // They need a program that is not always built; the commands that read their folders go with them.
    let is_of_fleets = |line: &String| line.starts_with("sidestep fleet");
    if all.iter().any(is_of_fleets) && !crate::fleet::is_there() {
        all.truncate(all.iter().position(is_of_fleets).unwrap_or(0));
    }
    for line in &all {
        let mut shell = Command::new("sh");
        shell.args(["-c", line]).current_dir(place.path()).env("PATH", &path);
        let ended = shell.output().expect("a shell");
        let said = String::from_utf8_lossy(&ended.stderr);
        assert!(ended.status.success(), "{}: `{line}`: {said}", page.display());
    }
    all.len()
}

#[test]
fn every_command_of_the_readme_runs() {
    assert!(run_all(&root().join("README.md")) > 15, "the README shows what there is");
}

#[test]
fn every_command_of_the_book_runs() {
    let pages = std::fs::read_dir(root().join("docs/src")).expect("the book");
    let mut pages: Vec<PathBuf> = pages.map(|page| page.expect("an entry").path()).collect();
    pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    pages.sort();
    let commands: usize = pages.iter().map(|page| run_all(page)).sum();
    assert!(commands > 15, "the book shows how: {commands}");
}

/// A reader goes on from the README to the book in one clone, where a folder can hold one run.
#[test]
fn no_two_pages_record_into_one_folder() {
    let mut pages = vec![root().join("README.md")];
    let book = std::fs::read_dir(root().join("docs/src")).expect("the book");
    pages.extend(book.map(|page| page.expect("an entry").path()).filter(|page| page.is_file()));
    let mut taken: BTreeMap<String, PathBuf> = BTreeMap::new();
    for page in &pages {
        for line in commands(&std::fs::read_to_string(page).expect("text")) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let out =
                words.iter().position(|word| *word == "--out").map(|k| words[k + 1].to_string());
            let Some(out) = out.filter(|_| !words.contains(&"--replace")) else { continue };
            let first = taken.entry(out.clone()).or_insert_with(|| page.clone());
            assert_eq!(first, page, "{out} of {} is taken", page.display());
        }
    }
    assert!(taken.len() > 8, "{taken:?}");
}

#[test]
fn commands_are_found_in_blocks_of_shell_only() {
    let page = "sidestep a\n```sh\nsidestep run \\\n  x # why\nmkdir y\ncargo run --release -- new z\n```\n\
                ```sh ignore\nsidestep b\n```\n```text\nsidestep c\n```\n";
    assert_eq!(commands(page), ["sidestep run    x # why", "sidestep new z"]);
}

#[test]
fn the_chapter_of_columns_has_every_column_of_a_sweep() {
    let place = TestFolder::new();
    place.json(&[
        "sweep",
        "s.toml",
        "--vary",
        "robots.0.count=1,2",
        "--cycles",
        "50",
        "--out",
        "d",
    ]);
    let chapter = std::fs::read_to_string(root().join("docs/src/columns.md")).expect("the chapter");
    for table in ["results", "timings", "cells"] {
        let path = place.path(&format!("d/{table}.parquet"));
        let read = sidestep_record::run_table::read::<Value>(&path).expect("a table");
        for column in read.columns.iter().filter(|column| column.role != "parameter") {
            // Metrics that are maps or lists have a column for each key, or for their length.
            let map = column.name.find("_by_").and_then(|_| column.name.split('.').next());
            let name = map.unwrap_or(&column.name);
            let name = name.strip_suffix("_count").unwrap_or(name);
            assert!(chapter.contains(&format!("`{name}`")), "{table}: {}", column.name);
        }
    }
}
