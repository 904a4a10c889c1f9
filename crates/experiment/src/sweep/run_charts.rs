//! The runs themselves as figures: joined seed by seed, as differences from the baseline, as boxes, and as shares of
//! runs up to each value.

use super::compare::BaselineIndex;
use super::groups::RunGroups;
use super::label::capitalized;
use super::plan::PRIVILEGE_MARK;
use super::table::RunColumn;
use sidestep_document::figure::{Point, RunLegend, SlotStats};
use sidestep_document::{Figure, FigureKind, Series};
use sidestep_kernel::ports::ColumnValues;
use sidestep_statistics::{Sample, mean, mean_interval, percentile};

/// Largest number of slots beside each other: more have no room for swarms.
pub(super) const MAX_SLOTS: usize = 8;
/// Largest number of runs of a slot that are shown as points; more are a blot, and the box says more.
const MAX_POINTS: usize = 200;
/// Least number of runs for a box: quartiles of fewer say nothing that the points do not.
const MIN_BOX_RUNS: usize = 8;
/// Least number of runs of a variant for a curve of shares.
pub(super) const MIN_STEPS_RUNS: usize = 10;
/// Largest least value of counts that bars show, as a fraction of the greatest: bars of others would look alike.
const MAX_BAR_LEAST: f64 = 0.4;
/// Reach of whiskers beyond the box, in interquartile ranges, as Tukey drew it.
const WHISKER_RANGES: f64 = 1.5;

/// Short names of the variants, and what they are as a whole: where one parameter of words tells them
/// apart, its values and its name.
pub(super) struct VariantNames {
    pub(super) names: Vec<String>,
    pub(super) label: String,
}

impl VariantNames {
    pub(super) fn new(groups: &RunGroups<'_>) -> Self {
        // Names made of settings, or numbers in place of names.
        let is_setting = |name: &String| name.contains('=') || name.parse::<u64>().is_ok();
        let are_settings = groups.variants.iter().all(is_setting);
        // A number alone says nothing.
        if let [parameter] = &groups.parameters[..]
            && are_settings
            && !parameter.numeric
        {
            let mut names = Vec::with_capacity(groups.variants.len());
            for (variant, name) in groups.variants.iter().enumerate() {
                let level = parameter.levels[parameter.of_variant[variant]].name();
                let mark = if name.ends_with(PRIVILEGE_MARK) { PRIVILEGE_MARK } else { "" };
                names.push(level + mark);
            }
            return Self { names, label: parameter.name.clone() };
        }
        Self { names: groups.variants.clone(), label: "variant".into() }
    }
}

/// Returns whether a metric is measured run by run: shares are not.
pub(super) fn is_number(metric: &RunColumn) -> bool {
    !matches!(metric.values, ColumnValues::Bool(_) | ColumnValues::Text(_))
}

/// Returns the runs of all variants, those of one seed joined; `None` where variants are too many, or have no seeds
/// in common.
pub(super) fn joined_runs(groups: &RunGroups<'_>, metric: &RunColumn) -> Option<Figure> {
    let has_pairs = groups.paired && groups.replicates.len() > 1;
    let is_seeded = !groups.seedless.contains(&true);
    if !has_pairs || !is_seeded || !is_number(metric) || !has_slots(groups) {
        return None;
    }
    if groups.replicates.len() > MAX_POINTS {
        return None;
    }
    let columns = (0..groups.variants.len()).map(|v| groups.by_replicate(metric, v)).collect();
    let label = groups.label(metric);
    let figure = runs_figure(groups, columns, false);
    Some(Figure {
        title: format!("{}, seed by seed", capitalized(&label)),
        note: format!("Each line is a seed, n = {}.", groups.replicates.len()),
        y_label: label.to_string(),
        kind: joined(figure.kind),
        ..figure
    })
}

fn joined(kind: FigureKind) -> FigureKind {
    match kind {
        FigureKind::Runs { slots, has_zero_line, legend, .. } => {
            // Boxes would hide the lines.
            let slots = slots.into_iter().map(|s| SlotStats { five_numbers: None, ..s }).collect();
            FigureKind::Runs { slots, has_zero_line, is_joined: true, has_bars: false, legend }
        }
        other => other,
    }
}

