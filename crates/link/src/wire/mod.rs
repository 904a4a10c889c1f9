//! The wire: frames from one peer of a fleet to another, some of which may be lost.
//!
//! Everything that must arrive is numbered, acknowledged and retransmitted above it (`arq.rs`).
//!
//! ```text
//! zenoh.rs        between processes, with zenoh/echo.rs: probes of half-open links
//! multicast.rs    between nodes by UDP multicast
//! memory.rs       between threads
//! access.rs       who may publish and subscribe what, by certificates
//! endpoint.rs     notation of endpoints, and reserved ports
//! handshake.rs    the reason why a certificate is rejected; link_log.rs: what Zenoh says of encrypted links
//! view_server.rs  views of a fleet for its viewers, by query and reply
//! http_text.rs    a text served by HTTP
//! ```

pub mod access;
pub mod endpoint;
mod handshake;
pub mod http_text;
pub mod link_log;
pub mod memory;
mod multicast;
pub mod view_server;
pub mod zenoh;

pub use crate::peer::PeerId;
use crate::protocol::FleetMember;
pub use endpoint::WireSetupError;
pub use multicast::draw_group;
use sidestep::kernel::EntityId;
use std::net::SocketAddrV4;
use std::time::Duration;

/// A carrier of frames between peers. A frame may be lost without notice.
pub trait Wire: Send {
    /// Sends a frame to other peers, without waiting for them. Further peers may receive it, too.
    fn send(&mut self, to: &[PeerId], frame: &[u8]);

    /// Returns the next frame that has arrived; waits for one at most the given time. `None` when none arrives.
    fn receive(&mut self, within: Duration) -> Option<Vec<u8>>;

    /// Takes the number of frames that were not received because their sender is not who they say.
    fn take_forged(&mut self) -> u64 {
        0
    }

    /// Makes frames to other nodes go by a multicast group from now on.
    ///
    /// # Errors
    /// When this machine cannot take part in it.
    fn join_multicast(&mut self, _group: SocketAddrV4) -> Result<(), WireSetupError> {
        Ok(())
    }

    /// Learns of all nodes of the fleet, and opens the direct links from this one to the others, where there are any.
    ///
    /// # Errors
    /// When an endpoint cannot be bound.
    fn connect_mesh(
        &mut self,
        _me: EntityId,
        _members: &[FleetMember],
    ) -> Result<(), WireSetupError> {
        Ok(())
    }

    /// Probes a direct link, and returns whether it is half-open: it seems to be open, and its other end has answered no
    /// probe for some time. The ends answer by themselves, however busy their nodes are.
    fn is_half_open(&mut self, _member: &FleetMember, _within: Duration) -> bool {
        false
    }

    /// Closes the direct links to all other nodes, without waiting for that, and opens them again.
    ///
    /// # Errors
    /// When an endpoint cannot be bound yet, usually because the former links are still being closed: there are no direct
    /// links then, and the call is to be repeated.
    fn reopen_links(&mut self) -> Result<(), WireSetupError> {
        Ok(())
    }
}

impl<W: Wire + ?Sized> Wire for Box<W> {
    fn take_forged(&mut self) -> u64 {
        (**self).take_forged()
    }

    fn send(&mut self, to: &[PeerId], frame: &[u8]) {
        (**self).send(to, frame);
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        (**self).receive(within)
    }

    fn join_multicast(&mut self, group: SocketAddrV4) -> Result<(), WireSetupError> {
        (**self).join_multicast(group)
    }

    fn connect_mesh(
        &mut self,
        me: EntityId,
        members: &[FleetMember],
    ) -> Result<(), WireSetupError> {
        (**self).connect_mesh(me, members)
    }

    fn is_half_open(&mut self, member: &FleetMember, within: Duration) -> bool {
        (**self).is_half_open(member, within)
    }

    fn reopen_links(&mut self) -> Result<(), WireSetupError> {
        (**self).reopen_links()
    }
}
