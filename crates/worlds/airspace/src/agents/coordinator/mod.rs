//! The process integrated mechanism: coordinators whose state migrates.

mod aboard;
mod check;
mod election;
mod epoch;
mod host;
mod messages;
mod party;
mod passenger;
mod seat;
mod state;
mod tour;

pub use party::Host;
use passenger::{Here, Passenger, Rules, Ship, Step};
