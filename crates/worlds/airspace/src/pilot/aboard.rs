//! The pilot, as a state machine.

mod conclude;
mod turn;

use super::control::{Control, Course, Memory};
use super::early::Early;
use super::schedule::{Schedule, patience};
use super::sight::Sight;
use super::talks::{Speaker, looks, optimizes, proposes, tells};
use crate::agents::contact::Contacts;
use crate::agents::packet::{Packet, TalkId, Topic};
use crate::agents::traffic::Traffic;
use crate::agents::{Frame, Party, Progress, Radio, Talk};
use crate::avoid::Beset;
use crate::decide::{Considered, Manner};
use crate::events::{Event, EventKind};
use crate::world::{AirspaceWorld, Grouping};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{Refusal, Refused, digest, open};
use std::collections::VecDeque;
use std::sync::Arc;
use turn::{Stage, Stands, Turn};

/// Number of ended talks of which questions are answered: those of two cycles.
const PAST_TALKS: usize = 6;

/// The program aboard one airplane: see the [module](super).
pub struct Pilot {
    world: Arc<AirspaceWorld>,
    id: EntityId,
    fingerprint: u64,
    memory: Memory,
    /// The cycle that it is in, or was in last.
    turn: Option<Turn>,
    /// Talks that have ended for it.
    past: VecDeque<Talk<dyn Party>>,
    early: Early,
    out: Vec<Packet>,
    refused: Refused,
}

impl Pilot {
    /// Returns the pilot of an airplane that remembers the `contacts` of earlier cycles.
    ///
    /// # Panics
    /// When there is no such airplane in the world.
    pub fn new(world: Arc<AirspaceWorld>, id: EntityId, contacts: Contacts) -> Self {
        Self::remembering(world, id, Memory { contacts, ..Memory::default() })
    }

    /// Returns the pilot of an airplane with all that it remembers.
    ///
    /// # Panics
    /// When there is no such airplane in the world.
    pub fn remembering(world: Arc<AirspaceWorld>, id: EntityId, memory: Memory) -> Self {
        assert!((id as usize) < world.airplanes.len(), "there is no airplane {id}");
        Self {
            fingerprint: world.fingerprint,
            world,
            id,
            memory,
            turn: None,
            past: VecDeque::new(),
            early: Early::default(),
            out: Vec::new(),
            refused: Refused::default(),
        }
    }

    /// Returns the same pilot, which talks only with those of the same build.
    #[must_use]
    pub fn of_build(self, build: &str) -> Self {
        let fingerprint = digest([build.as_bytes(), &self.world.fingerprint.to_le_bytes()]);
        Self { fingerprint, ..self }
    }

    /// Its airplane.
    pub fn id(&self) -> EntityId {
        self.id
    }

    /// Starts the talks of a cycle. Unfinished talks of an earlier one are given up.
    ///
    /// # Panics
    /// When the sight is that of another airplane, or one that [`Sight::check`] refuses.
    pub fn begin(&mut self, sight: Sight, tick: u64) {
        let schedule = Schedule::from(tick, self.world.network.as_ref());
        self.begin_by(sight, schedule);
    }

    /// Starts the talks of a cycle at ticks that all agree on.
    pub(crate) fn begin_by(&mut self, sight: Sight, schedule: Schedule) {
        self.take_up(sight, schedule);
        match self.world.groups {
            Grouping::Announced => self.decide(schedule.begins),
            Grouping::Heard => self.talk(Topic::Group, schedule.begins),
        }
        self.settle(schedule.begins);
    }

    fn take_up(&mut self, sight: Sight, schedule: Schedule) {
        assert_eq!(sight.own.id, self.id, "the sight is that of another airplane");
        if let Some(turn) = self.turn.take()
            && let Stage::Grouping(talk) | Stage::Deciding(talk) | Stage::Shielding(talk, _) =
                turn.stage
        {
            self.keep_past(talk);
        }
        let control = Control::orbit(self.id, sight.cycle, Memory::default());
        self.turn = Some(Turn {
            members: sight.members().into(),
            unheard: Vec::new(),
            schedule,
            stage: Stage::Decided,
            considered: Considered::default(),
            control,
            sight,
        });
    }

    /// Takes a packet that came off the network from an airplane: any bytes. Unreadable and unsound packets are
    /// counted and dropped.
    pub fn on_packet(&mut self, from: EntityId, bytes: &[u8], tick: u64) {
        // Actions due by then are done first, because they may make it too late for the packet.
        self.settle(tick);
        if let Err(why) = self.take(from, bytes, tick) {
            self.refused.count(why);
        }
        self.settle(tick);
    }

    /// Performs the actions that are due by a tick.
    pub fn on_timer(&mut self, tick: u64) {
        self.settle(tick);
        if let Some(talk) = self.turn.as_mut().and_then(Turn::talk) {
            talk.on_timer(tick, &mut self.out);
        }
        // Others may still depend on it in a talk that has ended for it.
        for talk in self.past.iter_mut().filter(|talk| tick < talk.frame().ends) {
            talk.on_timer(tick, &mut self.out);
        }
        self.settle(tick);
    }

