//! The master control: releases to each vehicle the next nodes of its route as others report to have left them.
//!
//! It is a state machine: messages and the time go in, messages and remarks come out. What holds whatever comes in, in
//! whatever order, lost or twice: a box is released to a vehicle only after all vehicles that pass it before by the plan
//! have reported a node after it. So no box is ever released to two ([`Master::held_boxes`]).

use super::messages::{
    Action, Connection, Edge, Header, InstantActions, MAJOR_LEVEL, MAX_MESSAGE_BYTES, Node,
    NodePosition, Order, State, VERSION,
};
use super::routes::{FloorFrame, Route};
pub use super::vehicle::DropReason;
use super::vehicle::{Cancellation, DropCounts, Dropped, OrderInWork, Vehicle, quote};
use serde::de::DeserializeOwned;
use sidestep_session::fleet::{DispatchStatus, VehicleStatus};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Most nodes after the last one reached that are released at once: more make long messages and no vehicle faster.
const MAX_NODES_AHEAD: usize = 50;

/// The settings of a master control.
#[derive(Debug, Clone, PartialEq)]
pub struct MasterConfig {
    /// The first level of all topics, e.g. `uagv`.
    pub interface: String,
    /// The manufacturer of all vehicles.
    pub manufacturer: String,
    /// The serial number of a vehicle is this and the number of its robot.
    pub serial_prefix: String,
    /// The name of the map in which places are given.
    pub map_id: String,
    /// The boxes of the floor.
    pub floor: FloorFrame,
    /// The beginning of the names of all orders, which no earlier order has.
    pub order_prefix: String,
    /// Nodes after the base that a vehicle is told of: its horizon.
    pub horizon_nodes: usize,
    /// Time without a state after which a vehicle counts as silent.
    pub silence: Duration,
    /// Time after which an order is sent again that no state has confirmed.
    pub resend: Duration,
}

/// A message to a vehicle. The time stamp is still to be set.
#[derive(Debug, Clone, PartialEq)]
pub struct Outgoing {
    /// The number of the vehicle.
    pub vehicle: usize,
    /// The topic, with all levels.
    pub topic: String,
    /// The message.
    pub message: OutgoingMessage,
}

/// What is sent to vehicles.
#[derive(Debug, Clone, PartialEq)]
pub enum OutgoingMessage {
    /// An order, or an update.
    Order(Box<Order>),
    /// Actions at once.
    InstantActions(InstantActions),
}

impl OutgoingMessage {
    /// Returns the message as JSON, sent at a time (ISO 8601, UTC).
    pub fn into_json(self, timestamp: &str) -> String {
        let json = match self {
            Self::Order(mut order) => {
                order.header.timestamp = timestamp.to_string();
                serde_json::to_string(&order)
            }
            Self::InstantActions(mut actions) => {
                actions.header.timestamp = timestamp.to_string();
                serde_json::to_string(&actions)
            }
        };
        json.expect("messages are plain data")
    }
}

/// A remark for the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// Whether something is wrong.
    pub is_warning: bool,
    /// The serial number of the vehicle; empty if none is concerned.
    pub serial: String,
    /// What has happened.
    pub text: String,
}

/// Numbers of the next message of each topic of a vehicle.
#[derive(Debug, Clone, Copy, Default)]
struct NextHeaders {
    order: u32,
    instant_actions: u32,
}

/// The master control of some vehicles.
#[derive(Debug, Clone)]
pub struct Master {
    config: MasterConfig,
    vehicles: Vec<Vehicle>,
    by_serial: BTreeMap<String, usize>,
    next_headers: Vec<NextHeaders>,
    /// Why each vehicle got nothing when it was looked at last.
    holds: Vec<Option<String>>,
    /// The errors of each vehicle that were told.
    told_errors: Vec<Vec<String>>,
    /// Drops of messages that are of no vehicle.
    stray_drops: DropCounts,
    outgoing: Vec<Outgoing>,
    remarks: Vec<Remark>,
    is_cancelled: bool,
}

impl Master {
    /// Creates the master control of a vehicle for each route.
    pub fn new(config: MasterConfig, routes: Vec<Route>) -> Self {
        let mut vehicles = Vec::with_capacity(routes.len());
        let mut by_serial = BTreeMap::new();
        for (number, route) in routes.into_iter().enumerate() {
            let serial = format!("{}{number}", config.serial_prefix);
            by_serial.insert(serial.clone(), number);
            let manufacturer = config.manufacturer.clone();
            let map_id = config.map_id.clone();
            vehicles.push(Vehicle::new(serial, manufacturer, map_id, config.floor, route));
        }
        let count = vehicles.len();
        Self {
            config,
            vehicles,
            by_serial,
            next_headers: vec![NextHeaders::default(); count],
            holds: vec![None; count],
            told_errors: vec![Vec::new(); count],
            stray_drops: DropCounts::new(),
            outgoing: Vec::new(),
            remarks: Vec::new(),
            is_cancelled: false,
        }
    }

