//! A compiled building: everything that stays fixed during a run.

use super::action::Action;
use super::alias_table::{AliasTable, RowIndex};
use super::decide::{Behaviour, Sector};
use super::delay::Delays;
use super::effector::{EffectorModel, ObstacleRule};
use super::policy::ConflictPolicy;
use super::sensor::{Reading, SensorModel};
use super::team::{Team, TeamOrders};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_error_models::beam::BeamModel;
use sidestep_error_models::ray::{Crossing, EPSILON, crossings, turn_crossing};
use sidestep_kernel::Cycle;
use sidestep_kernel::control::AgentTeams;
use sidestep_kernel::distr::{Bernoulli, DistributionError};
use sidestep_kernel::space::GridPosition;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::view::AgentGroup;
use sidestep_kernel::{EntityId, Seed};
use sidestep_map::{GridMap, Rect};
use std::ops::Range;
use std::sync::Arc;

/// Length of a cycle in seconds, for pictures and for clocks of fleets: a scenario gives none, because the model counts
/// cycles only.
pub const CYCLE_S: f64 = 1.0;

/// Boxes of a beam that are read together, even past a wall: four loads and one branch cost less than a branch
/// after each load.
pub(super) const BEAM_CHUNK_BOXES: usize = 4;

/// The order in which bodies are stored; no result depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StorageOrder {
    /// Neighbors on the map are neighbors in memory; rearranged at intervals, as they move.
    #[default]
    Spatial,
    /// The order of entity ids.
    ById,
    /// Shuffled by this number; for tests.
    Shuffled(u64),
}

impl StorageOrder {
    /// Entity ids in the order of storage.
    pub(super) fn ids(self, world: &RobotsWorld) -> Vec<EntityId> {
        let mut ids: Vec<EntityId> = (0..world.bodies.len() as EntityId).collect();
        match self {
            // `Spatial` starts by id, and is rearranged by the first cycle.
            Self::ById | Self::Spatial => {}
            Self::Shuffled(by) => {
                let streams = Streams::new(Seed(by));
                ids.sort_by_key(|&id| streams.block(id, 0, Purpose(0), 0));
            }
        }
        ids
    }
}

/// The errors that are switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Regime {
    /// Neither sensors nor effectors err.
    Reliable,
    /// Effectors err.
    Effectors,
    /// Sensors err.
    Sensors,
    /// Both err.
    #[default]
    Both,
}

impl Regime {
    /// The paper's four cases.
    pub const ALL: [Self; 4] = [Self::Reliable, Self::Effectors, Self::Sensors, Self::Both];

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        ["reliable", "effectors", "sensors", "both"][self as usize]
    }

    /// Where they are, every reading is the truth, whatever the tables of sensors say.
    pub(crate) fn has_reliable_sensors(self) -> bool {
        matches!(self, Self::Reliable | Self::Effectors)
    }

    /// Where they are, every action ends in its first transition, whatever the tables say.
    pub(crate) fn has_reliable_effectors(self) -> bool {
        matches!(self, Self::Reliable | Self::Sensors)
    }
}

