//! What a robot that is driven tells the others of itself.

use sidestep_kernel::EntityId;
use sidestep_planners::GridPose;

/// A beacon of a robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriveBeacon {
    /// The robot.
    pub robot: EntityId,
    /// Its boxes and its heading.
    pub at: GridPose,
    /// Its last word over the radio of the scenario; none before the first.
    pub word: Option<u64>,
    /// Its request to make room, as the word of a memory; 0 for none.
    pub request: u32,
    /// Number of actions of its plan that it has done; none where it has no plan, or does not know yet.
    pub done: Option<u32>,
    /// What it knows of the actions that others have done, by rising ids.
    pub heard_done: Vec<(EntityId, u32)>,
}
