//! Circles of imports: files of a crate that need each other, parents and their modules aside.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::members::Member;
use crate::paths::{self, Named};
use crate::source::{Place, Source};

/// Files that need each other, sorted, as paths relative to the folder of the crate.
pub(crate) type Circle = Vec<PathBuf>;

/// First lines of `xtask/circles.txt`.
pub(crate) const HEADER: &str = "\
# Circles of imports that are left: break them, add none. The test in xtask/src/rules.rs fails when one
# appears and when one is gone. `cargo xtask shape --circles` prints this file.

";

/// The number of imports that are followed to where an item is declared; a circle of them has no end.
const DETOURS: usize = 16;

/// Returns the circles of a crate: the strongly connected components of more than one file.
pub(crate) fn of(member: &Member) -> Vec<Circle> {
    let mut roots: Vec<&Path> = placed(member).map(|(_, place)| place.root.as_path()).collect();
    roots.sort();
    roots.dedup();
    roots.into_iter().flat_map(|root| components(&Graph::new(member, root).edges())).collect()
}

/// Number of files in circles, and of circles.
pub(crate) fn count(member: &Member) -> (u64, u64) {
    let circles = of(member);
    (circles.iter().map(Vec::len).sum::<usize>() as u64, circles.len() as u64)
}

/// Lists all circles as `xtask/circles.txt` does.
pub(crate) fn listed(members: &[Member]) -> String {
    let mut text = String::new();
    for member in members {
        for circle in of(member) {
            let _ = writeln!(text, "[{}]", member.name);
            for path in circle {
                let _ = writeln!(text, "{}", path.display());
            }
            text.push('\n');
        }
    }
    text
}

fn placed(member: &Member) -> impl Iterator<Item = (&Source, &Place)> {
    member.sources.iter().filter_map(|source| Some((source, source.module.as_ref()?)))
}

/// Modules of one root, by their names, and their imports.
struct Graph<'a> {
    /// File of every module, inline modules included.
    files: HashMap<Vec<String>, &'a Path>,
    /// The path that each name stands for, by module and name.
    imports: HashMap<(Vec<String>, String), Vec<String>>,
    /// Every path that a file names, with the module that names it.
    named: Vec<(&'a Place, &'a Path, Vec<Named>)>,
}

impl<'a> Graph<'a> {
    fn new(member: &'a Member, root: &Path) -> Graph<'a> {
        let mut graph = Graph { files: HashMap::new(), imports: HashMap::new(), named: Vec::new() };
        for (source, place) in placed(member).filter(|(_, place)| place.root == root) {
            graph.files.insert(place.names.clone(), &source.path);
            graph.named.push((place, &source.path, paths::of(&source.items)));
        }
        for (place, path, named) in &graph.named {
            for name in named {
                let module = [&place.names[..], &name.within].concat();
                graph.files.entry(module.clone()).or_insert(path);
                if let Some(import) = &name.import {
                    graph.imports.insert((module, import.clone()), name.path.clone());
                }
            }
        }
        graph
    }

    /// Returns which file names which others, its own modules and those it lies in aside.
    fn edges(&self) -> BTreeMap<&'a Path, BTreeSet<&'a Path>> {
        let places: HashMap<&Path, &Place> =
            self.named.iter().map(|(place, path, _)| (*path, *place)).collect();
        let mut edges: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
        for (place, path, named) in &self.named {
            let targets = named.iter().filter_map(|name| {
                let module = [&place.names[..], &name.within].concat();
                self.declaring(&module, &name.path, DETOURS)
            });
            let others = targets.filter(|target| {
                let other = &places[target].names;
                !other.starts_with(&place.names) && !place.names.starts_with(other)
            });
            edges.entry(path).or_default().extend(others);
        }
        edges
    }

    /// Returns the file that declares the item a path names, seen from `module`; none if it is foreign.
    fn declaring(&self, module: &[String], path: &[String], detours: usize) -> Option<&'a Path> {
        let mut here = match path.first()?.as_str() {
            "crate" => Vec::new(),
            "self" => module.to_vec(),
            "super" => module[..module.len().checked_sub(1)?].to_vec(),
            child => [module, &[child.to_string()]].concat(),
        };
        self.files.get(&here)?;
        for name in &path[1..] {
            if name == "super" {
                here.pop();
                continue;
            }
            let inner = [&here[..], std::slice::from_ref(name)].concat();
            if self.files.contains_key(&inner) {
                here = inner;
                continue;
            }
            let import = self.imports.get(&(here.clone(), name.clone()));
            if let Some(import) = import.filter(|_| detours > 0)
                && let Some(file) = self.declaring(&here, import, detours - 1)
            {
                return Some(file);
            }
            break;
        }
        self.files.get(&here).copied()
    }
}

/// Returns the strongly connected components of more than one node, sorted.
fn components<'a>(edges: &BTreeMap<&'a Path, BTreeSet<&'a Path>>) -> Vec<Circle> {
    let reached: BTreeMap<&Path, BTreeSet<&Path>> =
        edges.keys().map(|start| (*start, reachable(start, edges))).collect();
    let mut circles = BTreeSet::new();
    for (node, from_here) in &reached {
        let circle: Circle = from_here
            .iter()
            .filter(|other| reached.get(**other).is_some_and(|back| back.contains(node)))
            .map(|path| path.to_path_buf())
            .collect();
        if circle.len() > 1 {
            circles.insert(circle);
        }
    }
    circles.into_iter().collect()
}

/// Returns all nodes that edges lead to from `start`.
fn reachable<'a>(
    start: &'a Path,
    edges: &BTreeMap<&'a Path, BTreeSet<&'a Path>>,
) -> BTreeSet<&'a Path> {
    let mut reached = BTreeSet::new();
    let mut open = vec![start];
    while let Some(node) = open.pop() {
        for next in edges.get(node).into_iter().flatten() {
            if reached.insert(*next) {
                open.push(next);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    #[test]
    fn files_that_import_each_other_are_a_circle() {
        let small = member(&[
            ("src/lib.rs", "mod a; mod b; mod c;"),
            ("src/a.rs", "use crate::b::B;"),
            ("src/b.rs", "use super::{a::A, c::C};"),
            ("src/c.rs", "use std::fmt;"),
        ]);
        assert_eq!(count(&small), (2, 1));
        assert_eq!(listed(&[small]), "[small]\nsrc/a.rs\nsrc/b.rs\n\n");
    }

    #[test]
    fn parents_and_their_modules_may_need_each_other() {
        let small = member(&[
            ("src/lib.rs", "mod a;"),
            ("src/a.rs", "mod b; use b::B;"),
            ("src/a/b.rs", "use super::A; use crate::Root;"),
        ]);
        assert_eq!(count(&small), (0, 0));
    }

    #[test]
    fn imports_are_followed_and_paths_in_code_count() {
        let small = member(&[
            ("src/lib.rs", "mod a; mod b;"),
            ("src/a.rs", "mod inner; pub(crate) use inner::Thing as T;"),
            ("src/a/inner.rs", "fn f() { crate::b::g() }"),
            ("src/b.rs", "use crate::a::T;"),
        ]);
        assert_eq!(listed(&[small]), "[small]\nsrc/a/inner.rs\nsrc/b.rs\n\n");
    }

    #[test]
    fn tests_may_import_what_they_like() {
        let small = member(&[
            ("src/lib.rs", "mod a; mod b;"),
            ("src/a.rs", "#[cfg(test)] mod tests { use crate::b::B; }"),
            ("src/b.rs", "use crate::a::A;"),
        ]);
        assert_eq!(count(&small), (0, 0));
    }
}
