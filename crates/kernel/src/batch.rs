//! Many simulations of one scenario, stepped together: each on one worker, results by index.
//!
//! ```text
//! order(team, values)      noted for all worlds, checked at once
//! advance(cycles)          every world: its orders, then its cycles     ┐
//! observe(team, room)      [worlds, agents, ...], a row for each world  ├ on W workers that wait between calls
//! restart(seeds)           fresh starts of some                         ┘
//! ```
//!
//! A world knows nothing of the others, so the number of workers changes no bit. One that breaks off is
//! named in the error; the others are whole.

mod error;
mod world;

use crate::control::{BufferMut, OrderError, Orders, Space, Team};
use crate::digest::Digest;
use crate::error::InputError;
use crate::simulation::Simulation;
use crate::units::Cycle;
use crate::workers::ThreadPool;
pub use error::BatchError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use world::{BatchWorld, BufferLayout};

/// Makes a simulation at its start from a seed.
pub type SimulationFactory = dyn Fn(u64) -> Result<Box<dyn Simulation>, InputError> + Send + Sync;

/// Many simulations of one scenario.
pub struct Batch {
    shared: Arc<SharedWorlds>,
    pool: ThreadPool,
    /// The teams of each world, which are equal.
    teams: Arc<[Team]>,
    /// Orders that wait for the next cycle.
    orders: Vec<QueuedOrder>,
}

struct SharedWorlds {
    start: Arc<SimulationFactory>,
    worlds: Vec<Mutex<BatchWorld>>,
    /// Whether a world may have an error, so that usually none has to be asked.
    is_wrong: AtomicBool,
}

/// An order to all agents of a team in all worlds.
#[derive(Debug, Clone)]
struct QueuedOrder {
    team: usize,
    order: String,
    values: Vec<f64>,
}

impl Batch {
    /// Starts a world with each of the seeds, on `workers` workers (at least 1).
    ///
    /// # Errors
    /// When there are no seeds, or a world cannot start.
    pub fn new(
        start: Arc<SimulationFactory>,
        seeds: &[u64],
        workers: usize,
    ) -> Result<Self, BatchError> {
        if seeds.is_empty() {
            return Err(BatchError::Empty);
        }
        let world = |&seed: &u64| Mutex::new(BatchWorld::new(seed));
        let worlds = seeds.iter().map(world).collect();
        let shared = Arc::new(SharedWorlds { start, worlds, is_wrong: AtomicBool::new(false) });
        // More workers than worlds would have nothing to do.
        let (crew, orders) = (ThreadPool::new(workers.min(seeds.len())), Vec::new());
        let mut batch = Self { shared, pool: crew, teams: Arc::default(), orders };
        batch.for_each_world(|world, index, shared| {
            world.restart(index, world.seed, &*shared.start, None)
        });
        batch.check_errors()?;
        let first = batch.world(0);
        let teams: Arc<[Team]> = first.run.as_ref().map_or(&[][..], |run| run.teams()).into();
        drop(first);
        let differs =
            |world: &BatchWorld| world.run.as_ref().is_some_and(|run| *run.teams() != *teams);
        if let Some(world) = (1..batch.len()).find(|&k| differs(&batch.world(k))) {
            return Err(BatchError::Shape { world });
        }
        batch.teams = teams;
        Ok(batch)
    }

    /// Number of worlds; at least 1.
    #[expect(clippy::len_without_is_empty, reason = "it is never empty")]
    pub fn len(&self) -> usize {
        self.shared.worlds.len()
    }

    /// Number of workers: as many as requested, but at most one for each world.
    pub fn workers(&self) -> usize {
        self.pool.workers()
    }

    /// The teams of each world.
    pub fn teams(&self) -> &[Team] {
        &self.teams
    }

    /// Gives an order to all agents of a team in all worlds before the next cycle: the values of one world after the
    /// other, and within each world those of one agent after the other.
    ///
    /// # Errors
    /// When an order cannot be obeyed; nothing of it is noted then.
    pub fn order(&mut self, team: usize, order: &str, values: Vec<f64>) -> Result<(), BatchError> {
        let Some(its) = self.teams.get(team) else { return Err(self.no_team(team).into()) };
        let width = values.len() / self.len();
        let first = self.world(0);
        // All worlds have these teams, and the valid orders depend on no state: one world may answer for all; a
        // broken one accepts them.
        let check = |(world, values)| {
            let orders = Orders { order, agents: &its.agents, values };
            let checked = first.run.as_ref().map_or(Ok(()), |run| run.check(&orders));
            checked.map_err(|error| BatchError::Order { world, error })
        };
        if width * self.len() != values.len() {
            let (worlds, what, found) = (self.len(), "rows of values", values.len());
            return Err(BatchError::Count { worlds, what, found });
        }
        match width {
            0 => check((0, &[][..]))?,
            width => values.chunks(width).enumerate().try_for_each(check)?,
        }
        drop(first);
        self.orders.push(QueuedOrder { team, order: order.into(), values });
        Ok(())
    }

