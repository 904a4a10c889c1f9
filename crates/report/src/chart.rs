//! Figures as SVG.

use sidestep_document::figure::{Point, Scale};
use sidestep_document::{Figure, FigureKind};
use sidestep_draw::{Axis, Bar, BarChart, BarSeries, DrawError, Mark, Plot, Style};

/// Style of trajectories in the plane: the drawing without axes and labels is about square, as its two ranges are equal.
const SQUARE: Style = Style { height_px: 620.0, ..Style::CHART };

/// Draws a figure of an experiment.
///
/// # Errors
/// When it cannot be drawn.
pub fn chart_svg(figure: &Figure) -> Result<String, DrawError> {
    let style = if figure.kind == FigureKind::Ways { &SQUARE } else { &Style::CHART };
    chart_svg_with_style(figure, style)
}

/// Draws a figure in a style.
///
/// # Errors
/// When it cannot be drawn.
pub(crate) fn chart_svg_with_style(figure: &Figure, style: &Style) -> Result<String, DrawError> {
    match &figure.kind {
        FigureKind::Bars { categories } => bars(figure, categories).to_svg(style),
        FigureKind::Ways => trajectory_plot(figure).to_svg(style),
        FigureKind::Lines => plot(figure, Mark::Line).to_svg(style),
        FigureKind::Bands => plot(figure, Mark::Band).to_svg(style),
        FigureKind::Points => plot(figure, Mark::Points).to_svg(style),
    }
}

fn axis(scale: Scale, label: &str) -> Axis {
    match scale {
        Scale::Linear => Axis::linear(label),
        Scale::Log => Axis::log(label),
    }
}

fn plot(figure: &Figure, mark: Mark) -> Plot {
    let mut plot = Plot::new(&figure.title)
        .x_axis(axis(figure.x_scale, &figure.x_label))
        .y_axis(axis(figure.y_scale, &figure.y_label))
        .note(&figure.note);
    for series in &figure.series {
        plot = plot.series(sidestep_draw::Series {
            label: series.name.clone(),
            points: series.points.iter().map(point).collect(),
            mark,
        });
    }
    plot
}

fn point(p: &Point) -> sidestep_draw::Point {
    sidestep_draw::Point { x: p.x, y: p.y, interval: p.interval }
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
