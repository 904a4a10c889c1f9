//! Lines of a file, distinguished: blank, comment, documentation, code.

use std::ops::RangeInclusive;

use proc_macro2::{Span, TokenStream, TokenTree};

/// Numbers of lines, counted from 1, as spans count them.
pub(crate) type Range = RangeInclusive<usize>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Blank,
    /// Nothing but a comment that is not documentation.
    Comment,
    /// Nothing but documentation.
    Doc,
    Code,
}

/// One line of a file.
#[derive(Debug)]
pub(crate) struct Line {
    pub(crate) text: String,
    pub(crate) kind: Kind,
    /// Whether it belongs to code that is built for tests only.
    pub(crate) is_test: bool,
}

/// Tells the lines of a file apart by the tokens that stand on them.
pub(crate) fn of(text: &str, tokens: TokenStream) -> Vec<Line> {
    let raw: Vec<&str> = text.lines().collect();
    let mut kinds: Vec<Kind> = raw.iter().map(|text| without_tokens(text)).collect();
    mark(tokens, &raw, &mut kinds);
    let lines = raw.iter().zip(kinds);
    lines.map(|(text, kind)| Line { text: text.trim().to_string(), kind, is_test: false }).collect()
}

/// Kind of a line without tokens: blank or a comment, because nothing else is left.
fn without_tokens(text: &str) -> Kind {
    if text.trim().is_empty() { Kind::Blank } else { Kind::Comment }
}

fn mark(tokens: TokenStream, raw: &[&str], kinds: &mut [Kind]) {
    for token in tokens {
        match token {
            // Of documentation: its braces span the ends of the comment, not letters of their own.
            TokenTree::Group(group) if is_comment(group.span(), raw) => {}
            TokenTree::Group(group) => {
                mark_span(group.span_open(), raw, kinds);
                mark(group.stream(), raw, kinds);
                mark_span(group.span_close(), raw, kinds);
            }
            other => mark_span(other.span(), raw, kinds),
        }
    }
}

/// Marks the lines of one token. The lexer makes tokens of documentation too: they span the comment.
fn mark_span(span: Span, raw: &[&str], kinds: &mut [Kind]) {
    let (first, last) = (span.start().line - 1, span.end().line);
    let is_doc = is_comment(span, raw);
    for (kind, text) in kinds[first..last].iter_mut().zip(&raw[first..last]) {
        if text.trim().is_empty() || (is_doc && *kind == Kind::Code) {
            continue;
        }
        *kind = if is_doc { Kind::Doc } else { Kind::Code };
    }
}

fn is_comment(span: Span, raw: &[&str]) -> bool {
    let start = span.start();
    let head: String = raw[start.line - 1].chars().skip(start.column).take(2).collect();
    head == "//" || head == "/*"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_told_apart() {
        let text = "//! Doc.\n\n// why\nfn f() { // trailing\n    /// inner\n    let a = \"\n\n// text\";\n}\n/* b\n c */\n/** d\n e */\nconst A: f64 = 1.0 / 2.0;\n";
        let kinds: Vec<Kind> =
            of(text, text.parse().unwrap()).iter().map(|line| line.kind).collect();
        use Kind::{Blank, Code, Comment, Doc};
        assert_eq!(
            kinds,
            [
                Doc, Blank, Comment, Code, Doc, Code, Blank, Code, Code, Comment, Comment, Doc,
                Doc, Code
            ]
        );
    }
}
