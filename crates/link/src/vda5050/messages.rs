//! The messages of VDA 5050 version 2.1.0 that a master control sends and reads, as JSON.
//!
//! Fields are named as in the standard's tables (VDA 5050, "Interface for the communication between automated guided
//! vehicles (AGV) and a master control", version 2.1.0, sections 6.6, 6.9, 6.10 and 6.14). What is read has all fields that
//! the standard requires, or it is refused; fields that are not known here are accepted, as the standard asks (6.4).

use serde::{Deserialize, Serialize};

/// The version of the protocol that is spoken.
pub const VERSION: &str = "2.1.0";

/// The level of a topic that stands for the major version.
pub const MAJOR_LEVEL: &str = "v2";

/// Most bytes of a message that is read: a state with a thousand nodes takes a tenth of that.
pub const MAX_MESSAGE_BYTES: usize = 1 << 20;

/// The first fields of each message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Header {
    /// Its number among the messages of its topic.
    pub header_id: u32,
    /// Time at which it was sent, ISO 8601 in UTC. It is passed on and never computed with.
    pub timestamp: String,
    /// Version of the protocol, e.g. `2.1.0`.
    pub version: String,
    /// Manufacturer of the vehicle.
    pub manufacturer: String,
    /// Serial number of the vehicle.
    pub serial_number: String,
}

/// A place in the frame of a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct NodePosition {
    /// Meters along the x axis of the map.
    pub x: f64,
    /// Meters along the y axis of the map.
    pub y: f64,
    /// Distance in meters from the place within which the vehicle has traversed the node.
    #[serde(rename = "allowedDeviationXY", skip_serializing_if = "Option::is_none")]
    pub allowed_deviation_xy_m: Option<f64>,
    /// Name of the map.
    pub map_id: String,
}

/// An action of a vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Action {
    /// Its name in the standard, e.g. `cancelOrder`.
    pub action_type: String,
    /// Its own number, by which its state is reported.
    pub action_id: String,
    /// What may be done beside it: `NONE`, `SOFT` or `HARD`.
    pub blocking_type: String,
    /// Its parameters; those sent here have none.
    pub action_parameters: Vec<serde_json::Value>,
}

/// A node of an order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Node {
    /// Its name: one for each place.
    pub node_id: String,
    /// Its number in the order, even.
    pub sequence_id: u32,
    /// Whether it is part of the base, and not of the horizon.
    pub released: bool,
    /// Its place.
    pub node_position: NodePosition,
    /// Actions there: none.
    pub actions: Vec<Action>,
}

/// An edge of an order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Edge {
    /// Its name: one for each pair of places.
    pub edge_id: String,
    /// Its number in the order, odd.
    pub sequence_id: u32,
    /// Whether it is part of the base, and not of the horizon.
    pub released: bool,
    /// The node at its start.
    pub start_node_id: String,
    /// The node at its end.
    pub end_node_id: String,
    /// Actions on it: none.
    pub actions: Vec<Action>,
}

/// An order, or an update of one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Order {
    /// The header.
    #[serde(flatten)]
    pub header: Header,
    /// The name of the order, which its updates keep.
    pub order_id: String,
    /// The number of the update, from 0.
    pub order_update_id: u32,
    /// Its nodes.
    pub nodes: Vec<Node>,
    /// The edges between them.
    pub edges: Vec<Edge>,
}

/// Actions that vehicles do at once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct InstantActions {
    /// The header.
    #[serde(flatten)]
    pub header: Header,
    /// The actions.
    pub actions: Vec<Action>,
}

/// Whether a vehicle is connected to the broker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum ConnectionState {
    /// It is.
    Online,
    /// It has left in good order.
    Offline,
    /// The broker has lost it: its last will.
    ConnectionBroken,
}

/// A vehicle's message on the topic `connection`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Connection {
    /// The header.
    #[serde(flatten)]
    pub header: Header,
    /// Whether it is connected.
    pub connection_state: ConnectionState,
}

/// A node that a vehicle still has to pass.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct NodeState {
    /// Its name.
    pub node_id: String,
    /// Its number in the order.
    pub sequence_id: u32,
    /// Whether the vehicle may go there.
    pub released: bool,
}

/// An edge that a vehicle still has to pass.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct EdgeState {
    /// Its name.
    pub edge_id: String,
    /// Its number in the order.
    pub sequence_id: u32,
    /// Whether the vehicle may go there.
    pub released: bool,
}

/// Where a vehicle takes itself to be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct AgvPosition {
    /// Whether it knows.
    pub position_initialized: bool,
    /// Meters along the x axis of the map.
    pub x: f64,
    /// Meters along the y axis of the map.
    pub y: f64,
    /// Heading in radians, counterclockwise from the x axis.
    pub theta: f64,
    /// Name of the map.
    pub map_id: String,
}

