//! A summary as figures: each metric over each parameter.
//!
//! A numeric parameter gives lines, one for each combination of the other parameters; if there are
//! more than [`MAX_SERIES`] of these, numeric parameters among them are averaged over, then also
//! parameters of words. A parameter of words gives bars. Averages are only taken in full grids. If
//! variants are samples of a box, as in a Latin hypercube, they are points: in the box itself, if it
//! has two sides, and over each side. Without
//! parameters the variants are bars, and a single variant is shown by its distribution over runs.

use super::Label;
use super::groups::RunGroups;
use super::label::capitalized;
use super::table::RunColumn;
use sidestep_document::figure::Point;
use sidestep_document::{Figure, FigureKind, Series};
use sidestep_kernel::ports::Values;
use sidestep_statistics::{Sample, wilson};
use std::collections::BTreeMap;

/// Largest number of series in a figure: more cannot be distinguished.
const MAX_SERIES: usize = 8;

/// Names of the thirds of a sample, from its least values on.
const THIRD_NAMES: [&str; 3] = ["lower", "middle", "upper"];

/// Largest number of steps of a distribution.
const MAX_STEPS: usize = 200;

pub(super) fn figures(groups: &RunGroups<'_>, metric: &RunColumn) -> Vec<Figure> {
    if is_sampled(groups) {
        return sample_figures(groups, metric);
    }
    let over = |p| parameter_figure(groups, metric, p);
    let over: Vec<Figure> = (0..groups.parameters.len()).filter_map(over).collect();
    match (groups.parameters.len(), groups.variants.len()) {
        (0, 0) => Vec::new(),
        (0, 1) => distribution_figure(groups, metric).into_iter().collect(),
        (0, _) => vec![variant_figure(groups, metric)],
        _ => over,
    }
}

/// Returns whether variants are samples of a box of parameters: no two of them lie on a line, or there are many
/// and some number is another in each of them, as in a Latin hypercube with other sides that are whole numbers.
pub(super) fn is_sampled(groups: &RunGroups<'_>) -> bool {
    let numeric = numeric_parameters(groups);
    let variants = groups.variants.len();
    let alone = |p: &usize| {
        group_by_levels(groups, &other_parameters(groups, *p)).values().all(|g| g.len() < 2)
    };
    let is_own = |p: &usize| groups.parameters[*p].levels.len() == variants;
    let is_sampled = variants > MAX_SERIES && numeric.iter().any(is_own);
    numeric.len() > 1 && (is_sampled || numeric.iter().all(alone))
}

/// Returns the parameters that are numbers.
pub(super) fn numeric_parameters(groups: &RunGroups<'_>) -> Vec<usize> {
    (0..groups.parameters.len()).filter(|p| groups.parameters[*p].numeric).collect()
}

fn other_parameters(groups: &RunGroups<'_>, parameter: usize) -> Vec<usize> {
    (0..groups.parameters.len()).filter(|p| *p != parameter).collect()
}

/// Returns the variants by their levels of these parameters.
fn group_by_levels(
    groups: &RunGroups<'_>,
    parameters: &[usize],
) -> BTreeMap<Vec<usize>, Vec<usize>> {
    let mut found: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    for variant in 0..groups.variants.len() {
        let levels = parameters.iter().map(|p| groups.parameters[*p].of_variant[variant]);
        found.entry(levels.collect()).or_default().push(variant);
    }
    found
}

/// Returns the parameters that distinguish the series of a figure over `parameter`; `None` if there
/// would be too many, and an average would mix.
fn series_parameters(groups: &RunGroups<'_>, parameter: usize) -> Option<Vec<usize>> {
    let all = other_parameters(groups, parameter);
    let words: Vec<usize> =
        all.iter().copied().filter(|p| !groups.parameters[*p].numeric).collect();
    let balanced = groups.is_balanced(parameter);
    let mut choices = vec![all.clone()];
    if balanced {
        choices.extend([words, Vec::new()]);
    }
    choices.into_iter().find(|choice| group_by_levels(groups, choice).len() <= MAX_SERIES)
}

