//! The program of a robot that is a vehicle: it hands percepts over, and takes controls.

use super::VehiclePort;
use super::messages::{
    NO_CONTACT, RobotControlMessage, RobotDescription, RobotPerceptMessage, SensorDescription,
};
use crate::agent::{AgentActivity, AgentProgram};
use crate::robot_percept::read_percept;
use sidestep::import::bag::cdr;
use sidestep::kernel::{Cycle, EntityId};
use sidestep::worlds::robots::RobotsWorld;
use sidestep::worlds::robots::agents::{RobotControl, RobotPercept};
use sidestep::worlds::robots::decide::TripEvent;
use sidestep::worlds::robots::world::{CYCLE_S, Role};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time after which a percept without an answer is sent again: the vehicle may have just started, or a link was down.
const RESEND_INTERVAL: Duration = Duration::from_millis(500);

/// Time between two looks for a control. A cycle of robots takes far longer.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// A percept that the vehicle has yet to answer.
struct OpenPercept {
    cycle: Cycle,
    bytes: Vec<u8>,
    sent_at: Instant,
}

/// A robot whose decisions come from a vehicle.
pub(crate) struct RobotVehicle {
    world: Arc<RobotsWorld>,
    robot: EntityId,
    port: Box<dyn VehiclePort>,
    open: Option<OpenPercept>,
    /// Its control in the present cycle.
    control: Option<RobotControl>,
    /// The reason for which each control was dropped, with the number of them.
    dropped: BTreeMap<&'static str, u64>,
}

impl RobotVehicle {
    /// Returns the program of a robot, which tells its vehicle what that is.
    pub(crate) fn new(
        world: Arc<RobotsWorld>,
        robot: EntityId,
        mut port: Box<dyn VehiclePort>,
    ) -> Self {
        port.set_description(cdr::encode(&describe(&world, robot)));
        Self { world, robot, port, open: None, control: None, dropped: BTreeMap::new() }
    }

    /// Sends the open percept, for the first time or again.
    fn send_percept(&mut self) {
        if let Some(open) = &mut self.open {
            self.port.send(&open.bytes);
            open.sent_at = Instant::now();
        }
    }

    /// Reads a control of the vehicle.
    ///
    /// # Errors
    /// With the reason for which it is dropped.
    fn read(&self, bytes: &[u8], open: &OpenPercept) -> Result<RobotControl, &'static str> {
        let message: RobotControlMessage = cdr::decode(bytes).map_err(|_| "vehicle-damaged")?;
        if message.robot != self.robot {
            return Err("vehicle-other-robot");
        }
        if message.cycle != open.cycle {
            return Err("vehicle-other-cycle");
        }
        let trip = match message.trip {
            0 => None,
            1 => Some(TripEvent::Started),
            2 => Some(TripEvent::Completed),
            _ => return Err("vehicle-impossible"),
        };
        let control = RobotControl {
            id: message.robot,
            cycle: message.cycle,
            action: message.action,
            trip,
            broadcast: message.has_broadcast.then_some(message.broadcast),
            memory: message.memory,
        };
        // What the server would refuse is told here, at the vehicle.
        let bytes = postcard::to_stdvec(&control).expect("controls are plain data");
        match self.world.read_control(open.cycle, self.robot, &bytes) {
            Ok(control) => Ok(control),
            Err(reason) => {
                tracing::warn!(
                    robot = self.robot,
                    cycle = open.cycle,
                    reason,
                    "a vehicle's control is impossible"
                );
                Err("vehicle-impossible")
            }
        }
    }
}

impl AgentProgram for RobotVehicle {
    fn start_cycle(&mut self, cycle: Cycle, percept: &[u8]) -> Result<u64, String> {
        let percept = read_percept(cycle, percept)?;
        self.control = None;
        let bytes = cdr::encode(&percept_message(&percept));
        self.open = Some(OpenPercept { cycle, bytes, sent_at: Instant::now() });
        self.send_percept();
        // A cycle of robots has no ticks.
        Ok(0)
    }

    fn is_done(&self) -> bool {
        self.control.is_some()
    }

    fn control(&self) -> Option<Vec<u8>> {
        let control = self.control.as_ref()?;
        Some(postcard::to_stdvec(control).expect("controls are plain data"))
    }

