//! The only place that names threads: W workers, their pools of tasks, and the barrier.
//!
//! A pool holds the numbers `0..n`. Each worker has a share of it, takes chunks of its own share
//! first (its caches still hold those bodies) and then helps with the others' shares, so the load
//! balances itself and no worker waits for a lock. A single worker runs the very same code on the
//! calling thread; it takes the pool from front to back, never waits, and makes no system
//! call.
//!
//! The threads of a [`ThreadPool`] live on between calls.

mod thread_pool;

pub use thread_pool::{Job, ThreadPool};

use crate::interrupt::unwind_worker_lost;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

/// Pools that may be in use at the same time: a pool's cursors are reset by
/// the next pool but one, when no worker reads them anymore. Three would do; a power of two makes the
/// remainder a mask.
const POOLS: usize = 4;

/// Numbers in the largest chunk of a pool: bodies enough that taking a chunk costs nothing beside them.
const MAX_CHUNK: usize = 64;
/// Chunks of each worker's share at least, so that the others find some work to take over.
const MIN_CHUNKS_PER_SHARE: usize = 8;

/// Spins before a waiting worker yields its processor: 10 to 200 us, by the processor. That is longer than workers wait
/// for each other at the end of a balanced phase, so that they make no system call.
const SPINS_BEFORE_YIELD: u32 = 4_000;
/// Yields before a waiting worker sleeps: with more workers than processors, each yield lets one of the others go on,
/// and waking a sleeper takes a system call.
const YIELDS_BEFORE_SLEEP: u32 = 200;

/// Returns the number of processors that this process may use, at least 1. The answer takes system
/// calls that read files, so ask once.
pub fn available_workers() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// Runs `work` once on each of `states.len()` workers at the same time, each with its own
/// element of `states`, and returns when all are done. The calling thread is worker 0.
///
/// # Panics
/// When a worker panicked (a bug); the others are released first.
pub fn run<S: Send>(states: &mut [S], work: impl Fn(&Worker<'_>, &mut S) + Sync) {
    match states {
        [] => {}
        [only] => work(&Worker::ALONE, only),
        _ => WorkerTeam::new(states.len()).run(states, &work, &work),
    }
}

/// One of the workers of a [`run`].
#[derive(Debug)]
pub struct Worker<'a> {
    /// `None` for a lone worker.
    team: Option<&'a WorkerTeam>,
    index: usize,
}

impl Worker<'_> {
    /// The only worker of a run.
    pub(crate) const ALONE: Worker<'static> = Worker { team: None, index: 0 };

    /// This worker's number, from 0.
    pub fn index(&self) -> usize {
        self.index
    }

    /// Number of workers in the team, this one included.
    pub fn team_size(&self) -> usize {
        self.team.map_or(1, WorkerTeam::size)
    }

    /// Takes chunks of `0..n` until none is left. All workers call it with the same `pool`
    /// and `n`; every number is handed out exactly once. `pool` counts the calls: 0, 1, 2...
    #[inline]
    pub fn for_each_chunk(&self, pool: u64, n: usize, mut task: impl FnMut(Range<usize>)) {
        let Some(team) = self.team else {
            return (0..n).step_by(MAX_CHUNK).for_each(|from| task(from..n.min(from + MAX_CHUNK)));
        };
        let size = team.size();
        // No worker uses the cursors of the next pool but one now, so they can be reset without a
        // barrier.
        team.chunk_cursor((pool + 2) % POOLS as u64, self.index).store(0, Ordering::Relaxed);
        let chunk = (n / (size * MIN_CHUNKS_PER_SHARE)).clamp(1, MAX_CHUNK);
        for k in 0..size {
            let owner = (self.index + k) % size;
            let start = n * owner / size;
            let end = n * (owner + 1) / size;
            let cursor = team.chunk_cursor(pool % POOLS as u64, owner);
            loop {
                let from = start + cursor.fetch_add(chunk, Ordering::Relaxed);
                if from >= end {
                    break;
                }
                task(from..end.min(from + chunk));
            }
        }
    }

    /// Waits until every worker has arrived; all writes before it are visible to every worker after it.
    ///
    /// # Panics
    /// When another worker panicked.
    #[inline]
    pub fn wait_at_barrier(&self) {
        if let Some(team) = self.team {
            team.barrier.wait(team.size as u32, team.spins);
        }
    }

    /// Returns whether `own` is true for any worker. All must call it, because it waits for all.
    pub fn any_worker(&self, own: bool) -> bool {
        let Some(WorkerTeam { votes, .. }) = self.team else { return own };
        if own {
            votes.fetch_add(1, Ordering::Relaxed);
        }
        self.wait_at_barrier();
        let any = votes.load(Ordering::Relaxed) > 0;
        // No vote may be withdrawn before all workers have read the count.
        self.wait_at_barrier();
        if own {
            votes.fetch_sub(1, Ordering::Relaxed);
        }
        any
    }
}

