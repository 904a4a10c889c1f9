//! Workers that wait between calls, for calls that take less time than starting threads.

use super::CachePadded;
use crate::interrupt::unwind_worker_lost;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Numbers in the largest chunk that a worker takes at once: each is a whole world, with many cycles of work.
const MAX_CHUNK: usize = 8;
/// Chunks of each worker's share at least, so that the others find some work to take over.
const MIN_CHUNKS_PER_SHARE: usize = 8;
/// Number of times that a worker polls for a call before it sleeps: some 50 us. Falling asleep and being woken takes
/// as long as a small call, and callers make the next one at once; each poll yields the processor to any other
/// thread.
const POLLS_BEFORE_SLEEP: usize = 100;

/// A task that any worker does for some numbers.
pub type Job = Arc<dyn Fn(usize) + Send + Sync>;

/// A caller and W - 1 threads, which are started at the first call and wait between calls, asleep after some
/// microseconds.
#[derive(Debug)]
pub struct ThreadPool {
    workers: usize,
    /// None before the first call.
    threads: Option<PoolThreads>,
}

/// Threads of one process: a forked child of it has none of them.
#[derive(Debug)]
struct PoolThreads {
    process: u32,
    shared: Arc<PoolState>,
}

#[derive(Debug)]
struct PoolState {
    call: Mutex<PoolCall>,
    called: Condvar,
    done: Condvar,
    /// The number of the present call, outside of the lock for polling.
    number: AtomicU64,
    /// Threads that have started and not finished their part.
    working: AtomicUsize,
    /// The next number of each worker's share.
    cursors: Vec<CachePadded>,
    is_broken: AtomicBool,
}

/// The present call, or the last one.
#[derive(Default)]
struct PoolCall {
    number: u64,
    n: usize,
    /// `None` when it is over; a thread that wakes later goes back to sleep.
    task: Option<Job>,
    is_last: bool,
}

impl std::fmt::Debug for PoolCall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { number, n, is_last, .. } = self;
        write!(f, "Call({number}, {n} tasks, last: {is_last})")
    }
}

impl ThreadPool {
    /// Returns `workers` workers (at least 1), one of which is the calling thread.
    pub fn new(workers: usize) -> Self {
        Self { workers: workers.max(1), threads: None }
    }

    /// Number of workers, the calling thread included.
    pub fn workers(&self) -> usize {
        self.workers
    }

    /// Does every number of `0..n` once, and returns when all are done: the calling thread by `own_task`, the others by
    /// `task`. Each worker starts with a share of its own, the same in each call, because its caches may still hold
    /// that data, and then helps with the others' shares.
    ///
    /// # Panics
    /// When `own_task` or `task` panicked (a bug), or the system cannot start a thread.
    pub fn run(&mut self, n: usize, mut own_task: impl FnMut(usize), task: Job) {
        if self.workers == 1 || n <= 1 {
            return (0..n).for_each(own_task);
        }
        let shared = Arc::clone(&self.ensure_threads().shared);
        shared.publish_job(n, task);
        // A guard, because the threads must be done with the caller's data also when `own_task` unwinds.
        let guard = CompletionWaitGuard(&shared);
        shared.do_share(0, n, &mut own_task);
        drop(guard);
        if shared.is_broken.load(Ordering::Relaxed) {
            self.threads = None;
            unwind_worker_lost();
        }
    }

    fn ensure_threads(&mut self) -> &PoolThreads {
        let process = std::process::id();
        if let Some(threads) = self.threads.take() {
            if threads.process != process {
                // This is a forked child, and the threads are the parent's: its locks may be held in this copy
                // forever, so dropping could hang.
                std::mem::forget(threads);
            } else if !threads.shared.is_broken.load(Ordering::Relaxed) {
                self.threads = Some(threads);
            }
            // Otherwise the last call unwound, and some of its threads are gone.
        }
        let workers = self.workers;
        self.threads.get_or_insert_with(|| PoolThreads::new(workers, process))
    }
}

impl PoolThreads {
    fn new(workers: usize, process: u32) -> Self {
        let shared = Arc::new(PoolState {
            call: Mutex::default(),
            called: Condvar::new(),
            done: Condvar::new(),
            number: AtomicU64::new(0),
            working: AtomicUsize::new(0),
            cursors: (0..workers).map(|_| CachePadded::default()).collect(),
            is_broken: AtomicBool::new(false),
        });
        for index in 1..workers {
            let shared = Arc::clone(&shared);
            std::thread::Builder::new()
                .name(format!("worker {index}"))
                .spawn(move || shared.run_thread_loop(index))
                .expect("the system can start a thread");
        }
        Self { process, shared }
    }
}

impl Drop for PoolThreads {
    fn drop(&mut self) {
        self.shared.lock_call().is_last = true;
        self.shared.called.notify_all();
    }
}

impl PoolState {
    fn lock_call(&self) -> MutexGuard<'_, PoolCall> {
        self.call.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Resets the cursors before the call is visible, and wakes the threads.
    fn publish_job(&self, n: usize, task: Job) {
        self.cursors.iter().for_each(|cursor| cursor.0.store(0, Ordering::Relaxed));
        let mut call = self.lock_call();
        call.number += 1;
        call.n = n;
        call.task = Some(task);
        self.number.store(call.number, Ordering::Release);
        drop(call);
        self.called.notify_all();
    }

