//! Postures of a chain, and the straight path between two.

use super::own_path::{OwnPath, longest_move_m};
use super::{ChainPosture, ConfigurationSpace, MAX_SAMPLES};
use crate::ik::constraints::ConstraintChecker;
use sidestep_kernel::distr::normal;
use sidestep_kernel::stream::Draws;
use sidestep_kernel::{InputError, interrupt};
use sidestep_rods::geometry::{
    Point, add, add_scaled, lerp, norm, norm_squared, normalized, scaled, sub, unit_x,
};
use sidestep_rods::{Chain, Connector, ConstraintProjector, Mobility, Obstacles};
use std::cell::RefCell;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// The postures of one chain among obstacles. A posture is the place of one connector, the root, and the directions and
/// lengths of all rods from there outward. The root is the connector that is held, or an end of a free chain. Between two
/// fixed connectors it is the lower one, and rods are projected so that the chain ends at the other.
pub struct ChainConfigurationSpace<'a, const D: usize> {
    checker: ConstraintChecker<'a, D>,
    /// The connectors from the root outward, to one end of the chain or to both.
    limbs: Vec<Vec<usize>>,
    root: usize,
    /// The other fixed connector of a chain that is led between two.
    far_end: Option<usize>,
    projector: RefCell<ConstraintProjector<D>>,
    k: usize,
    /// Longest move of a connector between two postures that are checked, meters.
    step_m: f64,
}

impl<'a, const D: usize> ChainConfigurationSpace<'a, D> {
    /// Returns the postures to which connector `k` can bring a chain.
    ///
    /// # Errors
    /// When the chain has no rods, or is held at several connectors one of which would have to move.
    pub fn new(
        chain: &'a Chain<D>,
        obstacles: &'a Obstacles<D>,
        self_collision: bool,
        k: usize,
    ) -> Result<Self, InputError> {
        let n = chain.points().len();
        if n < 2 {
            let remedy = "set planner = \"none\", or give two connectors or more";
            return Err(InputError::new("planner", "a chain without rods has no postures", remedy));
        }
        let ends = chain_bases(chain, k).map_err(|[low, high]| held_twice_error(low, high))?;
        let up = |from: usize, to: usize| (from..=to).collect::<Vec<usize>>();
        let down = |from: usize| (0..=from).rev().collect::<Vec<usize>>();
        let (root, far_end, limbs) = match ends {
            ChainBases::Two([low, high]) => (low, Some(high), vec![up(low, high)]),
            ChainBases::One(root) if chain.connectors()[root].is_still() => {
                // What lies behind a base stays where it is.
                (root, None, vec![if root < k { up(root, n - 1) } else { down(root) }])
            }
            ChainBases::One(root) => (root, None, vec![up(root, n - 1), down(root)]),
            // The end that is farther away swings about the nearer part.
            ChainBases::None => {
                let root = if 2 * k < n { n - 1 } else { 0 };
                (root, None, vec![up(root, n - 1), down(root)])
            }
        };
        let checker = ConstraintChecker { chain, obstacles, self_collision };
        let projector = RefCell::default();
        Ok(Self { checker, limbs, root, far_end, projector, k, step_m: chain.step_m() })
    }

