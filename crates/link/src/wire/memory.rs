//! A wire between the threads of one process.

use super::{Party, Wire};
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The place where parties of one process meet.
#[derive(Debug, Clone, Default)]
pub struct Exchange(Arc<Mutex<BTreeMap<Party, Sender<Vec<u8>>>>>);

impl Exchange {
    /// Returns the wire of a party. Frames to it go to the wire that was asked for last.
    pub fn wire(&self, me: Party) -> MemoryWire {
        let (sender, arrived) = channel();
        self.lock().insert(me, sender);
        MemoryWire { exchange: self.clone(), arrived }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<Party, Sender<Vec<u8>>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The end of an [`Exchange`] at one party.
#[derive(Debug)]
pub struct MemoryWire {
    exchange: Exchange,
    arrived: Receiver<Vec<u8>>,
}

impl Wire for MemoryWire {
    fn send(&mut self, to: &[Party], frame: &[u8]) {
        let others = self.exchange.lock();
        // A frame to an absent party is lost, as on any other wire.
        for other in to.iter().filter_map(|party| others.get(party)) {
            let _ = other.send(frame.to_vec());
        }
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        self.arrived.recv_timeout(within).ok()
    }
}
