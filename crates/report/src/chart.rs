//! Figures as SVG.

use crate::series_looks::SeriesLooks;
use sidestep_document::figure::{Point, Scale, SlotStats};
use sidestep_document::{Figure, FigureKind, Series};
use sidestep_draw::{
    Axis, Bar, BarChart, BarSeries, DrawError, DrawnChart, ForestChart, ForestMark, ForestSeries,
    HeatChart, Mark, Plot, QuartileBox, Slot, SlotChart, Style,
};

/// Style of figures in a report: two of them stand beside each other, and one on a telephone is still readable.
const PAGE: Style = Style { width_px: 520.0, height_px: 370.0, font_px: 13.0 };
/// Style of trajectories in the plane: the drawing without axes and labels is about square, as its two ranges are equal.
const SQUARE: Style = Style { height_px: 500.0, ..PAGE };
/// Style of forests, whose rows have names and words beside them.
const WIDE: Style = Style { width_px: 860.0, ..PAGE };

/// Draws a figure of an experiment for a page, which shows its title and its note itself.
///
/// # Errors
/// When it cannot be drawn.
pub(crate) fn page_chart(figure: &Figure) -> Result<DrawnChart, DrawError> {
    let style = match figure.kind {
        FigureKind::Ways => &SQUARE,
        FigureKind::Forest { .. } => &WIDE,
        _ => &PAGE,
    };
    let bare = Figure { title: String::new(), note: String::new(), ..figure.clone() };
    draw_chart(&bare, style)
}

/// Draws a figure in a style.
///
/// # Errors
/// When it cannot be drawn.
pub(crate) fn draw_chart(figure: &Figure, style: &Style) -> Result<DrawnChart, DrawError> {
    match &figure.kind {
        FigureKind::Bars { categories } => bars(figure, categories).draw(style),
        FigureKind::Dots { categories } => bars(figure, categories).dots().draw(style),
        FigureKind::Ways => trajectory_plot(figure).draw(style),
        FigureKind::Lines => plot(figure, Mark::Line).draw(style),
        FigureKind::Bands => plot(figure, Mark::Band).draw(style),
        FigureKind::Points => plot(figure, Mark::Points).draw(style),
        FigureKind::Steps => plot(figure, Mark::Steps).draw(style),
        FigureKind::Front { corners } => {
            plot(figure, Mark::Points).reference_path("front", corners.clone()).draw(style)
        }
        FigureKind::Forest { rows, texts, words } => {
            forest(figure, rows, texts).words(&words.heading, &words.unmarked).draw(style)
        }
        FigureKind::Runs { slots, is_joined, has_zero_line, has_bars, legend } => {
            let mut chart = SlotChart::new(
                &figure.title,
                axis(figure.y_scale, &figure.y_label),
                chart_slots(figure, slots),
            );
            if *is_joined {
                chart = chart.joined();
            }
            if *has_zero_line {
                chart = chart.zero_line();
            }
            if *has_bars {
                chart = chart.bars();
            }
            let chart = chart.legend_words(&legend.seed, &legend.mean);
            chart.x_label(&figure.x_label).note(&figure.note).draw(style)
        }
        FigureKind::Heat { columns, value_label } => heat(figure, columns, value_label).draw(style),
    }
}

fn forest(figure: &Figure, rows: &[String], texts: &[Vec<String>]) -> ForestChart {
    let mut chart = ForestChart::new(&figure.title, axis(figure.x_scale, &figure.x_label), rows)
        .note(&figure.note);
    for (series, texts) in figure.series.iter().zip(texts) {
        let mark = |(row, text): (usize, &String)| {
            let point = series.points.iter().find(|p| p.x == row as f64);
            ForestMark {
                value: point.map_or(f64::NAN, |p| p.y),
                interval: point.and_then(|p| p.interval),
                text: text.clone(),
            }
        };
        let marks = texts.iter().enumerate().map(mark).collect();
        chart = chart.series(ForestSeries { label: series.name.clone(), marks });
    }
    chart
}

