//! The agent of one connector: its identity, its links, and the part it plays in a cycle.

mod climb;
mod clock;
mod follow;
mod lead;

use super::control::{ExecutedMotion, LeaderOutcome};
use super::link::Link;
use super::message::{Message, MotionProtocol, Packet};
use super::percept::{ConnectorPercept, Role};
use super::side::{PerSide, Side};
use super::traffic::Traffic;
use crate::motion::recovery::RecoveryLimits;
use crate::world::ChainWorld;
use climb::RecoveryProgress;
use follow::SlaveMotion;
use lead::LeadState;
use sidestep_kernel::network::{
    ConversationId, DropCounts, DropReason, PacketHeader, RetryPolicy, digest, parse_packet,
};
use sidestep_kernel::{Cycle, EntityId, InputError};
use sidestep_rods::geometry::Point;
use sidestep_rods::local_solver::LocalSolver;
use sidestep_rods::{Chain, Obstacles, Rod, Rules};

/// Most packets that wait for the beginning of their cycle.
const MAX_HELD_PACKETS: usize = 64;

/// The program aboard one connector of a chain.
///
/// Packets and ticks go in, packets come out; [`Self::control`] is there when its cycle is over. It
/// never panics on anything from the network. It keeps nothing from one cycle to the next that a result
/// depends on, so a killed agent may be started anew.
#[derive(Debug, Clone)]
pub struct ConnectorAgent<const D: usize> {
    /// Number of its connector in its chain of `n`, and the id of connector 0 on the network.
    me: u32,
    n: u32,
    first_id: EntityId,
    /// Digests of scenario and build, and of the ids of its chain's connectors.
    fingerprint: u64,
    members: u64,
    radio: Option<RadioTimeouts>,
    rungs: RecoveryLimits,
    /// The rods to its neighbors.
    rods: PerSide<Option<Rod>>,
    alone: LocalSolver<D>,
    /// Obstacles that its sensors see in this cycle.
    obstacles: Obstacles<D>,
    /// The cycle; none before the first.
    cycle: Option<Cycle>,
    began: u64,
    now: u64,
    place: TentativePosition<D>,
    beside: PerSide<Option<TentativePosition<D>>>,
    links: PerSide<Option<Link<Message<D>>>>,
    missing: PerSide<Option<u32>>,
    /// Packets of a cycle that has not begun here yet.
    held: Vec<(Side, Cycle, Packet<D>)>,
    following: Option<SlaveMotion>,
    leading: Option<LeadState<D>>,
    climbing: Option<RecoveryProgress<D>>,
    /// Number of the motion that it makes in this cycle.
    goes_in: Option<u32>,
    led: Option<ExecutedMotion>,
    ended: Option<LeaderOutcome<D>>,
    is_silent: bool,
    /// Whether the leader has finished, and whether time is up.
    is_over: bool,
    is_closed: bool,
    is_late: bool,
    traffic: Traffic,
    /// Packets that it has dropped since it was started.
    refused: DropCounts,
}

/// The time for which it waits for others, where messages may get lost.
#[derive(Debug, Clone, Copy)]
struct RadioTimeouts {
    patience: RetryPolicy,
    /// Number of ticks after which the talk of a cycle ends.
    ticks: u64,
}

/// A place while a motion is prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TentativePosition<const D: usize> {
    /// The place outside of motions,
    settled: Point<D>,
    /// after the sub-steps that are accepted,
    base: Point<D>,
    /// and after the present one.
    now: Point<D>,
}

impl<const D: usize> TentativePosition<D> {
    fn new(place: Point<D>) -> Self {
        Self { settled: place, base: place, now: place }
    }

    /// Begins another motion.
    fn start(&mut self) {
        *self = Self::new(self.settled);
    }

    /// Accepts the present sub-step.
    fn accept(&mut self) {
        self.base = self.now;
    }

    /// Takes the present sub-step back.
    fn revert(&mut self) {
        self.now = self.base;
    }

