//! A compiled building: everything that never changes during a run.

use super::decide::{Behaviour, Sector};
use super::effector::{Action, EffectorModel, ObstacleRule};
use super::policy::ConflictPolicy;
use super::ray::{Crossing, crossings, turn_crossing};
use super::sensor::{Reading, ReadingTable, Row, SensorModel};
use serde::{Deserialize, Serialize};
use sidestep_kernel::Cycle;
use sidestep_kernel::distr::{Chance, RowError};
use sidestep_kernel::space::Position;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{EntityId, Seed};
use sidestep_map::GridMap;
use std::sync::Arc;

/// Boxes of a beam that are read together, even past a wall.
pub(super) const BEAM_STEP: usize = 4;

/// The order in which bodies are stored; no result depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StorageOrder {
    /// Neighbors on the map are neighbors in memory; arranged anew now and then.
    #[default]
    Spatial,
    /// By entity id.
    ById,
    /// Shuffled by this number; for tests.
    Shuffled(u64),
}

impl StorageOrder {
    /// Entity ids in the order of storage.
    pub(super) fn ids(self, world: &RobotsWorld) -> Vec<EntityId> {
        let mut ids: Vec<EntityId> = (0..world.bodies.len() as EntityId).collect();
        match self {
            // Arranged as it goes.
            Self::ById | Self::Spatial => {}
            Self::Shuffled(by) => {
                let streams = Streams::new(Seed(by));
                ids.sort_by_key(|&id| streams.block(id, 0, Purpose(0), 0));
            }
        }
        ids
    }
}

/// Which errors are switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
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

    /// Its name in files.
    pub fn name(self) -> &'static str {
        ["reliable", "effectors", "sensors", "both"][self as usize]
    }

    /// Whether sensors are reliable.
    pub fn reliable_sensors(self) -> bool {
        matches!(self, Self::Reliable | Self::Effectors)
    }

    /// Whether effectors are reliable.
    pub fn reliable_effectors(self) -> bool {
        matches!(self, Self::Reliable | Self::Sensors)
    }
}

/// The immutable world that runs share.
#[derive(Debug, Clone)]
pub struct RobotsWorld {
    /// The map without bodies.
    pub map: Arc<GridMap>,
    /// Names of the kinds by number: 0 `free`, 1 `wall`, then bodies' kinds.
    pub kinds: Vec<String>,
    /// Which errors are on.
    pub regime: Regime,
    /// The law for blocked paths.
    pub obstacle_rule: ObstacleRule,
    /// The order in conflict groups.
    pub policy: ConflictPolicy,
    /// All bodies by id.
    pub bodies: Vec<Body>,
    /// What bodies have in common.
    pub types: Vec<BodyType>,
    pub(super) kind_rank: Vec<u8>,
    pub(super) radio: Option<Radio>,
    pub(super) robots: Vec<EntityId>,
    /// In which order states keep the bodies.
    pub(super) storage: StorageOrder,
    pub(super) streams: Streams,
    /// Rings of wall around the map, since whole paths, and [`BEAM_STEP`] boxes of a beam, are
    /// read at once.
    pub(super) border: u32,
    /// Width of the padded grid.
    pub(super) stride: u32,
    /// The padded grid without bodies.
    pub(super) walls: Vec<u8>,
    /// Most boxes that a claim reaches beside a body.
    pub(super) reach: u32,
}

/// One body: who it is and when it acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Body {
    /// Identity: its place in the list of bodies.
    pub id: EntityId,
    /// Index into the types.
    pub ty: u16,
    /// Acts every `period` cycles,
    pub period: u32,
    /// in those where `(cycle + phase) % period` is 0.
    pub phase: u32,
}

impl Body {
    /// Whether the body acts in this cycle.
    #[inline]
    pub fn is_due(&self, now: Cycle) -> bool {
        (now + u64::from(self.phase)).is_multiple_of(u64::from(self.period))
    }

