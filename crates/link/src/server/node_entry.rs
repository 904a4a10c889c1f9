//! Seats of a fleet: one for each agent, taken by the node that has joined for it.

use crate::protocol::{Incarnation, Member, Status};
use std::time::Instant;

/// The place of an agent in the fleet.
#[derive(Debug, Default)]
pub struct NodeEntry {
    /// Its node, if one has joined.
    pub member: Option<Member>,
    /// The process of the node.
    pub process: u32,
    /// Whether all other nodes have heard it.
    pub is_ready: bool,
    /// The last status reported by the node.
    pub status: Status,
    /// Whether its node is gone: it has ended, or was not heard for too long.
    pub is_gone: bool,
    /// Whether its node has said that it has nothing more to say.
    pub has_left: bool,
    /// The present cycle's control, once it has come.
    pub control: Option<Vec<u8>>,
    /// Number of its controls that were flown.
    pub flown: u64,
    /// Number of its controls that came too late, or not at all.
    pub late: u64,
    /// Number of its controls that made no sense.
    pub absurd: u64,
    /// Number of nodes that it has had.
    pub lives: u64,
    /// Time at which its node joined.
    pub since: Option<Instant>,
}

impl NodeEntry {
    /// Returns the present life of its node, if it has one that is not gone.
    pub fn incarnation(&self) -> Option<Incarnation> {
        self.member.as_ref().filter(|_| !self.is_gone).map(|member| member.life)
    }

    /// Seats a node in place of any other.
    pub fn assign(&mut self, member: Member, process: u32) {
        let is_new = self.member.as_ref().is_none_or(|known| known.life != member.life);
        if is_new {
            self.lives += 1;
            self.is_ready = false;
            self.since = Some(Instant::now());
        }
        (self.member, self.process, self.is_gone) = (Some(member), process, false);
    }
}
