//! E-1 to E-7: the setting of the experiments.

use super::super::LoriaReport;
use super::{Claim, Verdict, claim, judge_every_run, with_processors};

pub(super) fn claims(report: &LoriaReport) -> Vec<Claim> {
    vec![
        suites(report),
        floors(report),
        processors(report),
        sequential(report),
        sizes(report),
        camera(report),
        regimes(report),
    ]
}

fn suites(report: &LoriaReport) -> Claim {
    let runs: usize =
        report.reliability.variants.iter().map(|variant| variant.outcomes.len()).sum();
    let builds: usize = report.genericity.builds.iter().map(|b| b.outcomes.len()).sum();
    let timed = report.performance.timings.len() + report.strategies.trials.len();
    let fitted = report.cost_model.points.len();
    claim(
        "E-1",
        Verdict::Setting,
        format!(
            "{runs} reliability runs, {builds} genericity runs, {timed} timed series, {fitted} \
             runs for the cost model."
        ),
    )
}

fn floors(report: &LoriaReport) -> Claim {
    claim("E-2", Verdict::Setting, report.reliability.floors.join("; "))
}

fn processors(report: &LoriaReport) -> Claim {
    let p = &report.performance;
    let workers: Vec<String> = p.digests.iter().map(|d| d.0.to_string()).collect();
    let ours = format!("Workers {}: {}.", workers.join(", "), digests(report));
    with_processors(p, claim("E-3", Verdict::Setting, ours))
}

fn sequential(report: &LoriaReport) -> Claim {
    let p = &report.performance;
    claim(
        "E-4",
        judge_every_run(p.digests.len() + 1, p.is_deterministic()),
        format!(
            "With 1 worker, with more, and recorded: {}, {}.",
            digests(report),
            p.recorded_digest
        ),
    )
}

fn digests(report: &LoriaReport) -> &'static str {
    if report.performance.is_deterministic() { "one digest" } else { "different digests" }
}

/// Describes runs with or without a camera, and returns whether all kept the laws.
fn builds(report: &LoriaReport, camera: bool) -> (String, Verdict) {
    let [lawful, with_trips, all] = report.genericity.runs(camera);
    let text = format!(
        "Sizes 1 to 5: {lawful} of {all} runs kept the laws, {with_trips} completed trips within \
         {} cycles",
        report.genericity.cycles
    );
    (text, judge_every_run(all, lawful == all))
}

fn sizes(report: &LoriaReport) -> Claim {
    let (ours, verdict) = builds(report, false);
    claim("E-5", verdict, format!("{ours}."))
}

fn camera(report: &LoriaReport) -> Claim {
    let (ours, verdict) = builds(report, true);
    let effect = report.genericity.camera_effect();
    let ours = format!("{ours}; contacts per 1000 actions with the camera less without: {effect}.");
    claim("E-6", verdict, ours)
}

fn regimes(report: &LoriaReport) -> Claim {
    let r = &report.reliability;
    claim(
        "E-7",
        Verdict::Setting,
        format!(
            "{} variants x {} seeds, four regimes at each of {} places.",
            r.variants.len(),
            report.plan.seeds,
            r.base_keys().len()
        ),
    )
}
