//! Pictures of runs that have a replay, and the table of all runs.

use super::matrix::sign;
use super::{Gallery, GalleryMark, GalleryRun};
use crate::html::wide_table;
use maud::{Markup, html};

/// Largest number of pictures: a page of more is slow, and nobody looks through them.
const MAX_PICTURES: usize = 200;
/// Largest number of rows of the table of runs: a browser sorts as many at once.
const MAX_ROWS: usize = 5000;
/// Number of metrics below a picture; its outliers come beside them.
const PICTURE_METRICS: usize = 3;

/// Returns the pictures of the runs that have a replay, outliers first.
pub(super) fn pictures(gallery: &Gallery) -> Markup {
    let mut with_page: Vec<&GalleryRun> =
        gallery.runs.iter().filter(|run| run.page.is_some()).collect();
    with_page.sort_by(|a, b| b.distance().total_cmp(&a.distance()));
    let omitted = with_page.len().saturating_sub(MAX_PICTURES);
    html! {
        section .replays aria-labelledby="replays" {
            h2 id="replays" { "Replays" }
            ul { @for run in with_page.iter().take(MAX_PICTURES) { (card(gallery, run)) } }
            @if omitted > 0 { p .note { (omitted) " more replays are in the table below." } }
        }
    }
}

fn card(gallery: &Gallery, run: &GalleryRun) -> Markup {
    let variant = &gallery.variants[run.variant];
    html! {
        li {
            a href=[run.page.as_deref()] {
                @if let Some(picture) = &run.picture { img src=(picture) alt="" loading="lazy"; }
                span .name { (variant) " · seed " (run.seed) }
            }
            @for (metric, mark) in run.marks() {
                p .outlier {
                    (badge(mark)) " "
                    (gallery.metrics[metric].label) " " (run.values[metric].text) ": " (mark.words)
                }
            }
            dl {
                @for (metric, value) in gallery.metrics.iter().zip(&run.values).take(PICTURE_METRICS) {
                    div { dt { (metric.label) } dd { (value.text) } }
                }
            }
        }
    }
}

fn badge(mark: &GalleryMark) -> Markup {
    html! {
        span .mark .high[mark.is_high] .low[!mark.is_high] aria-hidden="true" { (sign(mark.is_high)) }
    }
}

/// Returns the table of runs: all that fit, outliers and those with a replay first where they are too many.
pub(super) fn table(gallery: &Gallery) -> Markup {
    let rows = listed_runs(gallery);
    let omitted = gallery.runs.len() - rows.len();
    let title = "All runs";
    html! {
        section .all aria-labelledby="runs" {
            h2 id="runs" { (title) }
            fieldset .choice disabled {
                legend { "Show" }
                @for (value, words) in [("all", "all"), ("outlier", "outliers"), ("replay", "with a replay")] {
                    label { input type="radio" name="shown" value=(value) checked[value == "all"]; " " (words) }
                }
            }
            (wide_table(title, grid(gallery, &rows)))
            @if omitted > 0 {
                p .note { (omitted) " more runs are not listed here: the table of the sweep has all." }
            }
        }
    }
}

fn listed_runs(gallery: &Gallery) -> Vec<&GalleryRun> {
    let mut order: Vec<usize> = (0..gallery.runs.len()).collect();
    let is_plain = |run: &GalleryRun| run.page.is_none() && run.marks().next().is_none();
    order.sort_by_key(|&k| is_plain(&gallery.runs[k]));
    order.truncate(MAX_ROWS);
    order.sort_unstable();
    order.into_iter().map(|k| &gallery.runs[k]).collect()
}

fn grid(gallery: &Gallery, rows: &[&GalleryRun]) -> Markup {
    let is_number: Vec<bool> = (0..gallery.metrics.len())
        .map(|k| rows.iter().any(|run| run.values.get(k).is_some_and(|v| v.number.is_some())))
        .collect();
    html! {
        table .sortable {
            thead { tr {
                th scope="col" { "variant" }
                th scope="col" .number { "seed" }
                th scope="col" { "replay" }
                th scope="col" .number { "outlier in" }
                @for (metric, number) in gallery.metrics.iter().zip(&is_number) {
                    th scope="col" .number[*number] title=(metric.meaning) { (metric.label) }
                }
            } }
            tbody { @for run in rows { (row(gallery, run, &is_number)) } }
        }
    }
}

fn row(gallery: &Gallery, run: &GalleryRun, is_number: &[bool]) -> Markup {
    let outliers = run.marks().count();
    html! {
        tr data-outlier[outliers > 0] data-replay[run.page.is_some()] {
            th scope="row" { (gallery.variants[run.variant]) }
            td { (run.seed) }
            td .words {
                @if let Some(page) = &run.page {
                    a href=(page) aria-label={ "Replay of " (gallery.variants[run.variant]) ", seed " (run.seed) } { "replay" }
                } @else if !run.failure.is_empty() {
                    span .failed title=(run.failure) { "failed" }
                }
            }
            td { @if outliers > 0 { (outliers) } }
            // A run that failed has no values, and a cell of each column nevertheless: columns are found by their place.
            @for _ in run.values.len()..is_number.len() { td {} }
            @for (k, value) in run.values.iter().enumerate() {
                td .words[!is_number[k]] title=[value.mark.as_ref().map(|mark| &mark.words)] {
                    (value.text) @if let Some(mark) = &value.mark { " " (badge(mark)) }
                }
            }
        }
    }
}
