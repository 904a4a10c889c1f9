//! Texts for people: a scenario's contents, a run's outcome, and all positions.

use super::deploy::deployment::Deployment;
use super::metrics::{ArmMetrics, ChainAbandonedSubtask, Metrics, RobotMetrics};
use super::scenario::ChainScenario;
use super::state::Snapshot;
use serde_json::{Value, json};
use sidestep_kernel::World;
use sidestep_kernel::text::{
    JsonTextReport, KeyValues, align_pairs, format_fixed, group_thousands, key_value_pair,
};

/// Returns what a scenario has and how long it lasts, before it runs.
pub(super) fn describe_scenario<const D: usize>(compiled: &ChainScenario<D>) -> JsonTextReport {
    JsonTextReport {
        json: scenario_contents_json(compiled),
        text: align_pairs(&scenario_contents_lines(compiled)),
    }
}

fn scenario_contents_json<const D: usize>(compiled: &ChainScenario<D>) -> Value {
    let world = &compiled.world;
    let rods: usize = world.chains.iter().map(|spec| spec.start.rods().len()).sum();
    let plan = compiled.plan();
    json!({
        "name": plan.name,
        "seed": plan.seed,
        "cycles": plan.cycles,
        "chains": world.chains.len(),
        "connectors": world.agent_count(),
        "rods": rods,
        "obstacles": world.obstacles.still().len(),
        "movers": world.movers.len(),
        "dimensions": D,
        "dt_s": world.dt_s,
        "deployment": world.deployment,
    })
}

fn scenario_contents_lines<const D: usize>(compiled: &ChainScenario<D>) -> KeyValues {
    let world = &compiled.world;
    let plan = compiled.plan();
    let chains = group_thousands(world.chains.len() as u64);
    let parts = group_thousands(world.agent_count() as u64);
    let still = group_thousands(world.obstacles.still().len() as u64);
    let moving = group_thousands(world.movers.len() as u64);
    let cycles = group_thousands(plan.cycles);
    let dt_s = world.dt_s;
    let lasts_s = plan.cycles as f64 * dt_s;
    let mut lines = vec![
        key_value_pair("chains", format!("{chains}, of {parts} connectors in {D} dimensions")),
        key_value_pair("obstacles", format!("{still}, and {moving} that move")),
        key_value_pair(
            "run",
            format!("{cycles} cycles of {dt_s} s ({lasts_s} s), seed {}", plan.seed),
        ),
    ];
    if world.deployment == Deployment::Team {
        let network = match &world.network {
            None => "loses nothing".into(),
            Some(n) => format!(
                "{} s a message, loses {} %, a cycle's talk ends after {} s",
                n.latency_s,
                100.0 * n.loss,
                n.deadline_s
            ),
        };
        let words = format!("an agent per connector; the network: {network}");
        lines.push(key_value_pair("deployment", words));
    }
    lines
}

pub(super) fn describe_poses<const D: usize>(snapshot: &Snapshot) -> JsonTextReport {
    let mut rows = Vec::new();
    let axes: String =
        ["x_m", "y_m", "z_m"][..D].iter().map(|axis| format!("{axis:>12}")).collect();
    let mut text = format!("  chain  connector{axes}\n");
    for (chain, record) in snapshot.chains.iter().enumerate() {
        for (connector, at) in record.points_m.chunks_exact(D).enumerate() {
            rows.push(json!({ "chain": chain, "connector": connector, "at_m": at }));
            let at = at.iter().map(|x| format!("{x:>12.4}")).collect::<String>();
            text.push_str(&format!("  {chain:<5}  {connector:<9}{at}\n"));
        }
    }
    JsonTextReport { json: Value::Array(rows), text }
}

