//! The world as it appears to code that runs scenarios of any world.

use super::method::{Method, Methods};
use super::scenario::CompiledAirspace;
use super::{AirspaceWorld, bundle, import, text};
use sidestep_kernel::text::JsonTextReport;
use sidestep_kernel::view::BodyKind;
use sidestep_kernel::{InputError, RunConfig, Simulation, World};
use sidestep_scenario::{
    CompiledScenario as AnyCompiled, Editing, ImportOptions, ImportedScenario, MetricInfo, Remark,
    ResolvedScenario, SeedEffect, Source, WorldFacts, WorldType,
};
use std::any::Any;
use std::path::Path;
use std::sync::Arc;

/// Airplanes that avoid each other.
#[derive(Debug, Clone, Default)]
pub struct Airspace {
    own: Methods,
}

impl Airspace {
    /// Returns the world with its own methods only.
    pub const fn new() -> Self {
        Self { own: Methods::new() }
    }

    /// Returns the world with a further method, which scenarios call by this name.
    #[must_use]
    pub fn with_method(mut self, name: impl Into<String>, method: impl Method + 'static) -> Self {
        self.own.insert(name.into(), Arc::new(method));
        self
    }
}

impl WorldType for Airspace {
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
        super::scenario::sections_schema(&self.own)
    }

    fn random_quantities(&self) -> &'static str {
        "airspace.generator, airspace.position_noise_m, airspace.heading_noise_deg, airspace.network, and \
         the search of method pc"
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
        super::facts::editing_tools()
    }

    fn import_scenario(
        &self,
        file: &Path,
        options: &ImportOptions,
    ) -> Result<Option<ImportedScenario>, InputError> {
        import::import_file(file, options)
    }

    fn compile(&self, source: &Source) -> Result<Box<dyn AnyCompiled>, InputError> {
        Ok(Box::new(CompiledAirspace::with_methods(source, &self.own)?))
    }
}

impl AnyCompiled for CompiledAirspace {
    fn world(&self) -> &'static str {
        AirspaceWorld::NAME
    }

    fn plan(&self) -> RunConfig {
        CompiledAirspace::plan(self)
    }

    fn body_count(&self) -> usize {
        self.world.airplanes.len()
    }

    fn contents(&self, _: &Source) -> JsonTextReport {
        text::describe_scenario(self)
    }

    fn remarks(&self) -> Vec<Remark> {
        super::scenario::scenario_remarks(self)
    }

    fn seed_effect(&self) -> SeedEffect {
        self.seeds
    }

    fn resolve(&self, source: &Source) -> Result<ResolvedScenario, InputError> {
        bundle::resolve_scenario(source, self)
    }

    fn reseeded(&self, seed: u64) -> Option<Result<Box<dyn AnyCompiled>, InputError>> {
        Some(CompiledAirspace::reseeded(self, seed).map(|compiled| Box::new(compiled) as Box<_>))
    }

    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation> {
        Box::new(self.clone().start(source, workers))
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
