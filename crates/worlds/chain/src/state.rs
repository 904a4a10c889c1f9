//! The changing state of a run, and its snapshot.

use super::agents::chain_controls::ChainControls;
use super::deferred::DeferredMotions;
use super::driver::external::External;
use super::driver::{Task, TaskProgress};
use super::formation::{Robot, Solid};
use super::metrics::ChainTally;
use super::motion::escape::EscapePlan;
use super::neighbors::Neighbors;
use super::script::ScriptMotion;
use super::swarm::drive::Pose2;
use super::swarm::leader::{Decision, LeaderState};
use super::world::{ChainSpec, ChainWorld};
use serde::{Deserialize, Serialize};
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::math::atan2;
use sidestep_kernel::{Cycle, Digest, EntityId, InputError, Slot};
use sidestep_rods::geometry::{Bounds, Point, normalized, with_dimensions};
use sidestep_rods::{Chain, Grid, bounds_around};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Number of chains up to which a look at each takes no longer than finding those nearby.
const MAX_LINEAR_SCAN: usize = 16;
/// Room for rounding between boxes and distances, meters.
const ROUNDING_M: f64 = 1e-6;

/// State of a world of chains; slots are ids.
#[derive(Debug)]
pub struct ChainState<const D: usize> {
    cells: Box<[ChainCell<D>]>,
    /// Number of claims ever made.
    claims: AtomicU64,
    /// The claims of this cycle, sorted by the first worker that needs them.
    neighbors: RwLock<Neighbors<D>>,
    /// Whether some body may have changed since the boxes below were made.
    has_changed: AtomicBool,
    /// The boxes around the solid parts of all chains in the plane, made by the first worker that needs them.
    crowd: RwLock<Grid<2>>,
}

/// One chain's share of the state. None of its locks is ever waited for: in the first phase all workers only
/// read the bodies, and in the last phase only the one worker that has a group writes its bodies.
#[derive(Debug)]
struct ChainCell<const D: usize> {
    body: RwLock<Body<D>>,
    /// The box that the chain may enter during this cycle.
    claim: Mutex<Bounds<D>>,
    /// Decision of its navigator in this cycle.
    decision: Mutex<Option<Decision>>,
}

/// One chain as it is now.
#[derive(Debug, Clone)]
pub struct Body<const D: usize> {
    /// Its connectors and rods.
    pub chain: Chain<D>,
    /// Progress of its initiator through its tasks.
    pub driving: TaskProgress,
    /// Scattered connectors, and the places where they will be joined again; none while the chain
    /// is whole.
    pub scattered: Option<ScatterState>,
    /// The robots that keep to its connectors; empty if nothing is on wheels.
    pub robots: Vec<Robot>,
    /// Radius of their bodies, meters.
    pub(crate) robot_radius_m: f64,
    /// Counts so far.
    pub tally: ChainTally,
    /// Cycles that its navigator has stood because something moves ahead.
    pub(crate) stood: u32,
    /// Memory of its way out of where it was caught.
    pub(crate) way_out: EscapePlan,
    /// The motions of the present script, which follow from the place where it started.
    pub(crate) motions: Vec<ScriptMotion>,
    /// Orders from outside, and the answer to the last ones.
    pub(crate) external: External,
    /// Joint values of an arm, in rad or m: its connectors are where forward kinematics puts them.
    pub joints: Option<Vec<f64>>,
    /// The way that it follows because local rules came no nearer.
    pub(crate) plan: Option<MotionPlan<D>>,
    /// The nearest lost connectors below and above, as each connector knows; empty while none is lost.
    pub(crate) missing: Vec<MissingNeighbors>,
    /// Decisions of its agents for a cycle, if they run elsewhere.
    pub(crate) handed: Option<ChainControls<D>>,
    /// Motions that the chain has yet to follow; none whenever it is looked at.
    pub(crate) put_off: DeferredMotions<D>,
}

/// Parts of a broken chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScatterState {
    /// The first scattered connector,
    pub first: u32,
    /// and the last.
    pub last: u32,
    /// Speed of each, m/s,
    pub speed_m_s: f64,
    /// and the places where all connectors will be joined again, coordinate after coordinate; empty
    /// while the parts lie where they are.
    pub goals_m: Vec<f64>,
    /// Cycles in a row in which something kept the parts from being joined; see [`Snapshot::waited`].
    #[serde(skip)]
    pub(crate) waited: Cycle,
}

/// A way to a target: the postures that are not reached yet, each straight from the one before; at least one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MotionPlan<const D: usize> {
    /// Places of all connectors.
    Rods(VecDeque<Vec<Point<D>>>),
    /// Values of an arm's joints.
    Joints(VecDeque<Vec<f64>>),
}

