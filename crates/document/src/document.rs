//! A report as plain data: its content, in order. It has no file and no markup; other crates render
//! it as a page or as text.

use super::claim::Claim;
use super::{Figure, Table};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde::Serialize;

/// A report.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Document {
    /// Its subject, shown as the first heading.
    pub title: String,
    /// The result, in a sentence or two.
    pub lead: Text,
    /// Everything else, from top to bottom.
    pub blocks: Vec<Block>,
    /// The path of a page beside the report that shows what it is about: the replay of a run, or those of a sweep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replay: Option<String>,
}

/// A part of a report.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Block {
    /// The heading of all that follows, up to the next one.
    Section(String),
    /// A few sentences.
    Paragraph(Text),
    /// A warning: the report is a trial with few runs, or a run is not finished.
    Warning(Text),
    /// Verbatim text: commands, a scenario.
    Code(Code),
    /// Names and values.
    Facts(Vec<(String, Text)>),
    /// Numbers.
    Table(Table),
    /// A figure to draw.
    Figure(Figure),
    /// A finished picture.
    Picture(Picture),
    /// Claims of a paper, with our verdicts.
    Claims(Vec<Claim>),
}

/// One experiment of a report: its setup and its results.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Its name, which becomes the heading of a section.
    pub title: &'static str,
    /// Its setup, and the effect to look for, with the markup of [`Text::from_markup`].
    pub about: &'static str,
    /// Its figures, shown before the tables.
    pub figures: Vec<Figure>,
    /// Its numbers.
    pub tables: Vec<Table>,
}

/// Verbatim text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Code {
    /// Its title; if the text is long, the page shows only this until it is opened.
    pub title: String,
    /// `sh`, `toml`, ...
    pub language: &'static str,
    /// The text, shown as it stands.
    pub text: String,
}

/// A finished picture.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Picture {
    /// Its title: the content of the picture.
    pub title: String,
    /// Small print below the picture, e.g. the meaning of colors.
    pub caption: String,
    /// A whole SVG document, without anything that has to be loaded.
    #[serde(skip)]
    pub svg: String,
}

/// A few sentences.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Text(pub Vec<Span>);

/// A part of a text in one style.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Span {
    /// Ordinary words.
    Plain(String),
    /// A name from a scenario, a command, a digest.
    Code(String),
    /// Emphasized words.
    Strong(String),
}

impl Text {
    /// Parses markup: `` `code` `` and `**strong**`. A mark that is not closed is plain text. Use
    /// this only for text of the program; text of users stays plain through `Text::from`.
    pub fn from_markup(text: &str) -> Self {
        let mut spans = Vec::new();
        let mut rest = text;
        while let Some(MarkedText { before, inside, mark, after }) = next_marked(rest) {
            push_plain(&mut spans, before);
            spans.push(match mark {
                CODE => Span::Code(inside.into()),
                _ => Span::Strong(inside.into()),
            });
            rest = after;
        }
        push_plain(&mut spans, rest);
        Self(spans)
    }

    /// Returns a name or a command alone, in which nothing is markup.
    pub fn code(text: impl Into<String>) -> Self {
        Self(vec![Span::Code(text.into())])
    }

    /// Appends more text, without a blank between the two.
    #[must_use]
    pub fn append(mut self, more: impl Into<Text>) -> Self {
        self.0.extend(more.into().0);
        self
    }

    /// Returns the words without their marks.
    pub fn plain_text(&self) -> String {
        self.0
            .iter()
            .map(|span| match span {
                Span::Plain(text) | Span::Code(text) | Span::Strong(text) => text.as_str(),
            })
            .collect()
    }
}

impl From<&str> for Text {
    fn from(text: &str) -> Self {
        Self::from(text.to_string())
    }
}

impl From<String> for Text {
    fn from(text: String) -> Self {
        let mut spans = Vec::new();
        push_plain(&mut spans, &text);
        Self(spans)
    }
}

const CODE: &str = "`";
const STRONG: &str = "**";

/// A text split at a pair of marks.
struct MarkedText<'a> {
    before: &'a str,
    inside: &'a str,
    mark: &'static str,
    after: &'a str,
}

/// Returns a text split at its first pair of marks.
fn next_marked(text: &str) -> Option<MarkedText<'_>> {
    let pairs = [CODE, STRONG].into_iter().filter_map(|mark| split_at_mark(text, mark));
    pairs.min_by_key(|pair| pair.before.len())
}

fn split_at_mark<'a>(text: &'a str, mark: &'static str) -> Option<MarkedText<'a>> {
    let (before, rest) = text.split_once(mark)?;
    let (inside, after) = rest.split_once(mark)?;
    (!inside.is_empty()).then_some(MarkedText { before, inside, mark, after })
}

fn push_plain(spans: &mut Vec<Span>, text: &str) {
    if !text.is_empty() {
        spans.push(Span::Plain(text.into()));
    }
}

