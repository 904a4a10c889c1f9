//! A run folder as a document. Nothing here knows worlds: metrics come from `summary.json`, and
//! everything else follows from the schemas of the recorded tables.

use super::text::{format_count, format_duration};
use super::{events, metrics, series, tables};
use crate::flight::cut_off_text;
use crate::read_summary;
use crate::recorded_run::nothing_recorded;
use serde_json::Value;
use sidestep_document::Document;
use sidestep_document::document::{Block, Code, Picture, Text};
use sidestep_kernel::InputError;
use sidestep_kernel::shell::sidestep_command;
use sidestep_record::{Manifest, RunReader, Status, origins_text};
use sidestep_scenario::{MetricInfo, Worlds};
use std::path::Path;

/// The remark beside all numbers of a single run.
const ONE_RUN: &str = "**One run, n = 1**: these numbers have no interval, and say nothing of other \
                       seeds.";

/// Returns the report of the run in `folder`.
///
/// # Errors
/// When it is no run folder, or something in it is damaged.
pub(super) fn document(worlds: &Worlds, folder: &Path) -> Result<Document, InputError> {
    let view = RunReader::open(folder)?;
    view.check_files(|_| true)?;
    let summary = read_summary(folder)?;
    refuse_nothing(&view)?;
    let name = name(&view, summary.as_ref());
    let mut document = Document::new(format!("{name}, seed {}", view.manifest.seed), lead(&view));
    if let Some(warning) = unfinished(&view) {
        document.warning(warning);
    }
    if let Some(picture) = picture(folder)? {
        document.section("Where everybody went").pictures([picture]);
    }
    let meanings = worlds.find(&view.manifest.world).map_or(&[][..], |kind| kind.metric_infos());
    if let Some(summary) = &summary {
        append_metrics(&mut document, &view.manifest, summary, meanings);
    }
    let agents =
        worlds.find(&view.manifest.world).and_then(|world_type| world_type.facts().positions);
    let tables = tables::table_names(folder)?;
    if tables.iter().any(|name| name == series::TABLE) {
        series::append(&mut document, folder, meanings)?;
    }
    for table in tables {
        events::append(&mut document, folder, &table, agents.as_ref())?;
    }
    document.section("What was run").push(Block::Facts(facts(&view, summary.as_ref())));
    document.commands("How to run it again", reproduction_commands(&view));
    document.push(Block::Code(Code {
        title: "The scenario, complete in itself (scenario.toml)".into(),
        language: "toml",
        text: view.scenario.clone(),
    }));
    tables::append(&mut document, folder)?;
    Ok(document)
}

/// Refuses a run of which nothing is on disk: a report of it would look as if nothing had happened in it.
fn refuse_nothing(view: &RunReader) -> Result<(), InputError> {
    let Manifest { status, cycles_done, .. } = &view.manifest;
    let is_flight = view.manifest.is_flight();
    let is_begun = *status == Status::Complete || *cycles_done > 0;
    if is_begun || !(is_flight || tables::table_names(&view.path)?.is_empty()) {
        return Ok(());
    }
    Err(nothing_recorded(&view.path, is_flight))
}

/// Returns the scenario's name, or the world's if it has none.
fn name(view: &RunReader, summary: Option<&Value>) -> String {
    let named = summary.and_then(|s| s.get("name")).and_then(Value::as_str);
    named.filter(|name| !name.is_empty()).unwrap_or(&view.manifest.world).into()
}

fn lead(view: &RunReader) -> Text {
    let Manifest { world, status, cycles_done, cycles_planned, program_version, .. } =
        &view.manifest;
    let done = format_count(*cycles_done);
    let planned = format_count(*cycles_planned);
    let cycles = if cycles_done == cycles_planned {
        format!("{done} cycles")
    } else if *status == Status::Complete {
        format!("over after {done} of at most {planned} cycles")
    } else {
        format!("{done} of {planned} cycles")
    };
    let text = format!("A run of the world `{world}` by sidestep {program_version}, {cycles}.");
    Text::from_markup(&text)
}

