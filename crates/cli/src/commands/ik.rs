//! `sidestep ik`: inverse kinematics of a robot arm.

use super::arm::{Arm, ArmArgs, Placed, meters, numbers};
use crate::console::{Console, aligned};
use crate::exit::{ExitCode, Failure};
use clap::{Args, ValueEnum};
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::worlds::chain::ik::Engine;
use sidestep::worlds::chain::kinematics::{ArmAnswer, ArmGoal, Sphere, Vector};

const EXAMPLES: &str = "\
Examples:
  sidestep ik arm.urdf --target 0.3,0.1,0.4
  sidestep ik panda.urdf --srdf panda.srdf --group arm --posture default --target 0.4,0,0.5 --json
  sidestep ik arm.urdf --target 0.3,0.1,0.4 --obstacle 0.2,0,0.3,0.05 --obstacle 0,0.2,0.3,0.05

The target is a position in m in the frame of the base. The search starts from --joints or
--posture (otherwise from rest) and continues from random postures; joints stay inside their limits.
Obstacles are spheres (center and radius in m) that no rod between two connectors may enter: rods
are thin lines, so add the arm's thickness to the radius. The answer is a posture; the path to it is
not checked. Its joint values can be passed to `sidestep fk --joints`.

The exit code is 0 if the target is reached and 1 if not: then the nearest posture found is printed,
and what is in the way.";

/// Inverse kinematics: compute joint values that bring a robot arm's tip to a target.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct IkArgs {
    #[command(flatten)]
    arm: ArmArgs,

    /// Target position of the tip, in m
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    target: String,

    /// Solver
    #[arg(long, value_name = "ENGINE", default_value = "auto")]
    engine: EngineName,

    /// Largest distance in m at which the target counts as reached
    #[arg(long, value_name = "M", default_value_t = 1e-6)]
    tolerance_m: f64,

    /// Number of random postures to start from after the first
    #[arg(long, value_name = "N", default_value_t = 100)]
    restarts: usize,

    /// Random seed of these postures
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// Spherical obstacle (center and radius in m); repeatable
    #[arg(long = "obstacle", value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    obstacles: Vec<String>,

    /// Ignore joint limits
    #[arg(long)]
    ignore_limits: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum EngineName {
    /// The faster one, which is dls
    Auto,
    /// Connectors first, by the rules of the chain (FABRIK on links of fixed length), then the joints
    #[value(alias = "fabrik")]
    Chain,
    /// Damped least squares on the joints
    Dls,
}

/// The answer of the command.
#[derive(Debug, Serialize)]
struct Found {
    reached: bool,
    /// Distance of the tip from the target in m.
    error_m: f64,
    /// Why the target is not reached; null if it is.
    reason: Option<String>,
    target: Vector,
    engine: &'static str,
    /// Number of steps, over all starts.
    iterations: usize,
    /// Number of postures that the search started from.
    starts: usize,
    #[serde(flatten)]
    placed: Placed,
}

/// Runs the command.
///
/// # Errors
/// When a file, a link, the posture, the values, the target or an obstacle is wrong.
pub(crate) fn ik(args: &IkArgs, console: Console) -> Result<ExitCode, Failure> {
    let arm = args.arm.load()?;
    let goal = args.goal()?;
    let answer = arm.chain.solve(&goal, &arm.values)?;
    let found = Found::new(&arm, &goal, answer);
    console.result(&found, || found.text());
    Ok(if found.reached { ExitCode::Done } else { ExitCode::Failed })
}

impl IkArgs {
    fn goal(&self) -> Result<ArmGoal, InputError> {
        let target_m = fixed("--target", "x,y,z", &self.target)?;
        if !(self.tolerance_m > 0.0 && self.tolerance_m.is_finite()) {
            let cause = format!("is {} m", self.tolerance_m);
            return Err(InputError::new("--tolerance-m", cause, "give a length above 0"));
        }
        let sphere = |text: &String| {
            let [x, y, z, radius_m] = fixed("--obstacle", "x,y,z,radius", text)?;
            if radius_m < 0.0 {
                let cause = format!("`{text}` has a negative radius");
                return Err(InputError::new("--obstacle", cause, "give a radius of 0 or more"));
            }
            Ok(Sphere { center_m: [x, y, z], radius_m })
        };
        Ok(ArmGoal {
            tolerance_m: self.tolerance_m,
            engine: match self.engine {
                EngineName::Auto => Engine::Auto,
                EngineName::Chain => Engine::Chain,
                EngineName::Dls => Engine::Dls,
            },
            restarts: self.restarts,
            seed: self.seed,
            ignore_limits: self.ignore_limits,
            spheres: self.obstacles.iter().map(sphere).collect::<Result<_, _>>()?,
            ..ArmGoal::new(target_m)
        })
    }
}

/// Reads the `N` numbers that an option takes, each of a size that a place in m can have.
fn fixed<const N: usize>(option: &str, form: &str, text: &str) -> Result<[f64; N], InputError> {
    let remedy =
        || format!("write {form} in m, such as {}", ["0.3", "0.1", "0.4", "0.05"][..N].join(","));
    let found = numbers(option, text)?;
    let all: [f64; N] = found.try_into().map_err(|found: Vec<f64>| {
        let cause = format!("`{text}` has {} of {N} numbers", found.len());
        InputError::new(option, cause, remedy())
    })?;
    match all.iter().find(|x| !(-1e7..=1e7).contains(*x)) {
        None => Ok(all),
        Some(x) => Err(InputError::new(option, format!("{x} is no place"), remedy())),
    }
}

impl Found {
    fn new(arm: &Arm, goal: &ArmGoal, answer: ArmAnswer) -> Self {
        Self {
            reached: answer.reached,
            error_m: answer.error_m,
            reason: answer.reason.map(|reason| reason.to_string()),
            target: goal.target_m,
            engine: answer.engine.name(),
            iterations: answer.iterations,
            starts: answer.starts,
            placed: arm.at(&answer.values),
        }
    }

    fn text(&self) -> String {
        let verdict = match &self.reason {
            None => "The target is reached.".to_owned(),
            Some(reason) => {
                format!("The target is not reached: {reason}.\nThe nearest posture found is shown.")
            }
        };
        let rows = [
            ("target".to_owned(), meters(&self.target)),
            ("error".to_owned(), format!("{:>10.3e} m", self.error_m)),
        ];
        format!("{}{}{verdict}\n", self.placed.text(), aligned(&rows))
    }
}
