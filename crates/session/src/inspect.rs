//! What any file or folder that this program reads is, and what becomes of it when it is read.

use crate::files::replace_atomically;
use crate::flight::cut_off_text;
use crate::sweep::check_variants;
use crate::{Error, write_atomically};
use serde::Serialize;
use serde_json::Value;
use sidestep_experiment::sweep::Sweep;
use sidestep_import::traffic::{self, TrafficOptions};
use sidestep_import::{ForeignFormat, bag, carmen, clean_map};
use sidestep_kernel::InputError;
use sidestep_kernel::shell::sidestep_command;
use sidestep_record::sweep::SweepFolder;
use sidestep_record::{McapRunInfo, RunReader, Status, is_mcap, origins_text, row_count, tables};
use sidestep_scenario::file::{packed_error, read_start};
use sidestep_scenario::{ImportOptions, ImportReport, Source, Treatment, Worlds};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file or folder, and what becomes of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InspectedFile {
    /// Its path, as it was given.
    pub file: String,
    /// What was found in it.
    #[serde(flatten)]
    pub report: ImportReport,
}

/// Returns what is in the file or folder at `path`: one of this program (a scenario, a run, a sweep, a recording, a file
/// that scenarios of a world name), or of another one, which `options` may tell how to read.
///
/// # Errors
/// When it cannot be read, is of no kind that this program reads, nothing in it is of use, or it has no such option.
pub fn inspect(
    worlds: &Worlds,
    path: &Path,
    options: &ImportOptions,
) -> Result<InspectedFile, Error> {
    let report = report(worlds, path, options)?;
    Ok(InspectedFile { file: crate::display_path(path), report })
}

fn report(worlds: &Worlds, path: &Path, options: &ImportOptions) -> Result<ImportReport, Error> {
    if !path.exists() {
        let remedy = "check the path; relative ones start at the working directory";
        return Err(
            InputError::new(path.display(), "there is no such file or folder", remedy).into()
        );
    }
    if let Some(report) = own_recording(path)? {
        check_no_options(path, options)?;
        return Ok(report);
    }
    if let Some(format) = ForeignFormat::recognize(path)? {
        check_no_options(path, options)?;
        return Ok(format.inspect(path)?);
    }
    if path.is_dir() {
        return Err(unknown_folder(path).into());
    }
    if let Some(imported) = worlds.import_scenario(path, options)? {
        return match imported.scenario {
            Ok(_) => Ok(imported.report),
            Err(error) => Err(error.into()),
        };
    }
    check_no_options(path, options)?;
    for world in worlds.iter() {
        if let Some(report) = world.inspect_other_file(path)? {
            return Ok(report);
        }
    }
    own_text(worlds, path)
}

/// Refuses options of an import for a file that none of them is about.
fn check_no_options(path: &Path, options: &ImportOptions) -> Result<(), InputError> {
    let Some((key, _)) = options.iter().next() else { return Ok(()) };
    let cause = format!("`import.{key}` has no effect on a file of this kind");
    let remedy = "leave it out: recorded traffic and BlueSky files have such options";
    Err(InputError::new(path.display(), cause, remedy))
}

/// Returns the report of a sweep file or a scenario.
fn own_text(worlds: &Worlds, path: &Path) -> Result<ImportReport, Error> {
    let is_toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    if !is_toml {
        let start = read_start(path, 16)?;
        return Err(packed_error(path, &start).unwrap_or_else(|| unknown_kind(path)).into());
    }
    let sweep = Sweep::read(path)?;
    // The reader of sweeps takes a scenario as a sweep of itself.
    if sweep.scenario == path {
        return Ok(scenario_report(worlds, path)?);
    }
    sweep.check()?;
    check_variants(worlds, &sweep)?;
    let mut report = ImportReport::new("sweep");
    report.add_fact("scenario", sweep.scenario.display().to_string());
    report.add_kept("variants", sweep.design.variants(&sweep.place)?.len());
    report.add_kept("runs of each", sweep.replicates as usize);
    report.add_remarks(&worlds.compile(&Source::read(&sweep.scenario, &[])?)?.remarks());
    Ok(report)
}

