//! A connector as the initiator of one motion: sub-step after sub-step it asks both sides, and then
//! says whether the motion is carried out.

use super::ConnectorAgent;
use crate::agents::control::Led;
use crate::agents::message::{Consent, Message, Objection, Order, Prepare};
use crate::agents::side::{Both, Side};
use crate::rods::geometry::{Point, between};
use crate::rods::scene::Refusal;
use crate::rods::veto::{Moved, Outcome, Veto};
use crate::rods::wire::Place;

/// A motion that a connector leads.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Leading<const D: usize> {
    order: Order<D>,
    /// The side from which the order came; none if it is its own.
    orderer: Option<Side>,
    from: Point<D>,
    /// Number of sub-steps, and of the present one.
    n: usize,
    k: usize,
    stage: Stage,
    has_asked: Both<bool>,
    moved: Moved<D>,
}

/// The next thing to do in a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// The next sub-step, if there is one.
    Step,
    /// Asks one side.
    Ask(Side, Lengths),
    /// Waits for its answer.
    Wait(Side, Lengths),
    /// Ends the motion, because of an objection.
    Object(Objection),
}

/// Lengths that rods which turn try.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lengths {
    /// Another one only if the present one is blocked.
    Own,
    /// All.
    All,
}

impl<const D: usize> ConnectorAgent<D> {
    /// Begins to lead a motion.
    pub(super) fn lead(&mut self, order: Order<D>, orderer: Option<Side>) {
        self.begin_motion();
        self.following = None;
        let from = self.place.base;
        let Ok(n) = self.alone.sub_steps(from, order.to, order.is_empty) else {
            return self.is_answered(orderer, None);
        };
        let me = self.me as usize;
        let touched = me..me;
        let moved =
            Moved { touched, changed: 0, rotated: 0, max_slave_step_m: 0.0, cut_short: None };
        let stage = match self.alone.may_lead(from, order.to) {
            Ok(()) => Stage::Step,
            Err(refusal) => Stage::Object(self.own_objection(refusal)),
        };
        let has_asked = Both::default();
        self.leading = Some(Leading { order, orderer, from, n, k: 0, stage, has_asked, moved });
    }

    fn own_objection(&self, Refusal { reason, obstacle }: Refusal) -> Objection {
        let (has_turned, may_go_elsewhere) = (false, false);
        Objection { by: self.me, reason, obstacle, has_turned, may_go_elsewhere }
    }

    /// Does the next thing in the motion that it leads; returns whether there was one to do.
    pub(super) fn go_on_leading(&mut self) -> bool {
        let Some(mut leading) = self.leading.take() else { return false };
        match leading.stage {
            Stage::Wait(..) => {
                self.leading = Some(leading);
                return false;
            }
            Stage::Step if leading.k == leading.n => self.has_led(leading),
            Stage::Object(objection) => self.has_led_in_vain(leading, &objection),
            Stage::Step => {
                leading.k += 1;
                leading.stage = self.step(&leading);
                self.leading = Some(leading);
            }
            Stage::Ask(side, lengths) => {
                leading.stage = self.ask(&mut leading, side, lengths);
                self.leading = Some(leading);
            }
        }
        true
    }

    /// Goes on to a sub-step, which begins where the one before has led.
    fn step(&mut self, leading: &Leading<D>) -> Stage {
        let Leading { order, from, n, k, .. } = leading;
        let to = if k == n { order.to } else { between(*from, order.to, *k as f64 / *n as f64) };
        self.accept();
        let at = self.place.base;
        if self.alone.is_there(at, to) {
            return Stage::Step;
        }
        if !order.is_open
            && let Err(refusal) = self.alone.judge_initiator(at, to, &self.obstacles)
        {
            return Stage::Object(self.own_objection(refusal));
        }
        self.place.now = to;
        Stage::Ask(Side::Above, Lengths::Own)
    }

    fn ask(&mut self, leading: &mut Leading<D>, side: Side, lengths: Lengths) -> Stage {
        if self.rods[side].is_none() {
            return self.after(leading, side);
        }
        // In the first sweep the connector on the other side has yet to move, and the second sweep
        // will check the bend.
        let other = self.beside[Side::Above].filter(|_| side == Side::Below);
        leading.has_asked[side] = true;
        let prepare = Prepare {
            request: leading.order.request,
            sub_step: leading.k as u32,
            mo: self.place.base,
            mn: self.place.now,
            prev: other.map(|track| Place(track.now)),
            max_bend_rad: self.alone.max_bend_rad(),
            is_open: leading.order.is_open,
            all_lengths: lengths == Lengths::All,
        };
        self.say(side, Message::Prepare(prepare));
        Stage::Wait(side, lengths)
    }

