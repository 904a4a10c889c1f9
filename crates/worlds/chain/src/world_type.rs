//! The world's entry in the list of worlds, for code that runs scenarios without knowing any world.

use super::driver::own_driver::Driver;
use super::own_parts::CustomBehaviors;
use super::scenario::{AnyChainScenario as EitherCompiled, ChainScenario};
use super::{bundle, remarks, text, world::ChainWorld};
use sidestep_kernel::text::JsonTextReport;
use sidestep_kernel::view::BodyKind;
use sidestep_kernel::{InputError, RunConfig, Simulation, World};
use sidestep_rods::Reaction;
use sidestep_scenario::{
    CompiledScenario as AnyCompiled, Editing, MetricInfo, Remark, ResolvedScenario, SeedEffect,
    Source, WorldFacts, WorldType,
};
use std::any::Any;
use std::sync::Arc;

/// Chains of connectors and rods, in the plane or in space.
#[derive(Debug, Clone, Default)]
pub struct Chains {
    own: CustomBehaviors,
}

impl Chains {
    /// Returns the world with its own drivers and reactions only.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the world with a further driver; tasks call it by this name as their `kind`.
    #[must_use]
    pub fn with_driver(mut self, name: impl Into<String>, driver: impl Driver + 'static) -> Self {
        self.own.drivers.insert(name.into(), Arc::new(driver));
        self
    }

    /// Returns the world with a further reaction of connectors; scenarios call it by this name as `chain.rotation`.
    #[must_use]
    pub fn with_reaction(
        mut self,
        name: impl Into<String>,
        reaction: impl Reaction + 'static,
    ) -> Self {
        self.own.reactions.insert(name.into(), Arc::new(reaction));
        self
    }
}

impl WorldType for Chains {
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
        super::scenario::sections_schema(&self.own)
    }

    fn random_quantities(&self) -> &'static str {
        "fields, anywhere = true of a chain, tasks of kind wander, navigator.noise_m, and planned paths"
    }

    fn metric_infos(&self) -> &'static [MetricInfo] {
        &super::metric_info::METRIC_INFO
    }

    fn chart_metrics(&self) -> &'static [&'static str] {
        &super::metric_info::CHART_METRICS
    }

    fn kinds(&self) -> &'static [BodyKind] {
        super::kinds::ALL
    }

    fn facts(&self) -> WorldFacts {
        super::facts::FACTS
    }

    fn editing(&self) -> Editing {
        super::facts::editing()
    }

    fn compile(&self, source: &Source) -> Result<Box<dyn AnyCompiled>, InputError> {
        Ok(match EitherCompiled::with_custom_behaviors(source, &self.own)? {
            EitherCompiled::Plane(compiled) => Box::new(compiled),
            EitherCompiled::Space(compiled) => Box::new(compiled),
        })
    }
}

impl<const D: usize> AnyCompiled for ChainScenario<D> {
    fn world(&self) -> &'static str {
        ChainWorld::<D>::NAME
    }

    fn plan(&self) -> RunConfig {
        ChainScenario::plan(self)
    }

    fn body_count(&self) -> usize {
        self.world.agent_count()
    }

    fn contents(&self, _: &Source) -> JsonTextReport {
        text::describe_scenario(self)
    }

    fn remarks(&self) -> Vec<Remark> {
        remarks::remarks(self)
    }

    fn seed_effect(&self) -> SeedEffect {
        // Where the start does not follow from the seed, few parts draw, and only on occasion: a leader that
        // wanders, a laser that errs, parts that are thrown about, a path that is planned.
        match &self.recipe {
            Some(recipe) if !recipe.is_start_random() => SeedEffect::Perhaps,
            _ => SeedEffect::Decide,
        }
    }

    fn resolve(&self, source: &Source) -> Result<ResolvedScenario, InputError> {
        bundle::resolve_scenario(source, self)
    }

    fn reseeded(&self, seed: u64) -> Option<Result<Box<dyn AnyCompiled>, InputError>> {
        let compiled = ChainScenario::reseeded(self, seed)?;
        Some(compiled.map(|compiled| Box::new(compiled) as Box<_>))
    }

    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation> {
        Box::new(self.clone().start(source, workers))
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