fn unknown_folder(path: &Path) -> InputError {
    let cause = "this folder is no run, no sweep, no bag and no MRCLAM data set";
    InputError::new(path.display(), cause, "give such a folder, or the files in this one")
}

fn unknown_kind(path: &Path) -> InputError {
    let cause = "neither its content nor its name is that of a file that sidestep reads";
    let remedy = "see `sidestep inspect --help` for the kinds; a name has to end as its kind does, as in map.yaml";
    InputError::new(path.display(), cause, remedy)
}

/// Returns the report of a run, a sweep or a recording of this program; `None` for anything else.
fn own_recording(path: &Path) -> Result<Option<ImportReport>, Error> {
    if path.is_dir() {
        if SweepFolder::<Value>::is_at(path) {
            return Ok(Some(sweep_report(path)?));
        }
        return Ok(if RunReader::is_at(path) { Some(run_report(path)?) } else { None });
    }
    if !is_mcap(path) {
        return Ok(None);
    }
    // A bag of another program is an MCAP file, too.
    Ok(McapRunInfo::open(path).ok().map(|run| recording_report(&run)))
}

/// Of a flight whose folder does not say how it ended.
const UNCLOSED_FLIGHT: &str =
    "the flight is under way, or was killed: its tables reach to its last second";

fn run_report(path: &Path) -> Result<ImportReport, InputError> {
    let run = RunReader::open(path)?;
    run.check_files(|_| true)?;
    let manifest = &run.manifest;
    let mut report = ImportReport::new("run folder of this program");
    report.add_fact("world", manifest.world.clone());
    report.add_fact("seed", manifest.seed.to_string());
    report.add_fact("made by", maker(&manifest.program_version, manifest.build.as_deref()));
    report.add_fact("cycles", format!("{} of {}", manifest.cycles_done, manifest.cycles_planned));
    for table in tables(path)? {
        let rows = row_count(path, &table)?;
        report.add_kept(format!("rows of {table}"), rows as usize);
    }
    if manifest.is_flight() {
        report.add_fact("flown or simulated", origins_text(&manifest.all_origins()));
    }
    if manifest.ends_in_flight() && manifest.status != Status::Complete {
        let end = cut_off_text(manifest.cycles_done, manifest.cycles_planned);
        let text = if manifest.is_cut_off { end } else { UNCLOSED_FLIGHT.to_string() };
        let resume = sidestep_command("resume", path);
        let remedy = format!("close its recording with `{resume}`, if its server is gone");
        report.record(Treatment::Noted, text, "", if manifest.is_cut_off { "" } else { &remedy });
    } else if manifest.status != Status::Complete {
        report.record(
            Treatment::Noted,
            "the run has not ended: its tables reach to its last checkpoint",
            "",
            &format!("continue it with `{}`", sidestep_command("resume", path)),
        );
    }
    Ok(report)
}

fn maker(version: &str, build: Option<&str>) -> String {
    build.unwrap_or(version).to_string()
}

fn sweep_report(path: &Path) -> Result<ImportReport, InputError> {
    let sweep = SweepFolder::<Value>::open(path)?;
    let manifest = sweep.manifest();
    let mut report = ImportReport::new("sweep folder of this program");
    report.add_fact("made by", maker(&manifest.program_version, manifest.build.as_deref()));
    report.add_kept("variants", manifest.fingerprints.len());
    if !sweep.is_complete() {
        report.record(
            Treatment::Noted,
            "the sweep is not done",
            "",
            &format!("continue it with `{}`", sidestep_command("resume", path)),
        );
    }
    Ok(report)
}

fn recording_report(run: &McapRunInfo) -> ImportReport {
    let mut report = ImportReport::new("recording of this program (MCAP)");
    report.add_fact("world", run.world.clone());
    report.add_fact("seed", run.seed.to_string());
    report.add_fact("made by", maker(&run.program_version, run.build.as_deref()));
    report.add_fact("cycles", format!("{} of {}", run.cycles_done, run.cycles_planned));
    for (topic, messages) in &run.messages {
        report.add_kept(format!("messages on {topic}"), *messages as usize);
    }
    report
}

