//! An aircraft that is measured and led by MAVLink.
//!
//! All of it happens in the thread that calls: heartbeats, too. So they, and setpoints, are a proof of life of the guard
//! that calls, and the autopilot's own failsafe acts when it stops.

use super::autopilot::{
    CHANGE_HEADING, Firmware, GLOBAL_FRAME, HoldOrder, Identity, LOITER, Mode, REPOSITION,
    SET_MESSAGE_INTERVAL, SET_MODE, VehicleKind, is_autopilot,
};
use super::channel::Channel;
use super::commands::{ANSWER_TIME, CommandMessage, CommandOutcome, Commands, UNSUPPORTED};
use super::coordinates::GeoFrame;
use super::endpoint::MavlinkEndpoint;
use super::guidance::{FlightLimits, GeoSetpoint, Guidance, VehicleView, distance_m};
use super::measured::{Measured, PositionUse};
use super::messages::{CommandAck, CommandInt};
use super::signature::KEY_BYTES;
use super::traffic::{Traffic, TrafficFrame};
use crate::plant::aircraft::{AircraftPlant, AircraftState, Authority, Setpoint, TrafficReport};
use ::mavlink::dialects::common::{
    ADSB_VEHICLE_DATA, ATTITUDE_DATA, COMMAND_LONG_DATA, EXTENDED_SYS_STATE_DATA,
    GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavAutopilot, MavCmd, MavModeFlag, MavState, MavType,
    STATUSTEXT_DATA, TIMESYNC_DATA,
};
use ::mavlink::{MAVLinkV2MessageRaw, MavlinkVersion, MessageData};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

/// The component as which this one speaks: `MAV_COMP_ID_ONBOARD_COMPUTER`.
const OWN_COMPONENT: u8 = 191;

/// Time between two heartbeats, and between two questions for the round trip.
const HEARTBEAT_INTERVAL: Duration = Duration::from_secs(1);

/// The longest round trip that is one, and no answer to another question.
const MAX_ROUND_TRIP: Duration = Duration::from_secs(5);

const MAX_ROUND_TRIP_NS: i64 = 5_000_000_000;

/// Time after the first heartbeat in which others are waited for: each system has sent one by then.
const SURVEY_TIME: Duration = Duration::from_millis(1500);

/// Time without a position after which the vehicle is asked for its messages again.
const POSITION_PATIENCE: Duration = Duration::from_secs(2);

/// Time without a heartbeat after which the vehicle cannot be reached anymore. Shorter ones are gaps: an autopilot that
/// boots is back after half of it.
const LOST_TIME: Duration = Duration::from_secs(60);

/// Time for which the vehicle has got setpoints before it is asked to follow them: PX4 refuses otherwise.
const STREAM_TIME: Duration = Duration::from_secs(1);

/// Time of flight to the reference within which control is taken, in seconds, and its smallest distance in meters.
const TAKE_OVER_S: f64 = 3.0;
const TAKE_OVER_M: f64 = 10.0;

/// The age of a measurement up to which control is taken, in seconds.
const MAX_TAKE_OVER_AGE_S: f64 = 1.0;

/// Time in which a vehicle that has accepted to hold shows it by its mode.
const HOLD_TIME: Duration = Duration::from_secs(3);

/// Time after a refusal before the vehicle is asked to hold again.
const HOLD_RETRY_INTERVAL: Duration = Duration::from_secs(2);

/// Time after the end of a wait within which what is there already is read: whoever sends more may not stop the guard.
const MAX_READ_TIME: Duration = Duration::from_millis(30);

/// Messages that are asked for, and the time between two of each in microseconds.
const RATES: [(u32, u32); 3] = [
    (GLOBAL_POSITION_INT_DATA::ID, 100_000),
    (ATTITUDE_DATA::ID, 250_000),
    (EXTENDED_SYS_STATE_DATA::ID, 500_000),
];

