//! The parts of a document.

use super::{PageBlock, figures, tables, text};
use maud::{Markup, html};
use sidestep_document::document::{Block, Code, Text};

/// Number of lines above which text is folded.
const MAX_UNFOLDED_LINES: usize = 24;

pub(super) fn markup(part: &PageBlock<'_>) -> Markup {
    match part.block {
        Block::Section(_) => html! {},
        Block::Paragraph(words) => html! { p { (text(words)) } },
        Block::Warning(words) => html! { p .warning role="note" { (text(words)) } },
        Block::Code(it) => code(it),
        Block::Facts(them) => facts(them),
        Block::Table(table) => tables::table(table, &part.id),
        Block::Claims(claims) => tables::claims(claims),
        Block::Figure(figure) => figures::figure(figure, &part.id, part.picture),
        Block::Picture(picture) => figures::picture(picture, &part.id),
    }
}

fn code(it: &Code) -> Markup {
    // A scrolling block must be reachable by keyboard.
    let text = html! { pre tabindex="0" { code .{ "language-" (it.language) } { (it.text) } } };
    html! {
        @if it.text.lines().count() > MAX_UNFOLDED_LINES {
            details { summary { (it.title) } (text) }
        } @else {
            figure .code { figcaption { (it.title) } (text) }
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
