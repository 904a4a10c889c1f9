//! What a file is that a person names, drops or looks for.

use crate::encode::problem;
use crate::files::{AllowedFiles, FileMatches, file_entry, folder_paths, kind_of_folder};
use crate::protocol::{FileEntry, FileKind, Problem};
use sidestep_scenario::{ImportOptions, Source, Worlds};
use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};

/// Maximum number of entries that are listed: nobody reads a longer list.
const MAX_FOUND: usize = 500;
/// Maximum number of files and folders that are looked at: a folder may be a home with millions of files.
const MAX_EXAMINED: usize = 5000;
/// Maximum depth of folders in folders that are looked into.
const MAX_DEPTH: usize = 6;

/// A file or a folder on the way through the folders given at start.
struct WalkedPath {
    path: PathBuf,
    /// Its path below the folder given at start.
    below: PathBuf,
}

impl AllowedFiles {
    /// Returns everything below the folders given at start that can be opened or named, and whose path or description
    /// contains a text.
    pub(crate) fn find(&self, text: &str, worlds: &Worlds) -> FileMatches {
        let wanted = text.trim().to_lowercase();
        let (walked, mut left_out) = self.walk();
        let mut foreign = 0;
        let mut entries = Vec::new();
        for WalkedPath { path, below } in &walked {
            let Some(entry) = file_entry(path, worlds, &mut foreign) else { continue };
            let name = below.to_string_lossy().replace('\\', "/");
            let is_wanted = name.to_lowercase().contains(&wanted)
                || entry.about.to_lowercase().contains(&wanted);
            if entry.kind == FileKind::Folder || !is_wanted {
                continue;
            }
            if entries.len() == MAX_FOUND {
                left_out += 1;
                continue;
            }
            entries.push(FileEntry { name, ..entry });
        }
        entries.sort_by(|a, b| a.path.cmp(&b.path));
        FileMatches { entries, left_out }
    }

    /// Returns the files and folders below those given at start, breadth first, and the number of those that are not
    /// looked at. Folders of runs and sweeps count as one.
    fn walk(&self) -> (Vec<WalkedPath>, u64) {
        let roots = self.root_paths();
        let mut queue: VecDeque<(WalkedPath, usize)> =
            roots.map(|path| (WalkedPath { path, below: PathBuf::new() }, 0)).collect();
        let mut walked = Vec::new();
        let mut left_out = 0;
        while let Some((folder, depth)) = queue.pop_front() {
            for path in folder_paths(&folder.path).unwrap_or_default() {
                // A link may lead elsewhere, or around forever.
                let is_readable = !path.is_symlink() && self.resolve_path(&path).is_some();
                let Some(name) = path.file_name().filter(|_| is_readable) else { continue };
                if name.as_encoded_bytes().starts_with(b".") {
                    continue;
                }
                if walked.len() == MAX_EXAMINED {
                    left_out += 1;
                    continue;
                }
                let below = folder.below.join(name);
                let is_open = path.is_dir() && kind_of_folder(&path) == FileKind::Folder;
                if is_open && depth < MAX_DEPTH {
                    let path = path.clone();
                    queue.push_back((WalkedPath { path, below: below.clone() }, depth + 1));
                } else if is_open {
                    left_out += 1;
                }
                walked.push(WalkedPath { path, below });
            }
        }
        (walked, left_out)
    }

    /// Returns what a file or a folder is that a person wants to open. A copy of one that is below the folders given at
    /// start stands for that one, which can be saved and has its neighbors.
    ///
    /// # Errors
    /// When it is nothing that can be opened or named; with what would be right.
    pub(crate) fn identify(&self, path: &str, worlds: &Worlds) -> Result<FileEntry, Problem> {
        let given = self.resolve(path)?;
        let own = self.original_of(&given).unwrap_or(given);
        match file_entry(&own, worlds, &mut 0) {
            Some(entry) if entry.kind != FileKind::Folder => Ok(entry),
            _ => Err(wrong_file(&own, worlds)),
        }
    }