/// How an aircraft is reached and led.
#[derive(Debug, Clone)]
pub struct MavlinkOptions {
    /// Where it is.
    pub endpoint: MavlinkEndpoint,
    /// Its system; none for the only one that is there.
    pub system_id: Option<u8>,
    /// The system as which this one speaks. ArduPilot's failsafe acts on that of `SYSID_MYGCS`.
    pub own_system_id: u8,
    /// The key of signed frames.
    pub key: Option<[u8; KEY_BYTES]>,
    /// Whether frames may go without signatures although others reach the network.
    pub is_insecure: bool,
    /// Where the scenario's coordinates are.
    pub geo: GeoFrame,
    /// Whether the vehicle is asked, once, to follow setpoints.
    pub takes_control: bool,
    /// What setpoints may ask for.
    pub limits: FlightLimits,
    /// The longest wait for the first heartbeat.
    pub patience: Duration,
}

/// The reason why an aircraft cannot be led.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MavlinkError {
    /// Others reach the network, and nothing is signed.
    #[error("whoever reaches {0} could fly the aircraft: its frames are not signed")]
    Insecure(String),
    /// The connection cannot be opened, or has failed.
    #[error("{0}")]
    Connection(String),
    /// No autopilot was heard.
    #[error("no heartbeat of {0} at {1}{2}")]
    NoVehicle(String, String, String),
    /// Several systems were heard.
    #[error("the systems {0:?} are there, and it is not said which one is meant")]
    Several(Vec<u8>),
    /// It is of a kind that cannot be led.
    #[error("{0}")]
    Unsupported(String),
}

/// Times at which something is due.
#[derive(Debug, Clone, Copy)]
struct Schedule {
    start: Instant,
    heartbeat: Instant,
    position_at: Instant,
    rates_at: Instant,
    /// Which of the rates is asked for next; as many as there are when all were.
    next_rate: usize,
    lead_since: Option<Instant>,
    /// The question for the round trip that is open, in nanoseconds since the start.
    asked_ns: i64,
}

/// What has become of the last hold.
#[derive(Debug, Clone)]
enum HoldState {
    /// Nothing was asked.
    None,
    /// The vehicle has accepted it.
    Accepted(Instant),
    /// It could not be brought to it, for a reason.
    Failed(Instant, String),
}

/// An aircraft by MAVLink.
pub struct MavlinkPlant {
    channel: Channel,
    geo: GeoFrame,
    identity: Identity,
    /// Whether the vehicle is still to be asked to follow setpoints.
    has_to_take_control: bool,
    is_asking_control: bool,
    measured: Measured,
    commands: Commands,
    guidance: Guidance,
    traffic: Traffic,
    schedule: Schedule,
    hold: HoldState,
    last_sequence: Option<u8>,
    failure: Option<String>,
}

impl MavlinkPlant {
    /// Connects to an aircraft, and waits for its heartbeat.
    ///
    /// # Errors
    /// When nothing is signed on a network that others reach, no autopilot is heard, or several are, or it is of a kind
    /// that cannot be led.
    pub fn connect(options: &MavlinkOptions) -> Result<Self, MavlinkError> {
        Self::connect_while(options, &|| true)
    }

