//! The node of one airplane in a flight without a server, as a process.

use super::certificates::{check_identity, check_names, credentials};
use super::mavlink::MavlinkJob;
use super::node::endpoint_error;
use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use super::scenario::Scenario;
use crate::flight::board::FlightBoard;
use crate::flight::channel::{ChannelConfig, FlightChannel};
use crate::flight::fence::Fence;
use crate::flight::guard::{Guard, GuardLimits};
use crate::flight::journal::FlightJournal;
use crate::flight::message::flight_number;
use crate::flight::node::{FlightError, FlightNode, FlightParts, FlightSettings};
use crate::flight::time::WallClock;
use crate::identity::CertificateName;
use crate::plant::aircraft::AircraftPlant;
use crate::plant::model::ModelPlant;
use crate::wire::PeerId;
use crate::wire::endpoint::{PortReservation, check_reachable, reserve_port};
use crate::wire::zenoh::{PeerOptions, ZenohWire};
use sidestep::kernel::{EntityId, InputError};
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::AirspaceWorld;
use sidestep::worlds::airspace::pilot::Pilot;
use sidestep::worlds::airspace::replica::{Replica, TimeShares, check_flight};
use sidestep::worlds::airspace::scenario::CompiledAirspace;
use sidestep::worlds::airspace::settings::Grouping;
use sidestep_session::Error;
use sidestep_session::fleet::{FlightJob, JobScenario, LinkMessage, PlantChoice};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Requests that have room in a conversation, beyond the eight that a scenario must leave room for.
const REQUESTS_PER_CONVERSATION: f64 = 9.0;

/// A scenario that is flown without a server.
pub(super) struct FlightScenario {
    pub(super) scenario: Scenario,
    /// The number of the flight, which is that of all its parties.
    pub(super) flight: u64,
}

impl FlightScenario {
    /// Reads a scenario, with the changes that such a flight needs; `further` ones are those of a recorder.
    ///
    /// # Errors
    /// When it is wrong, or its airplanes cannot fly so.
    pub(super) fn read(
        flown: &JobScenario,
        speed: f64,
        further: &[String],
    ) -> Result<Self, InputError> {
        let scenario = Scenario::read(flown)?;
        // Before the changes: a recorder has others.
        let fingerprint = scenario.fingerprint()?;
        let place = scenario.source.place.clone();
        let mut overrides = required_overrides(airspace(&scenario)?);
        overrides.extend_from_slice(further);
        let scenario = scenario.with_overrides(&overrides)?;
        check_flight(airspace(&scenario)?)
            .map_err(|limit| InputError::new(&place, limit.cause, limit.remedy))?;
        let flight = flight_number(&fingerprint, WORLDS.build(), speed);
        Ok(Self { scenario, flight })
    }

    pub(super) fn airspace(&self) -> Result<&CompiledAirspace, InputError> {
        airspace(&self.scenario)
    }
}

fn airspace(scenario: &Scenario) -> Result<&CompiledAirspace, InputError> {
    scenario.compiled.as_any().downcast_ref().ok_or_else(|| {
        let cause = format!("agents of the world `{}` need a server", scenario.compiled.world());
        let remedy = "give a scenario with world = \"airspace\"";
        InputError::new(&scenario.source.place, cause, remedy)
    })
}

/// Returns the changes, as `key=value`, by which airplanes find their groups themselves, and may miss packets of each other.
fn required_overrides(scenario: &CompiledAirspace) -> Vec<String> {
    let world = &scenario.world;
    let mut overrides = Vec::new();
    if world.groups != Grouping::Heard {
        overrides.push("airspace.groups=heard".to_string());
    }
    // With simulated surveillance there is no network, and that is refused by its own reason.
    if world.network.is_none() && world.surveillance.is_none() {
        let deadline_s = TimeShares::DEFAULT.conversations * world.timing.dt_s / 2.0;
        let patience_s = deadline_s / REQUESTS_PER_CONVERSATION;
        overrides.push(format!("airspace.network.deadline_s={deadline_s}"));
        overrides.push(format!("airspace.network.patience_s={patience_s}"));
    }
    overrides
}

