//! One vehicle, as far as a master control knows it: its progress, its order, and why it may get none.
//!
//! Nothing that a vehicle says is believed: a message counts only if it fits what was sent. What can be believed is
//! monotone: a vehicle never gets behind a node that it has reached, and never gives a node back that was released.

use super::messages::{
    Connection, ConnectionState, ErrorLevel, Header, OperatingMode, State, VERSION, VehicleError,
};
use super::routes::{FloorFrame, Route};
use sidestep::kernel::terminal::escape_controls;
use std::collections::BTreeMap;
use std::time::Duration;

/// Names of errors by which vehicles refuse an order (VDA 5050, 6.6.4).
const REFUSALS: [&str; 4] = ["validationError", "orderError", "orderUpdateError", "noRouteError"];

/// Most orders of a vehicle that are kept to be taken up again: each comes of a start of the vehicle, whose states of
/// before are on their way for seconds.
const MAX_FORMER_ORDERS: usize = 8;

/// Most letters of a vehicle's text that are told.
const MAX_QUOTE_CHARS: usize = 80;

/// Why a message, or what it says about an order, is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DropReason {
    /// It is longer than any that is read.
    TooLong,
    /// It is no JSON, or lacks a field that the standard requires.
    Malformed,
    /// It is of a vehicle that has no part in the plan.
    UnknownVehicle,
    /// Its topic and its header name different vehicles.
    WrongSender,
    /// It is of another major version.
    WrongVersion,
    /// Its header is not newer than the last one.
    OldHeader,
    /// It is about another order.
    OtherOrder,
    /// It is about an update that was never sent.
    UnknownUpdate,
    /// It names a node that was not released, or another name for one that was.
    NotInBase,
    /// It names a node before one that was reached already.
    GoesBack,
    /// It says that the vehicle is elsewhere than at the node that it names.
    WrongPlace,
}

impl DropReason {
    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::TooLong => "too_long",
            Self::Malformed => "malformed",
            Self::UnknownVehicle => "unknown_vehicle",
            Self::WrongSender => "wrong_sender",
            Self::WrongVersion => "wrong_version",
            Self::OldHeader => "old_header",
            Self::OtherOrder => "other_order",
            Self::UnknownUpdate => "unknown_update",
            Self::NotInBase => "not_in_base",
            Self::GoesBack => "goes_back",
            Self::WrongPlace => "wrong_place",
        }
    }
}

/// A message that is dropped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dropped {
    /// Why.
    pub reason: DropReason,
    /// What was wrong, for people.
    pub detail: String,
}

impl Dropped {
    pub(super) fn new(reason: DropReason, detail: impl Into<String>) -> Self {
        Self { reason, detail: detail.into() }
    }
}

/// Counts of dropped messages by reason.
pub type DropCounts = BTreeMap<DropReason, u64>;

/// Returns the beginning of a text from outside, without what a terminal would execute.
pub(super) fn quote(text: &str) -> String {
    let short: String = text.chars().take(MAX_QUOTE_CHARS).collect();
    escape_controls(&short).to_string()
}

/// An order that was sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct OrderInWork {
    pub(super) id: String,
    /// The node of the route at which it begins: its sequence number is 0.
    pub(super) first: usize,
    /// Whether the vehicle may stand between this node and the next.
    pub(super) is_resumed: bool,
    /// The last update that was sent.
    pub(super) update: u32,
    /// Whether the vehicle has accepted that update.
    pub(super) is_accepted: bool,
    /// Whether the vehicle has accepted any.
    pub(super) was_accepted: bool,
    /// The first node of the last message.
    pub(super) message_first: usize,
    /// The last node of the base.
    pub(super) base: usize,
    /// The last node of the horizon.
    pub(super) horizon: usize,
    /// Time of the last message.
    pub(super) sent_at: Duration,
}

impl OrderInWork {
    /// Returns the sequence number of a node of the route.
    pub(super) fn sequence_id(&self, node: usize) -> u32 {
        2 * (node - self.first) as u32
    }

    /// Returns whether the end of the base is at another place than all nodes before it at which a vehicle may be that has
    /// reported a node. Else no update may begin there: a vehicle that has started again takes an update for an order, and
    /// begins it where it stands. On a route that passes a place twice, it would leave out what is between.
    pub(super) fn has_unique_end(&self, route: &Route, reported: usize) -> bool {
        let end = route.nodes[self.base].position;
        route.nodes[reported.min(self.base)..self.base].iter().all(|node| node.position != end)
    }