    /// Gives the waiting orders, and runs `cycles` cycles, in the worlds for which `mask` is true (all, without
    /// one); orders to others are dropped. A world in which nothing can happen anymore stays the same.
    ///
    /// # Errors
    /// When a world had broken off before: nothing is done then. When it does so now, or cannot obey: all others have
    /// done their cycles then.
    pub fn advance(&mut self, cycles: u64, mask: Option<&[bool]>) -> Result<(), BatchError> {
        self.check_count(mask.map(<[bool]>::len), "truth values")?;
        self.check_errors()?;
        let orders = std::mem::take(&mut self.orders);
        let (n, teams) = (self.len(), Arc::clone(&self.teams));
        let mask = mask.map(<[bool]>::to_vec);
        self.for_each_world(move |world, index, _| {
            if mask.as_ref().is_none_or(|mask| mask[index]) {
                world.with_run(index, |run| {
                    for QueuedOrder { team, order, values } in &orders {
                        let width = values.len() / n;
                        let values = &values[index * width..(index + 1) * width];
                        let agents = &teams[*team].agents;
                        run.order(&Orders { order, agents, values })?;
                    }
                    if cycles > 0 && !run.is_over() {
                        run.advance(cycles);
                    }
                    Ok(())
                });
            }
        });
        self.check_errors()
    }

    /// Writes what the agents of a team observe in all worlds: one room for each of its spaces, with the values
    /// of one world after the other.
    ///
    /// # Errors
    /// When there is no such team, or the room has another shape; or a world has broken off.
    pub fn observe(&mut self, team: usize, room: &mut [BufferMut<'_>]) -> Result<(), BatchError> {
        self.check_errors()?;
        let Some(its) = self.teams.get(team) else { return Err(self.no_team(team).into()) };
        let lengths: Vec<usize> =
            its.observation_spaces.iter().map(|space| its.agents.len() * space.width()).collect();
        self.check_buffers(team, &lengths, room)?;
        let n = self.len();
        let shared = Arc::clone(&self.shared);
        // The calling thread writes into the caller's room; the others write beside it, because as far as the
        // compiler knows they may outlive the borrowed room.
        let own = |index: usize| {
            let mut world = shared.world(index);
            let parts = &mut world_slice(room, &lengths, index);
            world.with_run(index, |run| run.observe(team, parts));
            shared.record_error(&world);
        };
        let theirs = Arc::clone(&self.shared);
        let extent = |(space, &length): (&Space, &usize)| {
            let is_whole = space.is_integer();
            BufferLayout { is_integer: is_whole, length }
        };
        let spaces: Vec<BufferLayout> =
            its.observation_spaces.iter().zip(&lengths).map(extent).collect();
        self.pool.run(
            n,
            own,
            Arc::new(move |index| theirs.world(index).observe(index, team, &spaces)),
        );
        for index in 0..n {
            self.world(index).copy_observations(&mut world_slice(room, &lengths, index));
        }
        self.check_errors()
    }

    /// Starts anew the worlds that have a seed here; waiting orders are dropped.
    ///
    /// # Errors
    /// When a world cannot start with its seed: it then stays as it was, and all others have started.
    pub fn restart(&mut self, seeds: &[Option<u64>]) -> Result<(), BatchError> {
        self.check_count(Some(seeds.len()), "seeds")?;
        self.orders.clear();
        let (wanted, teams) = (seeds.to_vec(), Arc::clone(&self.teams));
        self.for_each_world(move |world, index, shared| {
            if let Some(seed) = wanted[index] {
                world.restart(index, seed, &*shared.start, Some(&teams));
            }
        });
        // Worlds that were broken before, and have no seed here, do not concern this call.
        let refused = self.first_error(|index, _| seeds[index].is_some());
        refused.map_or(Ok(()), Err)
    }

    /// Returns the seed of each world.
    pub fn seeds(&self) -> Vec<u64> {
        (0..self.len()).map(|k| self.world(k).seed).collect()
    }

    /// Returns the cycles that each world has done.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn cycles(&self) -> Result<Vec<Cycle>, BatchError> {
        self.query(|run| run.cycle())
    }

