//! Figures as SVG.

use sidestep_document::figure::{Point, Scale, Series};
use sidestep_document::{Figure, FigureKind};
use sidestep_draw::{Axis, Bar, BarChart, BarSeries, DrawError, Mark, Plot, Style};

/// Style of tracks in the plane: about square, so that a circle looks like one.
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
    let plotted = |mark| plot(figure, mark).to_svg(style);
    match &figure.kind {
        FigureKind::Bars { categories } => bars(figure, categories).to_svg(style),
        FigureKind::Ways => trajectory_plot(figure).to_svg(style),
        FigureKind::Lines => plotted(Mark::Line),
        FigureKind::Bands => plotted(Mark::Band),
        FigureKind::Points => plotted(Mark::Points),
    }
}

fn axis(scale: Scale, label: &str) -> Axis {
    match scale {
        Scale::Linear => Axis::linear(label),
        Scale::Log => Axis::log(label),
    }
}

fn plot(figure: &Figure, mark: Mark) -> Plot {
    let plot = Plot::new(&figure.title)
        .x_axis(axis(figure.x_scale, &figure.x_label))
        .y_axis(axis(figure.y_scale, &figure.y_label))
        .note(&figure.note);
    let series = |s: &Series| sidestep_draw::Series {
        label: s.name.clone(),
        points: s.points.iter().map(point).collect(),
        mark,
    };
    figure.series.iter().map(series).fold(plot, Plot::series)
}

fn point(p: &Point) -> sidestep_draw::Point {
    sidestep_draw::Point { x: p.x, y: p.y, interval: p.interval }
}

/// Returns a plot with axes that span the same length around the middle of the drawing.
fn trajectory_plot(figure: &Figure) -> Plot {
    let plot = plot(figure, Mark::Path);
    let points = || figure.series.iter().flat_map(|s| &s.points);
    let (x, y) = (extent(points().map(|p| p.x)), extent(points().map(|p| p.y)));
    let (Some(x), Some(y)) = (x, y) else { return plot };
    let half = 0.54 * (x.1 - x.0).max(y.1 - y.0);
    if half <= 0.0 || !half.is_finite() {
        return plot;
    }
    let around = |(low, high): (f64, f64)| (0.5 * (low + high) - half, 0.5 * (low + high) + half);
    let spanning = |label: &str, (low, high)| Axis::linear(label).range(low, high);
    plot.x_axis(spanning(&figure.x_label, around(x))).y_axis(spanning(&figure.y_label, around(y)))
}

/// Returns the smallest and the largest of the finite values.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| v.is_finite()).fold(None, |extent, v| match extent {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

fn bars(figure: &Figure, categories: &[String]) -> BarChart {
    let chart = BarChart::new(&figure.title, categories)
        .x_label(&figure.x_label)
        .y_axis(axis(figure.y_scale, &figure.y_label))
        .note(&figure.note);
    let series = |s: &Series| {
        BarSeries::new(&s.name, (0..categories.len()).map(|k| bar_at(&s.points, k)).collect())
    };
    figure.series.iter().map(series).fold(chart, BarChart::series)
}

/// Returns the bar of the category `k`; a missing one has no value, so that nothing is drawn.
fn bar_at(points: &[Point], k: usize) -> Bar {
    let point = points.iter().find(|p| p.x == k as f64);
    point.map_or(Bar::new(f64::NAN), |p| Bar { value: p.y, interval: p.interval })
}
