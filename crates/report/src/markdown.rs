//! Documents as Markdown.

use crate::SvgFile;
use crate::html::REPLAY_WORDS;
use sidestep_document::Document;
use sidestep_document::Table;
use sidestep_document::claim::{self, Claim};
use sidestep_document::document::{Block, Code, Span, Text};
use std::fmt::Write;

/// Returns a document as text; `folder` holds the `pictures`, one for each figure and picture.
pub(crate) fn text(document: &Document, folder: &str, pictures: &[SvgFile]) -> String {
    let mut parts = vec![format!("# {}", escaped(&document.title)), spans(&document.lead)];
    let replay = document.replay_address();
    parts.extend(replay.map(|replay| format!("[{REPLAY_WORDS}]({replay})")));
    let mut pictures = pictures.iter();
    for block in &document.blocks {
        parts.push(match block {
            Block::Section(title) => format!("## {}", escaped(title)),
            Block::Paragraph(text) => spans(text),
            Block::Warning(text) => format!("> {}", spans(text)),
            Block::Code(code) => fenced_code(code),
            Block::Facts(facts) => fact_list(facts),
            Block::Table(table) => self::table(table).trim_end().into(),
            Block::Claims(claims) => claims_table(claims),
            Block::Figure(f) => picture_block(&f.title, &f.note, folder, pictures.next()),
            Block::Picture(p) => picture_block(&p.title, &p.caption, folder, pictures.next()),
        });
    }
    parts.retain(|part| !part.is_empty());
    parts.join("\n\n") + "\n"
}

/// Returns a table, with its title as a heading of the third level.
pub fn table(table: &Table) -> String {
    let columns: Vec<String> = table.columns.iter().map(|c| plain_cell(c)).collect();
    let rows = table.rows.iter().map(|row| table.cells(row).map(plain_cell).collect());
    let mut text = format!("### {}\n\n{}", escaped(&table.title), grid(&columns, rows));
    if !table.note.is_empty() {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{}\n", spans(&Text::from_markup(&table.note)));
    }
    text
}

/// Returns cells that are Markdown already, in their columns.
fn grid(columns: &[String], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut text = grid_line(columns);
    text += &format!("|{}\n", "---|".repeat(columns.len()));
    for row in rows {
        text += &grid_line(&row);
    }
    text
}

fn grid_line(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn claims_table(claims: &[Claim]) -> String {
    let has_figure = claims.iter().any(|c| c.papers_figure.is_some());
    let mut columns = vec!["claim", "the paper, in our words", "our figures", "verdict", "why"];
    if has_figure {
        columns.insert(2, "the paper's figure");
    }
    let columns: Vec<String> = columns.into_iter().map(plain_cell).collect();
    let note = spans(&Text::from_markup(claim::READING_NOTE));
    let rows = claims.iter().map(|claim| claim_row(claim, has_figure));
    format!("{}\n{note}", grid(&columns, rows))
}

fn claim_row(claim: &Claim, has_figure: bool) -> Vec<String> {
    let mut row = vec![
        plain_cell(claim.id),
        markup_cell(claim.paper),
        markup_cell(&claim.ours),
        format!("**{}**", claim.verdict.name()),
        markup_cell(&claim.reason),
    ];
    if has_figure {
        row.insert(2, plain_cell(claim.papers_figure.unwrap_or("none")));
    }
    row
}

fn fact_list(facts: &[(String, Text)]) -> String {
    let lines = facts.iter().map(|(name, value)| format!("- {}: {}", escaped(name), spans(value)));
    lines.collect::<Vec<_>>().join("\n")
}

fn picture_block(title: &str, note: &str, folder: &str, picture: Option<&SvgFile>) -> String {
    let Some(picture) = picture else { return String::new() };
    let note = if note.is_empty() { String::new() } else { format!("\n\n{}", escaped(note)) };
    format!("### {0}\n\n![{0}]({folder}/{1}.svg){note}", escaped(title), picture.stem)
}

/// Returns a code block with a fence that is longer than every row of backticks in the text.
fn fenced_code(code: &Code) -> String {
    let rows = code.text.split(|c| c != '`').map(str::len);
    let fence = "`".repeat(rows.max().unwrap_or(0).max(2) + 1);
    let text = code.text.trim_end();
    format!("{}:\n\n{fence}{}\n{text}\n{fence}", escaped(&code.title), code.language)
}

fn spans(text: &Text) -> String {
    text.0.iter().map(span).collect()
}

fn span(span: &Span) -> String {
    match span {
        Span::Plain(words) => escaped(words),
        Span::Strong(words) => format!("**{}**", escaped(words)),
        Span::Code(code) => code_span(code),
    }
}

/// Returns inline code; if it has backticks, more of them surround it.
fn code_span(code: &str) -> String {
    let code = code.replace('\n', " ");
    let longest = code.split(|c| c != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(longest + 1);
    // Markdown takes one space away at both ends.
    if longest == 0 { format!("{fence}{code}{fence}") } else { format!("{fence} {code} {fence}") }
}

/// Returns our own text, with markup, for a cell.
fn markup_cell(text: &str) -> String {
    let text = spans(&Text::from_markup(text));
    text.replace('|', "\\|")
}

/// Returns text for a cell, in which a bar would end the cell.
fn plain_cell(words: &str) -> String {
    escaped(words).replace('|', "\\|")
}

/// Returns text in which Markdown and its HTML find no markup.
fn escaped(words: &str) -> String {
    let mut text = String::with_capacity(words.len());
    let mut before: Option<char> = None;
    let mut rest = words.chars().peekable();
    while let Some(c) = rest.next() {
        let next = rest.peek().copied();
        match c {
            '\n' | '\r' => text.push(' '),
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            // An underscore inside a word is not markup; brackets are markup only before an
            // address.
            '_' if before.is_some_and(char::is_alphanumeric)
                && next.is_some_and(char::is_alphanumeric) =>
            {
                text.push(c);
            }
            ']' if !matches!(next, Some('(' | '[' | ':')) => text.push(c),
            '\\' | '`' | '*' | '_' | ']' | '~' => text.extend(['\\', c]),
            _ => text.push(c),
        }
        before = Some(c);
    }
    text
}
