//! The world as it appears to code that runs scenarios of any world.

use super::decide::Behaviour;
use super::scenario::{Behaviours, Compiled, StorageOrder};
use super::{RobotsWorld, bundle, import, remarks, text};
use sidestep_kernel::text::JsonTextReport;
use sidestep_kernel::view::BodyKind;
use sidestep_kernel::{InputError, RunConfig, Simulation, World};
use sidestep_scenario::{
    CompiledScenario as AnyCompiled, Editing, ImportOptions, ImportReport, ImportedScenario,
    MetricInfo, Remark, ResolvedScenario, SeedEffect, Source, WorldFacts, WorldType,
};
use std::any::Any;
use std::path::Path;
use std::sync::Arc;

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

    /// Returns the world with a further behavior, which scenarios call by this name.
    #[must_use]
    pub fn with_behaviour(
        mut self,
        name: impl Into<String>,
        behaviour: impl Behaviour + 'static,
    ) -> Self {
        self.own.insert(name.into(), Arc::new(behaviour));
        self
    }
}

impl Default for Robots {
    fn default() -> Self {
        Self::new()
    }
}

impl WorldType for Robots {
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

    fn inspect_other_file(&self, file: &Path) -> Result<Option<ImportReport>, InputError> {
        super::scenario::inspect_profile(file)
    }

    fn random_quantities(&self) -> &'static str {
        "errors (a regime other than reliable), random places and doors, and behaviors that draw"
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

    fn import_scenario(
        &self,
        file: &Path,
        _: &ImportOptions,
    ) -> Result<Option<ImportedScenario>, InputError> {
        import::import_file(file)
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

    fn plan(&self) -> RunConfig {
        Compiled::plan(self)
    }

    fn body_count(&self) -> usize {
        self.world.bodies.len()
    }

    fn contents(&self, source: &Source) -> JsonTextReport {
        text::contents(self, source)
    }

    fn remarks(&self) -> Vec<Remark> {
        remarks::remarks(self)
    }

    fn seed_effect(&self) -> SeedEffect {
        if self.is_always_random() {
            SeedEffect::Decide
        } else {
            // Behaviors and conflicts may draw, which only runs show.
            SeedEffect::Perhaps
        }
    }

    fn privilege(&self) -> Option<&'static str> {
        let mut teams = self.world.planner_teams.iter();
        let has_privilege = teams.any(|team| team.leader.reports.is_none());
        has_privilege.then_some("a planner knows the true places of all bodies, and who is late")
    }

    fn resolve(&self, source: &Source) -> Result<ResolvedScenario, InputError> {
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