    /// Returns the tick in which something is due, unless a packet comes before it.
    pub fn next_timer(&self) -> Option<u64> {
        let turn = self.turn.as_ref()?;
        let present = match &turn.stage {
            Stage::Grouping(talk) | Stage::Deciding(talk) | Stage::Shielding(talk, _) => {
                let ends = talk.frame().ends;
                Some(talk.next_timer().map_or(ends, |due| due.min(ends)))
            }
            Stage::Decided => Some(turn.schedule.shield_from),
            Stage::Over => None,
        };
        let of_cycle = self.past.iter().filter(|talk| talk.frame().id.cycle == turn.sight.cycle);
        let past =
            of_cycle.filter_map(|talk| talk.next_timer().filter(|due| *due < talk.frame().ends));
        present.into_iter().chain(past).min()
    }

    /// Returns the tick in which the talks of the present cycle end at the latest.
    pub fn deadline(&self) -> u64 {
        self.turn.as_ref().map_or(u64::MAX, |turn| turn.schedule.ends)
    }

    /// Takes out the packets that wait to be sent.
    pub fn take_packets(&mut self) -> Vec<Packet> {
        std::mem::take(&mut self.out)
    }

    /// Returns the ids of the group that it talks with, its own among them, rising.
    pub fn group(&self) -> &[EntityId] {
        self.turn.as_ref().map_or(&[], |turn| &turn.members)
    }

    /// Returns its control in the present cycle, once that is decided.
    pub fn control(&self) -> Option<Control> {
        let turn = self.turn.as_ref().filter(|turn| matches!(turn.stage, Stage::Over))?;
        let mut control = turn.control.clone();
        // Questions have been answered since.
        for talk in self.past.iter().filter(|talk| talk.frame().id.cycle == control.cycle) {
            let traffic = match talk.frame().id.topic {
                Topic::Group => &mut control.grouping,
                Topic::Decision => &mut control.deciding,
                Topic::Shield => &mut control.shielding,
            };
            *traffic = Traffic { ticks: traffic.ticks, ..talk.traffic() };
        }
        Some(control)
    }

    /// Returns whether it knows its group in the present cycle.
    pub fn has_group(&self) -> bool {
        self.turn.as_ref().is_some_and(|turn| !matches!(turn.stage, Stage::Grouping(_)))
    }

    /// Returns whether it has chosen its wishes in the present cycle.
    pub fn has_decided(&self) -> bool {
        let is_open = |turn: &Turn| matches!(turn.stage, Stage::Grouping(_) | Stage::Deciding(_));
        self.turn.as_ref().is_some_and(|turn| !is_open(turn))
    }

    /// Returns whether it has come to an end in the present cycle.
    pub fn is_done(&self) -> bool {
        self.turn.as_ref().is_some_and(|turn| matches!(turn.stage, Stage::Over))
    }

    /// Returns its control in the present cycle, and the ways that it has considered; `None` before that is decided.
    pub(crate) fn into_outcome(mut self) -> Option<(Control, Considered)> {
        let control = self.control()?;
        Some((control, self.turn.take()?.considered))
    }

    /// Returns its control where its group does not come to an end in the present cycle: it stays on its orbit.
    ///
    /// # Panics
    /// When it has not begun a cycle.
    pub(crate) fn given_up(mut self) -> (Control, Considered) {
        let mut turn = self.turn.take().expect("it has begun a cycle");
        let (is_over, now) = (matches!(turn.stage, Stage::Over), turn.sight.cycle);
        turn.note_traffic(0);
        let mut control = Control { course: Course::Orbit, memory: self.memory, ..turn.control };
        if !is_over {
            control.events.push(Event::of(now, EventKind::Deadline, self.id));
        }
        (control, Considered::default())
    }

    /// Returns how far it has come in the talk that it is in, if it is in one.
    pub fn progress(&self) -> Option<Progress> {
        match &self.turn.as_ref()?.stage {
            Stage::Grouping(talk) | Stage::Deciding(talk) | Stage::Shielding(talk, _) => {
                Some(talk.progress())
            }
            Stage::Decided | Stage::Over => None,
        }
    }

    /// Returns its knowledge of others.
    pub fn contacts(&self) -> &Contacts {
        &self.memory.contacts
    }

    /// Returns the counts of packets that were dropped.
    pub fn refused(&self) -> Refused {
        self.refused
    }

