//! The first page of a summary: at most six figures, chosen by what is compared and by what differs.
//!
//! Metrics come in the order of the summary, the most informative first; one that goes up and down with an earlier
//! one says the same again, and is passed over. Variants that are compared give a forest of all metrics, the seeds of
//! the first metric joined, and their differences; a parameter of numbers gives lines, two of several levels a heat
//! map; two metrics of several variants are shown against each other.

use super::Label;
use super::charts;
use super::compare::BaselineIndex;
use super::forest_chart::forest;
use super::front::{Better, front_corners};
use super::groups::{Level, Parameter, RunGroups};
use super::label::capitalized;
use super::run_charts::{VariantNames, boxed_runs, differences, joined_runs, shares_up_to};
use super::summary::MetricSummary;
use super::table::RunColumn;
use sidestep_document::figure::Point;
use sidestep_document::{Figure, FigureKind, Series};
use sidestep_statistics::rank_correlation;

/// Largest number of figures on the first page: as many as a reader takes in.
const MAX_FIGURES: usize = 6;
/// Rank correlation over all runs above which two metrics say the same.
const MAX_CORRELATION: f64 = 0.97;
/// Number of metrics that have figures of their own on the first page.
const MAX_METRICS: usize = 3;
/// Least number of levels of both factors of a heat map: of fewer, lines say more.
const MIN_LEVELS: usize = 3;
/// Largest number of levels of a factor of a heat map.
const MAX_LEVELS: usize = 30;
/// Variants that are shown by two metrics against each other.
const MIN_POINTS: usize = 3;
const MAX_POINTS: usize = 35;

/// What the first page is chosen from.
pub(super) struct LeadContext<'a> {
    pub(super) groups: &'a RunGroups<'a>,
    /// The metrics shown, and their summaries.
    pub(super) columns: &'a [&'a RunColumn],
    pub(super) metrics: &'a [MetricSummary],
    pub(super) reference: Option<&'a BaselineIndex>,
    /// Two metrics with the values that are better, or none.
    pub(super) aims: &'a [(&'a RunColumn, Better)],
}

/// Returns the figures of the first page.
pub(super) fn figures(context: &LeadContext<'_>) -> Vec<Figure> {
    let LeadContext { groups, columns, metrics, reference, aims } = *context;
    let own = independent_metrics(groups, columns);
    let Some(first) = own.first().copied() else { return Vec::new() };
    let mut figures: Vec<Figure> = Vec::new();
    if let Some(reference) = reference {
        figures.extend(forest(groups, metrics, reference));
    }
    let has_axis = groups.parameters.iter().any(|p| p.numeric);
    if has_axis {
        figures.extend(heat_figure(groups, first));
        for metric in &own {
            figures.extend(axis_figures(groups, metric));
        }
        // The last place is that of two metrics against each other.
        figures.truncate(MAX_FIGURES - 1);
    } else if groups.variants.len() > 1 {
        figures.extend(joined_runs(groups, first));
        figures.extend(reference.and_then(|reference| differences(groups, first, reference)));
        figures.extend(shares_up_to(groups, first));
        for metric in own.iter().skip(1) {
            figures.extend(boxed_runs(groups, metric));
        }
    }
    // A front that was asked for comes right after the comparison.
    if let [x, y] = aims {
        let place = figures.len().min(1);
        figures.splice(place..place, front(groups, [*x, *y]));
    } else if let [first, second, ..] = own[..] {
        figures.extend(trade_off(groups, [first, second]));
    }
    figures.truncate(MAX_FIGURES);
    for figure in &mut figures {
        add_privilege_note(figure, groups.privilege_note);
    }
    figures
}

/// Adds the note on variants in which somebody knows what no agent could, where a figure has it not yet.
fn add_privilege_note(figure: &mut Figure, privilege_note: Option<&str>) {
    if let Some(note) = privilege_note
        && !figure.note.contains(note)
    {
        figure.note = format!("{} {note}", figure.note);
    }
}

/// Returns the first metrics of which none goes with another.
fn independent_metrics<'a>(
    groups: &RunGroups<'_>,
    columns: &[&'a RunColumn],
) -> Vec<&'a RunColumn> {
    let mut own: Vec<&RunColumn> = Vec::with_capacity(MAX_METRICS);
    for column in columns {
        if own.len() == MAX_METRICS {
            break;
        }
        if !own.iter().any(|earlier| goes_with(groups, earlier, column)) {
            own.push(column);
        }
    }
    own
}

