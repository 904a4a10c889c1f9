//! A connector as the leader of its chain: it climbs the ladder of `motion::replan`, motion after
//! motion.
//!
//! The ladder asks for the outcome of a motion and goes on at once; an agent has to wait for it. So
//! the climb starts again with every answer, takes the answers that are there already, and stops
//! where the next one is missing. It is short, and the same code leads a chain that is moved at once.

use super::ConnectorAgent;
use crate::agents::control::Ended;
use crate::agents::message::{Message, Order};
use crate::agents::side::Side;
use crate::agents::sight::Wish;
use crate::motion::replan::{Climbed, End, Ladder, Moves, farther_end};
use crate::rods::geometry::{Point, sub, unit};
use crate::rods::veto::{Mode, Motion, Outcome, Reason, Request, Veto};
use crate::rods::wire::Place;

/// A leader's climb.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Climbing<const D: usize> {
    wish: Wish<D>,
    start: Point<D>,
    /// Answers so far.
    answers: Vec<Answer<D>>,
    /// Whether it waits for the next one.
    waits: bool,
    /// Number of motions so far.
    requests: u32,
}

/// An answer to a question of the ladder.
#[derive(Debug, Clone, PartialEq)]
enum Answer<const D: usize> {
    /// The outcome of a motion, after which the leader is at a place.
    Outcome(Outcome<D>, Point<D>),
    /// The other end.
    End(Option<End<D>>),
    /// The target is beyond all coordinates.
    Beyond,
}

/// A question of the ladder that has no answer yet.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Question<const D: usize> {
    /// A motion, or only whether it would be possible.
    Motion { request: Request<D>, only_asks: bool },
    /// The other end.
    End,
}

/// Reason for which a climb does not go on.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Halt<const D: usize> {
    Asks(Question<D>),
    Beyond,
}

impl<const D: usize> Climbing<D> {
    pub(super) fn new(wish: Wish<D>, start: Point<D>) -> Self {
        Self { wish, start, answers: Vec::new(), waits: false, requests: 0 }
    }
}

/// A chain that answers as it did before.
struct Replay<'a, const D: usize> {
    at: Point<D>,
    answers: std::slice::Iter<'a, Answer<D>>,
}

impl<const D: usize> Replay<'_, D> {
    fn outcome(&mut self, request: &Request<D>, only_asks: bool) -> Result<Outcome<D>, Halt<D>> {
        match self.answers.next() {
            Some(Answer::Outcome(outcome, at)) => {
                self.at = *at;
                Ok(outcome.clone())
            }
            Some(_) => Err(Halt::Beyond),
            None => Err(Halt::Asks(Question::Motion { request: *request, only_asks })),
        }
    }
}

impl<const D: usize> Moves<D> for Replay<'_, D> {
    type Failure = Halt<D>;

    fn place(&self, _: usize) -> Point<D> {
        self.at
    }

    fn request(&mut self, request: &Request<D>) -> Result<Outcome<D>, Halt<D>> {
        self.outcome(request, false)
    }

    fn objection(&mut self, request: &Request<D>) -> Result<Option<Veto<D>>, Halt<D>> {
        Ok(self.outcome(request, true)?.veto().copied())
    }

    fn other_end(&mut self, _: usize) -> Result<Option<End<D>>, Halt<D>> {
        match self.answers.next() {
            Some(Answer::End(end)) => Ok(*end),
            Some(_) => Err(Halt::Beyond),
            None => Err(Halt::Asks(Question::End)),
        }
    }
}

