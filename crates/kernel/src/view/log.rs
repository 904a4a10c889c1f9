//! What happened, for those who look on.

use crate::units::Cycle;
use serde::{Deserialize, Serialize};

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The cycle in which it happened.
    pub cycle: Cycle,
    /// How bad it is.
    pub level: Level,
    /// To whom: the name of a body.
    pub who: String,
    /// What, in words.
    pub words: String,
}

/// How bad something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// As it should be.
    Info,
    /// Worth a look.
    Warning,
    /// What the run is meant to avoid.
    Error,
}

/// Events kept for the next frame, up to a number; later ones are counted.
#[derive(Debug, Clone)]
pub struct Log<E> {
    events: Vec<E>,
    left_out: u64,
    /// Whether anybody watches.
    pub is_kept: bool,
}

/// More events than this between two frames are only counted.
const MOST_EVENTS: usize = 10_000;

impl<E> Default for Log<E> {
    fn default() -> Self {
        Self { events: Vec::new(), left_out: 0, is_kept: false }
    }
}

impl<E> Log<E> {
    /// Keeps an event, if anybody watches.
    pub fn push(&mut self, event: E) {
        if !self.is_kept {
            return;
        }
        match self.events.len() < MOST_EVENTS {
            true => self.events.push(event),
            false => self.left_out += 1,
        }
    }

    /// All events since the last call, and how many were left out.
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
