//! Laws of all planners on small random floors, and the classic cases.

mod cbs;
mod dependency_graph;
mod floors;
mod joint_search;
mod lacam;
mod pibt;
mod prioritized;
mod team_planner;
