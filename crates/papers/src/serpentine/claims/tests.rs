//! Tests of verdicts on made-up numbers.

use super::super::*;
use super::*;
use crate::cells::Value::{Count, Maybe, Number, Word, Yes};
use crate::cells::{Cell, Share, Value};
use sidestep::statistics::Interval;
use sidestep_document::Estimate;

fn yes(n: usize) -> Value {
    Value::Share(Share::of(vec![true; n]))
}

fn no() -> Value {
    Value::Share(Share::of([false]))
}

fn sure(value: f64) -> Value {
    let interval = Some(Interval { low: value, high: value });
    Value::Estimate(Estimate { mean: Some(value), interval, n: 3 })
}

fn word(text: &str) -> Value {
    Word(text.into())
}

/// Values of any cell of a run, if all is well.
fn clean() -> Vec<(&'static str, Value)> {
    let counts = ["vetoes", "penetrations", "bumper_events", "too_long"];
    let shares = ["arrived", "untouched", "reached", "whole", "can", "ends_kept"];
    let mut all: Vec<_> = counts.map(|name| (name, Count(0))).into();
    all.extend(shares.map(|name| (name, yes(3))));
    all.extend([
        ("steps", Count(100)),
        ("min_clearance_m", Maybe(Some(0.1))),
        ("rod_violation_m", Number(1e-15)),
        ("min_gap_m", Number(0.1)),
        ("max_lag_m", Number(0.1)),
        ("median_us", Number(1.0)),
        ("speed_m_s", sure(0.5)),
        ("in_band_percent", sure(99.0)),
        ("inside_percent", sure(0.0)),
        ("veto_percent", sure(0.0)),
        ("way_percent", sure(100.0)),
        ("real_time", sure(100.0)),
    ]);
    all
}

/// A minimal report that satisfies the slides: one cell of each kind.
fn ideal() -> Report {
    let ride = |leaving| {
        let case = [("width_m", Number(2.0)), ("followers", Count(15)), ("leaving", word(leaving))];
        Cell::new(case, clean())
    };
    let turned = |rotation| Cell::new([("rotation", word(rotation))], clean());
    let crossed = |leaving, leave_rule, speed_ratio| {
        let case = [
            ("discs", Count(10)),
            ("speed_ratio", Number(speed_ratio)),
            ("leaving", word(leaving)),
            ("leave_rule", Yes(leave_rule)),
        ];
        Cell::new(case, clean())
    };
    let met = |escape| Cell::new([("escape", word(escape))], clean());
    let solved = |way: postures::Way| {
        let case = [("way", word(way.key())), ("links", Count(7)), ("slack", Number(0.0))];
        Cell::new(case, clean())
    };
    let joined = |gone| {
        let case = [
            ("scattered", Count(10)),
            ("by_m", Number(1.0)),
            ("gone", Count(gone)),
            ("may_come", Yes(false)),
        ];
        Cell::new(case, clean())
    };
    let size = |connectors| scaling::Size {
        connectors,
        fixed_us: connectors as f64,
        fixed_moved: connectors as f64,
        slack_us: 1.0,
        slack_moved: 1.0,
    };
    let case = [("filled", Number(0.1)), ("movers", Count(0)), ("connectors", Count(450))];
    let snake = Cell::new(case, clean());
    let all = Share::of([true; 3]);
    let bend = initiators::Bend {
        limit_deg: 60.0,
        in_space: true,
        moved: all,
        other_vetoes: 0,
        exceeded: 0,
        sharpest_deg: 60.0,
    };
    use postures::Way::{FreeBase, LeastSquares, ThereAndBack, Veto};
    Report {
        plan: Plan::quick(),
        program_version: "0".into(),
        corridor: corridor::Corridor { cells: vec![ride("latched"), ride("level")] },
        rotations: rotation::Rotations { cells: vec![turned("union"), turned("literal")] },
        fields: field::Fields {
            cells: vec![
                crossed("latched", true, 0.0),
                crossed("level", false, 0.0),
                crossed("latched", true, 1.0),
            ],
        },
        pushing: pushing::Pushing { cells: Vec::new() },
        movers: movers::Movers { cells: vec![met("off"), met("look-ahead")] },
        snakes: snake::Snakes { cells: vec![snake] },
        scaling: scaling::Scaling {
            sizes: vec![size(50), size(1000)],
            far: vec![scaling::Far { balls: 0, us: 1.0, same: true }],
        },
        broken: broken::Broken { cells: vec![joined(0), joined(2)] },
        postures: postures::Postures {
            cells: [Veto, FreeBase, ThereAndBack, LeastSquares].map(solved).into(),
        },
        initiators: initiators::Initiators {
            moved: all,
            halves_alike: all,
            base_objected: all,
            failed_objected: all,
            kept: all,
            told: all,
            bends: vec![bend],
        },
        claims: Vec::new(),
        scenes: Vec::new(),
    }
}

