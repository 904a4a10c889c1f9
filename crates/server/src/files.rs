//! Files that a page may read: those below the folders given at start, after links are resolved.

use crate::drop_folder::DropFolder;
use crate::encode::problem;
use crate::protocol::{FileEntry, FileKind, Problem};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use sidestep_kernel::InputError;
use sidestep_scenario::editing::{FileUse, UsedFile};
use sidestep_scenario::{ImportOptions, Source, Worlds};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

/// Maximum number of entries of a folder that are listed, so that one listing stays quick.
const MAX_ENTRIES: usize = 1000;
/// Maximum size of a file that is read when its folder is listed: a list must not take seconds.
const MAX_FILE_BYTES: u64 = 1 << 20;
/// Maximum number of files of unknown kind in a folder that are read to see whether they are scenarios of other programs.
const MAX_FOREIGN_FILES: usize = 50;

/// The folders and files that may be read.
#[derive(Debug, Clone)]
pub(crate) struct AllowedFiles {
    roots: Arc<Vec<AllowedRoot>>,
    /// Files elsewhere to which the scenarios given at start refer, links resolved.
    granted: Arc<BTreeSet<PathBuf>>,
    /// Copies of files that people dropped on the page.
    drops: Arc<DropFolder>,
}

/// A folder or a file given at start.
#[derive(Debug)]
struct AllowedRoot {
    /// The path as it was given, which listings show.
    path: PathBuf,
    /// The path with links resolved.
    real: PathBuf,
}

/// The keys of a TOML file by which its kind is known.
#[derive(Deserialize)]
struct TomlHeader {
    world: Option<String>,
    name: Option<String>,
    scenario: Option<IgnoredAny>,
    profile: Option<String>,
}

/// Entries, and the number of those that are not among them.
#[derive(Debug, PartialEq)]
pub(crate) struct FileMatches {
    pub(crate) entries: Vec<FileEntry>,
    pub(crate) left_out: u64,
}

impl AllowedFiles {
    /// Returns the files that may be read: everything below these folders, and these files.
    ///
    /// # Errors
    /// When one of them does not exist.
    pub(crate) fn from_roots(paths: &[PathBuf]) -> Result<Self, Problem> {
        let mut roots = Vec::with_capacity(paths.len());
        for path in paths {
            let real = path.canonicalize().map_err(|e| {
                let remedy = "give a scenario, a recording or a folder that is there";
                Problem::new(path.display().to_string(), e.to_string(), remedy)
            })?;
            roots.push(AllowedRoot { path: path.clone(), real });
        }
        Ok(Self { roots: Arc::new(roots), granted: Arc::default(), drops: Arc::default() })
    }

