//! Airplanes: the world at the server, and a pilot at each node.

use crate::ports::{Absurd, Arrival, Channel, Doing, Outgoing, Program, Sent, Sight, Stage};
use crate::words::{Begin, Fingerprint};
use sidestep::kernel::network::Ether;
use sidestep::kernel::ports::Envelope;
use sidestep::kernel::view::{Frame, Look as View};
use sidestep::kernel::{Cycle, Digest, EntityId, InputError};
use sidestep::scenario::{Compiled, Source};
use sidestep::worlds::airspace::deploy::Deployment;
use sidestep::worlds::airspace::pilot::{Fleet, Packet, Pilot, Refusal, Sight as Percept};
use sidestep::worlds::airspace::{AirspaceRun, AirspaceWorld};
use sidestep_session::{Error, Journey, Watcher};
use std::any::Any;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Returns the fingerprint of a scenario: of its text, with all changes, and of all files that it names.
///
/// # Errors
/// When one of them cannot be read.
pub fn fingerprint(compiled: &dyn Compiled, source: &Source) -> Result<Fingerprint, InputError> {
    let resolved = compiled.resolve(source)?;
    let mut all = resolved.text.into_bytes();
    for (name, content) in resolved.files {
        all.extend(
            [name.as_bytes(), &content].map(|part| Digest::of(part).to_string()).concat().bytes(),
        );
    }
    Ok(Digest::of(&all).to_string()[..16].to_string())
}

/// Returns the world of a scenario whose airplanes can be flown by nodes.
///
/// # Errors
/// When it is another world, or one process decides for all.
pub fn world_of(
    compiled: &dyn Compiled,
    source: &Source,
) -> Result<Arc<AirspaceWorld>, InputError> {
    let airspace =
        compiled.as_any().downcast_ref::<sidestep::worlds::airspace::scenario::Compiled>();
    let Some(airspace) = airspace else {
        let cause = format!("agents of the world `{}` decide in one process", compiled.world());
        let remedy = "give a scenario with world = \"airspace\"";
        return Err(InputError::new(&source.place, cause, remedy));
    };
    let world = airspace.world.clone();
    if world.deployment == Deployment::Direct {
        let cause = "one process decides for all airplanes (deployment = \"direct\")";
        let remedy = "add --set airspace.deployment=compact-team, or another one of team, pim and \
                      hierarchical-pim";
        return Err(InputError::new(&source.place, cause, remedy));
    }
    Ok(world)
}

/// An airspace whose airplanes are flown by nodes.
pub struct Airspace<'a> {
    journey: Journey,
    watcher: &'a dyn Watcher,
    cycle_s: f64,
    is_watched: bool,
}

impl<'a> Airspace<'a> {
    /// Returns the stage of a run.
    pub fn new(journey: Journey, watcher: &'a dyn Watcher) -> Self {
        let mut stage = Self { journey, watcher, cycle_s: 0.0, is_watched: false };
        stage.cycle_s = stage.run().world().timing.dt_s;
        stage
    }

    /// Returns the run, to be finished.
    pub fn into_journey(self) -> Journey {
        self.journey
    }

    /// Returns the run, to be looked at.
    pub fn journey(&self) -> &Journey {
        &self.journey
    }

    fn run(&self) -> &AirspaceRun {
        let run: &dyn Any = self.journey.simulation();
        run.downcast_ref().expect("it is a run of an airspace")
    }
}

impl Stage for Airspace<'_> {
    fn agents(&self) -> Vec<EntityId> {
        (0..self.run().world().airplanes.len() as EntityId).collect()
    }

    fn cycle(&self) -> Cycle {
        self.journey.cycle()
    }

    fn is_over(&self) -> bool {
        let run = self.journey.simulation();
        run.is_over() || run.cycle() >= run.plan().cycles
    }

    fn cycle_s(&self) -> f64 {
        self.cycle_s
    }

    fn sights(&self) -> Vec<Sight> {
        let beyond = self.run().beyond();
        let one = |percept: Percept| {
            let agent = percept.own.id;
            let place = beyond.binary_search_by_key(&agent, |(id, _)| *id);
            let beyond = place.map(|k| beyond[k].1.clone()).unwrap_or_default();
            let sight = postcard::to_stdvec(&percept).expect("percepts are plain data");
            let begin = Begin { cycle: percept.cycle, sight, beyond };
            Sight { agent, group: percept.members(), begin }
        };
        self.run().sights().into_iter().map(one).collect()
    }

    fn advance(&mut self, controls: Vec<(EntityId, Vec<u8>)>) -> Result<Vec<Absurd>, Error> {
        let mut controls = controls;
        let mut absurd = Vec::new();
        if self.journey.simulation_mut().hand_over(&controls).is_err() {
            let refused = self.run().absurd(&controls);
            controls.retain(|(agent, _)| refused.iter().all(|(other, _)| other != agent));
            absurd = refused.into_iter().map(|(agent, reason)| Absurd { agent, reason }).collect();
            let handed = self.journey.simulation_mut().hand_over(&controls);
            handed.map_err(|e| Error::stopped(e.to_string(), "please report it: this is a bug"))?;
        }
        let next = self.journey.cycle() + 1;
        self.journey.advance_to(next, self.watcher)?;
        Ok(absurd)
    }

    fn frame(&mut self) -> Frame {
        let run = self.journey.simulation_mut();
        // Events are kept from now on: a fleet that nobody watches keeps none.
        if !std::mem::replace(&mut self.is_watched, true) {
            run.watch();
        }
        run.frame(View::BODIES)
    }
}

