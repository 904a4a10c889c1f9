//! Many simulations of one scenario, stepped together: each on one worker, results by index.
//!
//! ```text
//! order(team, values)      queued for all worlds, checked at once
//! advance(cycles)          every world: its orders, then its cycles     ┐
//! observe(team, buffers)   [worlds, agents, ...], a row for each world  ├ on W workers that wait between calls
//! restart(seeds)           fresh starts of some                         ┘
//! ```
//!
//! Worlds share no data, so the number of workers changes no bit. When a world panics, the error gives its
//! index; all other worlds finish the call normally.

mod error;
mod world;

use crate::control::{AgentTeam, BufferMut, MultiAgentOrder, OrderError, ValueSpace};
use crate::digest::Digest;
use crate::error::InputError;
use crate::simulation::Simulation;
use crate::units::Cycle;
use crate::workers::ThreadPool;
pub use error::BatchError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use world::{BatchWorldEntry, BufferLayout};

/// Makes a simulation at its start from a seed.
pub type SimulationFactory = dyn Fn(u64) -> Result<Box<dyn Simulation>, InputError> + Send + Sync;

/// Simulations of one scenario, each with a seed of its own and identified by its index, from 0.
pub struct Batch {
    shared: Arc<SharedWorlds>,
    pool: ThreadPool,
    /// The teams of each world, which are equal: [`Batch::new`] refuses worlds that differ.
    teams: Arc<[AgentTeam]>,
    /// Orders that are given before the next cycle.
    orders: Vec<QueuedOrder>,
}

