//! Events in their order, packed: a session keeps millions of them, and most are never asked for.

use crate::usage_registry::StoreBytes;
use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{Kinds, LogEvent};
use std::io::{Read, Write};
use std::ops::Range;

/// Number of events that are packed together: enough that words and kinds repeat, few enough to be unpacked at once.
const CHUNK_EVENTS: usize = 4096;
/// Maximum number of bytes of the sentences of events before they are packed; that of a usual event has some dozens.
const MAX_OPEN_WORD_BYTES: usize = 1 << 20;
/// Maximum number of bytes of packed events: a usual event takes a dozen.
const MAX_PACKED_BYTES: usize = 32 << 20;

/// A list of events, by their cycles.
#[derive(Debug)]
pub(crate) struct EventLog {
    max_events: u64,
    chunks: Vec<EventChunk>,
    /// Bytes of all chunks.
    packed_bytes: usize,
    /// The events that are not packed yet,
    open: Vec<LogEvent>,
    /// and the bytes of their sentences.
    open_word_bytes: usize,
    count: u64,
    /// The kinds of all bodies in the list, for which packed events have names.
    kinds: Kinds,
}

/// Packed events.
#[derive(Debug)]
struct EventChunk {
    first: Cycle,
    last: Cycle,
    count: u64,
    packed: Box<[u8]>,
}

/// Some of the events of a search by cycles.
#[derive(Debug, Default)]
pub(crate) struct EventPage {
    pub(crate) entries: Vec<LogEvent>,
    /// The number of all events of these cycles.
    pub(crate) count: u64,
}

impl EventLog {
    /// Returns an empty list that takes at most so many events.
    pub(crate) fn new(max_events: u64) -> Self {
        Self {
            max_events,
            chunks: Vec::new(),
            packed_bytes: 0,
            open: Vec::new(),
            open_word_bytes: 0,
            count: 0,
            kinds: Kinds::new([]),
        }
    }

    /// Appends an event, which is not before the last one; returns whether there was room for it.
    pub(crate) fn push(&mut self, entry: LogEvent) -> bool {
        if self.count >= self.max_events || self.packed_bytes >= MAX_PACKED_BYTES {
            return false;
        }
        for body in [Some(entry.who), entry.with].into_iter().flatten() {
            if !self.kinds.as_slice().contains(&body.kind) {
                self.kinds = Kinds::new(self.kinds.iter().chain([body.kind]));
            }
        }
        self.open_word_bytes += entry.words.capacity();
        self.open.push(entry);
        self.count += 1;
        if self.open.len() == CHUNK_EVENTS || self.open_word_bytes > MAX_OPEN_WORD_BYTES {
            self.pack_open();
        }
        true
    }

    fn pack_open(&mut self) {
        let Some((first, last)) = self.open.first().zip(self.open.last()) else { return };
        let (first, last) = (first.cycle, last.cycle);
        let count = self.open.len() as u64;
        let packed = pack(&self.open);
        self.packed_bytes += size_of::<EventChunk>() + packed.len();
        self.chunks.push(EventChunk { first, last, count, packed });
        self.open.clear();
        self.open_word_bytes = 0;
    }

    /// Number of events.
    pub(crate) fn len(&self) -> u64 {
        self.count
    }

    /// Returns the bytes of all events.
    pub(crate) fn bytes(&self) -> StoreBytes {
        let open = self.open.capacity() * size_of::<LogEvent>() + self.open_word_bytes;
        let max_open = CHUNK_EVENTS * size_of::<LogEvent>() + 2 * MAX_OPEN_WORD_BYTES;
        StoreBytes {
            used: (self.packed_bytes + open) as u64,
            // The last chunk may be the one that fills the list; packed it is no larger than it was.
            max: (MAX_PACKED_BYTES + 2 * max_open) as u64,
        }
    }

    /// Passes all events to `read`, in their order.
    pub(crate) fn for_each(&self, mut read: impl FnMut(&LogEvent)) {
        for chunk in &self.chunks {
            self.unpack(chunk).iter().for_each(&mut read);
        }
        self.open.iter().for_each(read);
    }

    /// Returns at most `limit` events of some cycles, after the first `skip` ones.
    pub(crate) fn page(&self, cycles: &Range<Cycle>, skip: u64, limit: usize) -> EventPage {
        let mut page = EventPage::default();
        let start = self.chunks.partition_point(|chunk| chunk.last < cycles.start);
        let chunks = self.chunks[start..].iter().take_while(|chunk| chunk.first < cycles.end);
        for chunk in chunks {
            let is_inside = cycles.contains(&chunk.first) && cycles.contains(&chunk.last);
            let is_skipped = page.count + chunk.count <= skip || page.entries.len() == limit;
            // Of events that are only counted, nothing is unpacked.
            if is_inside && is_skipped {
                page.count += chunk.count;
            } else {
                page.extend(&self.unpack(chunk), cycles, skip, limit);
            }
        }
        page.extend(&self.open, cycles, skip, limit);
        page
    }

