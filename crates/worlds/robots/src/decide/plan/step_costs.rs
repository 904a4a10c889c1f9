//! What a step through the places around a robot costs.

/// Price of a first step away from the goal that goes straight back, or gives up a sidestep. It is
/// there because a robot sees little of a wide obstacle, and would otherwise go to and fro before it.
const CHANGE_COST: u16 = 4;

/// The same on a detour, and there also for going straight back where that is nearer to the goal: back on its lane a
/// robot would stand before the same obstacle.
const DETOUR_CHANGE_COST: u16 = 32;

/// Prices of a search, in actions.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepCosts {
    /// Price of a place that is blocked now; the obstacle may go away.
    pub(super) blocked: u16,
    /// Extra price of a place beside a blocked one, where a slip ends in a contact.
    pub(super) beside: u16,
    /// Extra price of a place where something may be.
    pub(super) vague: u16,
    /// Extra price of a place that is off lane.
    pub(super) off_lane: u16,
    /// Whether the robot goes around something that it has waited for.
    pub(super) is_on_detour: bool,
    /// Direction of the last step; none before the first.
    pub(super) moved: Option<u8>,
    /// Whether that step did not lead nearer to the goal, so that it belongs to a detour.
    pub(super) is_sidestep: bool,
}

impl StepCosts {
    /// Returns the extra price of a first step for what it undoes.
    pub(super) fn change_of_course(self, direction: u8, is_away: bool) -> u16 {
        let goes_back = self.moved.is_some_and(|moved| (moved + 2) % 4 == direction);
        let is_change = self.is_change_of_course(direction);
        if self.is_on_detour && (goes_back || is_away && is_change) {
            DETOUR_CHANGE_COST
        } else if is_away && is_change {
            CHANGE_COST
        } else {
            0
        }
    }

    /// Returns whether a step in a direction goes back, or gives up the last step if that was a sidestep.
    fn is_change_of_course(self, direction: u8) -> bool {
        let Some(moved) = self.moved else { return false };
        match (4 + direction - moved) % 4 {
            0 => false,
            2 => true,
            _ => self.is_sidestep,
        }
    }
}
