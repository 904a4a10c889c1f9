//! Agents that send each other once where they intend to fly, for methods by which each then finds all headings
//! itself.

use super::link::{self, MessageLimits};
use super::ownship::FiledFlight;
use super::participant::{InvalidMessage, are_valid_coordinates};
use crate::baseline::mvp::ActiveResolutions;
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// The part of an airplane that no other one can see.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Intent {
    /// Number of way-points done with.
    pub next: u32,
    /// Number of its orders that are carried out.
    pub orders: u32,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// The conflicts that it resolves.
    pub resolving: ActiveResolutions,
}

/// The knowledge that an agent has before it hears anything.
#[derive(Debug, Clone)]
pub struct IntentInput {
    /// Place of its airplane in the group.
    pub me: usize,
    /// Its own message.
    pub own: Intent,
    /// The flights of the group as filed, by place: bounds on what its messages may say.
    pub filed: Arc<[FiledFlight]>,
    /// Number of all airplanes of the world, which ids in messages are below.
    pub airplanes: usize,
    /// Whether each of the group was heard lately, or is met for the first time.
    pub expected: Vec<bool>,
}

/// An agent that is done when all others were heard or given up.
#[derive(Debug)]
pub struct IntentExchangeAgent {
    start: IntentInput,
    intents: Vec<Option<Intent>>,
    gone: Vec<bool>,
    is_over: bool,
}

impl IntentExchangeAgent {
    /// Returns an agent that has not sent anything yet.
    pub fn new(start: IntentInput) -> Self {
        let mut intents = vec![None; start.filed.len()];
        intents[start.me] = Some(start.own.clone());
        Self { gone: vec![false; intents.len()], intents, start, is_over: false }
    }
}

impl link::ProtocolAgent for IntentExchangeAgent {
    type Message = Intent;
    /// Messages of the members, by place.
    type Outcome = Vec<Option<Intent>>;

    fn start(&mut self) -> Vec<Intent> {
        vec![self.start.own.clone()]
    }

    fn check_message(&self, from: usize, intent: &Intent) -> Result<(), InvalidMessage> {
        let FiledFlight { max_way_points, orders, .. } = self.start.filed[from];
        let is_filed = intent.next as usize <= max_way_points && intent.orders as usize <= orders;
        InvalidMessage::Plan.ensure(is_filed)?;
        InvalidMessage::Number.ensure(are_valid_coordinates([intent.altitude_m]))?;
        intent.resolving.check(self.start.airplanes)
    }

    fn message_limits(&self) -> MessageLimits {
        // An id takes at most 5 bytes.
        MessageLimits { bytes: 64 + 5 * self.start.airplanes, messages: 1 }
    }

    fn on_message(&mut self, from: usize, intent: Intent) -> Vec<Intent> {
        if !self.is_done() {
            self.intents[from] = Some(intent);
        }
        Vec::new()
    }

    fn awaited_members(&self) -> Vec<usize> {
        (0..self.intents.len()).filter(|&k| self.intents[k].is_none() && !self.gone[k]).collect()
    }

    fn is_expected(&self, other: usize) -> bool {
        self.start.expected[other]
    }

    fn on_peer_gone(&mut self, other: usize, _: bool) -> Vec<Intent> {
        self.gone[other] = true;
        Vec::new()
    }

    fn on_deadline(&mut self) {
        self.is_over = true;
    }

    fn is_done(&self) -> bool {
        self.is_over || self.awaited_members().is_empty()
    }

    fn outcome(&self) -> Option<Vec<Option<Intent>>> {
        self.is_done().then(|| self.intents.clone())
    }
}

impl ActiveResolutions {
    /// Checks the conflicts that an airplane says it resolves, among this number of airplanes.
    ///
    /// # Errors
    /// When there are no such airplanes, or no such heading.
    pub(crate) fn check(&self, airplanes: usize) -> Result<(), InvalidMessage> {
        let with: &[EntityId] = self.conflicting_aircraft();
        let is_ascending = with.windows(2).all(|pair| pair[0] < pair[1]);
        let are_known = with.iter().all(|&id| (id as usize) < airplanes);
        InvalidMessage::Airplane.ensure(is_ascending && are_known)?;
        InvalidMessage::Number.ensure(self.heading_rad().is_finite())
    }
}
