//! The wire: frames from one party of a fleet to another, of which some may be lost.
//!
//! Everything that must arrive is numbered, acknowledged and repeated above it (`post.rs`).
//!
//! ```text
//! zenoh.rs   between processes      handshake.rs  whose certificate is not taken, and why
//! memory.rs  between threads        board.rs      a text for whoever asks, by HTTP
//! endpoint.rs how endpoints are written, and ports that are held
//! ```

pub mod board;
pub mod endpoint;
mod handshake;
pub mod memory;
pub mod window;
pub mod zenoh;

pub use crate::party::Party;
use crate::words::Member;
pub use endpoint::WireError;
use sidestep::kernel::EntityId;
use std::time::Duration;

/// Carries frames between parties. A frame may be lost, and nobody is told.
pub trait Wire: Send {
    /// Sends a frame to other parties, without waiting for them. More may hear it than those.
    fn send(&mut self, to: &[Party], frame: &[u8]);

    /// Returns the next frame that has arrived; waits for one as long as is said. `None` when none came.
    fn receive(&mut self, within: Duration) -> Option<Vec<u8>>;

    /// Learns of all nodes of the fleet, and makes the straight ways from this one to the others, where there are any.
    ///
    /// # Errors
    /// When an endpoint cannot be had.
    fn join(&mut self, _me: EntityId, _members: &[Member]) -> Result<(), WireError> {
        Ok(())
    }

    /// Asks the other end of a straight way, and returns whether the way seems to be open and all questions have been left
    /// unanswered for some time. Ends answer by themselves, however busy their nodes are.
    fn is_deaf_to(&mut self, _member: &Member, _within: Duration) -> bool {
        false
    }

    /// Closes the straight ways to all other nodes, and opens them anew.
    ///
    /// # Errors
    /// When an endpoint cannot be had again: there are no straight ways then, and it can be tried once more.
    fn reopen(&mut self) -> Result<(), WireError> {
        Ok(())
    }
}

impl<W: Wire + ?Sized> Wire for Box<W> {
    fn send(&mut self, to: &[Party], frame: &[u8]) {
        (**self).send(to, frame);
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        (**self).receive(within)
    }

    fn join(&mut self, me: EntityId, members: &[Member]) -> Result<(), WireError> {
        (**self).join(me, members)
    }

    fn is_deaf_to(&mut self, member: &Member, within: Duration) -> bool {
        (**self).is_deaf_to(member, within)
    }

    fn reopen(&mut self) -> Result<(), WireError> {
        (**self).reopen()
    }
}
