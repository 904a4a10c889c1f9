//! Behaviours: from a percept, a small memory and an own random stream to one action.
//!
//! A behaviour never sees the world's state, only its percept (paper: agents propose, the
//! environment decides). It is shared by all robots of its type and keeps nothing of its
//! own; what a robot remembers is in its [`Memory`], which is part of the state.

mod goto;
mod random;
mod replay;
mod wander;

pub use goto::{Goto, Shuttle};
pub use random::Random;
pub use replay::{External, ORDER, Replay};
pub use wander::Wander;

use super::effector::{ActionId, Side};
pub use super::sensor::UNSEEN;
use super::sensor::{NOTHING, Reading};
use sidestep_kernel::Cycle;
use sidestep_kernel::stream::Draws;

/// What a robot remembers between its actions: four words whose meaning is the behaviour's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Memory {
    /// All 0 at the start of a run.
    pub words: [u32; 4],
}

/// What stopped the last action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contact {
    /// Kind of the thing touched, an index into the scenario's kinds.
    pub kind: u8,
    /// Which side of the body touched it.
    pub side: Side,
}

/// A message heard over the radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heard {
    /// Who sent it.
    pub sender: u32,
    /// What was sent.
    pub word: u64,
}

/// Where a beam looks, seen from the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sector {
    /// Within 45 degrees of the heading.
    Ahead,
    /// Between 45 and 135 degrees to the left.
    Left,
    /// Behind.
    Behind,
    /// Between 45 and 135 degrees to the right.
    Right,
}

impl Sector {
    /// The sector of a bearing in degrees, positive to the left. The diagonals belong to
    /// the sides.
    pub fn of(bearing_deg: f64) -> Self {
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
    /// The cycle.
    pub now: Cycle,
    /// One reading per beam, the sensors one after the other in the scenario's order.
    pub readings: &'a [Reading],
    /// Where each beam looks (shape: that of `readings`).
    pub sectors: &'a [Sector],
    /// Nearest distance class reported in each sector, [`UNSEEN`] where nothing is; see
    /// [`Percept::nearest`].
    pub nearest_in: [u8; 4],
    /// What stopped the last action, if anything did.
    pub contact: Option<Contact>,
    /// Column and row of the robot's lower-left box: it is localized.
    pub at: (u32, u32),
    /// Heading: 0 east, 1 north, 2 west, 3 south.
    pub heading: u8,
    /// What the robots in radio range last broadcast, by sender.
    pub heard: &'a [Heard],
}

/// The nearest class reported in each sector, for percepts that are made by hand.
pub fn nearest_in(readings: &[Reading], sectors: &[Sector]) -> [u8; 4] {
    let mut nearest = [UNSEEN; 4];
    for (reading, &sector) in readings.iter().zip(sectors) {
        if reading.observation != NOTHING {
            nearest[sector as usize] = nearest[sector as usize].min(reading.class);
        }
    }
    nearest
}

impl Percept<'_> {
    /// The nearest distance class at which something is reported in a sector, if anything.
    pub fn nearest(&self, sector: Sector) -> Option<u8> {
        let class = self.nearest_in[sector as usize];
        (class != UNSEEN).then_some(class)
    }
}

/// A mark on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trip {
    /// The robot stands where its trips begin; time counts from here.
    Begun,
    /// A trip is complete, and the next begins.
    Done,
}

/// What a robot does next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    /// The action tried.
    pub action: ActionId,
    /// Whether the last action began or completed a trip; trips are counted and timed.
    pub trip: Option<Trip>,
    /// What others in radio range hear from the next cycle on; `None` keeps the last word.
    pub broadcast: Option<u64>,
}

impl From<ActionId> for Decision {
    fn from(action: ActionId) -> Self {
        Self { action, trip: None, broadcast: None }
    }
}

/// How a robot decides. Implement it for behaviours of your own; see
/// `examples/own_behaviour.rs`.
pub trait Behaviour: std::fmt::Debug + Send + Sync {
    /// The next action, from the percept, the memory (which it may change) and the robot's
    /// random stream of this cycle alone.
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision;
}
