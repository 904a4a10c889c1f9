//! A request to abandon a cycle before it is done.
//!
//! A run stops in good order between two cycles. But one cycle of many airplanes may take minutes,
//! and no user who ends a run wants to wait for them. So long computations poll an [`Interrupt`]
//! ([`check`]), and unwind once it is raised. The half-done state is lost; a
//! recorded run continues from its last checkpoint, as after a kill.
//!
//! The engine attaches the interrupt of a run to the threads of its workers for the time of a call, so
//! that it need not be passed to loops deep inside a world. Nothing else is attached to threads. This is safe because
//! no result depends on an interrupt: a cycle is either done, or there is no state after it.

use std::any::Any;
use std::cell::RefCell;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// A flag that one thread raises and all workers of a run poll; clones share it.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<InterruptState>);

#[derive(Debug, Default)]
struct InterruptState {
    is_raised: AtomicBool,
    checks: AtomicU64,
}

/// The payload of the unwinding that a raised interrupt starts.
#[derive(Debug)]
struct InterruptPayload;

/// The payload of the unwinding of a worker whose team has lost another worker.
#[derive(Debug)]
struct WorkerLostPayload;

/// The interrupt that a thread polls. Each thread counts its own checks, so that workers that check all the
/// time do not wait for each other's cache lines.
#[derive(Debug)]
struct ThreadInterrupt {
    interrupt: Interrupt,
    checks: u64,
}

thread_local! {
    /// The interrupt that the present computation of this thread polls.
    static ATTACHMENT: RefCell<Option<ThreadInterrupt>> = const { RefCell::new(None) };
}

/// Checks the interrupt attached to this thread, if any. A computation calls it at least
/// once in some milliseconds of work, at any depth of calls.
///
/// # Panics
/// When that interrupt is raised. The unwinding prints nothing; [`Interrupt::has_caused_unwind`]
/// distinguishes it from that of a bug.
#[inline]
pub fn check() {
    let is_raised = ATTACHMENT
        .with_borrow_mut(|attached| attached.as_mut().is_some_and(ThreadInterrupt::check));
    if is_raised {
        resume_unwind(Box::new(InterruptPayload));
    }
}

impl ThreadInterrupt {
    fn check(&mut self) -> bool {
        self.checks += 1;
        self.interrupt.0.is_raised.load(Relaxed)
    }
}

impl Interrupt {
    /// Ends the work at the next check.
    pub fn raise(&self) {
        self.0.is_raised.store(true, Relaxed);
    }

    /// Attaches the interrupt to this thread until the returned guard is dropped.
    pub fn attach(&self) -> InterruptGuard {
        let attachment = ThreadInterrupt { interrupt: self.clone(), checks: 0 };
        InterruptGuard { previous: ATTACHMENT.replace(Some(attachment)) }
    }

    /// Number of checks by threads from which it was detached, for tests of the frequency of checks.
    pub fn total_checks(&self) -> u64 {
        self.0.checks.load(Relaxed)
    }

    /// Returns whether a caught unwinding came from a check of this interrupt, rather than from a
    /// bug.
    pub fn has_caused_unwind(&self, payload: &(dyn Any + Send)) -> bool {
        let is_raised = self.0.is_raised.load(Relaxed);
        // The calling thread may unwind at a barrier, because another worker was the first to check.
        is_raised && (payload.is::<InterruptPayload>() || payload.is::<WorkerLostPayload>())
    }
}

/// Keeps an interrupt attached to the thread until it is dropped.
#[derive(Debug)]
pub struct InterruptGuard {
    /// The attachment to restore.
    previous: Option<ThreadInterrupt>,
}

impl Drop for InterruptGuard {
    fn drop(&mut self) {
        if let Some(ThreadInterrupt { interrupt, checks }) =
            ATTACHMENT.replace(self.previous.take())
        {
            interrupt.0.checks.fetch_add(checks, Relaxed);
        }
    }
}

/// Unwinds a worker that would wait forever for one that has panicked, without a message: the other one has
/// printed the reason, unless it was interrupted.
pub(crate) fn unwind_worker_lost() -> ! {
    resume_unwind(Box::new(WorkerLostPayload))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workers;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    #[test]
    fn a_raised_interrupt_ends_all_workers_and_is_told_from_a_bug() {
        let caught = |raises: bool, workers: usize| {
            let interrupt = Interrupt::default();
            let work = |worker: &workers::Worker<'_>, (): &mut ()| {
                let _heeded = interrupt.attach();
                check();
                if worker.index() + 1 == workers && raises {
                    interrupt.raise();
                    check();
                }
                assert!(worker.index() + 1 < workers, "a bug");
                worker.wait_at_barrier();
            };
            let run = || workers::run(&mut vec![(); workers], work);
            let payload = catch_unwind(AssertUnwindSafe(run)).expect_err("it unwinds");
            assert!(interrupt.total_checks() >= u64::from(raises));
            interrupt.has_caused_unwind(payload.as_ref())
        };
        for workers in [1, 3] {
            assert!(caught(true, workers));
            assert!(!caught(false, workers));
        }
        // Nothing is heeded any longer.
        check();
    }
}
