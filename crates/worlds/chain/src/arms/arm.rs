//! An arm of joints as a chain of this world (slides K1 to K4).

use super::kinematics::{RecoverError, Recovered, SerialChain, Skeleton, Vector};
use crate::rods::chain::{Chain, Connector, Mobility, Rod};
use sidestep_kernel::InputError;
use std::f64::consts::PI;

/// Least length of rods whose joint can bring their ends together.
const LEAST_ROD_M: f64 = 1e-6;
/// Greatest length of rods whose joint has no limits.
const MOST_ROD_M: f64 = 1e6;

/// An arm: its joints, its connectors, and the place of its base.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Joints from base to tip.
    pub serial: SerialChain,
    /// Connectors and rods.
    pub skeleton: Skeleton,
    /// Position of the base's frame; its axes are those of the world.
    pub at_m: Vector,
    /// Joint values at the start, rad or m.
    pub values: Vec<f64>,
}

impl Arm {
    /// Returns an arm at a posture.
    pub fn new(serial: SerialChain, at_m: Vector, values: Vec<f64>) -> Self {
        Self { skeleton: serial.skeleton(), serial, at_m, values }
    }

    /// Returns the arm as a chain whose base is fixed. Joint limits become bend limits if those are
    /// equivalent; only [`Self::joints`] checks the others.
    ///
    /// # Errors
    /// When its connectors make no chain, e.g. because a rod has length 0.
    pub fn chain(&self, radius_m: f64, rod_radius_m: f64) -> Result<Chain<3>, InputError> {
        let frames = self.serial.forward(&self.values);
        let points = self.serial.connectors(&self.skeleton, &frames);
        let points: Vec<Vector> = points.iter().map(|p| self.in_world(*p)).collect();
        let limits = self.serial.bend_limits(&self.skeleton);
        let connector = |k: usize| {
            let exact = limits[k].as_ref().filter(|limit| limit.is_exact && k > 0);
            let max_bend_rad = exact.map_or(PI, |limit| limit.max_bend_rad.max(1e-9));
            let mobility = if k == 0 { Mobility::Fixed } else { Mobility::Free };
            Connector { mobility, max_bend_rad, ..Connector::free(radius_m) }
        };
        let rods = self.skeleton.rods.iter().map(|rod| Rod {
            min_m: rod.min_m.max(LEAST_ROD_M),
            max_m: rod.max_m.clamp(LEAST_ROD_M, MOST_ROD_M),
            radius_m: rod_radius_m,
        });
        Chain::new(points.clone(), (0..points.len()).map(connector).collect(), rods.collect())
    }

    /// Returns the joint values that reproduce the connectors' positions in the world.
    ///
    /// # Errors
    /// As [`SerialChain::recover`].
    pub fn joints(&self, points_m: &[Vector]) -> Result<Recovered, RecoverError> {
        let in_base: Vec<Vector> =
            points_m.iter().map(|p| [0, 1, 2].map(|i| p[i] - self.at_m[i])).collect();
        self.serial.recover(&self.skeleton, &in_base, &self.values)
    }

    fn in_world(&self, p: Vector) -> Vector {
        [0, 1, 2].map(|i| p[i] + self.at_m[i])
    }
}
