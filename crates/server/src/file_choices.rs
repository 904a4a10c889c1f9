//! Files to which a scenario can refer, for lists to choose from.

use crate::files::AllowedFiles;
use sidestep_scenario::Source;
use std::collections::{BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

/// Maximum number of files listed: a longer list is no help to choose from.
const MAX_FILES: usize = 300;
/// Maximum number of files and folders examined: a scenario may lie in a home folder with millions of files.
const MAX_ENTRIES: usize = 3000;
/// Maximum depth of folders in folders that is examined; maps and profiles lie near their scenario.
const MAX_DEPTH: usize = 3;

impl AllowedFiles {
    /// Returns the files below a scenario's folder, and those elsewhere among some names, in the scenario's own
    /// notation; only those that may be read.
    pub(crate) fn file_choices(&self, source: &Source, names: &[String]) -> Vec<String> {
        let folder =
            if source.folder.as_os_str().is_empty() { Path::new(".") } else { &source.folder };
        let mut found: BTreeSet<String> = BTreeSet::new();
        if folder.canonicalize().is_ok_and(|real| self.contains(&real)) {
            found.extend(self.files_below(folder).iter().filter_map(|path| slash_path(path)));
        }
        let readable =
            names.iter().filter(|name| self.is_readable_file(&source.path(Path::new(name))));
        found.extend(readable.take(MAX_FILES).cloned());
        found.into_iter().collect()
    }

    fn is_readable_file(&self, path: &Path) -> bool {
        path.canonicalize().is_ok_and(|real| self.contains(&real) && real.is_file())
    }

    /// Returns the paths of files below a folder, relative to it, breadth first: the nearest are the likeliest.
    fn files_below(&self, folder: &Path) -> Vec<PathBuf> {
        let mut queue = VecDeque::from([(PathBuf::new(), 0)]);
        let mut found = Vec::new();
        let mut examined = 0;
        while let Some((below, depth)) = queue.pop_front() {
            for name in folder_entries(&folder.join(&below), MAX_ENTRIES - examined) {
                examined += 1;
                let path = below.join(&name);
                let whole = folder.join(&path);
                // A link could lead back up, and around forever.
                let is_link = whole.is_symlink();
                if whole.is_dir() && !is_link && depth < MAX_DEPTH {
                    queue.push_back((path, depth + 1));
                } else if found.len() < MAX_FILES && self.is_readable_file(&whole) {
                    found.push(path);
                }
            }
        }
        found
    }
}

/// Returns the names in a folder that are not hidden, sorted, so that the limit cuts off the same ones on every
/// system.
fn folder_entries(folder: &Path, limit: usize) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let names =
        entries.take(limit).filter_map(|entry| Some(PathBuf::from(entry.ok()?.file_name())));
    let mut names: Vec<PathBuf> =
        names.filter(|name| !name.as_os_str().as_encoded_bytes().starts_with(b".")).collect();
    names.sort();
    names
}

/// Returns a path with slashes, as in scenarios on every system.
fn slash_path(path: &Path) -> Option<String> {
    let mut parts = Vec::new();
    for part in path.components() {
        parts.push(part.as_os_str().to_str()?);
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scenario_can_name_what_is_below_its_folder_and_what_it_names_elsewhere() {
        let place = tempfile::tempdir().expect("a folder");
        for name in [
            "in/s.toml",
            "in/maps/a.png",
            "in/.git/x",
            "in/b/c/d/e/far.txt",
            "in.txt",
            "out/m.yaml",
        ] {
            let path = place.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, "").expect("written");
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(place.path().join("in.txt"), place.path().join("in/link"))
            .expect("linked");
        let beside = |root: &str, names: &[&str]| {
            let files = AllowedFiles::from_roots(&[place.path().join(root)]).expect("a folder");
            let source = Source::new("s.toml", "", place.path().join("in"));
            let names: Vec<String> = names.iter().map(ToString::to_string).collect();
            files.file_choices(&source, &names)
        };
        let own = ["maps/a.png", "s.toml"];
        assert_eq!(beside("in", &["../out/m.yaml", "no such", "/etc/passwd"]), own);
        assert_eq!(beside("", &["../out/m.yaml"])[..2], ["../out/m.yaml", "link"]);
        assert_eq!(beside("out", &["maps/a.png"]), [""; 0], "its own folder may not be read");
    }
}
