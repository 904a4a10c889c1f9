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

pub(super) fn replace(range: Range<usize>, text: impl Into<String>) -> Splice {
    Splice { range, text: text.into() }
}

pub(super) fn insert(offset: usize, text: impl Into<String>) -> Splice {
    replace(offset..offset, text)
}

pub(super) fn delete(range: Range<usize>) -> Splice {
    replace(range, "")
}

/// Returns a text with pieces replaced; where two overlap, the second covers only what the first has left.
pub(super) fn apply_splices(text: &str, mut splices: Vec<Splice>) -> String {
    // A stable sort: insertions at one offset stay in their order.
    splices.sort_by_key(|splice| splice.range.start);
    let mut new = String::with_capacity(text.len());
    let mut copied = 0;
    for Splice { range, text: piece } in splices {
        new += &text[copied..range.start.max(copied)];
        new += &piece;
        copied = copied.max(range.end);
    }
    new + &text[copied..]
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
