//! The state of a run, and its snapshot.

mod command;
mod end;
mod hold;
mod neighborhood;
mod snapshot;
mod state_vectors;

use super::agents::traffic_state::TrafficPicture;
use super::baseline::mvp::ActiveResolutions;
use super::external_action::ExternalAction;
use super::flight::{InterOrderSegment, Pose2, Surface};
use super::measures::FlightEffort;
use super::method::MethodKind;
use super::pilot::{AirplaneControl, PilotMemory};
use super::shield::{ExemptIds, Fallback};
use super::surveillance::StateVectorHistory;
use super::world::AirspaceWorld;
pub use command::AirplaneCommand;
pub use end::{FlightEnd, PackedFlightEnd};
pub use hold::HoldState;
use neighborhood::SpatialIndex;
use sidestep_kernel::column::AtomicCell;
use sidestep_kernel::{Cycle, EntityId, EntitySlot, math};
pub use snapshot::{AirplaneSnapshot, PairRecord, Snapshot};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// The state of an airspace; slots are ids.
#[derive(Debug)]
pub struct AirspaceState {
    surface: Surface,
    /// The changing part of each airplane.
    pub airplanes: Box<[AirplaneState]>,
    pub(super) neighborhood: SpatialIndex,
    /// Each airplane's knowledge of others; empty where the network is reliable.
    contacts: Box<[Mutex<TrafficPicture>]>,
    /// The conflicts that each airplane resolves; empty unless the method is MVP.
    resolving: Box<[Mutex<ActiveResolutions>]>,
    /// The others with which each airplane is an exempt pair, see [`Self::exempt_pair`].
    exempt: Box<[Mutex<ExemptIds>]>,
    /// Each airplane's pose on its stored fallback; empty where no gust takes it off that.
    orbit_poses: Box<[OrbitPose]>,
    /// The turn rate of each airplane in the step that it flew last, in radians per second.
    turn_rates_rad_s: Box<[AtomicCell<f64>]>,
    /// What the flight of each airplane has cost; empty unless that is measured.
    efforts: Box<[Mutex<FlightEffort>]>,
    /// The holds of each airplane by the shield; empty where none can be held on its way to a level, and no altitude is
    /// known to be safe.
    holds: Box<[AtomicCell<HoldState>]>,
    /// The altitude in meters to which each airplane may change its level in this cycle. It is found anew in each cycle,
    /// and so no part of a snapshot.
    cleared_m: Box<[AtomicCell<f64>]>,
    /// What the method commands of each airplane; empty unless a method commands levels or speeds.
    commands: Box<[Mutex<AirplaneCommand>]>,
    /// The action that a caller has ordered for each airplane; empty unless callers decide.
    external_actions: Box<[Mutex<Option<ExternalAction>>]>,
    /// The past states of each airplane, which the reports of a cycle share; empty where all see all.
    state_vectors: Box<[Mutex<Arc<StateVectorHistory>>]>,
    /// The cycle for which controls were submitted, or [`NEVER`].
    controls_cycle: AtomicCell<u64>,
    /// The controls of that cycle, until their groups take them out.
    controls: Mutex<BTreeMap<EntityId, AirplaneControl>>,
}

/// Stands for no cycle.
const NEVER: Cycle = Cycle::MAX;

/// One airplane's share of the state.
#[derive(Debug, Default)]
// A cache line each, so that workers of different airplanes do not wait for each other.
#[repr(align(64))]
pub struct AirplaneState {
    /// Position east in meters, or longitude in radians.
    pub x: AtomicCell<f64>,
    /// Position north in meters, or latitude in radians.
    pub y: AtomicCell<f64>,
    /// Heading in radians, counterclockwise from east.
    pub heading_rad: AtomicCell<f64>,
    /// Altitude in meters.
    pub altitude_m: AtomicCell<f64>,
    /// The end of its flight, if it has ended.
    pub end: AtomicCell<PackedFlightEnd>,
    /// Number of way-points done with.
    pub next: AtomicCell<u32>,
    /// Number of times that the shield did not allow its preferred maneuver.
    pub overrides: AtomicCell<u32>,
    /// Number of those times when it fell back to its orbit.
    pub orbits: AtomicCell<u32>,
    /// Number of those times in a row up to now.
    pub orbiting: AtomicCell<u32>,
    /// Number of orders carried out.
    pub orders: AtomicCell<u16>,
    /// Number of times that an order had to wait for the next `dt`, or held a change of level.
    pub waits: AtomicCell<u16>,
    /// The stored fallback.
    pub fallback: AtomicCell<Fallback>,
    /// Whether all know the stored fallback who have watched its flight: 1, or else 0.
    pub tracked: AtomicCell<u16>,
}

