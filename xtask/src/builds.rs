//! What cargo compiles for each program: nothing that it would compile once more for another one.
//!
//! The features of packages of others are unified by `crates/workspace-hack` (see `.config/hakari.toml`), on which
//! the programs depend. Where this test fails after a change of dependencies, `cargo hakari generate` renews it.

use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Command;

/// Programs that are built one by one into the folder in which tests, lints and documentation are built.
const PROGRAMS: [&str; 4] = ["sidestep-cli", "sidestep-link", "sidestep-python", "xtask"];

/// Returns the units that cargo would compile for a choice of crates: the name of the package by all that makes one
/// compiled unit another, down to its last dependency.
fn units(choice: &[&str]) -> BTreeMap<String, String> {
    let output = Command::new(env!("CARGO"))
        .args(["build", "--release", "--offline", "--locked", "--unit-graph"])
        .args(["-Z", "unstable-options"])
        .args(choice)
        // The only exact answer to what cargo is going to compile is behind an unstable option.
        .env("RUSTC_BOOTSTRAP", "1")
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let graph: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let units = graph["units"].as_array().expect("units");
    let mut identities = vec![None; units.len()];
    (0..units.len())
        .map(|index| {
            let package = units[index]["pkg_id"].as_str().expect("a package").to_owned();
            (identity(index, units, &mut identities), package)
        })
        .collect()
}

/// Returns all that makes a unit another one: package, target, features, profile, and those of its dependencies.
fn identity(index: usize, units: &[Value], known: &mut [Option<String>]) -> String {
    if let Some(identity) = &known[index] {
        return identity.clone();
    }
    let unit = &units[index];
    let dependencies = unit["dependencies"].as_array().expect("dependencies");
    let mut parts: Vec<String> = dependencies
        .iter()
        .map(|dependency| {
            let at = dependency["index"].as_u64().expect("an index") as usize;
            digest(&identity(at, units, known))
        })
        .collect();
    // Cargo's order of dependencies follows from the choice of crates.
    parts.sort();
    for key in ["pkg_id", "target", "features", "profile", "mode", "platform"] {
        parts.push(unit[key].to_string());
    }
    let identity = parts.join("|");
    known[index] = Some(identity.clone());
    identity
}

/// Returns a short name of a text; identities contain those of all dependencies and would grow without it.
fn digest(text: &str) -> String {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

#[test]
fn no_program_compiles_again_what_another_has_compiled() {
    let all = units(&["--workspace", "--all-targets"]);
    for program in PROGRAMS {
        let own = units(&["--package", program]);
        assert!(own.len() > 50, "{program} is built of {} units", own.len());
        let again = own.iter().filter(|(identity, _)| !all.contains_key(*identity));
        let again: Vec<&String> = again.map(|(_, package)| package).collect();
        assert!(
            again.is_empty(),
            "{program} compiles again what the workspace has compiled: {again:#?}; run `cargo hakari generate`"
        );
    }
}

#[test]
fn the_kernel_is_built_without_networks_and_files_of_recordings() {
    let packages = units(&["--package", "sidestep-kernel"]);
    for foreign in ["zenoh", "parquet", "mcap", "tokio", "foxglove"] {
        let is_there = packages.values().any(|package| package.contains(&format!("#{foreign}@")));
        assert!(!is_there, "{foreign} is compiled for the kernel");
    }
    assert!(packages.values().any(|package| package.contains("#serde@")), "{packages:?}");
}
