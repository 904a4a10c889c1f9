//! Durations in buckets, from which percentiles and Prometheus' histograms are made.

use std::time::Duration;

/// Upper bounds of the buckets, in seconds: a bucket for each factor of about 2. From a tenth of a millisecond, less than
/// a round trip on one machine, to a minute, more than any cycle.
pub const BUCKET_BOUNDS_S: [f64; 18] = [
    0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0,
    10.0, 30.0, 60.0,
];

/// Counts of durations by bucket.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Histogram {
    /// The last bucket is for all durations above the last bound.
    counts: [u64; BUCKET_BOUNDS_S.len() + 1],
    /// Sum of all durations, in seconds.
    pub sum_s: f64,
}

impl Histogram {
    /// Counts a duration in its bucket; one on a bound is in the bucket below it.
    pub fn record(&mut self, duration: Duration) {
        let duration_s = duration.as_secs_f64();
        self.counts[BUCKET_BOUNDS_S.partition_point(|&bound| bound < duration_s)] += 1;
        self.sum_s += duration_s;
    }

    /// Returns the number of durations recorded.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the duration in seconds below which a fraction of the durations lies, as if those of a bucket were spread
    /// evenly over it, as Prometheus' `histogram_quantile` takes them; `None` without durations, and infinity above the
    /// last bound.
    pub fn quantile(&self, fraction: f64) -> Option<f64> {
        if self.count() == 0 {
            return None;
        }
        let rank = fraction * self.count() as f64;
        let mut lower = (0.0, 0);
        for (bound_s, count) in self.cumulative_counts() {
            if count > 0 && count as f64 >= rank {
                let share = (rank - lower.1 as f64) / (count - lower.1) as f64;
                return Some(lower.0 + share * (bound_s - lower.0));
            }
            lower = (bound_s, count);
        }
        Some(f64::INFINITY)
    }

    /// Returns, for each bound, the number of durations that do not exceed it.
    pub fn cumulative_counts(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
        BUCKET_BOUNDS_S.iter().zip(&self.counts).scan(0, |sum, (&bound, &count)| {
            *sum += count;
            Some((bound, *sum))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_counted_in_the_bucket_whose_bound_they_do_not_exceed() {
        let mut histogram = Histogram::default();
        for ms in [1, 2, 3, 100_000] {
            histogram.record(Duration::from_millis(ms));
        }
        let at_most = |bound_s: f64| {
            histogram.cumulative_counts().find(|(bound, _)| *bound == bound_s).expect("a bound").1
        };
        assert_eq!((at_most(0.001), at_most(0.002), at_most(0.005), at_most(60.0)), (1, 2, 3, 3));
        assert_eq!(histogram.count(), 4);
        assert!((histogram.sum_s - 100.006).abs() < 1e-9);
    }

    #[test]
    fn quantiles_lie_within_their_buckets_in_proportion_to_the_counts() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), None);
        for _ in 0..10 {
            histogram.record(Duration::from_millis(7));
        }
        // All ten are in the bucket from 5 to 10 ms.
        assert!((histogram.quantile(0.5).expect("durations") - 0.0075).abs() < 1e-12);
        assert!((histogram.quantile(1.0).expect("durations") - 0.010).abs() < 1e-12);
        histogram.record(Duration::from_secs(100));
        assert_eq!(histogram.quantile(0.99), Some(f64::INFINITY));
        assert!(histogram.quantile(0.5).expect("durations") < 0.010);
    }
}
