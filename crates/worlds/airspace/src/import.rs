//! Traffic in other programs' files, read as scenarios.

use super::traffic::{
    BlueskyScenario, ClipCounts, ImportedScenarioSettings, ImportedTypes, from_bluesky_with_types,
    from_tracks, omitted_commands, settings_from_bluesky,
};
use serde_json::{Value, json};
use sidestep_import::Treatment;
use sidestep_import::bluesky::{
    self, DISPLAY_RULE, ScnFile, ScnOptions, TYPES_RULE, UnresolvedPosition,
};
use sidestep_import::report::{Finding, ImportReport};
use sidestep_import::traffic::{self, RecordedTraffic, TrafficOptions};
use sidestep_kernel::InputError;
use sidestep_kernel::text::{KeyValues, group_thousands};
use sidestep_scenario::{ImportOptions, ImportedScenario};
use std::collections::BTreeMap;
use std::path::Path;

/// Forms of files, by the ends of their names.
enum TrafficFileFormat {
    Bluesky,
    Tracks,
    Other,
}

fn traffic_file_format(file: &Path) -> TrafficFileFormat {
    let name = file.to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    if name.ends_with(".scn") {
        TrafficFileFormat::Bluesky
    } else if traffic::is_traffic(file) {
        TrafficFileFormat::Tracks
    } else {
        TrafficFileFormat::Other
    }
}

/// Returns the scenario of a file of another form, and a report on the rest of the file.
///
/// # Errors
/// When the file cannot be read, or an option does not fit.
pub(super) fn import_file(
    file: &Path,
    options: &ImportOptions,
) -> Result<Option<ImportedScenario>, InputError> {
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut reasons = EmptyFileReasons::default();
    let (scenario, report, (mut json, lines)) = match traffic_file_format(file) {
        TrafficFileFormat::Other => return Ok(None),
        TrafficFileFormat::Bluesky => {
            let chosen = bluesky_options(file, options)?;
            let scn = bluesky::read_with(file, &chosen.reading)?;
            let types = match &chosen.openap {
                Some(folder) => ImportedTypes::load(folder, &scn)?,
                None => ImportedTypes::default(),
            };
            let settings = settings_from_bluesky(&file.display().to_string(), &scn);
            let mut report = full_report(&scn, &settings);
            reasons = EmptyFileReasons::new(&scn, &settings);
            let converted = from_bluesky_with_types(&name, &scn, &types);
            if let Some(BlueskyScenario { clipped, .. }) = &converted {
                record_types(&mut report, &types, *clipped);
            }
            let text = converted.map(|converted| converted.text);
            (text, report.clone(), bluesky_report(&scn, &settings, &report))
        }
        TrafficFileFormat::Tracks => {
            let tracks = traffic::read_with(file, &TrafficOptions::from_import(file, options)?)?;
            (from_tracks(&name, &tracks), tracks.report.clone(), track_import_report(&tracks))
        }
    };
    if scenario.is_none() {
        // As for a scenario, because a reader of the number does not ask for the reason.
        json["airplanes"] = 0.into();
    }
    let scenario = scenario.ok_or_else(|| reasons.error(file));
    Ok(Some(ImportedScenario { scenario, report, json, lines }))
}

/// Why none of the aircraft of a file flies.
#[derive(Debug, Default)]
struct EmptyFileReasons {
    /// The first line that cannot be read or carried out.
    first: Option<InputError>,
    /// A place at which an aircraft starts, and that nothing defines.
    unknown_place: Option<String>,
}

impl EmptyFileReasons {
    fn new(scn: &ScnFile, settings: &ImportedScenarioSettings) -> Self {
        let mut errors = scn.unparsed.iter().chain(&scn.refused).chain(&settings.refused);
        Self {
            first: errors.next().cloned(),
            unknown_place: scn.traffic.unplaced.first().map(|one| one.place.clone()),
        }
    }

    fn error(self, file: &Path) -> InputError {
        const CAUSE: &str = "no aircraft in it has a place and a speed";
        if let Some(place) = self.unknown_place {
            let cause = format!("{CAUSE}; one starts at {place}, which the file does not define");
            let remedy = "add --navdata with the folder of a navigation database";
            return InputError::new(file.display(), cause, remedy);
        }
        if let Some(first) = self.first {
            let line =
                first.line_and_column().map_or(String::new(), |(line, _)| format!(" {line}"));
            let cause = format!("{CAUSE}; line{line}: {}", first.cause());
            return InputError::new(file.display(), cause, first.remedy());
        }
        let remedy = "give a file that creates aircraft at known places, with speeds";
        InputError::new(file.display(), CAUSE, remedy)
    }
}