/// The immutable world, shared by all runs of a scenario.
#[derive(Debug, Clone)]
pub struct RobotsWorld {
    /// The map without bodies.
    pub map: Arc<GridMap>,
    /// Names of the kinds by number: 0 `free`, 1 `wall`, then bodies' kinds.
    pub kinds: Vec<String>,
    /// The kinds of errors that are switched on.
    pub regime: Regime,
    /// The rule for paths that meet an obstacle.
    pub obstacle_rule: ObstacleRule,
    /// The order in which the bodies of a conflict group act.
    pub policy: ConflictPolicy,
    /// Number of free boxes of the map, which each row of metrics over time needs.
    pub(super) free_boxes: usize,
    /// All bodies by id.
    pub bodies: Vec<Body>,
    /// Properties that bodies have in common, one entry per type.
    pub types: Vec<BodyType>,
    /// Rank of each kind under the policy `by_kind`; the smallest acts first.
    pub(super) kind_rank: Vec<u8>,
    pub(super) radio: Option<Radio>,
    /// The robots as a caller sees them.
    pub(super) teams: Arc<AgentTeams>,
    pub(super) robots: Vec<EntityId>,
    /// The robots by the sections of the scenario.
    pub(super) agent_groups: Vec<AgentGroup>,
    /// The teams of robots that a planner leads.
    pub(super) planner_teams: Vec<Team>,
    /// The robots whose behavior has goals, by rising id.
    pub(super) goal_robots: Vec<EntityId>,
    /// The robots that are watched for gridlocks: those, and those with tasks, by rising id.
    pub(super) watched_robots: Vec<EntityId>,
    /// Whether a run is over at its first gridlock.
    pub(super) stops_at_gridlock: bool,
    /// Whether there are robots that ask each other to make room.
    pub(super) has_requests: bool,
    /// Whether there are robots that may be delayed.
    pub(super) has_delays: bool,
    /// The sections of robots whose delays are drawn together.
    pub(super) delay_teams: Vec<Range<EntityId>>,
    /// Whether there are robots whose actions take several cycles.
    pub(super) has_long_actions: bool,
    /// The order in which states store the bodies.
    pub(super) storage: StorageOrder,
    pub(super) streams: Streams,
    /// Rings of wall around the map. They are there because whole paths, and [`BEAM_CHUNK_BOXES`] boxes of
    /// a beam, are read at once without a check against the map's edge.
    pub(super) border: u32,
    /// Width of the padded grid, in boxes.
    pub(super) stride: u32,
    /// The padded grid without bodies.
    pub(super) walls: Vec<u8>,
    /// Largest distance in boxes from a body to a box that it claims.
    pub(super) reach: u32,
}

/// One body: its identity, its type, and the cycles in which it acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Body {
    /// Identity: its place in the list of bodies.
    pub id: EntityId,
    /// Index into [`RobotsWorld::types`].
    pub ty: u16,
    /// Number of cycles from one action to the next.
    pub period: u32,
    /// The body acts in the cycles where `(cycle + phase) % period` is 0.
    pub phase: u32,
    /// Number of cycles that an action takes, other than a wait.
    pub action_cycles: u32,
}

impl Body {
    /// Returns whether the body acts in this cycle; otherwise it stays where it is, and claims
    /// nothing.
    #[inline]
    pub fn is_due(&self, now: Cycle) -> bool {
        (now + u64::from(self.phase)).is_multiple_of(u64::from(self.period))
    }

    /// Returns the number of actions that the body has started before this cycle.
    pub(crate) fn actions_before(&self, cycle: Cycle) -> u64 {
        let period = u64::from(self.period);
        let phase = u64::from(self.phase);
        // Multiples of the period in `phase..cycle + phase`.
        (cycle + phase).div_ceil(period) - phase.div_ceil(period)
    }
}

/// Properties shared by the bodies of one type.
#[derive(Debug, Clone)]
pub struct BodyType {
    /// Index into [`RobotsWorld::kinds`].
    pub kind: u8,
    /// Width and height in boxes.
    pub size: (u32, u32),
    /// Offsets of the boxes it covers from its anchor, in the padded grid.
    pub(crate) own: Box<[i32]>,
    /// Whether it marks the boxes that it covers as visited, as robots do.
    pub(crate) marks: bool,
    /// Its actions: `heading * actions per heading + action`; none for a door.
    pub(crate) actions: Arc<[Action]>,
    /// Its part in the world, with the data for it.
    pub role: Role,
}

impl BodyType {
    /// Returns the boxes that such a body covers when its lower-left one is `at`.
    pub(super) fn boxes(&self, at: (u32, u32)) -> Rect {
        Rect { col: at.0, row: at.1, width: self.size.0, height: self.size.1 }
    }

