//! Figures for print: without titles and notes, which belong in the text around them, of a given size,
//! and with a reader's own words.

use crate::{SvgFile, chart, slug};
use sidestep_document::document::Block;
use sidestep_document::{Document, Figure, FigureKind};
use sidestep_draw::{DrawError, Style};

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
    /// Labels of axes and names of series that are written in other words.
    pub labels: Vec<(String, String)>,
}

impl PrintStyle {
    /// Draws all figures of a document, numbered in order.
    ///
    /// # Errors
    /// When one cannot be drawn at this size.
    pub fn figures(&self, document: &Document) -> Result<Vec<SvgFile>, DrawError> {
        let figures = document.blocks.iter().filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        });
        let style = self.style();
        let file = |(k, figure): (usize, &Figure)| {
            let svg = chart::chart_svg_with_style(&self.without_heading(figure), &style)?;
            Ok(SvgFile { stem: format!("{k:02}-{}", slug(&figure.title)), svg })
        };
        (1..).zip(figures).map(file).collect()
    }

    /// Returns the labels that occur in no figure of a document.
    pub fn unused_labels<'a>(&'a self, document: &Document) -> Vec<&'a str> {
        let is_used = |label: &str| {
            document.blocks.iter().any(|block| match block {
                Block::Figure(figure) => figure_labels(figure).any(|word| word == label),
                _ => false,
            })
        };
        self.labels.iter().map(|(from, _)| from.as_str()).filter(|from| !is_used(from)).collect()
    }

    fn style(&self) -> Style {
        let [width_px, height_px] = self.size_mm.map(|mm| (mm * PX_PER_MM).round());
        Style { width_px, height_px, font_px: self.font_pt * PX_PER_PT }
    }

    fn without_heading(&self, figure: &Figure) -> Figure {
        let mut bare = Figure { title: String::new(), note: String::new(), ..figure.clone() };
        let said = |word: &mut String| {
            if let Some((_, to)) = self.labels.iter().find(|(from, _)| from == word) {
                word.clone_from(to);
            }
        };
        said(&mut bare.x_label);
        said(&mut bare.y_label);
        bare.series.iter_mut().for_each(|series| said(&mut series.name));
        if let FigureKind::Bars { categories } = &mut bare.kind {
            categories.iter_mut().for_each(said);
        }
        bare
    }
}

/// Returns all words at the axes and in the legend of a figure.
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