/// A pose on an orbit, in cells, so that workers can store those of their groups at the same time.
#[derive(Debug, Default)]
struct OrbitPose {
    x: AtomicCell<f64>,
    y: AtomicCell<f64>,
    heading_rad: AtomicCell<f64>,
}

impl AirplaneState {
    /// Returns its pose; in a cycle only the worker of its group changes it.
    pub fn pose(&self) -> Pose2 {
        Pose2 { at: [self.x.get(), self.y.get()], heading_rad: self.heading_rad.get() }
    }

    /// Stores its pose, whose heading the caller has wrapped.
    pub fn set_pose(&self, pose: Pose2) {
        self.x.set(pose.at[0]);
        self.y.set(pose.at[1]);
        self.heading_rad.set(pose.heading_rad);
    }

    fn restore(&self, record: &AirplaneSnapshot) {
        self.set_pose(record.pose);
        self.end.set(record.ended);
        let [next, overrides, orbits, orbiting] = record.counts;
        self.next.set(next);
        self.overrides.set(overrides);
        self.orbits.set(orbits);
        self.orbiting.set(orbiting);
        self.fallback.set(record.fallback);
        self.tracked.set(record.is_tracked.into());
        self.altitude_m.set(record.altitude_m);
        let [orders, waits] = record.orders;
        self.orders.set(orders);
        self.waits.set(waits);
    }

    fn to_snapshot(&self, turn_rate_rad_s: f64) -> AirplaneSnapshot {
        AirplaneSnapshot {
            pose: self.pose(),
            ended: self.end.get(),
            counts: [self.next.get(), self.overrides.get(), self.orbits.get(), self.orbiting.get()],
            fallback: self.fallback.get(),
            is_tracked: self.tracked.get() > 0,
            altitude_m: self.altitude_m.get(),
            orders: [self.orders.get(), self.waits.get()],
            turn_rate_rad_s,
        }
    }

    /// Returns whether it has not arrived yet.
    pub fn is_unfinished(&self) -> bool {
        self.end.get() == PackedFlightEnd::NONE
    }

    /// Returns the end of its flight, if it has ended.
    pub fn end(&self) -> Option<FlightEnd> {
        self.end.get().unpack()
    }

    /// Stores the end of its flight.
    pub(super) fn set_end(&self, end: FlightEnd) {
        self.end.set(end.into());
    }

    /// Returns the steps of `dtau` since the run's start when it arrived, if it has.
    pub fn arrived_step(&self) -> Option<u64> {
        match self.end() {
            Some(FlightEnd::Arrived(step)) => Some(step),
            _ => None,
        }
    }

    /// Returns whether it was removed before it arrived.
    pub fn has_left(&self) -> bool {
        matches!(self.end(), Some(FlightEnd::Left(_)))
    }
}

fn lock<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes out the memories of the airplanes of a group; nothing where airplanes have no memory. No two groups share an
/// airplane, so no other worker asks for the same.
fn take<T: Default>(all: &[Mutex<T>], group: &[EntitySlot]) -> Vec<T> {
    group
        .iter()
        .map(|&slot| match all.get(slot as usize) {
            Some(memory) => std::mem::take(&mut *lock(memory)),
            None => T::default(),
        })
        .collect()
}