    fn unpack(&self, chunk: &EventChunk) -> Vec<LogEvent> {
        let mut bytes = Vec::new();
        let read = DeflateDecoder::new(&*chunk.packed).read_to_end(&mut bytes);
        read.expect("what was compressed in memory is whole");
        let unpacked = self.kinds.resolve_names_during(|| postcard::from_bytes(&bytes));
        unpacked.expect("`push` has kept the kinds of all bodies")
    }
}

impl EventPage {
    fn extend(&mut self, entries: &[LogEvent], cycles: &Range<Cycle>, skip: u64, limit: usize) {
        for entry in entries.iter().filter(|entry| cycles.contains(&entry.cycle)) {
            if self.count >= skip && self.entries.len() < limit {
                self.entries.push(entry.clone());
            }
            self.count += 1;
        }
    }
}

fn pack(entries: &[LogEvent]) -> Box<[u8]> {
    let bytes = postcard::to_stdvec(entries).expect("events have a length, and text, and numbers");
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
    let packed = encoder.write_all(&bytes).and_then(|()| encoder.finish());
    packed.expect("writing to memory cannot fail").into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::robots::kinds::{PERSON, ROBOT};
    use sidestep_kernel::view::{BodyId, LogEventKind, Quantity, Severity};

    fn happened(cycle: Cycle) -> LogEvent {
        LogEvent {
            cycle,
            level: Severity::Warning,
            kind: LogEventKind::Contact,
            who: BodyId::new(ROBOT, cycle as u32 % 7, None),
            with: cycle.is_multiple_of(3).then(|| BodyId::new(PERSON, 2, Some(1))),
            at_m: Some([cycle as f64, f64::MIN_POSITIVE, -0.0]),
            value: Some(Quantity::new(0.1 * cycle as f64, "m")),
            words: format!("touches a wall in cycle {cycle}"),
        }
    }

    /// Two events in each cycle.
    fn log(cycles: Cycle) -> (EventLog, Vec<LogEvent>) {
        let all: Vec<LogEvent> =
            (0..cycles).flat_map(|cycle| [happened(cycle), happened(cycle)]).collect();
        let mut log = EventLog::new(u64::MAX);
        assert!(all.iter().all(|entry| log.push(entry.clone())));
        (log, all)
    }

    #[test]
    fn what_is_packed_comes_back_as_it_was_in_a_tenth_of_its_memory() {
        let (log, all) = log(20_000);
        assert!(log.chunks.len() > 8, "most of them are packed");
        let mut read = Vec::new();
        log.for_each(|entry| read.push(entry.clone()));
        assert_eq!((read.len() as u64, &read), (log.len(), &all));
        let words: usize = all.iter().map(|entry| entry.words.len()).sum();
        let unpacked = size_of_val(all.as_slice()) + words;
        assert!(10 * log.packed_bytes < unpacked, "{} of {unpacked} bytes", log.packed_bytes);
    }

    #[test]
    fn pages_are_those_of_a_plain_list_wherever_chunks_end() {
        let (log, all) = log(9000);
        let edges = [0, 1, 2047, 2048, 2049, 4095, 4096, 8191, 8192, 8999, 9000, Cycle::MAX];
        for from in edges {
            for until in edges {
                let cycles = from..until;
                let inside: Vec<&LogEvent> =
                    all.iter().filter(|entry| cycles.contains(&entry.cycle)).collect();
                for skip in [0, 1, 4096, 5000, 20_000] {
                    let page = log.page(&cycles, skip, 3);
                    let expected: Vec<&LogEvent> =
                        inside.iter().copied().skip(skip as usize).take(3).collect();
                    assert_eq!(page.entries.iter().collect::<Vec<_>>(), expected, "{cycles:?}");
                    assert_eq!(page.count, inside.len() as u64, "{cycles:?} after {skip}");
                }
            }
        }
    }

    #[test]
    fn a_full_list_takes_nothing_more() {
        let mut log = EventLog::new(5000);
        let taken = (0..6000).filter(|&cycle| log.push(happened(cycle))).count();
        assert_eq!((taken, log.len()), (5000, 5000));
    }
}
