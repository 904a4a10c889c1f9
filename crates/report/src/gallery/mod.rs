//! The page of the runs of a sweep: variants x seeds with their metrics, each opening its replay.
//!
//! ```text
//! mod.rs       what the page shows, as plain data     matrix.rs    variants x seeds of one metric
//! runs.rs      pictures, and the table of all runs    gallery.css, gallery.js
//! ```

mod matrix;
mod runs;
#[cfg(test)]
mod tests;

use crate::html::{CONTENT_SECURITY_POLICY, SCRIPT, STYLE, text};
use maud::{DOCTYPE, PreEscaped, html};
use sidestep_document::document::Text;

const GALLERY_STYLE: &str = include_str!("gallery.css");
const GALLERY_SCRIPT: &str = include_str!("gallery.js");

/// The runs of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gallery {
    /// Its subject, shown as the first heading.
    pub title: String,
    /// What is here, in a sentence or two.
    pub lead: Text,
    /// What a reader has to know before: a sweep that is not done, runs that failed.
    pub warnings: Vec<Text>,
    /// How to get replays of other runs.
    pub hint: Text,
    /// The rule by which a run is an outlier.
    pub rule: String,
    /// The metrics, the most telling first.
    pub metrics: Vec<GalleryMetric>,
    /// The names of the variants.
    pub variants: Vec<String>,
    /// The runs, by variant and seed.
    pub runs: Vec<GalleryRun>,
}

/// A metric of the runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GalleryMetric {
    /// Its label, with its unit.
    pub label: String,
    /// The thing counted or measured; may be empty.
    pub meaning: String,
}

/// A run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GalleryRun {
    /// The index of its variant.
    pub variant: usize,
    /// Its seed.
    pub seed: u64,
    /// Its metrics, in the order of those of the gallery.
    pub values: Vec<GalleryValue>,
    /// The path of its replay beside the page; none if there is none.
    pub page: Option<String>,
    /// The address of its picture, as data.
    pub picture: Option<String>,
    /// The reason why it failed; empty if it did not.
    pub failure: String,
}

/// A metric of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GalleryValue {
    /// The value as text; empty if there is none.
    pub text: String,
    /// The value; none if it is no number.
    pub number: Option<f64>,
    /// Why it is an outlier; none if it is none.
    pub mark: Option<GalleryMark>,
}

/// The mark of an outlier.
#[derive(Debug, Clone, PartialEq)]
pub struct GalleryMark {
    /// Whether it is above the others.
    pub is_high: bool,
    /// How far it is from the other runs, in words.
    pub words: String,
    /// How far it is, by which outliers are sorted.
    pub distance: f64,
}

impl GalleryRun {
    /// Returns the outliers among its metrics, with the index of each.
    fn marks(&self) -> impl Iterator<Item = (usize, &GalleryMark)> {
        let marked = self.values.iter().enumerate();
        marked.filter_map(|(k, value)| Some((k, value.mark.as_ref()?)))
    }

    /// Returns how far its farthest metric is from the other runs; 0 if it is no outlier.
    fn distance(&self) -> f64 {
        self.marks().map(|(_, mark)| mark.distance).fold(0.0, f64::max)
    }
}

/// Returns the page; self-contained but for the replays that it opens.
pub fn gallery_page(gallery: &Gallery) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(CONTENT_SECURITY_POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="referrer" content="no-referrer";
                meta name="description" content=(gallery.lead.plain_text());
                meta name="generator" content={ "sidestep " (env!("CARGO_PKG_VERSION")) };
                title { (gallery.title) " · runs" }
                style { (PreEscaped(STYLE)) (PreEscaped(GALLERY_STYLE)) }
            }
            body {
                header {
                    h1 { (gallery.title) }
                    p .lead { (text(&gallery.lead)) }
                }
                main {
                    @for warning in &gallery.warnings { p .warning role="note" { (text(warning)) } }
                    (matrix::markup(gallery))
                    (runs::pictures(gallery))
                    (runs::table(gallery))
                    p .note { (gallery.rule) }
                    p .note { (text(&gallery.hint)) }
                }
                footer {
                    p { "Made by sidestep " (env!("CARGO_PKG_VERSION"))
                        ". This page and its replays load nothing but each other." }
                }
                script { (PreEscaped(SCRIPT)) }
                script { (PreEscaped(GALLERY_SCRIPT)) }
            }
        }
    };
    page.into_string()
}
