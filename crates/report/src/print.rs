//! Figures for print: of a given size, without titles and notes, which belong in the text around them, and with labels of
//! the author's choice.

use crate::{SvgFile, chart, slug};
use sidestep_document::document::Block;
use sidestep_document::{Document, Figure, FigureKind};
use sidestep_draw::{DrawError, DrawnChart, Style, to_dark};
use std::collections::BTreeSet;

/// Pixels of an SVG per millimeter, and per point.
const PX_PER_MM: f64 = 96.0 / 25.4;
const PX_PER_PT: f64 = 96.0 / 72.0;

/// A figure for print.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintFigure {
    /// The drawing and its name.
    pub file: SvgFile,
    /// The title, which is not in the drawing.
    pub title: String,
    /// Its data as comma-separated values.
    pub csv: String,
}

/// Where figures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FigureLook {
    /// On paper, in the size of a column.
    #[default]
    Paper,
    /// On a screen, from afar: lines and marks grow with the text.
    Talk,
    /// The same on a dark ground.
    Dark,
}

impl FigureLook {
    /// Returns the usual width and height in mm: a column of a journal, or a slide.
    pub fn size_mm(self) -> [f64; 2] {
        match self {
            Self::Paper => [85.0, 60.0],
            Self::Talk | Self::Dark => [240.0, 135.0],
        }
    }

    /// Returns the usual size of text in points.
    pub fn font_pt(self) -> f64 {
        match self {
            Self::Paper => 8.0,
            Self::Talk | Self::Dark => 16.0,
        }
    }

    /// Returns the least width and height in mm, rounded up: that of the smallest drawing.
    pub fn least_mm(self) -> f64 {
        (Style::MIN_SIDE_PX * self.scale() / PX_PER_MM).ceil()
    }

    /// Returns how much larger lines and marks are than on paper.
    fn scale(self) -> f64 {
        match self {
            Self::Paper => 1.0,
            Self::Talk | Self::Dark => 1.8,
        }
    }
}

/// The look of figures for print.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintStyle {
    /// Where they are shown.
    pub look: FigureLook,
    /// Width and height in mm.
    pub size_mm: [f64; 2],
    /// Size of text in points.
    pub font_pt: f64,
    /// Replacements of labels of axes and names of series: the label in the report, and the one to print.
    pub labels: Vec<(String, String)>,
}

impl PrintStyle {
    /// Draws all figures of a document, numbered in order after `before` others.
    ///
    /// # Errors
    /// When one cannot be drawn at this size.
    pub fn figures(
        &self,
        document: &Document,
        before: usize,
    ) -> Result<Vec<PrintFigure>, DrawError> {
        let style = self.layout();
        let mut printed = Vec::new();
        for figure in figures(document) {
            let for_print = self.for_print(figure);
            let DrawnChart { svg, .. } = chart::draw_chart(&for_print, &style)?;
            let number = before + printed.len() + 1;
            printed.push(self.finish(number, figure.title.clone(), &svg, for_print.csv()));
        }
        Ok(printed)
    }

    /// Returns a drawing in the layout of this style as a figure with a number.
    pub fn finish(&self, number: usize, title: String, svg: &str, csv: String) -> PrintFigure {
        let svg = enlarged(svg, self.look.scale());
        let svg = if self.look == FigureLook::Dark { to_dark(&svg) } else { svg };
        let stem = format!("{number:02}-{}", slug(&title));
        PrintFigure { file: SvgFile { stem, svg }, title, csv }
    }

