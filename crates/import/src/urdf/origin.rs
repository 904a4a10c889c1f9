//! `<origin>`: a frame in another, by angles or by a quaternion.

use super::Origin;
use super::numbers::bounded;
use super::unused::record_units_of_origin;
use crate::xml::{Element, XmlAttribute};
use crate::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{atan2, cos, sin};

/// The version of URDF in which origins can have a quaternion.
const QUATERNION_VERSION: &str = "1.1";

/// Largest and smallest length of a quaternion; one so far from 1 is a mistake.
const MAX_LENGTH: f64 = 1e6;
const MIN_LENGTH: f64 = 1e-6;

/// Largest error of the length of a quaternion with few digits.
const LENGTH_TOLERANCE: f64 = 1e-3;

/// Reads the `<origin>` of an element, the identity where it has none.
pub(super) fn read(parent: Element, report: &mut ImportReport) -> Result<Origin, InputError> {
    let Some(element) = parent.child("origin")? else { return Ok(Origin::default()) };
    let triple = |name| element.attribute(name).map_or(Ok([0.0; 3]), bounded);
    let xyz_m = triple("xyz")?;
    let rpy_rad = triple("rpy")?;
    record_units_of_origin(element, [xyz_m, rpy_rad], report);
    let Some(value) = element.attribute("quat_xyzw") else { return Ok(Origin { xyz_m, rpy_rad }) };
    if element.attribute("rpy").is_some() {
        let cause = "an origin with both `rpy` and `quat_xyzw`";
        return Err(value.error(cause, "keep one of the two"));
    }
    let version = element.root().attribute("version").map_or("1.0", |version| version.text());
    if version != QUATERNION_VERSION {
        let rule = format!("`quat_xyzw` counts, which ROS ignores in URDF {version}");
        let remedy = "write version=\"1.1\" into <robot>, or rpy=\"...\" in place of it";
        report.record(Treatment::Guessed, rule, element.line(), remedy);
    }
    let quaternion = unit_quaternion(&value, report)?;
    Ok(Origin { xyz_m, rpy_rad: roll_pitch_yaw_rad(quaternion) })
}

/// Reads a quaternion, scalar last, and gives it length 1.
fn unit_quaternion(
    value: &XmlAttribute,
    report: &mut ImportReport,
) -> Result<[f64; 4], InputError> {
    let quaternion = value.quadruple()?;
    let squares = quaternion.iter().map(|q| q * q);
    let length = squares.sum::<f64>().sqrt();
    if !(MIN_LENGTH..=MAX_LENGTH).contains(&length) {
        let cause = format!("the quaternion has length {length}, and so no direction");
        let remedy = "write x y z w, scalar last, such as \"0 0 0 1\" for no turn at all";
        return Err(value.error(cause, remedy));
    }
    if (length - 1.0).abs() > LENGTH_TOLERANCE {
        let rule = "quaternions whose length is not 1";
        report.record(Treatment::Repaired, rule, value.line(), "");
    }
    Ok(quaternion.map(|q| q / length))
}

