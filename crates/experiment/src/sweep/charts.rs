//! A summary as figures: each metric over each parameter.
//!
//! A numeric parameter gives lines, one for each combination of the other parameters; if there are
//! more than [`MAX_SERIES`] of these, numeric parameters among them are averaged over, then also
//! parameters of words. A parameter of words gives the runs beside each other, or dots of means. Averages are only
//! taken in full grids. If variants are samples of a box, as in a Latin hypercube, they are points: in the box
//! itself, if it has two sides, and over each side. Without parameters the variants stand beside each other, and a
//! single variant is shown by its distribution over runs.

use super::Label;
use super::groups::{Level, Parameter, RunGroups};
use super::label::capitalized;
use super::run_charts::boxed_runs;
use super::table::RunColumn;
use super::text::with_interval;
use sidestep_document::figure::{Point, Scale};
use sidestep_document::{Figure, FigureKind, Series};
use sidestep_kernel::math;
use sidestep_kernel::ports::ColumnValues;
use sidestep_statistics::least_squares::Fit;
use sidestep_statistics::{Sample, wilson};
use std::collections::BTreeMap;

/// Largest number of series in a figure: more cannot be distinguished.
const MAX_SERIES: usize = 8;

/// Names of the thirds of a sample, from its least values on.
const THIRD_NAMES: [&str; 3] = ["lower", "middle", "upper"];

/// Largest number of steps of a distribution: more are finer than a pixel.
const MAX_STEPS: usize = 200;

pub(super) fn figures(groups: &RunGroups<'_>, metric: &RunColumn) -> Vec<Figure> {
    if is_sampled(groups) {
        return sample_figures(groups, metric);
    }
    if let [only] = &groups.parameters[..]
        && !only.numeric
        && let Some(figure) = run_figure(groups, metric)
    {
        return vec![figure];
    }
    let parameters = 0..groups.parameters.len();
    if !parameters.is_empty() {
        return parameters.filter_map(|p| parameter_figure(groups, metric, p)).collect();
    }
    match groups.variants.len() {
        0 => Vec::new(),
        1 => distribution_figure(groups, metric).into_iter().collect(),
        _ => vec![variant_figure(groups, metric)],
    }
}

/// Returns whether variants are samples of a box of parameters: no two of them lie on a line, or there are many
/// and some number is another in each of them, as in a Latin hypercube with other sides that are whole numbers.
pub(super) fn is_sampled(groups: &RunGroups<'_>) -> bool {
    let numeric = numeric_parameters(groups);
    if numeric.len() < 2 {
        return false;
    }
    let variants = groups.variants.len();
    let has_own_numbers = numeric.iter().any(|p| groups.parameters[*p].levels.len() == variants);
    if variants > MAX_SERIES && has_own_numbers {
        return true;
    }
    numeric.iter().all(|p| {
        let lines = group_by_levels(groups, &other_parameters(groups, *p));
        lines.values().all(|line| line.len() < 2)
    })
}

/// By index into [`RunGroups::parameters`].
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
    let mut choices = vec![all.clone()];
    if groups.is_balanced(parameter) {
        let words = all.into_iter().filter(|p| !groups.parameters[*p].numeric).collect();
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
    let Some(series_parameters) = series_parameters(groups, parameter) else {
        return scatter_figure(groups, metric, parameter);
    };
    let lines = group_by_levels(groups, &series_parameters);
    // Series of one point each would be a scatter figure in many colors.
    if lines.values().all(|variants| variants.len() < 2) {
        return scatter_figure(groups, metric, parameter);
    }
    let mut series = Vec::with_capacity(lines.len());
    for (levels, variants) in &lines {
        let mut names = Vec::with_capacity(levels.len());
        for (p, level) in series_parameters.iter().zip(levels) {
            let other = &groups.parameters[*p];
            names.push(format!("{} = {}", other.name, other.levels[*level].name()));
        }
        let points = line_points(groups, metric, parameter, variants);
        series.push(Series { name: names.join(", "), points });
    }
    let kind = if axis.numeric {
        FigureKind::Lines
    } else {
        FigureKind::Dots { categories: axis.levels.iter().map(|l| l.name()).collect() }
    };
    let over = Label::from_name(&axis.name);
    let title = format!("{} over {}", capitalized(&groups.label(metric)), over.text);
    let mut note = means_note(groups);
    let is_averaged = series_parameters.len() + 1 < groups.parameters.len();
    if is_averaged {
        note += " Means over the other parameters, too.";
    }
    let scales = AxisScales::choose(axis, &series);
    if let Some(slope) = scales.slope(&series) {
        note = format!("{note} {slope}");
    }
    let figure = figure(groups, metric, title, over.to_string());
    Some(Figure { note, kind, series, x_scale: scales.x, y_scale: scales.y, ..figure })
}