    /// Connects as [`Self::connect`] does, as long as `may_wait` says so.
    ///
    /// # Errors
    /// As [`Self::connect`], and as if nobody was heard when it may not wait.
    pub fn connect_while(
        options: &MavlinkOptions,
        may_wait: &dyn Fn() -> bool,
    ) -> Result<Self, MavlinkError> {
        let endpoint = &options.endpoint;
        if options.key.is_none() && !options.is_insecure && !endpoint.is_loopback() {
            return Err(MavlinkError::Insecure(endpoint.to_string()));
        }
        let own = [options.own_system_id, OWN_COMPONENT];
        let mut channel =
            Channel::open(endpoint, options.key, own).map_err(MavlinkError::Connection)?;
        if let Some(address) = channel.local_address() {
            tracing::debug!("MAVLink: {endpoint} from {address}");
        }
        let found = Survey::new(options).search(&mut channel, may_wait)?;
        let identity = Identity::new(found.0, &found.1).map_err(MavlinkError::Unsupported)?;
        tracing::info!(
            "system {} is {:?}, {:?}",
            identity.system,
            identity.firmware,
            identity.kind
        );
        let now = Instant::now();
        let schedule = Schedule {
            start: now,
            heartbeat: now,
            position_at: now,
            rates_at: now,
            next_rate: 0,
            lead_since: None,
            asked_ns: 0,
        };
        Ok(Self {
            channel,
            geo: options.geo,
            identity,
            has_to_take_control: options.takes_control,
            is_asking_control: false,
            measured: Measured::new(found.1),
            commands: Commands::default(),
            guidance: Guidance::new(options.limits),
            traffic: Traffic::default(),
            schedule,
            hold: HoldState::None,
            last_sequence: None,
            failure: None,
        })
    }

    /// Returns the address of this end of the connection.
    pub fn local_address(&self) -> Option<SocketAddr> {
        self.channel.local_address()
    }

    /// Returns the system of the vehicle.
    pub fn system_id(&self) -> u8 {
        self.identity.system
    }

    /// Returns how the vehicle flies.
    pub fn kind(&self) -> VehicleKind {
        self.identity.kind
    }

    /// Returns the program of its autopilot.
    pub fn firmware(&self) -> Firmware {
        self.identity.firmware
    }

    /// Reads what comes until there is news of the aircraft, or until a time. What is there already is read all.
    fn read(&mut self, until: Instant) {
        let end = until + MAX_READ_TIME;
        let mut is_news = false;
        while Instant::now() < end {
            self.keep_alive();
            let next = if is_news { Instant::now() } else { until.min(self.schedule.heartbeat) };
            match self.channel.receive(next) {
                Ok(Some(raw)) => is_news |= self.on_frame(&raw),
                Ok(None) => {
                    if is_news || Instant::now() >= until {
                        return;
                    }
                }
                Err(failure) => {
                    self.failure = Some(failure);
                    return;
                }
            }
        }
    }

    /// Sends what is due.
    fn keep_alive(&mut self) {
        self.commands.repeat(&mut self.channel);
        let now = Instant::now();
        if now >= self.schedule.heartbeat {
            self.schedule.heartbeat = now + HEARTBEAT_INTERVAL;
            self.channel.send(&own_heartbeat());
            self.ask_round_trip();
        }
        if self.measured.on_time() {
            self.channel.counts.silences += 1;
            tracing::warn!("no heartbeat of system {} for a while", self.identity.system);
        }
        self.ask_for_messages();
        self.note_control();
    }

    fn ask_round_trip(&mut self) {
        let since_start_ns = self.schedule.start.elapsed().as_nanos();
        // The largest number is 292 years after the start.
        let asked_ns = i64::try_from(since_start_ns).unwrap_or(i64::MAX);
        self.schedule.asked_ns = asked_ns;
        self.channel.send(&TIMESYNC_DATA { tc1: 0, ts1: asked_ns });
    }

    /// Asks for one message after another: an acknowledgment does not say which one it is of.
    fn ask_for_messages(&mut self) {
        let now = Instant::now();
        let is_missing = now.duration_since(self.schedule.position_at) > POSITION_PATIENCE;
        let has_asked = now.duration_since(self.schedule.rates_at) <= POSITION_PATIENCE;
        if is_missing && !has_asked {
            self.schedule.next_rate = 0;
        }
        if self.commands.is_pending(SET_MESSAGE_INTERVAL) {
            return;
        }
        let Some(rate) = RATES.get(self.schedule.next_rate) else { return };
        self.schedule.next_rate += 1;
        self.schedule.rates_at = now;
        let params = [rate.0 as f32, rate.1 as f32, 0.0];
        let message = self.long(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, params);
        self.commands.submit(message, &mut self.channel);
    }

