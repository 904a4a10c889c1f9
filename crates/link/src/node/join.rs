//! Joining: a node asks the server until it hears an answer.

use super::NodeError;
use crate::mail::{Heard, Mail};
use crate::wire::Party;
use crate::words::{Join, Welcome, Word};
use std::time::{Duration, Instant};

/// Time after which it asks again.
const AGAIN: Duration = Duration::from_millis(100);

/// The settings of a node that asks.
#[derive(Debug, Clone)]
pub struct Asked {
    /// The question.
    pub join: Join,
    /// Time after which it gives up.
    pub patience: Duration,
}

/// Asks the server whether a node may join, and meets it if so.
///
/// # Errors
/// When it may not, or no answer comes.
pub fn join(mail: &mut Mail, asked: &Asked) -> Result<Welcome, NodeError> {
    let until = Instant::now() + asked.patience;
    while Instant::now() < until {
        mail.note(Party::Server, Word::Join(asked.join.clone()));
        let again = Instant::now() + AGAIN;
        while let Some(heard) = mail.receive(again.saturating_duration_since(Instant::now())) {
            match heard {
                Heard { from: Party::Server, word: Word::Welcome(welcome), life } => {
                    mail.meet(Party::Server, life);
                    return Ok(welcome);
                }
                Heard { from: Party::Server, word: Word::Refused(refusal), .. } => {
                    return Err(NodeError::Refused(refusal));
                }
                _ => {}
            }
        }
    }
    Err(NodeError::Silence(asked.patience.as_secs()))
}
