//! Errors of a posture, and how the joints change them.
//!
//! Every row of the Jacobian is an error in m: of the tip along an axis that counts, of its
//! orientation about an axis that counts (an angle times [`RADIAN_LENGTH`] of the arm's reach), or of a part
//! of the arm that is in another body.

use super::super::serial::SerialChain;
use super::super::skeleton::Skeleton;
use super::super::transform::{Transform, Vector};
use super::contacts::{ContactFinder, ContactSet};
use super::fast_fk::{FastFk, LinkTransforms, rotation_between};
use super::goal::{ArmGoal, OrientationMask};
use sidestep_kernel::geometry::{cross, dot, norm, normalized, perpendicular, scaled, sub};
use sidestep_kernel::math::atan2;

/// The length as which an error of 1 rad counts, as a fraction of the arm's reach. Steps reduce the sum of squared
/// errors, so it trades place off against orientation: the last joints of most arms turn the tip on a lever of about
/// this length. Both errors end below their tolerances in any case; the value was not tuned by itself.
const RADIAN_LENGTH: f64 = 0.3;

/// What a search measures at each posture.
pub(super) struct PostureEvaluator<'a> {
    fast_fk: FastFk,
    goal: &'a ArmGoal,
    contacts: ContactFinder<'a>,
    /// The axes along which the tip's position counts, in the base's frame.
    along: Vec<Vector>,
    radian_m: f64,
}

/// Kept from posture to posture, so that none allocates.
#[derive(Debug, Clone)]
pub(super) struct PostureEvaluation {
    pub(super) placed: LinkTransforms,
    /// Wanted changes of the rows: those of the tip, then one for each contact.
    pub(super) wanted: Vec<f64>,
    /// Axes about which the tip's orientation counts, each for a row.
    about: Vec<Vector>,
    pub(super) touched: ContactSet,
    pub(super) tip_m: f64,
    pub(super) turn_rad: f64,
}

impl PostureEvaluation {
    /// Returns the square of the quantity that steps must reduce.
    pub(super) fn merit(&self) -> f64 {
        self.wanted.iter().map(|x| x * x).sum()
    }
}

impl<'a> PostureEvaluator<'a> {
    pub(super) fn new(chain: &'a SerialChain, skeleton: &'a Skeleton, goal: &'a ArmGoal) -> Self {
        // If all axes count it does not matter which, and these cost no digits.
        let axes =
            if goal.asked.has_whole_position() { &Transform::IDENTITY } else { &goal.target };
        let counts = (0..3).filter(|&axis| goal.asked.along[axis]);
        Self {
            fast_fk: FastFk::new(chain),
            along: counts.map(|axis| axes.axis(axis)).collect(),
            contacts: ContactFinder::new(skeleton, goal),
            radian_m: RADIAN_LENGTH * skeleton.reach_m.max(f64::MIN_POSITIVE),
            goal,
        }
    }

    /// Returns the length as which an angle of 1 rad counts.
    pub(super) fn radian_m(&self) -> f64 {
        self.radian_m
    }

    /// Returns an evaluation of no posture, as a buffer for [`PostureEvaluator::evaluate`].
    pub(super) fn empty_evaluation(chain: &SerialChain) -> PostureEvaluation {
        PostureEvaluation {
            placed: LinkTransforms::from_chain(chain),
            wanted: Vec::new(),
            about: Vec::new(),
            touched: ContactSet::default(),
            tip_m: f64::INFINITY,
            turn_rad: f64::INFINITY,
        }
    }

    /// Computes the links' poses and the errors at `values`; the Jacobian needs both.
    pub(super) fn evaluate(&self, values: &[f64], evaluation: &mut PostureEvaluation) {
        self.fast_fk.compute_link_poses(values, &mut evaluation.placed);
        let tip = evaluation.placed.tip;
        let missing = sub(self.goal.target.origin_m, tip.origin_m);
        evaluation.wanted.clear();
        evaluation.wanted.extend(self.along.iter().map(|axis| dot(missing, *axis)));
        evaluation.tip_m = evaluation.merit().sqrt();
        self.evaluate_orientation(&tip, evaluation);
        self.contacts.find(values, &evaluation.placed, &mut evaluation.touched);
        evaluation
            .wanted
            .extend(evaluation.touched.contacts.iter().map(|contact| contact.wanted_m));
    }

