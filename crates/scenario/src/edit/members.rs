//! Keys of tables in braces.

use super::layout::{Layout, Step};
use super::lists::{comma_after, skip_space};
use super::path::keys_at;
use super::splice::{Splice, delete, insert, replace};
use std::ops::Range;
use toml_edit::{InlineTable, Item, Value};

/// A key with its value, in braces.
pub(super) struct Member {
    /// The path to it from the table in braces.
    path: Vec<String>,
    /// The parts of its key.
    pub(super) keys: Vec<Range<usize>>,
    /// The end of its value.
    end: usize,
}

impl Member {
    fn start(&self) -> usize {
        self.keys.first().map_or(self.end, |key| key.start)
    }

    /// Returns whether it is at a path or below.
    pub(super) fn is_below(&self, path: &[Step]) -> bool {
        let name = |(step, own): (&Step, &String)| *step == Step::Name(own.clone());
        path.len() <= self.path.len() && path.iter().zip(&self.path).all(name)
    }
}

/// Returns the table in braces that a path leads into, and the number of steps to it.
pub(super) fn enclosing_table<'l>(
    layout: &'l Layout<'_>,
    path: &[Step],
) -> Option<(&'l InlineTable, usize)> {
    let at = |depth: usize| match layout.item(&path[..depth]) {
        Item::Value(Value::InlineTable(table)) => Some(table),
        _ => None,
    };
    let depth = (0..=path.len()).rev().find(|depth| at(*depth).is_none_or(|t| !t.is_dotted()))?;
    at(depth).map(|table| (table, depth))
}

/// Returns the members of a table in braces, in the order of the text.
pub(super) fn members(text: &str, table: &InlineTable) -> Vec<Member> {
    let mut found: Vec<Member> = table
        .get_values()
        .into_iter()
        .filter_map(|(keys, value)| {
            let path = keys.iter().map(|key| key.get().to_string()).collect();
            Some(Member { path, keys: Vec::new(), end: value.span()?.end })
        })
        .collect();
    found.sort_by_key(|member| member.end);
    let mut at = table.span().map_or(0, |span| span.start + 1);
    for member in &mut found {
        member.keys = keys_at(text, skip_space(text, at));
        at = comma_after(text, member.end).map_or(member.end, |comma| comma + 1);
    }
    found
}

/// Inserts a member after the others.
pub(super) fn insert_member(text: &str, table: &InlineTable, member: &str) -> Vec<Splice> {
    let open = table.span().map_or(0, |span| span.start + 1);
    vec![match members(text, table).last() {
        Some(last) => insert(last.end, format!(", {member}")),
        None if text[open..].starts_with('}') => insert(open, member),
        None => insert(open, format!(" {member}")),
    }]
}

/// Removes the members at a path or below.
pub(super) fn remove_members(text: &str, table: &InlineTable, path: &[Step]) -> Vec<Splice> {
    let all = members(text, table);
    let open = table.span().map_or(0, |span| span.start + 1);
    let mut splices = Vec::new();
    for (at, member) in all.iter().enumerate().filter(|(_, member)| member.is_below(path)) {
        let stay_before = all[..at].iter().rfind(|other| !other.is_below(path));
        let stays_behind = all[at + 1..].iter().any(|other| !other.is_below(path));
        splices.push(delete(match (stay_before, stays_behind) {
            (_, true) => member.start()..all[at + 1].start(),
            (Some(before), false) => before.end..member.end,
            (None, false) => open..member.end,
        }));
    }
    splices
}

/// Puts one member in place of those at a path or below.
pub(super) fn replace_members(
    text: &str,
    table: &InlineTable,
    path: &[Step],
    value: &str,
) -> Vec<Splice> {
    let all = members(text, table);
    let mut splices = Vec::new();
    for (at, member) in all.iter().enumerate().filter(|(_, member)| member.is_below(path)) {
        let key = member.keys.get(path.len() - 1).filter(|_| splices.is_empty());
        splices.push(match (key, at.checked_sub(1).map(|before| all[before].end)) {
            (Some(key), _) => replace(key.end..member.end, format!(" = {value}")),
            (None, before) => delete(before.unwrap_or(member.start())..member.end),
        });
    }
    splices
}
