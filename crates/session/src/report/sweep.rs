//! The folder of a sweep as a document: its runs, their results, and the precision of these.

use super::sweep_series;
use super::text::{format_count, format_duration};
use crate::sweep::{FinishedRuns, Folder, read_finished, run_picture};
use crate::{Error, Watcher};
use sidestep_document::document::{Block, Code, Document, Picture, Text};
use sidestep_document::{Figure, Table};
use sidestep_experiment::sweep::rounds::{VariantStop, variant_stops};
use sidestep_experiment::sweep::{Plan, Role, RunTable, Summary, Trial, Variant};
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::shell::{shell_path, sidestep_command};
use sidestep_scenario::Worlds;

/// Number of variants for which a run is drawn: some examples; the figures are about all variants.
const MAX_PICTURES: usize = 4;
/// Longest time in seconds of a run that is repeated for its picture, so that a report takes a minute or two at most.
const MAX_REPEATED_RUN_S: f64 = 20.0;
/// Largest number of failed runs that are listed.
const MAX_LISTED_FAILURES: usize = 20;

/// Returns the report of the sweep in `folder`.
///
/// # Errors
/// When something in it is damaged, or no run is finished yet.
pub(super) fn document(
    worlds: &Worlds,
    folder: &Folder,
    watcher: &dyn Watcher,
) -> Result<Document, Error> {
    let finished = read_finished(folder)?;
    let FinishedRuns { table, is_complete, .. } = &finished;
    // Its text is shown.
    folder.check_variant(0)?;
    let plan = folder.plan();
    let summary = plan.summary(worlds, table)?;
    let mut document = Document::new(name(plan), lead(plan, table));
    if !is_complete {
        document.warning(unfinished(folder, table));
    }
    append_results(&mut document, &summary);
    let meanings = worlds.find(&plan.world).map_or(&[][..], |world| world.metric_infos());
    sweep_series::append(&mut document, plan, &finished, meanings);
    append_failures(&mut document, plan, table);
    let pictures = pictures(worlds, folder, table, watcher)?;
    append_pictures(&mut document, pictures);
    append_methods(&mut document, &summary);
    append_plan(&mut document, folder, table);
    Ok(document)
}

fn name(plan: &Plan) -> String {
    if plan.name.is_empty() {
        return format!("A sweep of the world {}", plan.world);
    }
    plan.name.clone()
}

fn lead(plan: &Plan, table: &RunTable) -> Text {
    let runs = table.runs() as u64;
    let variants = plan.variants.len() as u64;
    // A single run has no interval, whether another seed would change it or not.
    let intervals = if runs > variants {
        "Intervals are 95 %."
    } else {
        "No variant has two runs, so there are no intervals."
    };
    Text::from_markup(&format!(
        "{} runs of {} variants in the world `{}`. Replicate k of every variant has seed \
         {}\u{a0}+\u{a0}k, so variants are compared seed by seed. {intervals}",
        format_count(runs),
        format_count(variants),
        plan.world,
        plan.first_seed,
    ))
}

fn unfinished(folder: &Folder, table: &RunTable) -> Text {
    let done = format_count(table.runs() as u64);
    let all = format_count(folder.plan().runs());
    let text = format!("**This sweep is not done.** {done} of at most {all} runs are finished. ");
    let resume = sidestep_command("resume", folder.path());
    Text::from_markup(&text).append(Text::code(resume)).append(" continues it.")
}

fn facts(folder: &Folder, table: &RunTable) -> Vec<(String, Text)> {
    let plan = folder.plan();
    let version = &folder.manifest().program_version;
    let mut facts: Vec<(String, Text)> = vec![
        ("World".into(), Text::code(&*plan.world)),
        ("Runs".into(), format_count(table.runs() as u64).into()),
        ("Variants".into(), format_count(plan.variants.len() as u64).into()),
        ("First seed".into(), plan.first_seed.to_string().into()),
        ("Version".into(), format!("sidestep {version}").into()),
        ("Fingerprint of all scenarios".into(), Text::code(folder.fingerprint())),
    ];
    if let Some(until) = &plan.until {
        let unit = if until.is_relative { "of the mean" } else { "in the metric's unit" };
        let metrics = if until.metrics.is_empty() {
            "every metric that varies".to_string()
        } else {
            until.metrics.join(", ")
        };
        let words = format!(
            "until half the interval is at most {} {unit}: {metrics}; at most {} runs a variant",
            until.half_width, plan.replicates
        );
        facts.push(("Runs of a variant".into(), words.into()));
    }
    if let Some(simulated_s) = total(table, "run_wall_s") {
        facts.push(("Simulation in all".into(), format_duration(simulated_s).into()));
    }
    facts
}

