//! The paper's claims, each with our figures and a verdict that follows from them by rule.

use super::Report;
use super::floor::Mind;
use super::reliability::{CONTACTS, Key, LATERAL, STRAIGHTNESS, SweepCase, TRIP, larger};
use crate::experiment::{Estimate, Table};
use crate::worlds::robots::world::Regime;
use Regime::{Both, Effectors, Reliable, Sensors};
use serde::Serialize;

/// What we say of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Our figures agree.
    Held,
    /// Our figures disagree, or agree under some conditions only.
    NotHeld,
    /// It cannot be judged: what the paper measured is lost, or takes another machine.
    Lost,
}

impl Verdict {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        ["held", "not held", "lost"][self as usize]
    }

    fn of(holds: bool) -> Self {
        if holds { Self::Held } else { Self::NotHeld }
    }
}

/// A claim of the paper and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Number; a letter where one sentence of the paper makes several claims.
    pub id: String,
    /// What the paper says, in our words.
    pub paper: String,
    /// Our figures.
    pub ours: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The rule by which it follows, and what limits it.
    pub reason: String,
}

fn claim(
    id: &str,
    paper: &str,
    ours: impl Into<String>,
    verdict: Verdict,
    reason: impl Into<String>,
) -> Claim {
    let (ours, reason) = (ours.into(), reason.into());
    Claim { id: id.into(), paper: paper.into(), ours, verdict, reason }
}

/// The claims as a table.
pub fn table(claims: &[Claim]) -> Table {
    let note = "`lost`: what the paper measured is lost, or takes another machine. Every verdict \
                follows from the figures by the rule in its row; an interval is 95 %.";
    let columns = ["claim", "the paper, in our words", "our figures", "verdict", "why"];
    let mut table = Table::new("Claims", note, &columns);
    for c in claims {
        let verdict = c.verdict.name().to_string();
        table.row([c.id.clone(), c.paper.clone(), c.ours.clone(), verdict, c.reason.clone()]);
    }
    table
}

/// All claims, judged.
pub fn judge(report: &Report) -> Vec<Claim> {
    let mut claims = setting(report);
    claims.extend([zigzag(report), collisions(report)]);
    claims.extend(trips(report));
    claims.push(behaviours(report));
    claims.extend(performance(report));
    claims.extend(costs(report));
    claims
}

/// E-1 to E-7: what the experiments are made of.
fn setting(report: &Report) -> Vec<Claim> {
    let Report { performance, genericity, reliability, strategies, .. } = report;
    let runs: usize = reliability.cells.iter().map(|cell| cell.outcomes.len()).sum();
    let builds: usize = genericity.builds.iter().map(|b| b.outcomes.len()).sum();
    let timed = performance.timings.len() + strategies.trials.len();
    let same_bits = performance.is_deterministic();
    let workers: Vec<String> = performance.digests.iter().map(|d| d.0.to_string()).collect();
    let digest = performance.digests.first().map_or("", |d| d.1.as_str());
    let (small, all) = genericity.completed(false);
    let (with_camera, of) = genericity.completed(true);
    vec![
        claim(
            "E-1",
            "The experiments are to show that the simulator is easy and general, that its parallel model is efficient, and that its stochastic model is valid.",
            format!(
                "{runs} reliability runs, {builds} genericity runs, {timed} timed series, {} runs for the cost model.",
                report.cost_model.points.len()
            ),
            Verdict::Held,
            "All four suites ran to the end; what each shows stands below.",
        ),
        claim(
            "E-2",
            "It ran on a real floor and on virtual ones of various sizes, with various numbers of robots, doors and mobile objects.",
            reliability.floors.join("; "),
            Verdict::Held,
            "Three generated floors ran all four regimes. The paper's sizes and its real floor are lost.",
        ),
        claim(
            "E-3",
            "It ran on up to sixteen processors.",
            format!(
                "Workers {}: {}.",
                workers.join(", "),
                if same_bits { "one digest" } else { "different digests" }
            ),
            Verdict::of(same_bits),
            format!(
                "The same run gives the same bits with every number of workers; of time, this machine can show {} processors only.",
                performance.processors
            ),
        ),
        claim(
            "E-4",
            "The same program runs sequentially and on parallel machines, and its user need not know parallel programming.",
            format!("Digest {digest} with 1 worker, with more, and recorded."),
            Verdict::of(same_bits),
            "One worker is the sequential mode, without a second code path; a user gives a number of workers. Other systems are to compare the digest.",
        ),
        claim(
            "E-5",
            "Robots of other sizes needed no change but the number of boxes, and it was in the source.",
            format!("Sizes 1 to 5: {small} of {all} runs completed trips."),
            Verdict::of(small == all),
            "Held when every size completes trips with every seed; only `size` of the scenario changes, no source.",
        ),
        claim(
            "E-6",
            "A camera with its confusion matrix was easily added, with changes to source and behaviour.",
            format!(
                "With a camera {with_camera} of {of} runs completed trips; contacts per 1000 actions with less without: {}.",
                genericity.camera_effect()
            ),
            Verdict::of(with_camera == of),
            "Held when every run with the camera completes trips; only `sensors` of the scenario changes.",
        ),
        claim(
            "E-7",
            "Four cases: all reliable; effectors, sensors, or both unreliable.",
            format!(
                "{} variants x {} seeds, four regimes on each of {} places.",
                reliability.cells.len(),
                report.plan.seeds,
                reliability.places().len()
            ),
            Verdict::Held,
            "`regime` of the scenario switches tables on and off; nothing else differs between the four.",
        ),
    ]
}