impl<const D: usize> ConnectorAgent<D> {
    /// Climbs as far as its answers reach; returns whether there was anything to do.
    pub(super) fn climb_on(&mut self) -> bool {
        let Some(climbing) = self.climbing.as_mut().filter(|climbing| !climbing.waits) else {
            return false;
        };
        climbing.waits = true;
        let Climbing { wish, start, answers, .. } = &*climbing;
        let mut ladder = Ladder { rungs: self.rungs, memory: wish.memory.clone() };
        let motion = Motion::Connector { k: self.me as usize, to: wish.to.0 };
        let request = Request { motion, source: wish.source, mode: Mode::Exact };
        let mut replay = Replay { at: *start, answers: answers.iter() };
        let climbed = ladder.climb_by(&mut replay, &request, &wish.situation);
        let (climbed, objection) = match climbed {
            Ok(climbed) => climbed,
            Err(Halt::Asks(question)) => {
                self.put(question);
                return true;
            }
            Err(Halt::Beyond) => {
                let (by, reached) = (self.me as usize, replay.at);
                let (reason, obstacle) = (Reason::Limit, None);
                let veto = Veto { by, from: by, reason, obstacle, reached };
                (Climbed::Vetoed(veto), Some(veto))
            }
        };
        self.climbing = None;
        self.ended = Some(Ended::Climbed { climbed, objection, memory: ladder.memory });
        self.finish(None);
        true
    }

    /// Puts a question to the chain.
    fn put(&mut self, question: Question<D>) {
        match question {
            Question::End if self.n == 1 => self.answer(Answer::End(None)),
            Question::End => self.say(self.far_side(), Message::AskEnd),
            Question::Motion { request, only_asks } => {
                let Some(climbing) = &mut self.climbing else { return };
                climbing.requests += 1;
                let (k, to) = match request.motion {
                    Motion::Connector { k, to } => (k as u32, to),
                    Motion::Rod { i, to } => (i as u32, to[0]),
                };
                let Wish { is_empty, is_open, .. } = climbing.wish;
                let (request, source) = (climbing.requests, request.source);
                let order = Order { request, to, source, is_empty, is_open, only_asks };
                match k == self.me {
                    true => self.lead(order, None),
                    false => self.say(self.far_side(), Message::Order(order)),
                }
            }
        }
    }

    /// Returns the side of the end that leads where this connector is stuck.
    fn far_side(&self) -> Side {
        match farther_end(self.me as usize, self.n as usize) {
            0 => Side::Below,
            _ => Side::Above,
        }
    }

    fn answer(&mut self, answer: Answer<D>) {
        if let Some(climbing) = &mut self.climbing {
            climbing.answers.push(answer);
            climbing.waits = false;
        }
    }

    /// Takes the outcome of a motion that the ladder wanted.
    pub(super) fn is_told(&mut self, outcome: Option<Outcome<D>>) {
        let at = self.place.base;
        self.answer(outcome.map_or(Answer::Beyond, |outcome| Answer::Outcome(outcome, at)));
    }

    /// Passes a leader's question on to the end, or answers it there.
    pub(super) fn on_order(&mut self, from: Side, message: Message<D>) {
        let onward = from.other();
        if self.rods[onward].is_some() {
            return self.say(onward, message);
        }
        match message {
            Message::Order(order) if self.leading.is_none() => self.lead(order, Some(from)),
            Message::AskEnd => {
                let at = self.place.base;
                let inward = self.beside[from].map(|track| track.base);
                let ahead = inward.and_then(|inward| unit(sub(at, inward)));
                self.say(from, Message::End(Place(at), ahead.map(Place)));
            }
            _ => {}
        }
    }

    /// Passes an answer on to the leader, or takes it there.
    pub(super) fn on_answer(&mut self, from: Side, message: Message<D>) {
        let is_mine = self.climbing.as_ref().is_some_and(|climbing| climbing.waits);
        if !is_mine {
            return self.say(from.other(), message);
        }
        if self.leading.is_some() || from != self.far_side() {
            return;
        }
        match message {
            Message::Done(outcome) => self.is_told(outcome),
            Message::End(at, ahead) => {
                let by = farther_end(self.me as usize, self.n as usize);
                let end = ahead.map(|ahead| End { by, at: at.0, ahead: ahead.0 });
                self.answer(Answer::End(end));
            }
            _ => {}
        }
    }
}