    /// Returns whether nothing can happen anymore, for each world.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn is_over(&self) -> Result<Vec<bool>, BatchError> {
        self.query(|run| run.is_over())
    }

    /// Returns the digest of each world; waiting orders are not in it.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn digests(&self) -> Result<Vec<Digest>, BatchError> {
        self.query(|run| run.digest())
    }

    /// Returns the result of a function for each world.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn query<T>(&self, of: impl Fn(&dyn Simulation) -> T) -> Result<Vec<T>, BatchError> {
        let answer = |k| {
            let world = self.world(k);
            world.run.as_deref().map(&of).ok_or_else(|| world.no_run_error(k))
        };
        (0..self.len()).map(answer).collect()
    }

    fn world(&self, index: usize) -> MutexGuard<'_, BatchWorld> {
        self.shared.world(index)
    }

    /// Does some work in each world, on all workers.
    fn for_each_world(
        &mut self,
        work: impl Fn(&mut BatchWorld, usize, &SharedWorlds) + Send + Sync + 'static,
    ) {
        let (n, shared) = (self.len(), Arc::clone(&self.shared));
        let work = Arc::new(move |k: usize| {
            let mut world = shared.world(k);
            work(&mut world, k, &shared);
            shared.record_error(&world);
        });
        let theirs = Arc::clone(&work);
        self.pool.run(n, |k| work(k), theirs);
    }

    /// Returns the error of the first world that has one. Those of broken worlds stay.
    fn check_errors(&self) -> Result<(), BatchError> {
        match self.shared.is_wrong.load(Ordering::Relaxed) {
            true => self.first_error(|_, _| true).map_or(Ok(()), Err),
            false => Ok(()),
        }
    }

    fn first_error(&self, counts: impl Fn(usize, &BatchError) -> bool) -> Option<BatchError> {
        let (mut first, mut is_wrong) = (None, false);
        for index in 0..self.len() {
            let mut world = self.world(index);
            if let Some(error) = world.error.clone().filter(|error| counts(index, error)) {
                if world.run.is_some() {
                    world.error = None;
                }
                first = first.or(Some(error));
            }
            is_wrong |= world.error.is_some();
        }
        self.shared.is_wrong.store(is_wrong, Ordering::Relaxed);
        first
    }

    fn no_team(&self, team: usize) -> OrderError {
        OrderError::NoTeam { team, teams: self.teams.len() }
    }

    fn check_count(&self, found: Option<usize>, what: &'static str) -> Result<(), BatchError> {
        let worlds = self.len();
        let wrong = found.filter(|&found| found != worlds);
        wrong.map_or(Ok(()), |found| Err(BatchError::Count { worlds, what, found }))
    }

    /// Checks that there is exactly the room that a team's observations in all worlds need.
    fn check_buffers(
        &self,
        team: usize,
        lengths: &[usize],
        room: &[BufferMut<'_>],
    ) -> Result<(), OrderError> {
        let (observed, n) = (&self.teams[team].observation_spaces, self.len());
        let fits = room.len() == lengths.len()
            && room.iter().zip(observed).zip(lengths).all(|((room, space), &length)| {
                room.len() == n * length
                    && space.is_integer() == matches!(room, BufferMut::Integer(_))
            });
        if fits {
            return Ok(());
        }
        let expected = observed.iter().zip(lengths).map(|(space, length)| {
            let sort = if space.is_integer() { "whole" } else { "real" };
            format!("{} of {n} x {length} {sort} values", space.name)
        });
        Err(OrderError::BufferShape { expected: expected.collect::<Vec<_>>().join(", ") })
    }
}

impl std::fmt::Debug for Batch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Batch({} worlds, {} workers)", self.len(), self.workers())
    }
}

impl SharedWorlds {
    /// A world that panicked no longer has a run, so nothing that it left behind is read.
    fn world(&self, index: usize) -> MutexGuard<'_, BatchWorld> {
        self.worlds[index].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes whether a world has an error; the end of a call is a barrier.
    fn record_error(&self, world: &BatchWorld) {
        if world.error.is_some() {
            self.is_wrong.store(true, Ordering::Relaxed);
        }
    }
}

/// Returns one world's part of the room for all worlds.
fn world_slice<'a>(
    room: &'a mut [BufferMut<'_>],
    lengths: &[usize],
    index: usize,
) -> Vec<BufferMut<'a>> {
    let range = |length: usize| index * length..(index + 1) * length;
    let one = |(room, &length): (&'a mut BufferMut<'_>, &usize)| match room {
        BufferMut::Integer(room) => BufferMut::Integer(&mut room[range(length)]),
        BufferMut::Real(room) => BufferMut::Real(&mut room[range(length)]),
    };
    room.iter_mut().zip(lengths).map(one).collect()
}