    fn long(&self, command: MavCmd, params: [f32; 3]) -> CommandMessage {
        let target = self.identity.target();
        CommandMessage::Long(COMMAND_LONG_DATA {
            command,
            param1: params[0],
            param2: params[1],
            param3: params[2],
            target_system: target[0],
            target_component: target[1],
            ..COMMAND_LONG_DATA::DEFAULT
        })
    }

    /// Takes a frame. Returns whether it is news of the aircraft.
    fn on_frame(&mut self, raw: &MAVLinkV2MessageRaw) -> bool {
        if raw.system_id() != u32::from(self.identity.system) {
            self.channel.counts.other_systems += 1;
            return false;
        }
        self.channel.accept_source();
        let is_autopilot = raw.component_id() == self.identity.target()[1];
        if is_autopilot {
            self.note_sequence(raw.sequence());
        }
        if raw.message_id() == ADSB_VEHICLE_DATA::ID {
            // Receivers are components of their own.
            self.on_traffic(raw);
            return false;
        }
        if !is_autopilot {
            return false;
        }
        match raw.message_id() {
            HEARTBEAT_DATA::ID => self.on_heartbeat(raw),
            GLOBAL_POSITION_INT_DATA::ID => self.on_position(raw),
            EXTENDED_SYS_STATE_DATA::ID => {
                let state = self.parse::<EXTENDED_SYS_STATE_DATA>(raw);
                state.is_some_and(|state| self.measured.on_landed_state(state.landed_state))
            }
            ATTITUDE_DATA::ID => {
                if let Some(attitude) = self.parse::<ATTITUDE_DATA>(raw) {
                    self.measured.on_yaw(f64::from(attitude.yaw));
                }
                false
            }
            CommandAck::ID => {
                self.on_ack(raw);
                false
            }
            TIMESYNC_DATA::ID => {
                self.on_time_answer(raw);
                false
            }
            STATUSTEXT_DATA::ID => {
                self.on_text(raw);
                false
            }
            _ => false,
        }
    }

    fn parse<D: MessageData>(&mut self, raw: &MAVLinkV2MessageRaw) -> Option<D> {
        let content = D::deser(MavlinkVersion::V2, raw.payload());
        if content.is_err() {
            self.channel.counts.unreadable += 1;
        }
        content.ok()
    }

    fn note_sequence(&mut self, sequence: u8) {
        if let Some(last) = self.last_sequence {
            let step = sequence.wrapping_sub(last);
            // Half of the numbers are after the last one, half before it.
            if step == 0 || step > 128 {
                self.channel.counts.out_of_order += 1;
            } else {
                self.channel.counts.lost += u64::from(step - 1);
            }
        }
        self.last_sequence = Some(sequence);
    }

    fn on_heartbeat(&mut self, raw: &MAVLinkV2MessageRaw) -> bool {
        let Some(heartbeat) = self.parse::<HEARTBEAT_DATA>(raw) else { return false };
        if !is_autopilot(raw.component_id(), &heartbeat) {
            return false;
        }
        let before = self.measured.authority(self.identity);
        let is_news = self.measured.on_heartbeat(heartbeat);
        let after = self.measured.authority(self.identity);
        if before != after {
            tracing::info!("in control of system {}: {after:?}", self.identity.system);
            // Whoever gives control back may have changed what the vehicle was told.
            self.guidance.restart();
        }
        is_news
    }

    fn on_position(&mut self, raw: &MAVLinkV2MessageRaw) -> bool {
        let Some(position) = self.parse::<GLOBAL_POSITION_INT_DATA>(raw) else { return false };
        let used = self.measured.on_position(&position, &mut self.channel.counts);
        match used {
            PositionUse::Dropped => false,
            PositionUse::Kept => {
                self.schedule.position_at = Instant::now();
                true
            }
            PositionUse::AfterBoot => {
                tracing::warn!("system {} has booted", self.identity.system);
                self.schedule.position_at = Instant::now();
                // It has forgotten what it was asked for and told.
                self.schedule.next_rate = 0;
                self.guidance.restart();
                true
            }
        }
    }

