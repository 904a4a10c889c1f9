//! Arms of robot models: the options that choose one and its posture, and both as text and JSON.

use super::arm_picture::ArmPicture;
use crate::console::{Console, align_pairs, format_fixed};
use clap::Args;
use serde::Serialize;
use sidestep::arms::kinematics::{
    ArmFiles, ArmModel, Dof, ObstacleSphere, SkeletonRod, Transform, Vector,
};
use sidestep::kernel::InputError;
use std::path::PathBuf;

/// The options that choose an arm and its posture.
#[derive(Debug, Args)]
pub(crate) struct ArmArgs {
    /// Robot model (URDF file)
    #[arg(value_name = "URDF")]
    urdf: PathBuf,

    /// Base link, to which positions are relative [default: the root link]
    #[arg(long, value_name = "LINK")]
    base: Option<String>,

    /// Tip link; its position is computed [default: the end of the longest arm]
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,

    /// SRDF file with groups, named postures, and pairs of links that may touch
    #[arg(long, value_name = "FILE")]
    srdf: Option<PathBuf>,

    /// Take base and tip from this group of the SRDF file
    #[arg(long, value_name = "NAME", requires = "srdf", conflicts_with_all = ["base", "tip"])]
    group: Option<String>,

    /// Joint values, one for each moving joint from base to tip, in rad or m
    #[arg(long, value_name = "Q1,Q2,...", allow_hyphen_values = true)]
    joints: Option<String>,

    /// Take the joint values from this named posture (group state) of the SRDF file
    #[arg(long, value_name = "NAME", requires = "srdf", conflicts_with = "joints")]
    posture: Option<String>,
}

/// An arm in a posture.
pub(crate) struct Arm {
    pub(crate) selection: ArmModel,
    pub(crate) values: Vec<f64>,
}

impl ArmArgs {
    /// Reads the files and returns the arm in its posture.
    ///
    /// # Errors
    /// When a file, a link, a group, the posture or the values are wrong.
    pub(crate) fn load(&self, console: Console) -> Result<Arm, InputError> {
        let selection = self.files().load()?;
        for finding in selection.findings() {
            console.note(format!("note: {finding}"));
        }
        let (place, values) = match &self.joints {
            Some(text) => ("--joints", parse_numbers("--joints", text)?),
            None => ("--posture", selection.named_posture(self.posture.as_deref())?),
        };
        selection.chain.check_joint_values(place, &values)?;
        Ok(Arm { selection, values })
    }

    fn files(&self) -> ArmFiles {
        ArmFiles {
            urdf: self.urdf.clone(),
            base: self.base.clone(),
            tip: self.tip.clone(),
            srdf: self.srdf.clone(),
            group: self.group.clone(),
        }
    }
}

/// Reads numbers separated by commas.
///
/// # Errors
/// When a word is not a number.
pub(crate) fn parse_numbers(option: &str, text: &str) -> Result<Vec<f64>, InputError> {
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    text.split(',').map(|word| parse_number(option, word.trim())).collect()
}

fn parse_number(option: &str, word: &str) -> Result<f64, InputError> {
    word.parse().map_err(|_| {
        let cause = format!("`{word}` is no number");
        InputError::new(option, cause, "write numbers with commas between: 0.1,-0.2")
    })
}

/// The posture of an arm and the positions that follow from it.
#[derive(Debug, Serialize)]
pub(crate) struct ArmPositions {
    robot: String,
    base_link: String,
    tip_link: String,
    /// Position of the tip in m.
    tip: Vector,
    /// Rows of the tip's rotation matrix.
    rotation: [Vector; 3],
    /// Joint values from the base out, in rad or m, as `--joints` takes them.
    joints: Vec<f64>,
    /// The joints that these values belong to, in the same order.
    joint_info: Vec<JointPosition>,
    /// Names of joints outside their limits, including those that mimic others.
    pub(crate) outside_limits: Vec<String>,
    /// Positions of the connectors in m, from the base out.
    connectors: Vec<Vector>,
    rods: Vec<RodLimits>,
}

#[derive(Debug, Serialize)]
struct JointPosition {
    name: String,
    value: f64,
    unit: &'static str,
    /// Lowest and highest value in rad or m; null where the joint has no limits.
    limits: Option<[f64; 2]>,
}

/// Shortest and longest length in m of the rod between two connectors; null where it has no limit.
#[derive(Debug, Serialize)]
struct RodLimits {
    min_m: f64,
    max_m: Option<f64>,
}

impl Arm {
    pub(crate) fn positions(&self, values: &[f64]) -> ArmPositions {
        let chain = &self.selection.chain;
        let frames = chain.forward_kinematics(values);
        let skeleton = chain.skeleton();
        let Transform { rotation, origin_m } = frames.tip;
        ArmPositions {
            robot: self.selection.model.name.clone(),
            base_link: chain.base.clone(),
            tip_link: chain.tip.clone(),
            tip: origin_m,
            rotation,
            joints: values.to_vec(),
            joint_info: chain
                .variables
                .iter()
                .zip(values)
                .map(|(v, &q)| joint_position(v, q))
                .collect(),
            outside_limits: chain.outside_limits(values).into_iter().map(str::to_owned).collect(),
            connectors: chain.connector_positions(&skeleton, &frames),
            rods: skeleton.rods.iter().map(rod_limits).collect(),
        }
    }
}

fn joint_position(variable: &Dof, value: f64) -> JointPosition {
    JointPosition {
        name: variable.name.clone(),
        value,
        unit: variable.motion.unit(),
        limits: variable.limits.map(|limits| [limits.lower, limits.upper]),
    }
}

fn rod_limits(rod: &SkeletonRod) -> RodLimits {
    RodLimits { min_m: rod.min_m, max_m: rod.max_m.is_finite().then_some(rod.max_m) }
}

impl ArmPositions {
    /// Returns the arm as a picture, with the target of its tip and the obstacles.
    pub(crate) fn picture<'a>(
        &'a self,
        target: Option<Vector>,
        obstacles: &'a [ObstacleSphere],
    ) -> ArmPicture<'a> {
        ArmPicture { robot: &self.robot, connectors: &self.connectors, target, obstacles }
    }

    pub(crate) fn text(&self) -> String {
        let joints: Vec<_> =
            self.joint_info.iter().map(|j| (j.name.clone(), joint_text(j))).collect();
        let last = self.connectors.len() - 1;
        let mut points = Vec::new();
        for (i, point) in self.connectors.iter().enumerate() {
            let name = if i == last { "tip".into() } else { format!("connector {i}") };
            points.push((name, format_point(point)));
        }
        format!(
            "{} from {} to {}\n{}Connectors\n{}",
            self.robot,
            self.base_link,
            self.tip_link,
            align_pairs(&joints),
            align_pairs(&points)
        )
    }
}

fn joint_text(joint: &JointPosition) -> String {
    let limits = match joint.limits {
        Some([lower, upper]) => format!("{lower:.4} to {upper:.4}"),
        None => "no limits".into(),
    };
    format!("{:>9} {:<3}  ({limits})", format_fixed(joint.value, 4), joint.unit)
}

/// Formats numbers with six decimals (micrometers, and less than an arcsecond) in aligned columns.
pub(crate) fn format_numbers(numbers: &[f64]) -> String {
    let columns = numbers.iter().map(|x| format!("{:>10}", format_fixed(*x, 6)));
    columns.collect::<Vec<_>>().join(" ")
}

/// Formats a position in m in aligned columns.
pub(crate) fn format_point(p: &Vector) -> String {
    format!("{} m", format_numbers(p))
}
