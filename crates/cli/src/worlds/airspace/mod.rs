//! The airspace world as the command sees it.

mod foreign;
mod picture;

pub(super) use foreign::{told_of, translated};

use super::{Comparison, Pictured, Plan, Resolved, Run, Said, Told};
use crate::console::grouped;
use crate::exit::Failure;
use crate::report::Lines;
use serde_json::{Value, json};
use sidestep::kernel::checkpoint::CheckpointError;
use sidestep::kernel::cycle::PhaseTimes;
use sidestep::kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep::kernel::{Cycle, Digest, InputError, Simulation};
use sidestep::scenario::Source;
use sidestep::worlds::airspace::metrics::Metrics;
use sidestep::worlds::airspace::scenario::Compiled;
use sidestep::worlds::airspace::simulation::AirspaceSimulation;
use sidestep::worlds::airspace::state::AirplaneRecord;
use std::path::Path;

/// A compiled airspace scenario.
pub(crate) struct Scenario {
    compiled: Compiled,
}

impl Scenario {
    /// Compiles the scenario.
    ///
    /// # Errors
    /// When anything in it is wrong.
    pub(super) fn new(source: &Source) -> Result<Self, InputError> {
        Ok(Self { compiled: Compiled::new(source)? })
    }

    /// The scenario itself.
    pub(super) fn into_compiled(self) -> Compiled {
        self.compiled
    }

    /// See [`super::Compiled::resolve`]: such a scenario names no other file.
    pub(super) fn resolve(source: &Source) -> Resolved {
        Resolved { text: source.text.clone(), files: Vec::new() }
    }
}

/// A run of an airspace.
pub(super) struct AirspaceRun {
    simulation: AirspaceSimulation,
}

impl AirspaceRun {
    /// A run at its start.
    pub(super) fn new(scenario: Scenario, source: &Source, workers: usize) -> Self {
        Self { simulation: AirspaceSimulation::from_compiled(scenario.compiled, source, workers) }
    }
}

delegates_simulation!(AirspaceRun);

impl Run for AirspaceRun {
    fn agent(&self) -> &'static str {
        "airplane"
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
        let (compiled, world) = (self.simulation.compiled(), self.simulation.world());
        let shield = if world.shield { "on" } else { "off" };
        let json = json!({
            "airplanes": world.airplanes.len(),
            "method": world.method.name(),
            "shield": shield,
            "dt_s": world.timing.dt_s,
            "too_close": compiled.too_close,
        });
        let mut text = format!(
            "  airplanes        {}\n  method           {}, shield {shield}\n",
            grouped(world.airplanes.len() as u64),
            world.method.name(),
        );
        text.push_str(&too_close(&compiled.too_close));
        Said { json, text }
    }

    fn outcome(&self) -> Lines {
        let mut lines = outcome(&self.simulation.airspace_metrics());
        let too_close = &self.simulation.compiled().too_close;
        if !too_close.is_empty() {
            let pairs: Vec<String> =
                too_close.iter().take(5).map(|(a, b)| format!("{a} and {b}")).collect();
            lines.push(line("WARNING", format!("start too close: {}", pairs.join(", "))));
        }
        lines
    }

    fn agent_metrics(&self) -> Value {
        let (world, state) = (self.simulation.world(), self.simulation.state());
        let one = |id: u32| serde_json::to_value(world.airplane_metrics(state, id));
        (0..self.agents() as u32).map(|id| one(id).unwrap_or_default()).collect()
    }

    fn poses(&self) -> Said {
        let snapshot = self.simulation.snapshot();
        let json = serde_json::to_value(&snapshot.airplanes).unwrap_or_default();
        let heading = "  airplane       x_m         y_m    heading_deg\n".to_string();
        let row = |(id, a): (usize, &AirplaneRecord)| {
            let ([x, y], psi_deg) = (a.pose.at, a.pose.psi_rad.to_degrees());
            format!("  {id:<8} {x:>10.1}  {y:>10.1}  {psi_deg:>13.1}\n")
        };
        let text = snapshot.airplanes.iter().enumerate().map(row).fold(heading, |t, r| t + &r);
        Said { json, text }
    }

    fn compare(&self, folder: &Path) -> Result<Comparison, InputError> {
        picture::compare(&self.simulation, folder)
    }

    fn picture(&self, of: Pictured<'_>) -> Result<String, Failure> {
        picture::svg(&self.simulation, of)
    }
}

/// Pairs whose first fallbacks are not apart, in words.
fn too_close(pairs: &[(u32, u32)]) -> String {
    let warn = |(a, b): &(u32, u32)| {
        format!("  warning          airplanes {a} and {b} start too close for the shield\n")
    };
    pairs.iter().map(warn).collect()
}

fn line(name: &str, value: String) -> (String, String) {
    (name.into(), value)
}

fn outcome(m: &Metrics) -> Lines {
    let nearest = m.min_separation_m.map_or("nobody came near".into(), |d| format!("{d:.1} m"));
    let lost = match m.losses_of_separation {
        0 => "none".into(),
        n => format!("{}, {:.1} s in all", grouped(n), m.lost_s),
    };
    let delay = m.mean_delay_percent.map_or("-".into(), |d| format!("{d:.1} % on average"));
    let rounds = m.rounds_mean.map_or(String::new(), |r| format!(", {r:.1} rounds each"));
    vec![
        line("arrived", format!("{} of {}", grouped(m.arrived), grouped(m.airplanes))),
        line("nearest approach", nearest),
        line("losses of separation", lost),
        line("delay", delay),
        line("optimizations", format!("{}{rounds}", grouped(m.optimisations))),
        line(
            "shield",
            format!(
                "{} decisions changed, {} of them to orbits",
                grouped(m.shield_overrides),
                grouped(m.shield_orbits)
            ),
        ),
    ]
}
