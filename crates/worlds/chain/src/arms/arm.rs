//! An arm of joints as a chain of this world (slides K1 to K4).

use super::kinematics::{RecoverError, Recovered, SerialChain, Skeleton, Vector};
use crate::rods::chain::{Chain, Connector, Mobility, Rod};
use sidestep_kernel::InputError;
use std::f64::consts::PI;

/// Rods whose joint can bring their ends together stay at least this long.
const LEAST_ROD_M: f64 = 1e-6;
/// Rods whose joint has no limits are at most this long.
const MOST_ROD_M: f64 = 1e6;

/// An arm: its joints, its connectors, and where its base stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Joints from base to tip.
    pub serial: SerialChain,
    /// Connectors and rods.
    pub skeleton: Skeleton,
    /// Where the frame of the base is; its axes are those of the world.
    pub at_m: Vector,
    /// Joint values at the start, rad or m.
    pub values: Vec<f64>,
}

impl Arm {
    /// An arm at a posture.
    pub fn new(serial: SerialChain, at_m: Vector, values: Vec<f64>) -> Self {
        Self { skeleton: serial.skeleton(), serial, at_m, values }
    }

    /// The arm as a chain whose base is fixed. Joint limits are bend limits where those say the
    /// same; others only [`Self::joints`] knows of.
    ///
    /// # Errors
    /// When its connectors make no chain, as those of an arm of one rod length 0 do not.
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

    /// The joint values that bring the connectors where they are in the world.
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
