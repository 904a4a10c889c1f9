//! Searches the events of a run for words.

use crate::encode::event;
use crate::event_store::EventStore;
use crate::protocol::{ReplyBody, RunEvent};
use sidestep_kernel::view::{BodyId, BodyKind, LogEvent, LogEventKind, Scenery};
use std::collections::BTreeMap;

/// Maximum number of events in a reply; a page that wants more repeats its request.
const MAX_FOUND: u32 = 5000;

/// A search for events.
pub(crate) struct EventQuery<'a> {
    /// Words, all of which an event has in its sentence, its kind or the names of its bodies, whatever their case.
    pub(crate) text: &'a str,
    /// The kinds wanted; all without them.
    pub(crate) kinds: Option<&'a [String]>,
    /// Number of first events that are not told.
    pub(crate) skip: u32,
    /// Maximum number of events that are told.
    pub(crate) limit: u32,
}

/// The names of bodies that have some, by kind and number.
type BodyNames<'a> = BTreeMap<(BodyKind, u32), &'a str>;

impl EventQuery<'_> {
    /// Returns the reply to the request for this search.
    pub(crate) fn reply(&self, store: &EventStore, scenery: &Scenery) -> ReplyBody {
        let mut names = BodyNames::new();
        for (kind, number, name) in &scenery.names {
            names.insert((*kind, *number), name);
        }
        let words: Vec<String> = self.text.split_whitespace().map(str::to_lowercase).collect();
        let limit = self.limit.min(MAX_FOUND) as usize;
        let mut entries: Vec<RunEvent> = Vec::new();
        let mut found = 0_u64;
        let mut counts: BTreeMap<LogEventKind, u64> = BTreeMap::new();
        store.kept().for_each(|entry| {
            *counts.entry(entry.kind).or_default() += 1;
            if !self.is_wanted_kind(entry.kind) || !has_words(entry, &words, &names) {
                return;
            }
            found += 1;
            if found > u64::from(self.skip) && entries.len() < limit {
                entries.push(event(entry));
            }
        });
        ReplyBody::FoundEvents {
            entries,
            found,
            searched: store.kept().len(),
            left_out: store.lost_count(),
            kinds: counts.iter().map(|(kind, count)| (kind.name().to_string(), *count)).collect(),
        }
    }

    fn is_wanted_kind(&self, kind: LogEventKind) -> bool {
        self.kinds.is_none_or(|kinds| kinds.iter().any(|wanted| wanted == kind.name()))
    }
}

/// Returns whether an event has all words, given in lowercase letters.
fn has_words(entry: &LogEvent, words: &[String], names: &BodyNames<'_>) -> bool {
    if words.is_empty() {
        return true;
    }
    let mut text = format!("{} {}", entry.kind.name(), entry.words);
    for body in [Some(entry.who), entry.with].into_iter().flatten() {
        text.push(' ');
        text.push_str(&body_words(body, names));
    }
    let text = text.to_lowercase();
    words.iter().all(|word| text.contains(word))
}

/// Returns a body as the page's lists have it: `robot 4`, or by its own name.
fn body_words(body: BodyId, names: &BodyNames<'_>) -> String {
    let part = body.part.map(|part| format!(" {part}")).unwrap_or_default();
    let own = names.get(&(body.kind, body.number)).copied().unwrap_or_default();
    format!("{own} {} {}{part}", body.kind.name(), body.number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::robots::kinds::ROBOT;
    use sidestep_kernel::Cycle;
    use sidestep_kernel::view::{Frame, Severity};

    fn happened(cycle: Cycle, kind: LogEventKind, robot: u32, words: &str) -> LogEvent {
        let who = BodyId::new(ROBOT, robot, None);
        let words = words.into();
        LogEvent {
            cycle,
            level: Severity::Info,
            kind,
            who,
            with: None,
            at_m: None,
            value: None,
            words,
        }
    }

    fn store() -> EventStore {
        let mut log = Vec::new();
        for cycle in 0..50 {
            log.push(happened(cycle, LogEventKind::Contact, cycle as u32, "touches a wall"));
        }
        log.push(happened(50, LogEventKind::Gridlock, 7, "waits in a Gridlock of 3 robots"));
        let mut store = EventStore::default();
        store.record_ahead(&mut Frame { cycle: 60, log, log_left_out: 4, ..Frame::default() });
        store
    }

    fn scenery() -> Scenery {
        Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies: Vec::new(),
            names: vec![(ROBOT, 3, "Anna".into())],
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        }
    }

    /// Returns the cycles of the events found, and the number of all found.
    fn search(text: &str, kinds: Option<&[String]>, skip: u32, limit: u32) -> (Vec<f64>, u64) {
        let query = EventQuery { text, kinds, skip, limit };
        let ReplyBody::FoundEvents { entries, found, searched, left_out, kinds } =
            query.reply(&store(), &scenery())
        else {
            panic!("no events");
        };
        assert_eq!((searched, left_out), (51, 4));
        assert_eq!(kinds, [("contact".to_string(), 50), ("gridlock".to_string(), 1)]);
        (entries.iter().map(|event| event.cycle).collect(), found)
    }

    #[test]
    fn all_words_are_searched_in_sentences_kinds_and_names_whatever_their_case() {
        assert_eq!(search("GRIDLOCK", None, 0, 9), (vec![50.0], 1));
        assert_eq!(search("waits 3", None, 0, 9), (vec![50.0], 1));
        assert_eq!(search("anna wall", None, 0, 9), (vec![3.0], 1));
        assert_eq!(search("robot 41", None, 0, 9), (vec![41.0], 1));
        assert_eq!(search("anna gridlock", None, 0, 9), (vec![], 0));
    }

    #[test]
    fn found_events_come_in_pages_and_by_kind() {
        assert_eq!(search("wall", None, 0, 3), (vec![0.0, 1.0, 2.0], 50));
        assert_eq!(search("wall", None, 48, 3), (vec![48.0, 49.0], 50));
        let only = ["gridlock".to_string()];
        assert_eq!(search("", Some(&only), 0, 3), (vec![50.0], 1));
        assert_eq!(search("", Some(&[]), 0, 3), (vec![], 0));
    }
}