/// E-8: trajectories under errors.
fn zigzag(report: &Report) -> Claim {
    let r = &report.reliability;
    let bent = r.difference(Key::BASE, [Both, Reliable], STRAIGHTNESS);
    let lateral = r.estimate(Key::BASE, Both, LATERAL);
    let mean = |regime| r.estimate(Key::BASE, regime, STRAIGHTNESS);
    claim(
        "E-8",
        "With unreliable sensors and effectors trajectories are not straight but slightly zigzag.",
        format!(
            "Straightness: reliable {}, effectors {}, sensors {}, both {}; both - reliable {bent}. Sideways moves per 1000 actions, both: {lateral}; reliable: 0.",
            mean(Reliable),
            mean(Effectors),
            mean(Sensors),
            mean(Both)
        ),
        Verdict::of(bent.is_below(0.0) && lateral.is_above(0.0)),
        "Held when straightness with both is below that of reliable robots and sideways moves are above 0, both by their intervals.",
    )
}

/// E-9: which errors cause more collisions.
fn collisions(report: &Report) -> Claim {
    let r = &report.reliability;
    let order = |key| {
        let sensors = r.difference(key, [Sensors, Effectors], CONTACTS);
        let effectors = r.difference(key, [Effectors, Reliable], CONTACTS);
        (sensors, sensors.is_above(0.0) && effectors.is_above(0.0))
    };
    let places = r.places();
    let held = places.iter().filter(|&&key| order(key).1).count();
    let swept: Vec<(SweepCase, f64)> =
        SweepCase::all().flat_map(|case| r.levels.iter().map(move |&e| (case, e))).collect();
    let more = |by| {
        let is = |&&(case, e): &&(SweepCase, f64)| larger(&r.sensors_less_effectors(case, e)) == by;
        swept.iter().filter(is).count()
    };
    let (sensors, effectors) = (more("sensors"), more("effectors"));
    let at = |regime| r.estimate(Key::BASE, regime, CONTACTS);
    claim(
        "E-9",
        "Errors of sensors cause more collisions than errors of effectors; both more than none.",
        format!(
            "Presets, rule cut, per 1000 actions: reliable {}, effectors {}, sensors {}; sensors - effectors {}. The order holds at {held} of {} places (floors, rules, behaviours). At equal error level, of {} points: sensors more at {sensors}, effectors at {effectors}, not to be told at {}. {}",
            at(Reliable),
            at(Effectors),
            at(Sensors),
            order(Key::BASE).0,
            places.len(),
            swept.len(),
            swept.len() - sensors - effectors,
            flips(report)
        ),
        Verdict::of(held == places.len() && effectors == 0),
        "Held only when the order is the same at all places and at no equal error level turns around. It depends on how often a thing is missed, on how many beams see the same thing, on the behaviour, and on the law for blocked paths.",
    )
}

/// From which error level on sensors cause more contacts, by case of the sweep.
fn flips(report: &Report) -> String {
    let r = &report.reliability;
    let sentence = |case: SweepCase| {
        let is_sensors = |e: f64| larger(&r.sensors_less_effectors(case, e)) == "sensors";
        // The first level from which on it stays so.
        let tail = r.levels.iter().rev().take_while(|&&e| is_sensors(e)).last();
        let [mind, beams, spread] = case.names();
        let from = tail.map_or("at no level".into(), |e| format!("from e = {e} on"));
        format!("{mind}, {beams} beams, {spread}: {from}")
    };
    let cases: Vec<String> = SweepCase::all().map(sentence).collect();
    format!("Sensors cause more, by behaviour, beams and recipe: {}.", cases.join("; "))
}

