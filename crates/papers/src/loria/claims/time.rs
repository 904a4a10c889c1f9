//! E-12 to E-15 and P-3: time, and its parts.

use super::super::LoriaReport;
use super::super::performance::{LoadTiming, PerformanceResults, REFERENCE_CYCLES};
use super::{Claim, ThresholdTest, Verdict, claim, judge_thresholds};
use sidestep::worlds::robots::baseline::Strategy;
use sidestep_document::Estimate;

/// Share below which initialization is called small.
const SMALL_SHARE: f64 = 0.05;

/// Efficiency with the most workers below which it is said to fall quickly.
const LOW_EFFICIENCY: f64 = 0.75;

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
    let shares = || p.initialization.iter().map(|i| i.share_alone);
    let worst = shares().max_by(|a, b| a.mean_or_zero().total_cmp(&b.mean_or_zero()));
    Claim {
        reason: format!(
            "Held when below {:.0} % for every load, by its interval over repeats; the paper's share and \
             cycles are lost.",
            100.0 * SMALL_SHARE
        ),
        ..claim(
            "E-12",
            judge_thresholds(shares().map(|share| ThresholdTest::below(&share, SMALL_SHARE))),
            format!(
                "Initialization takes up to {} of a run of {REFERENCE_CYCLES} cycles with one \
             worker (share, largest of {} loads).",
                worst.map_or("-".into(), |share| share.to_string()),
                p.loads.len()
            ),
        )
    }
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
    let timings = || p.at_max_workers(false).chain(p.at_max_workers(true));
    let falls =
        judge_thresholds(timings().map(|timing| ThresholdTest::above(&timing.speed_up, 1.0)));
    let machine = Estimate::from_values(timings().map(|timing| timing.machine.mean));
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
    Claim {
        reason: format!(
            "Held when the mean efficiency of all loads is below {LOW_EFFICIENCY} by its interval over \
             repeats; undecided where others were using the machine. The paper went to sixteen \
             processors; {} can show the beginning of a fall only.",
            p.processors
        ),
        ..claim(
            "E-13b",
            match is_time_inconclusive(p) {
                true => Verdict::Undecided,
                false => judge_thresholds([ThresholdTest::below(&efficiency, LOW_EFFICIENCY)]),
            },
            format!(
                "Efficiency with {most} workers, unrecorded: {efficiency}; by load: {}.",
                by_load.join(", ")
            ),
        )
    }
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
    let operations = || p.loads.iter().map(|load| load.operations);
    let (least, most) = (operations().min().unwrap_or(0), operations().max().unwrap_or(0));
    let speed_up = |cost: u32| {
        let timings = p.at_max_workers(false).filter(|t| p.loads[t.load].operations == cost);
        Estimate::from_factors(timings.flat_map(|timing| timing.ratios.iter().copied()))
    };
    claim(
        "E-15a",
        match is_time_inconclusive(p) {
            true => Verdict::Undecided,
            false => judge_thresholds([ThresholdTest::above(&gain, 0.0)]),
        },
        format!(
            "Speed-up with {} workers: {} at {least} operations per decision, {} at {most}; \
             difference {gain}.",
            p.max_workers(),
            speed_up(least),
            speed_up(most),
        ),
    )
}

fn conflicts(report: &LoriaReport) -> Claim {
    let model = &report.cost_model;
    let c_s = model.parameter("c_s").and_then(|p| p.interval_ns);
    let shown = |name: &str| match model.parameter(name) {
        None => "not to be told".into(),
        Some(p) => match p.interval_ns {
            None => format!("{:.0} ns", p.value_ns),
            Some(i) => format!("{:.0} ns [{:.0}, {:.0}]", p.value_ns, i.low, i.high),
        },
    };
    claim(
        "E-15b",
        judge_thresholds([ThresholdTest::interval_above(c_s, 0.0)]),
        format!(
            "Per body in conflict c_s = {}, besides c_d = {} for every body; p = {:.3} to {:.3}; \
             {} runs, R2 of the second step {:.3}.",
            shown("c_s"),
            shown("c_d"),
            model.conflict_share.0,
            model.conflict_share.1,
            model.points.len(),
            model.r_squared[1],
        ),
    )
}

/// Judges the claim about strategies that the paper rejects before any experiment.
fn rejected(report: &LoriaReport) -> Claim {
    let s = &report.strategies;
    let leads = Strategy::ALL.map(|strategy| (strategy.name(), s.lead_over(strategy)));
    let all = || leads.iter().flat_map(|(_, leads)| leads);
    let shown = leads.iter().map(|(name, leads)| {
        let ahead = leads.iter().filter(|lead| lead.is_above(0.0)).count();
        let behind = leads.iter().filter(|lead| lead.is_below(0.0)).count();
        let listed: Vec<String> = leads.iter().map(ToString::to_string).collect();
        format!(
            "over {name}: ahead at {ahead}, behind at {behind} of {} loads ({})",
            leads.len(),
            listed.join("; ")
        )
    });
    let ahead = judge_thresholds(all().map(|lead| ThresholdTest::above(lead, 0.0)));
    claim(
        "P-3",
        unless_inconclusive(&report.performance, ahead),
        format!(
            "Speed-up of the double pool with the most workers less that of the other, {}.",
            shown.collect::<Vec<_>>().join("; ")
        ),
    )
}
