//! The trials of experiments that have ended, in a file: an interrupted command goes on from there.
//!
//! The first line says which experiments the file is of, each further one is a trial: JSON, one value a line. The last line
//! is dropped if a kill has left it half written; nothing else in the file is ever changed. One command has it at a time.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The experiments that a file is of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialFileHead {
    /// The build of the program, because another one may come to other results.
    pub build: String,
    /// What is run, without what only its speed depends on.
    pub plan: Value,
}

/// A trial that has ended.
#[derive(Debug, Serialize, Deserialize)]
struct EndedTrial {
    trial: String,
    result: Value,
}

/// Why a file of trials cannot be continued.
#[derive(Debug, thiserror::Error)]
pub enum TrialFileError {
    /// It cannot be read or written.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Another command writes to it.
    #[error("another command writes to it")]
    InUse,
    /// It is no such file, or of other experiments.
    #[error("it is the beginning of {0}")]
    Other(String),
}

/// The trials that have ended, kept in a file or not at all.
#[derive(Debug, Default)]
pub struct TrialFile {
    path: Option<PathBuf>,
    known: BTreeMap<String, Value>,
    file: Mutex<Option<File>>,
    failure: Mutex<Option<io::Error>>,
}

impl TrialFile {
    /// Returns one that keeps nothing.
    pub fn none() -> Self {
        Self::default()
    }

    /// Opens a file, or begins one if there is none; trials in it are not run again.
    ///
    /// # Errors
    /// When it cannot be read or written, is of other experiments, or another command has it.
    pub fn open(path: &Path, head: &TrialFileHead) -> Result<Self, TrialFileError> {
        let mut file = OpenOptions::new().create(true).read(true).append(true).open(path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(TrialFileError::InUse),
            Err(TryLockError::Error(error)) => return Err(error.into()),
        }
        let mut text = String::new();
        file.read_to_string(&mut text)?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let known = read_trials(&text[..whole], head)?;
        if whole < text.len() {
            file.set_len(whole as u64)?;
        }
        if whole == 0 {
            write_line(&mut file, head)?;
        }
        Ok(Self {
            path: Some(path.to_path_buf()),
            known,
            file: Mutex::new(Some(file)),
            failure: Mutex::default(),
        })
    }

    /// Returns the number of trials that it had when it was opened.
    pub fn known_count(&self) -> usize {
        self.known.len()
    }

    /// Returns the result of a trial: as it is known, or else by `run`, and keeps it.
    ///
    /// # Errors
    /// Those of `run`.
    pub fn result<T: Serialize + DeserializeOwned, E>(
        &self,
        trial: &str,
        run: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        let known = self.known.get(trial).and_then(|known| T::deserialize(known).ok());
        if let Some(known) = known {
            return Ok(known);
        }
        let result = run()?;
        self.keep(trial, &result);
        Ok(result)
    }

    /// Writes a trial. What cannot be kept is still a result: the failure is told at the end.
    fn keep(&self, trial: &str, result: &impl Serialize) {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(open) = file.as_mut() else { return };
        let result = serde_json::to_value(result).expect("a result is plain data");
        if let Err(error) = write_line(open, &EndedTrial { trial: trial.into(), result }) {
            // A further line would come after half of this one.
            *file = None;
            *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
        }
    }

    /// Returns why trials could not be kept, if that is so.
    pub fn take_failure(&self) -> Option<io::Error> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Removes the file: all results are in their place.
    ///
    /// # Errors
    /// When it cannot be removed.
    pub fn remove(self) -> io::Result<()> {
        self.path.map_or(Ok(()), std::fs::remove_file)
    }
}

fn write_line(file: &mut File, value: &impl Serialize) -> io::Result<()> {
    let mut line = serde_json::to_vec(value).expect("plain data");
    line.push(b'\n');
    // At once, so that a killed process leaves whole lines.
    file.write_all(&line)
}

/// Returns the trials of a file, by name; none of an empty one.
fn read_trials(
    text: &str,
    head: &TrialFileHead,
) -> Result<BTreeMap<String, Value>, TrialFileError> {
    let other = |what: &str| TrialFileError::Other(what.into());
    let mut known = BTreeMap::new();
    let mut lines = text.lines().zip(1..);
    let Some((first, _)) = lines.next() else { return Ok(known) };
    let found: TrialFileHead = serde_json::from_str(first).map_err(|_| other("something else"))?;
    if found.plan != head.plan {
        return Err(other("other experiments"));
    }
    if found.build != head.build {
        return Err(other("these experiments by another build of this program"));
    }
    for (line, number) in lines {
        let EndedTrial { trial, result } = serde_json::from_str(line).map_err(|error| {
            other(&format!("these experiments, but line {number} is damaged: {error}"))
        })?;
        known.insert(trial, result);
    }
    Ok(known)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn head(seeds: u32) -> TrialFileHead {
        TrialFileHead { build: "b".into(), plan: json!({ "seeds": seeds }) }
    }

    /// Runs trials 0 to `count`, and returns their results and the number of those that were really run.
    fn run_trials(file: &TrialFile, count: u64) -> (Vec<u64>, u64) {
        let mut run = 0;
        let results = (0..count).map(|k| {
            file.result(&format!("trial {k}"), || {
                run += 1;
                Ok::<_, ()>(k * k)
            })
        });
        let results = results.collect::<Result<_, _>>().expect("no trial fails");
        (results, run)
    }

    #[test]
    fn trials_that_have_ended_are_not_run_again_and_a_half_line_is_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("trials.jsonl");
        let first = TrialFile::open(&path, &head(3)).expect("begins");
        assert_eq!(run_trials(&first, 3), (vec![0, 1, 4], 3));
        let text = std::fs::read_to_string(&path).expect("kept");
        std::fs::write(&path, &text[..text.len() - 5]).expect("written");
        drop(first);
        let second = TrialFile::open(&path, &head(3)).expect("goes on");
        assert_eq!(second.known_count(), 2);
        assert_eq!(run_trials(&second, 4), (vec![0, 1, 4, 9], 2));
        let in_use = TrialFile::open(&path, &head(3)).expect_err("one command at a time");
        assert!(matches!(in_use, TrialFileError::InUse), "{in_use}");
        drop(second);
        let third = TrialFile::open(&path, &head(3)).expect("goes on");
        assert_eq!(run_trials(&third, 4).1, 0);
        assert!(third.take_failure().is_none());
        third.remove().expect("removed");
        assert!(!path.exists());
    }

    #[test]
    fn a_file_of_other_experiments_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("trials.jsonl");
        drop(TrialFile::open(&path, &head(3)).expect("begins"));
        let text = std::fs::read_to_string(&path).expect("kept");
        let other_build = TrialFileHead { build: "c".into(), ..head(3) };
        for (other, words) in [(head(4), "other experiments"), (other_build, "another build")] {
            let error = TrialFile::open(&path, &other).expect_err("refused").to_string();
            assert!(error.contains(words), "{error}");
        }
        assert_eq!(std::fs::read_to_string(&path).expect("kept"), text);
        for (content, words) in
            [("a letter\n".into(), "something else"), (text + "{}\n", "line 2 is damaged")]
        {
            std::fs::write(&path, content).expect("written");
            let error = TrialFile::open(&path, &head(3)).expect_err("refused").to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn without_a_file_all_trials_are_run() {
        assert_eq!(run_trials(&TrialFile::none(), 3), (vec![0, 1, 4], 3));
        TrialFile::none().remove().expect("nothing to remove");
    }
}
