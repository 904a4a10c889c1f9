//! Snapshots: the content of checkpoints, covered by the digest.
//!
//! Each chain has a [`ChainRecord`]. What only some chains have is a [`SnapshotComponent`]: it saves itself to a list
//! of its own, by id, of the chains where there is something to save.

use super::body::{
    ChainBodyState, MissingNeighbors, MotionPlan, ScatteredPartState, Standstill, flatten,
    unflatten,
};
use crate::agents::chain_controls::ChainCycleControls;
use crate::driver::TaskProgress;
use crate::driver::external::ExternalControlState;
use crate::driver::own_driver::DriverMemory;
use crate::formation::Robot;
use crate::metrics::ChainTally;
use crate::motion::escape::EscapePlan;
use crate::world::ChainSpec;
use serde::{Deserialize, Serialize};
use sidestep_arms::motion::MotionState;
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::{Cycle, Digest, EntityId};

/// Records of one component, by chain.
pub(crate) type SnapshotComponentRecords<T> = Vec<(EntityId, T)>;

/// A part of a body that a snapshot lists only for chains where it is not in its initial state.
pub(super) trait SnapshotComponent {
    /// Its serialized form.
    type Record;

    /// Returns its record after `cycle` cycles; none where there is nothing to save.
    fn save(&self, cycle: Cycle) -> Option<Self::Record>;

    /// Restores it on a body that is otherwise at its start.
    ///
    /// # Errors
    /// When the record belongs to another chain.
    fn restore(
        &mut self,
        record: &Self::Record,
        owner: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError>;
}

/// The chain to which a component belongs.
pub(super) struct ExpectedChainSizes {
    /// Cycles done.
    cycle: Cycle,
    /// Number of its connectors; records with higher numbers are damaged.
    connectors: usize,
    /// Number of all their coordinates: the length of a posture of rods.
    coordinates: usize,
    /// Number of its joints, if it represents an arm.
    joints: Option<usize>,
}

/// What a snapshot has of every chain; the rest is in lists of those that have it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChainRecord {
    /// Positions of the connectors, coordinate after coordinate.
    pub points_m: Vec<f64>,
    /// See [`ChainBodyState::driving`].
    pub driving: TaskProgress,
    /// See [`ChainBodyState::scattered`].
    pub scattered: Option<ScatteredPartState>,
    /// See [`ChainBodyState::robots`].
    pub robots: Vec<Robot>,
}

/// What holds of scattered parts beside their record while obstacles are in their way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct GatherRecord {
    /// See [`ScatteredPartState::waited`].
    pub(crate) waited: Cycle,
    /// See [`ScatteredPartState::way_points_m`].
    pub(crate) way_points_m: Vec<Vec<f64>>,
}

/// A state by id: the content of a checkpoint, covered by the digest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Cycles done.
    pub cycle: Cycle,
    /// The chains by id.
    pub chains: Vec<ChainRecord>,
    /// Joint values of arms.
    pub(crate) joints: SnapshotComponentRecords<Vec<f64>>,
    /// Recent motions of joints that do not rest: see [`MotionState::to_rows`].
    pub(crate) motions: SnapshotComponentRecords<Vec<Vec<f64>>>,
    /// Plans: the postures still to be reached, each coordinate after coordinate, or of an arm joint after joint.
    pub(crate) plans: SnapshotComponentRecords<Vec<Vec<f64>>>,
    /// Plans to leave obstacles that caught a part of a chain.
    pub(crate) escape_plans: SnapshotComponentRecords<EscapePlan>,
    /// Cycles for which navigators stand because something moves ahead.
    pub(crate) standstills: SnapshotComponentRecords<u32>,
    /// What obstacles have kept scattered parts from, and the ways around them.
    pub(crate) gathering: SnapshotComponentRecords<GatherRecord>,
    /// Orders from external callers, and their results.
    pub(crate) externals: SnapshotComponentRecords<ExternalControlState>,
    /// Lost connectors, as known to the agents of their chain.
    pub(crate) missing: SnapshotComponentRecords<Vec<MissingNeighbors>>,
    /// Decisions that agents in other processes have submitted for the next cycle; serialized, because their type
    /// depends on the number of dimensions.
    pub(crate) submitted: SnapshotComponentRecords<Vec<u8>>,
    /// Memories of drivers of the program's own.
    pub(crate) driver_memories: SnapshotComponentRecords<DriverMemory>,
}