    /// Not for doors, which have no actions.
    #[inline]
    pub(crate) fn action_index(&self, heading: u8, action: u8) -> u16 {
        u16::from(heading) * (self.actions.len() / 4) as u16 + u16::from(action)
    }
}

/// The three sorts of bodies.
#[derive(Debug, Clone)]
pub enum Role {
    /// An agent: perceives, decides and acts.
    Robot(RobotModel),
    /// A mobile object, such as a person: moves at random, and perceives nothing.
    Mover(Mover),
    /// Opens and closes in its place, by a schedule or by chance.
    Door(Door),
}

/// A robot type: its body and its behavior.
#[derive(Debug, Clone)]
pub struct RobotModel {
    /// Sensors and effectors, shared by types that differ only in behavior.
    pub body: Arc<RobotBody>,
    /// Chooses the actions; shared by all robots of the type, and without state of its own.
    pub behaviour: Arc<dyn Behaviour>,
    /// Whether it is decided from outside; asked once, because the answer is needed in every cycle.
    pub(super) is_external: bool,
    /// The orders from outside, if they are those of the planner of its team.
    pub(super) team_orders: Option<TeamOrders>,
}

impl RobotModel {
    pub(crate) fn new(
        body: Arc<RobotBody>,
        behaviour: Arc<dyn Behaviour>,
        team_orders: Option<TeamOrders>,
    ) -> Self {
        let is_external = behaviour.is_external() || team_orders.is_some();
        Self { body, behaviour, is_external, team_orders }
    }
}

/// Sensors and effectors of a robot type.
#[derive(Debug)]
pub struct RobotBody {
    /// Sensors, in the scenario's order.
    pub sensors: Vec<MountedSensor>,
    /// Sector of each beam of all sensors in order.
    pub(crate) sectors: Vec<Sector>,
    /// The effector as the scenario gives it.
    pub effector: EffectorModel,
    /// The effector on this body, see [`BodyType::actions`].
    pub(crate) actions: Arc<[Action]>,
    /// Its delays, where there are any in this regime.
    pub(crate) delays: Option<Delays>,
}

/// A sensor on a body of a given size, with the boxes of its beams at every heading.
#[derive(Debug)]
pub struct MountedSensor {
    /// The sensor as the scenario gives it.
    pub model: SensorModel,
    pub(super) table: AliasTable,
    /// The boxes that its beams cross, for each heading.
    pub(super) boxes: [Box<[BeamBoxes]>; 4],
    /// The distance in boxes to each of them, the same for all headings.
    pub(super) distances: Box<[[f64; BEAM_CHUNK_BOXES]]>,
    /// End of each beam's boxes in the lists of `boxes`.
    pub(super) ends: Box<[u16]>,
    /// The row of each beam's report when it meets nothing.
    pub(super) nothing_row: RowIndex,
    pub(super) nothing: Reading,
    /// Side of a box in meters.
    pub(super) box_size_m: f64,
}

/// Consecutive boxes along a beam.
#[derive(Debug, Clone, Copy)]
pub(super) struct BeamBoxes {
    /// Index offsets from the anchor.
    pub(super) offsets: [i32; BEAM_CHUNK_BOXES],
    /// Distance class of an obstacle in each of them.
    pub(super) classes: [u8; BEAM_CHUNK_BOXES],
}