/// What has become of an action.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct ActionState {
    /// The action.
    pub action_id: String,
    /// `WAITING`, `INITIALIZING`, `RUNNING`, `PAUSED`, `FINISHED` or `FAILED`.
    pub action_status: String,
}

/// The charge of a vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct BatteryState {
    /// Percent.
    pub battery_charge: f64,
    /// Whether it is charging.
    pub charging: bool,
}

/// Who drives a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum OperatingMode {
    /// The master control.
    Automatic,
    /// The master control, at a speed that somebody else limits.
    SemiAutomatic,
    /// A person.
    Manual,
    /// A person who repairs it.
    Service,
    /// A person who shows it a path.
    TeachIn,
}

impl OperatingMode {
    /// Returns whether a vehicle carries out orders in this mode.
    pub fn accepts_orders(self) -> bool {
        matches!(self, Self::Automatic | Self::SemiAutomatic)
    }
}

/// How bad an error is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum ErrorLevel {
    /// It resolves by itself.
    Warning,
    /// A person has to help.
    Fatal,
}

/// An error of a vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct VehicleError {
    /// Its name, e.g. `orderError`.
    pub error_type: String,
    /// Words about it.
    #[serde(default)]
    pub error_description: String,
    /// How bad it is.
    pub error_level: ErrorLevel,
}

/// What keeps a vehicle from moving.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SafetyState {
    /// `AUTOACK`, `MANUAL`, `REMOTE` or `NONE`.
    pub e_stop: String,
    /// Whether something is in its protective field.
    pub field_violation: bool,
}

/// A vehicle's message on the topic `state`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct State {
    /// The header.
    #[serde(flatten)]
    pub header: Header,
    /// The order that it has, or has had; empty if none.
    pub order_id: String,
    /// The last update of that order that it has accepted.
    pub order_update_id: u32,
    /// The node that it has reached last; empty if it does not know.
    pub last_node_id: String,
    /// The number of that node in the order.
    pub last_node_sequence_id: u32,
    /// The nodes that it still has to pass.
    pub node_states: Vec<NodeState>,
    /// The edges that it still has to pass.
    pub edge_states: Vec<EdgeState>,
    /// Where it is, if it knows.
    #[serde(default)]
    pub agv_position: Option<AgvPosition>,
    /// Whether it moves.
    pub driving: bool,
    /// What has become of its actions.
    pub action_states: Vec<ActionState>,
    /// Its charge.
    pub battery_state: BatteryState,
    /// Who drives it.
    pub operating_mode: OperatingMode,
    /// Its errors.
    pub errors: Vec<VehicleError>,
    /// What keeps it from moving.
    pub safety_state: SafetyState,
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    pub(super) fn state() -> Value {
        json!({
            "headerId": 3, "timestamp": "2026-01-01T00:00:00.00Z", "version": "2.1.0", "manufacturer": "m",
            "serialNumber": "s", "orderId": "", "orderUpdateId": 0, "lastNodeId": "", "lastNodeSequenceId": 0,
            "nodeStates": [], "edgeStates": [], "driving": false, "actionStates": [],
            "batteryState": { "batteryCharge": 80.0, "charging": false, "reach": 7 },
            "operatingMode": "AUTOMATIC", "errors": [], "safetyState": { "eStop": "NONE", "fieldViolation": false },
            "somethingNew": { "of": "a later version" }
        })
    }

    #[test]
    fn a_state_is_read_with_fields_that_are_not_known_and_not_without_one_that_is_required() {
        let whole = state();
        assert!(serde_json::from_value::<State>(whole.clone()).is_ok());
        let object = whole.as_object().expect("an object");
        for key in object.keys().filter(|key| *key != "somethingNew") {
            let mut less = object.clone();
            less.remove(key);
            let read = serde_json::from_value::<State>(Value::Object(less));
            assert!(read.is_err(), "without {key}");
        }
    }

    #[test]
    fn numbers_that_the_standard_does_not_allow_are_refused() {
        for (key, wrong) in [
            ("headerId", json!(-1)),
            ("headerId", json!(4_294_967_296_u64)),
            ("orderUpdateId", json!(1.5)),
            ("operatingMode", json!("AUTO")),
            ("nodeStates", json!([{ "nodeId": "a" }])),
        ] {
            let mut state = state();
            state[key] = wrong;
            assert!(serde_json::from_value::<State>(state).is_err(), "{key}");
        }
    }

    #[test]
    fn the_words_of_enums_are_those_of_the_standard() {
        let words = json!([
            ConnectionState::Online,
            ConnectionState::ConnectionBroken,
            OperatingMode::SemiAutomatic,
            OperatingMode::TeachIn,
            ErrorLevel::Fatal
        ]);
        let expected = json!(["ONLINE", "CONNECTIONBROKEN", "SEMIAUTOMATIC", "TEACHIN", "FATAL"]);
        assert_eq!(words, expected);
    }
}
