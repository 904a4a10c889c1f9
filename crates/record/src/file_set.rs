//! Files that are written together, and the list of them: those of a report, or an exported file. All are whole before the
//! first takes its place, and only files that an earlier list names, as they were written, are replaced.

use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::create_error::PathError;
use crate::disk;
use crate::file_list::hash_file;
use crate::file_manifest::FileManifest;

/// New files and their list. If it is dropped before it is [committed](Self::commit), the new files are deleted.
pub struct FileSet {
    list: PathBuf,
    /// The list of the files that are replaced, if there is one.
    old: Option<FileManifest>,
    new: FileManifest,
    staged: Vec<TemporaryFile>,
    /// Folders that were created for the files, the outermost first.
    made: Vec<PathBuf>,
}

/// A file that is whole under a temporary name.
struct TemporaryFile {
    name: String,
    partial: PathBuf,
    target: PathBuf,
}

impl FileSet {
    /// Begins files of a [kind](FileManifest::kind) whose list will be at `list`; an earlier list of that kind may be there.
    ///
    /// # Errors
    /// Another file or a damaged list at that place.
    pub fn new(list: &Path, kind: &str, program_version: &str) -> Result<Self, InputError> {
        let old = match fs::symlink_metadata(list) {
            Err(_) => None,
            Ok(found) if !found.is_file() => return Err(in_the_way(list, &found)),
            Ok(_) => Some(FileManifest::read(list)?.0),
        };
        if let Some(old) = old.as_ref().filter(|old| old.kind != kind) {
            let cause = format!("this is the list of another kind of files: {}", old.kind);
            return Err(InputError::new(list.display(), cause, "give the new files another name"));
        }
        Ok(Self {
            list: list.to_path_buf(),
            old,
            new: FileManifest::new(kind, program_version),
            staged: Vec::new(),
            made: Vec::new(),
        })
    }

    fn folder(&self) -> &Path {
        disk::parent(&self.list)
    }

    /// Refuses a file that may not be written because another one has its name: `name` is its path beside the list.
    ///
    /// # Errors
    /// A link, a folder, a file that the earlier list does not name, or one that was changed.
    pub fn check(&self, name: &str) -> Result<(), InputError> {
        let path = self.folder().join(name);
        let Ok(found) = fs::symlink_metadata(&path) else { return Ok(()) };
        if !found.is_file() {
            return Err(in_the_way(&path, &found));
        }
        let old = self.old.iter().flat_map(|old| [old.files.get(name), old.replaced.get(name)]);
        let known: Vec<_> = old.flatten().collect();
        if known.is_empty() {
            let cause = "no list names this file: another program wrote it, or an older version of this one";
            return Err(InputError::new(path.display(), cause, REMEDY));
        }
        let present =
            hash_file(&path).map_err(|e| InputError::new(path.display(), e.to_string(), REMEDY))?;
        if known.contains(&&present) {
            return Ok(());
        }
        let cause = "the file was changed since it was written, and is not replaced";
        Err(InputError::new(path.display(), cause, REMEDY))
    }

    /// Makes a file under a temporary name, which `make` gets: it has to be whole and on the disk afterwards. An error of
    /// `make` names the file by its later name.
    ///
    /// # Errors
    /// Those of [`Self::check`] and of `make`; an I/O error.
    pub fn stage<T, E: From<InputError> + PathError>(
        &mut self,
        name: &str,
        make: impl FnOnce(&Path) -> Result<T, E>,
    ) -> Result<T, E> {
        self.check(name)?;
        let target = self.folder().join(name);
        self.make_folder(disk::parent(&target))
            .map_err(|e| RecordError::new(target.display(), e))?;
        let partial = free_name(&target);
        // Known before it is made, so that a half-written file is deleted too.
        let file =
            TemporaryFile { name: name.into(), partial: partial.clone(), target: target.clone() };
        self.staged.push(file);
        make(&partial).map_err(|e| e.with_path(&partial, &target))
    }

    /// Makes a file of these bytes under a temporary name.
    ///
    /// # Errors
    /// Those of [`Self::check`]; an I/O error.
    pub fn stage_bytes<E: From<InputError> + PathError>(
        &mut self,
        name: &str,
        bytes: &[u8],
    ) -> Result<(), E> {
        let path = self.folder().join(name);
        self.stage(name, |partial| {
            disk::write_through(partial, bytes)
                .map_err(|e| RecordError::new(path.display(), e).into())
        })
    }