/// Largest number of commands without effect that a report lists one by one.
const MAX_LISTED_COMMANDS: usize = 1000;

/// Rules of findings whose errors are listed one by one.
const RULES_WITH_ERRORS: [&str; 2] =
    ["lines that cannot be read", "commands that cannot be carried out"];

/// Returns the report on a file.
fn bluesky_report(
    scn: &ScnFile,
    settings: &ImportedScenarioSettings,
    report: &ImportReport,
) -> (Value, KeyValues) {
    let words = |errors: &[InputError]| errors.iter().map(ToString::to_string).collect::<Vec<_>>();
    let refused = [&scn.refused[..], &settings.refused].concat();
    let listed = &scn.unused[..scn.unused.len().min(MAX_LISTED_COMMANDS)];
    let json = json!({
        "command_lines": scn.command_lines,
        "unparsed_lines": scn.unparsed.len(),
        "unparsed": words(&scn.unparsed),
        "refused": words(&refused),
        "commands": scn.commands,
        "not_understood": scn.not_understood,
        "not_flown": omitted_commands(scn),
        "ignored": scn.ignored,
        "unused": listed,
        "unused_commands": scn.unused.len(),
        "import_report": report,
        "unresolved_places": scn.unresolved_places.len(),
        "unresolved_names": unresolved_destinations(scn).keys().collect::<Vec<_>>(),
        "unresolved": unresolved_destinations(scn).into_values().flatten().map(unresolved_place_json).collect::<Vec<_>>(),
        "aircraft_without_place": unresolved_start_positions(scn),
    });
    let mut lines = vec![("command lines".to_string(), group_thousands(scn.command_lines))];
    lines.extend(count_line("display only", &scn.ignored));
    lines.extend(first_names_line("left out, place unknown", &unresolved_start_positions(scn)));
    lines.extend(first_names_line("unknown way-points", &unresolved_uses(scn)));
    let has_line = |finding: &&Finding| {
        !RULES_WITH_ERRORS.contains(&finding.rule.as_str()) && finding.rule != DISPLAY_RULE
    };
    lines.extend(report.findings.iter().filter(has_line).map(Finding::line));
    lines.extend(error_lines("unparsed", &scn.unparsed));
    lines.extend(error_lines("not carried out", &refused));
    (json, lines)
}

/// Returns the report on a file with what became of it in the scenario.
fn full_report(scn: &ScnFile, settings: &ImportedScenarioSettings) -> ImportReport {
    let mut report = scn.report.clone();
    for guess in &settings.guesses {
        report.record(
            Treatment::Guessed,
            guess.as_str(),
            "",
            "choose with --set airspace.method=...",
        );
    }
    for error in &settings.refused {
        let place =
            error.line_and_column().map_or(String::new(), |(line, _)| format!("line {line}"));
        report.record(Treatment::Dropped, RULES_WITH_ERRORS[1], place, "see each error");
    }
    report
}

/// Returns the aircraft that start at places known only to a navigation database, with the names of
/// these places.
fn unresolved_start_positions(scn: &ScnFile) -> Vec<String> {
    let unplaced = scn.traffic.unplaced.iter();
    unplaced.map(|one| format!("{} at {}", one.aircraft.id, one.place)).collect()
}

/// Returns the places to fly to that the file does not define, by name, each with its uses.
fn unresolved_destinations(scn: &ScnFile) -> BTreeMap<&str, Vec<&UnresolvedPosition>> {
    let mut by_name: BTreeMap<&str, Vec<&UnresolvedPosition>> = BTreeMap::new();
    for used in &scn.unresolved_places {
        // Aircraft that are created at unknown places have a list of their own.
        if !matches!(used.command.as_str(), "CRE" | "CREATE") {
            by_name.entry(&used.name).or_default().push(used);
        }
    }
    by_name
}

fn unresolved_place_json(used: &UnresolvedPosition) -> Value {
    json!({
        "name": used.name,
        "command": used.command,
        "airplane": used.aircraft,
        "line": used.line,
    })
}

/// Returns each unknown place in words, with the command, the airplane and the line of its first use.
fn unresolved_uses(scn: &ScnFile) -> Vec<String> {
    let mut texts = Vec::new();
    for (name, uses) in unresolved_destinations(scn) {
        let UnresolvedPosition { command, aircraft, line, .. } = uses[0];
        let owner = aircraft.as_ref().map_or(String::new(), |id| format!(" of {id}"));
        let more = match uses.len() - 1 {
            0 => String::new(),
            more => format!(", and {} more", group_thousands(more as u64)),
        };
        texts.push(format!("{name} ({command}{owner}, line {line}{more})"));
    }
    texts
}

