//! Files and folders with names that are no text (E1): nothing panics, and no run is lost for its name.
#![cfg(target_os = "linux")]

use crate::support::{CommandOutput, SCENARIO, TestFolder};
use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;

/// Returns a word in which `?` stands for a byte that no text has.
fn word(text: &str) -> OsString {
    OsString::from_vec(text.bytes().map(|b| if b == b'?' { 0xff } else { b }).collect())
}

fn run(place: &TestFolder, line: &str) -> CommandOutput {
    let words = line.split(' ').map(word);
    CommandOutput(place.command(&[]).args(words).output().expect("the binary starts"))
}

#[test]
fn every_command_takes_and_tells_names_that_are_no_text() {
    let place = TestFolder::new();
    std::fs::write(place.path("").join(word("q?.toml")), SCENARIO).expect("written");
    for (line, tells) in [
        ("run q?.toml --cycles 50 --out ou?t --mcap m?.mcap --json", "ou\u{fffd}t"),
        ("resume ou?t --json", "ou\u{fffd}t"),
        ("report ou?t --out p?.html --json", "p\u{fffd}.html"),
        ("export ou?t --to csv --json", "ou\u{fffd}t-csv"),
        ("new robots n?.toml --json", "n\u{fffd}.toml"),
        ("schema robots -o s?.json --json", "s\u{fffd}.json"),
        ("man m?an --json", "m\u{fffd}an"),
        ("sweep plan q?.toml --cycles 50 --replicate 2 --out sw? --json", "sw\u{fffd}"),
        ("sweep status sw? --json", "sw\u{fffd}"),
        ("resume sw? --json", "sw\u{fffd}"),
    ] {
        let ended = run(&place, line);
        assert_eq!(ended.code(), 0, "{line}: {}", ended.err());
        assert!(ended.json().to_string().contains(tells), "{line}: {}", ended.out());
    }
    let summary = place.path("").join(word("ou?t/summary.json"));
    let text = std::fs::read_to_string(&summary).expect("there");
    assert!(text.contains("ou\u{fffd}t"), "{}: {text}", summary.display());
}
