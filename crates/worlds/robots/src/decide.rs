//! Behaviors: from a percept, a small memory and a random stream of its own to one action.
//!
//! A behavior never sees the world's state, only its percept (in the paper agents propose, and the
//! environment decides). It is shared by all robots of its type and has no state of its own; a
//! robot's knowledge is in its [`Memory`], which is part of the state.

mod announce;
mod errands;
mod external;
mod goto;
pub(crate) mod pass_request;
mod plan;
mod random;
mod replay;
mod sidestep;
mod stall_detector;
mod touch;
mod wander;

pub use announce::Announce;
pub use errands::Errands;
pub use external::External;
pub(crate) use goto::order_action;
pub use goto::{Avoidance, Goto, Shuttle};
pub use plan::Planner;
pub use replay::Replay;
pub use sidestep::SensorTrust;
pub use stall_detector::StallDetector;
pub use wander::Wander;

pub use super::alias_table::UNSEEN;
pub use super::effector::ActionId;
use super::effector::{LEFT, RIGHT, Side};
use super::sensor::{NOTHING, Reading};
use serde::{Deserialize, Serialize};
pub use sidestep_error_models::RandomPolicy;
use sidestep_kernel::stream::Draws;
use sidestep_kernel::{Cycle, EntityId};
use sidestep_map::planning::FlowField;
use std::cmp::Ordering;
use std::sync::Arc;

/// A robot's memory between its actions: four words; their meaning is up to the behavior.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Memory {
    /// The words; all 0 at the start of a run.
    pub words: [u32; 4],
}

/// The obstacle that stopped the last action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Contact {
    /// Kind of the obstacle, an index into the scenario's kinds.
    pub kind: u8,
    /// Side of the body that touched it.
    pub side: Side,
}

/// A message heard over the radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReceivedMessage {
    /// Id of the robot that sent it.
    pub sender: EntityId,
    /// The message, of which only behaviors know the meaning.
    pub word: u64,
}

/// The direction of a beam, seen from the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sector {
    /// Within 45 degrees of the heading.
    Ahead,
    /// Between 45 and 135 degrees to the left.
    Left,
    /// Less than 45 degrees off the opposite of the heading.
    Behind,
    /// Between 45 and 135 degrees to the right.
    Right,
}

impl Sector {
    /// Returns the sector of a bearing in degrees, positive to the left. The diagonals belong to
    /// the sides.
    pub fn from_bearing_deg(bearing_deg: f64) -> Self {
        let turned = bearing_deg.rem_euclid(360.0);
        if !(45.0..=315.0).contains(&turned) {
            Self::Ahead
        } else if turned <= 135.0 {
            Self::Left
        } else if turned < 225.0 {
            Self::Behind
        } else {
            Self::Right
        }
    }
}

/// Everything a robot knows when it decides.
#[derive(Debug)]
pub struct Percept<'a> {
    /// Cycle in which the robot decides, from 0 on.
    pub now: Cycle,
    /// The robot's own id, by which others know it as a sender.
    pub id: EntityId,
    /// One reading per beam, the sensors one after the other in the scenario's order.
    pub readings: &'a [Reading],
    /// Sector of each beam (shape: that of `readings`).
    pub sectors: &'a [Sector],
    /// Nearest distance class reported in each sector, [`UNSEEN`] where nothing is; see
    /// [`Percept::nearest`].
    pub nearest_in: [u8; 4],
    /// The obstacle that stopped the last action, if there was one.
    pub contact: Option<Contact>,
    /// Column and row of the robot's lower-left box; robots know where they are.
    pub at: (u32, u32),
    /// Heading: 0 east, 1 north, 2 west, 3 south.
    pub heading: u8,
    /// Last broadcasts of the robots in radio range, by sender; those that have said nothing yet are
    /// left out.
    pub heard: &'a [ReceivedMessage],
}

/// Returns the nearest class reported in each sector, for percepts that are made outside of a run.
pub fn nearest_by_sector(readings: &[Reading], sectors: &[Sector]) -> [u8; 4] {
    let mut nearest = [UNSEEN; 4];
    for (reading, &sector) in readings.iter().zip(sectors) {
        if reading.observation != NOTHING {
            nearest[sector as usize] = nearest[sector as usize].min(reading.class);
        }
    }
    nearest
}

impl Percept<'_> {
    /// Returns the nearest distance class at which something is reported in a sector, if any.
    pub fn nearest(&self, sector: Sector) -> Option<u8> {
        let class = self.nearest_in[sector as usize];
        (class != UNSEEN).then_some(class)
    }
}

/// Returns the side on which the nearest thing reported is farther, drawn where both are alike.
fn freer_side(percept: &Percept<'_>, draws: &mut Draws) -> ActionId {
    // [`UNSEEN`] is greater than every class.
    let left = percept.nearest_in[Sector::Left as usize];
    let right = percept.nearest_in[Sector::Right as usize];
    match left.cmp(&right) {
        Ordering::Greater => LEFT,
        Ordering::Less => RIGHT,
        Ordering::Equal => random_turn(draws),
    }
}

fn random_turn(draws: &mut Draws) -> ActionId {
    if draws.uniform_below(2) == 0 { LEFT } else { RIGHT }
}

/// A mark on the path of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum TripEvent {
    /// The robot is where its trips start; time counts from here.
    Started,
    /// A trip is complete, and the next one starts.
    Completed,
}

/// A robot's choice for this cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    /// The action to try, by its number in the robot's effector.
    pub action: ActionId,
    /// Whether the last action started or completed a trip; trips are counted and timed.
    pub trip: Option<TripEvent>,
    /// Message that others in radio range hear from the next cycle on; `None` keeps the last one.
    pub broadcast: Option<u64>,
}

impl From<ActionId> for Decision {
    fn from(action: ActionId) -> Self {
        Self { action, trip: None, broadcast: None }
    }
}

/// The rule by which a robot chooses actions. Implement it for behaviors of your own; see
/// `crates/sidestep/examples/own_behavior.rs`.
pub trait Behaviour: std::fmt::Debug + Send + Sync {
    /// Returns the next action. It may depend only on the percept, the memory (which it may change)
    /// and the robot's random stream of this cycle, because robots decide in any order, on any worker.
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision;

    /// Returns whether its robots ask each other to make room. Then word 2 of the memory holds the
    /// robot's request, and the world writes the one that it hears into word 3.
    fn has_requests(&self) -> bool {
        false
    }

    /// Returns whether a robot with this memory is on a trip that it will complete: how long that takes is not known
    /// yet, and statistics of trips count it.
    fn is_on_trip(&self, _memory: &Memory) -> bool {
        false
    }

    /// Returns the goal to which a robot with this memory goes, by its number among [`Behaviour::flow_fields`]; none for one
    /// that goes nowhere. Robots with a goal are watched for gridlocks.
    fn goal(&self, _memory: &Memory) -> Option<usize> {
        None
    }

    /// Returns whether it follows the orders of a caller ([`External`]) and looks at nothing, so that its
    /// robots need not perceive twice.
    fn is_external(&self) -> bool {
        false
    }

    /// Returns the boxes, any of which is the present goal of a robot at this place, where a planner leads it: (column,
    /// row) of its lower-left box. None for robots that find their way themselves.
    fn planned_goals(&self, _at: (u32, u32), _memory: &Memory) -> &[(u32, u32)] {
        &[]
    }

    /// Returns the flow fields of all places that it wants to reach, so that a check can report those that
    /// are out of reach.
    fn flow_fields(&self) -> &[Arc<FlowField>] {
        &[]
    }
}
