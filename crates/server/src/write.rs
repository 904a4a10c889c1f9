//! Files that a page may write: scenarios below the folders that were given at start, each completely or not at all.

use crate::files::AllowedFiles;
use crate::protocol::Problem;
use serde_json::Value;
use sidestep_scenario::Source;
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Maximum size of a file that is replaced: that of the longest scenario that can be read.
const MAX_FILE_BYTES: u64 = 16 << 20;
const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];
const BYTE_ORDER_MARK: &str = "\u{feff}";

/// A file that a page may write.
#[derive(Debug)]
pub(crate) struct WriteTarget {
    /// Its path as given.
    pub(crate) path: PathBuf,
    /// Its path without links.
    pub(crate) real: PathBuf,
}

/// A file that is replaced.
struct OldContent {
    text: String,
    has_byte_order_mark: bool,
    permissions: Permissions,
}

impl AllowedFiles {
    /// Returns the file that a page may write at a path.
    ///
    /// # Errors
    /// When it is elsewhere, hidden, or no plain file.
    pub(crate) fn write_target(&self, path: &str) -> Result<WriteTarget, Problem> {
        let given = PathBuf::from(path);
        // A missing folder and a forbidden one are reported alike.
        let real = real_path(&given).unwrap_or_default();
        let Some(below) = self.relative_to_root(&real) else {
            return Err(not_writable(path, "is in no folder below those that were given at start"));
        };
        if below.iter().any(|part| part.as_encoded_bytes().starts_with(b".")) {
            return Err(not_writable(path, "is hidden"));
        }
        match fs::symlink_metadata(&real) {
            Ok(found) if !found.is_file() => Err(not_writable(path, "is no plain file")),
            Ok(_) => Ok(WriteTarget { path: given, real }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                Ok(WriteTarget { path: given, real })
            }
            Err(_) => Err(not_writable(path, "cannot be read")),
        }
    }
}

fn not_writable(path: &str, cause: &str) -> Problem {
    Problem::new(path, cause, "give a .toml file below the folders that were given at start")
}

/// Returns the path without links of a file that exists, or that can be created.
fn real_path(path: &Path) -> Option<PathBuf> {
    // Links are followed even where they lead nowhere: the target could be created later, anywhere.
    if path.is_symlink() || path.exists() {
        return path.canonicalize().ok();
    }
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
    Some(folder.join(path.file_name()?))
}

/// Replaces a file by a text, or makes it, if its content may be replaced. Otherwise returns its content.
///
/// # Errors
/// When it cannot be written, or is a foreign file and no scenario; then it stays as it was.
pub(crate) fn replace_file(
    target: &WriteTarget,
    text: &str,
    is_own: bool,
    may_replace: impl Fn(Option<&str>) -> bool,
) -> Result<Option<String>, Problem> {
    if is_in_recording(&target.real) {
        return Err(in_recording(target.path.display().to_string()));
    }
    let old = read_old_content(target)?;
    if let Some(old) = &old {
        check_replaceable(target, old, is_own)?;
    }
    let found = old.as_ref().map(|old| old.text.as_str());
    if !may_replace(found) {
        return Ok(old.map(|old| old.text));
    }
    let partial = PartialFile::new(target)
        .and_then(|partial| partial.write_text(text, old.as_ref()))
        .map_err(|error| write_error(target, &error))?;
    // Writing takes some time, in which another program may have changed the file.
    if let Some(present) = read_old_content(target)?
        && Some(present.text.as_str()) != found
        && !may_replace(Some(&present.text))
    {
        return Ok(Some(present.text));
    }
    partial.finish(target).map_err(|error| write_error(target, &error))?;
    Ok(None)
}

fn read_old_content(target: &WriteTarget) -> Result<Option<OldContent>, Problem> {
    let place = target.path.display().to_string();
    let other_name = "save it under another name";
    let (bytes, permissions) = match read_with_permissions(&target.real) {
        Ok(content) => content,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => {
            return Err(Problem::new(place, format!("cannot be read: {error}"), other_name));
        }
    };
    if bytes.starts_with(GZIP_MAGIC) {
        let remedy = format!("unpack it, or {other_name}");
        return Err(Problem::new(place, "is packed with gzip", remedy));
    }
    if bytes.len() as u64 > MAX_FILE_BYTES {
        let cause = format!("has more than {MAX_FILE_BYTES} bytes");
        return Err(Problem::new(place, cause, other_name));
    }
    let Ok(text) = String::from_utf8(bytes) else {
        return Err(Problem::new(place, "is no text (UTF-8)", other_name));
    };
    // Kept aside, so that texts are compared without it, and it is written again.
    let unmarked = text.strip_prefix(BYTE_ORDER_MARK).map(String::from);
    let has_byte_order_mark = unmarked.is_some();
    let text = unmarked.unwrap_or(text);
    Ok(Some(OldContent { text, has_byte_order_mark, permissions }))
}