    /// Returns the file or folder below those given at start of which another one is a copy, if there is one.
    fn original_of(&self, copy: &Path) -> Option<PathBuf> {
        if !self.is_dropped(copy) {
            return None;
        }
        let name = copy.file_name()?;
        let (walked, _) = self.walk();
        let mut same = walked.into_iter().filter(|other| other.path.file_name() == Some(name));
        same.find(|other| is_copy(copy, &other.path)).map(|other| other.path)
    }
}

/// Returns whether a file has the content of another one; of folders their descriptions are compared.
fn is_copy(copy: &Path, other: &Path) -> bool {
    if copy.is_dir() {
        let described = ["run.json", "sweep.json"].map(|name| (copy.join(name), other.join(name)));
        return described.iter().any(|(a, b)| a.is_file() && is_copy(a, b));
    }
    let has_length = |path: &Path| fs::metadata(path).ok().filter(fs::Metadata::is_file);
    let lengths = (has_length(copy), has_length(other));
    let (Some(a), Some(b)) = lengths else { return false };
    a.len() == b.len() && fs::read(copy).ok() == fs::read(other).ok()
}

/// Returns the problem of a file that cannot be opened, with what would be right.
fn wrong_file(path: &Path, worlds: &Worlds) -> Problem {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let told = |cause: &str, remedy: &str| Problem::new(name.as_str(), cause, remedy);
    if path.is_dir() {
        let remedy = "choose the folder of a run (with run.json) or of a sweep (with sweep.json)";
        return told("is a folder, and neither a run nor a sweep", remedy);
    }
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match ending.as_str() {
        "toml" => match Source::read(path, &[]).and_then(|s| s.parse::<serde_json::Value>()) {
            Err(error) => Problem { place: name.as_str().into(), ..problem(&error) },
            Ok(_) => {
                let names = worlds.names().join(", ");
                let remedy = format!("begin a scenario with world = \"...\", one of {names}");
                told("is no scenario: it has neither `world` nor `scenario` nor `profile`", &remedy)
            }
        },
        "json" | "parquet" => told(
            "is a part of a run or a sweep",
            "choose the whole folder in which it lies: it has run.json or sweep.json",
        ),
        "html" => told("is a page: a report, or a replay", "open it in the browser, by itself"),
        "db3" | "bag" => told(
            "is a bag of a robot's messages, and no recording of Sidestep",
            "learn errors from it by the command: `sidestep learn --help`",
        ),
        _ => match worlds.import_scenario(path, &ImportOptions::default()) {
            Err(error) => Problem { place: name.as_str().into(), ..problem(&error) },
            Ok(Some(imported)) => match imported.scenario {
                Err(error) => Problem { place: name.as_str().into(), ..problem(&error) },
                Ok(_) => told("is too large to be opened here", "run it by the command"),
            },
            Ok(None) => told(
                "is nothing that the studio opens",
                "choose a scenario (.toml), a map (.map, .yaml or an image), traffic (.scn, .csv), the folder of a run \
                 or a sweep, or an MCAP file of a run",
            ),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::WORLDS;

    /// A folder `in` that may be read, with files in folders.
    fn places() -> (tempfile::TempDir, AllowedFiles) {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in [
            ("in/a.toml", "format = 1\nworld = \"robots\"\nname = \"crowd\"\n"),
            ("in/deep/er/b.toml", "format = 1\nworld = \"chain\"\nname = \"Long snake\"\n"),
            ("in/deep/plan.sweep.toml", "scenario = \"b.toml\"\nname = \"Lag\"\n"),
            ("in/deep/run/run.json", "{}"),
            ("in/deep/run/scenario.toml", "format = 1\nworld = \"robots\"\n"),
            ("in/arm.urdf", "<robot/>"),
            ("in/.git/c.toml", "format = 1\nworld = \"robots\"\n"),
            ("in/words.txt", "words"),
        ] {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, text).expect("written");
        }
        let files = AllowedFiles::from_roots(&[folder.path().join("in")]).expect("a folder");
        (folder, files)
    }

    #[test]
    fn what_lies_in_folders_of_folders_is_found_by_path_and_by_words() {
        let (_folder, files) = places();
        let names = |text: &str| -> Vec<(String, FileKind)> {
            let found = files.find(text, &WORLDS);
            assert_eq!(found.left_out, 0);
            found.entries.into_iter().map(|entry| (entry.name, entry.kind)).collect()
        };
        let all = [
            ("a.toml", FileKind::Scenario),
            ("arm.urdf", FileKind::Model),
            ("deep/er/b.toml", FileKind::Scenario),
            ("deep/plan.sweep.toml", FileKind::Sweep),
            ("deep/run", FileKind::Run),
        ];
        let all = all.map(|(name, kind)| (name.to_string(), kind));
        assert_eq!(names(""), all);
        assert_eq!(names("SNAKE"), [all[2].clone()]);
        assert_eq!(names("lag"), [all[3].clone()], "by the name of a sweep");
        assert_eq!(names("deep/"), all[2..]);
        assert_eq!(names("words"), []);
    }

    #[test]
    fn what_is_beyond_the_bound_is_counted() {
        let folder = tempfile::tempdir().expect("a folder");
        for number in 0..MAX_FOUND + 7 {
            let path = folder.path().join(format!("{number}.mcap"));
            fs::write(path, "").expect("written");
        }
        let files = AllowedFiles::from_roots(&[folder.path().to_path_buf()]).expect("a folder");
        let found = files.find("", &WORLDS);
        assert_eq!((found.entries.len(), found.left_out), (MAX_FOUND, 7));
    }

    #[test]
    fn a_dropped_copy_stands_for_the_file_that_the_studio_knows() {
        let (folder, files) = places();
        let own = fs::read(folder.path().join("in/deep/er/b.toml")).expect("there");
        let dropped = |name: &str, content: &[u8]| {
            let path = files.drops().store(name, content).expect("kept");
            files.identify(path.to_str().expect("text"), &WORLDS).expect("known")
        };
        let path = folder.path().join("in/deep/er/b.toml").display().to_string();
        assert_eq!(dropped("1/b.toml", &own).path, path);
        let other = dropped("2/b.toml", b"format = 1\nworld = \"robots\"\n");
        assert!(other.path.ends_with("2/b.toml") && other.kind == FileKind::Scenario);
        files.drops().store("3/run/run.json", b"{}").expect("kept");
        let run = files.drops().store("3/run/x.parquet", b"1").expect("kept");
        let run = run.parent().expect("a folder").to_str().expect("text").to_string();
        let entry = files.identify(&run, &WORLDS).expect("known");
        assert_eq!((entry.kind, entry.name.as_str()), (FileKind::Run, "run"));
        assert!(entry.path.ends_with("in/deep/run"));
    }

    #[test]
    fn a_wrong_file_is_told_what_would_be_right() {
        let (_folder, files) = places();
        let problem = |name: &str, content: &[u8]| {
            let path = files.drops().store(name, content).expect("kept");
            files.identify(path.to_str().expect("text"), &WORLDS).expect_err(name)
        };
        for (name, content, cause, remedy) in [
            ("1/x.toml", &b"a = 1\n"[..], "neither `world`", "world = \"...\", one of robots"),
            ("2/x.toml", b"a = = 1\n", "", ""),
            ("3/run.json", b"{}", "part of a run", "whole folder"),
            ("4/x.txt", b"words", "nothing that the studio opens", "scenario (.toml), a map"),
            ("5/page.html", b"<html>", "is a page", "browser"),
            ("6/x.scn", b"nonsense", "", ""),
        ] {
            let told = problem(name, content);
            assert_eq!(name.split('/').next_back(), Some(&*told.place));
            assert!(told.cause.contains(cause) && told.remedy.contains(remedy), "{told:?}");
        }
        files.drops().store("7/folder/a.txt", b"").expect("kept");
        let folder = files.drops().store("7/folder/b.txt", b"").expect("kept");
        let folder = folder.parent().expect("a folder").to_str().expect("text").to_string();
        let told = files.identify(&folder, &WORLDS).expect_err("no run");
        assert!(told.remedy.contains("run.json"), "{told:?}");
    }
}
