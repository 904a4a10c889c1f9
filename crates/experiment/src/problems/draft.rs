//! A text that is repaired step by step, and the way back to the text as it was given.

use sidestep_kernel::InputError;
use sidestep_scenario::Source;
use std::ops::Range;
use toml::de::DeTable;

/// Bytes that were replaced by others.
#[derive(Debug, Clone)]
struct TextEdit {
    at: usize,
    removed: usize,
    inserted: usize,
}

impl TextEdit {
    /// Returns the place before the change of a place after it; within an insertion, the start of the
    /// removed bytes, or their end.
    fn map_back(&self, offset: usize, is_end: bool) -> usize {
        let inserted_end = self.at + self.inserted;
        if offset < self.at || (is_end && offset == self.at) {
            offset
        } else if is_end && offset <= inserted_end {
            self.at + self.removed
        } else if !is_end && offset < inserted_end {
            self.at
        } else {
            offset - self.inserted + self.removed
        }
    }
}

/// A scenario with a repaired text.
#[derive(Debug, Clone)]
pub(super) struct Draft {
    source: Source,
    /// The latest last.
    changes: Vec<TextEdit>,
}

impl Draft {
    pub(super) fn new(source: Source) -> Self {
        Self { source, changes: Vec::new() }
    }

    pub(super) fn source(&self) -> &Source {
        &self.source
    }

    pub(super) fn text(&self) -> &str {
        &self.source.text
    }

    /// Returns the draft with parts of its text replaced, which do not overlap; none if it would be no
    /// TOML then.
    pub(super) fn with_replacements(&self, mut parts: Vec<(Range<usize>, String)>) -> Option<Self> {
        let mut draft = self.clone();
        // From the last to the first, so that the places of the others stay right.
        parts.sort_by_key(|(part, _)| std::cmp::Reverse(part.start));
        for (part, text) in parts {
            let edit = TextEdit { at: part.start, removed: part.len(), inserted: text.len() };
            draft.source.text.replace_range(part, &text);
            draft.changes.push(edit);
        }
        DeTable::parse(&draft.source.text).is_ok().then_some(draft)
    }

    /// An error in another file than the given text stays as it is.
    pub(super) fn map_error_back(&self, given: &Source, error: &InputError) -> InputError {
        let Some(start) = error.line_and_column().filter(|_| error.place() == given.place) else {
            return error.clone();
        };
        let start = offset(self.text(), start);
        let end = error.end_line_and_column().map_or(start, |end| offset(self.text(), end));
        let start = self.map_back(start, false);
        let end = if end > start { self.map_back(end, true).max(start) } else { start };
        given.error(start..end, error.cause(), error.remedy())
    }

    /// Returns the place in the given text of a place in this one.
    fn map_back(&self, offset: usize, is_end: bool) -> usize {
        self.changes.iter().rev().fold(offset, |offset, change| change.map_back(offset, is_end))
    }
}

/// Lines and columns count from 1, columns in characters.
fn offset(text: &str, (line, column): (usize, usize)) -> usize {
    let start: usize = text.split_inclusive('\n').take(line - 1).map(str::len).sum();
    let ahead = text[start..].char_indices().nth(column - 1).map_or(text.len() - start, |(i, _)| i);
    start + ahead
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lead_back_through_all_changes() {
        let given = Source::new("s.toml", "a = 1\nbad = 22\nc = \"é\" # d\ne = 5\n", "");
        let draft = Draft::new(given.clone());
        let draft = draft.with_replacements(vec![(6..14, String::new())]).expect("TOML");
        let draft = draft
            .with_replacements(vec![(0..0, "new = 7\n".into()), (4..5, "1000".into())])
            .expect("TOML");
        assert_eq!(draft.text(), "new = 7\na = 1000\n\nc = \"é\" # d\ne = 5\n");
        let place = |part: &str| {
            let start = draft.text().find(part).expect(part);
            let error = draft.source().error(start..start + part.len(), "c", "r");
            let told = draft.map_error_back(&given, &error);
            (told.key().map(String::from), told.line_and_column(), told.end_line_and_column())
        };
        assert_eq!(place("5"), (Some("e".into()), Some((4, 5)), Some((4, 6))));
        assert_eq!(place("é"), (Some("c".into()), Some((3, 6)), Some((3, 7))));
        assert_eq!(place("1000"), (Some("a".into()), Some((1, 5)), Some((1, 6))));
        assert!(draft.with_replacements(vec![(0..3, "= =".into())]).is_none());
    }

    #[test]
    fn errors_elsewhere_stay_as_they_are() {
        let given = Source::new("s.toml", "a = 1\n", "");
        let draft = Draft::new(given.clone());
        let error = InputError::new("other.yaml", "c", "r").with_position(900, 7);
        assert_eq!(draft.map_error_back(&given, &error), error);
    }
}
