//! Pieces of a text that are replaced.

use std::ops::Range;

/// A piece of a text, and its replacement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Splice {
    /// The bytes that are replaced; none where something is inserted.
    pub(super) range: Range<usize>,
    /// The text that replaces them.
    pub(super) text: String,
}

/// Replaces a piece.
pub(super) fn replace(range: Range<usize>, text: impl Into<String>) -> Splice {
    Splice { range, text: text.into() }
}

/// Inserts a piece.
pub(super) fn insert(at: usize, text: impl Into<String>) -> Splice {
    replace(at..at, text)
}

/// Removes a piece.
pub(super) fn delete(range: Range<usize>) -> Splice {
    replace(range, "")
}

/// Returns a text with pieces replaced; where two overlap, the second gets the remainder of the first.
pub(super) fn apply_splices(text: &str, mut splices: Vec<Splice>) -> String {
    splices.sort_by_key(|splice| splice.range.start);
    let mut new = String::with_capacity(text.len());
    let mut done = 0;
    for Splice { range, text: piece } in splices {
        new += &text[done..range.start.max(done)];
        new += &piece;
        done = done.max(range.end);
    }
    new + &text[done..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_replaced_in_any_order() {
        let splices =
            vec![replace(4..5, "E"), insert(0, ">"), delete(1..3), delete(2..4), insert(6, "<")];
        assert_eq!(apply_splices("abcdef", splices), ">aEf<");
        assert_eq!(apply_splices("ab", vec![insert(1, "1"), insert(1, "2")]), "a12b");
    }
}