/// E-10: how long a trip takes.
fn trips(report: &Report) -> [Claim; 2] {
    let r = &report.reliability;
    let slower = |key, other| r.difference(key, [Both, other], TRIP).is_above(0.0);
    let slowest = |key| [Reliable, Effectors, Sensors].into_iter().all(|other| slower(key, other));
    let places = r.places();
    let held = places.iter().filter(|&&key| slowest(key)).count();
    let at = |regime| r.estimate(Key::BASE, regime, TRIP);
    let ratio = |a, b| r.ratio(Key::BASE, [a, b], TRIP);
    let cycles = format!(
        "Cycles per trip: reliable {}, effectors {}, sensors {}, both {}",
        at(Reliable),
        at(Effectors),
        at(Sensors),
        at(Both)
    );
    let ratios = format!(
        "effectors / reliable {}; sensors / reliable {}; both / reliable {}; both / sensors {}; both / effectors {}",
        ratio(Effectors, Reliable),
        ratio(Sensors, Reliable),
        ratio(Both, Reliable),
        ratio(Both, Sensors),
        ratio(Both, Effectors)
    );
    [
        claim(
            "E-10a",
            "A trip to and fro takes longest when sensors and effectors are both unreliable.",
            format!("{cycles}. Both are slowest at {held} of {} places.", places.len()),
            Verdict::of(held == places.len()),
            "Held when, at every place, a trip with both takes longer than with none, with effectors and with sensors alone, each by its paired interval.",
        ),
        claim(
            "E-10b",
            "It takes some times, and a half, as long as in another case.",
            format!("Seed by seed: {ratios}."),
            Verdict::Lost,
            "Factor and the pair of cases are lost; these are all ratios.",
        ),
    ]
}

/// E-11: what uncertainty asks of a behaviour.
fn behaviours(report: &Report) -> Claim {
    let r = &report.reliability;
    let gain = |regime| r.between_minds([Mind::Avoid, Mind::Filter], regime, TRIP);
    let contacts = |regime| r.between_minds([Mind::Filter, Mind::Avoid], regime, CONTACTS);
    let more = difference_of_gains(report);
    claim(
        "E-11",
        "Behaviours are harder to design for unreliable sensors and effectors; simple ones do where all is reliable.",
        format!(
            "A filter (two reports before a robot believes its side beams) saves cycles per trip: reliable {}, both {}, the second less the first {more}; it costs contacts per 1000 actions: reliable {}, both {}.",
            gain(Reliable),
            gain(Both),
            contacts(Reliable),
            contacts(Both)
        ),
        Verdict::of(gain(Both).is_above(0.0) && more.is_above(0.0)),
        "Held when the more elaborate behaviour saves time under errors, and more than it saves without. One pair of behaviours is an example, not a proof.",
    )
}

/// Cycles that the filter saves under both errors, less those that it saves without any.
fn difference_of_gains(report: &Report) -> Estimate {
    let r = &report.reliability;
    let of = |mind, regime| r.values(Key { mind, ..Key::BASE }, regime, TRIP);
    let gains = |regime| -> Vec<Option<f64>> {
        let (plain, filtered) = (of(Mind::Avoid, regime), of(Mind::Filter, regime));
        plain.iter().zip(&filtered).map(|(a, b)| Some((*a)? - (*b)?)).collect()
    };
    Estimate::paired(&gains(Both), &gains(Reliable))
}

/// Initialization is called small below this share.
const SMALL_SHARE: f64 = 0.05;

/// Efficiency is said to fall quickly where it is below this with the most workers.
const LOW_EFFICIENCY: f64 = 0.75;

