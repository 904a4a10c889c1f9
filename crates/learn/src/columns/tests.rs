//! Promise: columns give the same report and the same profile as a CSV file of the same rows, to the bit.

use super::*;
use crate::effector::{self, EffectorOptions};
use crate::profile;
use crate::sensor::{self, SensorOptions};
use sidestep_import::table::CsvTable;
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};

/// A table of reals, integers and words as columns, and as the text of a CSV file.
struct Both {
    columns: Vec<(String, ColumnCells)>,
    texts: Vec<Vec<String>>,
}

impl Both {
    fn new() -> Self {
        Self { columns: Vec::new(), texts: Vec::new() }
    }

    fn add(mut self, name: &str, cells: ColumnCells, texts: Vec<String>) -> Self {
        self.columns.push((name.to_string(), cells));
        self.texts.push(texts);
        self
    }

    fn reals(self, name: &str, values: Vec<f64>) -> Self {
        let text = |value: &f64| if value.is_nan() { String::new() } else { format!("{value:?}") };
        let texts = values.iter().map(text).collect();
        self.add(name, ColumnCells::Reals(Box::new(values)), texts)
    }

    fn integers(self, name: &str, values: Vec<f64>) -> Self {
        let text = |value: &f64| if value.is_nan() { String::new() } else { format!("{value}") };
        let texts = values.iter().map(text).collect();
        self.add(name, ColumnCells::Integers(Box::new(values)), texts)
    }

    fn words(self, name: &str, values: Vec<&str>) -> Self {
        let mut words = Words::default();
        values.iter().for_each(|word| words.push(Some(word)));
        let texts = values.into_iter().map(String::from).collect();
        self.add(name, ColumnCells::Words(words), texts)
    }

    fn csv(&self) -> CsvTable {
        let names: Vec<&str> = self.columns.iter().map(|(name, _)| name.as_str()).collect();
        let mut text = names.join(",");
        for row in 0..self.texts[0].len() {
            let cells: Vec<&str> = self.texts.iter().map(|column| column[row].as_str()).collect();
            text += &format!("\n{}", cells.join(","));
        }
        CsvTable::parse(&"log", &text).unwrap()
    }

    fn table(self) -> ColumnTable {
        ColumnTable::new("log", self.columns).unwrap()
    }
}

/// Random numbers from 0 to 1, the same ones each time.
fn shares(purpose: u16, n: usize) -> Vec<f64> {
    let streams = Streams::new(Seed(7));
    let word = |k: usize| streams.block(k as u32, 1, Purpose(1), purpose)[0];
    (0..n).map(|k| f64::from(word(k)) / f64::from(u32::MAX)).collect()
}

fn pick<'w>(purpose: u16, n: usize, words: &[&'w str]) -> Vec<&'w str> {
    let place = |share: f64| ((share * words.len() as f64) as usize).min(words.len() - 1);
    shares(purpose, n).into_iter().map(|share| words[place(share)]).collect()
}

/// More rows than two blocks, so that blocks have begins and ends.
const ROWS: usize = 2 * BLOCK_ROWS + 77;

/// Every 50th value is missing, and every 71st is out of range.
fn damaged(mut values: Vec<f64>) -> Vec<f64> {
    values.iter_mut().step_by(50).for_each(|value| *value = f64::NAN);
    values.iter_mut().step_by(71).for_each(|value| *value = -1e4);
    values
}

fn moves() -> Both {
    let noisy = |purpose: u16, center: f64| {
        let off = shares(purpose, ROWS).into_iter().map(|share| center + 0.8 * (share - 0.5));
        off.collect::<Vec<f64>>()
    };
    let turns = shares(3, ROWS).into_iter().map(|share| 400.0 * (share - 0.5)).collect();
    let robots = shares(4, ROWS).into_iter().map(|share| (5.0 * share).floor()).collect();
    let pauses = shares(5, ROWS).into_iter().map(|share| (3.0 * share).floor()).collect();
    Both::new()
        .words("action", pick(1, ROWS, &["forward", "left", "right", "stay", "7", ""]))
        .reals("ahead_boxes", damaged(noisy(6, 1.0)))
        .reals("left_boxes", noisy(7, 0.0))
        .reals("turn_deg", turns)
        .words("contact", pick(2, ROWS, &["no", "no", "no", "yes"]))
        .integers("robot", robots)
        .integers("delay_cycles", pauses)
}

/// Returns warnings without that on the first damaged row, which names its place in the table.
fn general(warnings: &[String]) -> Vec<String> {
    let is_general = |warning: &&String| !warning.contains("damaged rows were left out");
    warnings.iter().filter(is_general).cloned().collect()
}