struct SharedWorlds {
    factory: Arc<SimulationFactory>,
    worlds: Vec<Mutex<BatchWorldEntry>>,
    /// Whether a world may have an error: a call without errors then locks no world to search for one.
    has_error: AtomicBool,
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
        factory: Arc<SimulationFactory>,
        seeds: &[u64],
        workers: usize,
    ) -> Result<Self, BatchError> {
        if seeds.is_empty() {
            return Err(BatchError::Empty);
        }
        let worlds = seeds.iter().map(|&seed| Mutex::new(BatchWorldEntry::new(seed))).collect();
        let shared = SharedWorlds { factory, worlds, has_error: AtomicBool::new(false) };
        let mut batch = Self {
            shared: Arc::new(shared),
            // A world is the unit of work, so further workers would stay idle.
            pool: ThreadPool::new(workers.min(seeds.len())),
            teams: Arc::default(),
            orders: Vec::new(),
        };
        batch.for_each_world(|world, index, shared| {
            world.restart(index, world.seed, &*shared.factory, None)
        });
        batch.check_errors()?;
        let teams: Arc<[AgentTeam]> = batch.world(0).agent_teams().into();
        batch.teams = teams;
        for index in 1..batch.len() {
            if *batch.world(index).agent_teams() != *batch.teams {
                return Err(BatchError::Shape { world: index });
            }
        }
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

    /// Returns the teams, the same in each world; [`Batch::order`] and [`Batch::observe`] take a team's index here.
    pub fn agent_teams(&self) -> &[AgentTeam] {
        &self.teams
    }

    /// Gives an order to all agents of a team in all worlds before the next cycle: the values of one world after the
    /// other, and within each world those of one agent after the other.
    ///
    /// # Errors
    /// When an order cannot be obeyed; no world gets it then.
    pub fn order(&mut self, team: usize, order: &str, values: Vec<f64>) -> Result<(), BatchError> {
        let Some(AgentTeam { agents, .. }) = self.teams.get(team) else {
            return Err(self.no_such_team(team).into());
        };
        let values_per_world = values.len() / self.len();
        if values_per_world * self.len() != values.len() {
            return Err(BatchError::Count {
                worlds: self.len(),
                what: "rows of values",
                found: values.len(),
            });
        }
        // All worlds have these teams, and valid orders do not depend on the state, so one world checks the
        // orders of all. A broken one has no run that could check: `advance` returns its error.
        let first = self.world(0);
        for world in 0..self.len() {
            let values = &values[world * values_per_world..(world + 1) * values_per_world];
            let orders = MultiAgentOrder { order, agents, values };
            if let Some(run) = &first.run {
                run.check(&orders).map_err(|error| BatchError::Order { world, error })?;
            }
        }
        drop(first);
        self.orders.push(QueuedOrder { team, order: order.into(), values });
        Ok(())
    }

    /// Gives the waiting orders, and runs `cycles` cycles, in the worlds for which `mask` is true (all, without
    /// one); orders to others are dropped. A world in which nothing can happen anymore stays the same.
    ///
    /// # Errors
    /// When a world was broken before this call: nothing is done then. When a world breaks during it, or cannot obey
    /// an order: all others have done their cycles then.
    pub fn advance(&mut self, cycles: u64, mask: Option<&[bool]>) -> Result<(), BatchError> {
        self.check_world_count(mask.map(<[bool]>::len), "truth values")?;
        self.check_errors()?;
        let orders = std::mem::take(&mut self.orders);
        let worlds = self.len();
        let teams = Arc::clone(&self.teams);
        let mask = mask.map(<[bool]>::to_vec);
        self.for_each_world(move |world, index, _| {
            if mask.as_ref().is_none_or(|mask| mask[index]) {
                world.apply_to_run(index, |run| {
                    for QueuedOrder { team, order, values } in &orders {
                        let width = values.len() / worlds;
                        let values = &values[index * width..(index + 1) * width];
                        let agents = &teams[*team].agents;
                        run.order(&MultiAgentOrder { order, agents, values })?;
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

    /// Writes what the agents of a team observe in all worlds: one buffer for each of its spaces, with the values
    /// of one world after the other.
    ///
    /// # Errors
    /// When there is no such team, or the buffers have another shape; or a world has broken off.
    pub fn observe(
        &mut self,
        team: usize,
        buffers: &mut [BufferMut<'_>],
    ) -> Result<(), BatchError> {
        self.check_errors()?;
        let Some(AgentTeam { agents, observation_spaces, .. }) = self.teams.get(team) else {
            return Err(self.no_such_team(team).into());
        };
        let layouts: Vec<BufferLayout> = observation_spaces
            .iter()
            .map(|space| BufferLayout {
                is_integer: space.is_integer(),
                length: agents.len() * space.value_count(),
            })
            .collect();
        self.check_buffers(observation_spaces, &layouts, buffers)?;
        let worlds = self.len();
        let shared = Arc::clone(&self.shared);
        // The calling thread writes straight into the caller's buffers. The other threads cannot borrow them,
        // because they live on after this call: they fill buffers of their own, which are copied below.
        let observe_here = |index: usize| {
            let mut world = shared.world(index);
            let slices = &mut world_slices(buffers, &layouts, index);
            world.apply_to_run(index, |run| run.observe(team, slices));
            shared.raise_error_flag(&world);
        };
        let shared_with_threads = Arc::clone(&self.shared);
        let thread_layouts = layouts.clone();
        let observe_on_thread = Arc::new(move |index: usize| {
            shared_with_threads.world(index).observe(index, team, &thread_layouts);
        });
        self.pool.run(worlds, observe_here, observe_on_thread);
        for index in 0..worlds {
            self.world(index).copy_observations(&mut world_slices(buffers, &layouts, index));
        }
        self.check_errors()
    }

    /// Starts anew the worlds that have a seed here; queued orders are dropped.
    ///
    /// # Errors
    /// When a world cannot start with its seed: it then stays as it was, and all others have started.
    pub fn restart(&mut self, seeds: &[Option<u64>]) -> Result<(), BatchError> {
        self.check_world_count(Some(seeds.len()), "seeds")?;
        self.orders.clear();
        let new_seeds = seeds.to_vec();
        let teams = Arc::clone(&self.teams);
        self.for_each_world(move |world, index, shared| {
            if let Some(seed) = new_seeds[index] {
                world.restart(index, seed, &*shared.factory, Some(&teams));
            }
        });
        // Worlds that were broken before, and have no seed here, do not concern this call.
        self.take_first_error(|index| seeds[index].is_some()).map_or(Ok(()), Err)
    }

    /// Continues each world from a checkpoint of the same scenario, one for each; queued orders are dropped.
    ///
    /// # Errors
    /// When a checkpoint is damaged, or of another scenario or build: that world stays as it was, and all others continue
    /// from theirs.
    pub fn restore(&mut self, checkpoints: &[Vec<u8>]) -> Result<(), BatchError> {
        self.check_world_count(Some(checkpoints.len()), "checkpoints")?;
        self.orders.clear();
        let mut first = None;
        for (index, checkpoint) in checkpoints.iter().enumerate() {
            let mut world = self.world(index);
            let Some(run) = world.run.as_deref_mut() else {
                first = first.or(Some(world.broken_world_error(index)));
                continue;
            };
            if let Err(error) = run.restore(checkpoint) {
                first = first.or(Some(BatchError::Restore { world: index, error }));
            }
        }
        first.map_or(Ok(()), Err)
    }

    /// Returns the seed with which each world last started.
    pub fn seeds(&self) -> Vec<u64> {
        (0..self.len()).map(|k| self.world(k).seed).collect()
    }

    /// Returns the cycles that each world has done.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn cycles(&self) -> Result<Vec<Cycle>, BatchError> {
        self.map_worlds(|run| run.cycle())
    }

    /// Returns whether nothing can happen anymore, for each world.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn is_over(&self) -> Result<Vec<bool>, BatchError> {
        self.map_worlds(|run| run.is_over())
    }

    /// Returns the digest of each world; queued orders are not in it.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn digests(&self) -> Result<Vec<Digest>, BatchError> {
        self.map_worlds(|run| run.digest())
    }

    /// Returns the result of `get` for each world by index, computed on the calling thread.
    ///
    /// # Errors
    /// When a world has broken off.
    pub fn map_worlds<T>(&self, get: impl Fn(&dyn Simulation) -> T) -> Result<Vec<T>, BatchError> {
        let mut values = Vec::with_capacity(self.len());
        for index in 0..self.len() {
            let world = self.world(index);
            let run = world.run.as_deref().ok_or_else(|| world.broken_world_error(index))?;
            values.push(get(run));
        }
        Ok(values)
    }

    /// Returns the result of `use_run` for one world, such as a picture of it.
    ///
    /// # Errors
    /// When it has broken off.
    ///
    /// # Panics
    /// When there is no such world.
    pub fn with_world<T>(
        &self,
        index: usize,
        use_run: impl FnOnce(&mut dyn Simulation) -> T,
    ) -> Result<T, BatchError> {
        let mut world = self.world(index);
        match world.run.as_deref_mut() {
            Some(run) => Ok(use_run(run)),
            None => Err(world.broken_world_error(index)),
        }
    }

    fn world(&self, index: usize) -> MutexGuard<'_, BatchWorldEntry> {
        self.shared.world(index)
    }

    /// Errors that the work leaves in a world also raise [`SharedWorlds::has_error`].
    fn for_each_world(
        &mut self,
        work: impl Fn(&mut BatchWorldEntry, usize, &SharedWorlds) + Send + Sync + 'static,
    ) {
        let shared = Arc::clone(&self.shared);
        let work = Arc::new(move |index: usize| {
            let mut world = shared.world(index);
            work(&mut world, index, &shared);
            shared.raise_error_flag(&world);
        });
        let work_on_thread = Arc::clone(&work);
        self.pool.run(self.len(), |index| work(index), work_on_thread);
    }

    /// Returns the error of the first world that has one.
    fn check_errors(&self) -> Result<(), BatchError> {
        if self.shared.has_error.load(Ordering::Relaxed) {
            self.take_first_error(|_| true).map_or(Ok(()), Err)
        } else {
            Ok(())
        }
    }

    /// Returns the error of the first of the selected worlds that has one, and clears the errors of all of them. The
    /// error of a broken world stays, because every later call has to fail with it until the world is restarted.
    fn take_first_error(&self, is_selected: impl Fn(usize) -> bool) -> Option<BatchError> {
        let mut first = None;
        let mut has_error = false;
        for index in 0..self.len() {
            let mut world = self.world(index);
            if is_selected(index)
                && let Some(error) = world.error.clone()
            {
                if world.run.is_some() {
                    world.error = None;
                }
                first = first.or(Some(error));
            }
            has_error |= world.error.is_some();
        }
        self.shared.has_error.store(has_error, Ordering::Relaxed);
        first
    }

    fn no_such_team(&self, team: usize) -> OrderError {
        OrderError::NoTeam { team, teams: self.teams.len() }
    }

    fn check_world_count(
        &self,
        found: Option<usize>,
        what: &'static str,
    ) -> Result<(), BatchError> {
        let worlds = self.len();
        match found {
            Some(found) if found != worlds => Err(BatchError::Count { worlds, what, found }),
            _ => Ok(()),
        }
    }

    /// Checks that the buffers have exactly the size that a team's observations in all worlds need.
    fn check_buffers(
        &self,
        spaces: &[ValueSpace],
        layouts: &[BufferLayout],
        buffers: &[BufferMut<'_>],
    ) -> Result<(), OrderError> {
        let worlds = self.len();
        let fits = buffers.len() == layouts.len()
            && buffers.iter().zip(layouts).all(|(buffer, layout)| {
                buffer.len() == worlds * layout.length
                    && layout.is_integer == matches!(buffer, BufferMut::Integer(_))
            });
        if fits {
            return Ok(());
        }
        let expected = spaces.iter().zip(layouts).map(|(space, layout)| {
            let number_type = if layout.is_integer { "whole" } else { "real" };
            format!("{} of {worlds} x {} {number_type} values", space.name, layout.length)
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
    /// Locks a world. A poisoned lock is fine: a world that panicked has lost its run, so nothing half-done is read.
    fn world(&self, index: usize) -> MutexGuard<'_, BatchWorldEntry> {
        self.worlds[index].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Raises the flag if a world has an error. Relaxed order is enough, because the caller reads the flag after
    /// [`ThreadPool::run`] has waited for all workers.
    fn raise_error_flag(&self, world: &BatchWorldEntry) {
        if world.error.is_some() {
            self.has_error.store(true, Ordering::Relaxed);
        }
    }
}

/// Returns one world's part of the buffers for all worlds.
fn world_slices<'a>(
    buffers: &'a mut [BufferMut<'_>],
    layouts: &[BufferLayout],
    index: usize,
) -> Vec<BufferMut<'a>> {
    let mut slices = Vec::with_capacity(layouts.len());
    for (buffer, layout) in buffers.iter_mut().zip(layouts) {
        let range = index * layout.length..(index + 1) * layout.length;
        slices.push(match buffer {
            BufferMut::Integer(values) => BufferMut::Integer(&mut values[range]),
            BufferMut::Real(values) => BufferMut::Real(&mut values[range]),
        });
    }
    slices
}
