//! `sidestep fk`: where a robot arm's tip and connectors are.

use crate::console::{Console, aligned};
use crate::exit::{ExitCode, Failure};
use clap::Args;
use serde::Serialize;
use sidestep::import::urdf::Model;
use sidestep::import::urdf::srdf::Semantics;
use sidestep::kernel::InputError;
use sidestep::worlds::chain::kinematics::{Pose, Rod, SerialChain, Variable, Vector};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep fk arm.urdf
  sidestep fk arm.urdf --joints 0.1,-0.2,0.3 --json
  sidestep fk panda.urdf --tip panda_link8 --posture default --srdf panda.srdf

Values are rad and m, for the joints that move from the root to the tip; without any, each is as
near to zero as its limits allow. The tip is the leaf with the most moving joints, unless told
otherwise. Connectors are the points that the chain world moves: where axes meet or come nearest
to each other, and the tip. Positions are m in the frame of the root link. xacro has to be
expanded first.";

/// Compute where a robot arm's tip and connectors are (forward kinematics).
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FkArgs {
    /// Robot model
    #[arg(value_name = "URDF")]
    urdf: PathBuf,

    /// The link whose place is wanted [default: the end of the longest arm]
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,

    /// A value for each moving joint up to the tip, in rad or m
    #[arg(long, value_name = "Q1,Q2,...", allow_hyphen_values = true)]
    joints: Option<String>,

    /// Take the values from this named posture of the SRDF file
    #[arg(long, value_name = "NAME", requires = "srdf", conflicts_with = "joints")]
    posture: Option<String>,

    /// File with named postures
    #[arg(long, value_name = "FILE")]
    srdf: Option<PathBuf>,

    /// Compute also what the joints' limits forbid
    #[arg(long)]
    ignore_limits: bool,
}

/// What the command says.
#[derive(Debug, Serialize)]
struct Placed {
    robot: String,
    base_link: String,
    tip_link: String,
    /// Position of the tip in m.
    tip: Vector,
    /// Rows of the tip's rotation matrix.
    rotation: [Vector; 3],
    joints: Vec<JointPlaced>,
    /// Positions in m, from the base out.
    connectors: Vec<Vector>,
    rods: Vec<RodSize>,
}

#[derive(Debug, Serialize)]
struct JointPlaced {
    name: String,
    value: f64,
    unit: &'static str,
    /// Lowest and highest value; null where there are none.
    limits: Option<[f64; 2]>,
}

/// Lengths that the rod between two connectors can have; null where there is no longest.
#[derive(Debug, Serialize)]
struct RodSize {
    min_m: f64,
    max_m: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// When a file, the tip, the posture or the values are wrong.
pub(crate) fn fk(args: &FkArgs, console: Console) -> Result<ExitCode, Failure> {
    let model = Model::load(&args.urdf)?;
    let tip = match &args.tip {
        Some(name) => model.link("--tip", name)?,
        None => model.default_tip(),
    };
    let place = args.tip.as_ref().map_or(args.urdf.display().to_string(), |_| "--tip".into());
    let chain = SerialChain::new(&model, model.root, tip, &place)?;
    let values = values(args, &model, &chain)?;
    let placed = place_all(&model, &chain, &values);
    console.result(&placed, || text(&placed));
    Ok(ExitCode::Done)
}

fn values(args: &FkArgs, model: &Model, chain: &SerialChain) -> Result<Vec<f64>, InputError> {
    let (place, values) = match (&args.joints, &args.posture, &args.srdf) {
        (Some(text), ..) => ("--joints", parse(text)?),
        (None, Some(name), Some(srdf)) => {
            let semantics = Semantics::load(srdf, model)?;
            ("--posture", in_posture(&semantics.posture("--posture", name)?, model, chain))
        }
        _ => ("--joints", chain.rest()),
    };
    chain.check_count(place, &values)?;
    if !args.ignore_limits {
        chain.check_limits(place, &values).map_err(or_ignore_limits)?;
    }
    Ok(values)
}

fn parse(text: &str) -> Result<Vec<f64>, InputError> {
    let words = text.split(',').map(str::trim).filter(|_| !text.trim().is_empty());
    let number = |word: &str| {
        word.parse().map_err(|_| {
            let cause = format!("`{word}` is no number");
            InputError::new("--joints", cause, "write numbers with commas between: 0.1,-0.2")
        })
    };
    words.map(number).collect()
}

fn or_ignore_limits(error: InputError) -> InputError {
    let remedy = format!("{}, or add --ignore-limits", error.remedy());
    InputError::new(error.place(), error.cause(), remedy)
}

/// The values of a posture; joints that it leaves out are at rest.
fn in_posture(posture: &[(usize, f64)], model: &Model, chain: &SerialChain) -> Vec<f64> {
    let mut values = chain.rest();
    for (variable, value) in chain.variables.iter().zip(&mut values) {
        // Of several postures with one name the last one holds.
        let said = posture.iter().rfind(|(joint, _)| model.joints[*joint].name == variable.name);
        if let Some((_, said)) = said {
            *value = *said;
        }
    }
    values
}

fn place_all(model: &Model, chain: &SerialChain, values: &[f64]) -> Placed {
    let frames = chain.forward(values);
    let skeleton = chain.skeleton();
    let Pose { rotation, origin_m } = frames.tip;
    Placed {
        robot: model.name.clone(),
        base_link: chain.base.clone(),
        tip_link: chain.tip.clone(),
        tip: origin_m,
        rotation,
        joints: chain.variables.iter().zip(values).map(|(v, &value)| joint(v, value)).collect(),
        connectors: chain.connectors(&skeleton, &frames),
        rods: skeleton.rods.iter().map(rod).collect(),
    }
}

fn joint(variable: &Variable, value: f64) -> JointPlaced {
    JointPlaced {
        name: variable.name.clone(),
        value,
        unit: variable.motion.unit(),
        limits: variable.limits.map(|limits| [limits.lower, limits.upper]),
    }
}

fn rod(rod: &Rod) -> RodSize {
    RodSize { min_m: rod.min_m, max_m: rod.max_m.is_finite().then_some(rod.max_m) }
}

fn text(placed: &Placed) -> String {
    let joints = placed.joints.iter().map(|j| (j.name.clone(), joint_words(j)));
    let joints: Vec<_> = joints.collect();
    let last = placed.connectors.len() - 1;
    let name = |i: usize| if i == last { "tip".into() } else { format!("connector {}", i + 1) };
    let points = placed.connectors.iter().enumerate().map(|(i, p)| (name(i), meters(p)));
    let points: Vec<_> = points.collect();
    format!(
        "{} from {} to {}\n{}Connectors\n{}",
        placed.robot,
        placed.base_link,
        placed.tip_link,
        aligned(&joints),
        aligned(&points)
    )
}

fn joint_words(joint: &JointPlaced) -> String {
    let limits = match joint.limits {
        Some([lower, upper]) => format!("{lower:.4} to {upper:.4}"),
        None => "no limits".into(),
    };
    format!("{:>9.4} {:<3}  ({limits})", joint.value, joint.unit)
}

fn meters(p: &Vector) -> String {
    // Adding zero turns the -0 of rounding into 0.
    let rounded = p.map(|x| (x * 1e6).round() / 1e6 + 0.0);
    format!("{:>10.6} {:>10.6} {:>10.6} m", rounded[0], rounded[1], rounded[2])
}
