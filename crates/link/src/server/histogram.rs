//! Durations in classes, from which percentiles and Prometheus' histograms are made.

use std::time::Duration;

/// Upper bounds of the classes, in seconds: a class for each factor of about 2.
pub const BUCKET_BOUNDS_S: [f64; 18] = [
    0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0,
    10.0, 30.0, 60.0,
];

/// Counts of durations by class.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Histogram {
    counts: [u64; BUCKET_BOUNDS_S.len() + 1],
    /// Sum of all durations, in seconds.
    pub sum_s: f64,
}

impl Histogram {
    /// Counts a duration.
    pub fn record(&mut self, took: Duration) {
        let took_s = took.as_secs_f64();
        self.counts[BUCKET_BOUNDS_S.partition_point(|&bound| bound < took_s)] += 1;
        self.sum_s += took_s;
    }

    /// Returns the number of durations counted.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the bound in seconds below which the given part of the durations lies; `None` without durations, and
    /// infinity above the last bound.
    pub fn quantile(&self, part: f64) -> Option<f64> {
        let wanted = (part * self.count() as f64).ceil().max(1.0) as u64;
        let bound = self.cumulative().find(|(_, count)| *count >= wanted);
        (self.count() > 0).then(|| bound.map_or(f64::INFINITY, |(bound_s, _)| bound_s))
    }

    /// Returns, for each bound, the number of durations at most that long.
    pub fn cumulative(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
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
    fn durations_are_counted_in_the_class_whose_bound_they_do_not_exceed() {
        let mut histogram = Histogram::default();
        for ms in [1, 2, 3, 100_000] {
            histogram.record(Duration::from_millis(ms));
        }
        let at_most = |bound_s: f64| {
            histogram.cumulative().find(|(bound, _)| *bound == bound_s).expect("a bound").1
        };
        assert_eq!((at_most(0.001), at_most(0.002), at_most(0.005), at_most(60.0)), (1, 2, 3, 3));
        assert_eq!(histogram.count(), 4);
        assert!((histogram.sum_s - 100.006).abs() < 1e-9);
    }
}
