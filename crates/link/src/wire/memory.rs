//! A wire between the threads of one process.

use super::{PeerId, Wire};
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A network within one process.
#[derive(Debug, Clone, Default)]
pub struct MemoryHub(Arc<Mutex<BTreeMap<PeerId, Sender<Vec<u8>>>>>);

impl MemoryHub {
    /// Returns the wire of a peer. Frames to the peer go to its newest wire.
    pub fn open_wire(&self, me: PeerId) -> MemoryWire {
        let (sender, arrived) = channel();
        self.lock().insert(me, sender);
        MemoryWire { hub: self.clone(), arrived }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<PeerId, Sender<Vec<u8>>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The connection of one peer to a [`MemoryHub`].
#[derive(Debug)]
pub struct MemoryWire {
    hub: MemoryHub,
    arrived: Receiver<Vec<u8>>,
}

impl Wire for MemoryWire {
    fn send(&mut self, to: &[PeerId], frame: &[u8]) {
        let others = self.hub.lock();
        // A frame to an absent peer is lost, as on any other wire.
        for other in to.iter().filter_map(|peer| others.get(peer)) {
            let _ = other.send(frame.to_vec());
        }
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        self.arrived.recv_timeout(within).ok()
    }
}
