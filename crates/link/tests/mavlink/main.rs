//! Aircraft by MAVLink: vehicles that share no code with the plant, on the Python package `pymavlink`.
//!
//! The interpreter is that of SIDESTEP_PYTHON, else `python3`; where it or the package is not here these tests are skipped,
//! unless SIDESTEP_REQUIRE names `python`.

mod flights;
mod soak;
mod vehicles;

use serde_json::{Value, json};
use sidestep::worlds::airspace::flight::Pose2;
use sidestep_link::mavlink::{
    Firmware, MavlinkEndpoint, MavlinkError, MavlinkOptions, MavlinkPlant, VehicleKind,
    address_of_airplane,
};
use sidestep_link::plant::aircraft::{AircraftPlant, Authority, Setpoint, TrafficReport};
use sidestep_testing::has_modules;
use std::f64::consts::FRAC_PI_2;
use std::time::{Duration, Instant};
use vehicles::{
    Flight, Reference, TEST_TIMEOUT, Vehicles, count, fly, options, wait_for, wait_for_count,
};

/// What the vehicles are made of.
const PEER: &str = "pymavlink";

/// The mode of PX4 in which a vehicle holds.
const AUTO_LOITER: u32 = 4 << 16 | 3 << 24;

/// The altitude of all flights in meters, above the home of the vehicle.
const ALTITUDE_M: f64 = 60.0;

fn copter() -> Value {
    json!({ "kind": "copter", "autopilot": "ardupilot", "system": 1, "start": [0, 0, ALTITUDE_M, 90] })
}

/// Returns a flight from the east to the north, around a circle if it turns.
fn flight(plant: MavlinkPlant, at: [f64; 2], speed_m_s: f64, turn_rate_rad_s: f64) -> Flight {
    let start = Pose2 { at, heading_rad: 0.0 };
    let reference = Reference { start, speed_m_s, turn_rate_rad_s, altitude_m: ALTITUDE_M };
    Flight { plant, reference, distances_m: Vec::new() }
}

/// Returns the distance that nine of ten are below.
fn most_m(flight: &Flight) -> f64 {
    let mut sorted = flight.distances_m.clone();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() * 9 / 10]
}

