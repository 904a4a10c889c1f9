//! The timers of an agent, its outgoing packets, and the end of its cycle.

use super::ConnectorAgent;
use crate::agents::control::{ConnectorControl, ConnectorMove};
use crate::agents::link::NeighborLink;
use crate::agents::message::{MotionProtocol, Packet};
use crate::agents::side::NeighborSide;
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{
    ConversationId, DropReason, NetworkAgent, OutgoingPacket, PacketHeader,
};
use std::sync::Arc;

impl<const D: usize> NetworkAgent for ConnectorAgent<D> {
    fn id(&self) -> EntityId {
        self.first_id + self.me
    }

    /// Receives a packet. One that is not from a neighbor, cannot be read or is invalid is counted
    /// and dropped.
    fn on_packet(&mut self, from: EntityId, bytes: &[u8], tick: u64) {
        self.now = self.now.max(tick);
        let Err(why) = self.receive(from, bytes) else { return };
        self.dropped.record(why);
        // A packet that comes too late is of no use, and no sender's fault.
        self.traffic.dropped += u64::from(why != DropReason::Stale);
    }

    /// Sends unconfirmed messages again, and gives up a neighbor that never confirms.
    fn on_timer(&mut self, tick: u64) {
        self.now = self.now.max(tick);
        for side in NeighborSide::ALL {
            let link = self.links[side].as_mut().filter(|_| !self.is_silent);
            if link.is_some_and(|link| link.on_timer(tick)) {
                self.mark_missing(side, side.neighbor(self.me, self.n));
            }
        }
        if !self.is_done() && self.deadline().is_some_and(|deadline| deadline <= tick) {
            self.end_cycle();
        }
        self.advance_until_waiting();
    }

    fn next_timer(&self) -> Option<u64> {
        if self.is_done() {
            return None;
        }
        let links = NeighborSide::ALL.into_iter().filter_map(|side| self.links[side].as_ref());
        links.filter_map(NeighborLink::next_retry).chain(self.deadline()).min()
    }

    fn take_packets(&mut self) -> Vec<OutgoingPacket> {
        let Some(cycle) = self.cycle else { return Vec::new() };
        if self.is_silent {
            return Vec::new();
        }
        let mut out = Vec::new();
        for side in NeighborSide::ALL {
            let Some(receivers) = &self.receivers[side] else { continue };
            let missing = self.missing[side.other()];
            let Some(parcel) =
                self.links[side].as_mut().and_then(|link| link.next_message_batch(self.now))
            else {
                continue;
            };
            let sequence = self.traffic.messages as u32;
            let conversation =
                ConversationId { cycle, topic: MotionProtocol, members: self.members };
            let header = PacketHeader {
                fingerprint: self.fingerprint,
                conversation,
                sender: self.id(),
                sequence,
            };
            let payload = Packet { missing, parcel }.encode().into_packet(&header);
            self.traffic.count_message(payload.len());
            if let Some(link) = &mut self.links[side] {
                link.record_packet(payload.len());
            }
            out.push(OutgoingPacket { to: Arc::clone(receivers), sequence, payload });
        }
        out
    }
}

impl<const D: usize> ConnectorAgent<D> {
    /// Ends the cycle because time is up. A neighbor that has not been heard at all is lost.
    fn end_cycle(&mut self) {
        for side in NeighborSide::ALL {
            if self.links[side].as_ref().is_some_and(|link| !link.has_heard_neighbor()) {
                self.mark_missing(side, side.neighbor(self.me, self.n));
            }
        }
        self.abort_led_motion();
        self.climbing = None;
        self.is_late = !self.is_over && self.nearest_missing().is_none();
        self.is_closed = true;
    }

    /// Returns the tick in which its cycle ends in any case; none where messages never get lost.
    pub fn deadline(&self) -> Option<u64> {
        self.radio.map(|radio| self.began.saturating_add(radio.ticks))
    }

    /// Returns whether its cycle is over. It still answers questions of its neighbors.
    pub fn is_done(&self) -> bool {
        let mut links = NeighborSide::ALL.into_iter().filter_map(|side| self.links[side].as_ref());
        self.is_closed || self.is_over && links.all(NeighborLink::is_quiet)
    }

    /// Returns its connector's motion in this cycle; none before the cycle is over.
    pub fn control(&self) -> Option<ConnectorControl<D>> {
        let cycle = self.cycle.filter(|_| self.is_done())?;
        let doubt = self.following.as_ref().filter(|following| following.has_consented);
        let goes = match (self.goes_in, doubt) {
            (Some(request), _) => ConnectorMove::To { request, to: self.position.settled },
            (None, Some(following)) => {
                ConnectorMove::WithItsMaster { request: following.request, to: self.position.now }
            }
            (None, None) => ConnectorMove::Stays,
        };
        Some(ConnectorControl {
            connector: self.me,
            cycle,
            goes,
            led: self.led,
            ended: self.ended.clone(),
            missing: NeighborSide::ALL.map(|side| self.missing[side]),
            is_late: self.is_late,
            traffic: self.traffic,
        })
    }
}