fn total(table: &RunTable, column: &str) -> Option<f64> {
    let values = &table.column(column)?.values;
    Some((0..table.runs()).filter_map(|row| values.number(row)).sum())
}

/// Returns the variants with their parameters and numbers of runs.
fn variants(plan: &Plan, table: &RunTable) -> Option<Table> {
    if plan.parameters.is_empty() {
        return None;
    }
    let mut runs = vec![0u64; plan.variants.len()];
    if let Some(ColumnValues::I64(of)) = table.column("variant").map(|c| &c.values) {
        for variant in of.iter_with_missing().flatten() {
            // A damaged table may have numbers of no variant.
            if let Some(runs) = usize::try_from(*variant).ok().and_then(|v| runs.get_mut(v)) {
                *runs += 1;
            }
        }
    }
    let mut columns = vec!["variant", "runs"];
    columns.extend(plan.parameters.iter().map(String::as_str));
    let note = "`variants/NNNN/scenario.toml` is the whole scenario of variant NNNN.";
    let mut rows = Table::new("Variants", note, &columns);
    for (k, variant) in plan.variants.iter().enumerate() {
        let mut row = vec![format!("{k:04}"), runs[k].to_string()];
        row.extend(plan.parameters.iter().map(|key| setting_text(variant, key)));
        rows.push_row(row);
    }
    Some(rows)
}