    /// How many actions the body has begun before this cycle.
    pub fn actions_before(&self, cycle: Cycle) -> u64 {
        let (period, phase) = (u64::from(self.period), u64::from(self.phase));
        // Multiples of the period in `phase..cycle + phase`.
        (cycle + phase).div_ceil(period) - phase.div_ceil(period)
    }
}

/// What bodies of one type share.
#[derive(Debug, Clone)]
pub struct BodyType {
    /// Number of its kind.
    pub kind: u8,
    /// Width and height in boxes.
    pub size: (u32, u32),
    /// Offsets of the boxes it covers from its anchor, in the padded grid.
    pub own: Box<[i32]>,
    /// Robots mark the boxes they cover as visited.
    pub marks: bool,
    /// Its actions: `heading * actions per heading + action`; none for a door.
    pub actions: Arc<[Action]>,
    /// What it does.
    pub role: Role,
}

impl BodyType {
    /// Where an action at a heading stands in `actions`.
    #[inline]
    pub fn action_index(&self, heading: u8, action: u8) -> u16 {
        u16::from(heading) * (self.actions.len() / 4) as u16 + u16::from(action)
    }
}

/// The three sorts of bodies.
#[derive(Debug, Clone)]
pub enum Role {
    /// An agent.
    Robot(RobotModel),
    /// A mobile object.
    Mover(Mover),
    /// A door.
    Door(Door),
}

/// A robot type: its body and its mind.
#[derive(Debug, Clone)]
pub struct RobotModel {
    /// Sensors and effectors, shared by types that differ in behaviour only.
    pub body: Arc<RobotBody>,
    /// How it decides.
    pub behaviour: Arc<dyn Behaviour>,
}

/// Sensors and effectors of a robot type.
#[derive(Debug)]
pub struct RobotBody {
    /// Sensors in order.
    pub sensors: Vec<MountedSensor>,
    /// Sector of each beam of all sensors in order.
    pub sectors: Vec<Sector>,
    /// The effector as data.
    pub effector: EffectorModel,
    /// The effector on this body, see [`BodyType::actions`].
    pub actions: Arc<[Action]>,
}

/// A sensor on a body of a given size.
#[derive(Debug)]
pub struct MountedSensor {
    /// The sensor as data.
    pub model: SensorModel,
    pub(super) table: ReadingTable,
    /// The boxes that its beams cross, at each heading.
    pub(super) boxes: [Box<[Crossed]>; 4],
    /// Where each beam's boxes end in the lists of `boxes`.
    pub(super) ends: Box<[u16]>,
    /// The row of each beam's report where there is nothing.
    pub(super) nothing_row: Row,
    pub(super) nothing: Reading,
}

/// Some boxes in a row on a beam's way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossed {
    /// Index offsets from the anchor.
    pub(super) offsets: [i32; BEAM_STEP],
    /// Distance class of what stands there.
    pub(super) classes: [u8; BEAM_STEP],
}

impl MountedSensor {
    /// Mounts a sensor on a `size` x `size` body.
    ///
    /// # Errors
    /// When a row of its matrices is no distribution.
    pub fn new(
        model: SensorModel,
        size: u32,
        box_size_m: f64,
        stride: u32,
        reliable: bool,
    ) -> Result<Self, RowError> {
        let range = model.range_m / box_size_m;
        let beam = |&deg: &f64| in_fours(crossings(size, deg, range));
        let beams: Vec<_> = model.bearings_deg.iter().map(beam).collect();
        let crossed = |four: [Crossing; BEAM_STEP], heading| Crossed {
            offsets: four.map(|c| {
                let turned = turn_crossing(c, size, heading);
                turned.dy * stride as i32 + turned.dx
            }),
            classes: four.map(|c| model.class_of(c.distance * box_size_m)),
        };
        let boxes = [0, 1, 2, 3]
            .map(|heading| beams.iter().flatten().map(|&four| crossed(four, heading)).collect());
        let mut end = 0;
        let ends = beams.iter().map(|beam| {
            end += beam.len() as u16;
            end
        });
        let ends = ends.collect();
        let (table, nothing) = (ReadingTable::new(&model, reliable)?, model.nothing());
        let nothing_row = table.row(nothing);
        Ok(Self { model, table, boxes, ends, nothing_row, nothing })
    }