#[test]
fn vehicles_of_each_kind_follow_lines_and_circles_in_the_wind() {
    if !has_modules(PEER) {
        return;
    }
    let common =
        json!({ "kind": "plane", "autopilot": "ardupilot", "wind": [3, -2], "noise": 0.3 });
    let vehicle = |fields: Value| {
        let mut vehicle = common.clone();
        let more = fields.as_object().expect("fields").clone();
        vehicle.as_object_mut().expect("fields").extend(more);
        vehicle
    };
    let mut vehicles = Vehicles::start(&json!([
        vehicle(
            json!({ "system": 1, "kind": "copter", "start": [0, 0, ALTITUDE_M, 90], "speed": 8 })
        ),
        vehicle(json!({ "system": 2, "kind": "copter", "start": [0, 500, ALTITUDE_M, 90],
                        "autopilot": "px4", "mode": AUTO_LOITER })),
        vehicle(json!({ "system": 3, "start": [0, 1000, ALTITUDE_M, 90], "speed": 15 })),
        vehicle(json!({ "system": 4, "start": [0, 2000, ALTITUDE_M, 90], "speed": 15 })),
    ]));
    let connect = |vehicle: usize, system_id: u8| {
        let options = options(vehicles.ports[vehicle]);
        // PX4 does not stay in its mode without setpoints.
        let takes_control = vehicle == 1;
        let options = MavlinkOptions { system_id: Some(system_id), takes_control, ..options };
        MavlinkPlant::connect(&options).expect("a vehicle")
    };
    let mut flights = vec![
        flight(connect(0, 1), [0.0, 0.0], 8.0, 0.15),
        flight(connect(1, 2), [0.0, 500.0], 8.0, 0.0),
        flight(connect(2, 3), [0.0, 1000.0], 15.0, 0.1),
        flight(connect(3, 4), [0.0, 2000.0], 15.0, 0.0),
    ];
    let kinds: Vec<_> = flights.iter().map(|flight| flight.plant.kind()).collect();
    let wing = VehicleKind::FixedWing;
    assert_eq!(kinds, [VehicleKind::Multirotor, VehicleKind::Multirotor, wing, wing]);
    assert_eq!(flights[1].plant.firmware(), Firmware::Px4);
    // Fixed wings were flying by themselves until now, which takes them from the beginning of their reference.
    for flight in &mut flights {
        let state = wait_for(&mut flight.plant, "a position", |state| state.age_s < 0.5);
        flight.reference.start = state.pose;
        flight.reference.start.heading_rad = 0.0;
    }
    fly(&mut flights, 20.0, 8.0);
    for (k, flight) in flights.iter().enumerate() {
        let most_m = most_m(flight);
        println!("vehicle {k}: {most_m:.2} m, {:?}", flight.plant.counts());
        let bound_m = if flight.plant.kind() == wing { 8.0 } else { 2.0 };
        assert!(most_m < bound_m, "vehicle {k}: {most_m} m, {:?}", vehicles.report(k));
        assert_eq!(count(&flight.plant, "refused_commands"), 0);
    }
    let copter = vehicles.report(0);
    // Nothing is left out, altitudes are above the home, and heartbeats are sent all the time.
    assert_eq!(
        (&copter["setpoint"]["type_mask"], &copter["setpoint"]["coordinate_frame"]),
        (&json!(0), &json!(6))
    );
    assert!(copter["told"]["heartbeats"].as_u64().expect("a count") >= 15, "{copter}");
    let plane = vehicles.report(2);
    // Four courses and two speeds in a second at most.
    assert!(plane["told"]["courses"].as_u64().expect("a count") <= 110, "{plane}");
    assert!(plane["told"]["commands"]["178"].as_u64().expect("a count") <= 55, "{plane}");
}

/// Stays where it is.
fn still(at: [f64; 2]) -> Setpoint {
    Setpoint {
        pose: Pose2 { at, heading_rad: FRAC_PI_2 },
        ground_speed_m_s: 0.0,
        turn_rate_rad_s: 0.0,
        altitude_m: ALTITUDE_M,
    }
}

/// Leads a vehicle to a place until something holds.
fn lead_until(plant: &mut MavlinkPlant, what: &str, holds: impl Fn(&mut MavlinkPlant) -> bool) {
    let until = Instant::now() + TEST_TIMEOUT;
    while !holds(plant) {
        assert!(Instant::now() < until, "waited for {what}: {:?}", plant.counts());
        plant.wait(Duration::from_millis(100));
        plant.lead(&still([0.0, 0.0])).expect("it is reached");
    }
}

fn authority(plant: &mut MavlinkPlant) -> Option<Authority> {
    plant.wait(Duration::from_millis(1)).map(|state| state.authority)
}