    /// Returns the topics to listen to, those of unknown vehicles among them.
    pub fn topics(&self) -> [String; 2] {
        let all = |topic: &str| format!("{}/{MAJOR_LEVEL}/+/+/{topic}", self.config.interface);
        [all("state"), all("connection")]
    }

    /// Accepts a message that has arrived `now` after the start.
    pub fn on_message(&mut self, topic: &str, payload: &[u8], now: Duration) {
        let Some(levels) = TopicLevels::parse(topic) else {
            let detail = format!("topic `{}`", quote(topic));
            self.drop_stray(Dropped::new(DropReason::UnknownVehicle, detail));
            return;
        };
        let vehicle = self.by_serial.get(levels.serial).copied();
        let is_ours = levels.manufacturer == self.config.manufacturer;
        let Some(vehicle) = vehicle.filter(|_| is_ours) else {
            let detail = format!("{}/{}", quote(levels.manufacturer), quote(levels.serial));
            self.drop_stray(Dropped::new(DropReason::UnknownVehicle, detail));
            return;
        };
        let accepted = match levels.name {
            "connection" => self.on_connection(vehicle, payload),
            _ => self.on_state(vehicle, payload, now),
        };
        if let Err(dropped) = accepted {
            self.drop_of(vehicle, dropped);
        }
        self.advance(now);
    }

    fn on_connection(&mut self, vehicle: usize, payload: &[u8]) -> Result<(), Dropped> {
        let connection: Connection = parse(payload)?;
        let state = connection.connection_state;
        if self.vehicles[vehicle].accept_connection(connection)? {
            self.remark(vehicle, false, format!("is {state:?}"));
        }
        Ok(())
    }

    fn on_state(&mut self, vehicle: usize, payload: &[u8], now: Duration) -> Result<(), Dropped> {
        let state: State = parse(payload)?;
        let had_order = self.vehicles[vehicle].order.is_some();
        let was_complete = self.vehicles[vehicle].is_complete();
        let accepted = self.vehicles[vehicle].accept_state(&state, now);
        self.tell_errors(vehicle);
        if had_order && self.vehicles[vehicle].order.is_none() && !self.is_cancelled {
            let id = quote(&state.order_id);
            self.remark(vehicle, true, format!("has lost its order: it reports `{id}`"));
        }
        if self.vehicles[vehicle].is_complete() && !was_complete {
            self.remark(vehicle, false, "is at the end of its route".into());
        }
        accepted
    }

    /// Takes note that time has passed.
    pub fn on_time(&mut self, now: Duration) {
        for vehicle in &mut self.vehicles {
            vehicle.note_silence(now, self.config.silence);
        }
        self.advance(now);
    }

    /// Asks all vehicles to end their orders, and sends no more of them.
    pub fn cancel(&mut self, now: Duration) {
        self.is_cancelled = true;
        for number in 0..self.vehicles.len() {
            let vehicle = &self.vehicles[number];
            let Some(order) = &vehicle.order else { continue };
            if vehicle.is_complete() {
                continue;
            }
            let action_id = format!("{}-cancel", order.id);
            let cancellation = Cancellation { action_id, is_confirmed: false, sent_at: now };
            self.vehicles[number].cancellation = Some(cancellation);
            self.send_cancellation(number);
        }
    }

    /// Returns the serial numbers of the vehicles that have not confirmed that their order has ended.
    pub fn unconfirmed_cancellations(&self) -> Vec<String> {
        let open = self.vehicles.iter().filter(|vehicle| {
            vehicle.cancellation.as_ref().is_some_and(|cancellation| !cancellation.is_confirmed)
        });
        open.map(|vehicle| vehicle.serial.clone()).collect()
    }

    /// Returns whether all vehicles have reached the ends of their routes.
    pub fn is_complete(&self) -> bool {
        self.vehicles.iter().all(Vehicle::is_complete)
    }

    /// Returns the number of nodes that all vehicles have reached together.
    pub fn nodes_reached(&self) -> usize {
        self.vehicles.iter().map(|vehicle| vehicle.progress).sum()
    }

    /// Takes the messages to be sent.
    pub fn take_outgoing(&mut self) -> Vec<Outgoing> {
        std::mem::take(&mut self.outgoing)
    }

