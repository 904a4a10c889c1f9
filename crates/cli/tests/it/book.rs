//! Every command that the README and the book show runs as it stands, from a fresh copy of the files of a clone.
//!
//! Commands are the lines of blocks in the language `sh` that begin with `sidestep` or
//! `cargo run --release --`. A block that no test can run is marked `sh ignore`, and its page says why.
//!
//! The pictures of a page are those that its commands make: `pictures/NAME.png` is `runs/NAME.png`, or the picture of
//! the run in `runs/NAME`. `SIDESTEP_WRITE=pictures` renews them. That of the studio's page needs a browser, and is
//! none of these.

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
    let text = std::fs::read_to_string(page).expect("the page");
    let mut all = commands(&text);
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
    check_pictures(&text, place.path());
    all.len()
}

/// The folder of the pictures of all pages.
const PICTURES: &str = "docs/src/pictures";
/// The picture of the studio's page, which needs a browser.
const OF_THE_STUDIO: &str = "studio";
/// Pictures of measurements that take too long for a test, with the script of the page that makes each.
const OF_SCRIPTS: [(&str, &str); 1] = [("learning", "python/benches/scores.py")];
/// Largest difference of a color of two pixels that look alike, of 255.
const MAX_DIFFERENCE: u8 = 24;
/// Largest share of pixels of a picture that may look different, as letters of another version do.
const MAX_DIFFERENT_SHARE: f64 = 0.003;

/// Returns the names of the pictures that a page shows, without their endings.
fn pictures(page: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for image in page.split("![").skip(1) {
        let target = image.split_once("](").and_then(|(_, rest)| rest.split_once(')'));
        let file = target.and_then(|(target, _)| target.rsplit_once("pictures/"));
        let name = file.and_then(|(_, file)| file.strip_suffix(".png"));
        names.extend(name.map(str::to_string));
    }
    names
}

/// Returns the picture that the commands of a page have made under a name, if they have.
fn picture_made(place: &Path, name: &str) -> Option<PathBuf> {
    let runs = place.join("runs");
    let candidates = [runs.join(format!("{name}.png")), runs.join(name).join("trajectories.png")];
    candidates.into_iter().find(|path| path.is_file())
}

/// Compares the pictures of a page with those that its commands have made, or renews them.
fn check_pictures(page: &str, place: &Path) {
    for name in pictures(page) {
        let Some(made) = picture_made(place, &name) else { continue };
        let shown = root().join(PICTURES).join(format!("{name}.png"));
        if std::env::var("SIDESTEP_WRITE").is_ok_and(|what| what == "pictures") {
            std::fs::copy(&made, &shown).expect("a picture is written");
            continue;
        }
        let share = different_share(&made, &shown);
        assert!(
            share <= MAX_DIFFERENT_SHARE,
            "{PICTURES}/{name}.png is not what the commands of its page make: {:.1} % of its pixels differ; \
             SIDESTEP_WRITE=pictures renews it",
            100.0 * share
        );
    }
}

/// Returns the share of pixels that look different; all do where sizes differ.
fn different_share(a: &Path, b: &Path) -> f64 {
    let [a, b] = [a, b].map(|path| image::open(path).expect("a picture").to_rgb8());
    if a.dimensions() != b.dimensions() {
        return 1.0;
    }
    let is_different = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| {
        a.0.iter().zip(&b.0).any(|(a, b)| a.abs_diff(*b) > MAX_DIFFERENCE)
    };
    let different = a.pixels().zip(b.pixels()).filter(is_different).count();
    different as f64 / f64::from(a.width() * a.height())
}

#[test]
fn every_picture_is_made_by_a_command_of_a_page_that_shows_it() {
    let mut pages = vec![root().join("README.md")];
    let book = std::fs::read_dir(root().join("docs/src")).expect("the book");
    pages.extend(book.map(|page| page.expect("an entry").path()).filter(|page| page.is_file()));
    let texts: Vec<String> =
        pages.iter().map(|page| std::fs::read_to_string(page).expect("text")).collect();
    let is_made = |name: &str| {
        let places = [format!("--out runs/{name}"), format!("--out runs/{name}.png")];
        let is_one = |line: &String| {
            places.iter().any(|place| line.ends_with(place) || line.contains(&format!("{place} ")))
        };
        texts.iter().any(|text| {
            pictures(text).iter().any(|shown| shown == name) && commands(text).iter().any(is_one)
        })
    };
    let mut checked = 0;
    for entry in std::fs::read_dir(root().join(PICTURES)).expect("the pictures") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if let Some((_, script)) = OF_SCRIPTS.iter().find(|(picture, _)| *picture == name) {
            let makes = |line: &str| line.contains(script) && line.contains(&format!("{name}.png"));
            let is_one = |text: &String| pictures(text).contains(&name) && text.lines().any(makes);
            assert!(texts.iter().any(is_one), "{name}: no page shows it and names {script}");
        } else if name != OF_THE_STUDIO {
            assert!(is_made(&name), "{name}: no page shows it beside the command that makes it");
            checked += 1;
        }
    }
    assert!(checked >= 5, "{checked}");
}

#[test]
fn pictures_of_a_page_are_found_by_their_names() {
    let page =
        "a ![words](docs/src/pictures/office.png) b\n![w](pictures/plan.png)\n[no](pictures/x.png)";
    assert_eq!(pictures(page), ["office", "plan"]);
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
