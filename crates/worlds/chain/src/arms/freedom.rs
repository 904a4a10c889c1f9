//! Ways in which the connectors of an arm can move, by its joints and by its rods.

use super::arm::Arm;
use super::kinematics::{Variable, Vector};
use sidestep_kernel::geometry::{dot, scaled, sub};

/// Step of a joint in the quotient of differences, rad or m.
const STEP: f64 = 1e-6;
/// Share of its length that a column must keep, beside those before it, to be a way of its own.
const OWN: f64 = 1e-5;

/// Numbers of independent ways in which the connectors of an arm can move at almost all postures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Freedom {
    /// By its joints: the rank of the connectors' Jacobian.
    pub(crate) of_joints: usize,
    /// By its rods alone, as the chain moves them: two for each, and one more where it slides.
    pub(crate) of_rods: usize,
}

impl Freedom {
    /// Returns that of an arm, away from its limits and from postures in which axes coincide.
    pub(crate) fn of(arm: &Arm) -> Self {
        let slides = arm.skeleton.rods.iter().filter(|rod| rod.max_m > rod.min_m).count();
        let posture = somewhere(arm);
        let columns = (0..posture.len()).map(|k| column(arm, &posture, k)).collect();
        Self { of_joints: rank(columns), of_rods: 2 * arm.skeleton.rods.len() + slides }
    }

    /// Whether joints can follow whatever the chain does.
    pub(crate) fn is_whole(self) -> bool {
        self.of_joints >= self.of_rods
    }
}

/// Returns a posture inside the limits that nothing distinguishes.
fn somewhere(arm: &Arm) -> Vec<f64> {
    let variables = arm.serial.variables.iter().enumerate();
    let value = |(k, variable): (usize, &Variable)| {
        // Multiples of the golden ratio, which fall nowhere twice.
        let share = 0.2 + 0.6 * ((k + 1) as f64 * 0.618_034).fract();
        variable.limits.map_or(share, |l| l.lower + share * (l.upper - l.lower))
    };
    variables.map(value).collect()
}

/// Returns the velocities of all connectors per unit of a variable's.
fn column(arm: &Arm, posture: &[f64], variable: usize) -> Vec<Vector> {
    let at = |step: f64| {
        let mut values = posture.to_vec();
        values[variable] += step;
        arm.serial.connectors(&arm.skeleton, &arm.serial.forward(&values))
    };
    let ends = at(STEP).into_iter().zip(at(-STEP));
    ends.map(|(ahead, behind)| scaled(sub(ahead, behind), 0.5 / STEP)).collect()
}

/// Returns the number of independent columns, by orthogonalization.
fn rank(columns: Vec<Vec<Vector>>) -> usize {
    let length = |column: &[Vector]| product(column, column).sqrt();
    let longest = columns.iter().map(|c| length(c)).fold(0.0, f64::max);
    let mut basis: Vec<Vec<Vector>> = Vec::new();
    for mut column in columns {
        for unit in &basis {
            let along = product(&column, unit);
            column.iter_mut().zip(unit).for_each(|(v, u)| *v = sub(*v, scaled(*u, along)));
        }
        let left = length(&column);
        if left > OWN * longest {
            column.iter_mut().for_each(|v| *v = scaled(*v, 1.0 / left));
            basis.push(column);
        }
    }
    basis.len()
}

fn product(a: &[Vector], b: &[Vector]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(*a, *b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arms::kinematics::SerialChain;
    use sidestep_import::urdf::Model;
    use sidestep_testing::robot_model;

    fn freedom(model: &str) -> Option<(usize, usize)> {
        let path = robot_model(model)?;
        let model = Model::load(&path).expect("a model");
        let serial = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("arm");
        let values = serial.rest();
        let found = Freedom::of(&Arm::new(serial, [0.0; 3], values));
        Some((found.of_joints, found.of_rods))
    }

    #[test]
    fn joints_follow_a_chain_where_each_rod_turns_about_two_axes_of_its_own() {
        // Shoulder, elbow and wrist of three, one and three axes: the upper arm's twist turns the forearm.
        let expected = [("iiwa14_primitive_collision.urdf", (6, 6)), ("ur5_robot.urdf", (5, 6))];
        for (model, ways) in expected {
            let Some(found) = freedom(model) else { return };
            assert_eq!(found, ways, "{model}");
        }
    }
}
