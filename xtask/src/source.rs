//! One file of Rust: its lines, and its items apart from tests.

use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::TokenStream;
use syn::spanned::Spanned;
use syn::{Attribute, ImplItem, Item, Meta};

use crate::lines::{self, Line, Range};

/// The purpose of a file, by the folder that it lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Code,
    Test,
    Bench,
    Example,
}

/// Place of a file in the tree of modules.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// File that the tree grows from, `src/lib.rs` for example.
    pub(crate) root: PathBuf,
    /// Names of the modules from the root to this one.
    pub(crate) names: Vec<String>,
    pub(crate) in_library: bool,
}

/// One file of Rust.
pub(crate) struct Source {
    /// Path, relative to the folder of the crate.
    pub(crate) path: PathBuf,
    pub(crate) role: Role,
    /// Lines, in order.
    pub(crate) lines: Vec<Line>,
    /// Everything declared, without items that are built for tests only.
    pub(crate) items: Vec<Item>,
    /// Modules in files of their own that are built for tests only, as [`Source::items`] lacks them.
    pub(crate) test_modules: Vec<Item>,
    /// The file's place in the tree of modules; none where no module names it, or only tests do.
    pub(crate) module: Option<Place>,
}

impl Source {
    /// Parses a file.
    pub(crate) fn new(path: PathBuf, role: Role, text: &str) -> Result<Source, String> {
        let parsed = parse(text).map_err(|e| {
            let at = e.span().start();
            format!("{}:{}:{}: {e}", path.display(), at.line, at.column + 1)
        })?;
        let (tokens, mut items) = parsed;
        let mut lines = lines::of(text, tokens);
        let mut tests = Vec::new();
        take_tests(&mut items, &mut tests);
        for item in &tests {
            mark_test(&mut lines, range(item));
        }
        take_test_methods(&mut items, &mut lines);
        Ok(Source { path, role, lines, items, test_modules: tests, module: None })
    }

    /// Declares the whole file to be for tests.
    pub(crate) fn make_test(&mut self) {
        self.role = Role::Test;
    }

    /// Lines of a kind that are no test, in this range.
    pub(crate) fn count(&self, kind: lines::Kind, range: Range) -> u64 {
        let lines = &self.lines[range.start() - 1..*range.end()];
        lines.iter().filter(|line| line.kind == kind && !line.is_test).count() as u64
    }
}

fn parse(text: &str) -> syn::Result<(TokenStream, Vec<Item>)> {
    // Lines are numbered alike with and without this first line, because it stays in place.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let tokens: TokenStream = text.parse().map_err(syn::Error::from)?;
    let file: syn::File = syn::parse2(tokens.clone())?;
    Ok((tokens, file.items))
}

/// Range of lines that something takes, its attributes and documentation with it.
pub(crate) fn range(node: &impl Spanned) -> Range {
    let span = node.span();
    span.start().line..=span.end().line
}

fn mark_test(lines: &mut [Line], range: Range) {
    for line in &mut lines[range.start() - 1..*range.end()] {
        line.is_test = true;
    }
}

/// Moves items that are built for tests only out of `items`, from inline modules too.
fn take_tests(items: &mut Vec<Item>, tests: &mut Vec<Item>) {
    tests.extend(items.extract_if(.., |item| is_test(attributes(item))));
    for item in items {
        if let Item::Mod(module) = item
            && let Some((_, inner)) = &mut module.content
        {
            take_tests(inner, tests);
        }
    }
}

/// Removes methods that are built for tests only from `impl` blocks.
fn take_test_methods(items: &mut [Item], lines: &mut [Line]) {
    for item in items {
        match item {
            Item::Mod(module) => {
                if let Some((_, inner)) = &mut module.content {
                    take_test_methods(inner, lines);
                }
            }
            Item::Impl(block) => block.items.retain(|item| {
                let ImplItem::Fn(method) = item else { return true };
                let test = is_test(&method.attrs);
                if test {
                    mark_test(lines, range(method));
                }
                !test
            }),
            _ => {}
        }
    }
}

/// Returns whether attributes say that something is built for tests only.
pub(crate) fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::Path(path) => path.is_ident("test"),
        Meta::List(list) if list.path.is_ident("cfg") => {
            let condition = list.tokens.to_string().replace(' ', "");
            condition == "test" || condition.starts_with("all(test")
        }
        _ => false,
    })
}

/// Attributes of an item.
pub(crate) fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Reads all files of a crate, sorted by path; `folder` is relative to the root of the workspace.
pub(crate) fn read_all(root: &Path, folder: &Path) -> Result<Vec<Source>, String> {
    let base = root.join(folder);
    let mut paths = Vec::new();
    collect(&base, &["rs"], &mut paths).map_err(|e| format!("{}: {e}", base.display()))?;
    paths.sort();
    let mut sources = Vec::new();
    for full in paths {
        let text = fs::read_to_string(&full).map_err(|e| format!("{}: {e}", full.display()))?;
        let path = full.strip_prefix(&base).unwrap_or(&full).to_path_buf();
        let role = role(&folder.join(&path));
        let source = Source::new(path, role, &text)
            .map_err(|message| format!("{}/{message}", folder.display()))?;
        sources.push(source);
    }
    Ok(sources)
}

/// Collects the files below a folder with one of these endings, but not those of other packages or of builds.
pub(crate) fn collect(
    folder: &Path,
    endings: &[&str],
    paths: &mut Vec<PathBuf>,
) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let is_foreign = path.join("Cargo.toml").exists() || path.ends_with("target");
        if path.is_dir() && !is_foreign {
            collect(&path, endings, paths)?;
        } else if path
            .extension()
            .is_some_and(|found| endings.iter().any(|ending| found == *ending))
        {
            paths.push(path);
        }
    }
    Ok(())
}

/// Role of a file by the first folder that says so, from the root of the workspace down to `src`.
fn role(path: &Path) -> Role {
    for part in path {
        match part.to_str() {
            Some("src") => return Role::Code,
            Some("tests" | "fuzz") => return Role::Test,
            Some("benches") => return Role::Bench,
            Some("examples") => return Role::Example,
            _ => {}
        }
    }
    Role::Code
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lines::Kind;

    #[test]
    fn what_is_for_tests_is_marked_and_taken_out() {
        let text = "fn a() {}\nimpl A {\n    #[cfg(test)]\n    fn b() {}\n    fn c() {}\n}\n\
                    /// Doc.\n#[cfg(test)]\nmod tests {\n    fn d() {}\n}\nmod e {\n    #[test]\n    fn f() {}\n}\n\
                    #[cfg(not(test))]\nfn g() {}\n";
        let source = Source::new("a.rs".into(), Role::Code, text).unwrap();
        assert_eq!(source.items.len(), 4);
        assert_eq!(source.count(Kind::Code, 1..=source.lines.len()), 8);
    }

    #[test]
    fn folders_say_what_a_file_is_for() {
        let role = |path| role(Path::new(path));
        assert_eq!(role("crates/a/src/tests/b.rs"), Role::Code);
        assert_eq!(role("crates/a/tests/it/b.rs"), Role::Test);
        assert_eq!(role("crates/a/examples/b.rs"), Role::Example);
        assert_eq!(role("benches/robots/src/main.rs"), Role::Bench);
    }

    #[test]
    fn a_file_that_is_no_rust_is_named() {
        let error = Source::new("a.rs".into(), Role::Code, "fn a() {\n  let = 3;\n}").err();
        assert!(error.unwrap().starts_with("a.rs:2:"));
    }
}
