//! Parameters of functions that are tuples, by pattern or by type: a struct would name their parts.

use std::fmt::Write;

use syn::{FnArg, Pat, Type};

use crate::measures::functions::{self, Function};
use crate::members::Member;

/// Number of parameters of a function that are tuples.
fn in_function(function: &Function) -> u64 {
    function.signature.inputs.iter().filter(|input| is_tuple(input)).count() as u64
}

fn is_tuple(input: &FnArg) -> bool {
    match input {
        FnArg::Receiver(_) => false,
        FnArg::Typed(typed) => is_tuple_pattern(&typed.pat) || is_tuple_type(&typed.ty),
    }
}

fn is_tuple_pattern(pattern: &Pat) -> bool {
    match pattern {
        Pat::Tuple(_) => true,
        Pat::Reference(reference) => is_tuple_pattern(&reference.pat),
        Pat::Paren(inner) => is_tuple_pattern(&inner.pat),
        _ => false,
    }
}

fn is_tuple_type(kind: &Type) -> bool {
    match kind {
        Type::Tuple(tuple) => !tuple.elems.is_empty(),
        Type::Reference(reference) => is_tuple_type(&reference.elem),
        Type::Paren(inner) => is_tuple_type(&inner.elem),
        _ => false,
    }
}

fn found(member: &Member) -> Vec<(String, u64)> {
    let mut found = Vec::new();
    for source in functions::code(member) {
        for function in functions::of(source) {
            let tuples = in_function(&function);
            if tuples > 0 {
                let path = member.folder.join(&source.path);
                let name = &function.signature.ident;
                found.push((format!("{}:{} {name}", path.display(), function.line()), tuples));
            }
        }
    }
    found
}

/// Number of parameters that are tuples, and of functions that have some.
pub(crate) fn count(member: &Member) -> (u64, u64) {
    let found = found(member);
    (found.iter().map(|(_, tuples)| tuples).sum(), found.len() as u64)
}

/// Lists functions with parameters that are tuples.
pub(crate) fn listed(members: &[Member]) -> String {
    members.iter().flat_map(found).fold(String::new(), |mut text, (place, tuples)| {
        let _ = writeln!(text, "{tuples:2} {place}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    #[test]
    fn patterns_and_types_count_and_lists_of_tuples_do_not() {
        let small = member(&[(
            "src/lib.rs",
            "fn a((x, y): (u8, u8), b: &(u8, u8)) {}\n\
             fn c(d: Point, e: (), f: &[(u8, u8)], g: impl Fn((u8, u8))) {}\n\
             trait T {\n    fn h(&self, i: (u8, u8));\n}\n\
             #[cfg(test)]\nmod tests {\n    fn j(k: (u8, u8)) {}\n}\n",
        )]);
        assert_eq!(count(&small), (3, 2));
        assert!(listed(&[small]).ends_with(" 1 crates/small/src/lib.rs:4 h\n"));
    }
}
