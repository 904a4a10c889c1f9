//! Messages that wait to be sent to one socket: all texts, but only the newest frames and states.
//!
//! Sessions put things here from their threads and never wait; the socket takes them when it can.

use crate::protocol::{Notice, Reply, SessionId};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Something to send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Mail {
    /// A reply or a notice.
    Text(String),
    /// A frame.
    Frame(Vec<u8>),
}

/// The mail of one socket.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    waiting: Mutex<Waiting>,
    ready: Notify,
}

#[derive(Debug, Default)]
struct Waiting {
    texts: VecDeque<String>,
    /// Number of requests that were taken in and are not answered yet.
    open_requests: usize,
    /// Numbers and bytes of the long ones among them.
    long: Vec<(u32, usize)>,
    newest: BTreeMap<SessionId, Newest>,
    /// The session that was served last, so that all have their turn.
    last: SessionId,
}

/// The newest frame and state of one session.
#[derive(Debug, Default)]
struct Newest {
    status: Option<String>,
    cast: Option<String>,
    frame: Option<Vec<u8>>,
}

/// Returns one of our messages as JSON, which cannot fail.
fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

impl Outbox {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        // The mail is consistent after every step, even if a thread panicked between two of them.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes that a request was taken in; each needs one reply.
    pub(crate) fn expect_reply(&self) {
        self.waiting().open_requests += 1;
    }

    /// Returns the number of requests without a reply, and of replies that were not sent yet.
    pub(crate) fn backlog(&self) -> usize {
        let waiting = self.waiting();
        waiting.open_requests + waiting.texts.len()
    }

    /// Notes that the request just taken in is a long one.
    pub(crate) fn note_long(&self, id: u32, bytes: usize) {
        self.waiting().long.push((id, bytes));
    }

    /// Returns the bytes of all long requests without a reply.
    pub(crate) fn long_bytes(&self) -> usize {
        self.waiting().long.iter().map(|(_, bytes)| bytes).sum()
    }

    /// Sends a reply.
    pub(crate) fn reply(&self, reply: &Reply) {
        let text = json(reply);
        let mut waiting = self.waiting();
        waiting.open_requests = waiting.open_requests.saturating_sub(1);
        if let Some(at) = waiting.long.iter().position(|(id, _)| *id == reply.id) {
            waiting.long.swap_remove(at);
        }
        waiting.texts.push_back(text);
        drop(waiting);
        self.ready.notify_one();
    }

    /// Sends a notice; all of them go out, in their order.
    pub(crate) fn notice(&self, notice: &Notice) {
        let text = json(notice);
        self.waiting().texts.push_back(text);
        self.ready.notify_one();
    }

    /// Sends the state of a session, unless a newer one comes before it has been sent.
    pub(crate) fn status(&self, session: SessionId, status: &Notice) {
        let text = json(status);
        self.waiting().newest.entry(session).or_default().status = Some(text);
        self.ready.notify_one();
    }

    /// Sends a frame, and the cast that it begins, unless a newer one comes before it has been sent. Returns whether
    /// it replaces one that was not sent.
    pub(crate) fn frame(&self, session: SessionId, cast: Option<&Notice>, frame: Vec<u8>) -> bool {
        let cast = cast.map(json);
        let mut waiting = self.waiting();
        let newest = waiting.newest.entry(session).or_default();
        if cast.is_some() {
            newest.cast = cast;
        }
        let replaces = newest.frame.replace(frame).is_some();
        drop(waiting);
        self.ready.notify_one();
        replaces
    }

    /// Takes back the frame and the state of a session that were not sent; returns whether there was a frame.
    pub(crate) fn clear(&self, session: SessionId) -> bool {
        let newest = self.waiting().newest.remove(&session);
        newest.is_some_and(|newest| newest.frame.is_some())
    }

    /// Returns the next message to send: texts first, then the mail of the sessions in turn.
    pub(crate) fn next(&self) -> Option<Mail> {
        let mut waiting = self.waiting();
        if let Some(text) = waiting.texts.pop_front() {
            return Some(Mail::Text(text));
        }
        let last = waiting.last;
        let all = waiting.newest.range(last + 1..).chain(waiting.newest.range(..=last));
        let session = all.map(|(&session, _)| session).next()?;
        let newest = waiting.newest.get_mut(&session)?;
        let text = newest.status.take().or_else(|| newest.cast.take()).map(Mail::Text);
        let mail = text.or_else(|| newest.frame.take().map(Mail::Frame));
        if newest.status.is_none() && newest.cast.is_none() && newest.frame.is_none() {
            waiting.newest.remove(&session);
            waiting.last = session;
        }
        mail
    }

    /// Waits until there may be something to send.
    pub(crate) async fn ready(&self) {
        self.ready.notified().await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{Answer, Outcome};

    fn reply(id: u32) -> Reply {
        Reply { id, result: Outcome::Answer(Answer::Done) }
    }

    fn notice(text: &str) -> Notice {
        let (program, worlds, open) = (text.to_string(), Vec::new(), Vec::new());
        Notice::Hello { version: 1, program, worlds, read_only: false, open }
    }

    fn all(outbox: &Outbox) -> Vec<String> {
        let name = |mail| match mail {
            Mail::Frame(bytes) => format!("frame {}", bytes[0]),
            Mail::Text(text) if text.contains("\"id\"") => "reply".to_string(),
            Mail::Text(text) => text.split('"').nth(9).expect("a program").to_string(),
        };
        std::iter::from_fn(|| outbox.next()).map(name).collect()
    }

    #[test]
    fn replies_go_first_and_of_frames_and_states_the_newest_alone() {
        let outbox = Outbox::default();
        assert!(!outbox.frame(1, Some(&notice("cast 1")), vec![1]));
        assert!(outbox.frame(1, None, vec![2]));
        outbox.status(1, &notice("old"));
        outbox.status(1, &notice("new"));
        outbox.expect_reply();
        assert_eq!(outbox.backlog(), 1);
        outbox.reply(&reply(1));
        assert_eq!(outbox.backlog(), 1);
        assert_eq!(all(&outbox), ["reply", "new", "cast 1", "frame 2"]);
        assert_eq!(outbox.backlog(), 0);
    }

    #[test]
    fn sessions_have_their_turns() {
        let outbox = Outbox::default();
        assert!([3, 1, 2].into_iter().all(|k| !outbox.frame(k, None, vec![k as u8])));
        assert_eq!(outbox.next(), Some(Mail::Frame(vec![1])));
        outbox.frame(1, None, vec![9]);
        assert_eq!(all(&outbox), ["frame 2", "frame 3", "frame 9"]);
    }

    #[test]
    fn what_was_taken_back_is_not_sent() {
        let outbox = Outbox::default();
        outbox.frame(1, None, vec![1]);
        assert!(outbox.clear(1) && !outbox.clear(1));
        assert_eq!(outbox.next(), None);
    }
}