impl SnapshotComponent for Option<Vec<f64>> {
    type Record = Vec<f64>;

    fn save(&self, _: Cycle) -> Option<Vec<f64>> {
        self.clone()
    }

    fn restore(
        &mut self,
        values: &Vec<f64>,
        _: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError> {
        let joints = self.as_mut().filter(|joints| joints.len() == values.len());
        joints.ok_or(CheckpointError::Damaged)?.clone_from(values);
        Ok(())
    }
}

impl SnapshotComponent for MotionState {
    type Record = Vec<Vec<f64>>;

    fn save(&self, _: Cycle) -> Option<Vec<Vec<f64>>> {
        (!self.is_at_rest()).then(|| self.to_rows())
    }

    fn restore(
        &mut self,
        rows: &Vec<Vec<f64>>,
        owner: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError> {
        let motion = owner.joints.and_then(|joints| Self::from_rows(rows, joints));
        *self = motion.ok_or(CheckpointError::Damaged)?;
        Ok(())
    }
}

impl<const D: usize> SnapshotComponent for Option<MotionPlan<D>> {
    type Record = Vec<Vec<f64>>;

    fn save(&self, _: Cycle) -> Option<Vec<Vec<f64>>> {
        let path = match self.as_ref()? {
            MotionPlan::Rods(path) => path.iter().map(|posture| flatten(posture)).collect(),
            MotionPlan::Joints(path) => path.iter().cloned().collect(),
        };
        Some(path)
    }

    fn restore(
        &mut self,
        path: &Vec<Vec<f64>>,
        owner: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError> {
        let values = owner.joints.unwrap_or(owner.coordinates);
        if path.is_empty() || path.iter().any(|posture| posture.len() != values) {
            return Err(CheckpointError::Damaged);
        }
        let plan = if owner.joints.is_some() {
            MotionPlan::Joints(path.iter().cloned().collect())
        } else {
            MotionPlan::Rods(path.iter().map(|posture| unflatten(posture)).collect())
        };
        *self = Some(plan);
        Ok(())
    }
}

impl SnapshotComponent for EscapePlan {
    type Record = Self;

    fn save(&self, _: Cycle) -> Option<Self> {
        (!self.is_none()).then_some(*self)
    }

    fn restore(&mut self, record: &Self, _: &ExpectedChainSizes) -> Result<(), CheckpointError> {
        *self = *record;
        Ok(())
    }
}

impl SnapshotComponent for Standstill {
    type Record = u32;

    fn save(&self, _: Cycle) -> Option<u32> {
        (self.cycles > 0).then_some(self.cycles)
    }

    fn restore(&mut self, cycles: &u32, _: &ExpectedChainSizes) -> Result<(), CheckpointError> {
        self.cycles = *cycles;
        Ok(())
    }
}

impl SnapshotComponent for DriverMemory {
    type Record = Self;

    fn save(&self, _: Cycle) -> Option<Self> {
        (*self != Self::default()).then_some(*self)
    }

    fn restore(&mut self, record: &Self, _: &ExpectedChainSizes) -> Result<(), CheckpointError> {
        *self = *record;
        Ok(())
    }
}

/// The rest of the scattered parts is in the record of their chain.
impl SnapshotComponent for Option<ScatteredPartState> {
    type Record = GatherRecord;

    fn save(&self, _: Cycle) -> Option<GatherRecord> {
        let ScatteredPartState { waited, way_points_m, .. } = self.as_ref()?;
        let is_free = *waited == 0 && way_points_m.is_empty();
        (!is_free).then(|| GatherRecord { waited: *waited, way_points_m: way_points_m.clone() })
    }

