//! Purposes of the random draws of this world. A purpose's number is part of the key of its draws: another
//! number gives other runs.

use sidestep_kernel::stream::Purpose;

/// Starts of bodies without a given place.
pub(crate) const PLACE: Purpose = Purpose(1);
/// Phases of periods.
pub(crate) const PHASE: Purpose = Purpose(2);
/// A behavior's own stream.
pub(crate) const DECIDE: Purpose = Purpose(3);
/// An action: index 0 says which transition it ends in, index 1 is the body's priority
/// in its conflict group.
pub(crate) const ACT: Purpose = Purpose(4);
/// Delays: index 0 has whether one starts, and how long it is.
pub(crate) const DELAY: Purpose = Purpose(5);
/// Random doors.
pub(crate) const DOOR: Purpose = Purpose(6);
/// Directions of people.
pub(crate) const MOVE: Purpose = Purpose(7);
/// Lost receptions.
pub(crate) const RADIO: Purpose = Purpose(8);
/// Seeds of runs that are compared with the exact chain.
pub(crate) const RUN: Purpose = Purpose(9);
/// The heading that starts where the policy `right_of_way` leaves a tie; the entity is the group's
/// smallest id.
pub(crate) const RIGHT_OF_WAY: Purpose = Purpose(10);
/// The seed of a planner; the entity is its first robot.
pub(crate) const PLAN: Purpose = Purpose(11);
/// Delays of a section of robots that are drawn together; the entity is its first robot.
pub(crate) const TEAM_DELAYS: Purpose = Purpose(12);
/// Lost reports to a planner.
pub(crate) const REPORT: Purpose = Purpose(13);
/// Readings of the sensor with this number on its robot: from 16 on, so that there is room for
/// further purposes below.
pub(crate) const fn sense(sensor: usize) -> Purpose {
    Purpose(16 + sensor as u16)
}