/// A counter on cache lines of its own, so that workers do not slow each other down. On two of 64 bytes, because
/// processors fetch lines in pairs.
#[derive(Debug, Default)]
#[repr(align(128))]
struct CachePadded(AtomicUsize);

/// The shared data of workers that run together. It outlives a run and serves the next one.
#[derive(Debug)]
pub(crate) struct WorkerTeam {
    size: usize,
    /// `POOLS` cursors per worker.
    cursors: Vec<CachePadded>,
    barrier: Barrier,
    /// Number of workers that answer yes, see [`Worker::any_worker`].
    votes: AtomicUsize,
    /// 0 where there are more workers than processors: spinning would keep the others from working.
    spins: u32,
}

impl WorkerTeam {
    /// Creates a team of `size` workers. Asks the system for the number of its processors.
    pub(crate) fn new(size: usize) -> Self {
        Self {
            size,
            cursors: (0..size * POOLS).map(|_| CachePadded::default()).collect(),
            barrier: Barrier::default(),
            votes: AtomicUsize::new(0),
            spins: if size <= available_workers() { SPINS_BEFORE_YIELD } else { 0 },
        }
    }

    fn size(&self) -> usize {
        self.size
    }

    /// Runs `lead` on the calling thread as worker 0 and `work` on a thread for each other
    /// worker, each with its own element of `states`, and returns when all are done.
    ///
    /// # Panics
    /// When a worker panicked (a bug), or when `states` has not one element per worker.
    pub(crate) fn run<S: Send>(
        &mut self,
        states: &mut [S],
        lead: impl FnOnce(&Worker<'_>, &mut S),
        work: impl Fn(&Worker<'_>, &mut S) + Sync,
    ) {
        assert_eq!(states.len(), self.size, "one element per worker");
        self.reset();
        let team = &*self;
        let work = &work;
        let Some((first, others)) = states.split_first_mut() else { return };
        std::thread::scope(|scope| {
            // Here too, so that workers that wait do not hang when a thread cannot be started.
            let _release = ReleaseOnPanic(team);
            for (i, own) in others.iter_mut().enumerate() {
                std::thread::Builder::new()
                    .name(format!("worker {}", i + 1))
                    .spawn_scoped(scope, move || {
                        let _release = ReleaseOnPanic(team);
                        work(&Worker { team: Some(team), index: i + 1 }, own);
                    })
                    .expect("the system can start a thread");
            }
            lead(&Worker { team: Some(team), index: 0 }, first);
        });
    }

    /// Resets the cursors because pools are counted from 0 in each run, and all the rest because a
    /// run that panicked left it in disorder.
    fn reset(&mut self) {
        self.cursors.iter_mut().for_each(|cursor| *cursor.0.get_mut() = 0);
        *self.votes.get_mut() = 0;
        self.barrier = Barrier::default();
    }

    #[inline]
    fn chunk_cursor(&self, pool: u64, worker: usize) -> &AtomicUsize {
        &self.cursors[worker * POOLS + pool as usize].0
    }
}

/// A barrier at which workers spin, then yield, then sleep.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Barrier {
    /// Workers that have arrived in the present generation.
    arrived: AtomicU32,
    /// Number of times that all workers have passed.
    generation: AtomicU32,
    /// Whether a worker has panicked.
    broken: AtomicBool,
    /// Workers that wait for `wake`.
    sleepers: AtomicU32,
    sleeping: Mutex<()>,
    wake: Condvar,
}

impl Barrier {
    #[inline]
    fn wait(&self, size: u32, spins: u32) {
        let generation = self.generation.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == size {
            self.arrived.store(0, Ordering::Relaxed);
            self.release_generation(generation.wrapping_add(1));
        } else {
            self.wait_for_generation(generation, spins);
        }
        if self.broken.load(Ordering::Relaxed) {
            unwind_worker_lost();
        }
    }

    /// Ends the present generation, and wakes its sleepers.
    fn release_generation(&self, next: u32) {
        // Both sides store first and then read the other's word (SeqCst), so either the sleeper
        // sees the new generation or this worker sees the sleeper.
        self.generation.store(next, Ordering::SeqCst);
        if self.sleepers.load(Ordering::SeqCst) > 0 {
            // A sleeper between its last check and its wait holds the lock: after it the sleeper is woken.
            drop(self.sleeping.lock().unwrap_or_else(PoisonError::into_inner));
            self.wake.notify_all();
        }
    }

