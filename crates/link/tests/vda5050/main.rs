//! Vehicles by VDA 5050: `mosquitto` between the program `sidestep-link` and vehicles in Python, which know nothing of it.
//!
//! They are skipped where `mosquitto`, or Python with `paho-mqtt`, is missing; `SIDESTEP_REQUIRE` with the words `mosquitto`
//! and `python` makes them fail instead. The published schemas are those of the folder `SIDESTEP_VDA5050_SCHEMAS`.

mod support;

use serde_json::json;
use sidestep::kernel::Seed;
use sidestep::kernel::stream::{Purpose, Streams};
use sidestep_testing::has_modules;
use std::time::{Duration, Instant};
use support::{Hall, Plant, PlantTask, broker};

/// Five robots that go to and fro around a block of shelves, past each other.
const ROBOTS: &str = "count = 5\nat = [[0, 0, 0], [1, 0, 0], [6, 2, 2], [5, 2, 2], [3, 0, 0]]\n\
    behaviour = { kind = \"shuttle\", a = [0, 0, 2, 3], b = [5, 0, 2, 3] }\n";

#[test]
fn vehicles_with_losses_a_restart_a_refusal_and_forged_states_carry_out_a_plan_in_its_order() {
    let Some(broker) = broker() else { return };
    if !has_modules("paho.mqtt.client") {
        return;
    }
    let hall = Hall::new(ROBOTS, 40);
    let faults =
        json!({ "1": { "restart_after": 5 }, "2": { "refuse_after": 4, "refuse_s": 1.0 } });
    let task = PlantTask { lost: 0.2, edge_s: [0.03, 0.15], faults, forges: true };
    let plant = Plant::start(&broker, &hall, &task);
    let mut job = hall.job(&broker);
    job.silence_s = 2.0;
    job.resend_s = 1.0;
    let ended = support::run(job);
    let result = plant.stop();
    assert_eq!(ended.code, 0, "{ended:?}");
    let status = ended.status.expect("a report");
    assert!(status.is_complete);
    hall.assert_carried_out(&result);
    assert_eq!(result["invalid"], json!([]), "messages");
    for name in ["order", "state", "connection"] {
        assert!(result["checked"][name].as_u64().unwrap_or(0) > 0, "{name}: {}", result["checked"]);
    }
    assert_eq!(result["wills"], 1, "the broker told the lost connection");
    assert!(status.vehicles[1].orders >= 2, "it has lost one: {status:?}");
    let logged = ended.logged.join("\n");
    for words in
        ["agv-1 has lost its connection", "agv-1 has lost its order", "agv-2 reports orderError"]
    {
        assert!(logged.contains(words), "{words} is not told:\n{logged}");
    }
    let dropped = support::all_drops(&status);
    for reason in [
        "malformed",
        "old_header",
        "other_order",
        "not_in_base",
        "wrong_version",
        "unknown_vehicle",
    ] {
        assert!(dropped.contains_key(reason), "{reason} is not counted: {dropped:?}");
    }
    assert!(status.vehicles.iter().any(|vehicle| vehicle.waits > 0), "{status:?}");
}

#[test]
fn a_vehicle_that_falls_silent_holds_those_behind_it_and_is_named() {
    let Some(broker) = broker() else { return };
    if !has_modules("paho.mqtt.client") {
        return;
    }
    let hall = Hall::new(ROBOTS, 40);
    let faults = json!({ "2": { "silent_after": 2 } });
    let task = PlantTask { lost: 0.0, edge_s: [0.02, 0.05], faults, forges: false };
    let plant = Plant::start(&broker, &hall, &task);
    let mut job = hall.job(&broker);
    job.silence_s = 1.5;
    job.give_up_s = Some(4.0);
    let ended = support::run(job);
    let result = plant.stop();
    assert_eq!(ended.code, 1, "{ended:?}");
    let error = ended.error.expect("a reason");
    assert!(error.cause.contains("agv-2 is silent"), "{error:?}");
    let logged = ended.logged.join("\n");
    assert!(logged.contains("agv-2 is silent"), "{logged}");
    assert!(logged.contains("cannot go on without it"), "{logged}");
    assert_eq!(result["conflicts"], json!([]));
    assert_eq!(result["invalid"], json!([]), "messages");
    let status = ended.status.expect("a report");
    assert!(!status.is_complete && !status.vehicles[2].is_complete, "{status:?}");
}

