//! The master control against vehicles that keep the standard, and a network that does not keep order.

use super::*;
use crate::vda5050::messages::OperatingMode;
use crate::vda5050::routes::{Predecessor, RouteNode, routes};
use proptest::prelude::*;
use serde_json::{Value, json};
use sidestep::kernel::view::Isometry2;
use sidestep::planners::{
    ActionModel, Agent, DependencyGraph, FreeSpace, GridPose, Instance, lacam,
};

const SILENCE: Duration = Duration::from_secs(30);
const RESEND: Duration = Duration::from_secs(5);

fn config() -> MasterConfig {
    MasterConfig {
        interface: "uagv".into(),
        manufacturer: "acme".into(),
        serial_prefix: "t".into(),
        map_id: "hall".into(),
        floor: FloorFrame { box_m: 1.0, plane: Isometry2::default() },
        order_prefix: "run".into(),
        horizon_nodes: 2,
        silence: SILENCE,
        resend: RESEND,
    }
}

/// Start and goal of a vehicle: column and row.
type StartAndGoal = ((u32, u32), (u32, u32));

/// Returns the routes of vehicles with these starts and goals in a hall with a pillar.
fn hall_routes(places: &[StartAndGoal]) -> Vec<Route> {
    let free = FreeSpace::new(5, 4, |col, row| (col, row) != (2, 1));
    let agents = places.iter().map(|&(start, goal)| Agent {
        size: 1,
        start: GridPose::new(start.0, start.1, 0),
        goal,
    });
    let instance = Instance::new(&free, ActionModel::Turns, agents.collect()).expect("a problem");
    // Any plan will do, and rings are refused.
    let config =
        lacam::LacamConfig { is_first_enough: true, may_rotate: false, ..Default::default() };
    let found = lacam::plan(&instance, config).expect("paths");
    let plan = found.plan.expect("a plan");
    let graph = DependencyGraph::new(&instance, &plan).expect("right");
    routes(&instance, &plan, &graph).expect("no ring")
}

/// Two vehicles one behind the other in a corridor, who both go two places on.
fn queue() -> Master {
    let node = |col, after| RouteNode { position: (col, 0), after };
    let before = |node| vec![Predecessor { vehicle: 1, node }];
    let last =
        Route { size: 1, nodes: vec![node(0, vec![]), node(1, before(1)), node(2, before(2))] };
    let first = Route { size: 1, nodes: vec![node(1, vec![]), node(2, vec![]), node(3, vec![])] };
    Master::new(config(), vec![last, first])
}

/// A vehicle that keeps the standard.
#[derive(Debug, Clone)]
struct Truck {
    serial: String,
    header: u32,
    connection_header: u32,
    order_id: String,
    update: u32,
    /// The nodes ahead: name, sequence number, released.
    ahead: Vec<(String, u32, bool)>,
    last_node: (String, u32),
    /// Whether it is between its last node and the next.
    is_between: bool,
    /// The node to which it drives; it stays there when the order is lost.
    target: Option<String>,
    errors: Vec<&'static str>,
}

impl Truck {
    fn new(number: usize, route: &Route) -> Self {
        Self {
            serial: format!("t{number}"),
            header: 0,
            connection_header: 0,
            order_id: String::new(),
            update: 0,
            ahead: Vec::new(),
            last_node: (route.nodes[0].id(), 0),
            is_between: false,
            target: None,
            errors: Vec::new(),
        }
    }

    fn topic(&self, name: &str) -> String {
        format!("uagv/v2/acme/{}/{name}", self.serial)
    }

    fn connection(&mut self, state: &str) -> (String, Value) {
        self.connection_header += 1;
        let message = json!({
            "headerId": self.connection_header, "timestamp": "t", "version": "2.1.0", "manufacturer": "acme",
            "serialNumber": self.serial, "connectionState": state
        });
        (self.topic("connection"), message)
    }

    fn state(&mut self) -> (String, Value) {
        let ahead = self.ahead.iter().map(|(id, sequence, released)| {
            json!({ "nodeId": id, "sequenceId": sequence, "released": released })
        });
        let errors =
            self.errors.iter().map(|name| json!({ "errorType": name, "errorLevel": "WARNING" }));
        let message = json!({
            "headerId": self.header, "timestamp": "t", "version": "2.1.0", "manufacturer": "acme",
            "serialNumber": self.serial, "orderId": self.order_id, "orderUpdateId": self.update,
            "lastNodeId": self.last_node.0, "lastNodeSequenceId": self.last_node.1,
            "nodeStates": ahead.collect::<Vec<_>>(), "edgeStates": [], "driving": self.is_between,
            "actionStates": [], "batteryState": { "batteryCharge": 50.0, "charging": false },
            "operatingMode": OperatingMode::Automatic, "errors": errors.collect::<Vec<_>>(),
            "safetyState": { "eStop": "NONE", "fieldViolation": false }
        });
        self.header += 1;
        (self.topic("state"), message)
    }

