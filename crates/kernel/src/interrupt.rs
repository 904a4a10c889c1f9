//! A request to leave a cycle half done.
//!
//! A run stops in good order between two cycles. But one cycle of many airplanes may take minutes,
//! and no user who ends a run wants to wait for them. So long computations look at an [`Interrupt`]
//! again and again ([`check`]), and when it is raised they unwind. The half-done state is lost; a
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

/// A flag that one thread raises and all workers of a run look at; clones share it.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<InterruptState>);

#[derive(Debug, Default)]
struct InterruptState {
    is_raised: AtomicBool,
    checks: AtomicU64,
}

/// The payload of the unwinding after a look at a raised interrupt.
#[derive(Debug)]
struct InterruptPayload;

/// The payload of the unwinding of a worker whose team has lost another worker.
#[derive(Debug)]
struct WorkerLostPayload;

/// The interrupt that a thread heeds. Each thread counts its own looks, so that workers that look all the
/// time do not wait for each other's cache lines.
#[derive(Debug)]
struct Attachment {
    interrupt: Interrupt,
    checks: u64,
}

thread_local! {
    /// The interrupt that the present computation of this thread heeds.
    static ATTACHMENT: RefCell<Option<Attachment>> = const { RefCell::new(None) };
}

/// Looks at the interrupt that this thread heeds, if it heeds any. A computation calls it at least
/// once in some milliseconds of work, however deep inside it is.
///
/// # Panics
/// When that interrupt is raised. The unwinding prints nothing; [`Interrupt::caused`]
/// distinguishes it from that of a bug.
#[inline]
pub fn check() {
    let is_raised =
        ATTACHMENT.with_borrow_mut(|heeded| heeded.as_mut().is_some_and(Attachment::check));
    if is_raised {
        resume_unwind(Box::new(InterruptPayload));
    }
}

impl Attachment {
    fn check(&mut self) -> bool {
        self.checks += 1;
        self.interrupt.0.is_raised.load(Relaxed)
    }
}

impl Interrupt {
    /// Asks for the end of the work at the next look.
    pub fn raise(&self) {
        self.0.is_raised.store(true, Relaxed);
    }

    /// Lets this thread heed the interrupt until the returned guard is dropped.
    pub fn attach(&self) -> AttachGuard {
        AttachGuard {
            before: ATTACHMENT.replace(Some(Attachment { interrupt: self.clone(), checks: 0 })),
        }
    }

    /// Number of looks by threads that no longer heed it, for tests of the frequency of looks.
    pub fn checks(&self) -> u64 {
        self.0.checks.load(Relaxed)
    }

    /// Returns whether a caught unwinding came from a look at this interrupt, rather than from a
    /// bug.
    pub fn caused(&self, payload: &(dyn Any + Send)) -> bool {
        let is_raised = self.0.is_raised.load(Relaxed);
        is_raised && (payload.is::<InterruptPayload>() || payload.is::<WorkerLostPayload>())
    }
}

/// A while in which a thread heeds an interrupt.
#[derive(Debug)]
pub struct AttachGuard {
    before: Option<Attachment>,
}

impl Drop for AttachGuard {
    fn drop(&mut self) {
        if let Some(Attachment { interrupt, checks: looks }) =
            ATTACHMENT.replace(self.before.take())
        {
            interrupt.0.checks.fetch_add(looks, Relaxed);
        }
    }
}

/// Unwinds a worker that would wait for another one forever, without a message: the other one has
/// printed the reason, if there is anything to print.
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
                worker.barrier();
            };
            let run = || workers::run(&mut vec![(); workers], work);
            let payload = catch_unwind(AssertUnwindSafe(run)).expect_err("it unwinds");
            assert!(interrupt.checks() >= u64::from(raises));
            interrupt.caused(payload.as_ref())
        };
        for workers in [1, 3] {
            assert!(caught(true, workers));
            assert!(!caught(false, workers));
        }
        // Nothing is heeded any longer.
        check();
    }
}
