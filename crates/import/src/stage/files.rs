//! The text of a world, over all files that it includes.

use std::path::{Path, PathBuf};

use super::MAX_WORLD_BYTES;
use super::parse::{self, Item, SourcePosition, Value};
use crate::named_file::{allowed_folder, folder_of, is_inside};
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

const MAX_FILES: usize = 1000;

/// The files of a world in the order in which they were read; positions refer to them by their numbers.
#[derive(Default)]
pub(super) struct WorldFiles {
    sources: Vec<SourceFile>,
}

struct SourceFile {
    path: PathBuf,
    text: String,
}

impl WorldFiles {
    /// Reads a world with all files that it includes. Returns their items in the order in which Stage reads them.
    pub(super) fn read(
        path: &Path,
        report: &mut ImportReport,
    ) -> Result<(Self, Vec<Item>), InputError> {
        let mut reader =
            IncludeReader { files: Self::default(), open: Vec::new(), items: Vec::new(), report };
        reader.read(path)?;
        Ok((reader.files, reader.items))
    }

    /// Returns the number of files.
    pub(super) fn count(&self) -> usize {
        self.sources.len()
    }

    /// Returns an error at a position.
    pub(super) fn error(
        &self,
        at: SourcePosition,
        cause: impl Into<String>,
        remedy: &str,
    ) -> InputError {
        let SourceFile { path, text } = &self.sources[at.file];
        InputError::new(path.display(), cause, remedy).with_byte_offset(text, at.offset)
    }

    /// Returns the line of a position for reports, with the file's name where it is an included one.
    pub(super) fn place(&self, at: SourcePosition) -> String {
        let SourceFile { path, text } = &self.sources[at.file];
        let before = &text.as_bytes()[..at.offset.min(text.len())];
        let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
        if at.file == 0 {
            return format!("line {line}");
        }
        format!("line {line} of {}", path.file_name().unwrap_or_default().display())
    }

    /// Returns the path of a file that a world names. Stage looks for it from the folder of the world, whichever of its
    /// files names it; that of the naming file is tried after it, because many an author expects that.
    ///
    /// The file has to lie in the folder above the world's or below: packages have their worlds and their maps side by
    /// side there, and a world that someone else wrote has no business with others.
    pub(super) fn find(
        &self,
        name: &Value,
        report: &mut ImportReport,
    ) -> Result<PathBuf, InputError> {
        let [file] = &name.words[..] else {
            return Err(self.error(name.at, "a list where a file's name is expected", "give one"));
        };
        let world = folder_of(&self.sources[0].path);
        let naming = folder_of(&self.sources[name.at.file].path);
        let by_world = world.join(file);
        if by_world.is_file() {
            return self.check_inside(name, by_world);
        }
        let by_naming_file = naming.join(file);
        if !by_naming_file.is_file() {
            let cause = format!("there is no file {}", by_world.display());
            return Err(self.error(name.at, cause, "put it there, or leave the line out"));
        }
        let rule = "paths that are relative to an included file, and not to the world as in Stage";
        report.record(Treatment::Repaired, rule, self.place(name.at), "");
        self.check_inside(name, by_naming_file)
    }

    fn check_inside(&self, name: &Value, path: PathBuf) -> Result<PathBuf, InputError> {
        if is_inside(&path, &allowed_folder(&self.sources[0].path)) {
            return Ok(path);
        }
        let cause = format!("{} is outside of the world's folder", path.display());
        let remedy = "copy the file beside the world, and write its name without a folder";
        Err(self.error(name.at, cause, remedy))
    }
}

struct IncludeReader<'a> {
    files: WorldFiles,
    /// Files that are being read: each was included by the one before.
    open: Vec<PathBuf>,
    items: Vec<Item>,
    report: &'a mut ImportReport,
}

impl IncludeReader<'_> {
    fn read(&mut self, path: &Path) -> Result<(), InputError> {
        let text = read_text(path, MAX_WORLD_BYTES)?;
        if text.trim_start().starts_with('<') {
            let cause = "is XML, as worlds of Gazebo are, and no world of Stage";
            let remedy = "give a map of ROS (.yaml) of the same place, or a world of Stage";
            return Err(InputError::new(path.display(), cause, remedy));
        }
        let canonical = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        self.open.push(canonical);
        let file = self.files.sources.len();
        let items = parse::items(&path.display().to_string(), &text, file)?;
        self.files.sources.push(SourceFile { path: path.to_owned(), text });
        for item in items {
            match item {
                Item::Include(name) => self.include(&name)?,
                other => self.items.push(other),
            }
        }
        self.open.pop();
        Ok(())
    }

    fn include(&mut self, name: &Value) -> Result<(), InputError> {
        let path = self.files.find(name, self.report)?;
        if path.canonicalize().is_ok_and(|path| self.open.contains(&path)) {
            let cause = format!("{} includes itself", path.display());
            return Err(self.files.error(name.at, cause, "leave this `include` out"));
        }
        if self.files.sources.len() >= MAX_FILES {
            let cause = format!("more than {MAX_FILES} files are included");
            return Err(self.files.error(name.at, cause, "leave this `include` out"));
        }
        self.read(&path)
    }
}
