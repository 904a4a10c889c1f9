//! Long functions: more than 40 lines of code between the braces. Comments may be as long as need be.

use std::fmt::Write;

use crate::lines::Kind;
use crate::measures::functions::{self, Function};
use crate::members::Member;
use crate::source::Source;

/// Lines that a body may have.
const LIMIT: u64 = 40;

fn length(source: &Source, function: &Function) -> u64 {
    function.inside().map_or(0, |lines| source.count(Kind::Code, lines))
}

fn found(member: &Member) -> Vec<(String, u64)> {
    let mut found = Vec::new();
    for source in functions::code(member) {
        for function in functions::of(source) {
            let length = length(source, &function);
            if length > LIMIT {
                let path = member.folder.join(&source.path);
                let name = &function.signature.ident;
                found.push((format!("{}:{} {name}", path.display(), function.line()), length));
            }
        }
    }
    found
}

/// Number of functions that are too long.
pub(crate) fn count(member: &Member) -> u64 {
    found(member).len() as u64
}

/// Lists functions that are too long, the longest first.
pub(crate) fn listed(members: &[Member]) -> String {
    let mut all: Vec<(String, u64)> = members.iter().flat_map(found).collect();
    all.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    all.iter().fold(String::new(), |mut text, (place, length)| {
        let _ = writeln!(text, "{length:4} {place}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    #[test]
    fn bodies_over_forty_lines_are_found() {
        let text = |lines: usize| {
            let body = "    a();\n".repeat(lines);
            format!("struct S;\nimpl S {{\n  fn long() {{\n    // why\n\n{body}  }}\n}}\n")
        };
        assert_eq!(count(&member(&[("src/lib.rs", &text(40))])), 0);
        let small = member(&[("src/lib.rs", &text(41)), ("tests/it.rs", &text(41))]);
        assert_eq!(listed(&[small]), "  41 crates/small/src/lib.rs:3 long\n");
    }
}
