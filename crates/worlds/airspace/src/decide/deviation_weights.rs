//! Weights of deviations by right of way, for probability collectives.

use super::velocity::TrafficView;
use crate::flight::KnownAircraft;
use crate::right_of_way::Yielding;
use crate::settings::RightOfWayRule;
use crate::world::AirspaceWorld;

/// Factor on the cost of deviations of one that has right of way. A tenth of a deviation then costs
/// as much as all of it, because costs are squares.
const DEVIATION_WEIGHT: f64 = 100.0;

impl AirspaceWorld {
    /// Returns the factor on the cost of deviations of each airplane of a group, by places that all see.
    ///
    /// It is that of its priority; and by a rule it is greater for one that has right of way in some conflict,
    /// and has to give way in none. Conflicts are those within the horizon of airplanes that head for their way-points, or
    /// else of present velocities.
    pub(crate) fn deviation_weights(&self, group: &[KnownAircraft]) -> Vec<f64> {
        if !self.uses_right_of_way {
            return vec![1.0; group.len()];
        }
        // Only what is filed and seen, so that all compute the same.
        let filed: Vec<KnownAircraft> =
            group.iter().map(|known| KnownAircraft { next: 0, orders: 0, ..*known }).collect();
        let traffic = TrafficView::from_filed_group(self, &filed);
        let proceeding = traffic.proceeding();
        let mut has_right = vec![false; group.len()];
        let mut gives_way = vec![false; group.len()];
        if self.right_of_way != RightOfWayRule::None {
            for i in 0..group.len() {
                for j in i + 1..group.len() {
                    // One that has turned away already still gives way, or its right would end with the first turn.
                    let yielding = proceeding
                        .yielding_in_conflict(i, j)
                        .or_else(|| traffic.yielding_in_conflict(i, j));
                    match yielding {
                        Some(Yielding::First) => (has_right[j], gives_way[i]) = (true, true),
                        Some(Yielding::Second) => (has_right[i], gives_way[j]) = (true, true),
                        Some(Yielding::Both) | None => {}
                    }
                }
            }
        }
        let priorities: Vec<u8> = filed.iter().map(|known| self.priority(known.slot)).collect();
        let least = priorities.iter().copied().min().unwrap_or(0);
        let each = priorities.iter().zip(has_right.iter().zip(gives_way));
        each.map(|(priority, (has_right, gives_way))| {
            let further = u8::from(*has_right && !gives_way);
            (0..priority - least + further).fold(1.0, |weight, _| weight * DEVIATION_WEIGHT)
        })
        .collect()
    }
}
