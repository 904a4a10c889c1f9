//! Joint values from the positions of connectors.
//!
//! From the base out, each connector determines the joints that move it and no connector before it:
//! none, one (an angle about an axis, or a displacement along it), or two (the circles that two axes
//! draw meet in at most two points; Paden and Kahan's second subproblem, here for axes that need not
//! meet). If a step has two solutions, both are tried, the one nearer to the reference first. Iiwa arms
//! and the UR5 are solved like this, exactly; a Panda's elbow offsets couple three joints to one connector,
//! which is refused with [`RecoverError::Coupled`].

use std::f64::consts::TAU;

use super::serial::{JointMotionKind, MovingJoint, SerialChain};
use super::skeleton::Skeleton;
use super::transform::{Line, Transform, Vector};
use sidestep_import::urdf::Limits;
use sidestep_kernel::geometry::{add, cross, dot, norm, perpendicular_component, scaled, sub};
use sidestep_kernel::math::{atan2, wrap_angle};

/// Largest distance between a connector and its nearest possible place, as a fraction of the reach: positions in single
/// precision fit.
const FIT_TOLERANCE: f64 = 1e-6;

/// Distance from an axis, as a fraction of the reach, within which a point is on it: no turn moves it, and nearer to the
/// axis the angle is lost in rounding.
const ON_AXIS_TOLERANCE: f64 = 1e-10;

/// Joint values tried before the search gives up; an arm of 7 joints needs at most some 20. Each pair of axes may double
/// their number, so that a made-up arm could keep the search busy without end.
const MAX_TRIES: usize = 20_000;

/// Joint values that reproduce the connectors' positions.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveredJoints {
    /// One for each variable, inside its limits, in rad or m.
    pub values: Vec<f64>,
    /// The largest distance between a connector and its place by forward kinematics, in m.
    pub residual_m: f64,
    /// Variables that no connector depends on (the twist of the last rod, or of any rod that is
    /// straight on with its joint's axis); they have their reference value.
    pub open: Vec<String>,
}

/// The reason why there are no joint values for connectors.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecoverError {
    /// More or fewer positions than the skeleton has connectors, or one that is not finite.
    #[error("{found} finite positions where the arm has {expected} connectors")]
    WrongCount {
        /// Number of positions that were given and are finite.
        found: usize,
        /// Number of connectors of the arm.
        expected: usize,
    },
    /// Points leave these joints open, or couple them to connectors farther out.
    #[error("connector {connector} depends on {} at once; its position does not distinguish them", .joints.join(", "))]
    Coupled {
        /// Index of the connector, the base's being 0.
        connector: usize,
        /// Names of the joints, from the base out.
        joints: Vec<String>,
    },
    /// A joint between base and tip mimics another, so that values are not independent.
    #[error("joint `{joint}` mimics another; values are recovered for independent joints only")]
    Mimics {
        /// The first such joint from the base.
        joint: String,
    },
    /// No joint values bring the connector there: a rod has a wrong length, or axes forbid it.
    #[error(
        "connector {connector} is {distance_m:.3} m from the nearest place to which its joints can bring it while the \
         others are where they are"
    )]
    DoesNotFit {
        /// Index of the connector, the base's being 0.
        connector: usize,
        /// Distance from the connector to that place, in m.
        distance_m: f64,
    },
    /// The connectors can be reached, but only with a joint outside its limits.
    #[error("joint `{joint}` would have to be at {value}, outside {lower} to {upper}")]
    OutsideLimits {
        /// The joint at which the best branch of the search ended.
        joint: String,
        /// Its value in rad or m.
        value: f64,
        /// Lowest value allowed.
        lower: f64,
        /// Highest value allowed.
        upper: f64,
    },
}