    /// Takes the remarks for the log.
    pub fn take_remarks(&mut self) -> Vec<Remark> {
        std::mem::take(&mut self.remarks)
    }

    /// Returns the boxes (column, row) that a vehicle may cover: of the last node that it has reached, and of all nodes after it
    /// that were released to it. No box is held by two.
    pub fn held_boxes(&self, vehicle: usize) -> BTreeSet<(u32, u32)> {
        let Vehicle { route, progress, released, .. } = &self.vehicles[vehicle];
        (*progress..=*released).flat_map(|node| route.boxes(node)).collect()
    }

    /// Returns the present state of all vehicles, `now` after the start.
    pub fn status(&self, now: Duration) -> DispatchStatus {
        let vehicles = 0..self.vehicles.len();
        DispatchStatus {
            elapsed_s: now.as_secs_f64(),
            is_complete: self.is_complete(),
            vehicles: vehicles.map(|number| self.vehicle_status(number, now)).collect(),
            dropped: named(&self.stray_drops),
        }
    }

    fn vehicle_status(&self, number: usize, now: Duration) -> VehicleStatus {
        let vehicle = &self.vehicles[number];
        let end = vehicle.completed_at.unwrap_or(now);
        let time = vehicle.begun_at.map(|begun_at| end.saturating_sub(begun_at).as_secs_f64());
        VehicleStatus {
            serial: vehicle.serial.clone(),
            state: self.state_text(number),
            is_complete: vehicle.is_complete(),
            nodes_done: vehicle.progress,
            nodes: vehicle.route.last(),
            waits: vehicle.sums.waits,
            waited_s: vehicle.sums.waited.as_secs_f64(),
            time_s: time,
            orders: vehicle.sums.orders,
            updates: vehicle.sums.updates,
            resent: vehicle.sums.resent,
            errors: vehicle.errors().iter().map(|error| quote(&error.error_type)).collect(),
            dropped: named(&vehicle.sums.drops),
        }
    }

    /// Returns what a vehicle does, in words.
    fn state_text(&self, number: usize) -> String {
        let vehicle = &self.vehicles[number];
        if vehicle.is_complete() {
            return "done".into();
        }
        if let Some(hold) = vehicle.hold() {
            return hold;
        }
        if vehicle.progress < vehicle.released {
            return "drives".into();
        }
        let before: Vec<&str> =
            self.blockers(number).iter().map(|&other| &*self.vehicles[other].serial).collect();
        if before.is_empty() {
            "waits for orders".into()
        } else {
            format!("waits for {}", before.join(", "))
        }
    }

    /// Sends what can be sent, and tells who is held and goes on.
    fn advance(&mut self, now: Duration) {
        for number in 0..self.vehicles.len() {
            if !self.is_cancelled && self.vehicles[number].barrier().is_none() {
                self.send_next(number, now);
            }
            self.vehicles[number].note_wait(now);
        }
        for number in 0..self.vehicles.len() {
            self.resend_cancellation(number, now);
            self.tell_hold(number);
        }
    }

    /// Sends a vehicle a new order, an update, or the last message again.
    fn send_next(&mut self, number: usize, now: Duration) {
        let vehicle = &self.vehicles[number];
        if vehicle.is_complete() {
            return;
        }
        let base = self.releasable(number);
        let horizon = (base + self.config.horizon_nodes).min(vehicle.route.last());
        if let Some(first) = vehicle.next_order_start() {
            let order = OrderInWork {
                id: format!("{}-{number}-{}", self.config.order_prefix, vehicle.sums.orders),
                first,
                is_resumed: vehicle.sums.orders > 0,
                update: 0,
                is_accepted: false,
                was_accepted: false,
                message_first: first,
                base: base.max(first),
                horizon,
                sent_at: now,
            };
            self.vehicles[number].begin_order(order);
            self.send_order(number);
            return;
        }
        let resend = self.config.resend;
        let vehicle = &mut self.vehicles[number];
        let Some(order) = &mut vehicle.order else { return };
        if !order.is_accepted {
            // One update at a time: a vehicle refuses one that does not begin where its base ends.
            if now.saturating_sub(order.sent_at) >= resend {
                order.sent_at = now;
                vehicle.sums.resent += 1;
                self.send_order(number);
            }
            return;
        }
        let can_begin = order.has_unique_end(&vehicle.route, vehicle.progress);
        if base > order.base && can_begin {
            order.message_first = order.base;
            order.base = base;
            order.horizon = horizon;
            order.update += 1;
            order.is_accepted = false;
            order.sent_at = now;
            vehicle.released = base;
            vehicle.sums.updates += 1;
            self.send_order(number);
        }
    }

