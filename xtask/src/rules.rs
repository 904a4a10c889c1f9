//! Rules of the house that cargo cannot enforce: permitted names and dependencies, and no circles of imports.
//!
//! Crates are known by their folders; a rule about one that is not there holds by itself.

use std::collections::BTreeSet;
use std::path::{Component, Path};

use toml::{Table, Value};

use crate::arguments;
use crate::measures::{circles, functions};
use crate::members::{self, Member};
use crate::paths;
use crate::source::{self, Role};
use crate::test::misnamed_programs;

/// Circles that are known, in the format of `cargo xtask shape --circles`.
const KNOWN: &str = include_str!("../circles.txt");

/// Folders of code that may name threads; tests may too.
const THREADS: [&str; 5] =
    ["crates/kernel", "crates/session", "crates/server", "crates/link", "crates/cli"];

/// Packages that only some crates may depend on, with the folders of those crates.
const RESERVED: [(&str, &[&str]); 9] = [
    ("parquet", &["crates/record"]),
    ("mcap", &["crates/record", "crates/import"]),
    ("foxglove", &["crates/record"]),
    ("arrow-array", &["python"]),
    ("clap", &["crates/cli"]),
    ("pyo3", &["python"]),
    ("axum", &["crates/server"]),
    // The session names it for its features alone, so that all share the compiled crate.
    ("tokio", &["crates/server", "crates/session"]),
    ("zenoh", &["crates/link"]),
];

/// Folder of the crates of worlds.
const WORLDS: &str = "crates/worlds";

/// Crates that know no world, not even through another crate.
const WITHOUT_WORLDS: [&str; 18] = [
    "crates/document",
    "crates/kernel",
    "crates/record",
    "crates/draw",
    "crates/report",
    "crates/scenario",
    "crates/import",
    "crates/statistics",
    "crates/collectives",
    "crates/rods",
    "crates/arms",
    "crates/map",
    "crates/error-models",
    "crates/learn",
    "crates/exact",
    "crates/experiment",
    "crates/session",
    "crates/server",
];

/// Crates among them that take the list of worlds as an argument: their tests hand worlds over.
const TESTED_WITH_WORLDS: [&str; 3] = ["crates/experiment", "crates/session", "crates/server"];

/// Kinds of dependencies that get into the built programs.
const BUILT: [&str; 2] = ["dependencies", "build-dependencies"];
const ALL: [&str; 3] = ["dependencies", "build-dependencies", "dev-dependencies"];

fn is(member: &Member, folder: &str) -> bool {
    member.folder == Path::new(folder)
}

fn is_world(member: &Member) -> bool {
    member.folder.starts_with(WORLDS)
}

/// Names of the packages that a crate depends on itself, for one target or for all.
fn dependencies(member: &Member, kinds: &[&str]) -> BTreeSet<String> {
    let targets = member.manifest.get("target").and_then(Value::as_table);
    let tables = targets.into_iter().flat_map(Table::values).filter_map(Value::as_table);
    let mut names = BTreeSet::new();
    for table in tables.chain([&member.manifest]) {
        for entries in kinds.iter().filter_map(|kind| table.get(*kind)?.as_table()) {
            for (name, details) in entries {
                let package = details.get("package").and_then(Value::as_str);
                names.insert(package.unwrap_or(name).to_string());
            }
        }
    }
    names
}

/// Returns the members that `start` depends on, through others too.
fn needed<'a>(members: &'a [Member], start: &Member) -> Vec<&'a Member> {
    let mut found: Vec<&Member> = Vec::new();
    let mut open = dependencies(start, &BUILT);
    while let Some(name) = open.pop_first() {
        let new =
            |member: &&Member| member.name == name && !found.iter().any(|known| known.name == name);
        if let Some(member) = members.iter().find(new) {
            found.push(member);
            open.extend(dependencies(member, &BUILT));
        }
    }
    found
}

