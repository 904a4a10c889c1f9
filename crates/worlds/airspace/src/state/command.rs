//! The commands of methods, as the state keeps them.

use super::{AirspaceState, lock, put_memories};
use crate::flight::MethodCommand;
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntitySlot;

/// What a method commands of an airplane, and what of it is in force.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct AirplaneCommand {
    /// What the method has commanded last; it remembers it from here.
    pub wish: MethodCommand,
    /// What the airplane flies in place of what is filed.
    pub in_force: MethodCommand,
}

impl AirspaceState {
    /// Returns whether a method commands levels or speeds in this run.
    pub(crate) fn has_commands(&self) -> bool {
        !self.commands.is_empty()
    }

    /// Returns the command of an airplane; none where no method commands anything.
    pub(crate) fn command(&self, slot: EntitySlot) -> AirplaneCommand {
        self.commands.get(slot as usize).map(|one| *lock(one)).unwrap_or_default()
    }

    /// Returns the command of an airplane that is in force.
    pub(crate) fn command_in_force(&self, slot: EntitySlot) -> MethodCommand {
        self.command(slot).in_force
    }

    /// Stores the command of an airplane; nothing where no method commands anything.
    pub(crate) fn set_command(&self, slot: EntitySlot, command: AirplaneCommand) {
        put_memories(&self.commands, &[slot], vec![command]);
    }

    /// Returns whether the method of an airplane has forgotten the conflicts that it resolved, because of an override.
    pub(crate) fn is_overridden(&self, slot: EntitySlot) -> bool {
        let resolving = self.resolving.get(slot as usize);
        resolving.is_some_and(|resolving| lock(resolving).has_forgotten())
    }

    /// Lets the method of an airplane know that its command was not cleared.
    pub(crate) fn record_command_override(&self, slot: EntitySlot) {
        if let Some(resolving) = self.resolving.get(slot as usize) {
            lock(resolving).record_override();
        }
    }
}