    /// Waits until a generation has ended, in three steps of which each uses less processor time than the one before,
    /// and takes longer to wake up.
    fn wait_for_generation(&self, generation: u32, spins: u32) {
        for _ in 0..spins {
            if self.has_generation_ended(generation) {
                return;
            }
            std::hint::spin_loop();
        }
        for _ in 0..YIELDS_BEFORE_SLEEP {
            if self.has_generation_ended(generation) {
                return;
            }
            std::thread::yield_now();
        }
        let mut guard = self.sleeping.lock().unwrap_or_else(PoisonError::into_inner);
        self.sleepers.fetch_add(1, Ordering::SeqCst);
        while !self.has_generation_ended(generation) {
            guard = self.wake.wait(guard).unwrap_or_else(PoisonError::into_inner);
        }
        self.sleepers.fetch_sub(1, Ordering::SeqCst);
    }

    /// Returns whether nothing is left to wait for. A worker that arrives after a panic must not wait either: its
    /// generation never ends.
    #[inline]
    fn has_generation_ended(&self, generation: u32) -> bool {
        self.generation.load(Ordering::SeqCst) != generation || self.broken.load(Ordering::SeqCst)
    }
}

/// Releases the other workers when one panics, so that a bug ends the run instead of hanging it.
struct ReleaseOnPanic<'a>(&'a WorkerTeam);

impl Drop for ReleaseOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let barrier = &self.0.barrier;
            barrier.broken.store(true, Ordering::SeqCst);
            barrier.release_generation(barrier.generation.load(Ordering::SeqCst).wrapping_add(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    #[test]
    fn every_task_is_done_once_in_every_pool_for_any_team() {
        for team in [1, 2, 3, 8] {
            for n in [0, 1, 7, 1000] {
                let done: Vec<AtomicU64> = (0..n).map(|_| AtomicU64::new(0)).collect();
                run(&mut vec![(); team], |worker, ()| {
                    for pool in 0..9 {
                        worker.for_each_chunk(pool, n, |range| {
                            for i in range {
                                // Barriers: all have done pool k before any starts k + 1.
                                assert_eq!(done[i].fetch_add(1, Ordering::Relaxed), pool);
                            }
                        });
                        worker.wait_at_barrier();
                    }
                });
                assert!(done.iter().all(|d| d.load(Ordering::Relaxed) == 9));
            }
        }
    }

    #[test]
    fn a_team_serves_run_after_run_and_survives_a_panic() {
        let mut team = WorkerTeam::new(2);
        for runs in 0..4 {
            let done = AtomicU64::new(0);
            let work = |worker: &Worker<'_>, (): &mut ()| {
                for pool in 0..=runs {
                    worker.for_each_chunk(pool, 10, |range| {
                        done.fetch_add(range.len() as u64, Ordering::Relaxed);
                    });
                    worker.wait_at_barrier();
                }
            };
            team.run(&mut [(); 2], work, work);
            assert_eq!(done.into_inner(), 10 * (runs + 1));
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                team.run(
                    &mut [(); 2],
                    |_, ()| panic!("a bug"),
                    |worker, ()| worker.wait_at_barrier(),
                );
            }));
            assert!(outcome.is_err());
        }
    }

    #[test]
    fn any_is_the_same_answer_for_all() {
        for team in [1, 2, 5] {
            run(&mut vec![(); team], |worker, ()| {
                for round in 0..20 {
                    let own = round % 3 == 0 && worker.index() == round % team;
                    assert_eq!(worker.any_worker(own), round % 3 == 0);
                }
            });
        }
    }

    #[test]
    fn a_panic_in_one_worker_ends_the_run_for_all() {
        let outcome = std::panic::catch_unwind(|| {
            run(&mut [(); 3], |worker, ()| {
                assert!(worker.index() != 1, "a bug");
                worker.wait_at_barrier();
            });
        });
        assert!(outcome.is_err());
    }

    #[test]
    fn a_worker_that_comes_after_a_panic_does_not_wait() {
        let outcome = std::panic::catch_unwind(|| {
            run(&mut [(); 2], |worker, ()| {
                assert!(worker.index() != 1, "a bug");
                std::thread::sleep(std::time::Duration::from_millis(20));
                worker.wait_at_barrier();
            });
        });
        assert!(outcome.is_err());
    }

    #[test]
    fn sleepers_are_woken() {
        run(&mut [(); 2], |worker, ()| {
            for _ in 0..3 {
                if worker.index() == 0 {
                    std::thread::sleep(std::time::Duration::from_millis(20));
                }
                worker.wait_at_barrier();
            }
        });
    }
}
