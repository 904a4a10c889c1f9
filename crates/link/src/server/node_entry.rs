//! What the server knows of the node of an agent.

use crate::protocol::{FleetMember, Incarnation, NodeStatusReport};

/// The entry of an agent in the server's list of nodes.
#[derive(Debug, Default)]
pub struct NodeEntry {
    /// Its node, if one has joined.
    pub member: Option<FleetMember>,
    /// The process id of the node on its machine; 0 before any has joined.
    pub process: u32,
    /// Whether all other nodes have acknowledged the node's `Hello`.
    pub is_ready: bool,
    /// The last status reported by the node.
    pub status: NodeStatusReport,
    /// Whether the node is lost: it has ended, or was not heard for too long.
    pub is_lost: bool,
    /// Whether a lost node takes its place again as soon as it is heard: it has not ended, as far as is known.
    pub may_return: bool,
    /// Whether the node has said goodbye.
    pub has_left: bool,
    /// The present cycle's control, once it has arrived.
    pub control: Option<Vec<u8>>,
    /// Number of its controls that were carried out.
    pub carried_out: u64,
    /// Number of its controls that came too late, or not at all.
    pub late: u64,
    /// Number of its controls that could not be read or carried out.
    pub invalid: u64,
    /// Number of nodes that have joined for the agent, one after the other.
    pub joins: u64,
}

impl NodeEntry {
    /// Returns the present incarnation of the node, if one has joined and is not lost.
    pub fn incarnation(&self) -> Option<Incarnation> {
        let member = self.member.as_ref()?;
        (!self.is_lost).then_some(member.incarnation)
    }

    /// Records that a node has joined, in place of any other. The same node may join more than once, because its first
    /// answer may be lost.
    pub fn record_join(&mut self, member: FleetMember, process: u32) {
        let is_new =
            self.member.as_ref().is_none_or(|known| known.incarnation != member.incarnation);
        // A new process has received no `Hello` yet. One that only repeats its request stays as ready as it was.
        if is_new {
            self.joins += 1;
            self.has_left = false;
            self.is_ready = false;
        }
        self.member = Some(member);
        self.process = process;
        self.is_lost = false;
        self.may_return = false;
    }
}
