//! `sidestep ik`: inverse kinematics of a robot arm.
//!
//! ```text
//! args.rs     options -> goals
//! output.rs   a result as text and JSON
//! targets.rs  many targets from a table, and the table of their results
//! ```

mod args;
mod output;
mod targets;

use super::arm::ArmArgs;
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use args::GoalArgs;
use clap::Args;
use output::IkOutput;
use sidestep::arms::kinematics::Vector;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep ik arm.urdf --target 0.3,0.1,0.4
  sidestep ik arm.urdf --target 0.3,0.1,0.4 --rpy 3.1416,0,0
  sidestep ik arm.urdf --target 0.3,0.1,0.4 --rpy 3.1416,0,0 --free rz
  sidestep ik arm.urdf --target 0.3,0.1,0.4 --quaternion 1,0,0,0 --solutions 8
  sidestep ik panda.urdf --srdf panda.srdf --group arm --posture default \\
      --target 0.4,0,0.5 --nearest
  sidestep ik arm.urdf --targets poses.csv > answers.csv
  sidestep ik arm.urdf --target 0.3,0.1,0.4 --obstacle 0.2,0,0.3,0.05
  sidestep ik arm.urdf --target 0.3,0.1,0.4 --png arm.png

The target is the tip's frame in the frame of the base: its position in m, and with --rpy or \
--quaternion its orientation. --free lists what of it does not count, in the target's own axes: x, y, \
z (the position along them), rx, ry, rz (the turn about them). One free turn leaves the direction of \
that axis: `--free rz` makes a tool's axis z point as asked. All three free turns ask for the position \
alone, `--free x,y,z` for the orientation alone.

The search starts from --joints or --posture (otherwise from rest) and continues from random postures; \
joints stay inside their limits. With --solutions N it continues until it has N distinct postures: of \
every two, some joint differs by 0.1 rad or more (--apart), full turns aside; a slide counts as the \
angle that moves the tip as far at full reach. They are listed by their distance from the start. \
--nearest makes all restarts and draws each posture toward the start, and so finds the answer that \
moves the joints least.

Obstacles are spheres (center and radius in m) that no link's collision shape may enter: boxes, \
cylinders, spheres, and meshes (STL, OBJ, DAE) as their convex hulls. Links without a shape that can be read \
count as rods between connectors, which are thin lines, so add the arm's thickness to the radius; what \
is left out is printed. With `--body own` links must not touch each other either, except neighbors \
and the pairs whose collisions --srdf disables. The answer is a posture; the path to it is not \
checked. Its joint values can be passed to `sidestep fk --joints`.

--targets reads a table (CSV) with the columns x,y,z, and for orientations roll,pitch,yaw or \
qx,qy,qz,qw, and prints a table with a row for each target, in the order of the file.

--json prints reached, error_m, error_rad, reason, target, target_quaternion (x,y,z,w), engine, \
iterations, starts, solutions (joints, error_m and error_rad of each posture), remarks (meshes that \
stand as hulls, shapes that are left out), and of the first posture what `sidestep fk --json` prints. \
With --targets it prints targets, reached, joint_names and answers (of each the same, joints and \
others), and cpu_us_per_target, which is no part of the results.

The exit code is 0 if the target is reached (of several, each) and 1 if not: then the nearest posture \
found is printed, and what is in the way.";

/// Inverse kinematics: compute joint values that bring a robot arm's tip to a target.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct IkArgs {
    #[command(flatten)]
    arm: ArmArgs,

    /// Target position of the tip, in m
    #[arg(
        long,
        value_name = "X,Y,Z",
        allow_hyphen_values = true,
        required_unless_present = "targets"
    )]
    target: Option<String>,

    /// Orientation of the tip: roll, pitch and yaw in rad, about the base's fixed axes x, y, z in
    /// this order, as in URDF
    #[arg(long, value_name = "R,P,Y", allow_hyphen_values = true, conflicts_with = "quaternion")]
    rpy: Option<String>,

    /// Orientation of the tip as a quaternion, scalar last; it need not have length 1
    #[arg(long, value_name = "X,Y,Z,W", allow_hyphen_values = true)]
    quaternion: Option<String>,

    /// Many targets: a table (CSV) with the columns x,y,z and, if orientations are wanted,
    /// roll,pitch,yaw or qx,qy,qz,qw
    #[arg(long, value_name = "FILE", conflicts_with_all = ["target", "rpy", "quaternion"])]
    targets: Option<PathBuf>,

    /// Draw the posture that was found into this file, with the target and the obstacles
    #[arg(long, value_name = "FILE", conflicts_with = "targets")]
    png: Option<PathBuf>,

    #[command(flatten)]
    goal: GoalArgs,
}

/// # Errors
/// When a file, a link, the posture, the values, the target or an obstacle is wrong.
pub(crate) fn ik(args: &IkArgs, console: Console) -> Result<ExitCode, Failure> {
    let arm = args.arm.load(console)?;
    if let Some(path) = &args.targets {
        return targets::solve_table(path, &arm, &args.goal, console);
    }
    let (body, remarks) = args.goal.body(&arm)?;
    let goal = args.goal.goal(args.pose()?, &body)?;
    let result = arm.selection.chain.solve(&goal, &arm.values)?;
    remarks.iter().for_each(|remark| console.note(remark));
    let output = IkOutput::new(&arm, &goal, result, remarks);
    if let Some(path) = &args.png {
        output.positions.picture(Some(goal.target.origin_m), &goal.spheres).write(path)?;
    }
    console.print_result(&output, || output.text())?;
    Ok(if output.reached { ExitCode::Done } else { ExitCode::Failed })
}

impl IkArgs {
    fn pose(&self) -> Result<args::TipTarget, Failure> {
        let text = self.target.as_deref().unwrap_or_default();
        let position_m: Vector = args::parse_lengths("--target", "x,y,z", text)?;
        let target = match (&self.rpy, &self.quaternion) {
            (Some(text), _) => {
                args::TipTarget::from_rpy(position_m, args::parse_rpy("--rpy", text)?)
            }
            (None, Some(text)) => {
                let place = "--quaternion";
                args::TipTarget::from_quaternion(
                    place,
                    position_m,
                    args::parse_quaternion(place, text)?,
                )?
            }
            (None, None) => args::TipTarget::from_position(position_m),
        };
        Ok(target)
    }
}
