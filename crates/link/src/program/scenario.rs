//! The scenario that a server and its nodes fly.

use crate::deployed::Deployed;
use crate::words::{Clock, Fingerprint};
use crate::worlds::{deployed, fingerprint};
use sidestep::kernel::InputError;
use sidestep::scenario::{Compiled, Source};
use sidestep::worlds::WORLDS;
use sidestep_session::fleet::Flown;
use std::sync::Arc;

/// A scenario, read and compiled.
pub(super) struct Scenario {
    pub(super) source: Source,
    pub(super) compiled: Box<dyn Compiled>,
    pub(super) world: Arc<dyn Deployed>,
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
        let world = deployed(compiled.as_ref(), &source)?;
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
    /// real time a network on which no agent waits forever for one that is gone.
    pub(super) fn needs(&self, clock: Clock, is_recorded: bool) -> Vec<String> {
        let mut needs = Vec::new();
        if is_recorded {
            needs.push("record.controls=true".to_string());
        }
        if let Clock::Realtime { speed } = clock {
            needs.extend(self.world.patience(speed));
        }
        needs
    }
}
