//! The two parallel strategies that the source paper rejects, for measuring against them.
//!
//! Both use the very functions of the double pool (perceive and decide, claim, act); they differ in
//! which worker does what, and when. Neither keeps the promises of the double pool: results depend
//! on the number of workers, and under the lock also on the scheduling of threads. Both keep the
//! world's laws: no two bodies in a box, no body in a wall, and each body acts once a cycle when it
//! is due.
//!
//! - *Spatial partition*: each worker owns a vertical band of the map and the bodies anchored
//!   in it. It perceives for them, then moves those with claims that stay inside the band.
//!   Bodies that stand or may come across a border are moved by one worker, after all others;
//!   then bodies are handed over to the bands they have entered. Within a band the order is that
//!   of a list, without draws for priority: cheaper than the double pool, and less fair.
//! - *One lock*: each worker takes a body, locks the world, perceives and acts, and unlocks, as
//!   krABMaga's parallel schedule does per agent (which also starts new threads every step;
//!   here they live on). So bodies perceive a world that others have half changed.
//!
//! Both write claims, as the double pool does; the lock does not use them.

use super::Scratch;
use super::cycle_context::{CycleContext, with_cycle};
use super::metrics::Metrics;
use super::scenario::Compiled;
use super::state::{RobotsState, Snapshot};
use super::world::RobotsWorld;
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::workers::{self, Worker};
use sidestep_kernel::{Cycle, EntityId, EntitySlot, RunStats};
use sidestep_map::Cell;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A strategy that the paper rejects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strategy {
    /// Each worker owns a band of the map.
    SpatialPartition,
    /// Each body locks the world.
    OneLock,
}

impl Strategy {
    /// In the order of the report that measures them.
    pub const ALL: [Self; 2] = [Self::SpatialPartition, Self::OneLock];

    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::SpatialPartition => "spatial partition",
            Self::OneLock => "one lock",
        }
    }
}

/// A run of a robots world under one of the rejected strategies.
#[derive(Debug)]
pub struct BaselineRun {
    compiled: Compiled,
    state: RobotsState,
    strategy: Strategy,
    workers: Vec<BandWorker>,
    cycle: Cycle,
    serial_acts: u64,
}

/// Data of one worker, which no other one reads or writes while they run.
#[derive(Debug, Default)]
struct BandWorker {
    scratch: Scratch,
    /// Bodies anchored in this worker's band.
    own: Vec<EntitySlot>,
    /// Number of cycles of bodies that this worker did while all others waited.
    serial_acts: u64,
}

/// Data that the workers of a partition pass to each other.
#[derive(Debug)]
struct HaloExchange {
    /// Columns of each band in the padded grid; the outer bands reach over the map's edge.
    bands: Vec<Range<u32>>,
    /// Bodies of this cycle that are not inside one band.
    crossing: Mutex<Vec<EntitySlot>>,
    /// Bodies that have moved into each band.
    inboxes: Vec<Mutex<Vec<EntitySlot>>>,
}

impl BaselineRun {
    /// Returns a run at its start, with `workers` workers (at least 1).
    pub fn new(compiled: Compiled, strategy: Strategy, workers: usize) -> Self {
        let state = RobotsState::restore(&compiled.world, &compiled.start_snapshot());
        let mut band_workers = Vec::new();
        band_workers.resize_with(workers.max(1), BandWorker::default);
        let bands = compiled.world.bands(band_workers.len());
        for slot in 0..compiled.world.bodies.len() as EntitySlot {
            let band = band_of(&bands, state.position(slot).col());
            band_workers[band].own.push(slot);
        }
        Self { compiled, state, strategy, workers: band_workers, cycle: 0, serial_acts: 0 }
    }

    /// Runs on from the cycle that the last call has reached.
    pub fn advance(&mut self, cycles: u64) {
        let span = self.cycle..self.cycle + cycles;
        match self.strategy {
            Strategy::SpatialPartition => self.advance_partition(span),
            Strategy::OneLock => self.advance_one_lock(span),
        }
        self.cycle += cycles;
        self.serial_acts = self.workers.iter().map(|worker| worker.serial_acts).sum();
    }

    /// Returns the state by entity id.
    pub fn snapshot(&self) -> Snapshot {
        self.state.snapshot(&self.compiled.world, self.cycle)
    }

    /// Returns the metrics so far; there are no conflict groups.
    pub fn metrics(&self) -> Metrics {
        self.compiled.world.metrics(&self.state, self.cycle, &RunStats::default())
    }

