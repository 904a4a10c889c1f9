//! The changing state of a run.

mod body;
mod snapshot;

pub use body::ChainBodyState;
pub(crate) use body::{
    MissingNeighbors, MotionPlan, ScatteredPartState, Standstill, flatten, unflatten,
};
pub(crate) use snapshot::Snapshot;

use super::metrics::ChainTally;
use super::neighbors::ClaimIndex;
use super::swarm::leader::LeaderDecision;
use super::world::ChainWorld;
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::{Cycle, EntityId, EntitySlot, InputError};
use sidestep_rods::geometry::{Aabb, Point};
use sidestep_rods::{SpatialGrid, bounds_around};
use snapshot::{SnapshotComponent, SnapshotComponentRecords};
use std::ops::Deref;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Number of chains up to which checking each takes no longer than searching a grid of them.
const MAX_LINEAR_SCAN: usize = 16;
/// Margin for rounding between boxes and distances, meters.
const ROUNDING_M: f64 = 1e-6;

/// State of a world of chains; slots are ids.
#[derive(Debug)]
pub struct ChainWorldState<const D: usize> {
    cells: Box<[ChainStateCell<D>]>,
    /// Number of claims ever made, by which workers see whether sorted claims are out of date.
    claims: AtomicU64,
    /// The claims of this cycle, sorted by the first worker that needs them.
    neighbors: RwLock<ClaimIndex<D>>,
    /// Whether some body may have changed since the boxes below were made.
    has_changed: AtomicBool,
    /// The boxes around the solid parts of all chains in the plane, made by the first worker that needs them.
    crowd: RwLock<SpatialGrid<2>>,
}

/// One chain's share of the state. No worker ever waits for one of its locks: in the first phase all workers
/// only read the bodies, and in the last phase only the one worker that has a group writes its bodies.
#[derive(Debug)]
struct ChainStateCell<const D: usize> {
    body: RwLock<ChainBodyState<D>>,
    /// The box that the chain may enter during this cycle.
    claim: Mutex<Aabb<D>>,
    /// Decision of its navigator in this cycle.
    decision: Mutex<Option<LeaderDecision>>,
}

impl<const D: usize> ChainStateCell<D> {
    fn new(body: ChainBodyState<D>) -> Self {
        Self {
            body: RwLock::new(body),
            claim: Mutex::new(Aabb::empty()),
            decision: Mutex::new(None),
        }
    }
}

/// One chain as it is read: locked against changes or, while it has motions to follow, a copy that has followed them.
#[derive(Debug)]
pub enum ChainBodyStateRef<'a, const D: usize> {
    /// The chain itself.
    Locked(RwLockReadGuard<'a, ChainBodyState<D>>),
    /// A copy, after the motions that the chain has yet to follow.
    Followed(Box<ChainBodyState<D>>),
}

impl<const D: usize> Deref for ChainBodyStateRef<'_, D> {
    type Target = ChainBodyState<D>;

    fn deref(&self) -> &ChainBodyState<D> {
        match self {
            Self::Locked(body) => body,
            Self::Followed(body) => body,
        }
    }
}

impl<const D: usize> ChainWorldState<D> {
    fn from_bodies(bodies: impl Iterator<Item = ChainBodyState<D>>) -> Self {
        Self {
            cells: bodies.map(ChainStateCell::new).collect(),
            claims: AtomicU64::new(0),
            neighbors: RwLock::default(),
            has_changed: AtomicBool::new(true),
            crowd: RwLock::default(),
        }
    }

    /// Returns the state at the start.
    ///
    /// # Errors
    /// When a script contains no motions.
    pub fn new(world: &ChainWorld<D>) -> Result<Self, InputError> {
        let bodies = world.chains.iter().map(ChainBodyState::new).collect::<Result<Vec<_>, _>>()?;
        Ok(Self::from_bodies(bodies.into_iter()))
    }

