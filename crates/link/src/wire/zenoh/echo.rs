//! Probes of the other end of a link. Its Zenoh session replies in a thread of its own, however busy its node is: a link
//! without replies is half-open.

use super::{PeerId, frame_key, publish_to_key};
use sidestep::kernel::EntityId;
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use zenoh::Session;
use zenoh::key_expr::KeyExpr;
use zenoh::sample::Sample;

/// Attachment of a Zenoh message that is a probe. Frames of messengers have no attachment.
const ECHO_REQUEST: &[u8] = b"question";

/// Attachment of the reply to a probe.
const ECHO_REPLY: &[u8] = b"answer";

/// Time after which an unanswered probe counts for nothing if no further one has followed it: silence is evidence only
/// while the link is being probed.
const PROBE_TIMEOUT: Duration = Duration::from_secs(2);

/// The probes that a node has sent to others over its links, and their replies.
pub(super) struct EchoProbes {
    /// The times of the first and the last probe since the last reply.
    unanswered: BTreeMap<EntityId, (Instant, Instant)>,
    replies: Receiver<EntityId>,
    reply_sender: Sender<EntityId>,
}

impl Default for EchoProbes {
    fn default() -> Self {
        let (reply_sender, replies) = channel();
        Self { unanswered: BTreeMap::new(), replies, reply_sender }
    }
}

impl EchoProbes {
    /// Returns the handler of node `me` for probes and replies. It returns whether a Zenoh message was one of them, and is
    /// called by a thread of the session.
    pub(super) fn handler(
        &self,
        me: EntityId,
        session: Session,
    ) -> impl Fn(&Sample) -> bool + use<> {
        let replies = self.reply_sender.clone();
        move |sample| {
            let Some(mark) = sample.attachment().map(|mark| mark.to_bytes()) else { return false };
            let from =
                <[u8; 4]>::try_from(&*sample.payload().to_bytes()).map(EntityId::from_le_bytes);
            match (&*mark, from) {
                (ECHO_REQUEST, Ok(from)) => send(&session, me, from, ECHO_REPLY),
                // The receiver is gone when the wire is.
                (ECHO_REPLY, Ok(from)) => drop(replies.send(from)),
                // From another build.
                _ => {}
            }
            true
        }
    }

    /// Probes another node, and returns whether it has left all probes unanswered for some time.
    pub(super) fn probe_and_check_timeout(
        &mut self,
        session: &Session,
        me: EntityId,
        of: EntityId,
        within: Duration,
    ) -> bool {
        self.drain_replies();
        let now = Instant::now();
        let (first, last) = self.unanswered.entry(of).or_insert((now, now));
        if now.duration_since(*last) > PROBE_TIMEOUT {
            *first = now;
        }
        *last = now;
        send(session, me, of, ECHO_REQUEST);
        now.duration_since(*first) > within
    }

    /// Forgets all probes, as needed where links are new.
    pub(super) fn clear(&mut self) {
        self.unanswered.clear();
    }

    /// Processes the replies that have arrived. Returns whether no probe is unanswered.
    pub(super) fn drain_replies(&mut self) -> bool {
        for from in self.replies.try_iter() {
            self.unanswered.remove(&from);
        }
        self.unanswered.is_empty()
    }
}

fn send(session: &Session, me: EntityId, to: EntityId, mark: &'static [u8]) {
    let (from, to) = (PeerId::Node(me), PeerId::Node(to));
    let key = KeyExpr::try_from(frame_key(from, to));
    let key = key.expect("a path of letters and digits is a key");
    publish_to_key(session, &key, &me.to_le_bytes(), Some(mark));
}
