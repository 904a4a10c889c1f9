//! The events of a session, each kept once, however often its cycle is computed.

use crate::encode::event;
use crate::event_log::EventLog;
use crate::protocol::{ReplyBody, RunEvent};
use crate::usage_registry::StoreBytes;
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{Frame, LogEvent};
use std::ops::Range;

/// Maximum number of events kept, so that a search takes seconds at most. Further ones are counted.
const MAX_EVENTS: u64 = 2_000_000;
/// Number of cycles for which events that are not kept are counted together, so that the counts stay few.
const MIN_LOSS_BUCKET_CYCLES: Cycle = 1024;
/// Maximum number of such counts. Where there are more, those of twice as many cycles are put together.
const MAX_LOSS_BUCKETS: usize = 4096;
/// Maximum number of events in a frame, the last ones: frames stay small however much happens, and
/// the page requests the others.
const MAX_FRAME_EVENTS: usize = 100;

/// The events of one run.
#[derive(Debug)]
pub(crate) struct EventStore {
    /// Events as the kernel reports them: they are converted when they are requested.
    kept: EventLog,
    /// The first cycle not computed yet.
    frontier: Cycle,
    /// Numbers of events that were not kept, with the first cycle of each bucket.
    lost: Vec<(Cycle, u64)>,
    bucket_cycles: Cycle,
    /// The events since the last frame that was sent.
    unsent: UnsentEvents,
    /// The events since the last frame sent to Foxglove viewers, if they are served.
    unsent_to_viewers: Option<UnsentEvents>,
}

impl Default for EventStore {
    fn default() -> Self {
        Self::new(MAX_EVENTS)
    }
}

/// The last of the events that have not been reported yet.
#[derive(Debug, Default)]
struct UnsentEvents {
    entries: Vec<LogEvent>,
    left_out: u64,
}

impl UnsentEvents {
    fn push(&mut self, log: &[LogEvent], left_out: u64) {
        let last = &log[log.len().saturating_sub(MAX_FRAME_EVENTS)..];
        let excess = (self.entries.len() + last.len()).saturating_sub(MAX_FRAME_EVENTS);
        self.entries.drain(..excess);
        self.entries.extend_from_slice(last);
        self.left_out += left_out + (log.len() - last.len() + excess) as u64;
    }
}

impl EventStore {
    /// Returns a store that keeps at most so many events.
    pub(crate) fn new(max_events: u64) -> Self {
        Self {
            kept: EventLog::new(max_events),
            frontier: 0,
            lost: Vec::new(),
            bucket_cycles: MIN_LOSS_BUCKET_CYCLES,
            unsent: UnsentEvents::default(),
            unsent_to_viewers: None,
        }
    }

    /// Takes the events of a frame that is shown.
    pub(crate) fn record(&mut self, frame: &mut Frame) {
        self.unsent.push(&frame.log, frame.log_left_out);
        if let Some(unsent) = &mut self.unsent_to_viewers {
            unsent.push(&frame.log, frame.log_left_out);
        }
        self.record_ahead(frame);
    }

    /// Takes the events of a frame that is not shown.
    pub(crate) fn record_ahead(&mut self, frame: &mut Frame) {
        let mut log = std::mem::take(&mut frame.log);
        // A cycle that is computed again, after a seek backward, has the events that are kept already.
        if frame.cycle <= self.frontier {
            return;
        }
        let known = log.partition_point(|entry| entry.cycle < self.frontier);
        let mut lost = frame.log_left_out;
        for entry in log.drain(known..) {
            if !self.kept.push(entry) {
                lost += 1;
            }
        }
        self.record_loss(frame.cycle - 1, lost);
        self.frontier = frame.cycle;
    }

    fn record_loss(&mut self, cycle: Cycle, lost: u64) {
        if lost == 0 {
            return;
        }
        let bucket = cycle / self.bucket_cycles;
        match self.lost.last_mut() {
            Some((last, count)) if *last / self.bucket_cycles == bucket => *count += lost,
            _ => self.lost.push((cycle, lost)),
        }
        if self.lost.len() > MAX_LOSS_BUCKETS {
            self.widen_loss_buckets();
        }
    }

    /// Puts the counts of twice as many cycles together.
    fn widen_loss_buckets(&mut self) {
        self.bucket_cycles *= 2;
        let cycles = self.bucket_cycles;
        self.lost.dedup_by(|later, earlier| {
            let is_same = later.0 / cycles == earlier.0 / cycles;
            if is_same {
                earlier.1 += later.1;
            }
            is_same
        });
    }

    /// Returns the bytes of all that is kept.
    pub(crate) fn bytes(&self) -> StoreBytes {
        let StoreBytes { used, max } = self.kept.bytes();
        let of_counts = |count: usize| (count * size_of::<(Cycle, u64)>()) as u64;
        StoreBytes {
            used: used + of_counts(self.lost.capacity()),
            // The list of counts grows to a power of two.
            max: max + of_counts(2 * MAX_LOSS_BUCKETS),
        }
    }

    /// Returns the cycle before which all events are known.
    pub(crate) fn known_until(&self) -> Cycle {
        self.frontier
    }

    /// Returns all events that are kept, by their cycles.
    pub(crate) fn kept(&self) -> &EventLog {
        &self.kept
    }

    /// Returns the number of events that were not kept.
    pub(crate) fn lost_count(&self) -> u64 {
        self.lost.iter().map(|(_, count)| count).sum()
    }

    /// Returns the numbers of events that were not kept, with the first cycle of each bucket.
    pub(crate) fn lost(&self) -> &[(Cycle, u64)] {
        &self.lost
    }

