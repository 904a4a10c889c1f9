#![deny(clippy::disallowed_methods)]
//! The simulation kernel of every world: no files, no sockets, no wall clock.
//!
//! ```text
//! World (immutable) + State (columns)         one cycle, run by W workers
//!   claim : perceive, decide, claim   │ barrier │   cycle.rs knows the order
//!   join  : claims -> conflict groups │ barrier │   conflict.rs
//!   act   : groups act                │ barrier │   workers.rs knows the threads
//!
//! Run<World>: the one simulation; Simulation: its object-safe interface for all other crates
//! ```
//!
//! Guarantees of the modules:
//! - [`stream`]: a draw is a function of (seed, entity, cycle, purpose, index) alone.
//! - [`workers`], [`cycle`]: the same bits for every number of workers.
//! - [`digest`], [`checkpoint`]: a state has one digest, and continues bit for bit.
//! - [`control`]: the observations of agents, and external orders, checked and recorded.
//! - [`batch`]: many simulations of one scenario at once, the same bits for every number of workers.
//! - [`series`]: the metrics over time, which depend on the cycle alone.
//! - [`interrupt`]: a cycle that takes long can be abandoned.
//! - [`view`]: the scenery and the frames of any world; reading them changes no run.
//! - [`math`], [`distr`], [`geometry`], [`geodesy`]: numbers that are the same on every platform.
//! - [`network`]: the messages between agents, and their faults.
//! - [`terminal`], [`shell`]: text of unknown origin on a terminal, and commands to paste.
//! - [`ports`]: recorder, transport and clock, each with an in-memory version.

pub mod batch;
pub mod checkpoint;
pub mod column;
pub mod conflict;
pub mod control;
pub mod cycle;
pub mod digest;
pub mod distr;
pub mod engine;
pub mod error;
pub mod geodesy;
pub mod geometry;
pub mod interrupt;
pub mod math;
pub mod network;
pub mod ports;
pub mod run;
pub mod run_config;
pub mod series;
pub mod shell;
pub mod simulation;
pub mod space;
pub mod stream;
pub mod terminal;
pub mod text;
pub mod units;
pub mod view;
#[expect(clippy::disallowed_methods, reason = "the one place that starts threads")]
pub mod workers;
pub mod world;

pub use batch::Batch;
pub use column::AtomicColumn;
pub use digest::Digest;
pub use error::InputError;
pub use interrupt::Interrupt;
pub use run::{Run, RunInputs};
pub use run_config::{GroupSizeHistogram, RunConfig, RunStats};
pub use simulation::Simulation;
pub use units::{Cycle, EntityId, EntitySlot, Seed};
pub use world::{
    CheckpointableWorld, ControllableWorld, PhaseContext, Phases, RecordableWorld, World,
    WorldMetrics, WorldView,
};

/// The example of the README, which is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