    pub(super) fn chain(&self) -> &'a Chain<D> {
        self.checker.chain
    }

    pub(super) fn obstacles(&self) -> &'a Obstacles<D> {
        self.checker.obstacles
    }

    pub(super) fn root(&self) -> usize {
        self.root
    }

    pub(super) fn is_root_still(&self) -> bool {
        self.chain().connectors()[self.root].is_still()
    }

    /// Returns the other fixed connector of a chain that is led between two.
    pub(super) fn far_end(&self) -> Option<usize> {
        self.far_end
    }

    pub(super) fn initiator(&self) -> usize {
        self.k
    }

    pub(super) fn limbs(&self) -> impl Iterator<Item = &[usize]> {
        self.limbs.iter().map(Vec::as_slice)
    }

    /// Returns the longest move of a connector between two postures of a path that is followed, meters.
    pub(super) fn refined_step_m(&self) -> f64 {
        REFINED_STEPS * self.step_m
    }

    /// Returns the mean length of the rod between two neighbors, meters.
    pub(super) fn mean_length_m(&self, i: usize, j: usize) -> f64 {
        let rod = self.chain().rod_between(i, j);
        0.5 * (rod.min_m + rod.max_m)
    }

    /// Returns the mean lengths of the rods between connectors, meters.
    pub(super) fn mean_lengths_m(&self, connectors: RangeInclusive<usize>) -> Vec<f64> {
        let rods = *connectors.start()..*connectors.end();
        rods.map(|rod| self.mean_length_m(rod, rod + 1)).collect()
    }

    /// Returns the mean lengths of the rods from the root to the initiator, meters.
    pub(super) fn rods_to_initiator(&self) -> Vec<f64> {
        let steps = self.root.abs_diff(self.k);
        let limb = self.limbs.iter().find(|limb| limb.contains(&self.k));
        let pairs = limb.into_iter().flat_map(|limb| limb.windows(2)).take(steps);
        pairs.map(|pair| self.mean_length_m(pair[0], pair[1])).collect()
    }

    /// Returns the reach of the rods from the root to connector `k`, meters.
    pub(super) fn length_between(&self, k: usize) -> f64 {
        let rods = &self.chain().rods()[self.root.min(k)..self.root.max(k)];
        rods.iter().map(|rod| rod.max_m).sum()
    }

    /// Returns the present posture with the root elsewhere, where it may be.
    pub(super) fn moved_root(&self, root_at: Point<D>) -> ChainPosture<D> {
        let mut posture = self.present_posture();
        if !self.is_root_still() {
            posture[self.root] = root_at;
        }
        posture
    }

    /// Returns the length of the longest rod, meters.
    pub(super) fn longest_rod_m(&self) -> f64 {
        self.chain().max_rod_m()
    }

    /// Returns whether nothing but the chain's own body can block a straight path: postures between two that keep all
    /// other constraints keep them as well.
    fn is_own_body_alone(&self) -> bool {
        let has_bend_limit = self.chain().connectors().iter().any(|c| c.max_bend_rad < PI);
        self.obstacles().is_empty() && !has_bend_limit
    }

    /// Returns the posture at a fraction of the straight path; none if the chain does not reach its other fixed end in
    /// between.
    pub(super) fn posture_between(
        &self,
        a: &ChainPosture<D>,
        b: &ChainPosture<D>,
        fraction: f64,
    ) -> Option<ChainPosture<D>> {
        if fraction >= 1.0 {
            return Some(b.clone());
        }
        let mut posture = a.clone();
        if !self.is_root_still() {
            posture[self.root] = lerp(a[self.root], b[self.root], fraction);
        }
        for pair in self.limbs().flat_map(|limb| limb.windows(2)) {
            let [inner, outer] = [pair[0], pair[1]];
            let [from, to] = [a, b].map(|points| sub(points[outer], points[inner]));
            let [from_m, to_m] = [norm(from), norm(to)];
            let mean = lerp(scaled(from, 1.0 / from_m), scaled(to, 1.0 / to_m), fraction);
            // Opposite directions have no mean; just beside it they turn one way or the other.
            let u = normalized(mean).or(normalized(from)).unwrap_or(unit_x());
            posture[outer] = add_scaled(posture[inner], u, from_m + fraction * (to_m - from_m));
        }
        self.closed_posture(posture)
    }

    /// Returns a posture near one in which rods have allowed lengths and the chain's own parts are apart, if there is one.
    /// Connector `pinned` stays.
    pub(super) fn settle_posture(
        &self,
        mut posture: ChainPosture<D>,
        pinned: Option<usize>,
    ) -> Option<ChainPosture<D>> {
        let mut projector = self.projector.borrow_mut();
        let is_solid = self.checker.self_collision;
        // What is left of overlaps after one round of pushes is less for the next.
        let is_settled = (0..MAX_SETTLE_ROUNDS)
            .any(|_| projector.correct_posture(self.chain(), &mut posture, pinned, is_solid));
        is_settled.then_some(posture)
    }

    /// Returns a posture near one whose rods are laid out from the root, so that it ends at the other fixed end, if there is
    /// one; none if the rods do not reach it.
    pub(super) fn closed_posture(&self, mut posture: ChainPosture<D>) -> Option<ChainPosture<D>> {
        let Some(end) = self.far_end else { return Some(posture) };
        let end_at = self.chain().points()[end];
        let missing = sub(end_at, posture[end]);
        let rods = (end - self.root) as f64;
        // Each rod gets an even share of what is missing, so that the projection has little to correct.
        for (rod, k) in (self.root + 1..end).enumerate() {
            posture[k] = add_scaled(posture[k], missing, (rod + 1) as f64 / rods);
        }
        posture[end] = end_at;
        let mut projector = self.projector.borrow_mut();
        projector.correct_posture(self.chain(), &mut posture, None, false).then_some(posture)
    }

    /// Returns a random place of the root: within reach of the present one, where its mobility allows it.
    fn sample_root(&self, draws: &mut Draws) -> Point<D> {
        let present = self.chain().points()[self.root];
        if self.is_root_still() {
            return present;
        }
        let reach_m = self.length_m();
        let drawn = present.map(|x| x + reach_m * (2.0 * draws.uniform() - 1.0));
        self.chain().connectors()[self.root].mobility.project(drawn, present)
    }
}

