//! The state of a run, and its snapshot.

mod end;
mod neighborhood;
mod snapshot;

use super::agents::traffic_state::TrafficPicture;
use super::baseline::mvp::ActiveResolutions;
use super::external_action::ExternalAction;
use super::flight::{FlightSegment, Pose2};
use super::pilot::{Control, Memory};
use super::settings::Method;
use super::shield::{ExemptIds, Side};
use super::world::AirspaceWorld;
pub use end::{End, PackedEnd};
use neighborhood::Neighborhood;
use sidestep_kernel::column::AtomicCell;
use sidestep_kernel::{Cycle, EntityId, Slot, math};
pub use snapshot::{AirplaneRecord, PairRecord, Snapshot};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// The state of an airspace; slots are ids.
#[derive(Debug)]
pub struct AirspaceState {
    /// The changing part of each airplane.
    pub airplanes: Box<[AirplaneState]>,
    pub(super) neighborhood: Neighborhood,
    /// Each airplane's knowledge of others; empty where the network is reliable.
    contacts: Box<[Mutex<TrafficPicture>]>,
    /// The conflicts that each airplane resolves; empty unless the method is MVP.
    resolving: Box<[Mutex<ActiveResolutions>]>,
    /// The others with which each airplane is named, see [`Self::exempt_pair`].
    exempt: Box<[Mutex<ExemptIds>]>,
    /// Each airplane's pose on its stored orbit; empty where no gust takes it off that.
    orbit_poses: Box<[OrbitPose]>,
    /// The turn rate of each airplane in the step that it flew last, in radians per second.
    turn_rates_rad_s: Box<[AtomicCell<f64>]>,
    /// The wish that was ordered for each airplane; empty unless airplanes are decided from outside.
    wishes: Box<[Mutex<Option<ExternalAction>>]>,
    /// The cycle for which controls were handed over, or [`NEVER`].
    controls_cycle: AtomicCell<u64>,
    /// These controls.
    controls: Mutex<BTreeMap<EntityId, Control>>,
}

/// Stands for no cycle.
const NEVER: Cycle = Cycle::MAX;

/// One airplane's share of the state.
#[derive(Debug, Default)]
#[repr(align(64))]
pub struct AirplaneState {
    /// Position east, in meters.
    pub x_m: AtomicCell<f64>,
    /// Position north, in meters.
    pub y_m: AtomicCell<f64>,
    /// Heading in radians, counterclockwise from east.
    pub heading_rad: AtomicCell<f64>,
    /// Altitude in meters.
    pub altitude_m: AtomicCell<f64>,
    /// The end of its flight, if it has ended.
    pub end: AtomicCell<PackedEnd>,
    /// Number of way-points done with.
    pub next: AtomicCell<u32>,
    /// Number of times that the shield changed its wish.
    pub overrides: AtomicCell<u32>,
    /// Number of those times when it fell back to its orbit.
    pub orbits: AtomicCell<u32>,
    /// Number of those times in a row up to now.
    pub orbiting: AtomicCell<u32>,
    /// Number of orders carried out.
    pub orders: AtomicCell<u16>,
    /// Number of times that an order had to wait for the next `dt`.
    pub waits: AtomicCell<u16>,
    /// Side of the stored fallback.
    pub fallback: AtomicCell<Side>,
}

/// A pose on an orbit.
#[derive(Debug, Default)]
struct OrbitPose {
    x_m: AtomicCell<f64>,
    y_m: AtomicCell<f64>,
    heading_rad: AtomicCell<f64>,
}

impl AirplaneState {
    /// Returns its pose.
    pub fn pose(&self) -> Pose2 {
        Pose2 { at: [self.x_m.get(), self.y_m.get()], heading_rad: self.heading_rad.get() }
    }

    /// Sets its pose.
    pub fn set_pose(&self, pose: Pose2) {
        self.x_m.set(pose.at[0]);
        self.y_m.set(pose.at[1]);
        self.heading_rad.set(pose.heading_rad);
    }

