//! All measures of all crates, and the figures that a table shows of them.

use std::ops::AddAssign;

use crate::measures::{circles, clones, comments, functions, long, public, size, tuples};
use crate::members::Member;

/// Counts of one crate, or of all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Counts {
    code: u64,
    tests: u64,
    benches: u64,
    examples: u64,
    public: u64,
    files: u64,
    circle_files: u64,
    circles: u64,
    long: u64,
    tuple_parameters: u64,
    tuple_functions: u64,
    clone_pairs: u64,
    clone_lines: u64,
    comments: u64,
}

impl AddAssign<&Counts> for Counts {
    fn add_assign(&mut self, other: &Counts) {
        self.code += other.code;
        self.tests += other.tests;
        self.benches += other.benches;
        self.examples += other.examples;
        self.public += other.public;
        self.files += other.files;
        self.circle_files += other.circle_files;
        self.circles += other.circles;
        self.long += other.long;
        self.tuple_parameters += other.tuple_parameters;
        self.tuple_functions += other.tuple_functions;
        self.clone_pairs += other.clone_pairs;
        self.clone_lines += other.clone_lines;
        self.comments += other.comments;
    }
}

/// The formula of a figure from the counts.
enum Value {
    Whole(fn(&Counts) -> u64),
    /// One count over another; none where the other is zero.
    Ratio(fn(&Counts) -> (u64, u64)),
}

/// One column of the table.
pub(crate) struct Figure {
    /// Name in JSON.
    pub(crate) key: &'static str,
    /// Name in a table.
    pub(crate) heading: &'static str,
    pub(crate) decimals: usize,
    value: Value,
}

/// Figures in the order of a table.
pub(crate) const FIGURES: [Figure; 15] = [
    whole("code", "code", |c| c.code),
    whole("tests", "tests", |c| c.tests),
    whole("benches", "benches", |c| c.benches),
    whole("examples", "examples", |c| c.examples),
    whole("files", "files", |c| c.files),
    whole("public", "pub", |c| c.public),
    ratio("public_per_1000", "pub/1000", 1, |c| (1000 * c.public, c.code)),
    whole("circle_files", "circling", |c| c.circle_files),
    whole("circles", "circles", |c| c.circles),
    whole("long", "fn>40", |c| c.long),
    whole("tuple_parameters", "tuples", |c| c.tuple_parameters),
    whole("tuple_functions", "fn(tuple)", |c| c.tuple_functions),
    whole("clone_pairs", "clones", |c| c.clone_pairs),
    whole("clone_lines", "cloned", |c| c.clone_lines),
    ratio("comments_per_line", "why/code", 4, |c| (c.comments, c.code)),
];

const fn whole(key: &'static str, heading: &'static str, value: fn(&Counts) -> u64) -> Figure {
    Figure { key, heading, decimals: 0, value: Value::Whole(value) }
}

const fn ratio(
    key: &'static str,
    heading: &'static str,
    decimals: usize,
    value: fn(&Counts) -> (u64, u64),
) -> Figure {
    Figure { key, heading, decimals, value: Value::Ratio(value) }
}

impl Figure {
    fn of(&self, counts: &Counts) -> Option<f64> {
        match self.value {
            Value::Whole(value) => Some(value(counts) as f64),
            Value::Ratio(value) => {
                let (part, whole) = value(counts);
                (whole > 0).then(|| part as f64 / whole as f64)
            }
        }
    }
}

/// Figures of one crate or of all, in the order of [`FIGURES`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) values: Vec<Option<f64>>,
}

/// Name of the row of all crates.
pub(crate) const TOTAL: &str = "total";

/// Counts every crate, and all of them as the last.
pub(crate) fn of(members: &[Member]) -> Vec<(String, Counts)> {
    let (clones, all_clones) = clones::count(members);
    let mut total = Counts::default();
    let mut counted = Vec::new();
    for (member, clones) in members.iter().zip(clones) {
        let counts =
            Counts { clone_pairs: clones.pairs, clone_lines: clones.lines, ..of_one(member) };
        total += &counts;
        counted.push((member.name.clone(), counts));
    }
    // A pair between two crates counts in both, and once in all.
    total.clone_pairs = all_clones.pairs;
    counted.push((TOTAL.to_string(), total));
    counted
}

/// Counts one crate, clones aside.
fn of_one(member: &Member) -> Counts {
    let size = size::count(member);
    let (circle_files, circles) = circles::count(member);
    let (tuple_parameters, tuple_functions) = tuples::count(member);
    Counts {
        code: size.code,
        tests: size.tests,
        benches: size.benches,
        examples: size.examples,
        public: public::count(member),
        files: functions::code(member).count() as u64,
        circle_files,
        circles,
        long: long::count(member),
        tuple_parameters,
        tuple_functions,
        comments: comments::count(member),
        ..Counts::default()
    }
}

/// Returns the figures of the counts.
pub(crate) fn figures(counted: &[(String, Counts)]) -> Vec<Row> {
    let row = |(name, counts): &(String, Counts)| Row {
        name: name.clone(),
        values: FIGURES.iter().map(|figure| figure.of(counts)).collect(),
    };
    counted.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::functions::testing::member;

    #[test]
    fn crates_add_up_and_a_pair_between_two_counts_once() {
        let lines: String = (0..7).map(|line| format!("    f({line});\n")).collect();
        let text = format!("pub fn a() {{\n    // why\n{lines}}}\n");
        let library = || member(&[("src/lib.rs", text.as_str())]);
        let command = member(&[("src/main.rs", text.as_str())]);
        let rows = figures(&of(&[library(), command]));
        let value = |row: usize, key: &str| {
            rows[row].values[FIGURES.iter().position(|figure| figure.key == key).unwrap()]
        };
        assert_eq!(rows[2].name, TOTAL);
        assert_eq!((value(0, "code"), value(2, "code")), (Some(9.0), Some(18.0)));
        assert_eq!((value(0, "clone_pairs"), value(2, "clone_pairs")), (Some(1.0), Some(1.0)));
        assert_eq!((value(0, "clone_lines"), value(2, "clone_lines")), (Some(9.0), Some(18.0)));
        assert_eq!((value(1, "public_per_1000"), value(1, "public")), (Some(0.0), Some(0.0)));
        assert_eq!(value(2, "public_per_1000"), Some(1000.0 / 18.0));
        assert_eq!(value(2, "comments_per_line"), Some(2.0 / 18.0));
    }
}
