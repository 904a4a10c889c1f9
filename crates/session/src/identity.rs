//! The identity of builds: only the build that started a run or a sweep continues it.

use sidestep_kernel::InputError;
use std::path::Path;

/// The version of Sidestep.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The program that made a run or a sweep, as recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Producer {
    /// The version of the program.
    pub(crate) version: String,
    /// The build; early recordings do not have it.
    pub(crate) build: Option<String>,
}

impl Producer {
    /// Refuses the work of another build than `own`, or of another version if no build is recorded, because
    /// results may change between them. The noun `what` names the work, at `place`; `remedy` gets
    /// the name of the build that made it.
    ///
    /// # Errors
    /// When the builds differ.
    pub(crate) fn check(
        &self,
        own: &str,
        place: &Path,
        what: &str,
        remedy: impl FnOnce(&str) -> String,
    ) -> Result<(), InputError> {
        let (wrote, reads) = match &self.build {
            Some(build) => (build.as_str(), own),
            None => (self.version.as_str(), VERSION),
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

    const BUILD: &str = "0.1.0+0123456789ab";

    #[test]
    fn builds_are_compared_and_versions_where_there_is_none() {
        let check = |version: &str, build: Option<&str>| {
            let maker = Producer { version: version.into(), build: build.map(Into::into) };
            maker.check(BUILD, Path::new("x"), "run", |wrote| format!("use {wrote}"))
        };
        assert!(check(VERSION, None).is_ok() && check(VERSION, Some(BUILD)).is_ok());
        assert!(check("0.0.1", None).is_err());
        let other = check(VERSION, Some("0.1.0+000000000000")).expect_err("another build");
        assert!(other.cause().contains("0.1.0+000000000000") && other.cause().contains(BUILD));
        assert_eq!(other.remedy(), "use 0.1.0+000000000000");
    }
}
