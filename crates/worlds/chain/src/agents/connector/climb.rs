//! A connector as the leader of its chain: it climbs the ladder of `motion::recovery`, motion by
//! motion.
//!
//! The ladder asks for the outcome of a motion and goes on at once; an agent has to wait for it. So
//! the climb starts again with every answer, takes the answers that are there already, and stops
//! where the next one is missing. It is short, and the same code leads a chain that is moved at once.

use super::ConnectorAgent;
use crate::agents::control::LeaderOutcome;
use crate::agents::message::{LeadOrder, NeighborMessage};
use crate::agents::percept::Intention;
use crate::agents::side::NeighborSide;
use crate::motion::recovery::{ChainEnd, ChainMover, RecoveryLadder, RecoveryOutcome, farther_end};
use sidestep_rods::geometry::{Point, normalized, sub};
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{MotionOutcome, MotionRequest, RequestedMotion, Veto, VetoEffect, VetoReason};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct RecoveryProgress<const D: usize> {
    intention: Intention<D>,
    start: Point<D>,
    /// Answers so far.
    answers: Vec<RecoveryAnswer<D>>,
    /// Whether it waits for the next one.
    waits: bool,
    /// Number of motions so far.
    requests: u32,
}

/// The answer to one question of the ladder; answers are in the order of the questions.
#[derive(Debug, Clone, PartialEq)]
enum RecoveryAnswer<const D: usize> {
    /// The outcome of a motion, after which the leader is at a place.
    Outcome(MotionOutcome<D>, Point<D>),
    /// Place and direction of the far end; none in a chain of a single connector.
    End(Option<ChainEnd<D>>),
    /// The target is beyond all coordinates.
    Beyond,
}

/// A question of the ladder that has no answer yet.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RecoveryLadderQuery<const D: usize> {
    /// A motion, or only whether it would be possible.
    Motion { request: MotionRequest<D>, only_asks: bool },
    /// Where the far end of the chain is, and in which direction its rod points.
    End,
}

/// Reason for which a climb does not go on.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RecoveryHaltReason<const D: usize> {
    Asks(RecoveryLadderQuery<D>),
    Beyond,
}

impl<const D: usize> RecoveryProgress<D> {
    pub(super) fn new(intention: Intention<D>, start: Point<D>) -> Self {
        Self { intention, start, answers: Vec::new(), waits: false, requests: 0 }
    }
}

/// A chain that answers as it did before.
struct AnswerReplay<'a, const D: usize> {
    at: Point<D>,
    answers: std::slice::Iter<'a, RecoveryAnswer<D>>,
}

impl<const D: usize> AnswerReplay<'_, D> {
    fn next_replayed_outcome(
        &mut self,
        request: &MotionRequest<D>,
        only_asks: bool,
    ) -> Result<MotionOutcome<D>, RecoveryHaltReason<D>> {
        match self.answers.next() {
            Some(RecoveryAnswer::Outcome(outcome, at)) => {
                self.at = *at;
                Ok(outcome.clone())
            }
            Some(_) => Err(RecoveryHaltReason::Beyond),
            None => Err(RecoveryHaltReason::Asks(RecoveryLadderQuery::Motion {
                request: *request,
                only_asks,
            })),
        }
    }
}

impl<const D: usize> ChainMover<D> for AnswerReplay<'_, D> {
    type Failure = RecoveryHaltReason<D>;

    fn position(&self, _: usize) -> Point<D> {
        self.at
    }

    fn request(
        &mut self,
        request: &MotionRequest<D>,
    ) -> Result<MotionOutcome<D>, RecoveryHaltReason<D>> {
        self.next_replayed_outcome(request, false)
    }

    fn find_veto(
        &mut self,
        request: &MotionRequest<D>,
    ) -> Result<Option<Veto<D>>, RecoveryHaltReason<D>> {
        Ok(self.next_replayed_outcome(request, true)?.veto().copied())
    }

    fn farther_end(&mut self, _: usize) -> Result<Option<ChainEnd<D>>, RecoveryHaltReason<D>> {
        match self.answers.next() {
            Some(RecoveryAnswer::End(end)) => Ok(*end),
            Some(_) => Err(RecoveryHaltReason::Beyond),
            None => Err(RecoveryHaltReason::Asks(RecoveryLadderQuery::End)),
        }
    }
}

