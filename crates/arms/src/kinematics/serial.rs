//! A model's joints from base to tip, and forward kinematics.

use super::transform::{Line, Transform, Vector};
use sidestep_import::urdf::{JointKind, Limits, Model};
use sidestep_kernel::InputError;
use sidestep_kernel::geometry::scaled;

/// The joints between two links of a model. Fixed joints are merged into the links.
///
/// Link 0 is the base; joint `j` (from 0) carries link `j + 1`. A joint that mimics another has
/// no value of its own: the values of a posture are those of [`SerialChain::variables`].
#[derive(Debug, Clone, PartialEq)]
pub struct SerialChain {
    /// Name of the link in whose frame all places are.
    pub base: String,
    /// Name of the link that goals are for; of a part of an arm, its last connector.
    pub tip: String,
    /// The variables, in the order from base to tip.
    pub variables: Vec<Dof>,
    pub(crate) joints: Vec<MovingJoint>,
    /// The tip in the last link.
    pub(super) to_tip: Transform,
}

/// A value that a posture has to give.
#[derive(Debug, Clone, PartialEq)]
pub struct Dof {
    /// The joint whose value it is. The joint need not be between base and tip if one that is
    /// mimics it.
    pub name: String,
    /// Whether the value is an angle in rad or a displacement in m.
    pub motion: JointMotionKind,
    /// Lowest and highest value; none for continuous joints.
    pub limits: Option<Limits>,
    /// Highest speed, in rad/s or m/s; none where the model gives none.
    pub max_speed: Option<f64>,
}

/// How a joint with one degree of freedom moves; others cannot be between base and tip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMotionKind {
    /// About its axis, in rad.
    Turn,
    /// Along its axis, in m.
    Slide,
}

impl JointMotionKind {
    /// Returns the motion of joints of a kind that a single value moves.
    pub(super) fn from_kind(kind: JointKind) -> Option<Self> {
        match kind {
            JointKind::Revolute | JointKind::Continuous => Some(Self::Turn),
            JointKind::Prismatic => Some(Self::Slide),
            JointKind::Fixed | JointKind::Floating | JointKind::Planar => None,
        }
    }

    /// Returns the motion by `value` about or along the unit vector `axis`.
    pub(super) fn transform(self, axis: Vector, value: f64) -> Transform {
        match self {
            Self::Turn => Transform::from_axis_angle(axis, value),
            Self::Slide => Transform::from_translation(scaled(axis, value)),
        }
    }

    /// Returns the unit of values and limits, for messages.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Turn => "rad",
            Self::Slide => "m",
        }
    }
}

/// A joint that can move, with the fixed joints before it merged into it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MovingJoint {
    pub(crate) name: String,
    pub(crate) motion: JointMotionKind,
    /// The joint's frame in the link before it.
    pub(super) origin: Transform,
    pub(super) axis: Vector,
    pub(super) limits: Option<Limits>,
    pub(crate) max_speed: Option<f64>,
    pub(crate) drive: JointCoupling,
}

/// A joint's value: `multiplier * values[variable] + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointCoupling {
    pub(crate) variable: usize,
    pub(crate) multiplier: f64,
    pub(super) offset: f64,
}

impl JointCoupling {
    pub(super) fn value(&self, values: &[f64]) -> f64 {
        self.multiplier * values[self.variable] + self.offset
    }

    pub(super) fn is_identity(&self) -> bool {
        self.multiplier == 1.0 && self.offset == 0.0
    }
}

impl MovingJoint {
    /// Returns the turn or slide alone, without the origin.
    pub(super) fn transform(&self, value: f64) -> Transform {
        self.motion.transform(self.axis, value)
    }

    /// Returns its axis, if the link before it stands at `before`.
    pub(super) fn axis_line(&self, before: &Transform) -> Line {
        let frame = before.compose(&self.origin);
        Line { through_m: frame.origin_m, along: frame.transform_direction(self.axis) }
    }
}

/// Poses of all links, in the base's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFrames {
    /// Link 0 (the base), then the link that each joint carries.
    pub links: Vec<Transform>,
    /// The frame of the tip link, which is fixed in the last of them.
    pub tip: Transform,
}

