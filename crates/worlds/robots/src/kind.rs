//! The world as it appears to code that runs scenarios of any world.

use super::scenario::{Behaviours, Compiled, StorageOrder};
use super::{RobotsWorld, bundle, remarks, words};
use sidestep_kernel::words::Said;
use sidestep_kernel::{InputError, Plan, Simulation, World};
use sidestep_scenario::{Compiled as AnyCompiled, Kind, Meaning, Remark, Resolved, Seeds, Source};
use std::any::Any;

/// Situated agents on a grid.
#[derive(Debug, Clone)]
pub struct Robots {
    own: Behaviours,
}

impl Robots {
    /// Returns the world with its own behaviors only.
    pub const fn new() -> Self {
        Self { own: Behaviours::new() }
    }

    /// Returns the world with further behaviors, which scenarios call by these names.
    pub const fn with(own: Behaviours) -> Self {
        Self { own }
    }
}

impl Default for Robots {
    fn default() -> Self {
        Self::new()
    }
}

impl Kind for Robots {
    fn name(&self) -> &'static str {
        RobotsWorld::NAME
    }

    fn agent(&self) -> &'static str {
        RobotsWorld::AGENT
    }

    fn about(&self) -> &'static str {
        "Stochastic robots on a grid"
    }

    fn default_scenario(&self) -> &'static str {
        include_str!("default.toml")
    }

    fn sections(&self) -> serde_json::Value {
        super::scenario::sections(&self.own)
    }

    fn other_files(&self) -> Vec<(&'static str, serde_json::Value)> {
        vec![("profile", super::scenario::profile_schema(self.default_scenario()))]
    }

    fn draws(&self) -> &'static str {
        "errors (a regime other than reliable), random places and doors, and behaviors that draw"
    }

    fn meanings(&self) -> &'static [Meaning] {
        super::meanings::MEANINGS
    }

    fn compile(&self, source: &Source) -> Result<Box<dyn AnyCompiled>, InputError> {
        let compiled = Compiled::new(source, &self.own, StorageOrder::Spatial)?;
        Ok(Box::new(compiled))
    }
}

impl AnyCompiled for Compiled {
    fn world(&self) -> &'static str {
        RobotsWorld::NAME
    }

    fn plan(&self) -> Plan {
        Compiled::plan(self)
    }

    fn bodies(&self) -> usize {
        self.world.bodies.len()
    }

    fn contents(&self, source: &Source) -> Said {
        words::contents(self, source)
    }

    fn remarks(&self) -> Vec<Remark> {
        remarks::remarks(self)
    }

    fn seeds(&self) -> Seeds {
        match self.draws_always() {
            true => Seeds::Decide,
            // Behaviors and conflicts may draw: runs show it.
            false => Seeds::Perhaps,
        }
    }

    fn resolve(&self, source: &Source) -> Result<Resolved, InputError> {
        bundle::resolve(source, self)
    }

    fn reseeded(&self, seed: u64) -> Option<Result<Box<dyn AnyCompiled>, InputError>> {
        Some(Compiled::reseeded(self, seed).map(|compiled| Box::new(compiled) as Box<_>))
    }

    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation> {
        Box::new(self.clone().start(source, workers))
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