fn chart_slots(figure: &Figure, stats: &[SlotStats]) -> Vec<Slot> {
    let slot = |(series, stats): (&Series, &SlotStats)| Slot {
        label: series.name.clone(),
        values: series.points.iter().map(|p| p.y).collect(),
        mean: stats.mean.map(|mean| (mean, stats.interval)),
        quartiles: stats.five_numbers.map(|[low, first, median, third, high]| QuartileBox {
            whiskers: [low, high],
            quartiles: [first, median, third],
        }),
    };
    figure.series.iter().zip(stats).map(slot).collect()
}

fn heat(figure: &Figure, columns: &[String], value_label: &str) -> HeatChart {
    let row = |series: &Series| {
        let cell = |k| series.points.iter().find(|p| p.x == k as f64).map_or(f64::NAN, |p| p.y);
        (0..columns.len()).map(cell).collect()
    };
    HeatChart {
        title: figure.title.clone(),
        note: figure.note.clone(),
        x_label: figure.x_label.clone(),
        y_label: figure.y_label.clone(),
        value_label: value_label.into(),
        columns: columns.to_vec(),
        rows: figure.series.iter().map(|series| series.name.clone()).collect(),
        values: figure.series.iter().map(row).collect(),
    }
}

fn axis(scale: Scale, label: &str) -> Axis {
    match scale {
        Scale::Linear => Axis::linear(label),
        Scale::Log => Axis::log(label),
    }
}

fn plot(figure: &Figure, mark: Mark) -> Plot {
    let mut x_axis = axis(figure.x_scale, &figure.x_label);
    if mark == Mark::Line
        && let Some(levels) = few_levels(&figure.series, figure.x_scale)
    {
        x_axis = x_axis.ticks(levels);
    }
    let mut y_axis = axis(figure.y_scale, &figure.y_label);
    if mark == Mark::Band {
        (x_axis, y_axis) = band_axes(figure, x_axis, y_axis);
    }
    let mut plot = Plot::new(&figure.title)
        .x_axis(x_axis)
        .interval_label(&figure.interval_words)
        .y_axis(y_axis)
        .note(&figure.note);
    let SeriesLooks { looks, legend } = SeriesLooks::new(&figure.series);
    for (series, mut look) in figure.series.iter().zip(looks) {
        // Steps of several series lie over each other where these begin and end.
        if mark == Mark::Steps && legend.len() < 2 {
            look.dash = look.color;
        }
        plot = plot.series(sidestep_draw::Series {
            label: series.name.clone(),
            points: series.points.iter().map(point).collect(),
            mark,
            look: Some(look),
        });
    }
    plot.legend_groups(legend)
}

/// Relative difference of two values that may come from rounding alone.
const MAX_ROUNDING: f64 = 1e-9;
/// Part of an axis of values that stays free beyond the last one.
const AXIS_MARGIN: f64 = 0.04;

/// Returns axes for bands over time: they end where the run does, and an interval of what is never below zero does not
/// pull the axis there.
fn band_axes(figure: &Figure, x_axis: Axis, y_axis: Axis) -> (Axis, Axis) {
    let points = || figure.series.iter().flat_map(|s| &s.points).filter(|p| p.y.is_finite());
    let ends = |point: &Point| {
        let (low, high) = point.interval.unwrap_or((point.y, point.y));
        [low, high]
    };
    let (Some(mut x), Some((lowest_mean, _)), Some((mut low, high))) = (
        extent(points().map(|p| p.x)),
        extent(points().map(|p| p.y)),
        extent(points().flat_map(ends)),
    ) else {
        return (x_axis, y_axis);
    };
    // A series begins with the cycle after the start, which a reader takes for the start.
    if x.0 > 0.0 && x.0 < AXIS_MARGIN * x.1 {
        x.0 = 0.0;
    }
    let margin = AXIS_MARGIN * (high - low);
    // Zero belongs to an axis that comes near it.
    low = if lowest_mean >= 0.0 && low < 0.4 * high { 0.0 } else { low - margin };
    // What differs by rounding alone is one value, around which an axis makes room by itself.
    let is_range = |from: f64, to: f64| to - from > MAX_ROUNDING * from.abs().max(to.abs());
    let is_linear = |scale: Scale| scale == Scale::Linear;
    let has_x = is_linear(figure.x_scale) && is_range(x.0, x.1);
    let has_y = is_linear(figure.y_scale) && is_range(low, high);
    let x_axis = if has_x { x_axis.range(x.0, x.1) } else { x_axis };
    let y_axis = if has_y { y_axis.range(low, high + margin) } else { y_axis };
    (x_axis, y_axis)
}