    /// Also allows the files to which these scenarios refer, because a user who starts the studio with a scenario wants it
    /// to run. Texts that pages write later can refer to no further files elsewhere.
    pub(crate) fn with_files_referenced_by<'p>(
        self,
        scenarios: impl Iterator<Item = &'p Path>,
    ) -> Self {
        let mut granted = BTreeSet::new();
        for source in scenarios.filter_map(|path| Source::read(path, &[]).ok()) {
            for name in strings_in(&source).unwrap_or_default() {
                let real = source.path(Path::new(&name)).canonicalize();
                granted.extend(real.ok().filter(|real| !self.contains(real)));
            }
        }
        Self { granted: Arc::new(granted), ..self }
    }

    /// Returns the first folder given at start, from which paths in a new scenario start.
    pub(crate) fn first_root_folder(&self) -> PathBuf {
        let folder = self.roots.iter().find(|root| root.real.is_dir());
        folder.map_or_else(PathBuf::new, |root| root.path.clone())
    }

    /// Returns a path that a page may read.
    ///
    /// # Errors
    /// When it does not exist, or is elsewhere.
    pub(crate) fn resolve(&self, path: &str) -> Result<PathBuf, Problem> {
        let given = PathBuf::from(path);
        let is_allowed = self.resolve_path(&given).is_some();
        // A missing path and a forbidden one are reported alike: a page learns nothing about the rest of the disk.
        if is_allowed { Ok(given) } else { Err(outside_roots(path)) }
    }

    /// Returns the path without links of a file or a folder that a page may read.
    pub(crate) fn resolve_path(&self, path: &Path) -> Option<PathBuf> {
        let real = path.canonicalize().ok()?;
        // A pipe or a device might keep its reader waiting forever.
        let is_plain = real.is_file() || real.is_dir();
        (is_plain && self.contains(&real)).then_some(real)
    }

    /// Returns whether a path without links is below the folders, a scenario given at start refers to it, or it is a copy
    /// of a file that was dropped.
    pub(crate) fn contains(&self, real: &Path) -> bool {
        self.relative_to_root(real).is_some()
            || self.granted.contains(real)
            || self.drops.contains(real)
    }

    /// Returns whether a path is that of a copy of a file that was dropped.
    pub(crate) fn is_dropped(&self, path: &Path) -> bool {
        path.canonicalize().is_ok_and(|real| self.drops.contains(&real))
    }

    /// Returns the copies of files that were dropped.
    pub(crate) fn drops(&self) -> &Arc<DropFolder> {
        &self.drops
    }

    /// Returns the folders and files given at start, as they were given.
    pub(crate) fn root_paths(&self) -> impl Iterator<Item = PathBuf> {
        self.roots.iter().map(|root| root.path.clone())
    }

    /// Returns a path without links relative to the folder that it is below.
    pub(crate) fn relative_to_root<'p>(&self, real: &'p Path) -> Option<&'p Path> {
        self.roots.iter().find_map(|root| real.strip_prefix(&root.real).ok())
    }

    /// Refuses a text that refers to a file elsewhere: under any key, a value that is the path of something that exists. Which
    /// keys are paths only the worlds know.
    ///
    /// # Errors
    /// With the value.
    pub(crate) fn check_referenced_files(&self, source: &Source) -> Result<(), Problem> {
        let names = strings_in(source).map_err(|e| problem(&e))?;
        names.iter().try_for_each(|name| self.check_referenced_path(source, name))
    }

    fn check_referenced_path(&self, source: &Source, text: &str) -> Result<(), Problem> {
        // Paths start at the scenario's folder, wherever the server was started.
        let real = source.path(Path::new(text)).canonicalize();
        if real.is_ok_and(|real| !self.contains(&real)) { Err(outside_roots(text)) } else { Ok(()) }
    }

    /// Lists everything in a folder that can be opened, or everything given at start.
    ///
    /// # Errors
    /// When it is no folder that may be read.
    pub(crate) fn list_folder(
        &self,
        folder: Option<&str>,
        worlds: &Worlds,
    ) -> Result<FileMatches, Problem> {
        let Some(folder) = folder else {
            let roots = self.roots.iter();
            let entries = roots.filter_map(|root| file_entry(&root.path, worlds, &mut 0)).collect();
            return Ok(FileMatches { entries, left_out: 0 });
        };
        let path = self.resolve(folder)?;
        let mut paths = folder_paths(&path).map_err(|e| {
            Problem::new(folder, format!("cannot be listed: {e}"), "give a folder that may be read")
        })?;
        let left_out = paths.len().saturating_sub(MAX_ENTRIES) as u64;
        paths.truncate(MAX_ENTRIES);
        let mut foreign = 0;
        let mut entries: Vec<FileEntry> = Vec::new();
        for path in &paths {
            // A link may lead elsewhere.
            if path.canonicalize().is_ok_and(|real| self.contains(&real)) {
                entries.extend(file_entry(path, worlds, &mut foreign));
            }
        }
        entries.sort_by_key(|entry| (entry.kind != FileKind::Folder, entry.name.clone()));
        Ok(FileMatches { entries, left_out })
    }
}

/// Returns the paths of the entries of a folder, in their order.
pub(crate) fn folder_paths(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?;
    let paths: io::Result<Vec<PathBuf>> = entries.map(|item| Ok(item?.path())).collect();
    let mut paths = paths?;
    paths.sort();
    Ok(paths)
}

/// Returns the problem of a path that may not be read.
fn outside_roots(path: &str) -> Problem {
    let cause = "is not below the folders that were given at start";
    Problem::new(path, cause, "start the studio with its folder: `sidestep studio FOLDER`")
}

/// Returns all strings in a text, any of which may be the path of a file.
///
/// # Errors
/// When it is not TOML.
fn strings_in(source: &Source) -> Result<Vec<String>, InputError> {
    let mut open = vec![source.parse::<Value>()?];
    let mut names = Vec::new();
    while let Some(value) = open.pop() {
        match value {
            Value::Array(items) => open.extend(items),
            Value::Object(members) => open.extend(members.into_iter().map(|(_, value)| value)),
            Value::String(text) => names.push(text),
            _ => {}
        }
    }
    Ok(names)
}

