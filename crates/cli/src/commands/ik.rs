//! `sidestep ik`: joint values that bring a robot arm's tip to a target.

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
--posture (else from rest) and goes on from random postures; joints stay inside their limits.
Obstacles are spheres (center and radius in m) that no rod between two connectors may be in: rods
are thin lines, so add the arm's thickness to the radius. The answer is a posture; the way there is
not looked at. Its joints can be given to `sidestep fk --joints`.

Exit code 0 when the target is reached, 1 when not: then the nearest posture found is told, and
what is in the way.";

/// Compute joint values that bring a robot arm's tip to a target (inverse kinematics).
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct IkArgs {
    #[command(flatten)]
    arm: ArmArgs,

    /// Where the tip shall be, in m
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    target: String,

    /// Start from the connectors' solution, or work on the joints at once
    #[arg(long, value_name = "ENGINE", default_value = "auto")]
    engine: EngineName,

    /// How near counts as there
    #[arg(long, value_name = "M", default_value_t = 1e-6)]
    tolerance_m: f64,

    /// Random postures to start from after the first
    #[arg(long, value_name = "N", default_value_t = 100)]
    restarts: usize,

    /// What they grow from
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// A sphere that the arm may not be in; may be given several times
    #[arg(long = "obstacle", value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    obstacles: Vec<String>,

    /// Let joints leave their limits
    #[arg(long)]
    ignore_limits: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum EngineName {
    /// The faster one: dls
    Auto,
    /// Connectors first, by the rules of the chain, then the joints
    Chain,
    /// Damped least squares on the joints
    Dls,
}

/// What the command says.
#[derive(Debug, Serialize)]
struct Found {
    reached: bool,
    /// Distance of the tip from the target in m.
    error_m: f64,
    /// Why the target is not reached; null if it is.
    reason: Option<String>,
    target: Vector,
    engine: &'static str,
    /// Steps over all starts.
    iterations: usize,
    /// Postures that the search started from.
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

/// As many numbers as an option takes, each finite and not absurdly large.
fn fixed<const N: usize>(option: &str, form: &str, text: &str) -> Result<[f64; N], InputError> {
    let remedy =
        || format!("write {form} in m, such as {}", ["0.3", "0.1", "0.4", "0.05"][..N].join(","));
    let found = numbers(option, text)?;
    let all: [f64; N] = found.try_into().map_err(|found: Vec<f64>| {
        let cause = format!("`{text}` has {} of {N} numbers", found.len());
        InputError::new(option, cause, remedy())
    })?;
    match all.iter().find(|x| x.is_nan() || x.abs() > 1e7) {
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
