//! One file of Rust: its lines, the paths that it names, and the places that figures count.

use proc_macro2::Span;
use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{
    Block, Expr, ExprMatch, ImplItemFn, Item, ItemFn, ItemMod, ItemUse, Lit, Local, Macro, Pat,
    Signature, UseTree,
};

/// Parameters that a function may have, the receiver included.
const MAX_PARAMETERS: usize = 5;

/// Lines of code between the braces of a function.
const MAX_LINES: usize = 40;

/// Attributes of what is built for tests alone.
const TESTS: [&str; 3] = ["#[test]", "#[cfg(test)]", "#[cfg(all(test"];

/// Words by which a comment is taken to give a reason.
const REASONS: &str = "because since so otherwise else prevents avoids would hence therefore must \
                       cannot never lest why";

/// Words by which alike things are told apart, as `from_m` and `to_m`; units and letters do so too.
const PAIRS: &str = "after back before begin bottom col cos east end first from front height high \
                     inner last lat least left lon low lower max min most north outer right row \
                     second sin start third top upper width";

/// A file, as a target of cargo reaches it.
#[derive(Default)]
pub(crate) struct Source {
    /// Path, relative to the root of the workspace.
    pub(crate) path: PathBuf,
    /// File that the target's tree of modules grows from, and the names of the modules from there to this file.
    pub(crate) module: Vec<String>,
    pub(crate) code_lines: u64,
    pub(crate) test_lines: u64,
    /// Key of a figure and number of a line, outside of tests.
    pub(crate) findings: Vec<(&'static str, usize)>,
    /// Paths of two names or more, outside of tests.
    pub(crate) paths: Vec<NamedPath>,
}

/// Path as it is written: `["crate", "a", "B"]`; the last name of a glob is `*`.
pub(crate) struct NamedPath {
    pub(crate) names: Vec<String>,
    /// Module that names it, with inline modules: relative paths start there.
    pub(crate) module: Vec<String>,
    /// Name that an import gives it; none for a path in code.
    pub(crate) import: Option<String>,
}

/// Reads the files of a target from its root on, but those that are known already.
pub(crate) fn read_target(
    workspace: &Path,
    target: &Path,
    is_test: bool,
    known: &mut HashSet<PathBuf>,
) -> Result<Vec<Source>, String> {
    let mut sources = Vec::new();
    let mut open = vec![(vec![target.display().to_string()], is_test)];
    while let Some((module, is_test)) = open.pop() {
        // An attribute or a macro may put a module elsewhere: it is not read.
        let Some(path) = file(target, &module).filter(|path| known.insert(path.clone())) else {
            continue;
        };
        let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let file = syn::parse_file(&text)
            .map_err(|e| format!("{}:{}: {e}", path.display(), e.span().start().line))?;
        let source = Source {
            path: path.strip_prefix(workspace).unwrap_or(&path).to_path_buf(),
            module: module.clone(),
            ..Source::default()
        };
        let lines = text.lines().map(|text| Line { text: text.trim(), is_test }).collect();
        let mut reader = Reader { source, lines, module, is_test, declared: Vec::new() };
        reader.visit_file(&file);
        reader.count_lines();
        open.extend(reader.declared);
        sources.push(reader.source);
    }
    sources.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(sources)
}

fn file(target: &Path, module: &[String]) -> Option<PathBuf> {
    if module.len() == 1 {
        return Some(target.to_path_buf());
    }
    let folder = target.parent()?.join(module[1..].join("/"));
    [folder.with_extension("rs"), folder.join("mod.rs")].into_iter().find(|path| path.is_file())
}

/// A line without the spaces around it. Lines within strings are taken for what they look like.
struct Line<'a> {
    text: &'a str,
    is_test: bool,
}

impl Line<'_> {
    fn is_code(&self) -> bool {
        !self.text.is_empty() && !self.text.starts_with("//")
    }

    fn is_comment(&self) -> bool {
        self.text.starts_with("//")
            && !self.text.starts_with("///")
            && !self.text.starts_with("//!")
    }
}

/// Walks through a file and fills a [`Source`].
struct Reader<'a> {
    source: Source,
    lines: Vec<Line<'a>>,
    /// Module that is walked through, with inline modules.
    module: Vec<String>,
    is_test: bool,
    /// Modules in files of their own, and whether they are for tests.
    declared: Vec<(Vec<String>, bool)>,
}