    /// Reads a packet, and hands its message to the talk that it belongs to.
    fn take(&mut self, from: EntityId, bytes: &[u8], tick: u64) -> Result<(), Refusal> {
        let (seal, message) = open(bytes, self.fingerprint)?;
        let is_other = from != self.id && (from as usize) < self.world.airplanes.len();
        if seal.sender != from || !is_other {
            return Err(Refusal::Sender);
        }
        let Self { turn, past, early, out, .. } = self;
        if let Some(turn) = turn {
            if self.world.is_silent(self.id, turn.sight.cycle) {
                return Ok(());
            }
            if let Some(talk) = turn.talk()
                && talk.frame().id == seal.talk
            {
                return talk.hear(from, message, tick, out);
            }
        }
        if let Some(talk) = past.iter_mut().find(|talk| talk.frame().id == seal.talk) {
            return talk.hear(from, message, tick, out);
        }
        match turn.as_ref().map(|turn| turn.stands_at(&seal.talk)) {
            None | Some(Stands::Before) => early.keep(seal.talk, from, message),
            Some(Stands::Beside) => Err(Refusal::OtherGroup),
            Some(Stands::Beyond) => Err(Refusal::Stale),
            Some(Stands::FarBefore) => Err(Refusal::NoRoom),
        }
    }

    /// Continues as far as the talks and the time have come.
    fn settle(&mut self, tick: u64) {
        while let Some(turn) = &mut self.turn {
            match &mut turn.stage {
                Stage::Grouping(talk) | Stage::Deciding(talk) | Stage::Shielding(talk, _)
                    if talk.is_done() || tick >= talk.frame().ends =>
                {
                    let ended = talk.end();
                    // Where nothing is lost, messages take no time that counts.
                    let ticks = match self.world.network {
                        Some(_) => tick.min(talk.frame().ends).saturating_sub(talk.frame().begins),
                        None => 0,
                    };
                    turn.note_traffic(ticks);
                    self.conclude(ended, tick);
                }
                Stage::Decided if tick >= turn.schedule.shield_from => {
                    self.talk(Topic::Shield, tick);
                }
                _ => return,
            }
        }
    }

    /// Starts a talk with the others of the group.
    fn talk(&mut self, topic: Topic, tick: u64) {
        let Some(turn) = &mut self.turn else { return };
        let world = &*self.world;
        let known = turn.known_in(topic);
        let Turn { sight, schedule, members, unheard, considered, .. } = turn;
        let (begins, ends) = schedule.of(topic, tick);
        let id = match topic {
            // Its members are not known yet.
            Topic::Group => TalkId::new(sight.cycle, topic, &[]),
            Topic::Decision | Topic::Shield => TalkId::new(sight.cycle, topic, members),
        };
        let is_silent = world.is_silent(self.id, sight.cycle);
        let radio = Radio {
            me: known.binary_search(&self.id).expect("an airplane knows itself"),
            group: known,
            patience: patience(world.network.as_ref(), topic),
            // A clock that has jumped may leave no time for it.
            ticks: ends.saturating_sub(begins),
            is_silent,
        };
        let (me, members, fingerprint) = (self.id, members.clone(), self.fingerprint);
        let frame = Frame { id, members, me, fingerprint, begins, ends, is_silent };
        let Memory { contacts, resolving } = &self.memory;
        turn.stage = match topic {
            Topic::Shield => {
                let allowed = allowed(world, sight, considered);
                let ways: Vec<_> = allowed.iter().map(|&k| considered.ways[k].clone()).collect();
                let party = proposes(world, sight, unheard, contacts, &ways, radio);
                Stage::Shielding(Talk::new(frame, party), allowed)
            }
            Topic::Group => Stage::Grouping(Talk::new(frame, looks(world, sight, contacts, radio))),
            Topic::Decision if Manner::reacts(world) => {
                let party = tells(world, sight, contacts, resolving, radio);
                Stage::Deciding(Talk::new(frame, party))
            }
            Topic::Decision => {
                let party = optimizes(world, sight, unheard, contacts, radio);
                Stage::Deciding(Talk::new(frame, party))
            }
        };
        self.hear_early(id, tick);
    }

    /// Starts the talk that it is in, and hands over earlier messages of others in it.
    fn hear_early(&mut self, id: TalkId, tick: u64) {
        let Some(talk) = self.turn.as_mut().and_then(Turn::talk) else { return };
        talk.start(tick, &mut self.out);
        let (early, [stale, other_group]) = self.early.take(&id);
        (0..stale).for_each(|_| self.refused.count(Refusal::Stale));
        (0..other_group).for_each(|_| self.refused.count(Refusal::OtherGroup));
        for (from, message) in early {
            if let Err(why) = talk.hear(from, &message, tick, &mut self.out) {
                self.refused.count(why);
            }
        }
    }

    /// Keeps a talk that has ended here, to answer questions about it.
    fn keep_past(&mut self, talk: Talk<Speaker>) {
        if self.past.len() == PAST_TALKS {
            self.past.pop_front();
        }
        self.past.push_back(talk.past());
    }
}

/// Returns the places of the ways that intruders leave to an airplane, among all that it considers.
fn allowed(world: &AirspaceWorld, sight: &Sight, considered: &Considered) -> Vec<usize> {
    let flyer = sight.own.flyer(world);
    let beset = Beset::new(&flyer, &sight.intruders, world.timing.dtau_s);
    beset.allowed(&considered.ways, || sight.own.on_orbit(world))
}