    fn restore(&self, record: &AirplaneRecord) {
        self.set_pose(record.pose);
        self.end.set(record.ended);
        let [next, overrides, orbits, orbiting] = record.counts;
        self.next.set(next);
        self.overrides.set(overrides);
        self.orbits.set(orbits);
        self.orbiting.set(orbiting);
        self.fallback.set(record.fallback);
        self.altitude_m.set(record.altitude_m);
        let [orders, waits] = record.orders;
        self.orders.set(orders);
        self.waits.set(waits);
    }

    /// Returns whether it has not arrived yet.
    pub fn is_flying(&self) -> bool {
        self.end.get() == PackedEnd::NONE
    }

    /// Returns the end of its flight, if it has ended.
    pub fn end(&self) -> Option<End> {
        self.end.get().get()
    }

    /// Stores the end of its flight.
    pub(super) fn set_end(&self, end: End) {
        self.end.set(end.into());
    }

    /// Returns the steps of `dtau` since the run's start when it arrived, if it has.
    pub fn arrived_step(&self) -> Option<u64> {
        match self.end() {
            Some(End::Arrived(step)) => Some(step),
            _ => None,
        }
    }

    /// Returns whether it was removed before it arrived.
    pub fn has_left(&self) -> bool {
        matches!(self.end(), Some(End::Left(_)))
    }
}

fn lock<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes out the memories of the airplanes of a group; nothing where airplanes have no memory. No two groups share an
/// airplane, so no other worker asks for the same.
fn take<T: Default>(all: &[Mutex<T>], group: &[Slot]) -> Vec<T> {
    let one = |&slot: &Slot| all.get(slot as usize).map(|one| std::mem::take(&mut *lock(one)));
    group.iter().map(|slot| one(slot).unwrap_or_default()).collect()
}

/// Puts memories back.
fn put<T>(all: &[Mutex<T>], group: &[Slot], memories: Vec<T>) {
    for (&slot, memory) in group.iter().zip(memories) {
        if let Some(one) = all.get(slot as usize) {
            *lock(one) = memory;
        }
    }
}

/// Returns the memories of `n` airplanes from a snapshot, which may have fewer.
fn restore_memories<T: Clone + Default>(n: usize, saved: &[T]) -> Box<[Mutex<T>]> {
    (0..n).map(|i| Mutex::new(saved.get(i).cloned().unwrap_or_default())).collect()
}

impl AirspaceState {
    /// Returns the distance between two airplanes in meters, heights included.
    pub(crate) fn distance_m(&self, [a, b]: [EntityId; 2]) -> f64 {
        let [a, b] = [a, b].map(|id| &self.airplanes[id as usize]);
        let ([ax, ay], [bx, by]) = (a.pose().at, b.pose().at);
        let level_m = math::hypot(ax - bx, ay - by);
        math::hypot(level_m, a.altitude_m.get() - b.altitude_m.get())
    }

