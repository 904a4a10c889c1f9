//! What an airplane exposes to the coordinators that it hosts, and the news that they leave there for each other.

use super::CoordinatorHostServices;
use super::state::OptimizationProgress;
use crate::agents::link::ConversationEnd;
use crate::agents::{OptimizationResult, Ownship};
use crate::flight::{Point, Surface};

/// An airplane as the coordinators on it see it.
#[derive(Debug, Clone)]
pub(super) struct HostAircraft {
    pub own: Ownship,
    /// The parts of the group, each of which has a coordinator; with several there is one above them,
    /// which has the number after theirs.
    pub parts: Vec<Vec<usize>>,
    /// The part that the airplane belongs to.
    pub part: usize,
    /// Tick in which sampling ends, so that some time is left to bring the controls.
    pub sampling_end: u64,
    /// News of the part's coordinator for the one above it.
    pub report: Option<OptimizationProgress>,
    /// News of the one above for the part's coordinator.
    pub answer: Option<RootCoordinatorReply>,
    /// Whether there is no one above, and will be none.
    pub is_orphan: bool,
    has_news: bool,
    /// Set once, when the airplane gets its control or nobody can bring it one.
    pub end: Option<ConversationEnd<OptimizationResult>>,
}

/// The news of the coordinator above for that of a part.
#[derive(Debug, Clone)]
pub(super) struct RootCoordinatorReply {
    pub data: OptimizationProgress,
    /// Whether it has any results.
    pub is_known: bool,
}

impl HostAircraft {
    pub(super) fn new(own: Ownship, parts: Vec<Vec<usize>>) -> Self {
        let part = parts.iter().position(|part| part.contains(&own.me)).unwrap_or(0);
        Self {
            own,
            parts,
            part,
            sampling_end: u64::MAX,
            report: None,
            answer: None,
            is_orphan: false,
            has_news: false,
            end: None,
        }
    }

    /// Returns the number of the coordinator above the others, if there is one.
    pub(super) fn root_number(&self) -> Option<usize> {
        (self.parts.len() > 1).then_some(self.parts.len())
    }

    pub(super) fn set_part_progress(&mut self, report: OptimizationProgress) {
        self.report = Some(report);
        self.has_news = true;
    }

    pub(super) fn set_reply(&mut self, answer: RootCoordinatorReply) {
        self.report = None;
        self.answer = Some(answer);
        self.has_news = true;
    }

    /// Ends the conversation for the airplane, unless it has ended: its control stays as it is.
    pub(super) fn conclude(&mut self, conclusion: OptimizationResult, unheard: Vec<usize>) {
        if self.end.is_none() {
            self.end = Some(ConversationEnd { outcome: Some(conclusion), unheard, late: false });
        }
    }

    /// Ends the conversation for an airplane that no coordinator can reach.
    pub(super) fn conclude_alone(&mut self, unheard: Vec<usize>) {
        let beacons = vec![None; self.own.common.ids.len()];
        self.conclude(OptimizationResult { decided: None, beacons }, unheard);
    }
}

impl CoordinatorHostServices for HostAircraft {
    fn is_awaiting_coordinator(&self, number: usize) -> bool {
        // Only the part's coordinator waits for the one above it.
        let is_above = self.root_number() == Some(number) && self.report.is_some();
        self.end.is_none() && (number == self.part || is_above)
    }

    fn has_news(&mut self) -> bool {
        std::mem::take(&mut self.has_news)
    }

    fn on_no_majority(&mut self, number: usize, unanswering: &[usize]) {
        if number == self.part {
            self.conclude_alone(unanswering.to_vec());
        } else if self.root_number() == Some(number) && !self.is_orphan {
            self.is_orphan = true;
            self.has_news = true;
        }
    }
}

/// Splits a group at some places by proximity into parts of about as many members as there are
/// parts: each time the first that is left and those nearest to it.
pub(super) fn partition_group(surface: Surface, at: &[Point]) -> Vec<Vec<usize>> {
    let size = (at.len() as f64).sqrt().ceil() as usize;
    let mut rest: Vec<usize> = (0..at.len()).collect();
    let mut parts = Vec::new();
    while let Some(&first) = rest.first() {
        let from_first_m = |place: usize| surface.distance_m(at[first], at[place]);
        rest.sort_by(|&a, &b| from_first_m(a).total_cmp(&from_first_m(b)).then(a.cmp(&b)));
        let mut part: Vec<usize> = rest.drain(..size.min(rest.len())).collect();
        part.sort_unstable();
        parts.push(part);
        rest.sort_unstable();
    }
    parts
}