/// E-12 to E-14: time over workers.
fn performance(report: &Report) -> Vec<Claim> {
    let p = &report.performance;
    let most = p.most_workers();
    let plain: Vec<_> = p.at_most_workers(false).collect();
    let recorded: Vec<_> = p.at_most_workers(true).collect();
    let range = |values: &[f64]| {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = values.iter().copied().fold(0.0, f64::max);
        format!("{least:.2} to {greatest:.2}")
    };
    let speed_ups = |timings: &[&super::performance::Timing]| -> Vec<f64> {
        timings.iter().map(|t| t.speed_up.or_zero()).collect()
    };
    let (free, disk) = (speed_ups(&plain), speed_ups(&recorded));
    let efficiency: Vec<f64> = free.iter().map(|s| s / most as f64).collect();
    let falls = plain.iter().chain(&recorded).all(|t| t.speed_up.is_above(1.0));
    let low = efficiency.iter().filter(|&&e| e < LOW_EFFICIENCY).count();
    let worst = p.initialization.iter().map(|i| i.share_alone).fold(0.0, f64::max);
    let alone = most == 1;
    let unless_alone = |holds| if alone { Verdict::Lost } else { Verdict::of(holds) };
    let range_note = format!(
        "{} loads, {} repeats each, 1 to {most} workers",
        p.loads.len(),
        report.plan.repeats
    );
    vec![
        claim(
            "E-12",
            "Time is that of the cycles with recording to disk; initialization is not parallel and a small share of the whole.",
            format!(
                "Initialization takes up to {:.2} % of a run of {} cycles with one worker (largest of {} loads).",
                100.0 * worst,
                super::performance::REFERENCE_CYCLES,
                p.loads.len()
            ),
            Verdict::of(worst < SMALL_SHARE),
            format!(
                "Held when below {:.0} % for every load; the paper's share and cycles are lost.",
                100.0 * SMALL_SHARE
            ),
        ),
        claim(
            "E-13a",
            "Execution time falls as processors are added.",
            format!(
                "Speed-up with {most} workers: {} unrecorded, {} recorded ({range_note}).",
                range(&free),
                range(&disk)
            ),
            unless_alone(falls),
            "Held when, for every load, recorded or not, the interval of the speed-up with the most workers lies above 1.",
        ),
        claim(
            "E-13b",
            "Speed-up rises slowly and efficiency falls quickly.",
            format!(
                "Efficiency with {most} workers: {} unrecorded; below {LOW_EFFICIENCY} for {low} of {} loads.",
                range(&efficiency),
                efficiency.len()
            ),
            unless_alone(2 * low > efficiency.len()),
            format!(
                "Held when efficiency is below {LOW_EFFICIENCY} for most loads. The paper went to sixteen processors; {} can show the beginning of a fall only.",
                p.processors
            ),
        ),
        claim(
            "E-13c",
            "The first parallel version reached a certain speed-up on a certain number of processors.",
            format!("With {most} workers: {}.", range(&free)),
            Verdict::Lost,
            "Both numbers are lost.",
        ),
        claim(
            "E-14",
            "A small machine under another system gives equivalent results with the same number of processors.",
            "One machine was used.".to_string(),
            Verdict::Lost,
            "The paper's table is lost, and it takes a second machine; digests in this report tell whether another gives the same bits.",
        ),
    ]
}

/// E-15: what makes parallel runs pay, and what costs time.
fn costs(report: &Report) -> [Claim; 2] {
    let p = &report.performance;
    let gain = p.gain_by_cost();
    let operations = || p.loads.iter().map(|load| load.operations);
    let (least, most) = (operations().min().unwrap_or(0), operations().max().unwrap_or(0));
    let mean_speed_up = |cost: u32| {
        let timings = p.at_most_workers(false).filter(|t| p.loads[t.load].operations == cost);
        Estimate::of(timings.flat_map(|t| t.ratios.iter().copied()))
    };
    let alone = p.most_workers() == 1;
    let model = &report.cost_model;
    let shown = |name: &str| match model.parameter(name) {
        Some(p) => {
            let (low, high) = p.interval_ns.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            format!("{:.0} ns [{low:.0}, {high:.0}]", p.value_ns)
        }
        None => "cannot be told".into(),
    };
    let costs_time =
        model.parameter("c_s").and_then(|p| p.interval_ns).is_some_and(|(low, _)| low > 0.0);
    [
        claim(
            "E-15a",
            "Costlier behaviours are expected to give better parallel performance.",
            format!(
                "Speed-up with {} workers: {} at {least} operations per decision, {} at {most}; difference {gain}.",
                p.most_workers(),
                mean_speed_up(least),
                mean_speed_up(most)
            ),
            if alone { Verdict::Lost } else { Verdict::of(gain.is_above(0.0)) },
            "Held when the paired difference of speed-ups, dearest less cheapest decisions, lies above 0; unrecorded, over all numbers of robots.",
        ),
        claim(
            "E-15b",
            "Conflicts, the more so with many agents, cost time in the second step.",
            format!(
                "Per body in conflict c_s = {}, besides c_d = {} for every body; p = {:.3} to {:.3}; {} runs, R2 {:.3}.",
                shown("c_s"),
                shown("c_d"),
                model.conflict_share.0,
                model.conflict_share.1,
                model.points.len(),
                model.r_squared[1]
            ),
            Verdict::of(costs_time),
            "Held when the interval of c_s, fitted over runs of different crowding, lies above 0.",
        ),
    ]
}
