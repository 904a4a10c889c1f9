//! Tests of verdicts on made-up numbers.

use super::super::cost_model::{CostModel, Parameter};
use super::super::floor::AvoidancePolicy;
use super::super::genericity::{BuildOutcomes, GenericityResults};
use super::super::measure::{LoriaVariant, RunMeasures};
use super::super::performance::{InitializationCost, LoadTiming, PerformanceResults, loads};
use super::super::reliability::ReliabilityResults;
use super::super::strategies::{StrategyResults, StrategyTiming};
use super::super::{LoriaConfig, LoriaReport};
use super::*;
use sidestep::statistics::Interval;
use sidestep::worlds::robots::baseline::Strategy;
use sidestep::worlds::robots::world::Regime;
use sidestep_document::Estimate;

/// Outcomes as the paper has them; where `is_right` is false, each order is the other way around.
fn outcome(variant: &LoriaVariant, seed: usize, is_right: bool) -> RunMeasures {
    // Errors of both kinds are worst, those of sensors worse than those of effectors.
    let rank = match variant.regime {
        Regime::Reliable => 0.0,
        Regime::Effectors => 1.0,
        Regime::Sensors => 2.0,
        Regime::Both => 10.0,
    };
    let sign = if is_right { 1.0 } else { -1.0 };
    let noise = 0.01 * (seed % 5) as f64;
    let saved = if variant.mind == AvoidancePolicy::Filter { 1.0 + 0.5 * rank } else { 0.0 };
    RunMeasures {
        contacts: Some(100.0 + sign * rank * (1.0 + noise)),
        trip_cycles: Some(500.0 + sign * ((10.0 + noise) * rank - saved)),
        straightness: Some(0.8 - sign * 0.01 * rank * (1.0 + noise)),
        lateral_moves: Some(100.0 + sign * rank * (1.0 + noise)),
        trips: Some(3.0),
        lawful: true,
        ..RunMeasures::default()
    }
}

/// Factors near one value, by repeat.
fn near(value: f64, plan: &LoriaConfig) -> Vec<Option<f64>> {
    (0..plan.repeats).map(|k| Some(value * (1.0 + 0.001 * k as f64))).collect()
}

fn genericity(plan: &LoriaConfig) -> GenericityResults {
    let lawful = RunMeasures { lawful: true, ..RunMeasures::default() };
    let build =
        |camera| BuildOutcomes { size: 2, camera, outcomes: vec![lawful.clone(); plan.seeds] };
    GenericityResults { builds: [false, true].map(build).into(), cycles: plan.cycles }
}

/// Timings on a quiet machine of two processors.
fn performance(plan: &LoriaConfig) -> PerformanceResults {
    let loads = loads(plan);
    let timing = |load: usize, workers: usize, recorded| {
        let dear = if loads[load].operations > 1000 { 0.1 } else { 0.0 };
        let ratios = near(if workers == 1 { 1.0 } else { 1.2 + dear }, plan);
        LoadTiming {
            load,
            workers,
            recorded,
            cycle_ms: Estimate::from_values(near(1.0, plan)),
            speed_up: Estimate::from_factors(ratios.iter().copied()),
            ratios,
            machine: Estimate::from_factors(near(workers as f64, plan)),
        }
    };
    let of_load =
        |load| [(1, false), (2, false), (1, true), (2, true)].map(|(w, r)| timing(load, w, r));
    let share = Estimate::from_values(near(0.001, plan));
    let initialization =
        |load| InitializationCost { load, seconds: 0.1, share_alone: share, share_together: share };
    PerformanceResults {
        processors: 2,
        timings: (0..loads.len()).flat_map(of_load).collect(),
        initialization: (0..loads.len()).map(initialization).collect(),
        loads,
        digests: [1, 2, 3, 4, 8, 16].map(|workers| (workers, "d".to_string())).into(),
        recorded_digest: "d".into(),
    }
}

fn strategies(plan: &LoriaConfig) -> StrategyResults {
    let loads = loads(plan);
    let trial = |load: usize, strategy: &str, value: f64| {
        let ratios = near(value, plan);
        StrategyTiming {
            load,
            strategy: strategy.into(),
            workers: 2,
            cycle_ms: Estimate::from_values(near(1.0, plan)),
            speed_up: Estimate::from_factors(ratios.iter().copied()),
            ratios,
            machine: Estimate::from_factors(near(2.0, plan)),
            contacts: 1.0,
            serial_share: 0.0,
            valid: true,
            complete: true,
        }
    };
    let of_load = |load| {
        let others = Strategy::ALL.map(|strategy| trial(load, strategy.name(), 1.1));
        others.into_iter().chain([trial(load, "double pool", 1.5)]).collect::<Vec<_>>()
    };
    StrategyResults { trials: (0..loads.len()).flat_map(of_load).collect(), loads }
}

