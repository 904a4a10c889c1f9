//! The scenario that a server and its nodes fly.

use crate::airspace::{fingerprint, world_of};
use crate::words::{Clock, Fingerprint};
use sidestep::kernel::InputError;
use sidestep::scenario::{Compiled, Source};
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::AirspaceWorld;
use sidestep_session::fleet::Flown;
use std::sync::Arc;

/// A scenario, read and compiled.
pub(super) struct Scenario {
    pub(super) source: Source,
    pub(super) compiled: Box<dyn Compiled>,
    pub(super) world: Arc<AirspaceWorld>,
}

impl Scenario {
    /// Reads a scenario.
    ///
    /// # Errors
    /// When it is wrong, or its agents cannot be flown by nodes.
    pub(super) fn read(flown: &Flown) -> Result<Self, InputError> {
        let (source, compiled) = sidestep_session::read(WORLDS, &flown.file, &flown.overrides)?;
        Self::of(source, compiled)
    }

    fn of(source: Source, compiled: Box<dyn Compiled>) -> Result<Self, InputError> {
        let world = world_of(compiled.as_ref(), &source)?;
        Ok(Self { source, compiled, world })
    }

    /// Returns the scenario with further changes.
    ///
    /// # Errors
    /// When one of them does not fit.
    pub(super) fn with(self, overrides: &[String]) -> Result<Self, InputError> {
        if overrides.is_empty() {
            return Ok(self);
        }
        let source = self.source.with(overrides)?;
        let compiled = WORLDS.compile(&source)?;
        Self::of(source, compiled)
    }

    /// Returns the fingerprint.
    ///
    /// # Errors
    /// When a file that it names cannot be read.
    pub(super) fn fingerprint(&self) -> Result<Fingerprint, InputError> {
        fingerprint(self.compiled.as_ref(), &self.source)
    }

    /// Returns the changes that a fleet needs: controls that are recorded, so that the run can be computed again, and in
    /// real time a network on which nobody waits for ever for one that is gone.
    pub(super) fn needs(&self, clock: Clock, is_recorded: bool) -> Vec<String> {
        let mut needs = Vec::new();
        if is_recorded {
            needs.push("record.controls=true".to_string());
        }
        if clock != Clock::Lockstep && self.world.network.is_none() {
            // As long as may be, since processes are slower to answer than agents in memory.
            let patience_s = PATIENCE_PART * self.world.timing.dt_s;
            needs.push(format!("airspace.network.patience_s={patience_s}"));
        }
        needs
    }
}

/// Part of a cycle after which an agent asks again: an eighth of the time that a talk has, and a little less.
const PATIENCE_PART: f64 = 0.05;