impl SerialChain {
    /// Returns the joint values that bring the connectors of `skeleton` (this chain's) to
    /// `positions_m` in the base's frame. Of several solutions it returns the first found inside
    /// the limits, trying at each step the value nearest to `reference`, which has a value for each
    /// variable. A posture that was moved a little is found again from itself as reference.
    ///
    /// # Errors
    /// When the points do not determine the joints, do not fit the arm, or need a joint outside its
    /// limits.
    ///
    /// # Panics
    /// If `reference` has not one value for each variable.
    pub fn recover_joint_values(
        &self,
        skeleton: &Skeleton,
        positions_m: &[Vector],
        reference: &[f64],
    ) -> Result<RecoveredJoints, RecoverError> {
        assert_eq!(reference.len(), self.variables.len(), "one value for each variable");
        let finite = positions_m.iter().filter(|p| p.iter().all(|x| x.is_finite())).count();
        let expected = skeleton.connectors.len();
        if finite != expected || positions_m.len() != expected {
            return Err(RecoverError::WrongCount { found: finite, expected });
        }
        for (i, joint) in self.joints.iter().enumerate() {
            if !joint.drive.is_identity() || joint.drive.variable != i {
                return Err(RecoverError::Mimics { joint: joint.name.clone() });
            }
        }
        self.check_solvable(skeleton)?;
        let mut search = JointSearch {
            chain: self,
            skeleton,
            positions_m,
            reference,
            values: reference.to_vec(),
            open: vec![true; reference.len()],
            tries: 0,
            best_failure: None,
        };
        if !search.solve_from_connector(0, 0, Transform::IDENTITY) {
            return Err(search.best_failure.expect("a search that fails says why").1);
        }
        Ok(search.finish())
    }

    /// Returns whether each connector is moved by at most two joints that no earlier one is moved by.
    fn check_solvable(&self, skeleton: &Skeleton) -> Result<(), RecoverError> {
        let mut known = 0;
        for (connector, anchor) in skeleton.connectors.iter().enumerate() {
            let joints = &self.joints[known.min(anchor.first)..anchor.first];
            let solvable = match joints {
                [] | [_] => true,
                [a, b] => a.motion == JointMotionKind::Turn && b.motion == JointMotionKind::Turn,
                _ => false,
            };
            if !solvable {
                let joints = joints.iter().map(|joint| joint.name.clone()).collect();
                return Err(RecoverError::Coupled { connector, joints });
            }
            known = known.max(anchor.first);
        }
        Ok(())
    }
}

/// A depth-first search over the solutions of each step.
struct JointSearch<'a> {
    chain: &'a SerialChain,
    skeleton: &'a Skeleton,
    positions_m: &'a [Vector],
    reference: &'a [f64],
    values: Vec<f64>,
    /// Whether each variable has its reference value because no point determines it.
    open: Vec<bool>,
    tries: usize,
    /// The failure of the branch that got farthest.
    best_failure: Option<(SearchProgress, RecoverError)>,
}

/// The progress of a branch of a search; a limit is more informative than a misfit.
#[derive(PartialEq, PartialOrd)]
struct SearchProgress {
    connector: usize,
    fits: bool,
}

