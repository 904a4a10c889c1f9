//! Many independent runs at once.

use sidestep::kernel::workers;

/// Runs between two reports of progress, per worker.
const BATCH: usize = 8;

/// Told how far an experiment is: what is being done, and the share done, from 0 to 1.
pub type Progress<'a> = dyn FnMut(&str, f64) + 'a;

/// Progress of a part of the whole that goes from share `from` to share `to`.
pub fn stage(progress: &mut Progress<'_>, from: f64, to: f64) -> impl FnMut(&str, f64) {
    move |what, share| progress(what, from + (to - from) * share)
}

/// Does runs `0..runs` on up to `workers` workers, each run on one of them. The results come
/// back by index, so they do not depend on the number of workers.
pub fn in_parallel<T: Send>(
    workers: usize,
    runs: usize,
    run: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let mut crew: Vec<Vec<(usize, T)>> = Vec::new();
    crew.resize_with(workers.clamp(1, runs.max(1)), Vec::new);
    workers::run(&mut crew, |worker, own| {
        worker.for_each_chunk(0, runs, |chunk| own.extend(chunk.map(|i| (i, run(i)))));
    });
    let mut done: Vec<(usize, T)> = crew.into_iter().flatten().collect();
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

/// [`in_parallel`] in batches, and reports after each the share of `runs` that is done.
pub fn in_batches<T: Send>(
    workers: usize,
    runs: usize,
    mut report: impl FnMut(f64),
    run: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let batch = workers.max(1) * BATCH;
    let mut results = Vec::with_capacity(runs);
    while results.len() < runs {
        let first = results.len();
        let count = batch.min(runs - first);
        results.extend(in_parallel(workers, count, |i| run(first + i)));
        report(results.len() as f64 / runs as f64);
    }
    results
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_back_by_index_for_any_number_of_workers() {
        for workers in [0, 1, 2, 5] {
            for runs in [0, 1, 3, 100] {
                let expected: Vec<usize> = (0..runs).map(|i| i * i).collect();
                assert_eq!(in_parallel(workers, runs, |i| i * i), expected);
                let mut shares = vec![0.0];
                let results = in_batches(workers, runs, |share| shares.push(share), |i| i * i);
                assert_eq!(results, expected);
                assert!(shares.is_sorted() && (runs == 0 || shares.last() == Some(&1.0)));
            }
        }
    }
}