fn read_with_permissions(path: &Path) -> io::Result<(Vec<u8>, Permissions)> {
    let file = File::open(path)?;
    let permissions = file.metadata()?.permissions();
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    Ok((bytes, permissions))
}

/// Refuses files that are not replaced even where a page insists.
fn check_replaceable(target: &WriteTarget, old: &OldContent, is_own: bool) -> Result<(), Problem> {
    let place = target.path.display().to_string();
    if old.permissions.readonly() {
        let remedy = "allow to write it, or save it under another name";
        return Err(Problem::new(place, "may only be read", remedy));
    }
    // A recording keeps the scenario that was run.
    if ["run.json", "sweep.json"].iter().any(|name| target.real.with_file_name(name).is_file()) {
        return Err(in_recording(place));
    }
    let values = Source::new(place.as_str(), old.text.as_str(), "").parse::<Value>();
    let is_scenario = values.is_ok_and(|values| values["world"].is_string());
    if !is_own && !is_scenario && !old.text.trim().is_empty() {
        let cause = "holds something else than a scenario";
        return Err(Problem::new(place, cause, "save it under another name"));
    }
    Ok(())
}

fn in_recording(place: String) -> Problem {
    let remedy = "save it outside of the recording's folder";
    Problem::new(place, "belongs to a recording", remedy)
}

/// Returns whether a file lies where a recording keeps the files of the scenario that was run, or a sweep those that it planned.
fn is_in_recording(path: &Path) -> bool {
    let kept = [("inputs", "run.json"), ("variants", "sweep.json")];
    path.ancestors().skip(1).any(|folder| {
        let has = |(name, manifest): (&str, &str)| {
            folder.ends_with(name) && folder.with_file_name(manifest).is_file()
        };
        kept.into_iter().any(has)
    })
}

fn write_error(target: &WriteTarget, error: &io::Error) -> Problem {
    let remedy = match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "make room, and save again",
        _ => "check that its folder may be written, or save it elsewhere",
    };
    let cause = format!("cannot be written: {error}; it is as it was");
    Problem::new(target.path.display().to_string(), cause, remedy)
}

/// A file that is written beside the one that it will replace, because renaming is atomic only within a folder. It is
/// removed if it does not replace the other.
struct PartialFile {
    path: PathBuf,
    file: File,
    is_done: bool,
}

impl PartialFile {
    fn new(target: &WriteTarget) -> io::Result<Self> {
        let name = format!(".sidestep-{:016x}.part", getrandom::u64().map_err(io::Error::other)?);
        let path = target.real.with_file_name(name);
        let file = OpenOptions::new().write(true).create_new(true).open(&path)?;
        Ok(Self { path, file, is_done: false })
    }

    fn write_text(mut self, text: &str, old: Option<&OldContent>) -> io::Result<Self> {
        if let Some(old) = old {
            self.file.set_permissions(old.permissions.clone())?;
        }
        if old.is_some_and(|old| old.has_byte_order_mark) {
            self.file.write_all(BYTE_ORDER_MARK.as_bytes())?;
        }
        self.file.write_all(text.as_bytes())?;
        self.file.sync_all()?;
        Ok(self)
    }

    fn finish(mut self, target: &WriteTarget) -> io::Result<()> {
        fs::rename(&self.path, &target.real)?;
        self.is_done = true;
        // An error changes nothing: the file is replaced, and after a crash one of the two texts is there, whole. Not all
        // file systems can sync folders.
        let _ = sync_folder(&target.real);
        Ok(())
    }
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        if !self.is_done {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Makes the new name durable, where the system can.
#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    match path.parent() {
        Some(folder) => File::open(folder)?.sync_all(),
        None => Ok(()),
    }
}

/// Does nothing: other systems do not open folders.
#[cfg(not(unix))]
fn sync_folder(_path: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests;