    /// Whether every reading is the truth.
    pub fn is_reliable(&self) -> bool {
        self.table.reliable
    }

    /// The true reading of a beam that meets `kind` at distance class `class`. What the
    /// sensor cannot observe at all reads as nothing.
    #[inline]
    pub fn truth(&self, kind: u8, class: u8) -> Reading {
        match self.model.designates[usize::from(kind)] {
            0 => self.nothing,
            observation => Reading { observation, class },
        }
    }
}

/// A beam's crossings in fours; the last one is repeated, so that what is met first stays the
/// same.
fn in_fours(mut beam: Vec<Crossing>) -> Vec<[Crossing; BEAM_STEP]> {
    if let Some(&last) = beam.last() {
        beam.resize(beam.len().next_multiple_of(BEAM_STEP), last);
    }
    beam.as_chunks().0.to_vec()
}

/// A mobile object: tries one box per action.
#[derive(Debug, Clone)]
pub struct Mover {
    /// Chance to go on in the same direction; otherwise a new one is drawn.
    pub straight: Chance,
}

/// A door's will.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Door {
    /// Open for `open` cycles, closed for `closed`, shifted by `phase`.
    Periodic {
        /// Cycles open.
        open: u64,
        /// Cycles closed.
        closed: u64,
        /// Cycles by which the schedule is ahead.
        phase: u64,
    },
    /// Opens or closes by chance.
    Random {
        /// Chance per cycle to open when closed.
        open: Chance,
        /// Chance per cycle to close when open.
        close: Chance,
    },
}

impl Door {
    /// Whether the door wants to be open now.
    pub fn wants_open(&self, is_open: bool, now: Cycle, draw: impl FnOnce() -> u32) -> bool {
        match *self {
            Self::Periodic { open, closed, phase } => (now + phase) % (open + closed) < open,
            Self::Random { open, close } => {
                let toggles = if is_open { close.happens(draw()) } else { open.happens(draw()) };
                is_open != toggles
            }
        }
    }
}

/// Robots that hear each other.
#[derive(Debug, Clone, Copy)]
pub struct Radio {
    /// Square of the range, in half boxes.
    pub(super) reach2_half_boxes: u64,
    /// Chance that a reception is lost.
    pub(super) loss: Chance,
}

impl Radio {
    /// Radio with this range and this chance of losing a reception.
    pub fn new(range_m: f64, box_size_m: f64, loss: f64) -> Self {
        let reach = 2.0 * range_m / box_size_m;
        Self { reach2_half_boxes: (reach * reach) as u64, loss: Chance::new(loss) }
    }
}

impl RobotsWorld {
    /// The type of a body.
    pub fn type_of(&self, id: EntityId) -> &BodyType {
        &self.types[usize::from(self.bodies[id as usize].ty)]
    }

    /// The robots.
    pub fn robots(&self) -> &[EntityId] {
        &self.robots
    }

    /// Whether a body is a door.
    pub fn is_door(&self, id: EntityId) -> bool {
        matches!(self.type_of(id).role, Role::Door(_))
    }

    /// Map column and row of a position in the padded grid.
    #[inline]
    pub(super) fn map_position(&self, at: Position) -> (u32, u32) {
        (at.col() - self.border, at.row() - self.border)
    }

    /// Position in the padded grid of a map column and row.
    pub(super) fn grid_position(&self, (col, row): (u32, u32)) -> Position {
        Position::new(col + self.border, row + self.border)
    }

    /// Number of boxes of the map.
    pub(super) fn map_boxes(&self) -> usize {
        self.map.cells().len()
    }

    /// Indices in the padded grid of the map's boxes, row by row.
    pub(super) fn map_indices(&self) -> impl Iterator<Item = usize> + '_ {
        let (width, height) = (self.map.width(), self.map.height());
        (0..height).flat_map(move |row| {
            let first = ((row + self.border) * self.stride + self.border) as usize;
            first..first + width as usize
        })
    }
}