    /// Returns the last node of a vehicle's route up to which all that has to be passed by others has been.
    fn releasable(&self, number: usize) -> usize {
        let vehicle = &self.vehicles[number];
        let most = (vehicle.progress + MAX_NODES_AHEAD).min(vehicle.route.last());
        let mut node = vehicle.released;
        while node < most && self.open_predecessors(number, node + 1).next().is_none() {
            node += 1;
        }
        node
    }

    /// Returns the vehicles that still have to pass something before a node of a vehicle's route is released.
    fn open_predecessors(&self, number: usize, node: usize) -> impl Iterator<Item = usize> {
        let after = &self.vehicles[number].route.nodes[node].after;
        let open =
            after.iter().filter(|before| self.vehicles[before.vehicle].progress < before.node);
        open.map(|before| before.vehicle)
    }

    /// Returns the vehicles for which a vehicle waits, or will have to at the end of its base.
    fn blockers(&self, number: usize) -> BTreeSet<usize> {
        let vehicle = &self.vehicles[number];
        if vehicle.released == vehicle.route.last() {
            return BTreeSet::new();
        }
        self.open_predecessors(number, vehicle.released + 1).collect()
    }

    /// Returns the vehicles that cannot go to their ends before one does, by rising number.
    fn dependents(&self, number: usize) -> BTreeSet<usize> {
        let mut found = BTreeSet::from([number]);
        loop {
            let is_new = |other: &usize| {
                !found.contains(other) && !self.blockers(*other).is_disjoint(&found)
            };
            let new: Vec<usize> = (0..self.vehicles.len()).filter(is_new).collect();
            if new.is_empty() {
                break;
            }
            found.extend(new);
        }
        found.remove(&number);
        found
    }

    /// Sends the present message of a vehicle's order.
    fn send_order(&mut self, number: usize) {
        let vehicle = &self.vehicles[number];
        let Some(order) = &vehicle.order else { return };
        let all = order.message_first..=order.horizon;
        let nodes: Vec<Node> = all.clone().map(|node| order_node(vehicle, order, node)).collect();
        let edges = all.skip(1).map(|node| order_edge(vehicle, order, node)).collect();
        let order = Order {
            header: self.header(number, self.next_headers[number].order),
            order_id: order.id.clone(),
            order_update_id: order.update,
            nodes,
            edges,
        };
        let next = &mut self.next_headers[number].order;
        *next = next.wrapping_add(1);
        self.push_outgoing(number, "order", OutgoingMessage::Order(Box::new(order)));
    }

    fn resend_cancellation(&mut self, number: usize, now: Duration) {
        let Some(cancellation) = &mut self.vehicles[number].cancellation else { return };
        if cancellation.is_confirmed
            || now.saturating_sub(cancellation.sent_at) < self.config.resend
        {
            return;
        }
        cancellation.sent_at = now;
        self.send_cancellation(number);
    }

    fn send_cancellation(&mut self, number: usize) {
        let Some(cancellation) = &self.vehicles[number].cancellation else { return };
        let action = Action {
            action_type: "cancelOrder".into(),
            action_id: cancellation.action_id.clone(),
            blocking_type: "HARD".into(),
            action_parameters: Vec::new(),
        };
        let header = self.header(number, self.next_headers[number].instant_actions);
        let next = &mut self.next_headers[number].instant_actions;
        *next = next.wrapping_add(1);
        let message =
            OutgoingMessage::InstantActions(InstantActions { header, actions: vec![action] });
        self.push_outgoing(number, "instantActions", message);
    }

    fn header(&self, number: usize, header_id: u32) -> Header {
        Header {
            header_id,
            timestamp: String::new(),
            version: VERSION.into(),
            manufacturer: self.config.manufacturer.clone(),
            serial_number: self.vehicles[number].serial.clone(),
        }
    }

    fn push_outgoing(&mut self, number: usize, name: &str, message: OutgoingMessage) {
        let MasterConfig { interface, manufacturer, .. } = &self.config;
        let serial = &self.vehicles[number].serial;
        let topic = format!("{interface}/{MAJOR_LEVEL}/{manufacturer}/{serial}/{name}");
        self.outgoing.push(Outgoing { vehicle: number, topic, message });
    }

    fn drop_stray(&mut self, dropped: Dropped) {
        let count = self.stray_drops.entry(dropped.reason).or_default();
        *count += 1;
        if *count == 1 {
            let text = format!("dropped a message ({}): {}", dropped.reason.name(), dropped.detail);
            self.remarks.push(Remark { is_warning: true, serial: String::new(), text });
        }
    }