/// Adds to the report what types of aircraft have changed.
fn record_types(report: &mut ImportReport, types: &ImportedTypes, clipped: ClipCounts) {
    if types.has_any() {
        report.findings.retain(|finding| finding.rule != TYPES_RULE);
    }
    for name in &types.unknown {
        let remedy = "it flies without the limits of a type";
        report.record(Treatment::NotUsed, "types that OpenAP does not have", name.as_str(), remedy);
    }
    let ClipCounts { speeds, altitudes, vertical_speeds } = clipped;
    let rules = [
        ("speeds beyond what the type can fly", speeds),
        ("altitudes above the ceiling of the type", altitudes),
        ("vertical speeds beyond what the type can fly", vertical_speeds),
    ];
    for (rule, count) in rules {
        for _ in 0..count {
            report.record(Treatment::Repaired, rule, "", "clipped to the limit of the type");
        }
    }
}

/// The options of an import of a BlueSky file.
struct BlueskyOptions {
    reading: ScnOptions,
    /// The folder `data` of OpenAP, which has the types of aircraft.
    openap: Option<String>,
}

/// Returns the options of an import for a BlueSky file.
fn bluesky_options(file: &Path, options: &ImportOptions) -> Result<BlueskyOptions, InputError> {
    let mut chosen = BlueskyOptions { reading: ScnOptions::default(), openap: None };
    for (key, value) in options.iter() {
        match key {
            "navdata" => chosen.reading.navdata = Some(value.into()),
            "openap" => chosen.openap = Some(value.into()),
            _ => {
                let cause = format!("`import.{key}` is no option of a BlueSky file");
                let remedy = "its options are `import.navdata`, the folder of a navigation database, and \
                              `import.openap`, the folder openap/data of an installed OpenAP";
                return Err(InputError::new(file.display(), cause, remedy).with_key(key));
            }
        }
    }
    Ok(chosen)
}

fn track_import_report(recorded: &RecordedTraffic) -> (Value, KeyValues) {
    let report = &recorded.report;
    let count_of = |rule: &str| {
        let found = report.findings.iter().find(|finding| finding.rule == rule);
        found.map_or(0, |finding| finding.count)
    };
    let json = json!({
        "rows": recorded.rows,
        "aircraft": recorded.tracks.len(),
        "repeated_rows": recorded.repeated_rows,
        "aircraft_of_one_row": count_of(traffic::SINGLE_ROW_RULE),
        "import_report": report,
    });
    (json, report_lines(recorded.rows, report))
}

/// Returns the report of a file of so many rows as lines: what was found in it, what was kept, and what was not taken as
/// it stood.
fn report_lines(rows: usize, report: &ImportReport) -> KeyValues {
    let mut lines = vec![("read as".to_string(), report.format.clone())];
    lines.extend(report.facts.iter().map(|fact| (fact.name.to_string(), fact.value.clone())));
    let count = |noun: &str| {
        let kept = report.kept.iter().find(|kept| kept.noun == noun);
        group_thousands(kept.map_or(0, |kept| kept.count))
    };
    let kept = format!("{} of {} kept", count("rows"), group_thousands(rows as u64));
    lines.push(("rows".to_string(), kept));
    lines.push(("flights".to_string(), count("flights")));
    lines.extend(report.findings.iter().map(Finding::line));
    lines
}

/// Returns names with their counts on one line; no line for none.
fn count_line(name: &str, counts: &BTreeMap<String, u64>) -> Option<(String, String)> {
    let words: Vec<String> = counts.iter().map(|(name, n)| format!("{name} {n}")).collect();
    (!words.is_empty()).then(|| (name.to_string(), words.join(", ")))
}

/// Returns the first few names, and the number of others; no line for none.
fn first_names_line(name: &str, all: &[String]) -> Option<(String, String)> {
    const MAX_NAMES: usize = 5;
    let mut words = all[..all.len().min(MAX_NAMES)].join(", ");
    if all.len() > MAX_NAMES {
        words.push_str(&format!(" and {} more", group_thousands((all.len() - MAX_NAMES) as u64)));
    }
    (!all.is_empty()).then(|| (name.to_string(), words))
}

/// Returns a line per error, which says where in the file it is.
fn error_lines(name: &str, errors: &[InputError]) -> impl Iterator<Item = (String, String)> {
    errors.iter().map(move |error| {
        // The remedy is on a line of its own, which would look like a line of the report.
        let text = error.to_string().replace("\n  help: ", "; ");
        (name.to_string(), text)
    })
}