/// A plan in a snapshot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanRecord {
    /// The chain.
    pub chain: EntityId,
    /// Its postures that are not reached yet, each coordinate after coordinate, or of an arm joint after joint.
    pub way: Vec<Vec<f64>>,
}

/// One chain in a snapshot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChainRecord {
    /// Positions of the connectors, coordinate after coordinate.
    pub points_m: Vec<f64>,
    /// See [`Body::driving`].
    pub driving: TaskProgress,
    /// See [`Body::scattered`].
    pub scattered: Option<ScatterState>,
    /// See [`Body::robots`].
    pub robots: Vec<Robot>,
}

/// A state by id: the content of a checkpoint, covered by the digest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Cycles done.
    pub cycle: Cycle,
    /// The chains by id.
    pub chains: Vec<ChainRecord>,
    /// Joint values of arms, by id.
    pub joints: Vec<(EntityId, Vec<f64>)>,
    /// Their plans, of those that have one; by id.
    pub plans: Vec<PlanRecord>,
    /// Chains that are on a way out of where they were caught, by id.
    pub(crate) ways_out: Vec<(u32, EscapePlan)>,
    /// Cycles for which navigators have stood because something moves ahead, where they have, by id.
    pub(crate) stood: Vec<(EntityId, u32)>,
    /// Cycles for which scattered parts have waited for an obstacle in their way, where they have, by id.
    pub(crate) waited: Vec<(EntityId, Cycle)>,
    /// Orders from outside and answers, of chains that have any, by id.
    pub(crate) externals: Vec<(u32, External)>,
    /// Lost connectors, as known to those of their chain, of chains in which one is lost; by id.
    pub(crate) missing: Vec<(u32, Vec<MissingNeighbors>)>,
    /// Decisions for the cycle that comes next, by id, if those were handed over by agents elsewhere; serialized.
    pub(crate) handed: Vec<(u32, Vec<u8>)>,
}

/// The nearest lost connectors below and above, as a connector knows.
pub(crate) type MissingNeighbors = [Option<u32>; 2];

impl<const D: usize> Body<D> {
    /// Returns a chain at its start.
    pub(crate) fn new(spec: &ChainSpec<D>) -> Result<Self, InputError> {
        let chain = spec.start.clone();
        let driving = TaskProgress::new(spec.tasks[0].agent, chain.points());
        let mut body = Self {
            robots: spec.robots_at(chain.points(), &driving),
            robot_radius_m: spec.robot_radius_m(),
            driving,
            chain,
            scattered: None,
            tally: ChainTally::default(),
            stood: 0,
            way_out: EscapePlan::default(),
            motions: Vec::new(),
            external: External::default(),
            joints: spec.arm.as_ref().map(|arm| arm.values.clone()),
            plan: None,
            missing: Vec::new(),
            handed: None,
            put_off: DeferredMotions::default(),
        };
        body.motions = spec.motions(&body.driving)?;
        Ok(body)
    }

    /// Lets the chain follow motions that were put off.
    pub(crate) fn catch_up(&mut self) {
        self.put_off.catch_up(&mut self.chain, &mut self.tally);
    }