/// Returns the crates that depend on a package reserved for others.
fn trespassers(members: &[Member]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (package, folders) in RESERVED {
        let others = members.iter().filter(|member| !folders.iter().any(|own| is(member, own)));
        for member in others.filter(|member| dependencies(member, &ALL).contains(package)) {
            let may = folders.join(" and ");
            wrong.push(format!("{} depends on {package}: only {may} may", member.name));
        }
    }
    wrong
}

/// Returns worlds that depend on another, and crates that depend on a world and may not.
fn knows_worlds(members: &[Member]) -> Vec<String> {
    let mut wrong = Vec::new();
    for member in members {
        let may_not = is_world(member) || WITHOUT_WORLDS.iter().any(|folder| is(member, folder));
        let has_tests = TESTED_WITH_WORLDS.iter().any(|folder| is(member, folder));
        let direct = dependencies(member, if has_tests { &BUILT } else { &ALL });
        let indirect = needed(members, member);
        let worlds = members.iter().filter(|other| is_world(other) && other.name != member.name);
        for world in worlds.filter(|_| may_not) {
            if direct.contains(&world.name) || indirect.iter().any(|n| n.name == world.name) {
                wrong.push(format!("{} depends on the world {}", member.name, world.name));
            }
        }
    }
    wrong
}

/// Returns where code names threads and may not. Sleeping starts no thread.
fn threads(members: &[Member]) -> Vec<String> {
    let may_not = |member: &&Member| !THREADS.iter().any(|folder| is(member, folder));
    let mut wrong = Vec::new();
    for member in members.iter().filter(may_not) {
        for source in functions::code(member) {
            let is_thread = |path: &[String]| {
                path.starts_with(&std_thread()) && path.last().is_none_or(|last| last != "sleep")
            };
            if paths::of(&source.items).iter().any(|named| is_thread(&named.path)) {
                let path = member.folder.join(&source.path);
                wrong.push(format!("{} names std::thread", path.display()));
            }
        }
    }
    wrong
}

/// Returns where a file outside of its crate's folder is compiled in: a package has no such file.
fn reaches_out(members: &[Member]) -> Vec<String> {
    let mut wrong = Vec::new();
    for member in members {
        for source in member.sources.iter().filter(|source| source.role == Role::Code) {
            let folder = source.path.parent().unwrap_or(Path::new(""));
            for line in source.lines.iter().filter(|line| !line.is_test) {
                for file in compiled_in(&line.text).filter(|file| !lies_within(folder, file)) {
                    let path = member.folder.join(&source.path);
                    wrong.push(format!("{} compiles in {file}: not in the crate", path.display()));
                }
            }
        }
    }
    wrong
}

/// Returns the files that `include_str!` and `include_bytes!` name on a line.
fn compiled_in(line: &str) -> impl Iterator<Item = &str> {
    let named = ["include_str!(\"", "include_bytes!(\""];
    let rests = named.into_iter().flat_map(|start| line.split(start).skip(1));
    rests.filter_map(|rest| rest.split('"').next())
}

/// Returns whether a path beside a folder of the crate stays within the crate.
fn lies_within(folder: &Path, file: &str) -> bool {
    let mut depth = folder.components().count();
    Path::new(file).components().all(|part| match part {
        Component::ParentDir => depth.checked_sub(1).inspect(|above| depth = *above).is_some(),
        Component::Normal(_) => {
            depth += 1;
            true
        }
        _ => true,
    })
}

/// Words with which no documentation begins: they make a clause without a head.
const HEADLESS: [&str; 13] = [
    "What", "Who", "Whom", "Whose", "Where", "Which", "How", "Why", "When", "That", "If", "As",
    "Of",
];

/// Folders of the page and of the Python package.
const OTHER_LANGUAGES: [&str; 6] = [
    "studio/src",
    "studio/tests",
    "python/sidestep",
    "python/tests",
    "python/examples",
    "python/benches",
];

/// Endings of the names of their sources.
const ENDINGS: [&str; 4] = ["ts", "svelte", "py", "pyi"];

