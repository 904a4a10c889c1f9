//! The tree of modules of a crate: which file declares which, from each root on.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use syn::{Expr, Item, ItemMod, Lit, Meta};
use toml::{Table, Value};

use crate::source::{self, Place, Role, Source};

/// Says of every source where it is in the tree, and which are there for tests only.
pub(crate) fn place(folder: &Path, manifest: &Table, sources: &mut [Source]) {
    let mut tree = Tree {
        index: sources.iter().enumerate().map(|(at, s)| (s.path.clone(), at)).collect(),
        sources,
    };
    for (root, in_library) in roots(folder, manifest) {
        let place = Place { root: root.clone(), names: Vec::new(), in_library };
        tree.grow(&root, place, false);
    }
}

/// Roots that code grows from, relative to the folder: the library, commands, the build script.
fn roots(folder: &Path, manifest: &Table) -> Vec<(PathBuf, bool)> {
    let path_of = |target: &Value| target.get("path").and_then(Value::as_str).map(PathBuf::from);
    let library = manifest.get("lib").and_then(path_of).unwrap_or("src/lib.rs".into());
    let mut roots =
        vec![(library, true), ("src/main.rs".into(), false), ("build.rs".into(), false)];
    let commands = manifest.get("bin").and_then(Value::as_array);
    roots.extend(commands.into_iter().flatten().filter_map(path_of).map(|path| (path, false)));
    for entry in std::fs::read_dir(folder.join("src/bin")).into_iter().flatten().flatten() {
        let name = Path::new("src/bin").join(entry.file_name());
        roots.push((if entry.path().is_dir() { name.join("main.rs") } else { name }, false));
    }
    roots
}

/// Tree of modules as it grows.
struct Tree<'a> {
    index: HashMap<PathBuf, usize>,
    sources: &'a mut [Source],
}

impl Tree<'_> {
    /// Places one file and the files of its modules.
    fn grow(&mut self, path: &Path, place: Place, is_test: bool) {
        let Some(&at) = self.index.get(path) else { return };
        let source = &mut self.sources[at];
        if source.module.is_some() {
            return;
        }
        if is_test {
            source.make_test();
        } else {
            // A file that code and tests share is code.
            source.role = Role::Code;
            source.module = Some(place.clone());
        }
        let beside = folder_of_modules(path, place.names.is_empty());
        let mut found = Vec::new();
        find(&source.items, &beside, &place.names, is_test, &mut found);
        find(&source.test_modules, &beside, &place.names, true, &mut found);
        for module in found {
            let Some(path) = module.paths.iter().find(|path| self.index.contains_key(*path)) else {
                continue;
            };
            let place = Place { names: module.names, ..place.clone() };
            self.grow(path, place, module.is_test);
        }
    }
}

/// Module in a file of its own, as its parent declares it.
struct Declared {
    names: Vec<String>,
    /// The possible places of the file.
    paths: Vec<PathBuf>,
    is_test: bool,
}

/// Finds the modules in files of their own that `items` declare, through inline modules.
fn find(
    items: &[Item],
    beside: &Path,
    parent: &[String],
    is_test: bool,
    found: &mut Vec<Declared>,
) {
    for item in items {
        let Item::Mod(module) = item else { continue };
        let is_test = is_test || source::is_test(&module.attrs);
        let name = module.ident.to_string();
        let names = [parent, std::slice::from_ref(&name)].concat();
        match &module.content {
            Some((_, inner)) => find(inner, &beside.join(&name), &names, is_test, found),
            None => {
                let paths = vec![
                    beside.join(format!("{name}.rs")),
                    beside.join(&name).join("mod.rs"),
                    beside.join(explicit_path(module).unwrap_or_default()),
                ];
                found.push(Declared { names, paths, is_test });
            }
        }
    }
}

/// Path that `#[path = "..."]` gives.
fn explicit_path(module: &ItemMod) -> Option<String> {
    module.attrs.iter().find_map(|attribute| {
        let Meta::NameValue(pair) = &attribute.meta else { return None };
        let Expr::Lit(literal) = &pair.value else { return None };
        match &literal.lit {
            Lit::Str(text) if pair.path.is_ident("path") => Some(text.value()),
            _ => None,
        }
    })
}

/// Folder where the modules of a file are: its own for roots and `mod.rs`, else one of its name.
fn folder_of_modules(path: &Path, is_root: bool) -> PathBuf {
    if is_root || path.ends_with("mod.rs") {
        path.parent().unwrap_or(Path::new("")).to_path_buf()
    } else {
        path.with_extension("")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sources of a crate, placed.
    fn placed(files: &[(&str, &str)]) -> Vec<Source> {
        let mut sources: Vec<Source> = files
            .iter()
            .map(|(path, text)| Source::new(path.into(), Role::Code, text).unwrap())
            .collect();
        place(Path::new("nowhere"), &Table::new(), &mut sources);
        sources
    }

    #[test]
    fn files_are_placed_and_those_of_tests_are_told() {
        let sources = placed(&[
            ("src/lib.rs", "mod a; mod b { mod c; } #[cfg(test)] mod t;"),
            ("src/a.rs", "#[cfg(test)] mod tests; mod d;"),
            ("src/a/tests.rs", "mod deep;"),
            ("src/a/tests/deep.rs", ""),
            ("src/a/d/mod.rs", "mod e;"),
            ("src/a/d/e.rs", ""),
            ("src/b/c.rs", ""),
            ("src/t.rs", ""),
            ("src/lost.rs", ""),
        ]);
        let told: Vec<(String, bool)> = sources
            .iter()
            .map(|s| {
                let names = s.module.as_ref().map_or("-".into(), |place| place.names.join("::"));
                (names, s.role == Role::Test)
            })
            .collect();
        let told: Vec<(&str, bool)> = told.iter().map(|(n, t)| (n.as_str(), *t)).collect();
        assert_eq!(
            told,
            [
                ("", false),
                ("a", false),
                ("-", true),
                ("-", true),
                ("a::d", false),
                ("a::d::e", false),
                ("b::c", false),
                ("-", true),
                ("-", false)
            ]
        );
    }
}
