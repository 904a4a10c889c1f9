//! Paths that a file names, with the module that each stands in.

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Item, ItemMod, ItemUse, UseTree};

/// Path as it is written: `["crate", "a", "B"]`; the last name of a glob is `*`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Named {
    pub(crate) path: Vec<String>,
    /// Inline modules around it, from the file's own module on.
    pub(crate) within: Vec<String>,
    /// Name that an import gives it, to this module and to all that look into it.
    pub(crate) import: Option<String>,
}

/// Returns all paths of two names or more that `items` name, imports first of all.
pub(crate) fn of(items: &[Item]) -> Vec<Named> {
    let mut finder = Finder { within: Vec::new(), found: Vec::new() };
    for item in items {
        finder.visit_item(item);
    }
    finder.found
}

struct Finder {
    within: Vec<String>,
    found: Vec<Named>,
}

impl<'ast> Visit<'ast> for Finder {
    fn visit_item_mod(&mut self, module: &'ast ItemMod) {
        self.within.push(module.ident.to_string());
        visit::visit_item_mod(self, module);
        self.within.pop();
    }

    fn visit_item_use(&mut self, import: &'ast ItemUse) {
        for (path, name) in leaves(&import.tree) {
            self.found.push(Named { path, within: self.within.clone(), import: Some(name) });
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            let path = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
            self.found.push(Named { path, within: self.within.clone(), import: None });
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        let mut chains = Vec::new();
        chained(call.tokens.clone(), &mut chains);
        for path in chains {
            self.found.push(Named { path, within: self.within.clone(), import: None });
        }
    }
}

/// Collects names with two colons between them: the arguments of macros are tokens and no paths yet.
fn chained(tokens: TokenStream, chains: &mut Vec<Vec<String>>) {
    let mut chain: Vec<String> = Vec::new();
    let mut colons = 0;
    let mut end = |chain: &mut Vec<String>| {
        let whole = std::mem::take(chain);
        chains.extend((whole.len() > 1).then_some(whole));
    };
    let mut groups = Vec::new();
    for token in tokens {
        match token {
            TokenTree::Punct(mark) if mark.as_char() == ':' => colons += 1,
            TokenTree::Ident(name) => {
                if colons != 2 {
                    end(&mut chain);
                }
                colons = 0;
                chain.push(name.to_string());
            }
            other => {
                end(&mut chain);
                colons = 0;
                groups.extend(if let TokenTree::Group(group) = other { Some(group) } else { None });
            }
        }
    }
    end(&mut chain);
    groups.into_iter().for_each(|group| chained(group.stream(), chains));
}

/// Returns every path that an import names, with the name that it gets.
pub(crate) fn leaves(tree: &UseTree) -> Vec<(Vec<String>, String)> {
    let mut found = Vec::new();
    collect(tree, &mut Vec::new(), &mut found);
    found
}

fn collect(tree: &UseTree, path: &mut Vec<String>, found: &mut Vec<(Vec<String>, String)>) {
    let mut leaf = |name: String, alias: Option<String>| {
        let mut whole = path.clone();
        if name != "self" || whole.is_empty() {
            whole.push(name);
        }
        let name = alias.unwrap_or_else(|| whole.last().cloned().unwrap_or_default());
        found.push((whole, name));
    };
    match tree {
        UseTree::Path(step) => {
            path.push(step.ident.to_string());
            collect(&step.tree, path, found);
            path.pop();
        }
        UseTree::Name(name) => leaf(name.ident.to_string(), None),
        UseTree::Rename(rename) => leaf(rename.ident.to_string(), Some(rename.rename.to_string())),
        UseTree::Glob(_) => leaf("*".into(), None),
        UseTree::Group(group) => group.items.iter().for_each(|tree| collect(tree, path, found)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(text: &str) -> Vec<String> {
        let file: syn::File = syn::parse_str(text).unwrap();
        let told = |named: Named| {
            let import = named.import.map(|name| format!(" as {name}")).unwrap_or_default();
            format!("{}|{}{import}", named.within.join("::"), named.path.join("::"))
        };
        of(&file.items).into_iter().map(told).collect()
    }

    #[test]
    fn imports_are_told_one_by_one() {
        assert_eq!(
            written("use crate::a::{self, B, c::{D as E, *}}; pub use super::f::G as H;"),
            [
                "|crate::a as a",
                "|crate::a::B as B",
                "|crate::a::c::D as E",
                "|crate::a::c::* as *",
                "|super::f::G as H"
            ]
        );
    }

    #[test]
    fn paths_in_code_are_told_with_their_module() {
        assert_eq!(
            written("mod a { fn f(x: super::T) -> u8 { crate::g::h::<std::thread::Thread>(x) } }"),
            ["a|super::T", "a|crate::g::h", "a|std::thread::Thread"]
        );
    }

    #[test]
    fn paths_in_macros_are_told() {
        assert_eq!(
            written(
                "fn f() { assert!(crate::g::h(a, [b; 2]), \"{}\", x::<super::K>()); let y: u8 = 1; }"
            ),
            ["|crate::g::h", "|super::K"]
        );
    }
}