#[test]
fn control_is_what_the_vehicle_says_and_is_asked_for_once_where_that_was_told() {
    if !has_modules(PEER) {
        return;
    }
    let mut grounded = copter();
    grounded["ground"] = true.into();
    let mut loitering = copter();
    loitering["mode"] = 5.into();
    let mut vehicles = Vehicles::start(&json!([grounded, loitering, loitering]));
    let mut plant = vehicles.plant(0);
    let state = wait_for(&mut plant, "a position", |_| true);
    assert_eq!(state.authority, Authority::Ground);
    assert!((state.altitude_m - ALTITUDE_M).abs() < 0.01, "{state:?}");
    // North is where its nose points.
    assert!(state.pose.heading_rad.abs() < 0.01 && state.ground_speed_m_s < 0.01, "{state:?}");

    // By default it is left as it is.
    let mut plant = vehicles.plant(1);
    let report_setpoints = |vehicles: &mut Vehicles, vehicle: usize| {
        vehicles.report(vehicle)["told"]["setpoints"].as_u64().expect("a count")
    };
    for _ in 0..30 {
        plant.wait(Duration::from_millis(100));
        plant.lead(&still([0.0, 0.0])).expect("it is reached");
    }
    assert!(report_setpoints(&mut vehicles, 1) > 0);
    assert_eq!(vehicles.report(1)["modes"], json!([5]));
    // A pilot gives it away and takes it back.
    vehicles.set(&json!({ "vehicle": 1, "mode": 4 }));
    wait_for(&mut plant, "its node's control", |state| state.authority == Authority::Node);
    vehicles.set(&json!({ "vehicle": 1, "mode": 2 }));
    wait_for(&mut plant, "a pilot's control", |state| state.authority == Authority::Vehicle);
    // A pilot who has it is not disturbed.
    plant.hold("a test").expect("nothing to do");
    assert_eq!(vehicles.report(1)["modes"], json!([5, 4, 2]));

    // Refused once, it is not asked for again.
    vehicles.set(&json!({ "vehicle": 2, "deny": { "176": 2 } }));
    let takes_control = MavlinkOptions { takes_control: true, ..options(vehicles.ports[2]) };
    let mut plant = MavlinkPlant::connect(&takes_control).expect("a vehicle");
    lead_until(&mut plant, "a refusal", |plant| count(plant, "refused_commands") == 1);
    vehicles.set(&json!({ "vehicle": 2, "deny": {} }));
    for _ in 0..20 {
        plant.wait(Duration::from_millis(100));
        plant.lead(&still([0.0, 0.0])).expect("it is reached");
    }
    assert_eq!(vehicles.report(2)["told"]["commands"]["176"], 1);
    assert_eq!(authority(&mut plant), Some(Authority::Vehicle));
    // Another one is taken when it is asked.
    let mut plant = MavlinkPlant::connect(&takes_control).expect("a vehicle");
    lead_until(&mut plant, "control", |plant| authority(plant) == Some(Authority::Node));
    assert_eq!(vehicles.report(2)["modes"], json!([5, 4]));
}

#[test]
fn a_vehicle_holds_by_its_own_modes_and_refusals_are_told() {
    if !has_modules(PEER) {
        return;
    }
    let plane = json!({ "kind": "plane", "autopilot": "ardupilot", "system": 1,
                        "start": [0, 0, ALTITUDE_M, 90] });
    let mut vehicles = Vehicles::start(&json!([copter(), copter(), copter(), plane]));
    let is_led = |vehicles: &Vehicles, vehicle: usize| {
        let mut plant = vehicles.plant(vehicle);
        wait_for(&mut plant, "its node's control", |state| state.authority == Authority::Node);
        plant
    };
    // BRAKE.
    let mut plant = is_led(&vehicles, 0);
    plant.hold("a test").expect("it holds");
    plant.hold("a test").expect("it holds already");
    wait_for(&mut plant, "its own control", |state| state.authority == Authority::Vehicle);
    assert_eq!(vehicles.report(0)["modes"], json!([4, 17]));
    // Without BRAKE it loiters; without that, it is told that nothing helps.
    let mut plant = is_led(&vehicles, 1);
    vehicles.set(&json!({ "vehicle": 1, "deny": { "176": 4, "17": 2 } }));
    let refusal = plant.hold("a test").expect_err("it does not hold");
    for words in ["BRAKE", "MAV_RESULT_FAILED", "MAV_CMD_NAV_LOITER_UNLIM", "MAV_RESULT_DENIED"] {
        assert!(refusal.contains(words), "{refusal}");
    }
    // The next call does not disturb it at once.
    assert_eq!(plant.hold("a test"), Err(refusal));
    assert_eq!(vehicles.report(1)["told"]["commands"]["176"], 1);
    vehicles.set(&json!({ "vehicle": 1, "deny": { "176": 4 } }));
    let until = Instant::now() + TEST_TIMEOUT;
    while plant.hold("a test").is_err() {
        assert!(Instant::now() < until);
        plant.wait(Duration::from_millis(200));
    }
    assert_eq!(vehicles.report(1)["modes"], json!([4, 5]));
    // Nobody answers.
    let mut plant = is_led(&vehicles, 2);
    vehicles.set(&json!({ "vehicle": 2, "deaf": [176] }));
    let silence = plant.hold("a test").expect_err("nobody answers");
    assert!(silence.contains("not acknowledged"), "{silence}");
    assert_eq!(vehicles.report(2)["told"]["commands"]["176"], 3);
    assert_eq!(count(&plant, "unanswered_commands"), 1);
    // A fixed wing circles.
    let mut plant = is_led(&vehicles, 3);
    plant.hold("a test").expect("it holds");
    assert_eq!(vehicles.report(3)["modes"], json!([15, 12]));
}

