//! What cargo compiles for each program: nothing that it would compile once more for another one.
//!
//! The features of packages of others are unified by `crates/workspace-hack` (see `.config/hakari.toml`), on which
//! the programs depend. Where this test fails after a change of dependencies, `cargo hakari generate` renews it.

use serde_json::Value;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::process::Command;

/// Programs that are built one by one into the folder in which tests, lints and documentation are built.
const PROGRAMS: [&str; 5] =
    ["sidestep-cli", "sidestep-link", "sidestep-python-native", "sidestep-pond-python", "xtask"];

/// Returns the units that cargo would compile for a choice of crates: the name of the package by the identity.
fn units(choice: &[&str]) -> BTreeMap<u64, String> {
    let output = Command::new(env!("CARGO"))
        .args(["build", "--release", "--offline", "--locked", "--unit-graph"])
        .args(["-Z", "unstable-options"])
        .args(choice)
        // The only exact answer to what cargo is going to compile is behind an unstable option.
        .env("RUSTC_BOOTSTRAP", "1")
        .current_dir(crate::root())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let graph: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let units = graph["units"].as_array().expect("units");
    let mut identities = vec![None; units.len()];
    let packages = units.iter().map(|unit| unit["pkg_id"].as_str().expect("a package").to_owned());
    packages
        .enumerate()
        .map(|(index, package)| (identity(index, units, &mut identities), package))
        .collect()
}

/// Returns a digest of all that makes a unit another one: package, target, features, profile, and the units that it
/// depends on.
fn identity(index: usize, units: &[Value], known: &mut [Option<u64>]) -> u64 {
    if let Some(identity) = known[index] {
        return identity;
    }
    let dependencies = units[index]["dependencies"].as_array().expect("dependencies");
    let dependencies = dependencies.iter().map(|unit| unit["index"].as_u64().expect("an index"));
    let mut dependencies: Vec<u64> =
        dependencies.map(|index| identity(index as usize, units, known)).collect();
    // Cargo's order of dependencies follows from the choice of crates.
    dependencies.sort_unstable();
    let mut hasher = DefaultHasher::new();
    dependencies.hash(&mut hasher);
    for key in ["pkg_id", "target", "features", "profile", "mode", "platform"] {
        units[index][key].to_string().hash(&mut hasher);
    }
    *known[index].insert(hasher.finish())
}

#[test]
fn no_program_compiles_again_what_another_has_compiled() {
    let all = units(&["--workspace", "--all-targets"]);
    for program in PROGRAMS {
        let own = units(&["--package", program]);
        assert!(own.len() > 50, "{program} is built of {} units", own.len());
        let again = own.iter().filter(|(identity, _)| !all.contains_key(identity));
        let again: Vec<&String> = again.map(|(_, package)| package).collect();
        assert!(
            again.is_empty(),
            "{program}: run `cargo hakari generate`: compiled again {again:#?}"
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
