//! All that changes in a run, and its snapshot.

use super::agents::contact::Contacts;
use super::flight::{Point, Pose, Stage};
use super::shield::Side;
use super::world::AirspaceWorld;
use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Shared;
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::{Column, Cycle, Digest, Slot};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Not arrived yet.
pub const FLYING: u64 = u64::MAX;
/// Set beside the time at which an airplane was removed, rather than arrived.
const LEFT: u64 = 1 << 63;
/// See [`Cell::fallback`].
const TOO_CLOSE: u8 = 2;
const NOBODY: u32 = u32::MAX;

/// How a flight ends, and in which step of `dtau` since the run's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At the last way-point, or at the end of the recorded way.
    Arrived(u64),
    /// Removed before that.
    Left(u64),
}

/// The state of an airspace; slots are ids.
#[derive(Debug)]
pub struct AirspaceState {
    /// What changes of each airplane.
    pub airplanes: Box<[Cell]>,
    pub(super) neighborhood: Neighborhood,
    /// What each airplane knows of others; nothing where the network can be relied on.
    contacts: Box<[Mutex<Contacts>]>,
}

/// One airplane's share of the state.
#[derive(Debug, Default)]
#[repr(align(64))]
pub struct Cell {
    /// Position east, meters,
    pub x_m: Shared<f64>,
    /// and north.
    pub y_m: Shared<f64>,
    /// Heading.
    pub heading_rad: Shared<f64>,
    /// Altitude, meters.
    pub altitude_m: Shared<f64>,
    /// Steps of `dtau` since the run's start when it arrived, or [`FLYING`]; with the highest bit
    /// set, when it was removed.
    pub arrived: Shared<u64>,
    /// Way-points done with.
    pub next: Shared<u32>,
    /// Times that the shield changed what it wanted,
    pub overrides: Shared<u32>,
    /// of these, falls back to its orbit,
    pub orbits: Shared<u32>,
    /// and how many of those in a row just now.
    pub orbiting: Shared<u32>,
    /// Orders carried out,
    pub orders: Shared<u16>,
    /// and times that one had to wait for the next `dt`.
    pub waits: Shared<u16>,
    /// Stored fallback, 0 left, 1 right; and 2 for having come in too close to another.
    pub fallback: Shared<u8>,
}

impl Cell {
    /// Its pose.
    pub fn pose(&self) -> Pose {
        Pose { at: [self.x_m.get(), self.y_m.get()], heading_rad: self.heading_rad.get() }
    }

    /// Puts it somewhere.
    pub fn set_pose(&self, pose: Pose) {
        self.x_m.set(pose.at[0]);
        self.y_m.set(pose.at[1]);
        self.heading_rad.set(pose.heading_rad);
    }

    /// Whether it has not arrived yet.
    pub fn is_flying(&self) -> bool {
        self.arrived.get() == FLYING
    }

    /// How its flight has ended, if it has.
    pub fn end(&self) -> Option<End> {
        match self.arrived.get() {
            FLYING => None,
            step if step & LEFT != 0 => Some(End::Left(step & !LEFT)),
            step => Some(End::Arrived(step)),
        }
    }

    /// Ends its flight.
    pub(super) fn set_end(&self, end: End) {
        self.arrived.set(match end {
            End::Arrived(step) => step,
            End::Left(step) => step | LEFT,
        });
    }

    /// Steps of `dtau` since the run's start when it arrived, if it has.
    pub fn arrived_step(&self) -> Option<u64> {
        match self.end() {
            Some(End::Arrived(step)) => Some(step),
            _ => None,
        }
    }

    /// Whether it was removed before it arrived.
    pub fn has_left(&self) -> bool {
        matches!(self.end(), Some(End::Left(_)))
    }

    /// The stored fallback.
    pub fn side(&self) -> Side {
        Side::BOTH[usize::from(self.fallback.get() & 1)]
    }

    /// Whether it came in too close to another for the shield.
    pub fn came_too_close(&self) -> bool {
        self.fallback.get() & TOO_CLOSE != 0
    }

    /// Notes that it did.
    pub(super) fn set_too_close(&self) {
        self.fallback.set(self.fallback.get() | TOO_CLOSE);
    }

    /// Stores a fallback.
    pub fn set_side(&self, side: Side) {
        self.fallback.set(self.fallback.get() & TOO_CLOSE | side as u8);
    }
}

