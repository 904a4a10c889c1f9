//! Flights in BlueSky 1.1.1, and the same ones here. BlueSky flies in the interpreter of SIDESTEP_PYTHON, else `python3`.

use serde::Deserialize;
use serde_json::json;
use sidestep_airspace::state::FlightEnd;
use sidestep_airspace::{AirspaceRun, airspace_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::geodesy::GeoPosition;
use sidestep_scenario::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A file as flown in BlueSky.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct FlownFile {
    /// Latitude, longitude, altitude in ft and true airspeed in m/s.
    pub aircraft: BTreeMap<String, [f64; 4]>,
    /// The pairs that lost separation.
    pub losses: BTreeSet<(String, String)>,
    /// Pairs that came nearer than twice a zone, with their smallest distance in meters.
    #[serde(default)]
    pub nearest: Vec<(String, String, f64)>,
    /// Commands that BlueSky itself cannot carry out.
    #[serde(default)]
    pub refused: Vec<String>,
    /// Why it flew none of it.
    pub error: Option<String>,
}

/// A file as flown here.
#[derive(Default)]
pub(crate) struct OwnFlight {
    /// Positions of those in the air at the end, and of all others none.
    pub aircraft: BTreeMap<String, Option<GeoPosition>>,
    /// Smallest distances in meters of the pairs that came near each other.
    pub nearest_m: BTreeMap<(String, String), f64>,
    /// The pairs that lost separation.
    pub losses: BTreeSet<(String, String)>,
}

/// Flies a scenario for some seconds, with some of its keys replaced.
pub(crate) fn own_flight(name: &str, text: String, overrides: &[&str], until_s: f64) -> OwnFlight {
    let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
    let source = Source::new(name, text, "").with_overrides(&overrides).expect("settings");
    let mut run = airspace_run(&source, 1).unwrap_or_else(|error| panic!("{name}: {error}"));
    run.advance((until_s / run.world().timing.dt_s) as u64);
    flown(&run, until_s)
}

/// Returns the aircraft and the losses of a run.
fn flown(run: &AirspaceRun, until_s: f64) -> OwnFlight {
    let world = run.world();
    let name = |id: usize| world.airplanes[id].callsign.clone().unwrap_or_default();
    let mut flight = OwnFlight::default();
    for (id, airplane) in run.state().airplanes.iter().enumerate() {
        let has_appeared = world.airplanes[id].appears_s < until_s;
        if has_appeared && !matches!(airplane.end(), Some(FlightEnd::Left(_))) {
            let position = airplane.is_unfinished().then(|| position_of(run, id));
            flight.aircraft.insert(name(id), position);
        }
    }
    let pairs: serde_json::Value = run.pair_metrics();
    for pair in pairs.as_array().expect("pairs") {
        let [a, b] = [0, 1].map(|k| name(pair["airplanes"][k].as_u64().expect("an id") as usize));
        let names = if a < b { (a, b) } else { (b, a) };
        if pair["losses"].as_u64().is_some_and(|losses| losses > 0) {
            flight.losses.insert(names.clone());
        }
        if let Some(nearest_m) = pair["nearest_m"].as_f64() {
            flight.nearest_m.insert(names, nearest_m);
        }
    }
    flight
}

/// Returns where an airplane is on earth.
fn position_of(run: &AirspaceRun, id: usize) -> GeoPosition {
    let [longitude_rad, latitude_rad] = run.state().airplanes[id].pose().at;
    GeoPosition { latitude_rad, longitude_rad }
}

/// Returns what BlueSky makes of files below a folder in some seconds: a list of [`FlownFile`] as JSON.
pub(crate) fn bluesky_flights(folder: &Path, files: &[String], until_s: f64) -> Vec<u8> {
    let python = sidestep_testing::python();
    let request = std::env::temp_dir().join(format!(
        "sidestep-files-{}-{}.json",
        std::process::id(),
        files.len()
    ));
    let asked = json!({ "folder": folder, "files": files, "until_s": until_s });
    std::fs::write(&request, asked.to_string()).expect("room");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/fly_bluesky_files.py");
    let output = Command::new(&python).arg(script).arg(&request).output().expect("python starts");
    std::fs::remove_file(&request).expect("it was written");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    output.stdout
}

/// Returns the folder of the navigation database that BlueSky brings; `None` without BlueSky.
pub(crate) fn bluesky_navdata() -> Option<PathBuf> {
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
