//! Highest speed, acceleration and jerk of each joint.

use crate::kinematics::{JointMotionKind, SerialChain};
use sidestep_import::urdf::joint_limits::{GivenRates, JointRates as RatesByName};
use std::f64::consts::PI;

/// Speeds of joints without one in the model: half a turn a second, as the joints of a UR5, and 1 m/s.
const DEFAULT_SPEED_RAD_S: f64 = PI;
const DEFAULT_SPEED_M_S: f64 = 1.0;
/// Time in which a joint without a given acceleration reaches its highest speed, s. The data sheet of the Panda allows
/// 0.10 to 0.29 s by joint; with 0.3 s each of its joints stays within it.
const DEFAULT_SPEED_UP_S: f64 = 0.3;
/// Highest acceleration of such joints, rad/s2 or m/s2: that of `MoveIt` for joints without one. Models have speeds of
/// 10 rad/s and more where nobody knew them.
const MAX_DEFAULT_ACCELERATION: f64 = 10.0;
/// Time in which a joint without a given jerk reaches its highest acceleration, s. Drives of arms allow some
/// milliseconds; this is a quarter of the period of the first resonance of arms, about 6 Hz, which a profile excites
/// less the longer this time is.
const DEFAULT_JERK_S: f64 = 0.04;

/// The highest rates of one joint, in rad or m per s, s2 and s3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRates {
    /// Highest speed.
    pub speed: f64,
    /// Highest acceleration.
    pub acceleration: f64,
    /// Highest jerk.
    pub jerk: f64,
}

impl JointRates {
    /// Returns the rates of a joint: those that are given, with the model's speed where none is, or else defaults; all
    /// up to those of `at_most`.
    fn from_given(given: GivenRates, at_most: GivenRates, motion: JointMotionKind) -> Self {
        let speed = lower(given.speed, at_most.speed).unwrap_or(default_speed(motion));
        let acceleration = lower(given.acceleration, at_most.acceleration);
        let usual = (speed / DEFAULT_SPEED_UP_S).min(MAX_DEFAULT_ACCELERATION);
        let acceleration = acceleration.unwrap_or(usual);
        let jerk = lower(given.jerk, at_most.jerk).unwrap_or(acceleration / DEFAULT_JERK_S);
        Self { speed, acceleration, jerk }
    }

    /// Returns the lower ones of two joints' rates.
    fn min(self, other: Self) -> Self {
        Self {
            speed: self.speed.min(other.speed),
            acceleration: self.acceleration.min(other.acceleration),
            jerk: self.jerk.min(other.jerk),
        }
    }

    pub(super) fn scaled(self, factor: f64) -> Self {
        Self {
            speed: self.speed * factor,
            acceleration: self.acceleration * factor,
            jerk: self.jerk * factor,
        }
    }
}

/// A joint whose highest speed is assumed, because nothing gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct AssumedSpeed {
    /// Its name.
    pub joint: String,
    /// The speed, in rad/s or m/s.
    pub speed: f64,
    /// Whether it turns or slides.
    pub motion: JointMotionKind,
}

/// Which rates of a variable are those of all joints, because its own ones are higher.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CutRates {
    /// Whether its acceleration is.
    pub acceleration: bool,
    /// Whether its jerk is.
    pub jerk: bool,
}

/// Returns the speed of a joint without a given one, in rad/s or m/s.
fn default_speed(motion: JointMotionKind) -> f64 {
    match motion {
        JointMotionKind::Turn => DEFAULT_SPEED_RAD_S,
        JointMotionKind::Slide => DEFAULT_SPEED_M_S,
    }
}

/// Returns the lower one of two limits, if there are any.
fn lower(given: Option<f64>, at_most: Option<f64>) -> Option<f64> {
    given.into_iter().chain(at_most).reduce(f64::min)
}

/// Returns the highest rates of each variable of an arm: `given` by the name of a joint, else of the model, else
/// defaults; all up to those of `at_most`. Joints that mimic a variable narrow its rates.
pub fn joint_rates(
    chain: &SerialChain,
    given: &RatesByName,
    at_most: GivenRates,
) -> Vec<JointRates> {
    let own = chain.variables.iter().map(|v| {
        JointRates::from_given(given_rates(given, &v.name, v.max_speed), at_most, v.motion)
    });
    let mut rates: Vec<JointRates> = own.collect();
    for joint in &chain.joints {
        let multiplier = joint.drive.multiplier;
        if multiplier != 0.0 {
            let named = given_rates(given, &joint.name, joint.max_speed);
            let own = JointRates::from_given(named, at_most, joint.motion);
            let variable = &mut rates[joint.drive.variable];
            *variable = variable.min(own.scaled(1.0 / multiplier.abs()));
        }
    }
    rates
}

/// Returns the rates of a joint in a file, with the model's speed where that has none.
fn given_rates(given: &RatesByName, name: &str, model_speed: Option<f64>) -> GivenRates {
    let rates = given.get(name).copied().unwrap_or_default();
    GivenRates { speed: rates.speed.or(model_speed), ..rates }
}

/// Returns the joints whose assumed speeds limit a variable: those of [`joint_rates`] with the same arguments. A joint
/// that mimics a variable limits it as well, and an assumption that another limit makes void is none of them.
pub fn assumed_speeds(
    chain: &SerialChain,
    given: &RatesByName,
    at_most: GivenRates,
) -> Vec<AssumedSpeed> {
    if at_most.speed.is_some() {
        return Vec::new();
    }
    let rates = joint_rates(chain, given, at_most);
    let mut assumed: Vec<AssumedSpeed> = Vec::new();
    let mut add = |name: &str, motion: JointMotionKind, speed: f64| {
        if !assumed.iter().any(|known| known.joint == name) {
            assumed.push(AssumedSpeed { joint: name.into(), speed, motion });
        }
    };
    for (variable, rates) in chain.variables.iter().zip(&rates) {
        let is_given = given_rates(given, &variable.name, variable.max_speed).speed.is_some();
        if !is_given && default_speed(variable.motion) <= rates.speed {
            add(&variable.name, variable.motion, default_speed(variable.motion));
        }
    }
    for joint in &chain.joints {
        let multiplier = joint.drive.multiplier.abs();
        let is_given = given_rates(given, &joint.name, joint.max_speed).speed.is_some();
        if is_given || multiplier == 0.0 {
            continue;
        }
        let speed = default_speed(joint.motion);
        // Computed as in `joint_rates`, so that equal speeds are equal in every bit.
        if speed * (1.0 / multiplier) <= rates[joint.drive.variable].speed {
            add(&joint.name, joint.motion, speed);
        }
    }
    assumed
}

/// Returns of each variable whether the acceleration and the jerk of `at_most` are lower than what it, and the joints
/// that mimic it, may have otherwise.
pub fn rates_cut_by(
    chain: &SerialChain,
    given: &RatesByName,
    at_most: GivenRates,
) -> Vec<CutRates> {
    let rates = joint_rates(chain, given, at_most);
    let freely = joint_rates(chain, given, GivenRates { acceleration: None, ..at_most });
    let jerky = joint_rates(chain, given, GivenRates { jerk: None, ..at_most });
    let pairs = rates.iter().zip(freely.iter().zip(&jerky));
    pairs
        .map(|(rates, (freely, jerky))| CutRates {
            acceleration: freely.acceleration > rates.acceleration,
            jerk: jerky.jerk > rates.jerk,
        })
        .collect()
}