fn parameter_figure(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    parameter: usize,
) -> Option<Figure> {
    let axis = &groups.parameters[parameter];
    let scattered = || axis.numeric.then(|| scatter_figure(groups, metric, parameter));
    let Some(apart) = series_parameters(groups, parameter) else { return scattered() };
    let lines = group_by_levels(groups, &apart);
    if lines.values().all(|variants| variants.len() < 2) {
        return scattered();
    }
    let series = lines.iter().map(|(key, variants)| {
        let named = apart.iter().zip(key).map(|(p, level)| {
            let other = &groups.parameters[*p];
            format!("{} = {}", other.name, other.levels[*level].name())
        });
        let points = (0..axis.levels.len()).filter_map(|level| {
            let at = |v: &&usize| axis.of_variant[**v] == level;
            let group: Vec<usize> = variants.iter().filter(at).copied().collect();
            (!group.is_empty()).then_some(())?;
            groups.mean_over(metric, &group).point(level_position(groups, parameter, level))
        });
        Series { name: named.collect::<Vec<_>>().join(", "), points: points.collect() }
    });
    let kind = if axis.numeric {
        FigureKind::Lines
    } else {
        FigureKind::Bars { categories: axis.levels.iter().map(|l| l.name()).collect() }
    };
    let averaged = apart.len() + 1 < groups.parameters.len();
    let over = Label::from_name(&axis.name);
    let title = format!("{} over {}", capitalized(&groups.label(metric)), over.text);
    let note = match averaged {
        true => format!("{} Means over the other parameters, too.", means_note(groups)),
        false => means_note(groups),
    };
    let figure = figure(groups, metric, title, over.to_string());
    Some(Figure { note, kind, series: series.collect(), ..figure })
}

/// Returns the position of a level on the axis.
fn level_position(groups: &RunGroups<'_>, parameter: usize, level: usize) -> f64 {
    match groups.parameters[parameter].levels[level] {
        super::groups::Level::Number(value) => value,
        super::groups::Level::Text(_) => level as f64,
    }
}

/// Returns a figure with one point per variant.
fn scatter_figure(groups: &RunGroups<'_>, metric: &RunColumn, parameter: usize) -> Figure {
    let axis = &groups.parameters[parameter];
    let point = |variant: usize| {
        let x = level_position(groups, parameter, axis.of_variant[variant]);
        groups.mean_over(metric, &[variant]).point(x)
    };
    let points = (0..groups.variants.len()).filter_map(point).collect();
    let over = Label::from_name(&axis.name);
    let title = format!("{} over {}", capitalized(&groups.label(metric)), over.text);
    let note = format!("A point is a variant. {}", means_note(groups));
    let series = vec![Series { name: String::new(), points }];
    let figure = figure(groups, metric, title, over.to_string());
    Figure { note, kind: FigureKind::Points, series, ..figure }
}

/// Returns samples of a box of parameters as figures: the box itself, if it has two sides, and the metric
/// over each side.
fn sample_figures(groups: &RunGroups<'_>, metric: &RunColumn) -> Vec<Figure> {
    let sides = numeric_parameters(groups);
    let over = sides.iter().map(|p| scatter_figure(groups, metric, *p));
    let plane = match sides[..] {
        [across, upward] => sample_plane_figure(groups, metric, [across, upward]),
        _ => None,
    };
    plane.into_iter().chain(over).collect()
}