/// A pilot, at a node.
pub struct Aboard {
    world: Arc<AirspaceWorld>,
    pilot: Pilot,
    /// Those that it has heard in this cycle, and in the one before.
    heard: BTreeSet<EntityId>,
    heard_before: BTreeSet<EntityId>,
}

impl Aboard {
    /// Returns the pilot of an airplane, which talks with those of the same build alone.
    pub fn new(world: Arc<AirspaceWorld>, id: EntityId, build: &str) -> Self {
        let pilot = Pilot::new(world.clone(), id, Default::default()).of_build(build);
        Self { world, pilot, heard: BTreeSet::new(), heard_before: BTreeSet::new() }
    }
}

impl Program for Aboard {
    fn begin(&mut self, cycle: Cycle, sight: &[u8]) -> Result<u64, String> {
        let percept: Percept = postcard::from_bytes(sight).map_err(|e| e.to_string())?;
        if (percept.own.id, percept.cycle) != (self.pilot.id(), cycle) {
            return Err("it is of another airplane, or of another cycle".into());
        }
        percept.check(&self.world).map_err(|why| format!("it cannot be: {why:?}"))?;
        self.heard_before = std::mem::take(&mut self.heard);
        let tick = self.world.talks_of(cycle)[0].0;
        self.pilot.begin(percept, tick);
        Ok(tick)
    }

    fn on_packet(&mut self, from: EntityId, payload: &[u8], tick: u64) {
        self.heard.insert(from);
        self.pilot.on_packet(from, payload, tick);
    }

    fn on_timer(&mut self, tick: u64) {
        self.pilot.on_timer(tick);
    }

    fn next_timer(&self) -> Option<u64> {
        self.pilot.next_timer()
    }

    fn take_packets(&mut self) -> Vec<Outgoing> {
        let outgoing =
            |Packet { to, sequence, payload }| Outgoing { to: to.to_vec(), sequence, payload };
        self.pilot.take_packets().into_iter().map(outgoing).collect()
    }

    fn control(&self) -> Option<Vec<u8>> {
        let control = self.pilot.control()?;
        Some(postcard::to_stdvec(&control).expect("controls are plain data"))
    }

    fn is_done(&self) -> bool {
        self.pilot.is_done()
    }

    fn doing(&self) -> Doing {
        let word = match &self.pilot {
            pilot if pilot.is_done() => "done",
            pilot if pilot.has_decided() => "shield",
            pilot if pilot.has_group() => "decide",
            _ => "group",
        };
        let progress = self.pilot.progress().unwrap_or_default();
        Doing { word, round: progress.round, epoch: progress.epoch.into() }
    }

    fn heard(&self) -> Vec<EntityId> {
        let heard = if self.heard.is_empty() { &self.heard_before } else { &self.heard };
        heard.iter().copied().collect()
    }

    fn dropped(&self) -> Vec<(String, u64)> {
        let refused = self.pilot.refused();
        let counts = Refusal::ALL.iter().map(|&why| (why.name().to_string(), refused.of(why)));
        counts.filter(|(_, count)| *count > 0).collect()
    }
}

/// The faults of the scenario's network, for what one airplane sends.
pub struct Faults {
    world: Arc<AirspaceWorld>,
    ether: Ether,
    sender: EntityId,
}

impl Faults {
    /// Returns the faults of a world's network for an airplane; none of a world whose network is reliable.
    pub fn new(world: Arc<AirspaceWorld>, sender: EntityId) -> Option<Self> {
        Some(Self { ether: world.ether()?, world, sender })
    }
}

impl Channel for Faults {
    fn arrivals(&mut self, sent: &Sent) -> Vec<Arrival> {
        let &Sent { to, tick, sequence, bytes } = sent;
        let payload = vec![0; bytes];
        let sender = self.sender;
        let packet = Envelope { cycle: tick, sender, sequence, receiver: to, payload };
        let arrivals = self.ether.arrivals(packet).into_iter();
        arrivals.map(|(leaves, arrives)| Arrival { leaves, arrives }).collect()
    }

    fn tick_s(&self) -> f64 {
        self.ether.tick_s()
    }

    fn begin(&mut self, cycle: Cycle) {
        self.ether.begin(self.world.talks_of(cycle).to_vec());
    }
}