/// Who is near whom: lists of airplanes by square of the plane, built anew each cycle.
#[derive(Debug)]
pub(super) struct Neighborhood {
    side_m: f64,
    /// Per bucket: cycle (upper half) and last airplane listed (lower half).
    first: Box<[AtomicU64]>,
    /// Per airplane: the one listed before it.
    next: Column<u32>,
}

impl Neighborhood {
    /// For `n` airplanes that mind each other up to `side_m` away.
    fn new(n: usize, side_m: f64) -> Self {
        let buckets = (2 * n).next_power_of_two();
        Self {
            side_m,
            first: (0..buckets).map(|_| AtomicU64::new(u64::MAX)).collect(),
            next: Column::filled(n, NOBODY),
        }
    }

    fn square(&self, at: Point) -> [i64; 2] {
        at.map(|v| (v / self.side_m).floor() as i64)
    }

    fn bucket(&self, [x, y]: [i64; 2]) -> &AtomicU64 {
        let mixed = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        &self.first[(mixed >> 32) as usize & (self.first.len() - 1)]
    }

    /// Lists an airplane for this cycle.
    pub(super) fn enter(&self, slot: Slot, at: Point, now: Cycle) {
        let stamp = u64::from(now as u32) << 32;
        let before = self.bucket(self.square(at)).swap(stamp | u64::from(slot), Relaxed);
        let listed = before >> 32 == stamp >> 32;
        self.next.set(slot as usize, if listed { before as u32 } else { NOBODY });
    }

    /// Calls `meet` for every airplane listed in this cycle in the squares around `at`, and
    /// maybe for others.
    pub(super) fn around(&self, at: Point, now: Cycle, mut meet: impl FnMut(Slot)) {
        let [x, y] = self.square(at);
        for square in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy])) {
            let first = self.bucket(square).load(Relaxed);
            let mut slot = if first >> 32 == u64::from(now as u32) { first as u32 } else { NOBODY };
            while slot != NOBODY {
                meet(slot);
                slot = self.next.get(slot as usize);
            }
        }
    }
}

fn held(contacts: &Mutex<Contacts>) -> std::sync::MutexGuard<'_, Contacts> {
    contacts.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One airplane in a snapshot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AirplaneRecord {
    /// Its pose.
    pub pose: Pose,
    /// See [`Cell::arrived`].
    pub arrived: u64,
    /// Way-points done with, overrides, orbits, orbits in a row.
    pub counts: [u32; 4],
    /// Stored fallback.
    pub fallback: Side,
    /// Whether it came in too close to another for the shield.
    pub came_too_close: bool,
    /// Altitude.
    pub altitude_m: f64,
    /// Orders carried out, and times that one had to wait.
    pub orders: [u16; 2],
}

/// Looks at the distance of a pair in one step of `dtau`.
pub const LOOKS_PER_STEP: usize = 10;

/// What a pair of airplanes has come to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairRecord {
    /// Closest approach.
    pub nearest_m: f64,
    /// Looks at which they were nearer than their separation, see
    /// [`LOOKS_PER_STEP`].
    pub lost_looks: u64,
    /// Separate losses of separation.
    pub losses: u32,
}

impl PairRecord {
    /// Adds another record of the same pair, in any order.
    pub fn add(&mut self, other: Self) {
        self.nearest_m = self.nearest_m.min(other.nearest_m);
        self.lost_looks += other.lost_looks;
        self.losses += other.losses;
    }
}

/// A state by id: what a checkpoint holds and a digest covers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Cycles done.
    pub cycle: Cycle,
    /// The airplanes by id.
    pub airplanes: Vec<AirplaneRecord>,
    /// What each knows of others; empty where the network can be relied on.
    pub contacts: Vec<Contacts>,
}

