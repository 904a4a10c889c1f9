//! The agent of one connector: its identity, its links, and its role in a cycle.

mod climb;
mod clock;
mod follow;
mod lead;

use super::control::{ExecutedMotion, LeaderOutcome};
use super::link::NeighborLink;
use super::message::{MotionProtocol, NeighborMessage, Packet};
use super::percept::{ConnectorPercept, ConnectorRole};
use super::side::{NeighborSide, PerSide};
use super::traffic::NetworkTraffic;
use crate::motion::recovery::RecoveryLimits;
use crate::world::ChainWorld;
use climb::RecoveryProgress;
use follow::SlaveMotionState;
use lead::LeadMotionState;
use sidestep_kernel::network::{
    ConversationId, DropCounts, DropReason, PacketHeader, RetryPolicy, digest_pieces, parse_packet,
};
use sidestep_kernel::{Cycle, EntityId, InputError};
use sidestep_rods::geometry::Point;
use sidestep_rods::local_solver::ConnectorReactionSolver;
use sidestep_rods::{Chain, Obstacles, ReactionRules, Rod};
use std::sync::Arc;

/// Most packets that wait for the beginning of their cycle: a neighbor is at most one cycle ahead.
const MAX_HELD_PACKETS: usize = 64;

/// The program of one connector of a chain.
///
/// Packets and ticks go in, packets come out; [`Self::control`] is there when its cycle is over. It
/// never panics on anything from the network. Results depend on nothing that it keeps from one cycle to the next, so a
/// killed agent may be started again.
#[derive(Debug, Clone)]
pub struct ConnectorAgent<const D: usize> {
    /// Number of its connector, from 0.
    me: u32,
    /// Number of connectors of its chain.
    n: u32,
    /// Id of connector 0 on the network; those of the others follow in order.
    first_id: EntityId,
    /// Digest of scenario and build.
    fingerprint: u64,
    /// Digest of the ids of its chain's connectors.
    members: u64,
    radio: Option<RadioTimeouts>,
    rungs: RecoveryLimits,
    /// The rods to its neighbors.
    rods: PerSide<Option<Rod>>,
    /// Receivers of the packets to each neighbor; made once, because packets share their list of receivers.
    receivers: PerSide<Option<Arc<[EntityId]>>>,
    solver: ConnectorReactionSolver<D>,
    /// Obstacles that its sensors see in this cycle.
    obstacles: Obstacles<D>,
    /// The cycle; none before the first.
    cycle: Option<Cycle>,
    began: u64,
    now: u64,
    position: TentativePosition<D>,
    beside: PerSide<Option<TentativePosition<D>>>,
    links: PerSide<Option<NeighborLink<NeighborMessage<D>>>>,
    missing: PerSide<Option<u32>>,
    /// Packets of a cycle that has not begun here yet.
    early_packets: Vec<(NeighborSide, Cycle, Packet<D>)>,
    following: Option<SlaveMotionState>,
    leading: Option<LeadMotionState<D>>,
    climbing: Option<RecoveryProgress<D>>,
    /// Number of the motion that it makes in this cycle.
    goes_in: Option<u32>,
    led: Option<ExecutedMotion>,
    ended: Option<LeaderOutcome<D>>,
    is_silent: bool,
    /// Whether the leader has finished.
    is_over: bool,
    /// Whether the deadline has passed.
    is_closed: bool,
    is_late: bool,
    traffic: NetworkTraffic,
    /// Packets that it has dropped since it was started.
    dropped: DropCounts,
}

/// Returns the receivers of packets to the neighbors of connector `k` of a chain of `n`.
fn neighbor_receivers(first_id: EntityId, k: u32, n: u32) -> PerSide<Option<Arc<[EntityId]>>> {
    PerSide::from_fn(|side| {
        let neighbor = side.neighbor(k, n)?;
        Some(Arc::from([first_id + neighbor]))
    })
}