    /// Returns the share of the bodies' cycles that one worker did while all others waited.
    pub fn serial_fraction(&self) -> f64 {
        let all = self.compiled.world.bodies.len() as u64 * self.cycle;
        self.serial_acts as f64 / all.max(1) as f64
    }

    fn advance_one_lock(&mut self, span: Range<Cycle>) {
        let world = &*self.compiled.world;
        let state = &self.state;
        let world_lock = Mutex::new(());
        workers::run(&mut self.workers, |worker, own| {
            // Each call of `run` starts a new team of workers, which counts its pools from 0.
            for (pool, now) in (0u64..).zip(span.clone()) {
                worker.for_each_chunk(pool, world.bodies.len(), |bodies| {
                    with_cycle!(world, state, now, |cycle| for slot in bodies {
                        let _guard = lock(&world_lock);
                        cycle.perceive(slot as EntitySlot, &mut own.scratch);
                        cycle.act_with_draw(slot as EntitySlot, &mut own.scratch);
                    });
                });
                worker.wait_at_barrier();
            }
        });
    }

    fn advance_partition(&mut self, span: Range<Cycle>) {
        let world = &*self.compiled.world;
        let state = &self.state;
        let exchange = HaloExchange::new(world.bands(self.workers.len()));
        workers::run(&mut self.workers, |worker, own| {
            for now in span.clone() {
                with_cycle!(world, state, now, |cycle| {
                    partition_cycle(cycle, &exchange, worker, own);
                });
            }
        });
    }
}

/// Runs a worker's part of one cycle: its own bodies perceive; barrier, because no body may act while
/// others perceive; those inside the band act; barrier; one worker moves the rest and hands over; barrier.
fn partition_cycle<T: OccupantWord>(
    cycle: &CycleContext<'_, T>,
    exchange: &HaloExchange,
    worker: &Worker<'_>,
    band_worker: &mut BandWorker,
) {
    let BandWorker { scratch, own, serial_acts } = band_worker;
    own.iter().for_each(|&slot| cycle.perceive(slot, scratch));
    worker.wait_at_barrier();
    let band = &exchange.bands[worker.index()];
    own.retain(|&slot| {
        let inside = cycle.is_inside(slot, band);
        if inside {
            cycle.act_with_draw(slot, scratch);
        } else {
            lock(&exchange.crossing).push(slot);
        }
        inside
    });
    worker.wait_at_barrier();
    if worker.index() == 0 {
        let mut crossing = std::mem::take(&mut *lock(&exchange.crossing));
        // The order in which workers arrive depends on scheduling; that of the slots does not.
        crossing.sort_unstable();
        *serial_acts += crossing.len() as u64;
        for slot in crossing {
            cycle.act_with_draw(slot, scratch);
            exchange.transfer(slot, cycle.body(slot).position().col());
        }
    }
    worker.wait_at_barrier();
    own.append(&mut lock(&exchange.inboxes[worker.index()]));
}

impl HaloExchange {
    fn new(bands: Vec<Range<u32>>) -> Self {
        let inboxes = bands.iter().map(|_| Mutex::default()).collect();
        Self { bands, crossing: Mutex::default(), inboxes }
    }

    fn transfer(&self, slot: EntitySlot, col: u32) {
        lock(&self.inboxes[band_of(&self.bands, col)]).push(slot);
    }
}

/// Locks a mutex even when it is poisoned, because a worker that panicked has ended the run anyway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Bands are sorted from west to east, and the last one has no end.
fn band_of(bands: &[Range<u32>], col: u32) -> usize {
    bands.partition_point(|band| band.end <= col).min(bands.len() - 1)
}

impl RobotsWorld {
    /// Returns `n` vertical bands of equal width.
    fn bands(&self, n: usize) -> Vec<Range<u32>> {
        let mut bands = Vec::with_capacity(n);
        let mut west = 0;
        for k in 1..=n as u64 {
            // The last band reaches over the map's edge, so that one band alone has no border.
            let is_last = k == n as u64;
            let east =
                if is_last { u32::MAX } else { (u64::from(self.stride) * k / n as u64) as u32 };
            bands.push(west..east);
            west = east;
        }
        bands
    }
}

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Returns whether all boxes that a body covers, or may come to cover, lie in these columns.
    fn is_inside(&self, slot: EntitySlot, band: &Range<u32>) -> bool {
        let world = self.world;
        let body = self.body(slot);
        let col = body.position().col();
        let width = self.type_of(body).size.0;
        let reach = world.reach;
        // Most bodies are far from a border, and their claims need not be walked.
        if col >= band.start.saturating_add(reach) && col + width + reach <= band.end {
            return true;
        }
        let covers = band.contains(&col) && band.contains(&(col + width - 1));
        if !covers || body.intent.get().is_idle() {
            return covers;
        }
        let mut inside = true;
        self.for_each_claimed(slot, |index, _| {
            inside &= band.contains(&(index as u32 % world.stride));
        });
        inside
    }
}

