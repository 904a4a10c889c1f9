//! A connector as the initiator of one motion: in each sub-step it asks both sides, and at the end it
//! sends whether the motion is carried out.

use super::ConnectorAgent;
use crate::agents::control::ExecutedMotion;
use crate::agents::message::{
    ConsentMessage, LeadOrder, NeighborMessage, PrepareMessage, VetoMessage,
};
use crate::agents::side::{NeighborSide, PerSide};
use sidestep_rods::geometry::{Point, lerp};
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{CompletedMotion, IncompleteVeto, MotionOutcome, Veto};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct LeadMotionState<const D: usize> {
    order: LeadOrder<D>,
    /// The side from which the order came; none if it is its own.
    orderer: Option<NeighborSide>,
    from: Point<D>,
    /// Number of sub-steps.
    n: usize,
    /// The present sub-step, from 1.
    k: usize,
    phase: LeadMotionPhase,
    has_asked: PerSide<bool>,
    moved: CompletedMotion<D>,
}

/// The next thing to do in a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum LeadMotionPhase {
    /// The next sub-step, if there is one.
    Step,
    /// Asks one side whether it can follow.
    Ask(NeighborSide, TrialRodLengths),
    /// Waits for its answer.
    Wait(NeighborSide, TrialRodLengths),
    /// Ends the motion, because of an objection.
    Object(VetoMessage),
}

/// Lengths that rods which turn try.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TrialRodLengths {
    /// Another one only if the present one is blocked.
    Own,
    /// All that a rod may have: the second try, after a veto.
    All,
}

impl<const D: usize> ConnectorAgent<D> {
    pub(super) fn start_leading(&mut self, order: LeadOrder<D>, orderer: Option<NeighborSide>) {
        self.start_motion();
        self.following = None;
        let from = self.position.base;
        let Ok(n) = self.solver.sub_steps(from, order.to, order.is_empty) else {
            return self.send_outcome(orderer, None);
        };
        let me = self.me as usize;
        let touched = me..me;
        let moved = CompletedMotion {
            touched,
            changed: 0,
            rotated: 0,
            max_slave_step_m: 0.0,
            cut_short: None,
        };
        let phase = match self.solver.may_lead(from, order.to) {
            Ok(()) => LeadMotionPhase::Step,
            Err(refusal) => LeadMotionPhase::Object(self.own_veto_message(refusal)),
        };
        let has_asked = PerSide::default();
        self.leading =
            Some(LeadMotionState { order, orderer, from, n, k: 0, phase, has_asked, moved });
    }

    fn own_veto_message(&self, IncompleteVeto { reason, obstacle }: IncompleteVeto) -> VetoMessage {
        VetoMessage { by: self.me, reason, obstacle, has_turned: false, may_go_elsewhere: false }
    }

    /// Does the next thing in the motion that it leads; returns whether there was one to do.
    pub(super) fn advance_leading(&mut self) -> bool {
        let Some(mut leading) = self.leading.take() else { return false };
        match leading.phase {
            LeadMotionPhase::Wait(..) => {
                self.leading = Some(leading);
                return false;
            }
            LeadMotionPhase::Step if leading.k == leading.n => self.finish_led_motion(leading),
            LeadMotionPhase::Object(objection) => self.abort_lead(leading, &objection),
            LeadMotionPhase::Step => {
                leading.k += 1;
                leading.phase = self.start_sub_step(&leading);
                self.leading = Some(leading);
            }
            LeadMotionPhase::Ask(side, lengths) => {
                leading.phase = self.ask_side(&mut leading, side, lengths);
                self.leading = Some(leading);
            }
        }
        true
    }

    /// Starts a sub-step, which begins where the one before has ended.
    fn start_sub_step(&mut self, leading: &LeadMotionState<D>) -> LeadMotionPhase {
        let LeadMotionState { order, from, n, k, .. } = leading;
        let to = if k == n { order.to } else { lerp(*from, order.to, *k as f64 / *n as f64) };
        self.accept_sub_step();
        let at = self.position.base;
        if self.solver.is_negligible(at, to) {
            return LeadMotionPhase::Step;
        }
        if !order.is_open
            && let Err(refusal) = self.solver.check_initiator(at, to, &self.obstacles)
        {
            return LeadMotionPhase::Object(self.own_veto_message(refusal));
        }
        self.position.now = to;
        // Above first, as where one process moves the chain, so that both make the same bits.
        LeadMotionPhase::Ask(NeighborSide::Above, TrialRodLengths::Own)
    }

    fn ask_side(
        &mut self,
        leading: &mut LeadMotionState<D>,
        side: NeighborSide,
        lengths: TrialRodLengths,
    ) -> LeadMotionPhase {
        if self.rods[side].is_none() {
            return self.after_consent(leading, side);
        }
        // In the first sweep the connector on the other side has yet to move, and the second sweep
        // will check the bend.
        let other = self.beside[NeighborSide::Above].filter(|_| side == NeighborSide::Below);
        leading.has_asked[side] = true;
        let prepare = PrepareMessage {
            request: leading.order.request,
            sub_step: leading.k as u32,
            mo: self.position.base,
            mn: self.position.now,
            prev: other.map(|track| WirePoint(track.now)),
            max_bend_rad: self.solver.max_bend_rad(),
            is_open: leading.order.is_open,
            all_lengths: lengths == TrialRodLengths::All,
        };
        self.send(side, NeighborMessage::Prepare(prepare));
        LeadMotionPhase::Wait(side, lengths)
    }

