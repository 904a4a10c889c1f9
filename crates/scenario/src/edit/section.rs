//! The text of new sections.

use super::EditError;
use super::layout::{Layout, Step};
use super::path::quoted_name;
use super::value::text_of;
use serde_json::{Map, Value as Json};

/// The length of the longest inline table, which fits a line; a longer one becomes a section.
const MAX_INLINE_CHARS: usize = 80;

/// Returns whether a table should be a section rather than an inline table.
pub(super) fn is_large(members: &Map<String, Json>) -> bool {
    let text = text_of(&Json::Object(members.clone()), false);
    text.is_ok_and(|text| text.len() > MAX_INLINE_CHARS)
}

/// Returns whether an array becomes a list of sections.
pub(super) fn are_sections(items: &[Json]) -> bool {
    !items.is_empty() && items.iter().all(Json::is_object)
}

/// Returns the names on a path without the numbers of elements, as headers have them.
pub(super) fn names_of(path: &[Step]) -> Vec<String> {
    path.iter()
        .filter_map(|step| match step {
            Step::Name(name) => Some(name.clone()),
            Step::Index(_) => None,
        })
        .collect()
}

/// Returns names as a key of several parts.
pub(super) fn dotted(names: &[String]) -> String {
    names.iter().map(|name| quoted_name(name)).collect::<Vec<_>>().join(".")
}

/// `is_element` stands for a section of a list, `[[...]]`.
pub(super) fn header(layout: &Layout<'_>, path: &[Step], is_element: bool) -> String {
    let name = dotted(&names_of(path));
    let new_line = layout.new_line();
    if is_element { format!("[[{name}]]{new_line}") } else { format!("[{name}]{new_line}") }
}

/// Returns a header and lines for all members; large tables in them become sections of their own.
pub(super) fn section_text(
    layout: &Layout<'_>,
    path: &[Step],
    members: &Map<String, Json>,
    is_element: bool,
) -> Result<String, EditError> {
    let new_line = layout.new_line();
    let mut text = header(layout, path, is_element);
    // After all keys, because a key after the header of a section would belong to that section.
    let mut sections = String::new();
    for (name, value) in members {
        let member_path = [path, &[Step::Name(name.clone())]].concat();
        match value {
            Json::Array(items) if are_sections(items) => {
                for inner in items.iter().filter_map(Json::as_object) {
                    sections += new_line;
                    sections += &section_text(layout, &member_path, inner, true)?;
                }
            }
            Json::Object(inner) if is_large(inner) => {
                sections += new_line;
                sections += &section_text(layout, &member_path, inner, false)?;
            }
            _ => {
                let line = format!("{} = {}{new_line}", quoted_name(name), text_of(value, false)?);
                text += &line;
            }
        }
    }
    Ok(text + &sections)
}
