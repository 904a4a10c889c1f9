//! Vehicles of a test, in Python.

use serde_json::{Value, json};
use sidestep::worlds::airspace::flight::{Pose2, Surface};
use sidestep_link::mavlink::{
    FlightLimits, GeoFrame, MavlinkEndpoint, MavlinkOptions, MavlinkPlant, Origin,
};
use sidestep_link::plant::aircraft::{AircraftPlant, AircraftState, Setpoint};
use sidestep_testing::{JsonProcess, python};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Longer than anything here takes, on a machine that has much else to do.
pub(crate) const TEST_TIMEOUT: Duration = Duration::from_secs(120);

/// Where the origin of the tests' plane is.
pub(crate) const ORIGIN: Origin =
    Origin { latitude_deg: 47.397_742, longitude_deg: 8.545_594, altitude_m: None };

/// The vehicles of a test. They end with it.
pub(crate) struct Vehicles {
    process: JsonProcess<Value>,
    pub(crate) ports: Vec<u16>,
}

impl Vehicles {
    pub(crate) fn start(vehicles: &Value) -> Self {
        let config = json!({
            "origin": [ORIGIN.latitude_deg, ORIGIN.longitude_deg],
            "vehicles": vehicles,
        });
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mavlink/vehicle.py");
        let mut command = Command::new(python());
        command.arg(script).arg(config.to_string());
        let mut vehicles = Self { process: JsonProcess::start(command), ports: Vec::new() };
        let ports = vehicles.next();
        vehicles.ports = serde_json::from_value(ports).expect("ports");
        vehicles
    }

    fn next(&self) -> Value {
        self.process.next("an answer of the vehicles", TEST_TIMEOUT)
    }

    pub(crate) fn ask(&mut self, request: &Value) -> Value {
        self.process.write(request);
        self.next()
    }

    pub(crate) fn report(&mut self, vehicle: usize) -> Value {
        self.ask(&json!({ "do": "report", "vehicle": vehicle }))
    }

    /// Changes fields of the first vehicle.
    pub(crate) fn set(&mut self, fields: &Value) {
        let mut request = fields.clone();
        request["do"] = "set".into();
        assert_eq!(self.ask(&request), "done");
    }

    /// Connects to a vehicle.
    pub(crate) fn plant(&self, vehicle: usize) -> MavlinkPlant {
        MavlinkPlant::connect(&options(self.ports[vehicle])).expect("a vehicle")
    }
}

/// Returns how a vehicle is reached that listens at a port.
pub(crate) fn options(port: u16) -> MavlinkOptions {
    MavlinkOptions {
        endpoint: MavlinkEndpoint::parse(&format!("udpout:127.0.0.1:{port}")).expect("an endpoint"),
        system_id: None,
        own_system_id: 245,
        key: None,
        is_insecure: false,
        geo: GeoFrame::new(Surface::Plane, Some(ORIGIN)).expect("an origin"),
        takes_control: false,
        limits: FlightLimits {
            max_speed_m_s: 25.0,
            min_airspeed_m_s: 10.0,
            max_acceleration_m_s2: 4.0,
        },
        patience: TEST_TIMEOUT,
    }
}

/// A flight that is known beforehand: straight on, or in a circle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reference {
    pub(crate) start: Pose2,
    pub(crate) speed_m_s: f64,
    pub(crate) turn_rate_rad_s: f64,
    pub(crate) altitude_m: f64,
}

impl Reference {
    pub(crate) fn setpoint(&self, time_s: f64) -> Setpoint {
        Setpoint {
            pose: self.start.step(self.speed_m_s, self.turn_rate_rad_s, time_s),
            ground_speed_m_s: self.speed_m_s,
            turn_rate_rad_s: self.turn_rate_rad_s,
            altitude_m: self.altitude_m,
        }
    }
}

/// A plant on a reference, and its distances from there in meters.
pub(crate) struct Flight {
    pub(crate) plant: MavlinkPlant,
    pub(crate) reference: Reference,
    pub(crate) distances_m: Vec<f64>,
}

/// Flies all of them for a time, ten setpoints a second, and keeps their distances after a settling time.
pub(crate) fn fly(flights: &mut [Flight], seconds: f64, settling_s: f64) {
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < seconds {
        for flight in &mut *flights {
            let state = flight.plant.wait(Duration::from_millis(2));
            let now_s = start.elapsed().as_secs_f64();
            flight.plant.lead(&flight.reference.setpoint(now_s)).expect("it is reached");
            let Some(state) = state else { continue };
            if now_s > settling_s {
                let there = flight.reference.setpoint(now_s - state.age_s).pose.at;
                let at = state.pose.at;
                flight.distances_m.push((at[0] - there[0]).hypot(at[1] - there[1]));
            }
        }
        std::thread::sleep(Duration::from_millis(90));
    }
}

/// Waits for a state of a plant.
pub(crate) fn wait_for(
    plant: &mut MavlinkPlant,
    what: &str,
    holds: impl Fn(&AircraftState) -> bool,
) -> AircraftState {
    let until = Instant::now() + TEST_TIMEOUT;
    let mut last = None;
    while Instant::now() < until {
        last = plant.wait(Duration::from_millis(50));
        if let Some(state) = last.filter(|state| holds(state)) {
            return state;
        }
    }
    panic!("waited for {what}: {last:?}, {:?}", plant.counts())
}

pub(crate) fn count(plant: &MavlinkPlant, name: &str) -> u64 {
    let counts = plant.counts();
    let found = counts.iter().find(|count| count.0 == name);
    found.unwrap_or_else(|| panic!("no count {name}: {counts:?}")).1
}

/// Waits until a count is at least a number.
pub(crate) fn wait_for_count(plant: &mut MavlinkPlant, name: &str, least: u64) {
    let until = Instant::now() + TEST_TIMEOUT;
    while count(plant, name) < least {
        assert!(Instant::now() < until, "{name}: {:?}", plant.counts());
        plant.wait(Duration::from_millis(50));
    }
}
