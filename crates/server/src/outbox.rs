//! Messages that wait to be sent by one socket: all replies and notifications, but only the newest frame and status of each
//! session.
//!
//! Sessions put them here from their threads and never wait; the socket takes them when it can.

use crate::protocol::{Reply, ServerNotification, SessionId};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Something to send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum OutboxItem {
    /// A reply or a notice, each of which is sent.
    Text(String),
    /// The newest frame of a session.
    Frame(Vec<u8>),
}

/// The outgoing messages of one socket.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    pending: Mutex<PendingMessages>,
    ready: Notify,
}

#[derive(Debug, Default)]
struct PendingMessages {
    texts: VecDeque<String>,
    /// Number of requests that were received and are not answered yet.
    open_requests: usize,
    /// Numbers and bytes of the long ones among them.
    long: Vec<(u32, usize)>,
    newest: BTreeMap<SessionId, LatestUpdate>,
    /// The session that was served last: the next one has its turn first.
    last: SessionId,
}

/// The newest frame and state of one session: an older one that was not sent is of no use to the page.
#[derive(Debug, Default)]
struct LatestUpdate {
    status: Option<String>,
    bodies: Option<String>,
    frame: Option<Vec<u8>>,
}

/// Returns one of our messages as JSON, which cannot fail.
fn to_json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

impl Outbox {
    fn lock(&self) -> MutexGuard<'_, PendingMessages> {
        // It is consistent even if a thread has panicked while it held the lock.
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records that a request was received; each needs one reply.
    pub(crate) fn add_open_request(&self) {
        self.lock().open_requests += 1;
    }

    /// Returns the number of requests without a reply, and of replies that were not sent yet.
    pub(crate) fn backlog(&self) -> usize {
        let pending = self.lock();
        pending.open_requests + pending.texts.len()
    }

    /// Records that the request just received is a long one.
    pub(crate) fn record_large_request(&self, id: u32, bytes: usize) {
        self.lock().long.push((id, bytes));
    }

    /// Returns the bytes of all long requests without a reply.
    pub(crate) fn pending_large_request_bytes(&self) -> usize {
        self.lock().long.iter().map(|(_, bytes)| bytes).sum()
    }

    /// Sends a reply; its request counts as answered at once, and the reply is in the backlog until the socket takes
    /// it.
    pub(crate) fn send_reply(&self, reply: &Reply) {
        let text = to_json(reply);
        let mut pending = self.lock();
        pending.open_requests = pending.open_requests.saturating_sub(1);
        if let Some(at) = pending.long.iter().position(|(id, _)| *id == reply.id) {
            pending.long.swap_remove(at);
        }
        pending.texts.push_back(text);
        drop(pending);
        self.ready.notify_one();
    }

    /// Sends a notice; all of them go out, in their order.
    pub(crate) fn send_notification(&self, notice: &ServerNotification) {
        let text = to_json(notice);
        self.lock().texts.push_back(text);
        self.ready.notify_one();
    }

    /// Sends the state of a session, unless a newer one comes before it has been sent.
    pub(crate) fn send_status(&self, session: SessionId, status: &ServerNotification) {
        let text = to_json(status);
        self.lock().newest.entry(session).or_default().status = Some(text);
        self.ready.notify_one();
    }

    /// Sends a frame, and the body table that it begins, unless a newer one comes before it has been sent. Returns whether
    /// it replaces one that was not sent.
    pub(crate) fn send_frame(
        &self,
        session: SessionId,
        bodies: Option<&ServerNotification>,
        frame: Vec<u8>,
    ) -> bool {
        let bodies = bodies.map(to_json);
        let mut pending = self.lock();
        let newest = pending.newest.entry(session).or_default();
        if bodies.is_some() {
            newest.bodies = bodies;
        }
        let replaces = newest.frame.replace(frame).is_some();
        drop(pending);
        self.ready.notify_one();
        replaces
    }

    /// Removes the frame and the status of a session that were not sent; returns whether there was a frame.
    pub(crate) fn discard_update(&self, session: SessionId) -> bool {
        let newest = self.lock().newest.remove(&session);
        newest.is_some_and(|newest| newest.frame.is_some())
    }

    /// Returns the next message to send: replies and notifications first, because the user waits for them, then those of the
    /// sessions in turn.
    pub(crate) fn pop(&self) -> Option<OutboxItem> {
        let mut pending = self.lock();
        if let Some(text) = pending.texts.pop_front() {
            return Some(OutboxItem::Text(text));
        }
        let last = pending.last;
        let all = pending.newest.range(last + 1..).chain(pending.newest.range(..=last));
        let session = all.map(|(&session, _)| session).next()?;
        let newest = pending.newest.get_mut(&session)?;
        let text = newest.status.take().or_else(|| newest.bodies.take()).map(OutboxItem::Text);
        let item = text.or_else(|| newest.frame.take().map(OutboxItem::Frame));
        if newest.status.is_none() && newest.bodies.is_none() && newest.frame.is_none() {
            pending.newest.remove(&session);
            pending.last = session;
        }
        item
    }

    /// Waits until there may be something to send.
    pub(crate) async fn wait_until_ready(&self) {
        self.ready.notified().await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{ReplyBody, ReplyResult};

    fn reply(id: u32) -> Reply {
        Reply { id, result: ReplyResult::Answer(ReplyBody::Done) }
    }

    fn notice(text: &str) -> ServerNotification {
        let (program, worlds, open) = (text.to_string(), Vec::new(), Vec::new());
        ServerNotification::Hello { version: 1, program, worlds, read_only: false, open }
    }

    fn all(outbox: &Outbox) -> Vec<String> {
        let name = |item| match item {
            OutboxItem::Frame(bytes) => format!("frame {}", bytes[0]),
            OutboxItem::Text(text) if text.contains("\"id\"") => "reply".to_string(),
            OutboxItem::Text(text) => text.split('"').nth(9).expect("a program").to_string(),
        };
        std::iter::from_fn(|| outbox.pop()).map(name).collect()
    }

    #[test]
    fn replies_go_first_and_of_frames_and_states_the_newest_alone() {
        let outbox = Outbox::default();
        assert!(!outbox.send_frame(1, Some(&notice("table 1")), vec![1]));
        assert!(outbox.send_frame(1, None, vec![2]));
        outbox.send_status(1, &notice("old"));
        outbox.send_status(1, &notice("new"));
        outbox.add_open_request();
        assert_eq!(outbox.backlog(), 1);
        outbox.send_reply(&reply(1));
        assert_eq!(outbox.backlog(), 1);
        assert_eq!(all(&outbox), ["reply", "new", "table 1", "frame 2"]);
        assert_eq!(outbox.backlog(), 0);
    }

    #[test]
    fn sessions_have_their_turns() {
        let outbox = Outbox::default();
        assert!([3, 1, 2].into_iter().all(|k| !outbox.send_frame(k, None, vec![k as u8])));
        assert_eq!(outbox.pop(), Some(OutboxItem::Frame(vec![1])));
        outbox.send_frame(1, None, vec![9]);
        assert_eq!(all(&outbox), ["frame 2", "frame 3", "frame 9"]);
    }

    #[test]
    fn what_was_taken_back_is_not_sent() {
        let outbox = Outbox::default();
        outbox.send_frame(1, None, vec![1]);
        assert!(outbox.discard_update(1) && !outbox.discard_update(1));
        assert_eq!(outbox.pop(), None);
    }
}