/// The scales of a figure over a parameter.
struct AxisScales {
    x: Scale,
    y: Scale,
}

/// Least ratio of the ends of an axis for a logarithmic scale.
const MIN_LOG_RATIO: f64 = 8.0;
/// Least ratio of the widest to the narrowest step between levels: levels that multiply have such, levels that add
/// have not.
const MIN_STEP_RATIO: f64 = 3.0;

impl AxisScales {
    /// Returns logarithmic scales for levels that multiply, as 8, 16, 32, and for values that do so over them, too.
    fn choose(parameter: &Parameter, series: &[Series]) -> Self {
        let mut scales = Self { x: Scale::Linear, y: Scale::Linear };
        let mut levels = Vec::with_capacity(parameter.levels.len());
        for level in &parameter.levels {
            if let Level::Number(value) = level {
                levels.push(*value);
            }
        }
        let steps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let is_multiplied = ratio(&steps).is_some_and(|ratio| ratio >= MIN_STEP_RATIO);
        let is_wide = ratio(&levels).is_some_and(|ratio| ratio >= MIN_LOG_RATIO);
        if !is_multiplied || !is_wide {
            return scales;
        }
        scales.x = Scale::Log;
        let points = series.iter().flat_map(|s| &s.points);
        let ends: Vec<f64> = points.map(|p| p.interval.map_or(p.y, |(low, _)| low)).collect();
        if ratio(&ends).is_some_and(|ratio| ratio >= MIN_LOG_RATIO) {
            scales.y = Scale::Log;
        }
        scales
    }

    /// Returns the exponent with which a single series grows, as text; `None` where an axis is linear.
    fn slope(&self, series: &[Series]) -> Option<String> {
        let [only] = series else { return None };
        if (self.x, self.y) != (Scale::Log, Scale::Log) {
            return None;
        }
        let rows: Vec<Vec<f64>> = only.points.iter().map(|p| vec![1.0, math::ln(p.x)]).collect();
        let logarithms: Vec<f64> = only.points.iter().map(|p| math::ln(p.y)).collect();
        let fit = Fit::new(&rows, &logarithms)?;
        let interval = fit.intervals.as_ref().map(|intervals| intervals[1]);
        let slope = with_interval(Some(fit.coefficients[1]), interval);
        Some(format!("Slope of a straight line through the means on these axes: {slope}."))
    }
}

/// Returns the largest of some positive numbers divided by the least; `None` for fewer than two, or one that is not
/// positive.
fn ratio(values: &[f64]) -> Option<f64> {
    let low = values.iter().copied().reduce(f64::min)?;
    let high = values.iter().copied().reduce(f64::max)?;
    (values.len() > 1 && low > 0.0).then(|| high / low)
}

/// Returns the means of some variants at each level of a parameter.
fn line_points(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    parameter: usize,
    variants: &[usize],
) -> Vec<Point> {
    let axis = &groups.parameters[parameter];
    let mut points = Vec::new();
    for level in 0..axis.levels.len() {
        let at_level = variants.iter().filter(|v| axis.of_variant[**v] == level);
        let group: Vec<usize> = at_level.copied().collect();
        if !group.is_empty() {
            let position = level_position(groups, parameter, level);
            points.extend(groups.mean_over(metric, &group).point(position));
        }
    }
    points
}

/// Words have no value, and stand at their number.
fn level_position(groups: &RunGroups<'_>, parameter: usize, level: usize) -> f64 {
    match groups.parameters[parameter].levels[level] {
        Level::Number(value) => value,
        Level::Text(_) => level as f64,
    }
}

/// Returns a figure with one point per variant; `None` over a parameter of words, which has no positions.
fn scatter_figure(groups: &RunGroups<'_>, metric: &RunColumn, parameter: usize) -> Option<Figure> {
    let axis = &groups.parameters[parameter];
    if !axis.numeric {
        return None;
    }
    let mut points = Vec::with_capacity(groups.variants.len());
    for variant in 0..groups.variants.len() {
        let x = level_position(groups, parameter, axis.of_variant[variant]);
        points.extend(groups.mean_over(metric, &[variant]).point(x));
    }
    let over = Label::from_name(&axis.name);
    let title = format!("{} over {}", capitalized(&groups.label(metric)), over.text);
    let note = format!("A point is a variant. {}", means_note(groups));
    let series = vec![Series { name: String::new(), points }];
    let figure = figure(groups, metric, title, over.to_string());
    Some(Figure { note, kind: FigureKind::Points, series, ..figure })
}