#[test]
fn measurements_that_stop_stand_still_or_come_late_are_old() {
    if !has_modules(PEER) {
        return;
    }
    let mut vehicles = Vehicles::start(&json!([copter()]));
    let mut plant = vehicles.plant(0);
    wait_for(&mut plant, "a fresh position", |state| state.age_s < 0.3);
    vehicles.set(&json!({ "lag": 1.5 }));
    wait_for(&mut plant, "a late position", |state| state.age_s > 1.4);
    vehicles.set(&json!({ "lag": 0 }));
    wait_for(&mut plant, "a fresh position", |state| state.age_s < 0.3);
    vehicles.set(&json!({ "frozen": true }));
    wait_for(&mut plant, "a position that repeats", |state| state.age_s > 1.5);
    assert!(count(&plant, "bad_positions") > 5, "{:?}", plant.counts());
    vehicles.set(&json!({ "frozen": false }));
    wait_for(&mut plant, "a fresh position", |state| state.age_s < 0.3);
    vehicles.set(&json!({ "silent": true }));
    let silent = wait_for(&mut plant, "silence", |state| state.age_s > 2.0);
    // Who is in control is not known to have changed, so that it is asked to hold.
    assert_eq!(silent.authority, Authority::Node);
    wait_for_count(&mut plant, "silences", 1);
    vehicles.set(&json!({ "silent": false }));
    wait_for(&mut plant, "its node's control", |state| {
        state.authority == Authority::Node && state.age_s < 0.3
    });
}

#[test]
fn a_vehicle_that_boots_in_the_air_is_told_and_asked_again_for_its_messages() {
    if !has_modules(PEER) {
        return;
    }
    let mut vehicles = Vehicles::start(&json!([copter()]));
    let mut plant = vehicles.plant(0);
    wait_for(&mut plant, "a fresh position", |state| state.age_s < 0.3);
    let before = vehicles.report(0)["told"]["commands"]["511"].as_u64().expect("a count");
    assert_eq!(vehicles.ask(&json!({ "do": "reboot", "seconds": 4 })), "done");
    wait_for(&mut plant, "silence", |state| state.age_s > 2.5);
    wait_for(&mut plant, "a position after the boot", |state| {
        state.age_s < 0.5 && state.authority == Authority::Vehicle
    });
    assert_eq!(count(&plant, "reboots"), 1);
    let report = vehicles.report(0);
    assert!(report["told"]["commands"]["511"].as_u64().expect("a count") > before, "{report}");
    assert_eq!(report["modes"], json!([4, 0]), "control is not taken again");
}

