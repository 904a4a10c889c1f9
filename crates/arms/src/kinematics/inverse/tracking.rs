//! Joint values for the places of connectors: the demands of a chain's motion on an arm's joints within one cycle.
//!
//! A chain of rods has more degrees of freedom than most arms: its motion is a guide. First all connectors are brought
//! as near to their places in it as the joints can, then the connectors that lead are brought to theirs exactly. Both
//! stay in a *room* of each variable: its limits, and the range that its rates allow in a cycle.

use super::super::serial::{JointMotionKind, MovingJoint, SerialChain};
use super::super::skeleton::{LinkAnchor, Skeleton};
use super::super::transform::Vector;
use super::fast_fk::{FastFk, LinkTransforms};
use super::step::{IkStepInput, IkStepper, JointRanges};
use sidestep_kernel::geometry::{norm, sub};

/// Weight of a connector's place in the guide, beside 1 of those that lead: they come first, and are then met exactly
/// in a descent of their own.
const GUIDE_WEIGHT: f64 = 0.3;
/// Largest number of steps toward the guide: it need not be reached, so a few suffice.
const MAX_GUIDE_STEPS: usize = 4;
/// Largest number of steps toward the targets of connectors that lead, which are to be met exactly.
const MAX_LEAD_STEPS: usize = 24;
/// First damping of both, as a fraction of the mean of the matrix's diagonal. Within a cycle joints are near their
/// aims, so it is far below that of descents from any posture; the guide's is larger, because it asks for more than the
/// joints can do.
const GUIDE_DAMPING: f64 = 1e-2;
const LEAD_DAMPING: f64 = 1e-4;
/// Factors of the damping after a step that helped, and after one that did not.
const DAMPING_DECREASE: f64 = 0.1;
const DAMPING_INCREASE: f64 = 10.0;
/// Steps in a row that do not help, after which the descent ends.
const MAX_IDLE_STEPS: usize = 4;
/// Distance from its place, as a fraction of the reach, at which a connector counts as being there: a few hundred times
/// the rounding of forward kinematics.
const ARRIVAL_TOLERANCE: f64 = 1e-13;

/// An arm whose joints follow the places of its connectors.
#[derive(Debug)]
pub struct ConnectorTargetSolver {
    fast_fk: FastFk,
    anchors: Vec<LinkAnchor>,
    limits: JointRanges,
    /// Bound on the travel of any connector per unit of each variable, in m.
    levers_m: Vec<f64>,
    /// Length of the stretched arm, in m.
    reach_m: f64,
    blank: LinkTransforms,
}

/// A connector and where it is to be at the end of a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConnectorTarget {
    /// Index of the connector in the skeleton, the base's being 0.
    pub connector: usize,
    /// Its place in m, in the base's frame.
    pub at_m: Vector,
}

impl ConnectorTargetSolver {
    /// Returns a tracker; `skeleton` must be that of `chain`.
    pub fn new(chain: &SerialChain, skeleton: &Skeleton) -> Self {
        let anchors = skeleton.connectors.clone();
        Self {
            fast_fk: FastFk::new(chain),
            limits: JointRanges::from_chain(chain),
            levers_m: levers_m(chain, &anchors),
            reach_m: skeleton.reach_m,
            blank: LinkTransforms::from_chain(chain),
            anchors,
        }
    }

    /// Returns a bound on the travel of any connector per unit of each variable, in m.
    pub fn levers_m(&self) -> &[f64] {
        &self.levers_m
    }

    /// Returns the distance at which a connector that leads counts as being at its place, in m.
    pub fn arrival_tolerance_m(&self) -> f64 {
        // 1e-9 of the reach: descents that converge end far nearer, those that the room stops are
        // off by far more.
        1e4 * ARRIVAL_TOLERANCE * self.reach_m
    }

    /// Returns the lowest and highest value of each variable; infinite where a joint has no limit.
    pub fn limits(&self) -> &[[f64; 2]] {
        &self.limits.ranges
    }

    /// Returns values inside the limits: those that are beyond by rounding are put at their ends.
    pub fn clamp(&self, mut values: Vec<f64>) -> Vec<f64> {
        self.limits.clamp(&mut values);
        values
    }

    /// Returns the places of all connectors in m, in the base's frame.
    pub fn connector_positions(&self, values: &[f64]) -> Vec<Vector> {
        let mut placed = self.blank.clone();
        self.fast_fk.compute_link_poses(values, &mut placed);
        self.anchors
            .iter()
            .map(|anchor| placed.links[anchor.first].transform_point(anchor.point_m))
            .collect()
    }

    /// Returns whether a variable is at an end of its limits.
    pub fn is_at_limit(&self, values: &[f64]) -> bool {
        let ends = values.iter().zip(&self.limits.ranges);
        ends.into_iter().any(|(value, range)| range.contains(value))
    }