impl AirspaceState {
    /// The state that a snapshot describes.
    pub(super) fn restore(world: &AirspaceWorld, snapshot: &Snapshot) -> Self {
        let n = snapshot.airplanes.len();
        let all = 0..n;
        let farthest = all.clone().map(|i| world.look_m(i, i)).fold(1.0, f64::max);
        let airplanes: Box<[Cell]> = all.map(|_| Cell::default()).collect();
        for (cell, record) in airplanes.iter().zip(&snapshot.airplanes) {
            cell.set_pose(record.pose);
            cell.arrived.set(record.arrived);
            let [next, overrides, orbits, orbiting] = record.counts;
            cell.next.set(next);
            cell.overrides.set(overrides);
            cell.orbits.set(orbits);
            cell.orbiting.set(orbiting);
            cell.set_side(record.fallback);
            if record.came_too_close {
                cell.set_too_close();
            }
            cell.altitude_m.set(record.altitude_m);
            let [orders, waits] = record.orders;
            cell.orders.set(orders);
            cell.waits.set(waits);
        }
        let contacts = match world.network {
            Some(_) => (0..n).map(|i| snapshot.contacts.get(i).cloned()).collect(),
            None => Vec::new(),
        };
        let contacts = contacts.into_iter().map(|c| Mutex::new(c.unwrap_or_default())).collect();
        Self { airplanes, neighborhood: Neighborhood::new(n, farthest), contacts }
    }

    /// Takes out what the airplanes of a group know of others. Groups share no airplane, so
    /// nobody else asks for the same.
    pub(super) fn take_contacts(&self, group: &[Slot]) -> Vec<Contacts> {
        let take =
            |&slot: &Slot| self.contacts.get(slot as usize).map(|c| std::mem::take(&mut *held(c)));
        group.iter().map(|slot| take(slot).unwrap_or_default()).collect()
    }

    /// Puts it back.
    pub(super) fn put_contacts(&self, group: &[Slot], known: Vec<Contacts>) {
        for (&slot, known) in group.iter().zip(known) {
            if let Some(contacts) = self.contacts.get(slot as usize) {
                *held(contacts) = known;
            }
        }
    }

    /// The state after `cycle` cycles.
    pub fn snapshot(&self, cycle: Cycle) -> Snapshot {
        let record = |cell: &Cell| AirplaneRecord {
            pose: cell.pose(),
            arrived: cell.arrived.get(),
            counts: [cell.next.get(), cell.overrides.get(), cell.orbits.get(), cell.orbiting.get()],
            fallback: cell.side(),
            came_too_close: cell.came_too_close(),
            altitude_m: cell.altitude_m.get(),
            orders: [cell.orders.get(), cell.waits.get()],
        };
        let contacts = self.contacts.iter().map(|contacts| held(contacts).clone()).collect();
        Snapshot { cycle, airplanes: self.airplanes.iter().map(record).collect(), contacts }
    }

    /// Whether an airplane is there in a cycle: it has appeared and has not arrived.
    pub(super) fn is_there(&self, world: &AirspaceWorld, slot: Slot, now: Cycle) -> bool {
        self.airplanes[slot as usize].is_flying() && world.appears_in(slot as usize) <= now
    }

    /// Returns the part of a flight that an airplane is on now.
    pub(super) fn stage<'a>(&self, world: &'a AirspaceWorld, slot: Slot) -> Stage<'a> {
        world.stage(slot, self.airplanes[slot as usize].orders.get().into())
    }
}

impl Snapshot {
    /// The digest of this state (promise D1): every value by id.
    pub fn digest(&self) -> Digest {
        let mut hasher = Hasher::default();
        hasher.u64(self.cycle);
        hasher.u64(self.airplanes.len() as u64);
        for airplane in &self.airplanes {
            let Pose { at: [x, y], heading_rad } = airplane.pose;
            [x, y, heading_rad].iter().for_each(|v| hasher.u64(v.to_bits()));
            hasher.u64(airplane.arrived);
            airplane.counts.iter().for_each(|&n| hasher.u32(n));
            let too_close = if airplane.came_too_close { TOO_CLOSE } else { 0 };
            hasher.u8(airplane.fallback as u8 | too_close);
            // Without orders the altitude is the scenario's, or that of the track at this time.
            let [orders, waits] = airplane.orders;
            if orders > 0 || waits > 0 {
                hasher.u64(airplane.altitude_m.to_bits());
                hasher.u32(u32::from(orders) << 16 | u32::from(waits));
            }
        }
        if !self.contacts.is_empty() {
            let known = postcard::to_stdvec(&self.contacts).expect("contacts are plain data");
            known.iter().for_each(|&byte| hasher.u8(byte));
        }
        hasher.finish()
    }
}
