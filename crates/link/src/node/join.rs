//! Joining: a node asks the server until it gets an answer.

use super::NodeError;
use crate::messenger::{Messenger, ReceivedMessage};
use crate::protocol::{JoinRequest, Message, Welcome};
use crate::wire::PeerId;
use std::time::{Duration, Instant};

/// Time after which it asks again: the request or the answer to it may be lost.
const JOIN_RETRY_DELAY: Duration = Duration::from_millis(100);

/// The settings of a node that asks to join.
#[derive(Debug, Clone)]
pub struct JoinConfig {
    /// The request, the same each time that it is sent.
    pub join: JoinRequest,
    /// Time after which it gives up.
    pub timeout: Duration,
}

/// Asks the server whether a node may join, and connects with it if so.
///
/// # Errors
/// When it may not, or no answer arrives.
pub fn join(messenger: &mut Messenger, config: &JoinConfig) -> Result<Welcome, NodeError> {
    let until = Instant::now() + config.timeout;
    while Instant::now() < until {
        messenger.send_best_effort(PeerId::Server, Message::Join(config.join.clone()));
        let retry_at = Instant::now() + JOIN_RETRY_DELAY;
        while let Some(received) =
            messenger.receive(retry_at.saturating_duration_since(Instant::now()))
        {
            match received {
                ReceivedMessage {
                    from: PeerId::Server,
                    message: Message::Welcome(welcome),
                    incarnation,
                } => {
                    messenger.connect(PeerId::Server, incarnation);
                    return Ok(welcome);
                }
                ReceivedMessage {
                    from: PeerId::Server, message: Message::Refused(error), ..
                } => {
                    return Err(NodeError::Refused(error));
                }
                // A heartbeat to an earlier process of this agent, for instance.
                _ => {}
            }
        }
    }
    // The server may have let it join, and its answers are lost.
    let reason = "it has given up: no answer has arrived".to_string();
    messenger.send_best_effort(PeerId::Server, Message::Left(reason));
    Err(NodeError::ServerSilent(config.timeout.as_secs()))
}