    /// Returns values in their `room` at which the connectors are near the guide's places, if there is one, and those
    /// that lead as near to theirs as the room allows.
    pub fn track(
        &self,
        start: &[f64],
        room: &[[f64; 2]],
        guide: Option<&[Vector]>,
        led: &[ConnectorTarget],
    ) -> Vec<f64> {
        if start.is_empty() {
            return Vec::new();
        }
        let room = JointRanges { ranges: room.to_vec() };
        let mut fit = TrackingDescent::new(self, start);
        if let Some(guide) = guide {
            let mut aims = Vec::new();
            for (connector, &at_m) in guide.iter().enumerate() {
                // Connectors fixed in the base cannot be moved.
                if self.anchors[connector].first > 0 {
                    let is_led = led.iter().any(|aim| aim.connector == connector);
                    let weight = if is_led { 1.0 } else { GUIDE_WEIGHT };
                    aims.push((ConnectorTarget { connector, at_m }, weight));
                }
            }
            fit.descend(aims, &room, MAX_GUIDE_STEPS, GUIDE_DAMPING);
        }
        if !led.is_empty() {
            let aims = led.iter().map(|aim| (*aim, 1.0)).collect();
            fit.descend(aims, &room, MAX_LEAD_STEPS, LEAD_DAMPING);
        }
        fit.values
    }
}

/// A descent of joint values toward targets of connectors.
struct TrackingDescent<'a> {
    arm: &'a ConnectorTargetSolver,
    values: Vec<f64>,
    placed: LinkTransforms,
    stepper: IkStepper,
}

impl<'a> TrackingDescent<'a> {
    fn new(arm: &'a ConnectorTargetSolver, start: &[f64]) -> Self {
        Self {
            arm,
            values: start.to_vec(),
            placed: arm.blank.clone(),
            stepper: IkStepper::default(),
        }
    }

    /// Makes damped steps until the connectors are there or it gets no better.
    fn descend(
        &mut self,
        aims: Vec<(ConnectorTarget, f64)>,
        room: &JointRanges,
        steps: usize,
        mut damping: f64,
    ) {
        let mut next = self.values.clone();
        let mut next_placed = self.placed.clone();
        let mut wanted = self.residuals(&self.values.clone(), &aims, None);
        let mut is_new = true;
        let mut since = 0;
        for _ in 0..steps {
            if merit(&wanted).sqrt() <= ARRIVAL_TOLERANCE * self.arm.reach_m
                || since >= MAX_IDLE_STEPS
            {
                break;
            }
            if is_new {
                self.update_jacobian(&aims);
            }
            let input =
                IkStepInput { values: &self.values, wanted: &wanted, damping, bounds: room };
            self.stepper.step(input, &mut next);
            let next_wanted = self.residuals(&next.clone(), &aims, Some(&mut next_placed));
            is_new = merit(&next_wanted) < merit(&wanted);
            if is_new {
                std::mem::swap(&mut self.values, &mut next);
                std::mem::swap(&mut self.placed, &mut next_placed);
                wanted = next_wanted;
                since = 0;
                damping *= DAMPING_DECREASE;
            } else {
                since += 1;
                damping *= DAMPING_INCREASE;
            }
        }
    }

    /// Returns the weighted vectors from the connectors to their targets at these values.
    fn residuals(
        &mut self,
        values: &[f64],
        aims: &[(ConnectorTarget, f64)],
        placed: Option<&mut LinkTransforms>,
    ) -> Vec<f64> {
        let placed = placed.unwrap_or(&mut self.placed);
        self.arm.fast_fk.compute_link_poses(values, placed);
        let mut residuals = Vec::with_capacity(3 * aims.len());
        for (aim, weight) in aims {
            let anchor = &self.arm.anchors[aim.connector];
            let at_m = placed.links[anchor.first].transform_point(anchor.point_m);
            residuals.extend(sub(aim.at_m, at_m).map(|x| weight * x));
        }
        residuals
    }

    /// Computes the weighted velocities of connectors per unit of each variable.
    fn update_jacobian(&mut self, aims: &[(ConnectorTarget, f64)]) {
        let n = self.values.len();
        let rows = &mut self.stepper.rows;
        rows.clear();
        rows.resize(3 * aims.len() * n, 0.0);
        for ((aim, weight), rows) in aims.iter().zip(rows.chunks_exact_mut(3 * n)) {
            let anchor = &self.arm.anchors[aim.connector];
            let at_m = self.placed.links[anchor.first].transform_point(anchor.point_m);
            let lines = &self.placed.lines;
            self.arm.fast_fk.for_each_joint(lines, anchor.first, at_m, |variable, moves| {
                for (axis, x) in moves.into_iter().enumerate() {
                    rows[axis * n + variable] += weight * x;
                }
            });
        }
    }
}

fn merit(wanted: &[f64]) -> f64 {
    wanted.iter().map(|x| x * x).sum()
}

