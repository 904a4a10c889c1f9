//! Comments inside of functions that stand on lines of their own: they should say why.

use std::collections::BTreeSet;

use crate::lines::Kind;
use crate::measures::functions;
use crate::members::Member;

/// Lines of comments inside of functions.
pub(crate) fn count(member: &Member) -> u64 {
    functions::code(member)
        .map(|source| {
            // A set, because a function within another would count its comments twice.
            let inside: BTreeSet<usize> =
                functions::of(source).iter().filter_map(|f| f.inside()).flatten().collect();
            inside.into_iter().map(|line| source.count(Kind::Comment, line..=line)).sum::<u64>()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    #[test]
    fn only_comments_in_bodies_count() {
        let text = "// license\n/// Doc.\nfn a() {\n    // one\n    // two\n    b(); // trailing\n    \
                    fn c() {\n        // three\n    }\n}\n// outside\n\
                    #[cfg(test)]\nmod t {\n    fn d() {\n        // test\n    }\n}\n";
        assert_eq!(count(&member(&[("src/lib.rs", text)])), 3);
    }
}
