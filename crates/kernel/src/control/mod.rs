//! External control: the observations of agents, and the orders that a caller gives them.
//!
//! ```text
//! teams() ──> Space, Space, ...           inputs and outputs of all agents that are alike
//! observe(team) ──> one array per space   of the frozen state, before a cycle
//! order(agents, values)                   checked, written to the state, recorded in the table `orders`
//! replay_orders(OrderLog)                 the same orders again, each before its cycle
//! ```
//!
//! Alternatively, agents decide in processes of their own; their action in a cycle is then a message that only their
//! world understands:
//!
//! ```text
//! submit_controls(agents, bytes)          checked, written to the state, recorded in the table `controls`
//! replay_controls(ControlLog)             the same controls again, each before its cycle
//! ```
//!
//! An order is part of the state as soon as it is given: a checkpoint has it, and so has the digest. An externally
//! controlled run is therefore a function of its scenario, its seed and its tables `orders` and `controls`.

mod controls;
mod error;
mod orders;
mod rows;
mod space;
mod team;

pub use controls::{ControlLog, ControlTableReader};
pub use error::OrderError;
pub use orders::OrderLog;
pub use rows::OrderTableReader;
pub use space::{BufferMut, ValueDomain, ValueSpace};
pub use team::{AgentTeam, AgentTeams, MultiAgentOrder, Order};

pub(crate) use controls::{ControlRow, control_rows, controls_table};
pub(crate) use orders::{OrderRow, orders_table};
