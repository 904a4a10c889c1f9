//! Flights of nodes in threads, over a network in memory.
