//! Options of `sidestep ik` -> goals.

use super::super::arm::{Arm, parse_numbers};
use clap::{Args, ValueEnum};
use sidestep::arms::ik::IkEngine;
use sidestep::arms::kinematics::{
    ArmBody, ArmGoal, MAX_SOLUTIONS, ObstacleSphere, PoseMask, Transform, Vector,
};
use sidestep::import::urdf::Origin;
use sidestep::kernel::InputError;

/// The options that all targets share.
#[derive(Debug, Args)]
pub(super) struct GoalArgs {
    /// Free axes of the target's frame, which do not count: x, y, z (position), rx, ry, rz (rotation)
    #[arg(long, value_name = "AXES", value_delimiter = ',')]
    free: Vec<FreeAxis>,

    /// Solver
    #[arg(long, value_name = "ENGINE", default_value = "auto")]
    engine: EngineArg,

    /// Position tolerance: largest distance in m at which the target counts as reached
    #[arg(long, value_name = "M", default_value_t = 1e-6)]
    tolerance_m: f64,

    /// Orientation tolerance: largest angle in rad at which it counts as reached
    #[arg(long, value_name = "RAD", default_value_t = 1e-6)]
    tolerance_rad: f64,

    /// Number of distinct postures to find
    #[arg(long, value_name = "N", default_value_t = 1)]
    solutions: usize,

    /// Smallest difference between distinct postures, in rad of one joint
    #[arg(long, value_name = "RAD", default_value_t = 0.1)]
    apart: f64,

    /// Find the postures nearest to the starting posture (--joints, --posture)
    #[arg(long)]
    nearest: bool,

    /// Number of random restarts: postures to start from after the first
    #[arg(long, value_name = "N", default_value_t = 100)]
    restarts: usize,

    /// Random seed of these postures
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// Spherical obstacle (center and radius in m); repeatable
    #[arg(long = "obstacle", value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    obstacles: Vec<String>,

    /// Shape of the arm in collisions with obstacles and itself
    #[arg(long, value_name = "BODY", default_value = "shapes")]
    body: BodyArg,

