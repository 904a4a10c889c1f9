//! Postures of a chain with a fixed base, and the straight path between two.

use super::{ChainPosture, ConfigurationSpace};
use crate::ik::constraints::ConstraintChecker;
use sidestep_kernel::distr::normal;
use sidestep_kernel::stream::Draws;
use sidestep_kernel::{InputError, interrupt};
use sidestep_rods::geometry::{
    Point, add, add_scaled, distance, lerp, norm, norm_squared, normalized, scaled, sub, unit_x,
};
use sidestep_rods::{Chain, Obstacles};
use std::f64::consts::PI;

/// The postures of one chain among obstacles.
pub struct ChainConfigurationSpace<'a, const D: usize> {
    checker: ConstraintChecker<'a, D>,
    /// The connectors from the one that keeps its place outward, to the end of the chain.
    limb: Vec<usize>,
    k: usize,
    /// Longest move of a connector between two postures that are checked, meters.
    step_m: f64,
}

impl<'a, const D: usize> ChainConfigurationSpace<'a, D> {
    /// Returns the postures to which connector `k` can bring a chain.
    ///
    /// # Errors
    /// When no other connector keeps its place.
    pub fn new(
        chain: &'a Chain<D>,
        obstacles: &'a Obstacles<D>,
        self_collision: bool,
        k: usize,
    ) -> Result<Self, InputError> {
        let n = chain.points().len();
        let connectors = chain.connectors();
        let below = (0..k).rev().find(|&i| connectors[i].is_still());
        let above = (k + 1..n).find(|&i| connectors[i].is_still());
        let limb = match (below, above) {
            (Some(base), _) => (base..n).collect(),
            (None, Some(base)) => (0..=base).rev().collect(),
            (None, None) => {
                let remedy = "give a connector mobility = \"fixed\"";
                return Err(InputError::new("planner", "the chain has no fixed base", remedy));
            }
        };
        let checker = ConstraintChecker { chain, obstacles, self_collision };
        Ok(Self { checker, limb, k, step_m: chain.step_m() })
    }

    pub(super) fn chain(&self) -> &'a Chain<D> {
        self.checker.chain
    }

    pub(super) fn obstacles(&self) -> &'a Obstacles<D> {
        self.checker.obstacles
    }

    pub(super) fn base_connector(&self) -> usize {
        self.limb[0]
    }
}

impl<const D: usize> ConfigurationSpace for ChainConfigurationSpace<'_, D> {
    type Posture = ChainPosture<D>;

    fn present_posture(&self) -> ChainPosture<D> {
        self.checker.chain.points().to_vec()
    }

    fn length_m(&self) -> f64 {
        let rods = self.limb.windows(2);
        rods.map(|pair| self.checker.chain.rod_between(pair[0], pair[1]).max_m).sum()
    }

    fn distance_m(&self, a: &ChainPosture<D>, b: &ChainPosture<D>) -> f64 {
        self.limb.iter().map(|&i| distance(a[i], b[i])).fold(0.0, f64::max)
    }

    fn squared_distance(&self, a: &ChainPosture<D>, b: &ChainPosture<D>) -> f64 {
        self.limb.iter().map(|&i| norm_squared(sub(a[i], b[i]))).sum()
    }

    fn interpolate(
        &self,
        a: &ChainPosture<D>,
        b: &ChainPosture<D>,
        fraction: f64,
    ) -> ChainPosture<D> {
        if fraction >= 1.0 {
            return b.clone();
        }
        let mut posture = a.clone();
        for pair in self.limb.windows(2) {
            let [inner, outer] = [pair[0], pair[1]];
            let [from, to] = [a, b].map(|points| sub(points[outer], points[inner]));
            let [from_m, to_m] = [norm(from), norm(to)];
            let mean = lerp(scaled(from, 1.0 / from_m), scaled(to, 1.0 / to_m), fraction);
            // Opposite directions have no mean; just beside it they turn one way or the other.
            let u = normalized(mean).or(normalized(from)).unwrap_or(unit_x());
            posture[outer] = add_scaled(posture[inner], u, from_m + fraction * (to_m - from_m));
        }
        posture
    }

    fn is_free(&self, posture: &ChainPosture<D>) -> bool {
        self.checker.find_veto(posture, self.k).is_none()
    }

    fn is_path_free(&self, a: &ChainPosture<D>, b: &ChainPosture<D>) -> bool {
        let n = (self.distance_m(a, b) / self.step_m).ceil().max(1.0) as usize;
        let mut before = a.clone();
        (1..=n).all(|step| {
            interrupt::check();
            let next = self.interpolate(a, b, step as f64 / n as f64);
            // Rods that nearly turn around jump in between, and a jump may pass through an obstacle.
            let is_near = self.distance_m(&before, &next) <= MAX_STEPS * self.step_m;
            before = next;
            is_near && self.is_free(&before)
        })
    }

    fn sample(&self, draws: &mut Draws) -> ChainPosture<D> {
        let mut posture = self.present_posture();
        let stiffness = STIFFNESS[draws.uniform_below(STIFFNESS.len() as u32) as usize];
        let mut u: Point<D> = direction(draws);
        for pair in self.limb.windows(2) {
            let [inner, outer] = [pair[0], pair[1]];
            let rod = self.checker.chain.rod_between(inner, outer);
            let length_m = rod.min_m + draws.uniform() * (rod.max_m - rod.min_m);
            posture[outer] = add_scaled(posture[inner], u, length_m);
            let side = scaled(direction(draws), stiffness * PI);
            u = normalized(add(u, side)).unwrap_or(u);
        }
        posture
    }
}

/// Longest move of a connector between two postures that are checked, in steps: with linear interpolation
/// of directions, the middle of a wide turn is faster than its ends.
const MAX_STEPS: f64 = 3.0;
/// Largest angles by which a rod of a random posture may differ in direction from the one before, as fractions of half a
/// turn: from nearly straight postures, which reach far, to any.
const STIFFNESS: [f64; 4] = [0.05, 0.15, 0.3, 1.0];

fn direction<const D: usize>(draws: &mut Draws) -> Point<D> {
    let drawn: Point<D> = std::array::from_fn(|_| normal(draws));
    normalized(drawn).unwrap_or(unit_x())
}