/// The times for which it waits for others, where messages may get lost.
#[derive(Debug, Clone, Copy)]
struct RadioTimeouts {
    retry: RetryPolicy,
    /// Number of ticks after which the negotiation of a cycle ends.
    ticks: u64,
}

/// A position while a motion is prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TentativePosition<const D: usize> {
    /// The position before the motion.
    settled: Point<D>,
    /// The position after the accepted sub-steps.
    base: Point<D>,
    /// The position after the present sub-step.
    now: Point<D>,
}

impl<const D: usize> TentativePosition<D> {
    fn new(position: Point<D>) -> Self {
        Self { settled: position, base: position, now: position }
    }

    /// Begins another motion where the last one was settled.
    fn start_motion(&mut self) {
        *self = Self::new(self.settled);
    }

    fn accept(&mut self) {
        self.base = self.now;
    }

    fn revert(&mut self) {
        self.now = self.base;
    }

    fn finish(&mut self, goes: bool) {
        *self = Self::new(if goes { self.now } else { self.settled });
    }
}

impl<const D: usize> ConnectorAgent<D> {
    /// Returns the agent of a connector in a compiled world, of which it learns only its own limits,
    /// its rods and the rules of its chain.
    ///
    /// # Panics
    /// When the world has no such connector.
    pub fn new(world: &ChainWorld<D>, chain: EntityId, connector: u32) -> Self {
        let spec = &world.chains[chain as usize];
        let mut agent = Self::from_chain(&spec.start, connector, &world.rules, world.rungs);
        agent.solver = agent.solver.with_reaction(world.reaction.clone());
        agent.first_id = world.first_connector_id(chain);
        agent.fingerprint = world.fingerprint;
        agent.members = member_ids_digest(agent.first_id, agent.n);
        agent.receivers = neighbor_receivers(agent.first_id, connector, agent.n);
        agent.radio = world.network.as_ref().map(|network| RadioTimeouts {
            retry: network.retry_policy(),
            ticks: network.conversation_ticks(),
        });
        agent
    }

    /// Returns the same agent, which talks only with agents of the same build.
    #[must_use]
    pub fn with_build(self, build: &str) -> Self {
        let fingerprint = digest_pieces([build.as_bytes(), &self.fingerprint.to_le_bytes()]);
        Self { fingerprint, ..self }
    }

    /// Returns the agent of connector `k` of a chain, on a network that loses nothing.
    pub(crate) fn from_chain(
        chain: &Chain<D>,
        k: u32,
        rules: &ReactionRules,
        rungs: RecoveryLimits,
    ) -> Self {
        let n = chain.points().len() as u32;
        let rods = PerSide::from_fn(|side| {
            let neighbor = side.neighbor(k, n)?;
            Some(chain.rod_between(k as usize, neighbor as usize))
        });
        Self {
            me: k,
            n,
            first_id: 0,
            fingerprint: 0,
            members: member_ids_digest(0, n),
            radio: None,
            rungs,
            rods,
            receivers: neighbor_receivers(0, k, n),
            solver: ConnectorReactionSolver::new(chain, k as usize, rules),
            obstacles: Obstacles::default(),
            cycle: None,
            began: 0,
            now: 0,
            position: TentativePosition::new(chain.points()[k as usize]),
            beside: PerSide::default(),
            links: PerSide::default(),
            missing: PerSide::default(),
            early_packets: Vec::new(),
            following: None,
            leading: None,
            climbing: None,
            goes_in: None,
            led: None,
            ended: None,
            is_silent: false,
            is_over: false,
            is_closed: false,
            is_late: false,
            traffic: NetworkTraffic::default(),
            dropped: DropCounts::default(),
        }
    }

    /// Returns the same agent on a network that may lose messages.
    #[cfg(test)]
    pub(crate) fn with_network(self, network: Option<&sidestep_kernel::network::Network>) -> Self {
        let radio = network.map(|network| RadioTimeouts {
            retry: network.retry_policy(),
            ticks: network.conversation_ticks(),
        });
        Self { radio, ..self }
    }