    /// Above is followed by below; after both the sub-step is accepted.
    fn after_consent(
        &self,
        leading: &mut LeadMotionState<D>,
        side: NeighborSide,
    ) -> LeadMotionPhase {
        if side == NeighborSide::Above {
            return LeadMotionPhase::Ask(NeighborSide::Below, TrialRodLengths::Own);
        }
        leading.moved.changed += 1;
        let me = self.me as usize;
        let touched = &mut leading.moved.touched;
        touched.start = touched.start.min(me);
        touched.end = touched.end.max(me + 1);
        LeadMotionPhase::Step
    }

    /// Accepts the consent of one side to the motion that it leads; returns whether it waits for that.
    pub(super) fn receive_consent(
        &mut self,
        side: NeighborSide,
        consent: &ConsentMessage<D>,
    ) -> bool {
        let Some(mut leading) = self.leading.take() else { return false };
        let waits = matches!(leading.phase, LeadMotionPhase::Wait(from, _) if from == side);
        if waits {
            let me = self.me as usize;
            let moved = &mut leading.moved;
            match side {
                NeighborSide::Below => {
                    let first = me.saturating_sub(consent.touched as usize);
                    moved.touched.start = moved.touched.start.min(first);
                }
                NeighborSide::Above => {
                    let end = (me + 1 + consent.touched as usize).min(self.n as usize);
                    moved.touched.end = moved.touched.end.max(end);
                }
            }
            moved.changed += consent.changed as usize;
            moved.rotated += consent.rotated as usize;
            moved.max_slave_step_m = moved.max_slave_step_m.max(consent.longest_m);
            leading.phase = self.after_consent(&mut leading, side);
        }
        self.leading = Some(leading);
        waits
    }

    /// Accepts the veto of one side to the motion that it leads. If rods have turned, and could try other
    /// lengths, that side is asked again.
    pub(super) fn receive_veto(&mut self, side: NeighborSide, objection: &VetoMessage) {
        let Some(leading) = &mut self.leading else { return };
        let LeadMotionPhase::Wait(from, lengths) = leading.phase else { return };
        if from != side {
            return;
        }
        let VetoMessage { has_turned, may_go_elsewhere, .. } = *objection;
        let repeats = lengths == TrialRodLengths::Own
            && has_turned
            && may_go_elsewhere
            && self.solver.should_repeat_sweep();
        leading.phase = if repeats {
            LeadMotionPhase::Ask(side, TrialRodLengths::All)
        } else {
            LeadMotionPhase::Object(*objection)
        };
    }

    /// Ends a motion to which all have consented.
    fn finish_led_motion(&mut self, leading: LeadMotionState<D>) {
        self.accept_sub_step();
        let goes = !leading.order.only_asks;
        let touched = &leading.moved.touched;
        if goes && !touched.is_empty() {
            self.led = Some(ExecutedMotion {
                request: leading.order.request,
                first: touched.start as u32,
                last: touched.end as u32 - 1,
            });
        }
        self.send_settle(&leading, goes);
        self.send_outcome(leading.orderer, Some(MotionOutcome::Moved(leading.moved)));
    }

    /// Ends a motion to which a connector objects.
    fn abort_lead(&mut self, leading: LeadMotionState<D>, objection: &VetoMessage) {
        let VetoMessage { by, reason, obstacle, .. } = *objection;
        let by = by as usize;
        let from = self.me as usize;
        let reached = self.position.base;
        self.send_settle(&leading, false);
        let veto = Veto { by, from, reason, obstacle, reached };
        self.send_outcome(leading.orderer, Some(MotionOutcome::Vetoed(veto)));
    }

    fn send_settle(&mut self, leading: &LeadMotionState<D>, goes: bool) {
        let request = leading.order.request;
        self.settle_motion(goes.then_some(request));
        for side in NeighborSide::ALL.into_iter().filter(|side| leading.has_asked[*side]) {
            self.send(side, NeighborMessage::Settle { request, goes });
        }
    }

    /// Aborts the motion that it leads, if there is one: no connector moves.
    pub(super) fn abort_led_motion(&mut self) {
        if let Some(leading) = self.leading.take() {
            self.send_settle(&leading, false);
        }
    }

    /// Sends the outcome to the agent that ordered the motion, or to this one's own ladder.
    fn send_outcome(&mut self, orderer: Option<NeighborSide>, outcome: Option<MotionOutcome<D>>) {
        match orderer {
            Some(side) => self.send(side, NeighborMessage::Done(outcome)),
            None => self.receive_outcome(outcome),
        }
    }
}