impl MountedSensor {
    /// Mounts a sensor on a `size` x `size` body.
    ///
    /// # Errors
    /// Returns an error when a row of its matrices is not a distribution.
    pub(crate) fn new(
        model: SensorModel,
        size: u32,
        box_size_m: f64,
        stride: u32,
        reliable: bool,
    ) -> Result<Self, DistributionError> {
        let range = model.range_m / box_size_m;
        let bearings_deg = model.bearings_deg.iter();
        let beams: Vec<Vec<[Crossing; BEAM_CHUNK_BOXES]>> =
            bearings_deg.map(|&deg| beam_chunks(crossings(size, deg, range))).collect();
        let boxes = [0, 1, 2, 3].map(|heading| {
            let chunks = beams.iter().flatten();
            let turned = chunks.map(|chunk| BeamBoxes {
                offsets: chunk.map(|crossing| {
                    let at = turn_crossing(crossing, size, heading);
                    at.dy * stride as i32 + at.dx
                }),
                classes: chunk.map(|crossing| model.class_of(crossing.distance, box_size_m)),
            });
            turned.collect()
        });
        let chunks = beams.iter().flatten();
        let distances = chunks.map(|chunk| chunk.map(|crossing| crossing.distance)).collect();
        let mut ends = Vec::with_capacity(beams.len());
        let mut end = 0;
        for beam in &beams {
            end += beam.len() as u16;
            ends.push(end);
        }
        let table = AliasTable::new(&model, reliable)?;
        let nothing = model.nothing();
        let nothing_row = table.row(nothing);
        let ends = ends.into();
        Ok(Self { model, table, boxes, distances, ends, nothing_row, nothing, box_size_m })
    }

    /// Returns whether every reading is the truth.
    pub(crate) fn is_reliable(&self) -> bool {
        self.table.reliable
    }

    /// Returns whether every reading is the truth by its tables or because errors are off.
    pub(super) fn is_error_free(&self) -> bool {
        let model = &self.model;
        self.is_reliable()
            || model.beam.is_none()
                && is_identity(&model.distance_confusion)
                && model.confusion.iter().all(|matrix| is_identity(matrix))
    }

    /// Returns the model by which its reports are drawn, where it measures ranges and errs.
    #[inline]
    pub(super) fn erring_beam(&self) -> Option<&BeamModel> {
        self.model.beam.as_ref().filter(|_| !self.table.reliable)
    }

    /// Returns 0, which is nothing, where the sensor does not see the kind.
    pub(super) fn designated_observation(&self, kind: u8) -> u8 {
        self.model.designates[usize::from(kind)]
    }

    /// Returns the true reading of a beam that meets `kind` at distance class `class`. A kind that
    /// the sensor cannot observe reads as nothing.
    #[inline]
    pub(crate) fn truth(&self, kind: u8, class: u8) -> Reading {
        match self.model.designates[usize::from(kind)] {
            0 => self.nothing,
            observation => Reading { observation, class },
        }
    }
}

/// Returns whether every row of a confusion matrix reports the truth for certain.
fn is_identity(matrix: &[Vec<f64>]) -> bool {
    // The last row of a matrix of classes, `beyond`, has no column, and is used only for spurious reports.
    matrix.iter().enumerate().all(|(truth, row)| row.get(truth).is_none_or(|&p| p == 1.0))
}

/// Returns a beam's crossings in groups of [`BEAM_CHUNK_BOXES`]. The last crossing is repeated to fill the
/// last group, so that the first box met stays the same.
fn beam_chunks(mut beam: Vec<Crossing>) -> Vec<[Crossing; BEAM_CHUNK_BOXES]> {
    if let Some(&last) = beam.last() {
        beam.resize(beam.len().next_multiple_of(BEAM_CHUNK_BOXES), last);
    }
    beam.as_chunks().0.to_vec()
}

/// A mobile object: tries one box per action.
#[derive(Debug, Clone)]
pub struct Mover {
    /// Chance to continue in the same direction; otherwise a new one is drawn.
    pub(crate) straight: Bernoulli,
}

/// The rule by which a door opens and closes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Door {
    /// Open for `open` cycles, then closed for `closed`, shifted by `phase`.
    Periodic {
        /// Number of cycles for which it is open.
        open: u64,
        /// Number of cycles for which it is closed.
        closed: u64,
        /// Cycles by which the schedule is ahead.
        phase: u64,
    },
    /// Opens or closes by chance.
    Random {
        /// Chance per cycle that a closed door opens.
        open: Bernoulli,
        /// Chance per cycle that an open door closes.
        close: Bernoulli,
    },
}

