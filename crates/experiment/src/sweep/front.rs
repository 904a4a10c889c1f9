//! The front of two metrics: the variants that no other one beats in both.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which values of a metric are better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// Lower ones, e.g. of delays.
    Low,
    /// Higher ones, e.g. of trips.
    High,
}

impl Better {
    /// Returns a value as a cost: of two, the better one has the lower cost.
    fn cost(self, value: f64) -> f64 {
        match self {
            Self::Low => value,
            Self::High => -value,
        }
    }

    /// Returns the word of the better direction.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Low => "lower",
            Self::High => "higher",
        }
    }
}

/// A metric, by the name of its column, and which of its values are better.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Aim {
    /// Name of its column.
    pub metric: String,
    /// The better values.
    pub better: Better,
}

/// Returns the front of some points as the corners of steps: what lies on its better side no point reaches.
pub(super) fn front_corners(points: &[(f64, f64)], better: [Better; 2]) -> Vec<(f64, f64)> {
    let cost = |(x, y): &(f64, f64)| (better[0].cost(*x), better[1].cost(*y));
    let mut sorted: Vec<&(f64, f64)> = points.iter().collect();
    sorted.sort_by(|a, b| {
        let (a, b) = (cost(a), cost(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut corners: Vec<(f64, f64)> = Vec::new();
    let mut least = f64::INFINITY;
    for point in sorted {
        let height = cost(point).1;
        if height >= least {
            continue;
        }
        // Up to this point the one before is the best: level until here, then up or down to it.
        if let Some((_, before)) = corners.last().copied() {
            corners.push((point.0, before));
        }
        corners.push(*point);
        least = height;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_has_the_points_that_none_beats_in_both() {
        let points = [(1.0, 5.0), (2.0, 3.0), (3.0, 4.0), (4.0, 1.0)];
        let low = front_corners(&points, [Better::Low, Better::Low]);
        assert_eq!(low, [(1.0, 5.0), (2.0, 5.0), (2.0, 3.0), (4.0, 3.0), (4.0, 1.0)]);
        let high = front_corners(&points, [Better::High, Better::High]);
        assert_eq!(high, [(4.0, 1.0), (3.0, 1.0), (3.0, 4.0), (1.0, 4.0), (1.0, 5.0)]);
        assert_eq!(front_corners(&points, [Better::Low, Better::High]), [(1.0, 5.0)]);
        assert!(front_corners(&[], [Better::Low, Better::Low]).is_empty());
    }
}
