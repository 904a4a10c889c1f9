//! The world of chains as the command sees it.

use super::{Plan, Run, Said};
use crate::console::grouped;
use crate::report::Lines;
use serde_json::{Value, json};
use sidestep::kernel::checkpoint::CheckpointError;
use sidestep::kernel::cycle::PhaseTimes;
use sidestep::kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep::kernel::view::{Frame, Look, PlaceRows, Scenery};
use sidestep::kernel::{Cycle, Digest, Simulation};
use sidestep::scenario::Source;
use sidestep::worlds::chain::metrics::{ChainGivenUp, Metrics};
use sidestep::worlds::chain::scenario::{AnyCompiled, Compiled};
use sidestep::worlds::chain::simulation::ChainSimulation;

/// A run of chains at its start.
pub(super) fn start(compiled: AnyCompiled, source: &Source, workers: usize) -> Box<dyn Run> {
    match compiled {
        AnyCompiled::Plane(compiled) => Box::new(ChainRun::new(compiled, source, workers)),
        AnyCompiled::Space(compiled) => Box::new(ChainRun::new(compiled, source, workers)),
    }
}

/// A run of chains in `D` dimensions.
struct ChainRun<const D: usize> {
    simulation: ChainSimulation<D>,
}

impl<const D: usize> ChainRun<D> {
    fn new(compiled: Compiled<D>, source: &Source, workers: usize) -> Self {
        Self { simulation: ChainSimulation::new(compiled, source, workers) }
    }
}

delegates_simulation!([const D: usize] ChainRun<D>);

impl<const D: usize> Run for ChainRun<D> {
    fn agent(&self) -> &'static str {
        "connector"
    }

    fn plan(&self) -> Plan {
        let compiled = self.simulation.compiled();
        Plan {
            name: compiled.name.clone(),
            seed: compiled.seed,
            cycles: compiled.cycles,
            checkpoint_every: match compiled.record.checkpoint_every {
                0 => Cycle::MAX,
                every => every,
            },
        }
    }

    fn begin_recording(&mut self) {
        self.simulation.begin_recording();
    }

    fn restore(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        self.simulation.restore(checkpoint)
    }

    fn contents(&self) -> Said {
        let world = self.simulation.world();
        let rods: usize = world.chains.iter().map(|spec| spec.start.rods().len()).sum();
        let plan = self.plan();
        let json = json!({
            "name": plan.name,
            "seed": plan.seed,
            "cycles": plan.cycles,
            "chains": world.chains.len(),
            "connectors": self.simulation.agents(),
            "rods": rods,
            "obstacles": world.obstacles.still().len(),
            "movers": world.movers.len(),
            "dimensions": D,
            "dt_s": world.dt_s,
        });
        let text = format!(
            "  chains           {}, of {} connectors in {D} dimensions\n  \
             obstacles        {}, and {} that move\n",
            grouped(world.chains.len() as u64),
            grouped(self.simulation.agents() as u64),
            grouped(world.obstacles.still().len() as u64),
            grouped(world.movers.len() as u64),
        );
        Said { json, text }
    }

    fn outcome(&self) -> Lines {
        outcome(&self.simulation.chain_metrics())
    }

    fn agent_metrics(&self) -> Value {
        let one = |slot| serde_json::to_value(self.simulation.metrics_of(slot));
        (0..self.simulation.state().len()).map(|slot| one(slot).unwrap_or_default()).collect()
    }

    fn poses(&self) -> Said {
        let snapshot = self.simulation.snapshot();
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
        Said { json: Value::Array(rows), text }
    }
}

fn line(name: &str, value: String) -> (String, String) {
    (name.into(), value)
}

