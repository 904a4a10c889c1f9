//! Scenario files fly here as they do in BlueSky: the same aircraft, at the same places, with the same losses.
//!
//! Both fly each file for some minutes without a window. Here a file that says nothing about conflicts flies with
//! method `none` and without the shield, as in BlueSky, and all others as they are imported, without the shield.
//! The interpreter of SIDESTEP_PYTHON, else `python3`, needs the package `bluesky-simulator` 1.1.1, whose tables of
//! places both read. SIDESTEP_BLUESKY_SCENARIOS names a folder of scenarios, such as that of BlueSky's own repository;
//! without it those of `../shared/data/airspace/bluesky` are flown. SIDESTEP_BLUESKY_TABLE names a file for the rows,
//! and SIDESTEP_BLUESKY_FLOWN one that keeps what BlueSky has flown for the next time.

use serde::Deserialize;
use serde_json::json;
use sidestep_airspace::state::FlightEnd;
use sidestep_airspace::traffic::from_bluesky;
use sidestep_airspace::{AirspaceRun, airspace_run};
use sidestep_import::bluesky::{NavigationData, ScnFile, Setting, read_with_places};
use sidestep_import::local_plane::{LatLon, LocalPlane};
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

/// Seconds for which each file is flown.
const UNTIL_S: f64 = 300.0;
/// Largest distance in meters at which two positions count as one: BlueSky accelerates, and turns before a way-point.
const SAME_PLACE_M: f64 = 2000.0;

/// A file as flown in BlueSky.
#[derive(Debug, Clone, Deserialize)]
struct FlownFile {
    /// Latitude, longitude, altitude in ft and true airspeed in m/s.
    aircraft: BTreeMap<String, [f64; 4]>,
    losses: BTreeSet<(String, String)>,
    error: Option<String>,
}

/// A file as both have flown it.
#[derive(Debug, Default)]
struct ComparedFile {
    /// Aircraft in both, only in BlueSky, and only here.
    aircraft: [usize; 3],
    /// Distances between both places in meters, by rising distance.
    gaps_m: Vec<f64>,
    /// Pairs that lose separation in both, only in BlueSky, and only here.
    losses: [usize; 3],
}

/// A file as flown here.
struct OwnFlight {
    /// Positions of those in the air at the end, and of all others none.
    aircraft: BTreeMap<String, Option<LatLon>>,
    losses: BTreeSet<(String, String)>,
}

fn files_below(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut due = vec![folder.to_path_buf()];
    while let Some(next) = due.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                due.push(path);
            } else if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("scn")) {
                let name = path.strip_prefix(folder).expect("it is below");
                found.push(name.to_string_lossy().into_owned());
            }
        }
    }
    found.sort();
    found
}

/// Returns whether a file asks for a resolution of conflicts at any time.
fn resolves(file: &ScnFile) -> bool {
    file.traffic.settings.iter().any(|timed| matches!(timed.setting, Setting::Resolution(_)))
}

fn fly(name: &str, file: &ScnFile) -> Option<OwnFlight> {
    let text = from_bluesky(name, file)?;
    let mut overrides = vec!["airspace.shield=\"off\"".to_string()];
    if !resolves(file) {
        overrides.push("airspace.method=\"none\"".to_string());
    }
    let source = Source::new(name, text, "").with_overrides(&overrides).expect("settings");
    let mut run = airspace_run(&source, 1).unwrap_or_else(|error| panic!("{error}"));
    let cycles = (UNTIL_S / run.world().timing.dt_s) as u64;
    run.advance(cycles);
    Some(flown(&run))
}

/// Returns the aircraft and the losses of a run.
fn flown(run: &AirspaceRun) -> OwnFlight {
    let world = run.world();
    let name = |id: usize| world.airplanes[id].callsign.clone().unwrap_or_default();
    let mut aircraft = BTreeMap::new();
    for (id, airplane) in run.state().airplanes.iter().enumerate() {
        let has_appeared = world.airplanes[id].appears_s < UNTIL_S;
        if has_appeared && !matches!(airplane.end(), Some(FlightEnd::Left(_))) {
            let position = airplane.is_unfinished().then(|| position_of(run, id));
            aircraft.insert(name(id), position);
        }
    }
    let pairs: serde_json::Value = run.pair_metrics();
    let mut losses = BTreeSet::new();
    for pair in pairs.as_array().expect("pairs") {
        if pair["losses"].as_u64().is_some_and(|losses| losses > 0) {
            let [a, b] =
                [0, 1].map(|k| name(pair["airplanes"][k].as_u64().expect("an id") as usize));
            losses.insert(if a < b { (a, b) } else { (b, a) });
        }
    }
    OwnFlight { aircraft, losses }
}

