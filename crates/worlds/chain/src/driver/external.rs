//! Orders of an external caller, and the result of the last ones.

use super::VetoRecord;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ExternalControlState {
    /// Orders for the next cycle.
    pub(crate) orders: Orders,
    /// The result of those of the last one.
    pub(crate) answer: OrderResult,
}

/// Orders for one cycle; a later one takes the place of an earlier one of its name.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Orders {
    /// The connector that goes to a place; by default the one that leads.
    pub(crate) connector: Option<u32>,
    /// The rod that goes to two places; by default the one behind the leading connector.
    pub(crate) rod: Option<u32>,
    /// The last target of either sort; without one nothing moves.
    pub(crate) target: Option<Target>,
    /// Whether the chain moves as far as possible where it cannot reach the target.
    pub(crate) goes_far: bool,
}

/// Places to which a connector or a rod shall go; in the plane the last coordinate is 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Target {
    /// The place of one connector, meters.
    Connector([f64; 3]),
    /// Both ends of a rod.
    Rod([[f64; 3]; 2]),
    /// Joints of an arm: their values are the only posture of its plan.
    Joints,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct OrderResult {
    /// How much of the motion was made.
    pub(crate) outcome: OrderOutcome,
    /// The positions that were to be reached within the cycle: of a rod's ends, or twice that of a connector.
    pub(crate) target_m: [[f64; 3]; 2],
    /// The place that the first of them has reached, or could have reached.
    pub(crate) reached_m: [f64; 3],
    /// The fraction of the cycle's motion that was made.
    pub(crate) done_share: f64,
    /// The objection, if there was one.
    pub(crate) veto: Option<VetoRecord>,
    /// The obstacle that caused it.
    pub(crate) obstacle: Option<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) enum OrderOutcome {
    /// There was no order to go anywhere.
    #[default]
    NoOrder,
    /// All of the cycle's motion was made.
    Moved,
    /// Some of it; then came the veto.
    CutShort,
    /// Nothing of it.
    Vetoed,
    /// It waited, because parts got out of the way of something.
    Waited,
    /// Its task takes no orders, or the chain was broken.
    Unheard,
}

impl OrderOutcome {
    /// Their names, in their order.
    pub(crate) const NAMES: [&str; 6] =
        ["no-order", "moved", "cut-short", "vetoed", "waited", "unheard"];
}

impl ExternalControlState {
    /// Returns whether there is nothing to keep.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Returns whether it belongs to a chain of `n` connectors.
    pub(crate) fn has_valid_indices(&self, n: usize) -> bool {
        let Orders { connector, rod, .. } = self.orders;
        let is_connector_there = connector.is_none_or(|k| (k as usize) < n);
        let is_rod_there = rod.is_none_or(|k| (k as usize) < n.saturating_sub(1));
        is_connector_there && is_rod_there
    }
}

impl Orders {
    /// The order that names a connector.
    pub(crate) const CONNECTOR: &str = "connector";
    /// The order that gives its target.
    pub(crate) const TO: &str = "to_m";
    /// The order that names a rod.
    pub(crate) const ROD: &str = "rod";
    /// The order that gives the targets of its ends.
    pub(crate) const ROD_TO: &str = "rod_to_m";
    /// The order that gives the values of the joints of an arm.
    pub(crate) const JOINTS: &str = "joints";
    /// The order that gives the effect of a veto on the way.
    pub(crate) const REACH: &str = "reach";

    /// Records an order; the values are of the space that it has.
    pub(crate) fn record(&mut self, order: &str, values: &[f64]) {
        match (order, values) {
            (Self::TO, at) => self.target = Some(Target::Connector(in_space(at))),
            (Self::ROD_TO, ends) => {
                let (first, second) = ends.split_at(ends.len() / 2);
                self.target = Some(Target::Rod([in_space(first), in_space(second)]));
            }
            (Self::JOINTS, _) => self.target = Some(Target::Joints),
            (Self::CONNECTOR, &[k]) => self.connector = Some(k as u32),
            (Self::ROD, &[k]) => self.rod = Some(k as u32),
            (_, values) => self.goes_far = values == [1.0],
        }
    }
}

/// Returns a place in space; in the plane its last coordinate is 0.
fn in_space(at: &[f64]) -> [f64; 3] {
    std::array::from_fn(|i| at.get(i).copied().unwrap_or_default())
}