/// Returns a remark about a run that is not complete.
fn unfinished(view: &RunReader) -> Option<Text> {
    let Manifest { status, cycles_done, cycles_planned, .. } = &view.manifest;
    if view.manifest.ends_in_flight() && *status != Status::Complete {
        return Some(unfinished_flight(&view.manifest, *cycles_done, *cycles_planned));
    }
    let how = match status {
        Status::Complete => return None,
        Status::Incomplete => "It was stopped",
        Status::Running => "It is under way, or was killed",
    };
    let text = format!(
        "**This run is not complete.** {how}; what is below is of its first {} cycles at most. ",
        format_count(*cycles_done)
    );
    let resume = Text::code(sidestep_command("resume", &view.path));
    Some(Text::from_markup(&text).append(resume).append(" continues it."))
}

/// Returns the remark about a flight that did not reach its end.
fn unfinished_flight(manifest: &Manifest, done: u64, planned: u64) -> Text {
    let end = if manifest.is_cut_off {
        cut_off_text(done, planned)
    } else {
        format!("it is under way, or was killed; recorded are its first {done} cycles of {planned}")
    };
    Text::from_markup(&format!("**This flight in real time is not complete**: {end}."))
}

fn facts(view: &RunReader, summary: Option<&Value>) -> Vec<(String, Text)> {
    let manifest = &view.manifest;
    let status = match manifest.status {
        Status::Complete => "complete",
        Status::Incomplete if manifest.is_cut_off => "cut off",
        Status::Incomplete => "incomplete",
        Status::Running => "not ended",
    };
    let origins = match &*manifest.all_origins() {
        [] => "none".to_string(),
        origins => origins_text(origins),
    };
    let mut facts: Vec<(String, Text)> = vec![
        ("World".into(), Text::code(&*manifest.world)),
        ("Status".into(), status.into()),
        ("Seed".into(), manifest.seed.to_string().into()),
        ("Cycles".into(), format_count(manifest.cycles_done).into()),
        ("Flown or simulated".into(), origins.into()),
        ("Cycles planned".into(), format_count(manifest.cycles_planned).into()),
        ("Version".into(), format!("sidestep {}", manifest.program_version).into()),
    ];
    // Early summaries have `robots` in place of `agents`.
    let agents = summary_number(summary, "agents").or(summary_number(summary, "robots"));
    if let Some(agents) = agents {
        facts.push(("Agents".into(), format_count(agents as u64).into()));
    }
    if let Some(wall_s) = summary_number(summary, "wall_s") {
        facts.push(("Took".into(), format_duration(wall_s).into()));
    }
    if let Some(workers) = summary_number(summary, "workers") {
        facts.push(("Workers".into(), workers.to_string().into()));
    }
    if let Some(digest) = manifest.digest.clone() {
        facts.push(("Digest of the last state".into(), Text::code(digest)));
    }
    facts
}

fn summary_number(summary: Option<&Value>, key: &str) -> Option<f64> {
    summary?.get(key)?.as_f64()
}

/// Returns the commands that reproduce the run: an exact replay, and a new run of the recorded scenario.
fn reproduction_commands(view: &RunReader) -> String {
    let run = sidestep_command("run", view.path.join("scenario.toml"));
    let replay = sidestep_command("replay", &view.path);
    format!(
        "# the same run, with the same rows and the same digest\n\
         {run} --out NEW_DIR\n\
         # its state at a cycle, computed anew and compared with what was recorded\n\
         {replay}\n"
    )
}

fn append_metrics(
    document: &mut Document,
    manifest: &Manifest,
    summary: &Value,
    meanings: &[MetricInfo],
) {
    let cycles = summary.get("cycles").and_then(Value::as_u64).unwrap_or(manifest.cycles_done);
    let of = format!(" After {} cycles.", format_count(cycles));
    document.section("Results").paragraph(Text::from_markup(&format!("{ONE_RUN}{of}")));
    // Indexing gives null where a summary has no such key.
    let all = &summary["metrics"];
    let per_agent = &summary["per_agent"];
    let per_pair = &summary["per_pair"];
    document.tables(metrics::tree_tables("Metrics", all, meanings));
    document.tables(metrics::list_table("Metrics of every agent", per_agent, meanings));
    document.tables(metrics::list_table("Metrics of pairs of agents", per_pair, meanings));
}

/// Returns the picture in the run folder; `None` if the run has not ended, or it could not be drawn.
fn picture(folder: &Path) -> Result<Option<Picture>, InputError> {
    let path = folder.join("trajectories.svg");
    match std::fs::read_to_string(&path) {
        Ok(svg) => {
            let title = "Trajectories, and where everybody is at the end".into();
            Ok(Some(Picture { title, caption: String::new(), svg }))
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(InputError::new(path.display(), e.to_string(), "make the file readable")),
    }
}
