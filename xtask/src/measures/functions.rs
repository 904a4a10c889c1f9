//! The functions of a file, each with its signature and its body.

use syn::visit::{self, Visit};
use syn::{Block, ImplItemFn, ItemFn, Signature, TraitItemFn};

use crate::lines::Range;
use crate::members::Member;
use crate::source::{Role, Source};

/// A function or method, or the declaration of one in a trait.
pub(crate) struct Function<'a> {
    pub(crate) signature: &'a Signature,
    pub(crate) body: Option<&'a Block>,
}

impl Function<'_> {
    /// Line that names the function.
    pub(crate) fn line(&self) -> usize {
        self.signature.ident.span().start().line
    }

    /// Lines between the braces.
    pub(crate) fn inside(&self) -> Option<Range> {
        let braces = self.body?.brace_token.span;
        let (first, last) = (braces.open().start().line + 1, braces.close().start().line - 1);
        (first <= last).then_some(first..=last)
    }
}

/// Sources that are code: neither tests nor benches nor examples.
pub(crate) fn code(member: &Member) -> impl Iterator<Item = &Source> {
    member.sources.iter().filter(|source| source.role == Role::Code)
}

/// Returns the functions of a file in order, also those inside others, but no tests.
pub(crate) fn of(source: &Source) -> Vec<Function<'_>> {
    let mut finder = Finder { found: Vec::new() };
    for item in &source.items {
        finder.visit_item(item);
    }
    finder.found
}

struct Finder<'a> {
    found: Vec<Function<'a>>,
}

impl<'a> Visit<'a> for Finder<'a> {
    fn visit_item_fn(&mut self, function: &'a ItemFn) {
        self.found.push(Function { signature: &function.sig, body: Some(&function.block) });
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, method: &'a ImplItemFn) {
        self.found.push(Function { signature: &method.sig, body: Some(&method.block) });
        visit::visit_impl_item_fn(self, method);
    }

    fn visit_trait_item_fn(&mut self, method: &'a TraitItemFn) {
        self.found.push(Function { signature: &method.sig, body: method.default.as_ref() });
        visit::visit_trait_item_fn(self, method);
    }
}

#[cfg(test)]
pub(crate) mod testing {
    use std::path::Path;

    use toml::Table;

    use crate::members::Member;
    use crate::modules;
    use crate::source::{Role, Source};

    /// A crate `small` with these files.
    pub(crate) fn member(files: &[(&str, &str)]) -> Member {
        let source = |(path, text): &(&str, &str)| {
            let role = match path.split('/').next() {
                Some("tests") => Role::Test,
                Some("benches") => Role::Bench,
                Some("examples") => Role::Example,
                _ => Role::Code,
            };
            Source::new(path.into(), role, text).unwrap()
        };
        let mut sources: Vec<Source> = files.iter().map(source).collect();
        modules::place(Path::new("nowhere"), &Table::new(), &mut sources);
        Member {
            name: "small".into(),
            folder: "crates/small".into(),
            manifest: Table::new(),
            sources,
        }
    }
}