fn scenario_report(worlds: &Worlds, path: &Path) -> Result<ImportReport, InputError> {
    let source = Source::read(path, &[])?;
    let compiled = worlds.compile(&source)?;
    let plan = compiled.plan();
    let mut report = ImportReport::new(format!("scenario of the world `{}`", compiled.world()));
    report.add_fact("seed", plan.seed.to_string());
    report.add_fact("cycles", plan.cycles.to_string());
    report.add_kept("bodies", compiled.body_count());
    report.add_remarks(&compiled.remarks());
    Ok(report)
}

/// Writes what was kept of a file to `out`, and returns the paths of the files written: a map of any kind as the YAML
/// file `out` and an image beside it, recorded traffic as CSV.
///
/// # Errors
/// When the file cannot be read, is of a kind that is not written, or `out` cannot be written.
pub fn write_clean(
    path: &Path,
    out: &Path,
    options: &ImportOptions,
) -> Result<Vec<PathBuf>, Error> {
    match ForeignFormat::recognize(path)? {
        Some(ForeignFormat::RosMap | ForeignFormat::CharMap) => {
            let image = out.with_extension("pgm");
            let name = image.file_name().unwrap_or_default().to_string_lossy();
            let [yaml, pgm] = clean_map(path, &name)?;
            write_atomically(&image, |file| file.write_all(&pgm))?;
            write_atomically(out, |file| file.write_all(&yaml))?;
            Ok(vec![out.to_path_buf(), image])
        }
        Some(ForeignFormat::Carmen) => {
            replace_atomically(out, |partial| Ok(carmen::write_clean(path, partial)?))?;
            Ok(vec![out.to_path_buf()])
        }
        Some(ForeignFormat::Bag) => {
            replace_atomically(out, |partial| Ok(bag::write_clean(path, partial)?))?;
            Ok(vec![out.to_path_buf()])
        }
        None if traffic::is_traffic(path) => {
            let options = TrafficOptions::from_import(path, options)?;
            let text = traffic::to_csv(&traffic::read_with(path, &options)?);
            write_atomically(out, |file| file.write_all(text.as_bytes()))?;
            Ok(vec![out.to_path_buf()])
        }
        _ => Err(not_written(path)),
    }
}