    /// Runs call after call on a thread, until the pool is dropped.
    fn run_thread_loop(&self, index: usize) {
        let mut last_number = 0;
        loop {
            poll_briefly(|| self.number.load(Ordering::Acquire) != last_number);
            let mut call = self.lock_call();
            while (call.number == last_number || call.task.is_none()) && !call.is_last {
                call = self.called.wait(call).unwrap_or_else(PoisonError::into_inner);
            }
            if call.is_last {
                return;
            }
            let n = call.n;
            let Some(task) = call.task.clone() else { return };
            self.working.fetch_add(1, Ordering::Relaxed);
            last_number = call.number;
            drop(call);
            let _guard = CompletionGuard(self);
            self.do_share(index, n, &mut |k| task(k));
            // Before the guard reports completion: after it no thread holds a caller's data.
            drop(task);
        }
    }

    /// Returns whether no thread works on a call.
    fn is_idle(&self) -> bool {
        self.working.load(Ordering::Acquire) == 0
    }

    /// Does one worker's share, and then the remaining parts of the others'.
    fn do_share(&self, index: usize, n: usize, task: &mut dyn FnMut(usize)) {
        let size = self.cursors.len();
        let chunk = (n / (size * MIN_CHUNKS_PER_SHARE)).clamp(1, MAX_CHUNK);
        for k in 0..size {
            let owner = (index + k) % size;
            let start = n * owner / size;
            let end = n * (owner + 1) / size;
            let cursor: &AtomicUsize = &self.cursors[owner].0;
            loop {
                let from = start + cursor.fetch_add(chunk, Ordering::Relaxed);
                if from >= end {
                    break;
                }
                (from..end.min(from + chunk)).for_each(&mut *task);
            }
        }
    }
}

/// Returns early if a condition holds; callers check it again under the lock, and sleep if it does not.
fn poll_briefly(mut condition: impl FnMut() -> bool) {
    for _ in 0..POLLS_BEFORE_SLEEP {
        if condition() {
            return;
        }
        std::thread::yield_now();
    }
}

/// A guard that reports that a thread has finished its part, also after a panic.
struct CompletionGuard<'a>(&'a PoolState);

impl Drop for CompletionGuard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.is_broken.store(true, Ordering::Relaxed);
        }
        if self.0.working.fetch_sub(1, Ordering::Release) == 1 {
            // Under the lock, so that a caller that is about to sleep is not missed.
            drop(self.0.lock_call());
            self.0.done.notify_all();
        }
    }
}

/// A guard that waits until all threads that have started have finished their part.
struct CompletionWaitGuard<'a>(&'a PoolState);

impl Drop for CompletionWaitGuard<'_> {
    fn drop(&mut self) {
        // All numbers are taken: a thread that has not started, because its processor has other work, would find
        // nothing to do, and is not waited for.
        self.0.lock_call().task = None;
        poll_briefly(|| self.0.is_idle());
        let mut call = self.0.lock_call();
        while !self.0.is_idle() {
            call = self.0.done.wait(call).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    #[test]
    fn every_number_is_done_once_in_every_call() {
        for workers in [1, 2, 3, 8] {
            let mut waiting = ThreadPool::new(workers);
            for n in [0, 1, 2, 7, 300, 7] {
                let done: Arc<Vec<AtomicU64>> =
                    Arc::new((0..n).map(|_| AtomicU64::new(0)).collect());
                let count = |done: &[AtomicU64], k: usize| {
                    done[k].fetch_add(1, Ordering::Relaxed);
                };
                let theirs = Arc::clone(&done);
                waiting.run(n, |k| count(&done, k), Arc::new(move |k| count(&theirs, k)));
                assert!(done.iter().all(|done| done.load(Ordering::Relaxed) == 1));
            }
        }
    }

    #[test]
    fn nothing_of_a_call_is_kept_when_it_returns() {
        let mut waiting = ThreadPool::new(3);
        let lent = Arc::new(());
        for _ in 0..50 {
            let theirs = Arc::clone(&lent);
            waiting.run(20, |_| (), Arc::new(move |_| drop(Arc::clone(&theirs))));
            assert_eq!(Arc::strong_count(&lent), 1);
        }
    }

    #[test]
    fn a_bug_reaches_the_caller_and_the_next_call_works() {
        let mut waiting = ThreadPool::new(3);
        let fails = |k: usize| assert!(k > 1000, "a bug");
        for _ in 0..3 {
            let run = || waiting.run(100, fails, Arc::new(fails));
            assert!(catch_unwind(AssertUnwindSafe(run)).is_err());
            let done = Arc::new(AtomicU64::new(0));
            let count = |done: &AtomicU64| {
                done.fetch_add(1, Ordering::Relaxed);
            };
            let theirs = Arc::clone(&done);
            waiting.run(100, |_| count(&done), Arc::new(move |_| count(&theirs)));
            assert_eq!(done.load(Ordering::Relaxed), 100);
        }
    }
}
