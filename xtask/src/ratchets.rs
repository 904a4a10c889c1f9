//! Counts that may not grow, in `xtask/ratchets.toml`.

use crate::shape::Counts;
use std::fmt::Write;

/// Figures that are held.
const HELD: [&str; 5] =
    ["tuple_lets", "bool_matches", "many_parameters", "arrows_back_up", "circles"];

const HEADER: &str = "\
# Counts of `cargo xtask shape` that may not grow; a count that is not here is 0. A test holds them,
# `cargo xtask shape --list FIGURE` shows the places, and `--ratchet` writes counts that have shrunk.
";

/// Writes the counts that have shrunk, and returns those that have grown.
pub(crate) fn tighten(counts: &Counts) -> Result<String, String> {
    let path = crate::root().join("xtask/ratchets.toml");
    let mut limits = limits();
    // The code of a new crate comes from others, whose counts shrink: it begins with what it has.
    for (name, counts) in counts {
        limits.entry(name.clone()).or_insert_with(|| counts.clone());
    }
    let (grown, lines) = compared(&limits, counts);
    std::fs::write(&path, HEADER.to_string() + &lines)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(grown)
}

fn limits() -> Counts {
    toml::from_str(include_str!("../ratchets.toml")).expect("counts of crates")
}

/// Returns the counts that have grown, and a line for each crate with the smaller of limit and count.
fn compared(limits: &Counts, counts: &Counts) -> (String, String) {
    let mut grown = String::new();
    let mut lines = String::new();
    for (name, counts) in counts {
        let mut held = Vec::new();
        for figure in HELD {
            let limit =
                limits.get(name).and_then(|limits| limits.get(figure)).copied().unwrap_or(0);
            let count = counts.get(figure).copied().unwrap_or(0);
            if count > limit {
                let _ = writeln!(grown, "{name}: {figure} may not grow from {limit} to {count}");
            }
            held.push(format!("{figure} = {}", count.min(limit)));
        }
        let _ = writeln!(lines, "{name} = {{ {} }}", held.join(", "));
    }
    (grown, lines)
}

#[test]
fn no_count_has_grown() {
    let tree = crate::shape::of(crate::root()).unwrap();
    let (grown, _) = compared(&limits(), &tree.counts);
    assert!(grown.is_empty(), "see `cargo xtask shape --list FIGURE`\n{grown}");
}

#[test]
fn counts_shrink_and_do_not_grow() {
    let limits = toml::from_str("a = { circles = 2, tuple_lets = 5 }").unwrap();
    let counts = toml::from_str("a = { circles = 3, tuple_lets = 4, reasons = 9 }").unwrap();
    let (grown, lines) = compared(&limits, &counts);
    assert_eq!(grown, "a: circles may not grow from 2 to 3\n");
    assert!(lines.starts_with("a = { tuple_lets = 4, "), "{lines}");
    assert!(lines.ends_with(", circles = 2 }\n"), "{lines}");
}
