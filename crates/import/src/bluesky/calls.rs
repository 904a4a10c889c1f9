//! Files that a scenario calls, which lie in its folder.

use super::MAX_SCN_BYTES;
use super::text::ScnText;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

/// The maximum length of a chain of calls.
pub(super) const MAX_CALL_DEPTH: usize = 8;

/// The maximum number of calls in a scenario.
pub(super) const MAX_CALLS: u64 = 10_000;

/// The maximum number of entries of a folder among which a name is looked for.
const MAX_FOLDER_ENTRIES: usize = 100_000;

/// The folder of a scenario, and the files of it that were read.
#[derive(Debug, Default)]
pub(super) struct CallFolder {
    folder: Option<PathBuf>,
    texts: BTreeMap<PathBuf, Rc<ScnText>>,
    bytes: u64,
}

impl CallFolder {
    /// Returns the folder of a file.
    pub(super) fn of_file(file: &Path) -> Self {
        let folder = file.parent().map(|parent| {
            if parent.as_os_str().is_empty() { PathBuf::from(".") } else { parent.to_path_buf() }
        });
        Self { folder, ..Self::default() }
    }

    /// Returns the folder of a text that is in no file.
    pub(super) fn nowhere() -> Self {
        Self::default()
    }

    /// Returns the path and the text of the file with this name.
    ///
    /// # Errors
    /// The cause and the remedy, when there is none, or it lies elsewhere.
    pub(super) fn read(
        &mut self,
        name: &str,
    ) -> Result<(PathBuf, Rc<ScnText>), (String, &'static str)> {
        let Some(folder) = &self.folder else {
            return Err((
                format!("`{name}` is not read, for this text has no folder"),
                "read it from a file",
            ));
        };
        let path = find_in_folder(folder, name)?;
        if let Some(text) = self.texts.get(&path) {
            return Ok((path, Rc::clone(text)));
        }
        let text = ScnText::read(&path, MAX_SCN_BYTES).map_err(|error| {
            (format!("`{name}` cannot be read: {}", error.cause()), "check the file")
        })?;
        self.bytes += text.text.len() as u64;
        if self.bytes > MAX_SCN_BYTES {
            let cause = format!("the files called have more than {MAX_SCN_BYTES} bytes");
            return Err((cause, "call fewer"));
        }
        let text = Rc::new(text);
        self.texts.insert(path.clone(), Rc::clone(&text));
        Ok((path, text))
    }
}

/// Returns the file that a name means: with the ending `.scn`, letters small or capital, below the folder. The folder's
/// own name may stand in front, because the simulator starts one folder above.
fn find_in_folder(folder: &Path, name: &str) -> Result<PathBuf, (String, &'static str)> {
    let given = name.replace('\\', "/");
    let outside = || {
        let cause = format!("`{name}` is outside of the scenario's folder, and is not read");
        (cause, "put the file beside the scenario, and call it by its name")
    };
    let mut parts = Vec::new();
    for component in Path::new(&given).components() {
        match component {
            Component::Normal(part) => parts.push(part.to_string_lossy().into_owned()),
            Component::CurDir => {}
            _ => return Err(outside()),
        }
    }
    let missing = || {
        let cause = format!("`{name}` is not in the scenario's folder");
        (cause, "put the file beside the scenario; paths start at its folder")
    };
    let root = folder.canonicalize().map_err(|_| missing())?;
    let own_name = root.file_name().map(|own| own.to_string_lossy().into_owned());
    let found = find_below(&root, &parts).or_else(|| {
        let (first, rest) = parts.split_first()?;
        let is_own = own_name.is_some_and(|own| own.eq_ignore_ascii_case(first));
        if is_own { find_below(&root, rest) } else { None }
    });
    let path = found.ok_or_else(missing)?;
    // A link may lead anywhere.
    let real = path.canonicalize().map_err(|_| missing())?;
    if real.starts_with(&root) { Ok(real) } else { Err(outside()) }
}

/// Returns the file below a folder with these parts of a path.
fn find_below(root: &Path, parts: &[String]) -> Option<PathBuf> {
    let (name, folders) = parts.split_last()?;
    let mut folder = root.to_path_buf();
    for part in folders {
        folder = find_entry(&folder, part).filter(|path| path.is_dir())?;
    }
    let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem);
    let names =
        [name.clone(), format!("{name}.scn"), format!("{stem}.scn"), format!("{name}.scn.gz")];
    names.iter().find_map(|name| find_entry(&folder, name).filter(|path| path.is_file()))
}

/// Returns the entry of a folder with this name, or with one that differs in small and capital letters.
fn find_entry(folder: &Path, name: &str) -> Option<PathBuf> {
    let exact = folder.join(name);
    if exact.exists() {
        return Some(exact);
    }
    let mut similar: Vec<PathBuf> = std::fs::read_dir(folder)
        .ok()?
        .take(MAX_FOLDER_ENTRIES)
        .filter_map(Result::ok)
        .filter(|entry| entry.file_name().to_string_lossy().eq_ignore_ascii_case(name))
        .map(|entry| entry.path())
        .collect();
    // The order of a folder's entries is not the same everywhere.
    similar.sort();
    similar.into_iter().next()
}
