//! The clocks by which messages are stamped.

use sidestep_kernel::InputError;

use super::messages::LaserScan;
use super::poses::StampedPose;
use crate::mrclam::StampedPose2;

/// Messages on a network may overtake each other by up to this; a stamp further back is from a clock that was set back.
const MAX_BACKWARD_STEP_SECS: f64 = 0.5;
/// A stamp further ahead of the previous one is from a clock that was set forward, such as from 1970 to the present.
const MAX_FORWARD_STEP_SECS: f64 = 3600.0;

/// A value of a message with a stamp.
pub(super) trait HasStamp {
    /// Returns the time in s.
    fn t_secs(&self) -> f64;
    /// Returns the number of its message on its topic from 1, which errors give.
    fn message(&self) -> u64;
}

impl HasStamp for &StampedPose {
    fn t_secs(&self) -> f64 {
        self.t_secs
    }

    fn message(&self) -> u64 {
        self.message
    }
}

impl HasStamp for (u64, LaserScan) {
    fn t_secs(&self) -> f64 {
        self.1.header.stamp.secs()
    }

    fn message(&self) -> u64 {
        self.0
    }
}

/// Returns messages, given as they were recorded, in the order of their stamps.
///
/// # Errors
/// When the clock jumps.
pub(super) fn sort_by_stamp<T: HasStamp>(
    place: &str,
    mut all: Vec<T>,
) -> Result<Vec<T>, InputError> {
    let mut latest = f64::NEG_INFINITY;
    for stamped in &all {
        let step_secs = stamped.t_secs() - latest;
        let is_first = latest == f64::NEG_INFINITY;
        if !is_first && !(-MAX_BACKWARD_STEP_SECS..=MAX_FORWARD_STEP_SECS).contains(&step_secs) {
            return Err(clock_jump(place, stamped.message(), step_secs));
        }
        latest = latest.max(stamped.t_secs());
    }
    all.sort_by(|a, b| a.t_secs().total_cmp(&b.t_secs()));
    Ok(all)
}

fn clock_jump(place: &str, message: u64, step_secs: f64) -> InputError {
    let direction = if step_secs < 0.0 { "before" } else { "after" };
    let cause = format!(
        "the clock jumps: message {message} is stamped {:.3} s {direction} an earlier one",
        step_secs.abs()
    );
    let remedy = "cut the bag at the jump, or record it again once the clock is set; a bag that was played in \
                  a loop has to be recorded once only";
    InputError::new(place, cause, remedy)
}

/// Returns the times of the first and the last pose, in s.
fn time_range(track: &[StampedPose2]) -> Option<[f64; 2]> {
    Some([track.first()?.t_secs, track.last()?.t_secs])
}

/// Checks that two tracks have some time in common.
///
/// # Errors
/// When they have none.
pub(super) fn check_overlap(
    bag: &str,
    [(a_name, a), (b_name, b)]: [(&str, &[StampedPose2]); 2],
) -> Result<(), InputError> {
    let (Some([a_start, a_end]), Some([b_start, b_end])) = (time_range(a), time_range(b)) else {
        return Ok(());
    };
    if a_start <= b_end && b_start <= a_end {
        return Ok(());
    }
    let cause = format!(
        "{a_name} ({a_start:.1} to {a_end:.1} s) and {b_name} ({b_start:.1} to {b_end:.1} s) have no time \
         in common"
    );
    let remedy = "stamp both by one clock: synchronize the machines, or set use_sim_time in all nodes or in none";
    Err(InputError::new(bag, cause, remedy))
}