#[test]
fn an_effector_is_the_same_from_columns_and_from_text() {
    let options = EffectorOptions { box_m: Some(0.25), ..EffectorOptions::default() };
    let [of_text, of_columns] = [
        effector::learn_csv(&moves().csv(), &options),
        effector::learn_csv(&moves().table(), &options),
    ]
    .map(Result::unwrap);
    let [mut one, other] = [&of_text, &of_columns].map(|model| model.report.clone());
    assert_eq!(general(&one.warnings), general(&other.warnings));
    assert_eq!(one.warnings.len(), other.warnings.len());
    assert!(other.warnings.iter().any(|warning| {
        warning.contains("log, column `ahead_boxes`, row 0 (from 0): `-10000.0` is more")
            || warning.contains("log, column `action`, row")
            || warning.contains("-10000 is more than one action moves")
    }));
    one.warnings.clone_from(&other.warnings);
    assert_eq!(one, other);
    assert!(one.rejected["damaged_row"] > 100 && one.rejected["contact"] > 100);
    assert_eq!(of_text.profile, of_columns.profile);
}

#[test]
fn a_sensor_is_the_same_from_columns_and_from_text() {
    let readings = || {
        let far = |purpose: u16| {
            let ranges = shares(purpose, ROWS).into_iter().map(|share| 8.0 * share);
            ranges.collect::<Vec<f64>>()
        };
        let true_m = far(3);
        let reported_m =
            true_m.iter().zip(shares(4, ROWS)).map(|(m, share)| (m + share - 0.5).abs()).collect();
        let robots = shares(5, ROWS).into_iter().map(|share| (3.0 * share).floor()).collect();
        Both::new()
            .integers("cycle", (0..ROWS).map(|row| (row / 4) as f64).collect())
            .integers("robot", robots)
            .words("true", pick(1, ROWS, &["wall", "wall", "nothing"]))
            .words("reported", pick(2, ROWS, &["wall", "wall", "wall", "nothing"]))
            .reals("true_distance_m", damaged(true_m))
            .reals("reported_distance_m", reported_m)
    };
    let options = SensorOptions { beam: true, range_m: 9.0, ..SensorOptions::default() };
    let [of_text, of_columns] = [
        sensor::learn_csv(&readings().csv(), &options),
        sensor::learn_csv(&readings().table(), &options),
    ]
    .map(Result::unwrap);
    let [mut one, other] = [&of_text, &of_columns].map(|model| model.report.clone());
    assert_eq!(general(&one.warnings), general(&other.warnings));
    one.warnings.clone_from(&other.warnings);
    assert_eq!(one, other);
    assert!(one.skipped > 50 && one.beam.is_some());
    let texts = [&of_text, &of_columns].map(|model| {
        let mut model = model.clone();
        model.report.warnings.clear();
        profile::with_sensor("profile", &profile::empty("p"), "s", &model).unwrap()
    });
    assert_eq!(texts[0], texts[1]);
    // The same from the text in which it is kept.
    let kept = profile::of_sensor(&of_text).unwrap();
    let base = profile::with_sensor("profile", &profile::empty("p"), "old", &of_columns).unwrap();
    for text in [profile::empty("p"), base] {
        let again = profile::with_learned("profile", &text, "s", &kept).unwrap();
        let straight = profile::with_sensor("profile", &text, "s", &of_text).unwrap();
        assert!(again == straight, "{again}\n{straight}");
    }
}

#[test]
fn errors_name_the_column_the_row_and_the_value() {
    let wrong = |ahead: f64| {
        Both::new()
            .words("action", vec!["forward", "forward", "left"])
            .reals("ahead_boxes", vec![1.0, ahead, ahead])
            .reals("left_boxes", vec![0.0; 3])
            .integers("turn_deg", vec![0.0; 3])
            .table()
    };
    let error = |ahead: f64| {
        effector::learn_csv(&wrong(ahead), &EffectorOptions::default()).unwrap_err().to_string()
    };
    assert!(
        error(9.5).starts_with("log, column `ahead_boxes`, row 1 (from 0): 9.5 is more"),
        "{}",
        error(9.5)
    );
    assert!(error(f64::NAN).contains("the value is missing (None or NaN)"), "{}", error(f64::NAN));
    assert!(
        error(f64::INFINITY).contains("`inf` is not a finite number"),
        "{}",
        error(f64::INFINITY)
    );
}

#[test]
fn words_are_numbered_and_there_may_be_many() {
    let mut words = Words::default();
    let texts: Vec<String> = (0..1000).map(|k| format!("w{}", k % 500)).collect();
    texts.iter().for_each(|text| words.push(Some(text)));
    words.push(None);
    words.push(Some("  w3 "));
    assert_eq!(words.row_count(), 1002);
    assert!(texts.iter().enumerate().all(|(row, text)| words.word(row) == Some(text)));
    assert_eq!([words.word(1000), words.word(1001)], [None, Some("w3")]);
}
