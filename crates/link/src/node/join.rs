//! Joining: a node asks the server until it hears an answer.

use super::NodeError;
use crate::messenger::{Messenger, Received};
use crate::protocol::{Join, Message, Welcome};
use crate::wire::Peer;
use std::time::{Duration, Instant};

/// Time after which it asks again.
const JOIN_RETRY_DELAY: Duration = Duration::from_millis(100);

/// The settings of a node that asks.
#[derive(Debug, Clone)]
pub struct JoinConfig {
    /// The question.
    pub join: Join,
    /// Time after which it gives up.
    pub timeout: Duration,
}

/// Asks the server whether a node may join, and meets it if so.
///
/// # Errors
/// When it may not, or no answer comes.
pub fn join(mail: &mut Messenger, asked: &JoinConfig) -> Result<Welcome, NodeError> {
    let until = Instant::now() + asked.timeout;
    while Instant::now() < until {
        mail.send_best_effort(Peer::Server, Message::Join(asked.join.clone()));
        let again = Instant::now() + JOIN_RETRY_DELAY;
        while let Some(heard) = mail.receive(again.saturating_duration_since(Instant::now())) {
            match heard {
                Received { from: Peer::Server, word: Message::Welcome(welcome), life } => {
                    mail.connect(Peer::Server, life);
                    return Ok(welcome);
                }
                Received { from: Peer::Server, word: Message::Refused(refusal), .. } => {
                    return Err(NodeError::Refused(refusal));
                }
                _ => {}
            }
        }
    }
    Err(NodeError::Silence(asked.timeout.as_secs()))
}
