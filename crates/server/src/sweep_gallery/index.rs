//! The page that opens the replays of a sweep: its runs as plain data.

use super::{FinishedRun, FinishedSweep, OUTLIER_RULE, WrittenReplay};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sidestep_experiment::sweep::outliers::Outlier;
use sidestep_experiment::sweep::{Role, RunColumn};
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::shell::sidestep_command;
use sidestep_kernel::text::group_thousands;
use sidestep_report::{Gallery, GalleryMark, GalleryMetric, GalleryRun, GalleryValue, Text};
use sidestep_session::sweep::Folder;

/// Digits of a number that is not whole: enough to tell two runs apart, and to read.
const DIGITS: usize = 4;

/// Returns the runs of a sweep, of which some have a replay.
pub(super) fn gallery(
    sweep: &FinishedSweep,
    folder: &Folder,
    replays: &[WrittenReplay],
) -> Gallery {
    let plan = folder.plan();
    let columns: Vec<MetricColumn<'_>> = sweep
        .summary
        .metrics
        .iter()
        .filter_map(|metric| {
            let mut metrics = sweep.table.columns_with_role(Role::Metric);
            metrics.find(|column| column.name == metric.name).map(MetricColumn::new)
        })
        .collect();
    let mut runs: Vec<GalleryRun> =
        sweep.runs.iter().map(|run| gallery_run(sweep, run, &columns)).collect();
    for replay in replays {
        runs[replay.run].page = Some(replay.page.clone());
        let address = |png| format!("data:image/png;base64,{}", STANDARD.encode(png));
        runs[replay.run].picture = replay.picture.as_ref().map(address);
    }
    let metrics = sweep.summary.metrics.iter().map(|metric| GalleryMetric {
        label: metric.label.to_string(),
        meaning: metric.meaning.to_string(),
    });
    Gallery {
        title: if plan.name.is_empty() {
            format!("A sweep of {}", plan.world)
        } else {
            plan.name.clone()
        },
        lead: lead(sweep, folder, replays.len()),
        warnings: warnings(sweep, folder),
        hint: hint(sweep, folder, replays.len()),
        rule: OUTLIER_RULE.to_string(),
        metrics: metrics.collect(),
        variants: sweep.names.clone(),
        runs,
    }
}

fn gallery_run(
    sweep: &FinishedSweep,
    run: &FinishedRun,
    columns: &[MetricColumn<'_>],
) -> GalleryRun {
    let failure = sweep.table.column("failure");
    let failure = failure.map_or_else(String::new, |column| column.values.text(run.row));
    // Without an end it has failed, whatever the table says.
    let failure = match (run.end.is_some(), failure.is_empty()) {
        (false, true) => "it did not come to its end".to_string(),
        _ => failure,
    };
    let values = columns.iter().map(|column| {
        let mut of_run = sweep.outliers.get(&run.row).into_iter().flatten();
        let outlier = of_run.find(|outlier| outlier.metric == column.values.name);
        GalleryValue {
            text: column.text(run.row),
            number: column.values.values.number(run.row),
            mark: outlier.map(|outlier| column.mark(outlier)),
        }
    });
    GalleryRun {
        variant: run.trial.variant as usize,
        seed: run.trial.seed,
        values: if run.end.is_some() { values.collect() } else { Vec::new() },
        page: None,
        picture: None,
        failure,
    }
}

/// A metric of the runs, and how its numbers are written.
struct MetricColumn<'a> {
    values: &'a RunColumn,
    format: NumberFormat,
}

/// How all numbers of a metric are written, so that they stand below each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum NumberFormat {
    Decimals(usize),
    /// With an exponent.
    Scientific,
}

impl<'a> MetricColumn<'a> {
    fn new(values: &'a RunColumn) -> Self {
        let rows = 0..values.values.len();
        let format = NumberFormat::of(rows.filter_map(|row| values.values.number(row)));
        Self { values, format }
    }

    fn text(&self, row: usize) -> String {
        match &self.values.values {
            ColumnValues::Bool(_) => match self.values.values.number(row) {
                Some(1.0) => "yes".into(),
                Some(_) => "no".into(),
                None => String::new(),
            },
            values => match values.number(row) {
                Some(number) => self.format.text(number),
                None => values.text(row),
            },
        }
    }

