//! Numbers of a robot, within what any robot has.

use crate::xml::XmlAttribute;
use sidestep_kernel::InputError;

/// The maximum of a coordinate, and of all other numbers of a joint: no robot has a larger one, and squares must stay
/// finite.
pub(super) const MAX_COORDINATE: f64 = 1e6;

/// Reads three numbers of a joint.
pub(super) fn bounded(value: XmlAttribute) -> Result<[f64; 3], InputError> {
    let triple = value.triple()?;
    triple.into_iter().try_for_each(|x| check_bounded(&value, x))?;
    Ok(triple)
}

/// Reads one number of a robot's size.
pub(super) fn bounded_number(value: XmlAttribute) -> Result<f64, InputError> {
    let number = value.number()?;
    check_bounded(&value, number)?;
    Ok(number)
}

/// Refuses a number that no robot has, at which lengths would be lost to rounding.
fn check_bounded(value: &XmlAttribute, x: f64) -> Result<(), InputError> {
    if x.abs() <= MAX_COORDINATE {
        return Ok(());
    }
    let cause = format!("{x:e} is beyond {MAX_COORDINATE:e}");
    Err(value.error(cause, "give lengths in meters and angles in radians"))
}