/// Returns the runs of all variants as swarms over boxes, or of counts over bars that start at zero; `None` where variants
/// are too many.
pub(super) fn boxed_runs(groups: &RunGroups<'_>, metric: &RunColumn) -> Option<Figure> {
    if !is_number(metric) || !has_slots(groups) {
        return None;
    }
    let columns: Vec<_> = (0..groups.variants.len()).map(|v| groups.values(metric, v)).collect();
    let most = columns.iter().map(Vec::len).max().unwrap_or(0);
    let label = groups.label(metric);
    if most <= MAX_POINTS && are_counts_from_zero(metric, &columns) {
        let figure = runs_figure(groups, columns, false);
        let note = "Bars: means. Each point is a run.".into();
        let kind = with_bars(figure.kind);
        let title = capitalized(&label);
        return Some(Figure { title, note, y_label: label.to_string(), kind, ..figure });
    }
    let boxes = if most >= MIN_BOX_RUNS {
        " Boxes: quartiles and median; whiskers: the values within 1.5 interquartile ranges."
    } else {
        ""
    };
    let points = if most > MAX_POINTS { "" } else { "Each point is a run." };
    let note = format!("{points}{boxes}").trim().to_string();
    let figure = runs_figure(groups, columns, false);
    Some(Figure { title: capitalized(&label), note, y_label: label.to_string(), ..figure })
}

/// Returns whether values are counts of which some are near zero.
fn are_counts_from_zero(metric: &RunColumn, columns: &[Vec<Option<f64>>]) -> bool {
    let are_counts = matches!(metric.values, ColumnValues::U32(_) | ColumnValues::U64(_));
    let values = || columns.iter().flatten().flatten().copied();
    let least = values().fold(f64::INFINITY, f64::min);
    let greatest = values().fold(0.0, f64::max);
    are_counts && greatest > 0.0 && least <= MAX_BAR_LEAST * greatest
}

fn with_bars(kind: FigureKind) -> FigureKind {
    match kind {
        FigureKind::Runs { slots, has_zero_line, is_joined, legend, .. } => {
            let slots = slots.into_iter().map(|s| SlotStats { five_numbers: None, ..s }).collect();
            FigureKind::Runs { slots, is_joined, has_zero_line, has_bars: true, legend }
        }
        other => other,
    }
}

/// Returns the differences of variants from their baseline, seed by seed; `None` without any.
pub(super) fn differences(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    reference: &BaselineIndex,
) -> Option<Figure> {
    if !is_number(metric) || groups.replicates.len() < 2 {
        return None;
    }
    let names = VariantNames::new(groups);
    let mut series = Vec::new();
    let mut slots = Vec::new();
    for variant in 0..groups.variants.len() {
        let Some(baseline) = reference.of[variant] else { continue };
        if groups.seedless[variant] && groups.seedless[baseline] {
            continue;
        }
        let own = groups.by_replicate(metric, variant);
        let other = groups.by_replicate(metric, baseline);
        let pairs = own.iter().zip(&other);
        let values: Vec<Option<f64>> = pairs.map(|(a, b)| Some((*a)? - (*b)?)).collect();
        slots.push(SlotStats { five_numbers: None, ..slot_stats(&values) });
        series.push(run_series(groups, names.names[variant].clone(), &values));
    }
    if series.is_empty() || series.len() > MAX_SLOTS {
        return None;
    }
    let label = groups.label(metric);
    let baseline = baseline_name(groups, reference, &names);
    Some(Figure {
        title: format!("{}: difference from {baseline}, seed by seed", capitalized(&label)),
        note: "Each point is the difference on one seed.".into(),
        x_label: names.label,
        y_label: format!("difference: {label}"),
        kind: FigureKind::Runs {
            slots,
            is_joined: false,
            has_zero_line: true,
            has_bars: false,
            legend: RunLegend::default(),
        },
        series,
        ..Figure::default()
    })
}

/// Returns the name of the baseline in figures.
pub(super) fn baseline_name(
    groups: &RunGroups<'_>,
    reference: &BaselineIndex,
    names: &VariantNames,
) -> String {
    let found = groups.variants.iter().position(|name| *name == reference.name);
    found.map_or_else(|| reference.name.clone(), |variant| names.names[variant].clone())
}

