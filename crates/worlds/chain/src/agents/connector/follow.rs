//! A connector as a slave: it reacts to its master, and is the master of the next one.

use super::ConnectorAgent;
use crate::agents::message::{ConsentMessage, NeighborMessage, PrepareMessage, VetoMessage};
use crate::agents::side::NeighborSide;
use sidestep_rods::geometry::distance;
use sidestep_rods::local_solver::{
    ConnectorReactionSolver, MasterMotion, SlavePosition, SlaveReaction,
};
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{IncompleteVeto, Rod, VetoReason};

/// What a connector remembers of a motion, from its master's question to the decision.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SlaveMotionState {
    /// Number of the motion in its cycle.
    pub(super) request: u32,
    sub_step: u32,
    master: NeighborSide,
    /// Whether it has asked the connector beyond it.
    has_asked: bool,
    /// Whether it waits for the answer.
    waits: bool,
    /// Whether it has consented to the present sub-step.
    pub(super) has_consented: bool,
    rotated: bool,
    has_others: bool,
    has_turned: bool,
}

impl<const D: usize> ConnectorAgent<D> {
    /// Answers a master, or asks the next connector first.
    pub(super) fn on_prepare(&mut self, from: NeighborSide, prepare: &PrepareMessage<D>) {
        let Some(rod) = self.rods[from].filter(|_| self.leading.is_none()) else { return };
        let before = self.following.take().filter(|f| f.request == prepare.request);
        if before.is_none() {
            self.start_motion();
        }
        if before.as_ref().is_none_or(|f| f.sub_step != prepare.sub_step) {
            self.accept_sub_step();
        }
        if let Some(master) = &mut self.beside[from] {
            master.base = prepare.mo;
            master.now = prepare.mn;
        }
        match self.reaction(from, rod, prepare) {
            Ok(reaction) => {
                self.follow(from, prepare, &reaction, before.is_some_and(|f| f.has_asked));
            }
            Err(refusal) => {
                self.position.revert();
                self.following = before.map(|f| SlaveMotionState { has_consented: false, ..f });
                self.send_veto(from, refusal, ConnectorReactionSolver::<D>::has_more_places(rod));
            }
        }
    }

    /// Moves as its reaction says, and asks the next connector if that one has to react. It may have asked that one in
    /// an earlier sub-step.
    fn follow(
        &mut self,
        from: NeighborSide,
        prepare: &PrepareMessage<D>,
        reaction: &SlaveReaction<D>,
        had_asked: bool,
    ) {
        let SlaveReaction { at, ends, rotated, has_others, has_turned } = *reaction;
        self.position.now = at;
        let onward = from.other();
        let asks = !ends && self.rods[onward].is_some();
        self.following = Some(SlaveMotionState {
            request: prepare.request,
            sub_step: prepare.sub_step,
            master: from,
            has_asked: had_asked || asks,
            waits: asks,
            has_consented: !asks,
            rotated,
            has_others,
            has_turned,
        });
        if asks {
            let next = PrepareMessage {
                mo: self.position.base,
                mn: at,
                prev: Some(WirePoint(prepare.mn)),
                max_bend_rad: self.solver.max_bend_rad(),
                ..*prepare
            };
            self.send(onward, NeighborMessage::Prepare(next));
        } else {
            let no_slaves =
                ConsentMessage { at, touched: 0, changed: 0, rotated: 0, longest_m: 0.0 };
            let consent = if ends { no_slaves } else { self.merged_consent(&no_slaves, rotated) };
            self.send(from, NeighborMessage::Consent(consent));
        }
    }

    fn reaction(
        &mut self,
        from: NeighborSide,
        rod: Rod,
        prepare: &PrepareMessage<D>,
    ) -> Result<SlaveReaction<D>, IncompleteVeto> {
        let onward = from.other();
        let next = self.beside[onward].map(|track| track.base).zip(self.rods[onward]);
        let slave = SlavePosition { so: self.position.base, rod, next };
        let pull = MasterMotion {
            mo: prepare.mo,
            mn: prepare.mn,
            prev: prepare.prev.map(|place| place.0),
            max_bend_rad: prepare.max_bend_rad,
            is_open: prepare.is_open,
            all_lengths: prepare.all_lengths,
        };
        self.solver.react(&slave, &self.obstacles, &pull)
    }

