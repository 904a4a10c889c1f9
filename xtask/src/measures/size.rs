//! Size: lines with code, by their purpose. Blank lines and comments do not count.

use crate::lines::Kind;
use crate::members::Member;
use crate::source::Role;

/// Lines of code of one crate.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) code: u64,
    /// Tests beside the code and in `tests/`.
    pub(crate) tests: u64,
    pub(crate) benches: u64,
    pub(crate) examples: u64,
}

pub(crate) fn count(member: &Member) -> Size {
    let mut size = Size::default();
    for source in &member.sources {
        for line in source.lines.iter().filter(|line| line.kind == Kind::Code) {
            *match (source.role, line.is_test) {
                (Role::Bench, _) => &mut size.benches,
                (Role::Example, _) => &mut size.examples,
                (Role::Test, _) | (Role::Code, true) => &mut size.tests,
                (Role::Code, false) => &mut size.code,
            } += 1;
        }
    }
    size
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    #[test]
    fn lines_are_counted_by_what_they_are_for() {
        let counted = count(&member(&[
            (
                "src/lib.rs",
                "//! Doc.\n\nfn a() {\n    // why\n    b();\n}\n#[cfg(test)]\nmod t {\n}\n",
            ),
            ("tests/it.rs", "#[test]\nfn a() {}\n"),
            ("benches/b.rs", "fn a() {}\n"),
            ("examples/e.rs", "fn a() {}\n\nfn b() {}\n"),
        ]));
        assert_eq!(counted, Size { code: 3, tests: 5, benches: 1, examples: 2 });
    }
}