/// Flies an airplane to the end of its flight, or until the parent process ends it.
///
/// # Errors
/// When anything is wrong with the job, the flight does not begin, or it is asked to end.
pub(super) fn run(job: &FlightJob, parent: &ParentMonitor) -> Result<(), Error> {
    job.network.listen.iter().try_for_each(|at| check_reachable(at)).map_err(endpoint_error)?;
    let flown = FlightScenario::read(&job.common.flown, job.clock.speed, &[])?;
    let scenario = &flown.scenario;
    let agent = scenario.world.find_agent_id(&job.agent)?;
    let tls = job.common.tls.as_ref();
    let wanted = CertificateName::Agent(job.agent.clone()).to_string();
    check_identity(tls, |name| name.may_run(&job.agent), &wanted)?;
    check_names(tls, &job.network.listen)?;
    let credentials = credentials(tls, scenario.world.as_ref());
    let compiled = flown.airspace()?;
    let world = &compiled.world;
    let limits = guard_limits(job, world, agent)?;
    let plant = open_plant(job, world, agent, parent)?;
    let listen = listen_endpoints(&job.network.listen)?;
    let options =
        PeerOptions { is_scouting: job.network.is_scouting, credentials: credentials.as_ref() };
    let me = PeerId::Node(agent);
    let wire = ZenohWire::peer_wire(me, &listen, &job.network.peers, options);
    let wire = wire.map_err(endpoint_error)?;
    print_message(&LinkMessage::Listens(listen));
    let config = ChannelConfig {
        me,
        flight: flown.flight,
        tolerance_s: job.clock.tolerance_s,
        speed: job.clock.speed,
    };
    let clock = WallClock::system();
    let faults = scenario.world.channel(agent);
    let channel = FlightChannel::new(config, Box::new(wire), clock, faults);
    let board = Arc::new(FlightBoard::default());
    let pilot = Pilot::new(world.clone(), agent, Default::default());
    let parts = FlightParts {
        replica: Replica::new(compiled, agent),
        pilot: pilot.with_build_id(WORLDS.build()),
        channel,
        board: Arc::clone(&board),
        journal: job.journal.clone().map(|path| FlightJournal::new(path, flown.flight)),
    };
    let settings = FlightSettings {
        start_s: job.clock.start_s,
        speed: job.clock.speed,
        cycles: scenario.compiled.plan().cycles,
        patience_s: job.guard.patience_s,
        lease_s: job.common.lease_s,
    };
    let guard = Guard::new(plant, board, clock, limits);
    let has_to_end = || parent.has_ended();
    let node = FlightNode::new(agent, parts, settings, &has_to_end, |status| {
        print_message(&LinkMessage::Flight(status.clone()));
    });
    let flown = with_guard(guard, node);
    flown.map_err(flight_error)
}

/// Runs a node with its guard beside it, which ends after it.
fn with_guard(guard: Guard, node: FlightNode<'_>) -> Result<(), FlightError> {
    let has_ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| guard.run(&has_ended));
        let flown = node.run();
        has_ended.store(true, Ordering::Relaxed);
        flown.map(drop)
    })
}

/// Returns the endpoints at which a party listens, with a port in place of each 0.
pub(super) fn listen_endpoints(listen: &[String]) -> Result<Vec<String>, Error> {
    let ports: Result<Vec<PortReservation>, _> =
        listen.iter().map(|endpoint| reserve_port(endpoint)).collect();
    // Zenoh binds the ports itself, at once.
    Ok(ports.map_err(endpoint_error)?.into_iter().map(|port| port.endpoint).collect())
}