/// Returns whether two metrics rise and fall together over all runs.
fn goes_with(groups: &RunGroups<'_>, a: &RunColumn, b: &RunColumn) -> bool {
    let runs = 0..groups.table.runs();
    let pair = |run: usize| Some((a.values.number(run)?, b.values.number(run)?));
    let pairs: Vec<(f64, f64)> =
        runs.filter_map(pair).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    rank_correlation(&pairs).is_some_and(|found| found.value.abs() > MAX_CORRELATION)
}

/// Returns the figures of a metric over the parameters that are numbers.
fn axis_figures(groups: &RunGroups<'_>, metric: &RunColumn) -> Vec<Figure> {
    let all = charts::figures(groups, metric);
    all.into_iter().filter(|figure| !matches!(figure.kind, FigureKind::Dots { .. })).collect()
}

/// Returns a metric over two factors of several levels each, in a full grid without others.
fn heat_figure(groups: &RunGroups<'_>, metric: &RunColumn) -> Option<Figure> {
    let [a, b] = &groups.parameters[..] else { return None };
    let sizes = [a.levels.len(), b.levels.len()];
    let has_levels = sizes.iter().all(|size| (MIN_LEVELS..=MAX_LEVELS).contains(size));
    if !has_levels || charts::is_sampled(groups) || sizes[0] * sizes[1] != groups.variants.len() {
        return None;
    }
    // Numbers rise from bottom to top; words stand in their order from the top.
    let (across, upward) = if a.numeric && !b.numeric { (a, b) } else { (b, a) };
    let mut rows: Vec<usize> = (0..upward.levels.len()).collect();
    if upward.numeric {
        rows.reverse();
    }
    let series = rows.iter().map(|row| heat_row(groups, metric, (across, upward), *row)).collect();
    let label = groups.label(metric);
    Some(Figure {
        title: format!("{} over two factors", capitalized(&label)),
        note: "Means over runs.".into(),
        x_label: Label::from_name(&across.name).to_string(),
        y_label: Label::from_name(&upward.name).to_string(),
        kind: FigureKind::Heat {
            columns: across.levels.iter().map(Level::name).collect(),
            value_label: label.to_string(),
        },
        series,
        ..Figure::default()
    })
}

/// Returns the means at one level of the factor upward.
fn heat_row(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    (across, upward): (&Parameter, &Parameter),
    row: usize,
) -> Series {
    let mut points = Vec::with_capacity(across.levels.len());
    for variant in 0..groups.variants.len() {
        if upward.of_variant[variant] == row {
            let column = across.of_variant[variant] as f64;
            points.extend(groups.mean_over(metric, &[variant]).point(column));
        }
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    Series { name: upward.levels[row].name(), points }
}

/// Returns two metrics with the front of the variants that no other one beats in both.
fn front(groups: &RunGroups<'_>, [x, y]: [(&RunColumn, Better); 2]) -> Option<Figure> {
    let figure = trade_off(groups, [x.0, y.0])?;
    let points = figure.series.iter().flat_map(|series| &series.points);
    let means: Vec<(f64, f64)> = points.map(|point| (point.x, point.y)).collect();
    let corners = front_corners(&means, [x.1, y.1]);
    let [x_words, y_words] =
        [x, y].map(|(metric, better)| format!("{} {}", better.word(), groups.label(metric).text));
    let note = format!(
        "{} On the dashed front are the variants that no other one beats in both: {x_words}, {y_words}.",
        figure.note
    );
    Some(Figure { note, kind: FigureKind::Front { corners }, ..figure })
}

/// Returns two metrics against each other, a point for each variant.
fn trade_off(groups: &RunGroups<'_>, [x, y]: [&RunColumn; 2]) -> Option<Figure> {
    if !(MIN_POINTS..=MAX_POINTS).contains(&groups.variants.len()) {
        return None;
    }
    let names = VariantNames::new(groups).names;
    let mut series = Vec::with_capacity(names.len());
    for (variant, name) in names.into_iter().enumerate() {
        let across = groups.mean_over(x, &[variant]);
        let upward = groups.mean_over(y, &[variant]);
        let Some(position) = across.mean else { continue };
        let x_interval = across.interval.map(|i| (i.low, i.high));
        let point = upward.point(position).map(|point| Point { x_interval, ..point });
        series.push(Series { name, points: point.into_iter().collect() });
    }
    let [x_label, y_label] = [x, y].map(|metric| groups.label(metric));
    Some(Figure {
        title: format!("{} and {}", capitalized(&y_label), x_label.text),
        note: "Means of the variants with 95 % intervals.".into(),
        x_label: x_label.to_string(),
        y_label: y_label.to_string(),
        kind: FigureKind::Points,
        series,
        ..Figure::default()
    })
}
