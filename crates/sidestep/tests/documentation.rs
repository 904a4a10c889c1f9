//! All files and folders that ARCHITECTURE.md and README.md name exist, and the scenarios in the
//! README are valid.

use sidestep::scenario::Source;
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the text between single backticks, outside of code blocks, that looks like a path: it
/// has a `/` and only characters that paths of this repository have. Outputs of runs, and data
/// outside of the repository, are left out.
fn named_paths(text: &str) -> Vec<&str> {
    let is_path = |span: &&str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        span.contains('/') && span.chars().all(plain)
    };
    let is_ours = |span: &&str| !["runs/", "../", "/"].iter().any(|p| span.starts_with(p));
    let prose = text.split("```").step_by(2);
    let spans = prose.flat_map(|part| part.split('`').skip(1).step_by(2));
    spans.filter(is_path).filter(is_ours).collect()
}

/// Returns the targets of links and pictures within the repository.
fn linked_paths(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
    targets.filter(|target| !target.is_empty() && !target.contains("://")).collect()
}

fn read(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).expect("the document is there")
}

fn missing(document: &str) -> Vec<String> {
    let text = read(document);
    let named = [named_paths(&text), linked_paths(&text)].concat();
    assert!(!named.is_empty(), "{document} names no path: the test looks for the wrong thing");
    let is_missing = |path: &&&str| !root().join(path).exists();
    named.iter().filter(is_missing).map(|path| format!("{document}: {path}")).collect()
}

#[test]
fn every_path_that_the_architecture_names_exists() {
    assert_eq!(missing("ARCHITECTURE.md"), [""; 0]);
}

#[test]
fn every_path_that_the_readme_names_exists() {
    assert_eq!(missing("README.md"), [""; 0]);
}

#[test]
fn the_scenario_that_the_readme_shows_compiles() {
    let readme = read("README.md");
    let scenarios: Vec<&str> = readme.split("```toml\n").skip(1).collect();
    assert_eq!(scenarios.len(), 1);
    let text = scenarios[0].split("```").next().unwrap_or_default();
    let source = Source::new("README.md", text, root());
    Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial).expect("a right scenario");
}

#[test]
fn only_what_looks_like_a_path_is_taken_for_one() {
    let text = "`a/b.rs`, `cargo run x/y`, `runs/office`, `../shared`, ```\n`c/d`\n``` and `e/`";
    assert_eq!(named_paths(text), ["a/b.rs", "e/"]);
    assert_eq!(linked_paths("[a](b.md#c) [d](https://e) ![f](g.png)"), ["b.md", "g.png"]);
}
