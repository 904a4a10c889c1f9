//! Limits of connections: per peer, so that none can keep out all others, and in total.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Maximum number of connections at a time: 16 pages and what they load beside, below the usual limit of open files.
const MAX_CONNECTIONS: usize = 128;
/// Maximum number of connections of a peer at a time. It does not hold for this machine itself, from which all connections
/// that are forwarded (by `ssh -L`, say) seem to come.
const MAX_CONNECTIONS_PER_PEER: usize = 64;

/// The present connections.
#[derive(Debug, Default)]
pub(crate) struct ConnectionLimiter(Mutex<Connections>);

#[derive(Debug, Default)]
struct Connections {
    /// In the order of their arrival.
    present: BTreeMap<u64, Connection>,
    /// Number of connections that have ever had a permit.
    count: u64,
}

#[derive(Debug)]
struct Connection {
    peer: IpAddr,
    /// Number of requests that are being answered. Without one it is half-open or idle: anybody can have thousands of these
    /// at no cost.
    requests: usize,
    /// Whether it has become a WebSocket.
    is_socket: bool,
    /// Tells the connection that it has lost its permit.
    ending: Arc<Notify>,
}

/// A permit for one connection, released on drop.
#[derive(Debug)]
pub(crate) struct ConnectionPermit {
    limiter: Arc<ConnectionLimiter>,
    number: u64,
    ending: Arc<Notify>,
}

impl ConnectionLimiter {
    fn lock(&self) -> MutexGuard<'_, Connections> {
        // Every change is a single call, so the list is right even if a thread has panicked while it held the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns a permit; `None` if there are too many connections. One that asks for nothing gives way, the oldest first:
    /// who only opens connections keeps nobody out.
    pub(crate) fn acquire(self: &Arc<Self>, peer: IpAddr) -> Option<ConnectionPermit> {
        let peer = peer.to_canonical();
        let mut connections = self.lock();
        let own = connections.present.values().filter(|other| other.peer == peer).count();
        let has_too_many = own >= MAX_CONNECTIONS_PER_PEER && !peer.is_loopback();
        if has_too_many {
            connections.end_oldest_idle(|other| other.peer == peer)?;
        } else if connections.present.len() >= MAX_CONNECTIONS {
            connections.end_oldest_idle(|_| true)?;
        }
        let number = connections.count;
        connections.count += 1;
        let ending = Arc::new(Notify::new());
        let connection = Connection { peer, requests: 0, is_socket: false, ending: ending.clone() };
        connections.present.insert(number, connection);
        Some(ConnectionPermit { limiter: self.clone(), number, ending })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.lock().present.is_empty()
    }
}

impl Connections {
    /// Takes the permit of the oldest connection that asks for nothing; `None` if there is none.
    fn end_oldest_idle(&mut self, may_end: impl Fn(&Connection) -> bool) -> Option<()> {
        let is_idle = |other: &Connection| other.requests == 0 && !other.is_socket;
        let mut idle = self.present.iter().filter(|(_, other)| is_idle(other));
        let (&number, _) = idle.find(|(_, other)| may_end(other))?;
        let ended = self.present.remove(&number)?;
        ended.ending.notify_one();
        Some(())
    }
}

impl ConnectionPermit {
    fn change(&self, change: impl FnOnce(&mut Connection)) {
        if let Some(own) = self.limiter.lock().present.get_mut(&self.number) {
            change(own);
        }
    }

    /// Records that a request has arrived: the connection keeps its permit until it is answered.
    pub(crate) fn begin_request(self: &Arc<Self>) -> RequestInProgress {
        self.change(|own| own.requests += 1);
        RequestInProgress(self.clone())
    }

    /// Records that the connection has become a WebSocket, which keeps its permit for good.
    pub(crate) fn record_socket(&self) {
        self.change(|own| own.is_socket = true);
    }

    /// Waits until the permit is taken away.
    pub(crate) async fn wait_for_loss(&self) {
        self.ending.notified().await;
    }
}

