//! Scenario files fly here as they do in BlueSky: the same aircraft, at the same places, with the same losses.
//!
//! Both fly each file for some minutes without a window. Here a file that asks for no method that BlueSky has flies
//! with method `none` and without the shield, as in BlueSky, and all others as they are imported, without the shield.
//! In BlueSky MVP resolves by headings only, and types have no limits, as here. The interpreter of SIDESTEP_PYTHON, else
//! `python3`, needs the package `bluesky-simulator` 1.1.1, whose tables of places both read. SIDESTEP_BLUESKY_SCENARIOS
//! names a folder of scenarios, such as that of BlueSky's own repository; without it those of
//! `../shared/data/airspace/bluesky` are flown. SIDESTEP_BLUESKY_TABLE names a file for the rows of files, beside which
//! those of aircraft are written, and SIDESTEP_BLUESKY_FLOWN one that keeps what BlueSky has flown for the next time.

use crate::bluesky_flights::{FlownFile, OwnFlight, bluesky_flights, bluesky_navdata, own_flight};
use sidestep_airspace::traffic::from_bluesky;
use sidestep_import::bluesky::{
    NavigationData, ResolutionMethod, ScnFile, Setting, read_with_places,
};
use sidestep_kernel::geodesy::GeoPosition;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Seconds for which each file is flown.
const UNTIL_S: f64 = 300.0;
/// Largest distance in meters at which two positions count as one: BlueSky accelerates, and turns before a way-point.
const SAME_PLACE_M: f64 = 2000.0;

/// A file as both have flown it.
#[derive(Debug, Default)]
struct ComparedFile {
    /// Aircraft in both, only in BlueSky, and only here.
    aircraft: [usize; 3],
    /// Distances between both places in meters, by rising distance, and whose they are.
    gaps_m: Vec<(f64, String)>,
    /// Pairs that lose separation in both, only in BlueSky, and only here.
    losses: [usize; 3],
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

/// Returns whether a file asks at any time for a resolution of conflicts that BlueSky has: SSD and EBY are plugins.
fn resolves(file: &ScnFile) -> bool {
    let is_known = |setting| matches!(setting, Setting::Resolution(ResolutionMethod::Mvp));
    file.traffic.settings.iter().any(|timed| is_known(timed.setting))
}

/// Returns a scenario in which MVP changes headings alone, as BlueSky was made to fly the files.
fn by_headings_alone(text: &str) -> String {
    let mut text = text.replace("\"vertical\"", "\"heading\", resolution_factor = 1.01");
    for resolution in ["\"speed\"", "\"heading-speed\"", "\"heading-speed-vertical\""] {
        text = text.replace(&format!("resolution = {resolution}"), "resolution = \"heading\"");
    }
    text
}

fn fly(name: &str, file: &ScnFile) -> Option<OwnFlight> {
    let text = by_headings_alone(&from_bluesky(name, file)?);
    let mut overrides = vec!["airspace.shield=\"off\""];
    if !resolves(file) {
        overrides.push("airspace.method=\"none\"");
    }
    Some(own_flight(name, text, &overrides, UNTIL_S))
}

/// Counts the members of both sets, of the first alone, and of the second alone.
fn counts<T: Ord>(theirs: &BTreeSet<T>, ours: &BTreeSet<T>) -> [usize; 3] {
    let both = theirs.intersection(ours).count();
    [both, theirs.len() - both, ours.len() - both]
}

/// Smallest airspeed in m/s at which an aircraft flies: those that stand are left out here, by name.
const MIN_SPEED_M_S: f64 = 1.0;

/// Returns the aircraft that BlueSky itself does not create, because it cannot read their commands.
fn refused_aircraft(flown: &FlownFile) -> BTreeSet<String> {
    let mut refused = BTreeSet::new();
    for command in &flown.refused {
        let mut words = command.split([' ', ',', '\t']).filter(|word| !word.is_empty());
        if words.next().is_some_and(|name| name.eq_ignore_ascii_case("CRE")) {
            refused.extend(words.next().map(str::to_ascii_uppercase));
        }
    }
    refused
}

/// Leaves out the aircraft that BlueSky does not create, and their losses.
fn without_refused(ours: OwnFlight, refused: &BTreeSet<String>) -> OwnFlight {
    let OwnFlight { mut aircraft, mut nearest_m, mut losses } = ours;
    aircraft.retain(|name, _| !refused.contains(name));
    let is_flown = |(a, b): &(String, String)| !refused.contains(a) && !refused.contains(b);
    nearest_m.retain(|pair, _| is_flown(pair));
    losses.retain(is_flown);
    OwnFlight { aircraft, nearest_m, losses }
}

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
            let there = GeoPosition::from_degrees(*lat_deg, *lon_deg);
            gaps_m.push((own.geodesic_to(there).length_m, name.clone()));
        }
    }
    gaps_m.sort_by(|a, b| a.0.total_cmp(&b.0));
    let losses = counts(&theirs.losses, &ours.losses);
    ComparedFile { aircraft: counts(&their_names, &own_names), gaps_m, losses }
}