    /// Returns the state that a snapshot describes.
    ///
    /// # Errors
    /// When the snapshot belongs to other chains.
    pub(crate) fn restore(
        world: &ChainWorld<D>,
        snapshot: &Snapshot,
        tallies: Vec<ChainTally>,
    ) -> Result<Self, CheckpointError> {
        if snapshot.chains.len() != world.chains.len() || tallies.len() != world.chains.len() {
            return Err(CheckpointError::Damaged);
        }
        let all = world.chains.iter().zip(&snapshot.chains).zip(tallies);
        let bodies = all.map(|((spec, record), tally)| {
            ChainBodyState::restore(spec, record, tally, snapshot.cycle)
        });
        let mut bodies = bodies.collect::<Result<Vec<_>, _>>()?;
        snapshot.restore_components(&mut bodies)?;
        Ok(Self::from_bodies(bodies.into_iter()))
    }

    /// Returns a copy on which a cycle can be tried.
    pub(crate) fn trial_copy(&self) -> Self {
        Self::from_bodies((0..self.len()).map(|slot| self.body(slot).clone()))
    }

    /// Returns the number of chains; slots are less than it.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Returns one chain, for reading: it is as if it had followed its deferred motions, and keeps them.
    pub fn body(&self, slot: usize) -> ChainBodyStateRef<'_, D> {
        let body = self.body_before_deferred_motions(slot);
        if body.deferred.is_empty() {
            return ChainBodyStateRef::Locked(body);
        }
        let mut followed = Box::new(body.clone());
        followed.apply_deferred_motions();
        ChainBodyStateRef::Followed(followed)
    }

    /// Lets all chains follow their deferred motions. A caller that reads them in each cycle does this first,
    /// because otherwise each read makes a copy that follows them.
    pub(crate) fn apply_deferred_motions(&self) {
        for slot in 0..self.len() {
            if !self.body_before_deferred_motions(slot).deferred.is_empty() {
                self.body_mut(slot).apply_deferred_motions();
            }
        }
    }

    /// Locks one chain for reading as it is: all connectors except the initiator may have motions still to follow.
    pub(crate) fn body_before_deferred_motions(
        &self,
        slot: usize,
    ) -> RwLockReadGuard<'_, ChainBodyState<D>> {
        self.cells[slot].body.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns whether the decisions of a chain's agents for a cycle were submitted, and are not carried out yet.
    pub fn has_submitted_controls(&self, slot: usize, cycle: Cycle) -> bool {
        let body = self.body_before_deferred_motions(slot);
        body.submitted.as_ref().is_some_and(|submitted| submitted.cycle == cycle)
    }

    /// Locks one chain for writing; the grid of solid parts is then out of date.
    pub(crate) fn body_mut(&self, slot: usize) -> RwLockWriteGuard<'_, ChainBodyState<D>> {
        // Reading first: if every worker wrote the flag, its cache line would move between them in each cycle.
        if !self.has_changed.load(Relaxed) {
            self.has_changed.store(true, Relaxed);
        }
        self.cells[slot].body.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the box that a chain has claimed for this cycle.
    pub(crate) fn claim(&self, slot: usize) -> Aabb<D> {
        *self.cells[slot].claim.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the claims by their lower ends; valid while no chain claims anything.
    pub(crate) fn sorted_claims(&self) -> RwLockReadGuard<'_, ClaimIndex<D>> {
        let made = self.claims.load(Relaxed);
        refresh_if_stale(
            &self.neighbors,
            |neighbors| neighbors.is_current(made),
            |neighbors| neighbors.sort(made, (0..self.len()).map(|slot| self.claim(slot))),
        )
    }

    /// Lists, in order, all chains with a solid part within a distance of a point, and perhaps some others nearby;
    /// valid while no body changes.
    pub(crate) fn list_near(&self, at: Point<2>, range_m: f64, slots: &mut Vec<EntitySlot>) {
        slots.clear();
        if self.len() <= MAX_LINEAR_SCAN {
            return slots.extend(0..self.len() as EntitySlot);
        }
        let crowd = refresh_if_stale(
            &self.crowd,
            |_| !self.has_changed.load(Relaxed),
            |crowd| {
                let boxes = (0..self.len()).map(|slot| self.body(slot).solid_bounds());
                crowd.rebuild(boxes, range_m);
                self.has_changed.store(false, Relaxed);
            },
        );
        crowd.visit(&bounds_around(at, range_m).grown(ROUNDING_M), |slot| {
            slots.push(slot as EntitySlot)
        });
        slots.sort_unstable();
    }

    pub(crate) fn set_claim(&self, slot: usize, claim: Aabb<D>) {
        // Relaxed: the barrier between two phases orders this before all readers.
        self.claims.fetch_add(1, Relaxed);
        *self.cells[slot].claim.lock().unwrap_or_else(PoisonError::into_inner) = claim;
    }

    /// Returns what a chain's navigator has decided in this cycle; none where none leads.
    pub(crate) fn decision(&self, slot: usize) -> Option<LeaderDecision> {
        *self.cells[slot].decision.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn set_decision(&self, slot: usize, decision: Option<LeaderDecision>) {
        *self.cells[slot].decision.lock().unwrap_or_else(PoisonError::into_inner) = decision;
    }

    /// Returns all that the rest of a run depends on, after `cycle` cycles.
    pub fn snapshot(&self, cycle: Cycle) -> Snapshot {
        let bodies = 0..self.len();
        Snapshot {
            cycle,
            chains: bodies.map(|slot| self.body(slot).record()).collect(),
            joints: self.save_component(cycle, |body| &body.joints),
            motions: self.save_component(cycle, |body| &body.motion),
            plans: self.save_component(cycle, |body| &body.plan),
            escape_plans: self.save_component(cycle, |body| &body.escape_plan),
            standstills: self.save_component(cycle, |body| &body.standstill),
            gathering: self.save_component(cycle, |body| &body.scattered),
            externals: self.save_component(cycle, |body| &body.external),
            missing: self.save_component(cycle, |body| &body.missing),
            submitted: self.save_component(cycle, |body| &body.submitted),
            driver_memories: self.save_component(cycle, |body| &body.driver_memory),
        }
    }

    /// Returns the records of those chains where there is something to save, by slot.
    fn save_component<C: SnapshotComponent>(
        &self,
        cycle: Cycle,
        component: fn(&ChainBodyState<D>) -> &C,
    ) -> SnapshotComponentRecords<C::Record> {
        let mut records = Vec::new();
        for slot in 0..self.len() {
            // Deferred motions change places and sums, and no component.
            // Deferred motions change the chain alone, no component, so the body is not copied to follow them.
            if let Some(record) = component(&self.body_before_deferred_motions(slot)).save(cycle) {
                records.push((slot as EntityId, record));
            }
        }
        records
    }

    /// Returns the counts of each chain so far.
    pub(crate) fn tallies(&self) -> Vec<ChainTally> {
        (0..self.len()).map(|slot| self.body(slot).tally.clone()).collect()
    }
}

/// Returns the content of a lock, renewed by the first worker that needs it if it is out of date.
fn refresh_if_stale<T>(
    lock: &RwLock<T>,
    is_current: impl Fn(&T) -> bool,
    renew: impl FnOnce(&mut T),
) -> RwLockReadGuard<'_, T> {
    let known = lock.read().unwrap_or_else(PoisonError::into_inner);
    if is_current(&known) {
        return known;
    }
    drop(known);
    let mut content = lock.write().unwrap_or_else(PoisonError::into_inner);
    // Another worker may have renewed it while this one waited for the lock.
    if !is_current(&content) {
        renew(&mut content);
    }
    drop(content);
    lock.read().unwrap_or_else(PoisonError::into_inner)
}
