//! The ways of robots of one size on the map of a scenario: shortest paths to places, and the planner that follows them.

use crate::decide::Planner;
use crate::world::{Regime, RobotBody};
use sidestep_map::GridMap;
use sidestep_map::planning::{FlowField, FreeSpace, Lanes};
use std::sync::Arc;

/// Finds the shortest paths of robots of one size to any goal.
#[derive(Debug, Clone)]
pub(crate) struct RoutePlanner {
    free: Arc<FreeSpace>,
    /// Side of a robot in boxes.
    pub(crate) size: u32,
    /// Lanes that the paths keep to; none for robots that do not plan, or see nobody who comes.
    lanes: Option<Arc<Lanes>>,
}

impl RoutePlanner {
    /// Returns the ways of robots of `size` x `size` boxes, along lanes or not.
    pub(crate) fn new(map: &GridMap, size: u32, has_lanes: bool) -> Self {
        let free = Arc::new(FreeSpace::from_map(map));
        let lanes = has_lanes.then(|| Arc::new(Lanes::new(&free, size)));
        Self { free, size, lanes }
    }

    /// Returns the shortest paths to the nearest of some boxes.
    pub(crate) fn to_nearest(&self, goals: &[(u32, u32)]) -> FlowField {
        match &self.lanes {
            Some(lanes) => FlowField::along_lanes(&self.free, self.size, goals, lanes),
            None => FlowField::to_nearest(&self.free, self.size, goals),
        }
    }

    /// Returns the planner of robots with this body, past the things that they sense.
    pub(crate) fn planner(&self, body: &RobotBody, box_size_m: f64, regime: Regime) -> Planner {
        let wheels_err = !regime.has_reliable_effectors() && body.effector.has_errors();
        Planner::new(Arc::clone(&self.free), self.size, body, box_size_m, wheels_err)
    }
}