impl<const D: usize> ConnectorAgent<D> {
    /// Climbs as far as its answers reach; returns whether there was anything to do.
    pub(super) fn continue_recovery(&mut self) -> bool {
        let Some(climbing) = self.climbing.as_mut().filter(|climbing| !climbing.waits) else {
            return false;
        };
        climbing.waits = true;
        let RecoveryProgress { intention, start, answers, .. } = &*climbing;
        let mut ladder = RecoveryLadder { rungs: self.rungs, memory: intention.memory.clone() };
        let motion = RequestedMotion::Connector { k: self.me as usize, to: intention.to.0 };
        let request = MotionRequest { motion, source: intention.source, mode: VetoEffect::Exact };
        let mut replay = AnswerReplay { at: *start, answers: answers.iter() };
        let climbed = ladder.move_or_recover_with(&mut replay, &request, &intention.situation);
        let (climbed, objection) = match climbed {
            Ok(climbed) => climbed,
            Err(RecoveryHaltReason::Asks(question)) => {
                self.ask_chain(question);
                return true;
            }
            Err(RecoveryHaltReason::Beyond) => {
                let by = self.me as usize;
                let reason = VetoReason::Limit;
                let veto = Veto { by, from: by, reason, obstacle: None, reached: replay.at };
                (RecoveryOutcome::Vetoed(veto), Some(veto))
            }
        };
        self.climbing = None;
        self.ended = Some(LeaderOutcome::Climbed { climbed, objection, memory: ladder.memory });
        self.finish(None);
        true
    }

    fn ask_chain(&mut self, question: RecoveryLadderQuery<D>) {
        match question {
            RecoveryLadderQuery::End if self.n == 1 => self.add_answer(RecoveryAnswer::End(None)),
            RecoveryLadderQuery::End => self.send(self.farther_end_side(), NeighborMessage::AskEnd),
            RecoveryLadderQuery::Motion { request, only_asks } => {
                let Some(climbing) = &mut self.climbing else { return };
                climbing.requests += 1;
                let (k, to) = match request.motion {
                    RequestedMotion::Connector { k, to } => (k as u32, to),
                    // The ladder moves single connectors only.
                    RequestedMotion::Rod { i, to } => (i as u32, to[0]),
                };
                let Intention { is_empty, is_open, .. } = climbing.intention;
                let source = request.source;
                let request = climbing.requests;
                let order = LeadOrder { request, to, source, is_empty, is_open, only_asks };
                if k == self.me {
                    self.start_leading(order, None);
                } else {
                    self.send(self.farther_end_side(), NeighborMessage::Order(order));
                }
            }
        }
    }

    /// Returns the side of the end that leads where this connector is stuck.
    fn farther_end_side(&self) -> NeighborSide {
        match farther_end(self.me as usize, self.n as usize) {
            0 => NeighborSide::Below,
            _ => NeighborSide::Above,
        }
    }

    fn add_answer(&mut self, answer: RecoveryAnswer<D>) {
        if let Some(climbing) = &mut self.climbing {
            climbing.answers.push(answer);
            climbing.waits = false;
        }
    }

    /// Takes the outcome of a motion that the ladder wanted.
    pub(super) fn receive_outcome(&mut self, outcome: Option<MotionOutcome<D>>) {
        let at = self.position.base;
        self.add_answer(
            outcome.map_or(RecoveryAnswer::Beyond, |outcome| RecoveryAnswer::Outcome(outcome, at)),
        );
    }

    /// Passes a leader's question on to the end, or answers it there.
    pub(super) fn on_order(&mut self, from: NeighborSide, message: NeighborMessage<D>) {
        let onward = from.other();
        if self.rods[onward].is_some() {
            return self.send(onward, message);
        }
        match message {
            NeighborMessage::Order(order) if self.leading.is_none() => {
                self.start_leading(order, Some(from))
            }
            NeighborMessage::AskEnd => {
                let at = self.position.base;
                let inward = self.beside[from].map(|track| track.base);
                let ahead = inward.and_then(|inward| normalized(sub(at, inward)));
                self.send(from, NeighborMessage::End(WirePoint(at), ahead.map(WirePoint)));
            }
            _ => {}
        }
    }

    /// Passes an answer on to the leader, or takes it there.
    pub(super) fn on_answer(&mut self, from: NeighborSide, message: NeighborMessage<D>) {
        let is_mine = self.climbing.as_ref().is_some_and(|climbing| climbing.waits);
        if !is_mine {
            return self.send(from.other(), message);
        }
        if self.leading.is_some() || from != self.farther_end_side() {
            return;
        }
        match message {
            NeighborMessage::Done(outcome) => self.receive_outcome(outcome),
            NeighborMessage::End(at, ahead) => {
                let by = farther_end(self.me as usize, self.n as usize);
                let end = ahead.map(|ahead| ChainEnd { by, at: at.0, ahead: ahead.0 });
                self.add_answer(RecoveryAnswer::End(end));
            }
            _ => {}
        }
    }
}