/// The bases of a chain one of whose connectors is led: the connectors that hold it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChainBases {
    /// None: the chain is free.
    None,
    /// The one on which the chain hangs.
    One(usize),
    /// The fixed ones on both sides of the connector that is led.
    Two([usize; 2]),
}

/// Returns the connectors that hold a chain where connector `k` is led.
///
/// # Errors
/// Two of them, the lower one first, if paths of the chain cannot be planned: those that are held, or have failed, on both
/// sides of `k` must be fixed; on one side another one may be behind one that is fixed.
pub fn chain_bases<const D: usize>(chain: &Chain<D>, k: usize) -> Result<ChainBases, [usize; 2]> {
    let connectors = chain.connectors();
    let is_held = |c: &Connector<D>| c.failed || c.mobility != Mobility::Free;
    let below = (0..k).rev().find(|&i| is_held(&connectors[i]));
    let above = (k + 1..connectors.len()).find(|&i| is_held(&connectors[i]));
    let root = match (below, above) {
        (None, None) => return Ok(ChainBases::None),
        (Some(root), None) | (None, Some(root)) => root,
        (Some(low), Some(high)) => {
            let are_still = connectors[low].is_still() && connectors[high].is_still();
            return if are_still { Ok(ChainBases::Two([low, high])) } else { Err([low, high]) };
        }
    };
    if connectors[root].is_still() {
        return Ok(ChainBases::One(root));
    }
    // All of the chain moves with a base that does, and no other connector may hold it.
    let other = (0..connectors.len()).find(|&i| i != root && i != k && is_held(&connectors[i]));
    other.map_or(Ok(ChainBases::One(root)), |other| Err([root.min(other), root.max(other)]))
}

fn held_twice_error(low: usize, high: usize) -> InputError {
    let cause = format!("the chain is held at connectors {low} and {high}, and not both are fixed");
    InputError::new("planner", cause, "fix both, hold one at most, or set planner = \"none\"")
}