/// Returns the entry of a file or folder; `None` if it cannot be opened. `foreign` counts the files of other programs
/// that were read.
pub(crate) fn file_entry(path: &Path, worlds: &Worlds, foreign: &mut usize) -> Option<FileEntry> {
    let name = path.file_name().map_or_else(|| path.to_str(), |name| name.to_str())?;
    if name.starts_with('.') && name.len() > 1 && name != ".." {
        return None;
    }
    let (kind, about) = if path.is_dir() {
        (kind_of_folder(path), String::new())
    } else {
        kind_of_file(path, worlds, foreign)?
    };
    Some(FileEntry { path: path.to_str()?.into(), name: name.into(), kind, about })
}

/// Returns whether a file may name any other file of the disk: a scenario or a sweep, unlike a profile.
pub(crate) fn names_files(path: &Path) -> bool {
    let header = || Source::read(path, &[]).ok()?.parse::<TomlHeader>().ok();
    let is_profile =
        || header().and_then(kind_of_toml).is_some_and(|(kind, _)| kind == FileKind::Profile);
    has_extension(path, "toml") && !is_profile()
}

pub(crate) fn kind_of_folder(path: &Path) -> FileKind {
    if path.join("run.json").is_file() {
        FileKind::Run
    } else if path.join("sweep.json").is_file() {
        FileKind::Sweep
    } else {
        FileKind::Folder
    }
}

fn kind_of_file(path: &Path, worlds: &Worlds, foreign: &mut usize) -> Option<(FileKind, String)> {
    let bytes = fs::metadata(path).ok().filter(fs::Metadata::is_file)?.len();
    if has_extension(path, "mcap") {
        let megabytes = bytes as f64 / 1e6;
        return Some((FileKind::Recording, format!("{megabytes:.1} MB")));
    }
    // Of a map only the name is looked at, so that it may be large.
    if let Some(about) = map_description(path, worlds) {
        return Some((FileKind::Map, about.to_owned()));
    }
    if has_extension(path, "urdf") {
        return Some((FileKind::Model, "links and joints of a robot".into()));
    }
    if bytes > MAX_FILE_BYTES {
        return None;
    }
    if has_extension(path, "toml") {
        let header: TomlHeader = Source::read(path, &[]).ok()?.parse().ok()?;
        return kind_of_toml(header);
    }
    *foreign += 1;
    if *foreign > MAX_FOREIGN_FILES {
        return None;
    }
    let imported = worlds.import_scenario(path, &ImportOptions::default()).ok()??;
    imported.scenario.is_ok().then(|| (FileKind::Foreign, String::new()))
}

/// Returns what a file is for the first world that uses it as a map.
fn map_description(path: &Path, worlds: &Worlds) -> Option<&'static str> {
    let name = path.file_name()?.to_str()?.to_lowercase();
    let mut uses = worlds.iter().flat_map(|world| world.editing().files);
    let is_used = |file: &FileUse| {
        file.kind == UsedFile::Map && file.endings.iter().any(|ending| name.ends_with(ending))
    };
    uses.find(is_used).map(|file| file.about)
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension))
}

