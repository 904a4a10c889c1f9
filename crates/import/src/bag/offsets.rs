//! Stamps against the times of the recording, which all topics share: where one clock was set and others were not, and
//! where topics are stamped by clocks that differ.

use super::streams::{Stream, Timing};
use crate::report::{ImportReport, Treatment};

/// Number of messages before and after a moment by which it is told whether a clock was set in between.
const NEIGHBORS: usize = 51;
/// Clocks that differ by less are not told apart from latencies, in s.
const MIN_OFFSET_SECS: f64 = 0.5;
/// Stamps so long after the recording of their messages, in s, cannot be: less is the error of clocks that are synchronized.
pub(super) const MAX_AHEAD_SECS: f64 = 0.3;
/// The recording has times where it lasts at least this share of the time between stamps: tools that convert bags leave
/// them out at times.
const MIN_TIMED_SHARE: f64 = 0.1;
/// Number of messages from which on the offset of a topic is known.
const MIN_MESSAGES: usize = 10;
/// Clocks that differ by more than this, in s, are of two kinds: those of a simulation and of the wall.
const MAX_OFFSET_SECS: f64 = 1e6;
/// Stamps run as the recording does where their rate differs by no more: others are those of a simulation, or of a bag that
/// was played faster or slower.
const MAX_RATE_ERROR: f64 = 0.02;
/// The rate of stamps is taken over parts of a recording as long, in s, of which there are so many at least.
const RATE_SPAN_SECS: f64 = 20.0;
const MIN_RATE_SPANS: usize = 8;
/// Messages are recorded as unevenly, in s.
const JITTER_SECS: f64 = 0.25;
/// A stamp of 0 beside others of more than this, in s, was never set: a simulation begins at 0.
const MIN_SET_SECS: f64 = 3600.0;

/// Returns whether the times of a recording tell how much time passed between messages.
pub(super) fn is_timed(timings: &[Timing]) -> bool {
    let mut steps: Vec<f64> = timings
        .windows(2)
        .map(|pair| pair[1].t_secs - pair[0].t_secs)
        .filter(|step| *step > 0.0)
        .collect();
    let n = steps.len() as f64;
    let (Some(first), Some(last), Some(usual)) =
        (timings.first(), timings.last(), median(&mut steps))
    else {
        return false;
    };
    last.log_secs - first.log_secs >= MIN_TIMED_SHARE * usual * n
}

/// Returns which messages have a stamp that is none: 0 beside others that are set, or, of one message alone, far ahead of
/// those before and after it.
pub(super) fn unusable_stamps(timings: &[Timing]) -> Vec<(usize, &'static str)> {
    let mut stamps: Vec<f64> =
        timings.iter().map(|timing| timing.t_secs).filter(|t| *t != 0.0).collect();
    let is_clock = median(&mut stamps).is_some_and(|usual| usual > MIN_SET_SECS);
    let is_timed = is_timed(timings);
    let mut unusable = Vec::new();
    for (k, timing) in timings.iter().enumerate() {
        if timing.t_secs == 0.0 && is_clock {
            unusable.push((k, "whose stamp is 0"));
            continue;
        }
        let around = [k.checked_sub(1), Some(k + 1)].map(|k| k.and_then(|k| timings.get(k)));
        let [Some(before), Some(after)] = around else { continue };
        let is_ahead_of = |other: &Timing| {
            other.t_secs != 0.0
                && timing.ahead_secs() - other.ahead_secs() > MIN_OFFSET_SECS
                && timing.t_secs - other.t_secs > MIN_OFFSET_SECS
        };
        if is_timed && is_ahead_of(before) && is_ahead_of(after) {
            unusable.push((k, "whose stamp is ahead of those before and after it"));
        }
    }
    unusable
}

/// How fast stamps run by the times of the recording.
struct Rate {
    /// 1 for a clock on the wall.
    ratio: f64,
    /// The error that uneven recording may make of it.
    error: f64,
}

impl Rate {
    /// Returns the rate of stamps; `None` where the recording has no times, or too few.
    fn of(timings: &[Timing]) -> Option<Self> {
        if !is_timed(timings) {
            return None;
        }
        let mut steps: Vec<f64> =
            timings.windows(2).map(|pair| pair[1].t_secs - pair[0].t_secs).collect();
        let usual_secs = median(&mut steps).filter(|step| *step > 0.0)?;
        let longest = timings.len() / MIN_RATE_SPANS;
        let wanted = (RATE_SPAN_SECS / usual_secs).ceil() as usize;
        let span = wanted.max(NEIGHBORS).min(longest).max(1);
        let spans = || timings.iter().zip(timings.iter().skip(span));
        let mut recorded: Vec<f64> =
            spans().map(|(from, to)| to.log_secs - from.log_secs).collect();
        let mut ratios: Vec<f64> = spans()
            .map(|(from, to)| (to.t_secs - from.t_secs) / (to.log_secs - from.log_secs))
            .filter(|ratio| ratio.is_finite())
            .collect();
        let ratio = median(&mut ratios)?;
        let recorded_secs = median(&mut recorded).filter(|secs| *secs > 0.0)?;
        Some(Self { ratio, error: JITTER_SECS / recorded_secs })
    }