    /// Returns the solid parts that others see: the chain's robots, or its connectors if it has
    /// none.
    pub(crate) fn solids(&self) -> impl Iterator<Item = (usize, Solid)> + '_ {
        let solid = |k: usize| match self.robots.get(k) {
            Some(robot) => Solid { at: robot.pose.at, radius_m: self.robot_radius_m },
            None => {
                let radius_m = self.chain.connectors()[k].radius_m;
                Solid { at: with_dimensions(self.chain.points()[k]), radius_m }
            }
        };
        (0..self.chain.points().len()).map(move |k| (k, solid(k)))
    }

    /// Returns the box around its solid parts in the plane.
    fn solid_bounds(&self) -> Bounds<2> {
        let boxes =
            self.solids().map(|(_, solid)| Bounds::from_points(&[solid.at]).grown(solid.radius_m));
        boxes.fold(Bounds::empty(), |all, one| all.joined(&one))
    }

    /// Returns a navigator's memory; at the start of its task it stands at its connector and looks
    /// ahead.
    pub(crate) fn leader_state(&self, task: &Task<D>) -> LeaderState {
        self.driving.leader.unwrap_or_else(|| {
            let [x, y, _] = self.driving.ahead;
            let [x, y] = normalized([x, y]).unwrap_or([1.0, 0.0]);
            let at = with_dimensions(self.chain.points()[task.agent]);
            LeaderState::new(Pose2 { at, heading_rad: atan2(y, x) })
        })
    }

    /// Returns the decisions that were handed over for a cycle, serialized.
    fn submitted_controls(&self, cycle: Cycle) -> Option<Vec<u8>> {
        let handed = self.handed.as_ref().filter(|handed| handed.cycle == cycle)?;
        Some(postcard::to_stdvec(handed).expect("decisions are plain data"))
    }

    fn record(&self) -> ChainRecord {
        ChainRecord {
            points_m: flatten(self.chain.points()),
            driving: self.driving.clone(),
            scattered: self.scattered.clone(),
            robots: self.robots.clone(),
        }
    }

    /// Returns the body that a record describes, after `cycle` cycles.
    fn restore(
        spec: &ChainSpec<D>,
        record: &ChainRecord,
        tally: ChainTally,
        cycle: Cycle,
    ) -> Result<Self, CheckpointError> {
        let mut chain = spec.start.clone();
        let n = chain.points().len();
        let robots = if spec.robots.is_some() { n } else { 0 };
        if record.robots.len() != robots
            || record.points_m.len() != n * D
            || record.driving.task as usize > spec.tasks.len()
        {
            return Err(CheckpointError::Damaged);
        }
        for change in spec.changes.iter().filter(|change| change.cycle < cycle) {
            change.constrain(&mut chain);
        }
        for (point, at) in chain.points_mut().iter_mut().zip(record.points_m.chunks_exact(D)) {
            point.copy_from_slice(at);
        }
        let motions = spec.motions(&record.driving).map_err(|_| CheckpointError::Damaged)?;
        let (driving, scattered) = (record.driving.clone(), record.scattered.clone());
        let fresh = Self::new(spec).map_err(|_| CheckpointError::Damaged)?;
        let robots = record.robots.clone();
        Ok(Self { chain, driving, scattered, robots, tally, motions, ..fresh })
    }
}

/// Returns the coordinates one after the other.
pub(crate) fn flatten<const D: usize>(points: &[Point<D>]) -> Vec<f64> {
    points.iter().flatten().copied().collect()
}

impl<const D: usize> ChainState<D> {
    fn from_bodies(bodies: impl Iterator<Item = Body<D>>) -> Self {
        let cell = |body| ChainCell {
            body: RwLock::new(body),
            claim: Mutex::new(Bounds::empty()),
            decision: Mutex::new(None),
        };
        Self {
            cells: bodies.map(cell).collect(),
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
        let bodies = world.chains.iter().map(Body::new).collect::<Result<Vec<_>, _>>()?;
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
        let bodies =
            all.map(|((spec, record), tally)| Body::restore(spec, record, tally, snapshot.cycle));
        let mut bodies = bodies.collect::<Result<Vec<_>, _>>()?;
        for (slot, values) in &snapshot.joints {
            let body = bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?;
            let joints = body.joints.as_mut().filter(|joints| joints.len() == values.len());
            joints.ok_or(CheckpointError::Damaged)?.clone_from(values);
        }
        for record in &snapshot.plans {
            let body = bodies.get_mut(record.chain as usize).ok_or(CheckpointError::Damaged)?;
            let n = body.chain.points().len();
            body.plan = Some(MotionPlan::restore(record, body.joints.as_deref(), n)?);
        }
        for (slot, way_out) in &snapshot.ways_out {
            let body = bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?;
            body.way_out = *way_out;
        }
        for (slot, stood) in &snapshot.stood {
            bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?.stood = *stood;
        }
        for (slot, waited) in &snapshot.waited {
            let body = bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?;
            body.scattered.as_mut().ok_or(CheckpointError::Damaged)?.waited = *waited;
        }
        restore_agents(&mut bodies, snapshot)?;
        Ok(Self::from_bodies(bodies.into_iter()))
    }

    /// Returns a copy on which a cycle can be tried.
    pub(crate) fn trial_copy(&self) -> Self {
        Self::from_bodies((0..self.len()).map(|slot| self.body(slot).clone()))
    }

    /// Returns the number of chains.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Locks one chain for reading.
    pub fn body(&self, slot: usize) -> RwLockReadGuard<'_, Body<D>> {
        let body = self.deferred_body(slot);
        if body.put_off.is_empty() {
            return body;
        }
        drop(body);
        self.body_mut(slot).catch_up();
        self.deferred_body(slot)
    }

