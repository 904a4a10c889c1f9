//! Figures for print: of a given size, without titles and notes, which belong in the text around them, and with labels of
//! the author's choice.

use crate::{SvgFile, chart, slug};
use sidestep_document::document::Block;
use sidestep_document::{Document, Figure, FigureKind};
use sidestep_draw::{DrawError, Style};
use std::collections::BTreeSet;

/// Pixels of an SVG per millimeter, and per point.
const PX_PER_MM: f64 = 96.0 / 25.4;
const PX_PER_PT: f64 = 96.0 / 72.0;

/// The look of figures for print.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintStyle {
    /// Width and height in mm.
    pub size_mm: [f64; 2],
    /// Size of text in points.
    pub font_pt: f64,
    /// Replacements of labels of axes and names of series: the label in the report, and the one to print.
    pub labels: Vec<(String, String)>,
}

impl PrintStyle {
    /// Draws all figures of a document, numbered in order.
    ///
    /// # Errors
    /// When one cannot be drawn at this size.
    pub fn figures(&self, document: &Document) -> Result<Vec<SvgFile>, DrawError> {
        let style = self.style();
        let mut files = Vec::new();
        for figure in figures(document) {
            let chart = chart::draw_chart(&self.for_print(figure), &style)?;
            let stem = format!("{:02}-{}", files.len() + 1, slug(&figure.title));
            files.push(SvgFile { stem, svg: chart.svg, spots: chart.spots });
        }
        Ok(files)
    }

    /// Returns the labels that occur in no figure of a document.
    pub fn unused_labels<'a>(&'a self, document: &Document) -> Vec<&'a str> {
        let used: BTreeSet<&str> = figures(document).flat_map(figure_labels).collect();
        self.labels
            .iter()
            .map(|(from, _)| from.as_str())
            .filter(|from| !used.contains(from))
            .collect()
    }

    fn style(&self) -> Style {
        let [width_px, height_px] = self.size_mm.map(|mm| (mm * PX_PER_MM).round());
        Style { width_px, height_px, font_px: self.font_pt * PX_PER_PT }
    }

    /// Returns a figure without title and note, and with replaced labels.
    fn for_print(&self, figure: &Figure) -> Figure {
        let mut figure = Figure { title: String::new(), note: String::new(), ..figure.clone() };
        self.replace_label(&mut figure.x_label);
        self.replace_label(&mut figure.y_label);
        for series in &mut figure.series {
            self.replace_label(&mut series.name);
        }
        if let FigureKind::Bars { categories } = &mut figure.kind {
            categories.iter_mut().for_each(|category| self.replace_label(category));
        }
        figure
    }

    fn replace_label(&self, label: &mut String) {
        if let Some((_, to)) = self.labels.iter().find(|(from, _)| from == label) {
            label.clone_from(to);
        }
    }
}

fn figures(document: &Document) -> impl Iterator<Item = &Figure> {
    document.blocks.iter().filter_map(|block| match block {
        Block::Figure(figure) => Some(figure),
        _ => None,
    })
}

/// Returns all labels of a figure: of its axes, its categories and its legend.
fn figure_labels(figure: &Figure) -> impl Iterator<Item = &str> {
    let categories = match &figure.kind {
        FigureKind::Bars { categories } => &categories[..],
        _ => &[],
    };
    let series = figure.series.iter().map(|series| &series.name);
    [&figure.x_label, &figure.y_label]
        .into_iter()
        .chain(series)
        .chain(categories)
        .map(String::as_str)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::Series;
    use sidestep_document::figure::Point;

    #[test]
    fn a_figure_for_print_has_its_size_and_words_and_no_title() {
        let points = vec![Point::new(0.0, 1.0), Point::new(1.0, 2.0)];
        let figure = Figure {
            title: "The title".into(),
            note: "The note".into(),
            x_label: "gap (m)".into(),
            y_label: "hits".into(),
            series: vec![Series { name: "calm".into(), points }],
            ..Figure::default()
        };
        let mut document = Document::new("T", "");
        document.figures([figure]);
        let words = [("hits", "Number of hits"), ("calm", "Calm sea"), ("missing", "x")];
        let labels = words.map(|(from, to)| (from.into(), to.into())).to_vec();
        let print = PrintStyle { size_mm: [127.0, 63.5], font_pt: 9.0, labels };
        let files = print.figures(&document).unwrap();
        let svg = &files[0].svg;
        assert!(svg.contains(r#"width="480""#) && svg.contains("Number of hits"), "{svg}");
        assert!(svg.contains("Calm sea") && svg.contains("gap (m)") && !svg.contains(">hits<"));
        assert!(!svg.contains("The title") && !svg.contains("The note"));
        assert_eq!(
            (files[0].stem.as_str(), print.unused_labels(&document)),
            ("01-the-title", vec!["missing"])
        );
    }
}
