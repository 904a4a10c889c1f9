//! Fuzzers of every parser and decoder, [`targets::TARGETS`].
//!
//! An input may be refused, but it may not panic, overflow, hang or take all memory (promise E1). `.ci/soak` compiles
//! this with counters for libFuzzer (`--cfg fuzzing`). Without, it is a program that hands files to a target, for
//! looking into the findings of a fuzzer: `sidestep-fuzz TARGET FILE...`

#![cfg_attr(fuzzing, no_main)]

mod files;
mod packets;
mod targets;

use std::path::PathBuf;
use targets::Target;

/// The target that the environment names. The starter of a fuzzer makes a folder for its files, and deletes it.
#[cfg(fuzzing)]
static CHOSEN: std::sync::LazyLock<Target> = std::sync::LazyLock::new(|| {
    files::keep_in(
        &std::env::var_os("SIDESTEP_FUZZ_FILES").map_or_else(std::env::temp_dir, PathBuf::from),
    );
    let name = std::env::var("SIDESTEP_FUZZ").unwrap_or_default();
    chosen(&name).unwrap_or_else(|message| panic!("SIDESTEP_FUZZ: {message}"))
});

#[cfg(fuzzing)]
libfuzzer_sys::fuzz_target!(|data: &[u8]| (CHOSEN.1)(data));

#[cfg(not(fuzzing))]
fn main() -> Result<(), String> {
    let mut words = std::env::args_os().skip(1);
    let name = words.next().unwrap_or_default();
    let (_, read) = chosen(&name.to_string_lossy())?;
    let scratch = tempfile::tempdir().map_err(|e| format!("no folder for files: {e}"))?;
    files::keep_in(scratch.path());
    for path in words.map(PathBuf::from) {
        let input = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        read(&input);
        println!("{}: no fault", path.display());
    }
    Ok(())
}

/// Returns the target of this name.
///
/// # Errors
///
/// No target has it: all names.
fn chosen(name: &str) -> Result<Target, String> {
    let names = || targets::TARGETS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let target = targets::TARGETS.iter().copied().find(|(own, _)| *own == name);
    target.ok_or_else(|| format!("no target is called `{name}`; there are {}", names()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    const SEEDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/seeds");

    fn entries(folder: impl AsRef<Path>) -> BTreeSet<PathBuf> {
        let entries = fs::read_dir(folder).expect("a folder of seeds");
        entries.map(|entry| entry.expect("an entry").path()).collect()
    }

    #[test]
    fn every_target_has_a_folder_of_seeds_and_every_folder_a_target() {
        let names: BTreeSet<_> =
            targets::TARGETS.iter().map(|(name, _)| Path::new(SEEDS).join(name)).collect();
        assert_eq!(names, entries(SEEDS));
    }

    #[test]
    fn no_target_fails_on_its_seeds_nor_on_halves_of_them() {
        let scratch = tempfile::tempdir().expect("a folder for files");
        files::keep_in(scratch.path());
        for (name, read) in targets::TARGETS {
            let seeds = entries(Path::new(SEEDS).join(name));
            assert!(!seeds.is_empty(), "{name} has no seed");
            for seed in seeds {
                let input = fs::read(seed).expect("a seed");
                read(&input);
                read(&input[..input.len() / 2]);
            }
        }
    }
}
