//! Fleets: in threads, over sockets, and as processes.

mod faults;
mod input;
mod namespaces;
mod processes;
mod support;
mod threads;
mod tls;
