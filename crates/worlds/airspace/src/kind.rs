//! The world as it appears to code that runs scenarios of any world.

use super::scenario::Compiled;
use super::{AirspaceWorld, bundle, foreign, words};
use sidestep_kernel::words::Said;
use sidestep_kernel::{InputError, Plan, Simulation, World};
use sidestep_scenario::{Compiled as AnyCompiled, Foreign, Kind, Meaning, Resolved, Seeds, Source};
use std::any::Any;
use std::path::Path;

/// Airplanes that avoid each other.
#[derive(Debug, Clone, Copy)]
pub struct Airspace;

impl Kind for Airspace {
    fn name(&self) -> &'static str {
        AirspaceWorld::NAME
    }

    fn agent(&self) -> &'static str {
        AirspaceWorld::AGENT
    }

    fn about(&self) -> &'static str {
        "Airplanes that avoid each other"
    }

    fn default_scenario(&self) -> &'static str {
        include_str!("default.toml")
    }

    fn sections(&self) -> serde_json::Value {
        super::scenario::sections()
    }

    fn draws(&self) -> &'static str {
        "airspace.generator, airspace.position_noise_m, airspace.heading_noise_deg, airspace.network, and \
         the search of method pc"
    }

    fn meanings(&self) -> &'static [Meaning] {
        super::meanings::MEANINGS
    }

    fn translate(&self, file: &Path) -> Result<Option<Foreign>, InputError> {
        foreign::translate(file)
    }

    fn compile(&self, source: &Source) -> Result<Box<dyn AnyCompiled>, InputError> {
        Ok(Box::new(Compiled::new(source)?))
    }
}

impl AnyCompiled for Compiled {
    fn world(&self) -> &'static str {
        AirspaceWorld::NAME
    }

    fn plan(&self) -> Plan {
        Compiled::plan(self)
    }

    fn bodies(&self) -> usize {
        self.world.airplanes.len()
    }

    fn contents(&self, _: &Source) -> Said {
        words::contents(self)
    }

    fn seeds(&self) -> Seeds {
        self.seeds
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
