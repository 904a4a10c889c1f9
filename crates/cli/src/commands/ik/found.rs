//! An answer of `sidestep ik` as text and JSON.

use super::super::arm::{Arm, Placed, in_micros, meters};
use crate::console::{LINE_COLS, aligned, wrapped};
use serde::Serialize;
use sidestep::worlds::chain::kinematics::{ArmAnswer, ArmGoal, Posture, Turn, Vector};

/// The answer of the command.
#[derive(Debug, Serialize)]
pub(super) struct Found {
    pub(super) reached: bool,
    /// Distance of the tip from the target in m, along the axes that count.
    error_m: f64,
    /// Angle in rad between the tip's orientation and the requested one; null if no orientation counts.
    error_rad: Option<f64>,
    /// The reason why the target is not reached; null if it is.
    reason: Option<String>,
    target: Vector,
    /// The requested orientation, as a quaternion x, y, z, w; null if none counts.
    target_quaternion: Option<[f64; 4]>,
    engine: &'static str,
    /// Number of steps, over all starts.
    iterations: usize,
    /// Number of postures that the search started from.
    starts: usize,
    /// All postures found that reach the target, the one of `joints` first; empty if it is not
    /// reached.
    solutions: Vec<Solution>,
    /// Meshes that stand as boxes, and shapes that could not be read.
    remarks: Vec<String>,
    /// Number of requested postures.
    #[serde(skip)]
    wanted: usize,
    #[serde(flatten)]
    pub(super) placed: Placed,
}

#[derive(Debug, Serialize)]
struct Solution {
    /// Joint values from the base out, in rad or m.
    joints: Vec<f64>,
    error_m: f64,
    error_rad: Option<f64>,
}

impl Found {
    pub(super) fn new(arm: &Arm, goal: &ArmGoal, answer: ArmAnswer, remarks: Vec<String>) -> Self {
        let is_turned = goal.asked.turn != Turn::Free;
        let angle = |error_rad: f64| is_turned.then_some(error_rad);
        let solution = |posture: &Posture| Solution {
            joints: posture.values.clone(),
            error_m: posture.error_m,
            error_rad: angle(posture.error_rad),
        };
        let first = Posture {
            values: answer.values.clone(),
            error_m: answer.error_m,
            error_rad: answer.error_rad,
        };
        let all = answer.reached.then_some(&first).into_iter().chain(&answer.others);
        Self {
            reached: answer.reached,
            error_m: answer.error_m,
            error_rad: angle(answer.error_rad),
            reason: answer.reason.map(|reason| reason.to_string()),
            target: goal.target.origin_m,
            target_quaternion: is_turned.then(|| goal.target.quaternion()),
            engine: answer.engine.name(),
            iterations: answer.iterations,
            starts: answer.starts,
            solutions: all.map(solution).collect(),
            remarks,
            wanted: goal.solutions,
            placed: arm.at(&answer.values),
        }
    }

    pub(super) fn text(&self) -> String {
        let verdict = match &self.reason {
            None => "The target is reached.".to_owned(),
            Some(reason) => {
                let words = format!("The target is not reached: {reason}.");
                format!(
                    "{}\nThe nearest posture found is shown.",
                    wrapped(&words, LINE_COLS).join("\n")
                )
            }
        };
        let mut rows = vec![
            ("target".to_owned(), meters(&self.target)),
            ("error".to_owned(), format!("{} m", in_micros(&[self.error_m]))),
        ];
        if let (Some(quaternion), Some(error_rad)) = (self.target_quaternion, self.error_rad) {
            rows.insert(1, ("quaternion".to_owned(), in_micros(&quaternion)));
            rows.push(("turned off".to_owned(), format!("{} rad", in_micros(&[error_rad]))));
        }
        format!("{}{}{}{verdict}\n", self.placed.text(), aligned(&rows), self.list())
    }

    /// Returns the postures as a list, if several were requested.
    fn list(&self) -> String {
        if self.wanted == 1 || !self.reached {
            return String::new();
        }
        let rows = self.solutions.iter().enumerate();
        let rows = rows.map(|(i, s)| (format!("posture {}", i + 1), in_micros(&s.joints)));
        let found = self.solutions.len();
        let missing = if found < self.wanted {
            format!("Found {found} of {} postures; more --restarts may find more.\n", self.wanted)
        } else {
            String::new()
        };
        format!("Joint values\n{}{missing}", aligned(&rows.collect::<Vec<_>>()))
    }
}