/// Returns where an airplane is on earth.
fn position_of(run: &AirspaceRun, id: usize) -> LatLon {
    let [lat_deg, lon_deg] = run.world().origin_deg.expect("traffic on earth");
    let plane = LocalPlane::centered_at(LatLon { lat_deg, lon_deg });
    plane.to_lat_lon(run.state().airplanes[id].pose().at)
}

fn gap_m(a: LatLon, b: LatLon) -> f64 {
    let [east_m, north_m] = LocalPlane::centered_at(a).to_plane_m(b);
    sidestep_kernel::math::hypot(east_m, north_m)
}

/// Counts the members of both sets, of the first alone, and of the second alone.
fn counts<T: Ord>(theirs: &BTreeSet<T>, ours: &BTreeSet<T>) -> [usize; 3] {
    let both = theirs.intersection(ours).count();
    [both, theirs.len() - both, ours.len() - both]
}

/// Smallest airspeed in m/s at which an aircraft flies: those that stand are left out here, by name.
const MIN_SPEED_M_S: f64 = 1.0;

/// Leaves out the aircraft that stand, and their losses.
fn without_standing(flown: &FlownFile) -> FlownFile {
    let mut flown = flown.clone();
    let standing: BTreeSet<String> = flown
        .aircraft
        .iter()
        .filter(|(_, [.., speed_m_s])| *speed_m_s < MIN_SPEED_M_S)
        .map(|(name, _)| name.clone())
        .collect();
    flown.aircraft.retain(|name, _| !standing.contains(name));
    flown.losses.retain(|(a, b)| !standing.contains(a) && !standing.contains(b));
    flown
}

fn compare(theirs: &FlownFile, ours: &OwnFlight) -> ComparedFile {
    let their_names: BTreeSet<&String> = theirs.aircraft.keys().collect();
    let own_names: BTreeSet<&String> = ours.aircraft.keys().collect();
    let mut gaps_m = Vec::new();
    for (name, [lat_deg, lon_deg, ..]) in &theirs.aircraft {
        if let Some(Some(own)) = ours.aircraft.get(name) {
            gaps_m.push(gap_m(*own, LatLon { lat_deg: *lat_deg, lon_deg: *lon_deg }));
        }
    }
    gaps_m.sort_by(f64::total_cmp);
    let losses = counts(&theirs.losses, &ours.losses);
    ComparedFile { aircraft: counts(&their_names, &own_names), gaps_m, losses }
}

/// Returns what BlueSky makes of files below a folder.
fn bluesky_flights(folder: &Path, files: &[String]) -> Vec<FlownFile> {
    let kept = std::env::var_os("SIDESTEP_BLUESKY_FLOWN").map(PathBuf::from);
    if let Some(Ok(text)) = kept.as_ref().map(std::fs::read) {
        return serde_json::from_slice(&text).expect("what was flown before");
    }
    let python = sidestep_testing::python();
    let request = std::env::temp_dir().join(format!("sidestep-files-{}.json", std::process::id()));
    let asked = json!({ "folder": folder, "files": files, "until_s": UNTIL_S });
    std::fs::write(&request, asked.to_string()).expect("room");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/fly_bluesky_files.py");
    let output = Command::new(&python).arg(script).arg(&request).output().expect("python starts");
    std::fs::remove_file(&request).expect("it was written");
    let said = String::from_utf8_lossy(&output.stderr);
    let flown = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {said}"));
    if let Some(kept) = kept {
        std::fs::write(kept, &output.stdout).expect("room");
    }
    flown
}