    fn mark(&self, outlier: &Outlier) -> GalleryMark {
        let side = if outlier.is_high { "above" } else { "below" };
        let median = self.format.text(outlier.median);
        let ranges = outlier.distance_ranges;
        let words = if ranges.is_finite() {
            format!(
                "{ranges:.1} interquartile ranges {side} the runs of its variant (median {median})"
            )
        } else {
            format!(
                "{side} the runs of its variant, of which more than three quarters have {median}"
            )
        };
        GalleryMark { is_high: outlier.is_high, words, distance: ranges }
    }
}

impl NumberFormat {
    fn of(numbers: impl Iterator<Item = f64>) -> Self {
        // Beyond this, not every whole number is a float.
        const MAX_WHOLE: f64 = 1e15;
        let numbers: Vec<f64> = numbers.filter(|number| number.is_finite()).collect();
        let largest = numbers.iter().fold(0.0_f64, |largest, number| largest.max(number.abs()));
        if largest < MAX_WHOLE && numbers.iter().all(|number| number.fract() == 0.0) {
            return Self::Decimals(0);
        }
        if !(1e-3..1e7).contains(&largest) {
            return Self::Scientific;
        }
        // The digits before the point count.
        let whole_digits = if largest >= 1.0 { format!("{largest:.0}").len() } else { 0 };
        Self::Decimals(DIGITS.saturating_sub(whole_digits))
    }

    fn text(self, number: f64) -> String {
        match self {
            Self::Decimals(0) if number.fract() != 0.0 => format!("{number:.1}"),
            Self::Decimals(decimals) => format!("{number:.decimals$}"),
            Self::Scientific => format!("{number:.*e}", DIGITS - 1),
        }
    }
}

fn lead(sweep: &FinishedSweep, folder: &Folder, replays: usize) -> Text {
    let plan = folder.plan();
    let outliers = sweep.runs.iter().filter(|run| run.distance > 0.0).count();
    let count = |n: usize| group_thousands(n as u64);
    Text::from_markup(&format!(
        "{} runs of {} variants in the world `{}`, {} of them outliers; {} have a replay here.",
        count(sweep.runs.len()),
        count(plan.variants.len()),
        plan.world,
        count(outliers),
        count(replays),
    ))
}

fn warnings(sweep: &FinishedSweep, folder: &Folder) -> Vec<Text> {
    let mut warnings = Vec::new();
    if !sweep.is_complete {
        let done = group_thousands(sweep.runs.len() as u64);
        let all = group_thousands(folder.plan().runs());
        let text = format!("**The sweep is not done**: {done} of at most {all} runs are here.");
        warnings.push(Text::from_markup(&text));
    }
    let failed = sweep.runs.iter().filter(|run| run.end.is_none()).count();
    if failed > 0 {
        let failed = group_thousands(failed as u64);
        warnings.push(Text::from_markup(&format!("**{failed} runs failed**, and have no replay.")));
    }
    warnings.extend(folder.plan().privilege_note().map(Text::from));
    warnings
}

/// Returns how to get replays of the other runs.
fn hint(sweep: &FinishedSweep, folder: &Folder, replays: usize) -> Text {
    let name = folder.path().file_name().unwrap_or_default();
    if replays == sweep.runs.iter().filter(|run| run.end.is_some()).count() {
        return Text::from("Every run has a replay.");
    }
    let command = sidestep_command("export --to page --runs all --replace", name);
    // The page may be anywhere, and tells no place of this machine.
    let words = ", with --out and all other options as they were.";
    Text::from("All runs get a replay by ").append(Text::code(command)).append(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_numbers_of_a_metric_have_the_same_decimals() {
        let text = |all: &[f64]| {
            let format = NumberFormat::of(all.iter().copied());
            all.iter().map(|number| format.text(*number)).collect::<Vec<_>>()
        };
        assert_eq!(text(&[3.0, 120.0]), ["3", "120"]);
        assert_eq!(text(&[99.0, 97.328]), ["99.00", "97.33"]);
        assert_eq!(text(&[0.1, 0.086_51]), ["0.1000", "0.0865"]);
        assert_eq!(text(&[12_345.6, 1.0]), ["12345.6", "1"]);
        assert_eq!(text(&[2e-7, 1e-9]), ["2.000e-7", "1.000e-9"]);
        assert_eq!(NumberFormat::of([1.0, 4.0].into_iter()).text(2.5), "2.5", "a median of counts");
    }
}