#[test]
fn when_it_is_interrupted_the_orders_of_all_vehicles_are_canceled() {
    let Some(broker) = broker() else { return };
    if !has_modules("paho.mqtt.client") {
        return;
    }
    let hall = Hall::new(ROBOTS, 40);
    let task = PlantTask { lost: 0.1, edge_s: [0.2, 0.4], faults: json!({}), forges: false };
    let plant = Plant::start(&broker, &hall, &task);
    let mut job = hall.job(&broker);
    job.resend_s = 0.5;
    let ended = support::run_until(job, |status| {
        status.vehicles.iter().map(|vehicle| vehicle.nodes_done).sum::<usize>() >= 3
    });
    let result = plant.stop();
    assert_eq!(ended.code, 130, "{ended:?}");
    assert!(!ended.logged.join("\n").contains("have not confirmed"), "{ended:?}");
    let vehicles = result["vehicles"].as_array().expect("vehicles");
    assert!(vehicles.iter().all(|vehicle| vehicle["canceled"].as_u64() >= Some(1)), "{result}");
    assert_eq!((&result["invalid"], &result["conflicts"]), (&json!([]), &json!([])));
}

/// `SIDESTEP_SOAK_S` is the number of seconds (60 if not set), `PROPTEST_RNG_SEED` the seed of the faults.
#[test]
#[ignore = "a minute, or as long as SIDESTEP_SOAK_S says: see .ci/soak"]
fn vehicles_with_random_faults_carry_out_plan_after_plan() {
    let Some(broker) = broker() else { return };
    if !has_modules("paho.mqtt.client") {
        return;
    }
    let variable = |name| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let lasts = Duration::from_secs(variable("SIDESTEP_SOAK_S").unwrap_or(60));
    let seed = variable("PROPTEST_RNG_SEED").unwrap_or(1);
    let streams = Streams::new(Seed(seed));
    let began = Instant::now();
    let mut orders = 0;
    let mut plans = 0;
    while began.elapsed() < lasts {
        let hall = Hall::new(ROBOTS, 40);
        // Each vehicle starts again, refuses or has no fault, by a draw.
        let mut faults = json!({});
        for vehicle in 0..5 {
            let [kind, after, lost, _] = streams.block(vehicle, plans, Purpose(1), 0);
            let after = 1 + after % 8;
            let fault = match kind % 3 {
                0 => json!({ "restart_after": after }),
                1 => json!({ "refuse_after": after, "refuse_s": 0.1 * f64::from(lost % 30) }),
                _ => json!({}),
            };
            faults[vehicle.to_string()] = fault;
        }
        let [lost, ..] = streams.block(5, plans, Purpose(1), 0);
        let lost = 0.01 * f64::from(lost % 40);
        let task = PlantTask { lost, edge_s: [0.03, 0.3], faults, forges: true };
        let plant = Plant::start(&broker, &hall, &task);
        let mut job = hall.job(&broker);
        job.silence_s = 3.0;
        job.resend_s = 1.0;
        let ended = support::run(job);
        let result = plant.stop();
        assert_eq!(ended.code, 0, "seed {seed}, plan {plans}, {task:?}: {ended:?}");
        let context = format!("seed {seed}, plan {plans}, {task:?}, {}", ended.logged.join("\n"));
        hall.assert_arrived(&result, &context);
        assert_eq!(result["invalid"], json!([]), "messages");
        let status = ended.status.expect("a report");
        orders += status.vehicles.iter().map(|vehicle| vehicle.orders).sum::<u64>();
        plans += 1;
    }
    println!("seed {seed}: {plans} plans of five vehicles, {orders} orders");
}

#[test]
fn what_cannot_be_dispatched_is_refused_with_a_remedy_before_anything_is_sent() {
    let refused = |change: &dyn Fn(&mut sidestep_session::fleet::DispatchJob), robots: &str| {
        let hall = Hall::new_unplanned(robots);
        let mut job = hall.job_at(1);
        change(&mut job);
        let ended = support::run(job);
        assert_eq!(ended.code, 2, "{ended:?}");
        let error = ended.error.expect("a reason");
        format!("{} {} {}", error.place, error.cause, error.remedy)
    };
    let planner = "planner = { method = \"lacam\" }\n";
    let planned = format!("{ROBOTS}{planner}");
    assert!(refused(&|_| {}, ROBOTS).contains("decides alone"));
    let elsewhere = refused(&|job| job.broker = "mqtt://10.9.8.7".into(), &planned);
    assert!(elsewhere.contains("--insecure"), "{elsewhere}");
    let no_address = refused(&|job| job.broker = "127.0.0.1".into(), &planned);
    assert!(no_address.contains("mqtt://HOST:PORT"), "{no_address}");
    let regime = "regime=\"effectors\"".to_string();
    let silent = refused(&|job| job.planned.overrides.push(regime.clone()), ROBOTS);
    assert!(silent.contains("decides alone"), "errors are left out of the plan: {silent}");
}
