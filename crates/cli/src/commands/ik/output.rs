//! A result of `sidestep ik` as text and JSON.

use super::super::arm::{Arm, ArmPositions, format_numbers, format_point};
use crate::console::{LINE_COLS, align_pairs, wrap_text};
use serde::Serialize;
use sidestep::arms::kinematics::{ArmGoal, IkResult, IkSolution, OrientationMask, Vector};

/// The result of the command.
#[derive(Debug, Serialize)]
pub(super) struct IkOutput {
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
    requested: usize,
    #[serde(flatten)]
    pub(super) positions: ArmPositions,
}

#[derive(Debug, Serialize)]
struct Solution {
    /// Joint values from the base out, in rad or m.
    joints: Vec<f64>,
    error_m: f64,
    error_rad: Option<f64>,
}

impl Solution {
    /// Creates the output of a solution; a goal without an orientation has no error of it.
    fn new(solution: &IkSolution, is_turned: bool) -> Self {
        Self {
            joints: solution.values.clone(),
            error_m: solution.error_m,
            error_rad: is_turned.then_some(solution.error_rad),
        }
    }
}

impl IkOutput {
    pub(super) fn new(arm: &Arm, goal: &ArmGoal, result: IkResult, remarks: Vec<String>) -> Self {
        let is_turned = goal.asked.turn != OrientationMask::Free;
        let first = IkSolution {
            values: result.values.clone(),
            error_m: result.error_m,
            error_rad: result.error_rad,
        };
        let all = result.reached.then_some(&first).into_iter().chain(&result.others);
        Self {
            reached: result.reached,
            error_m: result.error_m,
            error_rad: is_turned.then_some(result.error_rad),
            reason: result.reason.map(|reason| reason.to_string()),
            target: goal.target.origin_m,
            target_quaternion: is_turned.then(|| goal.target.quaternion()),
            engine: result.engine.name(),
            iterations: result.iterations,
            starts: result.starts,
            solutions: all.map(|solution| Solution::new(solution, is_turned)).collect(),
            remarks,
            requested: goal.solutions,
            positions: arm.positions(&result.values),
        }
    }

    pub(super) fn text(&self) -> String {
        let verdict = match &self.reason {
            None => "The target is reached.".to_owned(),
            Some(reason) => {
                let text = format!("The target is not reached: {reason}.");
                format!(
                    "{}\nThe nearest posture found is shown.",
                    wrap_text(&text, LINE_COLS).join("\n")
                )
            }
        };
        let mut rows = vec![
            ("target".to_owned(), format_point(&self.target)),
            ("error".to_owned(), format!("{} m", format_numbers(&[self.error_m]))),
        ];
        if let (Some(quaternion), Some(error_rad)) = (self.target_quaternion, self.error_rad) {
            rows.insert(1, ("quaternion".to_owned(), format_numbers(&quaternion)));
            rows.push(("turned off".to_owned(), format!("{} rad", format_numbers(&[error_rad]))));
        }
        format!(
            "{}{}{}{verdict}\n",
            self.positions.text(),
            align_pairs(&rows),
            self.solutions_text()
        )
    }

    /// Returns the postures as a list, if several were requested.
    fn solutions_text(&self) -> String {
        if self.requested == 1 || !self.reached {
            return String::new();
        }
        let rows = self.solutions.iter().enumerate();
        let rows = rows.map(|(i, s)| (format!("posture {}", i + 1), format_numbers(&s.joints)));
        let found = self.solutions.len();
        let missing = if found < self.requested {
            format!(
                "Found {found} of {} postures; more --restarts may find more.\n",
                self.requested
            )
        } else {
            String::new()
        };
        format!("Joint values\n{}{missing}", align_pairs(&rows.collect::<Vec<_>>()))
    }
}
