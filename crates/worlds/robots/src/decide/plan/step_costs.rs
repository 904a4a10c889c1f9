//! What a step through the places around a robot costs.

/// Prices of a search, in actions.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepCosts {
    /// Price of a place that is blocked now; the obstacle may go away.
    pub(super) blocked: u16,
    /// Extra price of a place beside a blocked one, where a slip ends in a contact.
    pub(super) beside: u16,
    /// Extra price of a place where something may be.
    pub(super) vague: u16,
    /// Direction of the last step; none before the first.
    pub(super) moved: Option<u8>,
    /// Whether that step did not lead nearer to the goal, so that it belongs to a detour.
    pub(super) is_sidestep: bool,
}

impl StepCosts {
    /// Returns whether a step in a direction goes back, or gives up the last step if that was a sidestep.
    pub(super) fn is_change_of_course(self, direction: u8) -> bool {
        let Some(moved) = self.moved else { return false };
        match (4 + direction - moved) % 4 {
            0 => false,
            2 => true,
            _ => self.is_sidestep,
        }
    }
}