    /// Returns the node of the route with a sequence number, if it is part of the base.
    fn node_in_base(&self, sequence_id: u32) -> Option<usize> {
        let node = self.first + sequence_id as usize / 2;
        (sequence_id.is_multiple_of(2) && node <= self.base).then_some(node)
    }
}

/// An order to end at once, and whether it has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cancellation {
    pub(super) action_id: String,
    pub(super) is_confirmed: bool,
    pub(super) sent_at: Duration,
}

/// The connection of a vehicle, as its messages say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Link {
    Unheard,
    Known(ConnectionState),
}

/// Sums over a vehicle's run.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct VehicleSums {
    /// Times at which it stood at the end of its base and had to wait.
    pub(super) waits: u64,
    /// Time that it has waited so.
    pub(super) waited: Duration,
    pub(super) orders: u64,
    pub(super) updates: u64,
    /// Messages that were sent again, because nothing has confirmed them.
    pub(super) resent: u64,
    pub(super) drops: DropCounts,
}

/// A vehicle.
#[derive(Debug, Clone)]
pub struct Vehicle {
    pub(super) serial: String,
    pub(super) manufacturer: String,
    pub(super) map_id: String,
    pub(super) route: Route,
    pub(super) frame: FloorFrame,
    link: Link,
    /// Header and time stamp of the last message about the connection.
    last_connection: Option<(u32, String)>,
    /// Header of the last state.
    last_header: Option<u32>,
    heard_at: Option<Duration>,
    is_silent: bool,
    mode: Option<OperatingMode>,
    errors: Vec<VehicleError>,
    /// Why it cannot begin an order where it is.
    misfit: Option<String>,
    /// The node of the route that it has reached last.
    pub(super) progress: usize,
    /// The last node of its route that was ever released to it.
    pub(super) released: usize,
    pub(super) order: Option<OrderInWork>,
    /// The last orders before, which it was taken to have lost.
    former_orders: Vec<OrderInWork>,
    /// The node at which its next order begins, once it is known to be able to begin one.
    next_first: Option<usize>,
    pub(super) cancellation: Option<Cancellation>,
    pub(super) begun_at: Option<Duration>,
    pub(super) completed_at: Option<Duration>,
    waits_since: Option<Duration>,
    pub(super) sums: VehicleSums,
}

impl Vehicle {
    pub(super) fn new(
        serial: String,
        manufacturer: String,
        map_id: String,
        floor: FloorFrame,
        route: Route,
    ) -> Self {
        Self {
            serial,
            manufacturer,
            map_id,
            route,
            frame: floor,
            link: Link::Unheard,
            last_connection: None,
            last_header: None,
            heard_at: None,
            is_silent: false,
            mode: None,
            errors: Vec::new(),
            misfit: None,
            progress: 0,
            released: 0,
            order: None,
            former_orders: Vec::new(),
            next_first: None,
            cancellation: None,
            begun_at: None,
            completed_at: None,
            waits_since: None,
            sums: VehicleSums::default(),
        }
    }

    /// Returns whether it was ever heard, or missed: until then it is only awaited.
    pub(super) fn is_awaited(&self) -> bool {
        !self.is_silent && self.mode.is_none()
    }

    /// Returns whether it has reached the end of its route.
    pub fn is_complete(&self) -> bool {
        self.progress == self.route.last()
    }

    /// Returns the errors of its last state.
    pub(super) fn errors(&self) -> &[VehicleError] {
        &self.errors
    }

    /// Returns the center of its body at a node of its route, in meters.
    pub(super) fn center_m(&self, node: usize) -> [f64; 2] {
        self.frame.center_m(self.route.nodes[node].position, self.route.size)
    }

    /// Returns why it gets no order and no update; none if it gets them.
    pub(super) fn barrier(&self) -> Option<String> {
        if self.is_complete() {
            return None;
        }
        match self.link {
            Link::Known(ConnectionState::Offline) => return Some("has gone offline".into()),
            Link::Known(ConnectionState::ConnectionBroken) => {
                return Some("has lost its connection".into());
            }
            Link::Unheard | Link::Known(ConnectionState::Online) => {}
        }
        if self.is_silent {
            return Some("is silent".into());
        }
        if self.link == Link::Unheard {
            return Some("has not said that it is connected".into());
        }
        let Some(mode) = self.mode else { return Some("has not reported its state".into()) };
        if !mode.accepts_orders() {
            return Some(format!("is in the mode {mode:?}"));
        }
        let mut errors = self.errors.iter();
        if let Some(error) = errors.find(|error| error.error_level == ErrorLevel::Fatal) {
            return Some(describe(error));
        }
        self.misfit.clone()
    }

