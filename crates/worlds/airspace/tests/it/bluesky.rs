//! MVP flies like BlueSky's: on the same super-conflicts, losses of separation, closest approaches and flight times
//! agree within the spread of the runs.
//!
//! `fixtures/bluesky.json` are our own measurements, made with `python/fly_bluesky.py`, BlueSky 1.1.1
//! and Python 3.11: runs 0 to 39 of [`cases`] for each number of airplanes. The interpreter of
//! SIDESTEP_PYTHON, else `python3`, repeats some of them where it has `bluesky`.

use serde::Deserialize;
use serde_json::{Value, json};
use sidestep_airspace::airspace_run;
use sidestep_airspace::metrics::airplane_metrics;
use sidestep_kernel::Simulation;
use sidestep_kernel::math::{cos, sin};
use sidestep_scenario::Source;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

const RADIUS_M: f64 = 6500.0;
/// Standard errors by which means may differ: by chance, fewer than one in ten thousand do.
const ERRORS: f64 = 4.0;

/// Results of one run.
#[derive(Debug, Clone, Copy, Deserialize)]
struct RunResult {
    losses: f64,
    nearest_m: f64,
    arrived: u64,
    mean_flown_s: f64,
}

#[derive(Deserialize)]
struct Fixture {
    limits: Value,
    flown: BTreeMap<usize, Vec<RunResult>>,
}

fn fixture() -> Fixture {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/bluesky.json");
    let text = std::fs::read_to_string(file).expect("it is in the repository");
    serde_json::from_str(&text).expect("a fixture")
}

/// Returns the airplanes of a super-conflict: x, y, heading in degrees, and the way-point.
fn case(n: usize, run: usize) -> Vec<[f64; 5]> {
    let turned = 2.399_963_229_728_653 * run as f64;
    let one = |k: usize| {
        let jitter_m = 20.0 * (((run * 7919 + k * 104_729) % 1000) as f64 / 500.0 - 1.0);
        let angle = turned + std::f64::consts::TAU * k as f64 / n as f64 + jitter_m / RADIUS_M;
        let (x, y) = (RADIUS_M * cos(angle), RADIUS_M * sin(angle));
        [x, y, angle.to_degrees() + 180.0, -x, -y]
    };
    (0..n).map(one).collect()
}

/// Returns a case for our MVP.
fn scenario(airplanes: &[[f64; 5]]) -> Source {
    let mut text =
        "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"mvp\"\nshield = \"off\"\n\
                    mvp = { look_ahead_s = 90.0, margin = 1.05 }\n"
            .to_string();
    for [x, y, heading_deg, to_x, to_y] in airplanes {
        text += &format!(
            "[[airplanes]]\nat_m = [{x:?}, {y:?}]\nheading_deg = {heading_deg:?}\n\
             way_points_m = [[{to_x:?}, {to_y:?}]]\n"
        );
    }
    Source::new("case", text, "")
}

/// Flies a case with our MVP.
fn ours(airplanes: &[[f64; 5]]) -> RunResult {
    let mut run = airspace_run(&scenario(airplanes), 1).expect("a scenario");
    run.advance(300);
    let metrics = run.metrics();
    let one = |id| airplane_metrics(run.world(), run.state(), id).flown_s.expect("it has arrived");
    let flown_s: f64 = (0..airplanes.len() as u32).map(one).sum();
    RunResult {
        losses: metrics.losses_of_separation as f64,
        nearest_m: metrics.min_separation_m.expect("they meet"),
        arrived: metrics.arrived,
        mean_flown_s: flown_s / airplanes.len() as f64,
    }
}

/// Fails unless two samples have the same mean within the spread of their runs, except for an amount that follows
/// from the motion: in BlueSky, an airplane turns at once and then flies straight for a second.
fn agree(
    what: &str,
    of: fn(&RunResult) -> f64,
    (ours, theirs): (&[RunResult], &[RunResult]),
    motion: f64,
) {
    let moments = |all: &[RunResult]| {
        let n = all.len() as f64;
        let mean = all.iter().map(of).sum::<f64>() / n;
        let square = all.iter().map(|one| (of(one) - mean) * (of(one) - mean)).sum::<f64>();
        (mean, square / (n - 1.0) / n)
    };
    let ((a, va), (b, vb)) = (moments(ours), moments(theirs));
    let allowed = ERRORS * (va + vb).sqrt() + motion;
    println!("{what}: {a:.2}, BlueSky {b:.2}, allowed difference {allowed:.2}");
    assert!((a - b).abs() <= allowed, "{what}: {a}, BlueSky {b}, may differ by {allowed}");
}

fn all_agree(n: usize, ours: &[RunResult], theirs: &[RunResult]) {
    let both = (ours, theirs);
    agree(&format!("{n}: losses"), |one| one.losses, both, 0.0);
    agree(&format!("{n}: closest approach in m"), |one| one.nearest_m, both, 5.0);
    agree(&format!("{n}: flight time in s"), |one| one.mean_flown_s, both, 1.0);
    assert!(ours.iter().chain(theirs).all(|one| one.arrived == n as u64), "{n}: some never arrive");
}

#[test]
fn mvp_flies_as_in_bluesky() {
    for (n, theirs) in fixture().flown {
        let ours: Vec<RunResult> = (0..theirs.len()).map(|run| ours(&case(n, run))).collect();
        all_agree(n, &ours, &theirs);
    }
}

#[test]
fn conflicts_are_remembered_over_a_checkpoint() {
    let source = scenario(&case(10, 0));
    let mut whole = airspace_run(&source, 1).expect("a scenario");
    for _ in 0..60 {
        let mut resumed = airspace_run(&source, 1).expect("a scenario");
        resumed.restore(&whole.checkpoint()).expect("its own checkpoint");
        resumed.advance(1);
        whole.advance(1);
        assert_eq!(resumed.digest(), whole.digest(), "after cycle {}", whole.cycle());
    }
}

#[test]
fn bluesky_itself_flies_as_was_measured() {
    let python = sidestep_testing::python();
    let has = Command::new(&python).args(["-c", "import bluesky"]).output();
    if !has.is_ok_and(|output| output.status.success()) {
        sidestep_testing::skip(format!(
            "{} has no bluesky (pip install bluesky-simulator==1.1.1)",
            python.display()
        ));
        return;
    }
    let Fixture { limits, mut flown } = fixture();
    // A few, because BlueSky takes its time.
    let runs = 2;
    flown.retain(|n, _| *n <= 10);
    let asked: Vec<(usize, usize)> =
        flown.keys().flat_map(|&n| (0..runs).map(move |run| (n, run))).collect();
    let cases: Vec<_> = asked.iter().map(|&(n, run)| case(n, run)).collect();
    let file = std::env::temp_dir().join(format!("sidestep-bluesky-{}.json", std::process::id()));
    std::fs::write(&file, json!({ "limits": limits, "cases": cases }).to_string()).expect("room");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/fly_bluesky.py");
    let output = Command::new(&python).arg(script).arg(&file).output().expect("python starts");
    std::fs::remove_file(&file).expect("it was written");
    let said = String::from_utf8_lossy(&output.stderr);
    let found: Vec<RunResult> =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {said}"));
    for (&n, measured) in &flown {
        let again = found.iter().zip(&asked).filter(|(_, of)| of.0 == n).map(|(one, _)| *one);
        let again: Vec<RunResult> = again.collect();
        all_agree(n, &again, &measured[..runs]);
    }
}