    /// Returns the state that a snapshot describes.
    pub(super) fn restore(world: &AirspaceWorld, snapshot: &Snapshot) -> Self {
        let n = snapshot.airplanes.len();
        let all = 0..n;
        let farthest = all.clone().map(|i| world.interaction_range_m(i, i)).fold(1.0, f64::max);
        let airplanes: Box<[AirplaneState]> = all.map(|_| AirplaneState::default()).collect();
        for (cell, record) in airplanes.iter().zip(&snapshot.airplanes) {
            cell.restore(record);
        }
        let contacts =
            restore_memories(world.network.as_ref().map_or(0, |_| n), &snapshot.contacts);
        let is_mvp = world.method == Method::Mvp;
        let resolving = restore_memories(if is_mvp { n } else { 0 }, &snapshot.resolving);
        let neighborhood = Neighborhood::new(n, farthest);
        let named = (0..n).map(|_| Mutex::default()).collect();
        let gusts = world.shield && world.disturbance.heading_rad > 0.0;
        let held = (0..if gusts { n } else { 0 }).map(|_| OrbitPose::default()).collect();
        let turn_rates_rad_s = snapshot
            .airplanes
            .iter()
            .map(|record| AtomicCell::new(record.turn_rate_rad_s))
            .collect();
        let is_external = world.method == Method::External;
        let wishes = restore_memories(if is_external { n } else { 0 }, &snapshot.wishes);
        let (handed_for, handed) = (AtomicCell::default(), Mutex::default());
        handed_for.set(NEVER);
        let state = Self {
            airplanes,
            neighborhood,
            contacts,
            resolving,
            exempt: named,
            orbit_poses: held,
            turn_rates_rad_s,
            wishes,
            controls_cycle: handed_for,
            controls: handed,
        };
        if let Some(handed) = &snapshot.handed {
            state.set_controls(snapshot.cycle, handed.clone());
        }
        let held = snapshot.held.iter().copied();
        let held = held.chain(snapshot.airplanes.iter().skip(snapshot.held.len()).map(|a| a.pose));
        (0..).zip(held).for_each(|(slot, pose)| state.set_orbit_pose(slot, pose));
        snapshot.named.iter().for_each(|&(a, b)| state.exempt_pair(a, b));
        state
    }

    /// Returns the pose that an airplane has on its stored orbit, if no gust has taken it off that.
    pub(super) fn orbit_pose(&self, slot: Slot) -> Pose2 {
        let on_orbit = |held: &OrbitPose| Pose2 {
            at: [held.x_m.get(), held.y_m.get()],
            heading_rad: held.heading_rad.get(),
        };
        let there = || self.airplanes[slot as usize].pose();
        self.orbit_poses.get(slot as usize).map_or_else(there, on_orbit)
    }

    /// Stores the pose that an airplane has on its orbit.
    pub(super) fn set_orbit_pose(&self, slot: Slot, pose: Pose2) {
        if let Some(held) = self.orbit_poses.get(slot as usize) {
            held.x_m.set(pose.at[0]);
            held.y_m.set(pose.at[1]);
            held.heading_rad.set(pose.heading_rad);
        }
    }

    /// Returns the others with which an airplane is named.
    pub(super) fn exempt_with(&self, slot: Slot) -> ExemptIds {
        lock(&self.exempt[slot as usize]).clone()
    }

    /// Names two airplanes of a group: from now on the shield promises nothing for this pair.
    pub(super) fn exempt_pair(&self, a: Slot, b: Slot) {
        for (one, other) in [(a, b), (b, a)] {
            let mut named = lock(&self.exempt[one as usize]);
            if let Err(place) = named.binary_search(&other) {
                let (before, after) = named.split_at(place);
                *named = before.iter().chain([&other]).chain(after).copied().collect();
            }
        }
    }

    /// Keeps only those others with which an airplane is to stay named.
    pub(super) fn retain_exempt(&self, slot: Slot, stays: impl Fn(EntityId) -> bool) {
        let mut named = lock(&self.exempt[slot as usize]);
        *named = named.iter().copied().filter(|&other| stays(other)).collect();
    }

    /// Takes out the memories of the airplanes of a group.
    pub(super) fn take_memories(&self, group: &[Slot]) -> Vec<Memory> {
        let both = take(&self.contacts, group).into_iter().zip(take(&self.resolving, group));
        both.map(|(contacts, resolving)| Memory { contacts, resolving }).collect()
    }

    /// Puts back the memory of an airplane.
    pub(super) fn put_memory(&self, slot: Slot, Memory { contacts, resolving }: Memory) {
        put(&self.contacts, &[slot], vec![contacts]);
        put(&self.resolving, &[slot], vec![resolving]);
    }

    /// Returns the knowledge that an airplane has of others.
    pub(super) fn traffic_picture(&self, slot: Slot) -> TrafficPicture {
        self.contacts.get(slot as usize).map(|all| lock(all).clone()).unwrap_or_default()
    }