/// Returns the angles of a unit quaternion: R = Rz(yaw) Ry(pitch) Rx(roll).
///
/// Roll is taken from the rotation that remains without yaw, so that all digits stay where the pitch is a right angle
/// and yaw and roll turn about one axis.
fn roll_pitch_yaw_rad([x, y, z, w]: [f64; 4]) -> [f64; 3] {
    let x_axis = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)];
    let y_axis = [2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z)];
    let z_axis = [2.0 * (x * z + y * w), 2.0 * (y * z - x * w)];
    let yaw = atan2(x_axis[1], x_axis[0]);
    let horizontal = (x_axis[0] * x_axis[0] + x_axis[1] * x_axis[1]).sqrt();
    let pitch = atan2(-x_axis[2], horizontal);
    let sin_roll = sin(yaw) * z_axis[0] - cos(yaw) * z_axis[1];
    let cos_roll = cos(yaw) * y_axis[1] - sin(yaw) * y_axis[0];
    [atan2(sin_roll, cos_roll), pitch, yaw]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::urdf::Model;
    use std::f64::consts::FRAC_PI_2;

    /// Rows of the rotation by angles: Rz(yaw) Ry(pitch) Rx(roll).
    fn rotation([roll, pitch, yaw]: [f64; 3]) -> [[f64; 3]; 3] {
        let [sr, sp, sy] = [sin(roll), sin(pitch), sin(yaw)];
        let [cr, cp, cy] = [cos(roll), cos(pitch), cos(yaw)];
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    }

    /// The quaternion of angles, from their halves.
    fn quaternion([roll, pitch, yaw]: [f64; 3]) -> [f64; 4] {
        let [sr, sp, sy] = [sin(roll / 2.0), sin(pitch / 2.0), sin(yaw / 2.0)];
        let [cr, cp, cy] = [cos(roll / 2.0), cos(pitch / 2.0), cos(yaw / 2.0)];
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    }

    #[test]
    fn the_angles_of_a_quaternion_turn_as_it_does_also_at_right_angles() {
        let angles = [-3.0, -FRAC_PI_2, -1.0, -1e-9, 0.0, 0.5, FRAC_PI_2, 2.5, 3.1];
        let pitches = [-FRAC_PI_2, -FRAC_PI_2 + 1e-9, -0.4, 0.0, 1.5, FRAC_PI_2];
        for roll in angles {
            for pitch in pitches {
                for yaw in angles {
                    let wanted = rotation([roll, pitch, yaw]);
                    let quaternion = quaternion([roll, pitch, yaw]);
                    let found = rotation(roll_pitch_yaw_rad(quaternion));
                    for (wanted, found) in wanted.iter().flatten().zip(found.iter().flatten()) {
                        assert!((wanted - found).abs() < 1e-14, "{roll} {pitch} {yaw}");
                    }
                }
            }
        }
    }

    fn read(version: &str, origin: &str) -> Result<Model, InputError> {
        let text = format!(
            "<robot name=\"r\" {version}><link name=\"a\"/><link name=\"b\"/>\n\
             <joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/>\
             <origin {origin}/></joint></robot>"
        );
        Model::parse("f", &text)
    }

    #[test]
    fn an_origin_has_a_quaternion_or_angles() {
        // A quarter turn about z.
        let model =
            read("version=\"1.1\"", "xyz=\"1 0 0\" quat_xyzw=\"0 0 0.70710678 0.70710678\"");
        let model = model.expect("a model");
        let [roll, pitch, yaw] = model.joints[0].origin.rpy_rad;
        assert!(roll.abs() + pitch.abs() + (yaw - FRAC_PI_2).abs() < 1e-12, "{yaw}");
        assert_eq!(model.joints[0].origin.xyz_m, [1.0, 0.0, 0.0]);
        assert!(model.report.findings.is_empty());
        // A file that does not say its version, and a quaternion that is too long.
        let model = read("", "quat_xyzw=\"0 0 2 2\"").expect("a model");
        assert!((model.joints[0].origin.rpy_rad[2] - FRAC_PI_2).abs() < 1e-12);
        let treatments: Vec<_> = model.report.findings.iter().map(|f| f.treatment).collect();
        assert_eq!(treatments, [Treatment::Guessed, Treatment::Repaired]);
        for (origin, cause) in [
            ("quat_xyzw=\"0 0 0 0\"", "no direction"),
            ("quat_xyzw=\"0 0 1\"", "3 numbers, not 4"),
            ("rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\"", "both"),
        ] {
            let error = read("version=\"1.1\"", origin).expect_err(origin);
            assert!(error.cause().contains(cause), "{error}");
            assert_eq!(error.line_and_column().map(|place| place.0), Some(2));
        }
    }

    #[test]
    fn a_version_and_attributes_that_are_not_known_are_said() {
        let model =
            read("version=\"2.0\"", "xyz=\"1 0 0\" quat_wxyz=\"1 0 0 0\"").expect("a model");
        let findings: Vec<_> = model.report.findings.iter().map(ToString::to_string).collect();
        assert!(findings[0].starts_with("suspicious: version `2.0`"), "{findings:?}");
        assert!(
            findings[1].starts_with("not used: `quat_wxyz` of <origin>, line 2"),
            "{findings:?}"
        );
    }
}