/// Largest number of levels that all have a tick.
const MAX_LEVEL_TICKS: usize = 7;
/// Least distance of two of them as a fraction of a linear axis, least ratio on a logarithmic one, and the longest label:
/// else they would lie over each other.
const MIN_TICK_GAP: f64 = 0.09;
const MIN_TICK_RATIO: f64 = 1.5;
const MAX_TICK_CHARS: usize = 5;

/// Returns the places of points along the horizontal axis in rising order, if these are few levels of all series: a reader
/// sees where was measured.
fn few_levels(series: &[Series], scale: Scale) -> Option<Vec<f64>> {
    let mut levels: Vec<f64> = Vec::new();
    for x in series.iter().flat_map(|series| &series.points).map(|point| point.x) {
        if x.is_finite() && !levels.contains(&x) {
            levels.push(x);
        }
        if levels.len() > MAX_LEVEL_TICKS {
            return None;
        }
    }
    levels.sort_by(f64::total_cmp);
    let [first, .., last] = levels[..] else { return None };
    let are_apart = levels.windows(2).all(|pair| match scale {
        Scale::Linear => pair[1] - pair[0] >= MIN_TICK_GAP * (last - first),
        Scale::Log => pair[1] >= MIN_TICK_RATIO * pair[0],
    });
    // Thirds have more digits than an axis has room for.
    let are_short = levels.iter().all(|x| x.to_string().len() <= MAX_TICK_CHARS);
    (are_apart && are_short).then_some(levels)
}

fn point(p: &Point) -> sidestep_draw::Point {
    sidestep_draw::Point { x: p.x, y: p.y, interval: p.interval, x_interval: p.x_interval }
}

/// Half of the range of an axis of trajectories, as a fraction of the larger extent: a margin of 4 % on each side, so that no
/// trajectory touches the frame.
const HALF_RANGE_FRACTION: f64 = 0.54;

/// Returns a plot with axes of the same range, around the middle of the trajectories: otherwise angles would be distorted.
fn trajectory_plot(figure: &Figure) -> Plot {
    let plot = plot(figure, Mark::Path);
    let points = figure.series.iter().flat_map(|s| &s.points);
    let Some(x) = extent(points.clone().map(|p| p.x)) else { return plot };
    let Some(y) = extent(points.map(|p| p.y)) else { return plot };
    let half = HALF_RANGE_FRACTION * (x.1 - x.0).max(y.1 - y.0);
    if half <= 0.0 || !half.is_finite() {
        return plot;
    }
    plot.x_axis(centered_axis(&figure.x_label, x, half)).y_axis(centered_axis(
        &figure.y_label,
        y,
        half,
    ))
}

/// Returns an axis that reaches `half` to both sides of the middle of an extent.
fn centered_axis(label: &str, (low, high): (f64, f64), half: f64) -> Axis {
    let middle = 0.5 * (low + high);
    Axis::linear(label).range(middle - half, middle + half)
}

/// Returns the smallest and the largest of the finite values.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| v.is_finite()).fold(None, |extent, v| match extent {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

fn bars(figure: &Figure, categories: &[String]) -> BarChart {
    let mut chart = BarChart::new(&figure.title, categories)
        .x_label(&figure.x_label)
        .y_axis(axis(figure.y_scale, &figure.y_label))
        .interval_label(&figure.interval_words)
        .note(&figure.note);
    for series in &figure.series {
        let bars = (0..categories.len()).map(|k| bar_at(&series.points, k)).collect();
        chart = chart.series(BarSeries::new(&series.name, bars));
    }
    chart
}

/// Returns the bar of the category `k`; a missing one has no value, so that nothing is drawn.
fn bar_at(points: &[Point], k: usize) -> Bar {
    let point = points.iter().find(|p| p.x == k as f64);
    point.map_or(Bar::new(f64::NAN), |p| Bar { value: p.y, interval: p.interval })
}
