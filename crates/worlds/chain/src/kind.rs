//! The world's entry in the list of worlds, for code that runs scenarios without knowing any world.

use super::scenario::{AnyCompiled as EitherCompiled, Compiled};
use super::{bundle, remarks, words, world::ChainWorld};
use sidestep_kernel::words::Said;
use sidestep_kernel::{InputError, Plan, Simulation, World};
use sidestep_scenario::{Compiled as AnyCompiled, Kind, Meaning, Remark, Resolved, Seeds, Source};
use std::any::Any;

/// Chains of connectors and rods, in the plane or in space.
#[derive(Debug, Clone, Copy)]
pub struct Chains;

impl Kind for Chains {
    fn name(&self) -> &'static str {
        ChainWorld::<2>::NAME
    }

    fn agent(&self) -> &'static str {
        ChainWorld::<2>::AGENT
    }

    fn about(&self) -> &'static str {
        "Chains that creep among obstacles"
    }

    fn default_scenario(&self) -> &'static str {
        include_str!("default.toml")
    }

    fn sections(&self) -> serde_json::Value {
        super::scenario::sections()
    }

    fn draws(&self) -> &'static str {
        "fields, anywhere = true of a chain, tasks of kind wander, navigator.noise_m, and planned ways"
    }

    fn meanings(&self) -> &'static [Meaning] {
        super::meanings::MEANINGS
    }

    fn compile(&self, source: &Source) -> Result<Box<dyn AnyCompiled>, InputError> {
        Ok(match EitherCompiled::new(source)? {
            EitherCompiled::Plane(compiled) => Box::new(compiled),
            EitherCompiled::Space(compiled) => Box::new(compiled),
        })
    }
}

impl<const D: usize> AnyCompiled for Compiled<D> {
    fn world(&self) -> &'static str {
        ChainWorld::<D>::NAME
    }

    fn plan(&self) -> Plan {
        Compiled::plan(self)
    }

    fn bodies(&self) -> usize {
        self.world.agents()
    }

    fn contents(&self, _: &Source) -> Said {
        words::contents(self)
    }

    fn remarks(&self) -> Vec<Remark> {
        remarks::remarks(self)
    }

    fn seeds(&self) -> Seeds {
        // Where the start does not follow from the seed, few parts draw, and only on occasion: a leader that
        // wanders, a laser that errs, parts that are thrown about, a way that is planned.
        match &self.recipe {
            Some(recipe) if !recipe.draws_start() => Seeds::Perhaps,
            _ => Seeds::Decide,
        }
    }

    fn resolve(&self, source: &Source) -> Result<Resolved, InputError> {
        bundle::resolve(source, self)
    }

    fn reseeded(&self, seed: u64) -> Option<Result<Box<dyn AnyCompiled>, InputError>> {
        let compiled = Compiled::reseeded(self, seed)?;
        Some(compiled.map(|compiled| Box::new(compiled) as Box<_>))
    }

    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation> {
        Box::new(self.clone().start(source, workers))
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