    fn restore(
        &mut self,
        record: &GatherRecord,
        owner: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError> {
        let scattered = self.as_mut().ok_or(CheckpointError::Damaged)?;
        let ways = &record.way_points_m;
        let dimensions = owner.coordinates / owner.connectors.max(1);
        let is_finite = |way: &Vec<f64>| way.iter().all(|x| x.is_finite());
        let has_points =
            ways.iter().all(|way| way.len() % dimensions.max(1) == 0 && is_finite(way));
        let is_of_parts = ways.is_empty() || ways.len() == scattered.way_count();
        if !has_points || !is_of_parts {
            return Err(CheckpointError::Damaged);
        }
        scattered.waited = record.waited;
        scattered.way_points_m.clone_from(ways);
        Ok(())
    }
}

impl SnapshotComponent for ExternalControlState {
    type Record = Self;

    fn save(&self, _: Cycle) -> Option<Self> {
        (!self.is_none()).then_some(*self)
    }

    fn restore(
        &mut self,
        record: &Self,
        owner: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError> {
        if !record.has_valid_indices(owner.connectors) {
            return Err(CheckpointError::Damaged);
        }
        *self = *record;
        Ok(())
    }
}

impl SnapshotComponent for Vec<MissingNeighbors> {
    type Record = Self;

    fn save(&self, _: Cycle) -> Option<Self> {
        (!self.is_empty()).then(|| self.clone())
    }

    fn restore(
        &mut self,
        record: &Self,
        owner: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError> {
        let n = owner.connectors;
        let exist = record.iter().flatten().flatten().all(|k| (*k as usize) < n);
        if record.len() != n || !exist {
            return Err(CheckpointError::Damaged);
        }
        self.clone_from(record);
        Ok(())
    }
}

impl<const D: usize> SnapshotComponent for Option<ChainCycleControls<D>> {
    type Record = Vec<u8>;

    fn save(&self, cycle: Cycle) -> Option<Vec<u8>> {
        // Decisions for an earlier cycle are never carried out, so they are no part of the state.
        let submitted = self.as_ref().filter(|submitted| submitted.cycle == cycle)?;
        Some(postcard::to_stdvec(submitted).expect("decisions are plain data"))
    }

    fn restore(
        &mut self,
        bytes: &Vec<u8>,
        owner: &ExpectedChainSizes,
    ) -> Result<(), CheckpointError> {
        let controls: ChainCycleControls<D> =
            postcard::from_bytes(bytes).map_err(|_| CheckpointError::Damaged)?;
        if controls.cycle != owner.cycle || controls.check(owner.connectors).is_err() {
            return Err(CheckpointError::Damaged);
        }
        *self = Some(controls);
        Ok(())
    }
}

/// Restores one component of all chains that have a record of it.
///
/// # Errors
/// When a record belongs to another chain.
fn restore_component<const D: usize, C: SnapshotComponent>(
    bodies: &mut [ChainBodyState<D>],
    cycle: Cycle,
    list: &[(EntityId, C::Record)],
    component: fn(&mut ChainBodyState<D>) -> &mut C,
) -> Result<(), CheckpointError> {
    for (slot, record) in list {
        let body = bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?;
        let connectors = body.chain.points().len();
        let owner = ExpectedChainSizes {
            cycle,
            connectors,
            coordinates: connectors * D,
            joints: body.joints.as_ref().map(Vec::len),
        };
        component(body).restore(record, &owner)?;
    }
    Ok(())
}

impl<const D: usize> ChainBodyState<D> {
    pub(super) fn record(&self) -> ChainRecord {
        ChainRecord {
            points_m: flatten(self.chain.points()),
            driving: self.driving.clone(),
            scattered: self.scattered.clone(),
            robots: self.robots.clone(),
        }
    }

