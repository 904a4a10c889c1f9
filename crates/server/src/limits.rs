//! Limits of connections: per peer, so that none can keep out all others, and in total.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maximum number of connections at a time: 16 pages and what they load beside, below the usual limit of open files.
const MAX_CONNECTIONS: usize = 128;
/// Maximum number of connections of a peer at a time. It does not hold for this machine itself, from which all connections
/// that are forwarded (by `ssh -L`, say) seem to come.
const MAX_CONNECTIONS_PER_PEER: usize = 64;

/// The present connections, by peer.
#[derive(Debug, Default)]
pub(crate) struct ConnectionLimiter(Mutex<BTreeMap<IpAddr, usize>>);

/// A permit for one connection, released on drop.
#[derive(Debug)]
pub(crate) struct ConnectionPermit {
    limiter: Arc<ConnectionLimiter>,
    peer: IpAddr,
}

impl ConnectionLimiter {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<IpAddr, usize>> {
        // The counts are consistent even if a thread has panicked while it held the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns a permit; `None` if there are too many connections.
    pub(crate) fn acquire(self: &Arc<Self>, peer: IpAddr) -> Option<ConnectionPermit> {
        let peer = peer.to_canonical();
        let mut by_peer = self.lock();
        let all: usize = by_peer.values().sum();
        let own = by_peer.get(&peer).copied().unwrap_or(0);
        if all >= MAX_CONNECTIONS || (own >= MAX_CONNECTIONS_PER_PEER && !peer.is_loopback()) {
            return None;
        }
        by_peer.insert(peer, own + 1);
        Some(ConnectionPermit { limiter: self.clone(), peer })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.lock().is_empty()
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
        let mut by_peer = self.limiter.lock();
        match by_peer.get_mut(&self.peer) {
            Some(count) if *count > 1 => *count -= 1,
            _ => drop(by_peer.remove(&self.peer)),
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
        let limiter = Arc::new(ConnectionLimiter::default());
        let mut places: Vec<ConnectionPermit> =
            (0..MAX_CONNECTIONS_PER_PEER).filter_map(|_| limiter.acquire(peer(1))).collect();
        assert_eq!(places.len(), MAX_CONNECTIONS_PER_PEER);
        assert!(limiter.acquire(peer(1)).is_none());
        assert!(limiter.acquire(IpAddr::from([0, 0, 0, 0, 0, 0xffff, 0xc000, 0x0201])).is_none());
        places.extend((0..MAX_CONNECTIONS).filter_map(|_| limiter.acquire(peer(2))));
        assert_eq!(places.len(), MAX_CONNECTIONS);
        assert!(limiter.acquire(peer(3)).is_none(), "in all");
        places.pop();
        assert!(limiter.acquire(peer(3)).is_some());
        places.clear();
        assert!(limiter.is_empty());
    }

    #[test]
    fn this_machine_may_have_all_as_others_may_stand_behind_it() {
        let limiter = Arc::new(ConnectionLimiter::default());
        let own: Vec<_> = (0..MAX_CONNECTIONS)
            .map_while(|_| limiter.acquire(IpAddr::from([127, 0, 0, 1])))
            .collect();
        assert_eq!(own.len(), MAX_CONNECTIONS);
    }
}
