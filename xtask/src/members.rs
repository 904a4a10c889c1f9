//! The crates of a workspace: its members by the root's `Cargo.toml`, each with its sources.

use std::fs;
use std::path::{Path, PathBuf};

use toml::Table;

use crate::modules;
use crate::source::{self, Source};

/// Package that is not counted: the tools of the house are not the house.
const TOOLS: &str = "xtask";

/// One crate of the workspace.
pub(crate) struct Member {
    pub(crate) name: String,
    /// Folder, relative to the root of the workspace.
    pub(crate) folder: PathBuf,
    /// Parsed `Cargo.toml`.
    #[cfg_attr(not(test), expect(dead_code, reason = "read by the tests of the house rules"))]
    pub(crate) manifest: Table,
    pub(crate) sources: Vec<Source>,
}

/// Reads all members of the workspace at `root` but xtask, sorted by folder.
pub(crate) fn read(root: &Path) -> Result<Vec<Member>, String> {
    let mut members = Vec::new();
    for folder in folders(root)? {
        let manifest = manifest(&root.join(&folder))?;
        let name = manifest.get("package").and_then(|p| p.get("name")).and_then(|n| n.as_str());
        let Some(name) = name.filter(|name| *name != TOOLS) else { continue };
        let mut sources = source::read_all(root, &folder)?;
        modules::place(&root.join(&folder), &manifest, &mut sources);
        members.push(Member { name: name.to_string(), folder, manifest, sources });
    }
    Ok(members)
}

fn manifest(folder: &Path) -> Result<Table, String> {
    let path = folder.join("Cargo.toml");
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    text.parse().map_err(|e| format!("{}: {e}", path.display()))
}

/// Returns the folders of all members, relative to the root; the root itself where it is a package.
fn folders(root: &Path) -> Result<Vec<PathBuf>, String> {
    let manifest = manifest(root)?;
    let workspace = manifest.get("workspace");
    let patterns = |key: &str| -> Vec<String> {
        let list = workspace.and_then(|w| w.get(key)).and_then(|list| list.as_array());
        list.into_iter().flatten().filter_map(|v| v.as_str()).map(String::from).collect()
    };
    let mut folders = Vec::new();
    for pattern in patterns("members") {
        folders.extend(matching(root, &pattern));
    }
    for pattern in patterns("exclude") {
        let excluded = matching(root, &pattern);
        folders.retain(|folder| !excluded.contains(folder));
    }
    if manifest.contains_key("package") {
        folders.push(PathBuf::new());
    }
    folders.sort();
    folders.dedup();
    Ok(folders)
}

/// Returns the folders with a `Cargo.toml` that a pattern such as `crates/*` names.
fn matching(root: &Path, pattern: &str) -> Vec<PathBuf> {
    let mut found = vec![PathBuf::new()];
    for part in pattern.split('/').filter(|part| !part.is_empty() && *part != ".") {
        found = found.iter().flat_map(|folder| step(root, folder, part)).collect();
    }
    found.retain(|folder| root.join(folder).join("Cargo.toml").is_file());
    found
}

/// Returns the entries of `folder` that one part of a pattern names.
fn step(root: &Path, folder: &Path, part: &str) -> Vec<PathBuf> {
    if !part.contains('*') {
        return vec![folder.join(part)];
    }
    let Ok(entries) = fs::read_dir(root.join(folder)) else { return Vec::new() };
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| fits(part, name)).map(|name| folder.join(name)).collect()
}

/// Returns whether a name fits a pattern in which `*` stands for any letters.
fn fits(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, rest)) => name.strip_prefix(head).is_some_and(|tail| {
            tail.char_indices().any(|(at, _)| fits(rest, &tail[at..])) || fits(rest, "")
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_letters() {
        assert!(fits("*", "kernel"));
        assert!(fits("ke*el", "kernel"));
        assert!(fits("kernel*", "kernel"));
        assert!(!fits("ke*l", "kernels"));
        assert!(!fits("draw", "drawn"));
    }

    #[test]
    fn members_are_found_by_globs_and_xtask_is_left_out() {
        let root = tempfile::tempdir().unwrap();
        let write = |path: &str, text: &str| {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        write("Cargo.toml", "[workspace]\nmembers = ['crates/*', 'xtask']\nexclude = ['crates/c']");
        for name in ["a", "b", "c"] {
            write(&format!("crates/{name}/Cargo.toml"), &format!("[package]\nname = '{name}'"));
            write(&format!("crates/{name}/src/lib.rs"), "pub fn f() {}");
        }
        write("crates/notes/README.md", "no crate");
        write("xtask/Cargo.toml", "[package]\nname = 'xtask'");
        let members = read(root.path()).unwrap();
        let names: Vec<&str> = members.iter().map(|member| member.name.as_str()).collect();
        assert_eq!(names, ["a", "b"]);
        assert_eq!(members[0].folder, Path::new("crates/a"));
        assert!(members[0].sources[0].module.as_ref().is_some_and(|place| place.in_library));
    }
}
