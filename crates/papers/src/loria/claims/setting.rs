//! E-1 to E-7: what the experiments are made of.

use super::super::Report;
use super::{Claim, Verdict};

pub(super) fn claims(report: &Report) -> Vec<Claim> {
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

fn suites(report: &Report) -> Claim {
    let runs: usize = report.reliability.cells.iter().map(|cell| cell.outcomes.len()).sum();
    let builds: usize = report.genericity.builds.iter().map(|b| b.outcomes.len()).sum();
    let timed = report.performance.timings.len() + report.strategies.trials.len();
    let fitted = report.cost_model.points.len();
    Claim {
        id: "E-1",
        paper: "The experiments are to show that the simulator is easy and general, that its \
                parallel model is efficient, and that its stochastic model is valid.",
        papers_figure: None,
        ours: format!(
            "{runs} reliability runs, {builds} genericity runs, {timed} timed series, {fitted} \
             runs for the cost model."
        ),
        verdict: Verdict::Held,
        reason: "All four suites ran to the end; what each shows stands below.".into(),
    }
}

fn floors(report: &Report) -> Claim {
    Claim {
        id: "E-2",
        paper: "It ran on a real floor and on virtual ones of various sizes, with various numbers \
                of robots, doors and mobile objects.",
        papers_figure: None,
        ours: report.reliability.floors.join("; "),
        verdict: Verdict::Held,
        reason: "Three generated floors ran all four regimes. The paper's sizes and its real \
                 floor are lost."
            .into(),
    }
}

fn processors(report: &Report) -> Claim {
    let p = &report.performance;
    let workers: Vec<String> = p.digests.iter().map(|d| d.0.to_string()).collect();
    Claim {
        id: "E-3",
        paper: "It ran on up to sixteen processors.",
        papers_figure: Some("16 processors"),
        ours: format!("Workers {}: {}.", workers.join(", "), digests(report)),
        verdict: Verdict::of(p.is_deterministic()),
        reason: format!(
            "The same run gives the same bits with every number of workers; of time, this \
             machine can show {} processors only.",
            p.processors
        ),
    }
}

fn sequential(report: &Report) -> Claim {
    let p = &report.performance;
    Claim {
        id: "E-4",
        paper: "The same program runs sequentially and on parallel machines, and its user need \
                not know parallel programming.",
        papers_figure: None,
        ours: format!(
            "With 1 worker, with more, and recorded: {}, {}.",
            digests(report),
            p.recorded_digest
        ),
        verdict: Verdict::of(p.is_deterministic()),
        reason: "One worker is the sequential mode, without a second code path; a user gives a \
                 number of workers. Other systems are to compare the digest."
            .into(),
    }
}

fn digests(report: &Report) -> &'static str {
    if report.performance.is_deterministic() { "one digest" } else { "different digests" }
}

/// Why a build is judged generic.
const GENERIC: &str = "Held when in every run every robot acts in every cycle and no two bodies \
                       come to share a box";

/// Runs with or without a camera in words, and whether all kept the laws.
fn builds(report: &Report, camera: bool) -> (String, Verdict) {
    let [lawful, with_trips, all] = report.genericity.runs(camera);
    let text = format!(
        "Sizes 1 to 5: {lawful} of {all} runs kept the laws, {with_trips} completed trips within \
         {} cycles",
        report.genericity.cycles
    );
    (text, Verdict::of(lawful == all))
}

fn sizes(report: &Report) -> Claim {
    let (ours, verdict) = builds(report, false);
    Claim {
        id: "E-5",
        paper: "Robots of other sizes needed no change but the number of boxes, and it was in \
                the source.",
        papers_figure: None,
        ours: format!("{ours}."),
        verdict,
        reason: format!("{GENERIC}; only `size` of the scenario changes, no source."),
    }
}

fn camera(report: &Report) -> Claim {
    let (ours, verdict) = builds(report, true);
    let effect = report.genericity.camera_effect();
    Claim {
        id: "E-6",
        paper: "A camera with its confusion matrix was easily added, with changes to source and \
                behaviour.",
        papers_figure: None,
        ours: format!("{ours}; contacts per 1000 actions with the camera less without: {effect}."),
        verdict,
        reason: format!("{GENERIC}; only `sensors` of the scenario changes, no source."),
    }
}

fn regimes(report: &Report) -> Claim {
    let r = &report.reliability;
    Claim {
        id: "E-7",
        paper: "Four cases: all reliable; effectors, sensors, or both unreliable.",
        papers_figure: None,
        ours: format!(
            "{} variants x {} seeds, four regimes at each of {} places.",
            r.cells.len(),
            report.plan.seeds,
            r.places().len()
        ),
        verdict: Verdict::Held,
        reason: "`regime` of the scenario switches the error tables on and off; nothing else \
                 differs between the four."
            .into(),
    }
}
