//! Things to which the pages for people refer exist: paths, links, pictures, scenarios, code, columns.

mod columns;
mod copies;

use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use std::path::{Path, PathBuf};

const BOOK: &str = "docs/src";
/// Pages on which all named paths begin at the root.
const PAGES: [&str; 3] = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).expect("the document is there")
}

/// Returns the pages below a folder, by their paths from the root.
fn pages_below(folder: &str) -> Vec<String> {
    let mut pages = Vec::new();
    for entry in std::fs::read_dir(root().join(folder)).expect("a folder") {
        let entry = entry.expect("an entry");
        let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            pages.extend(pages_below(&path));
        } else if path.ends_with(".md") {
            pages.push(path);
        }
    }
    pages.sort();
    pages
}

/// Returns the text between single backticks, outside of code blocks, that looks like a path: it
/// has a `/` and only characters that paths of this repository have. Outputs of runs and sweeps, the
/// contents of their folders, and data outside of the repository are left out.
fn named_paths(text: &str) -> Vec<&str> {
    let is_path = |span: &&str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        span.contains('/') && span.chars().all(plain)
    };
    let elsewhere = [
        "runs/",
        "sweeps/",
        "trajectories/",
        "events/",
        "series/",
        "shares/",
        "variants/",
        "../",
        "/",
    ];
    // Types of ROS 2 are written as paths are.
    let is_ours =
        |span: &&str| !elsewhere.iter().any(|p| span.starts_with(p)) && !span.contains("_msgs/");
    let prose = text.split("```").step_by(2);
    let spans = prose.flat_map(|part| part.split('`').skip(1).step_by(2));
    spans.filter(is_path).filter(is_ours).collect()
}

/// Returns the targets of links and pictures within the repository; `::` is in links to documented items.
fn linked_paths(text: &str) -> Vec<&str> {
    let prose = text.split("```").step_by(2);
    let targets = prose.flat_map(|part| part.split("](").skip(1));
    let targets = targets.filter_map(|rest| rest.split([')', '#']).next());
    targets
        .filter(|target| !target.is_empty() && !target.contains("://") && !target.contains("::"))
        .collect()
}

/// Returns the contents of the blocks in a language.
fn blocks<'a>(text: &'a str, language: &str) -> Vec<&'a str> {
    let blocks = text.split("```").skip(1).step_by(2);
    let fence = format!("{language}\n");
    blocks.filter_map(|block| block.strip_prefix(&fence)).collect()
}

#[test]
fn every_path_that_a_page_names_exists() {
    let mut missing = Vec::new();
    for page in PAGES.map(String::from).into_iter().chain(pages_below(BOOK)) {
        let text = read(&page);
        let is_missing = |path: &&str| !root().join(path).exists();
        missing.extend(
            named_paths(&text).into_iter().filter(is_missing).map(|p| format!("{page}: {p}")),
        );
    }
    assert_eq!(missing, [""; 0]);
}

#[test]
fn every_link_and_picture_of_a_page_exists() {
    let folders = [BOOK, "crates", "examples"].into_iter().flat_map(pages_below);
    let (mut missing, mut links) = (Vec::new(), 0);
    for page in PAGES.map(String::from).into_iter().chain(folders) {
        let (text, place) = (read(&page), root().join(&page));
        let linked = linked_paths(&text);
        links += linked.len();
        let is_missing = |path: &&str| !place.with_file_name(path).exists();
        missing.extend(linked.into_iter().filter(is_missing).map(|p| format!("{page}: {p}")));
    }
    assert_eq!(missing, [""; 0]);
    assert!(links > 20, "the test looks for the wrong thing: {links} links");
}

#[test]
fn every_chapter_is_in_the_summary_once_and_no_link_leaves_the_book() {
    let summary = read("docs/src/SUMMARY.md");
    let mut listed = linked_paths(&summary);
    listed.sort_unstable();
    let pages = pages_below(BOOK);
    let chapters: Vec<&str> = pages.iter().filter_map(|p| p.strip_prefix("docs/src/")).collect();
    let chapters: Vec<&str> = chapters.into_iter().filter(|&c| c != "SUMMARY.md").collect();
    assert_eq!(listed, chapters);
    for page in &pages {
        let leaving: Vec<String> = linked_paths(&read(page))
            .into_iter()
            .filter(|path| path.starts_with("..") || path.starts_with('/'))
            .map(String::from)
            .collect();
        assert_eq!(
            leaving, [""; 0],
            "{page}: what a built book does not hold is named, not linked"
        );
    }
}

#[test]
fn every_whole_scenario_that_a_page_shows_compiles() {
    let mut scenarios = 0;
    for page in ["README.md".to_string()].into_iter().chain(pages_below(BOOK)) {
        let text = read(&page);
        let whole = blocks(&text, "toml").into_iter().filter(|block| block.contains("world = "));
        for scenario in whole {
            let source = Source::new(&page, scenario, root().join("examples"));
            WORLDS.compile(&source).unwrap_or_else(|error| panic!("{error}"));
            scenarios += 1;
        }
    }
    assert!(scenarios > 2, "the test looks for the wrong thing: {scenarios} scenarios");
}

#[test]
fn the_code_that_the_book_shows_stands_in_an_example_that_is_compiled() {
    let folders = ["crates/sidestep/examples", "crates/cli/examples"].map(|path| root().join(path));
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(folder).expect("examples"));
    let files = files.map(|file| file.expect("a file").path());
    let examples: Vec<String> =
        files.map(|file| std::fs::read_to_string(file).expect("an example")).collect();
    let mut shown = 0;
    for page in pages_below(BOOK) {
        for block in blocks(&read(&page), "rust") {
            assert!(examples.iter().any(|text| text.contains(block)), "{page}: {block}");
            shown += 1;
        }
    }
    assert!(shown > 1, "the test looks for the wrong thing: {shown} blocks");
}

#[test]
fn only_what_looks_like_a_path_is_taken_for_one() {
    let text = "`a/b.rs`, `cargo run x/y`, `runs/office`, `../shared`, ```\n`c/d`\n``` and `e/`";
    assert_eq!(named_paths(text), ["a/b.rs", "e/"]);
    assert_eq!(linked_paths("[a](b.md#c) [d](https://e) ![f](g.png) [h](a::B)"), ["b.md", "g.png"]);
    assert_eq!(blocks("```sh\nx\n```\n```toml\ny\n```\n", "toml"), ["y\n"]);
}