#[test]
fn frames_are_signed_and_those_of_another_key_have_no_effect() {
    if !has_modules(PEER) {
        return;
    }
    let mut signed = copter();
    signed["key"] = "0a".repeat(32).into();
    let mut vehicles = Vehicles::start(&json!([signed, signed, copter()]));
    let with_key = |vehicle: usize, key: u8, patience: Duration| {
        let options = options(vehicles.ports[vehicle]);
        MavlinkPlant::connect(&MavlinkOptions { key: Some([key; 32]), patience, ..options })
    };
    let mut plant = with_key(0, 10, TEST_TIMEOUT).expect("the same key");
    wait_for(&mut plant, "a signed position", |state| state.authority == Authority::Node);
    plant.hold("a test").expect("it holds by signed commands");
    assert_eq!(count(&plant, "badly_signed"), 0);
    let patience = Duration::from_secs(4);
    let other = with_key(1, 11, patience).err().expect("another key").to_string();
    assert!(other.contains("another key"), "{other}");
    let bare = with_key(2, 10, patience).err().expect("no key").to_string();
    assert!(bare.contains("no signature"), "{bare}");
    // What is not signed is dropped among what is.
    assert_eq!(vehicles.ask(&json!({ "do": "foreign" })), "done");
    wait_for_count(&mut plant, "unsigned", 2);
    let report = vehicles.report(1);
    assert!(report["told"]["bad"].as_u64().expect("a count") > 0, "{report}");
}

#[test]
fn what_others_send_is_dropped_and_counted() {
    if !has_modules(PEER) {
        return;
    }
    let listen = MavlinkEndpoint::parse("udp:127.0.0.1:0").expect("an endpoint");
    let port = {
        // Another process may take the port in between; then the test fails.
        let socket = std::net::UdpSocket::bind("127.0.0.1:0").expect("a port");
        socket.local_addr().expect("an address").port()
    };
    let mut first = copter();
    first["connect"] = port.into();
    let mut second = copter();
    second["system"] = 2.into();
    second["connect"] = port.into();
    let mut vehicles = Vehicles::start(&json!([first, second]));
    let endpoint = MavlinkEndpoint { port, ..listen };
    let options = MavlinkOptions { endpoint, ..options(port) };
    let several = MavlinkPlant::connect(&options).err().expect("two vehicles");
    assert_eq!(several, MavlinkError::Several(vec![1, 2]));
    let third =
        MavlinkOptions { system_id: Some(3), patience: Duration::from_secs(2), ..options.clone() };
    let third = MavlinkPlant::connect(&third).err().expect("no such vehicle").to_string();
    assert!(third.contains("system 3") && third.contains("[1, 2]"), "{third}");
    let options = MavlinkOptions { system_id: Some(2), ..options };
    let mut plant = MavlinkPlant::connect(&options).expect("the second vehicle");
    assert_eq!(plant.system_id(), 2);
    wait_for(&mut plant, "a position", |state| state.authority == Authority::Node);
    // From another address, which is not listened to.
    wait_for_count(&mut plant, "other_addresses", 1);
    assert_eq!(vehicles.ask(&json!({ "do": "foreign", "vehicle": 1 })), "done");
    wait_for_count(&mut plant, "other_systems", 1);
    wait_for_count(&mut plant, "version_1", 1);
    wait_for_count(&mut plant, "unreadable", 1);
    assert_eq!(authority(&mut plant), Some(Authority::Node));
}