/// What has a meaning in addresses, in HTML or in Markdown.
const ENCODED: &AsciiSet =
    &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~').remove(b'/');

/// Returns the address of a file from its path relative to the page that links it.
fn relative_address(path: &str) -> String {
    utf8_percent_encode(path, ENCODED).to_string()
}

impl Document {
    /// Returns a report that has only a title and `lead`.
    pub fn new(title: impl Into<String>, lead: impl Into<Text>) -> Self {
        Self { title: title.into(), lead: lead.into(), blocks: Vec::new(), replay: None }
    }

    /// Returns the address of the replay, relative to the report.
    pub fn replay_address(&self) -> Option<String> {
        self.replay.as_deref().map(relative_address)
    }

    /// Starts a section.
    pub fn section(&mut self, title: impl Into<String>) -> &mut Self {
        self.push(Block::Section(title.into()))
    }

    /// Appends a part, below all earlier ones.
    pub fn push(&mut self, block: Block) -> &mut Self {
        self.blocks.push(block);
        self
    }

    /// Appends a few sentences.
    pub fn paragraph(&mut self, text: impl Into<Text>) -> &mut Self {
        self.push(Block::Paragraph(text.into()))
    }

    /// Appends a warning.
    pub fn warning(&mut self, text: impl Into<Text>) -> &mut Self {
        self.push(Block::Warning(text.into()))
    }

    /// Appends commands to type.
    pub fn commands(&mut self, title: impl Into<String>, text: impl Into<String>) -> &mut Self {
        self.push(Block::Code(Code { title: title.into(), language: "sh", text: text.into() }))
    }

    /// Appends a section about an experiment.
    pub fn experiment(&mut self, experiment: Experiment) -> &mut Self {
        let Experiment { title, about, figures, tables } = experiment;
        self.section(title).paragraph(Text::from_markup(about));
        self.figures(figures.into_iter().map(Figure::with_interval_note)).tables(tables)
    }

    /// Appends tables.
    pub fn tables(&mut self, tables: impl IntoIterator<Item = Table>) -> &mut Self {
        self.blocks.extend(tables.into_iter().map(Block::Table));
        self
    }

    /// Appends figures.
    pub fn figures(&mut self, figures: impl IntoIterator<Item = Figure>) -> &mut Self {
        self.blocks.extend(figures.into_iter().map(Block::Figure));
        self
    }

    /// Appends pictures.
    pub fn pictures(&mut self, pictures: impl IntoIterator<Item = Picture>) -> &mut Self {
        self.blocks.extend(pictures.into_iter().map(Block::Picture));
        self
    }
}

/// The warning at the top of a report with few runs.
const QUICK_RUN_WARNING: &str = "**A rehearsal: its figures have no weight.** Everything was run, with \
                             too few runs to measure anything; without `--quick` it is measured.";

/// Returns the start of a paper's report: its lead, and the claims before all else.
pub fn paper_document(title: &str, lead: String, quick: bool, claims: &[Claim]) -> Document {
    let mut document = Document::new(title, lead);
    if quick {
        document.warning(Text::from_markup(QUICK_RUN_WARNING));
    }
    document.section("Claims").push(Block::Claims(claims.to_vec()));
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_of_a_replay_leads_to_its_file_whatever_its_name() {
        let address = |name: &str| {
            let replay = Some(name.to_string());
            Document { replay, ..Document::new("", Text::from_markup("")) }.replay_address()
        };
        assert_eq!(address("office-2.replay.html").as_deref(), Some("office-2.replay.html"));
        let odd = address("a b#1?/50%ü.html");
        assert_eq!(odd.as_deref(), Some("a%20b%231%3F/50%25%C3%BC.html"));
    }

    #[test]
    fn marks_become_spans_and_a_mark_alone_stays_a_character() {
        let plain = |text: &str| Span::Plain(text.into());
        let text = Text::from_markup("a `b**` and **c**, 2 ** 3 and `");
        let spans = vec![
            plain("a "),
            Span::Code("b**".into()),
            plain(" and "),
            Span::Strong("c".into()),
            plain(", 2 ** 3 and `"),
        ];
        assert_eq!(text, Text(spans));
        assert_eq!(text.plain_text(), "a b** and c, 2 ** 3 and `");
        assert_eq!(Text::from_markup("````").plain_text(), "````");
        assert_eq!(Text::from_markup(""), Text::default());
    }

    #[test]
    fn what_comes_from_elsewhere_is_not_read_for_marks() {
        assert_eq!(Text::from("**x** `y`").0, [Span::Plain("**x** `y`".into())]);
    }

    #[test]
    fn a_document_keeps_the_order_in_which_it_is_told() {
        let mut document = Document::new("T", "lead");
        document.section("S").paragraph("p").commands("again", "sidestep run");
        let kinds: Vec<bool> =
            document.blocks.iter().map(|b| matches!(b, Block::Section(_))).collect();
        assert_eq!(kinds, [true, false, false]);
    }
}