impl SerialChain {
    /// Returns the joints from the link `base` to the link `tip` of `model` (indices of its links).
    /// `place` names the source of the tip's name in errors.
    ///
    /// # Errors
    /// When the tip is not attached to the base, or only through a joint that no single value
    /// moves.
    pub fn new(model: &Model, base: usize, tip: usize, place: &str) -> Result<Self, InputError> {
        let path = model.joint_path(base, tip).ok_or_else(|| {
            let cause = format!("`{}` does not hang on `{}`", model.links[tip], model.links[base]);
            InputError::new(place, cause, "give a link that is further from the root")
        })?;
        let mut chain = Self {
            base: model.links[base].clone(),
            tip: model.links[tip].clone(),
            variables: Vec::new(),
            joints: Vec::new(),
            to_tip: Transform::IDENTITY,
        };
        let mut drivers = Vec::new();
        for joint in path {
            chain.push(model, joint, &mut drivers, place)?;
        }
        Ok(chain)
    }

    /// Appends a joint of the model. `drivers` are the joints that own the variables.
    fn push(
        &mut self,
        model: &Model,
        index: usize,
        drivers: &mut Vec<usize>,
        place: &str,
    ) -> Result<(), InputError> {
        let joint = &model.joints[index];
        let origin = self.to_tip.compose(&Transform::from_urdf_origin(&joint.origin));
        if joint.kind == JointKind::Fixed {
            self.to_tip = origin;
            return Ok(());
        }
        let motion = JointMotionKind::from_kind(joint.kind).ok_or_else(|| {
            let cause = format!("joint `{}` has more than one degree of freedom", joint.name);
            InputError::new(place, cause, "choose base and tip on one side of it")
        })?;
        let (driver, multiplier, offset) = mimic_source(model, index);
        let known = drivers.iter().position(|&known| known == driver);
        let variable = known.unwrap_or_else(|| {
            drivers.push(driver);
            self.variables.push(joint_to_dof(model, driver));
            drivers.len() - 1
        });
        self.joints.push(MovingJoint {
            name: joint.name.clone(),
            motion,
            origin,
            axis: joint.axis,
            limits: joint.limits,
            max_speed: joint.max_speed,
            drive: JointCoupling { variable, multiplier, offset },
        });
        self.to_tip = Transform::IDENTITY;
        Ok(())
    }

    /// Returns how a joint of the model, between base and tip or beside them, follows the variables;
    /// none if it does not.
    pub(super) fn coupling(&self, model: &Model, joint: usize) -> Option<JointCoupling> {
        let (driver, multiplier, offset) = mimic_source(model, joint);
        let name = &model.joints[driver].name;
        let variable = self.variables.iter().position(|variable| variable.name == *name)?;
        Some(JointCoupling { variable, multiplier, offset })
    }

    /// Computes forward kinematics: the poses of links and tip at these values of the variables,
    /// inside their limits or not.
    ///
    /// # Panics
    /// If there are not as many values as variables.
    pub fn forward_kinematics(&self, values: &[f64]) -> LinkFrames {
        assert_eq!(values.len(), self.variables.len(), "one value for each variable");
        let mut links = Vec::with_capacity(self.joints.len() + 1);
        let mut link = Transform::IDENTITY;
        links.push(link);
        for joint in &self.joints {
            link = link.compose(&joint.origin).compose(&joint.transform(joint.drive.value(values)));
            links.push(link);
        }
        LinkFrames { tip: link.compose(&self.to_tip), links }
    }

    /// Returns the same joints with a tool on the tip: its frame in that of the tip is the new tip.
    #[must_use]
    pub fn with_tool(self, tool: &Transform) -> Self {
        Self { to_tip: self.to_tip.compose(tool), ..self }
    }