    /// Ends the motion.
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
        agent.first_id = world.first_id(chain);
        agent.fingerprint = world.fingerprint;
        agent.members = member_digest(agent.first_id, agent.n);
        agent.radio = world.network.as_ref().map(|network| RadioTimeouts {
            patience: network.retry_policy(),
            ticks: network.deadline_ticks(),
        });
        agent
    }

    /// Returns the same agent, which talks only with agents of the same build.
    #[must_use]
    pub fn with_build(self, build: &str) -> Self {
        let fingerprint = digest([build.as_bytes(), &self.fingerprint.to_le_bytes()]);
        Self { fingerprint, ..self }
    }

    /// Returns the agent of connector `k` of a chain, on a network that loses nothing.
    pub(crate) fn from_chain(
        chain: &Chain<D>,
        k: u32,
        rules: &Rules,
        rungs: RecoveryLimits,
    ) -> Self {
        let n = chain.points().len() as u32;
        let rod =
            |side: Side| side.neighbor(k, n).map(|j| chain.rod_between(k as usize, j as usize));
        Self {
            me: k,
            n,
            first_id: 0,
            fingerprint: 0,
            members: member_digest(0, n),
            radio: None,
            rungs,
            rods: PerSide::from_fn(rod),
            alone: LocalSolver::new(chain, k as usize, rules),
            obstacles: Obstacles::default(),
            cycle: None,
            began: 0,
            now: 0,
            place: TentativePosition::new(chain.points()[k as usize]),
            beside: PerSide::default(),
            links: PerSide::default(),
            missing: PerSide::default(),
            held: Vec::new(),
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
            traffic: Traffic::default(),
            refused: DropCounts::default(),
        }
    }

    /// Returns the same agent on a network that may lose messages.
    #[cfg(test)]
    pub(crate) fn with_network(self, network: Option<&sidestep_kernel::network::Network>) -> Self {
        let radio = network.map(|network| RadioTimeouts {
            patience: network.retry_policy(),
            ticks: network.deadline_ticks(),
        });
        Self { radio, ..self }
    }

    /// Returns a word for its part in the present cycle, for people.
    pub fn role_name(&self) -> &'static str {
        match () {
            () if self.is_done() => "done",
            () if self.climbing.is_some() || self.leading.is_some() => "lead",
            () if self.following.is_some() => "follow",
            () => "wait",
        }
    }

    /// Begins a cycle, whose talk starts in a tick. Packets are to be taken after it.
    ///
    /// # Errors
    /// When a number of the sight makes no sense; then the agent is as before.
    pub fn start(&mut self, sight: ConnectorPercept<D>, tick: u64) -> Result<(), InputError> {
        self.obstacles.set_moving(&sight.validated_obstacles(self.me, self.n)?)?;
        self.alone.set_max_bend_rad(sight.max_bend_rad)?;
        (self.cycle, self.began, self.now) = (Some(sight.cycle), tick, tick);
        self.place = TentativePosition::new(sight.at.0);
        let [below, above] = sight.neighbors;
        let track = |side| if side == Side::Below { below } else { above };
        self.beside =
            PerSide::from_fn(|side| track(side).map(|place| TentativePosition::new(place.0)));
        // Where messages never get lost no agent finds out that another is back: those that were gone are
        // there again.
        let [below, above] = self.radio.map_or([None; 2], |_| sight.missing);
        self.missing = PerSide::from_fn(|side| if side == Side::Below { below } else { above });
        (self.following, self.leading, self.climbing) = (None, None, None);
        (self.goes_in, self.led, self.ended) = (None, None, None);
        self.is_silent = sight.is_silent;
        (self.is_over, self.is_closed, self.is_late) = (false, sight.is_silent, false);
        self.traffic = Traffic::default();
        self.start_links();
        self.start_role(sight.role);
        self.receive_held(sight.cycle);
        Ok(())
    }

    fn start_links(&mut self) {
        let (me, n, missing) = (self.me, self.n, self.missing);
        let patience = self.radio.map(|radio| radio.patience);
        self.links = PerSide::from_fn(|side| {
            let neighbor = side.neighbor(me, n)?;
            let mut link = Link::new(patience, missing[side] == Some(neighbor));
            // Where messages get lost, neighbors find out in every cycle whether they are in touch.
            if patience.is_some() {
                link.push(Message::Here);
            }
            Some(link)
        });
    }

    /// Takes up its part in this cycle.
    fn start_role(&mut self, role: Role<D>) {
        let missing = self.nearest_missing().or(self.is_silent.then_some(self.me));
        match (role, missing) {
            (Role::Follows, _) => return,
            (Role::Rests, _) => self.ended = Some(LeaderOutcome::Rested),
            (Role::Leads(_), Some(missing)) => self.ended = Some(LeaderOutcome::Stands { missing }),
            (Role::Leads(wish), None) => {
                self.climbing = Some(RecoveryProgress::new(wish, self.place.base));
                return self.process();
            }
        }
        self.finish(None);
    }

    /// Takes the packets that came before the cycle had begun here.
    fn receive_held(&mut self, cycle: Cycle) {
        let held = std::mem::take(&mut self.held);
        for (side, its, packet) in held {
            match its.checked_sub(cycle) {
                Some(0) => self.accept_packet(side, packet),
                Some(1) => self.held.push((side, its, packet)),
                _ => {}
            }
        }
    }

    fn receive(&mut self, from: EntityId, bytes: &[u8]) -> Result<(), DropReason> {
        let (seal, message) = parse_packet::<MotionProtocol>(bytes, self.fingerprint)?;
        let PacketHeader { conversation: ConversationId { cycle, members, .. }, sender, .. } = seal;
        let neighbor = |side: &Side| side.neighbor(self.me, self.n).map(|k| self.first_id + k);
        let side = Side::ALL.into_iter().find(|side| neighbor(side) == Some(from));
        let side = side.filter(|_| sender == from).ok_or(DropReason::Sender)?;
        if members != self.members {
            return Err(DropReason::OtherGroup);
        }
        let packet = Packet::decode(message, self.n)?;
        // Of later cycles only the next one may have begun elsewhere.
        match self.cycle.map(|now| cycle.checked_sub(now)) {
            Some(Some(0)) => self.accept_packet(side, packet),
            Some(None) => return Err(DropReason::Stale),
            None | Some(Some(1)) if self.held.len() < MAX_HELD_PACKETS => {
                self.held.push((side, cycle, packet));
            }
            _ => return Err(DropReason::NoRoom),
        }
        Ok(())
    }

    /// Returns the counts of packets that it has dropped since it was started.
    pub fn drop_counts(&self) -> DropCounts {
        self.refused
    }

    fn accept_packet(&mut self, side: Side, packet: Packet<D>) {
        if self.is_silent {
            return;
        }
        let Some(link) = &mut self.links[side] else { return };
        let messages = link.receive(packet.parcel);
        let beyond = packet.missing.filter(|k| side.has(*k, self.me));
        self.mark_missing(side, beyond);
        for message in messages {
            self.on_message(side, message);
        }
        self.process();
    }

    fn on_message(&mut self, from: Side, message: Message<D>) {
        if self.is_over || self.is_closed {
            return;
        }
        match message {
            Message::Here => {}
            Message::Prepare(prepare) => self.on_prepare(from, &prepare),
            Message::Consent(consent) => self.on_consent(from, &consent),
            Message::Object(objection) => self.on_veto(from, objection),
            Message::Settle { request, goes } => self.on_settle(from, request, goes),
            Message::Over => self.finish(Some(from)),
            Message::AskEnd | Message::Order(_) => self.on_order(from, message),
            Message::End(..) | Message::Done(_) => self.on_answer(from, message),
        }
    }

    /// Notes the lost connector on one side, and tells the other side if that is news. A leader stops.
    fn mark_missing(&mut self, side: Side, missing: Option<u32>) {
        if self.missing[side] == missing {
            return;
        }
        self.missing[side] = missing;
        self.send(side.other(), Message::Here);
        if let Some(missing) = missing {
            self.give_up_leading();
            if self.climbing.take().is_some() {
                self.ended = Some(LeaderOutcome::Stands { missing });
                self.finish(None);
            }
        }
    }

    fn nearest_missing(&self) -> Option<u32> {
        let both = Side::ALL.into_iter().filter_map(|side| self.missing[side]);
        both.min_by_key(|k| k.abs_diff(self.me))
    }

    /// Says something to a neighbor, if there is one.
    fn send(&mut self, to: Side, message: Message<D>) {
        if let Some(link) = &mut self.links[to] {
            link.push(message);
        }
    }

    /// Ends the cycle, as the leader does or says.
    fn finish(&mut self, from: Option<Side>) {
        self.give_up_leading();
        self.is_over = true;
        for side in Side::ALL.into_iter().filter(|side| Some(*side) != from) {
            self.send(side, Message::Over);
        }
    }

    /// Does all that is possible before the next message.
    fn process(&mut self) {
        while self.advance_leading() || self.continue_climb() {}
    }
}

/// Returns the digest of the ids of a chain's connectors.
fn member_digest(first_id: EntityId, n: u32) -> u64 {
    let ids: Vec<EntityId> = (first_id..first_id + n).collect();
    ConversationId::new(0, MotionProtocol, &ids).members
}