    fn make_folder(&mut self, folder: &Path) -> io::Result<()> {
        let missing = disk::missing_folders(folder);
        fs::create_dir_all(folder)?;
        self.made.extend(missing);
        Ok(())
    }

    /// Writes the list and gives all files their names. Files that the earlier list names and that are not written anew
    /// stay, and stay in the list. A process that is killed meanwhile leaves a list that names what is there.
    ///
    /// # Errors
    /// An I/O error; a file that was changed meanwhile.
    pub fn commit(mut self) -> Result<(), RecordError> {
        let mut is_replaced = false;
        for file in &self.staged {
            self.check(&file.name).map_err(|e| RecordError::new(e.place(), e.cause()))?;
            let failed = |e: io::Error| RecordError::new(file.target.display(), e);
            let digest = hash_file(&file.partial).map_err(failed)?;
            self.new.files.insert(file.name.as_str(), digest);
            if file.target.exists() {
                is_replaced = true;
                self.new
                    .replaced
                    .insert(file.name.as_str(), hash_file(&file.target).map_err(failed)?);
            }
        }
        self.keep_others();
        self.new.write(&self.list)?;
        while let Some(file) = self.staged.first() {
            disk::rename(&file.partial, &file.target)?;
            self.staged.remove(0);
        }
        self.made.clear();
        if is_replaced {
            self.new.replaced = Default::default();
            self.new.write(&self.list)?;
        }
        Ok(())
    }

    /// Takes the files into the list that the earlier one names, and that are still there.
    fn keep_others(&mut self) {
        let old = self.old.take();
        for (name, digest) in old.iter().flat_map(|old| old.files.iter()) {
            let is_there = fs::symlink_metadata(self.folder().join(name)).is_ok();
            if is_there && !self.new.files.contains(name) {
                self.new.files.insert(name, digest.clone());
            }
        }
    }
}

impl Drop for FileSet {
    fn drop(&mut self) {
        for file in &self.staged {
            // Its name was free, so that this process has made it.
            let _ = fs::remove_file(&file.partial);
        }
        for folder in self.made.iter().rev() {
            // Fails, as it should, if the folder is not empty.
            let _ = fs::remove_dir(folder);
        }
    }
}

const REMEDY: &str = "move it away, or give another place with --out";

/// Returns the error of a place where something lies that is no file.
pub(crate) fn in_the_way(path: &Path, found: &Metadata) -> InputError {
    let (cause, remedy) = if found.is_symlink() {
        ("this is a link, which is never replaced", "give the place that it leads to")
    } else if found.is_dir() {
        ("this is a folder", "give a file")
    } else {
        ("this is no plain file", "give a file")
    };
    InputError::new(path.display(), cause, remedy)
}