/// Returns the outcome of a run; what did not occur is mostly left out.
pub(super) fn summary_lines(m: &Metrics) -> KeyValues {
    let mut lines = motion_lines(m);
    lines.extend(m.robots.as_ref().map(robots));
    lines.extend(m.arms.as_ref().map(joints));
    lines.extend(recovery_text(m));
    lines.extend(network(m));
    if m.reformed > 0 {
        lines.push(key_value_pair("re-formed", format!("{} times", group_thousands(m.reformed))));
    }
    if m.not_reformed > 0 {
        lines.push(key_value_pair("NOT re-formed", not_reformed_text(m)));
    }
    lines.extend(m.given_up.iter().take(MAX_LISTED_PARTS).map(abandoned_task_text));
    if m.given_up.len() > MAX_LISTED_PARTS {
        let more = group_thousands((m.given_up.len() - MAX_LISTED_PARTS) as u64);
        lines.push(key_value_pair("given up", format!("and {more} more")));
    }
    lines
}

/// Length below which a rod out of its limits is a matter of rounding, m.
const ROUNDING_M: f64 = 1e-9;

fn rod_violation_text(violation_m: f64) -> String {
    if violation_m <= ROUNDING_M {
        "within their limits".into()
    } else {
        format!("out of their limits by up to {} m", format_fixed(violation_m, 6))
    }
}

/// Returns the chains' progress, its cost, and the limits that they kept.
fn motion_lines(m: &Metrics) -> KeyValues {
    let clearance = match m.min_clearance_m {
        None => "nothing came near".into(),
        Some(c) if c.abs() < TOUCH_M => "touched".into(),
        Some(c) => format!("{} m", format_fixed(c, 4)),
    };
    let penetrations = match m.penetrations {
        0 => "none".into(),
        n => {
            let in_a_row = group_thousands(m.longest_inside_steps);
            format!(
                "{} steps with a part in an obstacle or in its own body, up to {in_a_row} in a row",
                group_thousands(n)
            )
        }
    };
    let moved = m.moved_per_step;
    let turned = group_thousands(m.rotations);
    let mut lines = vec![
        key_value_pair("progress", format!("{:.1} %", 100.0 * m.progress)),
        key_value_pair("vetoes", vetoes_text(m)),
        key_value_pair("penetrations", penetrations),
        key_value_pair("least clearance", clearance),
        key_value_pair("rods", rod_violation_text(m.max_rod_violation_m)),
        key_value_pair(
            "effort",
            format!("{moved:.1} connectors moved per step, {turned} rods turned"),
        ),
        key_value_pair("greatest speed", format!("{:.3} m/s", m.max_speed_m_s)),
    ];
    lines.extend(
        m.min_own_gap_m.map(|gap_m| key_value_pair("own parts", own_parts_gap_text(gap_m))),
    );
    lines
}

/// Returns how near the parts of a chain came to each other.
fn own_parts_gap_text(gap_m: f64) -> String {
    match gap_m {
        overlap_m if overlap_m < -TOUCH_M => {
            format!("overlapped by up to {} m", format_fixed(-gap_m, 4))
        }
        touch_m if touch_m < TOUCH_M => "touched each other".into(),
        _ => format!("at least {} m apart", format_fixed(gap_m, 4)),
    }
}

/// Returns how well the robots of swarms kept to their connectors.
fn robots(robots: &RobotMetrics) -> (String, String) {
    let bumpers = match robots.bumper_events {
        0 => "no bumper pressed".into(),
        n => format!("bumpers pressed {} times", group_thousands(n)),
    };
    let mean_m = robots.mean_lag_m;
    let max_m = robots.max_lag_m;
    key_value_pair(
        "robots",
        format!(
            "{bumpers}; behind their connectors by {mean_m:.2} m on average, {max_m:.2} m at most"
        ),
    )
}

/// Returns how much of the limits of their rates the joints of arms used.
fn joints(arms: &ArmMetrics) -> (String, String) {
    let shares = [arms.max_speed_ratio, arms.max_acceleration_ratio, arms.max_jerk_ratio];
    let [speed, acceleration, jerk] = shares.map(|share| format!("{:.1} %", 100.0 * share));
    let words = format!(
        "up to {speed} of their speed, {acceleration} of their acceleration, {jerk} of their jerk"
    );
    key_value_pair("joints", words)
}

