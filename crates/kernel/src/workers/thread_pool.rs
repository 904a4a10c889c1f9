//! Workers that wait between calls, for calls that take less time than starting threads.

use super::CachePadded;
use crate::interrupt::unwind_worker_lost;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Numbers in the largest chunk that a worker takes at once.
const MAX_CHUNK: usize = 8;
/// Number of times that a worker looks for a call before it sleeps: some 50 us. Falling asleep and being woken takes
/// as long as a small call, and callers come with the next one at once; each look yields the processor to any other
/// thread.
const POLLS_BEFORE_SLEEP: usize = 100;

/// A task that any worker does for some numbers.
pub type Job = Arc<dyn Fn(usize) + Send + Sync>;

/// A caller and W - 1 threads, which are started at the first call and wait between calls, asleep after a short
/// while.
#[derive(Debug)]
pub struct ThreadPool {
    workers: usize,
    /// None before the first call.
    threads: Option<Threads>,
}

/// Threads of one process: a forked child of it has none of them.
#[derive(Debug)]
struct Threads {
    process: u32,
    shared: Arc<PoolState>,
}

#[derive(Debug)]
struct PoolState {
    call: Mutex<Call>,
    called: Condvar,
    done: Condvar,
    /// The number of the present call, beside the lock.
    number: AtomicU64,
    /// Threads that have begun and not ended their part.
    working: AtomicUsize,
    /// The next number of each worker's share.
    cursors: Vec<CachePadded>,
    is_broken: AtomicBool,
}

/// The present call, or the last one.
#[derive(Default)]
struct Call {
    number: u64,
    n: usize,
    /// `None` when it is over; a thread that comes later goes back to sleep.
    task: Option<Job>,
    is_last: bool,
}

impl std::fmt::Debug for Call {
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

    /// Number of workers.
    pub fn workers(&self) -> usize {
        self.workers
    }

    /// Does every number of `0..n` once, and returns when all are done: `own` those that fall to the calling
    /// thread, `task` the others. Each worker begins with a share of its own, the same in each call, and
    /// then helps with the others' shares.
    ///
    /// # Panics
    /// When `own` or `task` panicked (a bug), or the system cannot start a thread.
    pub fn run(&mut self, n: usize, mut own: impl FnMut(usize), task: Job) {
        if self.workers == 1 || n <= 1 {
            return (0..n).for_each(own);
        }
        let shared = Arc::clone(&self.threads().shared);
        shared.start(n, task);
        // Also awaited where `own` unwinds, because the threads work with data that the caller has lent them.
        let awaited = JoinGuard(&shared);
        shared.work(0, n, &mut own);
        drop(awaited);
        if shared.is_broken.load(Ordering::Relaxed) {
            self.threads = None;
            unwind_worker_lost();
        }
    }

    fn threads(&mut self) -> &Threads {
        let process = std::process::id();
        let is_here = self.threads.as_ref().is_some_and(|crew| crew.process == process);
        let is_broken = |crew: &Threads| crew.shared.is_broken.load(Ordering::Relaxed);
        if is_here && self.threads.as_ref().is_some_and(is_broken) {
            // The last call unwound, and some of its threads are gone.
            self.threads = None;
        }
        if !is_here && let Some(lost) = self.threads.take() {
            // The threads belong to the parent: its locks may be held in this copy forever.
            std::mem::forget(lost);
        }
        let workers = self.workers;
        self.threads.get_or_insert_with(|| Threads::new(workers, process))
    }
}

impl Threads {
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
                .spawn(move || shared.run_jobs(index))
                .expect("the system can start a thread");
        }
        Self { process, shared }
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.shared.call().is_last = true;
        self.shared.called.notify_all();
    }
}

impl PoolState {
    fn call(&self) -> MutexGuard<'_, Call> {
        self.call.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls all threads.
    fn start(&self, n: usize, task: Job) {
        self.cursors.iter().for_each(|cursor| cursor.0.store(0, Ordering::Relaxed));
        let mut call = self.call();
        call.number += 1;
        (call.n, call.task) = (n, Some(task));
        self.number.store(call.number, Ordering::Release);
        drop(call);
        self.called.notify_all();
    }

    /// A thread's life: call after call.
    fn run_jobs(&self, index: usize) {
        let mut seen = 0;
        loop {
            poll_until(|| self.number.load(Ordering::Acquire) != seen);
            let mut call = self.call();
            while (call.number == seen || call.task.is_none()) && !call.is_last {
                call = self.called.wait(call).unwrap_or_else(PoisonError::into_inner);
            }
            let (n, Some(task), false) = (call.n, call.task.clone(), call.is_last) else { return };
            self.working.fetch_add(1, Ordering::Relaxed);
            seen = call.number;
            drop(call);
            let _ended = CompletionGuard(self);
            self.work(index, n, &mut |k| task(k));
            // Before the end is reported: after it no thread holds a caller's data.
            drop(task);
        }
    }

    /// Does one worker's share, and then the remaining parts of the others'.
    fn work(&self, index: usize, n: usize, task: &mut dyn FnMut(usize)) {
        let size = self.cursors.len();
        let chunk = (n / (size * 8)).clamp(1, MAX_CHUNK);
        for k in 0..size {
            let owner = (index + k) % size;
            let (start, end) = (n * owner / size, n * (owner + 1) / size);
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

/// Checks a condition a number of times.
fn poll_until(mut is_so: impl FnMut() -> bool) {
    for _ in 0..POLLS_BEFORE_SLEEP {
        if is_so() {
            return;
        }
        std::thread::yield_now();
    }
}

/// A guard that reports the end of a thread's part, also after a panic.
struct CompletionGuard<'a>(&'a PoolState);

impl Drop for CompletionGuard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.is_broken.store(true, Ordering::Relaxed);
        }
        if self.0.working.fetch_sub(1, Ordering::Release) == 1 {
            // Under the lock, so that a caller that is about to sleep is not missed.
            drop(self.0.call());
            self.0.done.notify_all();
        }
    }
}

/// A guard that waits until all threads that have begun have ended their part.
struct JoinGuard<'a>(&'a PoolState);

impl Drop for JoinGuard<'_> {
    fn drop(&mut self) {
        // Nothing is left to do: a thread that has not begun, because its processor has other work, is not waited
        // for.
        self.0.call().task = None;
        let is_done = || self.0.working.load(Ordering::Acquire) == 0;
        poll_until(is_done);
        let mut call = self.0.call();
        while !is_done() {
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
