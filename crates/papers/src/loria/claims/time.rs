//! E-12 to E-15 and P-3: time, and its parts.

use super::super::LoriaReport;
use super::super::cost_model::CostModel;
use super::super::performance::{LoadTiming, PerformanceResults, REFERENCE_CYCLES};
use super::{CLAIMS, Claim, ThresholdTest, Verdict, claim, judge_thresholds, with_processors};
use sidestep::worlds::robots::baseline::Strategy;
use sidestep_document::Estimate;

pub(super) fn claims(report: &LoriaReport) -> Vec<Claim> {
    let p = &report.performance;
    vec![
        initialization(p),
        time_falls(report),
        efficiency_falls(p),
        lost_speed_up(p),
        second_machine(),
        costly_decisions(p),
        conflicts(report),
        rejected(report),
    ]
}

fn initialization(p: &PerformanceResults) -> Claim {
    let shares: Vec<Estimate> = p.initialization.iter().map(|i| i.share_alone).collect();
    let worst = shares.iter().max_by(|a, b| a.mean_or_zero().total_cmp(&b.mean_or_zero()));
    let small_share = CLAIMS.threshold("E-12");
    claim(
        "E-12",
        judge_thresholds(shares.iter().map(|share| ThresholdTest::below(share, small_share))),
        format!(
            "Initialization takes up to {} of a run of {REFERENCE_CYCLES} cycles with one \
             worker (share, largest of {} loads).",
            worst.map_or("-".into(), |share| share.to_string()),
            p.loads.len()
        ),
    )
}

/// Returns whether time over workers decides nothing: there is one processor, or others were using them.
fn is_time_inconclusive(p: &PerformanceResults) -> bool {
    p.max_workers() == 1 || p.is_machine_busy()
}

/// Returns a verdict that does not blame a program for a machine that is busy or small.
fn unless_inconclusive(p: &PerformanceResults, verdict: Verdict) -> Verdict {
    match verdict {
        Verdict::Refuted if is_time_inconclusive(p) => Verdict::Undecided,
        verdict => verdict,
    }
}

fn time_falls(report: &LoriaReport) -> Claim {
    let p = &report.performance;
    let most = p.max_workers();
    let timings: Vec<&LoadTiming> = p.at_max_workers(false).chain(p.at_max_workers(true)).collect();
    let min_speed_up = CLAIMS.threshold("E-13a");
    let tests = timings.iter().map(|timing| ThresholdTest::above(&timing.speed_up, min_speed_up));
    let falls = judge_thresholds(tests);
    let machine = Estimate::from_values(timings.iter().map(|timing| timing.machine.mean));
    claim(
        "E-13a",
        unless_inconclusive(p, falls),
        format!(
            "Speed-up with {most} workers: {} unrecorded, {} recorded ({} loads, {} repeats of \
             each; mere arithmetic in turn with them: {machine}).",
            range(p.at_max_workers(false)),
            range(p.at_max_workers(true)),
            p.loads.len(),
            report.plan.repeats,
        ),
    )
}

/// Returns the mean speed-ups of some loads.
fn range<'a>(timings: impl Iterator<Item = &'a LoadTiming>) -> String {
    let means: Vec<f64> = timings.filter_map(|timing| timing.speed_up.mean).collect();
    let least = means.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = means.iter().copied().fold(0.0, f64::max);
    format!("{least:.2} to {greatest:.2}")
}

fn efficiency_falls(p: &PerformanceResults) -> Claim {
    let most = p.max_workers();
    let by_load: Vec<String> = p
        .at_max_workers(false)
        .map(|t| format!("{:.2}", t.speed_up.mean_or_zero() / most as f64))
        .collect();
    let efficiency = p.efficiency();
    let verdict = if is_time_inconclusive(p) {
        Verdict::Undecided
    } else {
        judge_thresholds([ThresholdTest::below(&efficiency, CLAIMS.threshold("E-13b"))])
    };
    let ours = format!(
        "Efficiency with {most} workers, unrecorded: {efficiency}; by load: {}.",
        by_load.join(", ")
    );
    with_processors(p, claim("E-13b", verdict, ours))
}