    /// Goes on after one side has consented.
    fn after(&self, leading: &mut Leading<D>, side: Side) -> Stage {
        if side == Side::Above {
            return Stage::Ask(Side::Below, Lengths::Own);
        }
        leading.moved.changed += 1;
        let (me, touched) = (self.me as usize, &mut leading.moved.touched);
        (touched.start, touched.end) = (touched.start.min(me), touched.end.max(me + 1));
        Stage::Step
    }

    /// Takes the consent of one side to the motion that it leads; returns whether it waits for that.
    pub(super) fn is_led_past(&mut self, side: Side, consent: &Consent<D>) -> bool {
        let Some(mut leading) = self.leading.take() else { return false };
        let waits = matches!(leading.stage, Stage::Wait(from, _) if from == side);
        if waits {
            let (me, moved) = (self.me as usize, &mut leading.moved);
            match side {
                Side::Below => {
                    let first = me.saturating_sub(consent.touched as usize);
                    moved.touched.start = moved.touched.start.min(first);
                }
                Side::Above => {
                    let end = (me + 1 + consent.touched as usize).min(self.n as usize);
                    moved.touched.end = moved.touched.end.max(end);
                }
            }
            moved.changed += consent.changed as usize;
            moved.rotated += consent.rotated as usize;
            moved.max_slave_step_m = moved.max_slave_step_m.max(consent.longest_m);
            leading.stage = self.after(&mut leading, side);
        }
        self.leading = Some(leading);
        waits
    }

    /// Takes the objection of one side to the motion that it leads. If rods have turned, and could try other
    /// lengths, that side is asked again.
    pub(super) fn is_led_against(&mut self, side: Side, objection: &Objection) {
        let Some(leading) = &mut self.leading else { return };
        let Stage::Wait(from, lengths) = leading.stage else { return };
        if from != side {
            return;
        }
        let Objection { has_turned, may_go_elsewhere, .. } = *objection;
        let repeats =
            lengths == Lengths::Own && has_turned && may_go_elsewhere && self.alone.repeats();
        leading.stage = match repeats {
            true => Stage::Ask(side, Lengths::All),
            false => Stage::Object(*objection),
        };
    }

    /// Ends a motion to which all have consented.
    fn has_led(&mut self, leading: Leading<D>) {
        self.accept();
        let goes = !leading.order.only_asks;
        let touched = &leading.moved.touched;
        if goes && !touched.is_empty() {
            let (first, last) = (touched.start as u32, touched.end as u32 - 1);
            self.led = Some(Led { request: leading.order.request, first, last });
        }
        self.settle(&leading, goes);
        self.is_answered(leading.orderer, Some(Outcome::Moved(leading.moved)));
    }

    /// Ends a motion to which a connector objects.
    fn has_led_in_vain(&mut self, leading: Leading<D>, objection: &Objection) {
        let Objection { by, reason, obstacle, .. } = *objection;
        let (by, from, reached) = (by as usize, self.me as usize, self.place.base);
        self.settle(&leading, false);
        let veto = Veto { by, from, reason, obstacle, reached };
        self.is_answered(leading.orderer, Some(Outcome::Vetoed(veto)));
    }

    fn settle(&mut self, leading: &Leading<D>, goes: bool) {
        let request = leading.order.request;
        self.settle_motion(goes.then_some(request));
        for side in Side::ALL.into_iter().filter(|side| leading.has_asked[*side]) {
            self.say(side, Message::Settle { request, goes });
        }
    }

    /// Breaks off the motion that it leads, if there is one: no connector moves.
    pub(super) fn give_up_leading(&mut self) {
        if let Some(leading) = self.leading.take() {
            self.settle(&leading, false);
        }
    }

    /// Hands the outcome of a motion to its orderer.
    fn is_answered(&mut self, orderer: Option<Side>, outcome: Option<Outcome<D>>) {
        match orderer {
            Some(side) => self.say(side, Message::Done(outcome)),
            None => self.is_told(outcome),
        }
    }
}