    /// Ignore joint limits
    #[arg(long)]
    ignore_limits: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EngineArg {
    /// The faster one, which is dls
    Auto,
    /// Connectors first, by the rules of the chain (FABRIK on links of fixed length), then the joints
    #[value(alias = "fabrik")]
    Chain,
    /// Damped least squares on the joints
    Dls,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BodyArg {
    /// Thin rods between the connectors
    Rods,
    /// The links' collision shapes; rods where a link has none
    Shapes,
    /// The same, without self-collision: links must not touch each other, unless a joint connects
    /// them or the SRDF file disables their collision
    Own,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FreeAxis {
    X,
    Y,
    Z,
    Rx,
    Ry,
    Rz,
}

impl FreeAxis {
    const TRANSLATIONS: [Self; 3] = [Self::X, Self::Y, Self::Z];
    const ROTATIONS: [Self; 3] = [Self::Rx, Self::Ry, Self::Rz];
}

/// A target of the tip: a position, and an orientation if `is_turned`.
#[derive(Debug, Clone, Copy)]
pub(super) struct TipTarget {
    pub(super) pose: Transform,
    pub(super) is_turned: bool,
}

impl TipTarget {
    pub(super) fn from_position(position_m: Vector) -> Self {
        Self { pose: Transform { origin_m: position_m, ..Transform::IDENTITY }, is_turned: false }
    }

    pub(super) fn from_rpy(position_m: Vector, rpy_rad: Vector) -> Self {
        let pose = Transform::from_urdf_origin(&Origin { xyz_m: position_m, rpy_rad });
        Self { pose, is_turned: true }
    }

    pub(super) fn from_quaternion(
        place: &str,
        position_m: Vector,
        xyzw: [f64; 4],
    ) -> Result<Self, InputError> {
        let pose = Transform::from_quaternion(place, position_m, xyzw)?;
        Ok(Self { pose, is_turned: true })
    }
}

impl GoalArgs {
    /// Returns the arm's body if it counts, and remarks on it.
    ///
    /// # Errors
    /// When its own links must not touch, and it has no shapes.
    pub(super) fn body(&self, arm: &Arm) -> Result<(Option<ArmBody>, Vec<String>), InputError> {
        let is_own = self.body == BodyArg::Own;
        let counts = is_own || (self.body == BodyArg::Shapes && !self.obstacles.is_empty());
        if !counts {
            return Ok((None, Vec::new()));
        }
        let (body, remarks) = arm.selection.body();
        if is_own && body.is_empty() {
            let cause = ["no link has a collision shape that can be read".to_owned()];
            let cause = [&cause[..], &remarks[..]].concat().join("; ");
            let remedy = "give the links boxes, cylinders, spheres or meshes (STL, OBJ, DAE)";
            return Err(InputError::new("--body", cause, remedy));
        }
        Ok((Some(body), remarks))
    }

    /// Returns the goal of a target, for an arm with this body.
    ///
    /// # Errors
    /// When an option is out of range.
    pub(super) fn goal(
        &self,
        target: TipTarget,
        body: &Option<ArmBody>,
    ) -> Result<ArmGoal, InputError> {
        check_positive("--tolerance-m", self.tolerance_m, "m", "a length")?;
        check_positive("--tolerance-rad", self.tolerance_rad, "rad", "an angle")?;
        check_positive("--apart", self.apart, "rad", "an angle")?;
        if !(1..=MAX_SOLUTIONS).contains(&self.solutions) {
            let remedy = format!("ask for 1 to {MAX_SOLUTIONS} postures");
            return Err(InputError::new("--solutions", format!("is {}", self.solutions), remedy));
        }
        Ok(ArmGoal {
            asked: self.pose_constraint(target.is_turned)?,
            tolerance_m: self.tolerance_m,
            tolerance_rad: self.tolerance_rad,
            engine: match self.engine {
                EngineArg::Auto => IkEngine::Auto,
                EngineArg::Chain => IkEngine::Chain,
                EngineArg::Dls => IkEngine::Dls,
            },
            restarts: self.restarts,
            seed: self.seed,
            solutions: self.solutions,
            nearest: self.nearest,
            apart: self.apart,
            ignore_limits: self.ignore_limits,
            body: body.clone(),
            own_body: self.body == BodyArg::Own,
            spheres: self.obstacles.iter().map(parse_sphere).collect::<Result<_, _>>()?,
            ..ArmGoal::from_pose(target.pose)
        })
    }

    /// Returns the part of a target's pose that counts.
    fn pose_constraint(&self, is_turned: bool) -> Result<PoseMask, InputError> {
        PoseMask::with_free(
            is_turned,
            FreeAxis::TRANSLATIONS.map(|axis| self.free.contains(&axis)),
            FreeAxis::ROTATIONS.map(|axis| self.free.contains(&axis)),
        )
    }
}

fn check_positive(option: &str, value: f64, unit: &str, quantity: &str) -> Result<(), InputError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(InputError::new(option, format!("is {value} {unit}"), format!("give {quantity} above 0")))
}

fn parse_sphere(text: &String) -> Result<ObstacleSphere, InputError> {
    let [x, y, z, radius_m] = parse_lengths("--obstacle", "x,y,z,radius", text)?;
    if radius_m < 0.0 {
        let cause = format!("`{text}` has a negative radius");
        return Err(InputError::new("--obstacle", cause, "give a radius of 0 or more"));
    }
    Ok(ObstacleSphere { center_m: [x, y, z], radius_m })
}

/// Parses the `N` lengths of an option, each of a size that a position in m can have.
pub(super) fn parse_lengths<const N: usize>(
    option: &str,
    form: &str,
    text: &str,
) -> Result<[f64; N], InputError> {
    let example = ["0.3", "0.1", "0.4", "0.05"][..N].join(",");
    parse_array(option, text, &format!("write {form} in m, such as {example}"))
}

/// Parses roll, pitch and yaw in rad.
pub(super) fn parse_rpy(option: &str, text: &str) -> Result<Vector, InputError> {
    parse_array(option, text, "write roll,pitch,yaw in rad, such as 3.1416,0,0.5")
}

/// Parses a quaternion x, y, z, w of any length but 0.
pub(super) fn parse_quaternion(option: &str, text: &str) -> Result<[f64; 4], InputError> {
    parse_array(option, text, "write x,y,z,w, scalar last, such as 0,0,0,1 for no turn at all")
}

fn parse_array<const N: usize>(
    option: &str,
    text: &str,
    remedy: &str,
) -> Result<[f64; N], InputError> {
    let numbers = parse_numbers(option, text)?;
    let array: [f64; N] = numbers.try_into().map_err(|numbers: Vec<f64>| {
        let cause = format!("`{text}` has {} of {N} numbers", numbers.len());
        InputError::new(option, cause, remedy)
    })?;
    match array.iter().find(|x| !(-1e7..=1e7).contains(*x)) {
        None => Ok(array),
        Some(x) => Err(InputError::new(option, format!("{x} is out of range"), remedy)),
    }
}
