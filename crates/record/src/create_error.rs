//! The reasons why results are not stored at a place, and the paths that such errors name.

use std::io;
use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

/// The reason why a folder of results is not made.
#[derive(Debug, thiserror::Error)]
pub enum CreateError {
    /// The place is wrong: something is there that may not be replaced, or no folder can be there.
    #[error(transparent)]
    Refused(#[from] InputError),
    /// The place is right, and the system failed: the disk is full, or this user may not write there.
    #[error(transparent)]
    Failed(#[from] RecordError),
}

impl CreateError {
    /// Returns the error of a folder that the system does not make.
    pub(crate) fn from_io(path: &Path, error: &io::Error) -> Self {
        let cause = format!("cannot make the folder: {error}");
        if is_wrong_path(error) {
            return InputError::new(path.display(), cause, CREATE_REMEDY).into();
        }
        RecordError::new(path.display(), cause).into()
    }

    /// Returns the error as another type that has both reasons.
    pub(crate) fn into_error<E: From<InputError> + From<RecordError>>(self) -> E {
        match self {
            Self::Refused(error) => error.into(),
            Self::Failed(error) => error.into(),
        }
    }
}

/// The remedy of a path where no folder can be made.
pub(crate) const CREATE_REMEDY: &str = "give a folder in a place where you may write";

/// Returns whether a system's error means that nothing can be at a path, whatever room and permissions there are: it
/// leads through a file, say.
pub fn is_wrong_path(error: &io::Error) -> bool {
    use io::ErrorKind::{
        AlreadyExists, InvalidFilename, InvalidInput, IsADirectory, NotADirectory, NotFound,
    };
    matches!(
        error.kind(),
        AlreadyExists | InvalidFilename | InvalidInput | IsADirectory | NotADirectory | NotFound
    )
}

/// An error of work that writes files, whose text may name their paths.
pub trait PathError: From<RecordError> {
    /// Returns the error with the path `to` wherever it names `from` or something below that. What is written under a
    /// hidden name fails by this name, which the user has never given.
    #[must_use]
    fn with_path(self, from: &Path, to: &Path) -> Self;
}

impl PathError for RecordError {
    fn with_path(self, from: &Path, to: &Path) -> Self {
        Self {
            place: replace_path(&self.place, from, to),
            cause: replace_path(&self.cause, from, to),
        }
    }
}

/// Returns a text with the path `to` in place of `from`.
pub fn replace_path(text: &str, from: &Path, to: &Path) -> String {
    text.replace(&from.display().to_string(), &to.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_is_wrong_where_nothing_can_be_and_the_system_fails_where_something_could() {
        let path = Path::new("a/b");
        for kind in [io::ErrorKind::NotADirectory, io::ErrorKind::AlreadyExists] {
            let error = CreateError::from_io(path, &kind.into());
            assert!(matches!(error, CreateError::Refused(_)), "{error}");
        }
        for kind in [io::ErrorKind::StorageFull, io::ErrorKind::PermissionDenied] {
            let error = CreateError::from_io(path, &kind.into());
            assert!(matches!(error, CreateError::Failed(_)), "{error}");
            assert!(error.to_string().contains("a/b: cannot make the folder"), "{error}");
        }
    }

    #[test]
    fn an_error_below_a_hidden_folder_names_the_folder_that_was_asked_for() {
        let error = RecordError::new("./.x.new-7/a.csv", "./.x.new-7 is full");
        let error = error.with_path(Path::new("./.x.new-7"), Path::new("x"));
        assert_eq!((&*error.place, &*error.cause), ("x/a.csv", "x is full"));
    }
}