    /// Stores the controls for a cycle of airplanes that have decided outside of the run.
    pub(super) fn set_controls(&self, cycle: Cycle, controls: Vec<Control>) {
        *lock(&self.controls) = controls.into_iter().map(|one| (one.id, one)).collect();
        self.controls_cycle.set(cycle);
    }

    /// Returns whether controls were handed over for a cycle.
    pub(super) fn has_controls(&self, cycle: Cycle) -> bool {
        self.controls_cycle.get() == cycle
    }

    /// Takes out the controls that were handed over for the airplanes of a group.
    pub(super) fn take_controls(&self, group: &[Slot]) -> Vec<Option<Control>> {
        let mut handed = lock(&self.controls);
        group.iter().map(|slot| handed.remove(slot)).collect()
    }

    /// Returns the wish that was ordered for an airplane, if there is one.
    pub(super) fn external_action(&self, slot: Slot) -> Option<ExternalAction> {
        self.wishes.get(slot as usize).and_then(|wish| lock(wish).clone())
    }

    /// Drops the wishes that were ordered for the airplanes of a group: they have decided.
    pub(super) fn drop_external_actions(&self, group: &[Slot]) {
        take(&self.wishes, group);
    }

    /// Stores the wish that was ordered for an airplane, in place of any other.
    pub(super) fn set_external_action(&self, slot: Slot, wish: ExternalAction) {
        put(&self.wishes, &[slot], vec![Some(wish)]);
    }

    /// Returns the turn rate of an airplane in the step that it flew last, in radians per second.
    pub(super) fn turn_rate_rad_s(&self, slot: Slot) -> f64 {
        self.turn_rates_rad_s[slot as usize].get()
    }

    /// Stores the turn rate of the step that an airplane flew last.
    pub(super) fn set_turn_rate_rad_s(&self, slot: Slot, omega_rad_s: f64) {
        self.turn_rates_rad_s[slot as usize].set(omega_rad_s);
    }

    /// Returns the state after `cycle` cycles.
    pub fn snapshot(&self, cycle: Cycle) -> Snapshot {
        let record = |(cell, turn_rate): (&AirplaneState, &AtomicCell<f64>)| AirplaneRecord {
            pose: cell.pose(),
            ended: cell.end.get(),
            counts: [cell.next.get(), cell.overrides.get(), cell.orbits.get(), cell.orbiting.get()],
            fallback: cell.fallback.get(),
            altitude_m: cell.altitude_m.get(),
            orders: [cell.orders.get(), cell.waits.get()],
            turn_rate_rad_s: turn_rate.get(),
        };
        let resolving = self.resolving.iter().map(|resolving| lock(resolving).clone()).collect();
        let contacts = self.contacts.iter().map(|contacts| lock(contacts).clone()).collect();
        let named = (0..).zip(&self.exempt).flat_map(|(a, others)| {
            let others = lock(others).clone();
            let pairs: Vec<_> = others.iter().filter(|b| **b > a).map(|b| (a, *b)).collect();
            pairs
        });
        let named = named.collect();
        let wishes = self.wishes.iter().map(|wish| lock(wish).clone()).collect();
        let handed = || lock(&self.controls).values().cloned().collect();
        let handed = self.has_controls(cycle).then(handed);
        let held = (0..self.orbit_poses.len() as Slot).map(|slot| self.orbit_pose(slot)).collect();
        let airplanes = self.airplanes.iter().zip(&self.turn_rates_rad_s).map(record).collect();
        Snapshot { cycle, airplanes, contacts, resolving, named, held, wishes, handed }
    }

    /// Returns whether an airplane is there in a cycle: it has appeared and has not arrived.
    pub(super) fn is_active(&self, world: &AirspaceWorld, slot: Slot, now: Cycle) -> bool {
        self.airplanes[slot as usize].is_flying() && world.first_cycle(slot as usize) <= now
    }

    /// Returns the part of a flight that an airplane is on now.
    pub(super) fn segment<'a>(&self, world: &'a AirspaceWorld, slot: Slot) -> FlightSegment<'a> {
        world.segment(slot, self.airplanes[slot as usize].orders.get().into())
    }
}