/// Returns the samples where they are in a box of two sides: thirds of the metric are series of their
/// own.
fn sample_plane_figure(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    sides: [usize; 2],
) -> Option<Figure> {
    let value = |v: usize| Some((groups.mean_over(metric, &[v]).mean?, v));
    let mut values: Vec<(f64, usize)> = (0..groups.variants.len()).filter_map(value).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let third = values.len().div_ceil(THIRD_NAMES.len()).max(1);
    let at = |v: usize, p: usize| level_position(groups, p, groups.parameters[p].of_variant[v]);
    let point = |&(_, v): &(f64, usize)| Point::new(at(v, sides[0]), at(v, sides[1]));
    let series = values.chunks(third).zip(THIRD_NAMES).map(|(part, words)| {
        let (low, high) = (part[0].0, part[part.len() - 1].0);
        let name = format!("{words} third: {} to {}", short_number(low), short_number(high));
        Series { name, points: part.iter().map(point).collect() }
    });
    let series: Vec<Series> = series.collect();
    let [across, upward] = sides.map(|p| Label::from_name(&groups.parameters[p].name));
    (series.len() == THIRD_NAMES.len()).then(|| Figure {
        title: format!("{} where the samples are", capitalized(&groups.label(metric))),
        note: "A point is a variant; its mark says in which third of all variants its mean is."
            .into(),
        x_label: across.to_string(),
        y_label: upward.to_string(),
        kind: FigureKind::Points,
        series,
        ..Figure::default()
    })
}

/// Returns a number with three digits.
fn short_number(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    rounded.to_string()
}

fn variant_figure(groups: &RunGroups<'_>, metric: &RunColumn) -> Figure {
    let point = |variant: usize| groups.mean_over(metric, &[variant]).point(variant as f64);
    let points = (0..groups.variants.len()).filter_map(point).collect();
    let figure = figure(groups, metric, capitalized(&groups.label(metric)), "variant".into());
    let kind = FigureKind::Bars { categories: groups.variants.clone() };
    let series = vec![Series { name: String::new(), points }];
    Figure { note: means_note(groups), kind, series, ..figure }
}

/// Returns the share of runs up to each value, with Wilson's intervals; `None` for a share of runs.
fn distribution_figure(groups: &RunGroups<'_>, metric: &RunColumn) -> Option<Figure> {
    if matches!(metric.values, Values::Bool(_)) {
        return None;
    }
    let sorted = Sample::from_runs(groups.values(metric, 0)).sorted();
    let n = sorted.len();
    let steps = n.min(MAX_STEPS);
    let point = |k: usize| {
        let below = ((k + 1) * n).div_ceil(steps);
        let interval = wilson(below as f64, n as f64);
        Point::new(sorted[below - 1], below as f64 / n as f64)
            .with_interval(Some((interval.low, interval.high)))
            .with_runs(n)
    };
    let label = groups.label(metric);
    let points = (0..steps).map(point).collect();
    Some(Figure {
        title: format!("Distribution of {label} over runs"),
        note: format!("95 % intervals, n = {n}."),
        x_label: label.to_string(),
        y_label: "share of runs up to it".into(),
        series: vec![Series { name: String::new(), points }],
        ..Figure::default()
    })
}

/// Returns a figure of a metric without its points.
fn figure(groups: &RunGroups<'_>, metric: &RunColumn, title: String, x_label: String) -> Figure {
    let share = matches!(metric.values, Values::Bool(_));
    let label = groups.label(metric);
    let y_label = if share { format!("{label}: share of runs") } else { label.to_string() };
    Figure { title, x_label, y_label, ..Figure::default() }
}

/// Returns the note on means.
fn means_note(groups: &RunGroups<'_>) -> String {
    format!("Means with 95 % intervals, {}.", run_counts(groups))
}

/// Returns the number of runs of the variants as text.
fn run_counts(groups: &RunGroups<'_>) -> String {
    let of = |v| groups.runs_of(v);
    let all = 0..groups.variants.len();
    let (least, most) = (all.clone().map(of).min().unwrap_or(0), all.map(of).max().unwrap_or(0));
    if least == most {
        format!("{most} run{} a variant", if most == 1 { "" } else { "s" })
    } else {
        format!("{least} to {most} runs a variant")
    }
}