/// Returns the folder of the navigation database that BlueSky brings; `None` without BlueSky.
fn bluesky_navdata() -> Option<PathBuf> {
    let python = sidestep_testing::python();
    let code = "import bluesky, pathlib; \
                print(pathlib.Path(bluesky.__file__).parent / 'resources' / 'navdata')";
    let output = Command::new(&python).args(["-c", code]).output().ok()?;
    if !output.status.success() {
        sidestep_testing::skip(format!(
            "{} has no bluesky (pip install bluesky-simulator==1.1.1)",
            python.display()
        ));
        return None;
    }
    let said = String::from_utf8_lossy(&output.stdout);
    said.lines().last().map(|line| PathBuf::from(line.trim()))
}

#[test]
fn files_fly_as_in_bluesky() {
    let Some(navdata) = bluesky_navdata() else { return };
    let given = std::env::var_os("SIDESTEP_BLUESKY_SCENARIOS").map(PathBuf::from);
    let Some(folder) = given.or_else(|| sidestep_testing::shared_data("airspace/bluesky")) else {
        return;
    };
    let files = files_below(&folder);
    let theirs = bluesky_flights(&folder, &files);
    assert_eq!(theirs.len(), files.len());
    let places = Arc::new(NavigationData::read(&navdata).expect("tables of places"));
    let mut rows = String::from(
        "file\tboth\tonly BlueSky\tonly here\tat one place\tplaces\tmedian gap m\tlosses both\tonly BlueSky\tonly here\n",
    );
    let mut total = ComparedFile::default();
    let (mut same_aircraft, mut same_losses, mut compared_files) = (0, 0, 0);
    let mut not_flown_there = 0;
    for (name, theirs) in files.iter().zip(&theirs) {
        let scn = read_with_places(&folder.join(name), &places).expect("a text");
        let ours = fly(name, &scn);
        let empty = OwnFlight { aircraft: BTreeMap::new(), losses: BTreeSet::new() };
        let one = compare(&without_standing(theirs), ours.as_ref().unwrap_or(&empty));
        let median_m = one.gaps_m.get(one.gaps_m.len() / 2).copied().unwrap_or(0.0);
        let near = one.gaps_m.iter().filter(|gap_m| **gap_m <= SAME_PLACE_M).count();
        let [both, theirs_alone, ours_alone] = one.aircraft;
        let [lost, lost_there, lost_here] = one.losses;
        let said = theirs.error.clone().unwrap_or_default();
        rows += &format!(
            "{name}\t{both}\t{theirs_alone}\t{ours_alone}\t{near}\t{}\t{median_m:.0}\t{lost}\t{lost_there}\t{lost_here}\t{said}\n",
            one.gaps_m.len()
        );
        // A file in which BlueSky itself fails, or creates nothing, compares nothing.
        if theirs.error.is_some() || (theirs.aircraft.is_empty() && ours.is_some()) {
            not_flown_there += 1;
            continue;
        }
        compared_files += 1;
        same_aircraft += usize::from(theirs_alone + ours_alone == 0);
        same_losses += usize::from(lost_there + lost_here == 0);
        for k in 0..3 {
            total.aircraft[k] += one.aircraft[k];
            total.losses[k] += one.losses[k];
        }
        total.gaps_m.extend(one.gaps_m);
    }
    if let Some(table) = std::env::var_os("SIDESTEP_BLUESKY_TABLE") {
        std::fs::write(table, &rows).expect("room");
    }
    let near = total.gaps_m.iter().filter(|gap_m| **gap_m <= SAME_PLACE_M).count();
    println!("{rows}");
    println!(
        "{compared_files} files, {not_flown_there} more that BlueSky does not fly: {same_aircraft} with the same aircraft, {same_losses} with the same losses; \
         aircraft {:?}, at one place {near} of {}, losses {:?}",
        total.aircraft,
        total.gaps_m.len(),
        total.losses
    );
    let [both, theirs_alone, ours_alone] = total.aircraft;
    assert!(both > 0, "no aircraft flies in both");
    assert!(theirs_alone + ours_alone <= both / 10, "{:?}", total.aircraft);
    assert!(near * 2 >= total.gaps_m.len(), "{near} of {}", total.gaps_m.len());
}
