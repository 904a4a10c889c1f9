//! A scenario of whatever world it names: for those who run scenarios and ask no more of them.

use super::{airspace, chain, robots};
use crate::scenario::{Resolved, Source, nearest};
use robots::scenario::{Behaviours, StorageOrder};
use sidestep_kernel::{Cycle, InputError, Simulation};

/// Names of the worlds, as scenarios give them.
pub const NAMES: [&str; 3] = ["robots", "airspace", "chain"];

/// A scenario that has been found right.
#[derive(Debug, Clone)]
pub enum AnyCompiled {
    /// Of the world `robots`.
    Robots(robots::scenario::Compiled),
    /// Of the world `airspace`.
    Airspace(airspace::scenario::Compiled),
    /// Of the world `chain`.
    Chain(chain::scenario::AnyCompiled),
}

/// What a scenario asks for, whatever its world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// The scenario's name; may be empty.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// Cycles to run at most.
    pub cycles: Cycle,
}

impl AnyCompiled {
    /// Compiles a scenario of whatever world it names.
    ///
    /// # Errors
    /// When no such world is known, or the scenario is wrong.
    pub fn new(source: &Source) -> Result<Self, InputError> {
        let world = source.preamble()?.world;
        match world.get_ref().as_str() {
            "robots" => {
                let order = StorageOrder::Spatial;
                robots::scenario::Compiled::new(source, &Behaviours::new(), order).map(Self::Robots)
            }
            "airspace" => airspace::scenario::Compiled::new(source).map(Self::Airspace),
            "chain" => chain::scenario::AnyCompiled::new(source).map(Self::Chain),
            other => {
                let cause = format!("unknown world `{other}`");
                Err(source.error(Some(world.span()), cause, nearest(other, &NAMES)))
            }
        }
    }

    /// Name of its world.
    pub fn world(&self) -> &'static str {
        match self {
            Self::Robots(_) => NAMES[0],
            Self::Airspace(_) => NAMES[1],
            Self::Chain(_) => NAMES[2],
        }
    }

    /// What the scenario asks for.
    pub fn plan(&self) -> Plan {
        use chain::scenario::AnyCompiled::{Plane, Space};
        let (name, seed, cycles) = match self {
            Self::Robots(c) => (&c.name, c.seed, c.cycles),
            Self::Airspace(c) => (&c.name, c.seed, c.cycles),
            Self::Chain(Plane(c)) => (&c.name, c.seed, c.cycles),
            Self::Chain(Space(c)) => (&c.name, c.seed, c.cycles),
        };
        Plan { name: name.clone(), seed, cycles }
    }

    /// Bodies and agents that are simulated: what a run's size is told by.
    pub fn agents(&self) -> u64 {
        use chain::scenario::AnyCompiled::{Plane, Space};
        let agents = match self {
            Self::Robots(c) => c.world.bodies.len(),
            Self::Airspace(c) => c.world.airplanes.len(),
            Self::Chain(Plane(c)) => {
                c.world.chains.iter().map(|s| s.start.connectors().len()).sum()
            }
            Self::Chain(Space(c)) => {
                c.world.chains.iter().map(|s| s.start.connectors().len()).sum()
            }
        };
        agents as u64
    }

    /// The scenario as it goes into a run folder: complete in itself.
    ///
    /// # Errors
    /// When a file that it names cannot be read any more.
    pub fn resolve(&self, source: &Source) -> Result<Resolved, InputError> {
        match self {
            Self::Robots(compiled) => robots::bundle::resolve(source, compiled),
            // Such a scenario names no other file.
            Self::Airspace(_) => Ok(Resolved { text: source.text.clone(), files: Vec::new() }),
            Self::Chain(_) => {
                let Plan { seed, cycles, .. } = self.plan();
                chain::bundle::resolve(source, (seed, cycles))
            }
        }
    }

    /// A run at its start; `source` names it in checkpoints.
    pub fn start(self, source: &Source, workers: usize) -> Box<dyn Simulation> {
        use chain::scenario::AnyCompiled::{Plane, Space};
        use chain::simulation::ChainSimulation;
        match self {
            Self::Robots(c) => {
                Box::new(robots::simulation::RobotsSimulation::from_compiled(c, source, workers))
            }
            Self::Airspace(c) => Box::new(airspace::simulation::AirspaceSimulation::from_compiled(
                c, source, workers,
            )),
            Self::Chain(Plane(c)) => Box::new(ChainSimulation::new(c, source, workers)),
            Self::Chain(Space(c)) => Box::new(ChainSimulation::new(c, source, workers)),
        }
    }
}
