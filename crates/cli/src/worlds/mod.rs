//! The one place that knows which worlds there are, and what the command needs of each.

/// A run is the simulation it holds, in all that the kernel asks.
macro_rules! delegates_simulation {
    ([$($generics:tt)*] $run:ty) => {
        impl<$($generics)*> Simulation for $run {
            fn world(&self) -> &'static str {
                Simulation::world(&self.simulation)
            }
            fn cycle(&self) -> Cycle {
                self.simulation.cycle()
            }
            fn agents(&self) -> usize {
                self.simulation.agents()
            }
            fn is_over(&self) -> bool {
                Simulation::is_over(&self.simulation)
            }
            fn advance(&mut self, cycles: u64) -> u64 {
                self.simulation.advance(cycles)
            }
            fn digest(&self) -> Digest {
                self.simulation.digest()
            }
            fn checkpoint(&self) -> Vec<u8> {
                self.simulation.checkpoint()
            }
            fn schemas(&self) -> Vec<TableSchema> {
                self.simulation.schemas()
            }
            fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
                self.simulation.record(recorder)
            }
            fn scenery(&self) -> Scenery {
                self.simulation.scenery()
            }
            fn watch(&mut self) {
                self.simulation.watch();
            }
            fn frame(&mut self, look: Look) -> Frame {
                self.simulation.frame(look)
            }
            fn place_rows(&self) -> Vec<PlaceRows> {
                self.simulation.place_rows()
            }
            fn metrics(&self) -> Value {
                self.simulation.metrics()
            }
            fn phase_times(&self) -> PhaseTimes {
                self.simulation.phase_times()
            }
        }
    };
    ($run:ty) => {
        delegates_simulation!([] $run);
    };
}

mod airspace;
mod chain;
mod robots;

use crate::report::Lines;
use airspace::AirspaceRun;
use robots::RobotsRun;
use serde_json::Value;
use sidestep::kernel::checkpoint::CheckpointError;
use sidestep::kernel::{Cycle, InputError, Simulation};
use sidestep::scenario::{Resolved, Source};
use sidestep::worlds::any::AnyCompiled;
use std::path::Path;

/// What a scenario asks for, whatever its world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Plan {
    /// The scenario's name, else its file's.
    pub(crate) name: String,
    /// The seed.
    pub(crate) seed: u64,
    /// Cycles to run.
    pub(crate) cycles: Cycle,
    /// Cycles between two checkpoints, at least 1; the largest number for none.
    pub(crate) checkpoint_every: Cycle,
}

/// Something to say about a state: as JSON, and in words.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Said {
    /// For machines.
    pub(crate) json: Value,
    /// For people.
    pub(crate) text: String,
}

/// What a file of another program's form holds beside the scenario that it stands for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Told {
    /// For machines.
    pub(crate) json: Value,
    /// For people.
    pub(crate) lines: Lines,
}

/// A run of some world: the kernel's face, and what only the command asks for.
pub(crate) trait Run: Simulation {
    /// What one of its agents is called.
    fn agent(&self) -> &'static str;

    /// What the scenario asks for.
    fn plan(&self) -> Plan;

    /// From now on keeps what is to be recorded.
    fn begin_recording(&mut self);

    /// Continues from a checkpoint.
    fn restore(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError>;

    /// What the compiled scenario holds: for `check`.
    fn contents(&self) -> Said;

    /// What came of the run so far, in lines for people.
    fn outcome(&self) -> Lines;

    /// Metrics of every agent by itself.
    fn agent_metrics(&self) -> Value;

    /// Metrics of pairs of agents, in worlds that have any.
    fn pair_metrics(&self) -> Value {
        Value::Null
    }

    /// Where every body is.
    fn poses(&self) -> Said;
}

/// The scenario that a file of another form stands for: BlueSky traffic (`.scn`) or recorded
/// tracks (`.csv`); `None` for files of our own.
///
/// # Errors
/// When it cannot be read, or has no airplane.
pub(crate) fn translated(file: &Path) -> Result<Option<String>, InputError> {
    airspace::translated(file)
}

/// What `check` and `run` say beside the scenario of a file of another form: which of its
/// commands are not acted on, and what in it cannot be read.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn told_of(file: &Path) -> Result<Option<Told>, InputError> {
    airspace::told_of(file)
}

/// A scenario that has been found right.
#[derive(Clone)]
pub(crate) struct Compiled(AnyCompiled);

impl Compiled {
    /// Compiles a scenario of whatever world it names.
    ///
    /// # Errors
    /// When no such world is known, or the scenario is wrong.
    pub(crate) fn new(source: &Source) -> Result<Self, InputError> {
        AnyCompiled::new(source).map(Self)
    }

    /// The scenario as it goes into a run folder: complete in itself.
    ///
    /// # Errors
    /// When a file that it names cannot be read any more.
    pub(crate) fn resolve(&self, source: &Source) -> Result<Resolved, InputError> {
        self.0.resolve(source)
    }

    /// The scenario itself, for commands that are about the robots world alone.
    ///
    /// # Errors
    /// When it is of another world.
    pub(crate) fn into_robots(
        self,
        source: &Source,
    ) -> Result<sidestep::worlds::robots::scenario::Compiled, InputError> {
        match self.0 {
            AnyCompiled::Robots(compiled) => Ok(compiled),
            AnyCompiled::Airspace(_) | AnyCompiled::Chain(_) => {
                let remedy = "give a scenario with world = \"robots\"";
                Err(InputError::new(&source.place, "this command is about robots alone", remedy))
            }
        }
    }

    /// The scenario itself, for commands that are about the airspace world alone.
    ///
    /// # Errors
    /// When it is of another world.
    pub(crate) fn into_airspace(
        self,
        source: &Source,
    ) -> Result<sidestep::worlds::airspace::scenario::Compiled, InputError> {
        match self.0 {
            AnyCompiled::Airspace(compiled) => Ok(compiled),
            AnyCompiled::Robots(_) | AnyCompiled::Chain(_) => {
                let remedy = "give a scenario with world = \"airspace\"";
                Err(InputError::new(&source.place, "this command is about airplanes alone", remedy))
            }
        }
    }

    /// A run at its start. `source` names the run in checkpoints.
    pub(crate) fn start(self, source: &Source, workers: usize) -> Box<dyn Run> {
        match self.0 {
            AnyCompiled::Robots(compiled) => Box::new(RobotsRun::new(compiled, source, workers)),
            AnyCompiled::Airspace(compiled) => {
                Box::new(AirspaceRun::new(compiled, source, workers))
            }
            AnyCompiled::Chain(compiled) => chain::start(compiled, source, workers),
        }
    }
}
