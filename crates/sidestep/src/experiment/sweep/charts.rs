//! A summary as figures: each metric over each parameter.
//!
//! A numeric parameter gives lines, one for each combination of the other parameters; where
//! these are more than [`SERIES`], numbers among them are averaged over, then words too. A
//! parameter of words gives bars. Averages are only taken in full grids. Where no line would
//! have two points, as in a Latin hypercube, the variants are points. Without parameters the
//! variants are bars, and one variant is its distribution over runs.

use super::Label;
use super::groups::Groups;
use super::label::sentence;
use super::table::RunColumn;
use crate::statistics::{Sample, wilson};
use sidestep_document::figure::Point;
use sidestep_document::{Figure, FigureKind, Series};
use sidestep_kernel::ports::Values;
use std::collections::BTreeMap;

/// Series in a figure at most: more cannot be told apart.
const SERIES: usize = 8;

/// Steps of a distribution at most.
const STEPS: usize = 200;

pub(super) fn figures(groups: &Groups<'_>, metric: &RunColumn) -> Vec<Figure> {
    let over = |p| over_parameter(groups, metric, p);
    let over: Vec<Figure> = (0..groups.parameters.len()).filter_map(over).collect();
    match (groups.parameters.len(), groups.variants.len()) {
        (0, 0) => Vec::new(),
        (0, 1) => distribution(groups, metric).into_iter().collect(),
        (0, _) => vec![of_variants(groups, metric)],
        _ => over,
    }
}

/// Whether variants share so few values that no two of them lie on a line.
pub(super) fn is_scattered(groups: &Groups<'_>) -> bool {
    let numeric: Vec<usize> =
        (0..groups.parameters.len()).filter(|p| groups.parameters[*p].numeric).collect();
    let alone = |p: &usize| grouped(groups, &others(groups, *p)).values().all(|g| g.len() < 2);
    numeric.len() > 1 && numeric.iter().all(alone)
}

fn others(groups: &Groups<'_>, parameter: usize) -> Vec<usize> {
    (0..groups.parameters.len()).filter(|p| *p != parameter).collect()
}

/// The variants by their levels of these parameters.
fn grouped(groups: &Groups<'_>, parameters: &[usize]) -> BTreeMap<Vec<usize>, Vec<usize>> {
    let mut found: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    for variant in 0..groups.variants.len() {
        let levels = parameters.iter().map(|p| groups.parameters[*p].of_variant[variant]);
        found.entry(levels.collect()).or_default().push(variant);
    }
    found
}

/// The parameters that tell the series of a figure over `parameter` apart; `None` where there
/// would be too many, and an average would mix.
fn apart(groups: &Groups<'_>, parameter: usize) -> Option<Vec<usize>> {
    let all = others(groups, parameter);
    let words: Vec<usize> =
        all.iter().copied().filter(|p| !groups.parameters[*p].numeric).collect();
    let balanced = groups.is_balanced(parameter);
    let mut choices = vec![all.clone()];
    if balanced {
        choices.extend([words, Vec::new()]);
    }
    choices.into_iter().find(|choice| grouped(groups, choice).len() <= SERIES)
}

fn over_parameter(groups: &Groups<'_>, metric: &RunColumn, parameter: usize) -> Option<Figure> {
    let axis = &groups.parameters[parameter];
    let scattered = || axis.numeric.then(|| scatter(groups, metric, parameter));
    let Some(apart) = apart(groups, parameter) else { return scattered() };
    let lines = grouped(groups, &apart);
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
            groups.mean_over(metric, &group).point(place(groups, parameter, level))
        });
        Series { name: named.collect::<Vec<_>>().join(", "), points: points.collect() }
    });
    let kind = if axis.numeric {
        FigureKind::Lines
    } else {
        FigureKind::Bars { categories: axis.levels.iter().map(|l| l.name()).collect() }
    };
    let averaged = apart.len() + 1 < groups.parameters.len();
    let over = Label::of(&axis.name);
    let title = format!(
        "{} over {}{} (means with 95 % intervals, {})",
        sentence(&Label { unit: None, ..Label::of(&metric.name) }),
        over.text,
        if averaged { ", mean over other parameters" } else { "" },
        runs(groups),
    );
    Some(figure(title, over.to_string(), metric, kind, series.collect()))
}