    /// Returns why it does not go on; none if it does. One that has refused an order gets the next all the same: it
    /// reports that until it has accepted one (VDA 5050, 6.6.4).
    pub(super) fn hold(&self) -> Option<String> {
        let refusal = self.errors.iter().find(|error| is_refusal(error));
        let refusal = refusal.filter(|_| self.order.is_some() && !self.is_complete());
        self.barrier().or_else(|| refusal.map(describe))
    }

    /// Returns the node at which a new order begins, if it can get one.
    pub(super) fn next_order_start(&self) -> Option<usize> {
        if self.order.is_some() { None } else { self.next_first }
    }

    /// Takes note that an order was sent.
    pub(super) fn begin_order(&mut self, order: OrderInWork) {
        self.begun_at.get_or_insert(order.sent_at);
        self.released = self.released.max(order.base);
        self.order = Some(order);
        self.next_first = None;
        self.sums.orders += 1;
    }

    /// Accepts a message about the connection; returns whether it says something new.
    ///
    /// # Errors
    /// When it is dropped.
    pub(super) fn accept_connection(&mut self, connection: Connection) -> Result<bool, Dropped> {
        self.check_sender(&connection.header)?;
        let header = (connection.header.header_id, connection.header.timestamp);
        // The broker keeps the last one, and hands it out with each subscription.
        if self.last_connection.as_ref() == Some(&header) {
            return Ok(false);
        }
        self.last_connection = Some(header);
        let is_new = self.link != Link::Known(connection.connection_state);
        self.link = Link::Known(connection.connection_state);
        if connection.connection_state == ConnectionState::Online {
            // It may have started again, and counts its messages anew.
            self.last_header = None;
        }
        Ok(is_new)
    }

    /// Accepts a state. What it says about the vehicle's order may be dropped, though the rest is accepted.
    ///
    /// # Errors
    /// When it is dropped, or what it says about the order is.
    pub(super) fn accept_state(&mut self, state: &State, now: Duration) -> Result<(), Dropped> {
        self.check_sender(&state.header)?;
        let header = state.header.header_id;
        if self.last_header.is_some_and(|last| !is_newer(header, last)) {
            let detail =
                format!("header {header} is not newer than {}", self.last_header.unwrap_or(0));
            return Err(Dropped::new(DropReason::OldHeader, detail));
        }
        self.last_header = Some(header);
        self.heard_at = Some(now);
        self.is_silent = false;
        self.mode = Some(state.operating_mode);
        self.errors.clone_from(&state.errors);
        self.confirm_cancellation(state);
        self.restore_former_order(state);
        match &self.order {
            Some(order) if order.id == state.order_id => self.accept_progress(state, now),
            Some(order) => {
                let detail =
                    format!("order `{}` in place of `{}`", quote(&state.order_id), order.id);
                let has_had_it = order.was_accepted || self.is_past_start(order, state);
                if has_had_it && !self.is_complete() {
                    self.on_lost_order(state);
                } else {
                    self.misfit = busy(state);
                }
                Err(Dropped::new(DropReason::OtherOrder, detail))
            }
            None => {
                self.find_start(state);
                Ok(())
            }
        }
    }

    fn check_sender(&self, header: &Header) -> Result<(), Dropped> {
        if header.serial_number != self.serial || header.manufacturer != self.manufacturer {
            let detail = format!(
                "the header names `{}/{}`",
                quote(&header.manufacturer),
                quote(&header.serial_number)
            );
            return Err(Dropped::new(DropReason::WrongSender, detail));
        }
        let major = |version: &str| version.split('.').next().map(str::to_string);
        if major(&header.version) != major(VERSION) {
            let detail = format!("version `{}` in place of {VERSION}", quote(&header.version));
            return Err(Dropped::new(DropReason::WrongVersion, detail));
        }
        Ok(())
    }

    fn confirm_cancellation(&mut self, state: &State) {
        let Some(cancellation) = &mut self.cancellation else { return };
        let mut own = state.action_states.iter().filter(|a| a.action_id == cancellation.action_id);
        // A vehicle that had nothing to end reports that it failed to.
        if own.any(|action| ["FINISHED", "FAILED"].contains(&action.action_status.as_str())) {
            cancellation.is_confirmed = true;
        }
    }

