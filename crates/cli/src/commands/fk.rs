//! `sidestep fk`: forward kinematics of a robot arm.

use super::arm::ArmArgs;
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use clap::Args;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep fk arm.urdf
  sidestep fk arm.urdf --joints 0.1,-0.2,0.3 --json
  sidestep fk panda.urdf --tip panda_link8 --posture default --srdf panda.srdf
  sidestep fk panda.urdf --group arm --srdf panda.srdf
  sidestep fk arm.urdf --joints 0.1,-0.2,0.3 --png arm.png

Values are in rad or m, one for each moving joint from the base to the tip; without any, each is as \
near to zero as its limits allow. Values outside the limits are computed too, with a warning. The \
default tip is the leaf with the most moving joints; where that is a finger or the jaw of a gripper, it \
is the frame that is fixed to the hand, or the hand. Connectors are the points that the chain world moves: \
where axes meet or come nearest to each other, and the tip. Positions are in m in the frame of the \
base. Expand xacro files first.";

/// Forward kinematics: compute the positions of a robot arm's tip and connectors.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FkArgs {
    #[command(flatten)]
    arm: ArmArgs,

    /// Draw the arm into this file
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
}

/// # Errors
/// When a file, a link, the posture or the values are wrong.
pub(crate) fn fk(args: &FkArgs, console: Console) -> Result<ExitCode, Failure> {
    let arm = args.arm.load(console)?;
    let positions = arm.positions(&arm.values);
    if let Some(path) = &args.png {
        positions.picture(None, &[]).write(path)?;
    }
    console.print_result(&positions, || positions.text())?;
    if !positions.outside_limits.is_empty() {
        console.warn(format!("outside limits: {}", positions.outside_limits.join(", ")));
    }
    Ok(ExitCode::Done)
}