fn lost_speed_up(p: &PerformanceResults) -> Claim {
    claim(
        "E-13c",
        Verdict::Lost,
        format!("With {} workers: {}.", p.max_workers(), range(p.at_max_workers(false))),
    )
}

fn second_machine() -> Claim {
    claim("E-14", Verdict::Lost, "One machine was used.")
}

fn costly_decisions(p: &PerformanceResults) -> Claim {
    let gain = p.gain_by_cost();
    let least = p.loads.iter().map(|load| load.operations).min().unwrap_or(0);
    let most = p.loads.iter().map(|load| load.operations).max().unwrap_or(0);
    let verdict = if is_time_inconclusive(p) {
        Verdict::Undecided
    } else {
        judge_thresholds([ThresholdTest::above(&gain, 0.0)])
    };
    let ours = format!(
        "Speed-up with {} workers: {} at {least} operations per decision, {} at {most}; \
         difference {gain}.",
        p.max_workers(),
        speed_up_at_cost(p, least),
        speed_up_at_cost(p, most),
    );
    claim("E-15a", verdict, ours)
}

/// Returns the speed-up of all loads with decisions of this cost, unrecorded, with the most workers.
fn speed_up_at_cost(p: &PerformanceResults, operations: u32) -> Estimate {
    let timings = p.at_max_workers(false).filter(|t| p.loads[t.load].operations == operations);
    Estimate::from_factors(timings.flat_map(|timing| timing.ratios.iter().copied()))
}

fn conflicts(report: &LoriaReport) -> Claim {
    let model = &report.cost_model;
    let c_s = model.parameter("c_s").and_then(|p| p.interval_ns);
    claim(
        "E-15b",
        judge_thresholds([ThresholdTest::interval_above(c_s, 0.0)]),
        format!(
            "Per body in conflict c_s = {}, besides c_d = {} for every body; p = {:.3} to {:.3}; \
             {} runs, R2 of the second step {:.3}.",
            parameter_text(model, "c_s"),
            parameter_text(model, "c_d"),
            model.conflict_share.0,
            model.conflict_share.1,
            model.points.len(),
            model.r_squared[1],
        ),
    )
}

fn parameter_text(model: &CostModel, name: &str) -> String {
    let Some(parameter) = model.parameter(name) else { return "not to be told".into() };
    let value_ns = parameter.value_ns;
    match parameter.interval_ns {
        None => format!("{value_ns:.0} ns"),
        Some(i) => format!("{value_ns:.0} ns [{:.0}, {:.0}]", i.low, i.high),
    }
}

/// Judges the claim about strategies that the paper rejects before any experiment.
fn rejected(report: &LoriaReport) -> Claim {
    let mut tests = Vec::new();
    let mut texts = Vec::new();
    for strategy in Strategy::ALL {
        let leads = report.strategies.lead_over(strategy);
        tests.extend(leads.iter().map(|lead| ThresholdTest::above(lead, 0.0)));
        let ahead = leads.iter().filter(|lead| lead.is_above(0.0)).count();
        let behind = leads.iter().filter(|lead| lead.is_below(0.0)).count();
        let listed: Vec<String> = leads.iter().map(ToString::to_string).collect();
        texts.push(format!(
            "over {}: ahead at {ahead}, behind at {behind} of {} loads ({})",
            strategy.name(),
            leads.len(),
            listed.join("; ")
        ));
    }
    claim(
        "P-3",
        unless_inconclusive(&report.performance, judge_thresholds(tests)),
        format!(
            "Speed-up of the double pool with the most workers less that of the other, {}.",
            texts.join("; ")
        ),
    )
}