/// Returns the share of runs up to each value, a curve for each variant; `None` where these are too many, or their runs
/// too few.
pub(super) fn shares_up_to(groups: &RunGroups<'_>, metric: &RunColumn) -> Option<Figure> {
    if !is_number(metric) || !has_slots(groups) || groups.seedless.contains(&true) {
        return None;
    }
    let names = VariantNames::new(groups);
    let mut series = Vec::new();
    for (variant, name) in names.names.iter().enumerate() {
        let sorted = Sample::from_runs(groups.values(metric, variant)).sorted();
        if sorted.len() < MIN_STEPS_RUNS {
            return None;
        }
        let n = sorted.len();
        let share =
            |(k, value): (usize, &f64)| Point::new(*value, (k + 1) as f64 / n as f64).with_runs(n);
        let points = sorted.iter().enumerate().map(share).collect();
        series.push(Series { name: name.clone(), points });
    }
    let label = groups.label(metric);
    Some(Figure {
        title: format!("Distribution of {label}"),
        note: "A curve further to the right has greater values; a steep one varies little from seed to seed.".into(),
        x_label: label.to_string(),
        y_label: "cumulative share of runs".into(),
        kind: FigureKind::Steps,
        series,
        ..Figure::default()
    })
}

fn has_slots(groups: &RunGroups<'_>) -> bool {
    (2..=MAX_SLOTS).contains(&groups.variants.len())
}

/// Returns a figure of the variants as slots, with a value for each run.
fn runs_figure(
    groups: &RunGroups<'_>,
    columns: Vec<Vec<Option<f64>>>,
    has_zero_line: bool,
) -> Figure {
    let names = VariantNames::new(groups);
    let mut series = Vec::with_capacity(columns.len());
    let mut slots = Vec::with_capacity(columns.len());
    for (name, values) in names.names.iter().zip(&columns) {
        slots.push(slot_stats(values));
        series.push(run_series(groups, name.clone(), values));
    }
    Figure {
        x_label: names.label,
        kind: FigureKind::Runs {
            slots,
            is_joined: false,
            has_zero_line,
            has_bars: false,
            legend: RunLegend::default(),
        },
        series,
        ..Figure::default()
    }
}

/// Returns the runs of a slot by the numbers of their replicates, if they are few.
fn run_series(groups: &RunGroups<'_>, name: String, values: &[Option<f64>]) -> Series {
    if values.len() > MAX_POINTS {
        return Series { name, points: vec![] };
    }
    let numbers = groups.replicates.iter().map(|replicate| *replicate as f64);
    let points = numbers.zip(values).map(|(x, y)| Point::new(x, y.unwrap_or(f64::NAN)));
    Series { name, points: points.collect() }
}

fn slot_stats(values: &[Option<f64>]) -> SlotStats {
    let sample = Sample::from_runs(values.iter().copied());
    let sorted = sample.sorted();
    let interval = mean_interval(&sample.values).map(|i| (i.low, i.high));
    let has_box = sorted.len() >= MIN_BOX_RUNS;
    SlotStats {
        mean: mean(&sample.values),
        interval,
        five_numbers: five_numbers(&sorted).filter(|_| has_box),
    }
}

fn five_numbers(sorted: &[f64]) -> Option<[f64; 5]> {
    let first = percentile(sorted, 0.25)?;
    let median = percentile(sorted, 0.5)?;
    let third = percentile(sorted, 0.75)?;
    let reach = WHISKER_RANGES * (third - first);
    let low = sorted.iter().copied().find(|value| *value >= first - reach)?;
    let high = sorted.iter().rev().copied().find(|value| *value <= third + reach)?;
    // Between two values a quartile may lie outside of all that are within reach of it.
    Some([low.min(first), first, median, third, high.max(third)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whiskers_end_at_the_last_value_within_reach_of_the_box() {
        let sorted = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 90.0];
        assert_eq!(five_numbers(&sorted), Some([1.0, 3.0, 5.0, 7.0, 8.0]));
        assert_eq!(five_numbers(&[]), None);
    }
}