    fn on_ack(&mut self, raw: &MAVLinkV2MessageRaw) {
        let Some(ack) = self.parse::<CommandAck>(raw) else { return };
        let own = [self.channel.own_system_id(), OWN_COMPONENT];
        // Older autopilots do not say to whom they answer.
        let is_ours = ack.target[0] == 0 || ack.target == own || ack.target == [own[0], 0];
        if is_ours {
            self.commands.on_ack(ack, &mut self.channel.counts);
        }
    }

    fn on_time_answer(&mut self, raw: &MAVLinkV2MessageRaw) {
        let Some(answer) = self.parse::<TIMESYNC_DATA>(raw) else { return };
        if answer.tc1 == 0 {
            // A question of the vehicle: it needs no time of ours.
            return;
        }
        // Answers may take longer than the time between questions.
        let is_ours = answer.ts1 <= self.schedule.asked_ns
            && self.schedule.asked_ns - answer.ts1.max(0) <= MAX_ROUND_TRIP_NS;
        let asked = u64::try_from(answer.ts1).ok().filter(|_| is_ours);
        let Some(asked_ns) = asked else { return };
        let asked = self.schedule.start + Duration::from_nanos(asked_ns);
        self.measured.clock.set_round_trip(asked, asked.elapsed().min(MAX_ROUND_TRIP));
    }

    fn on_text(&mut self, raw: &MAVLinkV2MessageRaw) {
        let Some(text) = self.parse::<STATUSTEXT_DATA>(raw) else { return };
        // Control characters of a stranger are kept out of the log.
        let words = text.text.to_str().unwrap_or_default().escape_debug().to_string();
        tracing::info!("system {} says: {words}", self.identity.system);
    }

    fn on_traffic(&mut self, raw: &MAVLinkV2MessageRaw) {
        let Some(message) = self.parse::<ADSB_VEHICLE_DATA>(raw) else { return };
        let frame = self.traffic_frame();
        self.traffic.on_message(&message, frame, &mut self.channel.counts);
    }

    fn traffic_frame(&self) -> TrafficFrame {
        let fix = self.measured.fix.as_ref();
        let home_m = fix.map(|fix| fix.altitude.sea_m - fix.altitude.home_m);
        TrafficFrame { geo: self.geo, home_m }
    }

    /// Tells what has become of the question for control.
    fn note_control(&mut self) {
        if !self.is_asking_control {
            return;
        }
        let Some(outcome) = self.commands.outcome(SET_MODE) else { return };
        self.is_asking_control = false;
        let mode = self.identity.node_mode().name;
        match outcome {
            CommandOutcome::Accepted => tracing::info!("mode {mode} is accepted"),
            refusal => tracing::warn!("mode {mode} is {refusal}; it is not asked for again"),
        }
    }

    fn set_mode(&mut self, mode: Mode) {
        // The first parameter says that the others are a mode of the autopilot's own.
        let custom = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED.bits();
        let params = [f32::from(custom), f32::from(mode.main), f32::from(mode.sub)];
        let message = self.long(MavCmd::MAV_CMD_DO_SET_MODE, params);
        self.commands.submit(message, &mut self.channel);
    }

