//! The form of the code: counts of each crate, and the places that they count.

use crate::imports::{self, Layers};
use crate::source::Source;
use crate::workspace;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

/// Counts of each crate, by the key of the figure.
pub(crate) type Counts = BTreeMap<String, BTreeMap<String, u64>>;

/// What is known of a workspace.
pub(crate) struct Tree {
    pub(crate) counts: Counts,
    /// Places that a figure counts, by its key.
    pub(crate) places: BTreeMap<&'static str, Vec<String>>,
}

/// Figures in the order of the table.
const FIGURES: [&str; 10] = [
    "code",
    "tests",
    "tuple_lets",
    "named_closures",
    "bool_matches",
    "reasons",
    "many_parameters",
    "long_functions",
    "arrows_back_up",
    "circles",
];

/// Figures that the table shows per 1,000 lines of code.
const RATES: [&str; 4] = ["tuple_lets", "named_closures", "bool_matches", "reasons"];

const LEGEND: &str = "
code, tests: lines that are neither blank nor comments; tests include benchmarks and examples, all else leaves them out.
tuple_lets: `let (a, b) = (x, y)` of unlike things: their names differ in more than words such as low and high.
named_closures: `let f = |x| ...`; bool_matches: `match` with an arm `true` or `false`.
reasons: comments (no documentation) with a word such as because, so, otherwise, would; /k: per 1,000 lines of code.
many_parameters: functions with more than five, the receiver included; long_functions: over 40 lines of code.
arrows_back_up: imports from a lower layer to a higher one (xtask/layers.toml); circles: files that import each other.
";

/// Reads a workspace and counts.
pub(crate) fn of(root: &Path) -> Result<Tree, String> {
    let layers = imports::read_layers(root)?;
    let mut tree = Tree { counts: Counts::new(), places: BTreeMap::new() };
    for package in workspace::read(root)? {
        let sources = package.sources()?;
        let mut counts = BTreeMap::from(FIGURES.map(|figure| (figure.to_string(), 0)));
        for source in &sources {
            *counts.entry("code".to_string()).or_default() += source.code_lines;
            *counts.entry("tests".to_string()).or_default() += source.test_lines;
        }
        for (figure, place) in places_of(&sources, layers.get(package.name())) {
            *counts.entry(figure.to_string()).or_default() += 1;
            tree.places.entry(figure).or_default().push(place);
        }
        tree.counts.insert(package.name().to_string(), counts);
    }
    Ok(tree)
}

fn places_of(sources: &[Source], layers: Option<&Layers>) -> Vec<(&'static str, String)> {
    let mut places = Vec::new();
    for source in sources {
        let path = source.path.display();
        places.extend(source.findings.iter().map(|(key, line)| (*key, format!("{path}:{line}"))));
    }
    let imports = imports::of(sources);
    let circles = imports::circles(sources, &imports);
    places.extend(circles.into_iter().map(|circle| ("circles", circle)));
    if let Some(layers) = layers {
        let arrows = imports::arrows_back_up(sources, &imports, layers);
        places.extend(arrows.into_iter().map(|arrow| ("arrows_back_up", arrow)));
    }
    places
}

/// Refuses words that are no figure.
pub(crate) fn check_figure(figure: &str) -> Result<(), String> {
    if FIGURES.contains(&figure) {
        Ok(())
    } else {
        Err(format!("no figure `{figure}`; there are: {}", FIGURES.join(", ")))
    }
}

/// Returns the places that a figure counts, one a line.
pub(crate) fn places(tree: &Tree, figure: &str) -> String {
    let places = tree.places.get(figure);
    places.into_iter().flatten().map(|place| format!("{place}\n")).collect()
}

pub(crate) fn json(counts: &Counts) -> String {
    format!("{:#}\n", serde_json::json!(counts))
}

/// Reads the output of [`json()`].
pub(crate) fn read(path: &Path) -> Result<Counts, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_str(&text)
        .map_err(|e| format!("{}: {e}; expected what `shape --json` prints", path.display()))
}

/// Returns a table with a line for each crate and one for all; with earlier counts, `before->now` where they differ.
pub(crate) fn table(before: Option<&Counts>, now: &Counts) -> String {
    let mut names: BTreeSet<&str> = now.keys().map(String::as_str).collect();
    names.extend(before.into_iter().flat_map(|before| before.keys()).map(String::as_str));
    let mut rows = vec![vec!["crate".to_string()]];
    rows[0].extend(FIGURES.map(|figure| {
        if RATES.contains(&figure) { format!("{figure}/k") } else { figure.to_string() }
    }));
    for name in names.into_iter().map(Some).chain([None]) {
        let mut row = vec![name.unwrap_or("total").to_string()];
        for figure in FIGURES {
            let now = value(now, name, figure);
            let before = before.map(|before| value(before, name, figure));
            row.push(match before {
                Some(before) if before != now => format!("{before}->{now}"),
                _ => now,
            });
        }
        rows.push(row);
    }
    aligned(&rows) + LEGEND
}

/// Returns a figure of one crate, or of all without a name; a dash where there is none.
fn value(counts: &Counts, name: Option<&str>, figure: &str) -> String {
    let mut count = None;
    let mut code = 0;
    for (_, counts) in counts.iter().filter(|(other, _)| name.is_none_or(|name| name == *other)) {
        count = Some(count.unwrap_or(0) + counts.get(figure).unwrap_or(&0));
        code += counts["code"];
    }
    match count {
        Some(count) if RATES.contains(&figure) => {
            format!("{:.1}", 1000.0 * count as f64 / code.max(1) as f64)
        }
        Some(count) => count.to_string(),
        None => "-".to_string(),
    }
}

/// Returns rows with columns of one width each: the first to the left, others to the right.
fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows[0].len();
    let width = |column: usize| rows.iter().map(|row| row[column].len()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let _ = write!(text, "{:width$}", row[0], width = widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            let _ = write!(text, "  {cell:>width$}");
        }
        text.push('\n');
    }
    text
}