impl JointSearch<'_> {
    /// Places the connectors from `connector` on, with the first `known` joints decided and the
    /// link behind them at `link`. Returns whether that worked.
    fn solve_from_connector(&mut self, connector: usize, known: usize, link: Transform) -> bool {
        let Some(anchor) = self.skeleton.connectors.get(connector) else { return true };
        let target_m = self.positions_m[connector];
        let until = anchor.first.max(known);
        if until == known {
            // This connector is fixed in a link that is already placed.
            let frames = self.chain.forward_kinematics(&self.values);
            return self.check_fit(connector, sub(anchor.position_m(&frames), target_m))
                && self.solve_from_connector(connector + 1, known, link);
        }
        let joints = &self.chain.joints[known..until];
        let placement = PointIkProblem { link: &link, p_m: anchor.point_m, target_m };
        for solution in self.solutions(joints, known, placement) {
            self.tries += 1;
            if self.tries > MAX_TRIES {
                return false;
            }
            if self.try_values(connector, known, link, &solution) {
                return true;
            }
        }
        false
    }

    /// Decides the joints from `known` on, and continues with the next connector.
    fn try_values(
        &mut self,
        connector: usize,
        known: usize,
        link: Transform,
        found: &[JointValueCandidate],
    ) -> bool {
        let mut outer = link;
        for (i, value) in found.iter().enumerate() {
            let joint = &self.chain.joints[known + i];
            self.values[known + i] = value.value;
            self.open[known + i] = value.is_open;
            outer = outer.compose(&joint.origin).compose(&joint.transform(value.value));
        }
        let anchor = &self.skeleton.connectors[connector];
        self.check_fit(
            connector,
            sub(outer.transform_point(anchor.point_m), self.positions_m[connector]),
        ) && self.are_valid(connector, known, found)
            && self.solve_from_connector(connector + 1, known + found.len(), outer)
    }

    /// Checks limits of the joints from `known` on, and records the first one that is exceeded.
    fn are_valid(&mut self, connector: usize, known: usize, found: &[JointValueCandidate]) -> bool {
        for (joint, found) in self.chain.joints[known..].iter().zip(found) {
            if let Some(limits) = joint.limits.filter(|l| !l.contains(found.value)) {
                self.record_failure(
                    SearchProgress { connector, fits: true },
                    outside_limits_error(joint, found.value, limits),
                );
                return false;
            }
        }
        true
    }

    fn check_fit(&mut self, connector: usize, error_m: Vector) -> bool {
        let distance_m = norm(error_m);
        let fits = distance_m <= FIT_TOLERANCE * self.skeleton.reach_m;
        if !fits {
            let failure = RecoverError::DoesNotFit { connector, distance_m };
            self.record_failure(SearchProgress { connector, fits: false }, failure);
        }
        fits
    }

    fn record_failure(&mut self, progress: SearchProgress, failure: RecoverError) {
        if self.best_failure.as_ref().is_none_or(|(best, _)| progress > *best) {
            self.best_failure = Some((progress, failure));
        }
    }

    /// Returns values of one or two joints that place a point, those nearer to the reference first.
    fn solutions(
        &self,
        joints: &[MovingJoint],
        known: usize,
        placement: PointIkProblem<'_>,
    ) -> Vec<Vec<JointValueCandidate>> {
        let reference = &self.reference[known..known + joints.len()];
        match joints {
            [joint] => vec![vec![self.solve_single_joint(joint, placement, reference[0])]],
            [inner, outer] => {
                let mut found = self.solve_two([inner, outer], placement, reference);
                found.sort_by(|a, b| {
                    total_change(a, reference).total_cmp(&total_change(b, reference))
                });
                found
            }
            _ => unreachable!("check_solvable refuses more"),
        }
    }

    fn solve_single_joint(
        &self,
        joint: &MovingJoint,
        PointIkProblem { link, p_m, target_m }: PointIkProblem<'_>,
        reference: f64,
    ) -> JointValueCandidate {
        let line = joint.axis_line(link);
        let p_m = link.compose(&joint.origin).transform_point(p_m);
        match joint.motion {
            JointMotionKind::Slide => JointValueCandidate::new(dot(sub(target_m, p_m), line.along)),
            JointMotionKind::Turn => self.solve_turn(joint, &line, [p_m, target_m], reference),
        }
    }

    /// Returns the turn about `line` that brings `p_m` to the direction of `target_m`.
    fn solve_turn(
        &self,
        joint: &MovingJoint,
        line: &Line,
        [p_m, target_m]: [Vector; 2],
        reference: f64,
    ) -> JointValueCandidate {
        let on_axis_m = ON_AXIS_TOLERANCE * self.skeleton.reach_m;
        let from = perpendicular_component(sub(p_m, line.through_m), line.along);
        let to = perpendicular_component(sub(target_m, line.through_m), line.along);
        // A point on the axis does not move, and so says nothing about the turn.
        if norm(from) <= on_axis_m || norm(to) <= on_axis_m {
            return JointValueCandidate { value: reference, is_open: true };
        }
        let angle_rad = atan2(dot(cross(from, to), line.along), dot(from, to));
        JointValueCandidate::new(nearest_turn(angle_rad, reference, joint.limits))
    }

    /// Returns two turns: the inner one brings to `target_m` the point that the outer one leaves at
    /// `z`, which is on the circle that the outer axis draws through `p_m` and on the one that the
    /// inner axis draws through `target_m`.
    fn solve_two(
        &self,
        [inner, outer]: [&MovingJoint; 2],
        PointIkProblem { link, p_m, target_m }: PointIkProblem<'_>,
        reference: &[f64],
    ) -> Vec<Vec<JointValueCandidate>> {
        let first = inner.axis_line(link);
        let at_zero = link.compose(&inner.origin);
        let second = outer.axis_line(&at_zero);
        let p_m = at_zero.compose(&outer.origin).transform_point(p_m);
        let mut found = Vec::new();
        for mut z in circle_intersections(&first, target_m, &second, p_m) {
            let q1 = self.solve_turn(inner, &first, [z, target_m], reference[0]);
            if q1.is_open {
                // An open first turn is at its reference, and the second has to fit it.
                let back = inner.transform(-q1.value);
                let local = at_zero.inverse_transform_point(target_m);
                z = at_zero.transform_point(back.transform_point(local));
            }
            found.push(vec![q1, self.solve_turn(outer, &second, [p_m, z], reference[1])]);
        }
        found
    }

    fn finish(self) -> RecoveredJoints {
        let frames = self.chain.forward_kinematics(&self.values);
        let found = self.chain.connector_positions(self.skeleton, &frames);
        let errors = found.iter().zip(self.positions_m).map(|(&a, &b)| norm(sub(a, b)));
        let variables = self.chain.variables.iter().zip(&self.open);
        RecoveredJoints {
            residual_m: errors.fold(0.0, f64::max),
            open: variables.filter(|(_, open)| **open).map(|(v, _)| v.name.clone()).collect(),
            values: self.values,
        }
    }
}

