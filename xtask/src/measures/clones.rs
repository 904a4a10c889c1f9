//! Clones: places with six or more equal lines of code. Imports, comments and blank lines do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::hash::{DefaultHasher, Hash, Hasher};

use syn::visit::{self, Visit};
use syn::{Item, ItemUse};

use crate::lines::{Kind, Range};
use crate::measures::functions;
use crate::members::Member;
use crate::source::{self, Source};

/// Lines that must be equal.
const WINDOW: usize = 6;

/// Two places with equal lines, as indices of the first line of each in `Text::lines`.
struct Clone {
    first: usize,
    second: usize,
    length: usize,
}

/// Pairs of equal places and lines that lie in some, of one crate or of all.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Clones {
    pub(crate) pairs: u64,
    pub(crate) lines: u64,
}

/// One line of code, and where it is.
struct Counted<'a> {
    member: usize,
    source: &'a Source,
    number: usize,
    text: &'a str,
}

/// Lines of all files; `None` parts lines that do not follow each other.
type Text<'a> = Vec<Option<Counted<'a>>>;

/// Counts the clones of each crate, and of all together: a pair may lie in two crates.
pub(crate) fn count(members: &[Member]) -> (Vec<Clones>, Clones) {
    let text = text(members);
    let mut each: Vec<Clones> = members.iter().map(|_| Clones::default()).collect();
    let clones = find(&text);
    let mut lines = BTreeSet::new();
    for clone in &clones {
        let touched = BTreeSet::from([clone.first, clone.second].map(|at| crate_of(&text, at)));
        touched.into_iter().for_each(|member| each[member].pairs += 1);
        lines.extend(clone.first..clone.first + clone.length);
        lines.extend(clone.second..clone.second + clone.length);
    }
    for &line in &lines {
        each[crate_of(&text, line)].lines += 1;
    }
    (each, Clones { pairs: clones.len() as u64, lines: lines.len() as u64 })
}

/// Lists all clones, the longest first.
pub(crate) fn listed(members: &[Member]) -> String {
    let text = text(members);
    let mut clones = find(&text);
    clones.sort_by_key(|clone| std::cmp::Reverse(clone.length));
    let place = |at: usize| {
        text[at].as_ref().map_or(String::new(), |line| {
            let path = members[line.member].folder.join(&line.source.path);
            format!("{}:{}", path.display(), line.number)
        })
    };
    clones.iter().fold(String::new(), |mut text, clone| {
        let _ = writeln!(text, "{:4} {} {}", clone.length, place(clone.first), place(clone.second));
        text
    })
}

fn crate_of(text: &Text, at: usize) -> usize {
    text[at].as_ref().map_or(0, |line| line.member)
}

/// Returns the lines that may be clones: code without imports, and no tests.
fn text(members: &[Member]) -> Text<'_> {
    let mut text = Vec::new();
    for (member, sources) in members.iter().enumerate() {
        for source in functions::code(sources) {
            let imports = imports(source);
            for (at, line) in source.lines.iter().enumerate() {
                let number = at + 1;
                if line.is_test {
                    text.push(None);
                } else if line.kind == Kind::Code && !imports.contains(&number) {
                    text.push(Some(Counted { member, source, number, text: &line.text }));
                }
            }
            text.push(None);
        }
    }
    text
}

/// Lines of imports.
fn imports(source: &Source) -> BTreeSet<usize> {
    struct Finder(Vec<Range>);
    impl<'ast> Visit<'ast> for Finder {
        fn visit_item(&mut self, item: &'ast Item) {
            match item {
                Item::Use(import) => self.visit_item_use(import),
                other => visit::visit_item(self, other),
            }
        }
        fn visit_item_use(&mut self, import: &'ast ItemUse) {
            self.0.push(source::range(import));
        }
    }
    let mut finder = Finder(Vec::new());
    source.items.iter().for_each(|item| finder.visit_item(item));
    finder.0.into_iter().flatten().collect()
}

/// Finds all pairs of equal places, each as long as it goes.
fn find(text: &Text) -> Vec<Clone> {
    let mut windows: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for at in 0..text.len().saturating_sub(WINDOW - 1) {
        if let Some(hash) = hash(&text[at..at + WINDOW]) {
            windows.entry(hash).or_default().push(at);
        }
    }
    let mut clones = Vec::new();
    for places in windows.values() {
        for (nth, &first) in places.iter().enumerate() {
            for &second in &places[nth + 1..] {
                clones.extend(clone(text, first, second));
            }
        }
    }
    clones.sort_by_key(|clone| (clone.first, clone.second));
    clones
}

/// Returns the clone that begins at these places, none where an earlier pair goes on to here.
fn clone(text: &Text, first: usize, second: usize) -> Option<Clone> {
    let goes_on = first > 0 && equal(&text[first - 1], &text[second - 1]);
    let length = (0..text.len() - second)
        .take_while(|step| equal(&text[first + step], &text[second + step]))
        .count()
        // Places in a row of equal lines end where the other begins.
        .min(second - first);
    (!goes_on && length >= WINDOW).then_some(Clone { first, second, length })
}

fn equal(one: &Option<Counted>, other: &Option<Counted>) -> bool {
    matches!((one, other), (Some(one), Some(other)) if one.text == other.text)
}

/// Hash of lines that go on from each other.
fn hash(lines: &[Option<Counted>]) -> Option<u64> {
    let mut hasher = DefaultHasher::new();
    for line in lines {
        line.as_ref()?.text.hash(&mut hasher);
    }
    Some(hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    fn function(name: &str, lines: usize) -> String {
        let body: String = (0..lines).map(|line| format!("    step({line});\n\n")).collect();
        format!("use a::{name};\n/// {name}.\nfn {name}() {{\n{body}}}\n")
    }

    #[test]
    fn equal_runs_are_found_once_and_their_lines_counted() {
        let files = [("src/a.rs", function("one", 8)), ("src/b.rs", function("two", 8))];
        let files: Vec<(&str, &str)> = files.iter().map(|(p, t)| (*p, t.as_str())).collect();
        let small = [member(&files)];
        // Eight steps and a closing brace.
        assert_eq!(count(&small).1, Clones { pairs: 1, lines: 18 });
        assert_eq!(listed(&small), "   9 crates/small/src/a.rs:4 crates/small/src/b.rs:4\n");
    }

    #[test]
    fn five_equal_lines_are_none_nor_are_tests() {
        let five = function("one", 4) + &function("two", 4);
        assert_eq!(count(&[member(&[("src/lib.rs", &five)])]).1, Clones::default());
        let tests = format!("#[cfg(test)]\nmod t {{\n{}}}\n", function("one", 9));
        let files = [("src/a.rs", tests.as_str()), ("src/b.rs", tests.as_str())];
        assert_eq!(count(&[member(&files)]).1, Clones::default());
    }

    #[test]
    fn a_row_of_equal_lines_does_not_overlap_itself() {
        let text = format!("fn f() {{\n{}}}\n", "    g();\n".repeat(12));
        assert_eq!(count(&[member(&[("src/lib.rs", &text)])]).1, Clones { pairs: 1, lines: 12 });
    }
}
