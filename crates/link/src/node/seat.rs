//! The seat of a node in a fleet: whoever joins takes one, and gives it back on every way out.

use crate::messenger::Messenger;
use crate::protocol::Message;
use crate::wire::PeerId;
use std::ops::{Deref, DerefMut};
use std::time::{Duration, Instant};

/// Time in which the server acknowledges that a node leaves: retransmissions have room in it. A process that was asked to
/// end keeps its starter waiting for no longer.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(1);

/// Time between two checks for the acknowledgment.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// The messenger of a node that has joined a fleet.
///
/// Dropped before the fleet's end, by an error or a panic, it tells the server that the node leaves: so the agent's seat
/// is free at once, and not only when the node's lease has ended.
pub struct Seat {
    messenger: Messenger,
    is_given_back: bool,
}

impl Seat {
    /// Returns the seat of a node that has joined by a messenger.
    pub fn new(messenger: Messenger) -> Self {
        Self { messenger, is_given_back: false }
    }

    /// Tells the server that the node leaves, with the reason.
    pub fn leave(&mut self, reason: &str) {
        if std::mem::replace(&mut self.is_given_back, true) {
            return;
        }
        self.messenger.send_reliable(PeerId::Server, Message::Left(reason.into()));
        let until = Instant::now() + LEAVE_TIMEOUT;
        while !self.messenger.has_delivered_to(PeerId::Server) && Instant::now() < until {
            self.messenger.receive(POLL_INTERVAL);
        }
    }

    /// Records that the server knows already that the node leaves.
    pub(super) fn mark_given_back(&mut self) {
        self.is_given_back = true;
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let is_panic = std::thread::panicking();
        let reason =
            if is_panic { "its program has failed" } else { "it has ended before the fleet" };
        self.leave(reason);
    }
}

impl Deref for Seat {
    type Target = Messenger;

    fn deref(&self) -> &Messenger {
        &self.messenger
    }
}

impl DerefMut for Seat {
    fn deref_mut(&mut self) -> &mut Messenger {
        &mut self.messenger
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::memory::MemoryHub;

    /// Returns what a server hears of a node that has joined and does something with its seat.
    fn heard_after(does: impl FnOnce(Seat) + Send + 'static) -> Option<Message> {
        let hub = MemoryHub::default();
        let (a, b) = (PeerId::Server, PeerId::Node(3));
        let mut server = Messenger::new(a, Box::new(hub.open_wire(a)));
        let mut node = Messenger::new(b, Box::new(hub.open_wire(b)));
        node.connect(a, server.incarnation());
        server.connect(b, node.incarnation());
        let node = std::thread::spawn(move || does(Seat::new(node)));
        let heard = server.receive(Duration::from_secs(20));
        server.send_acks();
        let _ = node.join();
        heard.map(|received| received.message)
    }

    #[test]
    fn a_seat_is_given_back_on_every_way_out() {
        for (heard, reason) in [
            (heard_after(drop), "it has ended before the fleet"),
            (heard_after(|mut seat| seat.leave("the disk is full")), "the disk is full"),
            (heard_after(|_seat| panic!("on purpose")), "its program has failed"),
        ] {
            assert_eq!(heard, Some(Message::Left(reason.into())));
        }
    }
}
