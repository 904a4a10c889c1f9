//! Traffic in other programs' files, taken as scenarios.

use super::Said;
use crate::console::grouped;
use serde_json::json;
use sidestep::import::{bluesky, traffic};
use sidestep::kernel::InputError;
use sidestep::worlds::airspace::traffic::{from_bluesky, from_tracks};
use std::collections::BTreeMap;
use std::path::Path;

/// Forms of files, by their names' ends.
enum Form {
    Bluesky,
    Tracks,
    Other,
}

fn form(file: &Path) -> Form {
    let name = file.to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    match name {
        _ if name.ends_with(".scn") => Form::Bluesky,
        _ if name.ends_with(".csv") => Form::Tracks,
        _ => Form::Other,
    }
}

/// See [`crate::worlds::translated`].
pub(crate) fn translated(file: &Path) -> Result<Option<String>, InputError> {
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let text = match form(file) {
        Form::Other => return Ok(None),
        Form::Bluesky => from_bluesky(&name, &bluesky::read(file)?),
        Form::Tracks => from_tracks(&name, &traffic::read(file)?),
    };
    let nobody = || {
        let remedy = "give a file that creates aircraft at known places";
        InputError::new(file.display(), "no aircraft in it has a place", remedy)
    };
    text.map(Some).ok_or_else(nobody)
}

/// See [`crate::worlds::told_of`].
pub(crate) fn told_of(file: &Path) -> Result<Option<Said>, InputError> {
    let Form::Bluesky = form(file) else { return Ok(None) };
    let scn = bluesky::read(file)?;
    let json = json!({
        "command_lines": scn.command_lines,
        "unparsed_lines": scn.unparsed.len(),
        "unparsed": scn.unparsed.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "commands": scn.commands,
        "not_understood": scn.not_understood,
        "ignored": scn.ignored,
        "unresolved_places": scn.unresolved_places.len(),
    });
    let mut text = format!("  command lines    {}\n", grouped(scn.command_lines));
    text.push_str(&listed("not acted on", &scn.not_understood));
    text.push_str(&listed("display only", &scn.ignored));
    for error in &scn.unparsed {
        text.push_str(&format!("  unparsed         {error}\n"));
    }
    Ok(Some(Said { json, text }))
}

fn listed(name: &str, counts: &BTreeMap<String, u64>) -> String {
    if counts.is_empty() {
        return String::new();
    }
    let words: Vec<String> = counts.iter().map(|(name, n)| format!("{name} {n}")).collect();
    format!("  {name:<15}  {}\n", words.join(", "))
}
