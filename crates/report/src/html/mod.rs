//! Documents as a self-contained page.
//!
//! ```text
//! blocks.rs    the blocks of a document      figures.rs   figures and pictures
//! tables.rs    tables and claims             page.css     style
//! page.js      sorting of tables             hover.js     values of marks where the pointer is
//! ```

mod blocks;
mod figures;
mod tables;

pub(crate) use figures::safe_json;
pub(crate) use tables::wide_table;

use crate::{PagePicture, slug};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sidestep_document::Document;
use sidestep_document::document::{Block, Span, Text};

pub(crate) const STYLE: &str = include_str!("page.css");
pub(crate) const SCRIPT: &str = include_str!("page.js");
/// The script that shows the values of marks; a page without figures does not contain it.
const HOVER_SCRIPT: &str = include_str!("hover.js");

/// Security policy: nothing may be loaded; inline styles and scripts may be used.
pub(crate) const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                      img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'";

/// A hint on how to use figures with a mouse.
const HINT: &str = "Figures: point at a mark for its values.";

/// The words of the link to a replay.
pub(crate) const REPLAY_WORDS: &str = "Open the replay";

/// Minimum number of sections for a table of contents: fewer are found by scrolling.
const MIN_CONTENTS_SECTIONS: usize = 3;

/// Returns the page; `pictures` has one for each figure and picture, in order.
pub(crate) fn page(document: &Document, pictures: &[PagePicture]) -> String {
    let sections = PageSection::all(document, pictures);
    let has_contents =
        sections.iter().filter(|s| s.title.is_some()).count() >= MIN_CONTENTS_SECTIONS;
    let has_figures = document.blocks.iter().any(|block| matches!(block, Block::Figure(_)));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(CONTENT_SECURITY_POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="description" content=(document.lead.plain_text());
                meta name="generator" content={ "sidestep " (env!("CARGO_PKG_VERSION")) };
                title { (document.title) }
                style { (PreEscaped(STYLE)) (PreEscaped(figures::dark_style())) }
            }
            body class=[has_contents.then_some("has-contents")] {
                header {
                    h1 { (document.title) }
                    p .lead { (text(&document.lead)) }
                    @if let Some(replay) = document.replay_address() { p { a href=(replay) { (REPLAY_WORDS) } } }
                }
                @if has_contents { (table_of_contents(&sections)) }
                main { @for section in &sections { (section.markup()) } }
                footer {
                    p { "Made by sidestep " (env!("CARGO_PKG_VERSION"))
                        ". This file is complete in itself and loads nothing." }
                    @if has_figures { p .screen { (HINT) } }
                }
                @if has_figures { script { (PreEscaped(HOVER_SCRIPT)) } }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

/// The blocks under one heading.
struct PageSection<'a> {
    title: Option<&'a str>,
    id: String,
    blocks: Vec<PageBlock<'a>>,
}

/// A block, the id of its element, and its picture if it has one.
struct PageBlock<'a> {
    block: &'a Block,
    id: String,
    picture: Option<&'a PagePicture>,
    /// The address of the replay beside the report.
    replay: Option<String>,
}

impl<'a> PageSection<'a> {
    /// Returns the blocks of a document by section.
    fn all(document: &'a Document, pictures: &'a [PagePicture]) -> Vec<Self> {
        let mut sections = vec![Self { title: None, id: String::new(), blocks: Vec::new() }];
        let mut pictures = pictures.iter();
        for (k, block) in document.blocks.iter().enumerate() {
            if let Block::Section(title) = block {
                let id = anchor_id(title, k);
                sections.push(Self { title: Some(title.as_str()), id, blocks: Vec::new() });
                continue;
            }
            let has_picture = matches!(block, Block::Figure(_) | Block::Picture(_));
            let picture = if has_picture { pictures.next() } else { None };
            let id = anchor_id(title_of(block).unwrap_or("part"), k);
            if let Some(section) = sections.last_mut() {
                let replay = document.replay_address();
                section.blocks.push(PageBlock { block, id, picture, replay });
            }
        }
        sections.retain(|s| s.title.is_some() || !s.blocks.is_empty());
        sections
    }

    fn markup(&self) -> Markup {
        let is_figure = |part: &PageBlock<'_>| matches!(part.block, Block::Figure(_));
        // Figures in a row stand beside each other.
        let groups: Vec<&[PageBlock<'_>]> =
            self.blocks.chunk_by(|a, b| is_figure(a) && is_figure(b)).collect();
        let parts = html! {
            @for group in groups {
                @if is_figure(&group[0]) {
                    div .plots { @for part in group { (blocks::markup(part)) } }
                } @else {
                    @for part in group { (blocks::markup(part)) }
                }
            }
        };
        html! {
            @match self.title {
                None => section { (parts) },
                Some(title) => section aria-labelledby=(self.id) {
                    h2 id=(self.id) { (title) }
                    (parts)
                },
            }
        }
    }
}

/// Returns the title of a block in the table of contents.
fn title_of(block: &Block) -> Option<&str> {
    match block {
        Block::Table(table) => Some(&table.title),
        Block::Figure(figure) => Some(&figure.title),
        Block::Picture(picture) => Some(&picture.title),
        _ => None,
    }
}

/// Returns the anchor of the block with an index. The number tells blocks of the same title apart.
fn anchor_id(title: &str, index: usize) -> String {
    format!("{}-{}", slug(title), index + 1)
}

fn link(id: &str, title: &str) -> Markup {
    html! { a href={ "#" (id) } { (title) } }
}

fn table_of_contents(sections: &[PageSection<'_>]) -> Markup {
    html! {
        nav .contents aria-label="Contents" {
            ol {
                @for section in sections {
                    @if let Some(title) = section.title {
                        li {
                            (link(&section.id, title))
                            @let titled: Vec<_> = section.blocks.iter()
                                .filter_map(|part| Some((&part.id, title_of(part.block)?)))
                                .collect();
                            @if titled.len() > 1 {
                                ol { @for (id, title) in titled { li { (link(id, title)) } } }
                            }
                        }
                    }
                }
            }
        }
    }
}

pub(crate) fn text(text: &Text) -> Markup {
    html! {
        @for span in &text.0 {
            @match span {
                Span::Plain(words) => (words),
                Span::Code(words) => code { (words) },
                Span::Strong(words) => strong { (words) },
            }
        }
    }
}