/// A point to be placed by the joints behind a link.
#[derive(Debug, Clone, Copy)]
struct PointIkProblem<'a> {
    /// The link before the joints.
    link: &'a Transform,
    /// The point in the frame of the link behind the joints.
    p_m: Vector,
    /// Its place in the base's frame.
    target_m: Vector,
}

/// A value that places a point; `is_open` if the point lies on the axis and any value would.
#[derive(Debug, Clone, Copy)]
struct JointValueCandidate {
    value: f64,
    is_open: bool,
}

impl JointValueCandidate {
    fn new(value: f64) -> Self {
        Self { value, is_open: false }
    }
}

fn total_change(values: &[JointValueCandidate], reference: &[f64]) -> f64 {
    values.iter().zip(reference).map(|(v, r)| (v.value - r).abs()).sum()
}

fn outside_limits_error(joint: &MovingJoint, value: f64, limits: Limits) -> RecoverError {
    let Limits { lower, upper } = limits;
    RecoverError::OutsideLimits { joint: joint.name.clone(), value, lower, upper }
}

/// Returns, of all angles that differ from `angle_rad` by full turns, the one nearest to
/// `reference_rad` that is inside the limits; the nearest of all if none is.
fn nearest_turn(angle_rad: f64, reference_rad: f64, limits: Option<Limits>) -> f64 {
    let nearest = reference_rad + wrap_angle(angle_rad - reference_rad);
    let turns = [nearest, nearest - TAU, nearest + TAU];
    let mut allowed = turns.into_iter().filter(|&value| limits.is_none_or(|l| l.contains(value)));
    if let Some(turn) = allowed.next() {
        return turn;
    }
    // Distant references end up here: bring the angle near to the middle of the limits.
    let middle = limits.map_or(0.0, |limits| 0.5 * (limits.lower + limits.upper));
    middle + wrap_angle(angle_rad - middle)
}

/// Returns the points where the circle about `first` through `a` meets that about `second` through
/// `b`.
///
/// The planes of the circles meet in a line, and that meets the sphere about a point of `second`
/// through `b`. Circles about parallel axes lie in one plane; then the line is that of the points
/// with equal power. There is one point if circles just touch, or miss each other by rounding.
fn circle_intersections(first: &Line, a: Vector, second: &Line, b: Vector) -> Vec<Vector> {
    // All coordinates are relative to the second circle's center.
    let center = second.nearest(b);
    let radius = norm(sub(b, center));
    let n2 = second.along;
    let (n1, d1) = match first.common_perpendicular(second) {
        Some(_) => (first.along, dot(first.along, sub(a, center))),
        None => {
            let other = first.nearest(a);
            let between = perpendicular_component(sub(other, center), n2);
            let radius_1 = norm(sub(a, other));
            let d = dot(between, between);
            (between, 0.5 * (d + radius * radius - radius_1 * radius_1))
        }
    };
    let along = cross(n1, n2);
    let square = dot(along, along);
    if square == 0.0 {
        // Both axes are the same, so the inner turn does it all.
        return vec![b];
    }
    // The point of the line {n1 x = d1, n2 x = 0} that is nearest to the center.
    let nearest = scaled(cross(n2, along), d1 / square);
    let half_chord = ((radius * radius - dot(nearest, nearest)).max(0.0) / square).sqrt();
    let turns = if half_chord == 0.0 { vec![0.0] } else { vec![half_chord, -half_chord] };
    turns.into_iter().map(|t| add(center, add(nearest, scaled(along, t)))).collect()
}