    fn send_veto(&mut self, to: NeighborSide, refusal: IncompleteVeto, may_go_elsewhere: bool) {
        let IncompleteVeto { reason, obstacle } = refusal;
        let by = self.me;
        let objection = VetoMessage { by, reason, obstacle, has_turned: false, may_go_elsewhere };
        self.send(to, NeighborMessage::Object(objection));
    }

    /// Adds this connector's part to the sums of a consent.
    fn merged_consent(&self, beyond: &ConsentMessage<D>, rotated: bool) -> ConsentMessage<D> {
        let displacement_m = distance(self.position.base, self.position.now);
        ConsentMessage {
            at: self.position.now,
            touched: beyond.touched + 1,
            changed: beyond.changed + u32::from(self.position.base != self.position.now),
            rotated: beyond.rotated + u32::from(rotated),
            longest_m: beyond.longest_m.max(displacement_m),
        }
    }

    /// Passes a consent on to its master, or to the motion that it leads.
    pub(super) fn on_consent(&mut self, from: NeighborSide, consent: &ConsentMessage<D>) {
        let waiting = self.following.as_mut().filter(|f| f.waits && f.master == from.other());
        if let Some(following) = waiting {
            following.waits = false;
            following.has_consented = true;
            let SlaveMotionState { master, rotated, .. } = *following;
            self.record_neighbor(from, consent);
            let joined = self.merged_consent(consent, rotated);
            self.send(master, NeighborMessage::Consent(joined));
        } else if self.receive_consent(from, consent) {
            self.record_neighbor(from, consent);
        }
    }

    fn record_neighbor(&mut self, side: NeighborSide, consent: &ConsentMessage<D>) {
        if let Some(beside) = &mut self.beside[side] {
            beside.now = consent.at;
        }
    }

    /// Passes a veto on to its master, or to the motion that it leads. Where this connector had alternatives, the
    /// reason is that the search for one has reached its limit.
    pub(super) fn on_veto(&mut self, from: NeighborSide, objection: VetoMessage) {
        let waiting = self.following.as_mut().filter(|f| f.waits && f.master == from.other());
        let Some(following) = waiting else { return self.receive_veto(from, &objection) };
        following.waits = false;
        let SlaveMotionState { master, has_others, has_turned, .. } = *following;
        self.position.revert();
        if let Some(beside) = &mut self.beside[from] {
            beside.revert();
        }
        let may_go_elsewhere =
            self.rods[master].is_some_and(ConnectorReactionSolver::<D>::has_more_places);
        let reason = if has_others { VetoReason::Limit } else { objection.reason };
        let objection = VetoMessage {
            reason,
            has_turned: objection.has_turned || has_turned,
            may_go_elsewhere: objection.may_go_elsewhere || may_go_elsewhere,
            ..objection
        };
        self.send(master, NeighborMessage::Object(objection));
    }

    /// Carries out the motion, or returns to where it was before it, and passes that on.
    pub(super) fn on_settle(&mut self, from: NeighborSide, request: u32, goes: bool) {
        // One that has not consented was not part of a motion that is carried out.
        let its = self.following.take_if(|motion| {
            let is_same = motion.request == request && motion.master == from;
            is_same && (motion.has_consented || !goes)
        });
        let Some(following) = its else { return };
        self.settle_motion(goes.then_some(request));
        if following.has_asked {
            self.send(from.other(), NeighborMessage::Settle { request, goes });
        }
    }

    /// Begins another motion from the settled positions.
    pub(super) fn start_motion(&mut self) {
        self.position.start_motion();
        self.beside.for_each(|_, beside| beside.iter_mut().for_each(|track| track.start_motion()));
    }

    pub(super) fn accept_sub_step(&mut self) {
        self.position.accept();
        self.beside.for_each(|_, beside| beside.iter_mut().for_each(|track| track.accept()));
    }

    /// Ends a motion, which is carried out if it has a number here.
    pub(super) fn settle_motion(&mut self, request: Option<u32>) {
        let goes = request.is_some();
        self.position.finish(goes);
        self.beside.for_each(|_, beside| beside.iter_mut().for_each(|track| track.finish(goes)));
        self.goes_in = request.or(self.goes_in);
    }
}