impl<const D: usize> ConfigurationSpace for ChainConfigurationSpace<'_, D> {
    type Posture = ChainPosture<D>;

    fn max_samples(&self) -> usize {
        let rods = self.chain().rods().len().max(1);
        (MAX_SAMPLE_EFFORT / (rods * rods)).clamp(MIN_SAMPLES, MAX_SAMPLES)
    }

    fn present_posture(&self) -> ChainPosture<D> {
        self.checker.chain.points().to_vec()
    }

    fn length_m(&self) -> f64 {
        let rods = self.limbs().flat_map(|limb| limb.windows(2));
        rods.map(|pair| self.chain().rod_between(pair[0], pair[1]).max_m).sum()
    }

    fn distance_m(&self, a: &ChainPosture<D>, b: &ChainPosture<D>) -> f64 {
        longest_move_m(a, b)
    }

    fn squared_distance(&self, a: &ChainPosture<D>, b: &ChainPosture<D>) -> f64 {
        a.iter().zip(b).map(|(a, b)| norm_squared(sub(*a, *b))).sum()
    }

    fn interpolate(
        &self,
        a: &ChainPosture<D>,
        b: &ChainPosture<D>,
        fraction: f64,
    ) -> ChainPosture<D> {
        // Where there is nothing in between, the way to the end itself is found not to be free.
        self.posture_between(a, b, fraction).unwrap_or_else(|| b.clone())
    }

    fn is_free(&self, posture: &ChainPosture<D>) -> bool {
        self.checker.find_veto(posture, self.k).is_none()
    }

    fn is_path_free(&self, a: &ChainPosture<D>, b: &ChainPosture<D>) -> bool {
        if self.is_own_body_alone() {
            let own_path = OwnPath {
                chain: self.chain(),
                from: a,
                to: b,
                posture_at: |fraction| self.posture_between(a, b, fraction),
                is_solid: self.checker.self_collision,
                step_m: self.step_m,
                // Rods that are projected may change their posture at once.
                even_m: if self.far_end.is_some() { self.refined_step_m() } else { f64::INFINITY },
            };
            return self.is_free(b) && own_path.is_clear();
        }
        let n = (self.distance_m(a, b) / self.step_m).ceil().max(1.0) as usize;
        let mut before = a.clone();
        (1..=n).all(|step| {
            interrupt::check();
            let Some(next) = self.posture_between(a, b, step as f64 / n as f64) else {
                return false;
            };
            // Rods that nearly turn around jump in between, and a jump may pass through an obstacle.
            let is_near = self.distance_m(&before, &next) <= MAX_STEPS * self.step_m;
            before = next;
            is_near && self.is_free(&before)
        })
    }

    fn sample(&self, draws: &mut Draws) -> ChainPosture<D> {
        let mut posture = self.moved_root(self.sample_root(draws));
        let stiffness = STIFFNESS[draws.uniform_below(STIFFNESS.len() as u32) as usize];
        let mut u: Point<D> = direction(draws);
        for pair in self.limbs().flat_map(|limb| limb.windows(2)) {
            let [inner, outer] = [pair[0], pair[1]];
            if inner == self.root {
                u = direction(draws);
            }
            let rod = self.checker.chain.rod_between(inner, outer);
            let length_m = rod.min_m + draws.uniform() * (rod.max_m - rod.min_m);
            posture[outer] = add_scaled(posture[inner], u, length_m);
            let side = scaled(direction(draws), stiffness * PI);
            u = normalized(add(u, side)).unwrap_or(u);
        }
        self.closed_posture(posture.clone()).unwrap_or(posture)
    }
}

/// Rounds of pushes that settle a posture, at most.
const MAX_SETTLE_ROUNDS: usize = 8;
/// Steps from one posture of a path that is followed to the next.
const REFINED_STEPS: f64 = 8.0;
/// Pairs of rods that the random postures of a search have, all together: as many as 2,000 postures of 8 rods. A
/// check of a posture takes time with the number of its pairs, and a search must not hold up a run.
const MAX_SAMPLE_EFFORT: usize = 128_000;
/// Random postures of a search at least.
const MIN_SAMPLES: usize = 60;
/// Longest move of a connector between two postures that are checked, in steps: with linear interpolation
/// of directions, the middle of a wide turn is faster than its ends.
const MAX_STEPS: f64 = 3.0;
/// Largest angles by which a rod of a random posture may differ in direction from the one before, as fractions of
/// half a turn: from nearly straight postures, which reach far, to any.
const STIFFNESS: [f64; 4] = [0.05, 0.15, 0.3, 1.0];

fn direction<const D: usize>(draws: &mut Draws) -> Point<D> {
    let drawn: Point<D> = std::array::from_fn(|_| normal(draws));
    normalized(drawn).unwrap_or(unit_x())
}
