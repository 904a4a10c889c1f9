//! Error tables from one number: the equal error level of sensors and effectors.
//!
//! The paper's tables are lost, and the tables decide which errors hurt more. Therefore, beside the
//! presets, sensors and effectors are compared at *equal error level* `e`:
//!
//! - Sensor: every row of the confusion matrix has `1 - e` on its diagonal. Distance classes
//!   are exact, so a reading is right with probability `1 - e` exactly. A spurious report
//!   draws its distance class evenly.
//! - Effector: every action ends as intended with probability `1 - e`. The rest is spread
//!   evenly over the paper's other transitions (forward: stays, slips two boxes, drifts left,
//!   drifts right; turns: stays, turns half around).
//!
//! The distribution of a sensor's error mass decides how much it hurts, so there are two recipes;
//! and beams that look the same way compensate for each other's errors, so there are two rings.

use crate::study::setting;
use serde::Serialize;
use sidestep::experiment::sweep::Setting;
use toml::Value;

/// Observations of the sensor, `nothing` first.
const OBSERVATIONS: [&str; 5] = ["nothing", "wall", "door", "person", "robot"];

/// The distribution of the error mass in a sensor's row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ErrorSpread {
    /// Evenly over all other observations: a thing is missed with probability `e / 4`, and
    /// otherwise taken for another thing.
    Even,
    /// Onto `nothing`: a thing is missed with probability `e`.
    Blind,
}

impl ErrorSpread {
    /// In the order of tables and figures.
    pub(super) const ALL: [Self; 2] = [Self::Even, Self::Blind];

    /// Returns its name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Even => "even",
            Self::Blind => "blind",
        }
    }

    /// Returns the confusion matrix at error level `e` (true x reported).
    pub(super) fn confusion(self, e: f64) -> [[f64; OBSERVATIONS.len()]; OBSERVATIONS.len()] {
        let others = (OBSERVATIONS.len() - 1) as f64;
        std::array::from_fn(|truth| {
            std::array::from_fn(|reported| match (self, truth, reported) {
                _ if truth == reported => 1.0 - e,
                (Self::Blind, 1.., 0) => e,
                (Self::Blind, 1.., _) => 0.0,
                _ => e / others,
            })
        })
    }
}

/// The number of beams that a robot has for the same thing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum BeamCount {
    /// The Nomad's ring: three beams look ahead, five to each side.
    Sixteen,
    /// One beam in each direction, for a robot of one box: nothing compensates for an error. This
    /// is nearest to the paper, which has one observation per sensor and object.
    Four,
}

impl BeamCount {
    pub(super) fn bearings_deg(self) -> Vec<f64> {
        let (n, step) = match self {
            Self::Sixteen => (16, 22.5),
            Self::Four => (4, 90.0),
        };
        (0..n).map(|k| f64::from(k) * step).collect()
    }

    /// Returns the side of the robot that carries them, in boxes.
    pub(super) fn size(self) -> u32 {
        match self {
            Self::Sixteen => 2,
            Self::Four => 1,
        }
    }
}

/// The standard actions of the effector, and their transitions (path, turn in degrees), the
/// intended one first.
const ACTIONS: [(&str, &[(&str, i64)]); 3] = [
    ("forward", &[("F", 0), ("", 0), ("FF", 0), ("FL", 0), ("FR", 0)]),
    ("left", &[("", 90), ("", 0), ("", 180)]),
    ("right", &[("", -90), ("", 0), ("", 180)]),
];

/// Returns the probabilities of `n` outcomes at error level `e`, the intended one first.
fn outcomes(n: usize, e: f64) -> Vec<f64> {
    let other = e / (n - 1) as f64;
    (0..n).map(|k| if k == 0 { 1.0 - e } else { other }).collect()
}

/// Returns settings of the sonar ring `equal-ring` and the effector `equal-wheels` of the scenario,
/// so that they err at level `e`.
pub(super) fn settings(e: f64, spread: ErrorSpread, beams: BeamCount) -> Vec<Setting> {
    let mut all = vec![setting("sensors.equal-ring.bearings_deg", beams.bearings_deg())];
    for (name, row) in OBSERVATIONS.iter().zip(spread.confusion(e)) {
        all.push(setting(&format!("sensors.equal-ring.confusion.{name}"), row.to_vec()));
    }
    for (action, transitions) in ACTIONS {
        let mut row: Vec<Value> = Vec::new();
        for ((path, turn), p) in transitions.iter().zip(outcomes(transitions.len(), e)) {
            let mut transition = toml::Table::new();
            transition.insert("p".into(), p.into());
            transition.insert("path".into(), (*path).into());
            transition.insert("turn".into(), (*turn).into());
            row.push(transition.into());
        }
        all.push(setting(&format!("effectors.equal-wheels.{action}"), row));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_the_equal_level_recipe_sum_to_one_and_err_as_often_as_said() {
        for e in [0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.75] {
            for spread in ErrorSpread::ALL {
                for (truth, row) in spread.confusion(e).iter().enumerate() {
                    assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                    assert!((1.0 - row[truth] - e).abs() < 1e-12);
                    assert!(row.iter().all(|&p| p >= 0.0));
                }
            }
            for (_, transitions) in ACTIONS {
                let row = outcomes(transitions.len(), e);
                assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                assert!((1.0 - row[0] - e).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn recipes_differ_in_how_often_a_thing_is_missed() {
        assert_eq!(ErrorSpread::Even.confusion(0.2)[1][0], 0.05);
        assert_eq!(ErrorSpread::Blind.confusion(0.2)[1][0], 0.2);
        assert_eq!(ErrorSpread::Blind.confusion(0.2)[0], ErrorSpread::Even.confusion(0.2)[0]);
    }
}
