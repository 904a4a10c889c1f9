//! Gives the build an identity beside its version: a digest over the sources that results follow
//! from. Runs and sweeps that one build started are not continued by another.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Folders of crates beside this one with sources that determine results.
const CRATES: [&str; 6] = ["kernel", "scenario", "map", "import", "collectives", "statistics"];
/// The sources of this crate that determine results.
const OWN: &str = "src/experiment/sweep";

fn main() {
    let here = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("cargo says where"));
    let version = std::env::var("CARGO_PKG_VERSION").expect("cargo says which");
    println!("cargo::rerun-if-changed=build.rs");
    // A package outside of the repository, with nothing beside it, has only its version.
    let build = match digest(&here) {
        Ok(digest) => format!("{version}+{digest}"),
        Err(_) => version,
    };
    println!("cargo::rustc-env=SIDESTEP_BUILD={build}");
}

/// Returns twelve hexadecimal digits over the names and the text of all sources.
fn digest(here: &Path) -> io::Result<String> {
    let crates = here.parent().ok_or(io::ErrorKind::NotFound)?;
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
    let mut sources = Vec::new();
    for file in files {
        let name = file.strip_prefix(crates).map_err(io::Error::other)?;
        let parts: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
        sources.push((parts.join("/"), fs::read_to_string(&file)?.replace("\r\n", "\n")));
    }
    sources.sort();
    let mut hasher = blake3::Hasher::new();
    for (name, text) in &sources {
        for part in [name, text] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
    }
    Ok(hasher.finalize().to_hex()[..12].to_string())
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
