//! Metrics over time of the variants of a sweep, as figures: means over seeds, with their intervals as bands.

use super::metrics::capitalize;
use crate::sweep::FinishedRuns;
use sidestep_document::Document;
use sidestep_document::figure::{Figure, FigureKind, Point, Series};
use sidestep_experiment::sweep::{Plan, SeriesBand, series_bands};
use sidestep_scenario::{MetricInfo, MetricLabel, metric_label};

/// Largest number of variants in a figure: more lines cannot be told apart.
const MAX_VARIANTS: usize = 8;

/// Appends a figure of each metric that its world is about and that changes, if the sweep has them over time.
pub(super) fn append(
    document: &mut Document,
    plan: &Plan,
    runs: &FinishedRuns,
    meanings: &[MetricInfo],
) {
    let mut bands = series_bands(&runs.table, &runs.series);
    bands.retain(|band| (band.variant as usize) < MAX_VARIANTS);
    let mut metrics: Vec<&str> = Vec::new();
    for band in &bands {
        if !metrics.contains(&band.metric.as_str()) {
            metrics.push(&band.metric);
        }
    }
    let names = plan.names();
    let figures = metrics.iter().filter_map(|metric| {
        let of_metric = bands.iter().filter(|band| band.metric == *metric);
        figure(metric, of_metric, &names, meanings)
    });
    let figures: Vec<Figure> = figures.collect();
    if figures.is_empty() {
        return;
    }
    let beyond = match plan.variants.len() {
        n if n > MAX_VARIANTS => format!(" The first {MAX_VARIANTS} of {n} variants."),
        _ => String::new(),
    };
    let lead = format!(
        "Means over seeds after equal numbers of cycles, with 95 % intervals; a run that is over keeps what it had at its \
         end.{beyond}"
    );
    document.section("Over time").paragraph(lead).figures(figures);
}

/// Returns a metric over the cycles, a line for each variant; none if it never changes.
fn figure<'a>(
    metric: &str,
    bands: impl Iterator<Item = &'a SeriesBand>,
    names: &[String],
    meanings: &[MetricInfo],
) -> Option<Figure> {
    let series: Vec<Series> = bands
        .map(|band| {
            let name = names.get(band.variant as usize).cloned().unwrap_or_default();
            let points = band.points.iter().map(|point| {
                let interval = point.interval.map(|interval| (interval.low, interval.high));
                Point::new(point.cycle as f64, point.mean)
                    .with_interval(interval)
                    .with_runs(point.runs)
            });
            Series { name, points: points.collect() }
        })
        .collect();
    let mut values = series.iter().flat_map(|line| &line.points).map(|point| point.y);
    let first = values.next()?;
    if values.all(|value| value == first) {
        return None;
    }
    let MetricLabel { words, unit, .. } = metric_label(meanings, metric);
    let label = unit.map_or_else(|| words.clone(), |unit| format!("{words} ({unit})"));
    Some(Figure {
        title: format!("{} over time", capitalize(&words)),
        x_label: "cycle".into(),
        y_label: label,
        kind: FigureKind::Bands,
        series,
        ..Figure::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_experiment::sweep::BandPoint;

    fn band(variant: u32, means: [f64; 3]) -> SeriesBand {
        let points = means.into_iter().zip([10, 20, 30]);
        let points = points.map(|(mean, cycle)| BandPoint { cycle, runs: 2, mean, interval: None });
        SeriesBand { variant, metric: "trips".into(), points: points.collect() }
    }

    #[test]
    fn variants_are_lines_of_one_figure_and_what_never_changes_is_none() {
        let names = ["a".to_string(), "b".to_string()];
        let bands = [band(0, [1.0, 2.0, 3.0]), band(1, [1.0, 1.0, 2.0])];
        let drawn = figure("trips", bands.iter(), &names, &[]).expect("it changes");
        let lines: Vec<(&str, f64)> =
            drawn.series.iter().map(|line| (&*line.name, line.points[2].y)).collect();
        assert_eq!(lines, [("a", 3.0), ("b", 2.0)]);
        assert_eq!(drawn.series[0].points[1].x, 20.0);
        let still = [band(0, [1.0; 3]), band(1, [1.0; 3])];
        assert!(figure("trips", still.iter(), &names, &[]).is_none());
    }
}