    /// Returns the labels that occur in no figure of a document.
    pub fn unused_labels<'a>(&'a self, document: &Document) -> Vec<&'a str> {
        let used = Self::document_labels(document);
        let labels = self.labels.iter().map(|(from, _)| from.as_str());
        labels.filter(|from| !used.contains(from)).collect()
    }

    /// Returns all labels of the figures of a document that can be replaced.
    pub fn document_labels(document: &Document) -> BTreeSet<&str> {
        figures(document).flat_map(figure_labels).filter(|label| !label.is_empty()).collect()
    }

    /// Returns the size and the text of a layout, which is enlarged afterwards.
    pub fn layout(&self) -> Style {
        let scale = self.look.scale();
        let [width_px, height_px] = self.size_mm.map(|mm| (mm * PX_PER_MM / scale).round());
        Style { width_px, height_px, font_px: self.font_pt * PX_PER_PT / scale }
    }

    /// Returns a figure without title and note, and with replaced labels.
    fn for_print(&self, figure: &Figure) -> Figure {
        let mut figure = Figure { title: String::new(), note: String::new(), ..figure.clone() };
        // Without its note, the legend says what is shown.
        let runs = figure.runs_words().map(|words| format!(", {words}")).unwrap_or_default();
        if let Some(words) = interval_words(&figure) {
            figure.interval_words = self.label(words) + &runs;
        }
        for label in [&mut figure.x_label, &mut figure.y_label] {
            let own = self.label(label);
            *label = if own == *label { key_words(label) } else { own };
        }
        let names = self.names(figure.series.iter().map(|series| series.name.as_str()).collect());
        for (series, name) in figure.series.iter_mut().zip(names) {
            series.name = name;
        }
        for name in figure.position_names_mut() {
            *name = self.label(name);
        }
        if let FigureKind::Runs { legend, .. } = &mut figure.kind {
            legend.seed = self.label(&legend.seed);
            legend.mean = self.label(&legend.mean) + &runs;
        }
        if let FigureKind::Forest { words, .. } = &mut figure.kind {
            words.heading += &runs;
        }
        figure
    }

    /// Returns the author's words for a label; the label itself where there are none.
    fn label(&self, label: &str) -> String {
        let own = self.labels.iter().find(|(from, _)| from == label);
        own.map_or(label, |(_, to)| to).to_string()
    }

    /// Returns the author's words for names of series, or else their own, in which keys are told in words.
    fn names(&self, names: Vec<&str>) -> Vec<String> {
        let in_words: Vec<String> = names.iter().map(|name| level_words(name)).collect();
        let count = |words: Vec<&str>| words.into_iter().collect::<BTreeSet<_>>().len();
        // Two names that would become one are left as they are.
        let is_distinct =
            count(in_words.iter().map(String::as_str).collect()) == count(names.clone());
        let words = |(name, words): (&str, String)| {
            let own = self.label(name);
            if own == name && is_distinct { words } else { own }
        };
        names.into_iter().zip(in_words).map(words).collect()
    }
}

/// Returns what a legend says of the intervals of a figure; `None` where it has none that a legend explains.
fn interval_words(figure: &Figure) -> Option<&'static str> {
    let words = match figure.kind {
        FigureKind::Steps => "95 % interval",
        FigureKind::Runs { .. } | FigureKind::Forest { .. } | FigureKind::Heat { .. } => {
            return None;
        }
        _ => "mean, 95 % interval",
    };
    figure.has_intervals().then_some(words)
}

/// Returns the words of a label of an axis, where it is a key: `robots.0.count` is the number of robots. Others stay.
fn key_words(label: &str) -> String {
    let (key, unit) = match label.split_once(" (") {
        Some((key, unit)) => (key, format!(" ({unit}")),
        None => (label, String::new()),
    };
    if key.contains([' ', '=']) || !key.starts_with(char::is_alphabetic) {
        return label.to_string();
    }
    words_of_key(key) + &unit
}

/// Returns the name of a variant with its keys in words: `conflict_policy=right_of_way` is "conflict policy=right of way".
/// Names that are no levels of factors stay, and so do those of which two keys would become one.
fn level_words(name: &str) -> String {
    let parts = name.split(", ").map(|part| part.split_once('='));
    let Some(levels) = parts.collect::<Option<Vec<(&str, &str)>>>() else {
        return name.to_string();
    };
    let keys: BTreeSet<String> = levels.iter().map(|(key, _)| words_of_key(key.trim())).collect();
    if keys.len() < levels.len() {
        return name.to_string();
    }
    let words = levels.iter().map(|(key, value)| {
        format!("{}={}", words_of_key(key.trim()), value.trim().replace('_', " "))
    });
    words.collect::<Vec<_>>().join(", ")
}

