//! The scenario of a server and its nodes.

use crate::distributed::DistributedWorld;
use crate::protocol::{ClockMode, ScenarioFingerprint};
use crate::worlds::{distributed_world, fingerprint};
use sidestep::kernel::InputError;
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::JobScenario;
use std::sync::Arc;

/// A scenario, read and compiled.
pub(super) struct Scenario {
    pub(super) source: Source,
    pub(super) compiled: Box<dyn CompiledScenario>,
    pub(super) world: Arc<dyn DistributedWorld>,
}

impl Scenario {
    /// Reads a scenario.
    ///
    /// # Errors
    /// When it is wrong, or its agents cannot be nodes.
    pub(super) fn read(job: &JobScenario) -> Result<Self, InputError> {
        let (source, compiled) =
            sidestep_session::read_scenario(&WORLDS, &job.file, &job.overrides)?;
        Self::from_compiled(source, compiled)
    }

    fn from_compiled(
        source: Source,
        compiled: Box<dyn CompiledScenario>,
    ) -> Result<Self, InputError> {
        let world = distributed_world(compiled.as_ref(), &source)?;
        Ok(Self { source, compiled, world })
    }

    /// Returns the scenario with further changes.
    ///
    /// # Errors
    /// When one of them does not fit.
    pub(super) fn with_overrides(self, overrides: &[String]) -> Result<Self, InputError> {
        if overrides.is_empty() {
            return Ok(self);
        }
        let source = self.source.with_overrides(overrides)?;
        let compiled = WORLDS.compile(&source)?;
        Self::from_compiled(source, compiled)
    }

    /// Returns the fingerprint.
    ///
    /// # Errors
    /// When a file to which it refers cannot be read.
    pub(super) fn fingerprint(&self) -> Result<ScenarioFingerprint, InputError> {
        fingerprint(self.compiled.as_ref(), &self.source)
    }

    /// Returns the changes that a fleet needs: controls are recorded, because a run whose agents were elsewhere cannot be
    /// computed again without them, and in real time agents get a timeout for the answers of others.
    pub(super) fn required_overrides(&self, clock: ClockMode, is_recorded: bool) -> Vec<String> {
        let mut overrides = Vec::new();
        if is_recorded {
            overrides.push("record.controls=true".to_string());
        }
        if let ClockMode::Realtime { speed } = clock {
            overrides.extend(self.world.response_timeout_override(speed));
        }
        overrides
    }
}
