//! What `scenarios/` shows of files that crates compile in is a copy of them, byte for byte.
//!
//! They are copies and no links, because a checkout on Windows turns links into files with a path as their text.
//! `SIDESTEP_WRITE=scenarios cargo test --release -p sidestep --test documentation copies` renews them.

use super::root;
use std::collections::BTreeMap;
use std::path::Path;

/// Files and folders that crates compile in, and their copies for users.
const COPIES: [(&str, &str); 5] = [
    ("crates/worlds/robots/src/default.toml", "scenarios/robots/default.toml"),
    ("crates/worlds/airspace/src/default.toml", "scenarios/airspace/default.toml"),
    ("crates/worlds/chain/src/default.toml", "scenarios/chain/default.toml"),
    ("crates/arms/examples/arm.urdf", "scenarios/chain/arm.urdf"),
    ("crates/papers/scenarios", "scenarios/papers"),
];

/// A folder whose scenarios have copies of the same names below `scenarios/`. It has pictures beside them.
const GALLERY: &str = "crates/cli/gallery";

/// Returns all files and folders that crates compile in, and their copies.
fn copies() -> Vec<(String, String)> {
    let mut copies: Vec<(String, String)> =
        COPIES.iter().map(|(original, copy)| (original.to_string(), copy.to_string())).collect();
    for name in contents(&root().join(GALLERY)).into_keys() {
        if name.ends_with(".toml") || name.ends_with(".urdf") {
            copies.push((format!("{GALLERY}/{name}"), format!("scenarios/{name}")));
        }
    }
    copies
}

/// Returns the bytes of a file, or of all files below a folder, by their paths within it.
fn contents(path: &Path) -> BTreeMap<String, Vec<u8>> {
    if !path.is_dir() {
        let bytes = std::fs::read(path).unwrap_or_default();
        return BTreeMap::from([(String::new(), bytes)]);
    }
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(path).expect("a folder") {
        let entry = entry.expect("an entry");
        let name = entry.file_name().to_string_lossy().into_owned();
        for (within, bytes) in contents(&entry.path()) {
            files.insert(format!("{name}/{within}"), bytes);
        }
    }
    files
}

/// Replaces a copy by its original.
fn renew(original: &Path, copy: &Path) {
    if !original.is_dir() {
        std::fs::copy(original, copy).expect("copied");
        return;
    }
    // Files of the copy that the original no longer has go with the folder.
    if copy.is_dir() {
        std::fs::remove_dir_all(copy).expect("removed");
    }
    std::fs::create_dir_all(copy).expect("made");
    for entry in std::fs::read_dir(original).expect("a folder") {
        let entry = entry.expect("an entry");
        renew(&entry.path(), &copy.join(entry.file_name()));
    }
}

#[test]
fn scenarios_for_users_are_copies_of_what_is_compiled_in() {
    let is_renewed = std::env::var("SIDESTEP_WRITE").is_ok_and(|what| what == "scenarios");
    for (original, copy) in copies() {
        let original_path = root().join(&original);
        let copy_path = root().join(&copy);
        if is_renewed {
            renew(&original_path, &copy_path);
        }
        assert!(!copy_path.is_symlink(), "{copy} is a link: a checkout on Windows breaks it");
        assert!(
            contents(&original_path) == contents(&copy_path),
            "{copy} differs from {original}, of which it is a copy: change the latter, then run\n  \
             SIDESTEP_WRITE=scenarios cargo test --release -p sidestep --test documentation copies"
        );
    }
}