/// What came of a run, in words.
fn outcome(m: &Metrics) -> Lines {
    let clearance = match m.min_clearance_m {
        None => "nothing came near".into(),
        Some(c) if c.abs() < TOUCH_M => "touched".into(),
        Some(c) => format!("{c:.4} m"),
    };
    let penetrations = match m.penetrations {
        0 => "none".into(),
        n => format!("{} steps with a part in an obstacle", grouped(n)),
    };
    let mut lines = vec![
        line("progress", format!("{:.1} %", 100.0 * m.progress)),
        line("vetoes", vetoes(m)),
        line("penetrations", penetrations),
        line("least clearance", clearance),
        line("rods", format!("within their limits to {:.1e} m", m.max_rod_violation_m)),
        line(
            "effort",
            format!(
                "{:.1} connectors moved per step, {} rods turned",
                m.moved_per_step,
                grouped(m.rotations)
            ),
        ),
        line("greatest speed", format!("{:.3} m/s", m.max_speed_m_s)),
    ];
    if let Some(robots) = &m.robots {
        let bumpers = match robots.bumper_events {
            0 => "no bumper pressed".into(),
            n => format!("bumpers pressed {} times", grouped(n)),
        };
        lines.push(line(
            "robots",
            format!(
                "{bumpers}; behind their connectors by {:.2} m on average, {:.2} m at most",
                robots.mean_lag_m, robots.max_lag_m
            ),
        ));
    }
    lines.extend(after_vetoes(m));
    if m.reformed > 0 {
        lines.push(line("re-formed", format!("{} times", grouped(m.reformed))));
    }
    if m.not_reformed > 0 {
        lines.push(line("NOT re-formed", format!("{} times", grouped(m.not_reformed))));
    }
    lines.extend(m.joints_errors.iter().map(|(chain, error)| {
        line("joints", format!("of chain {chain} cannot follow its connectors: {error}"))
    }));
    lines.extend(m.given_up.iter().take(MOST_TOLD).map(given_up));
    if m.given_up.len() > MOST_TOLD {
        let more = grouped((m.given_up.len() - MOST_TOLD) as u64);
        lines.push(line("given up", format!("and {more} more")));
    }
    lines
}

/// How initiators went on after vetoes, and what getting out of the way came to; no lines where
/// there was nothing of that.
fn after_vetoes(m: &Metrics) -> Lines {
    let some = |counts: &[(u64, &str)]| {
        let said = counts.iter().filter(|(n, _)| *n > 0);
        let said: Vec<String> = said.map(|(n, what)| format!("{} {what}", grouped(*n))).collect();
        (!said.is_empty()).then(|| said.join(", "))
    };
    let (rungs, escapes) = (&m.rungs, &m.escapes);
    let went_on = some(&[
        (rungs.shorter, "shorter steps"),
        (rungs.sideways, "to the side"),
        (rungs.turned, "turns on the spot"),
        (rungs.waited, "waited"),
        (rungs.pulled_back, "pulled by the other end"),
        (rungs.stuck, "stuck"),
    ]);
    let escaped = some(&[
        (escapes.moves, "parts moved away"),
        (escapes.vetoes, "could not"),
        (escapes.capped, "of these too slow"),
    ]);
    let went_on = went_on.map(|said| line("after vetoes", said));
    went_on.into_iter().chain(escaped.map(|said| line("escapes", said))).collect()
}

/// What is nearer than this touches, meters.
const TOUCH_M: f64 = 1e-6;
/// More that was given up is only counted.
const MOST_TOLD: usize = 5;

fn vetoes(m: &Metrics) -> String {
    if m.vetoes == 0 {
        return "none".into();
    }
    let reasons = m.vetoes_by_reason.iter().filter(|(_, n)| **n > 0);
    let reasons = reasons.map(|(reason, n)| format!("{reason} {}", grouped(*n)));
    format!("{}: {}", grouped(m.vetoes), reasons.collect::<Vec<_>>().join(", "))
}

fn given_up(told: &ChainGivenUp) -> (String, String) {
    let what = &told.what;
    let why = match (&what.by, &what.reason) {
        (Some(by), Some(reason)) => format!("connector {by} objected: {reason}"),
        _ => "nobody objected".into(),
    };
    let nearest = match what.nearest_m.is_finite() {
        true => format!(", came within {:.4} m", what.nearest_m),
        false => String::new(),
    };
    let who = format!("chain {}, task {}, part {}", told.chain, what.task, what.part);
    line("given up", format!("{who}{nearest}; {why}"))
}
