//! Pictures as files.

use crate::exit::Failure;
use crate::files::replace;
use crate::worlds::{Pictured, Run};
use sidestep::experiment::{Figure, FigureKind};
use sidestep_draw::{
    Axis, Bar, BarChart, BarSeries, DrawError, Plot, Point, Series, Style, to_png,
};
use sidestep_record::RunFolder;
use std::io::Write;
use std::path::Path;

/// Longer side of a PNG.
const PNG_PX: u32 = 1600;

/// Draws the trajectory picture into a run folder, as SVG and PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub(crate) fn draw_run(run: &dyn Run, folder: &RunFolder) -> Result<(), Failure> {
    let plan = run.plan();
    let origin = match run.cycle() < plan.cycles && !run.is_over() {
        true => {
            format!("{} INCOMPLETE: {} of {} cycles.", origin(run), run.cycle(), plan.cycles)
        }
        false => origin(run),
    };
    let svg = run.picture(Pictured { folder: Some(folder.path()), origin: &origin })?;
    write(&folder.path().join("trajectories.svg"), svg.as_bytes())?;
    write_png(&folder.path().join("trajectories.png"), &svg)
}

/// Small print under a picture.
pub(crate) fn origin(run: &dyn Run) -> String {
    format!("Seed {}, sidestep {}.", run.plan().seed, env!("CARGO_PKG_VERSION"))
}

/// Draws a figure of an experiment.
///
/// # Errors
/// When it cannot be drawn.
pub(crate) fn chart_svg(figure: &Figure) -> Result<String, DrawError> {
    match &figure.kind {
        FigureKind::Bars { categories } => bars(figure, categories).to_svg(&Style::CHART),
        kind => plot(figure, *kind == FigureKind::Lines).to_svg(&Style::CHART),
    }
}

fn plot(figure: &Figure, joined: bool) -> Plot {
    let plot = Plot::new(&figure.title)
        .x_axis(Axis::linear(&figure.x_label))
        .y_axis(Axis::linear(&figure.y_label));
    figure.series.iter().fold(plot, |plot, series| {
        let points = series.points.iter().map(|&(x, y, interval)| match interval {
            Some((low, high)) => Point::new(x, y).with_interval(low, high),
            None => Point::new(x, y),
        });
        let (name, points) = (&series.name, points.collect());
        plot.series(if joined { Series::line(name, points) } else { Series::points(name, points) })
    })
}

fn bars(figure: &Figure, categories: &[String]) -> BarChart {
    let chart = BarChart::new(&figure.title, categories)
        .x_label(&figure.x_label)
        .y_axis(Axis::linear(&figure.y_label));
    figure.series.iter().fold(chart, |chart, series| {
        let bars = (0..categories.len()).map(|k| bar_at(&series.points, k)).collect();
        chart.series(BarSeries::new(&series.name, bars))
    })
}

/// The bar of the category `k`; a missing one has no value, so that nothing is drawn.
fn bar_at(points: &[sidestep::experiment::figure::Point], k: usize) -> Bar {
    let point = points.iter().find(|(x, ..)| *x == k as f64);
    match point {
        Some(&(_, value, Some((low, high)))) => Bar::new(value).with_interval(low, high),
        Some(&(_, value, None)) => Bar::new(value),
        None => Bar::new(f64::NAN),
    }
}

/// Writes an SVG picture as PNG.
///
/// # Errors
/// When it cannot be drawn or written.
pub(crate) fn write_png(path: &Path, svg: &str) -> Result<(), Failure> {
    write(path, &to_png(svg, PNG_PX)?)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    replace(path, |file| file.write_all(bytes))
}
