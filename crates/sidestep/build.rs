//! Gives the build an identity beside its version: a digest over everything that results follow from, which is
//! the sources, the libraries of others (`libm` among them) and the compiler. Runs and sweeps that one build
//! started are not continued by another.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folders of crates beside this one with sources that determine results.
const CRATES: [&str; 9] = [
    "kernel", "scenario", "map", "import", "collectives", "statistics", "error-models", "rods", "arms",
];
/// The sources of this crate that determine results.
const OWN: &str = "src/experiment/sweep";

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

/// Returns the files that results follow from.
fn sources(here: &Path, crates: &Path) -> io::Result<Vec<PathBuf>> {
    let mut roots: Vec<PathBuf> = CRATES.iter().map(|name| crates.join(name)).collect();
    let worlds = crates.join("worlds");
    println!("cargo::rerun-if-changed={}", worlds.display());
    for entry in fs::read_dir(&worlds)? {
        roots.push(entry?.path());
    }
    let mut files = vec![here.join("Cargo.toml")];
    let mut folders = vec![here.join(OWN)];
    for root in roots {
        files.push(root.join("Cargo.toml"));
        folders.push(root.join("src"));
    }
    for folder in folders {
        println!("cargo::rerun-if-changed={}", folder.display());
        find_sources(&folder, &mut files)?;
    }
    Ok(files)
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