fn kind_of_toml(header: TomlHeader) -> Option<(FileKind, String)> {
    match (header.world, header.scenario) {
        (Some(world), _) => {
            let name = header.name.filter(|name| !name.is_empty());
            let about = name.map_or(world.clone(), |name| format!("{world}: {name}"));
            Some((FileKind::Scenario, about))
        }
        (None, Some(_)) => Some((FileKind::Sweep, header.name.unwrap_or_default())),
        (None, None) => header.profile.map(|name| (FileKind::Profile, name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::WORLDS;

    /// A folder `in` that may be read, and one beside it that may not.
    fn places() -> (tempfile::TempDir, AllowedFiles) {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in [
            ("in/a.toml", "format = 1\nworld = \"robots\"\nname = \"crowd\"\n"),
            ("in/sweep.toml", "scenario = \"a.toml\"\n"),
            ("in/other.toml", "x = 1\n"),
            ("in/notes.txt", "words"),
            ("in/hall.yaml", "image: hall.png\nresolution: 0.05\n"),
            ("in/mine.toml", "format = 1\nprofile = \"mine\"\n"),
            ("in/.hidden.toml", "world = \"robots\"\n"),
            ("in/film.mcap", "..."),
            ("in/t.scn", "00:00:00.00>CRE A,B738,52,4,90,FL200,250\n"),
            ("in/run/run.json", "{}"),
            ("in/deep/b.toml", "format = 1\nworld = \"chain\"\n"),
            ("out/secret.toml", "format = 1\nworld = \"robots\"\n"),
        ] {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, text).expect("written");
        }
        let files = AllowedFiles::from_roots(&[folder.path().join("in")]).expect("a folder");
        (folder, files)
    }

    #[test]
    fn a_folder_lists_what_can_be_opened() {
        let (folder, files) = places();
        let inside = folder.path().join("in");
        let listed = files.list_folder(inside.to_str(), &WORLDS).expect("listed").entries;
        let told: Vec<_> =
            listed.iter().map(|e| (e.name.as_str(), e.kind, e.about.as_str())).collect();
        assert_eq!(
            told,
            [
                ("deep", FileKind::Folder, ""),
                ("a.toml", FileKind::Scenario, "robots: crowd"),
                ("film.mcap", FileKind::Recording, "0.0 MB"),
                ("hall.yaml", FileKind::Map, "map of ROS"),
                ("mine.toml", FileKind::Profile, "mine"),
                ("run", FileKind::Run, ""),
                ("sweep.toml", FileKind::Sweep, ""),
                ("t.scn", FileKind::Foreign, ""),
            ]
        );
        let roots = files.list_folder(None, &WORLDS).expect("listed").entries;
        assert_eq!((roots.len(), roots[0].name.as_str()), (1, "in"));
        assert!(files.resolve(&listed[1].path).is_ok());
    }

    #[test]
    fn nothing_outside_is_found_by_dots_by_links_or_by_its_whole_path() {
        let (folder, files) = places();
        let path = |name: &str| folder.path().join(name).display().to_string();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(path("out"), path("in/link")).expect("linked");
            std::os::unix::fs::symlink(path("out/secret.toml"), path("in/s.toml")).expect("linked");
        }
        let outside = [
            "in/../out/secret.toml",
            "out/secret.toml",
            "in/link/secret.toml",
            "in/s.toml",
            "in/gone.toml",
        ];
        let problems: Vec<Problem> =
            outside.iter().map(|name| files.resolve(&path(name)).expect_err(name)).collect();
        assert!(
            problems.iter().all(|p| p.cause == problems[0].cause),
            "nothing is told of what is there"
        );
        assert!(files.list_folder(Some(&path("out")), &WORLDS).is_err());
        assert!(files.list_folder(Some(&path("in/..")), &WORLDS).is_err());
        assert!(files.resolve("/etc/passwd").is_err() && files.resolve("").is_err());
        let listed = files.list_folder(Some(&path("in")), &WORLDS).expect("listed").entries;
        assert!(listed.iter().all(|e| e.name != "link" && e.name != "s.toml"), "{listed:?}");
        assert!(files.resolve(&path("in/deep/../a.toml")).is_ok());
    }

    #[test]
    fn a_text_names_files_inside_alone() {
        let (folder, files) = places();
        let check = |text: &str| {
            let source = Source::new("s.toml", text, folder.path().join("in"));
            files.check_referenced_files(&source).map_err(|problem| problem.place)
        };
        assert_eq!(check("a = \"deep/b.toml\"\nb = [{ c = \"no such file\" }]"), Ok(()));
        assert_eq!(check("a = [{ b = \"../out/secret.toml\" }]"), Err("../out/secret.toml".into()));
        assert_eq!(check("a = \"/etc/passwd\""), Err("/etc/passwd".into()));
        assert_eq!(check("a = = 1"), Err("s.toml".into()));
    }

    #[test]
    fn a_name_leads_from_the_scenarios_folder_wherever_the_server_was_started() {
        let (folder, _) = places();
        // From the working directory, `.` leads inside.
        let files = AllowedFiles::from_roots(&[".".into()]).expect("a folder");
        assert!(files.resolve(".").is_ok());
        let source = Source::new("s.toml", "a = \".\"", folder.path().join("out"));
        assert_eq!(files.check_referenced_files(&source).map_err(|p| p.place), Err(".".into()));
    }

    #[test]
    fn what_a_scenario_names_that_was_named_at_start_may_be_read_and_nothing_beside_it() {
        let (folder, files) = places();
        let path = |name: &str| folder.path().join(name).display().to_string();
        fs::write(path("out/map.txt"), "....").expect("written");
        fs::write(path("in/a.toml"), "map = { file = \"../out/map.txt\" }\n").expect("written");
        let files = files.with_files_referenced_by([Path::new(&path("in/a.toml"))].into_iter());
        let check = |text: &str| {
            files.check_referenced_files(&Source::new("s.toml", text, folder.path().join("in")))
        };
        assert_eq!(check("a = \"../out/map.txt\""), Ok(()));
        assert!(files.resolve(&path("out/map.txt")).is_ok());
        assert!(
            check("a = \"../out/secret.toml\"").is_err() && files.resolve(&path("out")).is_err()
        );
        assert!(files.write_target(&path("out/map.txt")).is_err(), "it may be read, not written");
    }
}