fn not_written(path: &Path) -> Error {
    if path.is_dir() {
        let cause = "--clean writes what was kept of a file to a new one, and takes nothing out of a folder";
        let verify = sidestep_command("verify", path);
        let remedy =
            format!("leave --clean out; `{verify}` lists files in the folder that are not its own");
        return InputError::new(path.display(), cause, remedy).into();
    }
    let cause = "--clean writes no file of this kind";
    let remedy = "leave it out; it writes recorded traffic (as CSV), CARMEN logs, bags (as MCAP), and maps whose file says \
                  how large a box or pixel is (as YAML and PGM)";
    InputError::new(path.display(), cause, remedy).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::WORLDS;

    fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        folder
    }

    fn inspect_plain(path: &Path) -> Result<InspectedFile, Error> {
        inspect(&WORLDS, path, &ImportOptions::default())
    }

    #[test]
    fn an_unknown_key_of_a_variant_is_found_before_the_sweep_runs() {
        let sweep = "format = 1\nscenario = \"s.toml\"\nreplicates = 2\nvary = { \"robots.0.conut\" = [1, 2] }\n";
        let folder = folder_with(&[("s.toml", ROBOTS), ("w.toml", sweep)]);
        let error = inspect_plain(&folder.path().join("w.toml")).expect_err("an unknown key");
        assert!(error.to_string().contains("unknown key `conut`"), "{error}");
    }

    #[test]
    fn options_of_an_import_are_refused_where_they_have_no_effect() {
        let folder = folder_with(&[("a.map", "type octile\nheight 1\nwidth 2\nmap\n.@\n")]);
        let options = ImportOptions::from_overrides(&["import.max_gap_s=60".to_string()]);
        let error = inspect(&WORLDS, &folder.path().join("a.map"), &options);
        let error = error.expect_err("a map has no gaps");
        assert!(error.to_string().contains("`import.max_gap_s` has no effect"), "{error}");
    }

    const ROBOTS: &str =
        "format = 1\nworld = \"robots\"\nmap = { ascii = \"....\" }\nrobots = { count = 2 }\n";

    #[test]
    fn every_kind_of_text_is_told_by_its_content_or_its_name() {
        let sweep = "format = 1\nscenario = \"s.toml\"\nreplicates = 2\nvary = { \"robots.0.count\" = [1, 2] }\n";
        let profile = "format = 1\nprofile = \"mine\"\n";
        let files = [
            ("s.toml", ROBOTS, "scenario of the world `robots`"),
            ("w.toml", sweep, "sweep"),
            ("p.toml", profile, "profile of sensors and effectors"),
            ("a.txt", "..#\n", "map in characters"),
            ("a.map", "type octile\nheight 1\nwidth 2\nmap\n.@\n", "map in characters (MovingAI)"),
            (
                "a.scen",
                "version 1\n0\ta.map\t2\t1\t0\t0\t1\t0\t1\n",
                "list of starts and goals (MovingAI)",
            ),
            (
                "r.csv",
                "true;reported;true_distance_m\nwall;wall;1,5\n",
                "table of a sensor's readings (learn sensor --csv)",
            ),
            (
                "m.csv",
                "action,ahead_boxes,left_boxes,turn_deg\n",
                "table of a robot's motions (learn effector --csv)",
            ),
            ("a.xml", "<robot name=\"r\"><link name=\"a\"/></robot>", "URDF"),
        ];
        let folder = folder_with(&files.map(|(name, text, _)| (name, text)));
        for (name, _, format) in files {
            let inspected = inspect_plain(&folder.path().join(name));
            let inspected = inspected.unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(inspected.report.format, format, "{name}");
        }
    }

    #[test]
    fn a_mistake_in_a_profile_is_found_before_a_scenario_names_it() {
        let profile = "format = 1\nprofile = \"mine\"\n[sensors.eye]\nbearings_deg = [0.0]\nrange_m = 1.0\n\
                       observations = [\"nothing\", \"wall\"]\n\
                       confusion = { nothing = [0.5, 0.4], wall = [0.0, 1.0] }\n";
        let folder = folder_with(&[("p.toml", profile)]);
        let error = inspect_plain(&folder.path().join("p.toml")).expect_err("a wrong row");
        let Error::Input(error) = error else { panic!("{error}") };
        assert!(
            error.place().ends_with("p.toml") && error.line_and_column() == Some((7, 25)),
            "{error}"
        );
    }

    #[test]
    fn a_file_of_no_known_kind_is_refused_without_a_guess() {
        let folder = folder_with(&[("notes.md", "# Notes\n")]);
        let error = inspect_plain(&folder.path().join("notes.md")).expect_err("no kind");
        assert!(error.to_string().contains("neither its content nor its name"), "{error}");
        let error = inspect_plain(&folder.path().join("missing.map")).expect_err("missing");
        assert!(error.to_string().contains("no such file"), "{error}");
        let error = write_clean(
            &folder.path().join("notes.md"),
            &folder.path().join("out"),
            &ImportOptions::default(),
        );
        assert!(error.expect_err("no kind").to_string().contains("--clean writes no file"));
    }

    #[test]
    fn a_clean_map_reads_as_the_map_that_it_was_made_from() {
        let folder = folder_with(&[("a.map", "type octile\nheight 2\nwidth 2\nmap\n.@\n..\n")]);
        let clean = folder.path().join("my map.yaml");
        let written = write_clean(&folder.path().join("a.map"), &clean, &ImportOptions::default())
            .expect("written");
        assert_eq!(written.len(), 2);
        let boxes = |path: &Path| {
            let options = sidestep_import::GridOptions {
                box_size_m: 1.0,
                resolution_m: None,
                unknown: sidestep_map::UnknownPolicy::Keep,
            };
            sidestep_import::load_map(path, options).expect("read")
        };
        assert_eq!(boxes(&clean).cells(), boxes(&folder.path().join("a.map")).cells());
    }
}