    /// Returns the values of a named posture of `model`, by joint; joints that it leaves out are at
    /// rest. Of several values for one joint the last one holds.
    pub fn posture_values(&self, model: &Model, posture: &[(usize, f64)]) -> Vec<f64> {
        let mut values = self.rest_values();
        for (value, variable) in values.iter_mut().zip(&self.variables) {
            let mut given = posture.iter().rev();
            let last = given.find(|(joint, _)| model.joints[*joint].name == variable.name);
            if let Some((_, last)) = last {
                *value = *last;
            }
        }
        values
    }

    /// Returns the values nearest to zero that are inside the limits.
    pub fn rest_values(&self) -> Vec<f64> {
        let limits = self.variables.iter().map(|v| v.limits);
        limits.map(|limits| limits.map_or(0.0, |l| 0f64.clamp(l.lower, l.upper))).collect()
    }

    /// Checks that there is a finite value for each variable. `place` names the source of the
    /// values.
    ///
    /// # Errors
    /// When there are more or fewer values, with the names; or when one is not finite.
    pub fn check_joint_values(&self, place: &str, values: &[f64]) -> Result<(), InputError> {
        let names: Vec<&str> = self.variables.iter().map(|v| v.name.as_str()).collect();
        if values.len() != names.len() {
            let cause = format!(
                "{} values for the {} joints up to `{}`",
                values.len(),
                names.len(),
                self.tip
            );
            let remedy = format!("give a value for each of: {}", names.join(", "));
            return Err(InputError::new(place, cause, remedy));
        }
        if let Some(i) = values.iter().position(|value| !value.is_finite()) {
            let cause = format!("`{}` is {}", names[i], values[i]);
            return Err(InputError::new(place, cause, "give finite numbers"));
        }
        Ok(())
    }

    /// Checks that all joints, including mimicking ones, are inside their limits. `place` names the
    /// source of the values.
    ///
    /// # Errors
    /// When one is outside, with its name and its limits.
    pub fn check_limits(&self, place: &str, values: &[f64]) -> Result<(), InputError> {
        if let Some((name, motion, limits, value)) = self.values_outside_limits(values).next() {
            let unit = motion.unit();
            let cause = format!("joint `{name}` cannot be at {value} {unit}");
            let remedy = format!("stay between {} and {} {unit}", limits.lower, limits.upper);
            return Err(InputError::new(place, cause, remedy));
        }
        Ok(())
    }

    /// Returns the names of the joints outside their limits, including mimicking ones, each once.
    pub fn outside_limits<'a>(&'a self, values: &'a [f64]) -> Vec<&'a str> {
        let mut names = Vec::new();
        for (name, ..) in self.values_outside_limits(values) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    fn values_outside_limits<'a>(
        &'a self,
        values: &'a [f64],
    ) -> impl Iterator<Item = (&'a str, JointMotionKind, Limits, f64)> {
        let of_variables = self
            .variables
            .iter()
            .zip(values)
            .map(|(v, &x)| (v.name.as_str(), v.motion, v.limits, x));
        let of_joints = self
            .joints
            .iter()
            .map(|j| (j.name.as_str(), j.motion, j.limits, j.drive.value(values)));
        of_variables.chain(of_joints).filter_map(|(name, motion, limits, value)| {
            let limits = limits.filter(|limits| !limits.contains(value))?;
            Some((name, motion, limits, value))
        })
    }
}

/// Returns the joint at the end of the mimicry from `joint`, and `joint`'s value as a function of
/// its.
fn mimic_source(model: &Model, joint: usize) -> (usize, f64, f64) {
    let mut driver = joint;
    let mut multiplier = 1.0;
    let mut offset = 0.0;
    // Models contain no cycles of mimicry.
    while let Some(mimic) = &model.joints[driver].mimic {
        offset += multiplier * mimic.offset;
        multiplier *= mimic.multiplier;
        driver = mimic.joint;
    }
    (driver, multiplier, offset)
}

fn joint_to_dof(model: &Model, joint: usize) -> Dof {
    let joint = &model.joints[joint];
    let motion = match joint.kind {
        JointKind::Prismatic => JointMotionKind::Slide,
        _ => JointMotionKind::Turn,
    };
    let limits = joint.limits;
    let max_speed = joint.max_speed;
    Dof { name: joint.name.clone(), motion, limits, max_speed }
}