/// Where a level stands on the axis.
fn place(groups: &Groups<'_>, parameter: usize, level: usize) -> f64 {
    match groups.parameters[parameter].levels[level] {
        super::groups::Level::Number(value) => value,
        super::groups::Level::Text(_) => level as f64,
    }
}

/// Each variant a point.
fn scatter(groups: &Groups<'_>, metric: &RunColumn, parameter: usize) -> Figure {
    let axis = &groups.parameters[parameter];
    let point = |variant: usize| {
        let x = place(groups, parameter, axis.of_variant[variant]);
        groups.mean_over(metric, &[variant]).point(x)
    };
    let points = (0..groups.variants.len()).filter_map(point).collect();
    let over = Label::of(&axis.name);
    let title = format!(
        "{} over {}, one point a variant (means with 95 % intervals, {})",
        sentence(&Label { unit: None, ..Label::of(&metric.name) }),
        over.text,
        runs(groups),
    );
    let series = vec![Series { name: String::new(), points }];
    figure(title, over.to_string(), metric, FigureKind::Points, series)
}

fn of_variants(groups: &Groups<'_>, metric: &RunColumn) -> Figure {
    let point = |variant: usize| groups.mean_over(metric, &[variant]).point(variant as f64);
    let points = (0..groups.variants.len()).filter_map(point).collect();
    let title = format!(
        "{} (means with 95 % intervals, {})",
        sentence(&Label { unit: None, ..Label::of(&metric.name) }),
        runs(groups),
    );
    let kind = FigureKind::Bars { categories: groups.variants.clone() };
    figure(title, "variant".into(), metric, kind, vec![Series { name: String::new(), points }])
}

/// The share of runs up to each value, with Wilson's intervals. A share of runs has none.
fn distribution(groups: &Groups<'_>, metric: &RunColumn) -> Option<Figure> {
    if matches!(metric.values, Values::Bool(_)) {
        return None;
    }
    let sorted = Sample::of(groups.values(metric, 0)).sorted();
    let n = sorted.len();
    let steps = n.min(STEPS);
    let point = |k: usize| {
        let below = ((k + 1) * n).div_ceil(steps);
        let interval = wilson(below as f64, n as f64);
        Point::new(sorted[below - 1], below as f64 / n as f64)
            .with_interval(Some((interval.low, interval.high)))
            .of_runs(n)
    };
    let title = format!(
        "Distribution of {} over runs (95 % intervals, n = {n})",
        Label { unit: None, ..Label::of(&metric.name) }
    );
    let points = (0..steps).map(point).collect();
    Some(Figure {
        title,
        x_label: Label::of(&metric.name).to_string(),
        y_label: "share of runs up to it".into(),
        series: vec![Series { name: String::new(), points }],
        ..Figure::default()
    })
}

fn figure(
    title: String,
    x_label: String,
    metric: &RunColumn,
    kind: FigureKind,
    series: Vec<Series>,
) -> Figure {
    let share = matches!(metric.values, Values::Bool(_));
    let label = Label::of(&metric.name);
    let y_label = if share { format!("{label}: share of runs") } else { label.to_string() };
    Figure { title, x_label, y_label, kind, series, ..Figure::default() }
}

/// How many runs the variants have.
fn runs(groups: &Groups<'_>) -> String {
    let of = |v| groups.runs_of(v);
    let all = 0..groups.variants.len();
    let (least, most) = (all.clone().map(of).min().unwrap_or(0), all.map(of).max().unwrap_or(0));
    if least == most {
        format!("{most} runs a variant")
    } else {
        format!("{least} to {most} runs a variant")
    }
}