#[test]
fn traffic_is_shown_to_the_vehicle_and_taken_from_its_receiver() {
    if !has_modules(PEER) {
        return;
    }
    let mut vehicles = Vehicles::start(&json!([copter()]));
    let mut plant = vehicles.plant(0);
    wait_for(&mut plant, "a position", |_| true);
    let address = address_of_airplane(7).expect("an address");
    let report = TrafficReport {
        address,
        pose: Pose2 { at: [300.0, 400.0], heading_rad: FRAC_PI_2 },
        altitude_m: ALTITUDE_M,
        ground_speed_m_s: 12.5,
    };
    plant.show_traffic(&[report]).expect("it is reached");
    wait_for_count(&mut plant, "traffic_echoes", 1);
    let shown = &vehicles.report(0)["traffic"][0];
    // In millimeters above the sea, hundredths of a degree, centimeters per second.
    let expected = [
        ("ICAO_address", json!(address)),
        ("altitude", json!(548_000)),
        ("altitude_type", json!(1)),
        ("heading", json!(0)),
        ("hor_velocity", json!(1250)),
        ("flags", json!(31)),
        ("emitter_type", json!(14)),
    ];
    for (field, value) in expected {
        assert_eq!(shown[field], value, "{field}: {shown}");
    }
    // North by the size of the earth there: 400 m are 0.003598 degrees.
    let north = shown["lat"].as_f64().expect("units") * 1e-7 - vehicles::ORIGIN.latitude_deg;
    assert!((north - 0.003_598).abs() < 2e-6, "{north}");
    assert!(plant.take_traffic().is_empty(), "it is no news");
    let fields =
        json!([0x4B_1805, 474_000_000, 85_500_000, 1, 700_000, 9000, 5000, 0, 1, 0, 31, 1200]);
    assert_eq!(vehicles.ask(&json!({ "do": "adsb", "fields": fields })), "done");
    let until = Instant::now() + TEST_TIMEOUT;
    let mut heard = Vec::new();
    while heard.is_empty() {
        assert!(Instant::now() < until, "{:?}", plant.counts());
        plant.wait(Duration::from_millis(50));
        heard = plant.take_traffic();
    }
    assert_eq!((heard[0].address, heard[0].ground_speed_m_s), (0x4B_1805, 50.0));
    assert!((heard[0].altitude_m - 212.0).abs() < 0.01 && heard[0].pose.heading_rad.abs() < 1e-3);
}

#[test]
fn whoever_could_be_reached_by_others_needs_a_key_or_has_to_say_that_it_goes_without() {
    let endpoint = MavlinkEndpoint::parse("udpout:192.0.2.1:14550").expect("an endpoint");
    let outside = MavlinkOptions { endpoint, patience: Duration::from_millis(10), ..options(1) };
    let error = MavlinkPlant::connect(&outside).err().expect("it is not signed");
    assert!(matches!(error, MavlinkError::Insecure(_)), "{error}");
    let insecure = MavlinkOptions { is_insecure: true, ..outside.clone() };
    let error = MavlinkPlant::connect(&insecure).err().expect("nobody is there");
    assert!(!matches!(error, MavlinkError::Insecure(_)), "{error}");
    let signed = MavlinkOptions { key: Some([1; 32]), ..outside };
    let error = MavlinkPlant::connect(&signed).err().expect("nobody is there");
    assert!(!matches!(error, MavlinkError::Insecure(_)), "{error}");
}

#[test]
fn a_stream_that_breaks_is_connected_again() {
    if !has_modules(PEER) {
        return;
    }
    let mut streaming = copter();
    streaming["tcp"] = true.into();
    let mut vehicles = Vehicles::start(&json!([streaming]));
    let text = format!("tcp:127.0.0.1:{}", vehicles.ports[0]);
    let endpoint = MavlinkEndpoint::parse(&text).expect("an endpoint");
    let options = MavlinkOptions { endpoint, ..options(1) };
    let mut plant = MavlinkPlant::connect(&options).expect("a vehicle");
    wait_for(&mut plant, "a position", |state| state.authority == Authority::Node);
    assert_eq!(vehicles.ask(&json!({ "do": "hang up" })), "done");
    let until = Instant::now() + TEST_TIMEOUT;
    while vehicles.report(0)["connections"] != 2 {
        assert!(Instant::now() < until, "{:?}", plant.counts());
        plant.wait(Duration::from_millis(100));
    }
    wait_for(&mut plant, "a position after it", |state| state.age_s < 0.3);
    plant.hold("a test").expect("it holds");
    assert_eq!(vehicles.report(0)["modes"], json!([4, 17]));
}