fn words_of_key(key: &str) -> String {
    let parts: Vec<&str> = key.split('.').filter(|part| part.parse::<usize>().is_err()).collect();
    match parts[..] {
        [.., things, "count"] => format!("number of {}", things.replace('_', " ")),
        [.., last] => last.replace('_', " "),
        [] => key.to_string(),
    }
}

fn figures(document: &Document) -> impl Iterator<Item = &Figure> {
    document.blocks.iter().filter_map(|block| match block {
        Block::Figure(figure) => Some(figure),
        _ => None,
    })
}

/// Returns all labels of a figure: of its axes, its positions and its legend.
fn figure_labels(figure: &Figure) -> impl Iterator<Item = &str> {
    let positions = figure.position_names().unwrap_or_default();
    let series = figure.series.iter().map(|series| &series.name);
    let axes = [&figure.x_label, &figure.y_label].into_iter();
    let words = axes.chain(series).chain(positions).chain(figure.legend_words());
    words.map(String::as_str).chain(interval_words(figure))
}

/// Returns a drawing that is shown larger by a factor, with all its lines.
fn enlarged(svg: &str, factor: f64) -> String {
    let Some((head, rest)) = svg.split_once('>') else { return svg.to_string() };
    let mut head = head.to_string();
    for side in ["width", "height"] {
        let begin = format!(" {side}=\"");
        let Some((before, after)) = head.split_once(&begin) else { continue };
        let Some((length, after)) = after.split_once('"') else { continue };
        let larger = length.parse::<f64>().map_or(0.0, |px| (px * factor).round());
        head = format!("{before}{begin}{larger}\"{after}");
    }
    format!("{head}>{rest}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::Series;
    use sidestep_document::figure::Point;

    #[test]
    fn a_figure_for_print_has_its_size_and_words_and_no_title() {
        let bar = Some((0.5, 1.5));
        let points = vec![
            Point::new(0.0, 1.0).with_interval(bar).with_runs(8),
            Point::new(1.0, 2.0).with_runs(8),
        ];
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
        let look = FigureLook::Paper;
        let print = PrintStyle { look, size_mm: [127.0, 63.5], font_pt: 9.0, labels };
        let printed = print.figures(&document, 0).unwrap();
        let svg = &printed[0].file.svg;
        assert!(svg.contains(r#"width="480""#) && svg.contains("Number of hits"), "{svg}");
        assert!(svg.contains("Calm sea") && svg.contains("gap (m)") && !svg.contains(">hits<"));
        assert!(!svg.contains("The title") && !svg.contains("The note"));
        assert_eq!(
            (printed[0].file.stem.as_str(), print.unused_labels(&document)),
            ("01-the-title", vec!["missing"])
        );
        assert!(printed[0].csv.starts_with("series,gap (m),Number of hits,low"));
        assert!(svg.contains(">mean, 95 % interval, n = 8<"), "{svg}");
        let dark = PrintStyle { look: FigureLook::Dark, ..print };
        let svg = &dark.figures(&document, 0).unwrap()[0].file.svg;
        assert!(svg.contains(r#"width="481""#) && !svg.contains("#FFFFFF"), "{svg}");
    }

    #[test]
    fn keys_are_told_in_words_and_the_authors_own_names_stay() {
        let axes = [
            ("robots.0.count", "number of robots"),
            ("airspace.method", "method"),
            ("ground.corridor.width (m)", "width (m)"),
            ("closest approach (m)", "closest approach (m)"),
            ("0.5", "0.5"),
            ("", ""),
        ];
        for (label, words) in axes {
            assert_eq!(key_words(label), words);
        }
        let names = [
            ("conflict_policy = right_of_way", "conflict policy=right of way"),
            ("count=6, conflict_policy=random", "count=6, conflict policy=random"),
            ("robots.0.speed=1, robots.1.speed=2", "robots.0.speed=1, robots.1.speed=2"),
            ("office.toml", "office.toml"),
            ("fast_v1.5", "fast_v1.5"),
        ];
        for (name, words) in names {
            assert_eq!(level_words(name), words);
        }
        let look = FigureLook::Paper;
        let print = PrintStyle { look, size_mm: [85.0, 60.0], font_pt: 8.0, labels: vec![] };
        assert_eq!(print.names(vec!["a_b=1", "a b=1"]), ["a_b=1", "a b=1"], "still two names");
    }
}