/// Returns a temporary name beside a file that nothing has: `NAME.PROCESS.partial`.
pub fn free_name(path: &Path) -> PathBuf {
    let process = std::process::id();
    let name = |k: u32| {
        let mut name = path.as_os_str().to_owned();
        match k {
            0 => name.push(format!(".{process}.partial")),
            _ => name.push(format!("-{k}.{process}.partial")),
        }
        PathBuf::from(name)
    };
    let mut free = (0..u32::MAX).map(name).filter(|path| fs::symlink_metadata(path).is_err());
    free.next().unwrap_or_else(|| name(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file_manifest::REPORT;
    use sidestep_kernel::InputError;

    /// The error of any step.
    #[derive(Debug)]
    struct Failed(String);

    impl From<InputError> for Failed {
        fn from(e: InputError) -> Self {
            Self(e.to_string())
        }
    }

    impl PathError for Failed {
        fn with_path(self, from: &Path, to: &Path) -> Self {
            Self(crate::create_error::replace_path(&self.0, from, to))
        }
    }

    impl From<RecordError> for Failed {
        fn from(e: RecordError) -> Self {
            Self(e.to_string())
        }
    }

    fn write(list: &Path, files: &[(&str, &str)]) -> Result<(), Failed> {
        let mut set = FileSet::new(list, REPORT, "0")?;
        for (name, text) in files {
            set.stage_bytes::<Failed>(name, text.as_bytes())?;
        }
        Ok(set.commit()?)
    }

    fn names(folder: &Path) -> Vec<String> {
        let all = crate::run_content::list_tree(folder).unwrap();
        all.iter().map(|path| crate::run_content::slashed(path)).collect()
    }

    #[test]
    fn files_are_replaced_that_are_as_the_list_says_and_no_others() {
        let place = tempfile::tempdir().unwrap();
        let list = place.path().join("a.manifest.json");
        let at = |name: &str| place.path().join(name);
        write(&list, &[("a.html", "one"), ("a-figures/x.svg", "x"), ("a-figures/y.svg", "y")])
            .unwrap();
        write(&list, &[("a.html", "two"), ("a-figures/x.svg", "x")]).unwrap();
        assert_eq!(fs::read(at("a.html")).unwrap(), b"two");
        let (read, _) = FileManifest::read(&list).unwrap();
        assert_eq!(read.files.iter().count(), 3, "what stays stays listed");
        assert!(read.replaced.is_empty() && read.damaged_in(place.path()).is_empty());
        fs::write(at("a.html"), "mine").unwrap();
        let all = names(place.path());
        let refused = write(&list, &[("a-figures/x.svg", "new"), ("a.html", "three")]).unwrap_err();
        assert!(refused.0.contains("changed") && refused.0.contains("a.html"), "{refused:?}");
        fs::write(at("b.html"), "mine").unwrap();
        let other = at("b.manifest.json");
        let refused = write(&other, &[("new/b.md", ""), ("b.html", "")]).unwrap_err();
        assert!(refused.0.contains("no list names this file"), "{refused:?}");
        assert_eq!(fs::read(at("a.html")).unwrap(), b"mine");
        assert_eq!(fs::read(at("b.html")).unwrap(), b"mine");
        assert_eq!(fs::read(at("a-figures/x.svg")).unwrap(), b"x", "all or nothing");
        fs::remove_file(at("b.html")).unwrap();
        assert_eq!(names(place.path()), all, "nothing is left of what was refused");
    }

    #[cfg(unix)]
    #[test]
    fn links_folders_and_lists_of_others_are_never_replaced() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::write(at("mine"), "mine").unwrap();
        for target in ["mine", "nowhere"] {
            std::os::unix::fs::symlink(at(target), at("a.html")).unwrap();
            let refused = write(&at("a.manifest.json"), &[("a.html", "")]).unwrap_err();
            assert!(refused.0.contains("link"), "{refused:?}");
            assert!(at("a.html").is_symlink());
            fs::remove_file(at("a.html")).unwrap();
        }
        fs::create_dir(at("a.html")).unwrap();
        assert!(write(&at("a.manifest.json"), &[("a.html", "")]).unwrap_err().0.contains("folder"));
        for text in ["{\"name\": \"app\"}", ""] {
            fs::write(at("b.manifest.json"), text).unwrap();
            assert!(write(&at("b.manifest.json"), &[("b.html", "")]).is_err());
            assert_eq!(fs::read(at("b.manifest.json")).unwrap(), text.as_bytes());
        }
        FileManifest::new("table", "0").write(&at("results.manifest.json")).unwrap();
        let refused = write(&at("results.manifest.json"), &[("results.html", "")]).unwrap_err();
        assert!(refused.0.contains("another kind"), "{refused:?}");
    }

    #[test]
    fn a_list_also_knows_the_files_that_are_replaced_just_now() {
        let place = tempfile::tempdir().unwrap();
        let list = place.path().join("a.manifest.json");
        write(&list, &[("a", "one"), ("b", "one")]).unwrap();
        // As a process leaves it that is killed between both files.
        let mut half = FileManifest::read(&list).unwrap().0;
        half.replaced = half.files.clone();
        let two = crate::sealed_json::FileDigest::of_bytes(b"two");
        half.files.insert("a", two.clone());
        half.files.insert("b", two);
        half.write(&list).unwrap();
        fs::write(place.path().join("a"), "two").unwrap();
        assert_eq!(half.damaged_in(place.path()), []);
        write(&list, &[("a", "three"), ("b", "three")]).unwrap();
        fs::write(place.path().join("b"), "one").unwrap();
        let (list, _) = FileManifest::read(&list).unwrap();
        assert_eq!(list.damaged_in(place.path()).len(), 1, "what was replaced is forgotten");
    }
}