    /// Asks for control, if it was told to, when the vehicle can take up the reference.
    fn take_control(&mut self, setpoint: &GeoSetpoint, distance_m: f64) {
        let is_flying_by_itself = self.measured.authority(self.identity) == Authority::Vehicle;
        let is_heard = self.measured.silence() < HEARTBEAT_INTERVAL * 3;
        if !self.has_to_take_control || !is_flying_by_itself || !is_heard {
            return;
        }
        let lead_since = *self.schedule.lead_since.get_or_insert_with(Instant::now);
        let near_m = (setpoint.ground_speed_m_s * TAKE_OVER_S).max(TAKE_OVER_M);
        let is_fresh = self.measured.clock.age_s(Instant::now()) <= MAX_TAKE_OVER_AGE_S;
        if lead_since.elapsed() < STREAM_TIME || distance_m > near_m || !is_fresh {
            return;
        }
        self.has_to_take_control = false;
        self.is_asking_control = true;
        self.set_mode(self.identity.node_mode());
    }

    fn check_reach(&self) -> Result<(), String> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        let silence = self.measured.silence();
        if silence > LOST_TIME {
            return Err(format!(
                "no heartbeat of system {} for {:.0} s",
                self.identity.system,
                silence.as_secs_f64()
            ));
        }
        Ok(())
    }

    /// Sends an order to hold, and waits for its result.
    fn try_hold(&mut self, order: HoldOrder) -> CommandOutcome {
        let number = match order {
            HoldOrder::Mode(mode) => {
                self.is_asking_control = false;
                self.set_mode(mode);
                SET_MODE
            }
            HoldOrder::Loiter => {
                let message = self.long(MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 3]);
                self.commands.submit(message, &mut self.channel);
                LOITER
            }
            HoldOrder::StayHere => {
                let message = self.stay_here();
                self.commands.submit(message, &mut self.channel);
                REPOSITION
            }
        };
        let until = Instant::now() + ANSWER_TIME;
        while self.commands.is_pending(number) && Instant::now() < until {
            let step = Instant::now() + Duration::from_millis(20);
            self.read(step.min(until));
            if self.failure.is_some() {
                break;
            }
        }
        self.commands.outcome(number).unwrap_or(CommandOutcome::Unanswered)
    }

    fn stay_here(&self) -> CommandMessage {
        let command = self.identity.command(REPOSITION, [-1.0, 1.0, 0.0, f32::NAN]);
        let pose = self.measured.pose();
        let altitude = self.measured.fix.as_ref().map(|fix| fix.altitude.sea_m);
        CommandMessage::Int(CommandInt {
            // The largest number stands for where it is.
            place: pose.map_or([i32::MAX; 2], super::coordinates::GeoPose::units),
            z: altitude.map_or(f32::NAN, |sea_m| sea_m as f32),
            frame: GLOBAL_FRAME,
            ..command
        })
    }

    /// Returns the result of a hold that needs no order anymore.
    fn known_hold(&self) -> Option<Result<(), String>> {
        let is_heard = self.measured.silence() < HEARTBEAT_INTERVAL * 3;
        let is_led = self.measured.authority(self.identity) == Authority::Node;
        if is_heard && !is_led && !self.is_asking_control {
            // A pilot, the autopilot itself or the ground has it.
            return Some(Ok(()));
        }
        match &self.hold {
            HoldState::Accepted(at) if at.elapsed() < HOLD_TIME => Some(Ok(())),
            HoldState::Failed(at, why) if at.elapsed() < HOLD_RETRY_INTERVAL => {
                Some(Err(why.clone()))
            }
            _ => None,
        }
    }

    fn geo_setpoint(&self, setpoint: &Setpoint) -> GeoSetpoint {
        GeoSetpoint {
            pose: self.geo.to_earth(setpoint.pose),
            ground_speed_m_s: setpoint.ground_speed_m_s,
            turn_rate_rad_s: setpoint.turn_rate_rad_s,
            altitude: self.geo.altitude_target(setpoint.altitude_m),
        }
    }

    /// Sends what leads a vehicle to its reference. Commands are sent to one alone that obeys them; setpoints flow before,
    /// because PX4 wants to see them before it does.
    fn send_setpoint(&mut self, setpoint: &GeoSetpoint, altitude_m: f64) {
        let Some(fix) = self.measured.fix else { return };
        let age_s = self.measured.clock.age_s(Instant::now());
        let altitude_error_m = self.geo.altitude_m(fix.altitude) - altitude_m;
        let vehicle = VehicleView { identity: self.identity, fix: &fix, age_s, altitude_error_m };
        self.take_control(setpoint, distance_m(setpoint, &vehicle));
        let is_commanded = self.identity.firmware == Firmware::ArduPilot
            && self.identity.kind == VehicleKind::FixedWing;
        if !is_commanded {
            let since_start_ms = self.schedule.start.elapsed().as_millis();
            // It begins anew after 49 days, as all such times do.
            let boot_ms = (since_start_ms % (1 << 32)) as u32;
            let target = self.guidance.position_target(setpoint, &vehicle, boot_ms);
            self.channel.send(&target);
            return;
        }
        if self.measured.authority(self.identity) != Authority::Node {
            return;
        }
        for command in self.guidance.plane_commands(setpoint, &vehicle) {
            self.commands.send_once(&command, &mut self.channel);
        }
    }

    fn check_course(&self) -> Result<(), String> {
        let outcome = self.commands.outcome(CHANGE_HEADING);
        if outcome == Some(CommandOutcome::Refused(UNSUPPORTED)) {
            return Err("the autopilot does not know MAV_CMD_GUIDED_CHANGE_HEADING: ArduPlane 4.1 or newer does".into());
        }
        Ok(())
    }
}