    fn activity(&self) -> AgentActivity {
        let name = match (&self.open, self.is_done()) {
            (_, true) => "done",
            (Some(_), false) => "vehicle",
            (None, false) => "rest",
        };
        AgentActivity { name, ..AgentActivity::default() }
    }

    fn drop_counts(&self) -> Vec<(String, u64)> {
        let mut dropped = self.dropped.clone();
        let overflows = self.port.overflow_count();
        if overflows > 0 {
            dropped.insert("vehicle-too-many", overflows);
        }
        dropped.into_iter().map(|(reason, count)| (reason.to_string(), count)).collect()
    }

    fn poll_interval(&self) -> Option<Duration> {
        (self.open.is_some() && !self.is_done()).then_some(POLL_INTERVAL)
    }

    fn poll(&mut self) {
        while let Some(bytes) = self.port.receive() {
            // An answer to a percept that was sent twice may come twice; the first one counts.
            let open = self.open.as_ref().filter(|_| self.control.is_none());
            let read = open.ok_or("vehicle-other-cycle").and_then(|open| self.read(&bytes, open));
            match read {
                Ok(control) => self.control = Some(control),
                Err(reason) => *self.dropped.entry(reason).or_default() += 1,
            }
        }
        let is_overdue = |open: &OpenPercept| open.sent_at.elapsed() >= RESEND_INTERVAL;
        if !self.is_done() && self.open.as_ref().is_some_and(is_overdue) {
            self.send_percept();
        }
    }
}

/// Returns the message of a percept.
fn percept_message(percept: &RobotPercept) -> RobotPerceptMessage {
    let contact = percept.contact;
    RobotPerceptMessage {
        robot: percept.id,
        cycle: percept.cycle,
        column: percept.at.0,
        row: percept.at.1,
        heading: percept.heading,
        contact_kind: contact.map_or(NO_CONTACT, |contact| contact.kind),
        contact_side: contact.map_or(NO_CONTACT, |contact| contact.side as u8),
        observations: percept.readings.iter().map(|reading| reading.observation).collect(),
        classes: percept.readings.iter().map(|reading| reading.class).collect(),
        heard_from: percept.heard.iter().map(|heard| heard.sender).collect(),
        heard_words: percept.heard.iter().map(|heard| heard.word).collect(),
        memory: percept.memory,
    }
}

