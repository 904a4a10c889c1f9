//! The robots world as the command sees it.

mod contents;
mod poses;

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
use sidestep::worlds::robots::metrics::Metrics;
use sidestep::worlds::robots::scenario::Compiled;
use sidestep::worlds::robots::simulation::RobotsSimulation;

/// A run of a robots world.
pub(super) struct RobotsRun {
    simulation: RobotsSimulation,
    /// The sections as they stand in the file, for `check`.
    file: Value,
}

impl RobotsRun {
    /// A run at its start.
    pub(super) fn new(compiled: Compiled, source: &Source, workers: usize) -> Self {
        let file = source.parse().unwrap_or_default();
        Self { simulation: RobotsSimulation::from_compiled(compiled, source, workers), file }
    }
}

delegates_simulation!(RobotsRun);

impl Run for RobotsRun {
    fn agent(&self) -> &'static str {
        "robot"
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
        contents::contents(&self.simulation, &self.file)
    }

    fn outcome(&self) -> Lines {
        outcome(&self.simulation.robot_metrics())
    }

    fn agent_metrics(&self) -> Value {
        let (world, state) = (self.simulation.world(), self.simulation.state());
        let one = |&id: &u32| {
            let counts = world.counts(state, self.simulation.cycle(), id);
            json!({ "body": id, "counts": counts })
        };
        world.robots().iter().map(one).collect()
    }

    fn poses(&self) -> Said {
        poses::said(&self.simulation)
    }
}

fn outcome(metrics: &Metrics) -> Lines {
    let total = &metrics.total;
    let mut lines = vec![
        line("contacts", contacts(metrics)),
        line("trips", trips(total.trips, total.trip_cycles_mean)),
        line("distance", distance(total.distance_m)),
        line("coverage", format!("{:.1} % of the free boxes", 100.0 * metrics.coverage)),
    ];
    // A continued run at its end has seen no group in this process.
    if metrics.largest_group > 0 {
        lines.push(line("conflict groups", groups(metrics)));
    }
    lines
}

fn line(name: &str, value: String) -> (String, String) {
    (name.into(), value)
}

fn distance(meters: f64) -> String {
    match meters < 1000.0 {
        true => format!("{meters:.1} m"),
        false => format!("{:.1} km", meters / 1000.0),
    }
}

fn contacts(metrics: &Metrics) -> String {
    let total = &metrics.total;
    let touched = total.contacts_by_kind.iter().filter(|(_, n)| **n > 0);
    let by_kind: Vec<String> = touched.map(|(kind, n)| format!("{kind} {}", grouped(*n))).collect();
    let share = 1000.0 * metrics.contacts_per_action;
    match by_kind.is_empty() {
        true => "none".into(),
        false => format!(
            "{} ({share:.1} in 1000 actions): {}",
            grouped(total.contacts),
            by_kind.join(", ")
        ),
    }
}

fn trips(trips: u64, mean_cycles: Option<f64>) -> String {
    match mean_cycles {
        Some(mean) => format!("{}, {mean:.1} cycles on average", grouped(trips)),
        None => "none".into(),
    }
}

/// How many conflict groups had how many bodies: index k counts those of `2^k .. 2^(k+1)`.
fn groups(metrics: &Metrics) -> String {
    let sizes = metrics.group_sizes.iter().enumerate().filter(|(_, n)| **n > 0);
    let bins = sizes.map(|(k, n)| match k {
        0 => format!("alone {}", grouped(*n)),
        _ => format!("{}-{}: {}", 1u64 << k, (2u64 << k) - 1, grouped(*n)),
    });
    format!("{}; largest {}", bins.collect::<Vec<_>>().join(", "), metrics.largest_group)
}