impl AircraftPlant for MavlinkPlant {
    fn wait(&mut self, within: Duration) -> Option<AircraftState> {
        if self.failure.is_some() {
            std::thread::sleep(within);
        } else {
            self.read(Instant::now() + within);
        }
        self.measured.state(self.identity, self.geo)
    }

    fn lead(&mut self, setpoint: &Setpoint) -> Result<(), String> {
        self.check_reach()?;
        self.keep_alive();
        let on_earth = self.geo_setpoint(setpoint);
        self.send_setpoint(&on_earth, setpoint.altitude_m);
        self.check_course()
    }

    fn hold(&mut self, reason: &str) -> Result<(), String> {
        self.check_reach()?;
        self.read(Instant::now());
        if let Some(known) = self.known_hold() {
            return known;
        }
        tracing::warn!("system {} is to hold: {reason}", self.identity.system);
        let mut refusals = Vec::new();
        for order in self.identity.hold_orders() {
            let outcome = self.try_hold(order);
            if outcome == CommandOutcome::Accepted {
                self.hold = HoldState::Accepted(Instant::now());
                return Ok(());
            }
            refusals.push(format!("{} is {outcome}", hold_name(order)));
            if outcome == CommandOutcome::Unanswered {
                // Another order would not be heard either, and time is short.
                break;
            }
        }
        let why = refusals.join("; ");
        self.hold = HoldState::Failed(Instant::now(), why.clone());
        Err(why)
    }

    fn show_traffic(&mut self, traffic: &[TrafficReport]) -> Result<(), String> {
        self.check_reach()?;
        let frame = self.traffic_frame();
        for report in traffic {
            if let Some(message) = self.traffic.tell(report, frame) {
                self.channel.send(&message);
            }
        }
        Ok(())
    }

    fn take_traffic(&mut self) -> Vec<TrafficReport> {
        self.traffic.take()
    }

    fn counts(&self) -> Vec<(String, u64)> {
        let mut counts = self.channel.counts.list();
        counts.push(("other_addresses".into(), self.channel.strangers()));
        counts
    }
}

fn hold_name(order: HoldOrder) -> &'static str {
    match order {
        HoldOrder::Mode(mode) => mode.name,
        HoldOrder::Loiter => "MAV_CMD_NAV_LOITER_UNLIM",
        HoldOrder::StayHere => "MAV_CMD_DO_REPOSITION",
    }
}

