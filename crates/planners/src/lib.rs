#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

pub mod assignment;
pub mod cbs;
pub mod dependency_graph;
mod descent;
pub mod dispatcher;
mod distances;
mod executor;
mod goal_fields;
mod graph;
mod inheritance;
mod instance;
pub mod lacam;
pub mod lifelong;
pub mod pibt;
mod plan;
pub mod plan_file;
mod pose;
pub mod prioritized;
mod regions;
mod safe_intervals;
mod stepper;
pub mod tasks;
mod team_planner;
#[cfg(test)]
mod tests;
mod tick_planner;

pub use dependency_graph::{DependencyGraph, Permission};
pub use dispatcher::{Courier, Dispatcher, TeamTasks};
pub use executor::{Execution, Executor};
pub use instance::{Agent, Bounds, Instance};
pub use pibt::{Obstructions, Pibt, PibtConfig, PibtState};
pub use plan::{Costs, Plan, PlanError};
pub use pose::{Action, ActionModel, GridPose};
pub use sidestep_kernel::{InputError, Seed};
pub use sidestep_map::planning::FreeSpace;
pub use team_planner::{
    BusyAgent, Method, PlanCounts, TeamPlanner, TeamPlannerConfig, TeamPlannerState, TeamStep,
};
pub use tick_planner::{LifelongAgent, TickPlanner, TickSituation};