fn setting_text(variant: &Variant, key: &str) -> String {
    let Some(value) = variant.value(key) else { return "as in the scenario".to_string() };
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

/// Returns the reasons why variants stopped, if a precision ends them.
fn stop_reasons_table(plan: &Plan, table: &RunTable) -> Option<Table> {
    let stopped = variant_stops(plan, table);
    let names = plan.names();
    let mut rows = Table::new("Why this number of runs", "", &["variant", "runs", "why"]);
    for VariantStop { variant, runs, reason } in &stopped {
        let name = names.get(*variant as usize).cloned();
        rows.push_row([name.unwrap_or_default(), runs.to_string(), reason.describe().to_string()]);
    }
    (!stopped.is_empty()).then_some(rows)
}

fn reproduction_commands(folder: &Folder) -> String {
    let scenario = folder.path().join("variants/0000/scenario.toml");
    format!(
        "# one run of the table: the scenario of its variant, and its seed\n\
         {} --seed {}\n\
         # all runs as one table: a row a run, parameters and metrics in typed columns\n\
         python3 -c 'import polars, sys; print(polars.read_parquet(sys.argv[1]))' {}\n",
        sidestep_command("run", scenario),
        folder.plan().first_seed,
        shell_path(folder.results_file()),
    )
}

/// Appends the figures that show what differs and one table of everything, then every metric in a section of its own:
/// its other figures and its tables, folded.
fn append_results(document: &mut Document, summary: &Summary) {
    document.section("Results").figures(summary.lead_figures().iter().cloned());
    document.tables([summary.overview()]);
    for note in &summary.notes {
        document.paragraph(note.as_str());
    }
    for section in summary.sections() {
        document.section(section.title);
        let name = Text::code(section.name);
        document.paragraph(match section.meaning {
            "" => name.append("."),
            meaning => name.append(format!(": {meaning}.")),
        });
        let is_lead = |figure: &Figure| summary.lead_figures().contains(figure);
        let others = section.figures.into_iter().filter(|figure| !is_lead(figure));
        document.figures(others.map(Figure::folded)).tables(section.tables);
    }
}

/// Appends the notes common to all tables, and the metrics that are not shown.
fn append_methods(document: &mut Document, summary: &Summary) {
    document.section("How the numbers were made");
    for note in summary.footnotes() {
        document.paragraph(Text::from_markup(note));
    }
    document.tables(summary.omitted_metrics().map(Table::folded));
}

/// Appends the plan of the runs, and the commands to repeat them.
fn append_plan(document: &mut Document, folder: &Folder, table: &RunTable) {
    let plan = folder.plan();
    document.section("What was run").push(Block::Facts(facts(folder, table)));
    document.tables(variants(plan, table).map(Table::folded));
    document.tables(stop_reasons_table(plan, table).map(Table::folded));
    document.commands("How to run it again", reproduction_commands(folder));
    if let Ok(text) = std::fs::read_to_string(folder.scenario(0)) {
        let name = plan.names().into_iter().next().unwrap_or_default();
        let title = format!("The scenario of the first variant: {name}");
        document.push(Block::Code(Code { title, language: "toml", text }));
    }
}

fn append_pictures(document: &mut Document, RunPictures { all, remarks }: RunPictures) {
    if all.is_empty() && remarks.is_empty() {
        return;
    }
    document.section("Where everybody went");
    document.paragraph("The run of the first seed, of the first variants.").pictures(all);
    for remark in remarks {
        document.warning(remark);
    }
}

fn append_failures(document: &mut Document, plan: &Plan, table: &RunTable) {
    let Some(column) = table.column("failure") else { return };
    let failed = (0..table.runs()).filter(|&row| !column.values.text(row).is_empty());
    let failed: Vec<usize> = failed.collect();
    if failed.is_empty() {
        return;
    }
    let text = format!("**{} runs failed** and are in no figure of this report.", failed.len());
    document.section("Runs that failed").warning(Text::from_markup(&text));
    let note = format!("The first {MAX_LISTED_FAILURES} at most.");
    let mut rows = Table::new("Failures", note, &["variant", "seed", "why"]);
    let names = plan.names();
    for &row in failed.iter().take(MAX_LISTED_FAILURES) {
        let variant = number_at(table, "variant", row);
        let variant = variant.and_then(|variant| names.get(variant as usize).cloned());
        let seed = number_at(table, "seed", row).map_or_else(String::new, |s| s.to_string());
        rows.push_row([variant.unwrap_or_default(), seed, column.values.text(row)]);
    }
    document.tables([rows]);
}

/// Pictures of some runs, and the reasons why others have none.
#[derive(Default)]
struct RunPictures {
    all: Vec<Picture>,
    remarks: Vec<String>,
}

/// Returns a picture of one run of each of the first variants, except of those that took long.
fn pictures(
    worlds: &Worlds,
    folder: &Folder,
    table: &RunTable,
    watcher: &dyn Watcher,
) -> Result<RunPictures, Error> {
    let plan = folder.plan();
    let digests = table.columns_with_role(Role::Digest).next();
    let mut pictures = RunPictures::default();
    for (variant, title) in (0u32..).zip(plan.names()).take(MAX_PICTURES) {
        let trial = plan.trial(variant, 0);
        let Some(row) = row_of(table, trial.id).filter(|row| is_short(table, *row)) else {
            continue;
        };
        let digest = digests.map_or_else(String::new, |c| c.values.text(row));
        match run_picture(worlds, folder, trial, &digest, watcher)? {
            Ok(svg) => {
                let caption = caption(folder, trial, row);
                pictures.all.push(Picture { title, caption, svg });
            }
            Err(why) => {
                let seed = trial.seed;
                let remark = format!("There is no picture of {title}, seed {seed}: {why}.");
                pictures.remarks.push(remark);
            }
        }
    }
    Ok(pictures)
}

fn caption(folder: &Folder, trial: Trial, row: usize) -> String {
    let seed = trial.seed;
    if folder.is_complete() {
        return format!("Seed {seed}; its digest and metrics are in row {row} of results.parquet.");
    }
    format!("Seed {seed}; its trial has the number {}.", trial.id)
}

/// Returns the row of a trial, counted from 0.
fn row_of(table: &RunTable, trial: u64) -> Option<usize> {
    let trials = table.column("cell")?;
    (0..table.runs()).find(|&row| trials.values.number(row) == Some(trial as f64))
}

/// Returns whether a run did not fail, and is quick to repeat.
fn is_short(table: &RunTable, row: usize) -> bool {
    let has_failed = table.column("failure").is_some_and(|c| !c.values.text(row).is_empty());
    let took_s = number_at(table, "run_wall_s", row);
    !has_failed && took_s.is_some_and(|took_s| took_s <= MAX_REPEATED_RUN_S)
}

fn number_at(table: &RunTable, column: &str, row: usize) -> Option<f64> {
    table.column(column)?.values.number(row)
}