/// Returns the aircraft that a node leads.
///
/// # Errors
/// When it cannot be reached.
fn open_plant(
    job: &FlightJob,
    world: &AirspaceWorld,
    agent: EntityId,
    parent: &ParentMonitor,
) -> Result<Box<dyn AircraftPlant>, Error> {
    match &job.plant {
        PlantChoice::Model(settings) => {
            let seed = u64::from(agent);
            let model = ModelPlant::new(world.surface, *settings, job.clock.speed, seed);
            Ok(Box::new(model))
        }
        PlantChoice::Mavlink(settings) => {
            check_real_time(job)?;
            let model = &world.airplanes[agent as usize].model;
            let aircraft = MavlinkJob {
                settings,
                surface: world.surface,
                model,
                is_insecure: job.common.is_insecure,
            };
            Ok(Box::new(aircraft.open(parent)?))
        }
    }
}

/// Checks that a second of the scenario is one: vehicles do not fly faster.
fn check_real_time(job: &FlightJob) -> Result<(), InputError> {
    if job.clock.speed == 1.0 {
        return Ok(());
    }
    let cause = "a vehicle flies in real time";
    Err(InputError::new(format!("--speed {}", job.clock.speed), cause, "leave it out"))
}

/// Returns whether a vehicle may be anywhere without harm: a model without errors endangers nobody.
fn is_harmless(plant: &PlantChoice) -> bool {
    match plant {
        PlantChoice::Model(_) => true,
        PlantChoice::Mavlink(_) => false,
    }
}

/// Returns the limits of the guard.
fn guard_limits(
    job: &FlightJob,
    world: &AirspaceWorld,
    agent: EntityId,
) -> Result<GuardLimits, InputError> {
    let guard = &job.guard;
    let fence = Fence::new(&guard.fence, world.surface).map_err(|cause| {
        InputError::new("the fence", cause, "see sidestep node --help for its notation")
    })?;
    Ok(GuardLimits {
        max_deviation_m: max_deviation_m(job, world, agent)?,
        max_age_s: guard.max_age_s,
        patience_s: guard.patience_s,
        run_up_s: guard.run_up_s,
        fence,
        surface: world.surface,
    })
}

/// Returns how far a vehicle may be from its reference: the error of position for which the shield allows, without the way
/// that it flies while clocks differ.
fn max_deviation_m(
    job: &FlightJob,
    world: &AirspaceWorld,
    agent: EntityId,
) -> Result<f64, InputError> {
    let bound_m = world.position_bound_m(agent as usize);
    let speed_m_s = world.airplanes[agent as usize].model.v_m_s;
    let clock_m = speed_m_s * job.clock.tolerance_s * job.clock.speed;
    let allowed_m = bound_m - clock_m;
    if is_harmless(&job.plant) {
        // Without any bound it is not measured.
        return Ok(job.guard.max_deviation_m.unwrap_or(f64::INFINITY));
    }
    if allowed_m <= 0.0 {
        let cause = format!(
            "the shield allows for {bound_m} m between a vehicle and its reference, of which clocks that differ take {clock_m:.1} m"
        );
        let remedy = "give the airplanes a larger error of position (nic = 10 is 25 m, nic = 9 is 75 m), or \
                      --clock-tolerance a smaller number of seconds";
        return Err(InputError::new("the limits of the guard", cause, remedy));
    }
    let given_m = job.guard.max_deviation_m.unwrap_or(allowed_m);
    if given_m > allowed_m {
        let cause =
            format!("{given_m} m is more than the {allowed_m:.1} m for which the shield allows");
        let remedy =
            "give a smaller --max-deviation, or the airplanes a larger error of position (nic)";
        return Err(InputError::new("--max-deviation", cause, remedy));
    }
    Ok(given_m)
}

fn flight_error(error: FlightError) -> Error {
    let remedy = match &error {
        FlightError::Interrupted => return Error::Interrupted,
        FlightError::NotAllThere(_) => {
            "start all nodes before --start, with the same scenario, and see whether they reach each other"
        }
        FlightError::NotRemembered(_) => {
            "give --journal FILE to this node when it is started first: then it knows by itself; or start the flight again"
        }
    };
    Error::other(error.to_string(), remedy)
}