/// Returns documentation that begins with a clause without a head, in place of a noun phrase or a verb.
fn headless(members: &[Member]) -> Vec<String> {
    let mut wrong = Vec::new();
    for member in members {
        for source in &member.sources {
            let lines: Vec<&str> = source.lines.iter().map(|line| line.text.as_str()).collect();
            wrong.extend(headless_lines(&member.folder.join(&source.path), &lines));
        }
    }
    wrong
}

/// Returns the same of sources in other languages, below the root of the repository.
fn headless_elsewhere(root: &Path) -> Vec<String> {
    let mut paths = Vec::new();
    for folder in OTHER_LANGUAGES {
        source::collect(&root.join(folder), &ENDINGS, &mut paths).unwrap();
    }
    paths.sort();
    let wrong = paths.iter().flat_map(|path| {
        let text = std::fs::read_to_string(path).unwrap();
        headless_lines(path.strip_prefix(root).unwrap_or(path), &Vec::from_iter(text.lines()))
    });
    wrong.collect()
}

/// Returns such documentation of one file.
fn headless_lines(path: &Path, lines: &[&str]) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut is_inside = false;
    for (number, line) in (1..).zip(lines) {
        let documented = documentation(line);
        let begins = documented.filter(|_| !is_inside);
        is_inside = documented.is_some() && goes_on(line.trim());
        let word = begins.and_then(|words| words.split_whitespace().next());
        if word.is_some_and(|word| HEADLESS.contains(&word)) {
            wrong.push(format!("{}:{number} begins with a clause without a head", path.display()));
        }
    }
    wrong
}

/// Returns whether the next line of documentation would go on with this one. The page's comments may open with a line
/// that has no words yet, and end where they began, as may strings of Python.
fn goes_on(line: &str) -> bool {
    line != "/**" && !line.ends_with("*/") && !line.starts_with("\"\"\"")
}

/// Returns the words of a line of documentation, in any of our languages.
fn documentation(line: &str) -> Option<&str> {
    let line = line.trim_start();
    ["///", "//!", "/**", "* ", "\"\"\"", "#:"].iter().find_map(|start| line.strip_prefix(start))
}

fn std_thread() -> [String; 2] {
    ["std", "thread"].map(String::from)
}

/// Parts of a list of circles: the name of the crate, then a line for each file.
fn circles_of(text: &str) -> BTreeSet<&str> {
    let text = text.split("\n\n").map(str::trim);
    text.filter(|circle| circle.starts_with('[')).collect()
}

/// Returns the differences between the circles that are there and those that are known.
fn differing(found: &str, known: &str) -> Vec<String> {
    let (found, known) = (circles_of(found), circles_of(known));
    let new = found.difference(&known).map(|circle| {
        format!("a new circle of imports: move what both need to a file of its own\n{circle}\n")
    });
    let gone = known.difference(&found).map(|circle| {
        format!("a circle is gone: well done, take it from xtask/circles.txt\n{circle}\n")
    });
    new.chain(gone).collect()
}

