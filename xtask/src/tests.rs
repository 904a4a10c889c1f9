//! A small workspace, read and shown.

use crate::shape::{self, Counts, Tree};
use std::fs;
use std::path::Path;

const FILES: [(&str, &str); 9] = [
    ("Cargo.toml", "[workspace]\nmembers = ['a', 'b']"),
    ("a/Cargo.toml", "[package]\nname = 'a'"),
    ("a/src/lib.rs", "mod high;\nmod low;\n#[cfg(test)]\nmod tests;\npub use high::f;\n"),
    ("a/src/tests.rs", "use crate::low::G;\nuse std::fmt;\n"),
    (
        "a/src/low.rs",
        "use crate::f;\nuse crate::{self, high::{part::{self, P as Q}}};\n\
         fn g() { assert!(super::high::Re::<8>::new(1), \"{}\", Q) }\n",
    ),
    ("a/src/high.rs", "mod part;\npub use part::Thing as Re;\npub fn f() { super::low::g() }\n"),
    (
        "a/src/high/part.rs",
        "/// Doc.\npub struct Thing {\n}\n\
         fn f(a: u8, b: u8, c: u8, d: u8, e: u8, f: u8) {\n\
         // Here,\n// because of this.\nlet (path, count) = (a, b);\nlet (low_m, high_m) = (a, b);\n\
         // A name.\nlet g = |x| x;\nmatch a { true => b, _ => c }\n}\n\
         #[cfg(test)]\nmod tests {\nfn g() { match a { true => b, _ => c } }\n}\n\
         impl Thing {\n#[cfg(test)]\nfn h() { crate::low::g() }\n}\n",
    ),
    ("b/Cargo.toml", "[package]\nname = 'b'"),
    ("b/src/main.rs", "fn main() {\n}\n"),
];

fn write(folder: &Path, path: &str, text: &str) {
    let path = folder.join(path);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

fn small() -> Tree {
    let folder = tempfile::tempdir().unwrap();
    for (path, text) in FILES {
        write(folder.path(), path, text);
    }
    let body = "    a();\n".repeat(41);
    write(folder.path(), "a/tests/it.rs", &format!("fn f() {{\n{body}}}\n"));
    write(folder.path(), "a/build.rs", &format!("fn main() {{\n// Name.\n\n{body}}}\n"));
    write(folder.path(), "xtask/layers.toml", "a = [['low', 'high::part'], ['high']]");
    shape::of(folder.path()).unwrap()
}

#[test]
fn places_are_found_apart_from_tests() {
    let tree = small();
    let found: Vec<(&str, Vec<&str>)> = tree
        .places
        .iter()
        .map(|(figure, places)| (*figure, places.iter().map(String::as_str).collect()))
        .collect();
    assert_eq!(
        found,
        [
            ("arrows_back_up", vec!["a/src/low.rs -> a/src/high.rs"]),
            ("bool_matches", vec!["a/src/high/part.rs:11"]),
            ("circles", vec!["a/src/high.rs a/src/low.rs"]),
            ("long_functions", vec!["a/build.rs:1"]),
            ("many_parameters", vec!["a/src/high/part.rs:4"]),
            ("named_closures", vec!["a/src/high/part.rs:10"]),
            ("reasons", vec!["a/src/high/part.rs:5"]),
            ("tuple_lets", vec!["a/src/high/part.rs:7"]),
        ]
    );
    assert_eq!((tree.counts["a"]["code"], tree.counts["a"]["tests"]), (62, 53));
}

#[test]
fn json_is_read_back_and_a_table_shows_what_was_before() {
    let now = small().counts;
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "shape.json", &shape::json(&now));
    let mut before: Counts = shape::read(&folder.path().join("shape.json")).unwrap();
    assert_eq!(before, now);
    before.remove("b");
    *before.get_mut("a").unwrap().get_mut("code").unwrap() = 10;
    let text = shape::table(Some(&before), &now);
    let rows: Vec<Vec<&str>> = text.lines().map(|row| row.split_whitespace().collect()).collect();
    assert_eq!(rows[0][..4], ["crate", "code", "tests", "tuple_lets/k"]);
    assert_eq!(rows[1][..4], ["a", "10->62", "53", "100.0->16.1"]);
    assert_eq!(rows[2][..4], ["b", "-->2", "-->0", "-->0.0"]);
    assert_eq!(rows[3][..4], ["total", "10->64", "53", "100.0->15.6"]);
}