fn cost_model(low: f64) -> CostModel {
    let c_s = Parameter {
        name: "c_s".into(),
        meaning: String::new(),
        value_ns: low + 1.0,
        interval_ns: Some(Interval { low, high: low + 2.0 }),
    };
    CostModel { parameters: vec![c_s], ..CostModel::fit(Vec::new()) }
}

/// A report of a full plan that satisfies the paper.
fn ideal() -> LoriaReport {
    let plan = LoriaConfig { most_workers: 2, ..LoriaConfig::default() };
    LoriaReport {
        program_version: "0".into(),
        reliability: ReliabilityResults::synthetic(&plan, |variant, seed| {
            outcome(variant, seed, true)
        }),
        genericity: genericity(&plan),
        performance: performance(&plan),
        strategies: strategies(&plan),
        cost_model: cost_model(1.0),
        claims: Vec::new(),
        plan,
    }
}

fn ids(report: &LoriaReport, verdict: Verdict) -> Vec<&'static str> {
    judge(report).iter().filter(|c| c.verdict == verdict).map(|c| c.id).collect()
}

const JUDGED: [&str; 13] = [
    "E-4", "E-5", "E-6", "E-8", "E-9", "E-10a", "E-11", "E-12", "E-13a", "E-13b", "E-15a", "E-15b",
    "P-3",
];

#[test]
fn ideal_numbers_hold_all_claims_that_are_judged_and_settings_are_not() {
    let report = ideal();
    assert_eq!(ids(&report, Verdict::Held), JUDGED);
    assert_eq!(ids(&report, Verdict::Lost), ["E-10b", "E-13c", "E-14"]);
    assert_eq!(ids(&report, Verdict::Setting), ["E-1", "E-2", "E-3", "E-7"]);
}

fn set(timings: &mut [LoadTiming], plan: &LoriaConfig, value: f64) {
    for timing in timings {
        timing.ratios = near(value, plan);
        timing.speed_up = Estimate::from_factors(timing.ratios.iter().copied());
    }
}

/// No rule is one that no data can meet, and none is one that all data meet: [`ideal`] numbers hold
/// every claim, and here each claim has a number that refutes it.
#[test]
fn each_claim_has_a_number_that_refutes_it() {
    type Spoil = fn(&mut LoriaReport);
    let cases: [(Spoil, &[&str]); 9] = [
        (|r| r.performance.recorded_digest = "other".into(), &["E-4"]),
        (|r| r.genericity.builds[0].outcomes[7].lawful = false, &["E-5"]),
        (|r| r.genericity.builds[1].outcomes[7].lawful = false, &["E-6"]),
        (
            |r| {
                r.reliability =
                    ReliabilityResults::synthetic(&r.plan, |v, seed| outcome(v, seed, false))
            },
            &["E-8", "E-9", "E-10a", "E-11"],
        ),
        (
            |r| {
                r.performance.initialization[0].share_alone =
                    Estimate::from_values(near(0.1, &r.plan))
            },
            &["E-12"],
        ),
        (|r| set(&mut r.performance.timings, &r.plan, 0.8), &["E-13a", "E-15a"]),
        (|r| set(&mut r.performance.timings, &r.plan, 1.8), &["E-13b", "E-15a"]),
        (|r| r.cost_model = cost_model(-9.0), &["E-15b"]),
        (|r| r.strategies.trials[0].ratios = near(1.9, &r.plan), &["P-3"]),
    ];
    let mut refuted = std::collections::BTreeSet::<&str>::new();
    for (spoil, expected) in cases {
        let mut report = ideal();
        spoil(&mut report);
        assert_eq!(ids(&report, Verdict::Refuted), expected);
        refuted.extend(expected);
    }
    assert_eq!(refuted.len(), JUDGED.len(), "{refuted:?}");
}

#[test]
fn a_busy_machine_refutes_nothing_about_time() {
    let mut report = ideal();
    set(&mut report.performance.timings, &report.plan.clone(), 0.8);
    report.strategies.trials[0].ratios = near(1.9, &report.plan);
    for timing in &mut report.performance.timings {
        timing.machine = Estimate::from_factors(near(1.0, &report.plan));
    }
    assert_eq!(ids(&report, Verdict::Refuted), [""; 0]);
    assert_eq!(ids(&report, Verdict::Undecided), ["E-13a", "E-13b", "E-15a", "P-3"]);
}

#[test]
fn too_few_runs_decide_nothing_that_is_a_mean() {
    let plan = LoriaConfig { most_workers: 2, ..LoriaConfig::quick() };
    let report = LoriaReport {
        reliability: ReliabilityResults::synthetic(&plan, |variant, seed| {
            outcome(variant, seed, true)
        }),
        performance: performance(&plan),
        strategies: strategies(&plan),
        plan,
        ..ideal()
    };
    let held = ids(&report, Verdict::Held);
    assert_eq!(held, ["E-4", "E-5", "E-6", "E-15b"]);
}