impl Reader<'_> {
    /// Marks an item whose attributes keep it for tests. Returns whether all around it is for tests.
    fn enter(&mut self, item: Span) -> bool {
        let is_outer_test = self.is_test;
        let lines = &mut self.lines[item.start().line - 1..item.end().line];
        let mut head = lines.iter().take_while(|line| line.text.starts_with(['#', '/']));
        if head.any(|line| TESTS.iter().any(|attribute| line.text.starts_with(attribute))) {
            self.is_test = true;
            lines.iter_mut().for_each(|line| line.is_test = true);
        }
        is_outer_test
    }

    fn record(&mut self, figure: &'static str, span: Span) {
        if !self.is_test {
            self.source.findings.push((figure, span.start().line));
        }
    }

    fn record_path(&mut self, names: Vec<String>, import: Option<String>) {
        if !self.is_test && names.len() > 1 {
            self.source.paths.push(NamedPath { names, module: self.module.clone(), import });
        }
    }

    /// Records every path of an import that begins with these names. `a::{self}` is `a`.
    fn record_import(&mut self, tree: &UseTree, mut names: Vec<String>) {
        let (last, import) = match tree {
            UseTree::Path(step) => {
                names.push(step.ident.to_string());
                return self.record_import(&step.tree, names);
            }
            UseTree::Group(group) => {
                return group.items.iter().for_each(|tree| self.record_import(tree, names.clone()));
            }
            UseTree::Name(name) => (name.ident.to_string(), None),
            UseTree::Rename(rename) => (rename.ident.to_string(), Some(rename.rename.to_string())),
            UseTree::Glob(_) => ("*".to_string(), None),
        };
        if last != "self" {
            names.push(last);
        }
        let import = import.or_else(|| names.last().cloned());
        self.record_path(names, import);
    }

    fn measure_function(&mut self, signature: &Signature, body: &Block) {
        let first = body.brace_token.span.open().start().line;
        let last = body.brace_token.span.close().start().line;
        let inside = self.lines.iter().take(last.saturating_sub(1)).skip(first);
        if inside.filter(|line| line.is_code()).count() > MAX_LINES {
            self.record("long_functions", signature.ident.span());
        }
    }

    fn count_lines(&mut self) {
        let mut number = 1;
        for lines in self.lines.chunk_by(|a, b| a.is_comment() && b.is_comment()) {
            let first = &lines[0];
            if first.is_code() && first.is_test {
                self.source.test_lines += 1;
            } else if first.is_code() {
                self.source.code_lines += 1;
            }
            if first.is_comment() && !first.is_test && gives_reason(lines) {
                self.source.findings.push(("reasons", number));
            }
            number += lines.len();
        }
    }
}

fn gives_reason(comment: &[Line]) -> bool {
    let mut words = comment.iter().flat_map(|line| line.text.split(|c: char| !c.is_alphabetic()));
    words.any(|word| REASONS.split(' ').any(|reason| word.eq_ignore_ascii_case(reason)))
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let is_outer_test = self.enter(item.span());
        visit::visit_item(self, item);
        self.is_test = is_outer_test;
    }

    fn visit_item_mod(&mut self, module: &'ast ItemMod) {
        self.module.push(module.ident.to_string());
        if module.content.is_none() {
            self.declared.push((self.module.clone(), self.is_test));
        }
        visit::visit_item_mod(self, module);
        self.module.pop();
    }

    fn visit_item_use(&mut self, import: &'ast ItemUse) {
        self.record_import(&import.tree, Vec::new());
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names = path.segments.iter().map(|segment| segment.ident.to_string());
        self.record_path(names.collect(), None);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        // What a macro gets are tokens and no paths yet.
        let tokens = call.tokens.to_string().replace(" :: ", "::");
        for path in tokens.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':') {
            let names = path.split("::").filter(|name| !name.is_empty());
            self.record_path(names.map(String::from).collect(), None);
        }
    }

    fn visit_item_fn(&mut self, function: &'ast ItemFn) {
        self.measure_function(&function.sig, &function.block);
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, method: &'ast ImplItemFn) {
        let is_outer_test = self.enter(method.span());
        self.measure_function(&method.sig, &method.block);
        visit::visit_impl_item_fn(self, method);
        self.is_test = is_outer_test;
    }

    fn visit_signature(&mut self, signature: &'ast Signature) {
        if signature.inputs.len() > MAX_PARAMETERS {
            self.record("many_parameters", signature.ident.span());
        }
        visit::visit_signature(self, signature);
    }

    fn visit_local(&mut self, local: &'ast Local) {
        if let Some(init) = &local.init {
            if is_tuple_of_unlike_things(&local.pat, &init.expr) {
                self.record("tuple_lets", local.span());
            }
            if matches!(*init.expr, Expr::Closure(_)) {
                self.record("named_closures", local.span());
            }
        }
        visit::visit_local(self, local);
    }

    fn visit_expr_match(&mut self, expression: &'ast ExprMatch) {
        let mut patterns = expression.arms.iter().map(|arm| &arm.pat);
        if patterns.any(|p| matches!(p, Pat::Lit(value) if matches!(value.lit, Lit::Bool(_)))) {
            self.record("bool_matches", expression.span());
        }
        visit::visit_expr_match(self, expression);
    }
}

/// Returns whether `let (a, b) = (x, y)` names things that are not alike.
fn is_tuple_of_unlike_things(pattern: &Pat, value: &Expr) -> bool {
    let (Pat::Tuple(pattern), Expr::Tuple(_)) = (pattern, value) else {
        return false;
    };
    let mut kinds: Vec<Vec<String>> = pattern.elems.iter().filter_map(kind).collect();
    kinds.sort();
    kinds.dedup();
    kinds.len() > 1
}

/// Returns the words of a name without those that tell alike things apart; none of a pattern that is no name.
fn kind(pattern: &Pat) -> Option<Vec<String>> {
    let Pat::Ident(name) = pattern else {
        return None;
    };
    let name = name.ident.to_string();
    let words =
        name.split('_').filter(|word| word.len() > 2 && !PAIRS.split(' ').any(|p| p == *word));
    Some(words.map(String::from).collect())
}