    /// Returns the name of its role in the present cycle, for display.
    pub fn role_name(&self) -> &'static str {
        if self.is_done() {
            "done"
        } else if self.climbing.is_some() || self.leading.is_some() {
            "lead"
        } else if self.following.is_some() {
            "follow"
        } else {
            "wait"
        }
    }

    /// Begins a cycle whose negotiation starts in a tick. Packets are accepted after it.
    ///
    /// # Errors
    /// When a number of the percept is invalid; then the agent is as before.
    pub fn start(&mut self, percept: ConnectorPercept<D>, tick: u64) -> Result<(), InputError> {
        self.obstacles.replace_moving(&percept.validated_obstacles(self.me, self.n)?)?;
        self.solver.set_max_bend_rad(percept.max_bend_rad)?;
        self.cycle = Some(percept.cycle);
        self.began = tick;
        self.now = tick;
        self.position = TentativePosition::new(percept.at.0);
        self.beside = PerSide::new(
            percept.neighbors.map(|place| place.map(|place| TentativePosition::new(place.0))),
        );
        // Where messages never get lost no message would report that an agent is back, so those that were lost count
        // as back.
        let is_lossy = self.radio.is_some();
        self.missing = PerSide::new(if is_lossy { percept.missing } else { [None; 2] });
        self.following = None;
        self.leading = None;
        self.climbing = None;
        self.goes_in = None;
        self.led = None;
        self.ended = None;
        self.is_silent = percept.is_silent;
        self.is_over = false;
        self.is_closed = percept.is_silent;
        self.is_late = false;
        self.traffic = NetworkTraffic::default();
        self.start_links();
        self.start_role(percept.role);
        self.receive_held(percept.cycle);
        Ok(())
    }

    fn start_links(&mut self) {
        let me = self.me;
        let n = self.n;
        let missing = self.missing;
        let retry = self.radio.map(|radio| radio.retry);
        self.links = PerSide::from_fn(|side| {
            let neighbor = side.neighbor(me, n)?;
            let mut link = NeighborLink::new(retry, missing[side] == Some(neighbor));
            // Where messages get lost, neighbors find out in every cycle whether they are in touch.
            if retry.is_some() {
                link.push(NeighborMessage::Here);
            }
            Some(link)
        });
    }

    /// A leader that knows of a lost connector, or whose own radio is dead, does not begin.
    fn start_role(&mut self, role: ConnectorRole<D>) {
        let missing = self.nearest_missing().or(self.is_silent.then_some(self.me));
        match (role, missing) {
            (ConnectorRole::Follows, _) => return,
            (ConnectorRole::Rests, _) => self.ended = Some(LeaderOutcome::Rested),
            (ConnectorRole::Leads(_), Some(missing)) => {
                self.ended = Some(LeaderOutcome::Stands { missing })
            }
            (ConnectorRole::Leads(intention), None) => {
                self.climbing = Some(RecoveryProgress::new(intention, self.position.base));
                return self.advance_until_waiting();
            }
        }
        self.finish(None);
    }

    /// Accepts the packets that arrived before the cycle had begun here.
    fn receive_held(&mut self, cycle: Cycle) {
        let early_packets = std::mem::take(&mut self.early_packets);
        for (side, its, packet) in early_packets {
            match its.checked_sub(cycle) {
                Some(0) => self.accept_packet(side, packet),
                Some(1) => self.early_packets.push((side, its, packet)),
                _ => {}
            }
        }
    }

    fn receive(&mut self, from: EntityId, bytes: &[u8]) -> Result<(), DropReason> {
        let (header, message) = parse_packet::<MotionProtocol>(bytes, self.fingerprint)?;
        let PacketHeader { conversation: ConversationId { cycle, members, .. }, sender, .. } =
            header;
        let mut sides = NeighborSide::ALL.into_iter();
        let side = sides.find(|side| self.neighbor_id(*side) == Some(from));
        let side = side.filter(|_| sender == from).ok_or(DropReason::Sender)?;
        if members != self.members {
            return Err(DropReason::OtherGroup);
        }
        let packet = Packet::decode(message, self.n)?;
        // Of later cycles only the next one may have begun elsewhere.
        match self.cycle.map(|now| cycle.checked_sub(now)) {
            Some(Some(0)) => self.accept_packet(side, packet),
            Some(None) => return Err(DropReason::Stale),
            None | Some(Some(1)) if self.early_packets.len() < MAX_HELD_PACKETS => {
                self.early_packets.push((side, cycle, packet));
            }
            _ => return Err(DropReason::NoRoom),
        }
        Ok(())
    }

    /// Returns the id on the network of the neighbor on a side, if there is one.
    fn neighbor_id(&self, side: NeighborSide) -> Option<EntityId> {
        let neighbor = side.neighbor(self.me, self.n)?;
        Some(self.first_id + neighbor)
    }

    /// Returns the counts of packets that it has dropped since it was started.
    pub fn drop_counts(&self) -> DropCounts {
        self.dropped
    }

    fn accept_packet(&mut self, side: NeighborSide, packet: Packet<D>) {
        if self.is_silent {
            return;
        }
        let Some(link) = &mut self.links[side] else { return };
        let messages = link.receive(packet.parcel);
        let beyond = packet.missing.filter(|k| side.is_toward(*k, self.me));
        self.mark_missing(side, beyond);
        for message in messages {
            self.on_message(side, message);
        }
        self.advance_until_waiting();
    }

    fn on_message(&mut self, from: NeighborSide, message: NeighborMessage<D>) {
        if self.is_over || self.is_closed {
            return;
        }
        match message {
            NeighborMessage::Here => {}
            NeighborMessage::Prepare(prepare) => self.on_prepare(from, &prepare),
            NeighborMessage::Consent(consent) => self.on_consent(from, &consent),
            NeighborMessage::Object(objection) => self.on_veto(from, objection),
            NeighborMessage::Settle { request, goes } => self.on_settle(from, request, goes),
            NeighborMessage::Over => self.finish(Some(from)),
            NeighborMessage::AskEnd | NeighborMessage::Order(_) => self.on_order(from, message),
            NeighborMessage::End(..) | NeighborMessage::Done(_) => self.on_answer(from, message),
        }
    }

    /// Records the lost connector on one side, and sends it to the other side if it has changed. A leader stops.
    fn mark_missing(&mut self, side: NeighborSide, missing: Option<u32>) {
        if self.missing[side] == missing {
            return;
        }
        self.missing[side] = missing;
        self.send(side.other(), NeighborMessage::Here);
        if let Some(missing) = missing {
            self.abort_led_motion();
            if self.climbing.take().is_some() {
                self.ended = Some(LeaderOutcome::Stands { missing });
                self.finish(None);
            }
        }
    }

    fn nearest_missing(&self) -> Option<u32> {
        let both = NeighborSide::ALL.into_iter().filter_map(|side| self.missing[side]);
        both.min_by_key(|k| k.abs_diff(self.me))
    }

    /// Sends a message to a neighbor, if there is one.
    fn send(&mut self, to: NeighborSide, message: NeighborMessage<D>) {
        if let Some(link) = &mut self.links[to] {
            link.push(message);
        }
    }

    /// Ends the cycle, as the leader decides or as a message from the leader says.
    fn finish(&mut self, from: Option<NeighborSide>) {
        self.abort_led_motion();
        self.is_over = true;
        for side in NeighborSide::ALL.into_iter().filter(|side| Some(*side) != from) {
            self.send(side, NeighborMessage::Over);
        }
    }

    /// Advances as far as possible before the next message.
    fn advance_until_waiting(&mut self) {
        while self.advance_leading() || self.continue_recovery() {}
    }
}

/// Returns the digest of the ids of a chain's connectors.
fn member_ids_digest(first_id: EntityId, n: u32) -> u64 {
    let ids: Vec<EntityId> = (first_id..first_id + n).collect();
    ConversationId::new(0, MotionProtocol, &ids).members
}