    /// Takes the last events since the last call, and the number of those that are not among them.
    pub(crate) fn take_unsent(&mut self) -> (Vec<RunEvent>, u64) {
        let UnsentEvents { entries, left_out } = std::mem::take(&mut self.unsent);
        (entries.iter().map(event).collect(), left_out)
    }

    /// Keeps unsent events for Foxglove viewers, too.
    pub(crate) fn enable_viewer_events(&mut self) {
        self.unsent_to_viewers.get_or_insert_default();
    }

    /// Takes the last events since the last call for Foxglove viewers, and the number of those that are not among them.
    pub(crate) fn take_for_viewers(&mut self) -> (Vec<LogEvent>, u64) {
        let UnsentEvents { entries, left_out } =
            self.unsent_to_viewers.as_mut().map(std::mem::take).unwrap_or_default();
        (entries, left_out)
    }

    /// Returns at most the given number of events of some cycles, after the first `skip` ones.
    pub(crate) fn events_reply(&self, cycles: Range<Cycle>, skip: u32, limit: u32) -> ReplyBody {
        let page = self.kept.page(&cycles, skip.into(), limit as usize);
        let lost = self.lost.iter().filter(|(cycle, _)| cycles.contains(cycle));
        let lost: u64 = lost.map(|(_, count)| count).sum();
        // Those before the page are not left out: whoever skips them has them.
        let remaining = page.count.saturating_sub(skip.into()) - page.entries.len() as u64;
        let left_out = remaining + lost;
        let entries: Vec<RunEvent> = page.entries.iter().map(event).collect();
        ReplyBody::Events { entries, left_out, known_until: self.frontier as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::robots::kinds::ROBOT;
    use sidestep_kernel::view::{BodyId, LogEvent, LogEventKind, Severity};

    fn frame(cycle: Cycle, happened: &[Cycle]) -> Frame {
        let entry = |&cycle: &Cycle| {
            let (kind, who) = (LogEventKind::Contact, BodyId::new(ROBOT, 3, None));
            let (with, at_m, value, words) = (None, None, None, format!("at {cycle}"));
            LogEvent { cycle, level: Severity::Info, kind, who, with, at_m, value, words }
        };
        Frame { cycle, log: happened.iter().map(entry).collect(), ..Frame::default() }
    }

    fn cycles(answer: &ReplyBody) -> (Vec<f64>, u64) {
        let ReplyBody::Events { entries, left_out, .. } = answer else { panic!("no events") };
        (entries.iter().map(|event| event.cycle).collect(), *left_out)
    }

    #[test]
    fn what_is_computed_again_is_not_told_twice() {
        let mut events = EventStore::default();
        events.record(&mut frame(10, &[1, 5, 9]));
        events.record(&mut frame(6, &[5]));
        events.record(&mut frame(14, &[9, 10, 12]));
        assert_eq!(
            cycles(&events.events_reply(0..99, 0, 99)),
            (vec![1.0, 5.0, 9.0, 10.0, 12.0], 0)
        );
        assert_eq!(cycles(&events.events_reply(5..12, 0, 99)), (vec![5.0, 9.0, 10.0], 0));
        assert_eq!(cycles(&events.events_reply(0..99, 0, 2)), (vec![1.0, 5.0], 3));
        assert_eq!(cycles(&events.events_reply(Range { start: 9, end: 3 }, 0, 2)), (vec![], 0));
        assert_eq!(events.take_unsent().0.len(), 7, "a frame shows what led to it");
        assert_eq!(events.take_unsent().0.len(), 0);
    }

    #[test]
    fn a_cycle_of_more_events_than_an_answer_holds_is_told_in_parts() {
        let mut events = EventStore::default();
        events.record(&mut frame(10, &[3, 3, 3, 3, 3, 7]));
        assert_eq!(cycles(&events.events_reply(3..9, 2, 2)), (vec![3.0, 3.0], 2));
        assert_eq!(cycles(&events.events_reply(3..9, 4, 2)), (vec![3.0, 7.0], 0));
        assert_eq!(cycles(&events.events_reply(3..9, u32::MAX, 2)), (vec![], 0));
    }

    #[test]
    fn frames_and_memory_hold_so_many_and_the_rest_is_counted() {
        const KEPT: usize = 5000;
        let mut events = EventStore::new(KEPT as u64);
        let happened: Vec<Cycle> = vec![3; KEPT + 7];
        events.record(&mut Frame { log_left_out: 2, ..frame(4, &happened) });
        let (shown, left_out) = events.take_unsent();
        assert_eq!(
            (shown.len(), left_out),
            (MAX_FRAME_EVENTS, (KEPT + 7 - MAX_FRAME_EVENTS + 2) as u64)
        );
        assert_eq!(cycles(&events.events_reply(0..9, 0, u32::MAX)).1, 9);
    }

    #[test]
    fn long_sentences_and_endless_losses_stay_within_the_bound_and_are_counted() {
        let mut events = EventStore::new(1000);
        let mut told = 0;
        for cycle in 1..=3 * MAX_LOSS_BUCKETS as Cycle {
            let mut frame = frame(1024 * cycle, &[1024 * cycle - 1]);
            frame.log[0].words = "w".repeat(4096);
            told += 1;
            events.record_ahead(&mut frame);
            let StoreBytes { used, max } = events.bytes();
            assert!(used <= max, "{used} of {max} bytes");
        }
        let reply = events.events_reply(0..Cycle::MAX, 0, u32::MAX);
        let (kept, lost) = cycles(&reply);
        assert!(kept.len() == 1000 && lost >= 2 * MAX_LOSS_BUCKETS as u64);
        assert_eq!(kept.len() as u64 + lost, told);
    }
}