/// Puts back what [`take`] has taken out; nothing where airplanes have no memory.
fn put_memories<T>(all: &[Mutex<T>], group: &[EntitySlot], memories: Vec<T>) {
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
        let level_m = self.surface.distance_m(a.pose().at, b.pose().at);
        math::hypot(level_m, a.altitude_m.get() - b.altitude_m.get())
    }

    /// Returns the state that a snapshot describes; what is missing in it is empty.
    pub(super) fn restore(world: &AirspaceWorld, snapshot: &Snapshot) -> Self {
        let n = snapshot.airplanes.len();
        let ranges_m =
            world.all_rules().flat_map(|rules| (0..n).map(|i| rules.interaction_range_m(i, i)));
        let max_range_m = ranges_m.fold(1.0, f64::max);
        let airplanes: Box<[AirplaneState]> = (0..n).map(|_| AirplaneState::default()).collect();
        for (airplane, record) in airplanes.iter().zip(&snapshot.airplanes) {
            airplane.restore(record);
        }
        // What no airplane needs with these settings takes no memory, and is in no checkpoint.
        let with_contacts = if world.network.is_some() { n } else { 0 };
        let with_resolutions = if world.has_resolution_memory() { n } else { 0 };
        let has_gusts = world.shield && world.disturbance.heading_rad > 0.0;
        let with_orbit_poses = if has_gusts { n } else { 0 };
        let with_external_actions =
            if matches!(world.method, MethodKind::External) { n } else { 0 };
        let with_efforts = if world.measures.flights.is_some() { n } else { 0 };
        let with_commands = if world.has_commands() { n } else { 0 };
        let with_holds = if world.has_holds() { n } else { 0 };
        let with_state_vectors = if world.surveillance.is_some() { n } else { 0 };
        let controls_cycle = AtomicCell::default();
        controls_cycle.set(NEVER);
        let state = Self {
            surface: world.surface,
            airplanes,
            neighborhood: SpatialIndex::new(world.surface, n, max_range_m),
            contacts: restore_memories(with_contacts, &snapshot.contacts),
            resolving: restore_memories(with_resolutions, &snapshot.resolving),
            exempt: (0..n).map(|_| Mutex::default()).collect(),
            orbit_poses: (0..with_orbit_poses).map(|_| OrbitPose::default()).collect(),
            efforts: restore_memories(with_efforts, &snapshot.efforts),
            holds: (0..with_holds)
                .map(|i| AtomicCell::new(snapshot.holds.get(i).copied().unwrap_or_default()))
                .collect(),
            cleared_m: snapshot
                .airplanes
                .iter()
                .map(|record| AtomicCell::new(record.altitude_m))
                .collect(),
            turn_rates_rad_s: snapshot
                .airplanes
                .iter()
                .map(|record| AtomicCell::new(record.turn_rate_rad_s))
                .collect(),
            commands: restore_memories(with_commands, &snapshot.commands),
            external_actions: restore_memories(with_external_actions, &snapshot.external_actions),
            state_vectors: state_vectors::restore(with_state_vectors, &snapshot.state_vectors),
            controls_cycle,
            controls: Mutex::default(),
        };
        if let Some(controls) = &snapshot.controls {
            state.set_controls(snapshot.cycle, controls.clone());
        }
        for (i, record) in snapshot.airplanes.iter().enumerate() {
            // A snapshot without gusts has no orbit poses.
            let pose = snapshot.orbit_poses.get(i).copied().unwrap_or(record.pose);
            state.set_orbit_pose(i as EntitySlot, pose);
        }
        for &(a, b) in &snapshot.exempt {
            state.exempt_pair(a, b);
        }
        state
    }

    /// Returns the pose that an airplane has on its stored fallback, if no gust has taken it off that.
    pub(super) fn orbit_pose(&self, slot: EntitySlot) -> Pose2 {
        match self.orbit_poses.get(slot as usize) {
            Some(orbit_pose) => Pose2 {
                at: [orbit_pose.x.get(), orbit_pose.y.get()],
                heading_rad: orbit_pose.heading_rad.get(),
            },
            None => self.airplanes[slot as usize].pose(),
        }
    }

    /// Stores the pose that an airplane has on its fallback.
    pub(super) fn set_orbit_pose(&self, slot: EntitySlot, pose: Pose2) {
        if let Some(orbit_pose) = self.orbit_poses.get(slot as usize) {
            orbit_pose.x.set(pose.at[0]);
            orbit_pose.y.set(pose.at[1]);
            orbit_pose.heading_rad.set(pose.heading_rad);
        }
    }

    /// Replaces the part of an airplane, as its own process reports it.
    pub(super) fn replace_airplane(
        &self,
        slot: EntitySlot,
        record: &AirplaneSnapshot,
        orbit_pose: Pose2,
    ) {
        self.airplanes[slot as usize].restore(record);
        self.set_turn_rate_rad_s(slot, record.turn_rate_rad_s);
        self.set_orbit_pose(slot, orbit_pose);
    }

    /// Returns the part of an airplane.
    pub(super) fn airplane_snapshot(&self, slot: EntitySlot) -> AirplaneSnapshot {
        self.airplanes[slot as usize].to_snapshot(self.turn_rate_rad_s(slot))
    }

    /// Returns the others with which an airplane is an exempt pair.
    pub(super) fn exempt_ids(&self, slot: EntitySlot) -> ExemptIds {
        lock(&self.exempt[slot as usize]).clone()
    }

    /// Exempts two airplanes of a group: from now on the shield does not guarantee separation of this pair.
    pub(super) fn exempt_pair(&self, a: EntitySlot, b: EntitySlot) {
        for (one, other) in [(a, b), (b, a)] {
            let mut exempt = lock(&self.exempt[one as usize]);
            if let Err(place) = exempt.binary_search(&other) {
                let (before, after) = exempt.split_at(place);
                *exempt = before.iter().chain([&other]).chain(after).copied().collect();
            }
        }
    }

    /// Keeps only those exempt pairs of an airplane that are to stay.
    pub(super) fn retain_exempt(&self, slot: EntitySlot, stays: impl Fn(EntityId) -> bool) {
        let mut exempt = lock(&self.exempt[slot as usize]);
        *exempt = exempt.iter().copied().filter(|&other| stays(other)).collect();
    }

    /// Takes out the memories of the airplanes of a group.
    pub(super) fn take_memories(&self, group: &[EntitySlot]) -> Vec<PilotMemory> {
        let both = take(&self.contacts, group).into_iter().zip(take(&self.resolving, group));
        let each = both.zip(group);
        each.map(|((contacts, resolving), &slot)| PilotMemory {
            contacts,
            resolving,
            command: self.command(slot).wish,
        })
        .collect()
    }

    /// Puts back the memory of an airplane.
    pub(super) fn put_memory(
        &self,
        slot: EntitySlot,
        PilotMemory { contacts, resolving, command }: PilotMemory,
    ) {
        put_memories(&self.contacts, &[slot], vec![contacts]);
        put_memories(&self.resolving, &[slot], vec![resolving]);
        let in_force = self.command_in_force(slot);
        self.set_command(slot, AirplaneCommand { wish: command, in_force });
    }

    /// Returns the knowledge that an airplane has of others.
    pub(super) fn traffic_picture(&self, slot: EntitySlot) -> TrafficPicture {
        self.contacts.get(slot as usize).map(|all| lock(all).clone()).unwrap_or_default()
    }

    /// Stores the controls for a cycle of airplanes that have decided outside of the run.
    pub(super) fn set_controls(&self, cycle: Cycle, controls: Vec<AirplaneControl>) {
        *lock(&self.controls) = controls.into_iter().map(|one| (one.id, one)).collect();
        self.controls_cycle.set(cycle);
    }

    /// Returns whether controls were submitted for a cycle.
    pub(super) fn has_controls(&self, cycle: Cycle) -> bool {
        self.controls_cycle.get() == cycle
    }

    /// Takes out the controls that were submitted for the airplanes of a group.
    pub(super) fn take_controls(&self, group: &[EntitySlot]) -> Vec<Option<AirplaneControl>> {
        let mut controls = lock(&self.controls);
        group.iter().map(|slot| controls.remove(slot)).collect()
    }

    /// Returns the action that was ordered for an airplane, if there is one.
    pub(super) fn external_action(&self, slot: EntitySlot) -> Option<ExternalAction> {
        self.external_actions.get(slot as usize).and_then(|action| lock(action).clone())
    }

    /// Drops the actions that were ordered for the airplanes of a group: they have decided.
    pub(super) fn drop_external_actions(&self, group: &[EntitySlot]) {
        take(&self.external_actions, group);
    }

    /// Stores the action that was ordered for an airplane, in place of any other.
    pub(super) fn set_external_action(&self, slot: EntitySlot, action: ExternalAction) {
        put_memories(&self.external_actions, &[slot], vec![Some(action)]);
    }

    /// Returns the turn rate of an airplane in the step that it flew last, in radians per second.
    pub(super) fn turn_rate_rad_s(&self, slot: EntitySlot) -> f64 {
        self.turn_rates_rad_s[slot as usize].get()
    }

    /// Stores the turn rate of the step that an airplane flew last.
    pub(super) fn set_turn_rate_rad_s(&self, slot: EntitySlot, omega_rad_s: f64) {
        self.turn_rates_rad_s[slot as usize].set(omega_rad_s);
    }

    /// Returns what the flight of an airplane has cost; nothing where that is not measured.
    pub(super) fn effort(&self, slot: EntitySlot) -> Option<FlightEffort> {
        self.efforts.get(slot as usize).map(|effort| *lock(effort))
    }

    /// Stores what the flight of an airplane has cost.
    pub(super) fn set_effort(&self, slot: EntitySlot, effort: FlightEffort) {
        put_memories(&self.efforts, &[slot], vec![effort]);
    }

    /// Returns the holds of an airplane; nothing where none can be held.
    pub(super) fn hold(&self, slot: EntitySlot) -> Option<HoldState> {
        self.holds.get(slot as usize).map(AtomicCell::get)
    }

    /// Stores the holds of an airplane; nothing where none can be held.
    pub(super) fn set_hold(&self, slot: EntitySlot, hold: HoldState) {
        if let Some(one) = self.holds.get(slot as usize) {
            one.set(hold);
        }
    }

    /// Returns the present state, which is that after `cycle` cycles: the state itself does not count them.
    pub fn snapshot(&self, cycle: Cycle) -> Snapshot {
        let mut exempt = Vec::new();
        for (a, others) in (0..).zip(&self.exempt) {
            exempt.extend(lock(others).iter().filter(|b| **b > a).map(|b| (a, *b)));
        }
        let controls =
            self.has_controls(cycle).then(|| lock(&self.controls).values().cloned().collect());
        let orbits = 0..self.orbit_poses.len() as EntitySlot;
        Snapshot {
            cycle,
            airplanes: self
                .airplanes
                .iter()
                .zip(&self.turn_rates_rad_s)
                .map(|(airplane, turn_rate_rad_s)| airplane.to_snapshot(turn_rate_rad_s.get()))
                .collect(),
            contacts: self.contacts.iter().map(|one| lock(one).clone()).collect(),
            resolving: self.resolving.iter().map(|one| lock(one).clone()).collect(),
            exempt,
            orbit_poses: orbits.map(|slot| self.orbit_pose(slot)).collect(),
            commands: self.commands.iter().map(|one| *lock(one)).collect(),
            external_actions: self.external_actions.iter().map(|one| lock(one).clone()).collect(),
            controls,
            efforts: self.efforts.iter().map(|one| *lock(one)).collect(),
            holds: self.holds.iter().map(AtomicCell::get).collect(),
            state_vectors: self.all_state_vectors(),
        }
    }

    /// Returns whether an airplane is there in a cycle: it has appeared and has not arrived.
    pub(super) fn is_active(&self, world: &AirspaceWorld, slot: EntitySlot, now: Cycle) -> bool {
        self.airplanes[slot as usize].is_unfinished()
            && world.appearance_cycle(slot as usize) <= now
    }

    /// Returns the part of a flight that an airplane is on now.
    pub(super) fn segment<'a>(
        &self,
        world: &'a AirspaceWorld,
        slot: EntitySlot,
    ) -> InterOrderSegment<'a> {
        let orders = self.airplanes[slot as usize].orders.get().into();
        world.flown_segment(slot, orders, &self.command_in_force(slot))
    }

    /// Returns the same, with the altitude to which it may change its level in this cycle.
    pub(super) fn cleared_segment<'a>(
        &self,
        world: &'a AirspaceWorld,
        slot: EntitySlot,
    ) -> InterOrderSegment<'a> {
        let altitude_m = self.cleared_m[slot as usize].get();
        InterOrderSegment { altitude_m, ..self.segment(world, slot) }
    }

    /// Stores the altitude to which an airplane may change its level in this cycle.
    pub(super) fn clear_to(&self, slot: EntitySlot, altitude_m: f64) {
        self.cleared_m[slot as usize].set(altitude_m);
    }
}
