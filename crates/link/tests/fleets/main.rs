//! Fleets: in threads, over sockets, and as processes.

mod admission;
mod attack;
mod chains;
mod clocks;
mod cuts;
mod faults;
mod flight_soak;
mod flights;
mod input;
mod multicast;
mod namespaces;
mod output;
mod processes;
mod relay;
mod robot_soak;
mod robots;
mod soak;
mod support;
mod threads;
mod tls;
mod vehicles;
mod without_server;
