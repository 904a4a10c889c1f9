//! Sections of sensors and effectors, which stand in scenarios, profiles and presets.

use sidestep_kernel::InputError;
use sidestep_scenario::{Source, Spanned};
use std::ops::Range;
use std::sync::Arc;

/// A section and the text it stands in (scenario, profile or presets).
#[derive(Debug, Clone)]
pub(super) struct LocatedSection<T> {
    pub(super) section: Spanned<T>,
    pub(super) source: Arc<Source>,
}

impl<T> LocatedSection<T> {
    pub(super) fn error(
        &self,
        span: Range<usize>,
        cause: impl Into<String>,
        remedy: &str,
    ) -> InputError {
        self.source.error(Some(span), cause, remedy)
    }
}
