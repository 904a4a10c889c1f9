//! The identity of builds: only the build that began a run or a sweep goes on with it.

use sidestep::kernel::InputError;
use sidestep::{BUILD, VERSION};
use std::path::Path;

/// The maker of a run or a sweep, as it is recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Maker {
    /// The version of the program.
    pub(crate) version: String,
    /// The build; early recordings do not name it.
    pub(crate) build: Option<String>,
}

impl Maker {
    /// Refuses what another build has made, and another version where no build is known: results
    /// may change from one to the other. `what` was made, at `place`; `remedy` is told the maker.
    pub(crate) fn check(
        &self,
        place: &Path,
        what: &str,
        remedy: impl FnOnce(&str) -> String,
    ) -> Result<(), InputError> {
        let (wrote, reads) = match &self.build {
            Some(build) => (build, BUILD),
            None => (&self.version, VERSION),
        };
        if wrote == reads {
            return Ok(());
        }
        let cause = format!("the {what} is of sidestep {wrote}, this is {reads}");
        Err(InputError::new(place.display(), cause, remedy(wrote)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn builds_are_compared_and_versions_where_there_is_none() {
        let check = |version: &str, build: Option<&str>| {
            let maker = Maker { version: version.into(), build: build.map(Into::into) };
            maker.check(Path::new("x"), "run", |wrote| format!("use {wrote}"))
        };
        assert!(check(VERSION, None).is_ok() && check(VERSION, Some(BUILD)).is_ok());
        assert!(check("0.0.1", None).is_err());
        let other = check(VERSION, Some("0.1.0+000000000000")).expect_err("another build");
        assert!(other.cause().contains("0.1.0+000000000000") && other.cause().contains(BUILD));
        assert_eq!(other.remedy(), "use 0.1.0+000000000000");
    }
}