impl Door {
    /// A door that wants to close waits while a body stands in it. Only doors that act by chance
    /// draw.
    pub(crate) fn wants_open(&self, is_open: bool, now: Cycle, draw: impl FnOnce() -> u32) -> bool {
        match *self {
            Self::Periodic { open, closed, phase } => (now + phase) % (open + closed) < open,
            Self::Random { open, close } => {
                let chance = if is_open { close } else { open };
                is_open != chance.sample(draw())
            }
        }
    }
}

/// Radio contact between robots.
#[derive(Debug, Clone, Copy)]
pub struct Radio {
    /// Square of the range, in half boxes, so that the distance of two centers is compared with it as an integer.
    pub(super) reach2_half_boxes: u64,
    /// Chance that a reception is lost.
    pub(super) loss: Bernoulli,
}

impl Radio {
    /// Returns a radio with this range in meters and this chance of losing a reception.
    pub(crate) fn new(range_m: f64, box_size_m: f64, loss: f64) -> Self {
        // A robot exactly at the range hears, even where rounding makes the quotient smaller.
        let reach = 2.0 * (range_m / box_size_m + EPSILON);
        Self { reach2_half_boxes: (reach * reach) as u64, loss: Bernoulli::new(loss) }
    }
}

impl Radio {
    /// Returns whether two bodies hear each other, by their centers in halves of a box.
    pub(crate) fn reaches(&self, a: (i64, i64), b: (i64, i64)) -> bool {
        let dx = a.0 - b.0;
        let dy = a.1 - b.1;
        ((dx * dx + dy * dy) as u64) <= self.reach2_half_boxes
    }
}

impl RobotsWorld {
    /// Returns the type of a body; `id` is an index into [`Self::bodies`].
    pub fn type_of(&self, id: EntityId) -> &BodyType {
        &self.types[usize::from(self.bodies[id as usize].ty)]
    }

    /// Returns the ids of the robots, rising.
    pub fn robots(&self) -> &[EntityId] {
        &self.robots
    }

    pub(crate) fn is_door(&self, id: EntityId) -> bool {
        matches!(self.type_of(id).role, Role::Door(_))
    }

    /// Returns the map column and row of a position in the padded grid.
    #[inline]
    pub(super) fn map_position(&self, at: GridPosition) -> (u32, u32) {
        (at.col() - self.border, at.row() - self.border)
    }

    /// Returns the position in the padded grid of a map column and row.
    pub(super) fn grid_position(&self, col: u32, row: u32) -> GridPosition {
        GridPosition::new(col + self.border, row + self.border)
    }

    /// Returns the number of boxes without those of the border.
    pub(super) fn map_boxes(&self) -> usize {
        self.map.cells().len()
    }

    /// Returns the indices in the padded grid of the map's boxes, row by row.
    pub(super) fn map_indices(&self) -> impl Iterator<Item = usize> + '_ {
        let width = self.map.width() as usize;
        (0..self.map.height()).flat_map(move |row| {
            let first = ((row + self.border) * self.stride + self.border) as usize;
            first..first + width
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For the sides of boxes that people write; a quotient such as 0.9 / 0.3 is below 3.
    #[test]
    fn a_radio_reaches_a_robot_exactly_at_its_range_for_every_side_of_a_box() {
        for side_mm in (10..=500).step_by(5) {
            let side_m = f64::from(side_mm) / 1000.0;
            for boxes in 1..=60 {
                let range_m = f64::from(boxes * side_mm) / 1000.0;
                let reach2 = Radio::new(range_m, side_m, 0.0).reach2_half_boxes;
                assert_eq!(reach2, (4 * boxes * boxes) as u64, "{boxes} boxes of {side_m} m");
            }
        }
    }
}
