//! What a world is to those who run scenarios and know no world.

use crate::{Resolved, Source, nearest};
use sidestep_kernel::words::{Lines, Said};
use sidestep_kernel::{InputError, Plan, Simulation};
use std::any::Any;
use std::path::Path;

/// A world: its name, its files, and how its scenarios compile.
pub trait Kind: Sync {
    /// Name, as scenarios give it.
    fn name(&self) -> &'static str;

    /// Noun for one of its agents, e.g. `robot`.
    fn agent(&self) -> &'static str;

    /// One line that says what it simulates.
    fn about(&self) -> &'static str;

    /// A commented scenario with every key.
    fn default_scenario(&self) -> &'static str;

    /// The scenario that a file of another program's form stands for; `None` for files that this
    /// world does not read.
    ///
    /// # Errors
    /// When such a file cannot be read.
    fn translate(&self, _: &Path) -> Result<Option<Foreign>, InputError> {
        Ok(None)
    }

    /// Compiles a scenario of this world.
    ///
    /// # Errors
    /// With place, line, column, cause and remedy for anything that is wrong in it.
    fn compile(&self, source: &Source) -> Result<Box<dyn Compiled>, InputError>;
}

/// A scenario that has been found right; many runs of it share one world.
pub trait Compiled: Send + Sync {
    /// Name of its world.
    fn world(&self) -> &'static str;

    /// What the scenario asks for.
    fn plan(&self) -> Plan;

    /// Number of bodies that are simulated: what a run's size is told by.
    fn bodies(&self) -> usize;

    /// What the scenario holds, for people who check it.
    fn contents(&self, source: &Source) -> Said;

    /// The scenario as it goes into a run folder: complete in itself.
    ///
    /// # Errors
    /// When a file that it names cannot be read any more.
    fn resolve(&self, source: &Source) -> Result<Resolved, InputError>;

    /// A run at its start; `source` names it in checkpoints.
    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation>;

    /// The world's own type, for what is about one world alone.
    fn as_any(&self) -> &dyn Any;
}

/// What a file of another program's form stands for.
#[derive(Debug, Clone, PartialEq)]
pub struct Foreign {
    /// The scenario's text, or why nobody in the file can be simulated.
    pub scenario: Result<String, InputError>,
    /// What was found in the file beside it, for machines,
    pub json: serde_json::Value,
    /// and for people.
    pub lines: Lines,
}

/// The worlds that there are.
#[derive(Clone, Copy)]
pub struct Worlds(pub &'static [&'static dyn Kind]);

impl Worlds {
    /// Names of the worlds.
    pub fn names(self) -> Vec<&'static str> {
        self.0.iter().map(|kind| kind.name()).collect()
    }

    /// The world of this name.
    pub fn named(self, name: &str) -> Option<&'static dyn Kind> {
        self.0.iter().copied().find(|kind| kind.name() == name)
    }

    /// Compiles a scenario of whatever world it names.
    ///
    /// # Errors
    /// When no such world is known, or the scenario is wrong.
    pub fn compile(self, source: &Source) -> Result<Box<dyn Compiled>, InputError> {
        let world = source.preamble()?.world;
        let kind = self.named(world.get_ref()).ok_or_else(|| {
            let cause = format!("unknown world `{}`", world.get_ref());
            source.error(Some(world.span()), cause, nearest(world.get_ref(), &self.names()))
        })?;
        kind.compile(source)
    }

    /// What a file of another program's form stands for; `None` for files of our own.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn translate(self, file: &Path) -> Result<Option<Foreign>, InputError> {
        for kind in self.0 {
            if let Some(foreign) = kind.translate(file)? {
                return Ok(Some(foreign));
            }
        }
        Ok(None)
    }
}
