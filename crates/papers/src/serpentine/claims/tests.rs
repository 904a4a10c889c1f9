//! Tests of verdicts on made-up numbers.

use super::super::*;
use super::*;
use crate::case_results::Value::{Count, Maybe, Number, Word, Yes};
use crate::case_results::{CaseResults, Proportion, Value};
use sidestep_document::Estimate;

fn yes(n: usize) -> Value {
    Value::Share(Proportion::from_flags(vec![true; n]))
}

fn no() -> Value {
    Value::Share(Proportion::from_flags([false]))
}

fn sure(value: f64) -> Value {
    Value::Estimate(Estimate::from_values([Some(value); 10]))
}

fn no_target() -> Value {
    Value::Share(Proportion::new(0, TARGETS as u64))
}

fn half() -> Proportion {
    Proportion::new(5, 10)
}

/// Targets of a full plan.
const TARGETS: usize = 500;

fn word(text: &str) -> Value {
    Word(text.into())
}

/// Values of any case of a run, if all is well.
fn clean() -> Vec<(&'static str, Value)> {
    let counts = ["vetoes", "penetrations", "bumper_events", "too_long", "outside", "too_fast"];
    let shares = ["arrived", "untouched", "reached", "whole", "can", "ends_kept"];
    let mut all: Vec<_> = counts.map(|name| (name, Count(0))).into();
    all.extend(shares.map(|name| (name, yes(TARGETS))));
    all.extend([
        ("steps", Count(100)),
        ("min_clearance_m", Maybe(Some(0.1))),
        ("rod_violation_m", Number(1e-15)),
        ("off_m", Number(1e-16)),
        ("fastest", Number(1.0)),
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

/// A minimal report that satisfies the slides: one case of each kind.
fn ideal() -> SerpentineReport {
    let ride = |leaving| {
        let case = [("width_m", Number(2.0)), ("followers", Count(15)), ("leaving", word(leaving))];
        CaseResults::new(case, clean())
    };
    let turned = |rotation| CaseResults::new([("rotation", word(rotation))], clean());
    let crossed = |leaving, leave_rule, speed_ratio| {
        let case = [
            ("discs", Count(10)),
            ("speed_ratio", Number(speed_ratio)),
            ("leaving", word(leaving)),
            ("leave_rule", Yes(leave_rule)),
        ];
        CaseResults::new(case, clean())
    };
    let reached =
        |planner| CaseResults::new([("pillars", Count(3)), ("planner", word(planner))], clean());
    let met = |escape| CaseResults::new([("escape", word(escape))], clean());
    let solved = |way: postures::IkMethod| {
        let case = [("way", word(way.key())), ("links", Count(7)), ("slack", Number(0.1))];
        CaseResults::new(case, clean())
    };
    let joined = |gone| {
        let case = [
            ("scattered", Count(10)),
            ("by_m", Number(1.0)),
            ("gone", Count(gone)),
            ("may_come", Yes(false)),
        ];
        CaseResults::new(case, clean())
    };
    let size = |connectors| scaling::OpenTiming {
        connectors,
        fixed_us: connectors as f64,
        fixed_us_by_repeat: vec![connectors as f64; 5],
        fixed_moved: connectors as f64,
        slack_us: 1.0,
        slack_moved: 1.0,
    };
    let case = [("filled", Number(0.1)), ("movers", Count(0)), ("connectors", Count(450))];
    let snake = CaseResults::new(case, clean());
    let all = Proportion::from_flags([true; 30]);
    let bend = initiators::BendLimitResult {
        limit_deg: 60.0,
        in_space: true,
        moved: all,
        other_vetoes: 0,
        exceeded: 0,
        sharpest_deg: 60.0,
    };
    use postures::IkMethod::{FreeBase, LeastSquares, ThereAndBack, Veto};
    SerpentineReport {
        plan: SerpentineConfig::quick(),
        program_version: "0".into(),
        corridor: corridor::CorridorResults { cases: vec![ride("latched"), ride("level")] },
        rotations: rotation::RotationResults { cases: vec![turned("union"), turned("literal")] },
        fields: field::FieldResults {
            cases: vec![
                crossed("latched", true, 0.0),
                crossed("level", false, 0.0),
                crossed("latched", true, 1.0),
            ],
        },
        pushing: pushing::PushingResults { cases: Vec::new() },
        movers: movers::MoverResults { cases: vec![met("off"), met("look-ahead")] },
        snakes: snake::SnakeResults { cases: vec![snake] },
        scaling: scaling::ScalingResults {
            sizes: vec![size(50), size(1000)],
            far: vec![scaling::FarObstacleTiming {
                balls: 0,
                us: 1.0,
                us_by_repeat: vec![1.0; 5],
                same: true,
            }],
        },
        broken: broken_chain::BreakResults { cases: vec![joined(0), joined(2)] },
        postures: postures::PostureResults {
            cases: [Veto, FreeBase, ThereAndBack, LeastSquares].map(solved).into(),
        },
        initiators: initiators::InitiatorResults {
            moved: all,
            halves_alike: all,
            base_objected: all,
            failed_objected: all,
            kept: all,
            told: all,
            bends: vec![bend],
        },
        arms: arm::ArmResults { cases: arm::PLANNERS.map(reached).into() },
        claims: Vec::new(),
        scenes: Vec::new(),
    }
}

fn ids(report: &SerpentineReport, verdict: Verdict) -> Vec<&'static str> {
    judge(report).iter().filter(|c| c.verdict == verdict).map(|c| c.id).collect()
}

#[test]
fn ideal_numbers_hold_all_claims_but_the_one_without_a_measure() {
    let report = ideal();
    let held = ids(&report, Verdict::Held);
    assert_eq!(held.len(), 24, "{held:?}");
    assert_eq!(ids(&report, Verdict::Lost), ["E5"]);
    assert!(judge(&report).iter().all(|c| !c.ours.is_empty() && !c.reason.is_empty()));
}

#[test]
fn nothing_measured_is_undecided() {
    let mut report = ideal();
    report.corridor.cases.clear();
    report.fields.cases.clear();
    report.snakes.cases.clear();
    report.scaling.sizes.clear();
    let undecided = ids(&report, Verdict::Undecided);
    for id in ["P5, E4", "P6", "V6", "F4", "N3", "N5a", "N5b", "N6a", "N6b", "E1", "E2", "E3"] {
        assert!(undecided.contains(&id), "{id}: {undecided:?}");
    }
}

/// No rule is one that no data can meet, and none is one that all data meet: [`ideal`] numbers hold
/// every claim, and here each claim has a number that refutes it.
#[test]
fn each_claim_has_a_number_that_refutes_it() {
    type Spoil = fn(&mut SerpentineReport);
    let cases: [(Spoil, &[&str]); 27] = [
        (|r| r.corridor.cases[0].set_value("bumper_events", Count(1)), &["E2"]),
        (|r| r.corridor.cases[0].set_value("vetoes", Count(1)), &["E3"]),
        (|r| r.corridor.cases[0].set_value("penetrations", Count(1)), &["N6a", "E2"]),
        (|r| r.corridor.cases[0].set_value("in_band_percent", sure(50.0)), &["N3"]),
        (|r| r.corridor.cases[1].set_value("rod_violation_m", Number(1e-6)), &["V5"]),
        (|r| r.rotations.cases[1].set_value("penetrations", Count(1)), &["A7, A8"]),
        (|r| r.fields.cases[0].set_value("untouched", no()), &["N5b"]),
        (|r| r.fields.cases[1].set_value("arrived", no()), &["N5a"]),
        (|r| r.fields.cases[2].set_value("arrived", no()), &["N6b"]),
        (|r| r.movers.cases[1].set_value("inside_percent", sure(0.1)), &["P2"]),
        (|r| r.arms.cases[0].set_value("too_fast", Count(1)), &["K1, K4"]),
        (|r| r.arms.cases[1].set_value("outside", Count(1)), &["K1, K4"]),
        (|r| r.arms.cases[1].set_value("reached", no()), &["K1, K4"]),
        (|r| r.snakes.cases[0].set_value("real_time", sure(0.9)), &["E1"]),
        (|r| r.snakes.cases[0].set_value("penetrations", Count(1)), &["V6", "F4"]),
        (|r| r.snakes.cases[0].set_value("way_percent", sure(50.0)), &["V6"]),
        (|r| r.scaling.sizes[1].fixed_us_by_repeat = vec![3e3; 5], &["P5, E4"]),
        (|r| r.scaling.sizes[1].fixed_moved = 600.0, &["P6"]),
        (|r| r.scaling.far[0].same = false, &["P5, E4"]),
        (|r| r.broken.cases[0].set_value("ends_kept", no()), &["F3a"]),
        (|r| r.broken.cases[1].set_value("whole", no()), &["F3b"]),
        (|r| r.postures.cases[0].set_value("reached", no_target()), &["F2a"]),
        (|r| r.postures.cases[2].set_value("reached", no_target()), &["P6", "F2b"]),
        (|r| r.initiators.bends[0].exceeded = 1, &["F1"]),
        (|r| r.initiators.moved = half(), &["R4, R5"]),
        (|r| r.initiators.kept = half(), &["R7"]),
        (|r| r.initiators.told = half(), &["R8"]),
    ];
    let mut refuted = std::collections::BTreeSet::<&str>::new();
    for (spoil, expected) in cases {
        let mut report = ideal();
        spoil(&mut report);
        assert_eq!(ids(&report, Verdict::Refuted), expected);
        refuted.extend(expected);
    }
    assert_eq!(refuted.len(), 24, "{refuted:?}");
}

#[test]
fn a_full_plan_has_runs_enough_to_decide() {
    let plan = SerpentineConfig::default();
    let least = [plan.seeds, plan.field_seeds, plan.snake_seeds, plan.breaks];
    assert!(least.into_iter().all(|n| n >= crate::claims::MIN_RUNS), "{least:?}");
    assert_eq!(plan.ik_targets, TARGETS, "as many as 99 % takes");
}

#[test]
fn discs_that_only_touching_chains_run_into_say_nothing_of_those_that_look_ahead() {
    let mut report = ideal();
    report.movers.cases[0].set_value("inside_percent", sure(30.0));
    let claims = judge(&report);
    assert_eq!(claims[0].verdict, Verdict::Held);
    assert!(claims[0].ours.contains("off: up to 30.00 %"), "{}", claims[0].ours);
}

#[test]
fn a_full_plan_runs_all_variants_of_the_sweep_files() {
    let plan = SerpentineConfig::default();
    let studies = [corridor::study, rotation::study, movers::study, snake::study];
    let full = studies.map(|study| study(&plan).expect("right files").len());
    assert_eq!(full, [7 * 4, 9 * 3, 8 * 2 * 5, 2 * 4]);
    let quick = studies.map(|study| study(&SerpentineConfig::quick()).expect("right files").len());
    assert_eq!(quick, [2 * 3, 3, 8 * 2, 4]);
}
