//! Remarks on valid scenarios: effects that their author may not expect.

use serde::Serialize;

/// The weight of a remark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The run is probably not the one that its author wants.
    Warning,
    /// The run is valid, but may differ from its author's expectation.
    Note,
}

impl Severity {
    /// Returns its name, as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// A remark on a valid scenario.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Remark {
    /// Its weight; lists of remarks have warnings first.
    pub severity: Severity,
    /// The key in question, in the notation of overrides: `robots.0.effector`.
    pub key: String,
    /// One sentence, or a cause and a remedy: `it does so: do that`.
    pub words: String,
}

impl Remark {
    /// Creates a remark on a run that is probably not the one that its author wants.
    pub fn warning(key: impl Into<String>, words: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, key: key.into(), words: words.into() }
    }

    /// Creates a remark on a run that may differ from its author's expectation.
    pub fn note(key: impl Into<String>, words: impl Into<String>) -> Self {
        Self { severity: Severity::Note, key: key.into(), words: words.into() }
    }
}
