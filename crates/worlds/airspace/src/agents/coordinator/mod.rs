//! The process integrated mechanism: coordinators whose state migrates, and the hosts that take them in.
//!
//! A coordinator visits the airplanes in turn. While it is on an airplane it can read that airplane's
//! model: a host owns its own model only, and makes predictions with it, which the coordinator then carries along.
//! Its whole state is serialized for every hop, and read and checked on the other side; these are the
//! bytes that are counted. With sampled expectations it makes a tour per round, because each round has new samples;
//! with exact ones it gathers the predictions of all actions in a first tour, and computes the rounds at the host from which
//! it set out. A last tour brings each airplane its control.
//!
//! `pim` has one coordinator for a group. `hierarchical-pim` (the paper's outlook) splits the group by
//! proximity into about as many parts as each has members: a coordinator tours each part, all at the same time, and
//! one above them goes from home to home, gathers their data, and brings back the results of all. The algorithm is
//! the same, and so are the controls.
//!
//! | Module | Contents |
//! |---|---|
//! | `migrating` | a coordinator and a host, as they see each other |
//! | `state`, `itinerary`, `hosted_aircraft` | the coordinator of this world: its data, its tours, and its view of an airplane |
//! | `check` | checks of arriving bytes: every accepted state can be computed with |
//! | `epoch`, `messages`, `replica`, `election`, `host` | the protocol, which knows nothing of airplanes |
//! | `participant` | a host as a participant of a conversation |
//!
//! # The protocol
//!
//! For each coordinator, every host keeps the newest *epoch* that it has accepted, and refuses older ones
//! (`Stale`). An epoch is a number and the host that began it; higher numbers are newer, and among equal ones the
//! lower place. On a network that loses nothing only hops are sent. Else:
//!
//! 1. **A hop** carries the state, the epoch, and the number of the hop in it (`Hop`). It is repeated until it is
//!    acknowledged (`Ack`). The sender no longer runs the coordinator, but has it in its care, and keeps the copy
//!    until it leaves there again: so at least the last two hosts have one. The receiver takes each hop once; copies
//!    on the network are acknowledged and do nothing.
//! 2. **A hop that is never acknowledged** may have arrived all the same. So the sender does not go on as if it had
//!    not, but stands for election, and the new coordinator presumes the host that it could not reach.
//! 3. **Signs of life** are hops, and messages of a host that has it in its care for long (`Alive`). Hosts that have
//!    had no sign for some time, and need it, stand for election, one after the other by place.
//! 4. **An election** (`Elect`, `Vote`): a candidate begins an epoch with a number above all that it has seen.
//!    Others accept it and send their copy if it is newer, unless they have the coordinator in their care or
//!    have had a sign of it, which they send with its age. With a majority of the group (or half of it with the
//!    first of all) the candidate brings the coordinator back from the newest copy, highest epoch first. Without
//!    one it has no coordinator, and no control of one: its airplane decides alone, and under the shield stays on its
//!    orbit wherever one that goes first has not accepted another plan.
//!
//! # Why one rules at any time
//!
//! *(a) No coordinator has a twin in its epoch.* The owner begins an epoch once, because its numbers rise. From then
//! on a token moves: the host that sends hop `k + 1` has taken hop `k` and stops running it in the same step; hop
//! `k + 1` has one receiver, which takes it once. So at most one host runs it.
//!
//! *(b) At most one is accepted by a majority.* A host has accepted one epoch at a time, and accepted epochs
//! never become older. Two majorities have a member in common. So when one epoch is accepted by a majority, no other
//! one is, and a stale coordinator that is still alive somewhere is refused by every host that has seen the newer
//! one.
//!
//! *(c) Only one that was accepted by a majority delivers controls.* In the first epoch it has visited every
//! airplane before it decides, because a hop that fails ends the epoch; later ones are elected.
//!
//! *(d) No host waits forever.* A hop and a candidacy are repeated a number of times. Signs of life age, hearsay too:
//! a dead coordinator cannot be kept alive by two hosts that inform each other about it. A host that finds no majority
//! goes on without; and when time is up the conversation ends for each host by its own clock.
//!
//! `tests/interleavings.rs` searches all orders of events of three real hosts with two faults (a crash, a loss, a
//! copy, a delay beyond all patience) for a state in which (a), (b), (c) or (d) is wrong; `tests/chaos.rs` checks
//! each tick on random networks; `tests/recovery.rs` measures how long it takes.

mod check;
mod election;
mod epoch;
mod host;
mod hosted_aircraft;
mod itinerary;
mod messages;
mod migrating;
mod participant;
mod replica;
mod state;

use migrating::{
    CoordinatorHostConfig, CoordinatorHostContext, CoordinatorHostServices,
    CoordinatorItineraryStep, HostMoment, MigratingCoordinator,
};
pub use participant::CoordinatorHostParticipant;

#[cfg(test)]
mod tests;