    /// Accepts or refuses an order (VDA 5050, figure 8).
    fn on_order(&mut self, order: &Order) {
        let nodes: Vec<(String, u32, bool)> = order
            .nodes
            .iter()
            .map(|node| (node.node_id.clone(), node.sequence_id, node.released))
            .collect();
        let first = (nodes[0].0.clone(), nodes[0].1);
        if order.order_id != self.order_id {
            if !self.ahead.is_empty() {
                self.errors = vec!["orderError"];
                return;
            }
            if first.0 != self.last_node.0 {
                self.errors = vec!["noRouteError"];
                return;
            }
            self.last_node = first;
        } else {
            if order.order_update_id <= self.update {
                return;
            }
            self.ahead.retain(|node| node.2);
            let end = self.ahead.last().map(|node| (node.0.clone(), node.1));
            if first != end.unwrap_or_else(|| self.last_node.clone()) {
                self.errors = vec!["orderUpdateError"];
                return;
            }
        }
        self.errors.clear();
        self.order_id.clone_from(&order.order_id);
        self.update = order.order_update_id;
        self.ahead.extend(nodes.into_iter().skip(1));
    }

    /// Goes on by half of a box.
    fn drive(&mut self) {
        let Some(next) = self.ahead.first().filter(|next| next.2).cloned() else { return };
        if !self.is_between {
            self.is_between = true;
            self.target = Some(next.0);
            return;
        }
        self.is_between = false;
        self.target = None;
        self.last_node = (next.0, next.1);
        self.ahead.remove(0);
    }

    fn restart(&mut self) {
        self.header = 0;
        self.order_id.clear();
        self.update = 0;
        self.ahead.clear();
        self.last_node.1 = 0;
        self.errors.clear();
    }

    /// The places that it covers.
    fn covered(&self) -> Vec<String> {
        let mut covered = vec![self.last_node.0.clone()];
        covered.extend(self.target.clone());
        covered
    }
}

/// A hall with its master control and a network that holds messages.
struct Hall {
    master: Master,
    trucks: Vec<Truck>,
    now: Duration,
    /// States on their way, which arrive in any order.
    states: Vec<(String, Value)>,
    /// Orders on their way to each truck.
    orders: Vec<Vec<Order>>,
}

impl Hall {
    fn new(routes: &[Route]) -> Self {
        let trucks: Vec<Truck> =
            routes.iter().enumerate().map(|(number, route)| Truck::new(number, route)).collect();
        let orders = vec![Vec::new(); trucks.len()];
        let master = Master::new(config(), routes.to_vec());
        let mut hall = Self { master, trucks, now: Duration::ZERO, states: Vec::new(), orders };
        for number in 0..hall.trucks.len() {
            hall.connect(number);
        }
        hall
    }

    fn hand_over(&mut self, (topic, message): (String, Value)) {
        self.master.on_message(&topic, message.to_string().as_bytes(), self.now);
        self.collect();
    }

    fn connect(&mut self, number: usize) {
        let message = self.trucks[number].connection("ONLINE");
        self.hand_over(message);
    }

    fn collect(&mut self) {
        for outgoing in self.master.take_outgoing() {
            if let OutgoingMessage::Order(order) = outgoing.message {
                self.orders[outgoing.vehicle].push(*order);
            }
        }
    }

    fn publish_state(&mut self, number: usize) {
        let state = self.trucks[number].state();
        self.states.push(state);
    }

    fn pass_time(&mut self, time: Duration) {
        self.now += time;
        self.master.on_time(self.now);
        self.collect();
    }