/// Returns what BlueSky makes of files below a folder, or has made of them before.
fn flights(folder: &Path, files: &[String]) -> Vec<FlownFile> {
    let kept = std::env::var_os("SIDESTEP_BLUESKY_FLOWN").map(PathBuf::from);
    if let Some(Ok(text)) = kept.as_ref().map(std::fs::read) {
        return serde_json::from_slice(&text).expect("what was flown before");
    }
    let answer = bluesky_flights(folder, files, UNTIL_S);
    if let Some(kept) = kept {
        std::fs::write(kept, &answer).expect("room");
    }
    serde_json::from_slice(&answer).expect("flights")
}

#[test]
fn files_fly_as_in_bluesky() {
    let Some(navdata) = bluesky_navdata() else { return };
    let given = std::env::var_os("SIDESTEP_BLUESKY_SCENARIOS").map(PathBuf::from);
    let Some(folder) = given.or_else(|| sidestep_testing::shared_data("airspace/bluesky")) else {
        return;
    };
    let files = files_below(&folder);
    let theirs = flights(&folder, &files);
    assert_eq!(theirs.len(), files.len());
    let places = Arc::new(NavigationData::read(&navdata).expect("tables of places"));
    let mut rows = String::from(
        "file\tboth\tonly BlueSky\tonly here\tat one place\tplaces\tmedian gap m\tlosses both\tonly BlueSky\tonly here\n",
    );
    let mut place_rows = String::from("file\taircraft\tgap m\n");
    let mut total = ComparedFile::default();
    let (mut same_aircraft, mut same_losses, mut compared_files) = (0, 0, 0);
    let mut not_flown_there = 0;
    let mut not_created_there = 0;
    for (name, theirs) in files.iter().zip(&theirs) {
        let scn = read_with_places(&folder.join(name), &places).expect("a text");
        let ours = fly(name, &scn);
        let is_flown_here = ours.is_some();
        let refused = refused_aircraft(theirs);
        not_created_there += refused.len();
        let ours = without_refused(ours.unwrap_or_default(), &refused);
        let one = compare(&without_standing(theirs), &ours);
        let median_m = one.gaps_m.get(one.gaps_m.len() / 2).map_or(0.0, |gap| gap.0);
        let near = one.gaps_m.iter().filter(|gap| gap.0 <= SAME_PLACE_M).count();
        for (gap_m, aircraft) in &one.gaps_m {
            place_rows += &format!("{name}\t{aircraft}\t{gap_m:.0}\n");
        }
        let [both, theirs_alone, ours_alone] = one.aircraft;
        let [lost, lost_there, lost_here] = one.losses;
        let said = theirs.error.as_ref().or(theirs.refused.first()).cloned().unwrap_or_default();
        rows += &format!(
            "{name}\t{both}\t{theirs_alone}\t{ours_alone}\t{near}\t{}\t{median_m:.0}\t{lost}\t{lost_there}\t{lost_here}\t{said}\n",
            one.gaps_m.len()
        );
        // A file in which BlueSky itself fails, or creates nothing, compares nothing.
        if theirs.error.is_some() || (theirs.aircraft.is_empty() && is_flown_here) {
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
        let beside = PathBuf::from(&table).with_extension("aircraft.tsv");
        std::fs::write(table, &rows).expect("room");
        std::fs::write(beside, &place_rows).expect("room");
    }
    let near = total.gaps_m.iter().filter(|gap| gap.0 <= SAME_PLACE_M).count();
    println!("{rows}");
    println!(
        "{compared_files} files, {not_flown_there} more that BlueSky does not fly, and {not_created_there} aircraft that it does not create: {same_aircraft} with the same aircraft, {same_losses} with the same losses; \
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