/// Returns the first breach of the laws in a state: two bodies in a box, or one in a wall.
pub fn find_violation(world: &RobotsWorld, snapshot: &Snapshot) -> Option<String> {
    let width = world.map.width();
    let mut owner: Vec<Option<EntityId>> = vec![None; world.map.cells().len()];
    for (id, body) in (0..).zip(&snapshot.bodies) {
        let ty = world.type_of(id);
        if world.is_door(id) && body.facing.is_open() {
            continue;
        }
        let cols = body.at.0..body.at.0 + ty.size.0;
        let rows = body.at.1..body.at.1 + ty.size.1;
        for (col, row) in rows.flat_map(|r| cols.clone().map(move |c| (c, r))) {
            let outside = col >= width || row >= world.map.height();
            if outside || world.map.cell(col, row) != Cell::Free {
                return Some(format!("body {id} stands in a wall at [{col}, {row}]"));
            }
            let box_owner = &mut owner[(row * width + col) as usize];
            if let Some(other) = box_owner.replace(id) {
                return Some(format!("bodies {other} and {id} stand in one box [{col}, {row}]"));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{Behaviours, StorageOrder};
    use sidestep_scenario::Source;

    /// A crowded hall with people and a door that tries to close on bodies standing in it.
    fn crowd() -> Compiled {
        let row = format!("{}\n", ".".repeat(40));
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = 3\n[map]\nascii = \"\"\"\n{}\"\"\"\n\
             [[robots]]\ncount = 60\nsize = 2\neffector = \"nomad\"\nsensors = [\"sonar-8\"]\n\
             behaviour = {{ kind = \"replay\", actions = [{}] }}\n\
             [[people]]\ncount = 60\n\
             [doors]\nat = [[19, 12]]\nsize = [4, 1]\nrandom = {{ p_open = 0.3, p_close = 0.3 }}\n",
            row.repeat(25),
            "\"forward\", \"forward\", \"left\", ".repeat(200)
        );
        let source = Source::new("crowd", text, "");
        Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial).unwrap()
    }

    #[test]
    fn every_strategy_keeps_the_world_valid_and_counts_every_body_once_a_cycle() {
        let compiled = crowd();
        for strategy in Strategy::ALL {
            for workers in [1, 2, 3, 8] {
                let mut run = BaselineRun::new(compiled.clone(), strategy, workers);
                for _ in 0..40 {
                    run.advance(5);
                    assert_eq!(find_violation(&compiled.world, &run.snapshot()), None);
                }
                // A replay remembers how many actions it has started.
                let snapshot = run.snapshot();
                assert!(snapshot.bodies[..60].iter().all(|robot| robot.memory[0] == 200));
            }
        }
    }

    #[test]
    fn bodies_of_a_partition_are_never_lost_and_change_bands() {
        let mut run = BaselineRun::new(crowd(), Strategy::SpatialPartition, 3);
        let before: Vec<Vec<EntitySlot>> =
            run.workers.iter().map(|hand| hand.own.clone()).collect();
        run.advance(300);
        let mut all: Vec<EntitySlot> =
            run.workers.iter().flat_map(|hand| hand.own.clone()).collect();
        all.sort_unstable();
        assert_eq!(all, (0..121).collect::<Vec<EntitySlot>>());
        assert!(run.workers.iter().zip(&before).any(|(hand, before)| hand.own != *before));
        assert!(run.serial_fraction() > 0.0 && run.serial_fraction() < 0.9);
    }

    #[test]
    fn one_worker_has_no_borders() {
        let mut run = BaselineRun::new(crowd(), Strategy::SpatialPartition, 1);
        run.advance(100);
        assert_eq!(run.serial_fraction(), 0.0);
    }

    #[test]
    fn bodies_on_each_other_and_in_walls_are_breaches() {
        let compiled = crowd();
        let mut snapshot = compiled.start_snapshot();
        assert_eq!(find_violation(&compiled.world, &snapshot), None);
        snapshot.bodies[1].at = snapshot.bodies[0].at;
        assert!(find_violation(&compiled.world, &snapshot).is_some_and(|b| b.contains("one box")));
        snapshot.bodies[1].at = (39, 0);
        assert!(find_violation(&compiled.world, &snapshot).is_some_and(|b| b.contains("wall")));
    }
}
