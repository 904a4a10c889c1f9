//! The wire: frames from one party of a fleet to another, some of which may be lost.
//!
//! Everything that must arrive is numbered, acknowledged and repeated above it (`post.rs`).
//!
//! ```text
//! zenoh.rs   between processes      handshake.rs  why a certificate is not taken
//! memory.rs  between threads        board.rs      a text served by HTTP
//! endpoint.rs notation of endpoints, and ports that are held
//! ```

pub mod endpoint;
mod handshake;
pub mod http_text;
pub mod memory;
pub mod view_server;
pub mod zenoh;

pub use crate::peer::Peer;
use crate::protocol::Member;
pub use endpoint::WireError;
use sidestep::kernel::EntityId;
use std::time::Duration;

/// Carries frames between parties. A frame may be lost without notice.
pub trait Wire: Send {
    /// Sends a frame to other parties, without waiting for them. Further parties may hear it.
    fn send(&mut self, to: &[Peer], frame: &[u8]);

    /// Returns the next frame that has arrived; waits for one at most the given time. `None` when none came.
    fn receive(&mut self, within: Duration) -> Option<Vec<u8>>;

    /// Learns of all nodes of the fleet, and makes the direct links from this one to the others, where there are any.
    ///
    /// # Errors
    /// When an endpoint cannot be taken.
    fn connect_mesh(&mut self, _me: EntityId, _members: &[Member]) -> Result<(), WireError> {
        Ok(())
    }

    /// Asks the other end of a direct link, and returns whether the link seems to be open and all questions have been
    /// left unanswered for some time. Ends answer by themselves, however busy their nodes are.
    fn is_half_open(&mut self, _member: &Member, _within: Duration) -> bool {
        false
    }

    /// Closes the direct links to all other nodes, and opens them again.
    ///
    /// # Errors
    /// When an endpoint cannot be taken again: there are no direct links then, and it can be tried once more.
    fn reopen_links(&mut self) -> Result<(), WireError> {
        Ok(())
    }
}

impl<W: Wire + ?Sized> Wire for Box<W> {
    fn send(&mut self, to: &[Peer], frame: &[u8]) {
        (**self).send(to, frame);
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        (**self).receive(within)
    }

    fn connect_mesh(&mut self, me: EntityId, members: &[Member]) -> Result<(), WireError> {
        (**self).connect_mesh(me, members)
    }

    fn is_half_open(&mut self, member: &Member, within: Duration) -> bool {
        (**self).is_half_open(member, within)
    }

    fn reopen_links(&mut self) -> Result<(), WireError> {
        (**self).reopen_links()
    }
}
