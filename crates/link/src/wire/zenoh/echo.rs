//! Questions to the other end of a link. Its session answers by itself, however busy its node is: a link without
//! answers is deaf.

use super::put;
use sidestep::kernel::EntityId;
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use zenoh::Session;
use zenoh::key_expr::KeyExpr;
use zenoh::sample::Sample;

/// Marks of frames that are no mail.
const ECHO_REQUEST: &[u8] = b"question";
const ECHO_REPLY: &[u8] = b"answer";

/// Time after which a question counts for nothing if none has followed it.
const PROBE_TIMEOUT: Duration = Duration::from_secs(2);

/// The questions that a node has asked of others over its links, and their answers.
pub(super) struct EchoProbes {
    /// The first and the last question since the last answer.
    asked: BTreeMap<EntityId, (Instant, Instant)>,
    answered: Receiver<EntityId>,
    answers: Sender<EntityId>,
}

impl Default for EchoProbes {
    fn default() -> Self {
        let (answers, answered) = channel();
        Self { asked: BTreeMap::new(), answered, answers }
    }
}

impl EchoProbes {
    /// Returns the function of node `me` that answers questions, takes answers, and leaves mail alone; it returns
    /// whether the frame was no mail. It is called by a thread of the session.
    pub(super) fn handler(
        &self,
        me: EntityId,
        session: Session,
    ) -> impl Fn(&Sample) -> bool + use<> {
        let answers = self.answers.clone();
        move |sample| {
            let Some(mark) = sample.attachment().map(|mark| mark.to_bytes()) else { return false };
            let from =
                <[u8; 4]>::try_from(&*sample.payload().to_bytes()).map(EntityId::from_le_bytes);
            match (&*mark, from) {
                (ECHO_REQUEST, Ok(from)) => send(&session, me, from, ECHO_REPLY),
                // The receiver is gone when the wire is.
                (ECHO_REPLY, Ok(from)) => drop(answers.send(from)),
                // From another build.
                _ => {}
            }
            true
        }
    }

    /// Asks another node, and returns whether it has left all questions unanswered for some time.
    pub(super) fn probe(
        &mut self,
        session: &Session,
        me: EntityId,
        of: EntityId,
        within: Duration,
    ) -> bool {
        self.receive_replies();
        let now = Instant::now();
        let (first, last) = self.asked.entry(of).or_insert((now, now));
        if now.duration_since(*last) > PROBE_TIMEOUT {
            *first = now;
        }
        *last = now;
        send(session, me, of, ECHO_REQUEST);
        now.duration_since(*first) > within
    }

    /// Forgets all questions, as needed where links are new.
    pub(super) fn clear(&mut self) {
        self.asked.clear();
    }

    /// Takes the answers that have come. Returns whether no question is open.
    pub(super) fn receive_replies(&mut self) -> bool {
        for from in self.answered.try_iter() {
            self.asked.remove(&from);
        }
        self.asked.is_empty()
    }
}

fn send(session: &Session, me: EntityId, to: EntityId, mark: &'static [u8]) {
    let key = KeyExpr::try_from(super::peer_key(super::Peer::Node(to)));
    let key = key.expect("a path of letters and digits is a key");
    put(session, &key, &me.to_le_bytes(), Some(mark));
}
