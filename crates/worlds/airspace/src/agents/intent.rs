//! Agents that tell each other where they intend to fly, once, for methods by which each then finds all headings
//! itself.

use super::link::{self, Most};
use super::own_ship::Filed;
use super::party::{Unsound, are_places};
use crate::baseline::mvp::Resolving;
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
    pub resolving: Resolving,
}

/// The knowledge that an agent has before it hears anything.
#[derive(Debug, Clone)]
pub struct Start {
    /// Place of its airplane in the group.
    pub me: usize,
    /// Its own message.
    pub own: Intent,
    /// The flights of the group as filed.
    pub filed: Arc<[Filed]>,
    /// Number of all airplanes.
    pub airplanes: usize,
    /// Whether each of the group was heard lately, or is met for the first time.
    pub expected: Vec<bool>,
}

/// One agent.
#[derive(Debug)]
pub struct Agent {
    start: Start,
    told: Vec<Option<Intent>>,
    gone: Vec<bool>,
    is_over: bool,
}

impl Agent {
    /// Returns an agent that has not sent anything yet.
    pub fn new(start: Start) -> Self {
        let mut told = vec![None; start.filed.len()];
        told[start.me] = Some(start.own.clone());
        Self { gone: vec![false; told.len()], told, start, is_over: false }
    }
}

impl link::Agent for Agent {
    type Message = Intent;
    /// Messages of the members, by place.
    type Outcome = Vec<Option<Intent>>;

    fn start(&mut self) -> Vec<Intent> {
        vec![self.start.own.clone()]
    }

    fn check(&self, from: usize, intent: &Intent) -> Result<(), Unsound> {
        let Filed { most_way_points, orders, .. } = self.start.filed[from];
        let is_filed = intent.next as usize <= most_way_points && intent.orders as usize <= orders;
        Unsound::Plan.unless(is_filed)?;
        Unsound::Number.unless(are_places([intent.altitude_m]))?;
        intent.resolving.check(self.start.airplanes)
    }

    fn most(&self) -> Most {
        Most { bytes: 64 + 5 * self.start.airplanes, messages: 1 }
    }

    fn on_message(&mut self, from: usize, intent: Intent) -> Vec<Intent> {
        if !self.is_done() {
            self.told[from] = Some(intent);
        }
        Vec::new()
    }

    fn awaits(&self) -> Vec<usize> {
        (0..self.told.len()).filter(|&k| self.told[k].is_none() && !self.gone[k]).collect()
    }

    fn expects(&self, other: usize) -> bool {
        self.start.expected[other]
    }

    fn without(&mut self, other: usize, _: bool) -> Vec<Intent> {
        self.gone[other] = true;
        Vec::new()
    }

    fn at_deadline(&mut self) {
        self.is_over = true;
    }

    fn is_done(&self) -> bool {
        self.is_over || self.awaits().is_empty()
    }

    fn outcome(&self) -> Option<Vec<Option<Intent>>> {
        self.is_done().then(|| self.told.clone())
    }
}

impl Resolving {
    /// Checks the conflicts that an airplane says it resolves, among this number of airplanes.
    ///
    /// # Errors
    /// When there are no such airplanes, or no such heading.
    pub(crate) fn check(&self, airplanes: usize) -> Result<(), Unsound> {
        let with: &[EntityId] = self.with();
        let rises = with.windows(2).all(|pair| pair[0] < pair[1]);
        let are_known = with.iter().all(|&id| (id as usize) < airplanes);
        Unsound::Airplane.unless(rises && are_known)?;
        Unsound::Number.unless(self.heading_rad().is_finite())
    }
}