/// A request on a connection; it is answered when this is dropped.
#[derive(Debug)]
pub(crate) struct RequestInProgress(Arc<ConnectionPermit>);

impl Drop for RequestInProgress {
    fn drop(&mut self) {
        self.0.change(|own| own.requests -= 1);
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
        self.limiter.lock().present.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(k: u8) -> IpAddr {
        IpAddr::from([192, 0, 2, k])
    }

    /// Acquires a permit for a connection that asks for something.
    fn ask(limiter: &Arc<ConnectionLimiter>, peer: IpAddr) -> Option<ConnectionPermit> {
        let permit = limiter.acquire(peer)?;
        permit.record_socket();
        Some(permit)
    }

    #[test]
    fn one_peer_leaves_room_for_others_and_places_are_free_again() {
        let limiter = Arc::new(ConnectionLimiter::default());
        let mut places: Vec<ConnectionPermit> =
            (0..MAX_CONNECTIONS_PER_PEER).filter_map(|_| ask(&limiter, peer(1))).collect();
        assert_eq!(places.len(), MAX_CONNECTIONS_PER_PEER);
        assert!(ask(&limiter, peer(1)).is_none());
        assert!(ask(&limiter, IpAddr::from([0, 0, 0, 0, 0, 0xffff, 0xc000, 0x0201])).is_none());
        places.extend((0..MAX_CONNECTIONS).filter_map(|_| ask(&limiter, peer(2))));
        assert_eq!(places.len(), MAX_CONNECTIONS);
        assert!(ask(&limiter, peer(3)).is_none(), "in all");
        places.pop();
        assert!(ask(&limiter, peer(3)).is_some());
        places.clear();
        assert!(limiter.is_empty());
    }

    #[test]
    fn this_machine_may_have_all_as_others_may_stand_behind_it() {
        let limiter = Arc::new(ConnectionLimiter::default());
        let own: Vec<_> = (0..MAX_CONNECTIONS)
            .map_while(|_| ask(&limiter, IpAddr::from([127, 0, 0, 1])))
            .collect();
        assert_eq!(own.len(), MAX_CONNECTIONS);
    }

    #[test]
    fn connections_that_ask_for_nothing_give_way_the_oldest_first_and_to_their_own_peer() {
        let limiter = Arc::new(ConnectionLimiter::default());
        let page = ask(&limiter, peer(1)).expect("a place");
        let silent: Vec<_> = (0..1000).filter_map(|_| limiter.acquire(peer(1))).collect();
        assert_eq!(silent.len(), 1000, "each of them was let in for a while");
        let is_present =
            |permit: &ConnectionPermit| limiter.lock().present.contains_key(&permit.number);
        let present = silent.iter().filter(|permit| is_present(permit)).count();
        assert_eq!(present, MAX_CONNECTIONS_PER_PEER - 1);
        assert!(is_present(&page) && !is_present(&silent[0]) && is_present(&silent[999]));
        assert_eq!(limiter.lock().present.len(), MAX_CONNECTIONS_PER_PEER, "others have theirs");
        drop(silent);
        assert!(!limiter.is_empty());
        drop(page);
        assert!(limiter.is_empty());
    }

    #[test]
    fn a_connection_keeps_its_place_while_it_is_answered_and_gives_way_when_it_is_idle() {
        let limiter = Arc::new(ConnectionLimiter::default());
        let mut places = Vec::new();
        let mut requests = Vec::new();
        for _ in 0..MAX_CONNECTIONS {
            let permit = Arc::new(limiter.acquire(IpAddr::from([127, 0, 0, 1])).expect("a place"));
            requests.push(permit.begin_request());
            places.push(permit);
        }
        assert!(limiter.acquire(peer(1)).is_none(), "all are being answered");
        drop(requests.pop());
        assert!(limiter.acquire(peer(1)).is_some(), "the last one is idle now");
        drop(requests);
        drop(places);
        assert!(limiter.is_empty());
    }
}