    /// Locks one chain for reading, of which all connectors except the initiator may have motions to follow.
    pub(crate) fn deferred_body(&self, slot: usize) -> RwLockReadGuard<'_, Body<D>> {
        self.cells[slot].body.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns whether the decisions of a chain's agents for a cycle were handed over, and are not carried out yet.
    pub fn has_submitted_controls(&self, slot: usize, cycle: Cycle) -> bool {
        let body = self.deferred_body(slot);
        body.handed.as_ref().is_some_and(|handed| handed.cycle == cycle)
    }

    /// Locks one chain for writing.
    pub(crate) fn body_mut(&self, slot: usize) -> RwLockWriteGuard<'_, Body<D>> {
        // Workers that act would wait for each other if all of them wrote it.
        if !self.has_changed.load(Relaxed) {
            self.has_changed.store(true, Relaxed);
        }
        self.cells[slot].body.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the box that a chain has claimed for this cycle.
    pub(crate) fn claim(&self, slot: usize) -> Bounds<D> {
        *self.cells[slot].claim.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the claims by their lower ends; valid while no chain claims anything.
    pub(crate) fn neighbors(&self) -> RwLockReadGuard<'_, Neighbors<D>> {
        let made = self.claims.load(Relaxed);
        refresh(
            &self.neighbors,
            |neighbors| neighbors.is_current(made),
            |neighbors| neighbors.sort(made, (0..self.len()).map(|slot| self.claim(slot))),
        )
    }

    /// Lists the chains, in order, of which some solid part may be within a distance of a place, among them all of
    /// which one is; valid while no body changes.
    pub(crate) fn list_near(&self, at: Point<2>, range_m: f64, slots: &mut Vec<Slot>) {
        slots.clear();
        if self.len() <= MAX_LINEAR_SCAN {
            return slots.extend(0..self.len() as Slot);
        }
        let crowd = refresh(
            &self.crowd,
            |_| !self.has_changed.load(Relaxed),
            |crowd| {
                let boxes = (0..self.len()).map(|slot| self.body(slot).solid_bounds());
                crowd.rebuild(boxes, range_m);
                self.has_changed.store(false, Relaxed);
            },
        );
        crowd.visit(&bounds_around(at, range_m).grown(ROUNDING_M), |slot| slots.push(slot as Slot));
        slots.sort_unstable();
    }

    pub(crate) fn set_claim(&self, slot: usize, claim: Bounds<D>) {
        self.claims.fetch_add(1, Relaxed);
        *self.cells[slot].claim.lock().unwrap_or_else(PoisonError::into_inner) = claim;
    }

    /// Returns the decision of a chain's navigator.
    pub(crate) fn decision(&self, slot: usize) -> Option<Decision> {
        *self.cells[slot].decision.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn set_decision(&self, slot: usize, decision: Option<Decision>) {
        *self.cells[slot].decision.lock().unwrap_or_else(PoisonError::into_inner) = decision;
    }

    /// Returns the state after `cycle` cycles.
    pub fn snapshot(&self, cycle: Cycle) -> Snapshot {
        let slots = 0..self.len();
        let plan = |slot| Some(self.body(slot).plan.as_ref()?.record(slot as EntityId));
        let joints = slots.clone().map(|slot| (slot as EntityId, self.body(slot).joints.clone()));
        let ways_out = slots.clone().map(|slot| (slot as EntityId, self.body(slot).way_out));
        let stood = slots.clone().map(|slot| (slot as EntityId, self.body(slot).stood));
        let waited = |slot| Some((slot as EntityId, self.body(slot).scattered.as_ref()?.waited));
        let externals = slots.clone().map(|slot| (slot as EntityId, self.body(slot).external));
        let missing = slots.clone().map(|slot| (slot as EntityId, self.body(slot).missing.clone()));
        let handed =
            slots.clone().map(|slot| (slot as EntityId, self.body(slot).submitted_controls(cycle)));
        Snapshot {
            cycle,
            chains: slots.clone().map(|slot| self.body(slot).record()).collect(),
            joints: joints.filter_map(|(slot, values)| Some((slot, values?))).collect(),
            waited: slots.clone().filter_map(waited).filter(|(_, cycles)| *cycles > 0).collect(),
            plans: slots.filter_map(plan).collect(),
            ways_out: ways_out.filter(|(_, way_out)| !way_out.is_none()).collect(),
            stood: stood.filter(|(_, cycles)| *cycles > 0).collect(),
            externals: externals.filter(|(_, external)| !external.is_none()).collect(),
            missing: missing.filter(|(_, missing)| !missing.is_empty()).collect(),
            handed: handed.filter_map(|(slot, handed)| Some((slot, handed?))).collect(),
        }
    }

    /// Returns the counts of each chain so far.
    pub(crate) fn tallies(&self) -> Vec<ChainTally> {
        (0..self.len()).map(|slot| self.body(slot).tally.clone()).collect()
    }
}

/// Returns the content of a lock, renewed by the first worker that comes if it is out of date.
fn refresh<T>(
    lock: &RwLock<T>,
    is_current: impl Fn(&T) -> bool,
    renew: impl FnOnce(&mut T),
) -> RwLockReadGuard<'_, T> {
    let read = || lock.read().unwrap_or_else(PoisonError::into_inner);
    let known = read();
    if is_current(&known) {
        return known;
    }
    drop(known);
    let mut held = lock.write().unwrap_or_else(PoisonError::into_inner);
    if !is_current(&held) {
        renew(&mut held);
    }
    drop(held);
    read()
}

