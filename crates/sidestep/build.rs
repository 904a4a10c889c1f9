//! Gives the build an identity beside its version: a digest over everything that results follow from, which is
//! the sources, the libraries of others (`libm` among them) and the compiler. Runs and sweeps that one build
//! started are not continued by another.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The crate that makes tables of many runs; like the worlds, it determines results, with all that it uses.
const EXPERIMENT: &str = "experiment";
/// Folder of the crates of worlds.
const WORLDS: &str = "worlds";

fn main() {
    let here = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("cargo says where"));
    let version = env::var("CARGO_PKG_VERSION").expect("cargo says which");
    println!("cargo::rerun-if-changed=build.rs");
    // A package outside of the repository, with nothing beside it, has only its version.
    let build = match ingredients(&here) {
        Ok(ingredients) => format!("{version}+{}", digest(ingredients)),
        Err(_) => version,
    };
    println!("cargo::rustc-env=SIDESTEP_BUILD={build}");
}

/// Everything that results follow from, by name.
type Ingredients = Vec<(String, String)>;

/// Returns the sources, the versions of all libraries, and that of the compiler.
pub(crate) fn ingredients(here: &Path) -> io::Result<Ingredients> {
    let crates = here.parent().ok_or(io::ErrorKind::NotFound)?;
    let mut found = Vec::new();
    for file in sources(here, crates)? {
        let name = file.strip_prefix(crates).map_err(io::Error::other)?;
        let parts: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
        found.push((parts.join("/"), text(&file)?));
    }
    let lock = crates.with_file_name("Cargo.lock");
    // Cargo looks for changes of a file that is missing each time it builds.
    if lock.is_file() {
        println!("cargo::rerun-if-changed={}", lock.display());
        found.push(("Cargo.lock".into(), text(&lock)?));
    }
    found.push(("rustc --version".into(), compiler()?));
    Ok(found)
}

/// Returns the files that results follow from: those of the worlds and of experiments, and of all that they use.
fn sources(here: &Path, crates: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = vec![here.join("Cargo.toml")];
    for root in used_crates(crates)? {
        let manifest = root.join("Cargo.toml");
        let sources = root.join("src");
        println!("cargo::rerun-if-changed={}", manifest.display());
        println!("cargo::rerun-if-changed={}", sources.display());
        files.push(manifest);
        find_sources(&sources, &mut files)?;
    }
    Ok(files)
}

/// Returns the folders of the worlds and of experiments, and of the crates beside them that they use, through others
/// too.
fn used_crates(crates: &Path) -> io::Result<Vec<PathBuf>> {
    let worlds = crates.join(WORLDS);
    println!("cargo::rerun-if-changed={}", worlds.display());
    let mut open = folders(&worlds)?;
    open.push(crates.join(EXPERIMENT));
    let mut others = Vec::new();
    for folder in folders(crates)? {
        // A folder without a manifest is no crate.
        if let Ok(manifest) = fs::read_to_string(folder.join("Cargo.toml")) {
            others.push((package_name(&manifest), folder));
        }
    }
    let mut used: Vec<PathBuf> = Vec::new();
    while let Some(folder) = open.pop() {
        if used.contains(&folder) {
            continue;
        }
        let manifest = fs::read_to_string(folder.join("Cargo.toml"))?;
        let needs = dependencies(&manifest);
        open.extend(
            others.iter().filter(|(name, _)| needs.contains(name)).map(|(_, at)| at.clone()),
        );
        used.push(folder);
    }
    Ok(used)
}

fn folders(parent: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(parent)? {
        let path = entry?.path();
        if path.is_dir() {
            found.push(path);
        }
    }
    Ok(found)
}

/// Returns the name in a manifest.
fn package_name(manifest: &str) -> String {
    let named = manifest.lines().find_map(|line| line.strip_prefix("name = "));
    named.unwrap_or_default().trim_matches('"').to_string()
}

/// Returns the names of the packages that a manifest needs to be built. Reading it as TOML would need a library that
/// is compiled before anything else.
fn dependencies(manifest: &str) -> Vec<String> {
    let mut is_inside = false;
    let mut names = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            is_inside = line == "[dependencies]";
        } else if is_inside && let Some(end) = line.find(['.', ' ', '=']) {
            names.push(line[..end].to_string());
        }
    }
    names
}

/// Adds code and the presets that are compiled into it.
fn find_sources(folder: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            find_sources(&path, found)?;
        } else if path.extension().is_some_and(|extension| extension == "rs" || extension == "toml")
        {
            found.push(path);
        }
    }
    Ok(())
}

fn text(file: &Path) -> io::Result<String> {
    Ok(fs::read_to_string(file)?.replace("\r\n", "\n"))
}

/// Returns the compiler's version, which does not name the machine. Cargo runs this script again by itself where
/// that has changed.
fn compiler() -> io::Result<String> {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let told = Command::new(rustc).arg("--version").output()?;
    String::from_utf8(told.stdout).map_err(io::Error::other)
}

/// Returns twelve hexadecimal digits over names and texts.
pub(crate) fn digest(mut ingredients: Ingredients) -> String {
    ingredients.sort();
    let mut hasher = blake3::Hasher::new();
    for (name, text) in &ingredients {
        for part in [name, text] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
    }
    hasher.finalize().to_hex()[..12].to_string()
}
