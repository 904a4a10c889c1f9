//! Rules of this repository that neither cargo nor clippy can hold.

use crate::imports;
use crate::workspace::{self, Package};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Packages that only some crates may depend on: each is heavy, or the one way to a format or a network.
/// `cargo deny` could hold them, but not everybody who runs the tests has it.
const RESERVED: [(&str, &[&str]); 10] = [
    ("parquet", &["sidestep-record", "sidestep-import"]),
    ("mcap", &["sidestep-record", "sidestep-import"]),
    ("foxglove", &["sidestep-record"]),
    ("arrow-array", &["sidestep-python"]),
    ("clap", &["sidestep-cli"]),
    ("pyo3", &["sidestep-python", "sidestep-python-native", "sidestep-pond-python"]),
    ("axum", &["sidestep-server"]),
    ("tokio", &["sidestep-server", "sidestep-workspace-hack"]),
    ("zenoh", &["sidestep-link"]),
    ("rumqttc", &["sidestep-link"]),
];

/// Below it each crate is a world; no other place tells them apart.
const WORLDS: &str = "crates/worlds";

/// Crates that depend on a world, through others too. All else takes worlds as an argument, or needs none.
const KNOWS_WORLDS: [&str; 8] = [
    "sidestep",
    "sidestep-cli",
    "sidestep-fuzz",
    "sidestep-link",
    "sidestep-papers",
    "sidestep-pond-python",
    "sidestep-python",
    "sidestep-python-native",
];

/// Code outside of these crates that serves any world: what it needs of one, the world declares (its `facts.rs`).
const SERVES_ANY_WORLD: [&str; 6] = [
    "crates/session/src/fleet.rs",
    "python/sidestep/envs",
    "python/sidestep/plot.py",
    "studio/src/edit/canvas-editor.svelte.ts",
    "studio/src/edit/import.ts",
    "studio/src/edit/tools",
];

fn packages() -> Vec<Package> {
    workspace::read(crate::root()).unwrap()
}

#[test]
fn reserved_packages_are_used_by_their_crates_alone() {
    for package in packages() {
        for (reserved, users) in RESERVED.iter().filter(|(name, _)| package.depends_on(name)) {
            let name = package.name();
            assert!(users.contains(&name), "{name} depends on {reserved}: only {users:?} may");
        }
    }
}

/// Returns whether a package depends on a world, through others too.
fn knows_world(packages: &[Package], package: &Package) -> bool {
    let mut others = packages.iter().filter(|other| package.depends_on(other.name()));
    others.any(|other| other.is_in(WORLDS) || knows_world(packages, other))
}

#[test]
fn worlds_are_known_to_the_facade_and_its_users_alone() {
    let packages = packages();
    let knows: BTreeSet<&str> = packages
        .iter()
        .filter(|package| knows_world(&packages, package))
        .map(|package| package.name())
        .collect();
    assert_eq!(knows, BTreeSet::from(KNOWS_WORLDS));
}

/// Returns the file itself, or those directly in the folder.
fn files_at(path: &Path) -> Vec<PathBuf> {
    match fs::read_dir(path) {
        Ok(entries) => entries.map(|entry| entry.unwrap().path()).filter(|p| p.is_file()).collect(),
        Err(_) => vec![path.to_path_buf()],
    }
}

/// Returns the files of Rust in a folder and in those within it.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let (folders, mut files): (Vec<PathBuf>, Vec<PathBuf>) = entries.partition(|p| p.is_dir());
    files.retain(|path| path.extension().is_some_and(|extension| extension == "rs"));
    files.extend(folders.iter().flat_map(|inner| files_below(inner)));
    files
}

#[test]
fn code_that_serves_any_world_names_none() {
    let packages = packages();
    let worlds = packages.iter().filter(|package| package.is_in(WORLDS));
    let worlds: Vec<&str> =
        worlds.filter_map(|package| package.name().strip_prefix("sidestep-")).collect();
    assert!(worlds.contains(&"robots"), "{worlds:?}");
    for path in SERVES_ANY_WORLD.iter().flat_map(|path| files_at(&crate::root().join(path))) {
        let text = fs::read_to_string(&path).unwrap();
        // Examples in documentation are of some world.
        let is_example = |line: &&str| {
            ["///", ">>>", "...", "*"].iter().any(|mark| line.trim_start().starts_with(mark))
        };
        for line in text.lines().filter(|line| !is_example(line)) {
            let named = worlds.iter().find(|world| line.contains(&format!("\"{world}\"")));
            assert_eq!(named, None, "{}: {line}", path.display());
        }
    }
}

#[test]
fn layers_have_all_modules_of_their_crates_and_no_others() {
    let packages = packages();
    for (name, layers) in imports::read_layers(crate::root()).unwrap() {
        let package = packages.iter().find(|package| package.name() == name);
        let package = package.unwrap_or_else(|| panic!("xtask/layers.toml: no crate {name}"));
        let mut modules = BTreeSet::new();
        for source in package.sources().unwrap() {
            // Files of tests are in no layer.
            if source.code_lines > 0 && source.module.len() > 1 {
                let module = source.module[1..].join("::");
                let layer = imports::layer(&source.module, &layers);
                assert!(layer.is_some(), "xtask/layers.toml: {module} of {name} is in no layer");
                modules.insert(module);
            }
        }
        for module in layers.iter().flatten() {
            assert!(modules.contains(module), "xtask/layers.toml: {name} has no module {module}");
        }
    }
}

/// Crates whose types are read from files of users.
const READS_FILES: [&str; 8] = [
    "crates/collectives",
    "crates/error-models",
    "crates/experiment",
    "crates/import",
    "crates/learn",
    "crates/map",
    "crates/scenario",
    "crates/worlds",
];

/// Returns the attributes of an enum whose variants serde tells apart by a key, if it reads them from there.
fn tagged_attributes(item: &syn::ItemEnum) -> Option<String> {
    let lists = item.attrs.iter().filter_map(|attribute| attribute.meta.require_list().ok());
    let text: String =
        lists.map(|list| format!("{} {}\n", list.path.segments[0].ident, list.tokens)).collect();
    let is_read =
        text.contains("Deserialize") && text.contains("tag =") && !text.contains("from =");
    is_read.then_some(text)
}

/// Serde reads such an enum by its key first, and accepts any other keys unless it is told not to; beside a variant without
/// braces it accepts them in any case.
#[test]
fn tables_with_a_kind_refuse_keys_that_they_do_not_know() {
    let mut tagged = 0;
    for path in READS_FILES.iter().flat_map(|folder| files_below(&crate::root().join(folder))) {
        let text = fs::read_to_string(&path).unwrap();
        // Parsing takes long, and few files have one.
        if !text.contains("tag =") {
            continue;
        }
        let file = syn::parse_file(&text).unwrap();
        let enums = file.items.iter().filter_map(|item| match item {
            syn::Item::Enum(item) => Some((item, tagged_attributes(item)?)),
            _ => None,
        });
        for (item, attributes) in enums {
            let name = format!("{}: {}", path.display(), item.ident);
            assert!(attributes.contains("deny_unknown_fields"), "{name} accepts unknown keys");
            let unit = item.variants.iter().find(|one| matches!(one.fields, syn::Fields::Unit));
            let unit = unit.map(|variant| variant.ident.to_string());
            assert_eq!(unit, None, "{name} accepts any keys beside it: read it as a variant {{}}");
            tagged += 1;
        }
    }
    assert!(tagged >= 2, "{tagged} tables with a kind are known");
}