    fn evaluate_orientation(&self, tip: &Transform, evaluation: &mut PostureEvaluation) {
        evaluation.about.clear();
        let target = &self.goal.target;
        match self.goal.asked.turn {
            OrientationMask::Free => evaluation.turn_rad = 0.0,
            OrientationMask::Whole => {
                let turn = rotation_between(&tip.rotation, &target.rotation);
                evaluation.turn_rad = norm(turn);
                evaluation.about.extend(Transform::IDENTITY.rotation);
                evaluation.wanted.extend(turn.map(|x| x * self.radian_m));
            }
            OrientationMask::Axis(axis) => {
                let [own, wanted] = [tip.axis(axis as usize), target.axis(axis as usize)];
                let normal = cross(own, wanted);
                evaluation.turn_rad = atan2(norm(normal), dot(own, wanted));
                // Where the axes are parallel, any normal will do.
                let about = normalized(normal).unwrap_or_else(|| perpendicular(own));
                // The second row has no error: it keeps steps from turning the axis to the other
                // side.
                evaluation.about.extend([about, cross(own, about)]);
                evaluation.wanted.extend([evaluation.turn_rad * self.radian_m, 0.0]);
            }
        }
    }

    /// Returns the distance of a tip from the target in m, along the axes that count, and the angle
    /// of its orientation error.
    pub(super) fn tip_errors(&self, tip: &Transform) -> (f64, f64) {
        let missing = sub(self.goal.target.origin_m, tip.origin_m);
        let squares = self.along.iter().map(|axis| dot(missing, *axis) * dot(missing, *axis));
        let target = &self.goal.target;
        let turn_rad = match self.goal.asked.turn {
            OrientationMask::Free => 0.0,
            OrientationMask::Whole => norm(rotation_between(&tip.rotation, &target.rotation)),
            OrientationMask::Axis(axis) => {
                let [own, wanted] = [tip, target].map(|frame| frame.axis(axis as usize));
                atan2(norm(cross(own, wanted)), dot(own, wanted))
            }
        };
        (squares.sum::<f64>().sqrt(), turn_rad)
    }

    /// Computes the Jacobian at a posture that was evaluated: rows of an entry for each of `n`
    /// variables, one row after the other.
    pub(super) fn jacobian(&self, evaluation: &PostureEvaluation, n: usize, rows: &mut Vec<f64>) {
        rows.clear();
        rows.resize(evaluation.wanted.len() * n, 0.0);
        let LinkTransforms { lines, tip, .. } = &evaluation.placed;
        let (of_tip, others) = rows.split_at_mut(self.along.len() * n);
        self.fast_fk.for_each_joint(lines, lines.len(), tip.origin_m, |variable, moves| {
            for (row, axis) in of_tip.chunks_exact_mut(n).zip(&self.along) {
                row[variable] += dot(moves, *axis);
            }
        });
        let (of_turn, of_contacts) = others.split_at_mut(evaluation.about.len() * n);
        self.fast_fk.for_each_turning_joint(lines, |variable, turns| {
            for (row, about) in of_turn.chunks_exact_mut(n).zip(&evaluation.about) {
                row[variable] += self.radian_m * dot(turns, *about);
            }
        });
        for (row, contact) in of_contacts.chunks_exact_mut(n).zip(&evaluation.touched.contacts) {
            for pull in &contact.pulls {
                let away = scaled(contact.away, pull.share);
                self.fast_fk.for_each_joint(lines, pull.link, pull.at_m, |variable, moves| {
                    row[variable] += dot(moves, away);
                });
            }
        }
    }
}
