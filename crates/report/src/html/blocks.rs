//! The blocks of a document.

use super::{PageBlock, figures, tables, text};
use maud::{Markup, html};
use sidestep_document::document::{Block, Code, Text};

/// Number of lines above which code is folded: more would not fit the screen beside the text around it.
const MAX_UNFOLDED_LINES: usize = 24;

pub(super) fn markup(page_block: &PageBlock<'_>) -> Markup {
    match page_block.block {
        Block::Section(_) => html! {},
        Block::Paragraph(paragraph) => html! { p { (text(paragraph)) } },
        Block::Warning(warning) => html! { p .warning role="note" { (text(warning)) } },
        Block::Code(block) => code(block),
        Block::Facts(list) => facts(list),
        Block::Table(table) => tables::table(table, &page_block.id, page_block.replay.as_deref()),
        Block::Claims(claims) => tables::claims(claims),
        Block::Figure(figure) => figures::figure(figure, &page_block.id, page_block.picture),
        Block::Picture(picture) => {
            figures::picture(picture, &page_block.id, page_block.replay.as_deref())
        }
    }
}

fn code(block: &Code) -> Markup {
    // A scrolling block must be reachable by keyboard.
    let text =
        html! { pre tabindex="0" { code .{ "language-" (block.language) } { (block.text) } } };
    html! {
        @if block.text.lines().count() > MAX_UNFOLDED_LINES {
            details { summary { (block.title) } (text) }
        } @else {
            figure .code { figcaption { (block.title) } (text) }
        }
    }
}

fn facts(facts: &[(String, Text)]) -> Markup {
    html! {
        dl .facts {
            @for (name, value) in facts { div { dt { (name) } dd { (text(value)) } } }
        }
    }
}
