//! Tables of numbers, and of claims.

use super::text;
use maud::{Markup, html};
use sidestep_document::Table;
use sidestep_document::claim::{self, Claim, Verdict};
use sidestep_document::document::Text;

/// Returns a table that can be sorted by a click on a heading. Columns without room wait behind a
/// button; a folded table is shown by a click on its title.
/// Rows about a moment of a run lead to its `replay`, where there is one.
pub(super) fn table(table: &Table, id: &str, replay: Option<&str>) -> Markup {
    let note = html! {
        @if !table.note.is_empty() { p .note { (text(&Text::from_markup(&table.note))) } }
    };
    html! {
        @if table.is_folded {
            details .table id=(id) {
                summary { (table.title) }
                (wide_table(&table.title, grid(table, None, replay)))
                (note)
            }
        } @else {
            div .table id=(id) {
                (wide_table(&table.title, grid(table, Some(&table.title), replay)))
                (note)
            }
        }
    }
}

/// Returns columns and rows, with the title as caption.
pub(super) fn grid(table: &Table, caption: Option<&str>, replay: Option<&str>) -> Markup {
    let numbers: Vec<bool> =
        (0..table.columns.len()).map(|k| is_numeric_column(table, k)).collect();
    html! {
        table .sortable {
            @if let Some(caption) = caption { caption { (caption) } }
            thead { tr {
                @for (head, number) in table.columns.iter().zip(&numbers) {
                    th scope="col" class=[class(*number)] { (breakable_name(head)) }
                }
            } }
            tbody {
                @for (index, row) in table.rows.iter().enumerate() {
                    tr {
                        @for (k, cell) in table.cells(row).enumerate() {
                            @if k == 0 { th scope="row" class=[class(numbers[k])] { (row_name(cell, moment_address(table, index, replay))) } }
                            @else { td class=[(!numbers[k]).then_some("words")] { (non_breaking(cell)) } }
                        }
                    }
                }
            }
        }
    }
}

/// Returns the address of the moment that a row is about, in a replay.
fn moment_address(table: &Table, row: usize, replay: Option<&str>) -> Option<String> {
    let moment = table.moments.get(row)?;
    Some(format!("{}#{}", replay?, moment.fragment()))
}

fn row_name(name: &str, address: Option<String>) -> Markup {
    html! {
        @match address {
            Some(address) => a href=(address) { (breakable_name(name)) },
            None => (breakable_name(name)),
        }
    }
}

/// Returns the class that aligns the heads of numbers to the right. Cells of numbers, which are most of a page, have no class:
/// those of words have one.
fn class(is_number: bool) -> Option<&'static str> {
    is_number.then_some("number")
}

/// Returns whether a part of a name is a word that a separator follows.
fn ends_word(part: &str) -> bool {
    part.ends_with(['_', '.', '/']) && part.starts_with(|c: char| c.is_ascii_alphabetic())
}

/// Returns a name that may break between its words; numbers never do.
fn breakable_name(name: &str) -> Markup {
    html! {
        @for part in name.split_inclusive(['_', '.', '/']) {
            (part) @if ends_word(part) { wbr; }
        }
    }
}

/// Returns a cell in which the two ends of an interval stay on one line, and an exponent with its number.
fn non_breaking(cell: &str) -> String {
    if cell.contains('[') {
        cell.replace(", ", ",\u{a0}").replace("e-", "e-\u{2060}")
    } else {
        cell.into()
    }
}

/// Returns the place of a table: the page's script takes the last columns away where they have no room,
/// and offers them. Without scripts it scrolls, and so it has a name and can be reached by keyboard.
pub(crate) fn wide_table(name: &str, inside: Markup) -> Markup {
    // Not the name alone: a section may have the same.
    html! { div .wide { div .scrolled role="region" tabindex="0" aria-label={ "Table: " (name) } { (inside) } } }
}

/// Returns whether every cell that is not empty starts like a number, or like a bound of one: `< 0.0001`.
fn is_numeric_column(table: &Table, k: usize) -> bool {
    let mut cells = table.rows.iter().filter_map(|row| row.get(k));
    let has_any = cells.clone().any(|cell| !cell.is_empty());
    has_any && cells.all(|cell| is_numeric_cell(cell))
}

fn is_numeric_cell(cell: &str) -> bool {
    let digits = cell.trim_start_matches(['<', ' ', '-', '+', '\u{2212}']);
    cell.is_empty() || cell == "-" || digits.starts_with(|c: char| c.is_ascii_digit())
}

/// Returns the claims, below how many have each verdict.
pub(super) fn claims(claims: &[Claim]) -> Markup {
    let has_figure = claims.iter().any(|c| c.papers_figure.is_some());
    let heads = html! {
        th scope="col" { "claim" }
        th scope="col" { "verdict" }
        th scope="col" .words { "the paper, in our words" }
        @if has_figure { th scope="col" .papers { "the paper's figure" } }
        th scope="col" .ours { "our figures" }
        th scope="col" .why { "why" }
    };
    let table = html! {
        table .claims .sortable {
            caption { "Claims of the paper, and what came of them" }
            thead { tr { (heads) } }
            tbody { @for claim in claims { (claim_row(claim, has_figure)) } }
        }
    };
    html! {
        p .tally {
            @for verdict in Verdict::ALL {
                span .count { (badge(verdict)) " " strong { (claim::count(claims, verdict)) } } " "
            }
        }
        (wide_table("Claims", table))
        p .note { (text(&Text::from_markup(claim::READING_NOTE))) }
    }
}

fn claim_row(claim: &Claim, has_figure: bool) -> Markup {
    html! {
        tr id={ "claim-" (claim.id.replace([' ', ','], "")) } {
            th scope="row" { (claim.id) }
            td { (badge(claim.verdict)) }
            td { (text(&Text::from_markup(claim.paper))) }
            @if has_figure {
                @match claim.papers_figure {
                    Some(figure) => td { (figure) },
                    None => td .none { "none" },
                }
            }
            td { (text(&Text::from_markup(&claim.ours))) }
            td .why { (text(&Text::from_markup(&claim.reason))) }
        }
    }
}

/// Returns a verdict as color, sign and word.
fn badge(verdict: Verdict) -> Markup {
    let sign = match verdict {
        Verdict::Held => "\u{2713}",
        Verdict::Refuted => "\u{2717}",
        Verdict::Undecided => "?",
        Verdict::Lost => "\u{2205}",
        Verdict::Setting => "\u{2022}",
    };
    html! {
        span .badge .(verdict.name()) { span aria-hidden="true" { (sign) } " " (verdict.name()) }
    }
}