/// Returns the description of a robot.
fn describe(world: &RobotsWorld, robot: EntityId) -> RobotDescription {
    let ty = world.type_of(robot);
    let Role::Robot(model) = &ty.role else {
        unreachable!("ids below the number of robots are robots")
    };
    let sensors = model.body.sensors.iter().map(|sensor| {
        let model = &sensor.model;
        SensorDescription {
            name: model.name.clone(),
            range_m: model.range_m,
            bearings_deg: model.bearings_deg.clone(),
            observations: model.observations.clone(),
            classes: model.distance_classes.clone(),
            class_edges_m: model.distance_edges_m.clone(),
        }
    });
    RobotDescription {
        robot,
        cycle_s: CYCLE_S,
        box_size_m: world.map.box_size_m,
        columns: world.map.width(),
        rows: world.map.height(),
        size_boxes: ty.size.0,
        actions: model.body.effector.actions.clone(),
        kinds: world.kinds.clone(),
        sensors: sensors.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::kernel::Simulation;
    use sidestep::scenario::Source;
    use sidestep::worlds::robots::{RobotsRun, robots_run};
    use std::collections::VecDeque;
    use std::sync::Mutex;

    /// What has gone in and out of a port in memory.
    #[derive(Default)]
    struct Exchange {
        description: Vec<u8>,
        percepts: Vec<Vec<u8>>,
        controls: VecDeque<Vec<u8>>,
    }

    struct MemoryPort(Arc<Mutex<Exchange>>);

    impl VehiclePort for MemoryPort {
        fn set_description(&mut self, bytes: Vec<u8>) {
            self.0.lock().expect("no panic").description = bytes;
        }

        fn send(&mut self, percept: &[u8]) {
            self.0.lock().expect("no panic").percepts.push(percept.to_vec());
        }

        fn receive(&mut self) -> Option<Vec<u8>> {
            self.0.lock().expect("no panic").controls.pop_front()
        }

        fn overflow_count(&self) -> u64 {
            2
        }
    }

    const FLOOR: &str = "format = 1\nworld = \"robots\"\nseed = 2\n[map]\nascii = \"\"\"\n.....\n.....\n\"\"\"\n\
                         [[robots]]\ncount = 2\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n";

    fn vehicle(run: &RobotsRun) -> (RobotVehicle, Arc<Mutex<Exchange>>) {
        let exchange = Arc::new(Mutex::new(Exchange::default()));
        let port = Box::new(MemoryPort(exchange.clone()));
        (RobotVehicle::new(run.world().clone(), 1, port), exchange)
    }

    fn start(vehicle: &mut RobotVehicle, run: &RobotsRun) -> RobotPercept {
        let percepts = run.world().percepts_in_cycle(run.state(), run.cycle());
        let percept = postcard::to_stdvec(&percepts[1]).expect("plain data");
        vehicle.start_cycle(run.cycle(), &percept).expect("a percept of this cycle");
        percepts[1].clone()
    }

    fn answer(cycle: Cycle) -> RobotControlMessage {
        RobotControlMessage {
            robot: 1,
            cycle,
            action: 1,
            trip: 2,
            has_broadcast: false,
            broadcast: 9,
            memory: [1, 2, 3, 4],
        }
    }

    #[test]
    fn a_vehicle_is_told_what_it_is_and_what_it_perceives_and_its_answer_is_the_control() {
        let run = robots_run(&Source::new("s.toml", FLOOR, ""), 1).expect("a scenario");
        let (mut vehicle, exchange) = vehicle(&run);
        let described: RobotDescription =
            cdr::decode(&exchange.lock().expect("no panic").description).expect("it was written");
        assert_eq!((described.robot, described.columns, described.rows), (1, 5, 2));
        assert_eq!((described.actions[0].as_str(), described.sensors.len()), ("forward", 1));
        let percept = start(&mut vehicle, &run);
        let sent = exchange.lock().expect("no panic").percepts.clone();
        let sent: RobotPerceptMessage = cdr::decode(&sent[0]).expect("it was written");
        assert_eq!((sent.robot, sent.cycle, (sent.column, sent.row)), (1, 0, percept.at));
        assert_eq!((sent.observations.len(), sent.contact_kind), (8, NO_CONTACT));
        vehicle.poll();
        assert!(!vehicle.is_done() && vehicle.poll_interval().is_some());
        exchange.lock().expect("no panic").controls.push_back(cdr::encode(&answer(0)));
        vehicle.poll();
        let control = vehicle.control().expect("it has answered");
        let control = run.world().read_control(0, 1, &control).expect("a control");
        assert_eq!((control.action, control.trip), (1, Some(TripEvent::Completed)));
        assert_eq!((control.broadcast, control.memory), (None, [1, 2, 3, 4]));
        assert!(vehicle.poll_interval().is_none(), "it has nothing to wait for");
    }

    #[test]
    fn answers_that_cannot_be_are_dropped_and_counted_by_their_reason() {
        let run = robots_run(&Source::new("s.toml", FLOOR, ""), 1).expect("a scenario");
        let (mut vehicle, exchange) = vehicle(&run);
        start(&mut vehicle, &run);
        let wrong = [
            b"nothing".to_vec(),
            cdr::encode(&RobotControlMessage { robot: 0, ..answer(0) }),
            cdr::encode(&answer(1)),
            cdr::encode(&RobotControlMessage { action: 9, ..answer(0) }),
            cdr::encode(&RobotControlMessage { trip: 3, ..answer(0) }),
            // There is no radio.
            cdr::encode(&RobotControlMessage { has_broadcast: true, ..answer(0) }),
        ];
        exchange.lock().expect("no panic").controls.extend(wrong);
        vehicle.poll();
        assert!(!vehicle.is_done());
        let count = |reason: &str, count| (reason.to_string(), count);
        let expected = [
            count("vehicle-damaged", 1),
            count("vehicle-impossible", 3),
            count("vehicle-other-cycle", 1),
            count("vehicle-other-robot", 1),
            count("vehicle-too-many", 2),
        ];
        assert_eq!(vehicle.drop_counts(), expected);
    }
}