    /// Counts a dropped message of a vehicle, and tells the first one of each reason.
    fn drop_of(&mut self, number: usize, dropped: Dropped) {
        let count = self.vehicles[number].sums.drops.entry(dropped.reason).or_default();
        *count += 1;
        if *count == 1 {
            let text = format!("dropped a message ({}): {}", dropped.reason.name(), dropped.detail);
            self.remark(number, true, text);
        }
    }

    /// Tells the errors that a vehicle has not reported before.
    fn tell_errors(&mut self, number: usize) {
        let errors = self.vehicles[number].errors();
        let now: Vec<String> = errors.iter().map(|error| error.error_type.clone()).collect();
        if now == self.told_errors[number] {
            return;
        }
        let words = errors.iter().map(|error| {
            let description = quote(&error.error_description);
            format!("{} ({:?}) {description}", quote(&error.error_type), error.error_level)
        });
        let words: Vec<String> = words.collect();
        let text = if words.is_empty() {
            "reports no errors anymore".into()
        } else {
            format!("reports {}", words.join("; "))
        };
        self.told_errors[number] = now;
        self.remark(number, !words.is_empty(), text);
    }

    /// Tells that a vehicle is held, and who waits for it, or that it goes on.
    fn tell_hold(&mut self, number: usize) {
        let hold = self.vehicles[number].hold();
        if hold == self.holds[number] {
            return;
        }
        let was_held = self.holds[number].is_some();
        self.holds[number].clone_from(&hold);
        match hold {
            // All are held until they have reported for the first time.
            Some(_) if self.vehicles[number].is_awaited() => {}
            Some(reason) => {
                let others = self.dependents(number);
                let names: Vec<&str> =
                    others.iter().map(|&other| &*self.vehicles[other].serial).collect();
                let waiting = if names.is_empty() {
                    String::new()
                } else {
                    format!("; {} cannot go on without it", names.join(", "))
                };
                self.remark(number, true, format!("{reason}{waiting}"));
            }
            None if was_held => self.remark(number, false, "goes on".into()),
            None => {}
        }
    }

    fn remark(&mut self, number: usize, is_warning: bool, text: String) {
        let serial = self.vehicles[number].serial.clone();
        self.remarks.push(Remark { is_warning, serial, text });
    }
}

/// The levels of a topic after the interface and the version.
struct TopicLevels<'a> {
    manufacturer: &'a str,
    serial: &'a str,
    name: &'a str,
}

impl<'a> TopicLevels<'a> {
    fn parse(topic: &'a str) -> Option<Self> {
        let mut levels = topic.rsplit('/');
        let name = levels.next()?;
        let serial = levels.next()?;
        let manufacturer = levels.next()?;
        Some(Self { manufacturer, serial, name })
    }
}

fn parse<T: DeserializeOwned>(payload: &[u8]) -> Result<T, Dropped> {
    if payload.len() > MAX_MESSAGE_BYTES {
        let detail = format!("{} bytes, of {MAX_MESSAGE_BYTES} at most", payload.len());
        return Err(Dropped::new(DropReason::TooLong, detail));
    }
    serde_json::from_slice(payload)
        .map_err(|error| Dropped::new(DropReason::Malformed, quote(&error.to_string())))
}

fn order_node(vehicle: &Vehicle, order: &OrderInWork, node: usize) -> Node {
    let center_m = vehicle.center_m(node);
    // A vehicle that starts again between two nodes is within one box of the last (VDA 5050, 6.6.3.1, second option).
    let is_start = order.is_resumed && node == order.first;
    Node {
        node_id: vehicle.route.nodes[node].id(),
        sequence_id: order.sequence_id(node),
        released: node <= order.base,
        node_position: NodePosition {
            x: center_m[0],
            y: center_m[1],
            allowed_deviation_xy_m: is_start.then_some(vehicle.frame.box_m),
            map_id: vehicle.map_id.clone(),
        },
        actions: Vec::new(),
    }
}

/// Returns the edge that leads to a node.
fn order_edge(vehicle: &Vehicle, order: &OrderInWork, node: usize) -> Edge {
    let start = vehicle.route.nodes[node - 1].id();
    let end = vehicle.route.nodes[node].id();
    Edge {
        edge_id: format!("{start}_{end}"),
        sequence_id: order.sequence_id(node) - 1,
        released: node <= order.base,
        start_node_id: start,
        end_node_id: end,
        actions: Vec::new(),
    }
}

/// Returns counts by the names of their reasons.
fn named(counts: &DropCounts) -> BTreeMap<String, u64> {
    counts.iter().map(|(reason, &count)| (reason.name().to_string(), count)).collect()
}

#[cfg(test)]
mod tests;