/// All rules in one test, because reading the sources takes longer than the rules.
#[test]
fn the_rules_of_the_house_hold() {
    let members = members::read(&arguments::house()).unwrap();
    let wrong = [
        trespassers(&members),
        knows_worlds(&members),
        threads(&members),
        reaches_out(&members),
        headless(&members),
        headless_elsewhere(&arguments::house()),
        misnamed_programs(&members),
        differing(&circles::listed(&members), KNOWN),
    ]
    .concat();
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

mod small {
    use super::*;
    use crate::measures::functions::testing;

    fn member(folder: &str, manifest: &str, text: &str) -> Member {
        let name = folder.rsplit('/').next().unwrap().to_string();
        let manifest = manifest.parse().unwrap();
        Member { name, folder: folder.into(), manifest, ..testing::member(&[("src/lib.rs", text)]) }
    }

    #[test]
    fn reserved_packages_are_found_by_any_name() {
        let renamed = "[target.'cfg(unix)'.dev-dependencies]\nrows = { package = 'parquet' }";
        let members = [
            member("crates/record", "[dependencies]\nparquet.workspace = true", ""),
            member("crates/cli", "[dependencies]\nclap = '4'", ""),
            member("crates/draw", renamed, ""),
        ];
        assert_eq!(trespassers(&members), ["draw depends on parquet: only crates/record may"]);
    }

    #[test]
    fn worlds_are_found_through_other_crates() {
        let members = [
            member("crates/worlds/robots", "[dependencies]\nkernel = {}", ""),
            member("crates/worlds/chain", "[dev-dependencies]\nrobots = {}", ""),
            member("crates/facade", "[dependencies]\nrobots = {}", ""),
            member("crates/report", "[dependencies]\nfacade = {}", ""),
            member("crates/session", "[dev-dependencies]\nrobots = {}", ""),
            member("crates/server", "[dependencies]\nfacade = {}", ""),
            member("crates/kernel", "", ""),
        ];
        assert_eq!(
            knows_worlds(&members),
            [
                "chain depends on the world robots",
                "report depends on the world robots",
                "server depends on the world robots"
            ]
        );
    }

    #[test]
    fn threads_are_found_in_imports_and_in_code_but_not_in_tests() {
        let tests = "#[cfg(test)] mod tests { use std::thread; }";
        let members = [
            member("crates/a", "", "use std::{fmt, thread::{self, scope}};"),
            member("crates/b", "", "fn f() { std::thread::yield_now() }"),
            member("crates/c", "", tests),
            member("crates/d", "", "fn f() { std::thread::sleep(LONG) }"),
            member("crates/kernel", "", "use std::thread;"),
        ];
        assert_eq!(
            threads(&members),
            ["crates/a/src/lib.rs names std::thread", "crates/b/src/lib.rs names std::thread"]
        );
    }

    #[test]
    fn files_outside_of_the_package_are_found_and_those_within_are_not() {
        let text = "const A: &str = include_str!(\"../README.md\");\n\
                    const B: &[u8] = include_bytes!(\"../../maps/a.png\");";
        assert_eq!(
            reaches_out(&[member("crates/a", "", text)]),
            ["crates/a/src/lib.rs compiles in ../../maps/a.png: not in the crate"]
        );
    }

    #[test]
    fn documentation_begins_with_no_clause_without_a_head_but_may_go_on_with_one() {
        let text = "//! What it is.\n\n/// Whether it is.\n/// What it may be.\nfn f() {}\n\n    /// Who asks.\nfn g() {}";
        let wrong = headless(&[member("crates/a", "", text)]);
        let at =
            |line: usize| format!("crates/a/src/lib.rs:{line} begins with a clause without a head");
        assert_eq!(wrong, [at(1), at(7)]);
    }

    #[test]
    fn the_same_holds_for_documentation_in_other_languages() {
        let text = "/** Whether it is. */\n/** How it is. */\n/**\n * Where it is.\n * What else.\n */\n/**\n * A thing.\n */";
        let wrong = headless_lines(Path::new("a.ts"), &Vec::from_iter(text.lines()));
        let at = |line: usize| format!("a.ts:{line} begins with a clause without a head");
        assert_eq!(wrong, [at(2), at(4)]);
        let text = "\"\"\"What it is.\"\"\"\n#: A number.\n#: What counts.\n\n#: Why it is so.\n";
        let wrong = headless_lines(Path::new("a.ts"), &Vec::from_iter(text.lines()));
        assert_eq!(wrong, [at(1), at(5)]);
    }

    #[test]
    fn circles_must_be_listed_and_listed_ones_must_be_there() {
        let known = "# Comment.\n\n[a]\nsrc/b.rs\nsrc/c.rs\n\n[a]\nsrc/d.rs\nsrc/e.rs\n";
        assert_eq!(differing(known, known), Vec::<String>::new());
        let wrong =
            differing("[a]\nsrc/b.rs\nsrc/c.rs\nsrc/f.rs\n\n[a]\nsrc/d.rs\nsrc/e.rs\n\n", known);
        assert_eq!(wrong.len(), 2);
        assert!(wrong[0].starts_with("a new circle") && wrong[0].contains("src/f.rs"));
        assert!(wrong[1].starts_with("a circle is gone"));
    }
}