/// Returns bounds on the travel of any connector per unit of each variable: the lengths of all links between its joints
/// and the connector.
fn levers_m(chain: &SerialChain, anchors: &[LinkAnchor]) -> Vec<f64> {
    let mut levers_m = vec![0.0; chain.variables.len()];
    for (i, joint) in chain.joints.iter().enumerate() {
        let beyond = anchors.iter().filter(|anchor| anchor.first > i);
        let lever_m = beyond.map(|anchor| lever_m(chain, i, anchor)).fold(0.0, f64::max);
        levers_m[joint.drive.variable] += lever_m * joint.drive.multiplier.abs();
    }
    levers_m
}

/// Returns a bound on the travel of a connector beyond joint `i` per unit of the joint.
fn lever_m(chain: &SerialChain, i: usize, anchor: &LinkAnchor) -> f64 {
    if chain.joints[i].motion == JointMotionKind::Slide {
        return 1.0;
    }
    let links = chain.joints[i + 1..anchor.first].iter();
    let links_m = links.map(|link| norm(link.origin.origin_m) + max_joint_slide_m(link));
    norm(anchor.point_m) + links_m.sum::<f64>()
}

/// Returns the longest travel of a joint that slides; 1 m of one without limits, to keep bounds
/// finite.
fn max_joint_slide_m(joint: &MovingJoint) -> f64 {
    match (joint.motion, joint.limits) {
        (JointMotionKind::Turn, _) => 0.0,
        (JointMotionKind::Slide, Some(limits)) => limits.lower.abs().max(limits.upper.abs()),
        (JointMotionKind::Slide, None) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{MotionFilter, MotionState, joint_rates};
    use sidestep_import::urdf::Model;
    use sidestep_import::urdf::joint_limits::{GivenRates, JointRates};
    use sidestep_kernel::geometry::add;
    use sidestep_testing::robot_model;

    /// Returns what each joint can reach within 0.02 s at its highest speed.
    fn room(
        chain: &SerialChain,
        follower: &ConnectorTargetSolver,
        values: &[f64],
    ) -> Vec<[f64; 2]> {
        let filter =
            MotionFilter::new(joint_rates(chain, &JointRates::new(), GivenRates::default()), 0.02)
                .expect("windows of few cycles");
        filter.reference_ranges(&MotionState::default(), values, follower.limits())
    }

    fn arm(model: &str) -> Option<(SerialChain, ConnectorTargetSolver)> {
        let model = Model::load(&robot_model(model)?).expect("a model");
        let chain = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("arm");
        let follower = ConnectorTargetSolver::new(&chain, &chain.skeleton());
        Some((chain, follower))
    }

    const ARMS: [&str; 4] =
        ["iiwa14_primitive_collision.urdf", "ur5_robot.urdf", "panda.urdf", "RSNAKE_snake.urdf"];

    #[test]
    fn places_are_those_of_forward_kinematics() {
        for (chain, follower) in ARMS.into_iter().filter_map(arm) {
            let values = chain.rest_values();
            let expected =
                chain.connector_positions(&chain.skeleton(), &chain.forward_kinematics(&values));
            for (a, b) in follower.connector_positions(&values).into_iter().zip(expected) {
                assert!(norm(sub(a, b)) < 1e-12, "{}", chain.tip);
            }
        }
    }

    /// Leads each arm's tool along a straight line: wherever the room allows it, the tool is there exactly, and no
    /// joint leaves its room.
    #[test]
    fn a_tool_is_where_it_is_led_or_a_joint_is_at_the_end_of_its_room() {
        for (chain, follower) in ARMS.into_iter().filter_map(arm) {
            let mut values: Vec<f64> =
                follower.clamp(chain.rest_values().iter().map(|x| x + 0.3).collect());
            let tip = follower.connector_positions(&values).len() - 1;
            let mut led = 0;
            for _ in 0..100 {
                let mut places = follower.connector_positions(&values);
                places[tip] = add(places[tip], [-0.001, 0.001, -0.0005]);
                let aim = ConnectorTarget { connector: tip, at_m: places[tip] };
                let room = room(&chain, &follower, &values);
                let next = follower.track(&values, &room, Some(&places), &[aim]);
                assert!(
                    next.iter().zip(&room).all(|(x, [a, b])| (a..=b).contains(&x)),
                    "{}",
                    chain.tip
                );
                let off_m = norm(sub(follower.connector_positions(&next)[tip], aim.at_m));
                led += usize::from(off_m <= follower.arrival_tolerance_m());
                values = next;
            }
            assert!(led >= 90, "{}: {led}", chain.tip);
        }
    }

    #[test]
    fn no_connector_goes_farther_than_the_levers_say() {
        for (chain, follower) in ARMS.into_iter().filter_map(arm) {
            let rest = follower.clamp(chain.rest_values().iter().map(|x| x - 0.2).collect());
            for i in 0..rest.len() {
                let mut turned = rest.clone();
                turned[i] += 0.1;
                let [a, b] = [&rest, &turned].map(|values| follower.connector_positions(values));
                let way_m = a.iter().zip(&b).map(|(a, b)| norm(sub(*a, *b))).fold(0.0, f64::max);
                assert!(way_m <= 0.1 * follower.levers_m()[i] + 1e-12, "{} {i}", chain.tip);
            }
        }
    }
}
