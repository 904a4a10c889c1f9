//! The clocks by which messages are stamped.
//!
//! Topics share a clock. Where it is set, the messages after it belong to another epoch: epochs are moved apart by
//! whole seconds, the same for all topics, so that stamps in an epoch stay as they are and nothing reaches across. Where
//! topics do not share one, the times of the recording tell, see [`offsets`].

use sidestep_kernel::InputError;

use super::offsets;
use super::streams::{Stream, Timing};
use crate::report::{ImportReport, Treatment};
use crate::track::StampedPose2;

/// Messages on a network may overtake each other by up to this; several stamps further back are from a clock that was set
/// back.
const MAX_BACKWARD_STEP_SECS: f64 = 0.5;
/// The time between epochs: nothing is interpolated across it.
const EPOCH_GAP_SECS: f64 = 10.0;
/// Maximum number of epochs: more are a recording without any clock.
const MAX_EPOCHS: usize = 1000;

/// A message at which the clock was set.
#[derive(Debug, Clone, Copy)]
struct Jump {
    item: usize,
    log_secs: f64,
    step_secs: f64,
}

/// Gives the messages of all streams times on one axis that never goes back between epochs.
///
/// # Errors
/// When a clock is set more than a thousand times.
pub(super) fn align(
    bag: &str,
    streams: &mut [Stream<'_>],
    report: &mut ImportReport,
) -> Result<(), InputError> {
    for stream in streams.iter_mut() {
        replace_unset_stamps(stream, report);
    }
    record_rates(streams, report);
    let mut all_jumps = Vec::new();
    for stream in streams.iter() {
        let back = backward_jumps(stream);
        record_jumps(stream, &back, report);
        record_forward_jumps(stream, report);
        let mut jumps = [back, forward_jumps(stream)].concat();
        jumps.sort_by_key(|jump| jump.item);
        jumps.dedup_by_key(|jump| jump.item);
        all_jumps.push(jumps);
    }
    let Some(most) = all_jumps.iter().max_by_key(|jumps| jumps.len()) else { return Ok(()) };
    let bounds: Vec<f64> = most.iter().map(|jump| jump.log_secs).collect();
    if bounds.is_empty() {
        offsets::compare_clocks(streams, report);
        return Ok(());
    }
    if bounds.len() >= MAX_EPOCHS {
        let cause = format!("the clock of its stamps is set {} times", bounds.len());
        let remedy = "stamp the messages by one clock, and record the bag again";
        return Err(InputError::new(bag, cause, remedy));
    }
    let epochs: Vec<Vec<usize>> = streams
        .iter()
        .zip(&all_jumps)
        .map(|(stream, jumps)| epochs_of(stream, jumps, &bounds))
        .collect();
    let n = bounds.len() + 1;
    offsets::undo_single_jumps(streams, &epochs, n, report);
    offsets::compare_clocks(streams, report);
    shift_epochs(streams, &epochs, n);
    Ok(())
}

/// Replaces stamps that no program has set by the times of the recording.
fn replace_unset_stamps(stream: &mut Stream<'_>, report: &mut ImportReport) {
    let is_unset = stream.items.len() > 1 && stream.items.iter().all(|item| item.t_secs() == 0.0);
    if !is_unset {
        return;
    }
    for item in &mut stream.items {
        let t_secs = item.log_secs();
        item.set_t_secs(t_secs);
    }
    let rule =
        format!("the stamps of {} are all 0: the times of the recording are used", stream.name);
    report.record(
        Treatment::Guessed,
        rule,
        "",
        "set header.stamp in the program that publishes it",
    );
}

fn backward_jumps(stream: &Stream<'_>) -> Vec<Jump> {
    let mut jumps = Vec::new();
    let mut latest = f64::NEG_INFINITY;
    for (item, stamped) in stream.items.iter().enumerate() {
        let step_secs = stamped.t_secs() - latest;
        // One message alone is late, and its stamp is right.
        let next = stream.items.get(item + 1);
        let is_next_back = next.is_some_and(|next| next.t_secs() < latest);
        if step_secs < -MAX_BACKWARD_STEP_SECS && is_next_back {
            jumps.push(Jump { item, log_secs: stamped.log_secs(), step_secs });
            latest = stamped.t_secs();
        }
        latest = latest.max(stamped.t_secs());
    }
    jumps
}

/// Returns the messages from which on the stamps are further ahead of the recording than before.
fn forward_jumps(stream: &Stream<'_>) -> Vec<Jump> {
    let jump = |(item, step_secs): (usize, f64)| Jump {
        item,
        log_secs: stream.items[item].log_secs(),
        step_secs,
    };
    offsets::forward_jumps(&stream.timings()).into_iter().map(jump).collect()
}

fn record_jumps(stream: &Stream<'_>, jumps: &[Jump], report: &mut ImportReport) {
    for jump in jumps {
        let place = format!(
            "message {} is stamped {:.3} s before an earlier one",
            stream.items[jump.item].message(),
            -jump.step_secs
        );
        let rule =
            format!("stamps of {} that go back: the time after is a part of its own", stream.name);
        report.record(Treatment::Repaired, rule, place, "");
    }
}

fn record_rates(streams: &[Stream<'_>], report: &mut ImportReport) {
    let timings: Vec<Vec<Timing>> = streams.iter().map(Stream::timings).collect();
    let names = streams.iter().map(|stream| &*stream.name);
    let sources: Vec<(&str, &[Timing])> = names.zip(timings.iter().map(Vec::as_slice)).collect();
    offsets::record_rates(&sources, report);
}

/// Records stamps that are far ahead of those before.
fn record_forward_jumps(stream: &Stream<'_>, report: &mut ImportReport) {
    for (item, step_secs) in offsets::forward_steps(&stream.timings()) {
        let message = stream.items[item].message();
        let place = format!("message {message} is stamped {step_secs:.3} s after the one before");
        let rule = format!(
            "stamps of {} that jump ahead: the time after is a part of its own",
            stream.name
        );
        report.record(Treatment::Repaired, rule, place, "");
    }
}

/// Returns the epoch of each message: by the jumps of its own stream where it has them all, else by the times of the
/// recording.
fn epochs_of(stream: &Stream<'_>, jumps: &[Jump], bounds: &[f64]) -> Vec<usize> {
    let mut epochs = Vec::with_capacity(stream.items.len());
    let mut epoch = 0;
    for (k, item) in stream.items.iter().enumerate() {
        if jumps.len() == bounds.len() {
            epoch += usize::from(jumps.get(epoch).is_some_and(|jump| jump.item == k));
        } else {
            epoch = bounds.partition_point(|bound| *bound <= item.log_secs());
        }
        epochs.push(epoch);
    }
    epochs
}

/// Moves each epoch by whole seconds behind the one before it, where it does not follow by itself.
fn shift_epochs(streams: &mut [Stream<'_>], epochs: &[Vec<usize>], n: usize) {
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; n];
    for (stream, epochs) in streams.iter().zip(epochs) {
        for (item, epoch) in stream.items.iter().zip(epochs) {
            let [first, last] = &mut ranges[*epoch];
            *first = first.min(item.t_secs());
            *last = last.max(item.t_secs());
        }
    }
    let mut shifts = Vec::with_capacity(n);
    let mut end_secs = f64::NEG_INFINITY;
    for [first, last] in ranges {
        let needed = end_secs + EPOCH_GAP_SECS - first;
        let shift = if needed.is_finite() { needed.ceil().max(0.0) } else { 0.0 };
        end_secs = end_secs.max(last + shift);
        shifts.push(shift);
    }
    for (stream, epochs) in streams.iter_mut().zip(epochs) {
        for (item, epoch) in stream.items.iter_mut().zip(epochs) {
            if shifts[*epoch] > 0.0 {
                let t_secs = item.t_secs() + shifts[*epoch];
                item.set_t_secs(t_secs);
            }
        }
    }
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