    /// Returns the body that a record describes, after `cycle` cycles.
    pub(super) fn restore(
        spec: &ChainSpec<D>,
        record: &ChainRecord,
        tally: ChainTally,
        cycle: Cycle,
    ) -> Result<Self, CheckpointError> {
        let mut chain = spec.start.clone();
        let n = chain.points().len();
        let robot_count = if spec.robots.is_some() { n } else { 0 };
        if record.robots.len() != robot_count
            || record.points_m.len() != n * D
            || record.driving.task as usize > spec.tasks.len()
        {
            return Err(CheckpointError::Damaged);
        }
        // Failures and joint limits of past changes are in no record: they follow from the scenario.
        for change in spec.changes.iter().filter(|change| change.cycle < cycle) {
            change.apply_limit_change(&mut chain);
        }
        for (point, at) in chain.points_mut().iter_mut().zip(record.points_m.chunks_exact(D)) {
            point.copy_from_slice(at);
        }
        let motions = spec.script_motions(&record.driving).map_err(|_| CheckpointError::Damaged)?;
        let driving = record.driving.clone();
        let scattered = record.scattered.clone();
        let robots = record.robots.clone();
        let fresh = Self::new(spec).map_err(|_| CheckpointError::Damaged)?;
        Ok(Self { chain, driving, scattered, robots, tally, motions, ..fresh })
    }
}

impl Snapshot {
    /// Restores the components of all chains.
    ///
    /// # Errors
    /// When a record belongs to another chain.
    pub(super) fn restore_components<const D: usize>(
        &self,
        bodies: &mut [ChainBodyState<D>],
    ) -> Result<(), CheckpointError> {
        let cycle = self.cycle;
        restore_component(bodies, cycle, &self.joints, |body| &mut body.joints)?;
        restore_component(bodies, cycle, &self.motions, |body| &mut body.motion)?;
        restore_component(bodies, cycle, &self.plans, |body| &mut body.plan)?;
        restore_component(bodies, cycle, &self.escape_plans, |body| &mut body.escape_plan)?;
        restore_component(bodies, cycle, &self.standstills, |body| &mut body.standstill)?;
        restore_component(bodies, cycle, &self.gathering, |body| &mut body.scattered)?;
        restore_component(bodies, cycle, &self.externals, |body| &mut body.external)?;
        restore_component(bodies, cycle, &self.missing, |body| &mut body.missing)?;
        restore_component(bodies, cycle, &self.submitted, |body| &mut body.submitted)?;
        restore_component(bodies, cycle, &self.driver_memories, |body| &mut body.driver_memory)
    }

    /// Returns the digest of this state: it covers every value, by id.
    pub fn digest(&self) -> Digest {
        let mut hasher = Hasher::default();
        add(&mut hasher, &(self.cycle, &self.chains));
        // Empty lists add nothing, so that a new component does not change the digests of worlds without it.
        hash_nonempty_list(&mut hasher, &self.joints);
        hash_nonempty_list(&mut hasher, &self.motions);
        hash_nonempty_list(&mut hasher, &self.plans);
        hash_nonempty_list(&mut hasher, &self.escape_plans);
        hash_nonempty_list(&mut hasher, &self.standstills);
        hash_nonempty_list(&mut hasher, &self.gathering);
        hash_nonempty_list(&mut hasher, &self.externals);
        hash_nonempty_list(&mut hasher, &self.missing);
        hash_nonempty_list(&mut hasher, &self.submitted);
        hash_nonempty_list(&mut hasher, &self.driver_memories);
        hasher.finish()
    }
}

/// Adds a list to a digest, unless it is empty.
fn hash_nonempty_list<T: Serialize>(hasher: &mut Hasher, list: &[T]) {
    if !list.is_empty() {
        add(hasher, &list);
    }
}

fn add(hasher: &mut Hasher, data: &impl Serialize) {
    let bytes = postcard::to_stdvec(data).expect("a snapshot is plain data");
    for chunk in bytes.chunks(8) {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        hasher.write_u64(u64::from_le_bytes(word));
    }
    // The length tells a last word that is padded from one that ends in zeros.
    hasher.write_u64(bytes.len() as u64);
}