fn ids(report: &Report, verdict: Verdict) -> Vec<&'static str> {
    judge(report).iter().filter(|c| c.verdict == verdict).map(|c| c.id).collect()
}

#[test]
fn ideal_numbers_hold_all_claims_but_the_one_without_a_measure() {
    let report = ideal();
    assert_eq!(ids(&report, Verdict::NotHeld), [""; 0]);
    assert_eq!(ids(&report, Verdict::Lost), ["E5"]);
    assert!(judge(&report).iter().all(|c| !c.ours.is_empty() && !c.reason.is_empty()));
}

#[test]
fn nothing_measured_is_lost() {
    let mut report = ideal();
    report.corridor.cells.clear();
    report.fields.cells.clear();
    report.snakes.cells.clear();
    report.scaling.sizes.clear();
    let lost = ids(&report, Verdict::Lost);
    for id in ["P5, E4", "P6", "V6", "F4", "N3", "N5a", "N5b", "N6a", "N6b", "E1", "E2", "E3"] {
        assert!(lost.contains(&id), "{id}: {lost:?}");
    }
}

#[test]
fn each_number_speaks_against_its_own_claims() {
    type Spoil = fn(&mut Report);
    let cases: [(Spoil, &[&str]); 17] = [
        (|r| r.corridor.cells[0].put("bumper_events", Count(1)), &["E2"]),
        (|r| r.corridor.cells[0].put("vetoes", Count(1)), &["E3"]),
        (|r| r.corridor.cells[0].put("penetrations", Count(1)), &["N6a", "E2"]),
        (|r| r.corridor.cells[0].put("in_band_percent", sure(50.0)), &["N3"]),
        (|r| r.corridor.cells[1].put("rod_violation_m", Number(1e-6)), &["V5"]),
        (|r| r.rotations.cells[1].put("penetrations", Count(1)), &["A7, A8"]),
        (|r| r.fields.cells[0].put("untouched", no()), &["N5b"]),
        (|r| r.fields.cells[1].put("arrived", no()), &["N5a"]),
        (|r| r.fields.cells[2].put("arrived", no()), &["N6b"]),
        (|r| r.movers.cells[1].put("inside_percent", sure(0.1)), &["P2"]),
        (|r| r.snakes.cells[0].put("real_time", sure(0.9)), &["E1"]),
        (|r| r.snakes.cells[0].put("penetrations", Count(1)), &["V6", "F4"]),
        (|r| r.scaling.sizes[1].fixed_us *= 3.0, &["P5, E4"]),
        (|r| r.scaling.far[0].same = false, &["P5, E4"]),
        (|r| r.broken.cells[1].put("whole", no()), &["F3b"]),
        (|r| r.postures.cells[0].put("reached", no()), &["F2a"]),
        (|r| r.initiators.bends[0].exceeded = 1, &["F1"]),
    ];
    for (spoil, expected) in cases {
        let mut report = ideal();
        spoil(&mut report);
        assert_eq!(ids(&report, Verdict::NotHeld), expected);
    }
}

#[test]
fn discs_that_only_touching_chains_run_into_say_nothing_of_those_that_look_ahead() {
    let mut report = ideal();
    report.movers.cells[0].put("inside_percent", sure(30.0));
    let claims = judge(&report);
    assert_eq!(claims[0].verdict, Verdict::Held);
    assert!(claims[0].ours.contains("off: up to 30.00 %"), "{}", claims[0].ours);
}

#[test]
fn a_full_plan_runs_all_variants_of_the_sweep_files() {
    let plan = Plan::default();
    let studies = [corridor::study, rotation::study, movers::study, snake::study];
    let full = studies.map(|study| study(&plan).expect("right files").len());
    assert_eq!(full, [7 * 4, 9 * 3, 8 * 2 * 5, 2 * 4]);
    let quick = studies.map(|study| study(&Plan::quick()).expect("right files").len());
    assert_eq!(quick, [2 * 3, 3, 8 * 2, 4]);
}
