//! The last events of a fleet, by number: a listener that has missed some asks for them.

use super::messages::{FleetEvent, FleetEvents};
use sidestep::kernel::view::LogEvent;
use std::collections::VecDeque;

/// Number of events that are kept: some hundred bytes each, and those of a busy hour.
const MAX_EVENTS: usize = 10_000;

/// Most events of a reply, so that it is of moderate size; a listener asks again for the next ones.
const MAX_EVENTS_PER_REPLY: usize = 1_000;

/// The last events, in the order of their numbers.
#[derive(Debug, Default)]
pub(super) struct EventLog {
    events: VecDeque<FleetEvent>,
    /// Number of the next event.
    next: u64,
}

impl EventLog {
    /// Adds the events of a frame, which has left some out at its end, and returns them with their numbers.
    pub(super) fn push(&mut self, log: &[LogEvent], left_out: u64) -> FleetEvents {
        let first = self.next;
        for event in log {
            self.events.push_back(FleetEvent::new(self.next, event));
            self.next += 1;
        }
        let excess = self.events.len().saturating_sub(MAX_EVENTS);
        self.events.drain(..excess);
        // Nobody has kept them. A listener sees by the numbers that there were some.
        self.next += left_out;
        self.since(first, log.len())
    }

    /// Returns the events from a number on, as many as a reply may have.
    pub(super) fn read(&self, from: u64) -> FleetEvents {
        self.since(from, MAX_EVENTS_PER_REPLY)
    }

    fn since(&self, from: u64, count: usize) -> FleetEvents {
        let begin = self.events.partition_point(|event| event.number < from);
        FleetEvents {
            oldest: self.events.front().map_or(self.next, |event| event.number),
            next: self.next,
            events: self.events.range(begin..).take(count).cloned().collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::kernel::view::{BodyId, LogEventKind, Quantity, Severity};
    use sidestep::worlds::WORLDS;

    fn event(cycle: u64) -> LogEvent {
        let robot = WORLDS.kinds().parse_body_id("robot/3").expect("a kind of body");
        LogEvent {
            cycle,
            level: Severity::Warning,
            kind: LogEventKind::Contact,
            who: robot,
            with: Some(BodyId { number: 4, ..robot }),
            at_m: Some([1.0, 2.0, 0.0]),
            value: Some(Quantity::new(0.5, "m")),
            words: "robot 3 touches robot 4".into(),
        }
    }

    fn numbers(events: &FleetEvents) -> Vec<u64> {
        events.events.iter().map(|event| event.number).collect()
    }

    #[test]
    fn numbers_have_a_gap_where_events_were_left_out_and_nowhere_else() {
        let mut log = EventLog::default();
        assert_eq!(numbers(&log.push(&[], 0)), [0; 0]);
        let first = log.push(&[event(0), event(0)], 3);
        assert_eq!((numbers(&first), first.oldest, first.next), (vec![0, 1], 0, 5));
        let second = log.push(&[event(1)], 0);
        assert_eq!((numbers(&second), second.oldest, second.next), (vec![5], 0, 6));
        assert_eq!(numbers(&log.read(1)), [1, 5]);
        assert_eq!(numbers(&log.read(2)), [5]);
        assert_eq!(numbers(&log.read(6)), [0; 0]);
        let told = &second.events[0];
        assert_eq!((told.severity, &*told.kind, &*told.body), (1, "contact", "robot/3"));
        assert_eq!((&*told.other, told.value, &*told.unit), ("robot/4", 0.5, "m"));
    }

    #[test]
    fn the_oldest_events_go_first_and_a_listener_reads_the_others_in_pieces() {
        let mut log = EventLog::default();
        for cycle in 0..12_500 {
            log.push(&[event(cycle)], 0);
        }
        let mut read = Vec::new();
        let mut from = 0;
        loop {
            let piece = log.read(from);
            assert_eq!((piece.oldest, piece.next), (2_500, 12_500));
            assert!(piece.events.len() <= MAX_EVENTS_PER_REPLY);
            let Some(last) = piece.events.last() else { break };
            from = last.number + 1;
            read.extend(numbers(&piece));
        }
        assert_eq!(read, (2_500..12_500).collect::<Vec<u64>>());
    }
}
