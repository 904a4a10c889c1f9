//! Variants x seeds of one metric, which the reader chooses.

use super::{Gallery, GalleryRun, GalleryValue};
use crate::html::safe_json;
use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of seeds beside each other: more are found in the table of runs, which sorts.
pub(super) const MAX_SEEDS: usize = 60;
/// Largest number of variants below each other.
pub(super) const MAX_VARIANTS: usize = 200;

/// Returns the matrix of the first metric, with what a script needs for the others.
pub(super) fn markup(gallery: &Gallery) -> Markup {
    if gallery.metrics.is_empty() {
        return html! {};
    }
    let matrix = Matrix::new(gallery);
    html! {
        section .matrix aria-labelledby="matrix" {
            h2 id="matrix" { "Variants and seeds" }
            p .choice {
                label for="metric" { "Metric " }
                select id="metric" disabled {
                    @for (k, metric) in gallery.metrics.iter().enumerate() { option value=(k) { (metric.label) } }
                }
                span .note id="meaning" { (gallery.metrics[0].meaning) }
            }
            div .scrolled role="region" tabindex="0" aria-label="Table: variants and seeds" {
                table {
                    thead { tr {
                        th scope="col" { "variant" }
                        @for seed in &matrix.seeds { th scope="col" .number { "seed " (seed) } }
                    } }
                    tbody { @for (variant, cells) in &matrix.rows {
                        tr {
                            th scope="row" { (gallery.variants[*variant]) }
                            @for cell in cells { (matrix.cell(*cell)) }
                        }
                    } }
                }
            }
            p .note {
                "The deeper the color, the larger the value. "
                span .mark .high { "\u{25b2}" } " and " span .mark .low { "\u{25bc}" }
                " mark outliers; what is underlined opens a replay."
                @if let Some(rest) = matrix.omitted() { " " (rest) }
            }
            script type="application/json" id="matrix-data" { (PreEscaped(safe_json(&matrix.data()))) }
        }
    }
}

/// The runs of a gallery by variant and seed.
struct Matrix<'a> {
    gallery: &'a Gallery,
    seeds: Vec<u64>,
    /// The variants, with the index of the run of each seed.
    rows: Vec<(usize, Vec<Option<usize>>)>,
    /// Smallest and largest value of each metric.
    ranges: Vec<Option<(f64, f64)>>,
    omitted_seeds: usize,
    omitted_variants: usize,
}

impl<'a> Matrix<'a> {
    fn new(gallery: &'a Gallery) -> Self {
        let mut run_of = BTreeMap::new();
        let mut seeds = BTreeSet::new();
        let mut variants = BTreeSet::new();
        for (index, run) in gallery.runs.iter().enumerate() {
            run_of.insert((run.variant, run.seed), index);
            seeds.insert(run.seed);
            variants.insert(run.variant);
        }
        let omitted_seeds = seeds.len().saturating_sub(MAX_SEEDS);
        let omitted_variants = variants.len().saturating_sub(MAX_VARIANTS);
        let seeds: Vec<u64> = seeds.into_iter().take(MAX_SEEDS).collect();
        let mut rows = Vec::new();
        for variant in variants.into_iter().take(MAX_VARIANTS) {
            let of_seed = seeds.iter().map(|seed| run_of.get(&(variant, *seed)).copied());
            rows.push((variant, of_seed.collect()));
        }
        let ranges = (0..gallery.metrics.len()).map(|metric| range(&gallery.runs, metric));
        let ranges = ranges.collect();
        Self { gallery, seeds, rows, ranges, omitted_seeds, omitted_variants }
    }

    fn cell(&self, run: Option<usize>) -> Markup {
        let Some(index) = run else { return html! { td {} } };
        let run = &self.gallery.runs[index];
        let failed = !run.failure.is_empty();
        let value = run.values.first();
        let level = value.and_then(|value| self.level(0, value));
        let shown = if failed { "failed" } else { value.map_or("", |value| &value.text) };
        let mark = value.and_then(|value| value.mark.as_ref());
        html! {
            td data-run=[(!failed).then_some(index)] style=[level.map(|level| format!("--level:{level}"))] {
                span .mark .high[mark.is_some_and(|mark| mark.is_high)] .low[mark.is_some_and(|mark| !mark.is_high)]
                    title=[mark.map(|mark| &mark.words)] {
                    @if let Some(mark) = mark { (sign(mark.is_high)) }
                }
                @match &run.page {
                    Some(page) => a href=(page) { (shown) },
                    None => span .value { (shown) },
                }
            }
        }
    }

    /// Returns a value's place between the smallest and the largest of its metric, from 0 to 1.
    fn level(&self, metric: usize, value: &GalleryValue) -> Option<f64> {
        let (low, high) = self.ranges[metric]?;
        let number = value.number.filter(|number| number.is_finite())?;
        let level = if high > low { (number - low) / (high - low) } else { 0.0 };
        Some((level * 1000.0).round() / 1000.0)
    }

    /// Returns which runs have no cell; none if all have one.
    fn omitted(&self) -> Option<String> {
        let words = match (self.omitted_seeds, self.omitted_variants) {
            (0, 0) => return None,
            (seeds, 0) => format!("{seeds} more seeds"),
            (0, variants) => format!("{variants} more variants"),
            (seeds, variants) => format!("{seeds} more seeds and {variants} more variants"),
        };
        Some(format!("{words} are not in this matrix."))
    }

    /// Returns the metrics of the runs in the matrix, for its script.
    fn data(&self) -> Value {
        let shown: BTreeSet<usize> =
            self.rows.iter().flat_map(|(_, cells)| cells.iter().flatten().copied()).collect();
        let metrics = &self.gallery.metrics;
        let run = |index: usize| {
            let values = self.gallery.runs[index].values.iter().enumerate();
            let values = values.map(|(metric, value)| {
                let mark = value.mark.as_ref().map(|mark| (sign(mark.is_high), &mark.words));
                json!([value.text, self.level(metric, value), mark])
            });
            (index.to_string(), values.collect::<Value>())
        };
        let runs: serde_json::Map<String, Value> = shown.into_iter().map(run).collect();
        let meanings: Vec<&str> = metrics.iter().map(|metric| metric.meaning.as_str()).collect();
        json!({ "meanings": meanings, "runs": runs })
    }
}

/// Returns the sign of an outlier.
pub(super) fn sign(is_high: bool) -> &'static str {
    if is_high { "\u{25b2}" } else { "\u{25bc}" }
}

/// Returns the smallest and the largest finite value of a metric.
fn range(runs: &[GalleryRun], metric: usize) -> Option<(f64, f64)> {
    let values = runs.iter().filter_map(|run| run.values.get(metric)?.number);
    let mut values = values.filter(|value| value.is_finite());
    let first = values.next()?;
    Some(values.fold((first, first), |(low, high), value| (low.min(value), high.max(value))))
}