    /// Accepts what a state says about the present order.
    fn accept_progress(&mut self, state: &State, now: Duration) -> Result<(), Dropped> {
        let Some(order) = &self.order else { return Ok(()) };
        if state.order_update_id > order.update {
            let detail = format!("update {} of {} sent", state.order_update_id, order.update);
            return Err(Dropped::new(DropReason::UnknownUpdate, detail));
        }
        let reached = self.node_reached(order, state)?;
        self.check_nodes_ahead(order, state)?;
        self.check_place(state, reached)?;
        if let Some(order) = &mut self.order {
            order.was_accepted = true;
            order.is_accepted |= state.order_update_id == order.update;
        }
        self.misfit = None;
        self.progress = reached;
        if self.is_complete() {
            self.completed_at.get_or_insert(now);
        } else if self.is_canceled(state) {
            self.on_lost_order(state);
        }
        Ok(())
    }

    /// Returns whether a vehicle keeps the name of its order alone: somebody else has canceled it.
    fn is_canceled(&self, state: &State) -> bool {
        let Some(order) = &self.order else { return false };
        let has_all = state.order_update_id == order.update;
        has_all && self.progress < order.base && state.node_states.is_empty()
    }

    /// Returns the node of the route that a state says to be the last one reached.
    fn node_reached(&self, order: &OrderInWork, state: &State) -> Result<usize, Dropped> {
        let sequence_id = state.last_node_sequence_id;
        let node = order.node_in_base(sequence_id);
        let node = node.filter(|&node| self.route.nodes[node].id() == state.last_node_id);
        let Some(node) = node else {
            let id = quote(&state.last_node_id);
            let detail = format!("node `{id}` with sequence {sequence_id} was not released");
            return Err(Dropped::new(DropReason::NotInBase, detail));
        };
        if node < self.progress {
            let detail = format!("node {node} of its route, after {}", self.progress);
            return Err(Dropped::new(DropReason::GoesBack, detail));
        }
        Ok(node)
    }

    /// Checks that a vehicle takes no node for released that is not.
    fn check_nodes_ahead(&self, order: &OrderInWork, state: &State) -> Result<(), Dropped> {
        for ahead in state.node_states.iter().filter(|ahead| ahead.released) {
            let node = order.node_in_base(ahead.sequence_id);
            if node.is_none_or(|node| self.route.nodes[node].id() != ahead.node_id) {
                let id = quote(&ahead.node_id);
                let detail = format!("it takes node `{id}` for released");
                return Err(Dropped::new(DropReason::NotInBase, detail));
            }
        }
        Ok(())
    }

    /// Checks that a vehicle that has reached a node is there, or on its way to the next: a box off at most.
    fn check_place(&self, state: &State, reached: usize) -> Result<(), Dropped> {
        let Some(off_m) = self.distance_m(state, reached) else { return Ok(()) };
        if off_m <= self.frame.box_m {
            return Ok(());
        }
        let detail = format!("it has reached node {reached} of its route, and is {off_m:.2} m off");
        Err(Dropped::new(DropReason::WrongPlace, detail))
    }

    /// Returns the distance in meters from where a vehicle takes itself to be to the way from a node to the next; infinite
    /// on another map, none if it does not know.
    fn distance_m(&self, state: &State, node: usize) -> Option<f64> {
        let position = state.agv_position.as_ref().filter(|at| at.position_initialized)?;
        if position.map_id != self.map_id {
            return Some(f64::INFINITY);
        }
        let from = self.center_m(node);
        let to = self.center_m((node + 1).min(self.route.last()));
        Some(distance_to_segment([position.x, position.y], from, to))
    }

    /// Returns whether an idle vehicle is at a node of an order after its first: it has carried it out so far, and started
    /// again before a state has told that.
    fn is_past_start(&self, order: &OrderInWork, state: &State) -> bool {
        let mut after = order.first + 1..=self.released;
        let is_there = after.any(|node| self.route.nodes[node].id() == state.last_node_id);
        let start = self.route.nodes[order.first].id();
        is_there && state.last_node_id != start && state.node_states.is_empty()
    }

    /// Takes note that a vehicle has lost an order that it had: it has started again, or somebody has canceled it.
    fn on_lost_order(&mut self, state: &State) {
        self.keep_former_order();
        self.find_start(state);
    }

    fn keep_former_order(&mut self) {
        self.former_orders.extend(self.order.take());
        if self.former_orders.len() > MAX_FORMER_ORDERS {
            self.former_orders.remove(0);
        }
    }

    /// Takes up an order before again, if it turns out that the vehicle still carries it out: what said that it was lost was
    /// a state from before it had it.
    fn restore_former_order(&mut self, state: &State) {
        let mut formers = self.former_orders.iter();
        let former = formers.position(|former| former.id == state.order_id);
        let Some(former) = former.filter(|_| !state.node_states.is_empty()) else { return };
        let restored = self.former_orders.remove(former);
        self.keep_former_order();
        self.order = Some(restored);
        self.next_first = None;
    }