fn own_heartbeat() -> HEARTBEAT_DATA {
    HEARTBEAT_DATA {
        custom_mode: 0,
        mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
        autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
        base_mode: MavModeFlag::empty(),
        system_status: MavState::MAV_STATE_ACTIVE,
        mavlink_version: 3,
    }
}

/// The search for the vehicle that is meant.
struct Survey<'a> {
    options: &'a MavlinkOptions,
    found: BTreeMap<u8, HEARTBEAT_DATA>,
    first_at: Option<Instant>,
}

impl<'a> Survey<'a> {
    fn new(options: &'a MavlinkOptions) -> Self {
        Self { options, found: BTreeMap::new(), first_at: None }
    }

    /// Returns the system and its heartbeat.
    fn search(
        mut self,
        channel: &mut Channel,
        may_wait: &dyn Fn() -> bool,
    ) -> Result<(u8, HEARTBEAT_DATA), MavlinkError> {
        let until = Instant::now() + self.options.patience;
        let mut heartbeat_due = Instant::now();
        while Instant::now() < until && !self.is_over() && may_wait() {
            if Instant::now() >= heartbeat_due {
                // An autopilot that waits for datagrams learns where this one is.
                channel.send(&own_heartbeat());
                heartbeat_due += HEARTBEAT_INTERVAL;
            }
            let step = Instant::now() + Duration::from_millis(50);
            let received = channel.receive(step).map_err(MavlinkError::Connection)?;
            if let Some(raw) = received {
                self.on_frame(channel, &raw);
            }
        }
        self.choose(channel)
    }

    fn on_frame(&mut self, channel: &mut Channel, raw: &MAVLinkV2MessageRaw) {
        // The system number has a byte, because frames with longer ones are not read.
        let system = raw.system_id() as u8;
        if raw.message_id() != HEARTBEAT_DATA::ID {
            return;
        }
        let Ok(heartbeat) = HEARTBEAT_DATA::deser(MavlinkVersion::V2, raw.payload()) else {
            channel.counts.unreadable += 1;
            return;
        };
        if !is_autopilot(raw.component_id(), &heartbeat) {
            return;
        }
        self.found.insert(system, heartbeat);
        self.first_at.get_or_insert_with(Instant::now);
    }

    fn is_over(&self) -> bool {
        match self.options.system_id {
            Some(system) => self.found.contains_key(&system),
            None => self.first_at.is_some_and(|at| at.elapsed() > SURVEY_TIME),
        }
    }

    fn choose(mut self, channel: &Channel) -> Result<(u8, HEARTBEAT_DATA), MavlinkError> {
        if let Some(system) = self.options.system_id
            && let Some(heartbeat) = self.found.remove(&system)
        {
            return Ok((system, heartbeat));
        }
        if self.options.system_id.is_none() && self.found.len() > 1 {
            return Err(MavlinkError::Several(self.found.into_keys().collect()));
        }
        if self.options.system_id.is_none()
            && let Some(found) = self.found.pop_first()
        {
            return Ok(found);
        }
        let meant = self
            .options
            .system_id
            .map_or("an autopilot".to_string(), |system| format!("system {system}"));
        let endpoint = self.options.endpoint.to_string();
        Err(MavlinkError::NoVehicle(meant, endpoint, self.what_came(channel)))
    }

    /// Says what was heard instead.
    fn what_came(&self, channel: &Channel) -> String {
        let counts = &channel.counts;
        let systems: Vec<&u8> = self.found.keys().collect();
        if !systems.is_empty() {
            return format!("; the systems {systems:?} are there");
        }
        if counts.unsigned > 0 {
            return format!("; {} frames had no signature", counts.unsigned);
        }
        if counts.badly_signed > 0 {
            return format!(
                "; the signatures of {} frames are of another key, or old",
                counts.badly_signed
            );
        }
        if counts.version_1 > 0 {
            return format!("; {} frames were of version 1 of MAVLink", counts.version_1);
        }
        String::new()
    }
}