    /// Does one of the things that may happen.
    fn happen(&mut self, what: Happening) {
        let number = what.who % self.trucks.len();
        match what.kind {
            0..=3 => self.trucks[number].drive(),
            4..=6 => self.publish_state(number),
            7..=9 if !self.states.is_empty() => {
                let state = self.states.swap_remove(what.which % self.states.len());
                self.hand_over(state);
            }
            10 if !self.states.is_empty() => {
                let state = self.states[what.which % self.states.len()].clone();
                self.hand_over(state);
            }
            11 if !self.states.is_empty() => {
                self.states.swap_remove(what.which % self.states.len());
            }
            12..=14 if !self.orders[number].is_empty() => {
                let order = self.orders[number].remove(0);
                self.trucks[number].on_order(&order);
            }
            15 if !self.orders[number].is_empty() => {
                let order = self.orders[number][0].clone();
                self.trucks[number].on_order(&order);
            }
            16 if !self.orders[number].is_empty() => {
                self.orders[number].remove(0);
            }
            17 if what.which.is_multiple_of(4) => {
                // Orders that are on their way arrive all the same.
                self.trucks[number].restart();
                self.connect(number);
            }
            18 => self.pass_time(Duration::from_secs(what.which as u64 % 8)),
            19 => {
                let mut state = self.trucks[number].clone().state();
                state.1["lastNodeSequenceId"] = json!(what.which % 30);
                state.1["orderUpdateId"] = json!(what.which % 7);
                state.1["headerId"] = json!(self.trucks[number].header + 1);
                self.hand_over(state);
            }
            _ => {}
        }
    }

    /// Lets everything arrive until all have, for a number of rounds at most.
    fn settle(&mut self) {
        for _ in 0..400 {
            if self.master.is_complete() {
                return;
            }
            for number in 0..self.trucks.len() {
                for order in std::mem::take(&mut self.orders[number]) {
                    self.trucks[number].on_order(&order);
                }
                self.trucks[number].drive();
                self.publish_state(number);
            }
            for state in std::mem::take(&mut self.states) {
                self.hand_over(state);
            }
            self.check();
            self.pass_time(Duration::from_secs(2));
        }
    }

    /// Checks that no box is held by two, and no place is covered by two.
    fn check(&self) {
        let mut held = BTreeMap::new();
        let mut covered = BTreeMap::new();
        for number in 0..self.trucks.len() {
            let own = self.master.held_boxes(number);
            for at in &own {
                assert_eq!(held.insert(*at, number), None, "box {at:?} is held by two");
            }
            let names: Vec<String> = own.iter().map(|(col, row)| format!("{col}-{row}")).collect();
            let truck = &self.trucks[number];
            for place in truck.covered() {
                assert!(names.contains(&place), "{place} is not held: {truck:?}");
                assert_eq!(
                    covered.insert(place.clone(), number),
                    None,
                    "{place} is covered by two"
                );
            }
        }
    }
}

/// Something that may happen, by numbers.
#[derive(Debug, Clone, Copy)]
struct Happening {
    kind: u8,
    who: usize,
    which: usize,
}

fn happenings(kinds: std::ops::Range<u8>) -> impl Strategy<Value = Vec<Happening>> {
    let one = (kinds, 0..64_usize, 0..4096_usize);
    let one = one.prop_map(|(kind, who, which)| Happening { kind, who, which });
    prop::collection::vec(one, 0..400)
}

