//! Keys of inline tables.

use super::layout::{Layout, Step};
use super::lists::{comma_after, skip_space};
use super::path::keys_at;
use super::splice::{Splice, delete, insert, replace};
use std::ops::Range;
use toml_edit::{InlineTable, Item, Value};

/// A key with its value in an inline table.
pub(super) struct Member {
    /// The path to it from the inline table.
    path: Vec<String>,
    /// The parts of its key.
    pub(super) keys: Vec<Range<usize>>,
    /// Offset after its value.
    end: usize,
}

impl Member {
    fn start(&self) -> usize {
        self.keys.first().map_or(self.end, |key| key.start)
    }

    pub(super) fn is_below(&self, path: &[Step]) -> bool {
        path.len() <= self.path.len()
            && path
                .iter()
                .zip(&self.path)
                .all(|(step, own)| matches!(step, Step::Name(name) if name == own))
    }
}

/// Returns the inline table with braces that contains a path, and the number of steps to it: dotted keys within it
/// are tables without braces.
pub(super) fn enclosing_table<'l>(
    layout: &'l Layout<'_>,
    path: &[Step],
) -> Option<(&'l InlineTable, usize)> {
    for depth in (0..=path.len()).rev() {
        match layout.item(&path[..depth]) {
            Item::Value(Value::InlineTable(table)) if table.is_dotted() => {}
            Item::Value(Value::InlineTable(table)) => return Some((table, depth)),
            _ => return None,
        }
    }
    None
}

/// Sorted by their order in the text, in which `toml_edit` does not keep dotted keys.
pub(super) fn members(text: &str, table: &InlineTable) -> Vec<Member> {
    let mut members: Vec<Member> = table
        .get_values()
        .into_iter()
        .filter_map(|(keys, value)| {
            let path = keys.iter().map(|key| key.get().to_string()).collect();
            Some(Member { path, keys: Vec::new(), end: value.span()?.end })
        })
        .collect();
    members.sort_by_key(|member| member.end);
    // Keys follow the opening brace, and each comma.
    let mut offset = table.span().map_or(0, |span| span.start + 1);
    for member in &mut members {
        member.keys = keys_at(text, skip_space(text, offset));
        offset = comma_after(text, member.end).map_or(member.end, |comma| comma + 1);
    }
    members
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

/// Removes the members at a path or below: dotted keys may be several.
pub(super) fn remove_members(text: &str, table: &InlineTable, path: &[Step]) -> Vec<Splice> {
    let all = members(text, table);
    let open = table.span().map_or(0, |span| span.start + 1);
    let mut splices = Vec::new();
    for (k, member) in all.iter().enumerate().filter(|(_, member)| member.is_below(path)) {
        let kept_before = all[..k].iter().rfind(|other| !other.is_below(path));
        let is_any_kept_after = all[k + 1..].iter().any(|other| !other.is_below(path));
        // With the comma after it, or at the end with the one before.
        splices.push(delete(match kept_before {
            _ if is_any_kept_after => member.start()..all[k + 1].start(),
            Some(before) => before.end..member.end,
            None => open..member.end,
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
    for (k, member) in all.iter().enumerate().filter(|(_, member)| member.is_below(path)) {
        // The first member gets the value, and all others go.
        let key = member.keys.get(path.len() - 1).filter(|_| splices.is_empty());
        splices.push(match key {
            Some(key) => replace(key.end..member.end, format!(" = {value}")),
            None => {
                let start = k.checked_sub(1).map_or(member.start(), |previous| all[previous].end);
                delete(start..member.end)
            }
        });
    }
    splices
}
