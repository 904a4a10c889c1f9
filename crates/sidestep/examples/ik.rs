//! `cargo run -p sidestep --example ik`: joint values that bring the tool of an arm to a place.

use sidestep::arms::kinematics::{ArmFiles, ArmGoal};
use sidestep::kernel::InputError;

/// Places of the tool in meters; the last one is too far away.
const TARGETS_M: [[f64; 3]; 3] = [[0.4, 0.1, 0.6], [0.45, -0.35, 0.45], [2.0, 0.0, 0.3]];

fn main() -> Result<(), InputError> {
    let files = ArmFiles { urdf: "scenarios/chain/arm.urdf".into(), ..ArmFiles::default() };
    let arm = files.load()?.chain;
    let mut values = arm.rest_values();
    for target_m in TARGETS_M {
        let solution = arm.solve(&ArmGoal::new(target_m), &values)?;
        match &solution.reason {
            None => {
                println!("{target_m:?}: {:.3?}", solution.values);
                // The next search starts here, so that the arm moves little.
                values = solution.values;
            }
            Some(reason) => println!("{target_m:?}: {reason}"),
        }
    }
    Ok(())
}