    /// Returns whether stamps run as the recording does, so that it tells by how much their clock was set.
    fn is_of_recording(&self) -> bool {
        (self.ratio - 1.0).abs() <= MAX_RATE_ERROR + self.error
    }
}

/// Returns whether stamps run as the recording does.
fn run_as_recorded(timings: &[Timing]) -> bool {
    Rate::of(timings).is_some_and(|rate| rate.is_of_recording())
}

/// Names sources whose stamps do not run as the recording does.
pub(super) fn record_rates(sources: &[(&str, &[Timing])], report: &mut ImportReport) {
    let mut names = Vec::new();
    let mut first_rate = None;
    for (name, timings) in sources {
        let other = Rate::of(timings).filter(|rate| !rate.is_of_recording());
        if let (Some(rate), true) = (other, timings.len() >= MIN_MESSAGES) {
            first_rate.get_or_insert(rate.ratio);
            names.push(name);
        }
    }
    if let (Some(rate), Some(name)) = (first_rate, names.first()) {
        let others = match names.len() - 1 {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        let rule = format!(
            "the stamps of {name}{others} run {rate:.2} times as fast as the recording, as those of a simulation or of a bag \
             that is played do: by it is not told whether their clock was set forward or differs from others"
        );
        report.record(Treatment::Noted, rule, "", "");
    }
}

/// A stamp further ahead of the previous one, without as much time in between, is from a clock that was set forward,
/// such as from 1970 to the present.
const MAX_FORWARD_STEP_SECS: f64 = 3600.0;

/// Returns the messages, with the steps in s, at which stamps jump ahead: by the times of the recording, or, where it has
/// none, by themselves.
pub(super) fn forward_steps(timings: &[Timing]) -> Vec<(usize, f64)> {
    let mut items: Vec<usize> = forward_jumps(timings).into_iter().map(|(item, _)| item).collect();
    for (k, pair) in timings.windows(2).enumerate() {
        let step_secs = pair[1].t_secs - pair[0].t_secs;
        let recorded_secs = pair[1].log_secs - pair[0].log_secs;
        if step_secs > MAX_FORWARD_STEP_SECS && recorded_secs < 0.5 * step_secs {
            items.push(k + 1);
        }
    }
    items.sort_unstable();
    items.dedup();
    items.into_iter().map(|item| (item, timings[item].t_secs - timings[item - 1].t_secs)).collect()
}

/// Returns the messages, with the steps in s, from which on stamps are ahead of the recording by more than ever before:
/// there the clock was set forward. Stamps that lagged and return to where they were are those of a network that recovers.
pub(super) fn forward_jumps(timings: &[Timing]) -> Vec<(usize, f64)> {
    let mut jumps = Vec::new();
    if !run_as_recorded(timings) {
        return jumps;
    }
    let mut latest = f64::INFINITY;
    let mut recorded = f64::INFINITY;
    let mut most_ahead_secs = f64::INFINITY;
    for (k, timing) in timings.iter().enumerate() {
        let step_secs = timing.t_secs - latest;
        let recorded_secs = (timing.log_secs - recorded).max(0.0);
        let excess_secs = step_secs - recorded_secs * (1.0 + MAX_RATE_ERROR);
        let is_farthest = timing.ahead_secs() > most_ahead_secs + MIN_OFFSET_SECS;
        let is_lasting =
            || change_at(timings, k).is_some_and(|change_secs| change_secs > MIN_OFFSET_SECS);
        if excess_secs > MIN_OFFSET_SECS && is_farthest && is_lasting() {
            jumps.push((k, step_secs));
        }
        let is_back = latest - timing.t_secs > MIN_OFFSET_SECS;
        // What a clock has shown before it was set back is no measure for what it shows later.
        if k == 0 || is_back {
            most_ahead_secs = timing.ahead_secs();
        }
        most_ahead_secs = most_ahead_secs.max(timing.ahead_secs());
        if k == 0 || timing.t_secs > latest || is_back {
            (latest, recorded) = (timing.t_secs, timing.log_secs);
        }
    }
    jumps
}

/// Returns by how much stamps from a message on are further ahead of the recording than those before it, in s.
fn change_at(timings: &[Timing], start: usize) -> Option<f64> {
    let before = &timings[start.saturating_sub(NEIGHBORS)..start];
    let after = &timings[start..timings.len().min(start + NEIGHBORS)];
    Some(usual_offset(after)? - usual_offset(before)?)
}

fn usual_offset(timings: &[Timing]) -> Option<f64> {
    let mut offsets: Vec<f64> = timings.iter().map(|timing| timing.ahead_secs()).collect();
    median(&mut offsets)
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Takes back what the clocks of some streams were set by, where those of others were not; `epochs` has the epoch of each
/// message, of which there are `n`.
pub(super) fn undo_single_jumps(
    streams: &mut [Stream<'_>],
    epochs: &[Vec<usize>],
    n: usize,
    report: &mut ImportReport,
) {
    let timings: Vec<Vec<Timing>> = streams.iter().map(Stream::timings).collect();
    let timed: Vec<bool> = timings.iter().map(|timings| run_as_recorded(timings)).collect();
    for epoch in 1..n {
        let changes: Vec<Option<f64>> = (0..streams.len())
            .map(|s| {
                let start = epochs[s].partition_point(|own| *own < epoch);
                if timed[s] { change_at(&timings[s], start) } else { None }
            })
            .collect();
        let steadiest = (0..streams.len())
            .filter_map(|s| Some((s, changes[s]?)))
            .min_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
        let Some((reference, least_secs)) = steadiest else { continue };
        for s in 0..streams.len() {
            let Some(excess_secs) = changes[s].map(|change_secs| change_secs - least_secs) else {
                continue;
            };
            if excess_secs.abs() <= MIN_OFFSET_SECS {
                continue;
            }
            let start = epochs[s].partition_point(|own| *own < epoch);
            let place = format!(
                "from message {} on by {excess_secs:.3} s",
                streams[s].items[start].message()
            );
            let rule = format!(
                "the clock of {} was set and that of {} was not: taken back by the times of the recording",
                streams[s].name, streams[reference].name
            );
            report.record(Treatment::Repaired, rule, place, "");
            streams[s].shift_from(start, -excess_secs);
        }
    }
}

/// Compares the stamps of streams by the times of the recording. Those that are later than the recording of their messages
/// cannot be times of measurements, and are moved; others that differ are named.
pub(super) fn compare_clocks(streams: &mut [Stream<'_>], report: &mut ImportReport) {
    let offsets: Vec<Option<f64>> =
        streams.iter().map(|stream| known_offset(&stream.timings())).collect();
    let nearest = (0..streams.len())
        .filter_map(|s| Some((s, offsets[s]?)))
        .min_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
    let Some((reference, reference_secs)) = nearest else { return };
    for s in 0..streams.len() {
        let Some(offset_secs) = offsets[s] else { continue };
        let excess_secs = offset_secs - reference_secs;
        let [name, other] = [&streams[s].name, &streams[reference].name].map(Clone::clone);
        if offset_secs > MAX_AHEAD_SECS && excess_secs > MAX_AHEAD_SECS {
            let rule = format!(
                "the stamps of {name} lie {offset_secs:.3} s after the recording of their messages, which cannot be: they \
                 are moved by {:.3} s to those of {other}",
                -excess_secs
            );
            let remedy = "synchronize the clocks; a localization program stamps transforms ahead by its \
                          transform_tolerance";
            report.record(Treatment::Guessed, rule, "", remedy);
            streams[s].shift_from(0, -excess_secs);
        } else if excess_secs.abs() > MIN_OFFSET_SECS {
            let side = if excess_secs > 0.0 { "ahead of" } else { "behind" };
            let rule = format!(
                "the stamps of {name} are {:.3} s {side} those of {other} by the times of the recording: their clocks \
                 differ, or its messages came late",
                excess_secs.abs()
            );
            let remedy =
                "synchronize the clocks of the machines, and record again, if the clocks differ";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
    }
}

/// Names sources whose stamps are further behind the recording than those of others, in whatever years their clocks are.
/// Those that are ahead of it are not named here.
pub(super) fn record_differences(sources: &[(&str, &[Timing])], report: &mut ImportReport) {
    let offset = |timings: &[Timing]| {
        let is_known = timings.len() >= MIN_MESSAGES && run_as_recorded(timings);
        usual_offset(timings).filter(|_| is_known)
    };
    let offsets: Vec<Option<f64>> = sources.iter().map(|(_, timings)| offset(timings)).collect();
    let nearest = (0..sources.len())
        .filter_map(|s| Some((s, offsets[s]?)))
        .min_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
    let Some((reference, reference_secs)) = nearest else { return };
    for (s, (name, _)) in sources.iter().enumerate() {
        let Some(excess_secs) = offsets[s].map(|secs| secs - reference_secs) else { continue };
        if excess_secs < -MIN_OFFSET_SECS {
            let rule = format!(
                "the stamps of {name} are {:.3} s behind those of {} by the times of the recording: their clocks differ, or \
                 its messages came late",
                -excess_secs, sources[reference].0
            );
            let remedy =
                "synchronize the clocks of the machines, and record again, if the clocks differ";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
    }
}

/// Returns by how much stamps are usually ahead of the recording, where that is known.
pub(super) fn known_offset(timings: &[Timing]) -> Option<f64> {
    let is_known = timings.len() >= MIN_MESSAGES && run_as_recorded(timings);
    usual_offset(timings).filter(|offset_secs| is_known && offset_secs.abs() < MAX_OFFSET_SECS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten messages a second, with stamps by a function of the time in s.
    fn timings(n: u32, stamp: impl Fn(f64) -> f64) -> Vec<Timing> {
        let at = |k: u32| {
            let t_secs = 1000.0 + 0.1 * f64::from(k);
            Timing { t_secs: stamp(t_secs), log_secs: t_secs + 0.01 }
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn a_clock_that_is_set_forward_is_told_from_messages_that_come_late() {
        let set = timings(200, |t| if t < 1010.0 { t } else { t + 2.0 });
        let jumps = forward_jumps(&set);
        assert_eq!(jumps.len(), 1);
        assert!(jumps[0].0 == 100 && (jumps[0].1 - 2.1).abs() < 1e-9, "{jumps:?}");
        let mut late = timings(200, |t| t);
        late[100].t_secs -= 3.0;
        assert_eq!(forward_jumps(&late), []);
        // A network that stood for 3 s, and dropped all but the first and the last of the messages meanwhile.
        let mut stalled = timings(200, |t| t);
        stalled[100].log_secs += 3.0;
        stalled.drain(101..130);
        assert_eq!(forward_jumps(&stalled), []);
        let gap: Vec<Timing> = [&timings(200, |t| t)[..50], &timings(200, |t| t)[150..]].concat();
        assert_eq!(forward_jumps(&gap), []);
    }

    #[test]
    fn stamps_that_run_faster_than_the_recording_are_not_those_of_a_clock_that_is_set() {
        for rate in [0.5, 2.0, 3.0, 5.0] {
            let at = |k: u32| {
                let t_secs = 1000.0 + f64::from(k);
                Timing { t_secs, log_secs: 5000.0 + f64::from(k) / rate }
            };
            let slow: Vec<Timing> = (0..200).map(at).collect();
            assert_eq!(forward_jumps(&slow), [], "{rate}");
            assert_eq!(known_offset(&slow), None, "their offset changes");
        }
        let drifting: Vec<Timing> = (0..200)
            .map(|k| Timing { t_secs: 60.6 * f64::from(k), log_secs: 60.0 * f64::from(k) })
            .collect();
        assert_eq!(forward_jumps(&drifting), [], "one message a minute, and one percent too fast");
    }

    #[test]
    fn a_network_that_lags_more_and_more_and_recovers_is_no_clock_that_is_set() {
        let mut lagging = timings(600, |t| t);
        for (k, timing) in lagging.iter_mut().enumerate().skip(200).take(300) {
            timing.log_secs += 0.01 * (k - 200) as f64;
        }
        // The backlog of 3 s is dropped.
        lagging.drain(470..500);
        assert_eq!(forward_jumps(&lagging), []);
        // A clock that is set on top of that is found.
        lagging[520..].iter_mut().for_each(|timing| timing.t_secs += 2.0);
        let jumps = forward_jumps(&lagging);
        assert!(jumps.len() == 1 && jumps[0].0 == 520, "{jumps:?}");
    }

    #[test]
    fn stamps_that_were_not_set_are_found_and_a_simulation_begins_at_zero() {
        let mut wall = timings(50, |t| t + 1.7e9);
        (wall[7].t_secs, wall[20].t_secs) = (0.0, wall[20].t_secs + 18_000.0);
        let found = unusable_stamps(&wall);
        assert_eq!(found.iter().map(|(k, _)| *k).collect::<Vec<_>>(), [7, 20]);
        assert_eq!(unusable_stamps(&timings(50, |t| t - 1000.0)), []);
    }

    #[test]
    fn a_recording_without_times_tells_nothing() {
        let mut untimed = timings(200, |t| if t < 1010.0 { t } else { t + 2.0 });
        untimed.iter_mut().for_each(|timing| timing.log_secs = 5.0);
        assert!(!is_timed(&untimed) && is_timed(&timings(200, |t| t)));
        assert_eq!(forward_jumps(&untimed), []);
    }
}
