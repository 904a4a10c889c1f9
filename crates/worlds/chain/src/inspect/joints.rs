//! The joints of an arm: where they are, and how far they may go.

use super::ConnectorInspection;
use sidestep_arms::kinematics::{Dof, JointMotionKind};
use sidestep_kernel::view::{FactSection, FactTable, FactValue, Inspection};

impl<const D: usize> ConnectorInspection<'_, D> {
    /// Adds the value of each joint with its limits, and where it is after the cycle. Continuous joints have no limits.
    pub(super) fn add_joint_table(&self, inspection: &mut Inspection) {
        let Some(arm) = self.world.chains[self.slot as usize].arm.as_deref() else { return };
        let Some(now) = &self.before.joints else { return };
        let Some(next) = &self.after.joints else { return };
        let mut table = FactTable::new(["joint", "value", "next", "lowest", "highest", "room"]);
        for ((joint, &value), &next) in arm.serial.variables.iter().zip(now).zip(next) {
            let limits = joint.limits;
            let nearest = limits.map(|limits| (value - limits.lower).min(limits.upper - value));
            table.push_row([
                FactValue::text(joint.name.as_str()),
                joint_value(joint, value),
                joint_value(joint, next),
                limits.map(|limits| joint_value(joint, limits.lower)).into(),
                limits.map(|limits| joint_value(joint, limits.upper)).into(),
                nearest.map(|room| joint_value(joint, room)).into(),
            ]);
        }
        inspection.add_section(
            FactSection::new("Joints").fact("joints", FactValue::count(now.len())).table(table),
        );
    }
}

/// Returns a value of a joint for people: an angle in degrees, or a displacement in meters.
fn joint_value(joint: &Dof, value: f64) -> FactValue {
    match joint.motion {
        JointMotionKind::Turn => FactValue::degrees(value),
        JointMotionKind::Slide => FactValue::meters(value),
    }
}