/// Returns samples of a box of parameters as figures: the box itself, if it has two sides, and the metric
/// over each side.
fn sample_figures(groups: &RunGroups<'_>, metric: &RunColumn) -> Vec<Figure> {
    let sides = numeric_parameters(groups);
    let mut figures = Vec::new();
    if let [across, upward] = sides[..] {
        figures.extend(sample_plane_figure(groups, metric, [across, upward]));
    }
    for side in sides {
        figures.extend(scatter_figure(groups, metric, side));
    }
    figures
}

/// Returns the samples where they are in a box of two sides: thirds of the metric are series of their
/// own.
fn sample_plane_figure(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    sides: [usize; 2],
) -> Option<Figure> {
    let mut means = Vec::with_capacity(groups.variants.len());
    for variant in 0..groups.variants.len() {
        if let Some(mean) = groups.mean_over(metric, &[variant]).mean {
            means.push((mean, variant));
        }
    }
    means.sort_by(|a, b| a.0.total_cmp(&b.0));
    let third = means.len().div_ceil(THIRD_NAMES.len()).max(1);
    let mut series = Vec::with_capacity(THIRD_NAMES.len());
    for (part, third_name) in means.chunks(third).zip(THIRD_NAMES) {
        let low = short_number(part[0].0);
        let high = short_number(part[part.len() - 1].0);
        let mut points = Vec::with_capacity(part.len());
        for (_, variant) in part {
            let [x, y] =
                sides.map(|p| level_position(groups, p, groups.parameters[p].of_variant[*variant]));
            points.push(Point::new(x, y));
        }
        series.push(Series { name: format!("{third_name} third: {low} to {high}"), points });
    }
    let [across, upward] = sides.map(|p| Label::from_name(&groups.parameters[p].name));
    // Of a few samples there may be no three thirds.
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
    if let Some(figure) = run_figure(groups, metric) {
        return figure;
    }
    let points = (0..groups.variants.len())
        .filter_map(|variant| groups.mean_over(metric, &[variant]).point(variant as f64))
        .collect();
    let figure = figure(groups, metric, capitalized(&groups.label(metric)), "variant".into());
    let kind = FigureKind::Dots { categories: groups.variants.clone() };
    let series = vec![Series { name: String::new(), points }];
    Figure { note: means_note(groups), kind, series, ..figure }
}

/// Returns the single runs of the variants with their means, if they have room.
fn run_figure(groups: &RunGroups<'_>, metric: &RunColumn) -> Option<Figure> {
    let figure = boxed_runs(groups, metric)?;
    let note = format!("{} {}", means_note(groups), figure.note);
    Some(Figure { note, ..figure })
}

/// Returns the share of runs up to each value, with Wilson's intervals; `None` for a share of runs.
fn distribution_figure(groups: &RunGroups<'_>, metric: &RunColumn) -> Option<Figure> {
    if matches!(metric.values, ColumnValues::Bool(_)) {
        return None;
    }
    let sorted = Sample::from_runs(groups.values(metric, 0)).sorted();
    let n = sorted.len();
    let steps = n.min(MAX_STEPS);
    let mut points = Vec::with_capacity(steps);
    for k in 0..steps {
        let below = ((k + 1) * n).div_ceil(steps);
        let interval = wilson(below as f64, n as f64);
        let point = Point::new(sorted[below - 1], below as f64 / n as f64);
        points.push(point.with_interval(Some((interval.low, interval.high))).with_runs(n));
    }
    let label = groups.label(metric);
    Some(Figure {
        title: format!("Distribution of {label} over runs"),
        note: format!("95 % intervals, n = {n}."),
        x_label: label.to_string(),
        y_label: "cumulative share of runs".into(),
        kind: FigureKind::Steps,
        series: vec![Series { name: String::new(), points }],
        ..Figure::default()
    })
}

/// Returns a figure of a metric without its points.
fn figure(groups: &RunGroups<'_>, metric: &RunColumn, title: String, x_label: String) -> Figure {
    let share = matches!(metric.values, ColumnValues::Bool(_));
    let label = groups.label(metric);
    let y_label = if share { format!("{label}: share of runs") } else { label.to_string() };
    Figure { title, x_label, y_label, ..Figure::default() }
}

fn means_note(groups: &RunGroups<'_>) -> String {
    let means = format!("Means with 95 % intervals, {}.", run_counts(groups));
    let privilege_note = groups.privilege_note.map(|note| format!(" {note}"));
    means + &privilege_note.unwrap_or_default()
}

/// Returns the number of runs of the variants as text.
fn run_counts(groups: &RunGroups<'_>) -> String {
    let runs = (0..groups.variants.len()).map(|variant| groups.runs_of(variant));
    let min = runs.clone().min().unwrap_or(0);
    let max = runs.max().unwrap_or(0);
    if min == max {
        format!("{max} run{} a variant", if max == 1 { "" } else { "s" })
    } else {
        format!("{min} to {max} runs a variant")
    }
}