    /// Finds the node at which a new order begins: where the vehicle says to be, if that is where it can be.
    fn find_start(&mut self, state: &State) {
        self.next_first = None;
        self.misfit = busy(state);
        if self.misfit.is_some() {
            return;
        }
        let id = &state.last_node_id;
        let mut held = self.progress..=self.released;
        let found = held.find(|&node| self.route.nodes[node].id() == *id);
        // Before the first order a vehicle has other names for places, or none.
        let knows_nodes = self.sums.orders > 0 && !id.is_empty();
        let first = if knows_nodes { found } else { Some(self.progress) };
        let Some(first) = first else {
            self.misfit = Some(format!("says to be at node `{}`, where it cannot be", quote(id)));
            return;
        };
        if self.distance_m(state, first).is_some_and(|off_m| off_m > self.frame.box_m) {
            self.misfit = Some(self.misplacement(state, first));
            return;
        }
        self.next_first = Some(first);
    }

    /// Returns in words that a vehicle is not where its route begins.
    fn misplacement(&self, state: &State, first: usize) -> String {
        let place = |at: [f64; 2]| format!("({:.2}, {:.2}) m", at[0], at[1]);
        let at = state.agv_position.as_ref();
        let map = at.map_or(String::new(), |at| quote(&at.map_id));
        let is = at.map_or(String::new(), |at| place([at.x, at.y]));
        let expected = place(self.center_m(first));
        format!("is at {is} of map `{map}`, and has to be at {expected} of map `{}`", self.map_id)
    }

    /// Takes note of the time: whether the vehicle has become silent.
    pub(super) fn note_silence(&mut self, now: Duration, timeout: Duration) {
        let heard_at = self.heard_at.unwrap_or_default();
        if self.is_silent || now.saturating_sub(heard_at) <= timeout {
            return;
        }
        self.is_silent = true;
        // It may have started again without a word, and count anew. What it then says still has to fit.
        self.last_header = None;
    }

    /// Takes note whether it stands at the end of its base and has to wait.
    pub(super) fn note_wait(&mut self, now: Duration) {
        let stands = self.order.is_some() && self.progress == self.released;
        let waits = stands && !self.is_complete();
        match self.waits_since {
            None if waits => {
                self.sums.waits += 1;
                self.waits_since = Some(now);
            }
            Some(since) if !waits => {
                self.sums.waited += now.saturating_sub(since);
                self.waits_since = None;
            }
            _ => {}
        }
    }
}

/// Returns why a vehicle cannot take an order, if it has another one.
fn busy(state: &State) -> Option<String> {
    let is_busy = !state.node_states.is_empty();
    is_busy.then(|| format!("carries out another order, `{}`", quote(&state.order_id)))
}

fn describe(error: &VehicleError) -> String {
    let description = quote(&error.error_description);
    format!("reports {} {description}", quote(&error.error_type)).trim_end().to_string()
}

fn is_refusal(error: &VehicleError) -> bool {
    REFUSALS.contains(&error.error_type.as_str())
}

/// Returns whether a header comes after another one; they begin again at 0 after the largest number.
fn is_newer(header: u32, last: u32) -> bool {
    let ahead = header.wrapping_sub(last);
    ahead > 0 && ahead < 1 << 31
}

fn distance_to_segment(at: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let offset = [at[0] - from[0], at[1] - from[1]];
    let length2 = along[0] * along[0] + along[1] * along[1];
    let dot = offset[0] * along[0] + offset[1] * along[1];
    let part = if length2 > 0.0 { (dot / length2).clamp(0.0, 1.0) } else { 0.0 };
    let dx = offset[0] - part * along[0];
    let dy = offset[1] - part * along[1];
    (dx * dx + dy * dy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_wrap_around() {
        assert!(is_newer(1, 0) && is_newer(0, u32::MAX) && is_newer(5, u32::MAX - 5));
        assert!(!is_newer(0, 0) && !is_newer(0, 1) && !is_newer(u32::MAX, 0));
    }

    #[test]
    fn the_distance_to_a_way_is_that_to_its_nearest_point() {
        let distance = |at| distance_to_segment(at, [0.0, 0.0], [2.0, 0.0]);
        assert_eq!((distance([1.0, 0.5]), distance([-3.0, 4.0])), (0.5, 5.0));
        assert_eq!(distance_to_segment([3.0, 4.0], [0.0, 0.0], [0.0, 0.0]), 5.0);
    }
}