/// Starts and goals of some vehicles, none of which share a place.
fn places() -> impl Strategy<Value = Vec<StartAndGoal>> {
    let all: Vec<(u32, u32)> = (0..5)
        .flat_map(|col| (0..4).map(move |row| (col, row)))
        .filter(|&place| place != (2, 1))
        .collect();
    let shuffled = Just(all.clone()).prop_shuffle();
    (2..7_usize, shuffled.clone(), shuffled)
        .prop_map(|(count, starts, goals)| starts.into_iter().zip(goals).take(count).collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_box_is_released_to_two_whatever_arrives_and_all_arrive_in_the_end(
        places in places(),
        happenings in happenings(0..19),
    ) {
        let mut hall = Hall::new(&hall_routes(&places));
        for what in happenings {
            hall.happen(what);
            hall.check();
        }
        hall.settle();
        prop_assert!(hall.master.is_complete(), "{:#?}", hall.master.status(hall.now));
        for (truck, place) in hall.trucks.iter().zip(&places) {
            let goal = format!("{}-{}", place.1.0, place.1.1);
            prop_assert_eq!(&truck.last_node.0, &goal);
        }
    }

    /// States that are made up may claim what is not so, within what was released: the books of the master control stay
    /// without a conflict.
    #[test]
    fn no_box_is_released_to_two_though_vehicles_lie(
        places in places(),
        happenings in happenings(0..20),
    ) {
        let mut hall = Hall::new(&hall_routes(&places));
        for what in happenings {
            hall.happen(what);
            let mut held = BTreeMap::new();
            for number in 0..hall.trucks.len() {
                for at in hall.master.held_boxes(number) {
                    prop_assert_eq!(held.insert(at, number), None);
                }
            }
        }
    }
}

/// A hall of two in a queue, of whom the first was told its way and has it.
fn hall_of_two() -> Hall {
    let master = queue();
    let routes: Vec<Route> = master.vehicles.iter().map(|one| one.route.clone()).collect();
    let mut hall = Hall::new(&routes);
    for number in 0..2 {
        let state = hall.trucks[number].state();
        hall.hand_over(state);
    }
    hall
}

fn deliver_orders(hall: &mut Hall) {
    for number in 0..hall.trucks.len() {
        for order in std::mem::take(&mut hall.orders[number]) {
            hall.trucks[number].on_order(&order);
        }
    }
}

fn report(hall: &mut Hall, number: usize) {
    let state = hall.trucks[number].state();
    hall.hand_over(state);
}

#[test]
fn an_order_has_a_base_and_a_horizon_and_an_update_begins_where_the_base_ends() {
    let mut hall = hall_of_two();
    let order = hall.orders[0][0].clone();
    let nodes: Vec<(&str, u32, bool)> =
        order.nodes.iter().map(|node| (&*node.node_id, node.sequence_id, node.released)).collect();
    assert_eq!(nodes, [("0-0", 0, true), ("1-0", 2, false), ("2-0", 4, false)]);
    let edge = &order.edges[0];
    assert_eq!((&*edge.edge_id, edge.sequence_id, edge.released), ("0-0_1-0", 1, false));
    let position = &order.nodes[1].node_position;
    assert_eq!((position.x, position.y, &*position.map_id), (1.5, 0.5, "hall"));
    deliver_orders(&mut hall);
    report(&mut hall, 0);
    assert!(hall.orders[0].is_empty(), "nothing new is released to it");
    hall.trucks[1].drive();
    report(&mut hall, 1);
    assert!(hall.orders[0].is_empty(), "the first is still between two places");
    hall.trucks[1].drive();
    report(&mut hall, 1);
    let update = hall.orders[0][0].clone();
    let nodes: Vec<(&str, u32, bool)> =
        update.nodes.iter().map(|node| (&*node.node_id, node.sequence_id, node.released)).collect();
    assert_eq!((update.order_update_id, update.order_id), (1, order.order_id));
    assert_eq!(nodes, [("0-0", 0, true), ("1-0", 2, true), ("2-0", 4, false)]);
    assert_eq!(update.header.header_id, order.header.header_id + 1);
}

#[test]
fn an_order_that_no_state_confirms_is_sent_again_and_nothing_else() {
    let mut hall = hall_of_two();
    let sent = hall.orders[1][0].clone();
    hall.orders[1].clear();
    hall.pass_time(RESEND / 2);
    assert!(hall.orders[1].is_empty());
    hall.pass_time(RESEND / 2);
    let again = hall.orders[1][0].clone();
    assert_eq!((&again.order_id, again.order_update_id), (&sent.order_id, 0));
    assert_eq!((&again.nodes, &again.edges), (&sent.nodes, &sent.edges));
    assert_eq!(hall.master.status(hall.now).vehicles[1].resent, 1);
}

/// Changes the next state of a vehicle that drives, and returns why it is dropped.
fn dropped(change: impl Fn(&mut Value)) -> Vec<String> {
    let mut hall = hall_of_two();
    deliver_orders(&mut hall);
    hall.trucks[1].drive();
    hall.trucks[1].drive();
    report(&mut hall, 1);
    let mut state = hall.trucks[1].state();
    change(&mut state.1);
    let before = hall.master.held_boxes(1);
    hall.hand_over(state);
    assert_eq!(hall.master.held_boxes(1), before, "nothing of it is believed");
    let status = hall.master.status(hall.now);
    let warned = hall.master.take_remarks().iter().filter(|remark| remark.is_warning).count();
    assert!(warned > 0 || status.vehicles[1].dropped.is_empty(), "the first drop is told");
    status.vehicles[1].dropped.keys().cloned().collect()
}

#[test]
fn what_does_not_fit_is_dropped_with_its_reason() {
    assert_eq!(dropped(|_| {}), Vec::<String>::new());
    let at = |x: f64, map: &str| json!({ "x": x, "y": 0.5, "theta": 0.0, "mapId": map, "positionInitialized": true });
    for (key, value, reason) in [
        ("headerId", json!(0), "old_header"),
        ("orderId", json!("other"), "other_order"),
        ("orderUpdateId", json!(9), "unknown_update"),
        ("lastNodeSequenceId", json!(6), "not_in_base"),
        ("lastNodeSequenceId", json!(3), "not_in_base"),
        ("lastNodeSequenceId", json!(u32::MAX), "not_in_base"),
        ("lastNodeId", json!("9-9"), "not_in_base"),
        (
            "nodeStates",
            json!([{ "nodeId": "7-0", "sequenceId": 8, "released": true }]),
            "not_in_base",
        ),
        ("agvPosition", at(9.0, "hall"), "wrong_place"),
        ("agvPosition", at(2.5, "yard"), "wrong_place"),
        ("version", json!("1.1.0"), "wrong_version"),
        ("serialNumber", json!("t0"), "wrong_sender"),
        ("errors", json!(7), "malformed"),
    ] {
        assert_eq!(dropped(|state| state[key] = value.clone()), [reason], "{key} = {value}");
    }
    let back = |state: &mut Value| {
        state["lastNodeSequenceId"] = json!(0);
        state["lastNodeId"] = json!("1-0");
    };
    assert_eq!(dropped(back), ["goes_back"]);
}

#[test]
fn messages_of_nobody_in_the_plan_are_counted_and_the_first_is_told() {
    let mut hall = hall_of_two();
    hall.master.take_remarks();
    let state = hall.trucks[0].state().1.to_string();
    for topic in ["uagv/v2/acme/t7/state", "uagv/v2/other/t0/state", "nonsense"] {
        hall.master.on_message(topic, state.as_bytes(), hall.now);
    }
    let long = vec![b' '; MAX_MESSAGE_BYTES + 1];
    hall.master.on_message("uagv/v2/acme/t0/state", &long, hall.now);
    let status = hall.master.status(hall.now);
    assert_eq!(status.dropped["unknown_vehicle"], 3);
    assert_eq!(status.vehicles[0].dropped["too_long"], 1);
    assert_eq!(hall.master.take_remarks().len(), 2);
}

#[test]
fn a_vehicle_that_refuses_or_falls_silent_is_told_with_those_who_wait_for_it() {
    let mut hall = hall_of_two();
    deliver_orders(&mut hall);
    hall.master.take_remarks();
    hall.trucks[1].errors = vec!["orderError"];
    report(&mut hall, 1);
    let told: Vec<String> = hall.master.take_remarks().into_iter().map(|one| one.text).collect();
    assert!(told.iter().any(|text| text.contains("t0 cannot go on without it")), "{told:?}");
    assert_eq!(hall.master.status(hall.now).vehicles[0].state, "waits for t1");
    hall.trucks[1].errors.clear();
    report(&mut hall, 1);
    hall.master.take_remarks();
    for _ in 0..4 {
        hall.pass_time(SILENCE / 3);
        report(&mut hall, 0);
    }
    let told: Vec<String> = hall.master.take_remarks().into_iter().map(|one| one.text).collect();
    assert!(told.iter().any(|text| text.starts_with("is silent; t0")), "{told:?}");
}

#[test]
fn a_vehicle_elsewhere_or_with_an_order_of_somebody_else_gets_none_until_that_is_over() {
    let routes: Vec<Route> = queue().vehicles.iter().map(|one| one.route.clone()).collect();
    let mut hall = Hall::new(&routes);
    let mut busy = hall.trucks[1].state();
    busy.1["orderId"] = json!("theirs");
    busy.1["nodeStates"] = json!([{ "nodeId": "x", "sequenceId": 2, "released": true }]);
    hall.hand_over(busy);
    let mut elsewhere = hall.trucks[1].state();
    elsewhere.1["agvPosition"] =
        json!({ "x": 9.0, "y": 0.5, "theta": 0.0, "mapId": "hall", "positionInitialized": true });
    hall.hand_over(elsewhere);
    let mut manual = hall.trucks[1].state();
    manual.1["operatingMode"] = json!("MANUAL");
    hall.hand_over(manual);
    assert!(hall.orders[1].is_empty());
    let told: Vec<String> = hall.master.take_remarks().into_iter().map(|one| one.text).collect();
    for words in ["another order, `theirs`", "has to be at (1.50, 0.50) m", "mode Manual"] {
        assert!(told.iter().any(|text| text.contains(words)), "{words}: {told:?}");
    }
    report(&mut hall, 1);
    assert_eq!(hall.orders[1].len(), 1);
}

#[test]
fn a_vehicle_whose_order_somebody_cancels_gets_another_from_where_it_stands() {
    let mut hall = hall_of_two();
    deliver_orders(&mut hall);
    hall.trucks[1].drive();
    hall.trucks[1].ahead.clear();
    report(&mut hall, 1);
    let order = hall.orders[1][0].clone();
    assert_eq!((&*order.nodes[0].node_id, order.order_update_id), ("1-0", 0));
    assert_eq!(order.nodes[0].node_position.allowed_deviation_xy_m, Some(1.0));
    hall.settle();
    assert!(hall.master.is_complete());
    assert_eq!(hall.master.status(hall.now).vehicles[1].orders, 2);
}

#[test]
fn a_cancellation_goes_to_all_with_an_order_and_is_repeated_until_it_is_confirmed() {
    let mut hall = hall_of_two();
    deliver_orders(&mut hall);
    hall.master.cancel(hall.now);
    let sent = hall.master.take_outgoing();
    let topics: Vec<&str> = sent.iter().map(|one| &*one.topic).collect();
    assert_eq!(topics, ["uagv/v2/acme/t0/instantActions", "uagv/v2/acme/t1/instantActions"]);
    let OutgoingMessage::InstantActions(actions) = &sent[1].message else { panic!("{sent:?}") };
    let action = actions.actions[0].clone();
    assert_eq!((&*action.action_type, &*action.blocking_type), ("cancelOrder", "HARD"));
    let mut state = hall.trucks[1].state();
    state.1["actionStates"] = json!([{ "actionId": action.action_id, "actionType": "cancelOrder", "actionStatus": "FINISHED" }]);
    state.1["nodeStates"] = json!([]);
    hall.hand_over(state);
    assert_eq!(hall.master.unconfirmed_cancellations(), ["t0"]);
    hall.now += RESEND;
    hall.master.on_time(hall.now);
    let sent = hall.master.take_outgoing();
    assert_eq!(sent.len(), 1, "no orders, and nothing to the one that has confirmed: {sent:?}");
    assert_eq!(sent[0].topic, "uagv/v2/acme/t0/instantActions");
}

/// A route that passes column 1 of row 0 twice, whose last two nodes are released one after the other as another vehicle goes.
fn hall_with_a_return() -> Hall {
    let node = |position, after| RouteNode { position, after };
    let before = |node| vec![Predecessor { vehicle: 1, node }];
    let there_and_back = vec![
        node((0, 0), vec![]),
        node((1, 0), vec![]),
        node((2, 0), vec![]),
        node((1, 0), before(1)),
        node((1, 1), before(2)),
    ];
    let elsewhere = [(4, 3), (4, 2), (4, 1)].map(|position| node(position, vec![]));
    Hall::new(&[
        Route { size: 1, nodes: there_and_back },
        Route { size: 1, nodes: elsewhere.into() },
    ])
}

/// Drives to the next node, and reports it.
fn drive_on(hall: &mut Hall, number: usize) {
    hall.trucks[number].drive();
    hall.trucks[number].drive();
    report(hall, number);
}

#[test]
fn an_update_begins_nowhere_where_a_vehicle_may_stand_that_has_not_come_that_far() {
    let mut hall = hall_with_a_return();
    for number in 0..2 {
        report(&mut hall, number);
    }
    deliver_orders(&mut hall);
    report(&mut hall, 0);
    report(&mut hall, 1);
    drive_on(&mut hall, 1);
    deliver_orders(&mut hall);
    report(&mut hall, 0);
    drive_on(&mut hall, 0);
    assert_eq!(hall.trucks[0].last_node.0, "1-0");
    assert_eq!(hall.master.vehicles[0].released, 3, "the way back to this place");
    // The last node is free, and an update for it would begin at the place where the vehicle stands.
    drive_on(&mut hall, 1);
    assert!(hall.orders[0].is_empty(), "{:?}", hall.orders[0]);
    drive_on(&mut hall, 0);
    assert_eq!(hall.orders[0].len(), 1, "past it nothing can be mistaken");
    hall.settle();
    assert!(hall.master.is_complete());
}
