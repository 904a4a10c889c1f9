//! The events of a run, for viewers.

use crate::units::Cycle;
use serde::{Deserialize, Serialize};

/// An event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The cycle in which it happened.
    pub cycle: Cycle,
    /// Its severity.
    pub level: Level,
    /// The name of the body it happened to.
    pub who: String,
    /// The event in words.
    pub words: String,
}

/// The severity of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Normal.
    Info,
    /// Worth a look.
    Warning,
    /// An event that the run is meant to avoid.
    Error,
}

/// Events kept for the next frame, up to a maximum; further ones are only counted.
#[derive(Debug, Clone)]
pub struct Log<E> {
    events: Vec<E>,
    left_out: u64,
    /// Whether events are kept, because somebody watches.
    pub is_kept: bool,
}

/// The maximum number of events between two frames; further ones are only counted.
const MOST_EVENTS: usize = 10_000;

impl<E> Default for Log<E> {
    fn default() -> Self {
        Self { events: Vec::new(), left_out: 0, is_kept: false }
    }
}

impl<E> Log<E> {
    /// Keeps an event, if somebody watches.
    pub fn push(&mut self, event: E) {
        if !self.is_kept {
            return;
        }
        match self.events.len() < MOST_EVENTS {
            true => self.events.push(event),
            false => self.left_out += 1,
        }
    }

    /// Takes all events since the last call, and the number of those that were left out.
    pub fn take(&mut self) -> (Vec<E>, u64) {
        (std::mem::take(&mut self.events), std::mem::take(&mut self.left_out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_keeps_nothing_unless_somebody_watches_and_counts_what_is_too_much() {
        let mut log = Log::default();
        log.push(1);
        assert_eq!(log.take(), (vec![], 0));
        log.is_kept = true;
        (0..MOST_EVENTS + 3).for_each(|k| log.push(k));
        let (kept, left_out) = log.take();
        assert_eq!((kept.len(), left_out), (MOST_EVENTS, 3));
        assert_eq!(log.take(), (vec![], 0));
    }
}
