//! Trials -> results, many at once: the one scheduler of sweeps.

use sidestep_kernel::workers;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Takes a result: once it returns, the trial is finished.
pub type ResultSink<'a, T, E> = dyn FnMut(T) -> Result<(), E> + Send + 'a;

/// Results are taken one at a time, and a failure ends all workers before their next trial.
struct SharedState<'a, 'b, T, E> {
    take: &'a mut ResultSink<'b, T, E>,
    failure: Option<E>,
}

/// Runs the trials, `at_once` at a time and as far as possible in order, and passes every result on
/// as it arrives. `run` returns `None` if a trial was interrupted.
///
/// # Errors
/// The first error of `run` or `take`; no trial starts after that.
pub fn run_trials<C: Sync, T: Send, E: Send>(
    trials: &[C],
    at_once: usize,
    run: impl Fn(&C) -> Option<Result<T, E>> + Sync,
    take: &mut ResultSink<'_, T, E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let shared = Mutex::new(SharedState { take, failure: None });
    // Workers have no state of their own.
    let mut states = vec![(); at_once.clamp(1, trials.len().max(1))];
    workers::run(&mut states, |_, ()| {
        while let Some(trial) = trials.get(next.fetch_add(1, Ordering::Relaxed)) {
            if lock(&shared).failure.is_some() {
                return;
            }
            // No thread holds the lock while a run is in progress.
            let Some(result) = run(trial) else { return };
            let mut shared = lock(&shared);
            if let Err(failure) = result.and_then(|result| (shared.take)(result)) {
                shared.failure.get_or_insert(failure);
                return;
            }
        }
    });
    match lock(&shared).failure.take() {
        Some(failure) => Err(failure),
        None => Ok(()),
    }
}

/// Locks, also after a worker has panicked: one that panics outside of a run has left the values intact.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_trial_is_run_once_for_any_number_of_workers() {
        for at_once in [0, 1, 2, 5] {
            for count in [0, 1, 3, 100] {
                let trials: Vec<u32> = (0..count).collect();
                let mut done = Vec::new();
                let run = |trial: &u32| Some(Ok::<_, ()>(trial * trial));
                let ended = run_trials(&trials, at_once, run, &mut |result| {
                    done.push(result);
                    Ok(())
                });
                done.sort_unstable();
                assert_eq!((ended, done), (Ok(()), trials.iter().map(|n| n * n).collect()));
            }
        }
    }

    #[test]
    fn the_first_failure_ends_all_and_a_trial_that_is_broken_off_ends_its_worker() {
        let trials: Vec<u32> = (0..100).collect();
        let mut taken = 0;
        let mut take = |_| {
            taken += 1;
            Ok(())
        };
        let fails = |trial: &u32| Some(if *trial == 3 { Err("full") } else { Ok(*trial) });
        assert_eq!(run_trials(&trials, 1, fails, &mut take), Err("full"));
        let stops = |trial: &u32| (*trial < 2).then_some(Ok::<_, &str>(*trial));
        assert_eq!(run_trials(&trials, 1, stops, &mut take), Ok(()));
        assert_eq!(taken, 3 + 2);
    }
}