/// Gives bodies back the orders and decisions from outside, and their agents' knowledge of each other.
fn restore_agents<const D: usize>(
    bodies: &mut [Body<D>],
    snapshot: &Snapshot,
) -> Result<(), CheckpointError> {
    for (slot, external) in &snapshot.externals {
        let body = bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?;
        let is_its_own = external.is_within(body.chain.points().len());
        body.external = is_its_own.then_some(*external).ok_or(CheckpointError::Damaged)?;
    }
    for (slot, missing) in &snapshot.missing {
        let body = bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?;
        let n = body.chain.points().len();
        let is_its_own = |k: &u32| (*k as usize) < n;
        if missing.len() != n || !missing.iter().flatten().flatten().all(is_its_own) {
            return Err(CheckpointError::Damaged);
        }
        body.missing = missing.clone();
    }
    for (slot, handed) in &snapshot.handed {
        let body = bodies.get_mut(*slot as usize).ok_or(CheckpointError::Damaged)?;
        let (n, now) = (body.chain.points().len(), snapshot.cycle);
        let read = postcard::from_bytes::<ChainControls<D>>(handed).ok();
        let handed = read.filter(|read| read.cycle == now && read.check(n).is_ok());
        body.handed = Some(handed.ok_or(CheckpointError::Damaged)?);
    }
    Ok(())
}

impl<const D: usize> MotionPlan<D> {
    /// Returns the number of postures that are not reached yet.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Rods(way) => way.len(),
            Self::Joints(way) => way.len(),
        }
    }

    fn record(&self, chain: EntityId) -> PlanRecord {
        let way = match self {
            Self::Rods(way) => way.iter().map(|posture| flatten(posture)).collect(),
            Self::Joints(way) => way.iter().cloned().collect(),
        };
        PlanRecord { chain, way }
    }

    /// Returns the plan that a record describes, of a chain of `n` connectors, or of an arm with these joints.
    fn restore(
        record: &PlanRecord,
        joints: Option<&[f64]>,
        n: usize,
    ) -> Result<Self, CheckpointError> {
        let values = joints.map_or(n * D, <[f64]>::len);
        if record.way.is_empty() || record.way.iter().any(|posture| posture.len() != values) {
            return Err(CheckpointError::Damaged);
        }
        if joints.is_some() {
            return Ok(Self::Joints(record.way.iter().cloned().collect()));
        }
        let point = |at: &[f64]| std::array::from_fn(|i| at[i]);
        let posture = |m: &Vec<f64>| m.chunks_exact(D).map(point).collect();
        Ok(Self::Rods(record.way.iter().map(posture).collect()))
    }
}

impl Snapshot {
    /// Returns the digest of this state: it covers every value, by id.
    pub fn digest(&self) -> Digest {
        let mut hasher = Hasher::default();
        add(&mut hasher, &(self.cycle, &self.chains));
        // Empty lists add nothing, so that worlds without plans, ways out and orders keep their digests.
        add_any(&mut hasher, &self.joints);
        add_any(&mut hasher, &self.plans);
        add_any(&mut hasher, &self.ways_out);
        add_any(&mut hasher, &self.stood);
        add_any(&mut hasher, &self.waited);
        add_any(&mut hasher, &self.externals);
        add_any(&mut hasher, &self.missing);
        add_any(&mut hasher, &self.handed);
        hasher.finish()
    }
}

/// Adds a list to a digest, unless it is empty.
fn add_any<T: Serialize>(hasher: &mut Hasher, list: &[T]) {
    if !list.is_empty() {
        add(hasher, &list);
    }
}

/// Adds plain data to a digest.
fn add(hasher: &mut Hasher, data: &impl Serialize) {
    let bytes = postcard::to_stdvec(data).expect("a snapshot is plain data");
    bytes.chunks(8).for_each(|chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        hasher.write_u64(u64::from_le_bytes(word));
    });
    hasher.write_u64(bytes.len() as u64);
}