fn not_reformed_text(m: &Metrics) -> String {
    let times = format!("{} times", group_thousands(m.not_reformed));
    match m.missing_parts {
        0 => times,
        1 => format!("{times}; 1 part is missing"),
        n => format!("{times}; {} parts are missing", group_thousands(n)),
    }
}

/// Returns how initiators continued after vetoes, and the results of getting out of the way; no
/// lines if there were none.
fn recovery_text(m: &Metrics) -> KeyValues {
    let rungs = &m.rungs;
    let went_on = count_list(&[
        (rungs.shorter, "shorter steps"),
        (rungs.sideways, "to the side"),
        (rungs.turned, "turns on the spot"),
        (rungs.waited, "waited"),
        (rungs.pulled_back, "pulled by the other end"),
        (rungs.stuck, "stuck"),
        (rungs.planned, "paths planned"),
        (rungs.not_planned, "plans without a path"),
    ]);
    let escapes = &m.escapes;
    let escaped = count_list(&[
        (escapes.moves, "parts moved away"),
        (escapes.vetoes, "could not"),
        (escapes.capped, "of these too slow"),
    ]);
    let mut lines = KeyValues::new();
    lines.extend(went_on.map(|counts| key_value_pair("after vetoes", counts)));
    lines.extend(escaped.map(|counts| key_value_pair("escapes", counts)));
    lines
}

/// Returns counts with their nouns, except those of 0; none if all are.
fn count_list(counts: &[(u64, &str)]) -> Option<String> {
    let counts = counts.iter().filter(|(n, _)| *n > 0);
    let words: Vec<String> =
        counts.map(|(n, noun)| format!("{} {noun}", group_thousands(*n))).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// Returns the traffic on the network of the agents, and its faults; no lines where there are no agents.
fn network(m: &Metrics) -> KeyValues {
    let mut lines = KeyValues::new();
    if m.messages > 0 {
        let sent = format!("{}, {} bytes", group_thousands(m.messages), group_thousands(m.bytes));
        lines.push(key_value_pair("messages", sent));
    }
    let faults = count_list(&[
        (m.contacts_lost, "contacts lost"),
        (m.deadlines_missed, "leaders out of time"),
        (m.stood, "steps stood because of that"),
        (m.dropped, "messages that made no sense"),
    ]);
    lines.extend(faults.map(|faults| key_value_pair("network", faults)));
    lines
}

/// Distance below which bodies touch, meters.
const TOUCH_M: f64 = 1e-6;
/// Largest number of given-up parts that are listed; the others are only counted.
const MAX_LISTED_PARTS: usize = 5;

fn vetoes_text(m: &Metrics) -> String {
    if m.vetoes == 0 {
        return "none".into();
    }
    let reasons = m.vetoes_by_reason.iter().filter(|(_, n)| **n > 0);
    let reasons = reasons.map(|(reason, n)| format!("{reason} {}", group_thousands(*n)));
    format!("{}: {}", group_thousands(m.vetoes), reasons.collect::<Vec<_>>().join(", "))
}

fn abandoned_task_text(abandoned: &ChainAbandonedSubtask) -> (String, String) {
    let what = &abandoned.what;
    let why = match (&what.by, &what.reason) {
        (Some(by), Some(reason)) => format!("connector {by} objected: {reason}"),
        _ => "no connector objected".into(),
    };
    let nearest = if what.nearest_m.is_finite() {
        format!(", came within {:.4} m", what.nearest_m)
    } else {
        String::new()
    };
    let who = format!("chain {}, task {}, part {}", abandoned.chain, what.task, what.part);
    key_value_pair("given up", format!("{who}{nearest}; {why}"))
}
