//! The packages of a workspace, as `cargo metadata` describes them.

use crate::source::{self, Source};
use serde_json::Value;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A package of the workspace, with its description by cargo.
pub(crate) struct Package {
    /// Root of the workspace, from which paths of sources are counted.
    root: PathBuf,
    metadata: Value,
}

/// Returns the packages of the workspace at `root`.
pub(crate) fn read(root: &Path) -> Result<Vec<Package>, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(root)
        .output()
        .map_err(|error| format!("cargo metadata in {}: {error}", root.display()))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let workspace: Value = serde_json::from_slice(&output.stdout)
        .map_err(|error| format!("cargo metadata: {error}"))?;
    let root = PathBuf::from(string(&workspace["workspace_root"]));
    let packages = array(&workspace["packages"]);
    Ok(packages.map(|value| Package { root: root.clone(), metadata: value.clone() }).collect())
}

impl Package {
    pub(crate) fn name(&self) -> &str {
        string(&self.metadata["name"])
    }

    /// Returns whether it depends on a package directly, its tests aside.
    #[cfg(test)]
    pub(crate) fn depends_on(&self, name: &str) -> bool {
        let mut dependencies = array(&self.metadata["dependencies"]);
        dependencies.any(|dependency| dependency["name"] == name && dependency["kind"] != "dev")
    }

    /// Returns whether it lies below a folder of the workspace.
    #[cfg(test)]
    pub(crate) fn is_in(&self, folder: &str) -> bool {
        Path::new(string(&self.metadata["manifest_path"])).starts_with(self.root.join(folder))
    }

    pub(crate) fn sources(&self) -> Result<Vec<Source>, String> {
        let mut targets: Vec<&Value> = array(&self.metadata["targets"]).collect();
        // A file that code and tests share is read once, as code.
        targets.sort_by_key(|target| is_test(target));
        let mut sources = Vec::new();
        let mut known = HashSet::new();
        for target in targets {
            let path = Path::new(string(&target["src_path"]));
            sources.extend(source::read_target(&self.root, path, is_test(target), &mut known)?);
        }
        Ok(sources)
    }
}

/// Returns whether a target is no part of what users get.
fn is_test(target: &Value) -> bool {
    array(&target["kind"]).any(|kind| matches!(string(kind), "test" | "bench" | "example"))
}

fn array(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn string(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}
