//! The limits of connections: for one peer, so that it cannot keep out all others, and in total.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The largest number of connections at a time.
const MAX_CONNECTIONS: usize = 128;
/// The largest number of connections of a peer at a time. All forwarded connections come from this machine itself.
const MAX_CONNECTIONS_PER_PEER: usize = 64;

/// The present connections, by peer.
#[derive(Debug, Default)]
pub(crate) struct ConnectionLimiter(Mutex<BTreeMap<IpAddr, usize>>);

/// The place of a connection; it is free again when this is dropped.
#[derive(Debug)]
pub(crate) struct ConnectionPermit {
    doors: Arc<ConnectionLimiter>,
    peer: IpAddr,
}

impl ConnectionLimiter {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<IpAddr, usize>> {
        // The numbers are right after every step.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the place of a connection; `None` if there are too many.
    pub(crate) fn acquire(self: &Arc<Self>, peer: IpAddr) -> Option<ConnectionPermit> {
        let peer = peer.to_canonical();
        let mut inside = self.lock();
        let (all, own) = (inside.values().sum::<usize>(), inside.get(&peer).copied().unwrap_or(0));
        if all >= MAX_CONNECTIONS || (own >= MAX_CONNECTIONS_PER_PEER && !peer.is_loopback()) {
            return None;
        }
        inside.insert(peer, own + 1);
        Some(ConnectionPermit { doors: self.clone(), peer })
    }

    /// Returns whether there is no connection.
    pub(crate) fn is_empty(&self) -> bool {
        self.lock().is_empty()
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
        let mut inside = self.doors.lock();
        match inside.get_mut(&self.peer) {
            Some(number) if *number > 1 => *number -= 1,
            _ => drop(inside.remove(&self.peer)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(k: u8) -> IpAddr {
        IpAddr::from([192, 0, 2, k])
    }

    #[test]
    fn one_peer_leaves_room_for_others_and_places_are_free_again() {
        let doors = Arc::new(ConnectionLimiter::default());
        let mut places: Vec<ConnectionPermit> =
            (0..MAX_CONNECTIONS_PER_PEER).filter_map(|_| doors.acquire(peer(1))).collect();
        assert_eq!(places.len(), MAX_CONNECTIONS_PER_PEER);
        assert!(doors.acquire(peer(1)).is_none());
        assert!(doors.acquire(IpAddr::from([0, 0, 0, 0, 0, 0xffff, 0xc000, 0x0201])).is_none());
        places.extend((0..MAX_CONNECTIONS).filter_map(|_| doors.acquire(peer(2))));
        assert_eq!(places.len(), MAX_CONNECTIONS);
        assert!(doors.acquire(peer(3)).is_none(), "in all");
        places.pop();
        assert!(doors.acquire(peer(3)).is_some());
        places.clear();
        assert!(doors.is_empty());
    }

    #[test]
    fn this_machine_may_have_all_as_others_may_stand_behind_it() {
        let doors = Arc::new(ConnectionLimiter::default());
        let own: Vec<_> = (0..MAX_CONNECTIONS)
            .map_while(|_| doors.acquire(IpAddr::from([127, 0, 0, 1])))
            .collect();
        assert_eq!(own.len(), MAX_CONNECTIONS);
    }
}
