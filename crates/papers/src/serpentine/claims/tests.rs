//! Verdicts from made-up numbers.

use super::super::*;
use super::*;
use sidestep::statistics::Interval;
use sidestep_document::Estimate;

fn yes(n: usize) -> Share {
    Share::of(vec![true; n])
}

fn sure(value: f64) -> Estimate {
    Estimate { mean: Some(value), interval: Some(Interval { low: value, high: value }), n: 3 }
}

/// What the slides would have liked to measure, and no more: one cell of each kind.
fn ideal() -> Report {
    let ride = |leaving| corridor::Cell {
        case: corridor::Case { width_m: 2.0, followers: 15, leaving },
        arrived: yes(3),
        vetoes: 0,
        penetrations: 0,
        steps: 100,
        min_clearance_m: Some(0.1),
        rod_violation_m: 1e-15,
        bumper_events: 0,
        min_gap_m: 0.1,
        mean_lag_m: sure(0.01),
        max_lag_m: 0.1,
        speed_m_s: sure(0.5),
        in_band_percent: sure(99.0),
    };
    let turned = |rotation| rotation::Cell {
        case: rotation::Case { rotation, step_m: 0.01, width_m: 2.0 },
        arrived: yes(3),
        progress_percent: sure(100.0),
        vetoes: 0,
        penetrations: 0,
        steps: 100,
        min_clearance_m: Some(0.0),
        slave_over_master: 1.0,
        rod_violation_m: 0.0,
    };
    let crossed = |leaving, leave_rule, speed_ratio| field::Cell {
        case: field::Case { discs: 10, speed_ratio, leaving, leave_rule },
        arrived: yes(3),
        untouched: yes(3),
        penetrations: 0,
        steps: 100,
        vetoes: 0,
        min_clearance_m: None,
    };
    let met = |escape| movers::Cell {
        case: movers::Case { discs: 8, speed_ratio: 1.0, escape, moves: true },
        inside_percent: sure(0.0),
        veto_percent: sure(0.0),
        stuck_percent: sure(0.0),
        max_speed_m_s: 1.0,
        rod_violation_m: 0.0,
    };
    let solved = |way| postures::Cell {
        case: postures::Case { way, links: 7, slack: 0.0 },
        reached: yes(3),
        finished: 0,
        median_us: 1.0,
        median_iterations: 1.0,
    };
    let joined = |gone| broken::Cell {
        case: broken::Case { scattered: 10, by_m: 1.0, gone, may_come: false },
        can: yes(3),
        whole: yes(3),
        too_long: 0,
        median_passes: 1.0,
        most_passes: 2,
        ends_kept: yes(3),
        rod_violation_m: 0.0,
    };
    let size = |connectors| scaling::Size {
        connectors,
        fixed_us: connectors as f64,
        fixed_moved: connectors as f64,
        slack_us: 1.0,
        slack_moved: 1.0,
    };
    let snake = snake::Cell {
        case: snake::Case { filled: 0.1, movers: 0, connectors: 450 },
        steps_per_s: sure(5000.0),
        real_time: sure(100.0),
        veto_percent: sure(0.0),
        penetrations: 0,
        steps: 100,
        min_clearance_m: Some(0.0),
        way_percent: sure(100.0),
        rod_violation_m: 0.0,
    };
    let bend = initiators::Bend {
        limit_deg: 60.0,
        in_space: true,
        moved: yes(3),
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
            moved: yes(3),
            halves_alike: yes(3),
            base_objected: yes(3),
            failed_objected: yes(3),
            kept: yes(3),
            told: yes(3),
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
        (|r| r.corridor.cells[0].bumper_events = 1, &["E2"]),
        (|r| r.corridor.cells[0].vetoes = 1, &["E3"]),
        (|r| r.corridor.cells[0].penetrations = 1, &["N6a", "E2"]),
        (|r| r.corridor.cells[0].in_band_percent = sure(50.0), &["N3"]),
        (|r| r.corridor.cells[1].rod_violation_m = 1e-6, &["V5"]),
        (|r| r.rotations.cells[1].penetrations = 1, &["A7, A8"]),
        (|r| r.fields.cells[0].untouched = Share::of([false]), &["N5b"]),
        (|r| r.fields.cells[1].arrived = Share::of([true, false]), &["N5a"]),
        (|r| r.fields.cells[2].arrived = Share::of([false]), &["N6b"]),
        (|r| r.movers.cells[1].inside_percent = sure(0.1), &["P2"]),
        (|r| r.snakes.cells[0].real_time = sure(0.9), &["E1"]),
        (|r| r.snakes.cells[0].penetrations = 1, &["V6", "F4"]),
        (|r| r.scaling.sizes[1].fixed_us *= 3.0, &["P5, E4"]),
        (|r| r.scaling.far[0].same = false, &["P5, E4"]),
        (|r| r.broken.cells[1].whole = Share::of([false]), &["F3b"]),
        (|r| r.postures.cells[0].reached = Share::of([false]), &["F2a"]),
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
    report.movers.cells[0].inside_percent = sure(30.0);
    let claims = judge(&report);
    assert_eq!(claims[0].verdict, Verdict::Held);
    assert!(claims[0].ours.contains("off: up to 30.00 %"), "{}", claims[0].ours);
}
